// SPDX-License-Identifier: Apache-2.0
// The states after the 32 (estimation.md 1.3, last row): the blocks are one covariance of 42
// states, their columns are derivatives, and a drive that shows them finds them.
#include "loxo/estimate/extra_states.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "loxo/estimate/exact_route.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/estimate/smoother.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

using Dense = Eigen::Matrix<double, kAllStates, kAllStates>;

struct Draw {
  std::mt19937_64 rng{testing::seed()};
  std::normal_distribution<double> g;
  double operator()() { return g(rng); }
  Vec<Body> body(double k) { return {k * g(rng), k * g(rng), k * g(rng)}; }
  Block3<> block() {
    Block3<> b;
    for (auto& r : b.m)
      for (double& x : r) x = g(rng);
    return b;
  }
};
struct Both {
  Covariance<kStates> P;
  ExtraCovariance X;
};
Both split(const Dense& M) {
  Both b;
  for (int i = 0; i < kAllStates; ++i)
    for (int j = 0; j < kAllStates; ++j) {
      const double m = M(std::min(i, j), std::max(i, j));
      if (i < kStates && j < kStates) b.P.p[i][j] = m;
      if (i < kStates && j >= kStates) b.X.c[i][j - kStates] = m;
      if (i >= kStates && j >= kStates) b.X.e[i - kStates][j - kStates] = m;
    }
  return b;
}
// To 43 products each way of the size `size` has: an update's result is the
// small difference of large ones.
void expect_equal(const Both& b, const Dense& M, const Dense& size) {
  for (int i = 0; i < kAllStates; ++i)
    for (int j = i; j < kAllStates; ++j) {
      const double found = j < kStates   ? b.P.p[i][j]
                           : i < kStates ? b.X.c[i][j - kStates]
                                         : b.X.e[i - kStates][j - kStates];
      EXPECT_NEAR(found, M(i, j), 1e-12 * std::sqrt(size(i, i) * size(j, j))) << i << " " << j;
      if (j < kStates) {
        EXPECT_EQ(b.P.p[i][j], b.P.p[j][i]);
      }
    }
}
void expect_equal(const Both& b, const Dense& M) { expect_equal(b, M, M); }
Dense random_covariance(Draw& d) {
  Dense L;
  for (int i = 0; i < kAllStates; ++i)
    for (int j = 0; j < kAllStates; ++j) L(i, j) = d();
  return L * L.transpose();
}

TEST(ExtraStates, PredictionEqualsTheDenseProduct) {
  Draw d;
  const Dense M = random_covariance(d);
  Both b = split(M);
  ErrorTransition<double> t;
  t.dt = 0.3;
  for (Block3<>* x : {&t.psi_psi, &t.psi_bg, &t.psi_sg, &t.dv_psi, &t.dv_dv, &t.dv_dr, &t.dv_bg,
                      &t.dv_sg, &t.dv_ba, &t.dv_sa, &t.dr_psi, &t.dr_dr, &t.dr_ba, &t.dr_sa})
    *x = d.block();
  t.decay_bg = 0.9, t.decay_ba = 0.8;
  AccumulatorTransition<double> a;
  for (Block3<>* x : {&a.psi, &a.dv, &a.bg, &a.lever}) *x = d.block();
  for (int i = 0; i < 3; ++i) a.eps_h[i] = d(), a.eps_p[i] = d();
  ErrorNoise<double> q;
  q.psi = 0.1, q.dv = 0.2, q.dr = 0.3, q.dr_dv = 0.05, q.bg = 0.7, q.ba = 0.9;
  MisalignmentTransition m;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 6; ++k) m.psi[i][k] = d(), m.dv[i][k] = d();

  // Phi of the 32 by the product that the smoother keeps; the rest by its definition.
  TransitionProduct f;
  f.advance(t, a);
  f.advance_extra(t, a, m);
  Dense F = Dense::Identity(), Q = Dense::Zero();
  for (int i : kMovingRows)
    for (int j = 0; j < kStates; ++j) F(i, j) = f.f[i][j];
  for (int i = 0; i < 3; ++i) F(9 + i, 9 + i) = 0.9, F(12 + i, 12 + i) = 0.8;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 6; ++k) {
      F(i, kMisalignment + k) = m.psi[i][k], F(3 + i, kMisalignment + k) = m.dv[i][k];
      EXPECT_EQ(f.extra[i][kMisalignment - kStates + k], m.psi[i][k]);
      EXPECT_EQ(f.extra[3 + i][kMisalignment - kStates + k], m.dv[i][k]);
    }
  for (int i = 0; i < 3; ++i) {
    Q(i, i) = 0.1, Q(3 + i, 3 + i) = 0.2, Q(6 + i, 6 + i) = 0.3,
         Q(6 + i, 3 + i) = Q(3 + i, 6 + i) = 0.05;
    Q(9 + i, 9 + i) = 0.7, Q(12 + i, 12 + i) = 0.9;
  }
  predict(b.P, b.X, t, q, &a, &m);
  expect_equal(b, F * M * F.transpose() + Q);
  // Two steps on the tape are the product of both.
  f.advance(t, a);
  f.advance_extra(t, a, m);
  Dense Fm = F;  // the product leaves the biases' decay out (they are walks there)
  for (int i = 9; i < 15; ++i) Fm(i, i) = 1;
  const Dense two = Fm * Fm;
  for (int i : kMovingRows)
    for (int j = kStates; j < kAllStates; ++j)
      EXPECT_NEAR(f.extra[i][j - kStates], two(i, j), 1e-12 * (1 + std::fabs(two(i, j))));
}

