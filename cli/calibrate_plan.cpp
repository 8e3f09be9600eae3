// SPDX-License-Identifier: Apache-2.0
// `loxo calibrate plan`: which drive (leg lengths, courses, benchmarks) reaches a wanted accuracy
// of scale and angle.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <string>

#include "cli/calibrate.hpp"
#include "loxo/calibrate/plan.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/calibrate_drive.hpp"
#include "loxo/study/calibration_trials.hpp"

namespace loxo::cli {
namespace {

struct Options {
  std::string drive;
  std::string latitude, course = "45deg", speed = "15m/s", interval = "1s";
  std::string k_std, eps_std;
  std::string benchmark_std, height_std;
  std::string heading_bias, heading_drift, heading_noise, side_slip, scale_noise, quantisation;
  std::string longest = "100km";
  std::string scale = "1", mounting = "0deg";
  std::string ellipsoid;
  std::size_t benchmarks = 8;
  std::vector<std::string> estimate;
  int verify = 0;
};

double positive(const std::string& text, Dimension d, const std::string& option) {
  const double x = option_quantity(text, d, option);
  if (!(x > 0)) throw Error(ErrorKind::kUsage, "expected a value above 0", option);
  return x;
}
double sigma(const std::string& text, Dimension d, const std::string& option, double given) {
  if (text.empty()) return given;
  const double x = option_quantity(text, d, option);
  if (!(x >= 0)) throw Error(ErrorKind::kUsage, "expected 0 or more", option);
  return x;
}

PlanRequest request_of(const Globals& globals, const Options& o, Drive& drive) {
  PlanRequest r;
  if (!o.drive.empty()) {
    drive = read_drive(o.drive, globals.sets);
    r.errors = track_error_model(drive);
    if (!drive.benchmarks.empty()) {
      r.latitude = drive.benchmarks.front().point.lat;
      r.benchmark_std = drive.benchmarks.front().point.std;
      r.height_std = drive.benchmarks.front().point.std_h;
    }
  }
  if (!o.ellipsoid.empty()) {
    try {
      drive.ellipsoid = ellipsoid_by_name(o.ellipsoid);
    } catch (const Error& e) {
      throw Error(ErrorKind::kUsage, e.what(), "--ellipsoid");
    }
  }
  r.ellipsoid = &drive.ellipsoid;
  if (o.latitude.empty()) {
    if (o.drive.empty() || drive.benchmarks.empty())
      throw Error(ErrorKind::kUsage, "expected the latitude of the drive, as --latitude 55deg",
                  "--latitude");
  } else {
    r.latitude = option_quantity(o.latitude, Dimension::kAngle, "--latitude");
  }
  // Legs of tens of kilometres with true headings: the pole is for grid headings.
  if (!(std::fabs(r.latitude) <= 89 * deg))
    throw Error(ErrorKind::kUsage, "expected a latitude within -89 to 89 deg", "--latitude");
  if (o.k_std.empty() && o.eps_std.empty())
    throw Error(ErrorKind::kUsage,
                "expected the accuracy that is wanted, as --k-std 1e-4 or --eps-std 0.01deg",
                "--k-std, --eps-std");
  r.ln_k_std = o.k_std.empty() ? 0 : positive(o.k_std, Dimension::kNone, "--k-std");
  r.eps_std = o.eps_std.empty() ? 0 : positive(o.eps_std, Dimension::kAngle, "--eps-std");
  r.course = option_quantity(o.course, Dimension::kAngle, "--course");
  r.speed = positive(o.speed, Dimension::kSpeed, "--speed");
  r.interval = positive(o.interval, Dimension::kTime, "--interval");
  r.longest = positive(o.longest, Dimension::kLength, "--longest");
  if (r.longest < 100)
    throw Error(ErrorKind::kUsage, "expected at least 100 m of way", "--longest");
  if (r.longest > 1000 * km)
    throw Error(ErrorKind::kUsage, "expected at most 1000 km of way", "--longest");
  r.benchmark_std = sigma(o.benchmark_std, Dimension::kLength, "--benchmark-std", r.benchmark_std);
  r.height_std = sigma(o.height_std, Dimension::kLength, "--height-std",
                       o.benchmark_std.empty() ? r.height_std : r.benchmark_std);
  auto& e = r.errors;
  e.heading_bias = sigma(o.heading_bias, Dimension::kAngle, "--heading-bias", e.heading_bias);
  e.heading_drift =
      sigma(o.heading_drift, Dimension::kAngularRate, "--heading-drift", e.heading_drift);
  e.heading_noise =
      sigma(o.heading_noise, Dimension::kAngleRandomWalk, "--heading-noise", e.heading_noise);
  e.side_slip = sigma(o.side_slip, Dimension::kAngle, "--side-slip", e.side_slip);
  e.scale_noise = sigma(o.scale_noise, Dimension::kNone, "--scale-noise", e.scale_noise);
  e.quantisation = sigma(o.quantisation, Dimension::kLength, "--quantisation", e.quantisation);
  r.expected_k = positive(o.scale, Dimension::kNone, "--scale");
  r.expected_eps = option_quantity(o.mounting, Dimension::kAngle, "--mounting");
  if (o.benchmarks < 1 || o.benchmarks > 64)
    throw Error(ErrorKind::kUsage, "expected 1 to 64 benchmarks", "--benchmarks");
  r.benchmarks = o.benchmarks;
  r.estimate = states_of(o.estimate);
  return r;
}

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

// The unit that a state is told in.
struct StateUnit {
  const char* suffix;
  double factor;
  const char* sign;
};
StateUnit unit_of(State s) {
  switch (s) {
    case State::kDrift:
      return {"_deg_h", deg_per_h, " deg/h"};
    case State::kPitch:
      return {"_deg", deg, " deg"};
    default:
      return {"_m", 1.0, " m"};
  }
}

std::string leading(const ExpectedAccuracy& a, std::size_t state) {
  const auto& parts = a.sources[state];
  std::size_t lead = 0;
  double all = 0;
  for (std::size_t i = 0; i < kErrorSources; ++i) {
    all += parts[i];
    if (parts[i] > parts[lead]) lead = i;
  }
  if (!(all > 0)) return "-";
  return fmt::format("{} {:.0f} %", source_words(static_cast<ErrorSource>(lead)),
                     100 * parts[lead] / all);
}

Json plan_json(const PlanRequest& r, const Plan& p) {
  Json j;
  j["shape"] = p.shape.name;
  Json courses = Json::array();
  for (const double turn : p.shape.turns) courses.push_back(wrap_2pi(r.course + turn) / deg);
  j["courses_deg"] = courses;
  j["benchmarks"] = p.shape.turns.size() * p.shape.per_leg;
  j["benchmarks_per_leg"] = p.shape.per_leg;
  j["reached"] = p.reached;
  j["why"] = p.why;
  if (!(p.leg > 0)) return j;
  j["leg_m"] = p.leg;
  j["way_m"] = p.way;
  j["duration_s"] = p.duration;
  const auto& a = p.accuracy;
  j["k_std"] = number(a.std(0));
  j["eps_std_deg"] = number(a.std(1) / deg);
  for (std::size_t i = 2; i < a.states.size(); ++i) {
    const auto unit = unit_of(a.states[i]);
    j[std::string(state_name(a.states[i])) + "_std" + unit.suffix] = number(a.std(i) / unit.factor);
  }
  for (const std::size_t s : {std::size_t{0}, std::size_t{1}}) {
    Json shares = Json::object();
    const double all = a.covariance[s * a.states.size() + s];
    for (std::size_t i = 0; i < kErrorSources; ++i)
      shares[std::string(source_name(static_cast<ErrorSource>(i)))] =
          all > 0 ? Json(a.sources[s][i] / all) : Json(0.0);
    j[s == 0 ? "k_variance_shares" : "eps_variance_shares"] = shares;
  }
  j["mean_latitude_bias_k"] = number(p.formula_ln_k);
  j["mean_latitude_bias_eps_deg"] = number(p.formula_eps / deg);
  j["route_bias_k"] = number(p.route_ln_k);
  j["route_bias_eps_deg"] = number(p.route_eps / deg);
  return j;
}

std::string angle_text(double x) {
  if (x < 1 * arcmin) return fmt::format("{:.3g}\"", x / arcsec);
  return fmt::format("{:.3g} deg", x / deg);
}

std::string wanted_text(const PlanRequest& r) {
  std::string text;
  if (r.ln_k_std > 0) text += fmt::format("k to {:.3g}", r.ln_k_std);
  if (r.eps_std > 0)
    text += fmt::format("{}eps to {}", text.empty() ? "" : " and ", angle_text(r.eps_std));
  return text;
}

// Several lines of the same shape: those that use more benchmarks for no shorter way say nothing.
bool tells_nothing(const std::vector<Plan>& plans, std::size_t i) {
  for (std::size_t j = 0; j < plans.size(); ++j) {
    const auto &a = plans[i], &b = plans[j];
    if (j == i || b.shape.name != a.shape.name || b.shape.per_leg >= a.shape.per_leg) continue;
    if (a.reached && b.reached && b.way <= 1.02 * a.way) return true;
    if (!a.reached && !b.reached && b.leg > 0 && a.leg > 0) return true;
  }
  return false;
}

int run(const Globals& globals, const Options& o) {
  Drive drive;
  drive.ellipsoid = wgs84();
  const PlanRequest r = request_of(globals, o, drive);
  const auto plans = plan_drives(r);
  const Plan& best = plans.front();

  Json json{{"command", "calibrate plan"},
            {"latitude_deg", r.latitude / deg},
            {"wanted",
             {{"k_std", r.ln_k_std > 0 ? Json(r.ln_k_std) : Json(nullptr)},
              {"eps_std_deg", r.eps_std > 0 ? Json(r.eps_std / deg) : Json(nullptr)}}},
            {"reached", best.reached},
            {"recommended", best.reached ? Json(best.shape.name) : Json(nullptr)},
            {"plans", Json::array()}};
  for (const auto& p : plans) json["plans"].push_back(plan_json(r, p));

  std::string text = fmt::format(
      "{} wanted at {:.4g} deg, {:.3g} m/s, benchmarks known to {:.3g} m; the way at most {:.4g} "
      "km\n  {:<15}{:<20}{:>8}{:>8}{:>8}{:>7}{:>11}{:>12}   {}\n",
      wanted_text(r), r.latitude / deg, r.speed, r.benchmark_std, r.longest / km, "shape",
      "courses [deg]", "leg km", "points", "way km", "min", "k +-", "eps +-",
      "what leads: in k; in eps");
  for (std::size_t i = 0; i < plans.size(); ++i) {
    const auto& p = plans[i];
    if (!globals.verbose && tells_nothing(plans, i)) continue;
    std::string courses;
    for (const double turn : p.shape.turns)
      courses += fmt::format("{}{:03.0f}", courses.empty() ? "" : " ",
                             std::fmod(std::round(wrap_2pi(r.course + turn) / deg), 360.0));
    const std::string start =
        fmt::format("{} {:<15}{:<20}", i == 0 && p.reached ? "*" : " ", p.shape.name, courses);
    if (!p.reached) {
      text += fmt::format("{}{:>8}{:>8}   {}\n", start, "no",
                          p.shape.turns.size() * p.shape.per_leg, p.why);
      continue;
    }
    text += fmt::format("{}{:>8.3g}{:>8}{:>8.3g}{:>7.3g}{:>11.2g}{:>12}   {}; {}\n", start,
                        p.leg / km, p.shape.turns.size() * p.shape.per_leg, p.way / km,
                        p.duration / 60, p.accuracy.std(0), angle_text(p.accuracy.std(1)),
                        leading(p.accuracy, 0), leading(p.accuracy, 1));
    if (p.accuracy.states.size() > 2) {
      std::string others;
      for (std::size_t s = 2; s < p.accuracy.states.size(); ++s) {
        const auto unit = unit_of(p.accuracy.states[s]);
        others += fmt::format("{}{} +- {:.2g}{}", others.empty() ? "" : ", ",
                              state_words(p.accuracy.states[s]), p.accuracy.std(s) / unit.factor,
                              unit.sign);
      }
      text += fmt::format("  {:<15}{}\n", "", others);
    }
  }
  if (best.reached) {
    text += fmt::format("* recommended: the shortest way, calibrated from its log by {}",
                        best.shape.turns.size() * best.shape.per_leg + r.estimate.size() == 1
                            ? "replay"
                            : "least squares");
    if (std::isfinite(best.formula_eps) && (r.expected_k != 1 || r.expected_eps != 0))
      text += fmt::format(
          "; without a log, mean latitude errs by up to {:.2g} in k and {} in eps on a straight "
          "line (the rhumb chord does not)",
          best.formula_ln_k, angle_text(best.formula_eps));
    if (std::isfinite(best.route_eps) && std::hypot(best.route_ln_k, best.route_eps) > 0)
      text +=
          fmt::format("; a chord method would err by {:.2g} in k and {} in eps on this bent way",
                      std::fabs(best.route_ln_k), angle_text(std::fabs(best.route_eps)));
  }
  if (o.verify > 0 && best.reached) {
    const auto s =
        run_calibration_trials(*r.ellipsoid, plan_trials(r, best), o.verify, globals.seed);
    json["verify"] = {{"drives", s.drives},       {"valid", s.valid},  {"nees", number(s.nees)},
                      {"dimension", s.dimension}, {"band_low", s.low}, {"band_high", s.high},
                      {"inside", s.inside()}};
    if (s.valid > 0) {
      json["verify"]["k_std_found"] = number(s.states[0].found);
      json["verify"]["eps_std_found_deg"] = number(s.states[1].found / deg);
      text += fmt::format(
          "\n  {} simulated drives: k +- {:.2g}, eps +- {}; mean normalised square {:.3f} of {} "
          "(99.99 % band {:.3f} to {:.3f}): {}",
          s.drives, s.states[0].found, angle_text(s.states[1].found), s.nees, s.dimension, s.low,
          s.high, s.inside() ? "as stated" : "not as stated");
    }
  }
  say(globals, text);
  if (globals.json) print_json(json);
  if (!best.reached) {
    // The one that comes nearest says what holds it.
    const Plan* near = nullptr;
    double least = INFINITY;
    for (const auto& p : plans) {
      if (!(p.leg > 0)) continue;
      const auto s = index(p.missed);
      const double want = p.missed == State::kScale ? r.ln_k_std : r.eps_std;
      const double far = p.accuracy.std(s) / want;
      if (far < least) {
        least = far;
        near = &p;
      }
    }
    throw Error(
        ErrorKind::kWork,
        fmt::format("no plan of up to {:.4g} km and {} benchmarks reaches {}: {}", r.longest / km,
                    r.benchmarks, wanted_text(r),
                    near != nullptr ? fmt::format("the floor is {} ({}, {} benchmarks)", near->why,
                                                  near->shape.name,
                                                  near->shape.turns.size() * near->shape.per_leg)
                                    : best.why),
        "calibrate plan");
  }
  return 0;
}

}  // namespace

void add_calibrate_plan(CLI::App& calibrate, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub = add_subcommand(
      calibrate, globals, "plan", "what drive (length, courses, benchmarks) reaches an accuracy",
      "loxo calibrate plan --latitude 55deg --k-std 2e-5 --eps-std 10arcsec --benchmark-std 0.1m "
      "--heading-drift 0.01deg/h --scale-noise 0.1%",
      [o, &globals]() -> int { return run(globals, *o); });
  sub->add_option("DRIVE", o->drive,
                  "a drive whose declared sensor errors, latitude and benchmark std are used");
  sub->add_option("--latitude", o->latitude, "of the drive, as 55deg");
  sub->add_option("--k-std", o->k_std, "wanted 1 sigma of k / k, as 2e-5 or 0.01%");
  sub->add_option("--eps-std", o->eps_std, "wanted 1 sigma of the mounting angle, as 10arcsec");
  sub->add_option("--benchmark-std", o->benchmark_std,
                  "1 sigma of start and benchmarks per axis (0.1m)");
  sub->add_option("--height-std", o->height_std,
                  "1 sigma of their heights (as --benchmark-std), for pitch_mounting");
  sub->add_option("--heading-bias", o->heading_bias, "alignment of the heading, 1 sigma");
  sub->add_option("--heading-drift", o->heading_drift, "constant heading drift, as 0.01deg/h");
  sub->add_option("--heading-noise", o->heading_noise, "angle random walk, as 0.005deg/sqrt(h)");
  sub->add_option("--side-slip", o->side_slip, "white, each row, as 0.05deg");
  sub->add_option("--scale-noise", o->scale_noise, "white odometer noise, each row, as 0.1%");
  sub->add_option("--quantisation", o->quantisation, "one odometer pulse, as 0.05m");
  sub->add_option("--course", o->course, "of the first leg (45deg)");
  sub->add_option("--speed", o->speed, "(15m/s)");
  sub->add_option("--interval", o->interval, "time between rows of the log (1s)");
  sub->add_option("--longest", o->longest, "longest way to drive (100km)");
  sub->add_option("--benchmarks", o->benchmarks, "at most so many beside the start (8)");
  sub->add_option(
         "--estimate", o->estimate,
         "states beside scale and angle: heading_drift,pitch_mounting,lever_arm,start_offset")
      ->delimiter(',');
  sub->add_option("--scale", o->scale, "expected k before calibration, for chord methods (1)");
  sub->add_option("--mounting", o->mounting, "expected eps before calibration (0deg)");
  sub->add_option("--ellipsoid", o->ellipsoid, "WGS84, GRS80, CGCS2000, Krassovsky, or a=…m,f=…");
  sub->add_option("--verify", o->verify, "simulate so many drives of the recommended plan");
}

}  // namespace loxo::cli
