// SPDX-License-Identifier: Apache-2.0
// Sums of the latitude series of an Ellipsoid (order 8).
#pragma once
#include <limits>

#include "loxo/num/functions.hpp"

namespace loxo {

// sum_j c[j] sin(2 j x) from s = sin x, c = cos x, by Clenshaw.
template <Real S>
inline S sine_sum(const double (&k)[9], S s, S c) {
  const S x = S(2.0) * (c - s) * (c + s);  // 2 cos 2x
  S b1(k[8]), b2(0.0);
  for (int j = 7; j >= 1; --j) {
    const S b0 = x * b1 - b2 + S(k[j]);
    b2 = b1;
    b1 = b0;
  }
  return S(2.0) * s * c * b1;
}

// G = sum_j c[j] cos(2 j m) sin(j d)/sin(d) from cos 2m and cos d: half the divided difference of
// sine_sum over x in [m - d/2, m + d/2], relative to sin(d); regular at d = 0.
template <Real S>
inline S mean_sum(const double (&k)[9], S cos_2m, S cos_d) {
  const S x = S(2.0) * cos_2m, y = S(2.0) * cos_d;
  S t0(1.0), t1 = cos_2m;  // cos 2jm
  S u0(0.0), u1(1.0);      // sin jd / sin d
  S sum = S(k[1]) * t1;
  for (int j = 2; j <= 8; ++j) {
    const S t2 = x * t1 - t0, u2 = y * u1 - u0;
    t0 = t1;
    t1 = t2;
    u0 = u1;
    u1 = u2;
    sum = sum + S(k[j]) * t1 * u1;
  }
  return sum;
}

}  // namespace loxo
