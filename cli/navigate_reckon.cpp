// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "cli/navigate.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/reckon_drive.hpp"
#include "loxo/text/csv.hpp"

namespace loxo::cli {
namespace {

Integrator integrator_of(const std::string& name) {
  for (Integrator i : {Integrator::kExact, Integrator::kMidpoint, Integrator::kStartLatitude})
    if (integrator_name(i) == name) return i;
  throw Error(ErrorKind::kUsage, "'" + name + "' is not known", "--integrator");
}

// Of the file the way comes from, and of the description where it is a file of its own.
std::string input_hash(const Drive& drive) {
  const std::string& name = drive.track.present      ? drive.track.file
                            : drive.odometer.present ? drive.odometer.file
                                                     : drive.velocity.file;
  std::string hash;
  for (const std::string& path : {drive.toml_path, resolve_path(name, drive.folder)})
    if (std::filesystem::is_regular_file(path)) hash += (hash.empty() ? "" : " ") + file_hash(path);
  return hash;
}

}  // namespace

int navigate_reckon(const Globals& globals, const NavigateOptions& options) {
  ReckonOptions r;
  r.integrator = integrator_of(options.integrator);
  const double rate = option_quantity(options.output_rate, Dimension::kFrequency, "--output-rate");
  if (!(rate > 0) || !std::isfinite(rate))
    throw Error(ErrorKind::kUsage, "the rate must be positive", "--output-rate");
  if (globals.json && globals.output == "-")
    throw Error(ErrorKind::kUsage,
                "standard output cannot take the solution and --json; give -o a file", "-o");
  if (!options.calibration.empty()) r.calibration = read_calibration(options.calibration);
  const std::string output =
      globals.output.empty() && !globals.json ? std::string("-") : globals.output;
  const bool binary = output.size() > 3 && output.ends_with(".h5");
  r.output_rate = binary ? 0.0 : rate;

  const Drive drive = read_drive(options.drive, globals.sets);
  Diagnostics diagnostics = drive.diagnostics;
  std::unique_ptr<SolutionWriter> writer;
  const ReckonResult result = telling(globals, diagnostics, [&] {
    return reckon_drive(
        drive, r,
        [&](const SolutionRow& row) {
          if (output.empty()) return;
          if (!writer) {  // at the first row: a drive that cannot start leaves nothing
            const std::map<std::string, std::string> meta = {
                {"mode", "reckon"},
                {"ellipsoid", drive.ellipsoid.name},
                {"version", LOXO_VERSION},
                {"drive", drive.name},
                {"integrator", options.integrator},
                {"k", fmt::format("{}", r.calibration.k)},
                {"eps_deg", fmt::format("{}", r.calibration.eps / deg)},
                {"input_hash", input_hash(drive)}};
            writer = std::make_unique<SolutionWriter>(output, meta, options.precision);
          }
          writer->write(row);
        },
        diagnostics);
  });
  if (writer) writer->commit();
  print_diagnostics(globals, diagnostics);

  const SolutionRow& last = result.last;
  if (globals.json) {
    Json j;
    j["command"] = "navigate";
    j["mode"] = "reckon";
    j["integrator"] = options.integrator;
    j["rows"] = result.rows;
    j["steps"] = result.steps;
    j["duration_s"] = result.end - result.begin;
    j["distance_m"] = result.distance;
    j["k"] = r.calibration.k;
    j["eps_deg"] = r.calibration.eps / deg;
    j["end_t_s"] = last.t;
    j["end_lat_deg"] = last.lat / deg;
    j["end_lon_deg"] = last.lon / deg;
    j["end_h_m"] = last.h;
    j["end_heading_deg"] = last.heading / deg;
    j["diagnostics"] = to_json(diagnostics);
    print_json(j);
  } else if (output != "-") {
    say(globals,
        fmt::format("reckon {}: {} steps, {:.3f} km in {:.0f} s, {} rows to {}\nend: "
                    "{:.9f} deg, {:.9f} deg, {:.3f} m\n",
                    drive.name, result.steps, result.distance / km, result.end - result.begin,
                    result.rows, output, last.lat / deg, last.lon / deg, last.h));
  }
  return 0;
}

}  // namespace loxo::cli
