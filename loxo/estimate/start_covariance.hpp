// SPDX-License-Identifier: Apache-2.0
// What is known of a start, as the covariance that the joint filter begins with.
#pragma once
#include "loxo/earth/ellipsoid.hpp"
#include "loxo/estimate/nominal.hpp"

namespace loxo {

struct NavigatorConfig;

// 1 sigma, SI, each axis; 0: exactly known, or no state of this filter.
struct StartSigmas {
  double gyro_bias = 0, accel_bias = 0;  // rad/s, m/s^2
  // rad: of the attitude's level axes and of its heading, beside what the biases cause.
  double level = 0, heading = 0;
  // The level was found from the accelerometers, the heading from the gyros, and so has their
  // biases' part; false: it was given with its own sigma and owes them nothing.
  bool static_level = true, static_heading = false;
  // False: the biases' part is only a margin of the attitude's, which says nothing of them.
  bool correlated = true;
  double velocity = 0, position = 0;            // m/s, m, on ECEF axes
  Vec<Body> gyro_scale, accel_scale;            // 1
  double scale = 0, eps_h = 0, eps_p = 0;       // odometer: k, mounting [rad]
  double lever = 0, tau = 0, speed_offset = 0;  // m, s, m/s
};

// What the filter's own settings say of biases, scales and the odometer's constants; a witness that
// is not used seeks none of its own. Attitude, velocity and position are the caller's.
StartSigmas start_sigmas(const NavigatorConfig& config);

// P0 of the state `s`, on ECEF axes, symmetric to the bit: attitude and biases as
// alignment_covariance() has them [EST-14], every other state by itself; the accumulators and what
// is not declared are 0. First order in the biases; not with static_heading at a pole.
Covariance<kStates> start_covariance(const Ellipsoid& ell, const NominalState& s,
                                     const StartSigmas& sigmas);

// P0 after self-alignment from its causes, correlated [EST-14]: level from accelerometer biases,
// heading from the east gyro bias and the level; on ECEF axes, into P's psi and bias blocks.
// sigma_level, sigma_heading: the random part. `static_heading` false: the heading was given with
// sigma_heading, not found from the gyros.
void alignment_covariance(const Ellipsoid& ell, const NominalState& s, double gyro_bias,
                          double accel_bias, double sigma_level, double sigma_heading,
                          bool static_heading, Covariance<kStates>& P);

}  // namespace loxo
