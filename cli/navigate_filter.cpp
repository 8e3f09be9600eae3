// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "cli/navigate.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/consistency.hpp"
#include "loxo/study/filter_drive.hpp"
#include "loxo/study/innovations_file.hpp"
#include "loxo/study/reckon_drive.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo::cli {
namespace {

const std::vector<std::string> kWitnesses = {
    "odometer", "nhc", "zupt", "zaru", "fixes", "benchmarks", "headings", "heights", "velocity"};

std::vector<std::string> split(const std::string& text, const std::string& option) {
  std::vector<std::string> out;
  std::size_t from = 0;
  while (from <= text.size() && !text.empty()) {
    const std::size_t to = std::min(text.find(',', from), text.size());
    const std::string word = text.substr(from, to - from);
    bool known = false;
    for (const auto& w : kWitnesses) known = known || w == word;
    if (!known)
      throw Error(ErrorKind::kUsage, "'" + word + "' is no witness" + suggestion(word, kWitnesses),
                  option);
    out.push_back(word);
    from = to + 1;
  }
  return out;
}

FilterOptions options_of(const NavigateOptions& o, const std::string& output) {
  FilterOptions f;
  f.smooth = o.mode == "smooth";
  const FrameOption frame = frame_option(o);
  f.auto_frame = frame.automatic;
  f.frame = frame.frame;
  const double meridian = option_quantity(o.meridian, Dimension::kAngle, "--meridian");
  if (!(std::fabs(meridian) <= 2 * kPi))
    throw Error(ErrorKind::kUsage, "expected an angle within a turn, found " + o.meridian,
                "--meridian");
  f.vertical = o.vertical;
  f.only = split(o.use, "--use");
  f.without = split(o.without, "--without");
  if (!o.fixes_until.empty())
    f.fixes_until = option_quantity(o.fixes_until, Dimension::kTime, "--fixes-until");
  if (!o.fix_every.empty())
    f.fix_every = option_quantity(o.fix_every, Dimension::kTime, "--fix-every");
  if (!o.fix_every.empty() && !(f.fix_every > 0))
    throw Error(ErrorKind::kUsage, "the time between two fixes must be positive", "--fix-every");
  if (o.no_fixes) f.fixes_until = -1e300;
  for (const std::string& text : o.outages) {
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos)
      throw Error(ErrorKind::kUsage, "expected START:LENGTH as 650s:340s, found '" + text + "'",
                  "--outage");
    const double begin = option_quantity(text.substr(0, colon), Dimension::kTime, "--outage");
    const double length = option_quantity(text.substr(colon + 1), Dimension::kTime, "--outage");
    if (!(length > 0))
      throw Error(ErrorKind::kUsage, "an outage lasts longer than 0 s", "--outage");
    f.outages.emplace_back(begin, length);
  }
  // The smoother's rows are the tape's epochs, at most 10 Hz.
  f.output_period = output_period(o, o.mode == "smooth" ? "" : output);
  f.force = o.force;
  if (!o.calibration.empty()) {
    const ReckonCalibration c = read_calibration(o.calibration);
    f.calibrated = true;
    f.k = c.k, f.k_std = c.k_std, f.eps = c.eps, f.eps_std = c.eps_std;
  }
  return f;
}

