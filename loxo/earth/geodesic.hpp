// SPDX-License-Identifier: Apache-2.0
// The geodesic between two points (V-18). GeographicLib behind this door: it is exact there and
// poles are no trouble for geodesics.
#pragma once
#include "loxo/earth/ellipsoid.hpp"

namespace loxo {

struct GeodesicInverse {
  double azimuth1 = 0, azimuth2 = 0;  // [0, 2 pi), at the start and at the end
  double distance = 0;                // m
};
GeodesicInverse geodesic_inverse(const Ellipsoid& ell, double lat1, double lon1, double lat2,
                                 double lon2);
struct GeodesicDirect {
  double lat = 0, lon = 0, azimuth2 = 0;
};
GeodesicDirect geodesic_direct(const Ellipsoid& ell, double lat1, double lon1, double azimuth,
                               double distance);

}  // namespace loxo
