// SPDX-License-Identifier: Apache-2.0
// The wander-azimuth frame: level, turned with zero vertical transport rate (polar.md 1.3, 2.4).
// Regular everywhere; its azimuth is a memory of where it started.
#pragma once
#include "loxo/ins/geographic.hpp"
#include "loxo/ins/transverse.hpp"

namespace loxo {

struct WanderMechanization : LevelVertical<WanderMechanization> {
  using Frame = Wander;
  static constexpr FrameId kFrame = FrameId::kWander;
  static constexpr bool kTurns = true;
  static constexpr bool kTurnsFast = false;

  template <Real S>
  struct Position {
    Quat<Frame, Ecef, S> q_ne;
    S h{};                  // m
    S kxx{}, kxy{}, kyy{};  // K of the last evaluation: the predictor of the next
  };
  template <Real S>
  struct Local {
    Vec<Frame, S> w_ie, gravity;
    LevelTerms<S> terms;
  };

  // The polar axis resolved in the frame: third column of C_ne.
  template <Real S>
  static Vec<Frame, S> polar_axis(const Quat<Frame, Ecef, S>& q) {
    const S two(2.0);
    return {two * (q.x * q.z + q.w * q.y), two * (q.y * q.z - q.w * q.x),
            S(1.0) - two * (q.x * q.x + q.y * q.y)};
  }
  template <Real S>
  static Local<S> at(const EarthModel& earth, const Vec<Frame, S>& a, S h) {
    const S w(earth.w_ie), zero(0.0);
    Local<S> l;
    l.terms = level_terms(earth, a.x, a.y, a.z, h, UnitAngle<S>{zero, S(1.0)});
    l.w_ie = w * a;
    l.gravity = {zero, zero, -l.terms.gamma};
    return l;
  }
  template <Real S>
  static Local<S> half_way(const EarthModel& earth, const Position<S>& p, const Vec<Frame, S>& v,
                           double dt) {
    const S half(0.5 * dt), zero(0.0);
    const Vec<Frame, S> a = polar_axis(p.q_ne);
    const Vec<Frame, S> turn{-(half * (p.kxy * v.x + p.kyy * v.y)),
                             half * (p.kxx * v.x + p.kxy * v.y), zero};
    const Vec<Frame, S> once = cross(turn, a);
    return at(earth, a - once + S(0.5) * cross(turn, once), p.h + half * v.z);
  }
  // w_ew = (-r_y, r_x, 0), polar.md 2.4
  template <Real S>
  static Vec<Frame, S> transport(const Local<S>& l, const Vec<Frame, S>& v) {
    return {-(l.terms.kxy * v.x + l.terms.kyy * v.y), l.terms.kxx * v.x + l.terms.kxy * v.y,
            S(0.0)};
  }
  template <Real S>
  static Position<S> advance(const EarthModel&, const Position<S>& p, const Local<S>& l,
                             const Vec<Frame, S>& v, double dt) {
    Position<S> q;
    q.q_ne = exp_tiny<Frame, Frame>(S(-dt) * transport(l, v)) * scaled(p.q_ne, toward_unit(p.q_ne));
    q.h = p.h + S(dt) * v.z;
    q.kxx = l.terms.kxx;
    q.kxy = l.terms.kxy;
    q.kyy = l.terms.kyy;
    return q;
  }
  template <Real S>
  static Rot<Frame, Ecef, S> axes(const EarthModel&, const Position<S>& p) {
    return to_matrix(p.q_ne);
  }
  // A new wander frame starts along the geographic axes below 45 degrees of latitude and along the
  // transverse ones above: regular everywhere.
  template <Real S>
  static State<WanderMechanization, S> from_ecef(const EarthModel& earth, const EcefState<S>& e) {
    const auto np = normal_point(earth, e.r);
    const auto polar = fabs(np.n.z) > S(0.70710678118654752);
    const auto t = transverse_position(earth, np.n, np.h);
    const auto ct = transverse_frame_axes<Frame>(earth, t.tlat, t.tlon);
    const UnitAngle<S> lat{np.n.z, hypot(np.n.x, np.n.y)};
    const auto cg = GeographicMechanization::axes(lat, np.n.y / lat.c, np.n.x / lat.c);
    Rot<Frame, Ecef, S> c;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) c.m[i][j] = select(polar, ct.m[i][j], cg.m[i][j]);
    return along(earth, e, np, c);
  }
  // With given axes (rows in ECEF; the third must be the normal).
  template <Real S>
  static State<WanderMechanization, S> along(const EarthModel& earth, const EcefState<S>& e,
                                             const NormalPoint<S>& np,
                                             const Rot<Frame, Ecef, S>& c) {
    auto x = level_from_ecef<WanderMechanization>(e, c);
    x.position.q_ne = to_quaternion(c);
    x.position.h = np.h;
    const auto l = at(earth, polar_axis(x.position.q_ne), np.h);
    x.position.kxx = l.terms.kxx;
    x.position.kxy = l.terms.kxy;
    x.position.kyy = l.terms.kyy;
    return x;
  }
  template <Real S>
  static EcefState<S> to_ecef(const EarthModel& earth, const State<WanderMechanization, S>& x) {
    const auto q_en = normalized(conjugate(x.position.q_ne));
    const auto c_en = to_matrix(q_en);
    return {point_of_normal(earth, Vec<Ecef, S>{c_en.m[0][2], c_en.m[1][2], c_en.m[2][2]},
                            x.position.h),
            c_en * x.v, normalized(q_en * x.q_nb)};
  }
  template <Real S>
  static S nearness(const State<WanderMechanization, S>&, double) {
    return S(0.0);
  }
};

}  // namespace loxo
