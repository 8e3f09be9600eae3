// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/navigator.hpp"

#include <algorithm>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/errors/level_errors.hpp"
#include "loxo/estimate/coasting.hpp"
#include "loxo/ins/strapdown.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// chi2 quantiles of 1, 2, 3 degrees: 0.95 and 1 - 1e-6 ([EST-9], vectors).
constexpr double kChi95[4] = {0, 3.841458820694124, 5.991464547107979, 7.814727903251179};
constexpr double kChiGate[4] = {0, 23.92812697687947, 27.631021115871036, 30.66484962115624};

// What waits and what was used lately, in order of its times; fixed capacity. `from`: not before
// the strapdown has passed this time, so that doing a stretch again finds every measurement when it
// came.
template <class T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : data_(capacity) {}
  bool ready(double now, double shift = 0) const {
    return next_ < end_ && at(next_).x.t - shift <= now + 1e-9 && at(next_).from < now;
  }
  T take() { return at(next_++).x; }
  bool push(const T& x, double from) {
    if (end_ - begin_ == data_.size()) {
      if (begin_ == next_) return false;
      begin_ = next_;  // what was used is forgotten first
    }
    std::uint64_t i = end_;
    while (i > begin_ && at(i - 1).x.t > x.t) {
      slot(i) = at(i - 1);
      --i;
    }
    slot(i) = {x, from};
    if (i < next_) ++next_;
    ++end_;
    return true;
  }
  std::uint64_t cursor() const { return next_; }
  bool remembers(std::uint64_t cursor) const { return cursor >= begin_; }
  void go_back(std::uint64_t cursor) { next_ = cursor; }
  void forget(std::uint64_t before) { begin_ = before; }

 private:
  struct Entry {
    T x;
    double from = 0;
  };
  Entry& slot(std::uint64_t i) { return data_[i % data_.size()]; }
  const Entry& at(std::uint64_t i) const { return data_[i % data_.size()]; }
  std::vector<Entry> data_;
  std::uint64_t begin_ = 0, next_ = 0, end_ = 0;
};

Vec<Ecef> row_of(const Block3<>& c, int i) { return {c.m[i][0], c.m[i][1], c.m[i][2]}; }

// Level axes that mean something everywhere: geographic, or by longitude 0 within a metre of the
// pole.
Rot<Geographic, Ecef> level_at(const Geodetic<double>& p) { return geographic_axes(p.lat, p.lon); }

}  // namespace

struct Navigator::Pending {
  Ring<OdometerTick> ticks{4096};
  struct Position {
    double t = 0;
    Fix fix;
    bool user = false;
  };
  Ring<Position> fixes{1024};
  Ring<HeadingSample> headings{1024};
  Ring<HeightSample> heights{1024};
  Ring<VelocitySample> velocities{1024};
  double last_tick = -1e300;
  bool started = false;
  std::array<std::uint64_t, 5> cursors() const {
    return {ticks.cursor(), fixes.cursor(), headings.cursor(), heights.cursor(),
            velocities.cursor()};
  }
  bool remembers(const std::array<std::uint64_t, 5>& c) const {
    return ticks.remembers(c[0]) && fixes.remembers(c[1]) && headings.remembers(c[2]) &&
           heights.remembers(c[3]) && velocities.remembers(c[4]);
  }
  void go_back(const std::array<std::uint64_t, 5>& c) {
    ticks.go_back(c[0]), fixes.go_back(c[1]), headings.go_back(c[2]), heights.go_back(c[3]),
        velocities.go_back(c[4]);
  }
  void forget(const std::array<std::uint64_t, 5>& c) {
    ticks.forget(c[0]), fixes.forget(c[1]), headings.forget(c[2]), heights.forget(c[3]),
        velocities.forget(c[4]);
  }
};

