// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/transfer_budget.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "loxo/num/units.hpp"

namespace loxo {
namespace {

std::vector<TransferPoint> circle(double roll, double turn = 2 * kPi) {
  std::vector<TransferPoint> track;
  for (int i = 0; i < 3600; ++i) {
    TransferPoint p;
    p.tlat = 0.001;
    p.tlon = 59 * deg;
    p.angle = 59 * deg;
    p.heading = turn * i / 3600;  // once round in the hour, or less
    p.roll = roll * std::sin(2 * kPi * i / 9.0);
    p.ve = 6 * std::sin(p.heading);
    p.vn = 6 * std::cos(p.heading);
    set_gravity(wgs84(), p);
    track.push_back(p);
  }
  return track;
}

TEST(TransferBudget, FormulaAndMonteCarloAgree) {
  const ReferenceSigma sigma{3 * arcmin, 1 * arcmin, 0.1};
  const std::size_t draws = 400;
  const auto b = transfer_budget(wgs84(), circle(4 * deg), 1.0, sigma, draws, 5);
  // The relative standard deviation of a sampled rms is 1/sqrt(2 draws); the errors of few sources
  // make it more: 4 of them.
  const double tolerance = 4.0 / std::sqrt(2.0 * draws);
  const auto& f = b.formula;
  const auto& m = b.monte_carlo;
  for (auto [x, y] : {std::pair{f.rms_f.x, m.rms_f.x},
                      {f.rms_f.y, m.rms_f.y},
                      {f.rms_f.z, m.rms_f.z},
                      {f.rms_w.x, m.rms_w.x},
                      {f.rms_w.y, m.rms_w.y},
                      {f.rms_w.z, m.rms_w.z}})
    EXPECT_NEAR(y / x, 1.0, tolerance);
  EXPECT_LT(f.bias_w.x, f.rms_w.x);
  // Round the whole circle the bias averages out to second order; over a quarter it stays.
  const auto q = transfer_budget(wgs84(), circle(4 * deg, kPi / 2), 1.0, sigma, draws, 5);
  for (auto [x, y] : {std::pair{q.formula.bias_f.x, q.monte_carlo.bias_f.x},
                      {q.formula.bias_f.y, q.monte_carlo.bias_f.y},
                      {q.formula.bias_w.x, q.monte_carlo.bias_w.x},
                      {q.formula.bias_w.z, q.monte_carlo.bias_w.z}})
    EXPECT_NEAR(y / x, 1.0, tolerance);
  // Turning once in the hour: slow; rolling: fast.
  EXPECT_GT(b.spectrum.f[0] + b.spectrum.f[1], 0.5);
  EXPECT_GT(b.spectrum.f[2], 0.0);
  EXPECT_NEAR(b.spectrum.w[0] + b.spectrum.w[1] + b.spectrum.w[2], 1.0, 1e-12);
  const auto level = transfer_budget(wgs84(), circle(0), 1.0, sigma, 0, 5);
  // Six degrees of turn in a minute: (0.1 rad)^2 / 12 of the variance.
  EXPECT_LT(level.spectrum.f[2], 1.2e-3);
  EXPECT_GT(b.spectrum.f[2], 4 * level.spectrum.f[2]);
}

// The plan's closed form is the budget of a level ship that turns through all headings.
TEST(TransferBudget, PlanIsTheBudgetOfALevelShip) {
  const ReferenceSigma sigma{3 * arcmin, 1 * arcmin, 0.1};
  const UnitSigma unit{0.01 * deg_per_h, 10 * ug};
  const auto b = transfer_budget(wgs84(), circle(0), 1.0, sigma, 0, 1).formula;
  const PlanRow r = plan_row(wgs84(), 31 * deg, 59 * deg, sigma, unit);
  // terms left out in 7.5: 2.4 %
  EXPECT_NEAR(b.rms_f.x / r.accel, 1.0, 0.03);
  EXPECT_NEAR(b.rms_f.y / r.accel, 1.0, 0.03);
  EXPECT_NEAR(b.rms_w.x / r.gyro, 1.0, 0.03);
  EXPECT_NEAR(b.rms_w.z / r.gyro_up, 1.0, 0.03);
  // A reference as good as needed meets the share, to the last bit or so; a little worse does not.
  const PlanRow good = plan_row(wgs84(), 31 * deg, 59 * deg, r.needed, unit);
  EXPECT_LE(good.verdict.gyro_ratio, 0.1 * (1 + 1e-12));
  EXPECT_LE(good.verdict.accel_ratio, 0.1 * (1 + 1e-12));
  ReferenceSigma worse = r.needed;
  worse.level *= 3;
  worse.heading *= 3;
  worse.velocity *= 3;
  EXPECT_FALSE(plan_row(wgs84(), 31 * deg, 59 * deg, worse, unit).verdict.good);
  // No transfer, no error.
  const PlanRow none = plan_row(wgs84(), 80 * deg, 0.0, sigma, unit);
  EXPECT_EQ(none.accel, 0.0);
  EXPECT_TRUE(none.verdict.good);
}

}  // namespace
}  // namespace loxo
