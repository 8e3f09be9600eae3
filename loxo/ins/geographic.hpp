// SPDX-License-Identifier: Apache-2.0
// The geographic frame: level east-north-up by latitude and longitude. Singular at the poles: its
// azimuth turns by v_E tan(L)/(N + h), so with miss distance d the position error is about 600 (v
// T/d)^2 m (polar.md 3.4).
#pragma once
#include "loxo/ins/mechanization.hpp"

namespace loxo {

struct GeographicMechanization : LevelVertical<GeographicMechanization> {
  using Frame = Geographic;
  static constexpr FrameId kFrame = FrameId::kGeographic;
  static constexpr bool kTurns = true;
  static constexpr bool kTurnsFast = true;

  template <Real S>
  struct Position {
    UnitAngle<S> lat;  // geodetic
    S lon{}, h{};      // rad (runs on beyond pi), m
    S k_e{}, k_n{},
        inv_c{};  // 1/(N+h), 1/(M+h), 1/cos(lat) of the last evaluation: the predictor of the next
  };
  template <Real S>
  struct Local {
    Vec<Frame, S> w_ie, gravity;
    LevelTerms<S> terms;
  };

  template <Real S>
  static Local<S> at(const EarthModel& earth, const UnitAngle<S>& lat, S h) {
    const S w(earth.w_ie), zero(0.0);
    Local<S> l;
    l.terms = level_terms(earth, zero, lat.c, lat.s, h, lat);
    l.w_ie = {zero, w * lat.c, w * lat.s};
    l.gravity = {zero, zero, -l.terms.gamma};
    return l;
  }
  template <Real S>
  static Local<S> half_way(const EarthModel& earth, const Position<S>& p, const Vec<Frame, S>& v,
                           double dt) {
    const S half(0.5 * dt);
    return at(earth, leaned(p.lat, half * (p.k_n * v.y)), p.h + half * v.z);
  }
  // w_eg = (-vN/(M+h), vE/(N+h), vE tan(L)/(N+h)), polar.md 2.4
  template <Real S>
  static Vec<Frame, S> transport(const Local<S>& l, const Vec<Frame, S>& v) {
    const S r_e = l.terms.kxx * v.x;
    return {-(l.terms.kyy * v.y), r_e, r_e * l.terms.tangent};
  }
  template <Real S>
  static Position<S> advance(const EarthModel&, const Position<S>& p, const Local<S>& l,
                             const Vec<Frame, S>& v, double dt) {
    const S T(dt);
    Position<S> q;
    q.lat = turned(p.lat, T * (l.terms.kyy * v.y));
    q.lon = p.lon + T * (l.terms.kxx * v.x * l.terms.inv_c);
    q.h = p.h + T * v.z;
    q.k_e = l.terms.kxx;
    q.k_n = l.terms.kyy;
    q.inv_c = l.terms.inv_c;
    return q;
  }
  // C_ne: rows east, north, up.
  template <Real S>
  static Rot<Frame, Ecef, S> axes(const UnitAngle<S>& lat, S slon, S clon) {
    Rot<Frame, Ecef, S> c;
    c.m[0][0] = -slon;
    c.m[0][1] = clon;
    c.m[1][0] = -lat.s * clon;
    c.m[1][1] = -lat.s * slon;
    c.m[1][2] = lat.c;
    c.m[2][0] = lat.c * clon;
    c.m[2][1] = lat.c * slon;
    c.m[2][2] = lat.s;
    return c;
  }
  template <Real S>
  static Rot<Frame, Ecef, S> axes(const EarthModel&, const Position<S>& p) {
    S s, c;
    sincos(p.lon, s, c);
    return axes(p.lat, s, c);
  }
  // At a pole itself longitude is taken as 0; velocity and attitude agree with it.
  template <Real S>
  static State<GeographicMechanization, S> from_ecef(const EarthModel& earth,
                                                     const EcefState<S>& e) {
    const auto np = normal_point(earth, e.r);
    const S c = hypot(np.n.x, np.n.y);
    const auto at_pole = c < S(1e-300);
    const S safe = select(at_pole, S(1.0), c);
    const S slon = select(at_pole, S(0.0), np.n.y / safe),
            clon = select(at_pole, S(1.0), np.n.x / safe);
    Position<S> p;
    p.lat = {np.n.z, c};
    p.lon = atan2(slon, clon);
    p.h = np.h;
    const auto l = at(earth, p.lat, p.h);
    p.k_e = l.terms.kxx;
    p.k_n = l.terms.kyy;
    p.inv_c = l.terms.inv_c;
    auto x = level_from_ecef<GeographicMechanization>(e, axes(p.lat, slon, clon));
    x.position = p;
    return x;
  }
  template <Real S>
  static EcefState<S> to_ecef(const EarthModel& earth, const State<GeographicMechanization, S>& x) {
    return level_to_ecef(earth, x, axes(earth, x.position), x.position.h);
  }
  template <Real S>
  static S nearness(const State<GeographicMechanization, S>& x, double dt) {
    const auto& p = x.position;
    const S run = S(dt) * p.k_e * p.inv_c;
    return run * run * (x.v.x * x.v.x + x.v.y * x.v.y);
  }
};

}  // namespace loxo
