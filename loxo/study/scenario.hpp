// SPDX-License-Identifier: Apache-2.0
// A scenario: a trajectory and the sensors that ride on it, from TOML (docs/scenarios.md), and the
// drive it becomes.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "loxo/sim/odometer_errors.hpp"
#include "loxo/sim/trajectory.hpp"
#include "loxo/text/toml.hpp"

namespace loxo {

struct ScenarioImu {
  double rate = 100;          // Hz
  bool rates = false;         // written as rates, not increments
  std::string stamp = "end";  // of rates: mean over the interval that ends or is centred there, or
                              // the value at that instant: end, middle, instant
  ImuModel<double> errors;
  ImuSurroundings around;
};
struct ScenarioOdometer {
  bool present = false, pulses = false;
  double rate = 10, metres_per_pulse = 0.01;  // Hz
  OdometerModel<double> errors;
  std::vector<WheelFault> faults;
  double delay = 0;      // s
  Vec<Body> lever;       // m, from the IMU to the wheel, the IMU's body axes
  bool declared = true;  // delay and lever arm stand in the drive
};
struct ScenarioAttitude {
  bool present = false;
  double rate = 20;              // Hz
  ChannelModel<double> heading;  // rad
};
struct ScenarioFix {
  bool present = false;
  double rate = 1, position = 0, velocity = 0;  // Hz, 1 sigma per axis m, m/s
  double wander = 0, wander_time = 300;         // m, s: Markov part of each axis
  double outlier_share = 0, outlier = 100;      // how many fixes are gross, 1 sigma per axis m
  std::vector<FixOutlier> outliers;
  std::vector<double> outages;  // from, to, from, to … s
  double delay = 0;             // s, stated in the drive
  Vec<Body> lever;              // m, from the IMU to the antenna, stated in the drive
};
// A sensor of one number: height [m], heading [rad], speed over ground [m/s].
struct ScenarioChannel {
  bool present = false;
  double rate = 1, scale = 0;  // Hz; 1 sigma of a constant relative error
  ChannelModel<double> errors;
  std::vector<double> outages;
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
  ScenarioChannel height, heading, velocity;
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

// The parts of a scenario's file that say where the vehicle goes: [start], [[leg]], [path],
// [[waypoint]], [[wave]], [sea], [mounting]. `folder`: of a recorded track; `seed`: of a random
// road and of a sea.
Trajectory read_trajectory(const TomlTable& t, const Ellipsoid& ellipsoid, std::uint64_t seed,
                           const std::string& folder);
// Every how many samples a slower sensor speaks.
long samples_between(double imu_rate, double rate);

struct SimulatedDrive {
  std::size_t samples = 0, fixes = 0, benchmarks = 0;
  double duration = 0, distance = 0;  // s, m
};
// Writes drive.toml and its files into an existing folder.
SimulatedDrive write_scenario(const Scenario& scenario, const std::string& folder,
                              const std::function<void(double)>& progress = {});

}  // namespace loxo
