// SPDX-License-Identifier: Apache-2.0
// Every Jacobian of errors/ against differences of the non-linear equations, in every regime.
#include "loxo/errors/error_dynamics.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/errors/level_errors.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

struct Place {
  double lat, lon;
};
// Equator, middle, high, near the pole, the pole itself (by its longitude), south, both sides of
// 180 deg.
const Place kPlaces[] = {{0.0, 0.1},
                         {0.3 * deg, 20 * deg},
                         {45 * deg, -60 * deg},
                         {80 * deg, 179.99 * deg},
                         {89.9 * deg, 10 * deg},
                         {90 * deg, 30 * deg},
                         {-60 * deg, -179.99 * deg},
                         {-89.99 * deg, 5 * deg}};

struct Motion {
  Rot<Ecef, Body> C;
  Vec<Ecef> v;
  Point<Ecef> r;
};
struct Rates {
  Block3<> C;
  Vec<Ecef> v, r;
};
Vec<Ecef> gravity_at(const Ellipsoid& ell, const Point<Ecef>& r) {
  const NormalHeight<double> p = to_normal(ell, r);
  return p.n * (-normal_gravity(ell, p.n.z, p.h));
}
// C' = C[w] - [w_ie]C, v' = C f - 2 w_ie x v + g, r' = v (polar.md 3.1, ECEF form).
Rates rates_of(const Ellipsoid& ell, const Motion& x, const Vec<Body>& w, const Vec<Body>& f) {
  const Vec<Ecef> w_ie{0, 0, ell.w_ie};
  return {block_of(x.C) * skew(w) - skew(w_ie) * block_of(x.C),
          x.C * f - 2.0 * cross(w_ie, x.v) + gravity_at(ell, x.r), x.v};
}
// The nine rates of the errors between two motions, psi from C~ C^T = I - [psi] (its antisymmetric
// part).
void error_rate(const Motion& c, const Rates& rc, const Motion& t, const Rates& rt, double out[9]) {
  const Block3<> d = rc.C * transpose(block_of(t.C)) + block_of(c.C) * transpose(rt.C);
  out[0] = -0.5 * (d.m[2][1] - d.m[1][2]);
  out[1] = -0.5 * (d.m[0][2] - d.m[2][0]);
  out[2] = -0.5 * (d.m[1][0] - d.m[0][1]);
  const Vec<Ecef> dv = rc.v - rt.v, dr = rc.r - rt.r;
  out[3] = dv.x, out[4] = dv.y, out[5] = dv.z;
  out[6] = dr.x, out[7] = dr.y, out[8] = dr.z;
}

struct Scene {
  Motion x;
  Vec<Body> w, f;
};
Scene scene_at(const Ellipsoid& ell, const Place& p, std::mt19937& rng) {
  std::uniform_real_distribution<double> u(-1, 1);
  Scene s;
  s.x.r = to_ecef(ell, Geodetic<double>{p.lat, p.lon, 300.0 * u(rng)});
  s.x.v = {20 * u(rng), 20 * u(rng), 20 * u(rng)};
  s.x.C = to_matrix(exp_rotation<Ecef, Body>(Vec<Body>{3 * u(rng), 3 * u(rng), 3 * u(rng)}));
  s.w = {0.5 * u(rng), 0.5 * u(rng), 0.5 * u(rng)};
  s.f = {5 * u(rng), 5 * u(rng), 9.8 + u(rng)};
  return s;
}
ErrorPoint<Ecef> point_of(const Ellipsoid& ell, const Scene& s) {
  const NormalHeight<double> p = to_normal(ell, s.x.r);
  return {s.x.C, s.x.v, {0, 0, ell.w_ie}, {}, s.w, s.f, gravity_gradient(ell, p.n, p.h)};
}

