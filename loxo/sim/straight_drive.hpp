// SPDX-License-Identifier: Apache-2.0
// The drive that calibrates an odometer: from rest, along a straight line, back to rest, with a
// dead reckoning that keeps its own attitude from erroneous gyros. vehicle.md 3.4.
#pragma once
#include <cstdint>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/earth/frames.hpp"
#include "loxo/num/geometry.hpp"

namespace loxo {

// Speed up, cruise, slow down; level, at height 0.
struct StraightDrive {
  double lat = 0, lon = 0, course = 0;    // rad, clockwise from true north, at the start
  double acceleration = 0.5, speed = 20;  // m/s^2, m/s
  double length = 11200;                  // m
  bool geodesic = true;                   // false: a constant true heading (rhumb line)
  double interval = 0.1;                  // s a step
  double ramp_time() const;               // s
  double duration() const;                // s
  double distance(double t) const;        // m at t s after the start
  double velocity(double t) const;        // m/s
};

// The drive of SH15, vehicle.md 3.4: from 40 N (assumed; its table 1 uses it), 116 E along a
// constant true heading of 45 deg.
StraightDrive sh15_drive();

// What the dead reckoning has wrong at the start of the drive and all along it.
struct ReckoningErrors {
  double k = 1, eps = 0;                   // indicated / true; indicated - true course [rad]
  double phi_e = 0, phi_n = 0, phi_u = 0;  // rad, C_comp = (I - [phi x]) C at the start
  Vec<Body> gyro_bias;                     // rad/s, measured - true
  double gyro_noise = 0;                   // rad/sqrt(s), drawn by seed and trial
  std::uint64_t seed = 1, trial = 0;
};

struct StraightDriveEnds {
  double lat2 = 0, lon2 = 0;  // true end [rad]
  double lat3 = 0, lon3 = 0;  // reckoned end [rad]
};
// The body stands at course + eps, level; the gyros feel the true motion; the odometer indicates k
// times the way.
StraightDriveEnds simulate_straight_drive(const Ellipsoid& ell, const StraightDrive& drive,
                                          const ReckoningErrors& errors);

}  // namespace loxo
