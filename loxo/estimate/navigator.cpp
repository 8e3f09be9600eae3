// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/navigator.hpp"

#include <algorithm>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/errors/level_errors.hpp"
#include "loxo/estimate/coasting.hpp"
#include "loxo/estimate/navigator_queue.hpp"
#include "loxo/ins/strapdown.hpp"

namespace loxo {

const char* sensor_name(Sensor s) {
  static const char* const names[] = {"odometer",  "nhc_right", "nhc_up",       "zero_velocity",
                                      "zero_rate", "fix",       "fix_velocity", "heading",
                                      "height",    "velocity"};
  return names[static_cast<int>(s)];
}

Navigator::Navigator(const NavigatorConfig& config)
    : NavigatorMemory(config.standstill),
      config_(config),
      product_(std::make_unique<TransitionProduct>()),
      earth_(make_earth_model(config.ellipsoid)),
      pending_(std::make_unique<Pending>()),
      history_(config.late_limit > 0 ? std::make_unique<History>(config) : nullptr) {}
Navigator::~Navigator() = default;

void Navigator::start(const NavigatorStart& start) {
  s_ = start.state;
  P_ = start.P;
  X_ = {};
  if (dot(s_.antenna, s_.antenna) == 0)
    s_.antenna = {config_.fix_lever[0], config_.fix_lever[1], config_.fix_lever[2]};
  const auto on = [&](int i, double sigma) { X_.e[i - kStates][i - kStates] = sigma * sigma; };
  extra_ = has_extra_states(config_);
  for (int i = 0; i < 3; ++i) on(kAntenna + i, config_.fix_lever_std);
  on(kHeightBias, config_.height_bias_std);
  on(kHeadingBias, config_.heading_bias_std);
  for (int i = 0; i < 6; ++i) on(kMisalignment + i, config_.gyro_misalignment);
  h0_ = to_normal(config_.ellipsoid, s_.r).h;
  mounting_ = mounting_axes(s_.eps_h, s_.eps_p);
  product_->clear();
  std::fill(std::begin(x_), std::end(x_), 0.0);
  stopped_t_ = s_.t;
  pending_->started = true;
  rewind_to_ = 1e300;
  if (history_) history_->count = 0;
  if (tape_) tape_->epoch(s_, P_, rest(), health());
}

// age > 0: the measurement was valid that long before the strapdown's time.
MeasurementPoint Navigator::point(double age) const {
  MeasurementPoint p;
  const Rot<Ecef, Body> C = to_matrix(s_.q);
  p.C = age == 0 ? C : to_matrix(normalized(s_.q * exp_rotation<Body, Body>(w_eb_ * (-age))));
  p.a = a_;
  p.v = s_.v - a_ * age;
  p.r = s_.r - (s_.v - a_ * (0.5 * age)) * age;
  p.w_eb = w_eb_;
  p.w_ie = {0, 0, config_.ellipsoid.w_ie};
  return p;
}

void Navigator::imu(const ImuIncrement<double>& sample) {
  if (!(sample.t > s_.t)) return;
  std::uint32_t said = next_health_;
  next_health_ = 0;
  if (rewind_to_ < 1e300) said |= rewind();
  if (history_ && !tape_) {
    History& h = *history_;
    if (h.count == 0 || s_.t - h.mark(h.count - 1).memory.s_.t >= h.period ||
        h.end - h.mark(h.count - 1).sample >= h.samples.size())
      remember();
    while (h.end - h.mark(0).sample >= h.samples.size()) h.drop_oldest();
    h.sample(h.end++) = sample;
  }
  process(sample, said);
}

void Navigator::process(const ImuIncrement<double>& sample, std::uint32_t said) {
  const double gap = sample.t - s_.t;
  health_ = said;
  const double nominal = config_.imu_interval;
  if (gap > 3.0 * nominal || sample.dt > 3.0 * nominal) {
    ++events_.gaps;
    health_ |= kHealthGap;
  }
  const double hole = gap - sample.dt;
  if (hole > config_.long_gap) {
    ++events_.long_gaps;
    standing_health_ |= kHealthUncovered;
    recovering_ = true;
    coast_to(sample.t - sample.dt);
    step(sample.dt, sample.dtheta, sample.dv, 0, 0);
    s_.t = sample.t;
    run_pending();
  } else if (gap > 3.0 * nominal || sample.dt > 3.0 * nominal) {
    // 1.5: interpolated between the rates on both sides, with the noise of what may have happened.
    const int n =
        std::max(1, static_cast<int>(std::min(1e6, std::ceil(gap / std::max(nominal, 0.01)))));
    const double h = gap / n, per = 1.0 / max(sample.dt, 1e-9);
    const Vec<Body> w1 = sample.dtheta * per, f1 = sample.dv * per;
    const bool known = last_dt_ > 0;
    const Vec<Body> w0 = known ? w_meas_ : w1, f0 = known ? f_meas_ : f1;
    for (int i = 0; i < n; ++i) {
      const double u = (i + 0.5) / n;
      step(h, (w0 * (1 - u) + w1 * u) * h, (f0 * (1 - u) + f1 * u) * h,
           config_.gap_rate * config_.gap_rate * gap * h,
           config_.gap_force * config_.gap_force * gap * h);
      run_pending();
    }
    s_.t = sample.t;
  } else {
    // A heading that is lost leaves the level axes turning with the Earth in a wrong direction.
    const double wrong = config_.ellipsoid.w_ie * config_.ellipsoid.w_ie * lost_variance_ * 60.0;
    step(gap, sample.dtheta * (gap / sample.dt), sample.dv * (gap / sample.dt), wrong * gap, 0);
    s_.t = sample.t;
    stand_still_epoch();
    side_epoch();
    run_pending();
  }
  epoch_age_ += gap;
  if (tape_ && epoch_age_ >= config_.product_epoch * (1 - 1e-9)) {
    tape_flush();
    tape_->epoch(s_, P_, rest(), health());
    epoch_age_ = 0;
  }
  const double speed2 = dot(s_.v, s_.v), h = norm(s_.r - Point<Ecef>{});
  if (!(speed2 < 1e8) || !(h > 6.2e6 && h < 7.5e6) || !(P_.p[kDr][kDr] >= 0)) {
    diverged_ = true;
    standing_health_ |= kHealthDiverged;
  }
}

void Navigator::step(double dt, const Vec<Body>& dtheta_m, const Vec<Body>& dv_m, double extra_psi,
                     double extra_dv) {
  const Ellipsoid& ell = config_.ellipsoid;
  auto corrected = [](const Vec<Body>& x, const Vec<Body>& b, const Vec<Body>& g, double h) {
    return Vec<Body>{(x.x - b.x * h) / (1 + g.x), (x.y - b.y * h) / (1 + g.y),
                     (x.z - b.z * h) / (1 + g.z)};
  };
  Vec<Body> dtheta = corrected(dtheta_m, s_.bg, s_.sg, dt);
  const Vec<Body> dv = corrected(dv_m, s_.ba, s_.sa, dt);
  if (extra_) dtheta = dtheta - misaligned(s_.misalignment, dtheta);
  const double rate = 1.0 / dt;
  w_meas_ = dtheta_m * rate;
  f_meas_ = dv_m * rate;
  const Vec<Ecef> w_ie{0, 0, ell.w_ie};
  const Vec<Body> w = dtheta * rate;
  f_ = dv * rate;

  // One-sample coning and sculling with the increments before (polar.md 3.2's terms, rate carried
  // over).
  // One sample and its predecessor, and the house's one strapdown loop on ECEF axes (polar.md 3.2).
  const ImuIncrement<double> now{s_.t + dt, dt, dtheta, dv};
  const bool same = last_dt_ > 0 && fabs(last_dt_ - dt) < 0.01 * dt;
  const StepIncrement<double> u =
      same ? one_sample(ImuIncrement<double>{s_.t, last_dt_, last_dtheta_, last_dv_}, now)
           : one_sample(now);
  last_dtheta_ = dtheta;
  last_dv_ = dv;
  last_dt_ = dt;
  const EcefMechanization::Position<double> here =
      EcefMechanization::from_ecef(earth_, EcefState<double>{s_.r, s_.v, s_.q}).position;
  const State<EcefMechanization> after =
      loxo::step(earth_, State<EcefMechanization>{s_.q, s_.v, here}, u);
  const Vec<Ecef> v1 = after.v, v_mid = 0.5 * (s_.v + v1);
  const Quat<Ecef, Body> q_half = exp_rotation<Ecef, Ecef>(w_ie * (-0.5 * dt)) * s_.q *
                                  exp_rotation<Body, Body>(0.5 * u.rotation);

  MeasurementPoint mid;
  mid.C = to_matrix(q_half);
  mid.v = v_mid;
  mid.w_ie = w_ie;
  w_eb_ = w - transpose(mid.C) * w_ie;
  mid.w_eb = w_eb_;
  a_ = (v1 - s_.v) * rate;

  ErrorPoint<Ecef> p;
  p.C_mb = mid.C;
  p.v = v_mid;
  p.w_ie = w_ie;
  p.w = w;
  p.f = f_;
  p.gradient = gravity_gradient(ell, here.n, here.h);
  const ErrorTransition<double> t = error_transition(p, dt);
  ErrorNoise<double> q = error_noise(config_.gyro_noise, config_.accel_noise, dt, mid.C * dv);
  q.psi += extra_psi;
  q.dv += extra_dv;
  const double wg = config_.bias_moving * config_.gyro_bias,
               wa = config_.bias_moving * config_.accel_bias;
  q.bg = 2.0 * wg * wg * dt / config_.gyro_bias_tau;
  q.ba = 2.0 * wa * wa * dt / config_.accel_bias_tau;
  double d[3];
  accumulator_rate(mid, s_, mounting_, d);
  AccumulatorTransition<double> acc = accumulator_transition(mid, s_, mounting_, dt);
  across_the_way(acc, d);
  if (!extra_) {
    predict(P_, t, q, &acc);
  } else {
    const MisalignmentTransition turn = misalignment_transition(t, w);
    predict(P_, X_, t, q, &acc, config_.gyro_misalignment > 0 ? &turn : nullptr);
    const auto walk = [&](int i, double density) {
      X_.e[i - kStates][i - kStates] += density * density * dt;
    };
    walk(kHeightBias, config_.height_bias_walk);
    walk(kHeadingBias, config_.heading_bias_walk);
    if (tape_) product_->advance_extra(t, acc, turn);
  }
  if (tape_) product_->advance(t, acc);

  for (int i = 0; i < 3; ++i) s_.d[i] += dt * d[i];
  // [EST-13]: slip is process noise of the accumulators, and the walks of the odometer's constants.
  const double v2 = min(1.0, d[1] * d[1]);
  const double side_a = dot(w_eb_, Vec<Body>{0, 0, 1}) * d[1];
  const double slip = config_.slip_noise * d[1];
  P_.p[kAcc][kAcc] +=
      dt * (config_.nhc_side * config_.nhc_side * v2 +
            config_.nhc_turn * config_.nhc_turn * side_a * side_a + slip * slip * tick_side_);
  P_.p[kAcc + 2][kAcc + 2] += dt * config_.nhc_up * config_.nhc_up * v2;
  if (config_.use_odometer) {
    P_.p[kScale][kScale] += config_.scale_walk * config_.scale_walk * dt;
    P_.p[kTau][kTau] += config_.tau_walk * config_.tau_walk * dt;
  }

  s_.r = after.position.r;
  s_.v = after.v;
  s_.q = normalized(after.q_nb);
  s_.t += dt;
  nhc_age_ += dt;
  vertical_age_ += dt;
}

void Navigator::tape_flush() {
  if (!tape_ || product_->identity) return;
  tape_->transition(*product_);
  product_->clear();
}

void Navigator::projection(const SparseRow<double>& row, FullProjection& out) const {
  if (extra_)
    project(P_, X_, row, out);
  else
    project(P_, row, out.main);
}

// `inflate`: added to r where a vector as a whole is weighted; statistics are without it.
bool Navigator::scalar(Sensor sensor, const ScalarMeasurement& m, double z, double r,
                       const Gate& gate, Weighed* out, double inflate) {
  FullProjection a;
  projection(m.row, a);
  double hx = 0;
  for (int k = 0; k < m.row.n; ++k) hx += m.row.value[k] * x_[m.row.index[k]];
  const double y = z - m.h - hx;
  Weighed w = weigh(y, a.main.s0, r, gate);
  if (inflate > 0) {
    w.verdict = Verdict::kDeweighted;
    w.r += inflate;
  }
  counts_[static_cast<int>(sensor)].add(y, a.main.s0 + r, w);
  if (sink_) sink_->innovation({s_.t, sensor, y, a.main.s0 + r, w.verdict});
  if (out) *out = w;
  if (sensor != Sensor::kFix && sensor != Sensor::kZeroVelocity && sensor != Sensor::kZeroRate)
    contradict(w.nis);
  if (w.verdict == Verdict::kRejected) {
    health_ |= kHealthRejected;
    return false;
  }
  double gain[kAllStates];
  if (tape_) tape_flush();
  if (extra_)
    update(P_, X_, x_, a, y, w.r, gain);
  else
    update(P_, x_, a.main, y, w.r, true, tape_ ? gain : nullptr);
  if (tape_) tape_->measurement(m.row, a.main.s0 + w.r, y, gain);
  touched_ = true;
  return true;
}

// The end of an epoch: closed loop, no estimate survives it. [EST-6], [EST-7]
void Navigator::close() {
  if (!touched_) return;
  feed_back(s_, x_);
  if (extra_) feed_back_extra(s_, x_ + kStates);
  // The delay in use moves both ends of the accumulated way: its begin here, its end at the tick.
  s_.d[1] += tick_begin_speed_ * x_[kTau];
  const double psi2 = x_[0] * x_[0] + x_[1] * x_[1] + x_[2] * x_[2];
  if (psi2 > 1e-6) {
    reset_attitude(P_, x_);
    if (extra_) reset_attitude(X_, x_);
    if (tape_) product_->reset_attitude(x_);
  }
  mounting_ = mounting_axes(s_.eps_h, s_.eps_p);
  std::fill(std::begin(x_), std::end(x_), 0.0);
  touched_ = false;
}

void Navigator::reset_accumulator(int axis, double value) {
  s_.d[axis] = value;
  const int i = kAcc + axis;
  for (int j = 0; j < kStates; ++j) P_.p[i][j] = P_.p[j][i] = 0;
  for (double& c : X_.c[i]) c = 0;
  if (tape_) product_->reset_accumulator(axis);
}

void Navigator::stand_still_epoch() {
  const Vec<Body> rest =
      s_.bg + transpose(to_matrix(s_.q)) * Vec<Ecef>{0, 0, config_.ellipsoid.w_ie};
  detector_.sample(last_dt_, w_meas_, f_meas_, rest);
  const double speed = norm(s_.v);
  const double sigma =
      sqrt(P_.p[3][3] + P_.p[4][4] + P_.p[5][5] + config_.zupt_std * config_.zupt_std);
  const StandstillVerdict v = detector_.judge(s_.t, speed, sigma);
  if (!v.complete) return;
  standing_ = v.standing;
  standing_health_ &= ~static_cast<std::uint32_t>(kHealthDeadEncoder);
  if (v.standing == Standing::kDeadEncoder) {
    if (!(events_.first_dead <= s_.t)) events_.first_dead = s_.t;
    events_.dead_encoder += v.length;
    standing_health_ |= kHealthDeadEncoder;
  }
  if (v.standing != Standing::kStanding && v.standing != Standing::kSpin) return;
  events_.standing += v.length;
  stopped_t_ = s_.t;
  rejected_since_ = 1e300;
  const MeasurementPoint p = point(0);
  const Gate open{config_.gate.c, 0};  // decided by the witnesses, not by a gate
  if (config_.use_zupt) {
    const double r = config_.zupt_std * config_.zupt_std / v.length;  // the figure is for 1 Hz
    for (int i = 0; i < 3; ++i) scalar(Sensor::kZeroVelocity, zero_velocity(p, i), 0.0, r, open);
  }
  if (config_.use_zaru) {
    const double white = config_.gyro_noise * config_.gyro_noise / v.length;
    const double z[3] = {v.mean_w.x, v.mean_w.y, v.mean_w.z};
    // The level axes see the Earth turn from a heading: not from a lost one.
    for (int i = lost() ? 2 : 0; i < 3; ++i)
      scalar(Sensor::kZeroRate, zero_rate(p, s_, i), z[i],
             white + config_.zaru_sway[i] * config_.zaru_sway[i], open);
  }
  close();
}

void Navigator::side_epoch() {
  if (config_.vertical_std > 0 && vertical_age_ >= 1.0 - 1e-9) {
    vertical_age_ = 0;
    const MeasurementPoint p = point(0);
    const NormalHeight<double> n = to_normal(config_.ellipsoid, s_.r);
    const Point<Ecef> held = from_normal(config_.ellipsoid, NormalHeight<double>{n.n, h0_});
    scalar(Sensor::kHeight, position_along(p, Vec<Body>{}, n.n, held), 0.0,
           config_.vertical_std * config_.vertical_std, Gate{config_.gate.c, 0});
    close();
  }
  if (nhc_age_ < config_.nhc_epoch * (1 - 1e-9)) return;
  nhc_age_ = 0;
  if (config_.use_nhc) {
    const double r = config_.nhc_std * config_.nhc_std;
    scalar(Sensor::kSide, accumulated_side(s_, 0), 0.0, r, config_.gate);
    scalar(Sensor::kUp, accumulated_side(s_, 2), 0.0, r, config_.gate);
    close();
  }
  reset_accumulator(0, 0.0);
  reset_accumulator(2, 0.0);
}

void Navigator::run_pending() {
  Pending& q = *pending_;
  while (q.ticks.ready(s_.t, s_.tau)) {
    const OdometerTick tick = q.ticks.take();
    use_tick(tick);
  }
  while (q.fixes.ready(s_.t)) {
    const Pending::Position f = q.fixes.take();
    use_fix(f.fix, f.user);
  }
  const Gate open{config_.gate.c, 0};
  while (q.headings.ready(s_.t)) {
    const HeadingSample z = q.headings.take();
    const MeasurementPoint p = point(s_.t - z.t);
    const NormalHeight<double> n = to_normal(config_.ellipsoid, p.r);
    const LevelAxes<double> a = geographic_level_axes(config_.ellipsoid, n.n, n.h);
    ScalarMeasurement m = heading_in(p, row_of(a.C_me, 0), row_of(a.C_me, 1), n.n, a.azimuth_turn);
    m.h += s_.heading_bias;
    if (extra_) m.row.add(kHeadingBias, 1.0);
    const double sd = z.std > 0 ? z.std : config_.heading_std;
    if (lost()) {
      const double bias = X_.e[kHeadingBias - kStates][kHeadingBias - kStates];
      turn_heading(s_, P_, tape_ ? product_.get() : nullptr, n.n, -wrap_pi(z.heading - m.h),
                   sqrt(sd * sd + bias), rest());
      lost_variance_ = 0;
      continue;
    }
    scalar(Sensor::kHeading, m, m.h + wrap_pi(z.heading - m.h), sd * sd, config_.gate);
    close();
  }
  while (q.heights.ready(s_.t)) {
    const HeightSample z = q.heights.take();
    const MeasurementPoint p = point(s_.t - z.t);
    const NormalHeight<double> n = to_normal(config_.ellipsoid, p.r);
    const Point<Ecef> held = from_normal(config_.ellipsoid, NormalHeight<double>{n.n, z.h});
    ScalarMeasurement m = position_along(p, Vec<Body>{}, n.n, held);
    m.h += s_.height_bias;
    if (extra_) m.row.add(kHeightBias, 1.0);
    scalar(Sensor::kHeight, m, 0.0, config_.height_std * config_.height_std, open);
    if (given(z.rate))
      scalar(Sensor::kHeight, velocity_along(p, Vec<Body>{}, n.n), z.rate, 0.01, open);
    close();
  }
  while (q.velocities.ready(s_.t)) {
    const VelocitySample z = q.velocities.take();
    const MeasurementPoint p = point(s_.t - z.t);
    const Geodetic<double> g = to_geodetic(config_.ellipsoid, p.r);
    const Block3<> level = block_of(geographic_axes(g.lat, g.lon));
    const double r = config_.velocity_std * config_.velocity_std;
    for (int i = 0; i < 3; ++i)
      if (z.v[i] == z.v[i])
        scalar(Sensor::kVelocity,
               z.level ? velocity_along(p, Vec<Body>{}, row_of(level, i))
                       : body_velocity(p, Vec<Body>{}, i),
               z.v[i], r, config_.gate);
    close();
  }
}

void Navigator::contradict(double nis) {
  const double tau = config_.contradiction_time,
               keep = exp(-max(s_.t - contradiction_t_, 0.0) / tau);
  contradiction_t_ = s_.t;
  contradiction_ = keep * contradiction_ + min(nis, 100.0);
  contradiction_n_ = keep * contradiction_n_ + 1.0;
  if (contradiction_n_ < 10.0 || !(contradiction_ > config_.contradiction * contradiction_n_)) {
    contradicted_since_ = 1e300;
    return;
  }
  contradicted_since_ = min(contradicted_since_, s_.t);
  if (s_.t - contradicted_since_ > 2.0 * tau) standing_health_ |= kHealthDiverged;
}

SolutionRow Navigator::row(FrameId frame) const {
  return solution_row(config_.ellipsoid, s_, stated_covariance(), frame, health());
}

SolutionRow solution_row(const Ellipsoid& ell, const NominalState& s, const Covariance<kStates>& P,
                         FrameId frame, std::uint32_t health) {
  SolutionRow r = solution_row(ell, s.t, s.r, s.v, s.q);
  const Rot<Geographic, Ecef> C = geographic_axes(r.lat, r.lon);
  double* std[3] = {&r.std_e, &r.std_n, &r.std_u};
  for (int i = 0; i < 3; ++i) {
    double sum = 0;
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) sum += C.m[i][j] * P.p[kDr + j][kDr + k] * C.m[i][k];
    *std[i] = sqrt(max(sum, 0.0));
  }
  // Phi_U = psi_U + tanL dE/(N+h): the sigma of the true heading. [EST-2]
  double sl, cl;
  sincos(r.lat, sl, cl);
  const double turn = sl / max(cl, 1e-12) / (prime_vertical_radius(ell, sl) + r.h);
  double c[9]{}, sum = 0;
  for (int j = 0; j < 3; ++j) c[j] = C.m[2][j], c[kDr + j] = turn * C.m[0][j];
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) sum += c[i] * P.p[i][j] * c[j];
  r.std_heading = sqrt(max(sum, 0.0));
  r.frame = frame;
  r.health = health;
  return r;
}

}  // namespace loxo
