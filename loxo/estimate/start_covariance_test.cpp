// SPDX-License-Identifier: Apache-2.0
// The covariance of a start against the errors it speaks of, drawn and put into an alignment as a
// rotation; and every declared sigma in its place. [EST-14]
#include "loxo/estimate/start_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/ins/alignment.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

struct Place {
  const char* name;
  double lat, lon;  // rad
  bool gyros;       // north can be found by them
};
const Place kPlaces[] = {{"the equator", 0, 0.3, true},
                         {"44 N", 44 * deg, 0.3, true},
                         {"70 S, west of 180", -70 * deg, -kPi + 1e-9, true},
                         {"10 N, east of 180", 10 * deg, kPi - 1e-9, true},
                         {"89.9 N", 89.9 * deg, -2.0, false},
                         {"the south pole", -90 * deg, 1.0, false}};

NominalState standing(const Place& place, const Euler<double>& attitude) {
  NominalState s;
  s.r = to_ecef(wgs84(), Geodetic<double>{place.lat, place.lon, 100});
  s.q = to_quaternion(transpose(geographic_axes(place.lat, place.lon)) *
                      to_matrix<Geographic>(attitude));
  return s;
}

using Nine = Eigen::Matrix<double, 9, 9>;
// Attitude and biases; `unit`: the sigmas that it is told in.
Nine block(const Covariance<kStates>& P, const Eigen::Matrix<double, 9, 1>& unit) {
  static constexpr int at[9] = {0, 1, 2, kBg, kBg + 1, kBg + 2, kBa, kBa + 1, kBa + 2};
  Nine M;
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) M(i, j) = P.p[at[i]][at[j]] / (unit(i) * unit(j));
  return M;
}

// Means of gyros and accelerometers, wrong by drawn biases, give level and heading (or one of them,
// or neither: then they are given); the random part comes on top. Attitude and biases together are
// as large, and as much of one piece, as the covariance says.
TEST(StartCovariance, IsThatOfTheErrors) {
  std::mt19937_64 rng(testing::seed());
  std::normal_distribution<double> g;
  constexpr int kDraws = 2000;
  // chi2 of 9 x 2000 degrees: six sigma.
  const double band = 6 * std::sqrt(2 * 9.0 / kDraws);
  StartSigmas e;
  e.gyro_bias = 0.01 * deg_per_h, e.accel_bias = 100 * ug;
  e.level = 20 * arcsec, e.heading = 1 * arcmin;
  for (const Place& place : kPlaces)
    for (const bool static_level : {true, false})
      for (const bool static_heading : {true, false}) {
        if (static_heading && !(place.gyros && static_level)) continue;
        e.static_level = static_level, e.static_heading = static_heading;
        const Rot<Geographic, Ecef> C = geographic_axes(place.lat, place.lon);
        const Rot<Geographic, Body> C_nb = to_matrix<Geographic>(Euler<double>{2.0, 0.05, -0.03});
        const double gamma = normal_gravity(wgs84(), std::sin(place.lat), 100.0);
        const Vec<Geographic> earth{0, wgs84().w_ie * std::cos(place.lat),
                                    wgs84().w_ie * std::sin(place.lat)};
        const NominalState s = standing(place, {2.0, 0.05, -0.03});
        Eigen::Matrix<double, 9, 1> unit;
        unit << e.level, e.level, e.level, e.gyro_bias, e.gyro_bias, e.gyro_bias, e.accel_bias,
            e.accel_bias, e.accel_bias;
        const Eigen::LDLT<Nine> solver(block(start_covariance(wgs84(), s, e), unit));
        double nees = 0;
        for (int n = 0; n < kDraws; ++n) {
          auto three = [&](double sigma) {
            return Vec<Body>{sigma * g(rng), sigma * g(rng), sigma * g(rng)};
          };
          const Vec<Body> bg = three(e.gyro_bias), ba = three(e.accel_bias);
          const Vec<Body> w = transpose(C_nb) * earth + bg,
                          f = transpose(C_nb) * Vec<Geographic>{0, 0, gamma} +
                              (static_level ? 1.0 : 0.0) * ba,
                          true_north{C_nb.m[1][0], C_nb.m[1][1], C_nb.m[1][2]};
          const Rot<Geographic, Body> A = coarse_static(static_heading ? w : true_north, f);
          const Vec<Geographic> random{e.level * g(rng), e.level * g(rng), e.heading * g(rng)};
          const Rot<Ecef, Ecef> D = transpose(C) *
                                    to_matrix(exp_rotation<Geographic, Geographic>(-random)) * A *
                                    transpose(C_nb) * C;
          // C~ = (I - [psi]) C; constants are true - used, and 0 is used.
          Eigen::Matrix<double, 9, 1> x;
          x << -0.5 * (D.m[2][1] - D.m[1][2]), -0.5 * (D.m[0][2] - D.m[2][0]),
              -0.5 * (D.m[1][0] - D.m[0][1]), bg.x, bg.y, bg.z, ba.x, ba.y, ba.z;
          x = (x.array() / unit.array()).matrix();
          nees += x.dot(solver.solve(x)) / kDraws;
        }
        EXPECT_NEAR(nees, 9.0, band) << place.name << ", level found " << static_level
                                     << ", heading found " << static_heading;
      }
}

