// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/json_sections.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <utility>

#include "loxo/report/analysis_sections.hpp"
#include "loxo/report/filter_section.hpp"
#include "loxo/report/json_parts.hpp"
#include "loxo/report/page_html.hpp"

namespace loxo::report {
namespace {

const Json* part(const Json& json, const std::string& key) {
  const auto it = json.is_object() ? json.find(key) : json.end();
  return it != json.end() ? &*it : nullptr;
}
bool is_list_of(const Json& json, Json::value_t type) {
  return json.is_array() && !json.empty() &&
         std::all_of(json.begin(), json.end(), [&](const Json& j) { return j.type() == type; });
}
bool is_list_of_numbers(const Json& json) {
  return json.is_array() && !json.empty() &&
         std::all_of(json.begin(), json.end(),
                     [](const Json& j) { return j.is_number() || j.is_null(); }) &&
         std::any_of(json.begin(), json.end(), [](const Json& j) { return j.is_number(); });
}
std::string as_words(const Json& json) {
  if (json.is_string()) return json.get<std::string>();
  if (json.is_number()) return format_number(json.get<double>());
  if (json.is_boolean()) return json.get<bool>() ? "yes" : "no";
  if (json.is_null()) return "–";
  if (json.is_array()) {
    std::string out;
    for (const auto& j : json) out += (out.empty() ? "" : ", ") + as_words(j);
    return out;
  }
  return dump_json(json, -1);
}
Cell cell_of(const Json& json, double sigma = kNoValue) {
  if (json.is_number()) return Cell(json.get<double>(), sigma);
  return Cell(as_words(json));
}
bool ends(const std::string& text, std::string_view tail) {
  return text.size() > tail.size() && text.ends_with(tail);
}

// The key of the standard deviation of `key`: k -> k_std, eps_deg -> eps_std_deg, or x_unit ->
// x_unit_std.
const Json* sigma_of(const Json& object, const std::string& key) {
  if (const auto* s = part(object, key + "_std")) return s;
  for (std::size_t at = key.find('_'); at != std::string::npos; at = key.find('_', at + 1))
    if (const auto* s = part(object, key.substr(0, at) + "_std" + key.substr(at))) return s;
  return nullptr;
}
bool is_sigma_key(const Json& object, const std::string& key) {
  const auto at = key.find("_std");
  if (at == std::string::npos) return false;
  return object.contains(key.substr(0, at) + key.substr(at + 4));
}

}  // namespace

Column column_of_key(const std::string& key) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 32> kUnits{
      {{"_deg_sqrt_h", "deg/√h"},
       {"_mps_sqrt_h", "m/s/√h"},
       {"_deg_h_sqrt_h", "deg/h/√h"},
       {"_mps2_sqrt_h", "m/s²/√h"},
       {"_deg_h_h", "deg/h/h"},
       {"_mps2_h", "m/s²/h"},
       {"_deg_per_m", "deg/m"},
       {"_deg_h", "deg/h"},
       {"_deg_s", "deg/s"},
       {"_radps", "rad/s"},
       {"_rad_s", "rad/s"},
       {"_mps2", "m/s²"},
       {"_mps", "m/s"},
       {"_m_s", "m/s"},
       {"_m2", "m²"},
       {"_deg", "deg"},
       {"_arcsec", "″"},
       {"_arcmin", "′"},
       {"_rad", "rad"},
       {"_mil", "mil"},
       {"_ug", "µg"},
       {"_km", "km"},
       {"_nm", "nmi"},
       {"_hz", "Hz"},
       {"_min", "min"},
       {"_pct", "%"},
       {"_percent", "%"},
       {"_bytes", "bytes"},
       {"_h", "h"},
       {"_m", "m"},
       {"_s", "s"},
       {"_1", "1"}}};
  if (const auto at = key.find("_pct_"); at != std::string::npos)
    return {with_spaces(key.substr(0, at)) + " error, " + with_spaces(key.substr(at + 5)) +
                (std::isdigit(static_cast<unsigned char>(key[at + 5])) ? " %" : ""),
            "% of distance"};
  // The longest unit that fits.
  std::string_view tail, unit;
  for (const auto& [suffix, text] : kUnits)
    if (ends(key, suffix) && suffix.size() > tail.size()) tail = suffix, unit = text;
  return {with_spaces(key.substr(0, key.size() - tail.size())), std::string(unit)};
}

