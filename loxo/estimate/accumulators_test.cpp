// SPDX-License-Identifier: Apache-2.0
// [EST-12] over a whole tick: the rows of the accumulators in a product of 100 steps against
// differences of the non-linear strapdown and odometer over the same second, in a turn, climbing
// and braking, from the equator to the pole; and the delay's column against the shifted way.
#include <gtest/gtest.h>

#include <random>

#include "loxo/earth/geodetic.hpp"
#include "loxo/errors/error_dynamics.hpp"
#include "loxo/estimate/measurements.hpp"
#include "loxo/ins/strapdown.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

constexpr double kStep = 0.01;
constexpr int kSteps = 100;

struct Motion {
  NominalState s;
  Vec<Body> w, f;  // true rate and specific force, constant over the second
};
struct End {
  Quat<Ecef, Body> q;
  Vec<Ecef> v;
  Point<Ecef> r;
  double d[3]{};
};
// The second from m; with `product`, also the linearised one. x: errors of the sensors' constants.
End second(const Motion& m, const double* x, TransitionProduct* product) {
  const Ellipsoid& ell = wgs84();
  const EarthModel earth = make_earth_model(ell);
  NominalState s = m.s;
  const auto with = [](const Vec<Body>& a, const double* bias, const double* scale) {
    return Vec<Body>{a.x * (1 + scale[0]) + bias[0], a.y * (1 + scale[1]) + bias[1],
                     a.z * (1 + scale[2]) + bias[2]};
  };
  const double zero[kStates]{};
  if (!x) x = zero;
  const MountingAxes axes = mounting_axes(s.eps_h, s.eps_p);
  for (int i = 0; i < kSteps; ++i) {
    const Vec<Body> w = with(m.w, x + kBg, x + kSg), f = with(m.f, x + kBa, x + kSa);
    ImuIncrement<double> u;
    u.t = (i + 1) * kStep, u.dt = kStep, u.dtheta = w * kStep, u.dv = f * kStep;
    const auto place =
        EcefMechanization::from_ecef(earth, EcefState<double>{s.r, s.v, s.q}).position;
    const State<EcefMechanization> after =
        step(earth, State<EcefMechanization>{s.q, s.v, place}, one_sample(u));
    MeasurementPoint mid;
    mid.w_ie = {0, 0, ell.w_ie};
    mid.C = to_matrix(exp_rotation<Ecef, Ecef>(mid.w_ie * (-0.5 * kStep)) * s.q *
                      exp_rotation<Body, Body>(u.dtheta * 0.5));
    mid.v = 0.5 * (s.v + after.v);
    mid.w_eb = w - transpose(mid.C) * mid.w_ie;
    double rate[3];
    accumulator_rate(mid, s, axes, rate);
    for (int k = 0; k < 3; ++k) s.d[k] += rate[k] * kStep;
    if (product) {
      ErrorPoint<Ecef> p;
      p.C_mb = mid.C, p.v = mid.v, p.w_ie = mid.w_ie, p.w = w, p.f = f;
      p.gradient = gravity_gradient(ell, place.n, place.h);
      product->advance(error_transition(p, kStep), accumulator_transition(mid, s, axes, kStep));
    }
    s.q = normalized(after.q_nb), s.v = after.v, s.r = after.position.r;
  }
  End e;
  e.q = s.q, e.v = s.v, e.r = s.r;
  for (int k = 0; k < 3; ++k) e.d[k] = s.d[k];
  return e;
}

