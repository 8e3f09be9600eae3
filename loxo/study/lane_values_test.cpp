// SPDX-License-Identifier: Apache-2.0
// Out of the lanes and back into them: every number in its own lane and place, to the bit, for one
// lane and for eight; and the miss that the lanes' filters are judged by. [EST-1]
#include "loxo/study/lane_values.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "loxo/earth/attitude.hpp"
#include "loxo/study/drive_modes.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

// Number j of lane k; no two alike, tiny and huge ones among them.
double number(int k, std::size_t j) {
  return std::ldexp(1.0 + 0.01 * k, 60 * static_cast<int>(j) - 300);
}

template <Real S>
void there_and_back() {
  std::array<double, 11> rows[kWide<S>];
  for (int k = 0; k < kWide<S>; ++k)
    for (std::size_t j = 0; j < 11; ++j) rows[k][j] = number(k, j);
  S x[12];
  x[11] = S(-1.0);
  gather_rows(rows, 11, x);
  std::array<S, 11> all;
  for (std::size_t j = 0; j < 11; ++j) all[j] = x[j];
  const Spread<S, 11> back(all);
  const EcefState<S> state{{x[0], x[1], x[2]}, {x[3], x[4], x[5]}, {x[6], x[7], x[8], x[9]}};
  for (int k = 0; k < kWide<S>; ++k) {
    for (std::size_t j = 0; j < 11; ++j) {
      EXPECT_EQ(back.lane[k][j], number(k, j)) << k << ' ' << j;
      EXPECT_EQ(lane_of(x[j], k), number(k, j)) << k << ' ' << j;
    }
    EXPECT_EQ(lane_of(x[11], k), -1.0) << "beyond what was asked for";
    const EcefState<double> s = lane_of(state, k);
    const double told[10] = {s.r.x, s.r.y,    s.r.z,    s.v.x,    s.v.y,
                             s.v.z, s.q_eb.w, s.q_eb.x, s.q_eb.y, s.q_eb.z};
    for (std::size_t j = 0; j < 10; ++j) EXPECT_EQ(told[j], number(k, j)) << k << ' ' << j;
  }
}
TEST(LaneValues, AreTheSameBitsThereAndBack) {
  there_and_back<double>();
  there_and_back<Lanes>();
}

TEST(LaneValues, AStartIsBelievedWithItsMounting) {
  DriveSetup set;
  set.mounting_heading = 0.25, set.mounting_pitch = -0.5;
  EcefState<Lanes> x{};
  double turn[8], pitch[8];
  for (int k = 0; k < 8; ++k) turn[k] = k * 0.125, pitch[k] = -k;
  for (int k = 0; k < 8; ++k) {
    const NominalState s = believed_start(set, x, gather<Lanes>(turn), gather<Lanes>(pitch), k);
    EXPECT_EQ(s.eps_h, 0.25 - turn[k]);
    EXPECT_EQ(s.eps_p, -0.5 + pitch[k]);
  }
}

// Against the two-dimensional Gauss, by another's arithmetic, everywhere and for a covariance of
// any shape.
TEST(HorizontalMiss, IsThatOfTheHorizontalPart) {
  std::mt19937_64 rng(testing::seed());
  std::normal_distribution<double> g;
  for (const double lat : {0.0, 0.7, -1.2, 0.5 * kPi, -0.5 * kPi})
    for (const double lon : {0.0, 2.0, kPi, -kPi})
      for (const double size : {1e-3, 1.0, 1e5}) {
        const Rot<Geographic, Ecef> C = geographic_axes(lat, lon);
        DriveTruth::Epoch at;
        at.east = {C.m[0][0], C.m[0][1], C.m[0][2]};
        at.north = {C.m[1][0], C.m[1][1], C.m[1][2]};
        at.state.r = {size * g(rng), size * g(rng), size * g(rng)};
        NominalState s;
        s.r = at.state.r + size * Vec<Ecef>{g(rng), g(rng), g(rng)};
        Eigen::Matrix3d root, axes;
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j)
            root(i, j) = size * (g(rng) + (i == j ? 4 : 0)), axes(i, j) = C.m[i][j];
        const Eigen::Matrix3d P = root * root.transpose();
        Covariance<kStates> all;
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) all.p[kDr + i][kDr + j] = P(i, j);
        const Vec<Ecef> dr = s.r - at.state.r;
        const Eigen::Vector2d d = axes.topRows<2>() * Eigen::Vector3d(dr.x, dr.y, dr.z);
        const Eigen::Matrix2d H = axes.topRows<2>() * P * axes.topRows<2>().transpose();
        const HorizontalMiss miss = horizontal_miss(s, all, at);
        // Some ten operations on the whole miss, of which the horizontal may be a small part; the
        // inverse loses what the condition of H says.
        const double rounding = 20 * std::numeric_limits<double>::epsilon(), all2 = dot(dr, dr),
                     smallest = H.determinant() / H.trace(), condition = H.trace() / smallest;
        EXPECT_NEAR(miss.squared, d.squaredNorm(), rounding * all2);
        EXPECT_NEAR(miss.distance, d.norm(), rounding * all2 / d.norm());
        EXPECT_NEAR(miss.nees, d.dot(H.ldlt().solve(d)), rounding * condition * all2 / smallest)
            << "lat " << lat << " lon " << lon;
      }
}

}  // namespace
}  // namespace loxo
