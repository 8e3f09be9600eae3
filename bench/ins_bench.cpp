// SPDX-License-Identifier: Apache-2.0
// One two-sample strapdown step in every frame, in double and in eight lanes, each waiting for the
// last; twelve normals, the noise of a step; beside a plain loop as text books write it, timed in
// the same run.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>

#include "loxo/ins/strapdown.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"

namespace {
using namespace loxo;

constexpr int kSamples = 64;  // different samples, in turn
constexpr double kInterval = 0.005;

template <Real S>
std::array<ImuIncrement<S>, kSamples> samples() {
  std::array<ImuIncrement<S>, kSamples> out;
  for (int i = 0; i < kSamples; ++i) {
    const double a = 0.1 * i;
    auto& s = out[static_cast<std::size_t>(i)];
    s.t = kInterval * (i + 1), s.dt = kInterval;
    s.dtheta = {S(1e-4 * std::sin(a)), S(2e-4 * std::cos(a)), S(1e-4 * std::sin(2 * a))};
    s.dv = {S(1e-3 * std::cos(a)), S(1e-3 * std::sin(a)), S(9.82 * kInterval)};
  }
  return out;
}
template <Real S>
EcefState<S> start() {
  const double l = 50 * deg;
  EcefState<S> e;
  e.r = {S(6.39e6 * std::cos(l)), S(1e5), S(6.35e6 * std::sin(l))};
  e.v = {S(3), S(10), S(4)};
  e.q_eb = normalized(Quat<Ecef, Body, S>{S(0.8), S(0.1), S(0.3), S(0.5)});
  return e;
}

template <class M, class S>
void two_sample_step(benchmark::State& state) {
  const auto earth = make_earth_model(wgs84());
  const auto imu = samples<S>();
  auto x = M::from_ecef(earth, start<S>());
  for (auto _ : state) {
    for (std::size_t i = 0; i < kSamples; i += 2) {
      x = step(earth, x, two_samples(imu[i], imu[i + 1]));
      x = constrained(x, S(100.0), S(0.0));
    }
    benchmark::DoNotOptimize(x);
  }
  state.counters["per_step"] = benchmark::Counter(
      kSamples / 2 * ScalarTraits<S>::kLanes,
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
#define FRAME(M)                                             \
  BENCHMARK(two_sample_step<M, double>)->Name("double/" #M); \
  BENCHMARK(two_sample_step<M, Lanes>)->Name("eight_lanes/" #M)
FRAME(GeographicMechanization);
FRAME(TransverseMechanization);
FRAME(VirtualSphereMechanization);
FRAME(GridMechanization);
FRAME(WanderMechanization);
FRAME(EcefMechanization);

// The reference: the geographic frame with matrices, latitude and longitude as angles, libm and no
// cleverness.
struct Plain {
  double c[3][3], v[3], lat, lon, h;
};
void product(const double a[3][3], const double b[3][3], double out[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      out[i][j] = 0;
      for (int k = 0; k < 3; ++k) out[i][j] += a[i][k] * b[k][j];
    }
}
void rotation(const double r[3], double out[3][3]) {
  const double n = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
  const double s = n > 0 ? std::sin(n) / n : 1, k = n > 0 ? (1 - std::cos(n)) / (n * n) : 0.5;
  const double x[3][3] = {{0, -r[2], r[1]}, {r[2], 0, -r[0]}, {-r[1], r[0], 0}};
  double xx[3][3];
  product(x, x, xx);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[i][j] = (i == j) + s * x[i][j] + k * xx[i][j];
}
void plain_step(Plain& p, const StepIncrement<double>& u) {
  const double a = 6378137, e2 = 0.00669437999014, w = 7.292115e-5, T = u.dt;
  const double sl = std::sin(p.lat), cl = std::cos(p.lat), s2 = sl * sl, d = 1 - e2 * s2;
  const double N = a / std::sqrt(d), M = N * (1 - e2) / d;
  const double g = 9.7803253359 * (1 + 0.00193185265241 * s2) / std::sqrt(d) - 3.086e-6 * p.h;
  const double we[3] = {0, w * cl, w * sl};
  const double wn[3] = {-p.v[1] / (M + p.h), p.v[0] / (N + p.h),
                        p.v[0] * std::tan(p.lat) / (N + p.h)};
  const double b[3] = {u.velocity.x, u.velocity.y, u.velocity.z};
  const double k[3] = {2 * we[0] + wn[0], 2 * we[1] + wn[1], 2 * we[2] + wn[2]};
  double f[3], v[3];
  for (int i = 0; i < 3; ++i) f[i] = p.c[i][0] * b[0] + p.c[i][1] * b[1] + p.c[i][2] * b[2];
  v[0] = p.v[0] + f[0] - T * (k[1] * p.v[2] - k[2] * p.v[1]);
  v[1] = p.v[1] + f[1] - T * (k[2] * p.v[0] - k[0] * p.v[2]);
  v[2] = p.v[2] + f[2] - T * (k[0] * p.v[1] - k[1] * p.v[0] + g);
  p.lat += 0.5 * T * (p.v[1] + v[1]) / (M + p.h);
  p.lon += 0.5 * T * (p.v[0] + v[0]) / ((N + p.h) * cl);
  p.h = 100;
  const double turn[3] = {-T * (we[0] + wn[0]), -T * (we[1] + wn[1]), -T * (we[2] + wn[2])};
  const double rho[3] = {u.rotation.x, u.rotation.y, u.rotation.z};
  double n[3][3], r[3][3], once[3][3];
  rotation(turn, n);
  rotation(rho, r);
  product(n, p.c, once);
  product(once, r, p.c);
  p.v[0] = v[0], p.v[1] = v[1], p.v[2] = 0;
}
void plain_reference(benchmark::State& state) {
  const auto imu = samples<double>();
  Plain p{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {3, 10, 0}, 50 * deg, 0.1, 100};
  for (auto _ : state) {
    for (std::size_t i = 0; i < kSamples; i += 2) plain_step(p, two_samples(imu[i], imu[i + 1]));
    benchmark::DoNotOptimize(p);
  }
  state.counters["per_step"] = benchmark::Counter(
      kSamples / 2, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(plain_reference);

template <class S>
void twelve_normals(benchmark::State& state) {
  const Stream<S> stream{1, 0, 3};
  std::uint64_t sample = 0;
  for (auto _ : state) benchmark::DoNotOptimize(stream.template normals<12>(sample++));
  state.counters["per_step"] =
      benchmark::Counter(ScalarTraits<S>::kLanes, benchmark::Counter::kIsIterationInvariantRate |
                                                      benchmark::Counter::kInvert);
}
BENCHMARK(twelve_normals<double>)->Name("double/twelve_normals");
BENCHMARK(twelve_normals<Lanes>)->Name("eight_lanes/twelve_normals");

}  // namespace