TEST(GravityGradient, EqualsDifferencesEverywhere) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid sphere = make_sphere(6371000);
  for (const Ellipsoid* ell : {&wgs84(), &paper_sphere(), &sphere}) {
    for (const Place& p : kPlaces) {
      const Scene s = scene_at(*ell, p, rng);
      const NormalHeight<double> q = to_normal(*ell, s.x.r);
      const Block3<> G = gravity_gradient(*ell, q.n, q.h);
      const double e = 100.0;  // m: truncation (e/R)^2 = 2e-10, rounding 1e-15 * 9.8 / e
      for (int j = 0; j < 3; ++j) {
        const Vec<Ecef> d{j == 0 ? e : 0, j == 1 ? e : 0, j == 2 ? e : 0};
        const Vec<Ecef> g = (gravity_at(*ell, s.x.r + d) - gravity_at(*ell, s.x.r - d)) * (0.5 / e);
        // Relative to the gradient's size 9.8/R = 1.5e-6: 1e-7.
        EXPECT_NEAR(G.m[0][j], g.x, 2e-13);
        EXPECT_NEAR(G.m[1][j], g.y, 2e-13);
        EXPECT_NEAR(G.m[2][j], g.z, 2e-13);
      }
    }
  }
}

// [EST-3] on ECEF axes against differences of the non-linear equations, all 21 columns.
TEST(ErrorRates, EcefColumnsEqualDifferences) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid& ell = wgs84();
  for (const Place& p : kPlaces) {
    const Scene s = scene_at(ell, p, rng);
    const ErrorRates<double> F = error_rates(point_of(ell, s));
    const Rates nominal = rates_of(ell, s.x, s.w, s.f);
    // Size of the perturbation of each kind: second-order rest below 1e-9 of the first.
    const double step[7] = {1e-5, 1e-2, 100.0, 1e-4, 1e-3, 1e-4, 1e-4};
    for (int j = 0; j < kInsErrorStates; ++j) {
      double plus[9], minus[9];
      for (int side = 0; side < 2; ++side) {
        const double e = (side ? -1 : 1) * step[j / 3];
        Vec<Ecef> d{};
        (j % 3 == 0 ? d.x : j % 3 == 1 ? d.y : d.z) = e;
        const Vec<Body> db = relabel<Body>(d);
        Motion c = s.x;
        Vec<Body> w = s.w, f = s.f;
        switch (j / 3) {
          case 0:
            c.C = to_matrix(exp_rotation<Ecef, Ecef>(-d)) * s.x.C;
            break;  // C~ = (I - [psi]) C
          case 1:
            c.v = c.v + d;
            break;
          case 2:
            c.r = c.r + d;
            break;
          case 3:
            w = w + db;
            break;
          case 4:
            f = f + db;
            break;
          case 5:
            w = {w.x * (1 + db.x), w.y * (1 + db.y), w.z * (1 + db.z)};
            break;
          default:
            f = {f.x * (1 + db.x), f.y * (1 + db.y), f.z * (1 + db.z)};
            break;
        }
        error_rate(c, rates_of(ell, c, w, f), s.x, nominal, side ? minus : plus);
      }
      for (int i = 0; i < 9; ++i) {
        const double difference = (plus[i] - minus[i]) / (2 * step[j / 3]);
        // Rounding of the differences: 1e-15 * (rates of order 10) / step, and e^2 truncation.
        const double tolerance = 1e-5 * std::fabs(difference) + 4e-14 / step[j / 3] +
                                 1e-9 * step[j / 3] * step[j / 3] * 1e-3;
        EXPECT_NEAR(F.f[i][j], difference, tolerance)
            << "row " << i << " column " << j << " lat " << p.lat / deg;
      }
    }
  }
}

template <class M>
ErrorPoint<M> level_point(const Ellipsoid& ell, const Scene& s, const LevelAxes<double>& axes) {
  ErrorPoint<M> q;
  const Block3<>& C = axes.C_me;
  auto turn = [&](const Vec<Ecef>& v) { return relabel<M>(C * v); };
  const Block3<> Cb = C * block_of(s.x.C);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) q.C_mb.m[i][j] = Cb.m[i][j];
  q.v = turn(s.x.v);
  q.w_ie = turn({0, 0, ell.w_ie});
  double w[3];
  level_transport(axes, q.v.x, q.v.y, w);
  q.w_em = {w[0], w[1], w[2]};
  q.w = s.w;
  q.f = s.f;
  q.gradient = C * point_of(ell, s).gradient * transpose(C);
  return q;
}

