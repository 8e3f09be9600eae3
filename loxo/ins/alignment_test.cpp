// SPDX-License-Identifier: Apache-2.0
#include "loxo/ins/alignment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "loxo/earth/attitude.hpp"
#include "loxo/ins/closed_form_truth.hpp"
#include "loxo/ins/geographic.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr double kGravity = 9.8;  // m/s^2; only its direction enters
// Rates linear over samples of 10 ms of a sway of some seconds: below 1e-7 rad of level, 1e-7/(w_N
// T) of heading.
constexpr double kExact = 2e-5;  // rad

truth::Motion standing(double lat, double heading, double sway) {
  auto m = truth::great_circle(wgs84(), lat, 110 * deg, 0, 0);
  m.heading = heading;
  m.roll = 2 * sway, m.pitch = sway, m.yaw = sway;
  return m;
}
Rot<Geographic, Body> true_attitude(const truth::Motion& m, double lat, double t) {
  const UnitAngle<double> a{std::sin(lat), std::cos(lat)};
  return GeographicMechanization::axes(a, std::sin(110 * deg), std::cos(110 * deg)) *
         to_matrix(m.at(t).state.q_eb);
}
double heading_error(const Rot<Geographic, Body>& found, const Rot<Geographic, Body>& truth) {
  const double d = to_euler(found).heading - to_euler(truth).heading;
  return std::remainder(d, 2 * kPi);
}

// estimation.md 4.1
TEST(Alignment, CoarseStaticIsExactAtRest) {
  for (double lat : {-70 * deg, -1e-3, 0.0, 34 * deg, 89 * deg})
    for (double heading : {0.0, 100 * deg, 359 * deg}) {
      const auto m = standing(lat, heading, 0);
      const auto at = m.at(0);
      // The ellipsoid's gravity is along the normal here, the centrifugal part in it.
      EXPECT_NEAR(heading_error(coarse_static(at.w_ib, at.f), true_attitude(m, lat, 0)), 0, 1e-9)
          << lat << ' ' << heading;
    }
}

// estimation.md 4.2: the base rocks by degrees; the mean rate is lost, the inertial frame is not.
TEST(Alignment, InertialFrameSurvivesSway) {
  for (double lat : {-60 * deg, 0.0, 34 * deg, 80 * deg})
    for (double heading : {10 * deg, 200 * deg}) {
      const auto m = standing(lat, heading, 1 * deg);
      InertialFrameAlignment a(lat, m.ell.w_ie, kGravity);
      Vec<Body> w, f;
      const auto samples = m.record(0.01, 20000);
      for (const auto& s : samples) {
        a.add(s);
        w += s.dtheta, f += s.dv;
      }
      const double T = samples.back().t;
      const auto truth = true_attitude(m, lat, T), found = a.attitude();
      EXPECT_NEAR(heading_error(found, truth), 0, kExact / std::cos(lat)) << lat / deg;
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(found.m[2][i], truth.m[2][i], 1e-6);
      EXPECT_GT(std::fabs(heading_error(coarse_static(w, f), truth)), 100 * kExact);
    }
}

// [EST-15], first term with its sign: an east gyro bias turns the heading by g_E/w_N.
TEST(Alignment, EastBiasTurnsTheHeading) {
  const double lat = 40 * deg, bias = 0.01 * deg_per_h;
  const auto m = standing(lat, 0, 0);
  InertialFrameAlignment a(lat, m.ell.w_ie, kGravity);
  for (auto s : m.record(0.1, 3000)) {
    s.dtheta.x += bias * s.dt;
    a.add(s);
  }
  const double expected = bias / (m.ell.w_ie * std::cos(lat));
  EXPECT_NEAR(std::fabs(heading_error(a.attitude(), true_attitude(m, lat, 300))), expected,
              0.02 * expected);
  EXPECT_DOUBLE_EQ(a.sigma({bias, 0, 0}).gyro_bias, expected);
}

// [EST-15], second and third term: scatter over draws. The specification's own draws on velocities
// lie up to 25 % above.
TEST(Alignment, PredictedScatterIsTheScatter) {
  const double lat = 40 * deg, dt = 0.5, T = 300;
  const auto m = standing(lat, 30 * deg, 0);
  const auto clean = m.record(dt, static_cast<long>(T / dt));
  const auto truth = true_attitude(m, lat, T);
  for (const bool gyro : {false, true}) {
    const AlignmentErrors e{0, gyro ? 0.005 * deg_per_sqrt_h : 0.0,
                            gyro ? 0.0 : 0.02 * mps_per_sqrt_h};
    std::mt19937_64 rng(7);
    std::normal_distribution<double> g;
    double sum = 0, predicted = 0;
    constexpr int kDraws = 400;
    for (int k = 0; k < kDraws; ++k) {
      InertialFrameAlignment a(lat, m.ell.w_ie, kGravity);
      for (auto s : clean) {
        const double w = e.gyro_noise * std::sqrt(dt), f = e.accel_noise * std::sqrt(dt);
        s.dtheta += Vec<Body>{w * g(rng), w * g(rng), w * g(rng)};
        s.dv += Vec<Body>{f * g(rng), f * g(rng), f * g(rng)};
        a.add(s);
      }
      const double h = heading_error(a.attitude(), truth);
      sum += h * h;
      const auto s = a.sigma(e);
      predicted = std::hypot(s.gyro_noise, s.accel_noise);
    }
    const double ratio = std::sqrt(sum / kDraws) / predicted;
    std::printf("%s noise: scatter %.3f of the predicted\n", gyro ? "gyro" : "accelerometer",
                ratio);
    EXPECT_GT(ratio, 0.85);  // 400 draws: 4 sigma are 14 %
    EXPECT_LT(ratio, 1.45);
  }
}

