// SPDX-License-Identifier: Apache-2.0
#include "loxo/papers/reproduce.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/num/error.hpp"
#include "loxo/report/page_html.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::papers {
namespace {

constexpr Erratum kErrata[] = {
#include "loxo/papers/errata.inc"
};

constexpr PaperInfo kPapers[] = {
    {"yu2023", "calibration of scale and mounting angle from end points", 0.15, yu2023},
    {"shi2015", "what spoils an odometer's calibration", 0.3, shi2015},
    {"wang2012", "INS first, dead reckoning later", 18, wang2012},
    {"liu2014", "the transverse frame near the pole", 1.5, liu2014},
    {"bian2022", "testing at the pole without going there", 0.6, bian2022},
};

std::string joined(const std::vector<std::string>& parts, const char* between) {
  std::string text;
  for (const auto& p : parts) text += (text.empty() ? "" : between) + p;
  return text;
}

const Check* find(const Paper& paper, std::string_view id) {
  for (const auto& c : paper.checks)
    if (c.claim.id == id) return &c;
  return nullptr;
}

// The curves of a figure as x, y pairs.
struct Points {
  std::string name;
  const std::vector<double>*x, *y;
};
std::vector<Points> points_of(const report::Block& block) {
  std::vector<Points> out;
  if (const auto* s = std::get_if<report::Series>(&block)) {
    for (const auto& c : s->curves) out.push_back({c.name, c.x.empty() ? &s->at : &c.x, &c.y});
  } else if (const auto* d = std::get_if<report::Scatter>(&block)) {
    for (const auto& c : d->clouds) out.push_back({c.name, &c.x, &c.y});
  } else if (const auto* f = std::get_if<report::Fan>(&block)) {
    for (const auto& p : f->percentiles)
      out.push_back({fmt::format("{} %", p.percent), &f->at, &p.y});
    for (const auto& c : f->curves) out.push_back({c.name, c.x.empty() ? &f->at : &c.x, &c.y});
  } else if (const auto* m = std::get_if<report::Map>(&block)) {
    for (const auto& t : m->tracks) out.push_back({t.name, &t.lon, &t.lat});
  } else if (const auto* q = std::get_if<report::Cdf>(&block)) {
    for (const auto& p : q->samples) out.push_back({p.name, &p.values, &p.values});
  }
  return out;
}

report::Cell verdict_cell(Verdict v) {
  return {std::string(verdict_name(v)), v == Verdict::kFailed      ? report::Verdict::kBad
                                        : v == Verdict::kCorrected ? report::Verdict::kNote
                                                                   : report::Verdict::kGood};
}

}  // namespace

Ellipsoid Model::of(const Ellipsoid& ell) const {
  if (earth_radius == 1 && earth_rate == 1 && gravity == 1) return ell;
  Ellipsoid e = make_ellipsoid(ell.name, ell.a * earth_radius, ell.f);
  e.w_ie = ell.w_ie * earth_rate;
  e.gm = ell.gm;
  e.g_constant = ell.g_constant * gravity;
  return e;
}

std::string_view verdict_name(Verdict v) {
  return v == Verdict::kReproduced  ? "reproduced"
         : v == Verdict::kCorrected ? "corrected"
                                    : "failed";
}

std::span<const Erratum> errata() { return kErrata; }
std::span<const PaperInfo> papers() { return kPapers; }

Verdict judge(const Claim& c, double ours) {
  const bool right = c.expected_is_bound ? std::fabs(ours) <= c.expected
                                         : std::fabs(ours - c.expected) <= c.expected_tolerance;
  if (!right) return Verdict::kFailed;  // also where ours is NaN
  bool as_printed = true;
  if (c.kind == Kind::kValue) as_printed = std::fabs(ours - c.printed) <= c.tolerance;
  if (c.kind == Kind::kAtMost) as_printed = std::fabs(ours) <= c.printed;
  if (c.kind == Kind::kAtLeast) as_printed = ours >= c.printed;
  if (c.kind == Kind::kFigure) as_printed = c.erratum[0] == '\0';
  if (as_printed) return Verdict::kReproduced;
  return c.erratum[0] != '\0' ? Verdict::kCorrected : Verdict::kFailed;
}

