// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>

namespace loxo {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Moments {
  double n = 0, mean = 0, m2 = 0, m4 = 0;
};
Moments moments(const std::vector<double>& v) {
  Moments m;
  m.n = static_cast<double>(v.size());
  for (double x : v) m.mean += x / m.n;
  for (double x : v) {
    const double d2 = (x - m.mean) * (x - m.mean);
    m.m2 += d2 / m.n;
    m.m4 += d2 * d2 / m.n;
  }
  return m;
}
Interval mean_interval(const Moments& m, double z) {
  const double h = z * std::sqrt(m.m2 / std::max(1.0, m.n - 1));
  return {m.mean, m.mean - h, m.mean + h};
}
// By the fourth moment: right for any distribution that has one.
Interval std_interval(const Moments& m, double z) {
  const double s = std::sqrt(m.m2 * m.n / std::max(1.0, m.n - 1));
  const double h =
      m.m2 > 0 ? z * s * std::sqrt(std::max(0.0, m.m4 / (m.m2 * m.m2) - 1) / (4 * m.n)) : 0;
  return {s, std::max(0.0, s - h), s + h};
}
// Order statistics j, k with P(x_j < percentile < x_k) = confidence, by the normal form of the
// binomial.
Percentile percentile_of(const std::vector<double>& sorted, double percent, double z) {
  const auto n = static_cast<double>(sorted.size());
  const double p = percent / 100, middle = p * (n - 1), h = z * std::sqrt(n * p * (1 - p));
  const auto value = [&](double place) {
    place = std::clamp(place, 0.0, n - 1);
    const auto i = static_cast<std::size_t>(place);
    const double f = place - static_cast<double>(i);
    return i + 1 < sorted.size() ? sorted[i] + f * (sorted[i + 1] - sorted[i]) : sorted[i];
  };
  const auto order = [&](double place) {
    return sorted[static_cast<std::size_t>(std::clamp(place, 0.0, n - 1))];
  };
  return {percent, value(middle), order(std::floor(n * p - h) - 1), order(std::ceil(n * p + h))};
}
double quantile_of_confidence(double confidence) { return probit(0.5 + 0.5 * confidence); }

std::vector<double> ranks_of(const std::vector<double>& v) {
  std::vector<std::size_t> order(v.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return v[i] < v[j]; });
  std::vector<double> r(v.size());
  for (std::size_t i = 0; i < order.size();) {
    std::size_t j = i;
    while (j < order.size() && v[order[j]] == v[order[i]]) ++j;
    for (std::size_t k = i; k < j; ++k) r[order[k]] = 0.5 * static_cast<double>(i + j - 1);
    i = j;
  }
  return r;
}

}  // namespace

// One more value into the central sums (Pebay, Sandia report 2008-6212, with a second set of one).
void RunningMoments::add(double x) {
  const double before = n;
  n += 1;
  const double d = x - mean, dn = d / n, dn2 = dn * dn, t = d * dn * before;
  mean += dn;
  m4 += t * dn2 * (n * n - 3 * n + 3) + 6 * dn2 * m2 - 4 * dn * m3;
  m3 += t * dn * (n - 2) - 3 * dn * m2;
  m2 += t;
}

Interval confidence_interval(const RunningMoments& r, StopRule::Statistic statistic,
                             double confidence) {
  if (r.n < 8) return {kNaN, kNaN, kNaN};
  const Moments m{r.n, r.mean, r.m2 / r.n, r.m4 / r.n};
  const double z = quantile_of_confidence(confidence);
  return statistic == StopRule::Statistic::kMean ? mean_interval(m, z) : std_interval(m, z);
}

Interval confidence_interval(const std::vector<double>& values, StopRule::Statistic statistic,
                             double percentile, double confidence) {
  if (values.size() < 8) return {kNaN, kNaN, kNaN};
  const double z = quantile_of_confidence(confidence);
  if (statistic == StopRule::Statistic::kPercentile) {
    auto sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const Percentile p = percentile_of(sorted, percentile, z);
    return {p.value, p.lo, p.hi};
  }
  const Moments m = moments(values);
  return statistic == StopRule::Statistic::kMean ? mean_interval(m, z) : std_interval(m, z);
}

Summary summarize(const std::string& name, const std::vector<double>& values) {
  Summary s;
  s.name = name;
  std::vector<double> v;
  v.reserve(values.size());
  for (double x : values)
    if (std::isfinite(x)) v.push_back(x);
  s.count = v.size();
  s.bad = values.size() - v.size();
  if (v.empty()) {
    s.mean = s.mean_lo = s.mean_hi = s.std = s.std_lo = s.std_hi = s.rms = s.least = s.most = kNaN;
    return s;
  }
  constexpr double z = 1.959963984540054;
  const Moments m = moments(v);
  const Interval mi = mean_interval(m, z), si = std_interval(m, z);
  s.mean = mi.value, s.mean_lo = mi.lo, s.mean_hi = mi.hi;
  s.std = si.value, s.std_lo = si.lo, s.std_hi = si.hi;
  s.rms = std::sqrt(m.m2 + m.mean * m.mean);
  std::sort(v.begin(), v.end());
  s.least = v.front(), s.most = v.back();
  for (double p : {5.0, 25.0, 50.0, 75.0, 95.0, 99.0})
    s.percentiles.push_back(percentile_of(v, p, z));
  return s;
}