ResultKind kind_of(const Json& json) {
  if (json.is_array())
    return !json.empty() && json.front().is_object() && json.front().contains("printed")
               ? ResultKind::kReproduce
               : ResultKind::kUnknown;
  if (!json.is_object()) return ResultKind::kUnknown;
  const std::string command = words(json, "command");
  if (json.contains("certificate") || command == "certificate" ||
      words(json, "kind") == "certificate" ||
      words(json, "type").find("certificate") != std::string::npos)
    return ResultKind::kCertificate;
  if (command == "calibrate" || json.contains("methods")) return ResultKind::kCalibrate;
  if (command == "calibrate plan") return ResultKind::kPlan;
  if (command == "evaluate" || json.contains("horizontal_rms_m")) return ResultKind::kEvaluate;
  if (command == "reproduce" || json.contains("checks")) return ResultKind::kReproduce;
  if (command == "allan") return ResultKind::kAllan;
  if (command == "analyze budget") return ResultKind::kBudget;
  if (command == "analyze roots") return ResultKind::kRoots;
  if (command == "analyze static") return ResultKind::kStatic;
  if (command == "analyze odometer") return ResultKind::kOdometer;
  if (json.contains("covariance") && (json.contains("k") || json.contains("result")))
    return ResultKind::kCertificate;
  return command.empty() ? ResultKind::kUnknown : ResultKind::kOther;
}

std::string_view kind_name(ResultKind kind) {
  switch (kind) {
    case ResultKind::kCertificate:
      return "certificate";
    case ResultKind::kCalibrate:
      return "calibration";
    case ResultKind::kPlan:
      return "calibration plan";
    case ResultKind::kEvaluate:
      return "evaluation";
    case ResultKind::kReproduce:
      return "reproduction";
    case ResultKind::kAllan:
      return "Allan deviation";
    case ResultKind::kBudget:
      return "error budget";
    case ResultKind::kRoots:
      return "characteristic roots";
    case ResultKind::kStatic:
      return "static response";
    case ResultKind::kOdometer:
      return "odometer error analysis";
    case ResultKind::kOther:
      return "result";
    case ResultKind::kUnknown:
      break;
  }
  return "unknown";
}

void add_diagnostics(Section& section, const Json& diagnostics) {
  if (!diagnostics.is_array() || diagnostics.empty()) return;
  Table table;
  table.title = "What was noticed in the data";
  table.caption =
      "Nothing is repaired in silence: each kind with its place and how often it occurred.";
  table.columns = {{"kind", ""}, {"where", ""}, {"what", ""}, {"times", ""}};
  for (const auto& d : diagnostics) {
    if (d.is_string()) {
      table.rows.push_back({{Cell(""), Cell(""), Cell(d.get<std::string>()), Cell("")}});
      continue;
    }
    if (!d.is_object()) continue;
    const std::string severity = words(d, "severity");
    const Verdict verdict = severity == "bad"    ? Verdict::kBad
                            : severity == "note" ? Verdict::kNone
                                                 : Verdict::kNote;
    table.rows.push_back({{Cell(with_spaces(words(d, "kind")), verdict), Cell(words(d, "where")),
                           Cell(words(d, "what")), Cell(number(d, "count"))}});
  }
  section.blocks.emplace_back(std::move(table));
}

void add_diagnostics(Section& section, const Diagnostics& diagnostics) {
  Json list = Json::array();
  for (const auto& d : diagnostics.list())
    list.push_back({{"severity", d.severity == Severity::kNote      ? "note"
                                 : d.severity == Severity::kWarning ? "warning"
                                                                    : "bad"},
                    {"kind", d.kind},
                    {"where", d.where},
                    {"what", d.what},
                    {"count", d.count}});
  add_diagnostics(section, list);
}

