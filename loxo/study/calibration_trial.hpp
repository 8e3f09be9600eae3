// SPDX-License-Identifier: Apache-2.0
// One recorded track calibrated at its end, as a trial of a campaign: in double, a plain function.
#pragma once
#include <cstddef>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/earth/frames.hpp"
#include "loxo/ins/samples.hpp"
#include "loxo/num/geometry.hpp"

namespace loxo {

struct CalibrationTrial {
  const Ellipsoid* ellipsoid = nullptr;
  const std::vector<TrackStep>* track = nullptr;
  Point<Ecef> start, end;                 // true
  double scale = 1, eps = 0;              // true
  double benchmark_std = 0, survey[4]{};  // m; errors of start and end, north and east
  // As declared: rad, rad/s, rad/sqrt(s), 1, m.
  double heading_bias = 0, heading_drift = 0, heading_noise = 0, scale_noise = 0, quantisation = 0;
};
inline constexpr std::size_t kCalibrationMetrics = 9;
// Estimated - true of ln k and eps by replay, their sigmas, the squared errors over their
// covariance; the same errors by the rhumb chord; closure of replay [m]; NaN where a method is not
// valid.
void calibrate_trial(const CalibrationTrial& trial, double out[kCalibrationMetrics]);

}  // namespace loxo
