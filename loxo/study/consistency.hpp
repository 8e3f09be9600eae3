// SPDX-License-Identifier: Apache-2.0
// Does a stated covariance tell the truth: chi-square bands, NEES, NIS, whiteness. estimation.md
// section 7.
#pragma once
#include <cstddef>
#include <span>

namespace loxo {

// P(X <= x) for chi-square with `dof` degrees of freedom (any positive real); relative error 1e-14.
double chi_square_cdf(double x, double dof);
// The x with chi_square_cdf(x, dof) = p, 0 < p < 1; relative error 1e-13.
double chi_square_quantile(double p, double dof);

// The band [chi2_{Mn}((1-confidence)/2), chi2_{Mn}((1+confidence)/2)] / M in which the mean of M
// normalised squared errors of dimension n lies with this confidence.
struct Band {
  double low = 0, high = 0;
};
Band chi_square_band(double n, double trials, double confidence = 0.95);

// Normalised squared error e^T P^-1 e of one 3-block; P row-major, symmetric positive definite,
// else NaN.
double normalised_square3(const double e[3], const double p[9]);

// Normalised innovations of one sensor: mean of y^2/S (or y^T S^-1 y) and the share above
// chi2_n(0.95).
struct InnovationSummary {
  double mean = 0;            // expected: n
  double share_above_95 = 0;  // expected: 0.05
  double lag1 = 0;            // autocorrelation of successive values about their mean
  bool coloured = false;      // |lag1| >= 2/sqrt(count): not white
  std::size_t count = 0;
};
InnovationSummary summarise_innovations(std::span<const double> nis, double n);

// The p-quantile (0..1) of `values`, NaN left out, by linear interpolation between order
// statistics; NaN when nothing is left.
double quantile(std::span<const double> values, double p);

}  // namespace loxo
