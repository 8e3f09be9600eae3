// SPDX-License-Identifier: Apache-2.0
// A filter whose covariance crosses the pole (estimation.md section 5): mean NEES over many trials
// inside its band with the covariance switched by [EST-16], and the two matrices that look right
// and are wrong refused by the same test.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstdlib>
#include <random>
#include <vector>

#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/errors/level_errors.hpp"
#include "loxo/estimate/measurements.hpp"
#include "loxo/num/rotation_forms.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

constexpr double kDt = 0.2, kSpeed = 30.0;
const Vec<Ecef> kEarth{0, 0, 7.292115e-5};

struct Truth {
  std::vector<Quat<Ecef, Body>> q;
  std::vector<Vec<Ecef>> v;
  std::vector<Point<Ecef>> r;
  std::vector<Vec<Body>> rho, dvs;  // exact increments of the step that ends at i
};
Vec<Ecef> gravity_at(const Point<Ecef>& r) {
  const NormalHeight<double> p = to_normal(wgs84(), r);
  return p.n * (-normal_gravity(wgs84(), p.n.z, p.h));
}
// The mechanization: q' = exp(-w T) q exp(rho), velocity and position at mean velocity, gravity at
// mid-step.
void advance(Quat<Ecef, Body>& q, Vec<Ecef>& v, Point<Ecef>& r, const Vec<Body>& rho,
             const Vec<Body>& dvs) {
  const Vec<Ecef> c = to_matrix(q) * dvs, first = c - (0.5 * kDt) * cross(kEarth, c),
                  g = gravity_at(r + v * (0.5 * kDt));
  Vec<Ecef> v1 = v + first + kDt * (g - 2.0 * cross(kEarth, v));
  for (int i = 0; i < 2; ++i) v1 = v + first + kDt * (g - cross(kEarth, v + v1));
  q = normalized(exp_rotation<Ecef, Ecef>(kEarth * (-kDt)) * q * exp_rotation<Body, Body>(rho));
  r = r + (0.5 * kDt) * (v + v1);
  v = v1;
}
// A weave from 14 km before the pole to 14 km behind it, passing it at some hundred metres.
Truth make_truth() {
  Truth t;
  const double a = wgs84().a, b = wgs84().b;
  const int n = static_cast<int>(28000.0 / (kSpeed * 0.96) / kDt);
  Point<Ecef> r{-14000, 500, 0};
  r.z = b * std::sqrt(1 - (r.x * r.x + r.y * r.y) / (a * a));
  Vec<Ecef> last{};
  for (int i = 0; i <= n; ++i) {
    const double course = 0.35 * std::sin(2 * kPi * i * kDt / 60.0);
    auto velocity = [&](const Point<Ecef>& at) {
      Vec<Ecef> v{kSpeed * std::cos(course), kSpeed * std::sin(course), 0};
      v.z = -(b * b) / (a * a) * (at.x * v.x + at.y * v.y) / at.z;
      return v;
    };
    if (i > 0) {
      Vec<Ecef> v = velocity(r + last * kDt);
      r = r + (0.5 * kDt) * (last + v);
    }
    const Vec<Ecef> v = i > 0 ? velocity(r) : velocity(r);
    if (i > 0) r = t.r.back() + (0.5 * kDt) * (last + v);
    last = v;
    const NormalHeight<double> p = to_normal(wgs84(), r);
    const Vec<Ecef> f0 = v - dot(v, p.n) * p.n, f = f0 * (1 / norm(f0)), right = cross(f, p.n);
    Rot<Ecef, Body> C;
    const Vec<Ecef>* col[3] = {&right, &f, &p.n};
    for (int j = 0; j < 3; ++j) C.m[0][j] = col[j]->x, C.m[1][j] = col[j]->y, C.m[2][j] = col[j]->z;
    t.q.push_back(to_quaternion(C));
    t.v.push_back(v);
    t.r.push_back(r);
    if (i == 0) {
      t.rho.emplace_back();
      t.dvs.emplace_back();
      continue;
    }
    const auto& q0 = t.q[static_cast<std::size_t>(i) - 1];
    const Vec<Ecef>& v0 = t.v[static_cast<std::size_t>(i) - 1];
    const Point<Ecef>& r0 = t.r[static_cast<std::size_t>(i) - 1];
    t.rho.push_back(
        rotation_vector(conjugate(q0) * exp_rotation<Ecef, Ecef>(kEarth * kDt) * t.q.back()));
    const Vec<Ecef> first =
        v - v0 - kDt * (gravity_at(r0 + v0 * (0.5 * kDt)) - cross(kEarth, v0 + v));
    Vec<Ecef> c = first;
    for (int k = 0; k < 3; ++k) c = first + (0.5 * kDt) * cross(kEarth, c);
    t.dvs.push_back(transpose(to_matrix(q0)) * c);
  }
  return t;
}