// The filter as it was at a few past times, and the samples since the first of them.
struct Navigator::History {
  struct Mark {
    NavigatorMemory memory;
    std::array<std::uint64_t, 5> cursors{};
    std::uint64_t sample = 0;  // of the next sample
  };
  History(const NavigatorConfig& c)
      : limit(c.late_limit),
        period(max(0.25, c.late_limit / 16)),
        marks(static_cast<std::size_t>(c.late_limit / period) + 3,
              Mark{NavigatorMemory(c.standstill), {}, 0}),
        samples(static_cast<std::size_t>(
                    min(1e6, (c.late_limit + 2 * period) / max(c.imu_interval, 1e-4))) +
                64) {}
  Mark& mark(std::size_t i) { return marks[(first + i) % marks.size()]; }
  ImuIncrement<double>& sample(std::uint64_t i) { return samples[i % samples.size()]; }
  void drop_oldest() {
    first = (first + 1) % marks.size();
    --count;
  }
  double limit, period;
  std::vector<Mark> marks;
  std::vector<ImuIncrement<double>> samples;
  std::size_t first = 0, count = 0;
  std::uint64_t end = 0;
};

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

// The time from which a measurement may be used: now, where it is ahead of the strapdown; its own
// time, where the filter can go back to it; NaN: too old. Within one sample of its own it is in
// time too where nothing is remembered of before, and for a wheel always.
double Navigator::arrival(double t, bool near_is_in_time) {
  if (!pending_->started) return -1e300;
  const double age = s_.t - t;
  const bool near = age <= config_.imu_interval * (1 + 1e-6);
  if (age < -1e-9 || (near && near_is_in_time)) return s_.t;
  const bool remembered =
      history_ && !tape_ && history_->count > 0 && age <= history_->limit + 1e-9 &&
      history_->mark(0).memory.s_.t < t - 1e-9 && pending_->remembers(history_->mark(0).cursors);
  if (remembered) {
    ++events_.rewound;
    rewind_to_ = min(rewind_to_, t);
    return t - 1e-8;
  }
  if (near) return s_.t;
  ++events_.late;
  next_health_ |= kHealthRejected;
  return kNone;
}
bool Navigator::odometer(const OdometerTick& tick) {
  if (!(tick.t > pending_->last_tick)) return false;
  const double from = arrival(tick.t, true);
  // A lost distance: the next reading begins anew.
  if (!(from == from)) return have_tick_ = have_tick_ && tick.is_speed, false;
  if (!pending_->ticks.push(tick, from)) return false;
  pending_->last_tick = tick.t;
  return true;
}
bool Navigator::fix(const Fix& f) {
  const double from = arrival(f.t, false);
  return from == from && pending_->fixes.push({f.t, f, false}, from);
}
bool Navigator::benchmark(const Fix& f) {
  const double from = arrival(f.t, false);
  return from == from && pending_->fixes.push({f.t, f, true}, from);
}
bool Navigator::heading(const HeadingSample& h) {
  const double from = arrival(h.t, false);
  return from == from && pending_->headings.push(h, from);
}
bool Navigator::height(const HeightSample& h) {
  const double from = arrival(h.t, false);
  return from == from && pending_->heights.push(h, from);
}
bool Navigator::velocity(const VelocitySample& v) {
  const double from = arrival(v.t, false);
  return from == from && pending_->velocities.push(v, from);
}

// A mark of the filter as it is; those no longer needed are dropped.
void Navigator::remember() {
  History& h = *history_;
  while (h.count > 1 && h.mark(1).memory.s_.t < s_.t - h.limit - 1e-9) h.drop_oldest();
  if (h.count == h.marks.size()) h.drop_oldest();
  History::Mark& m = h.mark(h.count++);
  m.memory = *this;
  m.cursors = pending_->cursors();
  m.sample = h.end;
  pending_->forget(h.mark(0).cursors);
}

