// SPDX-License-Identifier: Apache-2.0
// `loxo evaluate`: how wrong a solution is, against a truth.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>

#include "cli/command.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/study/consistency.hpp"
#include "loxo/study/evaluation_file.hpp"
#include "loxo/study/innovations_file.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::cli {
namespace {

struct Options {
  std::string solution, truth, ellipsoid, series;
  std::vector<std::string> require;
  std::string from, to, innovations;
};

std::string number(double x, const char* format = "{:.4g}") {
  return std::isnan(x) ? "-" : fmt::format(fmt::runtime(format), x);
}

void print_table(const Globals& globals, const Evaluation& e) {
  const auto line = [&](const std::string& name, const std::string& text) {
    say(globals, fmt::format("  {:<26}{}", name, text));
  };
  say(globals, fmt::format("{} epochs, {:.6g} to {:.6g} s, {:.6g} m driven", e.epochs, e.t_begin,
                           e.t_end, e.distance_m));
  line("horizontal error [m]", fmt::format("rms {}   max {}   end {}", number(e.horizontal_rms_m),
                                           number(e.horizontal_max_m), number(e.horizontal_end_m)));
  line("% of distance", fmt::format("50% {}   95% {}   max {}   end {}",
                                    number(e.horizontal_pct_50), number(e.horizontal_pct_95),
                                    number(e.horizontal_pct_max), number(e.horizontal_pct_end)));
  line("circular error [m]",
       fmt::format("CEP50 {}   CEP95 {}", number(e.cep50_m), number(e.cep95_m)));
  line("along, across, up rms [m]", fmt::format("{}   {}   {}", number(e.along_rms_m),
                                                number(e.across_rms_m), number(e.up_rms_m)));
  line("velocity error rms [m/s]", number(e.velocity_rms_mps));
  line("heading error rms",
       fmt::format("{} deg   ({} mil)", number(e.heading_rms_deg), number(e.heading_rms_mil)));
  line("pitch, roll error rms",
       fmt::format("{}   {} deg", number(e.pitch_rms_deg), number(e.roll_rms_deg)));
  if (!std::isnan(e.nees_mean))
    line("NEES", fmt::format("mean {} (expected {}), {:.1f} % of epochs inside [{:.3f}, {:.3f}]",
                             number(e.nees_mean), number(e.nees_dof), 100 * e.nees_95_inside,
                             e.nees_low, e.nees_high));
  if (!std::isnan(e.kitti_translation_pct))
    line("KITTI, 100 to 800 m", fmt::format("{} %   {} deg/100 m", number(e.kitti_translation_pct),
                                            number(100 * e.kitti_rotation_deg_per_m)));
  if (!e.by_length.empty()) {
    say(globals, "  pieces of length      50 %      95 %       max   pieces (independent)");
    for (const auto& r : e.by_length)
      say(globals, fmt::format("  {:>10.0f} m     {:>8}  {:>8}  {:>8}   {} ({:.1f})", r.length,
                               number(r.pct_50), number(r.pct_95), number(r.pct_max), r.pieces,
                               r.independent));
  }
}

// Mean over all sensors with its band, then each sensor.
void pool(Evaluation& e, const std::vector<SensorConsistency>& sensors) {
  double count = 0, sum = 0, above = 0;
  for (const auto& s : sensors) {
    const auto n = static_cast<double>(s.count);
    count += n, sum += n * s.nis_mean, above += n * s.nis_above_95;
  }
  if (count == 0) return;
  const Band band = chi_square_band(1, count);
  e.nis_mean = sum / count, e.nis_above_95 = above / count;
  e.nis_low = band.low, e.nis_high = band.high;
}
void print_innovations(const Globals& globals, const std::vector<SensorConsistency>& sensors) {
  if (sensors.empty()) return;
  say(globals, "  innovations          number  mean NIS  95 % band          above 95 %  lag one");
  for (const auto& s : sensors)
    say(globals, fmt::format("  {:<18} {:>8}  {:>8.3f}  {:.3f} to {:.3f} {:>11.1f} %  {:>6.2f}{}",
                             s.sensor, s.count, s.nis_mean, s.nis_low, s.nis_high,
                             100 * s.nis_above_95, s.lag_one, s.coloured ? "  coloured" : ""));
}
Json innovations_json(const std::vector<SensorConsistency>& sensors) {
  Json json = Json::object();
  for (const auto& s : sensors)
    json[s.sensor] = {{"count", s.count},
                      {"deweighted", s.deweighted},
                      {"rejected", s.rejected},
                      {"nis_mean", s.nis_mean},
                      {"nis_low", s.nis_low},
                      {"nis_high", s.nis_high},
                      {"nis_above_95", s.nis_above_95},
                      {"lag_one", s.lag_one},
                      {"coloured", s.coloured}};
  return json;
}

int run(const Globals& globals, const Options& o) {
  std::vector<Requirement> requirements;
  for (const auto& text : o.require) requirements.push_back(parse_requirement(text));
  EvaluateConfig config;
  if (!o.from.empty()) config.from = option_quantity(o.from, Dimension::kTime, "--from");
  if (!o.to.empty()) config.to = option_quantity(o.to, Dimension::kTime, "--to");

  Diagnostics diagnostics;
  if (config.to <= config.from)
    throw Error(ErrorKind::kUsage, "the stretch ends before it begins: --to " + o.to, "--from");
  Ellipsoid ellipsoid = wgs84();
  try {
    if (!o.ellipsoid.empty()) ellipsoid = ellipsoid_by_name(o.ellipsoid);
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what(), "--ellipsoid");
  }
  // The solution names its ellipsoid and its drive; options rule over both.
  Solution solution = read_solution(o.solution, ellipsoid, diagnostics);
  const auto meta = [&](const char* key) {
    const auto it = solution.meta.find(key);
    return it == solution.meta.end() ? std::string() : it->second;
  };
  std::string truth_path = o.truth;
  if (truth_path.empty()) {
    for (const char* key : {"reference", "truth", "drive"}) {
      const std::string named = meta(key);
      if (named.empty()) continue;
      namespace fs = std::filesystem;
      fs::path p(named);
      if (!fs::exists(p)) p = fs::path(o.solution).parent_path() / p;
      if (fs::exists(p)) {
        truth_path = p.string();
        break;
      }
    }
    if (truth_path.empty())
      throw Error(ErrorKind::kUsage,
                  "no truth given, and the solution names no drive that can be found: use --truth "
                  "FILE (a table or a drive)",
                  "--truth");
  }
  Ellipsoid truth_ellipsoid = ellipsoid;
  if (o.ellipsoid.empty() && !meta("ellipsoid").empty())
    truth_ellipsoid = ellipsoid_by_name(meta("ellipsoid"));
  Solution truth = read_truth(truth_path, truth_ellipsoid, diagnostics);
  if (o.ellipsoid.empty() && truth_ellipsoid.name != ellipsoid.name) {
    ellipsoid = truth_ellipsoid;
    solution = read_solution(o.solution, ellipsoid, diagnostics);
  }
  Evaluation e = evaluate(solution, truth, ellipsoid, config, diagnostics);
  std::vector<SensorConsistency> sensors;
  if (!o.innovations.empty())
    sensors = read_innovations(o.innovations, config.from, config.to, diagnostics);
  pool(e, sensors);

