// SPDX-License-Identifier: Apache-2.0
// "This unit in the polar region": free-inertial drift at home and, with the record moved, at the
// pole, from many starts; and what of the difference is conversion, mechanization and physics
// (polar.md 7).
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "loxo/log/drive.hpp"
#include "loxo/sim/transfer_budget.hpp"

namespace loxo {

struct PolarTrialSettings {
  PolarMove move;
  ReferenceSigma sigma;  // of the reference: what the conversion error is made of
  std::vector<double> windows = {60, 300};  // s
  std::size_t most_starts = 100;
};

// One start of one window: horizontal errors at its end, east and north in the transverse axes,
// which the move keeps.
struct PolarTrialStart {
  double t = 0;                               // s
  double home[2] = {}, pole[2] = {};          // m
  double home_heading = 0, pole_heading = 0;  // rad, frame-free: about the vertical
  double conversion = 0;          // m, 1 sigma predicted of |pole - home| by the reference's errors
  double conversion_heading = 0;  // rad
  double mechanization = 0;       // m: largest distance between two polar mechanizations
  // What the other Earth rate and gravity make of the unit's own errors, first order: of pole -
  // home the part that a voyage at the pole would show as well.
  double physics[2] = {};      // m
  double physics_heading = 0;  // rad
};
struct PolarTrialWindow {
  double length = 0;  // s
  std::vector<PolarTrialStart> starts;
};
struct PolarTrialResult {
  std::vector<PolarTrialWindow> windows;
  std::vector<double> t, home_lat, home_lon, pole_lat, pole_lon;  // s, rad: the voyages
  std::size_t samples = 0;
  double begin_t = 0, end_t = 0;
};

// The record is converted in memory, once as it is and once for each error of the reference. Height
// is held to the reference. Throws Error(kInput) as transfer_drive() does, and where the log is
// shorter than the shortest window.
PolarTrialResult polar_trial(const Drive& drive, const PolarTrialSettings& settings,
                             Diagnostics& diagnostics, const std::function<void(double)>& progress);

// Median, 95 % and largest of values; kNone for none.
struct Quantiles {
  double p50 = kNone, p95 = kNone, max = kNone;
};
Quantiles quantiles(std::vector<double> values);

}  // namespace loxo
