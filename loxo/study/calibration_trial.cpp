// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/calibration_trial.hpp"

#include <algorithm>
#include <limits>

#include "loxo/calibrate/replay.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/num/functions.hpp"

namespace loxo {
namespace {

Benchmark surveyed(const Ellipsoid& ell, const Point<Ecef>& r, double north, double east,
                   double std, std::ptrdiff_t row) {
  const auto g = to_geodetic(ell, r);
  const double s = sin(g.lat);
  Benchmark b;
  b.row = row;
  b.lat = g.lat + north / (meridian_radius(ell, s) + g.h);
  b.lon = wrap_pi(g.lon + east / ((prime_vertical_radius(ell, s) + g.h) * cos(g.lat)));
  b.h = g.h;
  b.std = std;
  return b;
}

}  // namespace

void calibrate_trial(const CalibrationTrial& trial, double out[kCalibrationMetrics]) {
  std::fill(out, out + kCalibrationMetrics, std::numeric_limits<double>::quiet_NaN());
  const Ellipsoid& ell = *trial.ellipsoid;
  const auto& steps = *trial.track;
  const auto rows = static_cast<std::ptrdiff_t>(steps.size());
  const Benchmark a =
      surveyed(ell, trial.start, trial.survey[0], trial.survey[1], trial.benchmark_std, 0);
  const Benchmark c =
      surveyed(ell, trial.end, trial.survey[2], trial.survey[3], trial.benchmark_std, rows);
  RecordedTrack track;
  track.ellipsoid = &ell;
  track.steps = steps;
  TrackErrorModel errors;
  errors.heading_bias = trial.heading_bias;
  errors.heading_drift = trial.heading_drift;
  errors.heading_noise = trial.heading_noise;
  errors.scale_noise = trial.scale_noise;
  errors.quantisation = trial.quantisation;
  const Calibration r = calibrate_replay(track, a, c, errors);
  if (r.valid) {
    out[0] = log(r.k / trial.scale);
    out[1] = wrap_pi(r.eps - trial.eps);
    out[2] = r.ln_k_std;
    out[3] = r.eps_std;
    const double rho = or_else(r.correlation, 0.0);
    const double x = out[0] / r.ln_k_std, y = out[1] / r.eps_std;
    out[4] = (x * x - 2 * rho * x * y + y * y) / (1 - rho * rho);
    out[8] = r.closure;
  }
  const Replay replay(track, a, {steps.size()});
  const auto reckoned = replay.run({}).front();
  TwoPointInput in{a.lat, a.lon, c.lat, c.lon, reckoned.lat, reckoned.lon};
  TwoPointOptions options;
  options.benchmark_std = trial.benchmark_std;
  options.continuous_lon = true;
  const auto p = calibrate_two_point(ell, ChordMethod::kRhumb, in, options);
  if (p.valid) {
    out[5] = log(p.value.k / trial.scale);
    out[6] = wrap_pi(p.value.eps - trial.eps);
    out[7] = p.value.chord;
  }
}

}  // namespace loxo