enum class Switch { kRight, kVelocityRotatedOnly, kPureRotation };
using M9 = Eigen::Matrix<double, 9, 9>;
M9 dense(const Matrix9<double>& a) {
  M9 m;
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) m(i, j) = a.m[i][j];
  return m;
}
// P on ECEF axes through the classical states of frame a, the switch matrix, and back from frame c.
void switch_covariance(Covariance<15>& P, const Point<Ecef>& r, const Vec<Ecef>& v,
                       bool to_transverse, Switch kind) {
  const NormalHeight<double> p = to_normal(wgs84(), r);
  const LevelAxes<double> g = geographic_level_axes(wgs84(), p.n, p.h),
                          t = transverse_level_axes(wgs84(), p.n, p.h, 0.0);
  const LevelAxes<double>&a = to_transverse ? g : t, &c = to_transverse ? t : g;
  auto axes = [](const LevelAxes<double>& x) {
    M9 B = M9::Zero();
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) B(3 * k + i, 3 * k + j) = x.C_me.m[i][j];
    return B;
  };
  const Vec<Ecef> va = a.C_me * v, vc = c.C_me * v;
  const double pa[3] = {va.x, va.y, va.z}, pc[3] = {vc.x, vc.y, vc.z};
  const Matrix9<double> S = kind == Switch::kRight ? switch_classical(a, c, pa)
                            : kind == Switch::kVelocityRotatedOnly
                                ? switch_velocity_rotated_only(a, c, pa)
                                : switch_pure_rotation(a, c);
  const M9 A = axes(c).transpose() * dense(from_classical(c, pc)) * dense(S) *
               dense(to_classical(a, pa)) * axes(a);
  Eigen::Matrix<double, 15, 15> full = Eigen::Matrix<double, 15, 15>::Identity(), M;
  full.topLeftCorner<9, 9>() = A;
  for (int i = 0; i < 15; ++i)
    for (int j = 0; j < 15; ++j) M(i, j) = P.p[i][j];
  M = (full * M * full.transpose()).eval();
  for (int i = 0; i < 15; ++i)
    for (int j = 0; j < 15; ++j) P.p[i][j] = 0.5 * (M(i, j) + M(j, i));
}

