// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/epoch_filter.hpp"

#include "loxo/earth/geodetic.hpp"
#include "loxo/num/functions.hpp"

namespace loxo {

StartSigmas start_sigmas(const EpochFilterConfig& c) {
  StartSigmas s;
  s.gyro_bias = c.gyro_bias, s.accel_bias = c.accel_bias;
  s.level = c.level_std, s.heading = c.heading_std;
  // A given attitude says nothing of the biases.
  s.static_heading = s.correlated = c.static_alignment;
  s.velocity = c.velocity_std, s.position = c.position_std;
  s.gyro_scale = {c.gyro_scale, c.gyro_scale, c.gyro_scale};
  s.accel_scale = {c.accel_scale, c.accel_scale, c.accel_scale};
  s.scale = c.scale_std, s.eps_h = c.mounting_std, s.eps_p = c.pitch_std;
  return s;
}

EpochFilter::EpochFilter(const EpochFilterConfig& c, const NominalState& start) : config_(c) {
  P_ = start_covariance(c.ellipsoid, start, start_sigmas(c));
}

void EpochFilter::use(const ScalarMeasurement& m, double z, double variance, const Gate& gate) {
  alignas(64) Projection<kStates> a;
  project(P_, m.row, a);
  double y = z - m.h;
  for (int k = 0; k < m.row.n; ++k) y -= m.row.value[k] * x_[m.row.index[k]];
  const Weighed w = weigh(y, a.s0, variance, gate);
  update(P_, x_, a, y, w.r, w.verdict != Verdict::kRejected);
}

void EpochFilter::epoch(NominalState& s, const EpochMotion& e, const EpochMeasurements& z) {
  const EpochFilterConfig& c = config_;
  const double dt = e.dt;
  const auto place = to_normal(c.ellipsoid, s.r);
  ErrorPoint<Ecef> p;
  p.C_mb = e.C;
  p.v = e.v;
  p.w_ie = {0, 0, c.ellipsoid.w_ie};
  p.w = (1.0 / dt) * e.dtheta;
  p.f = (1.0 / dt) * e.dv;
  p.gradient = gravity_gradient<double>(c.ellipsoid, place.n, place.h);
  const ErrorTransition<double> t = error_transition(p, dt);
  ErrorNoise<double> q = error_noise(c.gyro_noise, c.accel_noise, dt, e.C * e.dv);
  q.bg = c.gyro_walk * c.gyro_walk * dt;
  q.ba = c.accel_walk * c.accel_walk * dt;
  MeasurementPoint at;
  at.C = e.C;
  at.v = e.v;
  at.r = s.r;
  at.w_ie = p.w_ie;
  at.w_eb = p.w - transpose(e.C) * p.w_ie;
  const MountingAxes mounting = mounting_axes(s.eps_h, s.eps_p);
  const AccumulatorTransition<double> acc = accumulator_transition(at, s, mounting, dt);
  predict(P_, t, q, &acc);
  P_.p[kScale][kScale] += c.scale_walk * c.scale_walk * dt;

  for (double& x : x_) x = 0;
  const Gate gate, open{1e9, 0};
  if (given(z.way)) {
    const double own = c.scale_noise * z.way, side = c.side_slip * z.way;
    use(accumulated_distance(s, 0.0), z.way, c.way_noise * c.way_noise + own * own, gate);
    use(accumulated_side(s, 0), 0.0, c.side_std * c.side_std + side * side, gate);
    use(accumulated_side(s, 2), 0.0, c.side_std * c.side_std, gate);
  }
  at.C = to_matrix(s.q);
  at.v = s.v;
  // Up from the ellipsoid's foot of the state: the height itself.
  if (given(z.height)) {
    const Point<Ecef> foot = from_normal(c.ellipsoid, NormalHeight<double>{place.n, 0.0});
    use(position_along(at, {}, place.n, foot), z.height, c.height_std * c.height_std, open);
  }
  if (z.has_fix) {
    const double variance = max(1e-6, c.fix_std * c.fix_std);
    const Vec<Ecef> axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (const auto& axis : axes)
      use(position_along(at, {}, axis, s.r), dot(axis, z.fix - s.r), variance, gate);
  }
  feed_back(s, x_);
  reset_attitude(P_, x_);
  for (int i = kAcc; i < kAcc + 3; ++i) {
    s.d[i - kAcc] = 0;
    for (int j = 0; j < kStates; ++j) P_.p[i][j] = P_.p[j][i] = 0;
  }
}

}  // namespace loxo
