// SPDX-License-Identifier: Apache-2.0
// What a drive trial may do beside running free: be calibrated, filtered, or navigated by the
// segmented method; what its trials share; and the way from lanes to doubles and back.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "loxo/estimate/epoch_filter.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/estimate/segmented.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/study/drive_truth.hpp"
#include "loxo/study/trial.hpp"

namespace loxo {

struct DriveModes {
  bool inertial = true, reckon = true, calibrate = false, filter = false, segmented = false,
       navigator = false;
  std::string text() const;
};
// What all trials share.
struct DriveSetup {
  Ellipsoid ellipsoid;
  DriveTruth truth;
  DriveModes modes;
  ImuSurroundings around;
  std::string around_text;  // in canonical form
  bool static_alignment = false;
  double gravity = 9.8, percent = 0;  // m/s^2 at the start; 100 / way [1/m]
  double mounting_heading = 0, mounting_pitch = 0, scale_markov_time = 600;
  std::size_t at_inertial = 0, at_reckon = 0, at_calibrate = 0, at_filter = 0, at_segmented = 0,
              at_navigator = 0;
  // Epochs at which the modes segmented and navigator tell their errors; and of the first three
  // minutes, at which phase 1 tells its scale.
  std::vector<std::size_t> fan, early_fan;
};
// Throws Error(kInput) for what cannot be, as static alignment near a pole.
DriveSetup drive_setup(const TomlTable& settings, const Scenario& scenario);

std::vector<MetricInfo> calibration_metrics();
std::vector<MetricInfo> filter_metrics();  // the fan follows
std::vector<MetricInfo> segmented_metrics(const DriveSetup& set);
std::vector<MetricInfo> navigator_metrics(const DriveSetup& set);
inline constexpr std::size_t kFilterMetrics = 8;
// INS, reckoned, weighted, naive, intersection, joint.
inline constexpr std::size_t kSegmentedSeries = 6;

// 1 sigma of a trial's sensors, as a user would declare them.
template <Real S>
struct DeclaredErrors {
  S gyro_noise, accel_noise, gyro_walk, accel_walk, gyro_bias, accel_bias, gyro_scale, accel_scale;
  S level, heading, scale, scale_walk, scale_markov, scale_noise, noise, distance_noise,
      quantisation, side_slip, mounting, mounting_pitch, fix, height;
};
template <Real S>
struct TrackSigmas {
  S heading, drift, heading_noise, scale_noise, quantisation;
};

// A scalar's lanes as doubles and back.
inline void spread(double x, double* out) { out[0] = x; }
inline void spread(const Lanes& x, double* out) { x.store(out); }
template <Real S>
S gather(const double* in) {
  if constexpr (std::same_as<S, double>)
    return in[0];
  else
    return Lanes::load(in);
}
template <Real S>
inline constexpr int kWide = ScalarTraits<S>::kLanes;

// The lanes of several numbers, one row a lane.
template <Real S, std::size_t N>
struct Spread {
  double lane[kWide<S>][N];
  explicit Spread(const std::array<S, N>& x) {
    double v[8];
    for (std::size_t j = 0; j < N; ++j) {
      spread(x[j], v);
      for (int k = 0; k < kWide<S>; ++k) lane[k][j] = v[k];
    }
  }
};
template <Real S, class F>
std::array<S, 3> three(const Vec<F, S>& v) {
  return {v.x, v.y, v.z};
}
template <Real S>
DeclaredErrors<double> lane_of(const DeclaredErrors<S>& d, int k) {
  const auto of = [&](const S& x) {
    double v[8];
    spread(x, v);
    return v[k];
  };
  return {of(d.gyro_noise),   of(d.accel_noise), of(d.gyro_walk),  of(d.accel_walk),
          of(d.gyro_bias),    of(d.accel_bias),  of(d.gyro_scale), of(d.accel_scale),
          of(d.level),        of(d.heading),     of(d.scale),      of(d.scale_walk),
          of(d.scale_markov), of(d.scale_noise), of(d.noise),      of(d.distance_noise),
          of(d.quantisation), of(d.side_slip),   of(d.mounting),   of(d.mounting_pitch),
          of(d.fix),          of(d.height)};
}
EpochFilterConfig epoch_filter_config(const DriveSetup& set, const DeclaredErrors<double>& d);

SegmentedConfig segmented_config(const DriveSetup& set, const DeclaredErrors<double>& d);
// Of the filter at every sample; fills the covariance of `start`, whose state is given.
NavigatorConfig navigator_config(const DriveSetup& set, const DeclaredErrors<double>& d,
                                 NavigatorStart& start);

}  // namespace loxo
