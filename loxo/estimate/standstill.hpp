// SPDX-License-Identifier: Apache-2.0
// Standing still, seen by three witnesses that must agree: the IMU, the wheel, the filter
// (estimation.md section 3).
#pragma once
#include "loxo/earth/frames.hpp"
#include "loxo/num/geometry.hpp"

namespace loxo {

enum class Standing { kMoving, kStanding, kDeadEncoder, kSpin };

struct StandstillConfig {
  double window = 1.0;              // s
  double sigma_w = 0, sigma_f = 0;  // noise of one sample at rest: rad/s, m/s^2
  double factor = 0;          // rms factor; 0: derived from chi2(1 - 1e-6) of the window's samples
  double wheel_quiet = 0.05;  // m/s
  double wheel_age = 1.5;     // of its tick interval
};

// Noise at rest of a vehicle that has not stood yet, its engine idling: three times what the data
// sheet's (rad/sqrt(s), m/s/sqrt(s)) leaves in a sample of `interval` s. estimation.md 3
void expect_noise(StandstillConfig& c, double gyro_noise, double accel_noise, double interval);

// What the detector says at the end of a window; mean_w: mean measured rate of the window, rad/s.
struct StandstillVerdict {
  bool complete = false;  // a window has just ended
  Standing standing = Standing::kMoving;
  bool imu_quiet = false, wheel_quiet = false, wheel_known = false, filter_agrees = false;
  Vec<Body> mean_w;
  double length = 0;      // s
  double tw = 0, tf = 0;  // rms of the window in sigmas
};

class StandstillDetector {
 public:
  explicit StandstillDetector(const StandstillConfig& config) : config_(config) {}
  // One sample: measured rate and specific force, w_rest = what a body at rest would show (bias +
  // Earth rate).
  void sample(double dt, const Vec<Body>& w, const Vec<Body>& f, const Vec<Body>& w_rest);
  // The wheel's last word before now: whether it has turned (a counter that changed, a speed above
  // wheel_quiet), how often it speaks [s], and the speed of the vehicle that it means [m/s].
  void wheel(double t, bool moved, double interval, double speed);
  // At most once per window; filter_speed, filter_sigma (of the velocity, all axes): witness 3,
  // |v| < 4 sigma + 0.3 m/s. Where no wheel speaks and the IMU has been quiet in motion as well (a
  // ship, a smooth road, a simulation), its quiet says nothing: then only what the filter nearly
  // knows by itself is rest.
  StandstillVerdict judge(double now, double filter_speed, double filter_sigma);
  // A fix says otherwise: for ten seconds no rest without the wheel's word.
  void contradict(double t) { contradicted_t_ = t; }
  const StandstillConfig& config() const { return config_; }

 private:
  StandstillConfig config_;
  int n_ = 0;
  double length_ = 0, ww_ = 0;
  Vec<Body> sum_w_, sum_f_, mean_f_;
  double ff_ = 0;
  Vec<Body> first_f_;
  double wheel_t_ = -1e300, wheel_interval_ = 0, wheel_moved_t_ = -1e300, wheel_speed_ = 0;
  double dead_since_ = 1e300, spin_since_ = 1e300;
  double moving_ = 0, quiet_moving_ = 0;  // s in motion for certain, and quiet in it
  double contradicted_t_ = -1e300;
};

// rms factor of W samples of three axes for a false alarm of 1e-6: sqrt(chi2_{3W}(1 - 1e-6)/(3W))
// (Wilson-Hilferty).
double standstill_factor(int samples);

}  // namespace loxo