namespace {

// The pairs of an object: numbers with their standard deviation and unit; nested objects one level
// down.
void add_pairs(KeyValues& out, const Json& object, const std::vector<std::string>& known,
               const std::string& prefix = "") {
  for (const auto& [key, value] : object.items()) {
    if (prefix.empty() && std::find(known.begin(), known.end(), key) != known.end()) continue;
    if (is_sigma_key(object, key) || is_list_of(value, Json::value_t::object) ||
        (value.is_array() && value.size() > 12))
      continue;
    if (value.is_array() && !value.empty() && value.front().is_array()) continue;
    const auto name = column_of_key(key);
    const std::string title = prefix.empty() ? name.title : prefix + ": " + name.title;
    if (value.is_object()) {
      if (prefix.empty()) add_pairs(out, value, known, name.title);
      continue;
    }
    const Json* sigma = sigma_of(object, key);
    std::string text =
        value.is_number()
            ? format_number(value.get<double>(),
                            sigma && sigma->is_number() ? sigma->get<double>() : kNoValue)
            : as_words(value);
    if (text.empty() || (value.is_array() && value.empty())) continue;
    if (value.is_number() && !name.unit.empty()) text += " " + name.unit;
    out.rows.emplace_back(title, text);
  }
}

// Lists that are more than tables: characteristic roots, and contributions of sources over a common
// time.
bool add_drawing(Section& section, const Json& object, const std::string& key, const Json& list) {
  const auto value_of = [](const Json& row, std::initializer_list<const char*> names) {
    for (const char* n : names)
      if (const double v = number(row, n); std::isfinite(v)) return v;
    return kNoValue;
  };
  if (std::isfinite(value_of(list.front(), {"re", "real", "re_1_s", "re_rad_s"})) &&
      std::isfinite(value_of(list.front(), {"im", "imag", "im_1_s", "im_rad_s"}))) {
    Roots roots;
    roots.title = with_spaces(key);
    roots.caption =
        "Characteristic roots in the complex plane; left of the vertical line an error dies out, "
        "right of it it grows.";
    for (const auto& r : list)
      roots.roots.push_back({words(r, "name"), value_of(r, {"re", "real", "re_1_s", "re_rad_s"}),
                             value_of(r, {"im", "imag", "im_1_s", "im_rad_s"})});
    section.blocks.emplace_back(std::move(roots));
    return false;  // the table follows it
  }
  const Json* t = part(object, "t_s");
  if (!t || !is_list_of_numbers(*t)) return false;
  const std::string name_key = list.front().contains("source") ? "source" : "name";
  StackedArea stack;
  stack.title = "Error budget";
  stack.x = {"time", "s"};
  stack.at = numbers(*t);
  for (const auto& source : list)
    for (const auto& [k, v] : source.items()) {
      if (!is_list_of_numbers(v) || v.size() != t->size()) continue;
      const bool variance = k.find("variance") != std::string::npos;
      Layer layer{words(source, name_key), numbers(v)};
      // Variances add; standard deviations are squared first.
      if (!variance)
        for (double& y : layer.y) y *= y;
      const auto unit = column_of_key(k).unit;
      stack.y = {"variance", variance || unit.empty() ? unit : "(" + unit + ")²"};
      stack.layers.push_back(std::move(layer));
      break;
    }
  if (stack.layers.empty()) return false;
  stack.caption =
      "Share of each source in the variance; names of the legend switch them on and off.";
  Series series;
  series.title = "Contribution of each source";
  series.caption = "One standard deviation that each source alone would cause.";
  series.x = stack.x;
  series.y = {"1 σ",
              stack.y.unit.starts_with("(") ? stack.y.unit.substr(1, stack.y.unit.size() - 4) : ""};
  series.at = stack.at;
  for (const auto& layer : stack.layers) {
    Curve curve;
    curve.name = layer.name;
    for (const double v : layer.y) curve.y.push_back(std::sqrt(v));
    series.curves.push_back(std::move(curve));
  }
  section.blocks.emplace_back(std::move(stack));
  section.blocks.emplace_back(std::move(series));
  return true;
}

// Lists of objects as tables, lists of numbers of equal length as curves.
void add_lists(Section& section, const Json& object, const std::vector<std::string>& known) {
  std::string at;
  std::vector<std::pair<std::string, const Json*>> curves;
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    if (is_list_of(value, Json::value_t::object)) {
      if (add_drawing(section, object, key, value)) continue;
      Table table;
      table.title = with_spaces(key);
      std::vector<std::string> keys;
      for (const auto& row : value)
        for (const auto& [k, v] : row.items())
          if (!is_sigma_key(row, k) && std::find(keys.begin(), keys.end(), k) == keys.end() &&
              !v.is_object())
            keys.push_back(k);
      for (const auto& k : keys) table.columns.push_back(column_of_key(k));
      for (const auto& row : value) {
        Row r;
        for (const auto& k : keys) {
          const Json* sigma = sigma_of(row, k);
          const Json* v = part(row, k);
          r.cells.push_back(
              v ? cell_of(*v, sigma && sigma->is_number() ? sigma->get<double>() : kNoValue)
                : Cell(""));
        }
        table.rows.push_back(std::move(r));
      }
      section.blocks.emplace_back(std::move(table));
    } else if (is_list_of_numbers(value) && value.size() > 12) {
      if (at.empty() && (key == "t_s" || key == "tau_s" || key == "x" || ends(key, "_s")))
        at = key;
      else
        curves.emplace_back(key, &value);
    } else if (value.is_object()) {
      for (const auto& [k, v] : value.items())
        if (is_list_of_numbers(v) && v.size() > 12) curves.emplace_back(key + " " + k, &v);
    }
  }
  if (at.empty()) return;
  Series series;
  series.x = {column_of_key(at).title, column_of_key(at).unit};
  series.at = numbers(object[at]);
  for (const auto& [key, values] : curves)
    if (values->size() == series.at.size()) {
      Curve curve;
      curve.name = column_of_key(key).title;
      curve.y = numbers(*values);
      series.y.unit = column_of_key(key).unit;
      series.curves.push_back(std::move(curve));
    }
  if (!series.curves.empty()) section.blocks.emplace_back(std::move(series));
}