// [EST-7] over all 43: rows and columns of psi, on the covariance and on the tape's product.
TEST(ExtraStates, ResetTurnsTheExtraBlocksToo) {
  Draw d;
  const Dense M = random_covariance(d);
  Both b = split(M);
  double x[kStates]{0.02, -0.05, 0.03};
  TransitionProduct f;
  for (int j = 0; j < kExtra; ++j)
    for (int i : kMovingRows) f.extra[i][j] = d();
  const TransitionProduct before = f;
  reset_attitude(b.P, x);
  reset_attitude(b.X, x);
  f.reset_attitude(x);
  Dense G = Dense::Identity();
  const Block3<> g = identity3<double>() + 0.5 * skew(Vec<Ecef>{x[0], x[1], x[2]});
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) G(i, j) = g.m[i][j];
  expect_equal(b, G * M * G.transpose());
  for (int j = 0; j < kExtra; ++j)
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += g.m[i][k] * before.extra[k][j];
      EXPECT_NEAR(f.extra[i][j], sum, 1e-14);
    }
}

TEST(ExtraStates, UpdateEqualsJosephsForm) {  // [EST-8]
  Draw d;
  const Dense M = random_covariance(d);
  Both b = split(M);
  SparseRow<double> h;
  Eigen::Matrix<double, 1, kAllStates> H = Eigen::Matrix<double, 1, kAllStates>::Zero();
  for (int i : {0, 7, 22, 31, 32, 34, 37, 42}) {
    h.add(i, d());
    H(i) = h.value[h.n - 1];
  }
  const double r = 0.3, y = d();
  FullProjection a;
  project(b.P, b.X, h, a);
  double x[kAllStates]{}, gain[kAllStates];
  update(b.P, b.X, x, a, y, r, gain);
  const double s = (H * M * H.transpose())(0) + r;
  const Eigen::Matrix<double, kAllStates, 1> K = M * H.transpose() / s;
  const Dense J = Dense::Identity() - K * H;
  EXPECT_NEAR(a.main.s0 + r, s, 1e-12 * s);
  for (int i = 0; i < kAllStates; ++i) {
    EXPECT_NEAR(gain[i], K(i), 1e-12 * std::sqrt(M(i, i) / s));
    EXPECT_NEAR(x[i], K(i) * y, 1e-11 * std::sqrt(M(i, i)));
  }
  expect_equal(b, J * M * J.transpose() + r * K * K.transpose(), M);
}

