// SPDX-License-Identifier: Apache-2.0
// One step of dead reckoning: 10 m on a winding way at 55 N, time per step of one track. "lanes"
// gives the time of one track of eight. A step waits for the last one: what is measured is a log,
// not a batch.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr std::size_t kSteps = 4096;

struct Way {
  std::vector<double> ds, heading;
  Way() {
    for (std::size_t i = 0; i < kSteps; ++i) {
      ds.push_back(10.0 + 0.01 * static_cast<double>(i % 7));
      heading.push_back(std::sin(0.003 * static_cast<double>(i)) * 3.0);
    }
  }
};
const Way& way() {
  static const Way w;
  return w;
}

void count(benchmark::State& state, int tracks) {
  state.counters["ns/step"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kSteps * tracks * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
template <Real S>
constexpr int kTracks = ScalarTraits<S>::kLanes;

// With the sine and cosine of the heading, as a navigator does it.
template <Real S, Integrator kIntegrator>
void reckon(benchmark::State& state) {
  const Way& w = way();
  for (auto _ : state) {
    auto r = reckon_start<S>(S(55 * deg), S(110 * deg));
    for (std::size_t i = 0; i < kSteps; ++i) {
      S s, c;
      sincos(S(w.heading[i]), s, c);
      step_by<S>(wgs84(), kIntegrator, r, S(w.ds[i]) * c, S(w.ds[i]) * s, S(100.0));
    }
    benchmark::DoNotOptimize(r);
  }
  count(state, kTracks<S>);
}
BENCHMARK(reckon<double, Integrator::kExact>)->Name("exact");
BENCHMARK(reckon<Lanes, Integrator::kExact>)->Name("exact_lanes");
BENCHMARK(reckon<double, Integrator::kMidpoint>)->Name("midpoint");
BENCHMARK(reckon<Lanes, Integrator::kMidpoint>)->Name("midpoint_lanes");
BENCHMARK(reckon<double, Integrator::kStartLatitude>)->Name("start_latitude");
BENCHMARK(reckon<Lanes, Integrator::kStartLatitude>)->Name("start_latitude_lanes");

template <Real S>
void grid(benchmark::State& state) {
  const Way& w = way();
  for (auto _ : state) {
    auto r = grid_start<S>(S(89.9 * deg), S(110 * deg));
    for (std::size_t i = 0; i < kSteps; ++i)
      step_grid<S>(wgs84(), true, r, S(w.ds[i]), S(w.heading[i]), S(0.0));
    benchmark::DoNotOptimize(r);
  }
  count(state, kTracks<S>);
}
BENCHMARK(grid<double>)->Name("grid");
BENCHMARK(grid<Lanes>)->Name("grid_lanes");

template <Real S>
void mechanised(benchmark::State& state) {
  const Way& w = way();
  for (auto _ : state) {
    auto r = mechanised_start<S>(S(55 * deg), S(110 * deg));
    for (std::size_t i = 0; i < kSteps; ++i)
      step_mechanised<S>(wgs84(), r, S(w.ds[i]), S(w.heading[i]), S(1.1), S(0.02), S(0.0), S(0.0));
    benchmark::DoNotOptimize(r);
  }
  count(state, kTracks<S>);
}
BENCHMARK(mechanised<double>)->Name("mechanised");
BENCHMARK(mechanised<Lanes>)->Name("mechanised_lanes");

}  // namespace
}  // namespace loxo