std::string method_title(const std::string& key) {
  static const std::array<std::pair<std::string_view, std::string_view>, 8> kNames{
      {{"replay", "replay"},
       {"start_latitude", "start latitude"},
       {"mean_latitude", "mean latitude"},
       {"rhumb", "exact rhumb"},
       {"geodesic", "geodesic"},
       {"gauss", "Gauss plane"},
       {"least_squares", "least squares"},
       {"online", "online filter"}}};
  for (const auto& [name, title] : kNames)
    if (name == key) return std::string(title);
  return with_spaces(key);
}

std::string short_number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x == 0 ? 0.0 : std::fabs(x));
  return (x < 0 ? "−" : "") + std::string(text);
}

// How a method fits its benchmarks: further states, chi-square, residuals.
void add_fit(Section& section, const std::string& title, const Json& method) {
  const auto* residuals = part(method, "residuals");
  if (!residuals || !is_list_of(*residuals, Json::value_t::object) || residuals->empty()) return;
  KeyValues states;
  states.title = "What " + title + " found beside scale and angle";
  for (const auto& [key, value] : method.items()) {
    const Json* sigma = sigma_of(method, key);
    if (key == "k" || key == "eps_deg" || !value.is_number() || !sigma || !sigma->is_number())
      continue;
    const auto column = column_of_key(key);
    states.rows.push_back({column.title, format_number(value.get<double>(), sigma->get<double>()) +
                                             (column.unit.empty() ? "" : " " + column.unit)});
  }
  if (const double dof = number(method, "dof"); dof > 0)
    states.rows.push_back({"chi² of the residuals", short_number(number(method, "chi2")) + " of " +
                                                        short_number(dof) +
                                                        " (near it: errors as declared)"});
  if (!states.rows.empty()) section.blocks.emplace_back(std::move(states));
  Table table;
  table.title = "Residuals of " + title;
  table.caption = "Benchmark minus calibrated track.";
  table.columns = {{"benchmark", ""}, {"north", "m"}, {"east", "m"}};
  const bool heights = std::isfinite(number(residuals->front(), "up_m"));
  if (heights) table.columns.push_back({"up", "m"});
  for (const auto& r : *residuals) {
    Row row;
    row.cells.emplace_back(words(r, "name"));
    for (const char* key : {"north_m", "east_m", "up_m"}) {
      if (!heights && key[0] == 'u') continue;
      row.cells.emplace_back(number(r, key));
      row.cells.back().text = short_number(number(r, key));
    }
    table.rows.push_back(std::move(row));
  }
  section.blocks.emplace_back(std::move(table));
}

}  // namespace

Section plain_section(const Json& json, const std::string& name) {
  Section section;
  section.title = name;
  const std::vector<std::string> known{"command", "diagnostics"};
  if (json.is_object()) {
    KeyValues pairs;
    add_pairs(pairs, json, known);
    if (!pairs.rows.empty()) section.blocks.emplace_back(std::move(pairs));
    add_lists(section, json, known);
    if (const auto* d = part(json, "diagnostics")) add_diagnostics(section, *d);
  } else {
    add_lists(section, Json{{"rows", json}}, {});
  }
  return section;
}

