// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <span>
#include <string_view>

#include "loxo/report/coast.hpp"
#include "loxo/report/page_html.hpp"
#include "loxo/report/thin.hpp"

namespace loxo::report {
namespace {

constexpr double kDeg = 180.0 / std::numbers::pi;

// A writer of its own: numbers short, long arrays packed, text safe inside <script>.
class Out {
 public:
  std::string text;

  void open(char c) {
    separate();
    text += c;
    first_ = true;
  }
  void close(char c) {
    text += c;
    first_ = false;
  }
  void key(std::string_view name) {
    separate();
    quote(name);
    text += ':';
    first_ = true;
  }
  void value(std::string_view words) {
    separate();
    quote(words);
  }
  void value(bool b) {
    separate();
    text += b ? "true" : "false";
  }
  void value(double x, int digits = 9) {
    separate();
    number(x, digits);
  }
  void field(std::string_view name, std::string_view words) {
    if (words.empty()) return;
    key(name);
    value(words);
  }
  void flag(std::string_view name, bool b) {
    if (!b) return;
    key(name);
    value(true);
  }
  void field(std::string_view name, double x, int digits = 9) {
    if (!std::isfinite(x)) return;
    key(name);
    value(x, digits);
  }
  // Short arrays as numbers; long ones as {"o": offset, "d": base64 of little-endian float32 of (x
  // - offset)}.
  void array(std::string_view name, std::span<const double> values, int digits = 9) {
    key(name);
    if (values.size() <= 64) {
      open('[');
      for (const double x : values) value(x, digits);
      close(']');
      return;
    }
    double lo = INFINITY, hi = -INFINITY;
    for (const double x : values) {
      if (!std::isfinite(x)) continue;
      lo = std::min(lo, x);
      hi = std::max(hi, x);
    }
    // An offset where the values are large beside their range: float32 has seven digits.
    const double offset =
        lo <= hi && (lo > 0 || hi < 0) && hi - lo < std::min(std::fabs(lo), std::fabs(hi)) ? lo
                                                                                           : 0.0;
    open('{');
    field("o", offset, 17);
    key("d");
    separate();
    text += '"';
    std::string bytes;
    bytes.reserve(values.size() * 4);
    for (const double x : values) {
      const auto bits =
          std::bit_cast<std::uint32_t>(std::isfinite(x) ? static_cast<float>(x - offset)
                                                        : std::numeric_limits<float>::quiet_NaN());
      for (int k = 0; k < 4; ++k) bytes += static_cast<char>((bits >> (8 * k)) & 0xff);
    }
    base64(bytes);
    text += '"';
    close('}');
  }

 private:
  bool first_ = true;