// The same physical vectors: rates on level axes = turned rates of ECEF minus [w_em].
template <class M>
void check_level(const Ellipsoid& ell, const Scene& s, const LevelAxes<double>& axes) {
  const ErrorPoint<M> q = level_point<M>(ell, s, axes);
  const ErrorRates<double> Fm = error_rates(q), Fe = error_rates(point_of(ell, s));
  const Block3<> C = axes.C_me;
  for (int bi = 0; bi < 3; ++bi)
    for (int bj = 0; bj < 7; ++bj) {
      Block3<> e;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) e.m[i][j] = Fe.f[3 * bi + i][3 * bj + j];
      Block3<> expected = C * e;
      if (bj < 3) expected = expected * transpose(C);
      if (bi == bj) expected = expected - skew(q.w_em);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          EXPECT_NEAR(Fm.f[3 * bi + i][3 * bj + j], expected.m[i][j], 1e-13) << bi << bj;
    }
}
TEST(ErrorRates, LevelAxesAreTurnedEcefAxes) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid& ell = wgs84();
  for (const Place& p : kPlaces) {
    const Scene s = scene_at(ell, p, rng);
    const NormalHeight<double> q = to_normal(ell, s.x.r);
    if (std::fabs(p.lat) < 89.95 * deg)
      check_level<Geographic>(ell, s, geographic_level_axes(ell, q.n, q.h));
    if (std::fabs(p.lat) > 20 * deg) {
      check_level<Transverse>(ell, s, transverse_level_axes(ell, q.n, q.h, 0.3));
      check_level<Grid>(ell, s, grid_level_axes(ell, q.n, q.h, 0.3));
    }
  }
}

// [EST-4] against the matrix exponential of [EST-3], scaled by typical state sizes; the sizes and
// the figures are the specification's: 1e-9 at 10 ms, 1e-7 at 0.1 s, here with a factor for random
// rates up to 0.5 rad/s.
TEST(ErrorTransition, AgreesWithTheMatrixExponential) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid& ell = wgs84();
  const double size[7] = {1e-3, 0.1, 10, 1e-5, 1e-2, 1e-4, 1e-4};
  for (const Place& p : kPlaces) {
    const Scene s = scene_at(ell, p, rng);
    const ErrorPoint<Ecef> q = point_of(ell, s);
    const ErrorRates<double> F = error_rates(q);
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(21, 21);
    for (int i = 0; i < 9; ++i)
      for (int j = 0; j < 21; ++j) A(i, j) = F.f[i][j];
    for (const auto& [dt, limit] : {std::pair{0.01, 1e-8}, std::pair{0.1, 1e-5}}) {
      const Eigen::MatrixXd exact = (A * dt).exp();
      const ErrorTransition<double> t = error_transition(q, dt);
      Eigen::MatrixXd B = Eigen::MatrixXd::Identity(21, 21);
      auto put = [&](int i, int j, const Block3<>& b) {
        for (int a = 0; a < 3; ++a)
          for (int c = 0; c < 3; ++c) B(i + a, j + c) = b.m[a][c];
      };
      put(0, 0, t.psi_psi), put(0, 9, t.psi_bg), put(0, 15, t.psi_sg);
      put(3, 0, t.dv_psi), put(3, 3, t.dv_dv), put(3, 6, t.dv_dr), put(3, 9, t.dv_bg),
          put(3, 12, t.dv_ba);
      put(3, 15, t.dv_sg), put(3, 18, t.dv_sa);
      put(6, 0, t.dr_psi), put(6, 3, dt * identity3<double>()), put(6, 6, t.dr_dr),
          put(6, 12, t.dr_ba), put(6, 18, t.dr_sa);
      double worst = 0;
      for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 21; ++j)
          worst = std::max(worst, std::fabs(B(i, j) - exact(i, j)) * size[j / 3] / size[i / 3]);
      EXPECT_LT(worst, limit) << dt;
    }
  }
}

