// SPDX-License-Identifier: Apache-2.0
// The joint filter inside a program of yours: inertial increments, an odometer and position fixes
// that come late, in one stream on standard input; the solution once a second.
//   embed_filter lat_deg lon_deg h_m heading_deg heading_std_deg < messages
// A line is one of, in SI and radians:
//   imu t dt  angle_right angle_forward angle_up  dv_right dv_forward dv_up
//   odo t distance_since_last
//   fix t lat_deg lon_deg h_m std_m        t: when it was true, up to two seconds before now
// At rest at the start, level. Nothing is allocated in the loop.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/num/units.hpp"

using namespace loxo;

int main(int argc, char** argv) {
  double given[5];
  for (int i = 0; i < 5; ++i) {
    char* end = nullptr;
    given[i] = argc == 6 ? std::strtod(argv[i + 1], &end) : NAN;
    if (!end || end == argv[i + 1] || *end != '\0' || !std::isfinite(given[i])) {
      std::fprintf(stderr,
                   "expected: embed_filter lat_deg lon_deg h_m heading_deg heading_std_deg\n");
      return 2;
    }
  }
  // What the data sheets say, 1 sigma.
  NavigatorConfig config;
  config.ellipsoid = wgs84();
  config.imu_interval = 0.02;
  config.gyro_bias = 1 * deg_per_h, config.gyro_noise = 0.05 * deg_per_sqrt_h;
  config.accel_bias = 300 * ug, config.accel_noise = 0.02 * mps_per_sqrt_h;
  expect_noise(config.standstill, config.gyro_noise, config.accel_noise, config.imu_interval);
  config.late_limit = 2.0;  // s: the receiver's fixes come up to this late

  NavigatorStart start;
  const Geodetic<double> at{given[0] * deg, given[1] * deg, given[2]};
  start.state.r = to_ecef(config.ellipsoid, at);
  start.state.q = to_quaternion(transpose(geographic_axes(at.lat, at.lon)) *
                                to_matrix<Geographic>(Euler<double>{given[3] * deg, 0, 0}));
  StartSigmas sigmas = start_sigmas(config);
  sigmas.level = 0.05 * deg, sigmas.heading = given[4] * deg;
  sigmas.velocity = 0.01, sigmas.position = 3;
  start.P = start_covariance(config.ellipsoid, start.state, sigmas);

  Navigator navigator(config);
  navigator.start(start);
  double next = 1.0;
  char line[512];
  std::printf("t_s,lat_deg,lon_deg,h_m,heading_deg,std_e_m,std_n_m,k\n");
  while (std::fgets(line, sizeof line, stdin)) {
    ImuIncrement<double> s;
    OdometerTick tick;
    Fix f;
    double std = 0;
    if (std::sscanf(line, "imu %lf %lf %lf %lf %lf %lf %lf %lf", &s.t, &s.dt, &s.dtheta.x,
                    &s.dtheta.y, &s.dtheta.z, &s.dv.x, &s.dv.y, &s.dv.z) == 8) {
      navigator.imu(s);
    } else if (std::sscanf(line, "odo %lf %lf", &tick.t, &tick.value) == 2) {
      navigator.odometer(tick);
    } else if (std::sscanf(line, "fix %lf %lf %lf %lf %lf", &f.t, &f.lat, &f.lon, &f.h, &std) ==
               5) {
      f.lat *= deg, f.lon *= deg;
      f.std_e = f.std_n = f.std_u = std;
      // Late or not: the stamp of its validity is all that it needs.
      if (!navigator.fix(f)) std::fprintf(stderr, "fix of %.3f s: too old\n", f.t);
    } else {
      std::fprintf(stderr, "expected imu, odo or fix with its numbers, found: %s", line);
      return 3;
    }
    if (navigator.t() >= next - 1e-6) {
      const SolutionRow r = navigator.row(FrameId::kGeographic);
      std::printf("%.3f,%.9f,%.9f,%.3f,%.4f,%.3f,%.3f,%.6f\n", r.t, r.lat / deg, r.lon / deg, r.h,
                  r.heading / deg, r.std_e, r.std_n, navigator.state().scale);
      next = std::floor(navigator.t() + 1e-6) + 1.0;
    }
  }
  return 0;
}
