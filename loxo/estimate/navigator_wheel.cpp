// SPDX-License-Identifier: Apache-2.0
// The odometer in the joint filter.

#include "loxo/estimate/navigator.hpp"

namespace loxo {
namespace {

// m^2, of one distance reading, its quantisation apart.
double reading_variance(const NavigatorConfig& c, double way) {
  const double relative = c.scale_noise * way;
  return relative * relative + c.reading_noise * c.reading_noise +
         c.way_noise * c.way_noise * fabs(way);
}

}  // namespace

void Navigator::judge_odometer(const Weighed& w, double y, double h, double t) {
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
    // A wheel that reads otherwise for good has another scale: opened as of an unknown one, and at
    // once as far as it reads otherwise, so that it takes the blame and the velocity does not.
    const double other = min(fabs(s_.scale * y / h), 1.0);  // h is 0 where a wheel spins at rest
    double& k = P_.p[kScale][kScale];
    if (k > 0) k = max(max(2.0 * k, other * other), config_.scale_std * config_.scale_std);
    if (t - rejected_since_ > 60.0 && standing_ != Standing::kDeadEncoder)
      standing_health_ |= kHealthDiverged;
  }
}

void Navigator::use_tick(const OdometerTick& tick) {
  const double interval = have_tick_ ? tick.t - tick_t_ : 0.0;
  WheelReading u{tick, interval, !have_tick_};
  u.speed = tick.is_speed ? tick.value : interval > 0 ? tick.value / interval : 0.0;
  tick_t_ = tick.t;
  have_tick_ = true;
  // A counter is quiet where it has not changed: a creep far below wheel_quiet is no rest.
  const bool counts = !tick.is_speed && config_.quantisation > 0;
  detector_.wheel(s_.t,
                  counts ? fabs(tick.value) > 0.5 * config_.quantisation
                         : fabs(u.speed) > config_.standstill.wheel_quiet,
                  interval, s_.scale != 0 ? u.speed / s_.scale : u.speed);
  if (!config_.use_odometer) return;
  const MeasurementPoint p = point(s_.t - (tick.t - s_.tau));
  if (coasting_) {
    use_coasting(u, p);
    return;
  }
  u.forward = dot(mounting_.axis[1], transpose(p.C) * p.v);
  u.acceleration = dot(mounting_.axis[1], transpose(p.C) * p.a);
  const double forward_std = sqrt(P_.p[3][3] + P_.p[4][4] + P_.p[5][5]);
  constexpr double kBackward = 0.3;  // m/s
  if (config_.unsigned_wheel && u.forward < -kBackward && u.forward < -3.0 * forward_std) {
    u.sign = -1.0;
    if (fabs(u.speed) > config_.standstill.wheel_quiet) ++events_.signs_turned;
  } else if (config_.unsigned_wheel && u.forward < 0 && fabs(u.speed) < 2.0 * kBackward) {
    u.unsure = 4.0 * tick.value * tick.value;
  }
  if (tick.is_speed)
    use_speed(u, p);
  else
    use_distance(u);
}

// In a gap of the inertial unit no way can be summed up; the mean speed of each reading counts, and
// rest does as well.
void Navigator::use_coasting(const WheelReading& u, const MeasurementPoint& p) {
  const OdometerTick& tick = u.tick;
  if (!tick.is_speed && u.first) return;
  coast_tick_t_ = s_.t;
  const double var =
      tick.is_speed
          ? config_.speed_std * config_.speed_std / min(1.0, max(u.interval, 0.01))
          : (config_.quantisation * config_.quantisation / 6.0 +
             reading_variance(config_, tick.value) + config_.distance_std * config_.distance_std) /
                (u.interval * u.interval);
  scalar(Sensor::kOdometer, vehicle_velocity(p, s_, mounting_, 1, true), u.speed, var,
         Gate{config_.gate.c, 0});
  close();
}

void Navigator::use_speed(const WheelReading& u, const MeasurementPoint& p) {
  const double value = u.tick.value;
  // Zero readings carry no scale: standing is section 3's to say.
  if (fabs(value) < config_.standstill.wheel_quiet || standing_ == Standing::kDeadEncoder) return;
  const double direction = (value < 0 ? -1.0 : 1.0) * u.sign;
  const ScalarMeasurement m = vehicle_velocity(p, s_, mounting_, 1, true, direction);
  // Errors of a wheel's speed are correlated over a second: the figure is for 1 Hz.
  const double rate = u.interval > 0 && u.interval < 1.0 ? 1.0 / u.interval : 1.0;
  const double jitter = config_.stamp_jitter * u.acceleration;
  const double q = config_.speed_quantum;
  const double r =
      (config_.speed_std * config_.speed_std + q * q / 12.0 + jitter * jitter) * rate + u.unsure;
  Weighed w;
  const double y = u.sign * value - m.h;
  scalar(Sensor::kOdometer, m, u.sign * value, r, config_.gate, &w);
  close();
  judge_odometer(w, y, m.h, s_.t);
}

// Way of the wheel from a time within the last step to now, by the constants now in use.
double Navigator::way_since(double from) const {
  const MeasurementPoint at = point(s_.t - from);
  const Vec<Body> half = transpose(at.C) * (at.v + at.a * (0.5 * (s_.t - from)));
  return dot(mounting_.axis[1], half + cross(at.w_eb, s_.lever)) * (s_.t - from);
}

// A way begins where the delay now in use puts this tick, with the motion as now corrected: what
// was believed before this tick holds the errors that it took out.
void Navigator::begin_way(double t) {
  const double from = t - s_.tau;
  const MeasurementPoint at = point(s_.t - from);
  const Rot<Body, Ecef> C = transpose(at.C);
  tick_sum_ = tick_noise_ = 0;
  tick_begin_ = t;
  tick_begin_speed_ = dot(mounting_.axis[1], C * at.v);
  tick_begin_accel_ = dot(mounting_.axis[1], C * at.a);
  reset_accumulator(1, way_since(from));
}

// Summed over at least an epoch, so that quantisation of the ticks between cancels.
void Navigator::use_distance(const WheelReading& u) {
  const OdometerTick& tick = u.tick;
  tick_side_ = u.interval > 0 ? u.interval : 0.0;
  if (u.first || u.interval > 10.0) {
    begin_way(tick.t);
    return;
  }
  tick_sum_ += u.sign * tick.value;
  tick_noise_ += reading_variance(config_, tick.value) + u.unsure;
  if (tick.t - tick_begin_ < config_.odometer_epoch * (1 - 1e-9)) return;
  const bool zero = fabs(tick_sum_) < config_.standstill.wheel_quiet * (tick.t - tick_begin_);
  if (!zero && standing_ != Standing::kDeadEncoder) {
    s_.d[1] -= way_since(tick.t - s_.tau);
    const double change = u.forward - tick_begin_speed_;
    ScalarMeasurement m = accumulated_distance(s_, s_.scale * change);
    const double q = config_.quantisation, jitter = config_.stamp_jitter * s_.scale * change;
    // Second order in the delay, d2h/dtau2 = k (a2 - a1): its mean and its variance. With a delay
    // known to 0.1 s it outweighs a good wheel's noise while the vehicle sets off.
    const double bend = s_.scale * (u.acceleration - tick_begin_accel_) * P_.p[kTau][kTau];
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
    judge_odometer(w, y, m.h, s_.t);
  }
  begin_way(tick.t);
}

}  // namespace loxo