Influence influence(const std::string& parameter, const std::vector<double>& x,
                    const std::vector<double>& metric) {
  Influence out;
  out.parameter = parameter;
  std::vector<double> a, b;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (std::isfinite(x[i]) && std::isfinite(metric[i])) a.push_back(x[i]), b.push_back(metric[i]);
  if (a.size() < 40) return out;
  const auto ra = ranks_of(a), rb = ranks_of(b);
  const double middle = 0.5 * static_cast<double>(a.size() - 1);
  double sab = 0, saa = 0, sbb = 0;
  for (std::size_t i = 0; i < ra.size(); ++i) {
    sab += (ra[i] - middle) * (rb[i] - middle);
    saa += (ra[i] - middle) * (ra[i] - middle);
    sbb += (rb[i] - middle) * (rb[i] - middle);
  }
  if (saa <= 0 || sbb <= 0) return out;
  out.rank_correlation = sab / std::sqrt(saa * sbb);
  // Slices of equal number by rank; the slice means' own noise is taken out.
  constexpr std::size_t kSlices = 20;
  double sum[kSlices] = {}, n[kSlices] = {};
  for (std::size_t i = 0; i < ra.size(); ++i) {
    const auto k = std::min(
        kSlices - 1, static_cast<std::size_t>(ra[i] / static_cast<double>(ra.size()) * kSlices));
    sum[k] += b[i];
    n[k] += 1;
  }
  const Moments m = moments(b);
  double between = 0, used = 0;
  for (std::size_t k = 0; k < kSlices; ++k)
    if (n[k] > 0) between += n[k] / m.n * std::pow(sum[k] / n[k] - m.mean, 2), used += 1;
  out.share =
      m.m2 > 0 ? std::clamp((between / m.m2 - (used - 1) / m.n) / (1 - (used - 1) / m.n), 0.0, 1.0)
               : 0;
  return out;
}

Difference difference(const std::vector<double>& a, const std::vector<double>& b, bool paired) {
  Difference d;
  d.paired = paired;
  constexpr double z = 1.959963984540054;
  std::vector<double> x, y, diff;
  for (double v : a)
    if (std::isfinite(v)) x.push_back(v);
  for (double v : b)
    if (std::isfinite(v)) y.push_back(v);
  if (paired)
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
      if (std::isfinite(a[i]) && std::isfinite(b[i])) diff.push_back(b[i] - a[i]);
  if (paired && !diff.empty()) {
    const Interval i = mean_interval(moments(diff), z);
    d.mean = i.value, d.lo = i.lo, d.hi = i.hi;
  } else if (!x.empty() && !y.empty()) {
    const Moments ma = moments(x), mb = moments(y);
    d.mean = mb.mean - ma.mean;
    const double h = z * std::sqrt(ma.m2 / ma.n + mb.m2 / mb.n);
    d.lo = d.mean - h, d.hi = d.mean + h;
  }
  std::sort(x.begin(), x.end());
  std::sort(y.begin(), y.end());
  for (std::size_t i = 0, j = 0; i < x.size() && j < y.size();) {
    const double v = std::min(x[i], y[j]);
    while (i < x.size() && x[i] <= v) ++i;
    while (j < y.size() && y[j] <= v) ++j;
    d.ks = std::max(d.ks, std::fabs(static_cast<double>(i) / static_cast<double>(x.size()) -
                                    static_cast<double>(j) / static_cast<double>(y.size())));
  }
  const double n = x.empty() || y.empty()
                       ? 0
                       : static_cast<double>(x.size()) * static_cast<double>(y.size()) /
                             static_cast<double>(x.size() + y.size());
  const double lambda = d.ks * (std::sqrt(n) + 0.12 + 0.11 / std::sqrt(std::max(n, 1.0)));
  if (lambda > 0.2) {
    double p = 0;
    for (int k = 1; k <= 100; ++k)
      p += (k % 2 == 1 ? 2.0 : -2.0) * std::exp(-2.0 * k * k * lambda * lambda);
    d.p_value = std::clamp(p, 0.0, 1.0);
  }
  return d;
}

std::uint64_t file_fingerprint(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::uint64_t h = 0xcbf29ce484222325;
  std::vector<char> buffer(1 << 16);
  while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())), in.gcount() > 0)
    for (std::streamsize i = 0; i < in.gcount(); ++i)
      h = (h ^ static_cast<unsigned char>(buffer[static_cast<std::size_t>(i)])) * 0x100000001b3;
  return h;
}

}  // namespace loxo
