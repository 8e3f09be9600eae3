// SPDX-License-Identifier: Apache-2.0
// The one strapdown loop. Kernels: no allocation, no input or output, no branch on data, no
// trigonometry.
#pragma once
#include "loxo/ins/ecef.hpp"
#include "loxo/ins/geographic.hpp"
#include "loxo/ins/grid.hpp"
#include "loxo/ins/transverse.hpp"
#include "loxo/ins/wander.hpp"

namespace loxo {

// One step of polar.md 3.2: the environment at mid-step, velocity implicit in its mean. Error order
// dt^2 over a given time; M's singularities are those of its frame. Vertical channel free: see
// constrained().
template <class M, Real S>
requires Mechanization<M, S>
[[gnu::flatten]] inline State<M, S> step(const EarthModel& earth, const State<M, S>& x,
                                         const StepIncrement<S>& u) {
  using V = Vec<typename M::Frame, S>;
  const S T(u.dt), half(0.5);
  const auto local = M::half_way(earth, x.position, x.v, u.dt);
  const V c = rotate(x.q_nb, u.velocity);
  const V fall = T * local.gravity;

  // First the mean velocity without Coriolis, enough for the turn of c; then with it.
  V v_mean = x.v + half * (c + fall);
  V w_in = local.w_ie;
  if constexpr (M::kTurns) w_in = w_in + M::transport(local, v_mean);
  const V w_c = cross(w_in, c);
  const V gained = (c + fall) - (half * T) * w_c + (T * T * S(1.0 / 6.0)) * cross(w_in, w_c);
  v_mean = x.v + half * (gained - T * cross(w_in + local.w_ie, v_mean));
  if constexpr (M::kTurns) {
    // Once more where the axes may turn fast: attitude, velocity and longitude must turn by the
    // same angle.
    w_in = local.w_ie + M::transport(local, v_mean);
    if constexpr (M::kTurnsFast) {
      v_mean = x.v + half * (gained - T * cross(w_in + local.w_ie, v_mean));
      w_in = local.w_ie + M::transport(local, v_mean);
    }
  }
  State<M, S> y;
  y.v = x.v + gained - T * cross(w_in + local.w_ie, v_mean);
  v_mean = half * (x.v + y.v);
  y.position = M::advance(earth, x.position, local, v_mean, u.dt);
  // q' = exp(-w_in T) q exp(rho); its length is mended in the next step, beside the others' work.
  y.q_nb = exp_tiny<typename M::Frame, typename M::Frame>(-T * w_in) *
           scaled(x.q_nb * exp_step<Body, Body>(u.rotation), toward_unit(x.q_nb));
  return y;
}

// The vertical channel is unstable: errors grow by exp(sqrt(2g/R) t), x545 an hour.
enum class VerticalMode {
  kFree,      // nothing
  kFixed,     // height and upward velocity are given, and taken as exact
  kShip,      // the start's height, upward velocity 0
  kExternal,  // damped toward a measured height
};

// A third-order loop, all poles at -1/tau; the 2 g/R that makes the channel unstable is taken out.
struct VerticalGains {
  double k1 = 0, k2 = 0, k3 = 0;  // 1/s, 1/s^2, 1/s^3
};
VerticalGains make_vertical_gains(double tau);
// The loop's best time [s] for heights of white noise `std` [m] every `interval` [s] and
// accelerometers of noise `accel_noise` [m/s/sqrt(s)]. The loop passes 33 std^2 interval/(16 tau)
// of the heights' variance and accel_noise^2 tau^3/16 of the accelerometers'; the sum is least at
// tau^4 = 11 std^2 interval/accel_noise^2. Between 2 s and 120 s: far below Schuler's 806 s.
double vertical_time(double std, double interval, double accel_noise);

// h [m], vu [m/s] as given.
template <class M, Real S>
inline State<M, S> constrained(const State<M, S>& x, S h, S vu) {
  return M::with_vertical(x, h, vu);
}
// One step of the damping loop toward the measured height; `integral` [m s] is the loop's memory.
template <class M, Real S>
inline State<M, S> damped(const State<M, S>& x, S h_measured, const VerticalGains& k, double dt,
                          S& integral) {
  const S e = M::height(x) - h_measured;
  integral = integral + S(dt) * e;
  return M::with_vertical(x, M::height(x) - S(k.k1 * dt) * e,
                          M::up_velocity(x) - S(k.k2 * dt) * e - S(k.k3 * dt) * integral);
}

extern template State<GeographicMechanization, double> step(
    const EarthModel&, const State<GeographicMechanization, double>&, const StepIncrement<double>&);
extern template State<TransverseMechanization, double> step(
    const EarthModel&, const State<TransverseMechanization, double>&, const StepIncrement<double>&);
extern template State<VirtualSphereMechanization, double> step(
    const EarthModel&, const State<VirtualSphereMechanization, double>&,
    const StepIncrement<double>&);
extern template State<GridMechanization, double> step(const EarthModel&,
                                                      const State<GridMechanization, double>&,
                                                      const StepIncrement<double>&);
extern template State<WanderMechanization, double> step(const EarthModel&,
                                                        const State<WanderMechanization, double>&,
                                                        const StepIncrement<double>&);
extern template State<EcefMechanization, double> step(const EarthModel&,
                                                      const State<EcefMechanization, double>&,
                                                      const StepIncrement<double>&);

}  // namespace loxo
