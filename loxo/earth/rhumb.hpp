// SPDX-License-Identifier: Apache-2.0
// Isometric latitude, meridian arc and rhumb lines: exact to rounding, stable for east-west lines,
// right up to the pole and across +-180 deg. Own code because GeographicLib gives NaN at the pole
// and has no lanes.
#pragma once
#include "loxo/earth/ellipsoid.hpp"

namespace loxo {

// q(L) (V-3) and its inverse; infinite at the poles.
template <Real S>
S isometric_latitude(const Ellipsoid& ell, S lat);
template <Real S>
S latitude_of_isometric(const Ellipsoid& ell, S q);
// m(L) (V-4) [m] from the equator, north +; error below 2e-8 m. And its inverse, below 2e-15 rad.
template <Real S>
S meridian_arc(const Ellipsoid& ell, S lat);
template <Real S>
S latitude_of_arc(const Ellipsoid& ell, S m);
// w(m) = dq/dm = 1/(N cos L) [1/m] (V-10).
template <Real S>
S isometric_rate(const Ellipsoid& ell, S lat);
// D(L1, L2) = (q2 - q1)/(m2 - m1) [1/m] (V-8), stable for L1 = L2.
template <Real S>
S isometric_divided_difference(const Ellipsoid& ell, S lat1, S lat2);

// azimuth clockwise from north [0, 2 pi); distance [m] along the shorter way in longitude.
template <Real S = double>
struct RhumbInverse {
  S azimuth{}, distance{}, north{},
      east{};  // north = distance cos(azimuth), east = distance sin(azimuth) [m]
};
// V-17. Identical points: distance 0, azimuth 0. A pole as an end point: along the meridian.
template <Real S>
RhumbInverse<S> rhumb_inverse(const Ellipsoid& ell, S lat1, S lon1, S lat2, S lon2);

template <Real S = double>
struct LatLon {
  S lat{}, lon{};
};
// V-8. NaN where the line would pass a pole (|m| > quarter meridian). lon in (-pi, pi].
template <Real S>
LatLon<S> rhumb_direct(const Ellipsoid& ell, S lat1, S lon1, S azimuth, S distance);

// The same in degrees, at the door: sines and cosines come from the degrees, so that nothing of a
// latitude near the pole, of a longitude difference or of azimuth 90 is lost in radians. Results in
// degrees and m.
RhumbInverse<double> rhumb_inverse_degrees(const Ellipsoid& ell, double lat1, double lon1,
                                           double lat2, double lon2);
LatLon<double> rhumb_direct_degrees(const Ellipsoid& ell, double lat1, double lon1, double azimuth,
                                    double distance);

}  // namespace loxo
