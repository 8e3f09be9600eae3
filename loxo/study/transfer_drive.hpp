// SPDX-License-Identifier: Apache-2.0
// A recorded drive moved to the pole with its own sensor errors: every section of it (polar.md 7).
#pragma once
#include <functional>
#include <string>

#include "loxo/log/drive.hpp"
#include "loxo/sim/polar_mover.hpp"
#include "loxo/sim/transfer_error.hpp"

namespace loxo {

struct TransferSettings {
  PolarMove move;
  bool binary = false;     // imu.h5 and reference.h5 instead of .csv
  bool trim = false;       // leave out what the reference does not cover
  std::string angle_text;  // as the user wrote them, for the name of the moved drive
  std::string meridian_text;
};

struct TransferResult {
  std::size_t samples = 0, left_out = 0, reference_epochs = 0;
  double largest_df = 0, largest_dw = 0;  // m/s^2, rad/s
  ClosureStatistics closure;              // of the reference on the IMU
  double begin_t = 0, end_t = 0;
};

// Writes the moved drive into `folder` (which exists and is empty). [imu], [reference], [odometer],
// [fix] with velocities and std, [attitude], [track], [velocity], [heading], [height], benchmarks
// by time or row, and the start go along; what cannot be moved is told to the diagnostics with the
// reason. A drive without [imu] is moved as well. Throws Error(kInput): no reference, one without
// attitude, with gaps or that does not cover the log, a track within 10 deg of a transverse pole.
TransferResult transfer_drive(const Drive& drive, const TransferSettings& settings,
                              const std::string& folder, Diagnostics& diagnostics,
                              const std::function<void(double t)>& progress = {});

// The epochs of [reference], streamed to a PolarMover, and the longest gap it may have: 3.5 median
// steps, at least 1 s.
struct ReferenceEpochs {
  std::vector<ReferenceEpoch> epochs;
  double longest_gap = 1.0;
};
ReferenceEpochs reference_epochs(const Drive& drive, Diagnostics& diagnostics);

// The voyage as the theory of the conversion error wants it, in equal steps [s] and at most about
// `most` points.
struct TransferPoints {
  std::vector<TransferPoint> points;
  double step = 1;
};
TransferPoints transfer_points(const Drive& drive, const PolarMove& move, Diagnostics& diagnostics,
                               std::size_t most = 6000);

}  // namespace loxo
