// SPDX-License-Identifier: Apache-2.0
// Covariance analysis without Monte Carlo: what every source of error alone does to an inertial
// solution and to a dead reckoning along a nominal motion, and all of them together. First order in
// the errors; sources are independent, so variances add. The motion comes as states at the ends of
// steps (0.1 s serves a vehicle): specific force and turn rate follow from them.
#pragma once
#include <array>
#include <cstddef>
#include <memory>
#include <string_view>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/ins/mechanization.hpp"

namespace loxo {

enum class BudgetSource {
  kGyroBias,
  kGyroScale,
  kGyroNoise,
  kGyroWalk,
  kAccelBias,
  kAccelScale,
  kAccelNoise,
  kAccelWalk,
  kLevel,
  kHeading,
  kStartPosition,
  kStartVelocity,
  kDeflection,
  kOdometerScale,
  kMountingHeading,
  kMountingPitch,
  kScaleNoise,
  kSideSlip,
  kQuantisation,
  kAttitudeBias,
  kAttitudeDrift,
  kAttitudeNoise,
  kMapFormula
};
inline constexpr std::size_t kBudgetSources = 23;
std::string_view budget_source_name(BudgetSource s);   // "gyro_bias" …, as in drive.toml
std::string_view budget_source_words(BudgetSource s);  // "gyro bias" …

// 1 sigma, SI; 0: not there. Inertial sensors: each axis.
struct BudgetErrors {
  double gyro_bias = 0, accel_bias = 0;          // rad/s, m/s^2
  double gyro_bias_tau = 0, accel_bias_tau = 0;  // s; 0: constant, else Gauss-Markov
  double gyro_scale = 0, accel_scale = 0;        // 1
  double gyro_noise = 0, accel_noise = 0;        // rad/sqrt(s), m/s/sqrt(s)
  double gyro_walk = 0, accel_walk = 0;          // rad/s/sqrt(s), m/s^2/sqrt(s)
  double level = 0, heading = 0;                 // alignment, each level axis; azimuth [rad]
  double position = 0, velocity = 0;             // start, each horizontal axis [m, m/s]
  double deflection = 0,
         deflection_length = 20000;  // of the vertical, each axis [rad]; m along track
  double scale = 0, mounting_heading = 0, mounting_pitch = 0;  // odometer's constants: ln k, rad
  double scale_noise = 0, side_slip = 0;  // white, each odometer interval: 1, rad
  double quantisation = 0;                // m of indicated distance
  double odometer_interval = 0.1;         // s
  double attitude_bias = 0, attitude_drift = 0, attitude_noise = 0;  // of an attitude sensor: rad,
                                                                     // rad/s, rad/sqrt(s)
};
struct BudgetConfig {
  Ellipsoid ellipsoid;
  BudgetErrors errors;
  // Level and heading at the start were found from the biased sensors themselves [EST-14]: biases
  // and deflection bring their part of the alignment error with them. Not at a pole.
  bool self_aligned = false;
  bool height_known = true;  // false: the vertical channel runs free
  bool attitude_sensor =
      false;  // the reckoning's heading is a sensor's, not the inertial solution's
  // Headings are counted from true north (not within 0.1 deg of a pole); false: attitude is kept
  // without one, as in ECEF.
  bool true_heading = true;
};

// Variances and covariances of the horizontal errors at an epoch, east and north of the nominal.
struct SourceVariance {
  double ee = 0, nn = 0, en = 0;     // inertial position, m^2
  double vee = 0, vnn = 0;           // inertial velocity, m^2/s^2
  double psi_up = 0, heading = 0;    // of the attitude about up; of its heading (against the axes
                                     // where it believes to be), rad^2
  double dee = 0, dnn = 0, den = 0;  // reckoned position, m^2
};
using BudgetRow = std::array<SourceVariance, kBudgetSources>;
SourceVariance total(const BudgetRow& row);

class CovarianceBudget {
 public:
  // Throws Error(kInput) for a negative or non-finite sigma, and for self-alignment or true
  // headings at a pole (on start).
  explicit CovarianceBudget(const BudgetConfig& config);
  ~CovarianceBudget();
  void start(const EcefState<double>& state);
  // The nominal state dt [s] later. Error of one step against the exact transition: 1e-7 at 0.1 s.
  void step(const EcefState<double>& state, double dt);
  // Sources that take part; the others' rows are zero.
  const std::vector<BudgetSource>& sources() const { return sources_; }
  // `map` [m]: east and north error of the formula that the reckoning counts with (deterministic),
  // as the caller found it.
  BudgetRow row(std::array<double, 2> map = {0, 0}) const;

 private:
  struct Impl;
  BudgetConfig config_;
  std::vector<BudgetSource> sources_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loxo
