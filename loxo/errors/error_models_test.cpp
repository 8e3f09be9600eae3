// SPDX-License-Identifier: Apache-2.0
// F and G of the 9-, 12-, 15- and 21-state models in every frame against differences of that
// frame's own non-linear mechanization (polar.md 3.1), on sphere and ellipsoid, in every regime; T
// of [EST-2] for all five latitudes and the wander frame; [EST-4] and [EST-5] at three steps.
#include "loxo/errors/error_models.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <functional>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/errors/level_errors.hpp"
#include "loxo/num/rotation_forms.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

// A mechanization of a level frame: its axes are part of the state.
struct LevelMotion {
  Block3<> C_me, C_mb;
  Vec<Ecef> v;  // components on the frame's axes
  Vec<Ecef> n;
  double h = 0;
};
using AxesOf = std::function<LevelAxes<double>(const Vec<Ecef>& n, double h)>;

// Rates of attitude and velocity in ECEF that the level mechanization implies.
struct EcefRates {
  Block3<> C;       // C_b^e
  Block3<> C_rate;  // its rate
  Vec<Ecef> v, v_rate;
};
EcefRates mechanized(const Ellipsoid& ell, const LevelMotion& x, const LevelAxes<double>& axes,
                     const Vec<Body>& w, const Vec<Body>& f) {
  double t[3];
  level_transport(axes, x.v.x, x.v.y, t);
  const Vec<Ecef> w_em{t[0], t[1], t[2]}, w_ie = x.C_me * Vec<Ecef>{0, 0, ell.w_ie};
  // polar.md 3.1
  const Vec<Ecef> v_rate = x.C_mb * relabel<Ecef>(f) - cross(2.0 * w_ie + w_em, x.v) +
                           Vec<Ecef>{0, 0, -normal_gravity(ell, x.n.z, x.h)};
  const Block3<> C_rate = x.C_mb * skew(w) - skew(w_ie + w_em) * x.C_mb;
  const Block3<> turn = (-1.0) * (skew(w_em) * x.C_me);
  const Block3<> back = transpose(x.C_me);
  EcefRates r;
  r.C = back * x.C_mb;
  r.C_rate = transpose(turn) * x.C_mb + back * C_rate;
  r.v = back * x.v;
  r.v_rate = transpose(turn) * x.v + back * v_rate;
  return r;
}

struct Scene {
  Point<Ecef> r;
  Vec<Ecef> v;
  Rot<Ecef, Body> C;
  Vec<Body> w, f;
};
struct Place {
  double lat, lon;
};
const Place kPlaces[] = {{0.0, 0.1},
                         {45 * deg, -60 * deg},
                         {80 * deg, 179.999 * deg},
                         {89.9 * deg, 10 * deg},
                         {90 * deg, 30 * deg},
                         {-60 * deg, -179.999 * deg},
                         {-89.99 * deg, 5 * deg}};
enum class Regime { kRest, kTurning, kClimbing, kTiny, kRandom };
const Regime kRegimes[] = {Regime::kRest, Regime::kTurning, Regime::kClimbing, Regime::kTiny,
                           Regime::kRandom};

Scene scene_at(const Ellipsoid& ell, const Place& p, Regime regime, std::mt19937& rng) {
  std::uniform_real_distribution<double> u(-1, 1);
  const Rot<Geographic, Ecef> C = geographic_axes(p.lat, p.lon);
  Scene s;
  s.r = to_ecef(ell, Geodetic<double>{p.lat, p.lon, 300.0 * u(rng)});
  const auto attitude = Euler<double>{3 * u(rng), 0.2 * u(rng), 0.2 * u(rng)};
  s.C = transpose(C) * to_matrix<Geographic>(attitude);
  const Vec<Ecef> w_ie{0, 0, ell.w_ie}, up = transpose(C) * Vec<Geographic>{0, 0, 9.8};
  Vec<Geographic> v{};
  Vec<Body> turn{};
  if (regime == Regime::kTurning) v = {20 * u(rng), 20 * u(rng), 0}, turn = {0, 0, 0.5};
  if (regime == Regime::kClimbing) v = {10 * u(rng), 10 * u(rng), 5}, turn = {0.1, 0, 0};
  if (regime == Regime::kTiny) v = {1e-6 * u(rng), 1e-6 * u(rng), 1e-7}, turn = {1e-7, 0, 1e-6};
  if (regime == Regime::kRandom)
    v = {30 * u(rng), 30 * u(rng), 10 * u(rng)}, turn = {0.5 * u(rng), 0.5 * u(rng), 0.5 * u(rng)};
  s.v = transpose(C) * v;
  s.w = transpose(s.C) * w_ie + turn;
  s.f = transpose(s.C) * up;
  if (regime == Regime::kRandom) s.f = s.f + Vec<Body>{5 * u(rng), 5 * u(rng), 5 * u(rng)};
  return s;
}

