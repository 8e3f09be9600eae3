// SPDX-License-Identifier: Apache-2.0
// A unit is read as an expression (products, quotients, powers, roots of named units), so that
// every combination an engineer writes is understood without a list of combinations.
#include "loxo/text/quantity.hpp"

#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

// Exponents of metre, second, radian, kelvin and pulse, in halves (deg/sqrt(h) is s^-1/2).
using Halves = std::array<int, 5>;
struct Unit {
  double factor = 1;
  Halves dim{};
};

struct NamedUnit {
  std::string_view name;
  double factor;
  Halves dim;
};
constexpr Halves kPure{}, kM{2}, kS{0, 2}, kRad{0, 0, 2}, kK{0, 0, 0, 2}, kPulse{0, 0, 0, 0, 2},
    kPerS{0, -2}, kMps{2, -2}, kMps2{2, -4}, kRadps{0, -2, 2};

constexpr NamedUnit kUnits[] = {
    {"deg", deg, kRad},
    {"°", deg, kRad},
    {"degree", deg, kRad},
    {"degrees", deg, kRad},
    {"rad", 1, kRad},
    {"radian", 1, kRad},
    {"radians", 1, kRad},
    {"mrad", 1e-3, kRad},
    {"urad", 1e-6, kRad},
    {"µrad", 1e-6, kRad},
    {"μrad", 1e-6, kRad},
    {"nrad", 1e-9, kRad},
    {"mil", mil, kRad},
    {"mils", mil, kRad},
    {"arcmin", arcmin, kRad},
    {"'", arcmin, kRad},
    {"′", arcmin, kRad},
    {"arcsec", arcsec, kRad},
    {"\"", arcsec, kRad},
    {"″", arcsec, kRad},
    {"''", arcsec, kRad},
    {"mas", arcsec * 1e-3, kRad},
    {"gon", kPi / 200, kRad},
    {"rev", 2 * kPi, kRad},
    {"turn", 2 * kPi, kRad},
    {"m", 1, kM},
    {"metre", 1, kM},
    {"meter", 1, kM},
    {"metres", 1, kM},
    {"meters", 1, kM},
    {"km", 1e3, kM},
    {"cm", 1e-2, kM},
    {"mm", 1e-3, kM},
    {"um", 1e-6, kM},
    {"µm", 1e-6, kM},
    {"μm", 1e-6, kM},
    {"ft", 0.3048, kM},
    {"inch", 0.0254, kM},
    {"mi", 1609.344, kM},
    {"mile", 1609.344, kM},
    {"nmi", 1852, kM},
    {"NM", 1852, kM},
    {"s", 1, kS},
    {"sec", 1, kS},
    {"second", 1, kS},
    {"seconds", 1, kS},
    {"ms", 1e-3, kS},
    {"us", 1e-6, kS},
    {"µs", 1e-6, kS},
    {"μs", 1e-6, kS},
    {"ns", 1e-9, kS},
    {"min", minute, kS},
    {"h", hour, kS},
    {"hr", hour, kS},
    {"hour", hour, kS},
    {"hours", hour, kS},
    {"d", 86400, kS},
    {"day", 86400, kS},
    {"days", 86400, kS},
    {"mps", 1, kMps},
    {"kmh", 1 / 3.6, kMps},
    {"kph", 1 / 3.6, kMps},
    {"mph", 0.44704, kMps},
    {"kn", knot, kMps},
    {"kt", knot, kMps},
    {"kts", knot, kMps},
    {"knot", knot, kMps},
    {"knots", knot, kMps},
    {"g", g_standard, kMps2},
    {"mg", mg, kMps2},
    {"ug", ug, kMps2},
    {"µg", ug, kMps2},
    {"μg", ug, kMps2},
    {"ng", ug * 1e-3, kMps2},
    {"Gal", 1e-2, kMps2},
    {"mGal", 1e-5, kMps2},
    {"uGal", 1e-8, kMps2},
    {"mps2", 1, kMps2},
    {"dps", deg, kRadps},
    {"dph", deg_per_h, kRadps},
    {"radps", 1, kRadps},
    {"degps", deg, kRadps},
    {"rpm", 2 * kPi / 60, kRadps},
    {"Hz", 1, kPerS},
    {"kHz", 1e3, kPerS},
    {"MHz", 1e6, kPerS},
    {"%", 1e-2, kPure},
    {"percent", 1e-2, kPure},
    {"‰", 1e-3, kPure},
    {"ppm", 1e-6, kPure},
    {"ppb", 1e-9, kPure},
    {"1", 1, kPure},
    {"K", 1, kK},
    {"°C", 1, kK},
    {"degC", 1, kK},
    {"pulse", 1, kPulse},
    {"pulses", 1, kPulse},
    {"tick", 1, kPulse},
    {"ticks", 1, kPulse},
    {"count", 1, kPulse},
    {"counts", 1, kPulse},
};

