// SPDX-License-Identifier: Apache-2.0
// Through a long gap of the inertial unit, and out of it. What stays known is the speed along the
// body's axes; where the body heads is lost, and with it the direction of the velocity: the two
// errors are one, dv = [v] psi about the vertical. Kept so, wheel and constraint cannot pretend to
// find the heading; only positions do, and by a turn of any size, not by a small angle.
// estimation.md 1.5, 4.5.
#pragma once
#include "loxo/estimate/nominal.hpp"

namespace loxo {

// Densities of what may happen in a gap, per second.
struct CoastNoise {
  double heading = 0, level = 0;     // rad^2/s
  double forward = 0, sideways = 0;  // (m/s)^2/s along `forward` and across it
  Vec<Ecef> up, ahead;               // unit vectors: the vertical, the way of travel
};
// Straight on for dt: r along v, attitude and velocity as they are. `product` and, here and below,
// X (the rest of the covariance of a filter with extra states) may be null.
void coast(NominalState& s, Covariance<kStates>& P, TransitionProduct* product, const CoastNoise& q,
           double dt, ExtraCovariance* X = nullptr);

// Sigma of the rotation about the vertical, rad.
double heading_sigma(const Covariance<kStates>& P, const Vec<Ecef>& up);

// Turns attitude and velocity by `angle` [rad] about `up` (right-handed: counter-clockwise seen
// from above) and takes `sigma` for what is then known of the heading; what was believed of it
// before is dropped, what is known of level and of the speed along the body's axes stays.
void turn_heading(NominalState& s, Covariance<kStates>& P, TransitionProduct* product,
                  const Vec<Ecef>& up, double angle, double sigma, ExtraCovariance* X = nullptr);

// The horizontal position is known to `sigma` [m] per axis, by nothing that came before.
void forget_position(Covariance<kStates>& P, TransitionProduct* product, const Vec<Ecef>& up,
                     double sigma, ExtraCovariance* X = nullptr);

}  // namespace loxo
