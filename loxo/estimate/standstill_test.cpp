// SPDX-License-Identifier: Apache-2.0
// The three witnesses and the verdicts they come to (estimation.md section 3): standing, dead
// encoder, spin, parked; none of them by one witness alone.
#include "loxo/estimate/standstill.hpp"

#include <gtest/gtest.h>

#include <random>

#include "test_seed.hpp"

namespace loxo {
namespace {

constexpr double kStep = 0.1;  // ten samples a window, as the specification's 1.65
struct Vehicle {
  double imu = 1;        // rms of its noise in sigmas: 1 at rest
  double speed = 0;      // what the filter says
  bool wheel = true;     // it speaks, ten times a second
  bool turns = false;    // and it moves
  double sigma = 0.025;  // of the filter's velocity
};
struct Yard {
  std::mt19937_64 rng;
  std::normal_distribution<double> g;
  StandstillConfig config;
  StandstillDetector detector;
  double t = 0;
  explicit Yard(StandstillConfig c = make()) : rng(testing::seed()), config(c), detector(c) {}
  static StandstillConfig make() {
    StandstillConfig c;
    c.sigma_w = 1e-3, c.sigma_f = 1e-2;
    return c;
  }
  Vec<Body> noise(double k) { return {k * g(rng), k * g(rng), k * g(rng)}; }
  // The verdict of the last window in `seconds`.
  StandstillVerdict drive(const Vehicle& v, int seconds) {
    StandstillVerdict last;
    for (int s = 0; s < seconds; ++s)
      for (int i = 0; i < 10; ++i) {
        t += kStep;
        const Vec<Body> rest{1e-5, 4e-5, 5e-5};
        detector.sample(kStep, rest + noise(1e-3 * v.imu),
                        Vec<Body>{0.3, -0.2, 9.8} + noise(1e-2 * v.imu), rest);
        if (v.wheel) detector.wheel(t, v.turns, 0.1, v.turns ? 5.0 : 0.0);
        const StandstillVerdict j = detector.judge(t, v.speed, v.sigma);
        if (j.complete) last = j;
      }
    return last;
  }
};
// estimation.md 3: of 100 Hz and of 6.25 Hz, three times the white noise of one sample; a unit
// without noise has none.
TEST(Standstill, NoiseToExpectIsThreeTimesThatOfTheDataSheet) {
  StandstillConfig c;
  expect_noise(c, 1e-4, 2e-3, 0.01);
  EXPECT_DOUBLE_EQ(c.sigma_w, 3e-3);
  EXPECT_DOUBLE_EQ(c.sigma_f, 6e-2);
  expect_noise(c, 1e-4, 2e-3, 0.16);
  EXPECT_DOUBLE_EQ(c.sigma_w, 7.5e-4);
  EXPECT_DOUBLE_EQ(c.sigma_f, 1.5e-2);
  expect_noise(c, 0, 0, 0.01);
  EXPECT_EQ(c.sigma_w, 0);
  EXPECT_EQ(c.sigma_f, 0);
}
TEST(Standstill, AllThreeWitnessesMakeStanding) {
  Yard y;
  const StandstillVerdict v = y.drive({}, 3);
  EXPECT_TRUE(v.imu_quiet && v.wheel_known && v.wheel_quiet && v.filter_agrees);
  EXPECT_EQ(v.standing, Standing::kStanding);
  EXPECT_NEAR(v.length, 1.0, 1e-9);
  EXPECT_NEAR(v.mean_w.z, 5e-5, 5e-3);
  // Without a wheel the other two are enough.
  Yard w;
  Vehicle none;
  none.wheel = false;
  EXPECT_EQ(w.drive(none, 3).standing, Standing::kStanding);
}
// The wheel is silent while the filter moves: for more than two seconds a dead encoder, never
// parked.
TEST(Standstill, ASilentWheelInMotionIsDead) {
  Yard y;
  Vehicle moving{20, 15, true, true}, dead = moving;
  dead.turns = false;
  EXPECT_EQ(y.drive(moving, 5).standing, Standing::kMoving);
  EXPECT_EQ(y.drive(dead, 2).standing, Standing::kMoving);
  EXPECT_EQ(y.drive(dead, 2).standing, Standing::kDeadEncoder);
  EXPECT_EQ(y.drive(dead, 60).standing, Standing::kDeadEncoder);
  // On a smooth straight the IMU may be quiet too: still dead, as the filter moves.
  Vehicle smooth = dead;
  smooth.imu = 1;
  EXPECT_EQ(y.drive(smooth, 5).standing, Standing::kDeadEncoder);
  EXPECT_EQ(y.drive(moving, 2).standing, Standing::kMoving);  // it speaks again
}
// Parked, and somebody enters: the IMU is not quiet, wheel and filter say rest. Neither standing
// nor a dead encoder.
TEST(Standstill, AShakenParkedCarIsNeither) {
  Yard y;
  EXPECT_EQ(y.drive({}, 3).standing, Standing::kStanding);
  const StandstillVerdict v = y.drive({8, 0.05, true, false}, 10);
  EXPECT_EQ(v.standing, Standing::kMoving);
  EXPECT_FALSE(v.imu_quiet);
  EXPECT_TRUE(v.wheel_quiet && v.filter_agrees);
}
// The wheel turns while IMU and filter are at rest: after two seconds spin (or the roll-out of a
// speed filter), and zero velocity is used.
TEST(Standstill, ATurningWheelAtRestIsSpin) {
  Yard y;
  EXPECT_EQ(y.drive({}, 3).standing, Standing::kStanding);
  const Vehicle spin{1, 0, true, true};
  EXPECT_EQ(y.drive(spin, 1).standing, Standing::kMoving);
  EXPECT_EQ(y.drive(spin, 3).standing, Standing::kSpin);
  EXPECT_EQ(y.drive({}, 2).standing, Standing::kStanding);
}
// A quiet IMU and wheel beside a filter that moves fast: not standing.
TEST(Standstill, TheFilterIsAWitnessToo) {
  Yard y;
  const StandstillVerdict v = y.drive({1, 15, true, false}, 2);
  EXPECT_TRUE(v.imu_quiet && v.wheel_quiet);
  EXPECT_FALSE(v.filter_agrees);
  EXPECT_NE(v.standing, Standing::kStanding);
}
// A wheel that has stopped talking is no witness of rest.
TEST(Standstill, AnOldReadingIsNoWitness) {
  Yard y;
  y.drive({}, 3);
  Vehicle gone;
  gone.wheel = false;
  const StandstillVerdict v = y.drive(gone, 3);
  EXPECT_FALSE(v.wheel_known);
  EXPECT_FALSE(v.wheel_quiet);
}
// An IMU that was quiet in motion as well is no witness. Without a wheel a filter that has lost its
// speed must not be told that it stands; one that nearly knows it may.
TEST(Standstill, QuietInMotionIsNoWitness) {
  Vehicle smooth{1, 5, false, false, 0.1}, lost{1, 0.8, false, false, 1.5},
      stopped{1, 0.3, false, false, 0.2}, rough = smooth;
  rough.imu = 20;
  Yard y;
  EXPECT_EQ(y.drive(smooth, 10).standing, Standing::kMoving);
  EXPECT_EQ(y.drive(lost, 10).standing, Standing::kMoving);
  EXPECT_EQ(y.drive(stopped, 2).standing, Standing::kStanding);
  // A road that shakes makes quiet a witness: the same filter is told.
  Yard z;
  EXPECT_EQ(z.drive(rough, 100).standing, Standing::kMoving);
  EXPECT_EQ(z.drive(lost, 2).standing, Standing::kStanding);
  // A wheel at rest is witness enough.
  Yard w;
  w.drive(smooth, 10);
  lost.wheel = true;
  EXPECT_EQ(w.drive(lost, 3).standing, Standing::kStanding);
}
// A fix that contradicts outweighs quiet for ten seconds, not a wheel.
TEST(Standstill, AFixThatContradictsEndsRestWithoutAWheel) {
  Vehicle none{1, 0, false, false};
  Yard y;
  EXPECT_EQ(y.drive(none, 3).standing, Standing::kStanding);
  y.detector.contradict(y.t);
  EXPECT_EQ(y.drive(none, 9).standing, Standing::kMoving);
  EXPECT_EQ(y.drive(none, 3).standing, Standing::kStanding);
  Yard w;
  w.drive({}, 3);
  w.detector.contradict(w.t);
  EXPECT_EQ(w.drive({}, 2).standing, Standing::kStanding);
}
// The threshold is chi-square's at one false alarm in a million windows: 1.65 for ten samples; and
// standing is found at about that rate of misses.
TEST(Standstill, ThresholdIsDerived) {
  EXPECT_NEAR(standstill_factor(10), 1.65, 0.02);
  EXPECT_GT(standstill_factor(5), standstill_factor(10));
  EXPECT_NEAR(standstill_factor(100000), 1.0, 0.01);
  Yard y;
  int standing = 0;
  for (int i = 0; i < 2000; ++i) standing += y.drive({}, 1).standing == Standing::kStanding;
  EXPECT_GE(standing, 1997);  // of the first windows, and 2e-6 a window
  // Twice the noise is seen in nearly every window: chi2_30 above 30 * 1.65^2/4 in 95 %.
  Yard z;
  int moving = 0;
  for (int i = 0; i < 300; ++i) moving += !z.drive({2, 0, true, false}, 1).imu_quiet;
  EXPECT_GT(moving, 270);
}

}  // namespace
}  // namespace loxo
