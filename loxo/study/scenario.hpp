// SPDX-License-Identifier: Apache-2.0
// A scenario: a trajectory and the sensors that ride on it, from TOML (docs/scenarios.md), and the
// drive it becomes.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "loxo/sim/trajectory.hpp"
#include "loxo/text/toml.hpp"

namespace loxo {

struct ScenarioImu {
  double rate = 100;  // Hz
  double gyro_bias = 0, accel_bias = 0, gyro_scale = 0,
         accel_scale = 0;                               // 1 sigma of constants drawn per axis
  double gyro_noise = 0, accel_noise = 0;               // rad/sqrt(s), m/s/sqrt(s)
  std::array<double, 3> gyro_offset{}, accel_offset{};  // known constants, added
};
struct ScenarioOdometer {
  bool present = false, pulses = false;
  double rate = 10, scale = 1, metres_per_pulse = 0.01;  // Hz; k: indicated / true
  double scale_noise = 0, quantisation = 0;              // of each increment; m
};
struct ScenarioAttitude {
  bool present = false;
  double rate = 20, heading_bias = 0, heading_drift = 0,
         heading_noise = 0;  // Hz, rad, rad/s, rad/sqrt(s)
};
struct ScenarioFix {
  bool present = false;
  double rate = 1, position = 0, velocity = 0;  // Hz, 1 sigma per axis m, m/s
  std::vector<double> outages;                  // from, to, from, to … s
};
struct ScenarioHeight {
  bool present = false;
  double rate = 1, height = 0;
};
struct ScenarioBenchmark {
  std::string name;
  double t = 0, std = 0;
};
// The start as the drive states it, minus the truth, in the track's axes at t = 0.
struct ScenarioStartError {
  double right = 0, forward = 0, v_right = 0, v_forward = 0;  // m, m/s
  double tilt_right = 0, tilt_forward = 0, tilt_up = 0;       // rad, C_stated = (1 - tilt x) C_true
};

struct Scenario {
  std::string name, about, ellipsoid_text;
  std::uint64_t seed = 1;
  Trajectory trajectory;
  ScenarioImu imu;
  ScenarioOdometer odometer;
  ScenarioAttitude attitude;
  ScenarioFix fix;
  ScenarioHeight height;
  std::vector<ScenarioBenchmark> benchmarks;
  ScenarioStartError start_error;
  double reference_rate = 10;  // Hz
};

struct ReadyScenario {
  std::string name, toml;
};
const std::vector<ReadyScenario>& ready_scenarios();

// A file's path or a ready scenario's name. Throws Error(kUsage) with the nearest name,
// Error(kInput) for its content.
Scenario read_scenario(const std::string& path_or_name, const std::vector<std::string>& sets = {});

struct SimulatedDrive {
  std::size_t samples = 0, fixes = 0, benchmarks = 0;
  double duration = 0, distance = 0;  // s, m
};
// Writes drive.toml and its files into an existing folder.
SimulatedDrive write_scenario(const Scenario& scenario, const std::string& folder,
                              const std::function<void(double)>& progress = {});

}  // namespace loxo
