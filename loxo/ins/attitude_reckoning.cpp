// SPDX-License-Identifier: Apache-2.0
#include "loxo/ins/attitude_reckoning.hpp"

#include "loxo/ins/mechanization.hpp"
#include "loxo/num/lanes.hpp"

namespace loxo {

template <Real S>
void step_attitude_reckoning(const Ellipsoid& ell, AttitudeReckonState<S>& state,
                             const Vec<Body, S>& dtheta, S ds, double dt, S h) {
  const Vec<Body, S> forward{S(0.0), S(1.0), S(0.0)};
  const auto along = [&](const Quat<Geographic, Body, S>& q) { return to_matrix(q) * forward; };
  const Vec<Geographic, S> before = along(state.q_nb);
  S sin_lat, cos_lat;
  sincos(state.where.lat, sin_lat, cos_lat);
  const S half(0.5), T(dt);
  // Rates at mid-step: the latitude half a step ahead, the direction of its start.
  const S m = meridian_radius(ell, sin_lat) + h;
  S s, c;
  sincos(state.where.lat + half * ds * before.y / m, s, c);
  const S n = prime_vertical_radius(ell, s) + h;
  // w_en T of the way ds, so that a standing vehicle needs no speed; w_ie T.
  const Vec<Geographic, S> turn{-(ds * before.y) / (meridian_radius(ell, s) + h),
                                ds * before.x / n + S(ell.w_ie) * T * c,
                                ds * before.x * s / (n * c) + S(ell.w_ie) * T * s};
  state.q_nb = renormalized(exp_tiny<Geographic, Geographic>(-turn) *
                            (state.q_nb * exp_step<Body, Body>(dtheta)));
  const Vec<Geographic, S> way = (half * ds) * (before + along(state.q_nb));
  step_midpoint(ell, state.where, way.y, way.x, h);  // (V-7)
}

template void step_attitude_reckoning(const Ellipsoid&, AttitudeReckonState<double>&,
                                      const Vec<Body, double>&, double, double, double);
template void step_attitude_reckoning(const Ellipsoid&, AttitudeReckonState<Lanes>&,
                                      const Vec<Body, Lanes>&, Lanes, double, Lanes);

}  // namespace loxo
