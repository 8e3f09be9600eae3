// SPDX-License-Identifier: Apache-2.0
#include "loxo/ins/earth_model.hpp"

#include "loxo/num/functions.hpp"

namespace loxo {

EarthModel make_earth_model(const Ellipsoid& ell, double lon0) {
  EarthModel m;
  m.a = ell.a;
  m.e2 = ell.e2;
  m.a_polar = ell.a * (1.0 - ell.e2);
  m.inv_a = 1.0 / ell.a;
  m.w_ie = ell.w_ie;
  m.lon0 = lon0;
  sincos(lon0, m.sin_lon0, m.cos_lon0);
  if (ell.g_constant > 0) {
    m.g_eq = ell.g_constant;
    return m;
  }
  const double centrifugal = ell.w_ie * ell.w_ie * ell.a * ell.a * ell.b / ell.gm;
  m.g_eq = 9.7803253359;
  m.g_s = 0.00193185265241;
  m.g_h = 2.0 / ell.a * (1.0 + ell.f + centrifugal);
  m.g_hs = 4.0 * ell.f / ell.a;
  m.g_hh = 3.0 / (ell.a * ell.a);
  m.g_e2 = ell.e2;
  return m;
}

}  // namespace loxo