// estimation.md 4.1 with polar.md 2.4: the heading of a levelled triad in steady motion, roll and
// pitch as they are; without the velocity it errs by the north-steaming error v_N/(R w cosL).
TEST(Alignment, GyrocompassIsExactInSteadyMotion) {
  for (double lat : {-75 * deg, 0.0, 34 * deg, 85 * deg})
    for (double course : {0.0, 70 * deg, 200 * deg, 359 * deg}) {
      auto m = truth::great_circle(wgs84(), lat, 110 * deg, course, 12);
      m.heading = 20 * deg;
      const auto at = m.at(0);
      const UnitAngle<double> a{std::sin(lat), std::cos(lat)};
      const auto c_ne = GeographicMechanization::axes(a, std::sin(110 * deg), std::cos(110 * deg));
      const auto v = c_ne * at.state.v;
      const auto k =
          level_terms(make_earth_model(m.ell), 0.0, std::cos(lat), std::sin(lat), 0.0, a);
      // A body that lists and trims: the same rate in other axes.
      const double roll = 7 * deg, pitch = -4 * deg;
      const auto tilted = transpose(to_matrix<Geographic>(Euler<double>{0, pitch, roll})) *
                          Vec<Geographic>{at.w_ib.x, at.w_ib.y, at.w_ib.z};
      const Vec<Body> w{tilted.x, tilted.y, tilted.z};
      const double truth = to_euler(true_attitude(m, lat, 0)).heading;
      const double found = gyrocompass(w, roll, pitch, lat, m.ell.w_ie, {v.x, v.y, k.kxx, k.kyy});
      EXPECT_NEAR(std::remainder(found - truth, 2 * kPi), 0, 1e-9) << lat / deg << ' ' << course;
      const double steaming = std::atan2(-v.y * k.kyy, m.ell.w_ie * std::cos(lat) + v.x * k.kxx);
      const double still = gyrocompass(w, roll, pitch, lat, m.ell.w_ie);
      EXPECT_NEAR(std::remainder(still - truth + steaming, 2 * kPi), 0, 1e-9);
    }
}

// Where the base stands is seen from the Earth's turn alone, sway or not.
TEST(Alignment, LatitudeFromGravityAndEarthRate) {
  for (double lat : {-80 * deg, -34 * deg, 1 * deg, 34 * deg, 60 * deg, 85 * deg})
    for (double sway : {0.0, 1 * deg}) {
      const auto m = standing(lat, 40 * deg, sway);
      InertialFrameAlignment a(0.3, m.ell.w_ie, kGravity);  // a wrong latitude does not matter
      for (const auto& s : m.record(0.02, 15000)) a.add(s);
      // At rest the sums' own steps, dt/T. A yaw of A sin(2 pi t/P) leaves a slope of at most
      // 12 A P/(2 pi T^2) (one period's rest at either end).
      const double limit =
          sway == 0 ? 1e-3 : 12 * sway * m.yaw_period / (2 * kPi * 300 * 300 * m.ell.w_ie);
      EXPECT_NEAR(a.latitude(), lat, limit) << lat / deg << ' ' << sway;
    }
}

TEST(Alignment, LatitudeLimitIsWhereTheSigmaReachesIt) {
  for (double bias : {0.001, 0.01, 0.1, 1.0}) {
    const double lat = latitude_limit(bias * deg_per_h, wgs84().w_ie, kRefusedHeading);
    const InertialFrameAlignment a(lat, wgs84().w_ie, kGravity);
    EXPECT_NEAR(a.sigma({bias * deg_per_h, 0, 0}).gyro_bias, kRefusedHeading,
                1e-9 * kRefusedHeading);
  }
  EXPECT_EQ(latitude_limit(2 * deg_per_h, wgs84().w_ie, kRefusedHeading), 0.0);
}

// estimation.md 4.5: the limit of a gyro of 0.01 deg/h lies at 89.6 deg, of 1 deg/h at 40 deg.
TEST(Alignment, SigmaGrowsTowardThePole) {
  auto total = [](double bias, double lat) {
    return InertialFrameAlignment(lat, wgs84().w_ie, kGravity).sigma({bias, 0, 0}).gyro_bias;
  };
  EXPECT_LT(total(0.01 * deg_per_h, 89.5 * deg), kRefusedHeading);
  EXPECT_GT(total(0.01 * deg_per_h, 89.7 * deg), kRefusedHeading);
  EXPECT_LT(total(1 * deg_per_h, 38 * deg), kRefusedHeading);
  EXPECT_GT(total(1 * deg_per_h, 42 * deg), kRefusedHeading);
}

}  // namespace
}  // namespace loxo