struct DimensionEntry {
  Dimension d;
  Halves dim;
  std::string_view name, example;
};
constexpr DimensionEntry kDimensions[] = {
    {Dimension::kNone, kPure, "a pure number", "0.1 %, 300 ppm or 1e-3"},
    {Dimension::kLength, kM, "a length", "m, km, ft"},
    {Dimension::kTime, kS, "a time", "s, ms, min, h"},
    {Dimension::kAngle, kRad, "an angle", "deg, rad, arcmin, mil"},
    {Dimension::kSpeed, kMps, "a speed", "m/s, km/h, kn"},
    {Dimension::kAcceleration, kMps2, "an acceleration", "m/s^2, mg, ug"},
    {Dimension::kAngularRate, kRadps, "an angular rate", "deg/h, deg/s, rad/s"},
    {Dimension::kFrequency, kPerS, "a frequency", "Hz, kHz"},
    {Dimension::kTemperature, kK, "a temperature", "K, degC"},
    {Dimension::kAngleRandomWalk,
     {0, -1, 2},
     "an angle random walk",
     "deg/sqrt(h), deg/h/sqrt(Hz)"},
    {Dimension::kVelocityRandomWalk, {2, -3}, "a velocity random walk", "m/s/sqrt(h), ug/sqrt(Hz)"},
    {Dimension::kRateRandomWalk, {0, -3, 2}, "a rate random walk", "deg/h/sqrt(h)"},
    {Dimension::kAccelerationRandomWalk,
     {2, -5},
     "an acceleration random walk",
     "m/s^2/sqrt(s), ug/sqrt(h)"},
    {Dimension::kScaleRandomWalk, {0, -1}, "a scale random walk", "1/sqrt(s), ppm/sqrt(h)"},
    {Dimension::kDistanceRandomWalk, {1}, "a distance random walk", "m/sqrt(m), m/sqrt(km)"},
    {Dimension::kLengthPerPulse, {2, 0, 0, 0, -2}, "a length per pulse", "m/pulse, mm/pulse"},
    {Dimension::kGSensitivity, {-2, 2, 2}, "a g-sensitivity", "deg/h/g"},
    {Dimension::kRatePerTemperature, {0, -2, 2, -2}, "an angular rate per temperature", "deg/h/K"},
    {Dimension::kAccelPerTemperature, {2, -4, 0, -2}, "an acceleration per temperature", "ug/K"},
    {Dimension::kLengthNoise, {2, -1}, "a length noise", "m/sqrt(s), m/sqrt(h)"},
};
const DimensionEntry& entry(Dimension d) {
  for (const auto& e : kDimensions) {
    if (e.d == d) return e;
  }
  return kDimensions[0];
}
const DimensionEntry* entry_of(const Halves& dim) {
  for (const auto& e : kDimensions) {
    if (e.dim == dim) return &e;
  }
  return nullptr;
}

std::vector<std::string> unit_names() {
  std::vector<std::string> names;
  for (const auto& u : kUnits) {
    if (u.name != "1") names.emplace_back(u.name);
  }
  for (const char* compound : {"m/s", "km/h", "m/s^2", "deg/h", "deg/s", "rad/s", "deg/sqrt(h)",
                               "deg/h/sqrt(Hz)", "ug/sqrt(Hz)", "m/s/sqrt(h)", "m/pulse", "deg/h/g",
                               "deg/h/sqrt(h)", "mm/pulse", "cm/pulse"}) {
    names.emplace_back(compound);
  }
  return names;
}

bool starts(std::string_view s, std::string_view with) { return s.substr(0, with.size()) == with; }
void skip_space(std::string_view& s) {
  for (;;) {
    if (!s.empty() && (s[0] == ' ' || s[0] == '\t')) {
      s.remove_prefix(1);
    } else if (starts(s, "\u00a0") ||
               starts(s, "\u202f")) {  // no-break spaces, as word processors put them
      s.remove_prefix(starts(s, "\u00a0") ? 2 : 3);
    } else {
      return;
    }
  }
}
std::string_view trim(std::string_view s) {
  skip_space(s);
  while (!s.empty() &&
         (s.back() == ' ' || s.back() == '\t' || s.back() == '\r' || s.back() == '\n'))
    s.remove_suffix(1);
  return s;
}

