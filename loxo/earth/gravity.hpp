// SPDX-License-Identifier: Apache-2.0
// Normal gravity (plumb-line, centrifugal part included), downward along the ellipsoid normal.
// polar.md 3.1.
#pragma once
#include "loxo/earth/ellipsoid.hpp"

namespace loxo {

// gamma(s = sin latitude, h) [m/s^2]: Somigliana with the second-order height term; the constant of
// ell.g_constant where that is set (any height).
template <Real S>
inline S normal_gravity(const Ellipsoid& ell, S s, S h) {
  if (ell.g_constant > 0) return S(ell.g_constant);
  const S s2 = s * s;
  const double m = ell.w_ie * ell.w_ie * ell.a * ell.a * ell.b / ell.gm;
  const S g0 =
      S(9.7803253359) * (S(1.0) + S(0.00193185265241) * s2) / sqrt(S(1.0) - S(ell.e2) * s2);
  const S u = h * S(1.0 / ell.a);
  return g0 * (S(1.0) - S(2.0) * (S(1.0 + ell.f + m) - S(2.0 * ell.f) * s2) * u + S(3.0) * u * u);
}

}  // namespace loxo
