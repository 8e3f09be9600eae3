// SPDX-License-Identifier: Apache-2.0
// A recorded drive through the strapdown loop alone: no measurement but, where asked for, a height.
#pragma once
#include "loxo/ins/strapdown.hpp"
#include "loxo/study/filter_drive.hpp"

namespace loxo {

struct InertialOptions {
  bool auto_frame =
      true;  // geographic below 80 deg, transverse above, back at 78 deg (polar.md 3.4)
  FrameId frame = FrameId::kGeographic;
  double meridian = 0;  // rad: reference meridian of the transverse and grid frames
  // free: nothing holds it. fixed: the drive's heights and their rate taken as exact (without
  // [height], the start's height). ship: the start's height, no vertical velocity, whatever
  // [height] says. external: damped toward the drive's heights, as fast as their sigma deserves.
  // "": external where the drive has heights, else free.
  std::string vertical;
  double output_period = 0.1;  // s; 0: every step
  bool force = false;          // go on with a poor alignment
};

struct InertialResult {
  AlignmentReport alignment;
  VerticalMode vertical = VerticalMode::kFree;
  EcefState<double> end;
  double begin_t = 0, end_t = 0;  // s
  double height_tau = 0;          // s: of the loop toward an external height; 0: there is none
  long imu_samples = 0, rows = 0, gaps = 0, switches = 0;
  double longest_gap = 0;  // s
  // Position error [m] that the geographic frame's azimuth makes near a pole, as polar.md 3.4
  // estimates it.
  double singular_error = 0, singular_t = kNone;
  bool broken = false;  // the arithmetic left its domain at end_t: rows stop there
};

// What the drive must say about its start. Throws Error(kInput) naming what is needed.
void require_start(const Drive& drive);

// Throws Error(kInput) for missing or bad input, Error(kWork) where the alignment cannot be had.
// Rows stand at whole multiples of the output period, and at the last sample; the solution does not
// depend on the period.
InertialResult inertial_drive(const Drive& drive, const InertialOptions& options,
                              const RowSink& sink, Diagnostics& diagnostics);

}  // namespace loxo