// psi, dv, dr of `c` against `t` and their rates on ECEF axes. [EST-1]
void error_rates_between(const EcefRates& c, const EcefRates& t, double out[9]) {
  const Block3<> d = c.C_rate * transpose(t.C) + c.C * transpose(t.C_rate);
  out[0] = -0.5 * (d.m[2][1] - d.m[1][2]);
  out[1] = -0.5 * (d.m[0][2] - d.m[2][0]);
  out[2] = -0.5 * (d.m[1][0] - d.m[0][1]);
  const Vec<Ecef> dv = c.v_rate - t.v_rate, dr = c.v - t.v;
  out[3] = dv.x, out[4] = dv.y, out[5] = dv.z;
  out[6] = dr.x, out[7] = dr.y, out[8] = dr.z;
}

template <int N, class M>
void check_frame(const Ellipsoid& ell, const Scene& s, const AxesOf& axes_of, const char* name) {
  const NormalHeight<double> at = to_normal(ell, s.r);
  const LevelAxes<double> axes = axes_of(at.n, at.h);
  const auto level = [&](const Point<Ecef>& r, const Vec<Ecef>& v, const Rot<Ecef, Body>& C,
                         const Vec<Body>& w, const Vec<Body>& f) {
    const NormalHeight<double> q = to_normal(ell, r);
    const LevelAxes<double> a = axes_of(q.n, q.h);
    LevelMotion m;
    m.C_me = a.C_me, m.C_mb = a.C_me * block_of(C), m.v = a.C_me * v, m.n = q.n, m.h = q.h;
    return mechanized(ell, m, a, w, f);
  };
  ErrorPoint<M> p;
  const Block3<> C_mb = axes.C_me * block_of(s.C);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) p.C_mb.m[i][j] = C_mb.m[i][j];
  p.v = relabel<M>(axes.C_me * s.v);
  p.w_ie = relabel<M>(axes.C_me * Vec<Ecef>{0, 0, ell.w_ie});
  double t[3];
  level_transport(axes, p.v.x, p.v.y, t);
  p.w_em = {t[0], t[1], t[2]};
  p.w = s.w, p.f = s.f;
  p.gradient = axes.C_me * gravity_gradient(ell, at.n, at.h) * transpose(axes.C_me);
  const ErrorModel<N> model = error_model<N>(p, {1000, 500});

  const EcefRates nominal = level(s.r, s.v, s.C, s.w, s.f);
  const double step[7] = {1e-5, 1e-2, 100.0, 1e-4, 1e-3, 1e-4, 1e-4};
  for (int j = 0; j < N; ++j) {
    double out[2][9];
    for (int side = 0; side < 2; ++side) {
      const double e = (side ? -1 : 1) * step[j / 3];
      Vec<Ecef> d{};
      (j % 3 == 0 ? d.x : j % 3 == 1 ? d.y : d.z) = e;
      const Vec<Ecef> de = transpose(axes.C_me) * d;
      const Vec<Body> db = relabel<Body>(d);
      Scene c = s;
      switch (j / 3) {
        case 0:
          c.C = to_matrix(exp_rotation<Ecef, Ecef>(-de)) * s.C;
          break;
        case 1:
          c.v = s.v + de;
          break;
        case 2:
          c.r = s.r + de;
          break;
        case 3:
          c.w = s.w + db;
          break;
        case 4:
          c.f = s.f + db;
          break;
        case 5:
          c.w = {s.w.x * (1 + db.x), s.w.y * (1 + db.y), s.w.z * (1 + db.z)};
          break;
        default:
          c.f = {s.f.x * (1 + db.x), s.f.y * (1 + db.y), s.f.z * (1 + db.z)};
      }
      double rate[9];
      error_rates_between(level(c.r, c.v, c.C, c.w, c.f), nominal, rate);
      for (int k = 0; k < 3; ++k) {
        const Vec<Ecef> m = axes.C_me * Vec<Ecef>{rate[3 * k], rate[3 * k + 1], rate[3 * k + 2]};
        out[side][3 * k] = m.x, out[side][3 * k + 1] = m.y, out[side][3 * k + 2] = m.z;
      }
      // d/dt (C_me x) = C_me x' - w_em x (C_me x)
      if (j < 9) {
        const Vec<Ecef> more = -cross(relabel<Ecef>(p.w_em), d);
        out[side][j / 3 * 3] += more.x, out[side][j / 3 * 3 + 1] += more.y;
        out[side][j / 3 * 3 + 2] += more.z;
      }
    }
    for (int i = 0; i < 9; ++i) {
      const double difference = (out[0][i] - out[1][i]) / (2 * step[j / 3]);
      // Rounding of rates of order 10 (v times transport near a pole), and truncation.
      const double tolerance = 1e-5 * std::fabs(difference) +
                               (4e-14 + 1e-14 * std::fabs(t[2] / ell.w_ie)) / step[j / 3] +
                               1e-12 * step[j / 3] * step[j / 3];
      EXPECT_NEAR(model.f[i][j], difference, tolerance)
          << name << " row " << i << " column " << j << " states " << N;
      // G by the same differences: what a sensor reads too much.
      if (j >= 9 && j < 15) {
        EXPECT_NEAR(model.g[i][j - 9], difference, tolerance) << i << j;
      }
    }
  }
  for (int i = 9; i < N; ++i)
    for (int j = 0; j < N; ++j)
      EXPECT_EQ(model.f[i][j], i != j || i >= 15 ? 0.0 : i < 12 ? -1e-3 : -2e-3);
  for (int i = 9; i < N; ++i)
    for (int j = 0; j < kErrorInputs; ++j)
      EXPECT_EQ(model.g[i][j], i < 15 && j == i - 3 ? 1.0 : 0.0);
}

