// SPDX-License-Identifier: Apache-2.0
// From what the IMU delivers to one step's rotation and velocity increment: coning, sculling and
// the second-order rotation term. polar.md 3.2.
#pragma once
#include <cstddef>

#include "loxo/ins/samples.hpp"

namespace loxo {

// One step's motion of the body relative to inertial space, resolved in the body axes at the start
// of the step.
template <Real S = double>
struct StepIncrement {
  double dt = 0;          // s
  Vec<Body, S> rotation;  // rotation vector rho [rad]
  Vec<Body, S>
      velocity;  // integral of the specific force, turned back to the start of the step [m/s]
};

namespace increments {
// dv + 1/2 dth x dv + 1/6 dth x (dth x dv): exact to third order for a constant rate and force.
template <Real S>
inline Vec<Body, S> rotated(const Vec<Body, S>& dth, const Vec<Body, S>& dv) {
  const Vec<Body, S> once = cross(dth, dv);
  return dv + S(0.5) * once + S(1.0 / 6.0) * cross(dth, once);
}
template <Real S>
inline Vec<Body, S> crossed(const ImuIncrement<S>& i, const ImuIncrement<S>& j) {
  return cross(i.dtheta, j.dv) + cross(i.dv, j.dtheta);
}
}  // namespace increments

// One sample, nothing known before it: error order T^3 in coning and sculling.
template <Real S>
inline StepIncrement<S> one_sample(const ImuIncrement<S>& a) {
  return {a.dt, a.dtheta, increments::rotated(a.dtheta, a.dv)};
}
// One sample and its predecessor: rates linear over both. Equal intervals: rho = dth + 1/12 dth0 x
// dth.
template <Real S>
inline StepIncrement<S> one_sample(const ImuIncrement<S>& before, const ImuIncrement<S>& a) {
  const S k(a.dt * a.dt / (6.0 * before.dt * (before.dt + a.dt)));
  return {a.dt, a.dtheta + k * cross(before.dtheta, a.dtheta),
          increments::rotated(a.dtheta, a.dv) + k * increments::crossed(before, a)};
}
// Two samples, rates linear over the step (polar.md 3.2). Equal intervals: factor 2/3; others:
// T^2/(6 T1 T2), so jittered stamps lose nothing.
template <Real S>
inline StepIncrement<S> two_samples(const ImuIncrement<S>& a, const ImuIncrement<S>& b) {
  const double dt = a.dt + b.dt;
  const S k(dt * dt / (6.0 * a.dt * b.dt));
  const Vec<Body, S> dth = a.dtheta + b.dtheta, dv = a.dv + b.dv;
  return {dt, dth + k * cross(a.dtheta, b.dtheta),
          increments::rotated(dth, dv) + k * increments::crossed(a, b)};
}
// Three samples over equal intervals, rates quadratic: 33/80 (1x3) + 57/80 (1x2 + 2x3).
template <Real S>
inline StepIncrement<S> three_samples(const ImuIncrement<S>& a, const ImuIncrement<S>& b,
                                      const ImuIncrement<S>& c) {
  const S far(33.0 / 80.0), near(57.0 / 80.0);
  const Vec<Body, S> dth = a.dtheta + b.dtheta + c.dtheta, dv = a.dv + b.dv + c.dv;
  return {a.dt + b.dt + c.dt,
          dth + far * cross(a.dtheta, c.dtheta) +
              near * (cross(a.dtheta, b.dtheta) + cross(b.dtheta, c.dtheta)),
          increments::rotated(dth, dv) + far * increments::crossed(a, c) +
              near * (increments::crossed(a, b) + increments::crossed(b, c))};
}
// Four samples over equal intervals, rates cubic: 736/945 (1x2 + 3x4) + 334/945 (1x3 + 2x4) +
// 526/945 (1x4) + 654/945 (2x3).
template <Real S>
inline StepIncrement<S> four_samples(const ImuIncrement<S>& a, const ImuIncrement<S>& b,
                                     const ImuIncrement<S>& c, const ImuIncrement<S>& d) {
  const S k12(736.0 / 945.0), k13(334.0 / 945.0), k14(526.0 / 945.0), k23(654.0 / 945.0);
  const Vec<Body, S> dth = (a.dtheta + b.dtheta) + (c.dtheta + d.dtheta),
                     dv = (a.dv + b.dv) + (c.dv + d.dv);
  return {a.dt + b.dt + c.dt + d.dt,
          dth + k12 * (cross(a.dtheta, b.dtheta) + cross(c.dtheta, d.dtheta)) +
              k13 * (cross(a.dtheta, c.dtheta) + cross(b.dtheta, d.dtheta)) +
              k14 * cross(a.dtheta, d.dtheta) + k23 * cross(b.dtheta, c.dtheta),
          increments::rotated(dth, dv) +
              k12 * (increments::crossed(a, b) + increments::crossed(c, d)) +
              k13 * (increments::crossed(a, c) + increments::crossed(b, d)) +
              k14 * increments::crossed(a, d) + k23 * increments::crossed(b, c)};
}
// n = 1 … 4 samples at `first`.
template <Real S>
inline StepIncrement<S> combine(const ImuIncrement<S>* first, int n) {
  switch (n) {
    case 1:
      return one_sample(first[0]);
    case 2:
      return two_samples(first[0], first[1]);
    case 3:
      return three_samples(first[0], first[1], first[2]);
    default:
      return four_samples(first[0], first[1], first[2], first[3]);
  }
}

// Rates as input [rad/s], [m/s^2]: means over (t - dt, t], or instants at both ends (linear between
// them).
template <Real S>
inline ImuIncrement<S> from_mean_rates(double t, double dt, const Vec<Body, S>& w,
                                       const Vec<Body, S>& f) {
  return {t, dt, S(dt) * w, S(dt) * f};
}
template <Real S>
inline ImuIncrement<S> from_instant_rates(double t, double dt, const Vec<Body, S>& w0,
                                          const Vec<Body, S>& f0, const Vec<Body, S>& w1,
                                          const Vec<Body, S>& f1) {
  return {t, dt, S(0.5 * dt) * (w0 + w1), S(0.5 * dt) * (f0 + f1)};
}
// The same sample over a part (0 … 1) of its interval, its rates constant; t is left to the caller.
template <Real S>
inline ImuIncrement<S> part_of(const ImuIncrement<S>& a, double part) {
  return {a.t, a.dt * part, S(part) * a.dtheta, S(part) * a.dv};
}
// The same interval run backward in time: integrals over (t, t - dt), dt negative (forward/backward
// law; smoothing, transfer of alignment to an earlier time).
template <Real S>
inline ImuIncrement<S> backward(const ImuIncrement<S>& a) {
  return {a.t - a.dt, -a.dt, -a.dtheta, -a.dv};
}

// exp of a rotation vector by series: no division, square root or branch. Error below 1e-16 for
// |phi| <= pi/2, 1e-12 for |phi| <= pi; a step that turns further is not a step.
template <class A, class B, Real S>
inline Quat<A, B, S> exp_step(const Vec<B, S>& phi) {
  const S x = S(0.25) * dot(phi, phi);  // (|phi|/2)^2
  const S x2 = x * x, x4 = x2 * x2;
  // cos h and sin(h)/h in x = h^2, in pairs: shorter chains of operations.
  const S c = ((S(1.0) - x * S(1.0 / 2.0)) + x2 * (S(1.0 / 24.0) - x * S(1.0 / 720.0))) +
              x4 * ((S(1.0 / 40320.0) - x * S(1.0 / 3628800.0)) +
                    x2 * (S(1.0 / 479001600.0) - x * S(1.0 / 87178291200.0)));
  const S k = ((S(1.0) - x * S(1.0 / 6.0)) + x2 * (S(1.0 / 120.0) - x * S(1.0 / 5040.0))) +
              x4 * ((S(1.0 / 362880.0) - x * S(1.0 / 39916800.0)) +
                    x2 * (S(1.0 / 6227020800.0) - x * S(1.0 / 1307674368000.0)));
  const S half = S(0.5) * k;
  return {c, half * phi.x, half * phi.y, half * phi.z};
}
// The same for the small turns of frames (|phi| <= 0.01 rad, error below 1e-17).
template <class A, class B, Real S>
inline Quat<A, B, S> exp_tiny(const Vec<B, S>& phi) {
  const S x = S(0.25) * dot(phi, phi);
  const S c = S(1.0) - x * (S(0.5) - x * S(1.0 / 24.0));
  const S half = S(0.5) - x * (S(1.0 / 12.0) - x * S(1.0 / 240.0));
  return {c, half * phi.x, half * phi.y, half * phi.z};
}
// One Newton step toward unit length: what a step's rounding needs.
template <class A, class B, Real S>
inline S toward_unit(const Quat<A, B, S>& q) {
  return S(1.5) - S(0.5) * ((q.w * q.w + q.x * q.x) + (q.y * q.y + q.z * q.z));
}
template <class A, class B, Real S>
inline Quat<A, B, S> scaled(const Quat<A, B, S>& q, const S& k) {
  return {q.w * k, q.x * k, q.y * k, q.z * k};
}
template <class A, class B, Real S>
inline Quat<A, B, S> renormalized(const Quat<A, B, S>& q) {
  return scaled(q, toward_unit(q));
}
// q v q*: 24 products and sums, cheaper than by the matrix for one vector.
template <class A, class B, Real S>
inline Vec<A, S> rotate(const Quat<A, B, S>& q, const Vec<B, S>& v) {
  const S tx = S(2.0) * (q.y * v.z - q.z * v.y), ty = S(2.0) * (q.z * v.x - q.x * v.z),
          tz = S(2.0) * (q.x * v.y - q.y * v.x);
  return {v.x + q.w * tx + (q.y * tz - q.z * ty), v.y + q.w * ty + (q.z * tx - q.x * tz),
          v.z + q.w * tz + (q.x * ty - q.y * tx)};
}

}  // namespace loxo