[[noreturn]] void unknown_unit(std::string_view unit, std::string_view where) {
  static const std::vector<std::string> names = unit_names();
  const std::string near = nearest(unit, names);
  throw Error(ErrorKind::kInput,
              "unknown unit '" + std::string(unit) + "'" +
                  (near.empty() ? "" : "; did you mean '" + near + "'?"),
              std::string(where));
}

Unit power(const Unit& u, int halves) {
  Unit r;
  r.factor = std::pow(u.factor, halves / 2.0);
  for (std::size_t i = 0; i < 5; ++i) {
    if (u.dim[i] * halves % 2 != 0)
      return Unit{std::nan(""), {}};  // a quarter power: no unit of ours
    r.dim[i] = u.dim[i] * halves / 2;
  }
  return r;
}
Unit product(const Unit& a, const Unit& b) {
  Unit r{a.factor * b.factor, a.dim};
  for (std::size_t i = 0; i < 5; ++i) r.dim[i] += b.dim[i];
  return r;
}

// factor = name [power] | sqrt(expr) | √name | (expr); false where the text is no unit.
class UnitParser {
 public:
  explicit UnitParser(std::string_view text) : s_(text) {}
  bool all(Unit& u) {
    return expression(u, 0) && (skip_space(s_), s_.empty()) && std::isfinite(u.factor);
  }

 private:
  bool expression(Unit& u, int depth) {
    if (depth > 8 || !factor(u, depth)) return false;
    for (;;) {
      skip_space(s_);
      bool divide = false;
      if (starts(s_, "/")) {
        divide = true;
        s_.remove_prefix(1);
      } else if (starts(s_, "*")) {
        s_.remove_prefix(1);
      } else if (starts(s_, "·") || starts(s_, "⋅")) {
        s_.remove_prefix(starts(s_, "·") ? 2 : 3);
      } else if (s_.empty() || s_[0] == ')') {
        return true;
      }  // else a space between factors: a product
      Unit v;
      if (!factor(v, depth)) return false;
      u = product(u, power(v, divide ? -2 : 2));
    }
  }
  bool factor(Unit& u, int depth) {
    skip_space(s_);
    if (starts(s_, "(")) {
      s_.remove_prefix(1);
      if (!expression(u, depth + 1) || !close()) return false;
    } else if (starts(s_, "√")) {
      s_.remove_prefix(3);
      if (!factor(u, depth + 1)) return false;
      u = power(u, 1);
      return std::isfinite(u.factor);
    } else if (starts(s_, "sqrt") || starts(s_, "rt")) {
      s_.remove_prefix(starts(s_, "sqrt") ? 4 : 2);
      if (starts(s_, "-") || starts(s_, "_")) s_.remove_prefix(1);
      if (!factor(u, depth + 1)) return false;
      u = power(u, 1);
      return std::isfinite(u.factor);
    } else if (!name(u)) {
      return false;
    }
    const int p = exponent();
    if (p == 0) return false;
    u = power(u, 2 * p);
    return true;
  }
  bool close() {
    skip_space(s_);
    if (!starts(s_, ")")) return false;
    s_.remove_prefix(1);
    return true;
  }
  // The longest known name here that ends where a name may end.
  bool name(Unit& u) {
    const NamedUnit* best = nullptr;
    for (const auto& n : kUnits) {
      if (!starts(s_, n.name) || (best != nullptr && n.name.size() < best->name.size())) continue;
      const std::string_view rest = s_.substr(n.name.size());
      if (!rest.empty() &&
          ((rest[0] >= 'a' && rest[0] <= 'z') || (rest[0] >= 'A' && rest[0] <= 'Z')))
        continue;
      best = &n;
    }
    if (best == nullptr) return false;
    u = Unit{best->factor, best->dim};
    s_.remove_prefix(best->name.size());
    return true;
  }
  // ^2, **2, 2 (m/s2), ², ⁻¹; 1 where none; 0 for what cannot be one.
  int exponent() {
    if (starts(s_, "²")) return s_.remove_prefix(2), 2;
    if (starts(s_, "³")) return s_.remove_prefix(2), 3;
    if (starts(s_, "⁻¹")) return s_.remove_prefix(5), -1;
    if (starts(s_, "⁻²")) return s_.remove_prefix(5), -2;
    const bool caret = starts(s_, "^"), stars = starts(s_, "**");
    if (caret || stars) {
      s_.remove_prefix(caret ? 1 : 2);
      bool minus = false;
      if (starts(s_, "-")) {
        minus = true;
        s_.remove_prefix(1);
      }
      if (s_.empty() || s_[0] < '1' || s_[0] > '4') return 0;
      const int p = s_[0] - '0';
      s_.remove_prefix(1);
      return minus ? -p : p;
    }
    if (!s_.empty() && (s_[0] == '2' || s_[0] == '3')) {
      const int p = s_[0] - '0';
      s_.remove_prefix(1);
      return p;
    }
    return 1;
  }
  std::string_view s_;
};

