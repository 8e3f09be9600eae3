// SPDX-License-Identifier: Apache-2.0
// The filter's arithmetic: prediction and update, beside a dense product of the same size in the
// same run.
#include <benchmark/benchmark.h>

#include <memory>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/estimate/smoother.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

ErrorPoint<Ecef> moving_point() {
  ErrorPoint<Ecef> p;
  p.C_mb = to_matrix(exp_rotation<Ecef, Body>(Vec<Body>{0.3, -0.4, 1.0}));
  p.v = {10, 5, 2};
  p.w_ie = {0, 0, 7.292115e-5};
  p.w = {0.01, 0.02, 0.1};
  p.f = {0.3, 0.2, 9.8};
  p.gradient = 1.5e-6 * identity3<double>();
  return p;
}
template <int N>
void fill(Covariance<N>& P) {
  for (int i = 0; i < N; ++i) P.p[i][i] = 1e-4;
}

template <int N>
void BM_Predict(benchmark::State& state) {
  Covariance<N> P;
  fill(P);
  ErrorPoint<Ecef> p = moving_point();
  AccumulatorTransition<double> a;
  for (auto _ : state) {
    benchmark::DoNotOptimize(p);
    const ErrorTransition<double> t = error_transition(p, 0.01);
    const ErrorNoise<double> q = error_noise(1e-5, 1e-3, 0.01, p.v * 0.01);
    predict(P, t, q, N > 21 ? &a : nullptr);
    benchmark::DoNotOptimize(P);
  }
}
BENCHMARK(BM_Predict<15>);
BENCHMARK(BM_Predict<21>);
BENCHMARK(BM_Predict<kStates>);

// Three scalar Joseph updates: a velocity.
template <int N>
void BM_Update3(benchmark::State& state) {
  Covariance<N> P;
  double x[N]{};
  fill(P);
  for (auto _ : state) {
    for (int i = 0; i < 3; ++i) {
      SparseRow<double> h;
      h.add3(kPsi, Vec<Ecef>{1, 2, 3});
      h.add3(kDv, Vec<Ecef>{0.5, 0.3, 0.2});
      h.add3(kBg, Vec<Ecef>{0.5, 0.3, 0.2});
      Projection<N> a;
      project(P, h, a);
      update(P, x, a, 0.01, 1e-2, true);
    }
    benchmark::DoNotOptimize(P);
  }
}
BENCHMARK(BM_Update3<15>);
BENCHMARK(BM_Update3<21>);
BENCHMARK(BM_Update3<kStates>);

// The same size without structure, for the ratio: F P F^T + Q with plain loops.
template <int N>
void BM_DensePredict(benchmark::State& state) {
  static double F[N][N], P[N][N], Y[N][N], out[N][N];
  for (int i = 0; i < N; ++i) F[i][i] = P[i][i] = 1;
  for (auto _ : state) {
    for (int i = 0; i < N; ++i)
      for (int j = 0; j < N; ++j) {
        double s = 0;
        for (int k = 0; k < N; ++k) s += F[i][k] * P[k][j];
        Y[i][j] = s;
      }
    for (int i = 0; i < N; ++i)
      for (int j = 0; j < N; ++j) {
        double s = 0;
        for (int k = 0; k < N; ++k) s += Y[i][k] * F[j][k];
        out[i][j] = s;
      }
    benchmark::DoNotOptimize(out);
  }
}
BENCHMARK(BM_DensePredict<21>);

// A cycle of the joint filter: strapdown, prediction of 32 states at every sample, constraint and
// odometer at 1 Hz. Argument 1: with the tape; 2: with the 11 extra states; 3: remembering two
// seconds for late measurements; 4: and a fix every second that comes a second late.
void BM_NavigatorSample(benchmark::State& state) {
  NavigatorConfig c;
  c.ellipsoid = wgs84();
  c.gyro_noise = 1e-5, c.accel_noise = 1e-3, c.gyro_bias = 1e-6, c.accel_bias = 1e-3;
  c.standstill.sigma_w = 1e-4, c.standstill.sigma_f = 1e-2;
  c.nhc_epoch = 0.1;
  const auto kind = state.range(0);
  c.late_limit = kind >= 3 ? 2.0 : 0.0;
  if (kind == 2)
    c.fix_lever_std = c.height_bias_std = 1, c.heading_bias_std = c.gyro_misalignment = 1e-3;
  auto nav = std::make_unique<Navigator>(c);
  auto tape = kind == 1 ? std::make_unique<SmootherTape>() : nullptr;
  nav->set_tape(tape.get());
  NavigatorStart s;
  const Geodetic<double> at{0.8, 0.1, 100};
  s.state.r = to_ecef(wgs84(), at);
  const Rot<Geographic, Ecef> C = geographic_axes(at.lat, at.lon);
  s.state.q = to_quaternion(transpose(C) * to_matrix<Geographic>(Euler<double>{0, 0, 0}));
  s.state.v = transpose(C) * Vec<Geographic>{0, 10, 0};
  for (int i = 0; i < kStates; ++i) s.P.p[i][i] = 1e-4;
  nav->start(s);
  ImuIncrement<double> u;
  u.dt = 0.01;
  u.dv = {0, 0, 0.0981};
  int n = 0;
  for (auto _ : state) {
    u.t += 0.01;
    if (++n % 10 == 0) nav->odometer({u.t, 1.0, false});
    if (kind == 4 && n % 100 == 0 && n > 200) {
      Fix f;
      f.t = u.t - 1.0, f.lat = at.lat + 1.57e-6 * f.t, f.lon = at.lon, f.std_e = f.std_n = 100;
      nav->fix(f);
    }
    nav->imu(u);
  }
  benchmark::DoNotOptimize(nav->state());
}
BENCHMARK(BM_NavigatorSample)->DenseRange(0, 4)->Iterations(360000);

}  // namespace
}  // namespace loxo
