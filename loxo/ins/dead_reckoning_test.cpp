// SPDX-License-Identifier: Apache-2.0
// vehicle.md 1: every integrator against the rhumb line's closed form, the grid heading against the
// straight line over the pole, lanes against doubles.
#include "loxo/ins/dead_reckoning.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

// 2e-8 m is what the meridian arc promises; angles near +-180 deg are rounded to 3e-9 m of it.
constexpr double kArc = 3e-8;

// The distance between two points that lie near each other [m], frame-free.
double apart(double lat1, double lon1, double lat2, double lon2, double h = 0) {
  const auto p = to_ecef(wgs84(), Geodetic<double>{lat1, lon1, h});
  const auto q = to_ecef(wgs84(), Geodetic<double>{lat2, lon2, h});
  return norm(p - q);
}

ReckonState<> drive(Integrator integrator, double lat, double lon, double heading, double length,
                    double step, double h = 0) {
  auto state = reckon_start(lat, lon);
  const auto n = static_cast<int>(std::lround(length / step));
  for (int i = 0; i < n; ++i)
    step_by(wgs84(), integrator, state, step * std::cos(heading), step * std::sin(heading), h);
  return state;
}

double end_error(Integrator integrator, double step) {
  const double lat = 55 * deg, lon = 110 * deg, heading = 45 * deg, length = 90e3;
  const auto end = drive(integrator, lat, lon, heading, length, step);
  const auto truth = rhumb_direct(wgs84(), lat, lon, heading, length);
  return apart(end.lat, end.lon, truth.lat, truth.lon);
}

TEST(DeadReckoning, ConvergenceTable) {
  // vehicle.md 1.2; (V-6), (V-7), (V-8); [S0-DR]. One unit of the last printed digit.
  struct Row {
    double step, start_latitude, digit, midpoint, digit2;
  };
  for (const Row& r : {Row{1000, 5.04, 0.01, 1.65e-4, 1e-6}, Row{100, 0.504, 1e-3, 1.65e-6, 3e-8},
                       Row{10, 0.0504, 1e-4, 1.65e-8, 3e-8}}) {
    EXPECT_NEAR(end_error(Integrator::kStartLatitude, r.step), r.start_latitude, r.digit);
    EXPECT_NEAR(end_error(Integrator::kMidpoint, r.step), r.midpoint, r.digit2);
  }
  EXPECT_NEAR(end_error(Integrator::kStartLatitude, 1), 0.00504, 1e-5);
  // "< 1e-9" of the table, and 1e-9 m of ECEF's last digit at each of three coordinates.
  for (double step : {1.0, 10.0, 100.0, 1000.0, 5000.0, 90e3})
    EXPECT_LT(end_error(Integrator::kExact, step), step < 2000 ? 4e-9 : kArc) << step;
}

TEST(DeadReckoning, ExactStepsAddUpToOneRhumbLineEverywhere) {
  std::mt19937_64 random(testing::seed());
  std::uniform_real_distribution<double> lat(-88, 88), lon(-180, 180), az(-180, 180), len(1, 60e3);
  for (int i = 0; i < 200; ++i) {
    const double a = lat(random) * deg, o = lon(random) * deg, h = az(random) * deg,
                 s = len(random);
    for (int pieces : {1, 7, 300}) {
      const auto end = drive(Integrator::kExact, a, o, h, s, s / pieces);
      const auto truth = rhumb_direct(wgs84(), a, o, h, s);
      EXPECT_LT(apart(end.lat, end.lon, truth.lat, truth.lon), kArc)
          << "lat " << a / deg << " az " << h / deg << " len " << s << " in " << pieces;
    }
  }
}

TEST(DeadReckoning, ShortAndLongStepsMeet) {
  // Either side of the 2 km where the expansion gives way to divided differences, also high up.
  for (double lat : {0.0, 30.0, -60.0, 85.0, -89.0})
    for (double length : {1999.999, 2000.001, 60.0, 70.0}) {
      const auto end = drive(Integrator::kExact, lat * deg, 0.3, 1.1, length, length);
      const auto truth = rhumb_direct(wgs84(), lat * deg, 0.3, 1.1, length);
      EXPECT_LT(apart(end.lat, end.lon, truth.lat, truth.lon), kArc) << lat << " " << length;
    }
}