std::optional<Unit> find_unit(std::string_view text) {
  text = trim(text);
  Unit u;
  if (text.empty() || !UnitParser(text).all(u)) return std::nullopt;
  return u;
}

double factor_for(std::string_view unit, Dimension d, std::string_view where,
                  std::string_view whole) {
  const auto u = find_unit(unit);
  if (!u) unknown_unit(unit, where);
  const DimensionEntry& wanted = entry(d);
  if (u->dim == wanted.dim) return u->factor;
  const DimensionEntry* found = entry_of(u->dim);
  throw Error(
      ErrorKind::kInput,
      "expected " + std::string(wanted.name) + " (" + std::string(wanted.example) + "), found '" +
          std::string(whole) + "', " +
          (found != nullptr ? std::string(found->name) : std::string("of another dimension")),
      std::string(where));
}

// A number at the front of s, which moves on; false where there is none.
bool take_number(std::string_view& s, double& x) {
  skip_space(s);
  std::string_view t = s;
  bool negative = false;
  if (starts(t, "+")) {
    t.remove_prefix(1);
  } else if (starts(t, "−")) {  // the typographic minus
    negative = true;
    t.remove_prefix(3);
  } else if (starts(t, "-")) {
    negative = true;
    t.remove_prefix(1);
  }
  // from_chars also reads "inf", "nan": names, not numbers, here.
  if (t.empty() || ((t[0] < '0' || t[0] > '9') && t[0] != '.')) return false;
  const auto [end, error] = std::from_chars(t.data(), t.data() + t.size(), x);
  if (error != std::errc()) return false;
  if (negative) x = -x;
  s = t.substr(static_cast<std::size_t>(end - t.data()));
  return true;
}

bool begins_number(std::string_view s) {
  double x;
  return take_number(s, x);
}

[[noreturn]] void bare(std::string_view text, Dimension d, std::string_view where) {
  const DimensionEntry& e = entry(d);
  throw Error(ErrorKind::kInput,
              "'" + std::string(text) + "' has no unit; expected " + std::string(e.name) +
                  " with its unit (" + std::string(e.example) + ")",
              std::string(where));
}
[[noreturn]] void no_number(std::string_view text, Dimension d, std::string_view where) {
  const DimensionEntry& e = entry(d);
  throw Error(ErrorKind::kInput,
              "'" + std::string(text) + "' is not a number; expected " + std::string(e.name) +
                  (d == Dimension::kNone ? "" : " with its unit (" + std::string(e.example) + ")"),
              std::string(where));
}

}  // namespace

std::string_view dimension_name(Dimension d) { return entry(d).name; }

double parse_quantity(std::string_view text, Dimension d, std::string_view where) {
  const std::string_view whole = trim(text);
  std::string_view s = whole;
  double x = 0;
  if (!take_number(s, x)) no_number(whole, d, where);
  s = trim(s);
  if (s.empty()) {
    if (d != Dimension::kNone) bare(whole, d, where);
    return x;
  }
  if (d == Dimension::kAngle) {
    // Degrees, minutes and seconds: 45° 30' 15.5"
    double sum = 0;
    const double sign = whole[0] == '-' || starts(whole, "−") ? -1.0 : 1.0;
    int parts = 0;
    std::string_view t = whole;
    for (;;) {
      double part = 0;
      if (!take_number(t, part)) break;
      skip_space(t);
      double factor = 0;
      std::size_t length = 0;
      for (const std::string_view unit : {"°", "deg", "''", "′", "'", "″", "\""}) {
        if (!starts(t, unit)) continue;
        factor = find_unit(unit)->factor;
        length = unit.size();
        break;
      }
      if (length == 0) break;
      t.remove_prefix(length);
      sum += std::abs(part) * factor;
      ++parts;
    }
    if (parts > 1 && trim(t).empty()) return sign * sum;
  }
  return x * factor_for(s, d, where, whole);
}