// The misalignment's columns: attitude and velocity at the end of a step with one element set,
// against without. Corrected rate = true + M w: the computed attitude turns by that more.
TEST(ExtraStates, MisalignmentColumnsEqualDifferences) {
  Draw d;
  for (double dt : {0.01, 0.1}) {
    ErrorPoint<Ecef> p;
    p.C_mb = to_matrix(exp_rotation<Ecef, Body>(d.body(2)));
    p.w_ie = {0, 0, wgs84().w_ie};
    p.w = d.body(0.5), p.f = d.body(5);
    const ErrorTransition<double> t = error_transition(p, dt);
    const MisalignmentTransition m = misalignment_transition(t, p.w);
    // p holds at mid-step; psi' and dv' by many small steps of the non-linear rates.
    const auto end = [&](const double e[6], Quat<Ecef, Body>& q, Vec<Ecef>& v) {
      const Vec<Body> w = p.w + misaligned(e, p.w);
      const int n = 200;
      const double h = dt / n;
      q = exp_rotation<Ecef, Ecef>(0.5 * dt * p.w_ie) * to_quaternion(p.C_mb) *
          exp_rotation<Body, Body>(p.w * (-0.5 * dt));
      v = {};
      for (int i = 0; i < n; ++i) {
        const auto mid = exp_rotation<Ecef, Ecef>(p.w_ie * (-0.5 * h)) * q *
                         exp_rotation<Body, Body>(w * (0.5 * h));
        v = v + to_matrix(mid) * p.f * h;
        q = exp_rotation<Ecef, Ecef>(p.w_ie * (-h)) * q * exp_rotation<Body, Body>(w * h);
      }
    };
    for (int k = 0; k < 6; ++k) {
      const double step = 1e-4;
      double e[6]{};
      Quat<Ecef, Body> q[2];
      Vec<Ecef> v[2];
      for (int side = 0; side < 2; ++side) {
        e[k] = side ? -step : step;
        end(e, q[side], v[side]);
      }
      const auto D = q[0] * conjugate(q[1]);  // C~ = (I - [psi]) C
      const double sign = D.w < 0 ? -1 : 1;
      const double psi[3] = {-sign * D.x / step, -sign * D.y / step, -sign * D.z / step};
      const Vec<Ecef> dv = (v[0] - v[1]) * (0.5 / step);
      const double dvs[3] = {dv.x, dv.y, dv.z};
      // Left out at second order: the step's own turn, |w|dt/2 of the column's size (sign cancels
      // over the step for psi), and a third of |w|dt in dv.
      const double turn = norm(p.w) * dt;
      for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(m.psi[i][k], psi[i], turn * turn * dt + 1e-11) << i << k;
        EXPECT_NEAR(m.dv[i][k], dvs[i], norm(p.f) * dt * turn * turn + 1e-11) << i << k;
      }
    }
  }
}

// ---- Through the navigator ------------------------------------------------------------------