  Json json;
  json["command"] = "evaluate";
  const Json values = to_json(e);
  for (const auto& [key, value] : values.items()) json[key] = value;
  if (!sensors.empty()) {
    json["nis_band"] = {e.nis_low, e.nis_high};
    json["innovations"] = innovations_json(sensors);
  }
  json["solution"] = o.solution;
  json["truth"] = truth_path;
  json["diagnostics"] = to_json(diagnostics);
  Json met = Json::array();
  std::string missed;
  for (const auto& r : requirements) {
    const bool ok = meets(r, e);
    met.push_back({{"require", r.text}, {"met", ok}});
    if (!ok) {
      double found = kNone;
      for (const auto& v : evaluation_values(e))
        if (v.name == r.key) found = v.value;
      missed += fmt::format(
          "{}required {}, found {}", missed.empty() ? "" : "; ", r.text,
          std::isnan(found) ? "nothing (not known for this input)" : fmt::format("{}", found));
    }
  }
  if (!requirements.empty()) json["require"] = met;

  if (!globals.output.empty()) {
    if (globals.output.ends_with(".csv") || globals.output.ends_with(".csv.gz")) {
      write_evaluation_series(globals.output, e);
    } else {
      OutputFile file(globals.output);
      file.write(dump_json(json) + "\n");
      file.commit();
    }
  }
  if (!o.series.empty()) write_evaluation_series(o.series, e);
  if (globals.json && globals.output != "-") print_json(json);
  if (globals.output != "-") {
    print_table(globals, e);
    print_innovations(globals, sensors);
  }
  if (!globals.json) print_diagnostics(globals, diagnostics);
  std::cout.flush();
  if (!missed.empty()) throw Error(ErrorKind::kRequirement, missed, "requirement missed");
  return 0;
}

}  // namespace

void add_evaluate(CLI::App& app, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub = add_command(
      app, globals, "evaluate",
      "errors of a solution against a truth: metres, % of distance, CEP, heading, NEES",
      "loxo evaluate solution.csv --truth reference.csv --require 'horizontal_pct_max<0.2'",
      [&globals, o]() -> int { return run(globals, *o); });
  sub->add_option("solution", o->solution, "solution file (CSV or .h5)")->required();
  sub->add_option("--truth", o->truth,
                  "truth: a table with the solution's columns, or a drive with a [reference]; "
                  "default: the drive named in the solution");
  sub->add_option("--require", o->require, "KEY<NUMBER, may be repeated: exit 4 where missed")
      ->allow_extra_args(false);
  sub->add_option("--series", o->series, "also write the errors of every epoch to this CSV");
  sub->add_option("--innovations", o->innovations,
                  "also judge a filter's innovations: the file of 'loxo navigate --innovations', "
                  "or that command's --json result");
  sub->add_option("--from", o->from, "only from this time on (with unit: 120s)");
  sub->add_option("--to", o->to, "only up to this time");
  sub->add_option("--ellipsoid", o->ellipsoid,
                  "ellipsoid; default: the one named by the solution or the drive");
}

}  // namespace loxo::cli
