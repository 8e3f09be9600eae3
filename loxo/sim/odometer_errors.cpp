// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/odometer_errors.hpp"

namespace loxo {

double wheel_factor(const std::vector<WheelFault>& faults, double t0, double t1) {
  double slip = 0, dead = 0;
  for (const WheelFault& f : faults) {
    const double share = max(0.0, min(t1, f.to) - max(t0, f.from)) / (t1 - t0);
    if (f.dead)
      dead += share;
    else
      slip += share * f.slip;
  }
  return (1.0 + slip) * (1.0 - min(1.0, dead));
}

double WayMemory::way() const {
  const double t = points_.back().t - delay_;
  if (t <= points_.front().t)
    return points_.front().way - points_.front().speed * (points_.front().t - t);
  if (points_.size() == 1 || delay_ == 0) return points_.back().way;
  const At &a = points_[0], &b = points_[1];
  const double d = b.t - a.t, x = (t - a.t) / d;
  const double h = x * x * (3 - 2 * x);
  return a.way + h * (b.way - a.way) + d * x * (1 - x) * ((1 - x) * a.speed - x * b.speed);
}

}  // namespace loxo