Section calibration_section(const Json& json, const std::string& name) {
  Section section;
  section.title = "Calibration" + (name.empty() ? "" : ": " + name);
  const std::string recommended = words(json, "recommended");
  const Json* methods = part(json, "methods");
  if (methods && methods->is_object()) {
    std::string why = words(json, "recommended_why");
    if (const auto* best = part(*methods, recommended); why.empty() && best && best->is_object())
      why = words(*best, "why");
    if (const auto* best = part(*methods, recommended); best && best->is_object())
      section.blocks.emplace_back(Text{
          "Recommended: **" + method_title(recommended) + "**. Scale k = " +
              format_number(number(*best, "k"), number(*best, "k_std")) + ", mounting angle = " +
              format_number(number(*best, "eps_deg"), number(*best, "eps_std_deg")) + " deg." +
              (why.empty() ? "" : " Why: " + why + "."),
          Verdict::kGood});
    else if (part(json, "recommended"))
      section.blocks.emplace_back(Text{"No method is valid on this drive.", Verdict::kBad});
    // What compares methods; the rest of least squares stands below.
    std::vector<std::string> keys{"k",
                                  "eps_deg",
                                  "closure_m",
                                  "route_bias_k",
                                  "route_bias_eps_deg",
                                  "formula_bias_k",
                                  "formula_bias_eps_deg"};
    std::erase_if(keys, [&](const std::string& k) {
      return std::none_of(methods->begin(), methods->end(), [&](const Json& m) {
        return m.is_object() && std::isfinite(number(m, k));
      });
    });
    Table table;
    table.title = "Methods side by side";
    table.caption =
        "Each applicable method on the same drive, with one standard deviation. Route bias: what "
        "the "
        "bent way does to a chord method; formula bias: what its formula does on a straight one.";
    table.columns.push_back({"method", ""});
    for (const auto& k : keys)
      table.columns.push_back(k == "k"         ? Column{"scale k", "1"}
                              : k == "eps_deg" ? Column{"mounting angle", "deg"}
                                               : column_of_key(k));
    table.columns.push_back({"verdict", ""});
    Intervals scale, angle;
    scale.title = "Scale by method";
    scale.x = {"scale k", "1"};
    angle.title = "Mounting angle by method";
    angle.x = {"mounting angle", "deg"};
    std::vector<std::string> order;
    for (const auto& [key, method] : methods->items())
      if (method.is_object() && !method.empty()) order.push_back(key);
    std::stable_partition(order.begin(), order.end(),
                          [&](const std::string& key) { return key == recommended; });
    for (const auto& key : order) {
      const Json& m = (*methods)[key];
      const Json* valid = part(m, "valid");
      const bool good = !valid || !valid->is_boolean() || valid->get<bool>();
      Row row;
      row.highlighted = key == recommended;
      row.cells.emplace_back(method_title(key));
      for (const auto& k : keys) {
        const Json* sigma = sigma_of(m, k);
        row.cells.emplace_back(number(m, k),
                               sigma && sigma->is_number() ? sigma->get<double>() : kNoValue);
        // Beside error bars the rest needs no six digits.
        if (auto& cell = row.cells.back(); std::isnan(cell.error) && std::isfinite(cell.value))
          cell.text = short_number(cell.value);
      }
      row.cells.emplace_back(good ? "valid" : "not valid", good ? Verdict::kGood : Verdict::kBad);
      row.note = words(m, "why");
      table.rows.push_back(std::move(row));
      if (!good) continue;
      if (std::isfinite(number(m, "k")))
        scale.rows.push_back(
            {method_title(key), number(m, "k"), number(m, "k_std"), key == recommended});
      if (std::isfinite(number(m, "eps_deg")))
        angle.rows.push_back({method_title(key), number(m, "eps_deg"), number(m, "eps_std_deg"),
                              key == recommended});
    }
    section.blocks.emplace_back(std::move(table));
    if (scale.rows.size() > 1) {
      section.blocks.emplace_back(std::move(scale));
      section.blocks.emplace_back(std::move(angle));
    }
    for (const auto& key : order) add_fit(section, method_title(key), (*methods)[key]);
  }
  KeyValues pairs;
  pairs.title = "The drive";
  const std::vector<std::string> known{"command",         "methods",     "recommended",
                                       "recommended_why", "diagnostics", "against"};
  add_pairs(pairs, json, known);
  if (const auto* against = part(json, "against"); against && against->is_object()) {
    const Json* drifted = part(*against, "drifted");
    const bool bad = drifted && drifted->is_boolean() && drifted->get<bool>();
    KeyValues held;
    held.title = "Held against the certificate";
    add_pairs(held, *against, {});
    section.blocks.emplace_back(
        Text{bad ? "The constants **drifted** since the certificate was made."
                 : "The constants agree with the certificate.",
             bad ? Verdict::kBad : Verdict::kGood});
    section.blocks.emplace_back(std::move(held));
  }
  if (!pairs.rows.empty()) section.blocks.emplace_back(std::move(pairs));
  add_lists(section, json, known);
  if (const auto* d = part(json, "diagnostics")) add_diagnostics(section, *d);
  return section;
}

