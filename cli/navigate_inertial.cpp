// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "cli/navigate.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/navigate_drive.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::cli {
namespace {

const char* vertical_name(VerticalMode v) {
  switch (v) {
    case VerticalMode::kFixed:
      return "fixed";
    case VerticalMode::kShip:
      return "ship";
    case VerticalMode::kExternal:
      return "external";
    case VerticalMode::kFree:
      break;
  }
  return "free";
}

InertialOptions options_of(const NavigateOptions& o, const std::string& output) {
  InertialOptions f;
  const FrameOption frame = frame_option(o);
  f.auto_frame = frame.automatic;
  f.frame = frame.frame;
  f.meridian = option_quantity(o.meridian, Dimension::kAngle, "--meridian");
  f.vertical = o.vertical;
  f.output_period = output_period(o, output);
  f.force = o.force;
  return f;
}

}  // namespace

int navigate_inertial(const Globals& globals, const NavigateOptions& options) {
  const std::string& path = globals.output;
  const InertialOptions o = options_of(options, path);
  const Drive drive = read_drive(options.drive, globals.sets);
  Diagnostics diagnostics = drive.diagnostics;
  std::unique_ptr<SolutionWriter> writer;
  if (!path.empty()) {
    std::map<std::string, std::string> meta = solution_meta(options, drive);
    meta["frame"] = options.frame;
    writer = std::make_unique<SolutionWriter>(path, meta, options.precision);
  }
  const InertialResult r = telling(globals, diagnostics, [&] {
    return inertial_drive(
        drive, o,
        [&](const SolutionRow& row) {
          if (writer) writer->write(row);
        },
        diagnostics);
  });
  if (writer) writer->commit();  // one that broke keeps what it had
  print_diagnostics(globals, diagnostics);
  const Geodetic<double> g = to_geodetic(drive.ellipsoid, r.end.r);
  if (globals.json) {
    Json j;
    j["command"] = "navigate";
    j["mode"] = "inertial";
    j["frame"] = options.frame;
    j["vertical"] = vertical_name(r.vertical);
    if (r.height_tau > 0) j["height_tau_s"] = r.height_tau;
    j["rows"] = r.rows;
    j["imu_samples"] = r.imu_samples;
    j["begin_s"] = r.begin_t;
    j["end_s"] = r.end_t;
    j["duration_s"] = r.end_t - r.begin_t;
    j["frame_switches"] = r.switches;
    j["gaps"] = r.gaps;
    j["longest_gap_s"] = r.longest_gap;
    if (given(r.singular_t)) {
      j["singular_t_s"] = r.singular_t;
      j["singular_error_m"] = r.singular_error;
    }
    j["broken"] = r.broken;
    j["alignment"] = to_json(r.alignment);
    if (!r.broken)
      j["end"] = {{"lat_deg", g.lat / deg}, {"lon_deg", g.lon / deg}, {"h_m", g.h},
                  {"x_m", r.end.r.x},       {"y_m", r.end.r.y},       {"z_m", r.end.r.z}};
    j["diagnostics"] = to_json(diagnostics);
    print_json(j);
  } else {
    std::string text = fmt::format(
        "inertial {}: {} rows over {:.1f} s from {} IMU samples, frame {}, vertical {}\n",
        drive.name, r.rows, r.end_t - r.begin_t, r.imu_samples, options.frame,
        vertical_name(r.vertical));
    text += alignment_text(r.alignment);
    if (r.switches > 0) text += fmt::format("frame changed {} times\n", r.switches);
    if (!r.broken)
      text += fmt::format("end: {:.7f} deg, {:.7f} deg, {:.2f} m\n", g.lat / deg, g.lon / deg, g.h);
    say(globals, text);
  }
  if (r.broken)
    throw Error(
        ErrorKind::kWork,
        fmt::format("the arithmetic left its domain at t = {:.2f} s; the solution up to there "
                    "is kept",
                    r.end_t));
  return 0;
}

}  // namespace loxo::cli
