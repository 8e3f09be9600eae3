// SPDX-License-Identifier: Apache-2.0
// The verdicts of estimation.md section 3, and how slow is too slow to be seen: what is taken for
// standing holds the velocity at zero, so a false one is worse than many missed.
#include "loxo/estimate/standstill.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

constexpr double kStep = 0.02, kSigmaW = 3e-4, kSigmaF = 5e-3;  // s, rad/s, m/s^2: of one sample

struct Scene {
  std::function<Vec<Body>(double)> rate = [](double) { return Vec<Body>{}; };   // beside the noise
  std::function<Vec<Body>(double)> force = [](double) { return Vec<Body>{}; };  // beside gravity
  double speed = 0;                                                             // of the vehicle
  double wheel = 0;  // what the wheel shows, as a speed
  double count = 0;  // m of one count: a counter; 0: a speed
  bool has_wheel = true;
  double filter_error = 0;  // of the filter's speed
  double filter_sigma = 0.02;
};
struct Seconds {
  int standing = 0, dead = 0, spin = 0, all = 0;
};
Seconds seconds(const Scene& s, double length = 120) {
  std::mt19937_64 rng(testing::seed(7));
  std::normal_distribution<double> g;
  StandstillConfig c;
  c.sigma_w = kSigmaW, c.sigma_f = kSigmaF;
  StandstillDetector d(c);
  Seconds out;
  double way = 0, told = 0;
  for (int i = 1; i <= static_cast<int>(length / kStep); ++i) {
    const double t = i * kStep;
    const auto noise = [&](double x) { return Vec<Body>{x * g(rng), x * g(rng), x * g(rng)}; };
    d.sample(kStep, s.rate(t) + noise(kSigmaW), Vec<Body>{0, 0, 9.8} + s.force(t) + noise(kSigmaF),
             Vec<Body>{});
    if (s.has_wheel && i % 5 == 0) {
      way += s.wheel * 0.1;
      if (s.count > 0) {
        const double now = std::floor(way / s.count) * s.count;
        d.wheel(t, std::fabs(now - told) > 0.5 * s.count, 0.1, (now - told) / 0.1);
        told = now;
      } else {
        d.wheel(t, std::fabs(s.wheel) > c.wheel_quiet, 0.1, s.wheel);
      }
    }
    const StandstillVerdict v =
        d.judge(t, std::fabs(s.speed + s.filter_error), std::hypot(s.filter_sigma, 0.02));
    if (!v.complete || out.all++ < 3) continue;  // the first seconds know no wheel
    out.standing += v.standing == Standing::kStanding;
    out.dead += v.standing == Standing::kDeadEncoder;
    out.spin += v.standing == Standing::kSpin;
  }
  return out;
}

