// SPDX-License-Identifier: Apache-2.0
// `loxo analyze odometer`: what alignment, gyros, odometer and benchmarks do to the scale and the
// mounting angle that a calibration drive finds, and what improves them most.
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "cli/analyze.hpp"
#include "loxo/calibrate/odometer_errors.hpp"
#include "loxo/calibrate/two_point.hpp"
#include "loxo/earth/ellipsoid.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::cli {
namespace {

struct Options {
  std::string ellipsoid = "WGS84", lat = "40deg", course = "45deg", length, speed = "20m/s",
              acceleration = "0.5m/s^2", model = "mechanised";
  std::string heading, level, gyro_bias, gyro_noise, benchmark, quantisation, scale_noise,
      side_slip, step = "1m";
};

double size(const std::string& text, Dimension d, const char* option) {
  if (text.empty()) return 0;
  const double x = option_quantity(text, d, option);
  if (!(x >= 0 && std::isfinite(x)))
    throw Error(ErrorKind::kUsage,
                "a standard deviation is never negative: at least 0 expected, found " + text,
                option);
  return x;
}

int run(const Globals& globals, const Options& o) {
  Ellipsoid ell;
  try {
    ell = ellipsoid_by_name(o.ellipsoid);
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what(), "--ellipsoid");
  }
  require_one_of(o.model, {"mechanised", "independent"}, "--heading-model");
  const auto model =
      o.model == "independent" ? HeadingModel::kIndependent : HeadingModel::kMechanised;
  if (o.length.empty())
    throw Error(ErrorKind::kUsage, "how long is the drive? a length with its unit, as 11.2km",
                "--length");
  CalibrationDrive drive;
  drive.lat = option_quantity(o.lat, Dimension::kAngle, "--lat");
  if (!(std::fabs(drive.lat) <= 90 * deg))
    throw Error(ErrorKind::kUsage, "latitude within +-90 deg expected, found " + o.lat, "--lat");
  drive.course = option_quantity(o.course, Dimension::kAngle, "--course");
  drive.length = option_quantity(o.length, Dimension::kLength, "--length");
  drive.speed = option_quantity(o.speed, Dimension::kSpeed, "--speed");
  drive.acceleration = option_quantity(o.acceleration, Dimension::kAcceleration, "--acceleration");
  OdometerSources s;
  s.heading = size(o.heading, Dimension::kAngle, "--heading-std");
  s.level = size(o.level, Dimension::kAngle, "--level-std");
  s.gyro_bias = size(o.gyro_bias, Dimension::kAngularRate, "--gyro-bias");
  s.gyro_noise = size(o.gyro_noise, Dimension::kAngleRandomWalk, "--gyro-noise");
  s.benchmark = size(o.benchmark, Dimension::kLength, "--benchmark-std");
  s.quantisation = size(o.quantisation, Dimension::kLength, "--quantisation");
  s.scale_noise = size(o.scale_noise, Dimension::kNone, "--scale-noise");
  s.side_slip = size(o.side_slip, Dimension::kAngle, "--side-slip");
  s.step = option_quantity(o.step, Dimension::kLength, "--step");
  const auto b = odometer_budget(ell, drive, s, model);
  if (b.ln_k == 0 && b.eps == 0)
    throw Error(ErrorKind::kUsage,
                "no error given: --heading-std 3.6arcmin, --gyro-bias 0.01deg/h, --benchmark-std "
                "0.1m …");