Section certificate_section(const Json& whole, const std::string& name) {
  Section section;
  section.title = "Certificate" + (name.empty() ? "" : ": " + name);
  // The constants may stand at the top or inside "result" or "constants".
  const Json* inner = part(whole, "certificate");
  const Json& json = inner && inner->is_object() ? *inner : whole;
  Certificate block;
  block.title = "Calibration certificate" +
                (words(json, "vehicle").empty() ? "" : " of " + words(json, "vehicle"));
  const Json* valid = part(json, "valid");
  const bool good = !valid || !valid->is_boolean() || valid->get<bool>();
  block.verdict = good ? Verdict::kGood : Verdict::kBad;
  block.verdict_text = good ? "valid" : "not valid";
  const auto take = [&](const Json& object) {
    for (const auto& [key, value] : object.items()) {
      const Json* sigma = sigma_of(object, key);
      if (!value.is_number() || !sigma || !sigma->is_number()) continue;
      const auto column = key == "k"         ? Column{"scale k", ""}
                          : key == "eps_deg" ? Column{"mounting angle", "deg"}
                                             : column_of_key(key);
      block.constants.push_back(
          {column.title, value.get<double>(), sigma->get<double>(), column.unit});
    }
  };
  take(json);
  for (const char* key : {"result", "constants", "estimate"})
    if (const auto* r = part(json, key); r && r->is_object()) take(*r);
  const Json* methods = part(json, "methods");
  // Constants as a list: [{"name", "value", "std", "unit"}].
  for (const char* key : {"constants", "states", "parameters"})
    if (const auto* list = part(json, key); list && is_list_of(*list, Json::value_t::object))
      for (const auto& c : *list)
        block.constants.push_back(
            {words(c, "name"), number(c, "value"), number(c, "std"), words(c, "unit")});
  for (const char* key : {"correlation", "covariance"})
    if (const auto* matrix = part(json, key);
        matrix && is_list_of(*matrix, Json::value_t::array) && block.correlation.empty()) {
      for (const auto& row : *matrix) block.correlation.push_back(numbers(row));
      if (std::string_view(key) == "covariance") {
        const auto c = block.correlation;
        for (std::size_t i = 0; i < c.size(); ++i)
          for (std::size_t j = 0; j < c[i].size() && j < c.size(); ++j)
            block.correlation[i][j] = i < c[i].size() && j < c[j].size()
                                          ? c[i][j] / std::sqrt(c[i][i] * c[j][j])
                                          : kNoValue;
      }
    }
  if (block.correlation.empty() && block.constants.size() >= 2)
    if (const double r = number(json, "correlation"); std::isfinite(r))
      block.correlation = {{1, r}, {r, 1}};
  if (block.correlation.size() != block.constants.size()) block.correlation.clear();
  KeyValues rest;
  const auto is_constant = [&](const Json& object, const std::string& key) {
    return sigma_of(object, key) != nullptr;
  };
  Json others = Json::object();
  for (const auto& [key, value] : json.items())
    if (!is_constant(json, key) && !is_sigma_key(json, key) && key != "covariance" &&
        key != "diagnostics" && key != "result" && key != "constants" && key != "methods" &&
        key != "recommended" && key != "recommended_why" && key != "command" && key != "format" &&
        key != "valid" && !value.is_null() && !(key == "name" && json.contains("vehicle")))
      others[key] = value;
  add_pairs(rest, others, {"correlation"});
  block.rows = rest.rows;
  section.blocks.emplace_back(std::move(block));
  add_lists(section, others, {"states", "parameters"});
  // How it came about: the methods on its drive.
  if (methods && methods->is_object()) {
    Json drive = Json::object();
    for (const char* key : {"methods", "recommended", "recommended_why"})
      if (const auto* p = part(json, key)) drive[key] = *p;
    for (auto& b : calibration_section(drive, "").blocks) section.blocks.push_back(std::move(b));
  }
  if (const auto* d = part(json, "diagnostics")) add_diagnostics(section, *d);
  return section;
}

