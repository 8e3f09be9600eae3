// SPDX-License-Identifier: Apache-2.0
#include "loxo/earth/transverse.hpp"

#include "loxo/earth/angle.hpp"
#include "loxo/num/lanes.hpp"

namespace loxo {

// polar.md 1.1: x' = z_e, y' = (cos lon0, sin lon0, 0), z' = (-sin lon0, cos lon0, 0).
template <Real S>
TransverseLatLon<S> to_transverse(const Vec<Ecef, S>& n, double lon0) {
  double s0, c0;
  sincos(lon0, s0, c0);
  const S y = n.x * S(c0) + n.y * S(s0);
  const S z = n.y * S(c0) - n.x * S(s0);
  return {atan2(z, sqrt(n.z * n.z + y * y)), longitude_of(y, n.z)};
}

template <Real S>
TransverseLatLon<S> to_transverse(S lat, S lon, double lon0) {
  S sL, cL, sD, cD;
  sincos_latitude(lat, sL, cL);
  sincos(lon - S(lon0), sD, cD);
  const S y = cL * cD, z = cL * sD;
  return {atan2(z, sqrt(sL * sL + y * y)), longitude_of(y, sL)};
}

template <Real S>
Geodetic<S> from_transverse(S tlat, S tlon, double lon0) {
  S sp, cp, sl, cl;
  sincos_latitude(tlat, sp, cp);
  sincos(tlon, sl, cl);
  const S y = cp * sl;
  // At a pole atan2(0, 0) = 0: the longitude is the reference meridian's.
  return {atan2(cp * cl, sqrt(y * y + sp * sp)), wrap_pi(S(lon0) + atan2(sp, y)), S(0.0)};
}

template <Real S>
Vec<Ecef, S> normal_of_transverse(S tlat, S tlon, double lon0) {
  double s0, c0;
  sincos(lon0, s0, c0);
  S sp, cp, sl, cl;
  sincos_latitude(tlat, sp, cp);
  sincos(tlon, sl, cl);
  const S y = cp * sl;
  return {y * S(c0) - sp * S(s0), y * S(s0) + sp * S(c0), cp * cl};
}

template <Real S>
Rot<Transverse, Ecef, S> transverse_axes(S tlat, S tlon, double lon0) {
  double s0, c0;
  sincos(lon0, s0, c0);
  S sp, cp, sl, cl;
  sincos_latitude(tlat, sp, cp);
  sincos(tlon, sl, cl);
  Rot<Transverse, Ecef, S> c;
  c.m[0][0] = cl * S(c0);  // E_t = -sin l x' + cos l y'
  c.m[0][1] = cl * S(s0);
  c.m[0][2] = -sl;
  const S ny = -sp * sl;  // N_t = -sin p cos l x' - sin p sin l y' + cos p z'
  c.m[1][0] = ny * S(c0) - cp * S(s0);
  c.m[1][1] = ny * S(s0) + cp * S(c0);
  c.m[1][2] = -sp * cl;
  const S uy = cp * sl;  // U = n
  c.m[2][0] = uy * S(c0) - sp * S(s0);
  c.m[2][1] = uy * S(s0) + sp * S(c0);
  c.m[2][2] = cp * cl;
  return c;
}

template <Real S>
S transverse_convergence(S lat, S lon, double lon0) {
  S sL, cL, sD, cD;
  sincos_latitude(lat, sL, cL);
  sincos(lon - S(lon0), sD, cD);
  return atan2(cD, -sL * sD);  // polar.md 1.2
}

template <Real S>
Rot<Grid, Ecef, S> grid_axes(S tlat, S tlon, double lon0) {
  const auto t = transverse_axes<S>(tlat, tlon, lon0);
  Rot<Grid, Ecef, S> c;
  for (int j = 0; j < 3; ++j) {
    c.m[0][j] = t.m[1][j];
    c.m[1][j] = -t.m[0][j];
    c.m[2][j] = t.m[2][j];
  }
  return c;
}

#define LOXO_INSTANTIATE(S)                                                   \
  template TransverseLatLon<S> to_transverse<S>(S, S, double);                \
  template TransverseLatLon<S> to_transverse<S>(const Vec<Ecef, S>&, double); \
  template Geodetic<S> from_transverse<S>(S, S, double);                      \
  template Vec<Ecef, S> normal_of_transverse<S>(S, S, double);                \
  template Rot<Transverse, Ecef, S> transverse_axes<S>(S, S, double);         \
  template S transverse_convergence<S>(S, S, double);                         \
  template Rot<Grid, Ecef, S> grid_axes<S>(S, S, double);
LOXO_INSTANTIATE(double)
LOXO_INSTANTIATE(Lanes)
#undef LOXO_INSTANTIATE

}  // namespace loxo
