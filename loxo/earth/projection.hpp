// SPDX-License-Identifier: Apache-2.0
// Gauss-Krueger (transverse Mercator, unit scale on the central meridian) and polar stereographic.
#pragma once
#include "loxo/earth/ellipsoid.hpp"
#include "loxo/earth/rhumb.hpp"

namespace loxo {

// x north [m] from the equator, y east [m] with the false easting added.
template <Real S = double>
struct GaussXY {
  S x{}, y{};
};
// Exact: Krueger series of order 8, below 2e-8 m within 40 deg of the central meridian.
template <Real S>
GaussXY<S> gauss_forward(const Ellipsoid& ell, S lat, S lon, double lon0,
                         double false_easting = 500000.0);
template <Real S>
LatLon<S> gauss_inverse(const Ellipsoid& ell, S x, S y, double lon0,
                        double false_easting = 500000.0);
// The papers' truncated series, corrected (V-22..24), for any ellipsoid. Truncation at 3 deg from
// the meridian, 40 N: 0.0003 m in x, 0.0001 m in y (0.063 m and 0.040 m without the m^6 and m^5
// terms, as printed).
template <Real S>
GaussXY<S> gauss_forward_paper(const Ellipsoid& ell, S lat, S lon, double lon0,
                               double false_easting = 500000.0);
// Its numerical inverse (Newton on the series), 1e-12 rad.
template <Real S>
LatLon<S> gauss_inverse_paper(const Ellipsoid& ell, S x, S y, double lon0,
                              double false_easting = 500000.0);

// Polar stereographic, north (south: mirrored), unit scale at the pole: x along lon0 + 90 deg, y
// along lon0 + 180 deg [m].
template <Real S = double>
struct PlaneXY {
  S x{}, y{};
};
template <Real S>
PlaneXY<S> polar_stereographic_forward(const Ellipsoid& ell, S lat, S lon, double lon0, bool north);
template <Real S>
LatLon<S> polar_stereographic_inverse(const Ellipsoid& ell, S x, S y, double lon0, bool north);

}  // namespace loxo
