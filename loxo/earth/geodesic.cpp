// SPDX-License-Identifier: Apache-2.0
#include "loxo/earth/geodesic.hpp"

#include <GeographicLib/Geodesic.hpp>

#include "loxo/earth/geodetic.hpp"
#include "loxo/num/units.hpp"

namespace loxo {

GeodesicInverse geodesic_inverse(const Ellipsoid& ell, double lat1, double lon1, double lat2,
                                 double lon2) {
  const GeographicLib::Geodesic g(ell.a, ell.f);
  GeodesicInverse r;
  g.Inverse(lat1 / deg, lon1 / deg, lat2 / deg, lon2 / deg, r.distance, r.azimuth1, r.azimuth2);
  r.azimuth1 = wrap_2pi(r.azimuth1 * deg);
  r.azimuth2 = wrap_2pi(r.azimuth2 * deg);
  return r;
}

GeodesicDirect geodesic_direct(const Ellipsoid& ell, double lat1, double lon1, double azimuth,
                               double distance) {
  const GeographicLib::Geodesic g(ell.a, ell.f);
  GeodesicDirect r;
  g.Direct(lat1 / deg, lon1 / deg, azimuth / deg, distance, r.lat, r.lon, r.azimuth2);
  r.lat *= deg;
  r.lon = wrap_pi(r.lon * deg);
  r.azimuth2 = wrap_2pi(r.azimuth2 * deg);
  return r;
}

}  // namespace loxo