// [EST-5] against Van Loan.
TEST(ErrorNoise, AgreesWithVanLoan) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid& ell = wgs84();
  const Scene s = scene_at(ell, kPlaces[2], rng);
  const ErrorPoint<Ecef> p = point_of(ell, s);
  const ErrorRates<double> F = error_rates(p);
  const double ng = 1e-4, na = 1e-3, dt = 0.1;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(9, 9), Qc = Eigen::MatrixXd::Zero(9, 9);
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) A(i, j) = F.f[i][j];
  for (int i = 0; i < 3; ++i) Qc(i, i) = ng * ng, Qc(3 + i, 3 + i) = na * na;
  Eigen::MatrixXd V = Eigen::MatrixXd::Zero(18, 18);
  V.topLeftCorner(9, 9) = -A, V.topRightCorner(9, 9) = Qc,
                     V.bottomRightCorner(9, 9) = A.transpose();
  const Eigen::MatrixXd E = (V * dt).exp();
  const Eigen::MatrixXd Q = E.bottomRightCorner(9, 9).transpose() * E.topRightCorner(9, 9);
  const Vec<Ecef> dv = (p.C_mb * p.f) * dt;
  const ErrorNoise<double> q = error_noise(ng, na, dt, dv);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(q.psi / Q(i, i), 1, 1e-6);
    EXPECT_NEAR(q.dv / Q(3 + i, 3 + i), 1,
                1e-2);  // (T/3) N_g^2 [dv][dv]^T is left out below 1 s: 0.3 % here
    EXPECT_NEAR(q.dr / Q(6 + i, 6 + i), 1, 1e-2);
    EXPECT_NEAR(q.dr_dv / Q(6 + i, 3 + i), 1, 1e-2);
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(q.dv_psi.m[i][j], Q(3 + i, j), 1e-4 * q.psi);
  }
}

// ---- Classical errors
// -------------------------------------------------------------------------------------------

LevelAxes<double> axes_of(FrameId frame, const Ellipsoid& ell, const NormalHeight<double>& q) {
  if (frame == FrameId::kGeographic) return geographic_level_axes(ell, q.n, q.h);
  if (frame == FrameId::kTransverse) return transverse_level_axes(ell, q.n, q.h, 0.3);
  return grid_level_axes(ell, q.n, q.h, 0.3);
}

// [EST-2]: T against differences of the exact frame quantities of displaced motions.
TEST(LevelErrors, ClassicalErrorsEqualDifferences) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid& ell = wgs84();
  for (FrameId frame : {FrameId::kGeographic, FrameId::kTransverse, FrameId::kGrid}) {
    for (double lat : {0.3 * deg, 45 * deg, -45 * deg, 80 * deg, 89 * deg}) {
      if (frame != FrameId::kGeographic && std::fabs(lat) < 20 * deg) continue;
      const Scene s = scene_at(ell, {lat, 100 * deg}, rng);
      const NormalHeight<double> q = to_normal(ell, s.x.r);
      const LevelAxes<double> a = axes_of(frame, ell, q);
      const Vec<Ecef> v_m = a.C_me * s.x.v;
      const double v[3] = {v_m.x, v_m.y, v_m.z};
      const Matrix9<double> T = to_classical(a, v);
      const Block3<> C_mb = a.C_me * block_of(s.x.C);
      // Displacement: curvature of tan L within it is the truncation, e tanL / R.
      const double step[3] = {1e-5, 1e-2, 20.0};
      for (int j = 0; j < 9; ++j) {
        double out[2][9];
        for (int side = 0; side < 2; ++side) {
          const double e = (side ? -1 : 1) * step[j / 3];
          Vec<Ecef> d{};
          (j % 3 == 0 ? d.x : j % 3 == 1 ? d.y : d.z) = e;
          const Vec<Ecef> de = transpose(a.C_me) * d;
          Motion c = s.x;
          if (j < 3)
            c.C = to_matrix(exp_rotation<Ecef, Ecef>(-de)) * s.x.C;
          else if (j < 6)
            c.v = c.v + de;
          else
            c.r = c.r + de;
          const LevelAxes<double> ac = axes_of(frame, ell, to_normal(ell, c.r));
          const Block3<> D = ac.C_me * block_of(c.C) * transpose(C_mb);
          const Vec<Ecef> dv = ac.C_me * c.v - v_m, dp = a.C_me * (c.r - s.x.r);
          const double o[9] = {-0.5 * (D.m[2][1] - D.m[1][2]),
                               -0.5 * (D.m[0][2] - D.m[2][0]),
                               -0.5 * (D.m[1][0] - D.m[0][1]),
                               dv.x,
                               dv.y,
                               dv.z,
                               dp.x,
                               dp.y,
                               dp.z};
          for (int i = 0; i < 9; ++i) out[side][i] = o[i];
        }
        const double tan_l = std::tan(std::fabs(lat));
        for (int i = 0; i < 9; ++i) {
          const double difference = (out[0][i] - out[1][i]) / (2 * step[j / 3]);
          const double relative =
              1e-9 + (j >= 6 ? std::pow(step[2] * tan_l / 6.37e6, 2) + 1e-8 : 0);
          const double rounding =
              i >= 6 ? 2e-9 : 3e-14;  // a unit in the last place of ECEF is 9e-10 m
          EXPECT_NEAR(T.m[i][j], difference,
                      relative * std::fabs(difference) + rounding / step[j / 3])
              << frame_name(frame) << " row " << i << " column " << j << " lat " << lat / deg;
        }
      }
      const Matrix9<double> U = from_classical(a, v);
      for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j) {
          double sum = 0;
          for (int k = 0; k < 9; ++k) sum += T.m[i][k] * U.m[k][j];
          EXPECT_NEAR(sum, i == j, 1e-18 + 1e-15 * (i == j));
        }
    }
  }
}

