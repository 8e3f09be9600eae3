// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/drive_modes.hpp"

#include <algorithm>
#include <cstdio>

#include "loxo/earth/gravity.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/scenario_keys.hpp"

namespace loxo {

using namespace scenario_keys;

std::string DriveModes::text() const {
  std::string s;
  for (const auto& [on, name] : {std::pair{inertial, "inertial"}, std::pair{reckon, "reckon"},
                                 std::pair{calibrate, "calibrate"}, std::pair{filter, "filter"},
                                 std::pair{segmented, "segmented"}})
    if (on) s += (s.empty() ? "" : ",") + std::string(name);
  return s;
}

DriveSetup drive_setup(const TomlTable& t, const Scenario& s) {
  DriveSetup set;
  set.ellipsoid = s.trajectory.ellipsoid;
  const std::vector<std::string> names{"inertial", "reckon", "calibrate", "filter", "segmented"};
  if (const auto modes = t.get_strings("mode")) {
    bool* flags[] = {&set.modes.inertial, &set.modes.reckon, &set.modes.calibrate,
                     &set.modes.filter, &set.modes.segmented};
    for (bool* f : flags) *f = false;
    for (const auto& m : *modes) {
      const auto at = std::find(names.begin(), names.end(), m);
      if (at == names.end())
        refuse("unknown mode '" + m + "'" + suggestion(m, names), t.where("mode"));
      *flags[at - names.begin()] = true;
    }
    if (modes->empty()) refuse("expected one mode or more", t.where("mode"));
  }
  set.static_alignment = one_of(t, "alignment", {"given", "static"}) == "static";
  set.truth = drive_truth(s, t.where(t.has("scenario") ? "scenario" : "duration"));
  set.around = s.imu.around;
  const auto& start = set.truth.epochs.front();
  const Vec<Ecef> up = cross(start.east, start.north);
  set.gravity = normal_gravity(set.ellipsoid, up.z, start.h);
  if (set.static_alignment && !(start.north.z > 0.02))
    refuse("no gyro finds north within a degree of a pole; expected alignment = \"given\"",
           t.where("alignment"));
  const bool driven = !set.truth.ticks.empty();
  if (!driven) refuse("expected an odometer interval or more", t.where("odometer_rate"));
  const double distance = fabs(set.truth.epochs.back().distance);
  set.percent = distance > 1.0 ? 100.0 / distance : 0.0;
  set.mounting_heading = s.trajectory.mounting_heading;
  set.mounting_pitch = s.trajectory.mounting_pitch;
  const auto put = [&](double x) {
    char text[40];
    std::snprintf(text, sizeof text, "%a ", x);
    set.around_text += text;
  };
  const auto& a = set.around;
  for (const double x :
       {a.gyro_markov_time, a.accel_markov_time, a.temperature_from, a.temperature_to, a.ramp_begin,
        a.ramp_end, set.mounting_heading, set.mounting_pitch, set.static_alignment ? 1.0 : 0.0})
    put(x);
  for (int k = 0; k < 3; ++k) put(a.gyro_offset[k]), put(a.accel_offset[k]);
  for (const auto& l : a.vibration) {
    put(l.frequency);
    for (int k = 0; k < 3; ++k) put(l.accel[k]), put(l.gyro[k]);
  }
  return set;
}

std::vector<MetricInfo> calibration_metrics() {
  return {{"replay_ln_k_error", "replay: ln(estimated / true scale)"},
          {"replay_eps_error_rad", "replay: estimated - true mounting angle"},
          {"replay_ln_k_std", "its stated sigma"},
          {"replay_eps_std_rad", "its stated sigma"},
          {"replay_nees", "replay: both errors squared over their covariance; mean 2"},
          {"rhumb_ln_k_error", "rhumb chord: ln(estimated / true scale)"},
          {"rhumb_eps_error_rad", "rhumb chord: estimated - true mounting angle"},
          {"chord_m", "between the surveyed ends"},
          {"replay_closure_m", "replay: what is left at the end"}};
}
std::vector<MetricInfo> filter_metrics() {
  return {{"filter_end_m", "joint filter: horizontal error at the end"},
          {"filter_max_m", "joint filter: largest horizontal error"},
          {"filter_rms_m", "joint filter: root mean square over the drive"},
          {"filter_end_pct", "joint filter: error at the end in percent of the distance"},
          {"filter_heading_end_rad", "joint filter: heading error at the end, clockwise"},
          {"filter_nees", "joint filter: horizontal, mean over the drive; expected 2"},
          {"filter_scale_error", "joint filter: estimated - true scale at the end"},
          {"filter_mounting_error_rad", "joint filter: estimated - true mounting at the end"}};
}
std::vector<MetricInfo> segmented_metrics() {
  return {{"segmented_end_m", "segmented: weighted error at the end"},
          {"segmented_max_pct", "segmented: largest weighted error in percent, from 120 s on"},
          {"segmented_end_pct", "segmented: weighted error at the end in percent"},
          {"segmented_joint_end_m", "its joint filter of 16 states: error at the end"},
          {"segmented_joint_end_pct", "its joint filter, in percent of the distance"},
          {"segmented_reckoned_end_m", "its calibrated dead reckoning: error at the end"},
          {"segmented_switch_s", "when it switched"},
          {"segmented_scale_error", "phase 1: estimated - true scale"},
          {"segmented_mounting_error_rad", "phase 1: estimated - true mounting"}};
}

EpochFilterConfig epoch_filter_config(const DriveSetup& set, const DeclaredErrors<double>& d) {
  EpochFilterConfig c;
  c.ellipsoid = set.ellipsoid;
  c.gyro_noise = d.gyro_noise, c.accel_noise = d.accel_noise;
  c.gyro_walk = d.gyro_walk, c.accel_walk = d.accel_walk;
  c.gyro_bias = d.gyro_bias, c.accel_bias = d.accel_bias;
  c.gyro_scale = d.gyro_scale, c.accel_scale = d.accel_scale;
  c.level_std = max(d.level, 1.0 * arcsec);
  c.heading_std = max(d.heading, 1.0 * arcsec);
  c.static_alignment = set.static_alignment;
  c.scale_std = d.scale, c.mounting_std = d.mounting, c.pitch_std = d.mounting_pitch;
  // A Markov scale as a walk with its time: its variance turns over once in that time.
  const double turnover = d.scale_markov * sqrt(2.0 / set.scale_markov_time);
  c.scale_walk = sqrt(d.scale_walk * d.scale_walk + turnover * turnover);
  const auto& t = set.truth;
  const double ticks = max(1.0, static_cast<double>(t.epoch_every) / t.odometer_every);
  const double epochs = static_cast<double>(t.epochs.size() - 1),
               way = fabs(t.epochs.back().distance) / epochs;
  c.way_noise = sqrt(ticks * d.noise * d.noise + way * d.distance_noise * d.distance_noise +
                     d.quantisation * d.quantisation / 6 + 1e-3 * 1e-3);
  c.scale_noise = d.scale_noise / sqrt(ticks);
  c.side_slip = d.side_slip;
  c.height_std = max(d.height, 0.01);
  c.fix_std = d.fix;
  return c;
}

SegmentedConfig segmented_config(const DriveSetup& set, const DeclaredErrors<double>& d) {
  SegmentedConfig c;
  c.ellipsoid = set.ellipsoid;
  c.gyro_bias = d.gyro_bias, c.gyro_noise = d.gyro_noise;
  c.accel_bias = d.accel_bias, c.accel_noise = d.accel_noise;
  c.level_std = d.level, c.heading_std = d.heading;
  c.static_heading = set.static_alignment;
  if (d.scale > 0) c.scale_std = d.scale;
  if (d.mounting > 0) c.mounting_std = d.mounting;
  const double ticks =
      max(1.0, static_cast<double>(set.truth.epoch_every) / set.truth.odometer_every);
  c.scale_noise = d.scale_noise / sqrt(ticks);
  c.slip_noise = d.side_slip;
  c.quantisation = d.quantisation;
  c.scale_walk = max(d.scale_walk, d.scale_markov * sqrt(2.0 / set.scale_markov_time));
  return c;
}

}  // namespace loxo