// Back to the last mark before the oldest late measurement, and forward again. What the row to come
// has to tell of it.
std::uint32_t Navigator::rewind() {
  History& h = *history_;
  const double to = rewind_to_;
  rewind_to_ = 1e300;
  while (h.count > 1 && !(h.mark(h.count - 1).memory.s_.t < to - 1e-9)) --h.count;
  const auto rejected = [&] {
    long sum = 0;
    for (const InnovationCount& c : counts_) sum += c.rejected;
    return sum;
  };
  const long before = rejected(), late = events_.late, rewound = events_.rewound;
  const History::Mark& m = h.mark(h.count - 1);
  if (!pending_->remembers(m.cursors)) return 0;
  static_cast<NavigatorMemory&>(*this) = m.memory;
  pending_->go_back(m.cursors);
  events_.late = late;
  events_.rewound = rewound;
  for (std::uint64_t i = m.sample; i < h.end; ++i) {
    if (s_.t - h.mark(h.count - 1).memory.s_.t >= h.period) {
      const std::uint64_t end = h.end;
      h.end = i;
      remember();
      h.end = end;
    }
    process(h.sample(i), 0);
  }
  return rejected() > before ? kHealthRejected : 0u;
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

// Through a gap that may hide a turn: straight on, what may have happened as noise, the wheel as a
// speed. (1.5, with its totals over the gap; a heading is at worst uniform.)
void Navigator::coast_to(double t) {
  const double gap = t - s_.t, turn = min(config_.gap_rate * gap, kPi / sqrt(3.0)),
               level = min(config_.gap_rate * gap, config_.gap_level),
               force = config_.gap_force * config_.gap_force * gap;
  const int n = std::max(1, static_cast<int>(std::min(1e6, std::ceil(gap / 0.1))));
  const double h = gap / n;
  TransitionProduct* const product = tape_ ? product_.get() : nullptr;
  coasting_ = true;
  w_eb_ = {};
  a_ = {};
  for (int axis = 0; axis < 3; ++axis) reset_accumulator(axis, 0.0);
  for (int i = 0; i < n; ++i) {
    CoastNoise q;
    q.up = to_normal(config_.ellipsoid, s_.r).n;
    q.ahead = to_matrix(s_.q) * mounting_.axis[1];
    q.ahead = q.ahead - q.up * dot(q.ahead, q.up);
    q.ahead = q.ahead * (1.0 / max(norm(q.ahead), 1e-9));
    // A road vehicle whose wheel stands does not turn.
    const bool told = config_.use_nhc && coast_tick_t_ > s_.t - 1.5;
    const double moves = told ? min(1.0, dot(s_.v, s_.v)) : 1.0;
    q.heading = moves * turn * turn / gap;
    q.level = level * level / gap;
    q.forward = force;
    q.sideways = config_.use_nhc ? config_.speed_std * config_.speed_std / gap : force;
    coast(s_, P_, product, q, h, rest());
    for (int k = 0; k < 3; ++k) {
      const double wg = config_.bias_moving * config_.gyro_bias,
                   wa = config_.bias_moving * config_.accel_bias;
      P_.p[kBg + k][kBg + k] += 2.0 * wg * wg * h / config_.gyro_bias_tau;
      P_.p[kBa + k][kBa + k] += 2.0 * wa * wa * h / config_.accel_bias_tau;
    }
    if (config_.use_odometer) {
      P_.p[kScale][kScale] += config_.scale_walk * config_.scale_walk * h;
      P_.p[kTau][kTau] += config_.tau_walk * config_.tau_walk * h;
    }
    run_pending();
  }
  s_.t = t;
  coasting_ = false;
  last_dt_ = nhc_age_ = 0;
  have_tick_ = false;  // the way of the next reading began in the gap
  anchored_ = false;
  const Vec<Ecef> up = to_normal(config_.ellipsoid, s_.r).n;
  const double sigma = heading_sigma(P_, up);
  if (sigma > config_.heading_lost) {
    lost_variance_ = sigma * sigma;
    lost_from_ = s_.r;
    turn_heading(s_, P_, product, up, 0.0, 0.0, rest());
  }
}

Covariance<kStates> Navigator::stated_covariance() const {
  Covariance<kStates> P = P_;
  if (!lost()) return P;
  const Vec<Ecef> up = to_normal(config_.ellipsoid, s_.r).n, v = cross(s_.v, up),
                  r = cross(s_.r - lost_from_, up);
  const double g[9] = {up.x, up.y, up.z, v.x, v.y, v.z, r.x, r.y, r.z};
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) P.p[i][j] += lost_variance_ * (g[i] * g[j]);
  return P;
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
  const double limit =
      4.0 * sqrt(P_.p[3][3] + P_.p[4][4] + P_.p[5][5] + config_.zupt_std * config_.zupt_std) + 0.3;
  const StandstillVerdict v = detector_.judge(s_.t, speed, limit);
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
    if (z.rate == z.rate)
      scalar(Sensor::kHeight, velocity_along(p, Vec<Body>{}, n.n), z.rate, 0.01, open);
    close();
  }
  while (q.velocities.ready(s_.t)) {
    const VelocitySample z = q.velocities.take();
    const MeasurementPoint p = point(s_.t - z.t);
    const Geodetic<double> g = to_geodetic(config_.ellipsoid, p.r);
    const Block3<> level = block_of(level_at(g));
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

// The heading from a velocity, or from the way between two fixes against the way reckoned between
// them: a turn of any size. False: the fix is not to be used (too near to the last).
bool Navigator::find_heading(const Fix& f) {
  const MeasurementPoint p = point(s_.t - f.t);
  const Vec<Body> l = s_.antenna;
  const NormalHeight<double> n = to_normal(config_.ellipsoid, p.r);
  const Vec<Ecef> up = n.n;
  const auto level = [&](const Vec<Ecef>& x) { return x - up * dot(x, up); };
  const Geodetic<double> here = to_geodetic(config_.ellipsoid, p.r);
  const Point<Ecef> z =
      to_ecef(config_.ellipsoid, Geodetic<double>{f.lat, f.lon, f.h == f.h ? f.h : here.h});
  const double s2 = f.std_e * f.std_e + f.std_n * f.std_n,
               sigma = sqrt(max(s2, 2 * config_.fix_std_min * config_.fix_std_min));
  Vec<Ecef> told, own;
  double std = 0;
  bool found = false;
  if (f.ve == f.ve && f.vn == f.vn && hypot(f.ve, f.vn) > 5.0) {
    told = transpose(level_at(here)) * Vec<Geographic>{f.ve, f.vn, 0};
    own = level(p.v + p.C * cross(p.w_eb, l));
    std = (f.std_v > 0 ? f.std_v : config_.fix_velocity_std) / norm(told);
    found = norm(own) > 1.0;
  } else if (anchored_) {
    told = level(z - anchor_fix_);
    own = level(p.r + p.C * l - anchor_);
    const double way = norm(told), reckoned = norm(own);
    std = sigma / max(way, 1e-9);
    found = std < 0.1 && fabs(way - reckoned) < 4.0 * sigma + 0.1 * reckoned;
    if (!found && max(way, reckoned) < 10.0 * sigma) return false;
  }
  TransitionProduct* const product = tape_ ? product_.get() : nullptr;
  if (found) {
    turn_heading(s_, P_, product, up, atan2(dot(cross(own, told), up), dot(own, told)),
                 max(std, 1e-3), rest());
    lost_variance_ = 0;
    anchored_ = false;
  } else {
    anchored_ = true;
  }
  forget_position(P_, product, up, 1e4, rest());
  return true;
}

void Navigator::use_fix(const Fix& f, bool user) {
  const double age = s_.t - f.t;
  const bool was_lost = lost();
  if (was_lost && !find_heading(f)) return;
  const MeasurementPoint p = point(age);
  const Geodetic<double> here = to_geodetic(config_.ellipsoid, p.r);
  const Rot<Geographic, Ecef> C_ge = level_at(here);
  const Block3<> level = block_of(C_ge);
  const Vec<Body> l = s_.antenna;
  const bool with_h = f.h == f.h;
  const Point<Ecef> z =
      to_ecef(config_.ellipsoid, Geodetic<double>{f.lat, f.lon, with_h ? f.h : here.h});
  const int n = with_h ? 3 : 2;
  const double floor2 = config_.fix_std_min * config_.fix_std_min;
  double r[3] = {max(f.std_e * f.std_e, floor2), max(f.std_n * f.std_n, floor2),
                 max(f.std_u * f.std_u, floor2)};
  for (double& e : r)
    if (!(e > 0)) e = 1e-6;
  // The whole vector first: n^2 = y^T S^-1 y. [EST-9]
  ScalarMeasurement m[3];
  FullProjection a[3];
  double S[3][3], y[3];
  for (int i = 0; i < n; ++i) {
    m[i] = position_along(p, l, row_of(level, i), z);
    if (extra_) m[i].row.add3(kAntenna, transpose(p.C) * row_of(level, i));
    projection(m[i].row, a[i]);
    y[i] = -m[i].h;
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      S[i][j] = i == j ? r[i] : 0.0;
      for (int k = 0; k < m[i].row.n; ++k) S[i][j] += m[i].row.value[k] * a[j][m[i].row.index[k]];
    }
  auto norm2 = [&](const double e[3]) {  // by Cholesky
    double L[3][3]{}, u[3], sum = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) {
        double s = S[i][j];
        for (int k = 0; k < j; ++k) s -= L[i][k] * L[j][k];
        L[i][j] = i == j ? sqrt(max(s, 1e-300)) : s / L[j][j];
      }
      u[i] = e[i];
      for (int k = 0; k < i; ++k) u[i] -= L[i][k] * u[k];
      u[i] /= L[i][i];
      sum += u[i] * u[i];
    }
    return sum;
  };
  const double n2 = norm2(y);
  contradict(n2 / n);
  double factor = 0;
  if (!(n2 <= kChi95[n])) factor = sqrt(n2 / kChi95[n]) - 1.0;
  if (!(n2 <= kChiGate[n])) {
    // A shift of the stamp along the velocity that explains it, found on horizontal components.
    const Vec<Geographic> v = C_ge * p.v;
    const double v2 = v.x * v.x + v.y * v.y;
    bool wrong_stamp = false;
    double shift = 0;
    if (v2 > 4.0) {
      shift = (y[0] * v.x + y[1] * v.y) / v2;
      const double e[3] = {y[0] - v.x * shift, y[1] - v.y * shift, n == 3 ? y[2] : 0.0};
      wrong_stamp = fabs(shift) <= 5.0 && fabs(shift) > 0.2 && norm2(e) < kChi95[n];
    }
    health_ |= kHealthRejected;
    if (user && !wrong_stamp) {
      ++events_.far_benchmarks;
      events_.far_metres = max(events_.far_metres, norm(z - p.r));
      if (!(events_.first_far <= s_.t)) events_.first_far = s_.t;
    } else if (wrong_stamp) {
      ++events_.wrong_stamps;
      events_.stamp_shift += shift;
      if (!(events_.first_wrong_stamp <= s_.t)) events_.first_wrong_stamp = s_.t;
    } else {
      ++events_.outlier_fixes;
    }
    if (!user && fix_rejected_since_ > s_.t) fix_rejected_since_ = s_.t;
    const bool locked_out = s_.t - fix_rejected_since_ > 3.0 * config_.lock_time;
    if ((config_.fix_gate && !user && !locked_out) || wrong_stamp) {
      Weighed w{Verdict::kRejected, r[0], n2 / n};
      counts_[static_cast<int>(Sensor::kFix)].add(sqrt(n2 / n), 1.0, w);
      if (sink_) sink_->innovation({s_.t, Sensor::kFix, sqrt(n2 / n), 1.0, w.verdict});
      return;
    }
    if (locked_out) standing_health_ |= kHealthUncovered;
  } else {
    fix_rejected_since_ = 1e300;
    // After a long gap the first fix only says where; the next one whether that was right.
    if (n2 <= kChi95[n] && !was_lost) {
      if (!recovering_) standing_health_ &= ~static_cast<std::uint32_t>(kHealthUncovered);
      recovering_ = false;
    }
  }
  const Gate all{1e9, 0};
  for (int i = 0; i < n; ++i) scalar(Sensor::kFix, m[i], 0.0, r[i], all, nullptr, S[i][i] * factor);
  close();
  if (lost()) {
    const MeasurementPoint at = point(age);
    lost_from_ = s_.r;
    anchor_fix_ = z;
    anchor_ = at.r + at.C * l;
    return;
  }
  if (f.ve == f.ve && f.vn == f.vn) {
    const MeasurementPoint p2 = point(age);
    const double sd = f.std_v > 0 ? f.std_v : config_.fix_velocity_std, rv = sd * sd;
    const double zv[3] = {f.ve, f.vn, f.vu};
    for (int i = 0; i < 3; ++i) {
      if (!(zv[i] == zv[i])) continue;
      ScalarMeasurement mv = velocity_along(p2, s_.antenna, row_of(level, i));
      if (extra_) mv.row.add3(kAntenna, cross(transpose(p2.C) * row_of(level, i), p2.w_eb));
      scalar(Sensor::kFixVelocity, mv, zv[i], rv, config_.gate);
    }
    close();
  }
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