// [EST-16], and its second law: the covariance on ECEF axes is the same from every frame, after any
// chain of switches.
TEST(LevelErrors, SwitchingFramesLosesNothing) {
  std::mt19937 rng(testing::seed());
  std::normal_distribution<double> g;
  const Ellipsoid& ell = wgs84();
  for (double lat : {45 * deg, -70 * deg, 89 * deg, 89.99 * deg}) {
    const Scene s = scene_at(ell, {lat, 100 * deg}, rng);
    const NormalHeight<double> q = to_normal(ell, s.x.r);
    using M9 = Eigen::Matrix<double, 9, 9>;
    auto eig = [](const Matrix9<double>& a) {
      M9 m;
      for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j) m(i, j) = a.m[i][j];
      return m;
    };
    M9 L;
    const double size[3] = {1e-4, 0.1, 50};
    for (int i = 0; i < 9; ++i)
      for (int j = 0; j < 9; ++j) L(i, j) = g(rng) * size[i / 3];
    const M9 P_e = L * L.transpose();
    auto on_axes = [&](const LevelAxes<double>& a) {  // blockdiag(C_me)
      M9 B = M9::Zero();
      for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) B(3 * k + i, 3 * k + j) = a.C_me.m[i][j];
      return B;
    };
    const FrameId chain[] = {FrameId::kGeographic, FrameId::kTransverse, FrameId::kGrid,
                             FrameId::kGeographic, FrameId::kGrid,       FrameId::kTransverse,
                             FrameId::kGeographic};
    LevelAxes<double> a = axes_of(chain[0], ell, q);
    Vec<Ecef> v = a.C_me * s.x.v;
    double va[3] = {v.x, v.y, v.z};
    M9 P = eig(to_classical(a, va)) * on_axes(a) * P_e * on_axes(a).transpose() *
           eig(to_classical(a, va)).transpose();
    for (FrameId next : chain) {
      const LevelAxes<double> c = axes_of(next, ell, q);
      const M9 S = eig(switch_classical(a, c, va));
      P = S * P * S.transpose();
      a = c;
      v = a.C_me * s.x.v;
      va[0] = v.x, va[1] = v.y, va[2] = v.z;
      const M9 U = on_axes(a).transpose() * eig(from_classical(a, va));
      const M9 back = U * P * U.transpose();
      for (int i = 0; i < 9; ++i)
        for (int j = 0; j < 9; ++j)
          // Cancellation of tanL terms in the geographic states: eps tan^2 L (50 m / R / 1e-4
          // rad)^2.
          EXPECT_NEAR(
              back(i, j), P_e(i, j),
              (1e-12 + 1e-15 * std::pow(std::tan(lat), 2)) * std::sqrt(P_e(i, i) * P_e(j, j)));
    }
    // The wrong ones differ where it matters: only these columns.
    const LevelAxes<double> ga = axes_of(FrameId::kGeographic, ell, q),
                            tr = axes_of(FrameId::kTransverse, ell, q);
    v = ga.C_me * s.x.v;
    const double vg[3] = {v.x, v.y, v.z};
    EXPECT_GT(
        (eig(switch_classical(ga, tr, vg)) - eig(switch_velocity_rotated_only(ga, tr, vg))).norm(),
        1e-8);
    EXPECT_GT((eig(switch_classical(ga, tr, vg)) - eig(switch_pure_rotation(ga, tr))).norm(), 1e-8);
  }
}