TEST(DeadReckoning, LatitudeKnowsNothingOfTheWay) {
  // (V-10): m is the sum of the northward steps, whatever their order; dlon/dm of D is w'(m)
  // (V-40).
  auto a = reckon_start(0.8, 0.2), b = a;
  for (int i = 0; i < 500; ++i) step_exact(wgs84(), a, 20.0, 0.0, 0.0);
  for (int i = 0; i < 500; ++i) step_exact(wgs84(), a, 0.0, 40.0, 0.0);
  for (int i = 0; i < 500; ++i) step_exact(wgs84(), b, 20.0, 40.0, 0.0);
  EXPECT_NEAR(a.lat, b.lat, 2e-16 * 2);
  EXPECT_GT(a.lon - b.lon, 1e-6);  // the longitude does
  auto low = reckon_start(0.8, 0.2), high = low;
  const auto r0 = step_exact(wgs84(), low, 1000.0, 0.0, 0.0);
  const auto r1 = step_exact(wgs84(), high, 1002.0, 0.0, 0.0);
  // d/dn of the mean of w over [0, n] is w'/2 at mid-step, to (n/a)^2; the difference of two rates
  // of 2e-7 over 2 m holds 1e-16 * 2e-7 / 2.
  EXPECT_NEAR((r1.mean_rate - r0.mean_rate) / 2.0, 0.5 * r0.slope, 1e-3 * r0.slope);
}

TEST(DeadReckoning, ThereAndBack) {
  for (double lat : {-70.0, 0.0, 55.0, 89.0})
    for (double step : {0.1, 30.0, 3000.0}) {
      auto state = reckon_start(lat * deg, 3.1);
      for (int i = 0; i < 100; ++i) step_exact(wgs84(), state, 0.3 * step, -0.8 * step, 0.0);
      for (int i = 0; i < 100; ++i) step_exact(wgs84(), state, -0.3 * step, 0.8 * step, 0.0);
      EXPECT_LT(apart(state.lat, state.lon, lat * deg, 3.1), 10 * kArc) << lat << " " << step;
    }
}

TEST(DeadReckoning, ManySmallStepsLoseNothing) {
  // 1e6 steps of 0.1 m: without the low parts the sum is off by some 1e-6 m.
  const auto end = drive(Integrator::kExact, 55 * deg, 110 * deg, 0.7, 1e5, 0.1);
  const auto truth = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 0.7, 1e5);
  EXPECT_LT(apart(end.lat, end.lon, truth.lat, truth.lon), kArc);
}

TEST(DeadReckoning, AcrossTheAntimeridianNothingHappens) {
  for (auto i : {Integrator::kExact, Integrator::kMidpoint, Integrator::kStartLatitude}) {
    const auto there = drive(i, -0.4, kPi - 1e-3, kPi / 2, 30e3, 100);
    const auto here = drive(i, -0.4, 0.0, kPi / 2, 30e3, 100);
    EXPECT_GT(there.lon, kPi);  // runs on
    EXPECT_NEAR(there.lon - (kPi - 1e-3), here.lon, 1e-15 * 10);
  }
}

TEST(DeadReckoning, HeightShrinksTheStep) {
  // (V-1), (V-2). East along the equator at height h: dlon = s/(a + h) exactly. North: a small step
  // by M + h.
  const double h = 1000;
  for (auto i : {Integrator::kExact, Integrator::kMidpoint, Integrator::kStartLatitude}) {
    auto state = reckon_start(0.0, 0.0);
    step_by(wgs84(), i, state, 0.0, 100.0, h);
    EXPECT_NEAR(state.lon * (wgs84().a + h), 100.0, 1e-12 * 100);
    state = reckon_start(0.9, 0.0);
    step_by(wgs84(), i, state, 1.0, 0.0, h);
    // dM/dL of a step of 1 m: 1e-9 relative
    EXPECT_NEAR((state.lat + state.lat_low - 0.9) * (meridian_radius(wgs84(), std::sin(0.9)) + h),
                1.0, 3e-9);
  }
}

TEST(DeadReckoning, TrueHeadingAcrossThePoleIsNan) {
  for (double sign : {1.0, -1.0})
    for (auto i : {Integrator::kExact, Integrator::kMidpoint, Integrator::kStartLatitude})
      for (double step : {1.0, 500.0, 5000.0}) {
        auto state = reckon_start(sign * 89.99 * deg, 0.0);
        bool left = false;
        for (int n = 0; n < 2300 && !left; ++n) {
          step_by(wgs84(), i, state, sign * step, 0.0, 0.0);
          left = !(state.lat == state.lat);
        }
        EXPECT_TRUE(left) << integrator_name(i) << " " << step;
      }
}

