// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/calibrate_drive.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo::cli {
namespace {

struct Options {
  std::string drive, method, against;
  std::vector<std::string> estimate;
};

const std::vector<std::string> kMethods = {"replay",   "start_latitude", "mean_latitude", "rhumb",
                                           "geodesic", "gauss",          "least_squares", "online"};

std::string number(double x, const char* format) {
  return std::isnan(x) ? "-" : fmt::format(fmt::runtime(format), x);
}

int run(const Globals& globals, const Options& o) {
  if (o.drive.empty())
    throw Error(ErrorKind::kUsage, "calibrate what? a DRIVE, 'points' or 'plan'", "calibrate");
  CalibrateOptions options;
  options.estimate = states_of(o.estimate);
  options.only = o.method;
  for (char& c : options.only)
    if (c == '-') c = '_';
  if (!options.only.empty() &&
      std::find(kMethods.begin(), kMethods.end(), options.only) == kMethods.end())
    throw Error(ErrorKind::kUsage,
                "'" + o.method + "' is no method" + suggestion(options.only, kMethods), "--method");
  options.online = options.estimate.empty();
  const Drive drive = read_drive(o.drive, globals.sets);
  Diagnostics diagnostics = drive.diagnostics;
  const auto result =
      telling(globals, diagnostics, [&] { return calibrate_drive(drive, options, diagnostics); });
  const auto* best = result.find(result.recommended);

  Json json = to_json(drive, result);
  Drift drift;
  if (!o.against.empty() && best != nullptr) {
    drift = drift_against(*best, read_json(o.against), o.against);
    json["against"] = {{"certificate", o.against}, {"drifted", drift.drifted},
                       {"chi2", drift.chi2},       {"probability", drift.probability},
                       {"dk", drift.dk},           {"deps_deg", drift.deps / deg}};
  }
  json["diagnostics"] = to_json(diagnostics);
  if (!globals.output.empty() && best != nullptr) {
    OutputFile file(globals.output);
    file.write(dump_json(certificate(drive, result, LOXO_VERSION)) + "\n");
    file.commit();
  }
  if (globals.json) print_json(json);
  if (given(result.route))
    say(globals, fmt::format("{}: route {:.1f} m, chord {:.1f} m, area {:.4g} m^2, headings {}",
                             drive.name, result.route, result.chord, result.signed_area,
                             json["heading_model"].get<std::string>()));
  say(globals, fmt::format("  {:<15}{:>14}{:>11}{:>14}{:>11}{:>11}{:>12}{:>14}", "method", "k",
                           "+-", "eps [deg]", "+-", "closure m", "route dk", "route deps \""));
  for (const auto& m : result.methods) {
    if (m.valid)
      say(globals,
          fmt::format("{} {:<15}{:>14.9f}{:>11}{:>14.7f}{:>11}{:>11}{:>12}{:>14}",
                      m.method == result.recommended ? "*" : " ", m.method, m.k,
                      number(m.ln_k_std * m.k, "{:.2g}"), m.eps / deg,
                      number(m.eps_std / deg, "{:.2g}"), number(m.closure, "{:.3g}"),
                      number(m.route_ln_k, "{:.2g}"), number(m.route_eps / arcsec, "{:.2g}")));
    else
      say(globals, fmt::format("  {:<15}{}", m.method, m.why));
  }
  if (const auto* fit = result.find("least_squares"); fit != nullptr && fit->valid) {
    std::string text;
    const std::size_t n = fit->states.size();
    for (std::size_t i = 2; i < n; ++i) {
      const State state = fit->states[i];
      const double unit = state == State::kDrift ? deg_per_h : state == State::kPitch ? deg : 1.0;
      text += fmt::format("{}{} {:.5g} +- {:.2g} {}", text.empty() ? "" : ", ", state_words(state),
                          fit->values[i] / unit, std::sqrt(fit->covariance[i * n + i]) / unit,
                          state == State::kDrift   ? "deg/h"
                          : state == State::kPitch ? "deg"
                                                   : "m");
    }
    if (fit->dof > 0 && fit->chi2 > 0)
      text += fmt::format("{}chi2 {:.3g} of {}", text.empty() ? "" : "; ", fit->chi2, fit->dof);
    if (!text.empty()) say(globals, "  least_squares: " + text);
  }
  if (best != nullptr)
    say(globals, fmt::format("* recommended: {} ({})", result.recommended, result.why));
  if (!o.against.empty() && best != nullptr)
    say(globals,
        fmt::format("against {}: {} (chi2 {:.3g}, probability {:.3g})", o.against,
                    drift.drifted ? "drifted" : "not drifted", drift.chi2, drift.probability));
  print_diagnostics(globals, diagnostics);
  if (best == nullptr) {
    std::string reasons;
    for (const auto& m : result.methods) reasons += fmt::format("\n  {}: {}", m.method, m.why);
    throw Error(ErrorKind::kWork, "no method is valid for this drive:" + reasons, o.drive);
  }
  return 0;
}

}  // namespace

std::vector<State> states_of(const std::vector<std::string>& names) {
  static const std::vector<std::string> known = {"heading_drift", "pitch_mounting", "lever_arm",
                                                 "start_offset"};
  std::vector<State> out;
  for (const auto& n : names) {
    if (n == "heading_drift") {
      out.push_back(State::kDrift);
    } else if (n == "pitch_mounting") {
      out.push_back(State::kPitch);
    } else if (n == "lever_arm") {
      out.insert(out.end(), {State::kLeverRight, State::kLeverForward});
    } else if (n == "start_offset") {
      out.insert(out.end(), {State::kStartNorth, State::kStartEast});
    } else {
      throw Error(ErrorKind::kUsage, "'" + n + "' is no state" + suggestion(n, known),
                  "--estimate");
    }
  }
  return out;
}

void add_calibrate(CLI::App& app, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub =
      add_command(app, globals, "calibrate",
                  "scale and mounting angle from a recorded drive, every method side by side",
                  "loxo calibrate DRIVE -o certificate.json",
                  [&globals, o]() -> int { return run(globals, *o); });
  sub->add_option("DRIVE", o->drive, "the recorded drive");
  sub->add_option("--method", o->method,
                  "one of replay, start_latitude, mean_latitude, rhumb, geodesic, gauss, "
                  "least_squares, online");
  sub->add_option(
         "--estimate", o->estimate,
         "states beside scale and angle: heading_drift,pitch_mounting,lever_arm,start_offset")
      ->delimiter(',');
  sub->add_option("--against", o->against, "an older certificate: drifted or not");
  add_calibrate_points(*sub, globals);
  add_calibrate_plan(*sub, globals);
}

}  // namespace loxo::cli
