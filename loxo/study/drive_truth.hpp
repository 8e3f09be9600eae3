// SPDX-License-Identifier: Apache-2.0
// The drive that all trials of a campaign share: error-free increments and what they lead to. The
// vehicle is steered in ECEF, so the route may cross a pole; truth is the strapdown solution of its
// own increments, hence consistent with them to rounding.
#pragma once
#include <string>
#include <vector>

#include "loxo/ins/ecef.hpp"
#include "loxo/text/toml.hpp"

namespace loxo {

struct DriveSettings {
  std::string route = "weave";  // static, straight (a great circle of normals), weave (heading
                                // swings by weave_angle)
  double lat = 0, lon = 0, heading = 0;        // rad, at the start
  double speed = 0;                            // m/s, reached by a start at 1 m/s^2
  double duration = 0;                         // s
  double imu_rate = 100;                       // Hz
  int odometer_every = 10;                     // IMU samples
  double weave_angle = 0, weave_period = 300;  // rad, s
};
DriveSettings read_drive_settings(const TomlTable& settings);

struct DriveTruth {
  // Body increments of a sample.
  struct Step {
    double th[3], v[3];
  };
  // Where the vehicle is at the end of a second (or of each sample, where there are fewer).
  struct Epoch {
    EcefState<double> state;
    Vec<Ecef, double> east, north;
    double distance = 0, h = 0, vu = 0;
  };
  double dt = 0;
  int epoch_every = 100;  // samples between epochs
  std::vector<Step> steps;
  std::vector<Epoch> epochs;  // epochs[0]: the start
  std::vector<double> ticks;  // way of each odometer interval [m]
  int odometer_every = 10;
};
DriveTruth drive(const EarthModel& earth, const DriveSettings& settings);

}  // namespace loxo
