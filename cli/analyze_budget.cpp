// SPDX-License-Identifier: Apache-2.0
// `loxo analyze budget`: which error of which sensor makes how much of the position error, over
// time, without Monte Carlo.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "cli/analyze.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/budget_drive.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/toml.hpp"

namespace loxo::cli {
namespace {

struct Choice {
  const char *option, *help;
  Dimension dimension;
  double BudgetErrors::*slot;
};
const std::vector<Choice>& choices() {
  static const std::vector<Choice> all = {
      {"--gyro-bias", "each axis, as 0.01deg/h", Dimension::kAngularRate, &BudgetErrors::gyro_bias},
      {"--gyro-bias-tau", "correlation time; without: constant", Dimension::kTime,
       &BudgetErrors::gyro_bias_tau},
      {"--gyro-scale", "as 50ppm", Dimension::kNone, &BudgetErrors::gyro_scale},
      {"--gyro-noise", "as 0.001deg/sqrt(h)", Dimension::kAngleRandomWalk,
       &BudgetErrors::gyro_noise},
      {"--gyro-walk", "as 0.001deg/h/sqrt(h)", Dimension::kRateRandomWalk,
       &BudgetErrors::gyro_walk},
      {"--accel-bias", "each axis, as 10ug", Dimension::kAcceleration, &BudgetErrors::accel_bias},
      {"--accel-bias-tau", "correlation time; without: constant", Dimension::kTime,
       &BudgetErrors::accel_bias_tau},
      {"--accel-scale", "as 100ppm", Dimension::kNone, &BudgetErrors::accel_scale},
      {"--accel-noise", "as 5ug/sqrt(Hz)", Dimension::kVelocityRandomWalk,
       &BudgetErrors::accel_noise},
      {"--accel-walk", "as 1e-7m/s^2/sqrt(s)", Dimension::kAccelerationRandomWalk,
       &BudgetErrors::accel_walk},
      {"--level-std", "of the alignment, each level axis, as 5arcsec", Dimension::kAngle,
       &BudgetErrors::level},
      {"--heading-std", "of the alignment, as 1arcmin", Dimension::kAngle, &BudgetErrors::heading},
      {"--position-std", "of the start (benchmark), as 0.1m", Dimension::kLength,
       &BudgetErrors::position},
      {"--velocity-std", "of the start, as 0.01m/s", Dimension::kSpeed, &BudgetErrors::velocity},
      {"--deflection", "of the vertical, each axis, as 5arcsec", Dimension::kAngle,
       &BudgetErrors::deflection},
      {"--deflection-length", "its correlation length, as 20km", Dimension::kLength,
       &BudgetErrors::deflection_length},
      {"--scale-std", "odometer scale, as 0.1%", Dimension::kNone, &BudgetErrors::scale},
      {"--mounting-std", "mounting angle in heading, as 1arcmin", Dimension::kAngle,
       &BudgetErrors::mounting_heading},
      {"--mounting-pitch-std", "mounting angle in pitch", Dimension::kAngle,
       &BudgetErrors::mounting_pitch},
      {"--scale-noise", "white, each odometer interval, as 0.1%", Dimension::kNone,
       &BudgetErrors::scale_noise},
      {"--side-slip", "white, each odometer interval, as 0.1deg", Dimension::kAngle,
       &BudgetErrors::side_slip},
      {"--quantisation", "of the odometer, as 0.05m", Dimension::kLength,
       &BudgetErrors::quantisation},
      {"--odometer-interval", "as 0.1s", Dimension::kTime, &BudgetErrors::odometer_interval},
      {"--heading-bias", "of the heading sensor, as 1arcmin", Dimension::kAngle,
       &BudgetErrors::attitude_bias},
      {"--heading-drift", "of the heading sensor, as 0.05deg/h", Dimension::kAngularRate,
       &BudgetErrors::attitude_drift},
      {"--heading-noise", "of the heading sensor, as 0.01deg/sqrt(h)", Dimension::kAngleRandomWalk,
       &BudgetErrors::attitude_noise}};
  return all;
}

struct Options {
  std::string what, mode = "auto", alignment = "auto", headings = "auto", vertical = "known",
                    calibration, integrator = "exact", step = "0.1s", every;
  std::vector<std::string> values = std::vector<std::string>(64);
};

// A drive is a folder, a .h5 file, or TOML without legs.
bool is_drive(const std::string& path) {
  namespace fs = std::filesystem;
  if (fs::is_directory(path) || path.ends_with(".h5")) return true;
  if (!fs::is_regular_file(path)) return false;
  return TomlTable::read(path).get_tables("leg").empty();
}

void take_certificate(const std::string& path, BudgetErrors& e) {
  const Json file = read_json(path);
  const Json* j = &file;
  if (j->is_object() && j->contains("result")) j = &j->at("result");
  if (j->is_object() && !j->contains("k_std") && j->contains("methods") &&
      j->contains("recommended")) {
    const std::string name = j->at("recommended").get<std::string>();
    if (j->at("methods").contains(name)) j = &j->at("methods").at(name);
  }
  for (const char* key : {"k", "k_std", "eps_std_deg"})
    if (!j->is_object() || !j->contains(key) || !j->at(key).is_number())
      throw Error(ErrorKind::kInput, "expected a certificate with a number", path + ": key " + key);
  e.scale = j->at("k_std").get<double>() / j->at("k").get<double>();
  e.mounting_heading = j->at("eps_std_deg").get<double>() * deg;
}

int run(const Globals& globals, const Options& o) {
  require_one_of(o.mode, {"auto", "inertial", "reckon"}, "--mode");
  require_one_of(o.alignment, {"auto", "given", "self"}, "--alignment");
  require_one_of(o.headings, {"auto", "true", "free"}, "--headings");
  require_one_of(o.vertical, {"known", "free"}, "--vertical");
  require_one_of(o.integrator, {"exact", "midpoint", "start-latitude"}, "--integrator");
  BudgetOptions b;
  b.step = option_quantity(o.step, Dimension::kTime, "--step");
  if (!(b.step > 0 && b.step <= 1))
    throw Error(ErrorKind::kUsage, "a step above 0 and at most 1 s expected, found " + o.step,
                "--step");
  b.height_known = o.vertical == "known";
  b.headings = o.headings == "true"   ? HeadingCount::kTrue
               : o.headings == "free" ? HeadingCount::kFree
                                      : HeadingCount::kAuto;
  b.integrator = o.integrator == "midpoint"         ? Integrator::kMidpoint
                 : o.integrator == "start-latitude" ? Integrator::kStartLatitude
                                                    : Integrator::kExact;
  Diagnostics diagnostics;
  const bool recorded = is_drive(o.what);
  Drive drive;
  Scenario scenario;
  double duration = 0;
  bool wheel = false;
  if (recorded) {
    drive = read_drive(o.what, globals.sets);
    b.errors = declared_errors(drive);
    b.attitude_sensor = drive.attitude.present || drive.track.present;
    wheel = drive.odometer.present || drive.track.present;
    b.self_aligned = drive.start.alignment_kind.has_value();
  } else {
    scenario = read_scenario(o.what, globals.sets);
    b.errors = declared_errors(scenario);
    b.attitude_sensor = scenario.attitude.present;
    wheel = scenario.odometer.present;
    duration = scenario.trajectory.duration();
  }
  if (o.alignment != "auto") b.self_aligned = o.alignment == "self";
  if (!o.calibration.empty()) take_certificate(o.calibration, b.errors);
  for (std::size_t i = 0; i < choices().size(); ++i) {
    const Choice& c = choices()[i];
    if (o.values[i].empty()) continue;
    const double x = option_quantity(o.values[i], c.dimension, c.option);
    if (!(x >= 0 && std::isfinite(x)))
      throw Error(
          ErrorKind::kUsage,
          "a standard deviation is never negative: at least 0 expected, found " + o.values[i],
          c.option);
    b.errors.*c.slot = x;
  }
  const std::string mode = o.mode != "auto" ? o.mode : wheel ? "reckon" : "inertial";
  if (mode == "inertial") b.attitude_sensor = false;
  if (!o.every.empty()) {
    b.row_every = option_quantity(o.every, Dimension::kTime, "--every");
    if (!(b.row_every > 0)) throw Error(ErrorKind::kUsage, "a time above 0 expected", "--every");
  } else if (duration > 0) {
    b.row_every = std::max(b.step, duration / 300);
  }
  Progress progress(globals, "budget", 1.0);
  b.progress = [&](double done) { progress.at(done); };
  const DriveBudget out =
      recorded ? drive_budget(drive, b, diagnostics) : scenario_budget(scenario, b);

  const bool reckon = mode == "reckon";
  const auto variance = [&](const SourceVariance& v) {
    return reckon ? v.dee + v.dnn : v.ee + v.nn;
  };
  // Sources that reach the chosen solution, the largest at the end first.
  std::vector<BudgetSource> sources = out.sources;
  const auto of = [&](const BudgetRow& row, BudgetSource s) -> const SourceVariance& {
    return row[static_cast<std::size_t>(s)];
  };
  sources.erase(std::remove_if(sources.begin(), sources.end(),
                               [&](BudgetSource s) {
                                 return std::all_of(out.rows.begin(), out.rows.end(),
                                                    [&](const BudgetRow& r) {
                                                      return !(variance(of(r, s)) > 1e-18);
                                                    });
                               }),
                sources.end());
  if (sources.empty())
    throw Error(ErrorKind::kInput,
                "no error is declared that reaches a solution by " + mode +
                    ": declare them (errors = { … }) or give them, as --gyro-bias 0.01deg/h",
                o.what);
  std::stable_sort(sources.begin(), sources.end(), [&](BudgetSource a, BudgetSource c) {
    return variance(of(out.rows.back(), a)) > variance(of(out.rows.back(), c));
  });

  Json json;
  json["command"] = "analyze budget";
  json["mode"] = mode;
  json["nominal"] = out.nominal;
  json["headings"] = out.true_heading ? "true" : "free";
  json["alignment"] = b.self_aligned ? "self" : "given";
  json["duration_s"] = out.t.back();
  json["distance_m"] = out.distance.back();
  const SourceVariance end = total(out.rows.back());
  const double whole = variance(end);
  json["horizontal_end_m"] = std::sqrt(whole);
  json["east_std_end_m"] = std::sqrt(reckon ? end.dee : end.ee);
  json["north_std_end_m"] = std::sqrt(reckon ? end.dnn : end.nn);
  if (!reckon) {
    json["velocity_end_mps"] = std::sqrt(end.vee + end.vnn);
    json["heading_end_deg"] = std::sqrt(end.heading) / deg;
  }
  if (out.distance.back() > 1)
    json["horizontal_end_percent"] = 100 * std::sqrt(whole) / out.distance.back();
  json["leading"] = std::string(budget_source_name(sources.front()));
  json["t_s"] = out.t;
  std::vector<double> sum;
  for (const auto& r : out.rows) sum.push_back(std::sqrt(variance(total(r))));
  json["total_m"] = sum;
  Json list = Json::array();
  std::string csv = "t_s,source,east_m,north_m,horizontal_m,ve_mps,vn_mps,heading_deg\n";
  say(globals, fmt::format("{}: {:.6g} s, {:.6g} m; {} solution", out.nominal, out.t.back(),
                           out.distance.back(), mode));
  say(globals, fmt::format("  {:<42}{:>14}{:>10}{:>14}", "source (1 sigma)", "at the end [m]",
                           "share", "at most [m]"));
  for (const BudgetSource s : sources) {
    std::vector<double> v;
    for (const auto& r : out.rows) v.push_back(variance(of(r, s)));
    const double last = std::sqrt(v.back()),
                 most = std::sqrt(*std::max_element(v.begin(), v.end()));
    // The total with this source half as large.
    const double halved = std::sqrt(whole - 0.75 * v.back());
    list.push_back({{"source", std::string(budget_source_name(s))},
                    {"horizontal_end_m", last},
                    {"share", whole > 0 ? v.back() / whole : 0.0},
                    {"horizontal_max_m", most},
                    {"total_if_halved_m", halved},
                    {"horizontal_variance_m2", v}});
    say(globals,
        fmt::format("  {:<42}{:>14.4g}{:>9.1f}%{:>14.4g}", std::string(budget_source_words(s)),
                    last, whole > 0 ? 100 * v.back() / whole : 0.0, most));
  }
  json["sources"] = list;
  say(globals, fmt::format("  {:<42}{:>14.4g}{:>10}{:>14.4g}", "all together", std::sqrt(whole), "",
                           *std::max_element(sum.begin(), sum.end())));
  say(globals, fmt::format("led by {}; half of it makes the end {:.4g} m",
                           std::string(budget_source_words(sources.front())),
                           list.front().at("total_if_halved_m").get<double>()));
  if (!globals.output.empty()) {
    OutputFile file(globals.output);
    if (globals.output.ends_with(".json")) {
      file.write(dump_json(json) + "\n");
    } else {
      const auto line = [&](double t, const std::string& name, const SourceVariance& v) {
        append_number(csv, t);
        csv += "," + name;
        const double values[] = {std::sqrt(reckon ? v.dee : v.ee),
                                 std::sqrt(reckon ? v.dnn : v.nn),
                                 std::sqrt(variance(v)),
                                 std::sqrt(v.vee),
                                 std::sqrt(v.vnn),
                                 std::sqrt(v.heading) / deg};
        for (double x : values) {
          csv += ',';
          append_number(csv, x);
        }
        csv += '\n';
      };
      for (std::size_t i = 0; i < out.rows.size(); ++i) {
        line(out.t[i], "total", total(out.rows[i]));
        for (const BudgetSource s : sources)
          line(out.t[i], std::string(budget_source_name(s)), of(out.rows[i], s));
      }
      file.write(csv);
    }
    file.commit();
  }
  json["diagnostics"] = to_json(diagnostics);
  if (globals.json) print_json(json);
  print_diagnostics(globals, diagnostics);
  return 0;
}

}  // namespace

void add_analyze_budget(CLI::App& analyze, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub = add_subcommand(
      analyze, globals, "budget",
      "error budget per source over time, of a scenario or a recorded drive, without Monte Carlo",
      "loxo analyze budget city-drive --heading-std 1arcmin --scale-std 0.05% -o budget.csv",
      [&globals, o]() -> int { return run(globals, *o); });
  sub->add_option("DRIVE|SCENARIO", o->what,
                  "a recorded drive, a scenario file, or a ready scenario's name")
      ->required();
  sub->add_option("--mode", o->mode,
                  "inertial: the strapdown solution alone; reckon: odometer and heading");
  sub->add_option("--alignment", o->alignment,
                  "self: found from the biased sensors themselves, errors correlated; given");
  sub->add_option("--headings", o->headings,
                  "true: counted from true north; free: as above 80 deg of latitude");
  sub->add_option("--vertical", o->vertical, "known (held height), free");
  sub->add_option("--calibration", o->calibration,
                  "certificate: its k_std and eps_std are the odometer's");
  sub->add_option("--integrator", o->integrator,
                  "exact, midpoint, start-latitude: the reckoning's own error is a source");
  sub->add_option("--step", o->step, "of the analysis, as 0.1s");
  sub->add_option("--every", o->every, "time between rows, as 10s");
  for (std::size_t i = 0; i < choices().size(); ++i)
    sub->add_option(choices()[i].option, o->values[i], choices()[i].help)
        ->group("errors, 1 sigma (as declared unless given)");
}

}  // namespace loxo::cli