  void separate() {
    if (!first_) text += ',';
    first_ = false;
  }
  void number(double x, int digits) {
    if (!std::isfinite(x)) {
      text += "null";
      return;
    }
    if (x == 0) x = 0;  // no minus zero
    char buffer[40];
    const auto end =
        digits >= 17
            ? std::to_chars(buffer, buffer + sizeof buffer, x).ptr  // the shortest that reads back
            : std::to_chars(buffer, buffer + sizeof buffer, x, std::chars_format::general, digits)
                  .ptr;
    text.append(buffer, end);
  }
  // '<' is escaped, so that no text can end the script element; bytes that are not UTF-8 become
  // U+FFFD.
  void quote(std::string_view words) {
    text += '"';
    for (std::size_t i = 0; i < words.size();) {
      const auto c = static_cast<unsigned char>(words[i]);
      if (c < 0x80) {
        if (c == '"' || c == '\\') {
          text += '\\';
          text += static_cast<char>(c);
        } else if (c < 0x20 || c == '<' || c == '>' || c == '&') {
          char buffer[8];
          std::snprintf(buffer, sizeof buffer, "\\u%04x", c);
          text += buffer;
        } else {
          text += static_cast<char>(c);
        }
        ++i;
        continue;
      }
      const std::size_t n = c >= 0xf0 && c < 0xf5 ? 4 : c >= 0xe0 ? 3 : c >= 0xc2 ? 2 : 0;
      bool good = n != 0 && c < 0xf5 && i + n <= words.size();
      for (std::size_t k = 1; good && k < n; ++k)
        good = (static_cast<unsigned char>(words[i + k]) & 0xc0) == 0x80;
      if (good) {
        text.append(words.substr(i, n));
        i += n;
      } else {
        text += "\xEF\xBF\xBD";
        ++i;
      }
    }
    text += '"';
  }
  void base64(std::string_view bytes) {
    static constexpr char kDigits[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
      std::uint32_t word = 0;
      const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
      for (std::size_t k = 0; k < 3; ++k)
        word = (word << 8) | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0u);
      for (std::size_t k = 0; k < 4; ++k)
        text += k <= n ? kDigits[(word >> (18 - 6 * k)) & 63] : '=';
    }
  }
};

std::string_view word(Verdict v) {
  switch (v) {
    case Verdict::kGood:
      return "good";
    case Verdict::kBad:
      return "bad";
    case Verdict::kNote:
      return "note";
    case Verdict::kNone:
      break;
  }
  return "";
}
std::string_view word(Style s) {
  switch (s) {
    case Style::kDashed:
      return "dashed";
    case Style::kPoints:
      return "points";
    case Style::kLinePoints:
      return "linepoints";
    case Style::kSteps:
      return "steps";
    case Style::kLine:
      break;
  }
  return "";
}
std::string_view word(PointKind k) {
  switch (k) {
    case PointKind::kBenchmark:
      return "benchmark";
    case PointKind::kStart:
      return "start";
    case PointKind::kEnd:
      return "end";
    case PointKind::kFix:
      return "fix";
    case PointKind::kOther:
      break;
  }
  return "other";
}

std::vector<double> picked(const std::vector<double>& values, const std::vector<std::size_t>& index,
                           double factor = 1) {
  std::vector<double> out;
  out.reserve(index.size());
  for (const auto i : index) out.push_back(i < values.size() ? values[i] * factor : kNoValue);
  return out;
}

void write(Out& o, std::string_view name, const Axis& axis) {
  o.key(name);
  o.open('{');
  o.field("label", axis.label);
  o.field("unit", axis.unit);
  o.flag("log", axis.log);
  o.field("lo", axis.lo);
  o.field("hi", axis.hi);
  o.close('}');
}
void write(Out& o, const std::vector<Mark>& marks) {
  if (marks.empty()) return;
  o.key("marks");
  o.open('[');
  for (const auto& m : marks) {
    o.open('{');
    o.field("at", m.at);
    o.field("label", m.label);
    o.flag("horizontal", m.horizontal);
    o.close('}');
  }
  o.close(']');
}
void write(Out& o, const std::vector<std::pair<std::string, std::string>>& rows) {
  o.open('[');
  for (const auto& [key, value] : rows) {
    o.open('[');
    o.value(key);
    o.value(value);
    o.close(']');
  }
  o.close(']');
}
void head(Out& o, std::string_view kind, std::string_view title, std::string_view caption = {}) {
  o.field("kind", kind);
  o.field("title", title);
  o.field("caption", caption);
}
void write_curve(Out& o, const Curve& c, const std::vector<double>& shared, std::size_t points) {
  o.open('{');
  o.field("name", c.name);
  o.field("style", word(c.style));
  o.field("source", c.source);
  if (c.colour >= 0) o.field("colour", c.colour);
  o.flag("hidden", !c.shown);
  const auto& x = c.x.empty() ? shared : c.x;
  auto y = c.y;
  y.resize(std::min(y.size(), x.size()));
  auto index = thin_curve(y, c.lo.empty() ? points : points / 2);
  // A curve that is only a band is thinned by the band's upper edge.
  if (y.empty() && !c.hi.empty())
    index = thin_curve(std::span(c.hi).first(std::min(c.hi.size(), x.size())), points / 2);
  std::erase_if(index, [&](std::size_t i) { return !std::isfinite(x[i]); });
  o.array("x", picked(x, index), 12);
  o.array("y", picked(y, index));
  if (!c.lo.empty() && !c.hi.empty()) {
    o.array("lo", picked(c.lo, index));
    o.array("hi", picked(c.hi, index));
  }
  o.close('}');
}
void write_curves(Out& o, const std::vector<Curve>& curves, const std::vector<double>& shared,
                  std::size_t points) {
  o.key("curves");
  o.open('[');
  for (const auto& c : curves) write_curve(o, c, shared, points);
  o.close(']');
}

struct BlockWriter {
  Out& o;
  std::size_t points;

