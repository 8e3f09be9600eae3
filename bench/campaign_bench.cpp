// SPDX-License-Identifier: Apache-2.0
// Campaigns on one core: trajectory steps a second of a one-hour-like drive (simulate with errors,
// navigate, reckon, evaluate), and two-point calibrations a second; in lanes against the same
// trials alone in double.
#include <benchmark/benchmark.h>

#include "loxo/study/campaign.hpp"

namespace {
using namespace loxo;

// 60 s at 100 Hz with a 10 Hz odometer: 6000 steps a trial, all noise sources on.
Campaign drives(const char* frame, const char* mode = "") {
  CampaignSource s;
  s.name = "bench";
  s.text = R"toml(
kind = "drive"
[settings]
duration = "60 s"
imu_rate = "100 Hz"
odometer_rate = "10 Hz"
frame = ")toml" +
           std::string(frame) + "\"\n" + mode + R"toml(
[parameters]
gyro_walk = "0.01 deg/h/sqrt(h)"
heading_error = "2 arcmin"
odometer_noise = "0.01 m"
)toml";
  return read_campaign(s, "bench");
}
constexpr double kSteps = 6000;

void drive_lanes(benchmark::State& state, const char* frame, const char* mode = "") {
  const Campaign c = drives(frame, mode);
  for (auto _ : state) benchmark::DoNotOptimize(run_block(c, 0, 8));
  state.counters["steps"] =
      benchmark::Counter(8 * kSteps, benchmark::Counter::kIsIterationInvariantRate);
}
void drive_double(benchmark::State& state, const char* frame) {
  const Campaign c = drives(frame);
  for (auto _ : state) benchmark::DoNotOptimize(run_trial(c, 3));
  state.counters["steps"] =
      benchmark::Counter(kSteps, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK_CAPTURE(drive_lanes, geographic, "geographic");
BENCHMARK_CAPTURE(drive_lanes, transverse, "transverse");
BENCHMARK_CAPTURE(drive_lanes, grid, "grid");
BENCHMARK_CAPTURE(drive_lanes, wander, "wander");
BENCHMARK_CAPTURE(drive_lanes, ecef, "ecef");
BENCHMARK_CAPTURE(drive_double, geographic, "geographic");
// What a mode costs: free inertial and dead reckoning, and these.
BENCHMARK_CAPTURE(drive_lanes, with_joint_filter, "geographic",
                  "mode = [\"inertial\", \"reckon\", \"filter\"]\n");
BENCHMARK_CAPTURE(drive_lanes, joint_filter_alone, "geographic", "mode = [\"filter\"]\n");
BENCHMARK_CAPTURE(drive_lanes, with_calibration, "geographic",
                  "mode = [\"inertial\", \"reckon\", \"calibrate\"]\n");
BENCHMARK_CAPTURE(drive_lanes, with_segmented, "geographic",
                  "mode = [\"inertial\", \"reckon\", \"segmented\"]\n");

void two_point_lanes(benchmark::State& state) {
  CampaignSource s;
  s.name = "bench";
  s.text =
      "kind = \"two_point\"\n[parameters]\ncourse = { uniform = [\"0 deg\", \"360 deg\"] }\nscale "
      "= { normal = [1.0, 0.02] }\n";
  const Campaign c = read_campaign(s, "bench");
  for (auto _ : state) benchmark::DoNotOptimize(run_block(c, 0, 1024));
  state.counters["calibrations"] =
      benchmark::Counter(1024, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(two_point_lanes);

}  // namespace
