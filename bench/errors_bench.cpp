// SPDX-License-Identifier: Apache-2.0
// How errors move: static responses, covariance budget, Allan deviation.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "loxo/earth/geodetic.hpp"
#include "loxo/errors/allan.hpp"
#include "loxo/errors/static_response.hpp"
#include "loxo/estimate/covariance.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/scenario.hpp"

namespace loxo {
namespace {

// 24 h at 1 s, nine sources.
void static_day(benchmark::State& state) {
  const auto site = transverse_site(wgs84(), 0.3, 0.4);
  std::vector<StaticResponse> responses;
  double StaticInputs::*const slots[9] = {
      &StaticInputs::eps_e,   &StaticInputs::eps_n,   &StaticInputs::eps_u,
      &StaticInputs::nabla_e, &StaticInputs::nabla_n, &StaticInputs::phie0,
      &StaticInputs::phin0,   &StaticInputs::phiu0,   &StaticInputs::dve0};
  std::vector<std::array<std::vector<double>, 7>> out(9);
  for (auto _ : state) {
    responses.clear();
    for (auto slot : slots) {
      StaticInputs in;
      in.*slot = 1e-8;
      responses.push_back(static_response(site, in));
    }
    static_series(responses, 0.0, 1.0, 86401, out);
    benchmark::DoNotOptimize(out[8][6][86400]);
  }
}
BENCHMARK(static_day)->Unit(benchmark::kMillisecond);

// One hour at 0.1 s with every source.
void budget_hour(benchmark::State& state) {
  BudgetConfig config;
  config.ellipsoid = wgs84();
  auto& e = config.errors;
  e.gyro_bias = e.accel_bias = e.gyro_scale = e.accel_scale = e.gyro_noise = e.accel_noise = 1e-6;
  e.gyro_walk = e.accel_walk = e.level = e.heading = e.position = e.velocity = e.deflection = 1e-6;
  e.scale = e.mounting_heading = e.mounting_pitch = e.scale_noise = e.side_slip = 1e-6;
  e.quantisation = e.attitude_bias = e.attitude_drift = e.attitude_noise = 1e-6;
  Scenario scenario = read_scenario("city-drive");
  TrajectoryWalk walk(scenario.trajectory);
  std::vector<EcefState<double>> motion{walk.truth().state};
  for (int i = 1; i <= 7200; ++i) {
    walk.to(0.1 * i);
    motion.push_back(walk.truth().state);
  }
  for (auto _ : state) {
    CovarianceBudget budget(config);
    budget.start(motion[0]);
    for (int turn = 0; turn < 5; ++turn)
      for (int i = 1; i <= 7200; ++i) budget.step(motion[static_cast<std::size_t>(i)], 0.1);
    benchmark::DoNotOptimize(budget.row());
  }
  state.counters["sources"] = 22;
}
BENCHMARK(budget_hour)->Unit(benchmark::kSecond);

// 10^8 samples on each of three axes, in pieces as a reader gives them.
void allan_stream(benchmark::State& state) {
  std::vector<double> piece(1 << 16);
  const Stream<double> noise{1, 0, 0};
  for (std::size_t i = 0; i < piece.size(); ++i) piece[i] = noise.normal(i);
  const long long total = state.range(0);
  for (auto _ : state) {
    AllanStream axes[3] = {AllanStream(0.01), AllanStream(0.01), AllanStream(0.01)};
    for (long long n = 0; n < total; n += static_cast<long long>(piece.size()))
      for (auto& axis : axes) axis.add(piece);
    for (auto& axis : axes) benchmark::DoNotOptimize(axis.points());
  }
  state.SetItemsProcessed(state.iterations() * 3 * total);
}
BENCHMARK(allan_stream)->Arg(10000000)->Unit(benchmark::kSecond)->Iterations(1);

}  // namespace
}  // namespace loxo
