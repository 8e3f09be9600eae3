// SPDX-License-Identifier: Apache-2.0
#include "loxo/earth/ellipsoid.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "loxo/num/error.hpp"

namespace loxo {
namespace {

#include "loxo/earth/latitude_series.inc"

// c[j] = n^j (t[j-1][0] + n (t[j-1][1] + ...)), order 8 in all; sin(2jx)/sin(2x) is the Chebyshev
// polynomial U_(j-1) of cos(2x): U_j = 2 u U_(j-1) - U_(j-2).
void sum_series(const double (&table)[8][8], double n, SineSeries& out) {
  double power = 1.0;
  for (int j = 1; j <= 8; ++j) {
    power *= n;
    double sum = 0.0;
    for (int k = 8 - j; k >= 0; --k) sum = sum * n + table[j - 1][k];
    out.c[j] = power * sum;
  }
  double last[8]{}, before[8]{};
  last[0] = 1.0;
  for (int j = 1; j <= 8; ++j) {
    for (int k = 0; k < 8; ++k) out.p[k] += out.c[j] * last[k];
    for (int k = 7; k >= 0; --k) {
      const double next = (k > 0 ? 2.0 * last[k - 1] : 0.0) - before[k];
      before[k] = last[k];
      last[k] = next;
    }
  }
}

std::string lower(std::string_view text) {
  std::string r(text);
  std::transform(r.begin(), r.end(), r.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return r;
}

std::string without_blanks(std::string_view text) {
  std::string r;
  for (const char c : text)
    if (std::isspace(static_cast<unsigned char>(c)) == 0) r += c;
  return r;
}

double number(std::string_view text, std::string_view whole) {
  double x = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
  if (error != std::errc() || end != text.data() + text.size())
    throw Error(ErrorKind::kInput, "expected a number, found '" + std::string(text) +
                                       "' in ellipsoid '" + std::string(whole) +
                                       "' (form: a=6378137m,f=1/298.257223563)");
  return x;
}

// "a=…m,f=…" in any order; f also as a quotient.
Ellipsoid parse_axes(const std::string& text) {
  double a = 0.0, f = -1.0;
  std::size_t at = 0;
  while (at <= text.size()) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    std::string_view part = std::string_view(text).substr(at, comma - at);
    at = comma + 1;
    if (part.starts_with("a=")) {
      part.remove_prefix(2);
      double unit = 1.0;
      if (part.ends_with("km")) {
        unit = 1e3;
        part.remove_suffix(2);
      } else if (part.ends_with("m")) {
        part.remove_suffix(1);
      }
      a = unit * number(part, text);
    } else if (part.starts_with("f=")) {
      part.remove_prefix(2);
      const std::size_t slash = part.find('/');
      f = slash == std::string_view::npos
              ? number(part, text)
              : number(part.substr(0, slash), text) / number(part.substr(slash + 1), text);
    } else {
      throw Error(ErrorKind::kInput, "expected a=…m,f=…, found '" + std::string(part) +
                                         "' in ellipsoid '" + text + "'");
    }
  }
  if (f < 0.0)
    throw Error(ErrorKind::kInput, "flattening missing in ellipsoid '" + text +
                                       "' (form: a=6378137m,f=1/298.257223563)");
  return make_ellipsoid(text, a, f);
}

// Edit distance, small words only.
std::size_t distance(std::string_view x, std::string_view y) {
  std::vector<std::size_t> row(y.size() + 1);
  for (std::size_t j = 0; j <= y.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= x.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= y.size(); ++j) {
      const std::size_t up = row[j];
      row[j] = std::min({up + 1, row[j - 1] + 1, diagonal + (x[i - 1] == y[j - 1] ? 0 : 1)});
      diagonal = up;
    }
  }
  return row[y.size()];
}

}  // namespace

