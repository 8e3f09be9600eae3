// SPDX-License-Identifier: Apache-2.0
// A recorded drive through the joint filter and the smoother. Settings follow by rule from what the
// drive declares of its own sensors; nothing is searched, the reference is never read.
#pragma once
#include <array>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "loxo/estimate/navigator.hpp"
#include "loxo/estimate/segmented.hpp"
#include "loxo/log/drive.hpp"

namespace loxo {

struct FilterOptions {
  bool smooth = false;
  bool auto_frame = true;  // geographic below 80 deg, transverse above (back at 78 deg)
  FrameId frame = FrameId::kGeographic;
  std::string vertical;  // "", free, fixed, ship, external
  // Witnesses by name: odometer, nhc, zupt, zaru, fixes, benchmarks, headings, heights, velocity.
  std::vector<std::string> without, only;
  double fixes_until = std::numeric_limits<double>::infinity();  // s: fixes after it are not used
  double fix_every =
      0;  // s: after fixes_until (or always) at most one fix per this time, position only
  std::vector<std::pair<double, double>>
      outages;                 // start, length, s: no fix, height or heading inside
  double output_period = 0.1;  // s; 0: every sample
  double until = std::numeric_limits<double>::infinity();  // s: stop there
  bool force = false;
  // From a certificate: k, eps and their sigmas (kNone: not stated, those of a drive that says
  // nothing).
  bool calibrated = false;
  double k = 1, k_std = kNone, eps = 0, eps_std = kNone;
  InnovationSink* innovations = nullptr;  // told every innovation
  // Start states that a caller has prepared (sweeps): heading error put on top, rad.
  double progress_every = 0;
  std::function<void(double)> progress;
};

// A constant with its band.
struct Estimated {
  std::string name;  // snake_case with the unit as suffix
  double value = 0, std = 0;
};
struct SensorReport {
  std::string name;
  InnovationCount count;
};
struct AlignmentReport {
  // static, inertial_frame, gyrocompass, fine, attitude, state, stored, two_step, in_motion
  std::string method;
  double heading = 0, heading_std = 0;               // rad
  double position_std = 0;                           // m, of the start, each axis
  double std_gyro = 0, std_noise = 0, std_sway = 0;  // what the sigma is made of, rad
  double duration = 0;                               // s used
  // What the prediction rests on: east gyro bias [rad/s], latitude of the place, and the latitude
  // up to which this bias leaves 5 deg of heading (0: nowhere) [rad].
  double gyro_bias = kNone, place_lat = kNone, latitude_limit = kNone;
  // The latitude that gravity and the Earth's turn show at rest [rad]; kNone where not observed.
  double latitude = kNone, latitude_std = kNone;
  std::string note;
};
// A row of the constants over time (one per 10 s), for the report.
struct ConstantsRow {
  double t = 0, k = 0, k_std = 0, eps_h = 0, eps_h_std = 0, eps_p = 0, eps_p_std = 0, tau = 0,
         tau_std = 0, offset = 0, offset_std = 0, bg_up = 0, bg_up_std = 0;
};
// Mean of y^2/S of each sensor over the stretch that ends at t; kNone where it said nothing.
struct InnovationRow {
  double t = 0;
  std::array<double, static_cast<std::size_t>(Sensor::kCount)> nis{};
};
// Which source held the solution over a stretch, and why; what was used of fixes and wheel in it,
// and the horizontal 95 % radius that the filter had at its end.
struct SegmentRow {
  double begin = 0, end = 0;
  std::string trusted, why;
  long fixes = 0, wheel = 0, wheel_left_out = 0;
  double radius = 0;  // m
};

struct FilterResult {
  std::map<std::string, std::string> meta;
  AlignmentReport alignment;
  std::vector<Estimated> constants;
  std::vector<SensorReport> sensors;
  std::vector<ConstantsRow> history;
  std::vector<InnovationRow> innovations;  // every 10 s
  std::vector<SegmentRow> segments;
  Navigator::Events events;
  long imu_samples = 0, rows = 0;
  double duration = 0;
  bool diverged = false;
  double diverged_t = kNone;
  // Covariance of (k, eps_h) at the end, for calibrate's method `online`.
  double k = 1, k_std = 0, eps_h = 0, eps_h_std = 0, k_eps_correlation = 0;
  bool has_odometer = false;
};

// Throws Error(kInput) where the first rows contradict the declared unit, or the axes while no
// attitude is given that could explain them; not with `force`.
void refuse_unsound(const ImuReader& reader, const Drive& drive, bool force);

using RowSink = std::function<void(const SolutionRow&)>;
// Throws Error(kInput) for bad measurements, Error(kWork) where no start is possible. A filter that
// diverges is told in the result, its rows up to there are given out.
FilterResult filter_drive(const Drive& drive, const FilterOptions& options, const RowSink& sink,
                          Diagnostics& diagnostics);

// The segmented method (vehicle.md 6-7): the weighted solution (its epochs a second apart, the INS
// between them), its phases and the joint filter beside it.
struct SegmentedResult {
  std::map<std::string, std::string> meta;
  AlignmentReport alignment;
  std::vector<SegmentedEpoch> history;  // every 10 s, and the switch
  SegmentedEpoch last;
  double k = 1, eps = 0, switch_t = kNone;
  bool forced = false;
  long rows = 0;
};
SegmentedResult segmented_drive(const Drive& drive, const FilterOptions& options,
                                const RowSink& sink, Diagnostics& diagnostics);

}  // namespace loxo
