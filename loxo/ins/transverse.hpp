// SPDX-License-Identifier: Apache-2.0
// The transverse frame (polar.md 1, 2.2): regular at the poles, singular at the transverse poles,
// on the equator 90 degrees from the reference meridian. And the same on the virtual sphere (2.3):
// other sums, equal to rounding.
#pragma once
#include "loxo/ins/mechanization.hpp"

namespace loxo {

// Transverse latitude p and longitude l, shared with the grid frame.
template <Real S>
struct TransversePosition {
  UnitAngle<S> tlat, tlon;
  S h{};  // m
  S kxx{}, kxy{}, kyy{},
      inv_c{};  // K in the frame's own axes and 1/cos(p) of the last evaluation: the predictor
};
// E_t, N_t, U in ECEF components, polar.md 1.1.
template <class Frame, Real S>
inline Rot<Frame, Ecef, S> transverse_frame_axes(const EarthModel& earth, const UnitAngle<S>& p,
                                                 const UnitAngle<S>& l) {
  const S s0(earth.sin_lon0), c0(earth.cos_lon0);
  auto row = [&](S x, S y, S z, S* out) {  // x x' + y y' + z z' with x' = z_e
    out[0] = y * c0 - z * s0;
    out[1] = y * s0 + z * c0;
    out[2] = x;
  };
  Rot<Frame, Ecef, S> c;
  row(-l.s, l.c, S(0.0), c.m[0]);
  row(-p.s * l.c, -p.s * l.s, p.c, c.m[1]);
  row(p.c * l.c, p.c * l.s, p.s, c.m[2]);
  return c;
}
template <Real S>
inline TransversePosition<S> transverse_position(const EarthModel& earth, const Vec<Ecef, S>& n,
                                                 S h) {
  const S s0(earth.sin_lon0), c0(earth.cos_lon0);
  const S along = n.x * c0 + n.y * s0;  // n.y'
  TransversePosition<S> p;
  p.tlat.s = n.y * c0 - n.x * s0;
  p.tlat.c = hypot(along, n.z);
  p.tlon = {along / p.tlat.c, n.z / p.tlat.c};
  p.h = h;
  return p;
}
template <Real S>
inline void keep_predictor(TransversePosition<S>& p, const LevelTerms<S>& t) {
  p.kxx = t.kxx;
  p.kxy = t.kxy;
  p.kyy = t.kyy;
  p.inv_c = t.inv_c;
}

// What the two frames on this position share: the way to ECEF and back, and where they are
// singular.
template <class Self>
struct OnTransversePosition : LevelVertical<Self> {
  template <Real S>
  using Position = TransversePosition<S>;
  template <Real S>
  static State<Self, S> from_ecef(const EarthModel& earth, const EcefState<S>& e) {
    const auto np = normal_point(earth, e.r);
    auto p = transverse_position(earth, np.n, np.h);
    keep_predictor(p, Self::at(earth, p.tlat, p.tlon, p.h).terms);
    auto x = level_from_ecef<Self>(e, Self::axes(earth, p));
    x.position = p;
    return x;
  }
  template <Real S>
  static EcefState<S> to_ecef(const EarthModel& earth, const State<Self, S>& x) {
    return level_to_ecef(earth, x, Self::axes(earth, x.position), x.position.h);
  }
  template <Real S>
  static S nearness(const State<Self, S>& x, double dt) {
    const auto& p = x.position;
    const S run = S(dt) * p.kxx * p.inv_c;
    return run * run * (x.v.x * x.v.x + x.v.y * x.v.y);
  }
};

template <bool kVirtualSphere>
struct TransverseOn : OnTransversePosition<TransverseOn<kVirtualSphere>> {
  using Frame = Transverse;
  using Self = TransverseOn<kVirtualSphere>;
  static constexpr FrameId kFrame = FrameId::kTransverse;
  static constexpr bool kTurns = true;
  static constexpr bool kTurnsFast = false;

  template <Real S>
  using Position = TransversePosition<S>;
  template <Real S>
  struct Local {
    Vec<Frame, S> w_ie, gravity;
    LevelTerms<S> terms;
    S radius{}, inv_radius{};  // of the virtual sphere [m]; any positive number
  };
  // r_E, r_N: rate of the normal along E_t and N_t [rad/s]. On the virtual sphere through u = Rv K
  // v.
  template <Real S>
  static void normal_rate(const Local<S>& l, const Vec<Frame, S>& v, S& r_e, S& r_n) {
    if constexpr (kVirtualSphere) {
      const S u_e = l.radius * (l.terms.kxx * v.x + l.terms.kxy * v.y);
      const S u_n = l.radius * (l.terms.kxy * v.x + l.terms.kyy * v.y);
      r_e = u_e * l.inv_radius;
      r_n = u_n * l.inv_radius;
    } else {
      r_e = l.terms.kxx * v.x + l.terms.kxy * v.y;
      r_n = l.terms.kxy * v.x + l.terms.kyy * v.y;
    }
  }

  template <Real S>
  static Local<S> at(const EarthModel& earth, const UnitAngle<S>& p, const UnitAngle<S>& l, S h) {
    const S w(earth.w_ie), zero(0.0);
    const S a1 = -l.s, a2 = -(p.s * l.c), sn = p.c * l.c;
    Local<S> local;
    local.terms = level_terms(earth, a1, a2, sn, h, p);
    local.w_ie = {w * a1, w * a2, w * sn};
    local.gravity = {zero, zero, -local.terms.gamma};
    local.radius = S(earth.a);
    local.inv_radius = S(earth.inv_a);
    return local;
  }
  template <Real S>
  static Local<S> half_way(const EarthModel& earth, const Position<S>& p, const Vec<Frame, S>& v,
                           double dt) {
    const S half(0.5 * dt);
    const S r_e = p.kxx * v.x + p.kxy * v.y, r_n = p.kxy * v.x + p.kyy * v.y;
    return at(earth, leaned(p.tlat, half * r_n), leaned(p.tlon, half * (r_e * p.inv_c)),
              p.h + half * v.z);
  }
  // w_et = (-r_N, r_E, r_E tan p), polar.md 2.2
  template <Real S>
  static Vec<Frame, S> transport(const Local<S>& l, const Vec<Frame, S>& v) {
    S r_e, r_n;
    normal_rate(l, v, r_e, r_n);
    return {-r_n, r_e, r_e * l.terms.tangent};
  }
  template <Real S>
  static Position<S> advance(const EarthModel&, const Position<S>& p, const Local<S>& l,
                             const Vec<Frame, S>& v, double dt) {
    const S T(dt);
    S r_e, r_n;
    normal_rate(l, v, r_e, r_n);
    Position<S> q;
    q.tlat = turned(p.tlat, T * r_n);
    q.tlon = turned(p.tlon, T * (r_e * l.terms.inv_c));
    q.h = p.h + T * v.z;
    keep_predictor(q, l.terms);
    return q;
  }
  template <Real S>
  static Rot<Frame, Ecef, S> axes(const EarthModel& earth, const Position<S>& p) {
    return transverse_frame_axes<Frame>(earth, p.tlat, p.tlon);
  }
};

using TransverseMechanization = TransverseOn<false>;
using VirtualSphereMechanization = TransverseOn<true>;

}  // namespace loxo
