// SPDX-License-Identifier: Apache-2.0
// The drive that all trials of a campaign share: the true increments of a scenario's trajectory and
// what they lead to, computed once.
#pragma once
#include <vector>

#include "loxo/study/scenario.hpp"

namespace loxo {

struct DriveTruth {
  // Body increments of a sample.
  struct Step {
    double th[3], v[3];
  };
  // Where the vehicle is at the end of a second (or of each sample, where there are fewer).
  struct Epoch {
    EcefState<double> state;
    Vec<Ecef> east, north;  // at a pole: of longitude 0
    double distance = 0, h = 0, vu = 0;
    bool fix = false;  // a position fix falls here
  };
  // An odometer interval: the wheel's true way, and turned / rolled.
  struct Tick {
    double way, factor;
  };
  double dt = 0;
  int epoch_every = 100;  // samples between epochs
  int odometer_every = 10;
  std::vector<Step> steps;
  std::vector<Epoch> epochs;  // epochs[0]: the start
  std::vector<Tick> ticks;
  // The IMU's vertical and level axes in the vehicle: body components of right, forward, up.
  Vec<Body> right, forward, up;
  std::uint64_t hash() const;  // of every bit above
};
// Throws Error(kInput), at `where`, for more samples than memory should hold.
DriveTruth drive_truth(const Scenario& scenario, const std::string& where);

// From a campaign's [settings]: `scenario`, a file or the name of a ready one, or a `route`
// (static, straight, weave, mixed, closed) with lat, lon, heading, speed, duration; imu_rate,
// odometer_rate.
Scenario drive_scenario(const TomlTable& settings);

}  // namespace loxo