Json json_of(const FilterResult& r, const NavigateOptions& o, const Diagnostics& d) {
  Json j;
  j["command"] = "navigate";
  j["mode"] = o.mode;
  j["rows"] = r.rows;
  j["imu_samples"] = r.imu_samples;
  j["duration_s"] = r.duration;
  j["alignment"] = to_json(r.alignment);
  Json& c = j["constants"] = Json::object();
  for (const Estimated& e : r.constants) {
    c[e.name] = e.value;
    c[e.name + "_std"] = e.std;
  }
  Json& s = j["innovations"] = Json::object();
  for (const SensorReport& e : r.sensors) {
    // Of the mean of so many white innovations, 95 %.
    const Band band = chi_square_band(
        1, static_cast<double>(e.count.used + e.count.deweighted + e.count.rejected));
    s[e.name] = {{"used", e.count.used},
                 {"deweighted", e.count.deweighted},
                 {"rejected", e.count.rejected},
                 {"nis_mean", e.count.nis_mean()},
                 {"nis_low", band.low},
                 {"nis_high", band.high},
                 {"nis_above_95", e.count.above_95_share()},
                 {"lag_one", e.count.lag_one()}};
  }
  Json& n = j["innovation_history"] = Json::object();
  n["t_s"] = Json::array();
  for (const InnovationRow& e : r.innovations) n["t_s"].push_back(e.t);
  for (const SensorReport& e : r.sensors)
    for (std::size_t i = 0; i < static_cast<std::size_t>(Sensor::kCount); ++i) {
      if (e.name != sensor_name(static_cast<Sensor>(i))) continue;
      Json& values = n[e.name] = Json::array();
      for (const InnovationRow& row : r.innovations)
        values.push_back(row.nis[i] == row.nis[i] ? Json(row.nis[i]) : Json(nullptr));
    }
  Json& g = j["segments"] = Json::array();
  for (const SegmentRow& e : r.segments)
    g.push_back({{"begin_s", e.begin},
                 {"end_s", e.end},
                 {"trusted", e.trusted},
                 {"why", e.why},
                 {"fixes", e.fixes},
                 {"wheel_readings", e.wheel},
                 {"wheel_left_out", e.wheel_left_out},
                 {"radius_95_m", e.radius}});
  Json& h = j["history"] = Json::array();
  for (const ConstantsRow& e : r.history)
    h.push_back({{"t_s", e.t},
                 {"k", e.k},
                 {"k_std", e.k_std},
                 {"eps_deg", e.eps_h / deg},
                 {"eps_std_deg", e.eps_h_std / deg},
                 {"pitch_mounting_deg", e.eps_p / deg},
                 {"pitch_mounting_std_deg", e.eps_p_std / deg},
                 {"delay_s", e.tau},
                 {"delay_std_s", e.tau_std},
                 {"speed_offset_mps", e.offset},
                 {"speed_offset_std_mps", e.offset_std},
                 {"gyro_bias_up_deg_h", e.bg_up / deg_per_h},
                 {"gyro_bias_up_std_deg_h", e.bg_up_std / deg_per_h}});
  j["events"] = {{"gaps", r.events.gaps},
                 {"long_gaps", r.events.long_gaps},
                 {"standing_s", r.events.standing},
                 {"dead_encoder_s", r.events.dead_encoder},
                 {"slip", r.events.slip},
                 {"skid", r.events.skid},
                 {"wrong_stamps", r.events.wrong_stamps},
                 {"outlier_fixes", r.events.outlier_fixes}};
  j["settings"] = r.meta;
  j["diverged"] = r.diverged;
  j["diagnostics"] = to_json(d);
  return j;
}

}  // namespace

