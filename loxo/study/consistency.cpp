// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/consistency.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace loxo {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Regularised lower incomplete gamma P(a, x): series below a + 1, continued fraction (Lentz) above;
// for large a both need about 10 sqrt(a) terms.
double gamma_p(double a, double x) {
  if (!(x > 0)) return 0;
  const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
  const int limit = 500 + static_cast<int>(20 * std::sqrt(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (int k = 1; k < limit && term > sum * 1e-17; ++k) sum += term *= x / (a + k);
    return front * sum;
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int k = 1; k < limit; ++k) {
    const double an = -k * (k - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    const double delta = d * c;
    h *= delta;
    if (std::fabs(delta - 1) < 1e-16) break;
  }
  return 1 - front * h;
}

}  // namespace

double chi_square_cdf(double x, double dof) { return gamma_p(0.5 * dof, 0.5 * x); }

double chi_square_quantile(double p, double dof) {
  if (!(p > 0 && p < 1 && dof > 0)) return kNaN;
  // Bracket, then bisection guarded Newton on the cdf.
  double lo = 0, hi = std::max(1.0, dof);
  while (chi_square_cdf(hi, dof) < p) hi *= 2;
  double x = 0.5 * (lo + hi);
  for (int k = 0; k < 200; ++k) {
    const double f = chi_square_cdf(x, dof) - p;
    (f > 0 ? hi : lo) = x;
    const double a = 0.5 * dof;
    const double density = 0.5 * std::exp((a - 1) * std::log(0.5 * x) - 0.5 * x - std::lgamma(a));
    double next = x - f / density;
    if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
    if (std::fabs(next - x) <= 1e-15 * x) return next;
    x = next;
  }
  return x;
}

Band chi_square_band(double n, double trials, double confidence) {
  const double tail = 0.5 * (1 - confidence);
  return {chi_square_quantile(tail, n * trials) / trials,
          chi_square_quantile(1 - tail, n * trials) / trials};
}

double normalised_square3(const double e[3], const double p[9]) {
  // Cholesky: the normalised square is |L^-1 e|^2.
  double l[3][3]{}, y[3]{}, sum = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      double v = p[3 * i + j];
      for (int k = 0; k < j; ++k) v -= l[i][k] * l[j][k];
      if (i == j) {
        if (!(v > 0)) return kNaN;
        l[i][i] = std::sqrt(v);
      } else {
        l[i][j] = v / l[j][j];
      }
    }
    double v = e[i];
    for (int k = 0; k < i; ++k) v -= l[i][k] * y[k];
    y[i] = v / l[i][i];
    sum += y[i] * y[i];
  }
  return sum;
}

InnovationSummary summarise_innovations(std::span<const double> nis, double n) {
  InnovationSummary r;
  std::vector<double> x;
  for (double v : nis)
    if (std::isfinite(v)) x.push_back(v);
  r.count = x.size();
  if (x.empty()) return r;
  const double limit = chi_square_quantile(0.95, n);
  for (double v : x) {
    r.mean += v;
    r.share_above_95 += v > limit ? 1 : 0;
  }
  const double m = static_cast<double>(x.size());
  r.mean /= m;
  r.share_above_95 /= m;
  double c0 = 0, c1 = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    c0 += (x[i] - r.mean) * (x[i] - r.mean);
    if (i > 0) c1 += (x[i] - r.mean) * (x[i - 1] - r.mean);
  }
  r.lag1 = c0 > 0 ? c1 / c0 : 0;
  r.coloured = std::fabs(r.lag1) >= 2 / std::sqrt(m);
  return r;
}

double quantile(std::span<const double> values, double p) {
  std::vector<double> x;
  x.reserve(values.size());
  for (double v : values)
    if (!std::isnan(v)) x.push_back(v);
  if (x.empty()) return kNaN;
  const double at = p * static_cast<double>(x.size() - 1);
  const auto k = static_cast<std::size_t>(at);
  std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(k), x.end());
  const double low = x[k];
  if (k + 1 >= x.size()) return low;
  const double high = *std::min_element(x.begin() + static_cast<std::ptrdiff_t>(k) + 1, x.end());
  return low + (at - static_cast<double>(k)) * (high - low);
}

}  // namespace loxo