// polar.md 4.2: the 15-state block matrix against differences of the non-linear transverse
// mechanization (3.1, 2.2).
struct TransverseMotion {
  double v[3], p, l, h;
  Rot<Transverse, Body> C;
};
void transverse_rates(const Ellipsoid& ell, const TransverseMotion& x, const Vec<Body>& w,
                      const Vec<Body>& f, double vdot[3], Block3<>& Cdot, double pdot[3]) {
  double sp, cp, sl, cl;
  sincos(x.p, sp, cp);
  sincos(x.l, sl, cl);
  const double s = cp * cl;
  const Curvature<double> K = curvature(ell, -sl, -sp * cl, s, x.h);
  const double rE = K.xx * x.v[0] + K.xy * x.v[1], rN = K.xy * x.v[0] + K.yy * x.v[1];
  const Vec<Transverse> w_ie{-ell.w_ie * sl, -ell.w_ie * sp * cl, ell.w_ie * cp * cl};
  const Vec<Transverse> w_et{-rN, rE, rE * sp / cp}, v{x.v[0], x.v[1], x.v[2]};
  const Vec<Transverse> a =
      x.C * f - cross(2.0 * w_ie + w_et, v) + Vec<Transverse>{0, 0, -normal_gravity(ell, s, x.h)};
  vdot[0] = a.x, vdot[1] = a.y, vdot[2] = a.z;
  Cdot = block_of(x.C) * skew(w) - skew(w_ie + w_et) * block_of(x.C);
  pdot[0] = rN, pdot[1] = rE / cp, pdot[2] = x.v[2];
}
TEST(LevelErrors, TransverseBlockModelEqualsDifferences) {
  std::mt19937 rng(testing::seed());
  std::uniform_real_distribution<double> u(-1, 1);
  const Ellipsoid sphere = make_sphere(6371000);
  for (const Ellipsoid* ell : {&wgs84(), &paper_sphere(), &sphere}) {
    for (const auto& [tlat, tlon] :
         {std::pair{0.0, 0.0}, std::pair{0.3, 0.4}, std::pair{-0.5, -0.2}, std::pair{0.1, kPi},
          std::pair{1.2, 1.0}, std::pair{-1e-6, 1e-7}, std::pair{-0.7, 2.5}}) {
      TransverseMotion x{};
      x.v[0] = 20 * u(rng), x.v[1] = 20 * u(rng), x.v[2] = 3 * u(rng);
      x.p = tlat, x.l = tlon, x.h = 200 * u(rng);
      x.C = to_matrix<Transverse>(Euler<double>{3 * u(rng), 0.5 * u(rng), 0.5 * u(rng)});
      const Vec<Body> w{0.1 * u(rng), 0.1 * u(rng), 0.1 * u(rng)}, f{2 * u(rng), 2 * u(rng), 9.8};
      TransversePoint q;
      q.tlat = x.p, q.tlon = x.l, q.h = x.h, q.C_tb = x.C, q.f = f;
      for (int i = 0; i < 3; ++i) q.v[i] = x.v[i];
      const Matrix15 F = transverse_error_matrix(*ell, q);
      double v0[3], p0[3];
      Block3<> C0;
      transverse_rates(*ell, x, w, f, v0, C0, p0);
      // dv, Phi, (dp, dl), dh, b_g, b_a
      const double step[15] = {1e-2, 1e-2, 1e-2, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5,
                               10,   1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3};
      for (int j = 0; j < 15; ++j) {
        double out[2][9];
        for (int side = 0; side < 2; ++side) {
          const double e = (side ? -1 : 1) * step[j];
          TransverseMotion c = x;
          Vec<Body> wc = w, fc = f;
          const Vec<Transverse> d{j % 3 == 0 ? e : 0, j % 3 == 1 ? e : 0, j % 3 == 2 ? e : 0};
          if (j < 3)
            c.v[j] += e;
          else if (j < 6)
            c.C = to_matrix(exp_rotation<Transverse, Transverse>(-d)) * x.C;
          else if (j == 6)
            c.p += e;
          else if (j == 7)
            c.l += e;
          else if (j == 8)
            c.h += e;
          else if (j < 12)
            wc = wc + relabel<Body>(d);
          else
            fc = fc + relabel<Body>(d);
          double v1[3], p1[3];
          Block3<> C1;
          transverse_rates(*ell, c, wc, fc, v1, C1, p1);
          const Block3<> D = C1 * transpose(block_of(x.C)) + block_of(c.C) * transpose(C0);
          const double o[9] = {v1[0] - v0[0],
                               v1[1] - v0[1],
                               v1[2] - v0[2],
                               -0.5 * (D.m[2][1] - D.m[1][2]),
                               -0.5 * (D.m[0][2] - D.m[2][0]),
                               -0.5 * (D.m[1][0] - D.m[0][1]),
                               p1[0] - p0[0],
                               p1[1] - p0[1],
                               p1[2] - p0[2]};
          for (int i = 0; i < 9; ++i) out[side][i] = o[i];
        }
        for (int i = 0; i < 9; ++i) {
          const double difference = (out[0][i] - out[1][i]) / (2 * step[j]);
          // 1e-5 per non-zero element, as the specification asks; the rest is rounding of the
          // differences.
          EXPECT_NEAR(F.m[i][j], difference, 1e-5 * std::fabs(difference) + 2e-14 / step[j])
              << ell->name << " row " << i << " column " << j << " p " << tlat << " l " << tlon;
        }
      }
    }
  }
}