// The wander axes at a neighbouring place: carried there without a turn about up.
AxesOf wander_near(const Ellipsoid& ell, const Vec<Ecef>& n0) {
  const Vec<Ecef> any = std::fabs(n0.z) < 0.9 ? Vec<Ecef>{0, 0, 1} : Vec<Ecef>{1, 0, 0};
  const Vec<Ecef> e0 = cross(any, n0), e = e0 * (1 / norm(e0));
  const Vec<Ecef> east = 0.8 * e + 0.6 * cross(n0, e);  // some azimuth
  return [=, &ell](const Vec<Ecef>& n, double h) {
    // The least rotation from n0 to n.
    const Vec<Ecef> k = cross(n0, n);
    const double c = dot(n0, n);
    const auto carried = [&](const Vec<Ecef>& a) {
      return a + cross(k, a) + cross(k, cross(k, a)) * (1 / (1 + c));
    };
    const Vec<Ecef> x = carried(east), y = cross(n, x);
    return wander_level_axes(ell, n, h, from_axes<Wander>(x, y, n));
  };
}

// Level axes of every frame about a place of normal n0.
std::vector<std::pair<const char*, AxesOf>> frames_near(const Ellipsoid& ell, const Vec<Ecef>& n0) {
  const Ellipsoid* e = &ell;
  return {
      {"geographic", [e](const Vec<Ecef>& n, double h) { return geographic_level_axes(*e, n, h); }},
      {"transverse",
       [e](const Vec<Ecef>& n, double h) { return transverse_level_axes(*e, n, h, 0.3); }},
      {"grid", [e](const Vec<Ecef>& n, double h) { return grid_level_axes(*e, n, h, 0.3); }},
      {"wander", wander_near(ell, n0)}};
}

