// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/thin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace loxo::report {

std::vector<std::size_t> thin_curve(std::span<const double> y, std::size_t points) {
  const std::size_t n = y.size();
  std::vector<std::size_t> kept;
  if (n <= points || n < 5) {
    kept.resize(n);
    for (std::size_t i = 0; i < n; ++i) kept[i] = i;
    return kept;
  }
  const std::size_t pieces = std::max<std::size_t>(points / 2, 1);
  kept.reserve(2 * pieces + 8);
  kept.push_back(0);
  for (std::size_t p = 0; p < pieces; ++p) {
    const std::size_t begin = p * n / pieces, end = (p + 1) * n / pieces;
    std::size_t low = end, high = end, gap = end;
    for (std::size_t i = begin; i < end; ++i) {
      if (!std::isfinite(y[i])) {
        if (gap == end) gap = i;
        continue;
      }
      if (low == end || y[i] < y[low]) low = i;
      if (high == end || y[i] > y[high]) high = i;
    }
    std::array<std::size_t, 3> found{low, high, gap};
    std::sort(found.begin(), found.end());
    for (const auto i : found)
      if (i < end && i > kept.back()) kept.push_back(i);
  }
  if (kept.back() != n - 1) kept.push_back(n - 1);
  return kept;
}

namespace {

using Unit = std::array<double, 3>;

Unit unit_of(double lat, double lon) {
  return {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
}

// Squared distance of p from the piece a-b.
double distance2(const Unit& p, const Unit& a, const Unit& b) {
  double ab2 = 0, dot = 0;
  for (int k = 0; k < 3; ++k) {
    ab2 += (b[k] - a[k]) * (b[k] - a[k]);
    dot += (b[k] - a[k]) * (p[k] - a[k]);
  }
  const double s = ab2 > 0 ? std::clamp(dot / ab2, 0.0, 1.0) : 0.0;
  double d2 = 0;
  for (int k = 0; k < 3; ++k) {
    const double d = p[k] - a[k] - s * (b[k] - a[k]);
    d2 += d * d;
  }
  return d2;
}

}  // namespace

std::vector<std::size_t> thin_track(std::span<const double> lat, std::span<const double> lon,
                                    std::size_t points) {
  const std::size_t n = std::min(lat.size(), lon.size());
  std::vector<std::size_t> kept;
  if (n <= points || n < 5) {
    kept.resize(n);
    for (std::size_t i = 0; i < n; ++i) kept[i] = i;
    return kept;
  }
  // Candidates at an even stride: the shape is then found in time and memory that do not grow with
  // the log.
  const std::size_t stride = std::max<std::size_t>(1, n / (20 * std::max<std::size_t>(points, 1)));
  std::vector<std::size_t> index;
  std::vector<Unit> at;
  std::vector<std::pair<std::size_t, std::size_t>> pieces;  // of candidates, between gaps
  std::vector<std::size_t> gaps;
  std::size_t begin = 0;
  bool in_gap = false;
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(lat[i]) || !std::isfinite(lon[i])) {
      if (!in_gap) {
        gaps.push_back(i);
        if (at.size() > begin) pieces.emplace_back(begin, at.size() - 1);
        begin = at.size();
      }
      in_gap = true;
      continue;
    }
    if (in_gap || i % stride == 0 || i + 1 == n) {
      index.push_back(i);
      at.push_back(unit_of(lat[i], lon[i]));
    }
    in_gap = false;
  }
  if (at.size() > begin) pieces.emplace_back(begin, at.size() - 1);

  // How far the track would be bent if the point were left out, never more than for the point that
  // split before it.
  std::vector<double> weight(at.size(), 0.0);
  double extent2 = 0;
  for (const auto& u : at) extent2 = std::max(extent2, distance2(u, at.front(), at.front()));
  const double negligible = extent2 * 1e-10;  // 1e-5 of the size of the track: less than a pixel
  struct Piece {
    std::size_t a, b;
    double limit;
  };
  std::vector<Piece> stack;
  for (const auto& [a, b] : pieces) {
    weight[a] = weight[b] = 4.0;
    stack.push_back({a, b, 4.0});
  }
  while (!stack.empty()) {
    const Piece piece = stack.back();
    stack.pop_back();
    if (piece.b < piece.a + 2) continue;
    double most = -1;
    std::size_t where = piece.a;
    for (std::size_t i = piece.a + 1; i < piece.b; ++i) {
      const double d2 = distance2(at[i], at[piece.a], at[piece.b]);
      if (d2 > most) {
        most = d2;
        where = i;
      }
    }
    if (most <= negligible) continue;
    weight[where] = std::min(most, piece.limit);
    stack.push_back({piece.a, where, weight[where]});
    stack.push_back({where, piece.b, weight[where]});
  }
  double least = 0;
  if (weight.size() > points) {
    std::vector<double> order = weight;
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(points),
                     order.end(), std::greater<>());
    least = order[points];
  }
  for (std::size_t i = 0; i < at.size(); ++i)
    if (weight[i] > least || weight[i] == 4.0) kept.push_back(index[i]);
  if (gaps.size() > points) gaps.resize(points);
  kept.insert(kept.end(), gaps.begin(), gaps.end());
  std::sort(kept.begin(), kept.end());
  return kept;
}

std::vector<double> sorted_finite(std::span<const double> values) {
  std::vector<double> out;
  out.reserve(values.size());
  for (const double v : values)
    if (std::isfinite(v)) out.push_back(v);
  std::sort(out.begin(), out.end());
  return out;
}

double percentile(std::span<const double> sorted, double percent) {
  if (sorted.empty()) return std::nan("");
  const double at = std::clamp(percent / 100.0, 0.0, 1.0) * static_cast<double>(sorted.size() - 1);
  const auto i = static_cast<std::size_t>(at);
  if (i + 1 >= sorted.size()) return sorted.back();
  return sorted[i] + (at - static_cast<double>(i)) * (sorted[i + 1] - sorted[i]);
}

Bins make_bins(const std::vector<std::vector<double>>& samples, int bins) {
  Bins out;
  double lo = INFINITY, hi = -INFINITY, width = 0;
  for (const auto& values : samples) {
    const auto sorted = sorted_finite(values);
    if (sorted.empty()) continue;
    lo = std::min(lo, sorted.front());
    hi = std::max(hi, sorted.back());
    const double spread = percentile(sorted, 75) - percentile(sorted, 25);
    width = std::max(width, 2.0 * spread / std::cbrt(static_cast<double>(sorted.size())));
  }
  if (!(lo <= hi)) return out;
  if (lo == hi) {  // one value: a bin around it
    const double half = lo == 0 ? 0.5 : std::fabs(lo) * 1e-3;
    lo -= half;
    hi += half;
  }
  std::size_t n = static_cast<std::size_t>(std::max(bins, 0));
  if (bins <= 0)
    n = width > 0 ? static_cast<std::size_t>(std::clamp(std::ceil((hi - lo) / width), 5.0, 120.0))
                  : 20;
  out.edges.resize(n + 1);
  for (std::size_t i = 0; i <= n; ++i)
    out.edges[i] = lo + (hi - lo) * static_cast<double>(i) / static_cast<double>(n);
  for (const auto& values : samples) {
    std::vector<double> counts(n, 0.0);
    for (const double v : values) {
      if (!std::isfinite(v) || v < lo || v > hi) continue;
      counts[std::min(
          n - 1, static_cast<std::size_t>((v - lo) / (hi - lo) * static_cast<double>(n)))] += 1;
    }
    out.counts.push_back(std::move(counts));
  }
  return out;
}

}  // namespace loxo::report