Section evaluation_section(const Json& json, const std::string& name) {
  Section section;
  section.title = "Evaluation" + (name.empty() ? "" : ": " + name);
  if (const auto* require = part(json, "require"); require && require->is_array())
    for (const auto& r : *require) {
      const Json* met = part(r, "met");
      const bool ok = met && met->is_boolean() && met->get<bool>();
      section.blocks.emplace_back(
          Text{"Required `" + words(r, "require") + "`: " + (ok ? "met." : "**missed**."),
               ok ? Verdict::kGood : Verdict::kBad});
    }
  Table table;
  table.title = "Errors";
  table.columns = {{"quantity", ""}, {"value", ""}, {"unit", ""}};
  for (const auto& [key, value] : json.items()) {
    if (!value.is_number()) continue;
    const auto column = column_of_key(key);
    table.rows.push_back({{Cell(column.title), Cell(value.get<double>()), Cell(column.unit)}});
  }
  section.blocks.emplace_back(std::move(table));
  add_lists(section, json, {"command", "require", "diagnostics"});
  if (const auto* d = part(json, "diagnostics")) add_diagnostics(section, *d);
  return section;
}

Section reproduction_section(const Json& json, const std::string& name) {
  Section section;
  section.title = name.empty() ? "Reproduction of the papers" : name;
  const Json* list = json.is_array() ? &json : part(json, "checks");
  if (!list || !list->is_array()) return plain_section(json, name);
  std::vector<std::string> papers;
  int reproduced = 0, corrected = 0, failed = 0;
  for (const auto& check : *list) {
    const std::string verdict = words(check, "verdict"), paper = words(check, "paper");
    reproduced += verdict == "reproduced";
    corrected += verdict == "corrected";
    failed += verdict == "failed";
    if (std::find(papers.begin(), papers.end(), paper) == papers.end()) papers.push_back(paper);
  }
  section.blocks.emplace_back(
      Text{std::to_string(reproduced) + " values reproduced, " + std::to_string(corrected) +
               " corrected (the printed value is in error), " +
               (failed ? "**" + std::to_string(failed) + " failed**." : "none failed."),
           failed ? Verdict::kBad : Verdict::kGood});
  for (const auto& paper : papers) {
    Table table;
    table.title = paper;
    table.caption =
        "Each printed value beside ours. Corrected: the print is in error, and the note says why.";
    table.columns = {{"id", ""},   {"quantity", ""},  {"printed", ""},
                     {"ours", ""}, {"tolerance", ""}, {"verdict", ""}};
    for (const auto& check : *list) {
      if (words(check, "paper") != paper) continue;
      const std::string verdict = words(check, "verdict");
      const auto value = [&](const char* key) {
        const Json* v = part(check, key);
        return v ? cell_of(*v) : Cell("");
      };
      Row row;
      row.cells = {value("id"),
                   value("quantity"),
                   value("printed"),
                   value("ours"),
                   value("tolerance"),
                   Cell(verdict, verdict == "failed"      ? Verdict::kBad
                                 : verdict == "corrected" ? Verdict::kNote
                                                          : Verdict::kGood)};
      row.note = words(check, "note");
      table.rows.push_back(std::move(row));
    }
    section.blocks.emplace_back(std::move(table));
  }
  return section;
}