  Json json;
  json["command"] = "analyze odometer";
  json["heading_model"] = o.model;
  json["lat_deg"] = drive.lat / deg;
  json["course_deg"] = drive.course / deg;
  json["length_m"] = drive.length;
  json["duration_s"] = b.duration;
  json["ln_k_std"] = b.ln_k;
  json["eps_std_deg"] = b.eps / deg;
  json["leading_scale"] = b.sources[b.leading_ln_k].name;
  json["leading_angle"] = b.sources[b.leading_eps].name;
  json["improves_scale_most"] = b.improvements[b.best_ln_k].change;
  json["improves_angle_most"] = b.improvements[b.best_eps].change;
  Json table = Json::array();
  std::string csv = "source,ln_k_std,eps_std_deg\n";
  const auto share = [](double part, double whole) {
    return whole > 0 ? part * part / (whole * whole) : 0.0;
  };
  say(globals, fmt::format("{:.6g} m in {:.4g} s at latitude {:.6g} deg, course {:.6g} deg",
                           drive.length, b.duration, drive.lat / deg, drive.course / deg));
  say(globals, fmt::format("  {:<32}{:>12}{:>8}{:>14}{:>8}", "source (1 sigma)", "scale [1]", "",
                           "angle ['']", ""));
  for (const auto& x : b.sources) {
    table.push_back({{"source", x.name},
                     {"ln_k_std", x.ln_k},
                     {"eps_std_deg", x.eps / deg},
                     {"share_of_scale", share(x.ln_k, b.ln_k)},
                     {"share_of_angle", share(x.eps, b.eps)}});
    csv += x.name;
    for (double v : {x.ln_k, x.eps / deg}) {
      csv += ',';
      append_number(csv, v);
    }
    csv += '\n';
    if (x.ln_k > 0 || x.eps > 0)
      say(globals,
          fmt::format("  {:<32}{:>12.3g}{:>7.1f}%{:>14.4g}{:>7.1f}%", x.words, x.ln_k,
                      100 * share(x.ln_k, b.ln_k), x.eps / arcsec, 100 * share(x.eps, b.eps)));
  }
  say(globals,
      fmt::format("  {:<32}{:>12.3g}{:>8}{:>14.4g}", "all together", b.ln_k, "", b.eps / arcsec));
  json["sources"] = table;
  Json changes = Json::array();
  for (const auto& c : b.improvements)
    changes.push_back({{"change", c.change}, {"ln_k_std", c.ln_k}, {"eps_std_deg", c.eps / deg}});
  json["improvements"] = changes;
  if (b.ln_k > 0)
    say(globals,
        fmt::format("scale: led by {}; {} makes it {:.3g}", b.sources[b.leading_ln_k].words,
                    b.improvements[b.best_ln_k].change, b.improvements[b.best_ln_k].ln_k));
  if (b.eps > 0)
    say(globals,
        fmt::format("angle: led by {}; {} makes it {:.4g}''", b.sources[b.leading_eps].words,
                    b.improvements[b.best_eps].change, b.improvements[b.best_eps].eps / arcsec));
  json["note"] =
      "an error of the alignment's heading goes into the angle one to one and no benchmark tells "
      "them apart: it matters only after a new alignment";
  if (s.heading > 0) say(globals, json["note"].get<std::string>());

  // The totals against the length of the drive, each source on its own.
  Json lengths = Json::array(), ln_k = Json::array(), eps = Json::array();
  for (int i = -20; i <= 20; ++i) {
    CalibrationDrive d = drive;
    d.length *= std::pow(10.0, i / 20.0);
    if (std::fabs(d.lat) + d.length / ell.b > 89.9 * deg) break;
    const auto at = odometer_budget(ell, d, s, model);
    lengths.push_back(d.length);
    ln_k.push_back(at.ln_k);
    eps.push_back(at.eps / deg);
  }
  json["over_length"] = {{"length_m", lengths}, {"ln_k_std", ln_k}, {"eps_std_deg", eps}};
  if (!globals.output.empty()) {
    OutputFile file(globals.output);
    file.write(globals.output.ends_with(".json") ? dump_json(json) + "\n" : csv);
    file.commit();
  }
  if (globals.json) print_json(json);
  return 0;
}

}  // namespace

void add_analyze_odometer(CLI::App& analyze, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub = add_subcommand(
      analyze, globals, "odometer",
      "scale and angle error of a calibration drive, by source, and what improves them most",
      "loxo analyze odometer --length 11.2km --heading-std 3.6arcmin --level-std 0.5arcmin "
      "--gyro-bias 0.01deg/h --gyro-noise '0.001deg/sqrt(h)' --benchmark-std 0.1m",
      [&globals, o]() -> int { return run(globals, *o); });
  sub->add_option("--length", o->length, "of the drive, as 11.2km");
  sub->add_option("--speed", o->speed, "as 20m/s");
  sub->add_option("--acceleration", o->acceleration, "from rest and back to rest; 0m/s^2: none");
  sub->add_option("--lat", o->lat, "latitude of the start, as 40deg");
  sub->add_option("--course", o->course, "true course, as 45deg");
  sub->add_option("--ellipsoid", o->ellipsoid, "the Earth");
  sub->add_option(
      "--heading-model", o->model,
      "mechanised: the reckoning keeps its own attitude; independent: another set does");
  const std::string group = "errors, 1 sigma";
  sub->add_option("--heading-std", o->heading, "of the alignment's heading, as 3.6arcmin")
      ->group(group);
  sub->add_option("--level-std", o->level, "of its level, each axis, as 0.5arcmin")->group(group);
  sub->add_option("--gyro-bias", o->gyro_bias, "each axis, as 0.01deg/h")->group(group);
  sub->add_option("--gyro-noise", o->gyro_noise, "angle random walk, as 0.001deg/sqrt(h)")
      ->group(group);
  sub->add_option("--benchmark-std", o->benchmark, "of both ends, each axis, as 0.1m")
      ->group(group);
  sub->add_option("--quantisation", o->quantisation, "of the odometer, as 0.5m")->group(group);
  sub->add_option("--scale-noise", o->scale_noise, "white, each step, as 0.1%")->group(group);
  sub->add_option("--side-slip", o->side_slip, "white, each step, as 0.1deg")->group(group);
  sub->add_option("--step", o->step, "the step that these two are stated for, as 1m")->group(group);
}

}  // namespace loxo::cli
