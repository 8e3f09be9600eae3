// SPDX-License-Identifier: Apache-2.0
// The alignment that a drive's [start] asks for, by kind, with its predicted accuracy.
// estimation.md
// 4. Shared by every mode that starts from the IMU.
#pragma once
#include "loxo/study/filter_start.hpp"

namespace loxo {

struct DriveAlignment {
  double t = 0;  // s: when it holds
  Rot<Geographic, Body> C_nb;
  Vec<Geographic> v;                         // m/s
  double level_std = 0, heading_random = 0;  // rad: what the biases do not explain
  bool from_gyros = false;       // heading and east gyro bias are correlated as [EST-14] says
  bool level_from_accel = true;  // level and accelerometer biases likewise
  // In motion the place is that of a fix on the way.
  bool has_place = false;
  Geodetic<double> place;
  double place_std = 0, velocity_std = 0;  // m, m/s
  StandingStart rest;
  double refine_until = kNone;  // s: a fine alignment goes on from t to here
  AlignmentReport report;
};

// At `place`, from t0 [s]. Throws Error(kWork) where the alignment cannot be had, with the reason
// and what would help; Error(kInput) for a kind that lacks what it needs.
DriveAlignment align_drive(const Drive& drive, const FilterOptions& options,
                           const NavigatorConfig& config, const DriveMeasurements& m,
                           const Geodetic<double>& place, double t0, Diagnostics& diagnostics);

// The fine stage: `start` (at a.t, with its whole covariance) is taken to a.refine_until by the
// filter.
void refine_start(const Drive& drive, const NavigatorConfig& config, DriveAlignment& a,
                  NavigatorStart& start);

}  // namespace loxo