TEST(ErrorModels, EveryFrameEqualsDifferencesOfItsMechanization) {  // [EST-3]
  std::mt19937 rng(testing::seed());
  const Ellipsoid sphere = make_sphere(6371000);
  for (const Ellipsoid* ell : {&wgs84(), &sphere}) {
    for (const Place& place : kPlaces)
      for (const Regime regime : kRegimes) {
        const Scene s = scene_at(*ell, place, regime, rng);
        const NormalHeight<double> q = to_normal(*ell, s.r);
        const auto frames = frames_near(*ell, q.n);
        const AxesOf &geographic = frames[0].second, &transverse = frames[1].second,
                     &grid = frames[2].second, &wander = frames[3].second;
        // Geographic axes turn by 100 m / (6 km) at 89.94 deg: their differences end before.
        if (std::fabs(place.lat) < 89 * deg) {
          check_frame<9, Geographic>(*ell, s, geographic, "geographic");
          check_frame<21, Geographic>(*ell, s, geographic, "geographic");
        }
        check_frame<12, Transverse>(*ell, s, transverse, "transverse");
        check_frame<21, Transverse>(*ell, s, transverse, "transverse");
        check_frame<15, Grid>(*ell, s, grid, "grid");
        check_frame<21, Grid>(*ell, s, grid, "grid");
        check_frame<9, Wander>(*ell, s, wander, "wander");
        check_frame<21, Wander>(*ell, s, wander, "wander");
      }
  }
}

// The transport rate is the turn of the axes along the way: C_me' = -[w_em] C_me. polar.md 2.4
TEST(ErrorModels, TransportRateIsTheTurnOfTheAxes) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid& ell = wgs84();
  for (const Place& place : kPlaces) {
    const Scene s = scene_at(ell, place, Regime::kRandom, rng);
    const NormalHeight<double> q = to_normal(ell, s.r);
    for (const auto& [name, axes_of] : frames_near(ell, q.n)) {
      const bool geographic = name[0] == 'g' && name[1] == 'e';
      if (geographic && std::fabs(place.lat) > 89 * deg) continue;
      const LevelAxes<double> a = axes_of(q.n, q.h);
      const Vec<Ecef> v = a.C_me * s.v;
      double w[3];
      level_transport(a, v.x, v.y, w);
      const AxesOf& of = axes_of;
      const double dt = 0.1;  // some metres
      const auto at = [&](double t) {
        const NormalHeight<double> n = to_normal(ell, s.r + s.v * t);
        return of(n.n, n.h).C_me;
      };
      const Block3<> rate = (0.5 / dt) * (at(dt) - at(-dt)),
                     expected = (-1.0) * (skew(Vec<Ecef>{w[0], w[1], w[2]}) * a.C_me);
      // 1e-15 of rounded positions over dt, and the square of the turn (5e-6 tan L)^2.
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) EXPECT_NEAR(rate.m[i][j], expected.m[i][j], 2e-14) << name;
    }
  }
}

