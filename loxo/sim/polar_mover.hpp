// SPDX-License-Identifier: Apache-2.0
// A recorded log walked through the polar test: the IMU's increments converted at mid-interval with
// the state of a recorded reference, which may be far slower than the IMU. One pass, constant
// memory (one reference interval of samples).
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "loxo/ins/solution.hpp"
#include "loxo/sim/polar_transfer.hpp"

namespace loxo {

// A reference epoch in ECEF.
struct ReferenceEpoch {
  double t = 0;
  EcefPose<double> e;
};

// The state between two reference epochs comes from the log's own increments, carried in ECEF from
// the first epoch; what is missing at the second (gyro and accelerometer bias, reference noise) is
// spread in proportion to time. Position is the cubic through both positions and velocities. These
// misclosures are the measure of how well reference and IMU agree.
struct ClosureStatistics {
  std::size_t intervals = 0;
  std::size_t open_intervals = 0;              // with a hole in the log: nothing to close
  double attitude_rms = 0, attitude_max = 0;   // rad per interval
  double velocity_rms = 0, velocity_max = 0;   // m/s per interval
  double interval_mean = 0, interval_max = 0;  // s
};

// One converted sample, with the states the conversion used (at mid-interval).
struct MovedSample {
  ImuIncrement<double> imu;
  TransverseState<double> home, moved;
  Conversion<double> conversion;
};

class PolarMover {
 public:
  // `next_reference` gives the epochs in time order, nullopt at the end. `longest_gap` [s]: a
  // longer reference interval throws Error(kInput) with its times. `emit_reference` gets each
  // epoch's moved state.
  PolarMover(const PolarMove& move, std::function<std::optional<ReferenceEpoch>()> next_reference,
             double longest_gap, std::function<void(const MovedSample&)> emit,
             std::function<void(double t, const TransverseState<double>& home,
                                const TransverseState<double>& moved)>
                 emit_reference);
  // The next sample in time order. Samples whose middle lies before the first or after the last
  // epoch are not converted and counted.
  void add(const ImuIncrement<double>& sample);
  // After the last sample: the rest of the reference.
  void finish();

  std::size_t before() const { return before_; }  // samples left out before the reference begins …
  std::size_t after() const { return after_; }    // … and after it ends
  double first_reference() const { return first_; }
  double last_reference() const { return k1_.t; }
  ClosureStatistics closure() const;

 private:
  bool next_interval();
  void close_interval();
  void advance(const TransverseState<double>& home, double t);
  TransverseState<double> moved_of(const TransverseState<double>& home);

  PolarMove move_;
  std::function<std::optional<ReferenceEpoch>()> next_;
  double longest_gap_;
  std::function<void(const MovedSample&)> emit_;
  std::function<void(double, const TransverseState<double>&, const TransverseState<double>&)>
      emit_reference_;
  ReferenceEpoch k0_, k1_;
  bool started_ = false, ended_ = false;
  double first_ = 0;
  std::vector<ImuIncrement<double>> held_;  // samples that overlap the interval [k0, k1]
  ImuIncrement<double> last_;               // the sample before them
  double p_ = 0, l_ = 0;                    // E1: where the moved path has come to, at p_t_
  double p_t_ = 0;
  Vec<Transverse, double> p_v_;
  std::size_t before_ = 0, after_ = 0;
  ClosureStatistics sums_;
};

// Reference epochs from the rows of a solution. Throws Error(kInput) for a row without position,
// velocity or attitude.
ReferenceEpoch reference_epoch(const SolutionRow& row, const std::string& where);

}  // namespace loxo
