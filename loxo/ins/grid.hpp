// SPDX-License-Identifier: Apache-2.0
// The grid frame: the transverse frame turned by a constant, E = N_t, N = -E_t (polar.md 1.3, 2.4).
#pragma once
#include "loxo/ins/transverse.hpp"

namespace loxo {

struct GridMechanization : OnTransversePosition<GridMechanization> {
  using Frame = Grid;
  static constexpr FrameId kFrame = FrameId::kGrid;
  static constexpr bool kTurns = true;
  static constexpr bool kTurnsFast = false;

  template <Real S>
  using Position = TransversePosition<S>;
  template <Real S>
  struct Local {
    Vec<Frame, S> w_ie, gravity;
    LevelTerms<S> terms;
  };

  template <Real S>
  static Local<S> at(const EarthModel& earth, const UnitAngle<S>& p, const UnitAngle<S>& l, S h) {
    const S w(earth.w_ie), zero(0.0);
    const S a1 = -(p.s * l.c), a2 = l.s, sn = p.c * l.c;
    Local<S> local;
    local.terms = level_terms(earth, a1, a2, sn, h, p);
    local.w_ie = {w * a1, w * a2, w * sn};
    local.gravity = {zero, zero, -local.terms.gamma};
    return local;
  }
  // p' = r_x, l' = -r_y / cos p
  template <Real S>
  static Local<S> half_way(const EarthModel& earth, const Position<S>& p, const Vec<Frame, S>& v,
                           double dt) {
    const S half(0.5 * dt);
    const S rx = p.kxx * v.x + p.kxy * v.y, ry = p.kxy * v.x + p.kyy * v.y;
    return at(earth, leaned(p.tlat, half * rx), leaned(p.tlon, -(half * (ry * p.inv_c))),
              p.h + half * v.z);
  }
  // w_eG = (-r_y, r_x, -r_y tan p), polar.md 2.4
  template <Real S>
  static Vec<Frame, S> transport(const Local<S>& l, const Vec<Frame, S>& v) {
    const S rx = l.terms.kxx * v.x + l.terms.kxy * v.y, ry = l.terms.kxy * v.x + l.terms.kyy * v.y;
    return {-ry, rx, -(ry * l.terms.tangent)};
  }
  template <Real S>
  static Position<S> advance(const EarthModel&, const Position<S>& p, const Local<S>& l,
                             const Vec<Frame, S>& v, double dt) {
    const S T(dt);
    const S rx = l.terms.kxx * v.x + l.terms.kxy * v.y, ry = l.terms.kxy * v.x + l.terms.kyy * v.y;
    Position<S> q;
    q.tlat = turned(p.tlat, T * rx);
    q.tlon = turned(p.tlon, -(T * (ry * l.terms.inv_c)));
    q.h = p.h + T * v.z;
    keep_predictor(q, l.terms);
    return q;
  }
  template <Real S>
  static Rot<Frame, Ecef, S> axes(const EarthModel& earth, const Position<S>& p) {
    const auto t = transverse_frame_axes<Transverse>(earth, p.tlat, p.tlon);
    Rot<Frame, Ecef, S> c;
    for (int j = 0; j < 3; ++j) {
      c.m[0][j] = t.m[1][j];
      c.m[1][j] = -t.m[0][j];
      c.m[2][j] = t.m[2][j];
    }
    return c;
  }
};

}  // namespace loxo
