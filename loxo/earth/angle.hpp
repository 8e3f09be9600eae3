// SPDX-License-Identifier: Apache-2.0
// Angles at their special places: the double nearest to 90 deg means the pole itself.
#pragma once
#include "loxo/num/functions.hpp"

namespace loxo {

inline constexpr double kPiDouble = 3.141592653589793;  // the doubles nearest to pi, pi/2, 2 pi …
inline constexpr double kHalfPi = 1.5707963267948966;
inline constexpr double kTwoPi = 6.283185307179586;
inline constexpr double kTwoPiRest = 2.4492935982947064e-16;  // … and what 2 pi is more

// sin and cos of a latitude: cos is 0 exactly at |lat| = pi/2 (as a double), so that a point given
// as 90 deg is on the axis, not 0.4 nm beside it with a longitude.
template <Real S>
inline void sincos_latitude(S lat, S& s, S& c) {
  sincos(lat, s, c);
  c = select(fabs(lat) >= S(kHalfPi), S(0.0), c);
}

// A longitude as atan2 finds it, -pi brought to pi (y = -0).
template <Real S>
inline S longitude_of(S y, S x) {
  const S l = atan2(y, x);
  return select(l <= S(-kPiDouble), S(kPiDouble), l);
}

}  // namespace loxo
