// SPDX-License-Identifier: Apache-2.0
// The segmented method of vehicle.md 6-7: an INS that runs alone and a dead reckoning that runs
// beside it on the INS's attitude. Phase 1: the INS calibrates the dead reckoning (4 states); at
// the switch its scale and mounting are fed back (V-55) and the track is replayed; then the two are
// weighted (V-57 to V-60). The joint filter of 7.1 (16 states) runs from the first second through
// all phases. Epochs of one second; flat 4- and 16-state matrices, no allocation after the switch.
#pragma once
#include <memory>

#include "loxo/earth/geodetic.hpp"
#include "loxo/ins/samples.hpp"

namespace loxo {

// 1-sigma, SI.
struct SegmentedConfig {
  Ellipsoid ellipsoid;
  double gyro_bias = 0, gyro_noise = 0, accel_bias = 0, accel_noise = 0;
  double level_std = 0,
         heading_std = 0;      // random part of the alignment, beside what the biases cause (6.1)
  bool static_heading = true;  // heading found from the gyros: correlated with their bias
  bool static_level = true;    // level found from the accelerometers: as correlated with theirs
  double velocity_std = 0.01;
  // Of a start given with its errors, rad and m/s: they drive the INS as a bias does, and R(t)
  // holds them beside it. 0: as good as level_std and velocity_std say.
  double given_level_std = 0, given_velocity_std = 0;
  double scale_std = 0.05, mounting_std = 0.052359877559829887;  // 3 deg
  double scale_noise = 1e-3, slip_noise = 8.7e-4;                // white, per second
  double way_noise = 0;                                          // m/sqrt(s), white, of the way
  double scale_walk = 2e-5, mounting_walk = 1e-6;                // 1/sqrt(s), rad/sqrt(s)
  double quantisation = 0;                                       // m
  Vec<Body> lever;  // from the IMU to the point whose way the odometer tells, body axes, m
  // R(t) of phase 1; c_a: the part of the accelerometers' bias that the alignment has not taken up
  // (1 where the level was not found from them).
  double r0 = 0.5, c_a = 0.3;
  double earliest = 60, latest = 180, distance = 500, sd_limit = 5e-4,
         change_limit = 3e-4;  // switch rule
};

struct SegmentedStart {
  double t = 0;
  Geodetic<double> place;
  Rot<Geographic, Body> C_nb;
  double ve = 0, vn = 0;
};

// East, north in metres; 2x2 covariances as {ee, en, nn}.
struct Horizontal {
  double lat = 0, lon = 0;
  double cov[3]{};
};
struct SegmentedEpoch {
  double t = 0;
  int phase = 1;          // 1, 2
  bool switched = false;  // at this epoch
  bool forced = false;    // the switch rule was not met, switched all the same (180 s)
  double distance = 0;    // indicated, m
  Horizontal ins,
      reckoned;  // each for itself; reckoned: all increments, calibrated as k and mu say
  Horizontal weighted, naive, intersection;     // V-57, V-58, V-59
  Horizontal joint;                             // 7.1
  double ve = 0, vn = 0, heading_std = 0;       // of the INS alone: m/s, rad
  double k = 1, mu = 0, k_std = 0, mu_std = 0;  // of phase 1 (frozen after the switch)
  double joint_k = 1, joint_mu = 0, joint_k_std = 0, joint_mu_std = 0;
  double ins_weight = 0;  // share of the INS in `weighted`: 1 - trace(Wt)/2
};

class SegmentedNavigator {
 public:
  SegmentedNavigator(const SegmentedConfig& config, const SegmentedStart& start);
  ~SegmentedNavigator();
  SegmentedNavigator(const SegmentedNavigator&) = delete;
  SegmentedNavigator& operator=(const SegmentedNavigator&) = delete;

  void imu(const ImuIncrement<double>& sample);
  // A distance increment over (last tick, tick.t]; true where it ended an epoch, which `epoch()`
  // then tells.
  bool odometer(const OdometerTick& tick);
  const SegmentedEpoch& epoch() const;
  // Where the INS alone is now, the height being the reckoned one.
  const Point<Ecef>& ins() const;
  const Vec<Ecef>& velocity() const;
  // Attitude of the INS now (body to ENU).
  const Rot<Geographic, Body>& attitude() const;
  double t() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// (V-57), (V-58), (V-59): weight of the second source; P_a, P_b, X: 2x2 row-major; out: 2x2 and the
// fused covariance (V-60). Near-singular P_a + P_b - X - X^T: pseudo-inverse.
void weight_minimum_variance(const double Pa[4], const double Pb[4], const double X[4], double W[4],
                             double P[4]);
void weight_naive(const double Pa[4], const double Pb[4], const double X[4], double W[4],
                  double P[4]);
void weight_intersection(const double Pa[4], const double Pb[4], double W[4], double P[4]);

}  // namespace loxo
