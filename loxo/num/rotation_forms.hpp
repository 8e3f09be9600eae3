// SPDX-License-Identifier: Apache-2.0
// Two other forms of a rotation: the vector that it turns by, and the axes that it turns to.
#pragma once
#include "loxo/num/geometry.hpp"

namespace loxo {

// The inverse of exp_rotation: the turn (rad, at most pi, about itself) of a unit quaternion of
// either sign. Error order: exact to rounding, relative to the vector; singular only in sign at pi.
template <class F, Real S>
Vec<F, S> rotation_vector(const Quat<F, F, S>& q) {
  const S n = sqrt(q.x * q.x + q.y * q.y + q.z * q.z);
  const auto none = n < S(1e-12);  // sin(h)/h is 1 there
  const S k = select(none, S(2.0), S(2.0) * atan2(n, fabs(q.w)) / select(none, S(1.0), n));
  const S s = select(q.w < S(0.0), -k, k);
  return {s * q.x, s * q.y, s * q.z};
}

// C_ab from the axes of A, unit vectors in components of B: its rows.
template <class A, class B, Real S>
Rot<A, B, S> from_axes(const Vec<B, S>& x, const Vec<B, S>& y, const Vec<B, S>& z) {
  Rot<A, B, S> c;
  const Vec<B, S>* rows[3] = {&x, &y, &z};
  for (int i = 0; i < 3; ++i)
    c.m[i][0] = rows[i]->x, c.m[i][1] = rows[i]->y, c.m[i][2] = rows[i]->z;
  return c;
}

}  // namespace loxo
