// SPDX-License-Identifier: Apache-2.0
// `loxo transfer budget DRIVE`: is this reference good enough to test this unit at this transfer?
#include <fmt/format.h>

#include <array>
#include <cmath>

#include "cli/transfer.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/transfer_drive.hpp"

namespace loxo::cli {
namespace {

Json vector_json(const Vec<Body, double>& v) { return {v.x, v.y, v.z}; }
Json error_json(const EquivalentError& e) {
  return {{"accel_bias_mps2", vector_json(e.bias_f)},
          {"gyro_bias_radps", vector_json(e.bias_w)},
          {"accel_rms_mps2", vector_json(e.rms_f)},
          {"gyro_rms_radps", vector_json(e.rms_w)}};
}

// The unit's bias: the option's, else the drive's own; none where neither says it.
double unit_bias(const std::string& option, double declared, Dimension d, const char* name) {
  const double x = option.empty() ? declared : option_quantity(option, d, name);
  if (std::isfinite(x) && !(x > 0)) throw Error(ErrorKind::kUsage, "expected a bias above 0", name);
  return x;
}

}  // namespace

ReferenceSigma reference_sigma(const TransferOptions& o) {
  const auto sigma = [](const std::string& text, Dimension d, const char* name) {
    const double x = option_quantity(text, d, name);
    if (!(x >= 0)) throw Error(ErrorKind::kUsage, "expected 0 or more, found '" + text + "'", name);
    return x;
  };
  return {sigma(o.heading_error, Dimension::kAngle, "--heading-error"),
          sigma(o.level_error, Dimension::kAngle, "--level-error"),
          sigma(o.velocity_error, Dimension::kSpeed, "--velocity-error")};
}

int transfer_budget(const Globals& globals, const TransferOptions& o) {
  if (o.drive.empty()) throw Error(ErrorKind::kUsage, "expected a drive");
  const ReferenceSigma sigma = reference_sigma(o);
  const double share = option_quantity(o.share, Dimension::kNone, "--share");
  if (!(share > 0)) throw Error(ErrorKind::kUsage, "expected a share above 0", "--share");
  const Drive drive = read_drive(o.drive, globals.sets);
  const PolarMove move = polar_move(drive, o);
  const UnitSigma unit{
      unit_bias(o.gyro_bias, drive.imu_errors.gyro_bias, Dimension::kAngularRate, "--gyro-bias"),
      unit_bias(o.accel_bias, drive.imu_errors.accel_bias, Dimension::kAcceleration,
                "--accel-bias")};
  const bool known = std::isfinite(unit.gyro_bias) && std::isfinite(unit.accel_bias);
  Diagnostics diagnostics = drive.diagnostics;
  const TransferPoints track =
      telling(globals, diagnostics, [&] { return transfer_points(drive, move, diagnostics); });
  const TransferBudget b =
      loxo::transfer_budget(move.earth, track.points, track.step, sigma, o.draws, globals.seed);

  std::string text = fmt::format(
      "conversion error of {}, 1 sigma per body axis (right, forward, up), over {} points every "
      "{:.3g} s\n"
      "reference: heading {:.3g}', level {:.3g}', velocity {:.3g} m/s (1 sigma, constant over the "
      "voyage)\n"
      "{:<28}{:>30}{:>30}\n",
      drive.name, b.points, track.step, sigma.heading / arcmin, sigma.level / arcmin,
      sigma.velocity, "", "formula",
      o.draws > 0 ? fmt::format("Monte Carlo, {} draws", o.draws) : "");
  const auto line = [&](const char* what, const Vec<Body, double>& f, const Vec<Body, double>& m,
                        double unit_) {
    text +=
        fmt::format("{:<28}{:10.4g}{:10.4g}{:10.4g}", what, f.x / unit_, f.y / unit_, f.z / unit_);
    if (o.draws > 0)
      text += fmt::format("{:10.4g}{:10.4g}{:10.4g}", m.x / unit_, m.y / unit_, m.z / unit_);
    text += '\n';
  };
  line("as a bias: accel, ug", b.formula.bias_f, b.monte_carlo.bias_f, ug);
  line("as a bias: gyro, deg/h", b.formula.bias_w, b.monte_carlo.bias_w, deg_per_h);
  line("at an instant: accel, ug", b.formula.rms_f, b.monte_carlo.rms_f, ug);
  line("at an instant: gyro, deg/h", b.formula.rms_w, b.monte_carlo.rms_w, deg_per_h);
  text += fmt::format(
      "about its mean, share of the variance slower than 30 min, 30 min to 1 min, faster: accel "
      "{:.0f} {:.0f} {:.0f} %, gyro {:.0f} {:.0f} {:.0f} %\n",
      100 * b.spectrum.f[0], 100 * b.spectrum.f[1], 100 * b.spectrum.f[2], 100 * b.spectrum.w[0],
      100 * b.spectrum.w[1], 100 * b.spectrum.w[2]);
  Json verdict = nullptr;
  if (known) {
    const Verdict v = transfer_verdict(b.formula, unit, share);
    text += fmt::format(
        "the unit: {:.3g} deg/h, {:.3g} ug; the conversion adds {:.3g} of its gyro bias and {:.3g} "
        "of its accelerometer bias: the reference is {} for a share of {:.3g}",
        unit.gyro_bias / deg_per_h, unit.accel_bias / ug, v.gyro_ratio, v.accel_ratio,
        v.good ? "good enough" : "not good enough", share);
    verdict = {{"gyro_ratio", v.gyro_ratio},
               {"accel_ratio", v.accel_ratio},
               {"share", share},
               {"good", v.good}};
  } else {
    text +=
        "no verdict: neither [imu] errors of the drive nor --gyro-bias and --accel-bias say what "
        "the unit's own errors are";
  }
  print_diagnostics(globals, diagnostics);
  say(globals, text);
  if (globals.json)
    print_json({{"command", "transfer budget"},
                {"points", b.points},
                {"step_s", track.step},
                {"draws", b.draws},
                {"formula", error_json(b.formula)},
                {"monte_carlo", o.draws > 0 ? error_json(b.monte_carlo) : Json(nullptr)},
                {"spectrum",
                 {{"accel_slow_mid_fast", b.spectrum.f}, {"gyro_slow_mid_fast", b.spectrum.w}}},
                {"verdict", verdict},
                {"diagnostics", to_json(diagnostics)}});
  return 0;
}

}  // namespace loxo::cli
