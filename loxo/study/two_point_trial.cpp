// SPDX-License-Identifier: Apache-2.0
// A drive on a rhumb line from one surveyed point to another, reckoned with a wrong scale and
// mounting angle and with noise on every source of (V-44) and (V-45), then calibrated from the two
// points.
#include "loxo/earth/rhumb.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/kernel_trial.hpp"

namespace loxo {
namespace {

enum P : std::size_t {
  kLat,
  kCourse,
  kLength,
  kDuration,
  kScale,
  kAngle,
  kBenchmark,
  kAzimuth,
  kDrift,
  kWalk,
  kScaleNoise,
  kCount
};

struct TwoPointKernel {
  Ellipsoid ell;

  template <Real S>
  void run(const S* p, std::uint64_t seed, std::uint64_t trial, S* m) const {
    const auto n = Stream<S>{seed, trial, 0}.template normals<10>(0);
    const S lat1 = p[kLat], lon1(0.0), d = p[kLength], T = p[kDuration];
    const auto end = rhumb_direct<S>(ell, lat1, lon1, p[kCourse], d);
    // The reckoned end: mean heading error over a straight drive, from initial azimuth, drift and
    // angle random walk; the walk's mean has variance N^2 T/3 (V-45).
    const S turn = p[kAngle] + p[kAzimuth] * n[0] + 0.5 * p[kDrift] * n[1] * T +
                   p[kWalk] * sqrt(T * (1.0 / 3.0)) * n[2];
    const S scale = p[kScale] * (1.0 + p[kScaleNoise] * n[3]);
    const auto reckoned = rhumb_direct<S>(ell, lat1, lon1, p[kCourse] + turn, d * scale);
    // The points as surveyed: north and east errors of each.
    const auto moved = [&](S lat, S lon, S north, S east) {
      const S s = sin(lat), w = sqrt(1.0 - ell.e2 * s * s);
      const S M = ell.a * (1.0 - ell.e2) / (w * w * w), N = ell.a / w;
      return LatLon<S>{lat + north / M, lon + east / (N * cos(lat))};
    };
    const auto a = moved(lat1, lon1, p[kBenchmark] * n[4], p[kBenchmark] * n[5]);
    const auto c = moved(end.lat, end.lon, p[kBenchmark] * n[6], p[kBenchmark] * n[7]);
    const auto surveyed = rhumb_inverse<S>(ell, a.lat, a.lon, c.lat, c.lon);
    // The log starts where the start point is believed to be.
    const auto back = rhumb_inverse<S>(ell, lat1, lon1, reckoned.lat, reckoned.lon);
    const S k = back.distance / surveyed.distance;
    const S ln_k_error = log(k / p[kScale]);
    const S eps_error = wrap_pi(back.azimuth - surveyed.azimuth - p[kAngle]);
    // Predicted variances (V-44), (V-45).
    const S b2 = 2.0 * p[kBenchmark] * p[kBenchmark] / (d * d);
    const S var_k = b2 + p[kScaleNoise] * p[kScaleNoise];
    const S var_eps = b2 + p[kAzimuth] * p[kAzimuth] + 0.25 * p[kDrift] * p[kDrift] * T * T +
                      p[kWalk] * p[kWalk] * T * (1.0 / 3.0);
    m[0] = ln_k_error;
    m[1] = eps_error;
    m[2] = sqrt(var_k);
    m[3] = sqrt(var_eps);
    m[4] = ln_k_error * ln_k_error / var_k + eps_error * eps_error / var_eps;
  }
};

}  // namespace

std::unique_ptr<TrialKind> make_two_point_trial(const TomlTable& settings) {
  const std::string ellipsoid = settings.get_string("ellipsoid").value_or("WGS84");
  TwoPointKernel kernel{ellipsoid_by_name(ellipsoid)};
  const double quarter = 0.5 * kPi;
  std::vector<ParameterInfo> p = {
      {"lat", "rad", Dimension::kAngle, 45.0 * deg, "latitude of the start", -quarter, quarter},
      {"course", "rad", Dimension::kAngle, 45.0 * deg, "course of the drive, clockwise from north",
       -2 * kPi, 2 * kPi},
      {"length", "m", Dimension::kLength, 10.0 * km, "length of the drive", 1e-3, 1e7},
      {"duration", "s", Dimension::kTime, 1000.0, "time that it takes", 1e-3, 1e7},
      {"scale", "", Dimension::kNone, 1.0, "odometer scale, indicated / true", 1e-3, 1e3},
      {"mounting", "rad", Dimension::kAngle, 0.0, "heading mounting angle, indicated - true", -kPi,
       kPi},
      {"benchmark_std", "m", Dimension::kLength, 0.1, "1 sigma of each surveyed point per axis",
       0.0, 1e6},
      {"azimuth_std", "rad", Dimension::kAngle, 0.0, "1 sigma of the initial azimuth", 0.0, kPi},
      {"drift_std", "radps", Dimension::kAngularRate, 0.0, "1 sigma of a constant heading drift",
       0.0, 1.0},
      {"angle_random_walk", "radpsqrts", Dimension::kAngleRandomWalk, 0.0, "angle random walk", 0.0,
       1.0},
      {"scale_noise", "", Dimension::kNone, 0.0, "1 sigma of the mean scale of the drive", 0.0,
       1.0},
  };
  return std::make_unique<KernelTrial<TwoPointKernel>>(
      kernel, p,
      std::vector<MetricInfo>{{"ln_k_error", "ln(estimated / true scale)"},
                              {"eps_error_rad", "estimated - true mounting angle"},
                              {"ln_k_std", "its sigma by (V-44)"},
                              {"eps_std_rad", "its sigma by (V-45)"},
                              {"nees", "both errors squared over their variances; mean 2"}},
      "ellipsoid=" + ellipsoid, 512);
}

}  // namespace loxo