TEST(DeadReckoning, GridHeadingGoesStraightOverThePole) {
  // G = 0 on lon 0 is due north; over the pole the meridian goes on southward on lon 180 (V-11).
  for (bool north : {true, false}) {
    const double sign = north ? 1 : -1;
    auto state = grid_start(sign * 89.5 * deg, 0.0);
    const double quarter = wgs84().quarter_meridian;
    const double to_pole = quarter - meridian_arc(wgs84(), 89.5 * deg);
    for (int i = 0; i < 1000; ++i)
      step_grid(wgs84(), north, state, 2 * to_pole / 1000, north ? 0.0 : kPi, 0.0);
    double lat, lon;
    latlon_of_normal(state.n, lat, lon);
    EXPECT_LT(apart(lat, lon, sign * 89.5 * deg, kPi), 1e-6);  // 1e-9 m a step
    for (int i = 0; i < 500; ++i)
      step_grid(wgs84(), north, state, -2 * to_pole / 1000, north ? 0.0 : kPi, 0.0);
    latlon_of_normal(state.n, lat, lon);
    EXPECT_LT(apart(lat, lon, sign * kPi / 2, 0.0), 1e-6);
  }
}

TEST(DeadReckoning, GridHeadingAgreesWithTrueHeadingAwayFromThePole) {
  // The same way in two headings, G = psi -+ lon taken at mid-step (V-11): second order in the
  // step.
  for (bool north : {true, false}) {
    const double s = north ? 1 : -1;
    for (double psi : {0.3, 2.0, -2.5}) {
      double error[2];
      for (int fine : {0, 1}) {
        const double step = fine != 0 ? 10 : 20;
        auto truth = reckon_start(s * 80 * deg, 1.0);
        auto grid = grid_start(s * 80 * deg, 1.0);
        for (int i = 0; i < 10000 / step; ++i) {
          const double before = truth.lon;
          step_exact(wgs84(), truth, step * std::cos(psi), step * std::sin(psi), 0.0);
          step_grid(wgs84(), north, grid, step, psi - s * 0.5 * (before + truth.lon), 0.0);
        }
        double lat, lon;
        latlon_of_normal(grid.n, lat, lon);
        error[fine] = apart(lat, lon, truth.lat, truth.lon);
      }
      // 10 km in steps of 20 m: (step tan L/N)^2/24 of the way, 1e-6 m.
      EXPECT_LT(error[0], 1e-5) << north << " " << psi;
      EXPECT_LT(error[1], 0.3 * error[0] + 1e-8) << north << " " << psi;
    }
  }
}

TEST(DeadReckoning, MechanisedLogReturnsToItsTruth) {
  // (V-12) recorded, (V-42) taken out: the same way, round a curve, with and without Earth rate.
  for (double dt : {0.0, 1.0})
    for (double lat : {-60.0, 0.0, 40.0, 75.0}) {
      const double k = 1.2, eps = -1 * deg, step = 40, h = 200;
      auto record = mechanised_start(lat * deg, 2.0);
      auto again = mechanised_start(lat * deg, 2.0);
      for (int i = 0; i < 280; ++i) {
        const double psi = 0.6 + 0.01 * i;
        const double psi_rec = record_mechanised(wgs84(), record, step, psi, k, eps, h, dt);
        const double back = step_mechanised(wgs84(), again, k * step, psi_rec, k, eps, h, dt);
        // Two passes leave the cube of ds tan L/2N: 1e-14 rad a step
        EXPECT_NEAR(back, psi, 1e-11);
      }
      EXPECT_LT(apart(again.truth.lat, again.truth.lon, record.truth.lat, record.truth.lon), 1e-6);
    }
}

TEST(DeadReckoning, MechanisedSimilarityKeepsGeodesicCurvature) {
  // [H2-chords] as a law: with k = 1, eps = 0 the recorded heading is the true one.
  auto state = mechanised_start(40 * deg, 116 * deg);
  for (int i = 0; i < 100; ++i)
    EXPECT_NEAR(record_mechanised(wgs84(), state, 40.0, 0.8, 1.0, 0.0, 0.0, 1.0), 0.8, 1e-15);
  // eps = 90 deg at 40 N: the reckoner goes east where the way goes north, its heading turns by
  // chi = s tan L/N on the DR track, minus nothing on the true one (V-12).
  state = mechanised_start(40 * deg, 116 * deg);
  double psi = 0;
  for (int i = 0; i < 100; ++i)
    psi = record_mechanised(wgs84(), state, 10.0, 0.0, 1.0, kPi / 2, 0.0, 0.0);
  const double n = prime_vertical_radius(wgs84(), std::sin(40 * deg));
  EXPECT_NEAR(psi - kPi / 2, 995 * std::tan(40 * deg) / n, 1e-8);  // second order: (s/N)^2
}

