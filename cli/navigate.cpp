// SPDX-License-Identifier: Apache-2.0
#include "cli/navigate.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "loxo/log/drive.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/filter_drive.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::cli {
Json to_json(const AlignmentReport& a) {
  Json j = {{"method", a.method},
            {"heading_deg", a.heading / deg},
            {"heading_std_deg", a.heading_std / deg},
            {"std_gyro_deg", a.std_gyro / deg},
            {"std_noise_deg", a.std_noise / deg},
            {"std_sway_deg", a.std_sway / deg},
            {"duration_s", a.duration},
            {"note", a.note}};
  if (given(a.gyro_bias)) {
    j["gyro_bias_deg_h"] = a.gyro_bias / deg_per_h;
    j["latitude_limit_deg"] = a.latitude_limit / deg;
  }
  if (given(a.latitude)) {
    j["latitude_deg"] = a.latitude / deg;
    j["latitude_std_deg"] = a.latitude_std / deg;
  }
  return j;
}

std::string alignment_text(const AlignmentReport& a) {
  if (a.method == "state") return "start: the state given\n";
  std::string text = fmt::format("start: {}, heading {:.3f} deg +- {:.2g} deg", a.method,
                                 a.heading / deg, a.heading_std / deg);
  if (a.std_gyro > 0)
    text += fmt::format(" (gyro {:.2g}, noise {:.2g}, sway {:.2g} over {:.0f} s)", a.std_gyro / deg,
                        a.std_noise / deg, a.std_sway / deg, a.duration);
  text += a.note.empty() ? "\n" : fmt::format("; {}\n", a.note);
  // [EST-14], the east gyro's part
  if (a.std_gyro > 0)
    text += fmt::format(
        "predicted: an east gyro drift of {:.3g} deg/h at latitude {:.2f} deg turns the heading by "
        "{:.2g} deg; 5 deg {}\n",
        a.gyro_bias / deg_per_h, a.place_lat / deg, a.std_gyro / deg,
        a.latitude_limit > 0
            ? fmt::format("are reached at latitude {:.2f} deg", a.latitude_limit / deg)
            : std::string("are exceeded at every latitude"));
  if (given(a.latitude))
    text += fmt::format("latitude by gravity and the Earth's turn: {:.3f} deg +- {:.2g} deg\n",
                        a.latitude / deg, a.latitude_std / deg);
  return text;
}

FrameOption frame_option(const NavigateOptions& o) {
  FrameOption f;
  f.automatic = o.frame == "auto";
  for (FrameId id : {FrameId::kGeographic, FrameId::kTransverse, FrameId::kGrid, FrameId::kWander,
                     FrameId::kEcef})
    if (frame_name(id) == o.frame) f.frame = id;
  return f;
}

bool is_binary(const std::string& output) { return output.size() > 3 && output.ends_with(".h5"); }

double output_period(const NavigateOptions& o, const std::string& output) {
  const double rate = option_quantity(o.output_rate, Dimension::kFrequency, "--output-rate");
  if (!(rate > 0) || !std::isfinite(rate))
    throw Error(ErrorKind::kUsage, "the rate must be positive", "--output-rate");
  return is_binary(output) ? 0.0 : 1.0 / rate;
}

std::map<std::string, std::string> solution_meta(const NavigateOptions& o, const Drive& drive) {
  std::map<std::string, std::string> meta = {{"mode", o.mode},
                                             {"ellipsoid", drive.ellipsoid.name},
                                             {"version", LOXO_VERSION},
                                             {"drive", drive.name}};
  const std::string input = resolve_path(drive.imu.file, drive.folder);
  if (drive.imu.present && std::filesystem::is_regular_file(input))
    meta["input_hash"] = file_hash(input);
  return meta;
}

void add_navigate(CLI::App& app, Globals& globals) {
  auto o = std::make_shared<NavigateOptions>();
  auto* sub = add_command(
      app, globals, "navigate", "a Solution from a recorded drive",
      "loxo navigate DRIVE --mode reckon -o solution.csv", [o, &globals]() -> int {
        require_one_of(o->mode, {"inertial", "reckon", "segmented", "filter", "smooth"}, "--mode");
        require_one_of(o->frame, {"geographic", "transverse", "grid", "wander", "ecef", "auto"},
                       "--frame");
        require_one_of(o->integrator, {"exact", "midpoint", "start-latitude"}, "--integrator");
        if (!o->vertical.empty())
          require_one_of(o->vertical, {"free", "fixed", "ship", "external"}, "--vertical");
        if (o->precision < 0 || o->precision > 17)
          throw Error(ErrorKind::kUsage,
                      "expected 0 to 17 significant digits, found " + std::to_string(o->precision),
                      "--precision");
        if (globals.json && globals.output == "-")
          throw Error(ErrorKind::kUsage,
                      "the solution and the --json result cannot both be standard output", "-o");
        if (!o->innovations.empty() && (o->mode == "reckon" || o->mode == "inertial"))
          throw Error(ErrorKind::kUsage, "innovations come from the modes filter and smooth",
                      "--innovations");
        if (o->mode == "reckon") return navigate_reckon(globals, *o);
        if (o->mode == "inertial") return navigate_inertial(globals, *o);
        return navigate_filter(globals, *o);
      });
  sub->add_option("DRIVE", o->drive, "the recorded drive")->required();
  sub->add_option("--mode", o->mode, "inertial, reckon, segmented, filter, smooth");
  sub->add_option("--frame", o->frame, "geographic, transverse, grid, wander, ecef, auto");
  sub->add_option("--calibration", o->calibration, "certificate written by 'loxo calibrate -o'");
  sub->add_option("--integrator", o->integrator, "exact, midpoint, start-latitude (reckon)");
  sub->add_option("--meridian", o->meridian, "reference meridian of the transverse frame, as 0deg");
  sub->add_option("--vertical", o->vertical, "free, fixed, ship, external");
  sub->add_option("--output-rate", o->output_rate, "rate of text output, as 10Hz");
  sub->add_option("--precision", o->precision,
                  "significant digits; 0: reads back to the same double");
  sub->add_flag("--force", o->force, "continue with a poor alignment");
  const std::string group = "filter, smooth, segmented";
  sub->add_option("--use", o->use,
                  "only these witnesses, as "
                  "odometer,nhc,zupt,zaru,fixes,benchmarks,headings,heights,velocity")
      ->group(group);
  sub->add_option("--without", o->without, "all witnesses but these, as nhc,zaru")->group(group);
  sub->add_option("--fixes-until", o->fixes_until, "fixes up to this time only, as 946s")
      ->group(group);
  sub->add_option(
         "--fix-every", o->fix_every,
         "one fix per this time (after --fixes-until, else always), position only, as 300s")
      ->group(group);
  sub->add_flag("--no-fixes", o->no_fixes,
                "no fixes at all (the start position may still come from one)")
      ->group(group);
  sub->add_option("--innovations", o->innovations,
                  "also write every innovation to this CSV, for 'loxo evaluate --innovations'")
      ->group(group);
  sub->add_option("--outage", o->outages,
                  "no fixes from START for LENGTH, as 650s:340s; may be repeated")
      ->group(group);
}

}  // namespace loxo::cli
