// SPDX-License-Identifier: Apache-2.0
// Time per IMU sample of the polar transfer: the kernels, and the whole pass with a reference at 1
// Hz and at 100 Hz.
#include <benchmark/benchmark.h>

#include <vector>

#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/polar_mover.hpp"

namespace loxo {
namespace {

TransverseState<double> home_state() {
  return {0.003,
          59 * deg,
          10.0,
          {5.0, -4.0, 0.1},
          to_matrix<Transverse>(Euler<double>{2.0, 0.02, -0.05})};
}
void report(benchmark::State& state, double samples) {
  state.counters["ns/sample"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * samples * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void keep_path(benchmark::State& state) {
  const PolarMove move{wgs84(), 122.9 * deg, 59 * deg, Keep::kPath};
  auto s = home_state();
  for (auto _ : state) {
    s.tlon += 1e-9;
    benchmark::DoNotOptimize(move_path(move, s, {0.1, 0.2, 9.8}));
  }
  report(state, 1);
}
BENCHMARK(keep_path);
void keep_velocity(benchmark::State& state) {
  const PolarMove move{wgs84(), 122.9 * deg, 59 * deg, Keep::kVelocity};
  auto s = home_state();
  for (auto _ : state) {
    s.tlon += 1e-9;
    benchmark::DoNotOptimize(convert_velocity(move, s, s.tlat, s.tlon - move.angle));
  }
  report(state, 1);
}
BENCHMARK(keep_velocity);

void whole_pass(benchmark::State& state) {
  const bool path = state.range(0) == 0;
  const int every = static_cast<int>(state.range(1));
  const PolarMove move{wgs84(), 122.9 * deg, 59 * deg, path ? Keep::kPath : Keep::kVelocity};
  auto s = home_state();
  std::vector<ReferenceEpoch> reference;
  constexpr int kSamples = 20000;
  for (int i = 0; i <= kSamples; i += every) {
    reference.push_back({0.01 * i, to_ecef_pose(move.earth, move.lon0, s)});
    s.tlon -= 1e-9 * every;
  }
  for (auto _ : state) {
    std::size_t k = 0;
    double sum = 0;
    PolarMover mover(
        move,
        [&]() -> std::optional<ReferenceEpoch> {
          return k < reference.size() ? std::optional(reference[k++]) : std::nullopt;
        },
        1e9, [&](const MovedSample& m) { sum += m.imu.dv.x; },
        [](double, const TransverseState<double>&, const TransverseState<double>&) {});
    for (int i = 0; i < kSamples; ++i)
      mover.add({0.01 * (i + 1), 0.01, {1e-5, 2e-5, 1e-5}, {0.0, 0.0, 0.098}});
    mover.finish();
    benchmark::DoNotOptimize(sum);
  }
  report(state, kSamples);
}
BENCHMARK(whole_pass)
    ->ArgNames({"keep_velocity", "every"})
    ->Args({0, 100})
    ->Args({0, 1})
    ->Args({1, 100})
    ->Args({1, 1});

}  // namespace
}  // namespace loxo
