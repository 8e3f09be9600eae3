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
  for (const auto& [on, name] :
       {std::pair{inertial, "inertial"}, std::pair{reckon, "reckon"},
        std::pair{calibrate, "calibrate"}, std::pair{filter, "filter"},
        std::pair{segmented, "segmented"}, std::pair{navigator, "navigator"}})
    if (on) s += (s.empty() ? "" : ",") + std::string(name);
  return s;
}

namespace {

// Where errors are told over the drive: every tenth of it, or as `every` says.
void lay_fans(const TomlTable& t, DriveSetup& set) {
  const double epoch = set.truth.dt * set.truth.epoch_every;
  const double last = static_cast<double>(set.truth.epochs.size() - 1);
  const double asked = t.get_quantity("every", Dimension::kTime).value_or(0.0);
  if (t.has("every") && !(asked >= epoch))
    refuse("expected a second or more between the errors that are told", t.where("every"));
  const double step = asked > 0 ? asked / epoch : max(1.0, last / 10);
  if (last / step > 200)
    refuse("expected at most 200 times at which errors are told", t.where("every"));
  for (double at = step; at < last + 0.5; at += step)
    set.fan.push_back(static_cast<std::size_t>(at + 0.5));
  for (double at = 10 / epoch; at <= min(last, 180 / epoch) + 0.5; at += 10 / epoch)
    set.early_fan.push_back(static_cast<std::size_t>(at + 0.5));
}
std::string time_of(const DriveSetup& set, std::size_t epoch) {
  char text[20];
  std::snprintf(text, sizeof text, "%04.0fs",
                set.truth.dt * set.truth.epoch_every * static_cast<double>(epoch));
  return text;
}
void add_times(std::vector<MetricInfo>& m, const DriveSetup& set,
               const std::vector<std::size_t>& epochs, const std::string& name,
               const std::string& unit, const std::string& meaning) {
  for (const std::size_t e : epochs)
    m.push_back({name + "_at_" + time_of(set, e) + unit, meaning + " after " + time_of(set, e)});
}

}  // namespace