// (V-53) against differences: radii held fixed, no vertical channel, metres with the local scale
// held fixed.
TEST(LevelErrors, GeographicTwelveStatesEqualDifferences) {
  std::mt19937 rng(testing::seed());
  std::uniform_real_distribution<double> u(-1, 1);
  const Ellipsoid& ell = wgs84();
  for (double lat : {0.0, 40 * deg, -65 * deg, 85 * deg}) {
    const double N = prime_vertical_radius(ell, std::sin(lat)),
                 M = meridian_radius(ell, std::sin(lat));
    const double v0[2] = {20 * u(rng), 20 * u(rng)};
    const Rot<Geographic, Body> C = to_matrix<Geographic>(Euler<double>{3 * u(rng), 0, 0});
    const Vec<Body> f{u(rng), u(rng), 9.8};
    const Vec<Geographic> fn = C * f;
    GeographicPoint q;
    q.lat = lat, q.ve = v0[0], q.vn = v0[1], q.C_nb = C;
    q.f[0] = fn.x, q.f[1] = fn.y, q.f[2] = fn.z;
    const Matrix12 F = geographic_error_matrix(ell, q);
    // rates of (C, vE, vN, E, N) at a perturbed state; E, N in metres with the scale of the nominal
    // place.
    auto rates = [&](const Rot<Geographic, Body>& c, const double v[2], double dn,
                     const Vec<Body>& w, const Vec<Body>& fb, Block3<>& Cdot, double out[4]) {
      const double L = lat + dn / M, sL = std::sin(L), cL = std::cos(L);
      const Vec<Geographic> w_ie{0, ell.w_ie * cL, ell.w_ie * sL},
          w_en{-v[1] / M, v[0] / N, v[0] * sL / cL / N};
      const Vec<Geographic> a = c * fb - cross(2.0 * w_ie + w_en, Vec<Geographic>{v[0], v[1], 0});
      Cdot = block_of(c) * skew(w) - skew(w_ie + w_en) * block_of(c);
      out[0] = a.x, out[1] = a.y;
      out[2] = v[0] / cL * std::cos(lat), out[3] = v[1];
    };
    const Vec<Body> w{0.01, 0.02, 0.1};
    Block3<> C0;
    double r0[4];
    rates(C, v0, 0, w, f, C0, r0);
    const double step[12] = {1e-5, 1e-5, 1e-5, 1e-2, 1e-2, 10, 10, 1e-4, 1e-4, 1e-4, 1e-3, 1e-3};
    for (int j = 0; j < 12; ++j) {
      double out[2][7];
      for (int side = 0; side < 2; ++side) {
        const double e = (side ? -1 : 1) * step[j];
        Rot<Geographic, Body> c = C;
        double v[2] = {v0[0], v0[1]}, dn = 0;
        Vec<Body> wc = w, fc = f;
        if (j < 3)
          c = to_matrix(exp_rotation<Geographic, Geographic>(
                  Vec<Geographic>{j == 0 ? -e : 0, j == 1 ? -e : 0, j == 2 ? -e : 0})) *
              C;
        else if (j < 5)
          v[j - 3] += e;
        else if (j == 6)
          dn = e;
        else if (j >= 7 && j < 10)
          wc = wc + Vec<Body>{j == 7 ? e : 0, j == 8 ? e : 0, j == 9 ? e : 0};
        else if (j >= 10)
          fc = fc + Vec<Body>{j == 10 ? e : 0, j == 11 ? e : 0, 0};
        Block3<> C1;
        double r1[4];
        rates(c, v, dn, wc, fc, C1, r1);
        const Block3<> D = C1 * transpose(block_of(C)) + block_of(c) * transpose(C0);
        const double o[7] = {-0.5 * (D.m[2][1] - D.m[1][2]),
                             -0.5 * (D.m[0][2] - D.m[2][0]),
                             -0.5 * (D.m[1][0] - D.m[0][1]),
                             r1[0] - r0[0],
                             r1[1] - r0[1],
                             r1[2] - r0[2],
                             r1[3] - r0[3]};
        for (int i = 0; i < 7; ++i) out[side][i] = o[i];
      }
      for (int i = 0; i < 7; ++i) {
        const double difference = (out[0][i] - out[1][i]) / (2 * step[j]);
        EXPECT_NEAR(F.m[i][j], difference, 1e-5 * std::fabs(difference) + 2e-14 / step[j])
            << i << " " << j << " lat " << lat / deg;
      }
    }
  }
}