// Every sigma on the diagonal of its own states and nothing beside it; the whole symmetric to the
// bit, and no combination of states of negative variance. All zero, tiny, drawn.
TEST(StartCovariance, EverySigmaStandsInItsPlace) {
  std::mt19937_64 rng(testing::seed());
  for (const Place& place : kPlaces)
    for (const double size : {0.0, 1e-12, 1.0})
      for (const bool correlated : {true, false}) {
        std::uniform_real_distribution<double> u(0.1 * size, size);
        StartSigmas e;
        e.gyro_bias = 1e-6 * u(rng), e.accel_bias = 1e-2 * u(rng);
        e.level = 1e-3 * u(rng), e.heading = 1e-2 * u(rng);
        e.static_heading = place.gyros, e.correlated = correlated;
        e.velocity = u(rng), e.position = u(rng);
        e.gyro_scale = {u(rng), u(rng), u(rng)}, e.accel_scale = {u(rng), u(rng), u(rng)};
        e.scale = u(rng), e.eps_h = u(rng), e.eps_p = u(rng);
        e.lever = u(rng), e.tau = u(rng), e.speed_offset = u(rng);
        const NominalState s = standing(place, {u(rng), 0.05, -0.03});
        const Covariance<kStates> P = start_covariance(wgs84(), s, e);
        double sigma[kStates]{};
        const auto say = [&](int first, std::initializer_list<double> x) {
          for (const double v : x) sigma[first++] = v;
        };
        say(kDv, {e.velocity, e.velocity, e.velocity});
        say(kDr, {e.position, e.position, e.position});
        say(kBg, {e.gyro_bias, e.gyro_bias, e.gyro_bias});
        say(kBa, {e.accel_bias, e.accel_bias, e.accel_bias});
        say(kSg, {e.gyro_scale.x, e.gyro_scale.y, e.gyro_scale.z});
        say(kSa, {e.accel_scale.x, e.accel_scale.y, e.accel_scale.z});
        say(kScale, {e.scale, e.eps_h, e.eps_p, e.lever, e.lever, e.lever, e.tau});
        say(kOffset, {e.speed_offset});
        const auto bias = [](int i) { return i >= kBg && i < kBa + 3; };
        bool says = false;  // the attitude of the biases
        for (int i = 0; i < kStates; ++i)
          for (int j = 0; j < kStates; ++j) {
            EXPECT_EQ(P.p[i][j], P.p[j][i]) << i << ' ' << j;
            if (i < 3 && bias(j)) says = says || P.p[i][j] != 0;
            if (i < 3 && (j < 3 || (bias(j) && correlated))) continue;
            if (j < 3 && bias(i) && correlated) continue;
            EXPECT_EQ(P.p[i][j], i == j ? sigma[i] * sigma[i] : 0.0)
                << place.name << ' ' << i << ' ' << j;
          }
        EXPECT_EQ(says, correlated && size > 0);
        if (size == 0) continue;
        // In units of the declared sigmas, of the smallest part of the attitude too.
        Eigen::Matrix<double, 9, 1> unit;
        unit << e.level, e.level, e.level, e.gyro_bias, e.gyro_bias, e.gyro_bias, e.accel_bias,
            e.accel_bias, e.accel_bias;
        const Nine M = block(P, unit);
        const Eigen::SelfAdjointEigenSolver<Nine> values(M, Eigen::EigenvaluesOnly);
        // Rounding of the largest element, times the dimension squared.
        EXPECT_GT(values.eigenvalues()(0), -81 * 2.3e-16 * M.cwiseAbs().maxCoeff()) << place.name;
      }
}

