// SPDX-License-Identifier: Apache-2.0
// The Earth as the strapdown kernels want it: the constants of one ellipsoid and one reference
// meridian, derived once. Doubles also in lanes: all lanes share one Earth.
#pragma once
#include "loxo/earth/ellipsoid.hpp"

namespace loxo {

struct EarthModel {
  double a = 0, e2 = 0;  // m, 1
  double a_polar = 0;    // a (1 - e2) [m]
  double inv_a = 0;      // 1/a [1/m]
  double w_ie = 0;       // rad/s
  // gamma = g_eq (1 + g_s s^2)/sqrt(1 - e2 s^2) (1 - (g_h - g_hs s^2) h + g_hh h^2), polar.md 3.1;
  // a constant gravity is g_eq alone.
  double g_eq = 0, g_s = 0, g_h = 0, g_hs = 0, g_hh = 0;
  double g_e2 = 0;                    // e2 of the gravity formula: 0 where gravity is constant
  double sin_lon0 = 0, cos_lon0 = 1;  // reference meridian of the transverse and grid frames
  double lon0 = 0;                    // rad
};

// lon0 [rad]: reference meridian of the transverse and grid frames (polar.md 1.1).
EarthModel make_earth_model(const Ellipsoid& ellipsoid, double lon0 = 0);

}  // namespace loxo