void Book::add(std::string_view id, double ours) {
  for (const auto& claim : claims_) {
    if (claim.id != id) continue;
    if (find(paper_, id) != nullptr)
      throw Error(ErrorKind::kWork, fmt::format("{} is answered twice", id), paper_.name);
    Check check{claim, ours, judge(claim, ours), claim.note};
    if (check.verdict == Verdict::kFailed)
      check.note =
          fmt::format("expected {:.6g}{}; {}", claim.expected,
                      claim.expected_is_bound ? " at most"
                                              : fmt::format(" +- {:.2g}", claim.expected_tolerance),
                      check.note);
    paper_.checks.push_back(check);
    return;
  }
  throw Error(ErrorKind::kWork, fmt::format("{} is not a claim", id), paper_.name);
}

void Book::close(std::string_view text) {
  std::vector<Check> ordered;
  for (const auto& claim : claims_) {
    const auto* found = find(paper_, claim.id);
    ordered.push_back(found != nullptr
                          ? *found
                          : Check{claim, kNotPrinted, Verdict::kFailed, "was not computed"});
  }
  paper_.checks = std::move(ordered);
  std::string& out = paper_.page;
  std::size_t at = 0;
  while (true) {
    const auto open = text.find("{{", at);
    out += text.substr(at, open - at);
    if (open == std::string_view::npos) break;
    const auto end = text.find("}}", open);
    if (end == std::string_view::npos)
      throw Error(ErrorKind::kWork, "'{{' without '}}' in the page", paper_.name);
    std::string name(text.substr(open + 2, end - open - 2)), format = ".4g";
    at = end + 2;
    if (const auto colon = name.find(':'); colon != std::string::npos) {
      format = name.substr(colon + 1);
      name.resize(colon);
    }
    const bool printed = name.rfind("printed ", 0) == 0;
    const auto* check = find(paper_, printed ? std::string_view(name).substr(8) : name);
    double x = 0;
    if (check != nullptr) {
      x = printed ? check->claim.printed : check->ours;
    } else if (const auto number = paper_.numbers.find(name); number != paper_.numbers.end()) {
      x = number->second;
    } else {
      throw Error(ErrorKind::kWork, fmt::format("the page asks for '{}'", name), paper_.name);
    }
    out += fmt::format(fmt::runtime("{:" + format + "}"), x);
  }
}

Json to_json(const std::vector<Paper>& done) {
  Json list = Json::array();
  const auto number = [](double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); };
  for (const auto& paper : done)
    for (const auto& c : paper.checks)
      list.push_back({{"id", c.claim.id},
                      {"paper", paper.name},
                      {"quantity", c.claim.quantity},
                      {"printed", number(c.claim.printed)},
                      {"ours", number(c.ours)},
                      {"tolerance", number(c.claim.tolerance)},
                      {"verdict", std::string(verdict_name(c.verdict))},
                      {"note", c.note}});
  return list;
}