void alignment_covariance(const Ellipsoid& ell, const NominalState& s, double gyro_bias,
                          double accel_bias, double sigma_level, double sigma_heading,
                          bool static_heading, Covariance<kStates>& P) {
  const Geodetic<double> g = to_geodetic(ell, s.r);
  const Rot<Geographic, Ecef> C_ge = geographic_axes(g.lat, g.lon);
  const Rot<Geographic, Body> C = C_ge * to_matrix(s.q);
  double sl, cl;
  sincos(g.lat, sl, cl);
  const double gamma = normal_gravity(ell, sl, g.h), wn = ell.w_ie * cl, wu = ell.w_ie * sl;
  // [EST-14]: Phi_E = -a_N/g, Phi_N = a_E/g, Phi_U = (-g_E + w_U Phi_N)/w_N; A = dPhi/d(x_bg,
  // x_ba).
  double A[3][6]{};
  for (int j = 0; j < 3; ++j) {
    A[0][3 + j] = -C.m[1][j] / gamma;
    A[1][3 + j] = C.m[0][j] / gamma;
    if (static_heading) {
      A[2][j] = -C.m[0][j] / wn;
      A[2][3 + j] = wu / wn * C.m[0][j] / gamma;
    }
  }
  const double var[6] = {gyro_bias * gyro_bias,   gyro_bias * gyro_bias,   gyro_bias * gyro_bias,
                         accel_bias * accel_bias, accel_bias * accel_bias, accel_bias * accel_bias};
  const double white[3] = {sigma_level * sigma_level, sigma_level * sigma_level,
                           sigma_heading * sigma_heading};
  double L[3][3], cross_g[3][6];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      L[i][j] = i == j ? white[i] : 0.0;
      for (int k = 0; k < 6; ++k) L[i][j] += A[i][k] * var[k] * A[j][k];
    }
    for (int k = 0; k < 6; ++k) cross_g[i][k] = A[i][k] * var[k];
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double sum = 0;
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) sum += C_ge.m[a][i] * L[a][b] * C_ge.m[b][j];
      P.p[kPsi + i][kPsi + j] = sum;
    }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < i; ++j) P.p[i][j] = P.p[j][i];
  for (int k = 0; k < 6; ++k) {
    P.p[kBg + k][kBg + k] = var[k];
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (int a = 0; a < 3; ++a) sum += C_ge.m[a][i] * cross_g[a][k];
      P.p[kPsi + i][kBg + k] = P.p[kBg + k][kPsi + i] = sum;
    }
  }
}

}  // namespace loxo
