// SPDX-License-Identifier: Apache-2.0
// Dead reckoning that keeps its own attitude from gyros (H2 on all three axes, vehicle.md 1.5 and
// 3.4): transport rate and Earth rate are those of its own wrong position and velocity. Kernel: no
// allocation, no throw; NaN beyond a pole, as true headings have none there.
#pragma once
#include "loxo/ins/dead_reckoning.hpp"

namespace loxo {

template <Real S = double>
struct AttitudeReckonState {
  Quat<Geographic, Body, S> q_nb;  // unit
  ReckonState<S> where;
};

// One step of dt [s]: body angle increment dtheta [rad], indicated distance ds [m] along the body's
// forward axis, ellipsoidal height h [m]. The heights that a pitch error pretends are not kept.
// Error order dt^2 over a given time.
template <Real S>
void step_attitude_reckoning(const Ellipsoid& ell, AttitudeReckonState<S>& state,
                             const Vec<Body, S>& dtheta, S ds, double dt, S h);

}  // namespace loxo
