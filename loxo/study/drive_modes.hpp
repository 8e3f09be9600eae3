// SPDX-License-Identifier: Apache-2.0
// What a drive trial may do beside running free: be calibrated, filtered, or navigated by the
// segmented method; and what its trials share.
#pragma once
#include <string>
#include <vector>

#include "loxo/estimate/epoch_filter.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/estimate/segmented.hpp"
#include "loxo/study/drive_truth.hpp"
#include "loxo/study/lane_values.hpp"
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

template <Real S>
DeclaredErrors<double> lane_of(const DeclaredErrors<S>& d, int k) {
  const auto of = [&](const S& x) { return lane_of(x, k); };
  return {of(d.gyro_noise),   of(d.accel_noise), of(d.gyro_walk),  of(d.accel_walk),
          of(d.gyro_bias),    of(d.accel_bias),  of(d.gyro_scale), of(d.accel_scale),
          of(d.level),        of(d.heading),     of(d.scale),      of(d.scale_walk),
          of(d.scale_markov), of(d.scale_noise), of(d.noise),      of(d.distance_noise),
          of(d.quantisation), of(d.side_slip),   of(d.mounting),   of(d.mounting_pitch),
          of(d.fix),          of(d.height)};
}
// The start as lane `k` computes it, with the mounting as believed: forward is turned clockwise by
// the mounting error (rad) from the true one, and up by the pitch error.
template <Real S>
NominalState believed_start(const DriveSetup& set, const EcefState<S>& start, const S& mounting,
                            const S& pitching, int k) {
  const EcefState<double> x = lane_of(start, k);
  NominalState s;
  s.r = x.r, s.v = x.v, s.q = x.q_eb;
  s.eps_h = set.mounting_heading - lane_of(mounting, k);
  s.eps_p = set.mounting_pitch + lane_of(pitching, k);
  return s;
}
// A position against the truth of its time, on the horizontal: its distance [m], and normalised
// squared by the stated covariance (expected 2) [EST-1].
struct HorizontalMiss {
  double squared = 0, distance = 0, nees = 0;
};
HorizontalMiss horizontal_miss(const NominalState& s, const Covariance<kStates>& P,
                               const DriveTruth::Epoch& truth);

EpochFilterConfig epoch_filter_config(const DriveSetup& set, const DeclaredErrors<double>& d);

SegmentedConfig segmented_config(const DriveSetup& set, const DeclaredErrors<double>& d);
// Of the filter at every sample; fills the covariance of `start`, whose state is given.
NavigatorConfig navigator_config(const DriveSetup& set, const DeclaredErrors<double>& d,
                                 NavigatorStart& start);

}  // namespace loxo
