// SPDX-License-Identifier: Apache-2.0
// A recorded drive by distance and heading alone (vehicle.md 1).
#pragma once
#include <functional>
#include <string>

#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/log/drive.hpp"

namespace loxo {

// k and eps of a certificate, taken out of every step: ds / k, heading - eps.
struct ReckonCalibration {
  double k = 1, eps = 0;                  // 1, rad
  double k_std = kNone, eps_std = kNone;  // kNone where the certificate does not say
  double drift = 0;                       // rad/s: heading - drift * t is what eps is taken out of
  double pitch = 0;                       // rad: pitch mounting, taken out of the slope
  std::string heading_model;              // "" where the certificate does not say
};
// A certificate as `loxo calibrate -o` writes it: k and eps_deg at the top, under "result", or
// under the recommended of its "methods". Throws Error(kInput) naming file and key.
ReckonCalibration read_calibration(const std::string& path);

struct ReckonOptions {
  Integrator integrator = Integrator::kExact;
  ReckonCalibration calibration;
  double output_rate = 10;  // Hz, rows on whole multiples of its period; 0: one row per step
};

struct ReckonResult {
  long rows = 0, steps = 0;
  double distance = 0;        // m, travelled, both directions counted
  double begin = 0, end = 0;  // s
  SolutionRow last;
};

// Rows carry the attitude of the body where a sensor tells it ([attitude], [heading]): it stands
// off the course by eps. Of a bare track the heading is the course. Every row of the solution, the
// first and the last step's end among them, to `sink`. Throws Error(kInput): nothing to reckon
// from, no start position, a log of less than two rows, a true-heading log that crosses a pole;
// Error(kUsage) for an integrator that a mechanised log has not.
ReckonResult reckon_drive(const Drive& drive, const ReckonOptions& options,
                          const std::function<void(const SolutionRow&)>& sink,
                          Diagnostics& diagnostics);

}  // namespace loxo
