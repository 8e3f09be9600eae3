// SPDX-License-Identifier: Apache-2.0
// Samples in, solution out: the joint filter of INS, odometer and fixes, sample by sample.
// Strapdown and covariance stand on ECEF axes, so no frame is ever switched under the filter; the
// frame of a row is a matter of display. No allocation after construction.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/estimate/measurements.hpp"
#include "loxo/estimate/standstill.hpp"
#include "loxo/estimate/start_covariance.hpp"
#include "loxo/ins/earth_model.hpp"
#include "loxo/ins/samples.hpp"
#include "loxo/ins/solution.hpp"

namespace loxo {

// 1-sigma, SI. Defaults are those of estimation.md 1.3 and 2; a drive's own declaration replaces
// them.
struct NavigatorConfig {
  Ellipsoid ellipsoid;
  double imu_interval = 0.01;  // s, nominal
  // Inertial sensors
  double gyro_noise = 0, accel_noise = 0;  // rad/sqrt(s), m/s/sqrt(s)
  double gyro_bias = 0, accel_bias = 0;    // rad/s, m/s^2
  double gyro_bias_tau = 3600,
         accel_bias_tau = 3600;            // s; `moving` of the bias is a walk with this time
  double bias_moving = 0.3;                // part of the bias sigma that moves
  double gyro_scale = 0, accel_scale = 0;  // 0: off
  // Which witnesses are used
  bool use_odometer = true, use_nhc = true, use_zupt = true, use_zaru = true;
  // Odometer
  double scale = 1, scale_std = 0.03, scale_walk = 3e-5;  // k; 1/sqrt(s)
  double eps_h = 0, eps_p = 0, eps_std = 0.034906585039886591;
  double lever[3]{}, lever_std = 0.3;
  double tau = 0, tau_std = 0, tau_walk = 0;  // s, s/sqrt(s)
  double speed_std = 0.1;                     // m/s at 1 Hz, of a speed reading
  double stamp_jitter = 0.1;                  // s, of a speed reading
  double speed_quantum = 0;                   // m/s, unit in which a speed is read
  // m/s: sigma of a speed reading's constant offset (0: none), and the speed at which k holds.
  double offset_std = 0, offset_speed = 0;
  double quantisation = 0;      // m, of a distance reading
  double scale_noise = 0;       // white, of each distance reading
  double reading_noise = 0;     // m, white, of each distance reading
  double way_noise = 0;         // m/sqrt(m), white over the way
  double slip_noise = 0;        // rad, white, of each distance reading
  double distance_std = 0.01;   // m, of a distance epoch beside what is declared
  double odometer_epoch = 1.0;  // s: distances are summed up to this
  bool unsigned_wheel = false;  // the sign of the reading is not that of the motion
  // Non-holonomic constraint [EST-13]
  double nhc_epoch = 1.0, nhc_std = 0.02;                  // s, m per epoch
  double nhc_side = 0.03, nhc_up = 0.05, nhc_turn = 0.02;  // m/sqrt(s), m/sqrt(s), 1
  // Standing still
  StandstillConfig standstill;
  double zupt_std = 0.02;  // m/s at 1 Hz
  double zaru_sway[3]{};   // rad/s, sd of the window means per body axis
  // Fixes and other sensors
  double fix_lever[3]{};
  double fix_std_min = 0;  // m
  // The states of extra_states.hpp: 0 is off, and where all are off the filter does not pay for
  // them.
  double fix_lever_std = 0;                            // m, each axis
  double height_bias_std = 0, height_bias_walk = 0;    // m, m/sqrt(s)
  double heading_bias_std = 0, heading_bias_walk = 0;  // rad, rad/sqrt(s)
  double gyro_misalignment = 0;                        // rad, each of the six elements
  bool fix_gate = true;  // false: user fixes, never rejected (diagnosed)
  double fix_velocity_std = 0.1;
  double heading_std = 0.0087, height_std = 5.0, velocity_std = 0.1;
  double vertical_std = 0;  // > 0: height held to the start's with this sigma at 1 Hz (fixed, ship)
  Gate gate;
  double gap_rate = 0.03, gap_force = 0.7;  // rad/s, m/s^2: what may happen inside a gap (1.5)
  // s. After a longer gap a turn may be missing: the filter coasts through it, and a heading whose
  // sigma is then above heading_lost [rad] is taken out of the filter until fixes give it back.
  double long_gap = 2.0, heading_lost = 0.05;
  double gap_level = 0.05;  // rad: slopes between two places of a road
  // Divergence: the mean of y^2/S over `contradiction_time`, each capped at 100, stays above
  // `contradiction` for twice that time. The gate alone would hide it: a filter that rejects
  // everything looks calm.
  double contradiction = 25.0, contradiction_time = 30.0;
  // s. How far back a late measurement is put in its place (the filter goes back and does the
  // samples since then again: 2 us each); older ones are refused. 0: nothing comes late. Fixed at
  // construction: about 6 kB of memory per 0.1 s.
  double late_limit = 2.0;
  double lock_time = 30.0;     // s of motion until rejection must end: longer than a slip, shorter
                               // than an INS's memory
  double product_epoch = 1.0;  // s between epochs on the tape
};

// Whether any of the states of extra_states.hpp is on.
inline bool has_extra_states(const NavigatorConfig& c) {
  return c.fix_lever_std > 0 || c.height_bias_std > 0 || c.heading_bias_std > 0 ||
         c.gyro_misalignment > 0;
}

// What the filter starts from; P on ECEF axes, as start_covariance() has it.
struct NavigatorStart {
  NominalState state;
  Covariance<kStates> P;
};

enum class Sensor {
  kOdometer,
  kSide,
  kUp,
  kZeroVelocity,
  kZeroRate,
  kFix,
  kFixVelocity,
  kHeading,
  kHeight,
  kVelocity,
  kCount
};
const char* sensor_name(Sensor s);

// An innovation as it is judged: y = z - h in the sensor's SI unit, variance S with the stated
// noise (before a robust weight). A fix that is left out whole is told once, normalised.
struct Innovation {
  double t = 0;
  Sensor sensor = Sensor::kOdometer;
  double y = 0, variance = 0;
  Verdict verdict = Verdict::kAsIs;
};
class InnovationSink {
 public:
  virtual ~InnovationSink() = default;
  virtual void innovation(const Innovation& i) = 0;
};

// Accumulated: samples bridged in gaps, readings given a sign, dead-encoder seconds, slip and skid
// readings, wrong stamps; `late`: refused as too old, `rewound`: late and used in their place.
struct NavigatorEvents {
  long gaps = 0, long_gaps = 0, signs_turned = 0, wrong_stamps = 0, outlier_fixes = 0,
       lock_recoveries = 0, far_benchmarks = 0, late = 0, rewound = 0;
  double dead_encoder = 0, slip = 0, skid = 0, standing = 0;
  double first_dead = kNone, first_slip = kNone, first_wrong_stamp = kNone, first_far = kNone,
         far_metres = 0, stamp_shift = 0;  // s, sum: positive where the stamps are early
};

// All that a sample or a measurement changes, in one value: what is copied to come back to a time.
// Whatever is added to the filter's memory belongs here, or a late measurement would find it in
// the future.
struct NavigatorMemory {
  explicit NavigatorMemory(const StandstillConfig& standstill) : detector_(standstill) {}

