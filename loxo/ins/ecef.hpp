// SPDX-License-Identifier: Apache-2.0
// The Earth-fixed frame: no level axes, no singularity. Gravity needs the ellipsoid normal: found
// from the last one by one Newton step. polar.md 3.1.
#pragma once
#include "loxo/ins/mechanization.hpp"

namespace loxo {

struct EcefMechanization {
  using Frame = Ecef;
  static constexpr FrameId kFrame = FrameId::kEcef;
  static constexpr bool kTurns = false;  // no transport rate
  static constexpr bool kTurnsFast = false;

  template <Real S>
  struct Position {
    Point<Ecef, S> r;  // m
    Vec<Ecef, S> n;    // the normal here
    S h{}, zeta{};  // height [m]; e2 N sin(latitude) of the last evaluation: the guess of the next
  };
  template <Real S>
  struct Local {
    Vec<Frame, S> w_ie, gravity;
    Point<Ecef, S> r;
    NormalPoint<S> np;
    S inv_radius{};  // 1/(N + h)
  };

  template <Real S>
  static Local<S> half_way(const EarthModel& earth, const Position<S>& p, const Vec<Frame, S>& v,
                           double dt) {
    const S zero(0.0);
    Local<S> l;
    l.r = p.r + S(0.5 * dt) * v;
    l.np = refine_normal(earth, l.r, p.zeta);
    l.gravity = -gravity_of(earth, l.np.s2, l.np.inv_u, l.np.h) * l.np.n;
    l.w_ie = {zero, zero, S(earth.w_ie)};
    l.inv_radius = S(earth.inv_a);
    return l;
  }
  template <Real S>
  static Vec<Frame, S> transport(const Local<S>&, const Vec<Frame, S>&) {
    return {};
  }
  // Normal and height follow from mid-step by the chord: n to 1e-2 of the half step's turn, h to
  // the third order.
  template <Real S>
  static Position<S> advance(const EarthModel&, const Position<S>& p, const Local<S>& l,
                             const Vec<Frame, S>& v, double dt) {
    Position<S> q;
    q.r = p.r + S(dt) * v;
    const Vec<Ecef, S> d = q.r - l.r;
    const S up = dot(d, l.np.n);
    const Vec<Ecef, S> level = d - up * l.np.n;
    q.n = l.np.n + l.inv_radius * level;
    q.h = l.np.h + up + S(0.5) * l.inv_radius * dot(level, level);
    q.zeta = l.np.zeta;
    return q;
  }
  template <Real S>
  static State<EcefMechanization, S> from_ecef(const EarthModel& earth, const EcefState<S>& e) {
    const auto np = normal_point(earth, e.r);
    return {e.q_eb, e.v, {e.r, np.n, np.h, np.zeta}};
  }
  template <Real S>
  static EcefState<S> to_ecef(const EarthModel&, const State<EcefMechanization, S>& x) {
    return {x.position.r, x.v, x.q_nb};
  }
  template <Real S>
  static S height(const State<EcefMechanization, S>& x) {
    return x.position.h;
  }
  template <Real S>
  static S up_velocity(const State<EcefMechanization, S>& x) {
    return dot(x.v, x.position.n);
  }
  template <Real S>
  static State<EcefMechanization, S> with_vertical(State<EcefMechanization, S> x, S h, S vu) {
    auto& p = x.position;
    x.v = x.v + (vu - dot(x.v, p.n)) * p.n;
    p.r = p.r + (h - p.h) * p.n;
    p.h = h;
    return x;
  }
  template <Real S>
  static S nearness(const State<EcefMechanization, S>&, double) {
    return S(0.0);
  }
};

}  // namespace loxo
