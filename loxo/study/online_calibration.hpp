// SPDX-License-Identifier: Apache-2.0
// The calibration method `online`: scale and heading mounting as the joint filter finds them on the
// way, with their covariance.
#pragma once
#include <string>

#include "loxo/log/drive.hpp"

namespace loxo {

struct OnlineCalibration {
  bool valid = false;
  std::string why;              // where it is not
  double k = 1, k_std = 0;      // indicated / true
  double eps = 0, eps_std = 0;  // rad, IMU heading - course, clockwise +
  double correlation = 0;
  double pitch_mounting = 0, pitch_mounting_std = 0;  // rad
  double delay = 0, delay_std = 0;                    // s
};
// Needs [imu] and [odometer]; fixes and benchmarks are used where there are any. Never throws for a
// drive that cannot be calibrated so (valid = false, the reason in `why`); faults of the input
// still throw.
OnlineCalibration online_calibration(const Drive& drive, Diagnostics& diagnostics);

}  // namespace loxo