struct Outcome {
  double inside = 0, worst = 0, before = 0, after = 0;
};
Outcome run(const Truth& truth, Switch kind, int trials, std::uint64_t seed) {
  const int n = static_cast<int>(truth.q.size()) - 1,
            every = static_cast<int>(std::lround(1 / kDt));
  const double s_psi = 0.2 * deg, s_v = 0.1, s_r = 100, s_bg = 0.1 * deg_per_h, s_ba = 100 * ug;
  const double ng = 0.01 * deg_per_sqrt_h, na = 0.01 * mps_per_sqrt_h;
  std::vector<double> sum(static_cast<std::size_t>(n / every + 1), 0.0);
  // What a trial keeps from its first to its last epoch (start errors, biases) is drawn with the
  // second moments of the whole sample made exactly P0's: else the mean over trials is off by the
  // same luck at all epochs together, and the share inside the band is one draw (62 to 99 % over
  // seeds) and not a mean.
  Eigen::MatrixXd kept(trials, 15);
  {
    std::mt19937_64 rng(seed);
    std::normal_distribution<double> g;
    for (int i = 0; i < trials; ++i)
      for (int j = 0; j < 15; ++j) kept(i, j) = g(rng);
    const Eigen::MatrixXd second = kept.transpose() * kept / trials;
    kept = second.llt().matrixL().solve(kept.transpose()).transpose().eval();
  }
  for (int trial = 0; trial < trials; ++trial) {
    std::mt19937_64 rng(seed + 7919u * static_cast<std::uint64_t>(trial));
    std::normal_distribution<double> g;
    auto three = [&](double s) { return Vec<Ecef>{s * g(rng), s * g(rng), s * g(rng)}; };
    NominalState s;
    auto drawn = [&](int at, double size) {
      return Vec<Ecef>{size * kept(trial, at), size * kept(trial, at + 1),
                       size * kept(trial, at + 2)};
    };
    const Vec<Body> bg = relabel<Body>(drawn(9, s_bg)), ba = relabel<Body>(drawn(12, s_ba));
    s.q = exp_rotation<Ecef, Ecef>(-drawn(0, s_psi)) * truth.q[0];
    s.v = truth.v[0] + drawn(3, s_v);
    s.r = truth.r[0] + drawn(6, s_r);
    Covariance<15> P;
    const double size[5] = {s_psi, s_v, s_r, s_bg, s_ba};
    for (int i = 0; i < 15; ++i) P.p[i][i] = size[i / 3] * size[i / 3];
    bool transverse = false;
    for (int i = 1; i <= n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      // Sensor: truth + bias + noise; the filter takes its bias out.
      const Vec<Body> dth =
          truth.rho[k] + bg * kDt + relabel<Body>(three(ng * std::sqrt(kDt))) - s.bg * kDt;
      const Vec<Body> dv =
          truth.dvs[k] + ba * kDt + relabel<Body>(three(na * std::sqrt(kDt))) - s.ba * kDt;
      ErrorPoint<Ecef> p;
      p.C_mb = to_matrix(exp_rotation<Ecef, Ecef>(kEarth * (-0.5 * kDt)) * s.q *
                         exp_rotation<Body, Body>(0.5 * dth));
      p.w_ie = kEarth;
      p.w = dth * (1 / kDt);
      p.f = dv * (1 / kDt);
      const NormalHeight<double> at = to_normal(wgs84(), s.r);
      p.gradient = gravity_gradient(wgs84(), at.n, at.h);
      predict(P, error_transition(p, kDt), error_noise(ng, na, kDt, p.C_mb * dv));
      advance(s.q, s.v, s.r, dth, dv);

      const double lat = std::asin(std::min(1.0, to_normal(wgs84(), s.r).n.z));
      if (!transverse && lat > 89.95 * deg) {
        switch_covariance(P, s.r, s.v, true, kind);
        transverse = true;
      } else if (transverse && lat < 89.94 * deg) {
        switch_covariance(P, s.r, s.v, false, kind);
        transverse = false;
      }
      if (i % every == 0) {
        MeasurementPoint m;
        m.C = to_matrix(s.q);
        m.v = s.v, m.r = s.r, m.w_ie = kEarth;
        double x[kStates]{};
        auto use = [&](const ScalarMeasurement& z, double value, double sigma) {
          Projection<15> a;
          project(P, z.row, a);
          double hx = 0;
          for (int j = 0; j < z.row.n; ++j) hx += z.row.value[j] * x[z.row.index[j]];
          update(P, x, a, value - z.h - hx, sigma * sigma, true);
        };
        const Vec<Body> vb = transpose(to_matrix(truth.q[k])) * truth.v[k];
        const double z[3] = {vb.x, vb.y, vb.z};
        for (int axis = 0; axis < 3; ++axis)
          use(body_velocity(m, Vec<Body>{}, axis), z[axis] + 0.1 * g(rng), 0.1);
        if (i % (120 * every) == 0)
          for (int axis = 0; axis < 3; ++axis) {
            const Vec<Ecef> d{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
            use(position_along(m, Vec<Body>{}, d, truth.r[k]), 10 * g(rng), 10);
          }
        feed_back(s, x);
        // [EST-1]: error = computed - true, attitude from C~ C^T.
        const Rot<Ecef, Ecef> D = to_matrix(s.q) * transpose(to_matrix(truth.q[k]));
        Eigen::Matrix<double, 15, 1> e;
        e << -0.5 * (D.m[2][1] - D.m[1][2]), -0.5 * (D.m[0][2] - D.m[2][0]),
            -0.5 * (D.m[1][0] - D.m[0][1]), s.v.x - truth.v[k].x, s.v.y - truth.v[k].y,
            s.v.z - truth.v[k].z, s.r.x - truth.r[k].x, s.r.y - truth.r[k].y, s.r.z - truth.r[k].z,
            bg.x - s.bg.x, bg.y - s.bg.y, bg.z - s.bg.z, ba.x - s.ba.x, ba.y - s.ba.y,
            ba.z - s.ba.z;
        Eigen::Matrix<double, 15, 15> M;
        for (int a = 0; a < 15; ++a)
          for (int b = 0; b < 15; ++b) M(a, b) = P.p[a][b];
        // Scaled first: sizes from 1e-7 to 1e2.
        Eigen::Matrix<double, 15, 1> d = M.diagonal().cwiseSqrt().cwiseInverse();
        M = (d.asDiagonal() * M * d.asDiagonal()).eval();
        e = (d.array() * e.array()).matrix();
        sum[static_cast<std::size_t>(i / every)] += e.dot(M.ldlt().solve(e));
      }
    }
  }
  // chi2 of 15 M degrees: normal to 1e-3 for M >= 40 (Wilson-Hilferty).
  const double dof = 15.0 * trials;
  auto quantile = [&](double z) {
    const double c = 1 - 2 / (9 * dof) + z * std::sqrt(2 / (9 * dof));
    return dof * c * c * c / trials;
  };
  const double low = quantile(-1.959963984540054), high = quantile(1.959963984540054);
  Outcome o;
  int inside = 0, count = 0;
  for (std::size_t i = 1; i < sum.size(); ++i) {
    const double mean = sum[i] / trials;
    inside += mean > low && mean < high;
    ++count;
    o.worst = std::max(o.worst, mean);
  }
  o.inside = static_cast<double>(inside) / count;
  return o;
}

TEST(PolarConsistency, CovarianceSurvivesTheSwitchAndWrongMatricesDoNot) {
  const bool all = std::getenv("LOXO_LONG") != nullptr;
  const int trials = all ? 200 : 60;
  // A run's errors last from epoch to epoch, so the share inside scatters from campaign to campaign
  // however true the covariance is: 24 seeds of 60 trials gave 97.7 % in the mean, three of them
  // less than 95 and one 76. The gate stands on a seed that is written down.
  const std::uint64_t seed = testing::seed(1);
  const Truth truth = make_truth();
  double nearest = 1e9;
  for (const auto& r : truth.r) nearest = std::min(nearest, std::hypot(r.x, r.y));
  std::printf("passes the pole at %.0f m\n", nearest);
  EXPECT_LT(nearest, 1000);
  const Outcome right = run(truth, Switch::kRight, trials, seed);
  std::printf("EST-16: %.1f %% of epochs inside, worst mean %.2f\n", 100 * right.inside,
              right.worst);
  EXPECT_GE(right.inside, 0.93);
  for (Switch kind : {Switch::kVelocityRotatedOnly, Switch::kPureRotation}) {
    const Outcome wrong = run(truth, kind, trials, seed);
    std::printf("wrong: %.1f %% inside, worst mean %.1f\n", 100 * wrong.inside, wrong.worst);
    EXPECT_LT(wrong.inside, 0.93);  // the same gate
    EXPECT_GT(wrong.worst, 25.0);
  }
}

}  // namespace
}  // namespace loxo
