// SPDX-License-Identifier: Apache-2.0
// Geodetic coordinates and ECEF.
#pragma once
#include "loxo/earth/ellipsoid.hpp"
#include "loxo/earth/frames.hpp"
#include "loxo/num/geometry.hpp"

namespace loxo {

// Latitude [-pi/2, pi/2] and longitude (-pi, pi] in rad, ellipsoidal height in m.
template <Real S = double>
struct Geodetic {
  S lat{}, lon{}, h{};
};

// Exact, any latitude. polar.md 1.3.
template <Real S>
Point<Ecef, S> to_ecef(const Ellipsoid& ell, const Geodetic<S>& p);
// Error below 1e-15 rad and 4e-9 m (four units in the last place of r) for |h| < 100 km, at the
// pole too; there lon = 0 (atan2(0, 0)).
template <Real S>
Geodetic<S> to_geodetic(const Ellipsoid& ell, const Point<Ecef, S>& r);

// The outward ellipsoid normal (unit) and height of a point: what is regular at the pole.
template <Real S>
struct NormalHeight {
  Vec<Ecef, S> n;
  S h{};
};
template <Real S>
NormalHeight<S> to_normal(const Ellipsoid& ell, const Point<Ecef, S>& r);
template <Real S>
Point<Ecef, S> from_normal(const Ellipsoid& ell, const NormalHeight<S>& p);
template <Real S>
Vec<Ecef, S> normal_of(S lat, S lon);

// C_en's transpose: rows east, north, up in ECEF components, at latitude and longitude (defined at
// the pole by that longitude).
template <Real S>
Rot<Geographic, Ecef, S> geographic_axes(S lat, S lon);

}  // namespace loxo
