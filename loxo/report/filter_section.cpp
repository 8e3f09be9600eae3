// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/filter_section.hpp"

#include <cmath>

#include "loxo/report/json_parts.hpp"
#include "loxo/report/json_sections.hpp"
#include "loxo/report/page_html.hpp"

namespace loxo::report {
namespace {

std::vector<double> column(const Json& rows, const char* key) {
  std::vector<double> out;
  for (const auto& r : rows) out.push_back(number(r, key));
  return out;
}

// To so many digits: a table is read, not computed with.
double rounded(double x, int digits) {
  if (!std::isfinite(x) || x == 0) return x;
  const double unit = std::pow(10.0, std::floor(std::log10(std::fabs(x))) - digits + 1);
  return std::round(x / unit) * unit;
}

Table constants_table(const Json& constants) {
  Table t;
  t.title = "Constants at the end";
  t.columns = {{"constant", ""}, {"value", "± 1 sigma"}, {"unit", ""}};
  for (const auto& [key, value] : constants.items()) {
    if (key.ends_with("_std") || !value.is_number()) continue;
    const Column c = column_of_key(key);
    t.rows.push_back(
        {{Cell(c.title), Cell(value.get<double>(), number(constants, (key + "_std").c_str())),
          Cell(c.unit)}});
  }
  return t;
}

Table innovations_table(const Json& innovations) {
  Table t;
  t.title = "Innovations";
  t.caption =
      "NIS is the mean of y²/S; of white innovations with a true S it lies in the band with 95 %. "
      "Robust weights enter with the unweighted S. Lag one: correlation of one innovation with the "
      "next.";
  t.columns = {{"sensor", ""},      {"used", ""},    {"weighted down", ""},
               {"rejected", ""},    {"NIS", "mean"}, {"band", "95 %"},
               {"above 95 %", "%"}, {"lag one", ""}, {"verdict", ""}};
  for (const auto& [name, s] : innovations.items()) {
    const double nis = number(s, "nis_mean"), low = number(s, "nis_low"),
                 high = number(s, "nis_high"), lag = number(s, "lag_one");
    const double n = number(s, "used") + number(s, "deweighted") + number(s, "rejected");
    const bool coloured = std::fabs(lag) > 2 / std::sqrt(n);
    std::string verdict = nis < low    ? "calmer than stated"
                          : nis > high ? "wider than stated"
                                       : "as stated";
    if (coloured) verdict += ", coloured";
    t.rows.push_back(
        {{Cell(with_spaces(name)), Cell(number(s, "used")), Cell(number(s, "deweighted")),
          Cell(number(s, "rejected")), Cell(rounded(nis, 3)),
          Cell(format_number(low, kNoValue, 3) + " … " + format_number(high, kNoValue, 3)),
          Cell(rounded(100 * number(s, "nis_above_95"), 2)), Cell(rounded(lag, 2)),
          Cell(verdict, nis > high ? Verdict::kBad : Verdict::kNone)}});
  }
  return t;
}

}  // namespace

bool is_filter_result(const Json& json) {
  return json.is_object() && words(json, "command") == "navigate" && json.contains("innovations") &&
         json.contains("constants");
}

Section filter_section(const Json& json, const std::string& name) {
  Section section;
  section.title = (words(json, "mode") == "smooth" ? "Smoother" : "Filter") +
                  (name.empty() ? std::string() : ": " + name);
  if (const auto it = json.find("diverged"); it != json.end() && it->is_boolean() && *it)
    section.blocks.emplace_back(
        Text{"The filter **diverged**: its innovations contradict it. Rows up to there are kept.",
             Verdict::kBad});
  std::vector<Span> spans;
  if (const auto it = json.find("segments"); it != json.end() && it->is_array()) {
    Table t;
    t.title = "Which source was trusted, and why";
    t.columns = {{"from", "s"}, {"to", "s"}, {"length", "s"}, {"trusted", ""}, {"why", ""}};
    // What a result of an older program, or of a drive without wheel, does not say is not shown.
    const bool more = !it->empty() && it->front().contains("radius_95_m");
    if (more)
      for (const Column& c :
           {Column{"fixes", ""}, Column{"wheel", "readings"}, Column{"left out", "readings"},
            Column{"95 % radius", "m, at its end"}})
        t.columns.push_back(c);
    for (const auto& s : *it) {
      const double a = number(s, "begin_s"), b = number(s, "end_s");
      t.rows.push_back({{Cell(rounded(a, 5)), Cell(rounded(b, 5)), Cell(rounded(b - a, 4)),
                         Cell(words(s, "trusted")), Cell(words(s, "why"))}});
      if (more)
        for (const char* key : {"fixes", "wheel_readings", "wheel_left_out", "radius_95_m"})
          t.rows.back().cells.emplace_back(rounded(number(s, key), 3 + (*key != 'r')));
      if (words(s, "trusted") != "odometer") spans.push_back({a, b, words(s, "trusted")});
    }
    section.blocks.emplace_back(std::move(t));
  }
  if (const auto it = json.find("history"); it != json.end() && it->is_array() && !it->empty()) {
    const Json& h = *it;
    const std::vector<double> at = column(h, "t_s");
    struct Shown {
      const char *key, *std, *title, *unit;
    };
    for (const Shown& s :
         {Shown{"k", "k_std", "Odometer scale", ""},
          Shown{"eps_deg", "eps_std_deg", "Heading mounting", "deg"},
          Shown{"pitch_mounting_deg", "pitch_mounting_std_deg", "Pitch mounting", "deg"},
          Shown{"delay_s", "delay_std_s", "Odometer delay", "s"},
          Shown{"speed_offset_mps", "speed_offset_std_mps", "Offset of the speed reading", "m/s"},
          Shown{"gyro_bias_up_deg_h", "gyro_bias_up_std_deg_h", "Up gyro bias", "deg/h"}}) {
      const std::vector<double> y = column(h, s.key), sd = column(h, s.std);
      bool moves = false;
      for (double x : sd) moves = moves || x > 0;
      if (!moves) continue;
      Curve c;
      c.name = s.title;
      c.y = y;
      for (std::size_t i = 0; i < y.size(); ++i) {
        c.lo.push_back(y[i] - 2 * sd[i]);
        c.hi.push_back(y[i] + 2 * sd[i]);
      }
      Series f;
      f.title = s.title;
      f.caption = "The band is two sigma.";
      // What the second half of the drive knows, drawn large: the start's band may be a hundred
      // times as wide.
      double low = kNoValue, high = kNoValue, widest = 0;
      for (std::size_t i = 0; i < y.size(); ++i) {
        widest = std::fmax(widest, c.hi[i] - c.lo[i]);
        if (2 * i < y.size()) continue;
        low = std::fmin(low, c.lo[i]), high = std::fmax(high, c.hi[i]);
      }
      if (widest > 6 * (high - low)) {
        f.y.lo = low - (high - low), f.y.hi = high + (high - low);
        f.caption += " At the start it reaches beyond the picture: ± " +
                     format_number(widest / 2, kNoValue, 2) +
                     (*s.unit ? std::string(" ") + s.unit : std::string()) + ".";
      }
      f.x = {"time", "s"};
      f.y.label = s.title, f.y.unit = s.unit;
      f.at = at;
      f.curves.push_back(std::move(c));
      f.sync = "filter";
      f.half = true;
      f.spans = spans;
      section.blocks.emplace_back(std::move(f));
    }
  }
  if (const auto it = json.find("innovation_history");
      it != json.end() && it->is_object() && it->contains("t_s")) {
    Series f;
    f.title = "Innovations over time";
    f.caption =
        "Mean of y²/S in each stretch, per sensor; 1 is what the stated sigmas promise. Shaded: "
        "stretches not carried by the odometer.";
    f.x = {"time", "s"};
    f.y = {"NIS", ""};
    f.y.log = true;
    for (const auto& x : it->at("t_s")) f.at.push_back(x.get<double>());
    for (const auto& [sensor, values] : it->items()) {
      if (sensor == "t_s") continue;
      Curve c;
      c.name = with_spaces(sensor);
      c.style = Style::kLinePoints;
      for (const auto& x : values)
        c.y.push_back(x.is_number() && x.get<double>() > 0 ? x.get<double>() : kNoValue);
      f.curves.push_back(std::move(c));
    }
    f.marks.push_back({1.0, "as stated", true});
    f.spans = spans;
    f.sync = "filter";
    section.blocks.emplace_back(std::move(f));
  }
  section.blocks.emplace_back(innovations_table(json.at("innovations")));
  section.blocks.emplace_back(constants_table(json.at("constants")));
  for (const auto& [key, title] :
       {std::pair<const char*, const char*>{"alignment", "Alignment"},
        {"events", "What it noticed"},
        {"settings", "Settings, by rule from what the drive declares"}}) {
    const auto it = json.find(key);
    if (it == json.end() || !it->is_object() || it->empty()) continue;
    KeyValues k;
    k.title = title;
    for (const auto& [name_of, value] : it->items()) {
      const Column c = column_of_key(name_of);
      std::string text = value.is_string()   ? value.get<std::string>()
                         : value.is_number() ? format_number(value.get<double>())
                                             : std::string();
      if (text.empty()) continue;
      if (!c.unit.empty() && value.is_number()) text += " " + c.unit;
      k.rows.emplace_back(c.title, text);
    }
    section.blocks.emplace_back(std::move(k));
  }
  if (const auto it = json.find("diagnostics"); it != json.end()) add_diagnostics(section, *it);
  return section;
}

}  // namespace loxo::report
