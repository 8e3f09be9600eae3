// SPDX-License-Identifier: Apache-2.0
// Fewer points that draw the same picture. All functions take NaN as a gap and keep it as one.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace loxo::report {

// Indices (ascending) of at most about `points` of y: first, last, and the minimum, the maximum and
// a NaN, if any, of each of equal pieces; so that a peak of one sample in a million is still seen.
std::vector<std::size_t> thin_curve(std::span<const double> y, std::size_t points);
// Indices of at most about `points` of a track [rad]: those that shape it most (Douglas-Peucker on
// the unit sphere, so that the pole and +-180 degrees are places like any other).
std::vector<std::size_t> thin_track(std::span<const double> lat, std::span<const double> lon,
                                    std::size_t points);

struct Bins {
  std::vector<double> edges;                // n + 1
  std::vector<std::vector<double>> counts;  // per sample, n each
};
// Common bins of several samples; `bins` 0: Freedman-Diaconis of the widest, between 5 and 120. Not
// finite: left out.
Bins make_bins(const std::vector<std::vector<double>>& samples, int bins);
// Value below which `percent` of the sorted finite values lie (linear between order statistics);
// NaN for none.
double percentile(std::span<const double> sorted, double percent);
// Finite values in ascending order.
std::vector<double> sorted_finite(std::span<const double> values);

}  // namespace loxo::report
