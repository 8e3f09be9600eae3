// SPDX-License-Identifier: Apache-2.0
// Every row of H against differences of the non-linear measurement, about random motion, at the
// equator, 45 deg south, 89.9 deg and the pole. Rows not named by a measurement must be zero in the
// differences too.
#include "loxo/estimate/measurements.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/errors/level_errors.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

struct World {  // truth = point + state; `w` the measured body rate without its bias
  MeasurementPoint p;
  NominalState s;
};

struct Regime {
  std::mt19937 rng{testing::seed()};
  std::uniform_real_distribution<double> u{-1, 1};
  double operator()() { return u(rng); }
  World at(double lat) {
    World w;
    const Ellipsoid& ell = wgs84();
    w.p.r = to_ecef(ell, Geodetic<double>{lat, 0.4, 100});
    w.p.v = {10 * u(rng), 10 * u(rng), 10 * u(rng)};
    w.p.a = {u(rng), u(rng), u(rng)};
    w.p.C = to_matrix(exp_rotation<Ecef, Body>(Vec<Body>{3 * u(rng), 3 * u(rng), 3 * u(rng)}));
    w.p.w_eb = {0.3 * u(rng), 0.3 * u(rng), 0.3 * u(rng)};
    w.p.w_ie = {0, 0, ell.w_ie};
    w.s.offset = 0.3 * u(rng), w.s.offset_speed = 9;
    w.s.scale = 1.2, w.s.eps_h = 0.3 * u(rng), w.s.eps_p = 0.2 * u(rng);
    w.s.lever = {u(rng), u(rng), u(rng)};
    w.s.bg = {1e-3 * u(rng), 1e-3 * u(rng), 1e-3 * u(rng)};
    w.s.d[0] = u(rng), w.s.d[1] = 10 * u(rng), w.s.d[2] = u(rng);
    return w;
  }
};

// The world with state i of x set to e: navigation truth = computed - x, constants true = used + x.
// [EST-1]
World truth(const World& c, int i, double e) {
  World t = c;
  double x[kStates]{};
  x[i] = e;
  t.p.C = to_matrix(exp_rotation<Ecef, Ecef>(Vec<Ecef>{x[0], x[1], x[2]})) * c.p.C;
  t.p.v = c.p.v - Vec<Ecef>{x[3], x[4], x[5]};
  t.p.r = c.p.r - Vec<Ecef>{x[6], x[7], x[8]};
  t.p.w_eb = c.p.w_eb - Vec<Body>{x[9], x[10], x[11]};  // corrected = true + x_bg
  t.s.bg = c.s.bg + Vec<Body>{x[9], x[10], x[11]};
  t.s.offset += x[kOffset];
  t.s.scale += x[kScale], t.s.eps_h += x[kEpsH], t.s.eps_p += x[kEpsP];
  t.s.lever = c.s.lever + Vec<Body>{x[24], x[25], x[26]};
  for (int k = 0; k < 3; ++k) t.s.d[k] -= x[kAcc + k];
  return t;
}

using Model = std::function<ScalarMeasurement(const World&)>;
void check(const World& w, const Model& model, const char* name, double relative = 1e-6) {
  const ScalarMeasurement m = model(w);
  double H[kStates]{};
  for (int k = 0; k < m.row.n; ++k) H[m.row.index[k]] += m.row.value[k];
  for (int i = 0; i < kStates; ++i) {
    if (i == kTau) continue;  // a time, not a state of this world: checked apart
    const double e = i >= 6 && i < 9 ? 10.0 : 1e-5;
    const double difference = (model(truth(w, i, e)).h - model(truth(w, i, -e)).h) / (2 * e);
    EXPECT_NEAR(H[i], difference, relative * std::fabs(difference) + 1e-9)
        << name << " state " << i;
  }
}

TEST(Measurements, RowsEqualDifferences) {  // [EST-10], [EST-11], [EST-12], sections 2.3, 2.4
  Regime draw;
  for (double lat : {0.0, -45 * deg, 89.9 * deg, 90 * deg}) {
    const World w = draw.at(lat);
    for (int axis = 0; axis < 3; ++axis) {
      check(
          w,
          [&](const World& x) {
            return vehicle_velocity(x.p, x.s, mounting_axes(x.s.eps_h, x.s.eps_p), axis, true);
          },
          "vehicle velocity");
      check(
          w, [&](const World& x) { return zero_velocity(x.p, axis); }, "zero velocity");
      check(
          w, [&](const World& x) { return zero_rate(x.p, x.s, axis); }, "zero rate", 1e-4);
      check(
          w,
          [&](const World& x) {
            return body_velocity(x.p, Vec<Body>{0.5, -1, 0.3}, axis);
          },
          "body velocity");
      if (axis != 1)
        check(
            w, [&](const World& x) { return accumulated_side(x.s, axis); }, "side");
    }
    check(
        w, [&](const World& x) { return accumulated_distance(x.s, 0.0); }, "distance");
    const Vec<Ecef> along{0.6, -0.48, 0.64};
    const Vec<Body> l{1, 2, -1};
    check(
        w, [&](const World& x) { return position_along(x.p, l, along, w.p.r); }, "position");
    check(
        w, [&](const World& x) { return velocity_along(x.p, l, along); }, "velocity");
  }
}