  void operator()(const Text& b) const {
    head(o, "text", "");
    o.field("text", b.text);
    o.field("verdict", word(b.verdict));
  }
  void operator()(const KeyValues& b) const {
    head(o, "keyvalues", b.title);
    o.key("rows");
    write(o, b.rows);
  }
  void operator()(const Table& b) const {
    head(o, "table", b.title, b.caption);
    o.key("columns");
    o.open('[');
    for (const auto& c : b.columns) {
      o.open('{');
      o.field("title", c.title);
      o.field("unit", c.unit);
      o.close('}');
    }
    o.close(']');
    const std::size_t n = std::min(b.rows.size(), points);
    if (n < b.rows.size()) o.field("left_out", static_cast<double>(b.rows.size() - n));
    o.key("rows");
    o.open('[');
    for (std::size_t i = 0; i < n; ++i) {
      const auto& r = b.rows[i];
      o.open('{');
      o.flag("highlighted", r.highlighted);
      o.field("note", r.note);
      o.key("cells");
      o.open('[');
      for (const auto& c : r.cells) {
        if (!c.is_number && c.verdict == Verdict::kNone) {
          o.value(c.text);
          continue;
        }
        o.open('{');
        o.field("text", c.is_number && c.text.empty() ? format_number(c.value, c.error) : c.text);
        if (c.is_number) {
          o.key("value");
          o.value(c.value, 17);
        }
        o.field("verdict", word(c.verdict));
        o.close('}');
      }
      o.close(']');
      o.close('}');
    }
    o.close(']');
  }
  void operator()(const Series& b) const {
    head(o, "series", b.title, b.caption);
    write(o, "x", b.x);
    write(o, "y", b.y);
    o.field("sync", b.sync);
    o.flag("half", b.half);
    write(o, b.marks);
    if (!b.spans.empty()) {
      o.key("spans");
      o.open('[');
      for (const auto& s : b.spans) {
        o.open('{');
        o.field("from", s.from);
        o.field("to", s.to);
        o.field("label", s.label);
        o.close('}');
      }
      o.close(']');
    }
    write_curves(o, b.curves, b.at, points);
  }
  void operator()(const Map& b) const {
    head(o, "map", b.title, b.caption);
    o.key("tracks");
    o.open('[');
    for (const auto& t : b.tracks) {
      o.open('{');
      o.field("name", t.name);
      o.field("style", word(t.style));
      if (t.colour >= 0) o.field("colour", t.colour);
      const auto index = thin_track(t.lat, t.lon, points);
      o.array("lat", picked(t.lat, index, kDeg), 13);
      o.array("lon", picked(t.lon, index, kDeg), 13);
      if (!t.t.empty()) o.array("t", picked(t.t, index), 12);
      o.close('}');
    }
    o.close(']');
    std::vector<double> lat, lon;
    for (const auto& t : b.tracks) {
      lat.insert(lat.end(), t.lat.begin(), t.lat.end());
      lon.insert(lon.end(), t.lon.begin(), t.lon.end());
    }
    // A page that is short of room keeps the front end's coarse coast.
    if (const auto land = points >= 400 ? coast_about(lat, lon) : Polygons{}; !land.empty()) {
      o.key("land");
      o.open('[');
      for (const auto& polygon : land) {
        o.open('[');
        for (const auto& ring : polygon) {
          o.open('[');
          for (const int v : ring) o.value(static_cast<double>(v));
          o.close(']');
        }
        o.close(']');
      }
      o.close(']');
    }
    o.key("points");
    o.open('[');
    for (std::size_t i = 0; i < std::min(b.points.size(), points); ++i) {
      const auto& p = b.points[i];
      o.open('{');
      o.field("name", p.name);
      o.field("what", word(p.kind));
      o.field("lat", p.lat * kDeg, 13);
      o.field("lon", p.lon * kDeg, 13);
      o.field("std_e", p.std_e);
      o.field("std_n", p.std_n);
      if (p.correlation != 0) o.field("correlation", p.correlation);
      o.close('}');
    }
    o.close(']');
  }
  void operator()(const Histogram& b) const {
    head(o, "histogram", b.title, b.caption);
    write(o, "x", b.x);
    write(o, b.marks);
    std::vector<std::vector<double>> values;
    for (const auto& s : b.samples) values.push_back(s.values);
    const auto bins = make_bins(values, b.bins);
    o.array("edges", bins.edges);
    o.key("samples");
    o.open('[');
    for (std::size_t i = 0; i < b.samples.size(); ++i) {
      o.open('{');
      o.field("name", b.samples[i].name);
      o.array("counts", i < bins.counts.size() ? bins.counts[i] : std::vector<double>{});
      const auto sorted = sorted_finite(values[i]);
      double mean = 0, sum2 = 0;
      for (const double v : sorted) mean += v / static_cast<double>(sorted.size());
      for (const double v : sorted) sum2 += (v - mean) * (v - mean);
      o.field("n", static_cast<double>(sorted.size()));
      if (sorted.size() > 1) {
        o.field("mean", mean);
        o.field("std", std::sqrt(sum2 / static_cast<double>(sorted.size() - 1)));
      }
      o.close('}');
    }
    o.close(']');
    o.flag("normal", b.normal);
  }
  void operator()(const Cdf& b) const {
    head(o, "cdf", b.title, b.caption);
    write(o, "x", b.x);
    o.array("percentiles", b.percentiles);
    o.key("samples");
    o.open('[');
    for (const auto& s : b.samples) {
      const auto sorted = sorted_finite(s.values);
      const std::size_t n = sorted.size(),
                        m = std::min<std::size_t>(n, std::min<std::size_t>(points, 400));
      std::vector<double> x, p, at;
      for (std::size_t k = 0; k < m; ++k) {
        const std::size_t i = m < 2 ? 0 : k * (n - 1) / (m - 1);
        x.push_back(sorted[i]);
        p.push_back(static_cast<double>(i + 1) / static_cast<double>(n));
      }
      for (const double percent : b.percentiles) at.push_back(percentile(sorted, percent));
      o.open('{');
      o.field("name", s.name);
      o.field("n", static_cast<double>(n));
      o.array("x", x);
      o.array("p", p);
      o.array("at", at);
      o.close('}');
    }
    o.close(']');
  }
  void operator()(const Scatter& b) const {
    head(o, "scatter", b.title, b.caption);
    write(o, "x", b.x);
    write(o, "y", b.y);
    write(o, b.marks);
    o.flag("equal", b.equal);
    o.key("clouds");
    o.open('[');
    for (const auto& c : b.clouds) {
      const std::size_t n = std::min(c.x.size(), c.y.size()),
                        most = std::min<std::size_t>(points, 2000);
      std::vector<std::size_t> index;  // an even choice: a scatter has no order to keep
      for (std::size_t k = 0; k < std::min(n, most); ++k)
        index.push_back(n <= most ? k : k * n / most);
      o.open('{');
      o.field("name", c.name);
      if (c.line) index = thin_curve(std::span(c.y).first(n), points);
      o.flag("line", c.line);
      if (n > most && !c.line) o.field("of", static_cast<double>(n));
      o.array("x", picked(c.x, index));
      o.array("y", picked(c.y, index));
      o.close('}');
    }
    o.close(']');
    o.key("ellipses");
    o.open('[');
    for (const auto& e : b.ellipses) {
      // Two degrees of freedom: chi-square quantile -2 ln(1 - p); axes from the eigenvalues.
      const double q = -2.0 * std::log1p(-e.confidence), mean = 0.5 * (e.sxx + e.syy),
                   half = 0.5 * (e.sxx - e.syy);
      const double root = std::hypot(half, e.sxy);
      o.open('{');
      o.field("name", e.name);
      o.field("x", e.x);
      o.field("y", e.y);
      o.field("a", std::sqrt(std::max(0.0, q * (mean + root))));
      o.field("b", std::sqrt(std::max(0.0, q * (mean - root))));
      o.field("angle", 0.5 * std::atan2(2.0 * e.sxy, e.sxx - e.syy));
      o.field("confidence", e.confidence);
      o.close('}');
    }
    o.close(']');
  }
  void operator()(const StackedArea& b) const {
    head(o, "stacked", b.title, b.caption);
    write(o, "x", b.x);
    write(o, "y", b.y);
    std::vector<double> total(b.at.size(), 0.0);
    for (const auto& l : b.layers)
      for (std::size_t i = 0; i < std::min(total.size(), l.y.size()); ++i)
        if (std::isfinite(l.y[i])) total[i] += l.y[i];
    const auto index = thin_curve(total, std::min<std::size_t>(points, 800));
    o.array("at", picked(b.at, index), 12);
    o.key("layers");
    o.open('[');
    for (const auto& l : b.layers) {
      o.open('{');
      o.field("name", l.name);
      o.array("y", picked(l.y, index));
      o.close('}');
    }
    o.close(']');
  }
  void operator()(const Roots& b) const {
    head(o, "roots", b.title, b.caption);
    o.key("roots");
    o.open('[');
    for (const auto& r : b.roots) {
      o.open('{');
      o.field("name", r.name);
      o.field("re", r.re, 17);
      o.field("im", r.im, 17);
      o.close('}');
    }
    o.close(']');
  }
  void operator()(const Fan& b) const {
    head(o, "fan", b.title, b.caption);
    write(o, "x", b.x);
    write(o, "y", b.y);
    std::vector<double> widest = b.percentiles.empty() ? b.at : b.percentiles.back().y;
    widest.resize(b.at.size(), kNoValue);
    const auto index = thin_curve(widest, std::min<std::size_t>(points, 800));
    o.array("at", picked(b.at, index), 12);
    auto percentiles = b.percentiles;
    std::stable_sort(
        percentiles.begin(), percentiles.end(),
        [](const Percentile& l, const Percentile& r) { return l.percent < r.percent; });
    o.key("percentiles");
    o.open('[');
    for (const auto& p : percentiles) {
      o.open('{');
      o.field("percent", p.percent);
      o.array("y", picked(p.y, index));
      o.close('}');
    }
    o.close(']');
    write_curves(o, b.curves, b.at, std::min<std::size_t>(points, 800));
  }
  void operator()(const Intervals& b) const {
    head(o, "intervals", b.title, b.caption);
    write(o, "x", b.x);
    o.field("reference", b.reference, 12);
    o.field("reference_name", b.reference_name);
    o.key("rows");
    o.open('[');
    for (const auto& r : b.rows) {
      o.open('{');
      o.field("name", r.name);
      o.field("text", format_number(r.value, r.sigma));
      o.field("value", r.value, 15);
      o.field("sigma", r.sigma);
      o.flag("highlighted", r.highlighted);
      o.close('}');
    }
    o.close(']');
  }
  void operator()(const Certificate& b) const {
    head(o, "certificate", b.title);
    o.field("verdict", word(b.verdict));
    o.field("verdict_text", b.verdict_text);
    o.key("constants");
    o.open('[');
    for (const auto& c : b.constants) {
      o.open('{');
      o.field("name", c.name);
      o.field("text", format_number(c.value, c.sigma, 8));
      o.field("unit", c.unit);
      o.close('}');
    }
    o.close(']');
    o.key("correlation");
    o.open('[');
    for (const auto& row : b.correlation) {
      o.open('[');
      for (const double c : row) o.value(c, 4);
      o.close(']');
    }
    o.close(']');
    o.key("rows");
    write(o, b.rows);
  }
};

}  // namespace