constexpr double kStep = 0.02;
// Hills and bends, so that every axis turns: attitudes of a smooth motion at one place are enough.
struct Rolling {
  std::vector<ImuIncrement<double>> imu;
  std::vector<Quat<Ecef, Body>> q;
  Point<Ecef> r;
  Rot<Geographic, Ecef> C;
};
Rolling rolling(double length) {
  Rolling out;
  const Geodetic<double> at{50 * deg, 10 * deg, 120};
  out.r = to_ecef(wgs84(), at);
  out.C = geographic_axes(at.lat, at.lon);
  const double gamma = normal_gravity(wgs84(), std::sin(at.lat), at.h);
  const auto attitude = [&](double t) {
    return to_quaternion(transpose(out.C) *
                         to_matrix<Geographic>(Euler<double>{
                             0.6 + 0.15 * t, 0.3 * std::sin(0.31 * t), 0.25 * std::sin(0.23 * t)}));
  };
  const Vec<Ecef> w{0, 0, wgs84().w_ie}, up = transpose(out.C) * Vec<Geographic>{0, 0, gamma};
  const int n = static_cast<int>(std::lround(length / kStep));
  out.q.push_back(attitude(0));
  for (int i = 1; i <= n; ++i) {
    const Quat<Ecef, Body>& a = out.q.back();
    const Quat<Ecef, Body> b = attitude(i * kStep);
    Quat<Body, Body> d = conjugate(a) * exp_rotation<Ecef, Ecef>(w * kStep) * b;
    if (d.w < 0) d = {-d.w, -d.x, -d.y, -d.z};
    const double m = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), k = 2 * std::atan2(m, d.w) / m;
    ImuIncrement<double> u;
    u.t = i * kStep, u.dt = kStep;
    u.dtheta = {k * d.x, k * d.y, k * d.z};
    // Body axes at mid-step: third order, 1e-6 m/s^2 here.
    const auto mid = a * exp_rotation<Body, Body>(0.5 * u.dtheta);
    u.dv = transpose(to_matrix(mid)) * (up * kStep);
    out.imu.push_back(u);
    out.q.push_back(b);
  }
  return out;
}
struct Truth {
  Vec<Body> antenna;
  double height_bias = 0, heading_bias = 0, misalignment[6]{};
};
NavigatorConfig extra_config() {
  NavigatorConfig c;
  c.ellipsoid = wgs84();
  c.imu_interval = kStep;
  c.gyro_noise = 0.01 * deg_per_sqrt_h, c.gyro_bias = 0.1 * deg_per_h;
  c.accel_noise = 0.01 * mps_per_sqrt_h, c.accel_bias = 50 * ug;
  c.bias_moving = 0;
  c.use_odometer = c.use_nhc = c.use_zupt = c.use_zaru = false;
  c.standstill.sigma_w = c.standstill.sigma_f = 1e-3;
  c.fix_lever_std = 1.0, c.height_bias_std = 10.0, c.heading_bias_std = 2 * deg;
  c.gyro_misalignment = 1e-3;
  c.height_std = 0.5, c.heading_std = 0.2 * deg;
  return c;
}
// Fixes of the antenna at 1 Hz, heights and headings with their biases, gyros with theirs.
void drive(Navigator& nav, const Rolling& path, const Truth& truth, Draw& d) {
  NavigatorStart s;
  s.state.r = path.r, s.state.q = path.q[0];
  for (int i = 0; i < 3; ++i) {
    s.P.p[kPsi + i][kPsi + i] = 1e-6, s.P.p[kDv + i][kDv + i] = 1e-4;
    s.P.p[kDr + i][kDr + i] = 1, s.P.p[kBg + i][kBg + i] = std::pow(0.1 * deg_per_h, 2);
    s.P.p[kBa + i][kBa + i] = std::pow(50 * ug, 2);
  }
  s.state.q = exp_rotation<Ecef, Ecef>(relabel<Ecef>(d.body(1e-3))) * s.state.q;
  s.state.r = s.state.r + relabel<Ecef>(d.body(1.0));
  s.state.v = relabel<Ecef>(d.body(0.01));
  nav.start(s);
  const Vec<Body> bg = d.body(0.1 * deg_per_h), ba = d.body(50 * ug);
  for (std::size_t i = 0; i < path.imu.size(); ++i) {
    ImuIncrement<double> u = path.imu[i];
    u.dtheta = u.dtheta + misaligned(truth.misalignment, u.dtheta) + bg * kStep +
               d.body(0.01 * deg_per_sqrt_h * std::sqrt(kStep));
    u.dv = u.dv + ba * kStep + d.body(0.01 * mps_per_sqrt_h * std::sqrt(kStep));
    if (i % 50 == 49) {
      const auto C = to_matrix(path.q[i + 1]);
      const auto p = to_geodetic(wgs84(), path.r + C * truth.antenna + relabel<Ecef>(d.body(0.05)));
      Fix f;
      f.t = u.t, f.lat = p.lat, f.lon = p.lon, f.h = p.h;
      f.std_e = f.std_n = f.std_u = 0.05;
      nav.fix(f);
      nav.height({u.t, to_geodetic(wgs84(), path.r).h + truth.height_bias + 0.5 * d(), kNone});
      const Vec<Geographic> bow = path.C * (C * Vec<Body>{0, 1, 0});
      double heading = std::atan2(bow.x, bow.y) + truth.heading_bias + 0.2 * deg * d();
      if (heading < 0) heading += 2 * kPi;
      nav.heading({u.t, heading, 0});
    }
    nav.imu(u);
  }
}

