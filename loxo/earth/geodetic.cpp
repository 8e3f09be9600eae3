// SPDX-License-Identifier: Apache-2.0
#include "loxo/earth/geodetic.hpp"

#include "loxo/earth/angle.hpp"
#include "loxo/earth/inner.hpp"

namespace loxo {

template <Real S>
Point<Ecef, S> to_ecef(const Ellipsoid& ell, const Geodetic<S>& p) {
  return from_normal(ell, NormalHeight<S>{normal_of(p.lat, p.lon), p.h});
}

namespace {
// Geodetic latitude's sine and cosine and the height, from the distances to the axis and to the
// equator. Bowring's step from the parametric latitude, three times: 1e-5, 1e-11, then rounding,
// for |h| < 100 km; still rounding at 20000 km.
template <Real S>
void meridian_plane(const Ellipsoid& ell, S axis, S z, S& sin_lat, S& cos_lat, S& h) {
  S u = S(1.0 - ell.f) * axis;  // cosine and sine of the parametric latitude, times a length
  S v = z;
  // At the centre of the Earth any direction will do.
  const S tiny(1e-300);
  S num = z, den = axis;
  for (int i = 0; i < 3; ++i) {
    const S k = S(1.0) / sqrt(max(u * u + v * v, tiny));
    const S cb = u * k, sb = v * k;
    num = z + S(ell.ep2 * ell.b) * sb * sb * sb;
    den = axis - S(ell.e2 * ell.a) * cb * cb * cb;
    u = den;
    v = S(1.0 - ell.f) * num;
  }
  const S length = sqrt(max(num * num + den * den, tiny));
  sin_lat = num / length;
  cos_lat = den / length;
  // From the differences to the foot point, which are small: the rounding of 6e6 m enters once.
  const S N = S(ell.a) / sqrt(S(1.0) - S(ell.e2) * sin_lat * sin_lat);
  h = (axis - N * cos_lat) * cos_lat + (z - S(1.0 - ell.e2) * N * sin_lat) * sin_lat;
}
}  // namespace

template <Real S>
Geodetic<S> to_geodetic(const Ellipsoid& ell, const Point<Ecef, S>& r) {
  S s, c, h;
  meridian_plane(ell, sqrt(r.x * r.x + r.y * r.y), r.z, s, c, h);
  const S lon = quick_atan2(r.y, r.x);
  return {quick_atan2(s, c), select(lon <= S(-kPiDouble), S(kPiDouble), lon), h};
}

template <Real S>
NormalHeight<S> to_normal(const Ellipsoid& ell, const Point<Ecef, S>& r) {
  const S axis = sqrt(r.x * r.x + r.y * r.y);
  S s, c, h;
  meridian_plane(ell, axis, r.z, s, c, h);
  const auto on_axis = axis <= S(0.0);
  const S k = c / select(on_axis, S(1.0), axis);
  return {{r.x * k, r.y * k, s}, h};
}

template <Real S>
Point<Ecef, S> from_normal(const Ellipsoid& ell, const NormalHeight<S>& p) {
  const S N = prime_vertical_radius(ell, p.n.z);
  const S k = N + p.h;
  return {k * p.n.x, k * p.n.y, (N * S(1.0 - ell.e2) + p.h) * p.n.z};
}

template <Real S>
Vec<Ecef, S> normal_of(S lat, S lon) {
  S sL, cL, sl, cl;
  sincos_latitude(lat, sL, cL);
  sincos(lon, sl, cl);
  return {cL * cl, cL * sl, sL};
}

template <Real S>
Rot<Geographic, Ecef, S> geographic_axes(S lat, S lon) {
  S sL, cL, sl, cl;
  sincos_latitude(lat, sL, cL);
  sincos(lon, sl, cl);
  Rot<Geographic, Ecef, S> c;
  c.m[0][0] = -sl;
  c.m[0][1] = cl;
  c.m[0][2] = S(0.0);
  c.m[1][0] = -sL * cl;
  c.m[1][1] = -sL * sl;
  c.m[1][2] = cL;
  c.m[2][0] = cL * cl;
  c.m[2][1] = cL * sl;
  c.m[2][2] = sL;
  return c;
}

#define LOXO_INSTANTIATE(S)                                                         \
  template Point<Ecef, S> to_ecef<S>(const Ellipsoid&, const Geodetic<S>&);         \
  template Geodetic<S> to_geodetic<S>(const Ellipsoid&, const Point<Ecef, S>&);     \
  template NormalHeight<S> to_normal<S>(const Ellipsoid&, const Point<Ecef, S>&);   \
  template Point<Ecef, S> from_normal<S>(const Ellipsoid&, const NormalHeight<S>&); \
  template Vec<Ecef, S> normal_of<S>(S, S);                                         \
  template Rot<Geographic, Ecef, S> geographic_axes<S>(S, S);
LOXO_INSTANTIATE(double)
LOXO_INSTANTIATE(Lanes)
#undef LOXO_INSTANTIATE

}  // namespace loxo