// [EST-2] at five latitudes in each frame, the wander frame too (th_U = 0: carried without a turn).
TEST(ErrorModels, ClassicalErrorsAtFiveLatitudes) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid& ell = wgs84();
  for (const double lat : {0.3 * deg, 45 * deg, 80 * deg, 89 * deg, 89.99 * deg}) {
    const Scene s = scene_at(ell, {lat, 40 * deg}, Regime::kRandom, rng);
    const NormalHeight<double> q = to_normal(ell, s.r);
    for (const auto& [name, axes_of] : frames_near(ell, q.n)) {
      const LevelAxes<double> a = axes_of(q.n, q.h);
      const Vec<Ecef> v_m = a.C_me * s.v;
      const double v[3] = {v_m.x, v_m.y, v_m.z};
      const Matrix9<double> T = to_classical(a, v);
      const Block3<> C_mb = a.C_me * block_of(s.C);
      // A displacement that turns geographic axes by a thousandth of a radian at most.
      const double far = std::min(20.0, 1e-3 * 6.37e6 / std::tan(lat));
      const double step[3] = {1e-5, 1e-2, far};
      for (int j = 0; j < 9; ++j) {
        double out[2][6];
        for (int side = 0; side < 2; ++side) {
          Vec<Ecef> d{};
          (j % 3 == 0 ? d.x : j % 3 == 1 ? d.y : d.z) = (side ? -1 : 1) * step[j / 3];
          const Vec<Ecef> de = transpose(a.C_me) * d;
          Scene c = s;
          if (j < 3) c.C = to_matrix(exp_rotation<Ecef, Ecef>(-de)) * s.C;
          if (j >= 3 && j < 6) c.v = s.v + de;
          if (j >= 6) c.r = s.r + de;
          const NormalHeight<double> qc = to_normal(ell, c.r);
          const LevelAxes<double> ac = axes_of(qc.n, qc.h);
          const Block3<> D = ac.C_me * block_of(c.C) * transpose(C_mb);
          const Vec<Ecef> dv = ac.C_me * c.v - v_m;
          const double o[6] = {-0.5 * (D.m[2][1] - D.m[1][2]),
                               -0.5 * (D.m[0][2] - D.m[2][0]),
                               -0.5 * (D.m[1][0] - D.m[0][1]),
                               dv.x,
                               dv.y,
                               dv.z};
          std::copy_n(o, 6, out[side]);
        }
        const double turn = std::max(far * std::tan(lat) / 6.37e6, far / 6.37e6);
        for (int i = 0; i < 6; ++i) {
          const double difference = (out[0][i] - out[1][i]) / (2 * step[j / 3]);
          // Third order in the turn of the axes; ECEF positions are rounded to 1e-9 m.
          const double size = i < 3 ? turn : turn * norm(s.v);
          const double tolerance = j >= 6 ? size * (turn * turn + 1e-8) / far
                                          : 1e-9 * std::fabs(difference) + 3e-14 / step[j / 3];
          EXPECT_NEAR(T.m[i][j], difference, tolerance)
              << name << " row " << i << " column " << j << " lat " << lat / deg;
        }
      }
    }
  }
}

Eigen::MatrixXd dense(const ErrorTransition<double>& t) {
  Eigen::MatrixXd B = Eigen::MatrixXd::Identity(21, 21);
  const auto put = [&](int i, int j, const Block3<>& b) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) B(i + r, j + c) = b.m[r][c];
  };
  put(0, 0, t.psi_psi), put(0, 9, t.psi_bg), put(0, 15, t.psi_sg);
  put(3, 0, t.dv_psi), put(3, 3, t.dv_dv), put(3, 6, t.dv_dr), put(3, 9, t.dv_bg);
  put(3, 12, t.dv_ba), put(3, 15, t.dv_sg), put(3, 18, t.dv_sa);
  put(6, 0, t.dr_psi), put(6, 3, t.dt * identity3<double>()), put(6, 6, t.dr_dr);
  put(6, 12, t.dr_ba), put(6, 18, t.dr_sa);
  return B;
}
ErrorPoint<Ecef> ecef_point(const Ellipsoid& ell, const Scene& s) {
  const NormalHeight<double> q = to_normal(ell, s.r);
  return {s.C, s.v, {0, 0, ell.w_ie}, {}, s.w, s.f, gravity_gradient(ell, q.n, q.h)};
}

