// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/error_sections.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "loxo/report/json_sections.hpp"
#include "loxo/report/page_html.hpp"

namespace loxo::report {
namespace {

constexpr double kToDeg = 180.0 / std::numbers::pi;

template <typename F>
std::vector<double> of(const Evaluation& e, F value) {
  std::vector<double> out;
  out.reserve(e.series.size());
  for (const auto& epoch : e.series) out.push_back(value(epoch));
  return out;
}
bool any(const std::vector<double>& y) {
  return std::any_of(y.begin(), y.end(), [](double v) { return std::isfinite(v); });
}

// The stated standard deviation at the evaluation's epochs: of the solution's row before or at it.
std::vector<double> stated(const NamedEvaluation& n, double SolutionRow::*member, double factor) {
  std::vector<double> out;
  if (!n.solution) return out;
  const auto& rows = n.solution->rows;
  std::size_t i = 0;
  for (const auto& epoch : n.evaluation->series) {
    while (i + 1 < rows.size() && rows[i + 1].t <= epoch.t) ++i;
    out.push_back(i < rows.size() ? factor * rows[i].*member : kNoValue);
  }
  return any(out) ? out : std::vector<double>{};
}

}  // namespace

Section error_section(const std::vector<NamedEvaluation>& evaluations, double t0) {
  Section section;
  section.title = "Errors against the truth";

  Table table;
  table.title = "How wrong, in numbers";
  table.caption =
      "Horizontal position: differences in Earth-fixed axes, resolved at the true position, in "
      "metres and in per cent of the way driven; heading and velocity: rms; NEES: its degrees of "
      "freedom are expected.";
  table.columns.push_back({"solution", ""});
  std::vector<std::string> keys;
  if (!evaluations.empty())
    for (const auto& v : evaluation_values(*evaluations.front().evaluation)) keys.push_back(v.name);
  // Four digits: an error is not known better, and the table stays narrow.
  const auto cell = [](double v) {
    Cell c(v);
    c.text = format_number(v, kNoValue, 4);
    return c;
  };
  const auto value_of = [](const NamedEvaluation& n, const std::string& key) {
    for (const auto& v : evaluation_values(*n.evaluation))
      if (v.name == key) return v.value;
    return kNoValue;
  };
  // The promised figures in the first table, the others in a second one.
  const std::vector<std::pair<std::string, Column>> first{
      {"horizontal_rms_m", {"rms", "m"}},
      {"horizontal_max_m", {"max", "m"}},
      {"horizontal_end_m", {"end", "m"}},
      {"cep50_m", {"CEP 50", "m"}},
      {"cep95_m", {"CEP 95", "m"}},
      {"horizontal_pct_50", {"50 %", "% of way"}},
      {"horizontal_pct_95", {"95 %", "% of way"}},
      {"horizontal_pct_max", {"max", "% of way"}},
      {"heading_rms_deg", {"heading", "deg"}},
      {"velocity_rms_mps", {"velocity", "m/s"}},
      {"nees_mean", {"NEES", ""}}};
  std::erase_if(keys, [&](const std::string& k) {
    return std::none_of(evaluations.begin(), evaluations.end(),
                        [&](const auto& n) { return std::isfinite(value_of(n, k)); });
  });
  Table more;
  more.title = "Further figures";
  more.columns.push_back({"quantity", ""});
  for (const auto& n : evaluations) more.columns.push_back({n.name, ""});
  more.columns.push_back({"unit", ""});
  std::vector<std::string> shown;
  for (const auto& [key, column] : first)
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) {
      shown.push_back(key);
      table.columns.push_back(column);
    }
  for (const auto& k : keys) {
    if (std::find(shown.begin(), shown.end(), k) != shown.end()) continue;
    const auto column = column_of_key(k);
    Row row;
    row.cells.emplace_back(column.title);
    for (const auto& n : evaluations) row.cells.push_back(cell(value_of(n, k)));
    row.cells.emplace_back(column.unit);
    more.rows.push_back(std::move(row));
  }
  const NamedEvaluation* best = nullptr;
  for (const auto& n : evaluations)
    if (std::isfinite(n.evaluation->horizontal_rms_m) &&
        (!best || n.evaluation->horizontal_rms_m < best->evaluation->horizontal_rms_m))
      best = &n;
  for (const auto& n : evaluations) {
    Row row;
    row.highlighted = evaluations.size() > 1 && &n == best;
    row.cells.emplace_back(n.name);
    for (const auto& k : shown) row.cells.push_back(cell(value_of(n, k)));
    table.rows.push_back(std::move(row));
  }
  section.blocks.emplace_back(std::move(table));

