// SPDX-License-Identifier: Apache-2.0
// A voyage of a ship as polar.md 9.2 describes it, for the studies of the transfer to the pole:
// courses and speeds that change smoothly, rolling in two waves, one state a step.
#pragma once
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/transfer_error.hpp"

namespace loxo {

struct VoyageLeg {
  double start, course, speed;  // s after the start, rad clockwise from true north, m/s
};
struct VoyageWave {
  double amplitude, period, phase;  // rad, s, rad
  double at(double t) const;
};
// The defaults are 9.2's: 11.6 h off 31 N, 122.7 E.
struct TransferVoyage {
  std::vector<VoyageLeg> legs = standard_legs();
  VoyageWave yaw[2] = {wave(1.0, 17.3, 0.3), wave(0.8, 61, 1.0)};
  VoyageWave pitch[2] = {wave(1.5, 6.7, 0.9), wave(0.6, 10.9, 2.0)};
  VoyageWave roll[2] = {wave(4.0, 9.3, 0.1), wave(1.5, 13.7, 1.4)};
  double mean_pitch = 0.3 * deg, mean_roll = -0.5 * deg;
  double lat = 30.9 * deg, lon = 122.7 * deg;  // of the start
  double lon0 = 122.9 * deg, angle = 1.029;    // of the transfer
  double end = 11.6 * 3600;                    // s

  double course(double t) const;  // rad; a turn takes its size / (1.6 deg/s), at least 20 s
  double speed(double t) const;   // m/s; a change takes a minute

  static VoyageWave wave(double amplitude_deg, double period, double phase) {
    return {amplitude_deg * deg, period, phase};
  }
  static std::vector<VoyageLeg> standard_legs();
};

struct VoyagePoint {
  double t, lat, lon;
  TransferPoint p;
};
// Every `step` seconds; `level` leaves pitch and roll out.
std::vector<VoyagePoint> sail(const Ellipsoid& earth, const TransferVoyage& voyage, double step,
                              bool level);

// The reference's errors of 9.2: 1' of pitch and roll, 3' of heading, 0.1 and -0.1 m/s; 5 m east
// and 5 m north where `position`.
ReferenceError voyage_reference_error(const Ellipsoid& earth, const TransferVoyage& voyage,
                                      const VoyagePoint& at, bool position);

}  // namespace loxo
