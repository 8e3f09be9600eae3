// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/analysis_sections.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "loxo/report/json_parts.hpp"
#include "loxo/report/json_sections.hpp"
#include "loxo/report/page_html.hpp"

namespace loxo::report {
namespace {

const Json& list_of(const Json& json, const char* key) {
  static const Json none = Json::array();
  const auto it = json.find(key);
  return it != json.end() && it->is_array() ? *it : none;
}
std::string titled(const std::string& what, const std::string& name) {
  return name.empty() ? what : what + ": " + name;
}
// Hours for a day, seconds for a drive.
Axis time_axis(std::vector<double>& t) {
  if (t.empty() || t.back() < 3 * 3600) return {"time", "s"};
  for (double& x : t) x /= 3600;
  return {"time", "h"};
}
Cell four(double x) {
  Cell c(x);
  c.text = format_number(x, kNoValue, 4);
  return c;
}

}  // namespace

Section static_response_section(const Json& json, const std::string& name) {
  Section section;
  section.title = titled("Static response", name);
  section.blocks.emplace_back(Text{"A system at rest on **" + words(json, "earth") +
                                   "**, errors in the " + words(json, "frame") +
                                   " frame: the exact closed form, Foucault included. The legend "
                                   "switches a source on and off in "
                                   "all figures."});
  std::vector<double> t = numbers(json, "t_s");
  const Axis x = time_axis(t);
  const struct {
    const char *key, *title, *label, *unit;
  } components[] = {{"north_m", "North position error", "north", "m"},
                    {"east_m", "East position error", "east", "m"},
                    {"dve_mps", "East velocity error", "east", "m/s"},
                    {"dvn_mps", "North velocity error", "north", "m/s"},
                    {"phie_arcsec", "Tilt about east", "tilt", "″"},
                    {"phin_arcsec", "Tilt about north", "tilt", "″"},
                    {"phiu_arcsec", "Azimuth error", "azimuth", "″"}};
  for (const auto& c : components) {
    Series s;
    s.title = c.title;
    s.x = x;
    s.y = {c.label, c.unit};
    s.at = t;
    s.sync = "static";
    s.half = true;
    for (const auto& r : list_of(json, "responses")) {
      Curve curve;
      curve.name = with_spaces(words(r, "source"));
      curve.source = curve.name;
      curve.y = numbers(r, c.key);
      if (curve.name == "sum") curve.style = Style::kDashed;
      if (curve.y.size() == t.size()) s.curves.push_back(std::move(curve));
    }
    if (!s.curves.empty()) section.blocks.emplace_back(std::move(s));
  }
  Table table;
  table.title = "Largest values and the end";
  table.columns = {{"source", ""}, {"north", "m"},   {"east", "m"}, {"velocity", "m/s"},
                   {"level", "″"}, {"azimuth", "″"}, {"end", "m"}};
  for (const auto& r : list_of(json, "sources"))
    table.rows.push_back(
        {{Cell(with_spaces(words(r, "source"))), four(number(r, "north_max_m")),
          four(number(r, "east_max_m")), four(number(r, "velocity_max_mps")),
          four(number(r, "level_max_arcsec")), four(number(r, "azimuth_max_arcsec")),
          four(std::hypot(number(r, "north_end_m"), number(r, "east_end_m")))}});
  if (!table.rows.empty()) section.blocks.emplace_back(std::move(table));
  Table noise;
  noise.title = "White noise at the end, one standard deviation";
  noise.columns = {{"source", ""}, {"north", "m"},  {"east", "m"},   {"dvE", "m/s"},
                   {"dvN", "m/s"}, {"tilt E", "″"}, {"tilt N", "″"}, {"azimuth", "″"}};
  for (const auto& r : list_of(json, "noise"))
    noise.rows.push_back(
        {{Cell(with_spaces(words(r, "source"))), four(number(r, "north_std_end_m")),
          four(number(r, "east_std_end_m")), four(number(r, "dve_std_end_mps")),
          four(number(r, "dvn_std_end_mps")), four(number(r, "phie_std_end_arcsec")),
          four(number(r, "phin_std_end_arcsec")), four(number(r, "phiu_std_end_arcsec"))}});
  if (!noise.rows.empty()) section.blocks.emplace_back(std::move(noise));
  return section;
}

Section roots_section(const Json& json, const std::string& name) {
  Section section;
  section.title = titled("Characteristic roots", name);
  Roots roots;
  roots.title = "Roots of the system at rest";
  roots.caption =
      "All lie on the imaginary axis: errors neither die out nor grow but by the zero root, a "
      "drift "
      "about the Earth's axis. Foucault splits Schuler's pair.";
  Table table;
  table.columns = {{"root", ""}, {"frequency", "rad/s"}, {"period", "min"}};
  for (const auto& r : list_of(json, "roots")) {
    const double im = number(r, "im");
    roots.roots.push_back({words(r, "name"), number(r, "re"), im});
    if (im > 0)
      table.rows.push_back(
          {{Cell(words(r, "name")), Cell(im), four(2 * 3.14159265358979 / im / 60)}});
  }
  if (roots.roots.empty()) return plain_section(json, section.title);
  section.blocks.emplace_back(std::move(roots));
  section.blocks.emplace_back(std::move(table));
  return section;
}

Section budget_section(const Json& json, const std::string& name) {
  Section section;
  section.title = titled("Error budget", name);
  std::vector<double> t = numbers(json, "t_s");
  const std::string mode = words(json, "mode");
  section.blocks.emplace_back(
      Text{"Solution by **" + mode + "**, along the " + words(json, "nominal") +
           ". One standard deviation at the end: **" +
           format_number(number(json, "horizontal_end_m"), kNoValue, 4) + " m**, led by **" +
           with_spaces(words(json, "leading")) + "**."});
  const Axis x = time_axis(t);
  StackedArea stack;
  stack.title = "Variance of the horizontal position, by source";
  stack.caption = "Variances of independent sources add: the height of a layer is its share.";
  stack.x = x;
  stack.y = {"variance", "m²"};
  stack.at = t;
  Series series;
  series.title = "What each source alone would do";
  series.caption = "One standard deviation of the horizontal position; dashed: all together.";
  series.x = x;
  series.y = {"horizontal", "m"};
  series.at = t;
  Table table;
  table.title = "At the end";
  table.columns = {
      {"source", ""}, {"end", "m"}, {"share", "%"}, {"largest", "m"}, {"total if halved", "m"}};
  for (const auto& s : list_of(json, "sources")) {
    const std::string source = with_spaces(words(s, "source"));
    Layer layer{source, numbers(s, "horizontal_variance_m2")};
    if (layer.y.size() == t.size()) {
      Curve curve;
      curve.name = source;
      for (double v : layer.y) curve.y.push_back(std::sqrt(std::max(0.0, v)));
      series.curves.push_back(std::move(curve));
      stack.layers.push_back(std::move(layer));
    }
    table.rows.push_back(
        {{Cell(source), four(number(s, "horizontal_end_m")), four(100 * number(s, "share")),
          four(number(s, "horizontal_max_m")), four(number(s, "total_if_halved_m"))}});
  }
  Curve total;
  total.name = "total";
  total.y = numbers(json, "total_m");
  total.style = Style::kDashed;
  if (total.y.size() == t.size()) series.curves.push_back(std::move(total));
  if (!stack.layers.empty()) section.blocks.emplace_back(std::move(stack));
  if (!series.curves.empty()) section.blocks.emplace_back(std::move(series));
  section.blocks.emplace_back(std::move(table));
  if (const auto it = json.find("diagnostics"); it != json.end()) add_diagnostics(section, *it);
  return section;
}

Section odometer_section(const Json& json, const std::string& name) {
  Section section;
  section.title = titled("Odometer calibration, error analysis", name);
  section.blocks.emplace_back(Text{
      "A drive of **" + format_number(number(json, "length_m"), kNoValue, 6) +
      " m** finds the scale to **" + format_number(number(json, "ln_k_std"), kNoValue, 3) +
      "** and the mounting angle to **" + format_number(number(json, "eps_std_deg"), kNoValue, 3) +
      " deg** (one standard deviation). Scale: led by " +
      with_spaces(words(json, "leading_scale")) + ", improved most by “" +
      words(json, "improves_scale_most") + "”. Angle: led by " +
      with_spaces(words(json, "leading_angle")) + ", improved most by “" +
      words(json, "improves_angle_most") + "”."});
  Table table;
  table.title = "By source";
  table.columns = {
      {"source", ""}, {"scale", "1"}, {"share", "%"}, {"angle", "deg"}, {"share", "%"}};
  for (const auto& s : list_of(json, "sources"))
    table.rows.push_back({{Cell(with_spaces(words(s, "source"))), four(number(s, "ln_k_std")),
                           four(100 * number(s, "share_of_scale")), four(number(s, "eps_std_deg")),
                           four(100 * number(s, "share_of_angle"))}});
  section.blocks.emplace_back(std::move(table));
  Table change;
  change.title = "What a change would make of it";
  change.columns = {{"change", ""}, {"scale", "1"}, {"angle", "deg"}};
  for (const auto& s : list_of(json, "improvements"))
    change.rows.push_back(
        {{Cell(words(s, "change")), four(number(s, "ln_k_std")), four(number(s, "eps_std_deg"))}});
  section.blocks.emplace_back(std::move(change));
  if (const auto it = json.find("over_length"); it != json.end()) {
    const auto at = numbers(*it, "length_m");
    const struct {
      const char *key, *title, *unit;
    } figures[] = {{"ln_k_std", "Scale over the length of the drive", "1"},
                   {"eps_std_deg", "Angle over the length of the drive", "deg"}};
    for (const auto& f : figures) {
      Series s;
      s.title = f.title;
      s.x = {"length", "m", true};
      s.y = {"1 σ", f.unit, true};
      s.at = at;
      s.half = true;
      Curve curve;
      curve.name = "all sources";
      curve.y = numbers(*it, f.key);
      if (curve.y.size() == at.size()) s.curves.push_back(std::move(curve));
      if (!s.curves.empty()) section.blocks.emplace_back(std::move(s));
    }
  }
  if (!words(json, "note").empty())
    section.blocks.emplace_back(Text{words(json, "note") + ".", Verdict::kNote});
  return section;
}

Section allan_log_section(const Json& json, const std::string& name) {
  Section section;
  const std::string kind = words(json, "kind");
  section.title = titled(kind == "hadamard"   ? "Hadamard deviation"
                         : kind == "modified" ? "Modified Allan deviation"
                                              : "Allan deviation",
                         name);
  const auto axes = json.find("axes");
  if (axes == json.end() || !axes->is_object()) return plain_section(json, section.title);
  for (const bool gyro : {true, false}) {
    Series s;
    s.title = gyro ? "Gyros" : "Accelerometers";
    s.caption =
        "Dots: measured, band: one standard deviation; dashed: the fitted noise of the same axis.";
    s.x = {"averaging time", "s", true};
    s.y = {"deviation", gyro ? "deg/h" : "µg", true};
    const double unit = gyro ? 3.14159265358979 / 180 / 3600 : 9.80665e-6;
    Table table;
    table.title = gyro ? "Gyros: fitted coefficients" : "Accelerometers: fitted coefficients";
    table.columns.push_back({"axis", ""});
    std::vector<std::string> keys;
    int colour = 0;
    for (const auto& [axis, a] : axes->items()) {
      if ((axis.find("gyro") != std::string::npos) != gyro) continue;
      Curve measured, fit;
      measured.name = with_spaces(axis);
      fit.name = with_spaces(axis) + " fit";
      fit.source = measured.source = measured.name;
      measured.style = Style::kLinePoints;
      fit.style = Style::kDashed;
      measured.colour = fit.colour = colour++;
      for (const auto& p : list_of(a, "points")) {
        const double d = number(p, "deviation") / unit, sigma = number(p, "deviation_std") / unit;
        measured.x.push_back(number(p, "tau_s"));
        measured.y.push_back(d);
        measured.lo.push_back(std::max(d - sigma, 0.05 * d));
        measured.hi.push_back(d + sigma);
        fit.y.push_back(number(p, "fit") / unit);
      }
      fit.x = measured.x;
      const bool fitted = std::any_of(fit.y.begin(), fit.y.end(), [](double v) { return v > 0; });
      s.curves.push_back(std::move(measured));
      if (fitted) s.curves.push_back(std::move(fit));
      for (const auto& [k, v] : a.items())
        if (v.is_number() && a.contains(k + "_std") &&
            std::find(keys.begin(), keys.end(), k) == keys.end())
          keys.push_back(k);
    }
    if (s.curves.empty()) continue;
    section.blocks.emplace_back(std::move(s));
    if (keys.empty()) continue;
    for (const auto& k : keys) table.columns.push_back(column_of_key(k));
    table.columns.push_back({"departs from the fit", "%"});
    for (const auto& [axis, a] : axes->items()) {
      if ((axis.find("gyro") != std::string::npos) != gyro) continue;
      Row row;
      const bool usable = a.value("usable", true);
      row.cells.emplace_back(with_spaces(axis), usable ? Verdict::kGood : Verdict::kBad);
      for (const auto& k : keys)
        row.cells.emplace_back(number(a, k.c_str()), number(a, (k + "_std").c_str()));
      row.cells.push_back(four(100 * number(a, "model_error")));
      row.note = words(a, "why");
      table.rows.push_back(std::move(row));
    }
    section.blocks.emplace_back(std::move(table));
  }
  if (!words(json, "errors").empty())
    section.blocks.emplace_back(Text{"For `[imu]` of a drive: `" + words(json, "errors") + "`"});
  if (const auto it = json.find("diagnostics"); it != json.end()) add_diagnostics(section, *it);
  return section;
}

}  // namespace loxo::report
