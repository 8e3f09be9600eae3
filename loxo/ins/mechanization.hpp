// SPDX-License-Identifier: Apache-2.0
// What the frame policies share: the state, the common meeting place (ECEF), and the curvature and
// gravity of a level frame with one square root and one division a step.
#pragma once
#include <concepts>

#include "loxo/earth/frames.hpp"
#include "loxo/ins/earth_model.hpp"
#include "loxo/ins/increments.hpp"

namespace loxo {

// A navigation state in the frame of policy M. A value.
template <class M, Real S = double>
struct State {
  Quat<typename M::Frame, Body, S> q_nb;  // attitude, unit
  Vec<typename M::Frame, S> v;            // velocity relative to the Earth [m/s]
  typename M::template Position<S> position;
};

// The same in ECEF, where all frames meet: regular everywhere.
template <Real S = double>
struct EcefState {
  Point<Ecef, S> r;          // m
  Vec<Ecef, S> v;            // m/s
  Quat<Ecef, Body, S> q_eb;  // attitude, unit
};

// A policy says only what the frame knows. Local<S> is what it knows at mid-step.
template <class M, class S>
concept Mechanization = Real<S> &&
    requires(const EarthModel& earth, State<M, S> x, const EcefState<S>& e, double dt,
             const typename M::template Local<S>& local, const Vec<typename M::Frame, S>& v, S h) {
  { M::kFrame } -> std::convertible_to<FrameId>;
  // Half a step ahead at velocity v: Earth rate, gravity, curvature there. Error order dt^2.
  { M::half_way(earth, x.position, v, dt) } -> std::same_as<typename M::template Local<S>>;
  { M::transport(local, v) } -> std::same_as<Vec<typename M::Frame, S>>;  // w_en [rad/s]
  { M::advance(earth, x.position, local, v, dt) } -> std::same_as<typename M::template Position<S>>;
  { M::from_ecef(earth, e) } -> std::same_as<State<M, S>>;
  { M::to_ecef(earth, x) } -> std::same_as<EcefState<S>>;
  { M::height(x) } -> std::same_as<S>;                         // ellipsoidal [m]
  { M::up_velocity(x) } -> std::same_as<S>;                    // m/s
  { M::with_vertical(x, h, h) } -> std::same_as<State<M, S>>;  // height [m], upward velocity [m/s]
  // Square of the nearness to the frame's singularity: (distance run in one step / distance to
  // it)^2.
  { M::nearness(x, dt) } -> std::same_as<S>;
};

// The vertical channel of every level frame: height in the position, upward velocity third.
template <class Self>
struct LevelVertical {
  template <Real S>
  static S height(const State<Self, S>& x) {
    return x.position.h;
  }
  template <Real S>
  static S up_velocity(const State<Self, S>& x) {
    return x.v.z;
  }
  template <Real S>
  static State<Self, S> with_vertical(State<Self, S> x, S h, S vu) {
    x.position.h = h;
    x.v.z = vu;
    return x;
  }
};

// An angle as sine and cosine, kept of unit length: no trigonometry in a step, exact at 0 and 90
// degrees.
template <Real S>
struct UnitAngle {
  S s{}, c{1.0};
};
// Turned by d, |d| <= 0.01 rad: error below 1e-17.
template <Real S>
inline UnitAngle<S> turned(const UnitAngle<S>& a, S d) {
  const S d2 = d * d;
  const S sd = d - (d * d2) * (S(1.0 / 6.0) - d2 * S(1.0 / 120.0));
  const S vd = d2 * (S(0.5) - d2 * (S(1.0 / 24.0) - d2 * S(1.0 / 720.0)));  // 1 - cos(d)
  // Off unit length by the rounding of the last step and no more: that one is mended, while this
  // one turns.
  const S k = S(1.5) - S(0.5) * (a.s * a.s + a.c * a.c);
  return {(a.s + (a.c * sd - a.s * vd)) * k, (a.c - (a.s * sd + a.c * vd)) * k};
}
// The same without the care for its length: for an angle that is looked at and not kept.
template <Real S>
inline UnitAngle<S> leaned(const UnitAngle<S>& a, S d) {
  const S d2 = d * d;
  const S sd = d - (d * d2) * (S(1.0 / 6.0) - d2 * S(1.0 / 120.0));
  const S vd = d2 * (S(0.5) - d2 * (S(1.0 / 24.0) - d2 * S(1.0 / 720.0)));  // 1 - cos(d)
  return {a.s + (a.c * sd - a.s * vd), a.c - (a.s * sd + a.c * vd)};
}

// Normal gravity [m/s^2] from s^2 = sin^2(latitude), 1/sqrt(1 - e2 s^2) and h [m]. polar.md 3.1, as
// normal_gravity().
template <Real S>
inline S gravity_of(const EarthModel& earth, S s2, S inv_u, S h) {
  return S(earth.g_eq) * (S(1.0) + S(earth.g_s) * s2) * inv_u *
         (S(1.0) - (S(earth.g_h) - S(earth.g_hs) * s2) * h + S(earth.g_hh) * (h * h));
}

// The universal curvature of a level frame and gravity at one place. polar.md 2.1, 3.1.
template <Real S>
struct LevelTerms {
  S kxx{}, kxy{}, kyy{};  // K [1/m]: horizontal rate of the normal = K v
  S tangent{};            // tan of the frame's own latitude (0 where it has none)
  S inv_c{};              // 1/cos of it
  S gamma{};              // m/s^2, downward
};
// a1, a2: components of the polar axis on the frame's horizontal axes; sn = sin(latitude); h [m];
// own: the frame's own latitude. One root, one division: 1/(D1 D2 u c) and products.
template <Real S>
inline LevelTerms<S> level_terms(const EarthModel& earth, S a1, S a2, S sn, S h,
                                 const UnitAngle<S>& own) {
  const S s2 = sn * sn;
  const S w2 = S(1.0) - S(earth.e2) * s2;
  const S u = sqrt(w2);
  const S d1 = S(earth.a) + h * u;               // (N + h) u
  const S d2 = S(earth.a_polar) + h * (w2 * u);  // (M + h) u^3
  const S d12 = d1 * d2, uc = u * own.c;
  const S r = S(1.0) / (d12 * uc);
  const S w2cr = w2 * (own.c * r);
  const S k = d2 * w2cr;                     // 1/(N + h)
  const S q = S(earth.e2 * earth.a) * w2cr;  // e2 N/((1 - e2 s^2)(N + h)(M + h))
  LevelTerms<S> t;
  const S qa1 = q * a1;
  t.kxx = k + qa1 * a1;
  t.kxy = qa1 * a2;
  t.kyy = k + q * a2 * a2;
  t.inv_c = d12 * (u * r);
  t.tangent = own.s * t.inv_c;
  const S inv_u = d12 * (own.c * r);
  t.gamma = gravity_of(earth, s2, inv_u, h);
  return t;
}

// The ellipsoid normal, the height and zeta = e2 N sin(latitude) of a point: (x, y, z + zeta) lies
// along the normal.
template <Real S>
struct NormalPoint {
  Vec<Ecef, S> n;
  S h{}, zeta{};
  S s2{}, inv_u{};  // sin^2(latitude), 1/sqrt(1 - e2 s^2) there
};
// One Newton step for zeta from a guess: quadratic; from a guess 100 m of way old the error is
// below 1e-16 rad. Regular at the poles; undefined at the Earth's centre.
template <Real S>
inline NormalPoint<S> refine_normal(const EarthModel& earth, const Point<Ecef, S>& r, S zeta) {
  const S z = r.z + zeta;
  const S length = sqrt(r.x * r.x + r.y * r.y + z * z);
  const S inv = S(1.0) / length;
  const S s = z * inv;
  const S w2 = S(1.0) - S(earth.e2) * s * s;
  const S inv_u = S(1.0) / sqrt(w2);
  const S e2n = S(earth.e2 * earth.a) * inv_u;
  const S slope = e2n * inv * (S(1.0) - s * s) * (inv_u * inv_u);  // d(e2 N s)/d zeta <= e2
  const S miss = e2n * s - zeta;
  const S d = miss * (S(1.0) + slope * (S(1.0) + slope * (S(1.0) + slope)));
  const S di = d * inv;
  const S turn = S(1.0) - s * di;
  NormalPoint<S> p;
  p.zeta = zeta + d;
  p.n = {r.x * inv * turn, r.y * inv * turn, (z + d) * inv * turn};
  const S ds = (S(1.0) - s * s) * di;
  p.s2 = p.n.z * p.n.z;
  // N and 1/u at the corrected latitude, to first order in ds (second order: 1e-16).
  const S grow = S(1.0) + S(earth.e2) * s * ds * (inv_u * inv_u);
  p.inv_u = inv_u * grow;
  p.h = length + s * d - S(earth.a) * p.inv_u;
  return p;
}
// From nothing: four Newton steps (|h| < 1000 km: below 1e-15 rad).
template <Real S>
inline NormalPoint<S> normal_point(const EarthModel& earth, const Point<Ecef, S>& r) {
  S zeta = S(earth.e2) * r.z;
  for (int i = 0; i < 3; ++i) zeta = refine_normal(earth, r, zeta).zeta;
  return refine_normal(earth, r, zeta);
}
// The point of a normal and a height.
template <Real S>
inline Point<Ecef, S> point_of_normal(const EarthModel& earth, const Vec<Ecef, S>& n, S h) {
  const S N = S(earth.a) / sqrt(S(1.0) - S(earth.e2) * n.z * n.z);
  return {(N + h) * n.x, (N + h) * n.y, (N * S(1.0 - earth.e2) + h) * n.z};
}

// Between a level frame with axes (rows of C_ne) and ECEF: matrices, never longitude or heading.
// polar.md 1.3.
template <class M, Real S>
inline EcefState<S> level_to_ecef(const EarthModel& earth, const State<M, S>& x,
                                  const Rot<typename M::Frame, Ecef, S>& c_ne, S h) {
  const auto q_en = to_quaternion(transpose(c_ne));
  return {point_of_normal(earth, Vec<Ecef, S>{c_ne.m[2][0], c_ne.m[2][1], c_ne.m[2][2]}, h),
          transpose(c_ne) * x.v, normalized(q_en * x.q_nb)};
}
template <class M, Real S>
inline State<M, S> level_from_ecef(const EcefState<S>& e,
                                   const Rot<typename M::Frame, Ecef, S>& c_ne) {
  State<M, S> x;
  x.q_nb = normalized(to_quaternion(c_ne) * e.q_eb);
  x.v = c_ne * e.v;
  return x;
}

}  // namespace loxo