  NominalState s_;
  Covariance<kStates> P_;
  ExtraCovariance X_;
  double x_[kAllStates]{};
  bool touched_ = false;
  StandstillDetector detector_;
  Standing standing_ = Standing::kMoving;
  std::array<InnovationCount, static_cast<int>(Sensor::kCount)> counts_{};
  NavigatorEvents events_;
  std::uint32_t health_ = 0, standing_health_ = 0;
  double health_until_ = -1e300;
  bool diverged_ = false;

  Vec<Body> w_eb_, f_, last_dtheta_, last_dv_, w_meas_, f_meas_;
  Vec<Ecef> a_;
  MountingAxes mounting_;
  double h0_ = 0, nhc_age_ = 0, vertical_age_ = 0, epoch_age_ = 0, last_dt_ = 0;
  bool have_tick_ = false;
  double tick_t_ = 0, tick_sum_ = 0, tick_noise_ = 0, tick_begin_ = 0, tick_begin_speed_ = 0,
         tick_begin_accel_ = 0, tick_side_ = 0;
  double odometer_used_t_ = -1e300, rejected_since_ = 1e300, inflated_t_ = -1e300,
         fix_rejected_since_ = 1e300;
  double stopped_t_ = 0;
  // In a long gap; after it, until a fix agrees; variance of a heading that is lost (0: it is not)
  // and where it was lost; the fix from which the way to the next one is measured.
  bool coasting_ = false, recovering_ = false, anchored_ = false;
  double lost_variance_ = 0;
  Point<Ecef> lost_from_, anchor_fix_, anchor_;
  double coast_tick_t_ = -1e300;
  double contradiction_ = 0, contradiction_n_ = 0, contradiction_t_ = -1e300,
         contradicted_since_ = 1e300;
};

class Navigator : private NavigatorMemory {
 public:
  explicit Navigator(const NavigatorConfig& config);
  void start(const NavigatorStart& start);
  void set_tape(FilterTape* tape) { tape_ = tape; }
  // Told every innovation; what is done again for a late measurement is told again.
  void set_sink(InnovationSink* sink) { sink_ = sink; }

