// SPDX-License-Identifier: Apache-2.0
// How wrong a Solution is. Errors are differences in ECEF, resolved afterwards in the level axes of
// the true position: nothing goes through longitude or heading, so that the pole costs nothing.
// estimation.md section 7.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/ins/solution.hpp"
#include "loxo/text/diagnostics.hpp"

namespace loxo {

struct EvaluateConfig {
  double min_pct_distance =
      1000;  // m: error/distance is formed beyond it (or beyond half of a shorter way)
  double max_gap = kNone;  // s: truth epochs inside a longer gap of the solution are left out;
                           // kNone: 3 median intervals
  double from = kNone, to = kNone;  // s: only epochs in [from, to]
  std::vector<double> lengths = {100,  200,  500,  1000,
                                 2000, 5000, 10000};  // m, the fixed-length table
};

// One epoch of the truth. SI and radians; kNone where not known.
struct EvaluationEpoch {
  double t = 0, s = 0;  // s: distance driven by the truth since the first epoch
  double east = 0, north = 0,
         up = 0;  // computed - true, level axes of the true position (up kNone: no heights)
  double along = kNone, across = kNone;  // by the true course, right +; only above 1 m/s
  double horizontal = 0;
  double ve = kNone, vn = kNone, vu = kNone;  // velocity error, the same axes
  double heading = kNone, pitch = kNone,
         roll = kNone;  // attitude error: minus the psi-angle [EST-1], heading too large +
  double nees = kNone;  // of the position, from the stated std
};

// Relative error over pieces of one length, in % of the piece.
struct LengthRow {
  double length = 0;  // m
  double pct_50 = kNone, pct_95 = kNone, pct_max = kNone;
  std::size_t pieces = 0;  // overlapping
  double independent = 0;  // way / length
};

struct Evaluation {
  double horizontal_rms_m = kNone, horizontal_max_m = kNone, horizontal_end_m = kNone;
  double distance_m = 0;
  double horizontal_pct_50 = kNone, horizontal_pct_95 = kNone, horizontal_pct_max = kNone,
         horizontal_pct_end = kNone;
  double cep50_m = kNone, cep95_m = kNone;
  double along_rms_m = kNone, across_rms_m = kNone, up_rms_m = kNone, up_max_m = kNone,
         position_3d_max_m = kNone;
  double heading_rms_deg = kNone, heading_max_deg = kNone, heading_rms_mil = kNone,
         pitch_rms_deg = kNone, roll_rms_deg = kNone;
  double velocity_rms_mps = kNone, velocity_max_mps = kNone;
  double nees_mean = kNone, nees_95_inside = kNone, nees_dof = kNone, nees_low = kNone,
         nees_high = kNone;
  // Of all innovations that a filter has told (study/innovations_file.hpp); not from the solution.
  double nis_mean = kNone, nis_above_95 = kNone, nis_low = kNone, nis_high = kNone;
  double kitti_translation_pct = kNone, kitti_rotation_deg_per_m = kNone;
  std::size_t epochs = 0;
  double t_begin = 0, t_end = 0;
  bool local =
      false;  // the truth is in local metres: the solution's track is laid on its first point
  std::vector<LengthRow> by_length;
  std::vector<EvaluationEpoch> series;
};

// On the truth's own epochs; the solution is interpolated between its rows (position by cubic
// Hermite with its velocities, attitude on the sphere of quaternions). Throws Error(kInput) when
// the two have no epoch in common, with both spans.
Evaluation evaluate(const Solution& solution, const Solution& truth, const Ellipsoid& ellipsoid,
                    const EvaluateConfig& config, Diagnostics& diagnostics);

// The numbers by the names of interface.md: for --json, --require, campaigns. Same order
// everywhere.
struct NamedValue {
  std::string name;
  double value = kNone;
};
std::vector<NamedValue> evaluation_values(const Evaluation& evaluation);

// A requirement "key<number" (also <=, >, >=). Throws Error(kUsage) for other text or an unknown
// key (nearest named).
struct Requirement {
  std::string text, key, op;
  double limit = 0;
};
Requirement parse_requirement(const std::string& text);
// NaN meets nothing.
bool meets(const Requirement& requirement, const Evaluation& evaluation);

// t_s,distance_m,… one row an epoch; appears whole or not at all.
void write_evaluation_series(const std::string& path, const Evaluation& evaluation);

}  // namespace loxo