report::Page report_page(const std::vector<Paper>& done) {
  report::Page page;
  page.title = "Papers, reproduced";
  report::Section summary;
  summary.title = "Summary";
  report::Table table;
  table.title = "Verdicts";
  table.caption =
      "Reproduced: our value is the printed one, within what its digits allow, or holds its bound; "
      "what is only drawn or said in words must agree with an independent derivation. Corrected: "
      "the print is in error, and the erratum named in the note proves it. Every value is computed "
      "by the program as it stands.";
  table.columns = {
      {"paper", ""}, {"checks", ""}, {"reproduced", ""}, {"corrected", ""}, {"failed", ""}};
  for (const auto& paper : done) {
    int count[3] = {0, 0, 0};
    for (const auto& c : paper.checks) ++count[static_cast<int>(c.verdict)];
    report::Row row;
    row.cells = {report::Cell(paper.name), report::Cell(double(paper.checks.size())),
                 report::Cell(double(count[0])), report::Cell(double(count[1])),
                 report::Cell(double(count[2]), report::kNoValue,
                              count[2] ? report::Verdict::kBad : report::Verdict::kNone)};
    row.note = paper.reference;
    table.rows.push_back(row);
  }
  summary.blocks.emplace_back(table);
  page.sections.push_back(summary);
  for (const auto& paper : done) {
    report::Section figures;
    figures.title = paper.name + ": " + paper.title;
    figures.group = paper.name;
    figures.blocks.emplace_back(report::Text{paper.reference});
    for (const auto& f : paper.figures) figures.blocks.push_back(f.block);
    for (const auto& t : paper.tables) figures.blocks.push_back(t);
    page.sections.push_back(figures);

    report::Section values;
    values.title = paper.name + ": every value";
    values.group = paper.name;
    report::Table t;
    t.title = "Printed beside ours";
    t.columns = {{"id", ""},   {"quantity", ""},  {"printed", ""},
                 {"ours", ""}, {"tolerance", ""}, {"verdict", ""}};
    for (const auto& c : paper.checks) {
      report::Row row;
      const char* relation = c.claim.kind == Kind::kAtMost    ? "\u2264 "
                             : c.claim.kind == Kind::kAtLeast ? "\u2265 "
                                                              : "";
      row.cells = {report::Cell(c.claim.id),
                   report::Cell(c.claim.quantity),
                   std::isnan(c.claim.printed)
                       ? report::Cell("not printed")
                       : report::Cell(relation + fmt::format("{:.6g}", c.claim.printed)),
                   report::Cell(fmt::format("{:.6g}", c.ours)),
                   std::isnan(c.claim.tolerance)
                       ? report::Cell("")
                       : report::Cell(fmt::format("{:.2g}", c.claim.tolerance)),
                   verdict_cell(c.verdict)};
      row.note = c.note;
      t.rows.push_back(row);
    }
    values.blocks.emplace_back(t);
    page.sections.push_back(values);

    report::Section wrong;
    wrong.title = paper.name + ": errata";
    wrong.group = paper.name;
    report::Table e;
    e.title = "What the print has wrong, and what is right";
    e.caption =
        "Proof: symbolic (an identity), numeric (evaluated against an independent "
        "computation), dimensional, or by reasoning; the rows above that show it.";
    e.columns = {{"erratum", ""}, {"what", ""}, {"proof", ""}, {"shown by", ""}};
    for (const auto& x : errata()) {
      if (paper.name != x.paper) continue;
      std::vector<std::string> shown;
      for (const auto& c : paper.checks)
        if (c.claim.erratum == std::string_view(x.id)) shown.emplace_back(c.claim.id);
      if (shown.size() > 4) {
        const auto more = shown.size() - 3;
        shown.resize(3);
        shown.push_back(fmt::format("and {} more", more));
      }
      report::Row row;
      row.cells = {report::Cell(x.id), report::Cell(x.text), report::Cell(x.proof),
                   report::Cell(joined(shown, ", "))};
      e.rows.push_back(row);
    }
    if (!e.rows.empty()) {
      wrong.blocks.emplace_back(e);
      page.sections.push_back(wrong);
    }
  }
  return page;
}

std::string figure_csv(const Figure& figure) {
  std::string text = "curve,x,y\n";
  if (const auto* r = std::get_if<report::Roots>(&figure.block))
    for (const auto& root : r->roots) {
      text += '"' + root.name + "\",";
      append_number(text, root.re);
      text += ',';
      append_number(text, root.im);
      text += '\n';
    }
  for (const auto& p : points_of(figure.block))
    for (std::size_t i = 0; i < p.y->size() && i < p.x->size(); ++i) {
      text += '"' + p.name + "\",";
      append_number(text, (*p.x)[i]);
      text += ',';
      append_number(text, (*p.y)[i]);
      text += '\n';
    }
  return text;
}

std::string docs_page(const std::vector<Paper>& done) {
  std::string text =
      "# The papers, for a reader who never saw them\n\n"
      "Every number below is written by `loxo reproduce --docs`; a test holds this page against "
      "it. The values one by one:\n`loxo reproduce`, with figures `loxo reproduce -o FOLDER`, for "
      "programs `loxo reproduce --json`. What is wrong in print is\nnumbered in "
      "[spec/errata.md](spec/errata.md).\n";
  for (const auto& paper : done) text += "\n" + paper.page;
  return text;
}

std::string errata_page() {
  std::string text =
      "| erratum | paper | what is printed, what is right | proof |\n|---|---|---|---|\n";
  const auto cell = [](std::string s) {
    for (std::size_t i = 0; (i = s.find('|', i)) != std::string::npos; i += 2) s.insert(i, "\\");
    return s;
  };
  for (const auto& e : errata())
    text += fmt::format("| {} | {} | {} | {} |\n", e.id, e.paper, cell(e.text), cell(e.proof));
  return text;
}

}  // namespace loxo::papers
