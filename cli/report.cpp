// SPDX-License-Identifier: Apache-2.0
// `loxo report`: one self-contained page from whatever the other commands wrote.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "cli/campaign.hpp"
#include "cli/command.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/log/table.hpp"
#include "loxo/num/error.hpp"
#include "loxo/report/error_sections.hpp"
#include "loxo/report/json_sections.hpp"
#include "loxo/report/page_html.hpp"
#include "loxo/report/solution_sections.hpp"
#include "loxo/study/evaluation_file.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::cli {
namespace {

namespace fs = std::filesystem;
using report::NamedSolution;

constexpr const char* kRecognised =
    "expected a solution or reference table (CSV or .h5 with t_s and a position), a drive (folder "
    "with drive.toml, .toml, .h5), a "
    "certificate, a campaign store, or the JSON that calibrate, evaluate, analyze, allan or "
    "reproduce wrote";

struct Input {
  std::string path, kind;
};

struct Gathered {
  std::deque<Solution> solutions;  // stable addresses
  std::vector<NamedSolution> named;
  std::vector<report::MapPoint> points;
  std::vector<report::Section> results;
  std::vector<report::Section> drives;
  std::vector<Input> inputs;
  std::optional<Ellipsoid> ellipsoid;
  Diagnostics diagnostics;
};

std::string first_bytes(const std::string& path, std::size_t n) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(n, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(n));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

std::string stem_of(const std::string& path) {
  std::string name = fs::path(path).filename().string();
  for (const char* tail : {".gz", ".csv", ".h5", ".json", ".toml", ".txt"})
    if (name.size() > std::string_view(tail).size() && name.ends_with(tail))
      name.resize(name.size() - std::string_view(tail).size());
  return name;
}

// A table is the truth when its file is called so; one that a navigator wrote must be called
// exactly so.
bool looks_like_truth(const std::string& stem, const std::string& mode) {
  for (const char* word : {"truth", "reference"}) {
    if (stem == word || mode == word) return true;
    if (mode.empty() && stem.find(word) != std::string::npos) return true;
  }
  return false;
}

std::string unused_name(const Gathered& g, const std::string& wanted) {
  std::string name = wanted;
  for (int n = 2;
       std::any_of(g.named.begin(), g.named.end(), [&](const auto& s) { return s.name == name; });
       ++n)
    name = fmt::format("{} {}", wanted, n);
  return name;
}

void add_solution(Gathered& g, Solution solution, const std::string& name, bool truth) {
  if (solution.rows.empty()) throw Error(ErrorKind::kInput, "has a header but no rows", name);
  g.solutions.push_back(std::move(solution));
  g.named.push_back({unused_name(g, truth ? "truth" : name), &g.solutions.back(), truth});
}

void add_table(Gathered& g, const std::string& path, bool truth) {
  const Ellipsoid ellipsoid = g.ellipsoid.value_or(wgs84());
  Solution solution = read_solution(path, ellipsoid, g.diagnostics);
  if (const auto it = solution.meta.find("ellipsoid");
      it != solution.meta.end() && !it->second.empty() && !g.ellipsoid) {
    g.ellipsoid = ellipsoid_by_name(it->second);
    if (g.ellipsoid->name != ellipsoid.name)
      solution = read_solution(path, *g.ellipsoid, g.diagnostics);
  }
  const std::string stem = stem_of(path);
  const auto at = solution.meta.find("mode");
  const std::string mode = at == solution.meta.end() ? "" : at->second;
  add_solution(g, std::move(solution), stem, truth || looks_like_truth(stem, mode));
}

void add_drive(Gathered& g, const std::string& path) {
  const Drive drive = read_drive(path);
  g.ellipsoid = drive.ellipsoid;
  report::Section section;
  section.title = "Drive: " + (drive.name.empty() ? stem_of(path) : drive.name);
  report::KeyValues pairs;
  pairs.rows.emplace_back("folder", drive.path);
  pairs.rows.emplace_back("ellipsoid", drive.ellipsoid.name);
  std::string sensors;
  for (const auto* channel :
       {&drive.imu, &drive.odometer, &drive.attitude, &drive.track, &drive.fix, &drive.velocity,
        &drive.heading, &drive.height, &drive.reference})
    if (channel->present)
      sensors +=
          fmt::format("{}{} (`{}`)", sensors.empty() ? "" : ", ", channel->section, channel->file);
  pairs.rows.emplace_back("sensors", sensors.empty() ? "none" : sensors);
  pairs.rows.emplace_back("benchmarks", std::to_string(drive.benchmarks.size()));
  section.blocks.emplace_back(std::move(pairs));
  report::add_diagnostics(section, drive.diagnostics);
  g.drives.push_back(std::move(section));
  for (const auto& b : drive.benchmarks)
    g.points.push_back({b.name, b.point.lat, b.point.lon, b.point.std, b.point.std});
  if (drive.reference.present) {
    Ellipsoid ellipsoid = drive.ellipsoid;
    add_solution(g, read_truth(path, ellipsoid, g.diagnostics), "truth", true);
  }
}

void add_truth(Gathered& g, const std::string& path) {
  Ellipsoid ellipsoid = g.ellipsoid.value_or(wgs84());
  add_solution(g, read_truth(path, ellipsoid, g.diagnostics), "truth", true);
  g.ellipsoid = ellipsoid;
}

// Every solution against the truth; false where there is none.
bool add_errors(Gathered& g, report::Page& page) {
  const NamedSolution* truth = nullptr;
  for (const auto& s : g.named)
    if (s.truth && !truth) truth = &s;
  if (!truth) return false;
  std::vector<Evaluation> evaluations;
  std::vector<report::NamedEvaluation> named;
  evaluations.reserve(g.named.size());
  const Ellipsoid ellipsoid = g.ellipsoid.value_or(wgs84());
  for (const auto& s : g.named) {
    if (s.truth) continue;
    try {
      evaluations.push_back(evaluate(*s.solution, *truth->solution, ellipsoid, {}, g.diagnostics));
      named.push_back({s.name, &evaluations.back(), s.solution});
    } catch (const Error& e) {
      g.diagnostics.warn("evaluate", s.name, e.what());
    }
  }
  if (named.empty()) return false;
  const auto best = std::min_element(named.begin(), named.end(), [](const auto& a, const auto& b) {
    return a.evaluation->horizontal_rms_m < b.evaluation->horizontal_rms_m;
  });
  page.subtitle =
      fmt::format("{}: {:.3g} m horizontal error (rms), {:.3g} m at the end of {:.4g} km",
                  best->name, best->evaluation->horizontal_rms_m,
                  best->evaluation->horizontal_end_m, best->evaluation->distance_m / 1000);
  page.sections.push_back(report::error_section(named, report::time_origin(g.named)));
  return true;
}

[[noreturn]] void refuse(const std::string& path, const std::string& found) {
  throw Error(ErrorKind::kInput, found + "; " + kRecognised, path);
}

// What a file is, by its bytes rather than its name.
void add_path(Gathered& g, const std::string& path, bool truth = false) {
  std::error_code ignored;
  if (!fs::exists(path, ignored))
    throw Error(ErrorKind::kInput, std::string("no such file or folder; ") + kRecognised, path);
  if (fs::is_directory(path)) {
    if (!fs::exists(fs::path(path) / "drive.toml")) refuse(path, "a folder without drive.toml");
    add_drive(g, path);
    g.inputs.push_back({path, "drive"});
    return;
  }
  const std::string head = first_bytes(path, 512);
  if (head.empty()) refuse(path, "the file is empty");
  if (head.starts_with("\x89HDF")) {
    const bool solution = !is_drive(path);
    if (solution)
      add_table(g, path, truth);
    else
      add_drive(g, path);
    g.inputs.push_back({path, solution ? "solution" : "drive"});
    return;
  }
  if (head.starts_with("SQLite format 3")) {
    auto page = campaign_page(path);
    for (auto& section : page.sections) {
      section.group = page.title;
      g.results.push_back(std::move(section));
    }
    g.inputs.push_back({path, "campaign"});
    return;
  }
  if (path.ends_with(".toml")) {
    add_drive(g, path);
    g.inputs.push_back({path, "drive"});
    return;
  }
  const auto first = head.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (first != std::string::npos && (head[first] == '{' || head[first] == '[')) {
    const Json json = read_json(path);
    const auto kind = report::kind_of(json);
    if (kind == report::ResultKind::kUnknown)
      refuse(path, "JSON of no known kind (no \"command\")");
    g.results.push_back(report::result_section(json, stem_of(path)));
    g.inputs.push_back({path, std::string(report::kind_name(kind))});
    return;
  }
  const auto table = open_table(path);  // refuses binary files
  const bool timed = table->has("t_s") || table->has("t") || table->has("time");
  const bool placed = table->has("lat_deg") || table->has("x_m") || table->has("e_m");
  if (!timed || !placed) {
    std::string names;
    for (const auto& h : table->header()) names += (names.empty() ? "" : ", ") + h;
    refuse(path, "a table with columns " + names.substr(0, 200));
  }
  add_table(g, path, truth);
  g.inputs.push_back({path, g.named.back().truth ? "truth" : "solution"});
}

std::string title_of(const Gathered& g, bool truth) {
  std::string names;
  std::size_t n = 0;
  for (const auto& s : g.named)
    if (!s.truth) names += (n++ ? ", " : "") + s.name;
  if (n == 0)
    return truth                             ? "Reference"
           : g.results.empty()               ? "Report"
           : g.results.front().group.empty() ? g.results.front().title
                                             : g.results.front().group;
  return (n > 4 ? fmt::format("{} solutions", n) : names) + (truth ? " against the truth" : "");
}

report::Page page_of(Gathered& g, const std::string& title) {
  report::Page page;
  std::stable_partition(g.named.begin(), g.named.end(),
                        [](const NamedSolution& s) { return s.truth; });
  const bool truth = !g.named.empty() && g.named.front().truth;
  page.title = !title.empty()         ? title
               : g.drives.size() == 1 ? g.drives.front().title
                                      : title_of(g, truth);

  if (!g.named.empty() || !g.points.empty())
    page.sections.push_back(report::map_section(g.named, g.points));
  if (add_errors(g, page))
    page.sections.insert(page.sections.end(), g.results.begin(), g.results.end());
  else
    page.sections.insert(page.sections.begin(), g.results.begin(), g.results.end());
  if (!g.named.empty()) page.sections.push_back(report::motion_section(g.named));
  for (auto& s : g.drives) page.sections.push_back(std::move(s));
  if (!g.diagnostics.empty()) {
    report::Section section;
    section.title = "Diagnostics";
    report::add_diagnostics(section, g.diagnostics);
    page.sections.push_back(std::move(section));
  }
  page.provenance.emplace_back("program", "loxo " LOXO_VERSION);
  for (const auto& input : g.inputs) {
    std::string hash;
    if (fs::is_regular_file(input.path)) hash = ", hash " + file_hash(input.path);
    page.provenance.emplace_back(input.kind, input.path + hash);
  }
  for (const auto& s : g.named)
    for (const auto& [key, value] : s.solution->meta)
      if (!value.empty()) page.provenance.emplace_back(s.name + ": " + key, value);
  return page;
}

struct Options {
  std::vector<std::string> paths;
  std::string truth, title;
};

int run(const Globals& globals, const Options& o) {
  const std::string output = globals.output.empty() ? "report.html" : globals.output;
  Gathered g;
  for (const auto& path : o.paths) add_path(g, path);
  if (!o.truth.empty()) {
    for (auto& s : g.named) s.truth = false;
    std::erase_if(g.named, [](const NamedSolution& s) { return s.name == "truth"; });
    add_truth(g, o.truth);
    g.inputs.push_back({o.truth, "truth"});
  }
  const report::Page page = page_of(g, o.title);
  report::write_page(page, output);
  if (globals.json) {
    Json inputs = Json::array(), sections = Json::array();
    for (const auto& i : g.inputs) inputs.push_back({{"path", i.path}, {"kind", i.kind}});
    for (const auto& s : page.sections) sections.push_back(s.title);
    if (output != "-")
      print_json({{"command", "report"},
                  {"output", output},
                  {"bytes", fs::file_size(output)},
                  {"inputs", inputs},
                  {"sections", sections},
                  {"diagnostics", to_json(g.diagnostics)}});
  } else {
    print_diagnostics(globals, g.diagnostics);
    if (output != "-")
      say(globals, fmt::format("{} ({:.0f} kB): {} section{}", output,
                               static_cast<double>(fs::file_size(output)) / 1000,
                               page.sections.size(), page.sections.size() == 1 ? "" : "s"));
  }
  return 0;
}

}  // namespace

void add_report(CLI::App& app, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub = add_command(
      app, globals, "report",
      "one self-contained HTML page from solutions, drives, certificates and results",
      "loxo report solution.csv DRIVE certificate.json -o report.html",
      [&globals, o]() -> int { return run(globals, *o); }, Output::kPage);
  sub->add_option("PATH", o->paths,
                  "solutions, drives, certificates, JSON results, in any number and order")
      ->required();
  sub->add_option("--truth", o->truth,
                  "what the solutions are held against: a table, or a drive with a [reference]");
  sub->add_option("--title", o->title, "title of the page");
}

}  // namespace loxo::cli