TEST(Accumulators, ASecondOfStepsEqualsDifferences) {  // [EST-12]
  std::mt19937 rng(testing::seed());
  std::uniform_real_distribution<double> u(-1, 1);
  for (const double lat : {0.0, 50 * deg, -80 * deg, 89.9 * deg, 90 * deg}) {
    Motion m;
    m.s.r = to_ecef(wgs84(), Geodetic<double>{lat, 0.4, 100});
    m.s.q = exp_rotation<Ecef, Body>(Vec<Body>{2 * u(rng), 2 * u(rng), 2 * u(rng)});
    m.s.v = to_matrix(m.s.q) * Vec<Body>{0.3, 15, 1};
    m.s.eps_h = 0.1 * u(rng), m.s.eps_p = 0.05 * u(rng);
    m.s.lever = {u(rng), u(rng), u(rng)};
    m.w = {0.05 * u(rng), 0.1, 0.3 * u(rng)};
    m.f = {4.5, -2, 9.8};
    TransitionProduct product;
    second(m, nullptr, &product);
    for (int j = 0; j < kStates; ++j) {
      if (j == kScale || j == kTau || j == kOffset) continue;  // not in the way itself
      const double e = j >= kDr && j < kDr + 3 ? 10.0 : 1e-4;
      End end[2];
      for (int side = 0; side < 2; ++side) {
        double x[kStates]{};
        x[j] = side ? -e : e;
        // computed = the one with errors: C~ = (I - [psi]) C, v + dv, r + dr; used = true - x.
        Motion c = m;
        c.s.q = exp_rotation<Ecef, Ecef>(-Vec<Ecef>{x[0], x[1], x[2]}) * c.s.q;
        c.s.v = c.s.v + Vec<Ecef>{x[3], x[4], x[5]};
        c.s.r = c.s.r + Vec<Ecef>{x[6], x[7], x[8]};
        c.s.eps_h -= x[kEpsH], c.s.eps_p -= x[kEpsP];
        c.s.lever = c.s.lever - Vec<Body>{x[kLever], x[kLever + 1], x[kLever + 2]};
        for (int k = 0; k < 3; ++k) c.s.d[k] += x[kAcc + k];
        end[side] = second(c, x, nullptr);
      }
      for (int k = 0; k < 3; ++k) {
        const double difference = (end[0].d[k] - end[1].d[k]) / (2 * e);
        // The rows take the errors at a step's begin: half a step of what feeds them is missing, so
        // first order in the step. At 100 Hz 5e-5 m for a milliradian.
        const double half = 0.5 * kStep, v = norm(m.s.v) + norm(m.f), f = norm(m.f);
        const double w = norm(m.w), lever = norm(m.s.lever);
        // What a gyro's scale error does to w_eb x l directly is no term of [EST-12].
        const double feeds[] = {f, 0.05, 1e-4, v + f, 1.0, w * (v + f), f, 0, 0, 0, 0};
        const double direct = j >= kSg && j < kSg + 3 ? w * lever : 0.0;
        EXPECT_NEAR(product.f[kAcc + k][j], difference, half * feeds[j / 3] + direct + 1e-7)
            << "row " << k << " column " << j << " lat " << lat / deg;
      }
    }
  }
}

// A distance over (t1 - tau, t2 - tau] of a speed that bends: H_tau of [EST-12].
TEST(Accumulators, DelayColumnEqualsDifferences) {
  const auto way = [](double t) { return 10 * t + t * t + 0.1 * t * t * t; };
  const auto speed = [](double t) { return 10 + 2 * t + 0.3 * t * t; };
  const double t1 = 3, t2 = 4, tau = 0.35, k = 1.02;
  const auto told = [&](double delay) { return k * (way(t2 - delay) - way(t1 - delay)); };
  NominalState s;
  s.scale = k;
  s.d[1] = way(t2 - tau) - way(t1 - tau);
  const ScalarMeasurement m = accumulated_distance(s, k * (speed(t2 - tau) - speed(t1 - tau)));
  EXPECT_NEAR(m.h, told(tau), 1e-12);
  double h = 0, h_k = 0, h_d = 0;
  for (int i = 0; i < m.row.n; ++i) {
    if (m.row.index[i] == kTau) h = m.row.value[i];
    if (m.row.index[i] == kScale) h_k = m.row.value[i];
    if (m.row.index[i] == kAcc + 1) h_d = m.row.value[i];
  }
  const double e = 1e-4;
  EXPECT_NEAR(h, (told(tau + e) - told(tau - e)) / (2 * e), 1e-7);
  EXPECT_NEAR(h_k, s.d[1], 1e-12);
  EXPECT_NEAR(h_d, -k, 1e-12);  // d is computed - true
}

}  // namespace
}  // namespace loxo
