// SPDX-License-Identifier: Apache-2.0
// One step's rotation and velocity from one to four samples, against the same step cut very fine;
// rates and increments as input. polar.md 3.2
#include "loxo/ins/increments.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "loxo/ins/closed_form_truth.hpp"
#include "loxo/num/rotation_forms.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

truth::Motion rocking() {
  auto m = truth::great_circle(wgs84(), 40 * deg, 110 * deg, 1, 15);
  m.roll = 5 * deg, m.pitch = 3 * deg, m.yaw = 2 * deg;
  m.roll_period = 3, m.pitch_period = 2.3, m.yaw_period = 4.1;
  m.heave = 0.5, m.heave_period = 3.3;
  return m;
}

// The step (t0, t0 + T] cut into 64 of four samples each.
StepIncrement<double> exact_step(const truth::Motion& m, double t0, double T) {
  Quat<Body, Body> q = Quat<Body, Body>::identity();
  Vec<Body> v;
  constexpr int kParts = 64;
  for (int i = 0; i < kParts; ++i) {
    ImuIncrement<double> s[4];
    const double h = T / (4 * kParts);
    for (int k = 0; k < 4; ++k) s[k] = m.imu(t0 + (4 * i + k) * h, t0 + (4 * i + k + 1) * h);
    const auto u = combine(s, 4);
    v += rotate(q, u.velocity);
    q = normalized(q * exp_step<Body, Body>(u.rotation));
  }
  return {T, rotation_vector(q), v};
}

// Errors of n samples over T, worst of some times.
struct StepError {
  double rotation = 0, velocity = 0;
};
StepError error_of(int n, double T) {
  const auto m = rocking();
  StepError e;
  for (double t0 : {0.3, 1.1, 2.7, 4.4}) {
    ImuIncrement<double> s[4];
    for (int k = 0; k < n; ++k) s[k] = m.imu(t0 + k * T / n, t0 + (k + 1) * T / n);
    const auto u = combine(s, n), x = exact_step(m, t0, T);
    e.rotation = std::max(e.rotation, norm(u.rotation - x.rotation));
    e.velocity = std::max(e.velocity, norm(u.velocity - x.velocity));
  }
  return e;
}

// The same step from more samples: one knows no coning (order 3 of a step), from two on order 5;
// the velocity, order 3 from one, 4 from more, whose third-order term of the turn takes the rate as
// constant.
TEST(Increments, OrderBySamples) {
  constexpr double kStep = 0.2, kSlack = 0.3;
  for (int n = 1; n <= 4; ++n) {
    const StepError a = error_of(n, kStep), b = error_of(n, kStep / 2);
    const double rotation = std::log2(a.rotation / b.rotation),
                 velocity = std::log2(a.velocity / b.velocity);
    std::printf("%d: rotation %.2g, order %.1f; velocity %.2g, order %.1f\n", n, a.rotation,
                rotation, a.velocity, velocity);
    EXPECT_GT(rotation, (n == 1 ? 3 : 5) - kSlack) << n;
    EXPECT_GT(velocity, (n == 1 ? 3 : 4) - kSlack) << n;
    if (n > 1) {
      EXPECT_LT(a.rotation, 0.01 * error_of(1, kStep).rotation);
      EXPECT_LT(a.velocity, 0.05 * error_of(1, kStep).velocity);
    }
  }
  EXPECT_LT(error_of(3, kStep).rotation, 0.5 * error_of(2, kStep).rotation);
  EXPECT_LT(error_of(4, kStep).rotation, error_of(3, kStep).rotation);
}

// A predecessor gives a single sample what a pair knows; jittered stamps cost two samples nothing.
TEST(Increments, PredecessorAndUnequalIntervals) {
  const auto m = rocking();
  for (double t0 : {0.5, 2.0, 3.7}) {
    const auto before = m.imu(t0 - 0.05, t0), a = m.imu(t0, t0 + 0.05);
    const auto x = exact_step(m, t0, 0.05);
    EXPECT_LT(norm(one_sample(before, a).rotation - x.rotation),
              0.1 * norm(one_sample(a).rotation - x.rotation));
    EXPECT_LT(norm(one_sample(before, a).velocity - x.velocity),
              0.1 * norm(one_sample(a).velocity - x.velocity));
    const auto c = m.imu(t0, t0 + 0.03), d = m.imu(t0 + 0.03, t0 + 0.1);
    const auto y = exact_step(m, t0, 0.1), u = two_samples(c, d);
    const auto even = two_samples(m.imu(t0, t0 + 0.05), m.imu(t0 + 0.05, t0 + 0.1));
    EXPECT_LT(norm(u.rotation - y.rotation), 1e-7);  // order 4 where the intervals differ
    EXPECT_LT(norm(even.rotation - y.rotation), 1e-8);
    EXPECT_EQ(u.dt, c.dt + d.dt);
  }
}

// Means over the interval are increments over it, to the bit of a product; instants at both ends
// are second order.
TEST(Increments, RatesAsInput) {
  const auto m = rocking();
  const auto a = m.imu(1.0, 1.01);
  const auto r = from_mean_rates(a.t, a.dt, a.dtheta * (1 / a.dt), a.dv * (1 / a.dt));
  EXPECT_LT(norm(r.dtheta - a.dtheta), 1e-17);
  EXPECT_LT(norm(r.dv - a.dv), 1e-15);
  double error[2];
  for (int k = 0; k < 2; ++k) {
    const double dt = 0.1 / (1 << k);
    const auto p = m.at(1.0), q = m.at(1.0 + dt);
    const auto i = from_instant_rates(1.0 + dt, dt, p.w_ib, p.f, q.w_ib, q.f);
    error[k] = norm(i.dtheta - m.imu(1.0, 1.0 + dt).dtheta);
  }
  EXPECT_NEAR(std::log2(error[0] / error[1]), 3.0, 0.3);
  // A part of a sample, and the same interval run backward.
  const auto half = part_of(a, 0.5);
  EXPECT_EQ(half.dt, 0.5 * a.dt);
  EXPECT_EQ(half.dv.z, 0.5 * a.dv.z);
  EXPECT_EQ(backward(a).dt, -a.dt);
  EXPECT_EQ(backward(a).t, a.t - a.dt);
}

}  // namespace
}  // namespace loxo
