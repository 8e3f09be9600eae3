// SPDX-License-Identifier: Apache-2.0
// `loxo analyze noise`: one noise figure in every form that data sheets, models and recorders use.
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "cli/analyze.hpp"
#include "loxo/errors/noise_units.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo::cli {
namespace {

struct Options {
  std::string value, as, rate, tau;
};

// "0.05deg/s" -> "deg/s": what follows the number.
std::string unit_of(const std::string& text) {
  std::size_t at = 0;
  try {
    (void)std::stod(text, &at);
  } catch (const std::exception&) {
    at = 0;
  }
  while (at < text.size() && text[at] == ' ') ++at;
  return text.substr(at);
}

int run(const Globals& globals, const Options& o) {
  Dimension d;
  try {
    d = unit_dimension(unit_of(o.value), "VALUE");
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what());
  }
  const bool gyro = d == Dimension::kAngleRandomWalk || d == Dimension::kAngularRate ||
                    d == Dimension::kRateRandomWalk;
  const bool walk = d == Dimension::kAngleRandomWalk || d == Dimension::kVelocityRandomWalk;
  const bool rate_walk = d == Dimension::kRateRandomWalk || d == Dimension::kAccelerationRandomWalk;
  const bool plain = d == Dimension::kAngularRate || d == Dimension::kAcceleration;
  if (!walk && !rate_walk && !plain)
    throw Error(
        ErrorKind::kUsage,
        "a noise figure expected, as 0.1deg/sqrt(h), 20ug/sqrt(Hz), 0.05deg/s, 10ug; found " +
            o.value,
        "VALUE");
  const double x = option_quantity(o.value, d, "VALUE");
  if (!(x >= 0 && std::isfinite(x)))
    throw Error(ErrorKind::kUsage, "noise is never negative: at least 0 expected, found " + o.value,
                "VALUE");
  const double rate = o.rate.empty() ? 0 : option_quantity(o.rate, Dimension::kFrequency, "--rate");
  const double tau = o.tau.empty() ? 0 : option_quantity(o.tau, Dimension::kTime, "--tau");
  if (!o.rate.empty() && !(rate > 0))
    throw Error(ErrorKind::kUsage, "a rate above 0 expected", "--rate");
  std::string as = o.as;
  if (as.empty()) as = walk ? "random-walk" : rate_walk ? "rate-walk" : "";
  if (plain)
    require_one_of(as, {"sample", "floor", "instability"}, "--as");
  else if (walk)
    require_one_of(as, {"random-walk", "density"}, "--as");
  else
    require_one_of(as, {"rate-walk"}, "--as");
  if (as == "sample" && rate == 0)
    throw Error(ErrorKind::kUsage, "a sample's noise needs the rate it is sampled at, as 100Hz",
                "--rate");

  Json json;
  json["command"] = "analyze noise";
  const auto put = [&](const std::string& key, const std::string& words, double value,
                       const std::string& unit) {
    json[key] = value;
    say(globals, fmt::format("  {:<46}{:>14.6g} {}", words, value, unit));
  };
  const std::string si = gyro ? "rad/s" : "m/s^2", shown = gyro ? "deg/s" : "ug";
  const double unit = gyro ? deg : ug;
  if (as == "random-walk" || as == "density" || as == "sample") {
    const double n = as == "sample"    ? random_walk_of_sample(x, rate)
                     : as == "density" ? random_walk_of_density(x)
                                       : x;
    if (gyro) {
      put("angle_random_walk_deg_sqrt_h", "angle random walk", n / deg_per_sqrt_h, "deg/sqrt(h)");
      put("angle_random_walk_rad_sqrt_s", "", n, "rad/sqrt(s)");
      put("density_one_sided_deg_s_sqrt_hz", "root density, one-sided",
          density_of_random_walk(n) / deg, "deg/s/sqrt(Hz)");
      put("density_two_sided_deg_s_sqrt_hz", "root density, two-sided", n / deg, "deg/s/sqrt(Hz)");
    } else {
      put("velocity_random_walk_mps_sqrt_h", "velocity random walk", n / mps_per_sqrt_h,
          "m/s/sqrt(h)");
      put("velocity_random_walk_mps_sqrt_s", "", n, "m/s/sqrt(s)");
      put("density_one_sided_ug_sqrt_hz", "root density, one-sided", density_of_random_walk(n) / ug,
          "ug/sqrt(Hz)");
      put("density_two_sided_ug_sqrt_hz", "root density, two-sided", n / ug, "ug/sqrt(Hz)");
    }
    if (rate > 0) {
      const double s = sample_of_random_walk(n, rate);
      put("sample_std_si", fmt::format("of a sample, mean over 1/({:g} Hz)", rate), s, si);
      put(gyro ? "sample_std_deg_s" : "sample_std_ug", "", s / unit, shown);
      put("increment_std_si", "of its increment", s / rate, gyro ? "rad" : "m/s");
    }
  } else if (as == "rate-walk") {
    put(gyro ? "rate_random_walk_deg_h_sqrt_h" : "acceleration_random_walk_ug_sqrt_h",
        gyro ? "rate random walk" : "acceleration random walk",
        gyro ? x / (deg_per_h / 60.0) : x / (ug / 60.0), gyro ? "deg/h/sqrt(h)" : "ug/sqrt(h)");
    put("rate_random_walk_si_sqrt_s", "", x, si + "/sqrt(s)");
    if (rate > 0)
      put("bias_step_si", fmt::format("step of the bias at {:g} Hz", rate),
          step_of_rate_walk(x, rate), si);
  } else {
    const double b = as == "floor" ? instability_of_floor(x) : x, floor = floor_of_instability(b);
    const double u = gyro ? deg_per_h : ug;
    const std::string name = gyro ? "deg/h" : "ug";
    put(gyro ? "bias_instability_deg_h" : "bias_instability_ug", "bias instability B", b / u, name);
    put(gyro ? "allan_floor_deg_h" : "allan_floor_ug", "floor of the Allan deviation, 0.664 B",
        floor / u, name);
    const double m = markov_of_floor(floor);
    put(gyro ? "markov_std_deg_h" : "markov_std_ug", "Gauss-Markov bias with that top", m / u,
        name);
    if (tau > 0) {
      put("markov_drive_si_sqrt_s", fmt::format("its driving noise at tau {:g} s", tau),
          drive_of_markov(m, tau), si + "/sqrt(s)");
      if (rate > 0)
        put("markov_step_si", fmt::format("its step at {:g} Hz", rate),
            m * std::sqrt(-std::expm1(-2.0 / (rate * tau))), si);
    }
  }
  if (globals.json) print_json(json);
  return 0;
}

}  // namespace

void add_analyze_noise(CLI::App& analyze, Globals& globals) {
  auto o = std::make_shared<Options>();
  auto* sub =
      add_subcommand(analyze, globals, "noise",
                     "a noise figure in every form of data sheets, models and samples, both ways",
                     "loxo analyze noise '0.1deg/sqrt(h)' --rate 100Hz",
                     [&globals, o]() -> int { return run(globals, *o); });
  sub->add_option("VALUE", o->value, "0.1deg/sqrt(h), 20ug/sqrt(Hz), 0.05deg/s, 10ug …")
      ->required();
  sub->add_option("--as", o->as,
                  "random-walk, density (one-sided), sample, rate-walk, floor, instability");
  sub->add_option("--rate", o->rate, "of the samples, as 100Hz");
  sub->add_option("--tau", o->tau, "correlation time of a Gauss-Markov bias, as 300s");
}

}  // namespace loxo::cli