TEST(Measurements, HeadingCarriesThePositionError) {  // section 2.4, [EST-2]
  Regime draw;
  const Ellipsoid& ell = wgs84();
  for (double lat : {0.3 * deg, -60 * deg, 85 * deg}) {
    World w = draw.at(lat);
    // A body with a pitch below 20 deg.
    const Rot<Geographic, Ecef> C = geographic_axes(lat, 0.4);
    w.p.C =
        transpose(C) * to_matrix<Geographic>(Euler<double>{3 * draw(), 0.3 * draw(), 0.3 * draw()});
    auto model = [&](const World& x) {
      const NormalHeight<double> n = to_normal(ell, x.p.r);
      const LevelAxes<double> a = geographic_level_axes(ell, n.n, n.h);
      auto row = [&](int i) { return Vec<Ecef>{a.C_me.m[i][0], a.C_me.m[i][1], a.C_me.m[i][2]}; };
      return heading_in(x.p, row(0), row(1), n.n, a.azimuth_turn);
    };
    const ScalarMeasurement m = model(w);
    double H[kStates]{};
    for (int k = 0; k < m.row.n; ++k) H[m.row.index[k]] += m.row.value[k];
    for (int i = 0; i < 9; ++i) {
      const double e = i >= 6 ? 100.0 : 1e-5;
      const double difference =
          wrap_pi(model(truth(w, i, e)).h - model(truth(w, i, -e)).h) / (2 * e);
      // The turn of the level with position, tan(pitch)/R per metre, is left out of the row: 6e-8.
      EXPECT_NEAR(H[i], difference, 1e-6 * std::fabs(difference) + (i >= 6 ? 7e-8 : 1e-9))
          << "state " << i << " lat " << lat / deg;
    }
  }
}

// Row k, column of state i.
double column(const AccumulatorTransition<double>& t, int k, int i) {
  if (i < 3) return t.psi.m[k][i];
  if (i < 6) return t.dv.m[k][i - 3];
  if (i >= kBg && i < kBg + 3) return t.bg.m[k][i - kBg];
  if (i == kEpsH) return t.eps_h[k];
  if (i == kEpsP) return t.eps_p[k];
  if (i >= kLever && i < kLever + 3) return t.lever.m[k][i - kLever];
  return 0.0;
}

// The accumulators' transition: differences of the rate of d. [EST-12]
TEST(Measurements, AccumulatorTransitionEqualsDifferences) {
  Regime draw;
  const World w = draw.at(0.7);
  const double dt = 0.1;
  const AccumulatorTransition<double> t =
      accumulator_transition(w.p, w.s, mounting_axes(w.s.eps_h, w.s.eps_p), dt);
  for (int i = 0; i < kStates; ++i) {
    if (i == kTau || i == kScale || i >= kAcc) continue;
    const double e = 1e-5;
    double plus[3], minus[3];
    const World a = truth(w, i, e), b = truth(w, i, -e);
    accumulator_rate(a.p, a.s, mounting_axes(a.s.eps_h, a.s.eps_p), plus);
    accumulator_rate(b.p, b.s, mounting_axes(b.s.eps_h, b.s.eps_p), minus);
    for (int k = 0; k < 3; ++k) {
      const double difference = -dt * (plus[k] - minus[k]) / (2 * e);  // x_d is computed - true
      EXPECT_NEAR(column(t, k, i), difference, 1e-6 * std::fabs(difference) + 1e-9)
          << k << " " << i;
    }
  }
}