// (V-54): one step of dead reckoning with scale and angle errors, midpoint latitude held by a short
// step.
TEST(LevelErrors, DeadReckoningStepEqualsDifferences) {
  const Ellipsoid& ell = wgs84();
  const double lat = 0.8, se = 15, sn = -9;
  const double M = meridian_radius(ell, std::sin(lat));
  double column[4];
  const Matrix4 F = dead_reckoning_transition(ell, lat, se, sn, column);
  auto step = [&](double dn, double mu, double dk, double out[2]) {
    const double e = (1 + dk) * (se * std::cos(mu) + sn * std::sin(mu)),
                 n = (1 + dk) * (sn * std::cos(mu) - se * std::sin(mu));
    out[0] =
        e * std::cos(lat) / std::cos(lat + dn / M);  // metres with the scale of the true latitude
    out[1] = dn + n;
  };
  const double h[4] = {0, 1.0, 1e-5, 1e-5};
  for (int j = 1; j < 4; ++j) {
    double a[2], b[2];
    step(j == 1 ? h[1] : 0, j == 2 ? h[2] : 0, j == 3 ? h[3] : 0, a);
    step(j == 1 ? -h[1] : 0, j == 2 ? -h[2] : 0, j == 3 ? -h[3] : 0, b);
    for (int i = 0; i < 2; ++i) {
      const double difference = (a[i] - b[i]) / (2 * h[j]);
      EXPECT_NEAR(F.m[i][j], difference, 1e-7 * std::fabs(difference) + 1e-9) << i << j;
      if (j == 2) {
        EXPECT_NEAR(column[i], difference, 1e-7 * std::fabs(difference));
      }
    }
  }
}

}  // namespace
}  // namespace loxo
