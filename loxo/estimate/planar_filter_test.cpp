// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/planar_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <random>

#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

PlanarConfig config() {
  PlanarConfig c;
  c.ellipsoid = wgs84();
  return c;
}
PlanarState start(double lat, double lon) {
  PlanarState s;
  s.at = reckon_start(lat, lon);
  s.eps = 0.3, s.ln_k = 0.05, s.drift = 1e-3, s.right = -0.4, s.forward = 1.2;
  return s;
}
const double kLatitudes[] = {0.0, 55 * deg, -44 * deg, 85 * deg};

TEST(PlanarFilter, TransitionIsTheDerivativeOfTheStep) {
  const double h = 1e-3;
  for (double lat : kLatitudes) {
    const PlanarState s = start(lat, kPi - 1e-7);  // over the date line
    PlanarFilter nominal(config(), s);
    const PlanarMatrix F = nominal.predict(30.0, 1.1, 100.0, 2.0, 1.0);
    for (int i = 0; i < kPlanarStates; ++i) {
      PlanarVector x = PlanarVector::Zero();
      PlanarState plus = s, minus = s;
      x[i] = h;
      correct(wgs84(), plus, 100.0, x);
      correct(wgs84(), minus, 100.0, -x);
      PlanarFilter a(config(), plus), b(config(), minus);
      a.predict(30.0, 1.1, 100.0, 2.0, 1.0);
      b.predict(30.0, 1.1, 100.0, 2.0, 1.0);
      const PlanarVector d = difference(wgs84(), a.state(), b.state(), 100.0) / (2 * h);
      // East metres at the step's middle against those at its end: d^2 tan(lat) / (2 a), 8e-4 m/rad
      // at 85 deg. Longitudes of pi are rounded to 3e-9 m, over 2e-3.
      EXPECT_LT((d - F.col(i)).cwiseAbs().maxCoeff(), 1e-3) << lat / deg << " state " << i;
    }
  }
}

TEST(PlanarFilter, AFixIsTheDerivativeOfTheLever) {
  // An exact fix of the shifted truth brings the nominal there, whatever the state: each in turn.
  for (double lat : kLatitudes)
    for (int i = 0; i < kPlanarStates; ++i) {
      if (i == kPlanarK || i == kPlanarDrift) continue;  // not seen by a fix alone
      PlanarState truth = start(lat, 2.0), s = truth;
      PlanarVector x = PlanarVector::Zero();
      x[i] = 1e-4;
      correct(wgs84(), truth, 0.0, x);
      s.P(i, i) = 1.0;
      const double theta = 0.8 - truth.eps;
      PlanarVector lever = PlanarVector::Zero();
      lever[kPlanarN] = truth.forward * std::cos(theta) - truth.right * std::sin(theta);
      lever[kPlanarE] = truth.forward * std::sin(theta) + truth.right * std::cos(theta);
      PlanarState point = truth;
      correct(wgs84(), point, 0.0, lever);
      PlanarFilter f(config(), s);
      ASSERT_TRUE(f.fix(point.at.lat, point.at.lon, 1e-6, 1e-6, 0.8, 0.0));
      // Second order in the lever's turn and in lever / a.
      EXPECT_NEAR(difference(wgs84(), f.state(), s, 0.0)[i], 1e-4, 1e-7) << lat / deg << ' ' << i;
    }
}

TEST(PlanarFilter, StatedErrorsAreTrue) {
  // 100 drives with the errors that are declared, another seed each time: NEES in its band.
  std::mt19937_64 rng(testing::seed());
  std::normal_distribution<double> normal;
  PlanarConfig c = config();
  c.scale_noise = 0.02, c.side_slip = 1 * deg, c.heading_noise = 0.05 * deg;
  double nees = 0;
  constexpr int kRuns = 100;
  for (int run = 0; run < kRuns; ++run) {
    PlanarState s;
    s.at = reckon_start(48 * deg, 11 * deg);
    s.P.diagonal() << 1, 1, std::pow(2 * deg, 2), 9e-4, std::pow(1e-5, 2), 0.25, 0.25;
    PlanarState truth = s;
    PlanarVector x;
    for (int i = 0; i < kPlanarStates; ++i) x[i] = std::sqrt(s.P(i, i)) * normal(rng);
    correct(c.ellipsoid, truth, 0, x);
    PlanarFilter f(c, s);
    for (int i = 0; i < 600; ++i) {
      const double recorded = 10, heading = 0.02 * i;
      PlanarFilter walk(c, truth);  // its own noise on the truth's way
      walk.predict(recorded, heading, 0, 1, 1);
      truth = walk.state();
      const double d = recorded * std::exp(-truth.ln_k), along = c.scale_noise * d * normal(rng),
                   across = c.side_slip * d * normal(rng), course = heading - truth.eps;
      x.setZero();
      x[kPlanarN] = along * std::cos(course) - across * std::sin(course);
      x[kPlanarE] = along * std::sin(course) + across * std::cos(course);
      x[kPlanarEps] = c.heading_noise * normal(rng);
      correct(c.ellipsoid, truth, 0, x);
      f.predict(recorded, heading, 0, 1, 1);
      if (i % 20 != 19) continue;
      const double theta = heading - truth.eps;
      PlanarState point = truth;
      x.setZero();
      x[kPlanarN] =
          truth.forward * std::cos(theta) - truth.right * std::sin(theta) + 2 * normal(rng);
      x[kPlanarE] =
          truth.forward * std::sin(theta) + truth.right * std::cos(theta) + 2 * normal(rng);
      correct(c.ellipsoid, point, 0, x);
      f.fix(point.at.lat, point.at.lon, 2, 2, heading, 0);
    }
    const PlanarVector e = difference(c.ellipsoid, truth, f.state(), 0);
    nees += e.dot(f.state().P.inverse() * e) / kRuns;
  }
  std::printf("NEES %.2f of %d\n", nees, kPlanarStates);
  // Chi-square of 700 degrees over 100: 5e-7 either side; and 5 % for what the filter linearises.
  EXPECT_GT(nees, 5.32 - 0.35);
  EXPECT_LT(nees, 8.99 + 0.35);
}

TEST(PlanarFilter, AnOutlierIsLeftOutAndALastingShiftBelieved) {
  PlanarState s;
  s.at = reckon_start(0.5, 0.0);
  s.P(0, 0) = s.P(1, 1) = 1;
  PlanarFilter f(config(), s);
  const double north = 50.0 / 6.36e6;
  EXPECT_FALSE(f.fix(0.5 + north, 0, 1, 1, 0, 0));
  EXPECT_EQ(f.state().at.lat, 0.5);
  for (int i = 0; i < 30; ++i) f.fix(0.5 + north, 0, 1, 1, 0, 0);
  EXPECT_NEAR(f.state().at.lat, 0.5 + north, 1 / 6.36e6);
  EXPECT_EQ(f.innovations().rejected, 10);
}

}  // namespace
}  // namespace loxo
