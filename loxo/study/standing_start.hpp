// SPDX-License-Identifier: Apache-2.0
// The stand a drive begins with: what its inertial unit shows at rest.
#pragma once
#include "loxo/log/drive.hpp"
#include "loxo/num/geometry.hpp"

namespace loxo {

// A standing start: means of the IMU and their scatter over windows of a second.
struct StandingStart {
  double begin = 0, end = 0;  // s
  long samples = 0;
  Vec<Body> mean_w, mean_f;         // rad/s, m/s^2
  double sigma_w = 0, sigma_f = 0;  // of one sample
  double sway[3]{};                 // sd of the 1 s means of the rate, rad/s
  double sway_angle = 0;            // rms of the integrated, detrended rate, rad
};
// From t0 for at most `duration`; ends before the first three seconds in a row that are clearly not
// at rest; without jolts_end only a turn ends it (`stop` says when it moves off). A second is
// disturbed (a door, a passenger) where it scatters more than six times the median second; such
// seconds count for the mean attitude but not for the noise.
StandingStart standing_start(const Drive& drive, double t0, double duration, double stop,
                             Diagnostics& diagnostics, bool jolts_end = true);

}  // namespace loxo