std::array<double, 3> parse_vector3(std::string_view text, Dimension d, std::string_view where) {
  const std::string_view whole = trim(text);
  std::string_view s = whole;
  std::array<double, 3> v{};
  for (std::size_t i = 0; i < 3; ++i) {
    skip_space(s);
    if (i > 0 && starts(s, ",")) s.remove_prefix(1);
    if (!take_number(s, v[i])) {
      throw Error(ErrorKind::kInput,
                  "expected three numbers and a unit, as \"0.4 -1.2 -0.6 m\", found '" +
                      std::string(whole) + "'",
                  std::string(where));
    }
  }
  s = trim(s);
  if (s.empty()) {
    if (d != Dimension::kNone) bare(whole, d, where);
    return v;
  }
  if (begins_number(s)) {
    throw Error(ErrorKind::kInput,
                "expected three numbers and a unit, found more: '" + std::string(whole) + "'",
                std::string(where));
  }
  const double factor = factor_for(s, d, where, whole);
  for (double& x : v) x *= factor;
  return v;
}

double unit_factor(std::string_view unit, Dimension d, std::string_view where) {
  return factor_for(unit, d, where, trim(unit));
}

Dimension unit_dimension(std::string_view unit, std::string_view where) {
  const auto u = find_unit(unit);
  if (!u) unknown_unit(unit, where);
  const DimensionEntry* e = entry_of(u->dim);
  if (e == nullptr) {
    throw Error(ErrorKind::kInput,
                "unit '" + std::string(unit) + "' measures nothing that is used here",
                std::string(where));
  }
  return e->d;
}

std::string_view unit_of_column(std::string_view column) {
  // "heading [deg]", "gx (rad/s)"
  if (!column.empty() && (column.back() == ']' || column.back() == ')')) {
    const auto open = column.rfind(column.back() == ']' ? '[' : '(');
    if (open != std::string_view::npos) {
      const std::string_view inside = trim(column.substr(open + 1, column.size() - open - 2));
      if (find_unit(inside)) return inside;
    }
  }
  static constexpr std::pair<std::string_view, std::string_view> kSuffixes[] = {
      {"deg", "deg"},
      {"rad", "rad"},
      {"mrad", "mrad"},
      {"arcsec", "arcsec"},
      {"arcmin", "arcmin"},
      {"mil", "mil"},
      {"m", "m"},
      {"km", "km"},
      {"cm", "cm"},
      {"mm", "mm"},
      {"ft", "ft"},
      {"nmi", "nmi"},
      {"s", "s"},
      {"sec", "s"},
      {"ms", "ms"},
      {"us", "us"},
      {"ns", "ns"},
      {"min", "min"},
      {"h", "h"},
      {"mps", "m/s"},
      {"m_s", "m/s"},
      {"ms-1", "m/s"},
      {"kmh", "km/h"},
      {"kmph", "km/h"},
      {"kph", "km/h"},
      {"kn", "kn"},
      {"knots", "kn"},
      {"mph", "mph"},
      {"cmps", "cm/s"},
      {"mmps", "mm/s"},
      {"mps2", "m/s^2"},
      {"m_s2", "m/s^2"},
      {"mpss", "m/s^2"},
      {"g", "g"},
      {"mg", "mg"},
      {"ug", "ug"},
      {"mgal", "mGal"},
      {"radps", "rad/s"},
      {"rad_s", "rad/s"},
      {"degps", "deg/s"},
      {"dps", "deg/s"},
      {"deg_s", "deg/s"},
      {"degph", "deg/h"},
      {"dph", "deg/h"},
      {"deg_h", "deg/h"},
      {"hz", "Hz"},
      {"khz", "kHz"},
      {"pct", "%"},
      {"ppm", "ppm"},
      {"degc", "degC"},
      {"deg_sqrt_h", "deg/sqrt(h)"},
      {"mps_sqrt_h", "m/s/sqrt(h)"},
      {"deg_h_sqrt_h", "deg/h/sqrt(h)"},
  };
  std::string_view best_suffix, best;
  for (const auto& [suffix, unit] : kSuffixes) {
    if (column.size() < suffix.size() + 2 || suffix.size() <= best_suffix.size()) continue;
    const std::size_t at = column.size() - suffix.size();
    if (column[at - 1] != '_') continue;
    bool same = true;
    for (std::size_t i = 0; i < suffix.size(); ++i) {
      const char c = column[at + i];
      same = same && (c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c) == suffix[i];
    }
    if (same) {
      best_suffix = suffix;
      best = unit;
    }
  }
  return best;
}

}  // namespace loxo
