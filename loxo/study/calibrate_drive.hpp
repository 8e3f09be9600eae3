// SPDX-License-Identifier: Apache-2.0
// A recorded drive calibrated by every method that applies, side by side. vehicle.md sections 2 to
// 5 and 8.
#pragma once
#include <string>
#include <vector>

#include "loxo/calibrate/least_squares.hpp"
#include "loxo/calibrate/replay.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/text/json.hpp"

namespace loxo {

struct CalibrateOptions {
  std::vector<State> estimate;  // states of least squares beside scale and angle
  std::string only;             // one method's name; empty: all
  bool online = false;          // also by the joint filter, where the drive has an IMU
};

struct DriveCalibration {
  std::vector<Calibration> methods;  // named as in interface.md
  std::string recommended, why;      // empty: none valid
  double chord = 0, route = 0,
         signed_area = 0;           // m, m, m^2 (vehicle.md 2.4), of the calibrated track
  double metres_per_pulse = kNone;  // calibrated; kNone where the odometer does not count

  const Calibration* find(const std::string& name) const;
};
// Throws Error(kInput): no track, fewer than two benchmarks, a benchmark outside the log, a log of
// one row.
DriveCalibration calibrate_drive(const Drive& drive, const CalibrateOptions& options,
                                 Diagnostics& diagnostics);

// The sensor errors that a drive declares for its track; 0 where it declares none.
TrackErrorModel track_error_model(const Drive& drive);

Json to_json(const Drive& drive, const DriveCalibration& result);
// The certificate: vehicle, input hash, method, heading model, result, covariance, validity,
// program version.
Json certificate(const Drive& drive, const DriveCalibration& result, const std::string& version);

// Drifted or not: the difference to an older certificate against both covariances.
struct Drift {
  double chi2 = 0, probability = 1;  // of a chi2 this large by chance, 2 degrees of freedom
  double dk = 0, deps = 0;           // now - then
  bool drifted = false;              // probability < 1 %
};
Drift drift_against(const Calibration& now, const Json& certificate, const std::string& path);

}  // namespace loxo
