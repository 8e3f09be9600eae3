// SPDX-License-Identifier: Apache-2.0
// Noise and functions, ours against the standard library's, in one run. Time is per trajectory
// (lanes: an eighth).
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "loxo/num/functions.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/random.hpp"

namespace {
using namespace loxo;

// The noise of one strapdown step: twelve normals (six axes of white noise, six of drift).
void noise_std(benchmark::State& state) {
  std::mt19937_64 gen(1);
  std::normal_distribution<double> normal;
  for (auto _ : state) {
    double sum = 0;
    for (int i = 0; i < 12; ++i) sum += normal(gen);
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(noise_std);

template <class S>
void noise(benchmark::State& state) {
  Stream<S> stream{1, 0, 0};
  std::uint64_t i = 0;
  for (auto _ : state) {
    const auto n = stream.template normals<12>(++i);
    S sum = n[0];
    for (std::size_t k = 1; k < 12; ++k) sum = sum + n[k];
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(state.iterations() * ScalarTraits<S>::kLanes);
}
BENCHMARK_TEMPLATE(noise, double);
BENCHMARK_TEMPLATE(noise, Lanes);

// One call a turn, its argument unknown to the compiler.
template <class S, class F>
void function(benchmark::State& state, F f) {
  S x = 0.3;
  for (auto _ : state) {
    benchmark::DoNotOptimize(x);
    S y = f(x);
    benchmark::DoNotOptimize(y);
  }
  state.SetItemsProcessed(state.iterations() * ScalarTraits<S>::kLanes);
}
#define COMPARE(name, expression)                                        \
  void name##_libm(benchmark::State& s) {                                \
    function<double>(s, [](double x) { return std::expression; });       \
  }                                                                      \
  BENCHMARK(name##_libm);                                                \
  void name##_double(benchmark::State& s) {                              \
    function<double>(s, [](double x) { return loxo::expression; });      \
  }                                                                      \
  BENCHMARK(name##_double);                                              \
  void name##_lanes(benchmark::State& s) {                               \
    function<Lanes>(s, [](const Lanes& x) { return loxo::expression; }); \
  }                                                                      \
  BENCHMARK(name##_lanes);
COMPARE(sin, sin(x))
COMPARE(tan, tan(x))
COMPARE(exp, exp(x))
COMPARE(log, log(x))
COMPARE(atan2, atan2(x, 0.7))
COMPARE(asin, asin(x))
COMPARE(atanh, atanh(x))
COMPARE(sinh, sinh(x))

}  // namespace
