// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/coasting.hpp"

#include <gtest/gtest.h>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/errors/level_errors.hpp"
#include "loxo/estimate/measurements.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

struct Vehicle {
  NominalState s;
  Vec<Ecef> up, ahead;
  Covariance<kStates> P;
};
Vehicle vehicle(double lat) {
  Vehicle x;
  const Rot<Geographic, Ecef> C = geographic_axes(lat, 0.4);
  x.s.r = to_ecef(wgs84(), Geodetic<double>{lat, 0.4, 0});
  x.s.q = to_quaternion(transpose(C) * to_matrix<Geographic>(Euler<double>{2.0, 0, 0}));
  x.ahead = to_matrix(x.s.q) * Vec<Body>{0, 1, 0};
  x.s.v = 20.0 * x.ahead;
  x.up = {C.m[2][0], C.m[2][1], C.m[2][2]};
  for (int i = 0; i < 3; ++i) {
    x.P.p[i][i] = 1e-6, x.P.p[kDv + i][kDv + i] = 1e-2, x.P.p[kDr + i][kDr + i] = 1;
    x.P.p[kBg + i][kBg + i] = 1e-12, x.P.p[i][kBg + i] = x.P.p[kBg + i][i] = 5e-10;
  }
  return x;
}
// Sigma of the velocity along a body axis, heading and level taken with it. [EST-11]
double body_sigma(const Vehicle& x, int axis) {
  MeasurementPoint p;
  p.C = to_matrix(x.s.q), p.v = x.s.v, p.r = x.s.r;
  Projection<kStates> a;
  project(x.P, body_velocity(p, Vec<Body>{}, axis).row, a);
  return std::sqrt(a.s0);
}

TEST(Coasting, LosesTheHeadingAndNotTheSpeed) {
  for (const double lat : {0.0, 50 * deg, -89.99 * deg}) {
    Vehicle x = vehicle(lat);
    const Point<Ecef> from = x.s.r;
    const double before[3] = {body_sigma(x, 0), body_sigma(x, 1), body_sigma(x, 2)};
    CoastNoise q;
    q.heading = 0.81 / 30, q.level = 0.05 * 0.05 / 30;
    q.up = x.up, q.ahead = x.ahead;
    for (int i = 0; i < 300; ++i) coast(x.s, x.P, nullptr, q, 0.1);
    EXPECT_NEAR(norm(x.s.r - from), 600.0, 1e-6);
    EXPECT_NEAR(heading_sigma(x.P, x.up), std::sqrt(0.81 + 1e-6), 1e-9);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(body_sigma(x, i), before[i], 1e-6) << i;
    // To the side of the way, a turn rate that walks: 20 m/s 0.9 rad 30 s / sqrt 3, and the
    // start's.
    const Vec<Ecef> right = cross(x.ahead, x.up);
    const double e[3] = {right.x, right.y, right.z};
    double side = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) side += e[i] * x.P.p[kDr + i][kDr + j] * e[j];
    EXPECT_NEAR(std::sqrt(side), 20 * 0.9 * 30 / std::sqrt(3.0), 2.0);
    q = CoastNoise{0, 0, 0.25, 0.01, x.up, x.ahead};
    coast(x.s, x.P, nullptr, q, 1.0);
    EXPECT_NEAR(body_sigma(x, 1), std::hypot(before[1], 0.5), 1e-6);
    EXPECT_NEAR(body_sigma(x, 0), std::hypot(before[0], 0.1), 1e-6);
  }
}

// A state that is off by a large turn and by small errors: after the turn is taken out, level,
// speed along the axes and biases are as wrong as before, the heading as told.
TEST(Coasting, ATurnOfAnySizeLeavesTheRest) {
  for (const double angle : {0.0, 0.5, -2.0, 3.1}) {
    const Vehicle truth = vehicle(50 * deg);
    Vehicle x = truth;
    const Quat<Ecef, Ecef> off = exp_rotation<Ecef, Ecef>(truth.up * (-angle));
    x.s.q = off * (exp_rotation<Ecef, Ecef>(-1e-4 * truth.ahead) * truth.s.q);
    x.s.v = to_matrix(off) * (truth.s.v + 1e-4 * truth.ahead);
    TransitionProduct product;
    turn_heading(x.s, x.P, &product, x.up, angle, 0.02);
    const Quat<Ecef, Ecef> d = x.s.q * conjugate(truth.s.q);
    EXPECT_NEAR(-2 * dot(Vec<Ecef>{d.x, d.y, d.z}, truth.ahead), 1e-4, 1e-9);
    EXPECT_NEAR(dot(Vec<Ecef>{d.x, d.y, d.z}, truth.up), 0.0, 1e-9);
    EXPECT_NEAR(norm(x.s.v - truth.s.v - 1e-4 * truth.ahead), 0, 1e-12);
    EXPECT_NEAR(heading_sigma(x.P, x.up), 0.02, 1e-12);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(body_sigma(x, i), body_sigma(truth, i), 1e-7) << i;
    // What the heading was before has no part in what it is now; the biases keep theirs of the
    // level.
    double row[kStates]{};
    for (int j = 0; j < kStates; ++j)
      for (int i = 0; i < 3; ++i)
        row[j] += product.f[i][j] * (i == 0 ? truth.up.x : i == 1 ? truth.up.y : truth.up.z);
    for (int i = 0; i < 6; ++i)
      EXPECT_NEAR(row[i], 0, 1e-9) << i;  // psi and dv from the old heading
    for (int i = 0; i < kStates; ++i)
      for (int j = 0; j < i; ++j) EXPECT_EQ(x.P.p[i][j], x.P.p[j][i]);
  }
}

TEST(Coasting, AForgottenPositionKeepsItsHeight) {
  Vehicle x = vehicle(50 * deg);
  x.P.p[kDr][kBa] = x.P.p[kBa][kDr] = 1e-3;
  forget_position(x.P, nullptr, x.up, 1e4);
  double along = 0, level = 0;
  const double u[3] = {x.up.x, x.up.y, x.up.z}, a[3] = {x.ahead.x, x.ahead.y, x.ahead.z};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      along += u[i] * x.P.p[kDr + i][kDr + j] * u[j];
      level += a[i] * x.P.p[kDr + i][kDr + j] * a[j];
    }
  EXPECT_NEAR(along, 1.0, 1e-6);
  EXPECT_NEAR(level, 1e8, 1);
}

}  // namespace
}  // namespace loxo