DriveSetup drive_setup(const TomlTable& t, const Scenario& s) {
  DriveSetup set;
  set.ellipsoid = s.trajectory.ellipsoid;
  const std::vector<std::string> names{"inertial", "reckon",    "calibrate",
                                       "filter",   "segmented", "navigator"};
  if (const auto modes = t.get_strings("mode")) {
    bool* flags[] = {&set.modes.inertial, &set.modes.reckon,    &set.modes.calibrate,
                     &set.modes.filter,   &set.modes.segmented, &set.modes.navigator};
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
  lay_fans(t, set);
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
std::vector<MetricInfo> segmented_metrics(const DriveSetup& set) {
  std::vector<MetricInfo> m{
      {"segmented_end_m", "segmented: weighted error at the end"},
      {"segmented_max_pct", "segmented: largest weighted error in percent, from 120 s on"},
      {"segmented_end_pct", "segmented: weighted error at the end in percent"},
      {"segmented_joint_end_m", "its joint filter of 16 states: error at the end"},
      {"segmented_joint_end_pct", "its joint filter, in percent of the distance"},
      {"segmented_reckoned_end_m", "its calibrated dead reckoning: error at the end"},
      {"segmented_switch_s", "when it switched"},
      {"segmented_forced", "1: the switch rule was not met"},
      {"segmented_scale_error", "phase 1: estimated - true scale"},
      {"segmented_mounting_error_rad", "phase 1: estimated - true mounting"},
      {"segmented_scale_found_60_pct", "share of the odometer's scale error found after 60 s"},
      {"segmented_scale_found_pct", "the same after 120 s"},
      {"segmented_mounting_found_pct", "share of the mounting error found after 120 s"},
      {"segmented_mounting_120_rad", "estimated - true mounting after 120 s"},
      {"start_azimuth_rad", "phi_U of the alignment (counterclockwise heading error)"},
      {"start_azimuth_pct", "its size, in percent of any distance"}};
  add_times(m, set, set.early_fan, "segmented_scale", "", "phase 1: scale - 1");
  const char* const series[kSegmentedSeries][2] = {
      {"ins", "INS alone"},
      {"reckoned", "calibrated dead reckoning"},
      {"weighted", "weighted by minimum variance (V-57)"},
      {"naive", "weighted naively (V-58)"},
      {"intersection", "weighted by covariance intersection (V-59)"},
      {"joint", "joint filter of 16 states"}};
  for (const auto& s : series)
    add_times(m, set, set.fan, std::string("segmented_") + s[0], "_pct",
              std::string(s[1]) + ", percent of the distance");
  return m;
}
std::vector<MetricInfo> navigator_metrics(const DriveSetup& set) {
  std::vector<MetricInfo> m{
      {"navigator_end_m", "joint filter at every sample: horizontal error at the end"},
      {"navigator_max_pct", "its largest, in percent of the distance, from 120 s on"},
      {"navigator_end_pct", "its error at the end in percent of the distance"},
      {"navigator_nees", "its horizontal NEES, mean over the drive; expected 2"},
      {"navigator_nees_end", "its horizontal NEES at the end; expected 2"},
      {"navigator_scale_error", "its estimated - true scale at the end"},
      {"navigator_mounting_error_rad", "its estimated - true mounting at the end"},
      {"navigator_diverged", "1: it says that it contradicts itself"}};
  add_times(m, set, set.fan, "navigator", "_pct", "joint filter, percent of the distance");
  return m;
}

HorizontalMiss horizontal_miss(const NominalState& s, const Covariance<kStates>& P,
                               const DriveTruth::Epoch& at) {
  const Vec<Ecef> dr = s.r - at.state.r;
  const double e = dot(dr, at.east), n = dot(dr, at.north);
  const auto cov = [&](const Vec<Ecef>& a, const Vec<Ecef>& b) {
    const double u[3] = {a.x, a.y, a.z}, v[3] = {b.x, b.y, b.z};
    double sum = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) sum += u[i] * P.p[kDr + i][kDr + j] * v[j];
    return sum;
  };
  const double ee = cov(at.east, at.east), en = cov(at.east, at.north),
               nn = cov(at.north, at.north);
  const double squared = e * e + n * n;
  return {squared, sqrt(squared), (nn * e * e - 2 * en * e * n + ee * n * n) / (ee * nn - en * en)};
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
  // A start from rest: what a second of the accelerometers' biases leaves.
  if (set.static_alignment) c.velocity_std = max(d.accel_bias, 1e-4);
  if (d.scale > 0) c.scale_std = d.scale;
  if (d.mounting > 0) c.mounting_std = d.mounting;
  const double ticks =
      max(1.0, static_cast<double>(set.truth.epoch_every) / set.truth.odometer_every);
  c.scale_noise = d.scale_noise / sqrt(ticks);
  c.slip_noise = d.side_slip;
  const auto& t = set.truth;
  const double epoch = t.epoch_every * t.dt,
               way = fabs(t.epochs.back().distance) / static_cast<double>(t.epochs.size() - 1);
  c.way_noise =
      sqrt((ticks * d.noise * d.noise + way * d.distance_noise * d.distance_noise) / epoch);
  c.quantisation = d.quantisation;
  c.scale_walk = max(d.scale_walk, d.scale_markov * sqrt(2.0 / set.scale_markov_time));
  return c;
}

NavigatorConfig navigator_config(const DriveSetup& set, const DeclaredErrors<double>& d,
                                 NavigatorStart& start) {
  NavigatorConfig c;
  c.ellipsoid = set.ellipsoid;
  c.imu_interval = set.truth.dt;
  c.gyro_noise = d.gyro_noise, c.accel_noise = d.accel_noise;
  c.gyro_bias = d.gyro_bias, c.accel_bias = d.accel_bias;
  // The part of the biases that moves, from their walks; what is constant is declared so.
  const auto part = [](double walk, double tau, double bias) {
    return bias > 0 ? walk * sqrt(0.5 * tau) / bias : 0.0;
  };
  c.bias_moving = min(1.0, max(part(d.gyro_walk, c.gyro_bias_tau, d.gyro_bias),
                               part(d.accel_walk, c.accel_bias_tau, d.accel_bias)));
  c.gyro_scale = d.gyro_scale, c.accel_scale = d.accel_scale;
  const EpochFilterConfig e = epoch_filter_config(set, d);
  c.scale_std = e.scale_std, c.scale_walk = e.scale_walk;
  c.eps_h = start.state.eps_h, c.eps_p = start.state.eps_p;
  c.eps_std = max(1e-5, sqrt(d.mounting * d.mounting + d.mounting_pitch * d.mounting_pitch));
  c.lever_std = 0.02;
  c.quantisation = d.quantisation;
  c.scale_noise = d.scale_noise, c.slip_noise = d.side_slip;
  c.reading_noise = d.noise, c.way_noise = d.distance_noise;
  c.distance_std = 1e-3;
  c.height_std = e.height_std;
  c.fix_std_min = 1e-3;
  // As the filter at epochs starts, with what this one seeks beside.
  StartSigmas sigmas = start_sigmas(e);
  sigmas.eps_h = sigmas.eps_p = c.eps_std;
  sigmas.lever = c.lever_std;
  start.P = start_covariance(c.ellipsoid, start.state, sigmas);
  return c;
}

}  // namespace loxo
