// SPDX-License-Identifier: Apache-2.0
// The papers reproduced: every table, figure and stated bound, the printed value beside ours, and a
// verdict. `ours` is always computed, by what users have; a claim holds what is printed and what an
// independent derivation (docs/spec/) says must come out, and is never looked at by the
// computation.
#pragma once
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/report/page.hpp"
#include "loxo/text/json.hpp"

namespace loxo::papers {

// What the computations are made of, so that a test can change one of it and see rows fail. Users
// never do.
struct Model {
  double earth_radius = 1;  // factor on every semi-major axis
  double earth_rate = 1;    // factor on the rotation rate
  double gravity = 1;       // factor on the sphere's constant gravity
  double angle_sign = 1;    // -1: the mounting angle enters the tracks with the wrong sign
  double gyro_drift = 1;    // factor on every gyro drift of the scenarios

  Ellipsoid of(const Ellipsoid& ell) const;
};

struct Options {
  bool full = false;       // the longer studies: 400 runs a route, more draws
  bool brief = false;      // for tests: shorter drives, fewer seeds, no ideal sensors near the pole
  int threads = 0;         // 0: as many as there are; the results do not depend on it
  int runs = 0;            // Monte Carlo runs a route; 0: 100, with `full` 400
  std::uint64_t seed = 1;  // of every random number
  Model model;
  // 0 to 1, of this paper; may be called by several threads at once.
  std::function<void(double)> progress{};
};

// Special values of Claim.
inline constexpr double kNotPrinted = std::numeric_limits<double>::quiet_NaN();
enum class Kind {
  kValue,    // printed with so many digits: |ours - printed| <= tolerance
  kAtMost,   // a bound: |ours| <= printed
  kAtLeast,  // a bound: ours >= printed
  kFigure,   // shown in a figure, said in words, or not in the paper at all: no number to compare
};
struct Claim {
  const char* id;
  const char* quantity;  // with its unit
  Kind kind;
  double printed, tolerance;
  // By a derivation and program of its own; ours must agree in any case.
  double expected, expected_tolerance;
  bool expected_is_bound;  // |ours| <= expected, instead
  const char* erratum;     // why the printed value is in error, an id of errata(), or ""
  const char* note;
};

enum class Verdict { kReproduced, kCorrected, kFailed };
std::string_view verdict_name(Verdict v);
struct Check {
  Claim claim;
  double ours = kNotPrinted;
  Verdict verdict = Verdict::kFailed;
  std::string note;
};

// A misprint or an error of a paper: what, and how it is proved (symbolic, numeric, dimensional,
// by reasoning). Ids are those of docs/spec/errata.md.
struct Erratum {
  const char* paper;
  const char* id;
  const char* text;
  const char* proof;
};
std::span<const Erratum> errata();
// docs/spec/errata.md, the papers' part: a table in Markdown.
std::string errata_page();

// One figure of a paper or of what it did not see; `id` names its CSV file.
struct Figure {
  std::string id;
  report::Block block;
};
struct Paper {
  std::string name, title, reference;
  std::vector<Check> checks;
  std::vector<Figure> figures;
  std::vector<report::Block> tables;      // what is better told in a table
  std::map<std::string, double> numbers;  // more numbers for the page
  std::string page;                       // docs/papers.md, this paper's part
};

// Takes the answers to a paper's claims.
class Book {
 public:
  Book(Paper& paper, std::span<const Claim> claims) : paper_(paper), claims_(claims) {}
  // Throws Error(kWork) for an id that is not a claim, or is answered twice.
  void add(std::string_view id, double ours);
  // Claims without an answer become failed checks; then fills the page's numbers into `text`:
  // {{id}} ours with 4 digits, {{id:.2e}} in a format of fmt, {{printed id}} the print.
  void close(std::string_view text);

 private:
  Paper& paper_;
  std::span<const Claim> claims_;
};
Verdict judge(const Claim& claim, double ours);

struct PaperInfo {
  const char* name;
  const char* title;
  double cost;  // share of the time of all
  Paper (*run)(const Options&);
};
std::span<const PaperInfo> papers();
Paper yu2023(const Options& options);
Paper shi2015(const Options& options);
Paper wang2012(const Options& options);
Paper liu2014(const Options& options);
Paper bian2022(const Options& options);

// interface.md: a list of id, paper, quantity, printed, ours, tolerance, verdict, note.
Json to_json(const std::vector<Paper>& done);
report::Page report_page(const std::vector<Paper>& done);
// One CSV of a figure: curve,x,y.
std::string figure_csv(const Figure& figure);
// docs/papers.md.
std::string docs_page(const std::vector<Paper>& done);

}  // namespace loxo::papers