TEST(ExtraStates, AreFoundInsideTheirBands) {
  Draw d;
  const Rolling path = rolling(120);
  double square = 0;
  int count = 0;
  const int trials = 8;
  double prior[kExtra], after[kExtra]{};
  for (int n = 0; n < trials; ++n) {
    Truth truth;
    truth.antenna = d.body(1.0);
    truth.height_bias = 10 * d(), truth.heading_bias = 2 * deg * d();
    for (double& m : truth.misalignment) m = 1e-3 * d();
    Navigator nav(extra_config());
    ASSERT_FALSE(nav.has_extra());
    drive(nav, path, truth, d);
    ASSERT_TRUE(nav.has_extra());
    const NominalState& s = nav.state();
    double e[kExtra] = {truth.antenna.x - s.antenna.x, truth.antenna.y - s.antenna.y,
                        truth.antenna.z - s.antenna.z, truth.height_bias - s.height_bias,
                        truth.heading_bias - s.heading_bias};
    for (int i = 0; i < 6; ++i) e[5 + i] = truth.misalignment[i] - s.misalignment[i];
    Eigen::Matrix<double, kExtra, kExtra> P;
    Eigen::Matrix<double, kExtra, 1> w;
    const auto& X = nav.extra_covariance();
    for (int i = 0; i < kExtra; ++i) {
      w[i] = e[i] / std::sqrt(X.e[i][i]);
      after[i] = std::sqrt(X.e[i][i]);
      for (int j = 0; j < kExtra; ++j) P(i, j) = X.e[i][j] / std::sqrt(X.e[i][i] * X.e[j][j]);
    }
    square += w.dot(P.ldlt().solve(w));
    count += kExtra;
  }
  const double sigma[kExtra] = {1, 1, 1, 10, 2 * deg, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3};
  for (int i = 0; i < kExtra; ++i) prior[i] = sigma[i];
  std::printf("chi2 %.1f of %d; sigma after/before:", square, count);
  for (int i = 0; i < kExtra; ++i) std::printf(" %.3f", after[i] / prior[i]);
  std::printf("\n");
  // Chi-square of 88 degrees: 5e-7 either side. (Five sigma of a normal are left once in 60,000.)
  ASSERT_EQ(count, 88);
  EXPECT_GT(square, 37.6);
  EXPECT_LT(square, 168.8);
  for (int i = 0; i < 5; ++i) EXPECT_LT(after[i], 0.1 * prior[i]) << i;
  for (int i = 5; i < kExtra; ++i) EXPECT_LT(after[i], 0.5 * prior[i]) << i;
}

// A state that is off has zero variance: with nothing on the filter is, to rounding, that of 32
// states, and on the tape too.
TEST(ExtraStates, OffTheyAreNotThere) {
  Draw d;
  const Rolling path = rolling(20);
  NavigatorConfig off = extra_config(), on = extra_config();
  off.fix_lever_std = off.height_bias_std = off.heading_bias_std = off.gyro_misalignment = 0;
  on = off;
  on.height_bias_std = 1e-12;  // the 43 states run, and hold nothing
  Draw a = d, b = d;
  Navigator x(off), y(on);
  SmootherTape tape(true);
  y.set_tape(&tape);
  drive(x, path, Truth{}, a);
  drive(y, path, Truth{}, b);
  ASSERT_FALSE(x.has_extra());
  ASSERT_TRUE(y.has_extra());
  EXPECT_LT(norm(x.state().r - y.state().r), 1e-8);
  for (int i = 0; i < kStates; ++i)
    EXPECT_NEAR(x.covariance().p[i][i], y.covariance().p[i][i],
                1e-9 * x.covariance().p[i][i] + 1e-300);
  int epochs = 0;
  tape.smooth([&](const NominalState&, const Covariance<kStates>&, std::uint32_t) { ++epochs; });
  EXPECT_EQ(epochs, 21);
}

// The smoother's constants are constant, and its last epoch is the filter's.
TEST(ExtraStates, SmoothedConstantsAreConstant) {
  Draw d;
  const Rolling path = rolling(60);
  Truth truth;
  truth.antenna = {0.7, -0.4, 0.9};
  truth.height_bias = 7, truth.heading_bias = 1 * deg;
  for (int i = 0; i < 6; ++i) truth.misalignment[i] = (i - 2.5) * 4e-4;
  Navigator nav(extra_config());
  SmootherTape tape(true);
  nav.set_tape(&tape);
  drive(nav, path, truth, d);
  bool last = true;
  tape.smooth([&](const NominalState& s, const Covariance<kStates>&, std::uint32_t) {
    const NominalState& f = nav.state();
    // Rounding over the run, relative to the states' sigmas.
    EXPECT_NEAR(s.antenna.x, f.antenna.x, 1e-7);
    EXPECT_NEAR(s.height_bias, f.height_bias, 1e-6);
    EXPECT_NEAR(s.heading_bias, f.heading_bias, 1e-8);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(s.misalignment[i], f.misalignment[i], 1e-9);
    for (int i = 0; last && i < kExtra; ++i)
      EXPECT_NEAR(tape.extra_variances()[i], nav.extra_covariance().e[i][i],
                  1e-12 * nav.extra_covariance().e[i][i]);
    last = false;
  });
}

}  // namespace
}  // namespace loxo