// Given level and heading are the attitude's only errors, about the axes that they are told of.
TEST(StartCovariance, AGivenAttitudeHasItsOwnSigmasOnly) {
  for (const Place& place : kPlaces) {
    StartSigmas e;
    e.gyro_bias = 1 * deg_per_h, e.accel_bias = 1 * mg;
    e.level = 0.05 * deg, e.heading = 1 * deg, e.static_level = false;
    const Covariance<kStates> P = start_covariance(wgs84(), standing(place, {1, 0, 0}), e);
    const Rot<Geographic, Ecef> C = geographic_axes(place.lat, place.lon);
    const double sigma[3] = {e.level, e.level, e.heading};
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        double sum = 0;
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) sum += C.m[a][i] * P.p[i][j] * C.m[b][j];
        // Two rotations' rounding of the largest variance; the pole's own axes to 1e-16 m of place.
        EXPECT_NEAR(sum, a == b ? sigma[a] * sigma[a] : 0.0, 1e-14 * e.heading * e.heading)
            << place.name;
      }
    for (int i = 0; i < 3; ++i)
      for (int j = kBg; j < kBa + 3; ++j) EXPECT_EQ(P.p[i][j], 0) << place.name;
  }
}

// A margin of the attitude's, where it says nothing of the biases, is as wide as their part.
TEST(StartCovariance, WithoutCorrelationTheAttitudeIsAsWide) {
  for (const Place& place : kPlaces) {
    StartSigmas e;
    e.gyro_bias = 1 * deg_per_h, e.accel_bias = 1 * mg;
    e.level = 0.01 * deg, e.heading = 1 * deg, e.static_heading = place.gyros;
    const NominalState s = standing(place, {1, 0, 0});
    const Covariance<kStates> with = start_covariance(wgs84(), s, e);
    e.correlated = false;
    const Covariance<kStates> without = start_covariance(wgs84(), s, e);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) EXPECT_EQ(without.p[i][j], with.p[i][j]) << place.name;
  }
}

TEST(StartCovariance, SettingsSeekTheConstantsOfTheWitnessesInUse) {
  NavigatorConfig c;
  c.gyro_bias = 1, c.accel_bias = 2, c.gyro_scale = 3, c.accel_scale = 4;
  c.scale_std = 5, c.eps_std = 6, c.lever_std = 7, c.tau_std = 8, c.offset_std = 9;
  for (const bool odometer : {true, false})
    for (const bool nhc : {true, false}) {
      c.use_odometer = odometer, c.use_nhc = nhc;
      const StartSigmas s = start_sigmas(c);
      EXPECT_EQ(s.gyro_bias, 1);
      EXPECT_EQ(s.accel_bias, 2);
      EXPECT_EQ(s.lever, 7);
      for (const double x : {s.gyro_scale.x, s.gyro_scale.y, s.gyro_scale.z}) EXPECT_EQ(x, 3);
      for (const double x : {s.accel_scale.x, s.accel_scale.y, s.accel_scale.z}) EXPECT_EQ(x, 4);
      EXPECT_EQ(s.scale, odometer ? 5 : 0);
      EXPECT_EQ(s.tau, odometer ? 8 : 0);
      EXPECT_EQ(s.speed_offset, odometer ? 9 : 0);
      for (const double x : {s.eps_h, s.eps_p}) EXPECT_EQ(x, odometer || nhc ? 6 : 0);
    }
}

}  // namespace
}  // namespace loxo
