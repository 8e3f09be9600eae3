// SPDX-License-Identifier: Apache-2.0
// Calibration: one iteration of replay on a long log, two-point calibrations, the covariance's
// sums.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "loxo/calibrate/replay.hpp"
#include "loxo/calibrate/two_point.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/csv.hpp"

namespace loxo {
namespace {

constexpr std::size_t kRows = 1000000;

std::vector<TrackStep> steps(double height) {
  std::vector<TrackStep> out(kRows);
  for (std::size_t i = 0; i < kRows; ++i) {
    out[i].t = 0.01 * static_cast<double>(i + 1);
    out[i].ds = 0.15;
    out[i].heading = std::sin(1e-4 * static_cast<double>(i)) + 0.5;
    out[i].h = height;
  }
  return out;
}

void replay(benchmark::State& state, double height, HeadingModel model) {
  const auto log = steps(height);
  RecordedTrack track;
  track.ellipsoid = &wgs84();
  track.steps = log;
  track.model = model;
  Benchmark start;
  start.lat = 55 * deg;
  const Replay pass(track, start, {kRows});
  const State wanted[] = {State::kScale, State::kAngle};
  StateVector x{};
  for (auto _ : state) {
    x[1] += 1e-9;
    benchmark::DoNotOptimize(pass.run(x, wanted));
  }
  state.counters["rows"] = benchmark::Counter(static_cast<double>(state.iterations()) * kRows,
                                              benchmark::Counter::kIsRate);
}
// One Newton iteration with its sensitivities, 10^6 rows.
BENCHMARK_CAPTURE(replay, level, 0.0, HeadingModel::kIndependent)
    ->Unit(benchmark::kMillisecond)
    ->Name("replay_iteration_1e6_rows");
BENCHMARK_CAPTURE(replay, high, 120.0, HeadingModel::kIndependent)
    ->Unit(benchmark::kMillisecond)
    ->Name("replay_iteration_1e6_rows_with_heights");
BENCHMARK_CAPTURE(replay, mechanised, 0.0, HeadingModel::kMechanised)
    ->Unit(benchmark::kMillisecond)
    ->Name("replay_iteration_1e6_rows_mechanised");

void moments(benchmark::State& state) {
  const auto log = steps(0);
  RecordedTrack track;
  track.ellipsoid = &wgs84();
  track.steps = log;
  Benchmark start;
  start.lat = 55 * deg;
  const Replay pass(track, start, {kRows});
  for (auto _ : state) benchmark::DoNotOptimize(pass.moments({}));
}
BENCHMARK(moments)->Unit(benchmark::kMillisecond)->Name("covariance_sums_1e6_rows");

// 10^6 two-point calibrations, through the door with its checks.
void points(benchmark::State& state, ChordMethod method) {
  const auto c = rhumb_direct(wgs84(), 0.9, 0.1, 0.5, 10e3);
  const auto d = rhumb_direct(wgs84(), 0.9, 0.1, 0.52, 10.1e3);
  TwoPointInput in{0.9, 0.1, c.lat, c.lon, d.lat, d.lon};
  for (auto _ : state)
    for (int i = 0; i < 1000000; ++i) {
      in.lat3 += 1e-13;
      benchmark::DoNotOptimize(calibrate_two_point(wgs84(), method, in));
    }
}
BENCHMARK_CAPTURE(points, rhumb, ChordMethod::kRhumb)
    ->Unit(benchmark::kMillisecond)
    ->Name("two_point_1e6_rhumb");
BENCHMARK_CAPTURE(points, mean, ChordMethod::kMeanLatitude)
    ->Unit(benchmark::kMillisecond)
    ->Name("two_point_1e6_mean_latitude");
BENCHMARK_CAPTURE(points, geodesic, ChordMethod::kGeodesic)
    ->Unit(benchmark::kMillisecond)
    ->Name("two_point_1e6_geodesic");

// A CSV of seven columns, 10^6 rows, read at constant memory.
void csv(benchmark::State& state) {
  const auto path = (std::filesystem::temp_directory_path() / "loxo_calibrate_bench.csv").string();
  {
    std::ofstream out(path);
    out << "t_s,gx,gy,gz,ax,ay,az\n";
    char line[256];
    for (std::size_t i = 0; i < kRows; ++i) {
      const double a = std::sin(0.001 * static_cast<double>(i));
      const int n = std::snprintf(line, sizeof line, "%.2f,%.7f,%.7f,%.7f,%.6f,%.6f,%.6f\n",
                                  0.01 * static_cast<double>(i), a * 0.01, a * 0.02, a * 0.03,
                                  a * 0.1, a * 0.2, 9.8 + a * 0.01);
      out.write(line, n);
    }
  }
  const auto peak = [] {
    rusage use{};
    getrusage(RUSAGE_SELF, &use);
    return static_cast<double>(use.ru_maxrss) / 1024;
  };
  const double before = peak();
  for (auto _ : state) {
    CsvReader reader(path);
    reader.select({"t_s", "gx", "gy", "gz", "ax", "ay", "az"});
    Diagnostics diagnostics;
    double row[7], sum = 0;
    while (reader.next(row, diagnostics)) sum += row[3];
    benchmark::DoNotOptimize(sum);
  }
  state.counters["rows"] = benchmark::Counter(static_cast<double>(state.iterations()) * kRows,
                                              benchmark::Counter::kIsRate);
  // Constant memory: what the highest use of memory grew by.
  state.counters["more_MB"] = peak() - before;
  std::filesystem::remove(path);
}
BENCHMARK(csv)->Unit(benchmark::kMillisecond)->Name("csv_1e6_rows_of_7");

}  // namespace
}  // namespace loxo