// [EST-4] against the matrix exponential of F, scaled by typical sizes of the states, at rest and
// climbing: the specification names 1e-9, 1e-7 and 1.5e-5.
TEST(ErrorModels, TransitionsAtThreeSteps) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid& ell = wgs84();
  const double size[7] = {1e-3, 0.1, 10, 1e-5, 1e-2, 1e-4, 1e-4};
  double worst[3]{};
  for (const Place& place : kPlaces)
    for (const Regime regime : {Regime::kRest, Regime::kTiny, Regime::kClimbing}) {
      const ErrorPoint<Ecef> p = ecef_point(ell, scene_at(ell, place, regime, rng));
      const ErrorModel<21> m = error_model<21>(p);
      Eigen::MatrixXd A(21, 21);
      for (int i = 0; i < 21; ++i)
        for (int j = 0; j < 21; ++j) A(i, j) = m.f[i][j];
      const double steps[3] = {0.01, 0.1, 1.0};
      for (int k = 0; k < 3; ++k) {
        const Eigen::MatrixXd exact = (A * steps[k]).exp(),
                              ours = dense(error_transition(p, steps[k]));
        for (int i = 0; i < 9; ++i)
          for (int j = 0; j < 21; ++j)
            worst[k] =
                std::max(worst[k], std::fabs(ours(i, j) - exact(i, j)) * size[j / 3] / size[i / 3]);
      }
    }
  std::printf("worst scaled: %.2g at 0.01 s, %.2g at 0.1 s, %.2g at 1 s\n", worst[0], worst[1],
              worst[2]);
  EXPECT_LT(worst[0], 1.5e-9);
  EXPECT_LT(worst[1], 1.5e-7);
  EXPECT_LT(worst[2], 1.5e-5);
}

// [EST-5] against Van Loan at three steps; at 1 s the term (T/3) N_g^2 [dv][dv]^T that it names.
TEST(ErrorModels, NoiseAtThreeSteps) {
  std::mt19937 rng(testing::seed());
  const Ellipsoid& ell = wgs84();
  const double ng = 0.1 * deg_per_sqrt_h, na = 0.05 * mps_per_sqrt_h;
  for (const Place& place : kPlaces) {
    const ErrorPoint<Ecef> p = ecef_point(ell, scene_at(ell, place, Regime::kRest, rng));
    const ErrorModel<9> m = error_model<9>(p);
    Eigen::MatrixXd A(9, 9), G(9, 6);
    for (int i = 0; i < 9; ++i) {
      for (int j = 0; j < 9; ++j) A(i, j) = m.f[i][j];
      for (int j = 0; j < 6; ++j) G(i, j) = m.g[i][j] * (j < 3 ? ng : na);
    }
    for (const double dt : {0.01, 0.1, 1.0}) {
      Eigen::MatrixXd V = Eigen::MatrixXd::Zero(18, 18);
      V.topLeftCorner(9, 9) = -A, V.topRightCorner(9, 9) = G * G.transpose();
      V.bottomRightCorner(9, 9) = A.transpose();
      const Eigen::MatrixXd E = (V * dt).exp();
      const Eigen::MatrixXd Q = E.bottomRightCorner(9, 9).transpose() * E.topRightCorner(9, 9);
      const Vec<Ecef> dv = (p.C_mb * p.f) * dt;
      const ErrorNoise<double> q = error_noise(ng, na, dt, dv);
      const Block3<> S = skew(dv), extra = (dt / 3 * ng * ng) * (S * transpose(S));
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const double one = i == j;
          EXPECT_NEAR(q.psi * one / q.psi, Q(i, j) / q.psi, 3e-4 * dt) << dt;
          // The rest after the named term: dt times the Earth's rate.
          EXPECT_NEAR((q.dv * one + extra.m[i][j]) / q.dv, Q(3 + i, 3 + j) / q.dv, 4e-4 * dt) << dt;
          EXPECT_NEAR(q.dv_psi.m[i][j], Q(3 + i, j), 3e-4 * dt * std::sqrt(q.psi * q.dv) + 1e-30);
          // 1e-4 at 0.1 s, with the square of the step: the gyros' noise in the position.
          EXPECT_NEAR(q.dr * one / q.dr, Q(6 + i, 6 + j) / q.dr, 3e-2 * dt * dt + 3e-4 * dt) << dt;
          EXPECT_NEAR(q.dr_dv * one / q.dr_dv, Q(6 + i, 3 + j) / q.dr_dv,
                      5e-2 * dt * dt + 4e-4 * dt);
        }
    }
  }
}

}  // namespace
}  // namespace loxo
