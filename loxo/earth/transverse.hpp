// SPDX-License-Identifier: Apache-2.0
// The transverse frame of polar.md section 1 for a reference meridian lon0 (rad), and the universal
// curvature formula of section 2, valid at the poles.
#pragma once
#include "loxo/earth/geodetic.hpp"

namespace loxo {

// tlat = p in [-pi/2, pi/2], tlon = l in (-pi, pi]; the north pole is (0, 0).
template <Real S = double>
struct TransverseLatLon {
  S tlat{}, tlon{};
};
template <Real S>
TransverseLatLon<S> to_transverse(S lat, S lon, double lon0);
template <Real S>
TransverseLatLon<S> to_transverse(const Vec<Ecef, S>& normal, double lon0);
// lat, lon; lon = lon0-consistent value exactly at a pole.
template <Real S>
Geodetic<S> from_transverse(S tlat, S tlon, double lon0);
template <Real S>
Vec<Ecef, S> normal_of_transverse(S tlat, S tlon, double lon0);
// Rows E_t, N_t, U in ECEF components; singular only at the transverse poles.
template <Real S>
Rot<Transverse, Ecef, S> transverse_axes(S tlat, S tlon, double lon0);
// sigma: azimuth of transverse north, clockwise from geographic north (1.2); heading = theading +
// sigma.
template <Real S>
S transverse_convergence(S lat, S lon, double lon0);
// Rows of the grid frame in ECEF components: E = N_t, N = -E_t.
template <Real S>
Rot<Grid, Ecef, S> grid_axes(S tlat, S tlon, double lon0);

// K of 2.1: horizontal rate of the normal (rx, ry) = K (vx, vy); symmetric 2x2.
template <Real S = double>
struct Curvature {
  S xx{}, xy{}, yy{};
};
// a1, a2: components of the polar axis z_e on the frame's two horizontal axes; s = sin(latitude); h
// [m].
template <Real S>
inline Curvature<S> curvature(const Ellipsoid& ell, S a1, S a2, S s, S h) {
  const S w2 = S(1.0) - S(ell.e2) * s * s;
  const S N = S(ell.a) / sqrt(w2);
  const S M = N * S(1.0 - ell.e2) / w2;
  const S k = S(1.0) / (N + h);
  const S q = S(ell.e2) * N / (w2 * (N + h) * (M + h));
  return {k + q * a1 * a1, q * a1 * a2, k + q * a2 * a2};
}

}  // namespace loxo