Ellipsoid make_ellipsoid(std::string name, double a, double f) {
  if (!(a > 0.0) || !std::isfinite(a))
    throw Error(
        ErrorKind::kInput,
        "ellipsoid '" + name + "': semi-major axis must be above 0 m, found " + std::to_string(a));
  if (!(f >= 0.0 && f <= 0.1))
    throw Error(
        ErrorKind::kInput,
        "ellipsoid '" + name + "': flattening must be within 0 to 0.1, found " + std::to_string(f));
  Ellipsoid e;
  e.name = std::move(name);
  e.a = a;
  e.f = f;
  e.b = a * (1.0 - f);
  e.e2 = f * (2.0 - f);
  e.ep2 = e.e2 / ((1.0 - f) * (1.0 - f));
  e.e = std::sqrt(e.e2);
  e.n = f / (2.0 - f);
  // The mean of dm/dphi (V-4): a/(1+n) times the sum of the squares of the binomial coefficients
  // (1/2 over k) n^k.
  const double n2 = e.n * e.n;
  const double mean =
      1.0 + n2 * (1.0 / 4 +
                  n2 * (1.0 / 64 + n2 * (1.0 / 256 + n2 * (25.0 / 16384 + n2 * (49.0 / 65536)))));
  e.rectifying_radius = a / (1.0 + e.n) * mean;
  e.quarter_meridian = e.rectifying_radius * 1.5707963267948966;
  sum_series(kMuOfPhi, e.n, e.mu_of_phi);
  sum_series(kPhiOfMu, e.n, e.phi_of_mu);
  sum_series(kChiOfPhi, e.n, e.chi_of_phi);
  sum_series(kPhiOfChi, e.n, e.phi_of_chi);
  sum_series(kMuOfChi, e.n, e.mu_of_chi);
  sum_series(kChiOfMu, e.n, e.chi_of_mu);
  return e;
}

const Ellipsoid& wgs84() {
  static const Ellipsoid e = make_ellipsoid("WGS84", 6378137.0, 1.0 / 298.257223563);
  return e;
}
const Ellipsoid& grs80() {
  static const Ellipsoid e = make_ellipsoid("GRS80", 6378137.0, 1.0 / 298.257222101);
  return e;
}
const Ellipsoid& cgcs2000() {
  static const Ellipsoid e = make_ellipsoid("CGCS2000", 6378137.0, 1.0 / 298.257222101);
  return e;
}
const Ellipsoid& krassovsky() {
  static const Ellipsoid e = make_ellipsoid("Krassovsky", 6378245.0, 1.0 / 298.3);
  return e;
}
const Ellipsoid& paper_sphere() {
  static const Ellipsoid e = [] {
    Ellipsoid s = make_sphere(6371000.0);
    s.g_constant = 9.8;
    return s;
  }();
  return e;
}
Ellipsoid make_sphere(double radius) { return make_ellipsoid("sphere", radius, 0.0); }

Ellipsoid ellipsoid_by_name(std::string_view text) {
  const std::string name = lower(without_blanks(text));
  if (name == "wgs84" || name == "wgs-84") return wgs84();
  if (name == "grs80" || name == "grs-80") return grs80();
  if (name == "cgcs2000" || name == "cgcs-2000") return cgcs2000();
  if (name == "krassovsky" || name == "krasovsky") return krassovsky();
  if (name == "sphere") return paper_sphere();
  if (name.find('=') != std::string::npos) return parse_axes(name);
  static constexpr const char* kNames[] = {"WGS84", "GRS80", "CGCS2000", "Krassovsky", "sphere"};
  const char* near = kNames[0];
  for (const char* n : kNames)
    if (distance(name, lower(n)) < distance(name, lower(near))) near = n;
  throw Error(ErrorKind::kInput,
              "unknown ellipsoid '" + std::string(text) + "'; did you mean '" + near +
                  "'? (valid: WGS84, GRS80, CGCS2000, Krassovsky, sphere, a=…m,f=…)");
}

}  // namespace loxo
