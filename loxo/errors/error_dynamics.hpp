// SPDX-License-Identifier: Apache-2.0
// How navigation errors move, frame-free (estimation.md section 1). On axes M (ECEF, or any level
// frame):
//   computed - true:  C~ = (I - [psi]) C,  v~ = v + dv,  r~ = r + dr        [EST-1]
//   constants, true - used (what is left in the corrected sensor): x_bg, x_ba, x_sg, x_sa
// Order of the error vector: psi 0-2 [rad], dv 3-5 [m/s], dr 6-8 [m], x_bg 9-11 [rad/s], x_ba 12-14
// [m/s^2], x_sg 15-17 [1], x_sa 18-20 [1]. The 9- and 15-state models are its leading parts; 12
// states are 0-11. Nothing here is singular anywhere: no tangent, no secant.
#pragma once
#include "loxo/earth/ellipsoid.hpp"
#include "loxo/earth/frames.hpp"
#include "loxo/errors/block3.hpp"

namespace loxo {

inline constexpr int kInsErrorStates = 21;

// The nominal motion that the error equations are taken about, resolved in M.
template <class M, Real S = double>
struct ErrorPoint {
  Rot<M, Body, S> C_mb;
  Vec<M, S> v;           // velocity relative to the Earth, m/s
  Vec<M, S> w_ie, w_em;  // Earth rate; transport rate of M (zero for M = ECEF), rad/s
  Vec<Body, S> w,
      f;  // corrected body rate relative to inertial space, rad/s; specific force, m/s^2
  Block3<S> gradient;  // d(gravity)/d(position) on M's axes, 1/s^2 (Gam of [EST-3])
};

// d(gravity vector)/d(position) on ECEF axes, centrifugal part included, exact for normal gravity
// along the ellipsoid normal n (unit, ECEF) at height h [m]. Gam of [EST-3], regular at the poles.
template <Real S>
Block3<S> gravity_gradient(const Ellipsoid& ell, const Vec<Ecef, S>& n, S h);

// The continuous matrix: rows psi, dv, dr; columns the 21 states. [EST-3]
template <Real S>
struct ErrorRates {
  S f[9][kInsErrorStates]{};
};
template <class M, Real S>
ErrorRates<S> error_rates(const ErrorPoint<M, S>& p);

// The transition over one step, second order, block by block; blocks not named are zero, dr_dv = dt
// I, and the constants' own are the two decay factors (1: random constant or walk). [EST-4] Error
// against the matrix exponential, scaled by typical state sizes: 1e-9 (10 ms), 1e-7 (0.1 s).
template <Real S>
struct ErrorTransition {
  S dt{};
  Block3<S> psi_psi, psi_bg, psi_sg;
  Block3<S> dv_psi, dv_dv, dv_dr, dv_bg, dv_sg, dv_ba, dv_sa;
  Block3<S> dr_psi, dr_dr, dr_ba, dr_sa;
  S decay_bg{1.0}, decay_ba{1.0};
};
// p at mid-step.
template <class M, Real S>
ErrorTransition<S> error_transition(const ErrorPoint<M, S>& p, S dt) {
  const Block3<S> I = identity3<S>();
  const Block3<S> C = block_of(p.C_mb);
  const Vec<Body, S> dtheta = p.w * dt;
  const Vec<M, S> f_m = p.C_mb * p.f;
  const Vec<M, S> dv_m = f_m * dt;
  const Block3<S> dV = skew(dv_m);
  const S half(0.5);
  ErrorTransition<S> t;
  t.dt = dt;
  t.psi_psi = I - dt * skew(p.w_ie + p.w_em);
  t.psi_bg = (-dt) * C;
  t.psi_sg = S(-1.0) * scale_columns(C, dtheta);
  t.dv_psi = dV;
  t.dv_dv = I - dt * skew(p.w_ie + p.w_ie + p.w_em);
  t.dv_dr = dt * p.gradient;
  t.dv_bg = half * (dV * t.psi_bg);
  t.dv_sg = half * (dV * t.psi_sg);
  t.dv_ba = dt * C;
  t.dv_sa = scale_columns(C, p.f * dt);
  t.dr_psi = (half * dt) * dV;
  t.dr_dr = I - dt * skew(p.w_em) + (half * dt * dt) * p.gradient;
  t.dr_ba = (half * dt) * t.dv_ba;
  t.dr_sa = (half * dt) * t.dv_sa;
  return t;
}

// White noise of the sensors over a step. [EST-5]
template <Real S>
struct ErrorNoise {
  S psi{}, dv{}, dr{}, dr_dv{};  // isotropic: variance of psi, dv, dr; covariance dr-dv
  Block3<S> dv_psi;              // covariance (dv, psi)
  S bg{}, ba{};                  // added to the variances of the constants
};
// gyro_noise [rad/sqrt(s)], accel_noise [m/s/sqrt(s)], dv_m: velocity increment of the step on M's
// axes.
template <class M, Real S>
ErrorNoise<S> error_noise(S gyro_noise, S accel_noise, S dt, const Vec<M, S>& dv_m) {
  const S ng = gyro_noise * gyro_noise * dt, na = accel_noise * accel_noise * dt;
  ErrorNoise<S> q;
  q.psi = ng;
  q.dv = na;
  q.dr = na * dt * dt * S(1.0 / 3.0);
  q.dr_dv = na * dt * S(0.5);
  q.dv_psi = (S(0.5) * ng) * skew(dv_m);
  return q;
}

}  // namespace loxo
