// SPDX-License-Identifier: Apache-2.0
// The weights; the acceptance simulation is study/segmented_gates_test.
#include "loxo/estimate/segmented.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

namespace loxo {
namespace {

// (V-57) is the minimum of (V-60) over all weights; (V-59) never claims less than the better input
// in trace.
TEST(Segmented, WeightsAreWhatTheyClaim) {
  std::mt19937 rng(std::random_device{}());
  std::normal_distribution<double> g;
  for (int n = 0; n < 50; ++n) {
    double L[4][4], P[4][4];
    for (auto& row : L)
      for (double& e : row) e = g(rng);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        P[i][j] = i == j ? 0.1 : 0;
        for (int k = 0; k < 4; ++k) P[i][j] += L[i][k] * L[j][k];
      }
    const double a[4] = {P[0][0], P[0][1], P[1][0], P[1][1]},
                 b[4] = {P[2][2], P[2][3], P[3][2], P[3][3]},
                 x[4] = {P[0][2], P[0][3], P[1][2], P[1][3]};
    double w[4], p[4], wn[4], pn[4], wc[4], pc[4];
    weight_minimum_variance(a, b, x, w, p);
    weight_naive(a, b, x, wn, pn);
    weight_intersection(a, b, wc, pc);
    EXPECT_LE(p[0] + p[3], pn[0] + pn[3] + 1e-9);
    EXPECT_LE(p[0] + p[3], std::min(a[0] + a[3], b[0] + b[3]) + 1e-9);
    EXPECT_LE(pc[0] + pc[3], std::min(a[0] + a[3], b[0] + b[3]) * (1 + 1e-6));
    // Where the cross covariance is zero the first two agree.
    const double zero[4] = {0, 0, 0, 0};
    weight_minimum_variance(a, b, zero, w, p);
    weight_naive(a, b, zero, wn, pn);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(w[i], wn[i], 1e-9);
  }
}

}  // namespace
}  // namespace loxo
