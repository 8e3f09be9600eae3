// SPDX-License-Identifier: Apache-2.0
// The odometer in the joint filter.

#include "loxo/estimate/navigator.hpp"

namespace loxo {

void Navigator::judge_odometer(const Weighed& w, double y, double t) {
  if (w.verdict == Verdict::kRejected) {
    health_ |= kHealthSlip;
    (y > 0 ? events_.slip : events_.skid) += 1;
    if (!(events_.first_slip <= t)) events_.first_slip = t;
    if (rejected_since_ > t) rejected_since_ = t;
  } else {
    if (w.verdict == Verdict::kAsIs && standing_health_ & kHealthSlip)
      standing_health_ &= ~static_cast<std::uint32_t>(kHealthSlip);
    rejected_since_ = 1e300;
    return;
  }
  // Rejection must end (1.7): no second witness says which is wrong, so the filter's own certainty
  // is what gives way.
  if (t - rejected_since_ > config_.lock_time && t - inflated_t_ >= 1.0) {
    inflated_t_ = t;
    ++events_.lock_recoveries;
    standing_health_ |= kHealthSlip | kHealthUncovered;
    for (int i = 0; i < 6; ++i) P_.p[i][i] *= 2.0;
    // A wheel that reads otherwise for good has another scale: opened as of an unknown one, and
    // further, so that it takes the blame before the velocity does.
    double& k = P_.p[kScale][kScale];
    if (k > 0) k = max(2.0 * k, config_.scale_std * config_.scale_std);
    if (t - rejected_since_ > 60.0 && standing_ != Standing::kDeadEncoder)
      standing_health_ |= kHealthDiverged;
  }
}

void Navigator::use_tick(const OdometerTick& tick) {
  const double tv = tick.t - s_.tau, age = s_.t - tv;
  const double interval = have_tick_ ? tick.t - tick_t_ : 0.0;
  double speed = tick.is_speed ? tick.value : interval > 0 ? tick.value / interval : 0.0;
  const double before = tick_t_;
  const bool first = !have_tick_;
  tick_t_ = tick.t;
  have_tick_ = true;
  // A counter is quiet where it has not changed: a creep far below wheel_quiet is no rest.
  const bool counts = !tick.is_speed && config_.quantisation > 0;
  detector_.wheel(s_.t,
                  counts ? fabs(tick.value) > 0.5 * config_.quantisation
                         : fabs(speed) > config_.standstill.wheel_quiet,
                  interval, s_.scale != 0 ? speed / s_.scale : speed);
  if (!config_.use_odometer) return;
  const MeasurementPoint p = point(age);
  if (coasting_) {  // no way can be summed up; rest counts as well
    if (!tick.is_speed && first) return;
    coast_tick_t_ = s_.t;
    const double way = config_.scale_noise * tick.value;
    const double var = tick.is_speed
                           ? config_.speed_std * config_.speed_std / min(1.0, max(interval, 0.01))
                           : (config_.quantisation * config_.quantisation / 6.0 + way * way +
                              config_.distance_std * config_.distance_std) /
                                 (interval * interval);
    scalar(Sensor::kOdometer, vehicle_velocity(p, s_, mounting_, 1, true), speed, var,
           Gate{config_.gate.c, 0});
    close();
    return;
  }
  const double forward = dot(mounting_.axis[1], transpose(p.C) * p.v);
  const double forward_std = sqrt(P_.p[3][3] + P_.p[4][4] + P_.p[5][5]);
  double sign = 1.0;
  double unsure = 0;  // variance of a reading whose sign is not known, of its own dimension
  constexpr double kBackward = 0.3;  // m/s
  if (config_.unsigned_wheel && forward < -kBackward && forward < -3.0 * forward_std) {
    sign = -1.0;
    if (fabs(speed) > config_.standstill.wheel_quiet) ++events_.signs_turned;
  } else if (config_.unsigned_wheel && forward < 0 && fabs(speed) < 2.0 * kBackward) {
    unsure = 4.0 * tick.value * tick.value;
  }
  const Vec<Body> ab = transpose(p.C) * p.a;
  const double a_forward = dot(mounting_.axis[1], ab);
  if (tick.is_speed) {
    // Zero readings carry no scale: standing is section 3's to say.
    if (fabs(tick.value) < config_.standstill.wheel_quiet || standing_ == Standing::kDeadEncoder)
      return;
    const double direction = (tick.value < 0 ? -1.0 : 1.0) * sign;
    const ScalarMeasurement m = vehicle_velocity(p, s_, mounting_, 1, true, direction);
    // Errors of a wheel's speed are correlated over a second: the figure is for 1 Hz.
    const double rate = interval > 0 && interval < 1.0 ? 1.0 / interval : 1.0;
    const double jitter = config_.stamp_jitter * a_forward;
    const double q = config_.speed_quantum;
    const double r =
        (config_.speed_std * config_.speed_std + q * q / 12.0 + jitter * jitter) * rate + unsure;
    Weighed w;
    const double y = sign * tick.value - m.h;
    scalar(Sensor::kOdometer, m, sign * tick.value, r, config_.gate, &w);
    close();
    judge_odometer(w, y, s_.t);
    return;
  }
  // Way of the wheel from a time within the last step to now, by the constants now in use.
  const auto way_since = [&](double from) {
    const MeasurementPoint at = point(s_.t - from);
    const Vec<Body> half = transpose(at.C) * (at.v + at.a * (0.5 * (s_.t - from)));
    return dot(mounting_.axis[1], half + cross(at.w_eb, s_.lever)) * (s_.t - from);
  };
  // A way begins where the delay now in use puts this tick, with the motion as now corrected: what
  // was believed before this tick holds the errors that it took out.
  const auto begin = [&] {
    const double from = tick.t - s_.tau;
    const MeasurementPoint at = point(s_.t - from);
    const Rot<Body, Ecef> C = transpose(at.C);
    tick_sum_ = tick_noise_ = 0;
    tick_begin_ = tick.t;
    tick_begin_speed_ = dot(mounting_.axis[1], C * at.v);
    tick_begin_accel_ = dot(mounting_.axis[1], C * at.a);
    reset_accumulator(1, way_since(from));
  };
  // Distance: summed over at least an epoch, so that quantisation of the ticks between cancels.
  tick_side_ = interval > 0 ? interval : 0.0;
  if (first || interval > 10.0) {
    begin();
    return;
  }
  tick_sum_ += sign * tick.value;
  const double noise = config_.scale_noise * tick.value;
  tick_noise_ += noise * noise + unsure;
  (void)before;
  if (tick.t - tick_begin_ < config_.odometer_epoch * (1 - 1e-9)) return;
  const bool zero = fabs(tick_sum_) < config_.standstill.wheel_quiet * (tick.t - tick_begin_);
  if (!zero && standing_ != Standing::kDeadEncoder) {
    s_.d[1] -= way_since(tv);
    const double change = forward - tick_begin_speed_;
    ScalarMeasurement m = accumulated_distance(s_, s_.scale * change);
    const double q = config_.quantisation, jitter = config_.stamp_jitter * s_.scale * change;
    // Second order in the delay, d2h/dtau2 = k (a2 - a1): its mean and its variance. With a delay
    // known to 0.1 s it outweighs a good wheel's noise while the vehicle sets off.
    const double bend = s_.scale * (a_forward - tick_begin_accel_) * P_.p[kTau][kTau];
    m.h += 0.5 * bend;
    // And in scale times delay, d2h/dk dtau = -(v2 - v1): 3 mm where 3 % meets 0.1 s at 1 m/s^2.
    m.h -= change * P_.p[kScale][kTau];
    const double both =
        change * change *
        (P_.p[kScale][kScale] * P_.p[kTau][kTau] + P_.p[kScale][kTau] * P_.p[kScale][kTau]);
    const double r = q * q / 6.0 + tick_noise_ + config_.distance_std * config_.distance_std +
                     jitter * jitter * 0.01 + 0.5 * bend * bend + both;
    Weighed w;
    const double y = tick_sum_ - m.h;
    scalar(Sensor::kOdometer, m, tick_sum_, r, config_.gate, &w);
    close();
    judge_odometer(w, y, s_.t);
  }
  begin();
}

}  // namespace loxo