// Rows right and up across the way: the derivative of (v_r v_f0 / v_f), that is of the angle times
// a speed held, so that a change of speed alone is nothing to them; the row along the way
// untouched.
TEST(Measurements, AcrossTheWayIsTheAnglesDerivative) {  // [EST-12], [EST-13]
  Regime draw;
  World w = draw.at(0.7);
  w.p.v = w.p.C * Vec<Body>{0.5, 20, -0.3};
  const MountingAxes m = mounting_axes(w.s.eps_h, w.s.eps_p);
  const double dt = 0.1;
  double d[3];
  accumulator_rate(w.p, w.s, m, d);
  const AccumulatorTransition<double> plain = accumulator_transition(w.p, w.s, m, dt);
  AccumulatorTransition<double> t = plain;
  across_the_way(t, d);
  // Regularised below 1 m/s: relative part (1 m/s / v_f)^2 of the slope.
  const double held = d[1] * d[1] / (d[1] * d[1] + 1.0);
  for (int i = 0; i < kStates; ++i) {
    if (i == kTau || i == kScale || i >= kAcc) continue;
    const double e = 1e-5;
    double plus[3], minus[3];
    const World a = truth(w, i, e), b = truth(w, i, -e);
    accumulator_rate(a.p, a.s, mounting_axes(a.s.eps_h, a.s.eps_p), plus);
    accumulator_rate(b.p, b.s, mounting_axes(b.s.eps_h, b.s.eps_p), minus);
    EXPECT_EQ(column(t, 1, i), column(plain, 1, i)) << i;
    for (int k : {0, 2}) {
      const double angle = -dt * d[1] * (plus[k] / plus[1] - minus[k] / minus[1]) / (2 * e);
      const double expected = held * angle + (1 - held) * column(plain, k, i);
      EXPECT_NEAR(column(t, k, i), expected, 1e-6 * std::fabs(expected) + 1e-9) << k << " " << i;
    }
  }
  // At a stand there is no way: nothing is taken off.
  const double still[3] = {0.01, 0, 0.01};
  AccumulatorTransition<double> at_rest = plain;
  across_the_way(at_rest, still);
  EXPECT_EQ(at_rest.dv.m[0][0], plain.dv.m[0][0]);
}

// H_tau: the reading belongs to t - tau; along the acceleration. [EST-11]
TEST(Measurements, DelayColumnEqualsDifferences) {
  Regime draw;
  World w = draw.at(0.7);
  const MountingAxes m = mounting_axes(w.s.eps_h, w.s.eps_p);
  w.s.lever = {};
  auto at = [&](double tau) {
    MeasurementPoint p = w.p;
    p.v = w.p.v - w.p.a * tau;
    return vehicle_velocity(p, w.s, m, 1, true).h;
  };
  const ScalarMeasurement z = vehicle_velocity(w.p, w.s, m, 1, true);
  double h = 0;
  for (int k = 0; k < z.row.n; ++k)
    if (z.row.index[k] == kTau) h = z.row.value[k];
  EXPECT_NEAR(h, (at(1e-3) - at(-1e-3)) / 2e-3, 1e-9);
}

// [EST-6]: what the feedback takes out is exactly the error put in.
TEST(Nominal, FeedbackUndoesTheError) {
  Regime draw;
  NominalState t;
  t.q = exp_rotation<Ecef, Body>(Vec<Body>{0.3, -1.0, 2.0});
  t.v = {1, 2, 3}, t.r = {4, 5, 6};
  NominalState c = t;
  const Vec<Ecef> psi{0.01, -0.02, 0.03};
  c.q = exp_rotation<Ecef, Ecef>(-psi) * t.q;
  c.v = t.v + Vec<Ecef>{0.1, 0.2, 0.3};
  c.scale = t.scale - 0.05;
  double x[kStates]{0.01, -0.02, 0.03, 0.1, 0.2, 0.3};
  x[kScale] = 0.05;
  feed_back(c, x);
  EXPECT_NEAR(c.q.w, t.q.w, 1e-15);
  EXPECT_NEAR(c.q.x, t.q.x, 1e-15);
  EXPECT_NEAR(c.v.y, t.v.y, 1e-15);
  EXPECT_NEAR(c.scale, t.scale, 1e-15);
}

// [EST-7] to second order: errors about the new nominal after a finite correction.
TEST(Nominal, ResetTurnsTheErrors) {
  const Vec<Ecef> psi_hat{0.02, -0.01, 0.015};
  const double e = 1e-6;
  double x[kStates]{psi_hat.x, psi_hat.y, psi_hat.z};
  TransitionProduct f;
  f.reset_attitude(x);
  for (int j = 0; j < 3; ++j) {
    const Vec<Ecef> d{j == 0 ? e : 0, j == 1 ? e : 0, j == 2 ? e : 0};
    // C~ = exp(-(psi_hat + d)) C_true; new nominal exp(psi_hat) C~; its error is -log of it.
    const auto q = exp_rotation<Ecef, Ecef>(psi_hat) * exp_rotation<Ecef, Ecef>(-(psi_hat + d));
    const double left[3] = {-2 * q.x, -2 * q.y, -2 * q.z};
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(f.f[i][j], left[i] / e, 3e-4) << i << j;  // third order: |psi|^2 / 6 = 1.2e-4
  }
}

}  // namespace
}  // namespace loxo