std::string format_number(double value, double error, int digits) {
  if (!std::isfinite(value)) return std::isinf(value) ? (value > 0 ? "∞" : "−∞") : "–";
  char buffer[64];
  const auto raised = [](int exponent) {  // ·10⁻⁷
    static constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string out = "·10";
    if (exponent < 0) out += "⁻";
    for (const char c : std::to_string(std::abs(exponent))) out += kDigits[c - '0'];
    return out;
  };
  const auto tidy = [&](std::string s) {  // a true minus sign, powers of ten as people write them
    if (const auto e = s.find('e'); e != std::string::npos) {
      const int exponent = std::atoi(s.c_str() + e + 1);
      s = s.substr(0, e);
      for (std::size_t at = 0; (at = s.find('-', at)) != std::string::npos; at += 3)
        s.replace(at, 1, "−");
      return s + raised(exponent);
    }
    for (std::size_t at = 0; (at = s.find('-', at)) != std::string::npos; at += 3)
      s.replace(at, 1, "−");
    return s;
  };
  if (!std::isfinite(error) || error < 0) {
    std::snprintf(buffer, sizeof buffer, "%.*g", digits, value == 0 ? 0.0 : value);
    return tidy(buffer);
  }
  if (error == 0) {
    std::snprintf(buffer, sizeof buffer, "%.*g", std::max(digits, 9), value == 0 ? 0.0 : value);
    return tidy(buffer) + " (exact)";
  }
  // Two digits of the error decide the place of the last digit of both.
  int place = static_cast<int>(std::floor(std::log10(error))) - 1;
  if (std::round(error / std::pow(10.0, place)) >= 100) ++place;
  const double largest = std::max(std::fabs(value), error);
  const int lead = largest > 0 ? static_cast<int>(std::floor(std::log10(largest))) : 0;
  if (lead >= 9 || lead <= -5) {  // a common power of ten
    const double unit = std::pow(10.0, lead);
    const int decimals = std::clamp(lead - place, 0, 15);
    std::snprintf(buffer, sizeof buffer, "(%.*f ± %.*f)", decimals, value / unit, decimals,
                  error / unit);
    return tidy(buffer) + raised(lead);
  }
  const int decimals = std::clamp(-place, 0, 17);
  std::snprintf(buffer, sizeof buffer, "%.*f ± %.*f", decimals, value, decimals, error);
  return tidy(buffer);
}

std::string to_json(const Page& page, std::size_t points) {
  Out o;
  o.open('{');
  o.field("title", page.title);
  o.field("subtitle", page.subtitle);
  o.key("provenance");
  write(o, page.provenance);
  o.key("sections");
  o.open('[');
  for (const auto& s : page.sections) {
    o.open('{');
    o.field("title", s.title);
    o.field("group", s.group);
    o.key("blocks");
    o.open('[');
    for (const auto& b : s.blocks) {
      o.open('{');
      std::visit(BlockWriter{o, points}, b);
      o.close('}');
    }
    o.close(']');
    o.close('}');
  }
  o.close(']');
  o.close('}');
  return std::move(o.text);
}

}  // namespace loxo::report