TEST(StandstillLimits, ParkedIsStanding) {
  EXPECT_GE(seconds(Scene{}).standing, 110);
  Scene none;
  none.has_wheel = false;
  EXPECT_GE(seconds(none).standing, 110);
}
// The engine idles: sigmas of the first verified standstill hold it (a sine within them).
TEST(StandstillLimits, AnIdlingEngineWithinTheSeenNoiseIsStanding) {
  Scene s;
  s.force = [](double t) { return Vec<Body>{0, 0, kSigmaF * std::sin(2 * kPi * 23.7 * t)}; };
  EXPECT_GE(seconds(s).standing, 110);
}
// Straight on at constant speed on a way without a jolt: the IMU is as quiet as parked, and the
// filter would agree up to 0.3 m/s. The wheel alone says that it moves, and is believed.
TEST(StandstillLimits, CreepingWithALivingWheelIsNeverStanding) {
  for (const double v : {0.06, 0.1, 0.2, 0.3, 0.35, 0.5, 2.0, 20.0})
    for (const double k : {0.8, 1.0, 1.2}) {
      Scene s;
      s.speed = v;
      for (const double count : {0.0, 0.001, 0.01}) {
        s.count = count;
        s.wheel = count > 0 ? v : k * v;  // a scale that is not known yet
        if (count == 0 && s.wheel < 0.06) continue;
        const Seconds x = seconds(s);
        EXPECT_EQ(x.standing, 0) << v << ' ' << count;
        EXPECT_EQ(x.spin, 0) << v << ' ' << count << ' ' << k;
        EXPECT_EQ(x.dead, 0) << v << ' ' << count;
      }
    }
}
// The limits: 0.05 m/s of a speed, one count in a second of a counter, 0.3 m/s and four sigma
// without a wheel.
TEST(StandstillLimits, WhatIsTooSlowToBeSeen) {
  Scene s;
  s.speed = s.wheel = 0.049;
  EXPECT_GE(seconds(s).standing, 110);
  s.count = 0.01;
  EXPECT_EQ(seconds(s).standing, 0);  // 4.9 counts a second
  s.speed = s.wheel = 0.004;
  EXPECT_GT(seconds(s).standing, 40);  // a count in 2.5 s
  Scene none;
  none.has_wheel = false;
  const double limit = 4 * std::hypot(0.02, 0.02) + 0.3;
  none.speed = limit - 0.01;
  EXPECT_GE(seconds(none).standing, 110);
  none.speed = limit + 0.01;
  EXPECT_EQ(seconds(none).standing, 0);
}
TEST(StandstillLimits, ADeadEncoderIsNotParking) {
  Scene s;
  s.speed = 15;
  const Seconds x = seconds(s);
  EXPECT_EQ(x.standing, 0);
  EXPECT_GE(x.dead, 110);
  s.speed = 0.5;  // also at a walk
  EXPECT_EQ(seconds(s).standing, 0);
}
TEST(StandstillLimits, AWheelThatSpinsOverAStandingVehicle) {
  Scene s;
  s.wheel = 5;
  const Seconds x = seconds(s);
  EXPECT_GE(x.spin, 105);
  EXPECT_EQ(x.standing, 0);
}
// A turntable: its rate beside the noise is seen from sigma sqrt(3 (factor^2 - 1)) on.
TEST(StandstillLimits, ATurntableIsSeenAboveItsLimit) {
  const double f = standstill_factor(10), limit = kSigmaW * std::sqrt(3 * (f * f - 1));
  std::printf("turntable seen from %.3f deg/s, %.2f sigma of a sample\n", limit / deg,
              limit / kSigmaW);
  for (const double share : {0.7, 1.3}) {
    Scene s;
    s.rate = [=](double) { return Vec<Body>{0, 0, share * limit}; };
    const int n = seconds(s).standing;
    if (share > 1) {
      EXPECT_EQ(n, 0);
    } else {
      EXPECT_GE(n, 110);
    }
  }
}
// Parked on a ferry that rolls by 1 deg in 8 s, or heaves: not at rest. Under way it is a vehicle
// whose wheel is silent.
TEST(StandstillLimits, AFerryIsNotTheGround) {
  Scene roll;
  roll.rate = [](double t) {
    return Vec<Body>{0, 1 * deg * 2 * kPi / 8 * std::cos(2 * kPi * t / 8), 0};
  };
  roll.force = [](double t) { return Vec<Body>{-9.8 * 1 * deg * std::sin(2 * kPi * t / 8), 0, 0}; };
  EXPECT_LE(seconds(roll).standing, 12);
  Scene heave;
  heave.force = [](double t) { return Vec<Body>{0, 0, 0.2 * std::sin(2 * kPi * t / 8)}; };
  EXPECT_LE(seconds(heave).standing, 12);
  roll.speed = heave.speed = 8;
  EXPECT_EQ(seconds(roll).standing + seconds(heave).standing, 0);
  EXPECT_GE(seconds(roll).dead, 110);
}

}  // namespace
}  // namespace loxo