TEST(DeadReckoning, MechanisedEarthRateHasItsSign) {
  // Due north with k = 2: the reckoner runs ahead, no convergence; psi_rec - psi is
  // + w INT (sin L_DR - sin L) dt (V-12), with sin L_DR - sin L = cos L s/M to (s/M)^2.
  auto state = mechanised_start(40 * deg, 0.0);
  double psi = 0;
  const int n = 100;
  for (int i = 0; i < n; ++i)
    psi = record_mechanised(wgs84(), state, 10.0, 0.0, 2.0, 0.0, 0.0, 1.0);
  const double ahead = 10.0 * (n - 1) * (n - 2) / 2.0;  // leads at the steps before [m s]
  const double m = meridian_radius(wgs84(), std::sin(40 * deg));
  const double expected = wgs84().w_ie * std::cos(40 * deg) * ahead / m;
  EXPECT_NEAR(psi, expected, 1e-3 * expected);
}

TEST(DeadReckoning, LanesGiveTheBitsOfDoubles) {
  std::mt19937_64 random(testing::seed());
  std::uniform_real_distribution<double> lat(-89.9, 89.9), lon(-180, 180), az(-180, 180),
      size(-4, 4), height(-100, 4000);
  for (int round = 0; round < 300; ++round) {
    double v[6][8];
    for (int i = 0; i < 8; ++i) {
      v[0][i] = lat(random) * deg, v[1][i] = lon(random) * deg;
      const double s = std::pow(10.0, size(random)), a = az(random) * deg;
      v[2][i] = i == 3 ? 0.0 : s * std::cos(a), v[3][i] = s * std::sin(a);
      v[4][i] = i % 3 == 0 ? 0.0 : height(random), v[5][i] = a;
    }
    Lanes x[6];
    for (int j = 0; j < 6; ++j) x[j] = Lanes::load(v[j]);
    for (auto integrator :
         {Integrator::kExact, Integrator::kMidpoint, Integrator::kStartLatitude}) {
      auto all = reckon_start<Lanes>(x[0], x[1]);
      for (int n = 0; n < 3; ++n) step_by<Lanes>(wgs84(), integrator, all, x[2], x[3], x[4]);
      for (int i = 0; i < 8; ++i) {
        auto one = reckon_start(v[0][i], v[1][i]);
        for (int n = 0; n < 3; ++n) step_by(wgs84(), integrator, one, v[2][i], v[3][i], v[4][i]);
        if (one.lat != one.lat) {
          EXPECT_NE(all.lat.lane(i), all.lat.lane(i));
          continue;
        }
        EXPECT_EQ(all.lat.lane(i), one.lat) << integrator_name(integrator);
        EXPECT_EQ(all.lon.lane(i), one.lon) << integrator_name(integrator);
      }
    }
    auto grid = grid_start<Lanes>(x[0], x[1]);
    auto pair = mechanised_start<Lanes>(x[0], x[1]);
    step_grid<Lanes>(wgs84(), true, grid, x[2], x[5], x[4]);
    const Lanes psi = step_mechanised<Lanes>(wgs84(), pair, 0.01 * x[3], x[5], Lanes(1.1),
                                             Lanes(0.02), x[4], Lanes(1.0));
    for (int i = 0; i < 8; ++i) {
      auto g = grid_start(v[0][i], v[1][i]);
      step_grid(wgs84(), true, g, v[2][i], v[5][i], v[4][i]);
      EXPECT_EQ(grid.n.x.lane(i), g.n.x);
      EXPECT_EQ(grid.n.z.lane(i), g.n.z);
      auto p = mechanised_start(v[0][i], v[1][i]);
      const double one =
          step_mechanised(wgs84(), p, 0.01 * v[3][i], v[5][i], 1.1, 0.02, v[4][i], 1.0);
      EXPECT_EQ(psi.lane(i), one);
    }
  }
}

}  // namespace
}  // namespace loxo