Section allan_section(const Json& json, const std::string& name) {
  Section section;
  section.title = "Allan deviation" + (name.empty() ? "" : ": " + name);
  Table table;
  table.title = "Fitted noise coefficients";
  table.caption = "In data-sheet units, with one standard deviation.";
  std::vector<std::string> keys;
  std::vector<std::pair<std::string, const Json*>> axes;
  // Axes as an object of objects or as a list, at the top or one level down.
  const auto visit = [&](const std::string& key, const Json& value) {
    if (!value.is_object()) return;
    bool noise = false;
    for (const auto& [k, v] : value.items())
      noise = noise || k.find("random_walk") != std::string::npos ||
              k.find("bias_instability") != std::string::npos || k == "tau_s";
    if (noise)
      axes.emplace_back(words(value, "axis").empty() ? with_spaces(key) : words(value, "axis"),
                        &value);
  };
  const auto visit_all = [&](const Json& object) {
    if (object.is_object())
      for (const auto& [k, v] : object.items()) visit(k, v);
    else if (object.is_array())
      for (const auto& v : object) visit("", v);
  };
  visit_all(json);
  if (json.is_object())
    for (const auto& [k, v] : json.items()) visit_all(v);
  if (axes.empty()) return plain_section(json, section.title);
  for (const auto& [axis, a] : axes)
    for (const auto& [k, v] : a->items())
      if (v.is_number() && !is_sigma_key(*a, k) &&
          std::find(keys.begin(), keys.end(), k) == keys.end())
        keys.push_back(k);
  table.columns.push_back({"axis", ""});
  for (const auto& k : keys) table.columns.push_back(column_of_key(k));
  for (const auto& [axis, a] : axes) {
    Row row;
    row.cells.emplace_back(axis);
    for (const auto& k : keys) {
      const Json* sigma = sigma_of(*a, k);
      row.cells.emplace_back(number(*a, k),
                             sigma && sigma->is_number() ? sigma->get<double>() : kNoValue);
    }
    table.rows.push_back(std::move(row));
  }
  section.blocks.emplace_back(std::move(table));
  // One figure for each unit of deviation.
  std::vector<std::pair<std::string, Series>> figures;
  for (const auto& [axis, a] : axes) {
    const Json* tau = part(*a, "tau_s");
    if (!tau) tau = part(json, "tau_s");
    if (!tau || !is_list_of_numbers(*tau)) continue;
    for (const auto& [k, v] : a->items()) {
      if (k == "tau_s" || !is_list_of_numbers(v) || v.size() != tau->size()) continue;
      const auto column = column_of_key(k);
      const bool fit = k.find("fit") != std::string::npos, low = k.find("low") != std::string::npos,
                 high = k.find("high") != std::string::npos;
      if (low || high) continue;
      auto at = std::find_if(figures.begin(), figures.end(),
                             [&](const auto& f) { return f.first == column.unit; });
      if (at == figures.end()) {
        Series s;
        s.title = "Deviation over averaging time";
        s.caption =
            "Measured deviation of each axis (dots, with its confidence band where known) and the "
            "fitted noise model (dashed).";
        s.x = {"averaging time", "s", true};
        s.y = {"Allan deviation", column.unit, true};
        figures.emplace_back(column.unit, std::move(s));
        at = figures.end() - 1;
      }
      Curve curve;
      curve.name = axis + (fit ? " fit" : "");
      curve.source = axis;
      curve.style = fit ? Style::kDashed : Style::kLinePoints;
      curve.x = numbers(*tau);
      curve.y = numbers(v);
      if (!fit)
        for (const auto& [l, lo] : a->items())
          if (l.find("low") != std::string::npos && lo.size() == v.size())
            for (const auto& [h, hi] : a->items())
              if (h.find("high") != std::string::npos && hi.size() == v.size())
                curve.lo = numbers(lo), curve.hi = numbers(hi);
      at->second.curves.push_back(std::move(curve));
    }
  }
  for (auto& [unit, figure] : figures) section.blocks.emplace_back(std::move(figure));
  if (const auto* d = part(json, "diagnostics")) add_diagnostics(section, *d);
  return section;
}

Section result_section(const Json& json, const std::string& name) {
  if (is_filter_result(json)) return filter_section(json, name);
  switch (kind_of(json)) {
    case ResultKind::kCertificate:
      return certificate_section(json, name);
    case ResultKind::kCalibrate:
      return calibration_section(json, name);
    case ResultKind::kEvaluate:
      return evaluation_section(json, name);
    case ResultKind::kReproduce:
      return reproduction_section(json, "");
    case ResultKind::kAllan: {
      // Points as `loxo allan` writes them; other shapes as far as they are understood.
      const Json* axes = part(json, "axes");
      const bool ours = axes && axes->is_object() && !axes->empty() && axes->begin()->is_object() &&
                        axes->begin()->contains("points");
      return ours ? allan_log_section(json, name) : allan_section(json, name);
    }
    case ResultKind::kStatic:
      if (json.contains("responses")) return static_response_section(json, name);
      break;
    case ResultKind::kRoots:
      if (json.contains("roots")) return roots_section(json, name);
      break;
    case ResultKind::kBudget:
      if (json.contains("total_m")) return budget_section(json, name);
      break;
    case ResultKind::kOdometer:
      return odometer_section(json, name);
    default:
      break;
  }
  return plain_section(json, name);
}

}  // namespace loxo::report
