// SPDX-License-Identifier: Apache-2.0
// The joint filter at epochs of a second or so, for trials: the strapdown runs outside (in lanes),
// one prediction covers an epoch, odometer and non-holonomic constraint come as the epoch's
// displacement, fixes and height at its end. The equations are those of the sample-by-sample
// Navigator. No allocation after construction.
#pragma once
#include "loxo/estimate/measurements.hpp"
#include "loxo/estimate/start_covariance.hpp"
#include "loxo/ins/samples.hpp"

namespace loxo {

// 1 sigma, SI.
struct EpochFilterConfig {
  Ellipsoid ellipsoid;
  double gyro_noise = 0, accel_noise = 0, gyro_walk = 0, accel_walk = 0;
  double gyro_bias = 0, accel_bias = 0, gyro_scale = 0, accel_scale = 0;
  double level_std = 0, heading_std = 0;  // random part of the start's attitude
  bool static_alignment = false;          // the rest of it came from the biases [EST-14]
  double position_std = 0.01, velocity_std = 1e-3;
  double scale_std = 0, scale_walk = 0, mounting_std = 0, pitch_std = 0;
  double way_noise = 0;                   // m, of an epoch's indicated way
  double scale_noise = 0;                 // of it, relative
  double side_std = 0.02, side_slip = 0;  // m; rad, of an epoch
  double height_std = 0.1;                // m
  double fix_std = 0;                     // m per axis
};

// Of its start.
StartSigmas start_sigmas(const EpochFilterConfig& config);

// What the strapdown did over an epoch, resolved at its middle.
struct EpochMotion {
  double dt = 0;
  Rot<Ecef, Body> C;
  Vec<Ecef> v;
  Vec<Body> dtheta, dv;  // sums of the corrected increments
};
struct EpochMeasurements {
  double way = kNone;     // indicated, of the epoch [m]
  double height = kNone;  // at its end [m]
  bool has_fix = false;
  Point<Ecef> fix;
};

class EpochFilter {
 public:
  EpochFilter(const EpochFilterConfig& config, const NominalState& start);
  // `s` holds the strapdown's state at the end of the epoch, with the displacement s.d of the epoch
  // on the vehicle's axes; it is corrected.
  void epoch(NominalState& s, const EpochMotion& motion, const EpochMeasurements& z);
  const Covariance<kStates>& covariance() const { return P_; }

 private:
  void use(const ScalarMeasurement& m, double z, double variance, const Gate& gate);

  EpochFilterConfig config_;
  Covariance<kStates> P_;
  double x_[kStates]{};
};

}  // namespace loxo