  // A sample that ends at sample.t > state().t. Measurements whose time has come are used.
  void imu(const ImuIncrement<double>& sample);
  // Measurements may be given ahead of the strapdown (they wait), or late by up to `late_limit`, in
  // any order: at the next sample the filter goes back and is, to the bit, what it would be had
  // they come in time. Settings changed meanwhile hold for what is done again. False: not taken, as
  // the queue is full, an odometer's time goes back, or the time lies before all that is remembered
  // (counted; the next row's health says "measurement rejected"). With a tape nothing is
  // remembered: a measurement must come before its sample.
  bool odometer(const OdometerTick& tick);
  bool fix(const Fix& fix);
  // A surveyed point or a user's own fix: weighted, never rejected; far ones are counted.
  bool benchmark(const Fix& fix);
  bool heading(const HeadingSample& heading);
  bool height(const HeightSample& height);
  bool velocity(const VelocitySample& velocity);

  double t() const { return s_.t; }
  const NominalState& state() const { return s_; }
  // What the filter works with; stated_covariance() is what it knows: while the heading is lost the
  // whole way since then may lie turned about where it was, and the filter itself, that cannot
  // learn of it from wheel and constraint, is kept from trying.
  const Covariance<kStates>& covariance() const { return P_; }
  Covariance<kStates> stated_covariance() const;
  bool lost() const { return lost_variance_ > 0; }
  // The rest of it, where has_extra().
  const ExtraCovariance& extra_covariance() const { return X_; }
  bool has_extra() const { return extra_; }
  const NavigatorConfig& config() const { return config_; }
  // Mutable, for a caller that turns a sensor on or off at a time.
  NavigatorConfig& settings() { return config_; }
  std::uint32_t health() const { return health_ | standing_health_; }
  Standing standing() const { return standing_; }
  const InnovationCount& innovations(Sensor s) const { return counts_[static_cast<int>(s)]; }
  bool diverged() const { return diverged_; }
  using Events = NavigatorEvents;
  const Events& events() const { return events_; }
  // The solution at state().t; the sigma of the true heading grows as tan L near a pole, as it
  // must.
  SolutionRow row(FrameId frame) const;

 private:
  struct Pending;
  struct History;
  void process(const ImuIncrement<double>& sample, std::uint32_t said);
  void remember();
  std::uint32_t rewind();
  double arrival(double t, bool near_is_in_time);
  void step(double dt, const Vec<Body>& dtheta, const Vec<Body>& dv, double extra_psi,
            double extra_dv);
  MeasurementPoint point(double age) const;
  bool scalar(Sensor sensor, const ScalarMeasurement& m, double z, double r, const Gate& gate,
              Weighed* out = nullptr, double inflate = 0);
  void close();
  ExtraCovariance* rest() { return extra_ ? &X_ : nullptr; }
  void projection(const SparseRow<double>& row, FullProjection& out) const;
  void tape_flush();
  void stand_still_epoch();
  void side_epoch();
  void run_pending();
  // A reading of the wheel, and what the filter thinks of it: a wheel without sign gets one, or is
  // not sure of it (variance `unsure`); forward speed and acceleration at its time.
  struct WheelReading {
    const OdometerTick& tick;
    double interval;
    bool first;
    double speed = 0, sign = 1, unsure = 0, forward = 0, acceleration = 0;
  };
  void use_tick(const OdometerTick& tick);
  void use_coasting(const WheelReading& u, const MeasurementPoint& p);
  void use_speed(const WheelReading& u, const MeasurementPoint& p);
  void use_distance(const WheelReading& u);
  double way_since(double from) const;
  void begin_way(double t);
  void use_fix(const Fix& fix, bool user);
  void coast_to(double t);
  bool find_heading(const Fix& fix);
  void contradict(double nis);
  void judge_odometer(const Weighed& w, double y, double h, double t);
  void reset_accumulator(int axis, double value);

  NavigatorConfig config_;
  FilterTape* tape_ = nullptr;
  InnovationSink* sink_ = nullptr;
  std::unique_ptr<TransitionProduct> product_;
  EarthModel earth_;
  bool extra_ = false;
  std::uint32_t next_health_ = 0;
  double rewind_to_ = 1e300;  // the oldest late measurement that waits
  std::unique_ptr<Pending> pending_;
  std::unique_ptr<History> history_;

 public:
  ~Navigator();
  Navigator(const Navigator&) = delete;
  Navigator& operator=(const Navigator&) = delete;
};

// A row of the solution from a nominal state and its covariance.
SolutionRow solution_row(const Ellipsoid& ell, const NominalState& s, const Covariance<kStates>& P,
                         FrameId frame, std::uint32_t health);

}  // namespace loxo
