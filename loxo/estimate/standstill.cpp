// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/standstill.hpp"

namespace loxo {

double standstill_factor(int samples) {
  const double n = 3.0 * samples, z = 4.753424308822899, a = 2.0 / (9.0 * n);
  const double c = 1.0 - a + z * sqrt(a);
  return sqrt(c * c * c);
}

void expect_noise(StandstillConfig& c, double gyro_noise, double accel_noise, double interval) {
  c.sigma_w = 3.0 * gyro_noise / sqrt(interval);
  c.sigma_f = 3.0 * accel_noise / sqrt(interval);
}

void StandstillDetector::sample(double dt, const Vec<Body>& w, const Vec<Body>& f,
                                const Vec<Body>& w_rest) {
  if (n_ == 0) first_f_ = f;
  const Vec<Body> e = w - w_rest, g = f - first_f_;
  ++n_;
  length_ += dt;
  ww_ += dot(e, e);
  sum_w_ += w;
  sum_f_ += g;
  ff_ += dot(g, g);
}

void StandstillDetector::wheel(double t, bool moved, double interval, double speed) {
  wheel_speed_ = fabs(speed);
  wheel_t_ = t;
  wheel_interval_ = interval;
  if (moved) wheel_moved_t_ = t;
}

StandstillVerdict StandstillDetector::judge(double now, double filter_speed, double filter_sigma) {
  const double filter_limit = 4.0 * filter_sigma + 0.3;
  StandstillVerdict v;
  if (length_ < config_.window * (1.0 - 1e-6)) return v;
  v.complete = true;
  v.length = length_;
  v.mean_w = sum_w_ * (1.0 / n_);
  const Vec<Body> mean = sum_f_ * (1.0 / n_);
  v.tw = sqrt(ww_ / (3.0 * n_)) / config_.sigma_w;
  v.tf = sqrt(max(0.0, ff_ - n_ * dot(mean, mean)) / (3.0 * n_)) / config_.sigma_f;
  // An idling engine's samples are correlated: not more than ten independent ones a second.
  const int independent =
      n_ < 10 ? n_ : static_cast<int>(min(static_cast<double>(n_), max(10.0, 10.0 * length_)));
  const double factor = config_.factor > 0 ? config_.factor : standstill_factor(independent);
  v.imu_quiet = v.tw < factor && v.tf < factor;
  v.wheel_known =
      wheel_t_ > now - max(config_.window, config_.wheel_age * wheel_interval_) - wheel_interval_;
  v.wheel_quiet = v.wheel_known && wheel_moved_t_ < now - v.length;
  v.filter_agrees = filter_speed < filter_limit;
  if (!v.filter_agrees) {
    moving_ += v.length;
    if (v.imu_quiet) quiet_moving_ += v.length;
  }
  const bool quiet_tells = quiet_moving_ < 3.0 || quiet_moving_ < 0.05 * moving_;
  const bool nearly_known = filter_sigma < 0.3 && filter_speed < 2.0 * filter_sigma + 0.1;
  const bool alone = (quiet_tells || nearly_known) && now > contradicted_t_ + 10.0;
  const bool others = v.imu_quiet && v.filter_agrees;
  // A parked car that somebody enters is not quiet either: a dead encoder needs a filter that
  // moves.
  if (v.wheel_known && v.wheel_quiet && !v.filter_agrees) {
    dead_since_ = min(dead_since_, now - v.length);
  } else {
    dead_since_ = 1e300;
  }
  // A wheel that agrees with the filter is no spin but a creep, as quiet as it may be.
  if (others && v.wheel_known && !v.wheel_quiet && wheel_speed_ - filter_speed > filter_limit) {
    spin_since_ = min(spin_since_, now - v.length);
  } else {
    spin_since_ = 1e300;
  }
  if (others && (v.wheel_quiet || (!v.wheel_known && alone))) {
    v.standing = Standing::kStanding;
  } else if (now - dead_since_ > 2.0) {
    v.standing = Standing::kDeadEncoder;
  } else if (now - spin_since_ >= 2.0) {
    v.standing = Standing::kSpin;
  }
  n_ = 0;
  length_ = ww_ = ff_ = 0;
  sum_w_ = sum_f_ = {};
  return v;
}

}  // namespace loxo