  const auto times = [&](const Evaluation& e) {
    return of(e, [t0](const EvaluationEpoch& p) { return p.t - t0; });
  };
  const auto add = [&](const std::string& title, const std::string& caption, const Axis& y,
                       const auto& value, double SolutionRow::*sigma, bool half,
                       double sigma_factor = 1) {
    Series series;
    series.title = title;
    series.caption = caption;
    series.x = {"time", "s"};
    series.y = y;
    series.sync = "time";
    series.half = half;
    for (const auto& n : evaluations) {
      Curve curve;
      curve.name = n.name;
      curve.x = times(*n.evaluation);
      curve.y = of(*n.evaluation, value);
      if (!any(curve.y)) continue;
      if (sigma)
        if (auto two = stated(n, sigma, 2 * sigma_factor); !two.empty()) {
          curve.hi = two;
          for (double& v : two) v = -v;
          curve.lo = std::move(two);
        }
      series.curves.push_back(std::move(curve));
    }
    if (!series.curves.empty()) section.blocks.emplace_back(std::move(series));
  };
  add(
      "Horizontal error", "Distance between the computed and the true position, without height.",
      {"error", "m"}, [](const EvaluationEpoch& p) { return p.horizontal; }, nullptr, false);
  add(
      "East error",
      "Computed minus true; the band is twice the standard deviation that the solution states.",
      {"east", "m"}, [](const EvaluationEpoch& p) { return p.east; }, &SolutionRow::std_e, true);
  add(
      "North error", "Computed minus true.", {"north", "m"},
      [](const EvaluationEpoch& p) { return p.north; }, &SolutionRow::std_n, true);
  add(
      "Along the course", "Along the true course, where the vehicle moves.", {"along", "m"},
      [](const EvaluationEpoch& p) { return p.along; }, nullptr, true);
  add(
      "Across the course", "To the right of the true course, where the vehicle moves.",
      {"across", "m"}, [](const EvaluationEpoch& p) { return p.across; }, nullptr, true);
  add(
      "Up error", "Computed minus true height.", {"up", "m"},
      [](const EvaluationEpoch& p) { return p.up; }, &SolutionRow::std_u, true);
  add(
      "Heading error", "Computed minus true.", {"heading", "deg"},
      [](const EvaluationEpoch& p) { return p.heading * kToDeg; }, &SolutionRow::std_heading, true,
      kToDeg);
  add(
      "Pitch error", "Computed minus true.", {"pitch", "deg"},
      [](const EvaluationEpoch& p) { return p.pitch * kToDeg; }, nullptr, true);
  add(
      "Roll error", "Computed minus true.", {"roll", "deg"},
      [](const EvaluationEpoch& p) { return p.roll * kToDeg; }, nullptr, true);
  add(
      "East velocity error", "Computed minus true.", {"east", "m/s"},
      [](const EvaluationEpoch& p) { return p.ve; }, nullptr, true);
  add(
      "North velocity error", "Computed minus true.", {"north", "m/s"},
      [](const EvaluationEpoch& p) { return p.vn; }, nullptr, true);

  Series share;
  share.title = "Error in per cent of the distance";
  share.caption =
      "Horizontal error over the distance driven so far; shown beyond the first 2 % of the way, "
      "where the quotient means something.";
  share.x = {"distance", "km"};
  share.y = {"error", "% of distance"};
  share.half = true;
  Cdf cdf;
  cdf.title = "Distribution of the horizontal error";
  cdf.caption = "Share of epochs with an error below the value.";
  cdf.x = {"horizontal error", "m"};
  for (const auto& n : evaluations) {
    Curve curve;
    curve.name = n.name;
    curve.x = of(*n.evaluation, [](const EvaluationEpoch& p) { return p.s / 1000; });
    const double least = 0.02 * n.evaluation->distance_m;
    curve.y = of(*n.evaluation, [least](const EvaluationEpoch& p) {
      return p.s > least && p.s > 0 ? 100 * p.horizontal / p.s : kNoValue;
    });
    if (any(curve.y)) share.curves.push_back(std::move(curve));
    Sample sample{n.name, of(*n.evaluation, [](const EvaluationEpoch& p) { return p.horizontal; })};
    if (any(sample.values)) cdf.samples.push_back(std::move(sample));
  }
  if (!share.curves.empty()) section.blocks.emplace_back(std::move(share));
  if (!cdf.samples.empty()) section.blocks.emplace_back(std::move(cdf));

  Series nees;
  nees.title = "Normalised error of position (NEES)";
  nees.caption =
      "Squared error in units of the stated covariance; on average its degrees of freedom if the "
      "solution knows itself.";
  nees.x = {"time", "s"};
  nees.y = {"NEES", "1", true};
  nees.sync = "time";
  for (const auto& n : evaluations) {
    Curve curve;
    curve.name = n.name;
    curve.x = times(*n.evaluation);
    curve.y = of(*n.evaluation, [](const EvaluationEpoch& p) { return p.nees; });
    if (!any(curve.y)) continue;
    if (nees.marks.empty() && std::isfinite(n.evaluation->nees_low)) {
      nees.marks.push_back({n.evaluation->nees_low, "95 % band", true});
      nees.marks.push_back({n.evaluation->nees_high, "", true});
    }
    nees.curves.push_back(std::move(curve));
  }
  if (!nees.curves.empty()) section.blocks.emplace_back(std::move(nees));

  Table lengths;
  lengths.title = "Relative error over pieces of equal length";
  lengths.caption =
      "Error that a piece of the way adds, in per cent of its length; independent: how many pieces "
      "do not overlap.";
  lengths.columns = {{"solution", ""},        {"length", "m"},        {"50 %", "% of length"},
                     {"95 %", "% of length"}, {"max", "% of length"}, {"pieces", ""},
                     {"independent", ""}};
  for (const auto& n : evaluations)
    for (const auto& r : n.evaluation->by_length)
      lengths.rows.push_back(
          {{Cell(n.name), Cell(r.length), cell(r.pct_50), cell(r.pct_95), cell(r.pct_max),
            Cell(static_cast<double>(r.pieces)), cell(r.independent)}});
  if (!lengths.rows.empty()) section.blocks.emplace_back(std::move(lengths));
  if (!more.rows.empty()) section.blocks.emplace_back(std::move(more));
  return section;
}

}  // namespace loxo::report
