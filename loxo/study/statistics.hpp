// SPDX-License-Identifier: Apache-2.0
// What the rows of a campaign say: intervals, percentiles with confidence, which parameter matters,
// and whether two campaigns differ.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "loxo/study/campaign.hpp"

namespace loxo {

struct Percentile {
  double at = 50;                    // percent
  double value = 0, lo = 0, hi = 0;  // 95 % interval, free of any distribution (order statistics)
};
struct Summary {
  std::string name;
  std::uint64_t count = 0, bad = 0;           // finite values; others
  double mean = 0, mean_lo = 0, mean_hi = 0;  // 95 %
  double std = 0, std_lo = 0, std_hi = 0;
  double rms = 0, least = 0, most = 0;
  std::vector<Percentile> percentiles;  // 5, 25, 50, 75, 95, 99
};
Summary summarize(const std::string& name, const std::vector<double>& values);

// How much of a metric's spread a parameter explains.
struct Influence {
  std::string parameter;
  double rank_correlation = 0;  // Spearman
  double share =
      0;  // first-order: variance of the mean over 20 slices of the parameter / variance, 0 … 1
};
Influence influence(const std::string& parameter, const std::vector<double>& x,
                    const std::vector<double>& metric);

// b against a.
struct Difference {
  double mean = 0, lo = 0, hi = 0;  // of b - a, 95 %
  bool paired = false;              // trial by trial (same seed)
  double ks = 0, p_value = 1;       // Kolmogorov-Smirnov
};
Difference difference(const std::vector<double>& a, const std::vector<double>& b, bool paired);

// Fingerprint of a file's bytes.
std::uint64_t file_fingerprint(const std::string& path);

}  // namespace loxo
