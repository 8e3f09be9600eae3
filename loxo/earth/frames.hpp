// SPDX-License-Identifier: Apache-2.0
// Every frame of the house, its axes and signs: the only such page.
//
// Angles: heading psi clockwise from the frame's north, pitch bow up +, roll starboard down +.
//   C_nb = Rz(psi) Rx(pitch) Ry(roll), polar.md section 0; Euler angles <-> matrix in
//   earth/attitude.hpp.
#pragma once
#include <string_view>

namespace loxo {

struct Inertial {};  // i: non-rotating, axes of ECEF at t = 0
struct Ecef {};      // e: Earth-fixed, z the rotation axis, x in the zero meridian
struct Geographic {
};  // g: level, east-north-up at the geodetic normal; undefined axes at the poles
struct Transverse {
};               // t: level, transverse east-north-up (polar.md 1.1) for a reference meridian lon0
struct Grid {};  // G: level, E = transverse north, N = - transverse east (polar.md 1.3)
struct Wander {};   // w: level, azimuth propagated with zero vertical transport rate
struct Body {};     // b: right-forward-up (RFU)
struct Vehicle {};  // v: right-forward-up of the wheels; Body turned by the mounting angles

// The navigation frame chosen at run time; the text of `--frame` and of the solution's column.
enum class FrameId { kGeographic, kTransverse, kGrid, kWander, kEcef };
inline constexpr std::string_view frame_name(FrameId f) {
  switch (f) {
    case FrameId::kGeographic:
      return "geographic";
    case FrameId::kTransverse:
      return "transverse";
    case FrameId::kGrid:
      return "grid";
    case FrameId::kWander:
      return "wander";
    case FrameId::kEcef:
      return "ecef";
  }
  return "?";
}

}  // namespace loxo
