// SPDX-License-Identifier: Apache-2.0
// Dead reckoning with fixes: the filter of a drive without an inertial unit. Error states, true
// minus nominal: position north and east [m], angle eps [rad], ln k, heading drift [rad/s], and
// where the fixed point stands in the body, right and forward [m]. The track moves the position by
// rhumb lines (V-8), the derivatives are (V-39)'s; a fix sees position and lever
// (estimation.md 9.4).
#pragma once
#include <Eigen/Core>

#include "loxo/estimate/kalman.hpp"
#include "loxo/ins/dead_reckoning.hpp"

namespace loxo {

enum PlanarIndex {
  kPlanarN,
  kPlanarE,
  kPlanarEps,
  kPlanarK,
  kPlanarDrift,
  kPlanarRight,
  kPlanarForward
};
inline constexpr int kPlanarStates = 7;
using PlanarMatrix = Eigen::Matrix<double, kPlanarStates, kPlanarStates>;
using PlanarVector = Eigen::Matrix<double, kPlanarStates, 1>;

struct PlanarConfig {
  Ellipsoid ellipsoid;
  // Of the track, 1 sigma: white each step, relative and rad; rad/sqrt(s); m of each step.
  double scale_noise = 0.01, side_slip = 0, heading_noise = 0, quantisation = 0;
  bool gate = true;  // fixes far outside are left out, and taken again when they last
};

struct PlanarState {
  double t = 0;
  ReckonState<> at;
  double eps = 0, ln_k = 0, drift = 0, right = 0, forward = 0;
  PlanarMatrix P = PlanarMatrix::Zero();
};
// True minus nominal added to the nominal.
void correct(const Ellipsoid& ellipsoid, PlanarState& state, double h, const PlanarVector& x);
// a - b as error states: what corrects b into a.
PlanarVector difference(const Ellipsoid& ellipsoid, const PlanarState& a, const PlanarState& b,
                        double h);

class PlanarFilter {
 public:
  PlanarFilter(const PlanarConfig& config, const PlanarState& start)
      : config_(config), state_(start) {}
  // The part `share` of a recorded step: ds [m] level distance of the part, heading as recorded
  // [rad], dt [s] of the part. Returns the transition.
  PlanarMatrix predict(double ds, double heading, double h, double dt, double share);
  // A position [rad] of the fixed point with sigmas [m]; heading: as recorded, at this time.
  // False: left out.
  bool fix(double lat, double lon, double std_e, double std_n, double heading, double h);
  const PlanarState& state() const { return state_; }
  const InnovationCount& innovations() const { return count_; }

 private:
  PlanarConfig config_;
  PlanarState state_;
  InnovationCount count_;
  int left_out_ = 0;  // in a row
};

}  // namespace loxo
