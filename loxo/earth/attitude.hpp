// SPDX-License-Identifier: Apache-2.0
// Euler angles of a body (RFU) in a level frame (ENU-like). polar.md section 0.
#pragma once
#include "loxo/earth/frames.hpp"
#include "loxo/num/geometry.hpp"

namespace loxo {

// heading [rad] clockwise from the frame's north in [0, 2 pi) on output, pitch bow up + [-pi/2,
// pi/2], roll starboard down + (-pi, pi].
template <Real S = double>
struct Euler {
  S heading{}, pitch{}, roll{};
};

// C_nb = Rz(heading) Rx(pitch) Ry(roll).
template <class N, Real S>
Rot<N, Body, S> to_matrix(const Euler<S>& e) {
  S sp, cp, st, ct, sg, cg;
  sincos(e.heading, sp, cp);
  sincos(e.pitch, st, ct);
  sincos(e.roll, sg, cg);
  Rot<N, Body, S> c;
  c.m[0][0] = cp * cg + sp * st * sg;
  c.m[0][1] = sp * ct;
  c.m[0][2] = cp * sg - sp * st * cg;
  c.m[1][0] = -sp * cg + cp * st * sg;
  c.m[1][1] = cp * ct;
  c.m[1][2] = -sp * sg - cp * st * cg;
  c.m[2][0] = -ct * sg;
  c.m[2][1] = st;
  c.m[2][2] = ct * cg;
  return c;
}
// Regular but for |pitch| = 90 deg, where heading and roll are one angle.
template <class N, Real S>
Euler<S> to_euler(const Rot<N, Body, S>& c) {
  Euler<S> e;
  e.pitch = atan2(c.m[2][1], sqrt(c.m[0][1] * c.m[0][1] + c.m[1][1] * c.m[1][1]));
  e.roll = atan2(-c.m[2][0], c.m[2][2]);
  const S h = atan2(c.m[0][1], c.m[1][1]);
  e.heading = select(h < S(0.0), h + S(6.283185307179586476925), h);
  return e;
}

}  // namespace loxo
