// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/polar_transfer.hpp"

#include "loxo/earth/gravity.hpp"
#include "loxo/num/lanes.hpp"

namespace loxo {
namespace {

// Sines and cosines of the place and what follows from them; no velocity.
template <Real S>
struct Place {
  S sp, cp, sl, cl, g;
  Curvature<S> K;
  Vec<Transverse, S> w_ie;
};
template <Real S>
Curvature<S> curvature_at(const Ellipsoid& earth, S sp, S cp, S sl, S cl, S h) {
  return curvature(earth, -sl, -sp * cl, cp * cl, h);  // 2.2
}
template <Real S>
Place<S> place(const Ellipsoid& earth, S sp, S cp, S sl, S cl, S h) {
  Place<S> p{sp, cp, sl, cl, S(0.0), {}, {}};
  const S a1 = -sl, a2 = -sp * cl, s = cp * cl;
  p.K = curvature_at(earth, sp, cp, sl, cl, h);
  p.g = normal_gravity(earth, s, h);
  const S w(earth.w_ie);
  p.w_ie = {w * a1, w * a2, w * s};  // 3.1
  return p;
}
template <Real S>
Place<S> place(const Ellipsoid& earth, S tlat, S tlon, S h) {
  S sp, cp, sl, cl;
  sincos(tlat, sp, cp);
  sincos(tlon, sl, cl);
  return place(earth, sp, cp, sl, cl, h);
}

// sin and cos of x + d from those of x for a small d: its series to d^6/720, which is below
// rounding for d < 3e-3.
template <Real S>
struct Sines {
  S s, c;
  Sines<S> ahead(S d) const {
    const S d2 = d * d;
    const S sd = d * (S(1.0) - d2 * (S(1.0 / 6) - d2 * S(1.0 / 120)));
    const S cd = S(1.0) - d2 * (S(0.5) - d2 * S(1.0 / 24));
    return {s * cd + c * sd, c * cd - s * sd};
  }
};

// Of transverse latitude, longitude and moved longitude.
template <Real S>
struct Turned {
  Sines<S> p, l, m;
  Turned(const PolarMove& move, const TransverseState<S>& home) {
    Sines<S> turn;
    sincos(home.tlat, p.s, p.c);
    sincos(home.tlon, l.s, l.c);
    sincos(S(move.angle), turn.s, turn.c);
    m = {l.s * turn.c - l.c * turn.s, l.c * turn.c + l.s * turn.s};
  }
};

// w_et = (-r_N, r_E, r_E tan p). 2.2
template <Real S>
Vec<Transverse, S> transport(const Place<S>& p, const Vec<Transverse, S>& v) {
  const S rE = p.K.xx * v.x + p.K.xy * v.y, rN = p.K.xy * v.x + p.K.yy * v.y;
  return {-rN, rE, rE * (p.sp / p.cp)};
}
template <Real S>
TransverseRates<S> rates(const Place<S>& p, const Vec<Transverse, S>& v) {
  return {p.w_ie, transport(p, v), p.g, p.K};
}

// P_m v = K_m^-1 K v, the up component kept. 7.2 E2
template <Real S>
Vec<Transverse, S> rescaled(const Curvature<S>& K, const Curvature<S>& Km,
                            const Vec<Transverse, S>& v) {
  const S rE = K.xx * v.x + K.xy * v.y, rN = K.xy * v.x + K.yy * v.y;
  const S k = S(1.0) / (Km.xx * Km.yy - Km.xy * Km.xy);
  return {k * (Km.yy * rE - Km.xy * rN), k * (Km.xx * rN - Km.xy * rE), v.z};
}

}  // namespace

template <Real S>
TransverseRates<S> transverse_rates(const Ellipsoid& earth, S tlat, S tlon, S h,
                                    const Vec<Transverse, S>& v) {
  return rates(place(earth, tlat, tlon, h), v);
}

template <Real S>
Conversion<S> convert_same_velocity(const TransverseRates<S>& home, const TransverseRates<S>& moved,
                                    const Vec<Transverse, S>& v,
                                    const Rot<Transverse, Body, S>& C_tb) {
  const Vec<Transverse, S> O = moved.w_ie - home.w_ie, E = moved.w_et - home.w_et;
  Vec<Transverse, S> df = cross(O + O + E, v);  // (3)
  df.z = df.z + (moved.g - home.g);             // -dg, dg = (0, 0, -(g_m - g))
  const auto C_bt = transpose(C_tb);
  return {C_bt * df, C_bt * (O + E)};
}

template <Real S>
MovedByPath<S> move_path(const PolarMove& move, const TransverseState<S>& home,
                         const Vec<Body, S>& f) {
  const Turned<S> lines(move, home);
  const Sines<S>&p = lines.p, &l = lines.l, &m = lines.m;
  const Place<S> at = place(move.earth, p.s, p.c, l.s, l.c, home.h);
  const Place<S> to = place(move.earth, p.s, p.c, m.s, m.c, home.h);
  MovedByPath<S> r;
  r.state = home;
  r.state.tlon = home.tlon - S(move.angle);
  r.state.v = rescaled(at.K, to.K, home.v);
  const Vec<Transverse, S> w_et =
      transport(at, home.v);  // the same at both places: the virtual velocity stays
  // v' at home from the recorded specific force. 3.1
  Vec<Transverse, S> a = home.C_tb * f - cross(at.w_ie + at.w_ie + w_et, home.v);
  a.z = a.z - at.g;
  // P_m' v by a central difference along the motion over +-tau: 1e-12 of P_m', itself 2e-7 m/s^2.
  // An aircraft's 300 m/s make 5e-4 rad of it.
  const double tau = 10.0;
  const S dp = S(tau) * -w_et.x, dl = S(tau) * w_et.y / at.cp, dh = S(tau) * home.v.z;
  const auto scaled_at = [&](S sign) {
    const Sines<S> pp = p.ahead(sign * dp), ll = l.ahead(sign * dl), mm = m.ahead(sign * dl);
    const S h = home.h + sign * dh;
    return rescaled(curvature_at(move.earth, pp.s, pp.c, ll.s, ll.c, h),
                    curvature_at(move.earth, pp.s, pp.c, mm.s, mm.c, h), home.v);
  };
  const auto ahead = scaled_at(S(1.0)), behind = scaled_at(S(-1.0));
  const Vec<Transverse, S> a_m = rescaled(at.K, to.K, a) + (ahead - behind) * S(0.5 / tau);
  // f_m - f in the transverse frame, without the recorded force's own rounding.
  Vec<Transverse, S> df = a_m - a + cross(to.w_ie + to.w_ie + w_et, r.state.v) -
                          cross(at.w_ie + at.w_ie + w_et, home.v);
  df.z = df.z + (to.g - at.g);
  const auto C_bt = transpose(home.C_tb);
  r.conversion = {C_bt * df, C_bt * (to.w_ie - at.w_ie)};
  return r;
}

template <Real S>
TransverseState<S> move_state(const PolarMove& move, const TransverseState<S>& home) {
  TransverseState<S> r = home;
  r.tlon = home.tlon - S(move.angle);
  const Turned<S> at(move, home);
  r.v = rescaled(curvature_at(move.earth, at.p.s, at.p.c, at.l.s, at.l.c, home.h),
                 curvature_at(move.earth, at.p.s, at.p.c, at.m.s, at.m.c, home.h), home.v);
  return r;
}

template <Real S>
Conversion<S> convert_velocity(const PolarMove& move, const TransverseState<S>& home, S tlat,
                               S tlon) {
  return convert_same_velocity(transverse_rates(move.earth, home.tlat, home.tlon, home.h, home.v),
                               transverse_rates(move.earth, tlat, tlon, home.h, home.v), home.v,
                               home.C_tb);
}

template <Real S>
void advance_transverse(const Ellipsoid& earth, S& tlat, S& tlon, S h, const Vec<Transverse, S>& v,
                        double dt) {
  const Vec<Transverse, S> w0 = transport(place(earth, tlat, tlon, h), v);
  const S p = tlat - S(0.5 * dt) * w0.x, l = tlon + S(0.5 * dt) * w0.y / cos(tlat);
  const Place<S> mid = place(earth, p, l, h);
  const Vec<Transverse, S> w = transport(mid, v);
  tlat = tlat - S(dt) * w.x;
  tlon = tlon + S(dt) * w.y / mid.cp;
}

template <Real S>
ImuIncrement<S> moved_increment(const ImuIncrement<S>& home, const Conversion<S>& c) {
  ImuIncrement<S> r = home;
  r.dtheta = home.dtheta + c.dw * S(home.dt);
  r.dv = home.dv + c.df * S(home.dt);
  return r;
}

template <Real S>
TransverseState<S> to_transverse_state(const Ellipsoid& earth, double lon0, const EcefPose<S>& e) {
  const NormalHeight<S> nh = to_normal(earth, e.r);
  const TransverseLatLon<S> t = to_transverse(nh.n, lon0);
  const auto C_te = transverse_axes<S>(t.tlat, t.tlon, lon0);
  return {t.tlat, t.tlon, nh.h, C_te * e.v, C_te * e.C_eb};
}

template <Real S>
EcefPose<S> to_ecef_pose(const Ellipsoid& earth, double lon0, const TransverseState<S>& t) {
  const auto C_et = transpose(transverse_axes<S>(t.tlat, t.tlon, lon0));
  return {from_normal(earth, NormalHeight<S>{normal_of_transverse<S>(t.tlat, t.tlon, lon0), t.h}),
          C_et * t.v, C_et * t.C_tb};
}

#define LOXO_INSTANTIATE(S)                                                                      \
  template TransverseRates<S> transverse_rates<S>(const Ellipsoid&, S, S, S,                     \
                                                  const Vec<Transverse, S>&);                    \
  template Conversion<S> convert_same_velocity<S>(                                               \
      const TransverseRates<S>&, const TransverseRates<S>&, const Vec<Transverse, S>&,           \
      const Rot<Transverse, Body, S>&);                                                          \
  template MovedByPath<S> move_path<S>(const PolarMove&, const TransverseState<S>&,              \
                                       const Vec<Body, S>&);                                     \
  template TransverseState<S> move_state<S>(const PolarMove&, const TransverseState<S>&);        \
  template Conversion<S> convert_velocity<S>(const PolarMove&, const TransverseState<S>&, S, S); \
  template void advance_transverse<S>(const Ellipsoid&, S&, S&, S, const Vec<Transverse, S>&,    \
                                      double);                                                   \
  template ImuIncrement<S> moved_increment<S>(const ImuIncrement<S>&, const Conversion<S>&);     \
  template TransverseState<S> to_transverse_state<S>(const Ellipsoid&, double,                   \
                                                     const EcefPose<S>&);                        \
  template EcefPose<S> to_ecef_pose<S>(const Ellipsoid&, double, const TransverseState<S>&);
LOXO_INSTANTIATE(double)
LOXO_INSTANTIATE(Lanes)
#undef LOXO_INSTANTIATE

}  // namespace loxo
