// SPDX-License-Identifier: Apache-2.0
// What a navigator concluded at one epoch. The file's columns are in interface.md ("A Solution on
// disk").
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/ins/samples.hpp"

namespace loxo {

// Bits of SolutionRow::health. 0 = nothing to say.
enum Health : std::uint32_t {
  kHealthGap = 1u << 0,          // input gap bridged
  kHealthSaturated = 1u << 1,    // sensor at its limit
  kHealthSingular = 1u << 2,     // the frame is near its singularity here
  kHealthDomain = 1u << 3,       // arithmetic left its domain: numbers of this row are NaN
  kHealthDeadEncoder = 1u << 4,  // the wheel says nothing while the IMU moves
  kHealthSlip = 1u << 5,         // wheel slip or skid de-weighted
  kHealthRejected = 1u << 6,     // a measurement rejected at this epoch
  kHealthDiverged = 1u << 7,     // the filter does not believe itself any more
  kHealthSwitched = 1u << 8,     // the navigation frame changed at this epoch
  kHealthUncovered = 1u << 9,    // the stated std is not to be trusted (long gap, fault)
};

// SI and radians. Quaternion body -> ECEF. std: 1 sigma, kNone where not known.
struct SolutionRow {
  double t = 0;
  double lat = 0, lon = 0, h = 0;
  double ve = 0, vn = 0, vu = 0;
  double roll = 0, pitch = 0, heading = 0;
  double qw = 1, qx = 0, qy = 0, qz = 0;
  double x = 0, y = 0, z = 0;
  double std_e = kNone, std_n = kNone, std_u = kNone, std_heading = kNone;
  FrameId frame = FrameId::kGeographic;
  std::uint32_t health = 0;
};

// The row of a state in ECEF [m, m/s]: latitude, longitude, level velocity and Euler angles agree
// with each other, also at a pole. No std, geographic, healthy.
SolutionRow solution_row(const Ellipsoid& earth, double t, const Point<Ecef>& r, const Vec<Ecef>& v,
                         const Quat<Ecef, Body>& q);

struct Solution {
  std::map<std::string, std::string> meta;  // mode, ellipsoid, program version, input hash …
  std::vector<SolutionRow> rows;
};

}  // namespace loxo