int navigate_filter(const Globals& globals, const NavigateOptions& options) {
  FilterOptions f = options_of(options, globals.output);
  const Drive drive = read_drive(options.drive, globals.sets);
  Diagnostics diagnostics = drive.diagnostics;
  std::unique_ptr<SolutionWriter> writer;
  if (!globals.output.empty()) {
    std::map<std::string, std::string> meta = solution_meta(options, drive);
    // Strapdown and covariance stand on ECEF axes; the frame is that of the rows.
    meta["mechanization"] = "ecef";
    meta["frame"] = options.frame;
    if (options.frame == "transverse" || options.frame == "auto")
      meta["meridian"] = options.meridian;
    writer = std::make_unique<SolutionWriter>(globals.output, meta, options.precision);
  }
  if (options.mode == "segmented" && !options.innovations.empty())
    throw Error(ErrorKind::kUsage, "innovations come from the modes filter and smooth",
                "--innovations");
  if (options.mode == "segmented") {
    const SegmentedResult r = telling(globals, diagnostics, [&] {
      return segmented_drive(
          drive, f,
          [&](const SolutionRow& row) {
            if (writer) writer->write(row);
          },
          diagnostics);
    });
    if (writer) writer->commit();
    print_diagnostics(globals, diagnostics);
    if (globals.json) {
      Json j;
      j["command"] = "navigate";
      j["mode"] = options.mode;
      j["rows"] = r.rows;
      j["k"] = r.k;
      j["k_std"] = r.last.k_std;
      j["eps_deg"] = r.eps / deg;
      j["eps_std_deg"] = r.last.mu_std / deg;
      j["joint_k"] = r.last.joint_k;
      j["joint_eps_deg"] = r.last.joint_mu / deg;
      j["switch_s"] = r.switch_t;
      j["forced"] = r.forced;
      Json& h = j["history"] = Json::array();
      for (const SegmentedEpoch& e : r.history)
        h.push_back({{"t_s", e.t},
                     {"phase", e.phase},
                     {"k", e.k},
                     {"eps_deg", e.mu / deg},
                     {"ins_weight", e.ins_weight},
                     {"joint_k", e.joint_k},
                     {"joint_eps_deg", e.joint_mu / deg}});
      j["diagnostics"] = to_json(diagnostics);
      print_json(j);
    } else {
      say(globals,
          fmt::format("segmented {}: {} rows; alignment {}, heading {:.2f} deg +- {:.2f} deg\n  "
                      "switch at t = {:.0f} s{}; k {:.5f} +- {:.2g}, eps {:.3f} deg +- {:.2g}\n"
                      "  joint filter beside it: k {:.5f}, eps {:.3f} deg; share of the INS at the "
                      "end {:.2f}\n",
                      drive.name, r.rows, r.alignment.method, r.alignment.heading / deg,
                      r.alignment.heading_std / deg, r.switch_t, r.forced ? " (forced)" : "", r.k,
                      r.last.k_std, r.eps / deg, r.last.mu_std / deg, r.last.joint_k,
                      r.last.joint_mu / deg, r.last.ins_weight));
    }
    return 0;
  }
  std::unique_ptr<InnovationWriter> innovations;
  if (!options.innovations.empty()) {
    if (options.innovations == globals.output)
      throw Error(ErrorKind::kUsage, "the solution and the innovations need a file each",
                  "--innovations");
    innovations = std::make_unique<InnovationWriter>(options.innovations);
    f.innovations = innovations.get();
  }
  const FilterResult r = telling(globals, diagnostics, [&] {
    return filter_drive(
        drive, f,
        [&](const SolutionRow& row) {
          if (writer) writer->write(row);
        },
        diagnostics);
  });
  if (innovations) {
    if (innovations->rows() > 0)
      innovations->commit();
    else
      diagnostics.warn("no_innovations", options.innovations,
                       "this drive's filter tells none (it has no inertial unit): no file written");
  }
  if (writer) writer->commit();  // a filter that diverged keeps what it had
  print_diagnostics(globals, diagnostics);
  if (globals.json) {
    print_json(json_of(r, options, diagnostics));
  } else {
    std::string text =
        fmt::format("{} {}: {} rows over {:.0f} s from {} IMU samples\n{}", options.mode,
                    drive.name, r.rows, r.duration, r.imu_samples, alignment_text(r.alignment));
    for (const Estimated& e : r.constants)
      text += fmt::format("  {:28} {:12.6g} +- {:.3g}\n", e.name, e.value, e.std);
    text += "  innovations                      used  weighted  rejected  mean NIS  above 95 %\n";
    for (const SensorReport& e : r.sensors)
      text += fmt::format("  {:28} {:8} {:9} {:9} {:9.2f} {:10.1f} %\n", e.name, e.count.used,
                          e.count.deweighted, e.count.rejected, e.count.nis_mean(),
                          100 * e.count.above_95_share());
    say(globals, text);
  }
  if (r.diverged)
    throw Error(ErrorKind::kWork,
                fmt::format("the filter diverged at t = {:.1f} s: its measurements contradict it; "
                            "the solution up to there is kept",
                            r.diverged_t));
  return 0;
}

}  // namespace loxo::cli
