// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/drive_alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
FilterStart filter_start(const Drive& drive, const FilterOptions& o, const NavigatorConfig& config,
                         const DriveMeasurements& m, double first_imu_t, Diagnostics& d) {
  const Ellipsoid& ell = drive.ellipsoid;
  const StartSection& st = drive.start;
  FilterStart b;
  NominalState& s = b.start.state;
  double lat = st.lat, lon = st.lon, h = st.h, pos_std = or_else(st.position_std, 1.0);
  double t0 = or_else(st.t, first_imu_t);
  if (t0 < first_imu_t - 60)
    throw Error(ErrorKind::kInput,
                fmt::format("the start at t = {} s lies before the first IMU sample at {} s", t0,
                            first_imu_t),
                "start.t_s");
  t0 = std::max(t0, first_imu_t);
  if (!given(lat)) {
    const Fix* best = nullptr;
    for (const Fix& f : m.all_fixes)
      if (f.t >= t0 - 2.0) {
        best = &f;
        break;
      }
    if (!drive.benchmarks.empty()) {
      const Benchmark& p = drive.benchmarks.front().point;
      lat = p.lat, lon = p.lon, h = p.h, pos_std = std::max(p.std, 0.05);
    } else if (best) {
      lat = best->lat, lon = best->lon, h = best->h;
      pos_std = std::max({best->std_e, best->std_n, config.fix_std_min});
    } else if (!st.has_state) {
      throw Error(ErrorKind::kInput,
                  "no start position: neither [start] with lat_deg and lon_deg, nor a "
                  "[[benchmark]], nor a fix",
                  "start");
    }
  }
  h = or_else(h, 0.0);
  DriveAlignment a;
  StartSigmas sigmas = start_sigmas(config);

  if (st.has_state) {
    t0 = std::max(or_else(st.state_t, t0), first_imu_t);
    s.r = {st.r[0], st.r[1], st.r[2]};
    s.v = {st.v[0], st.v[1], st.v[2]};
    s.q = normalized(Quat<Ecef, Body>{st.q[0], st.q[1], st.q[2], st.q[3]});
    s.t = t0;
    b.report.method = "state";
    b.report.heading = solution_row(ell, s.t, s.r, s.v, s.q).heading;
    b.report.heading_std = or_else(st.heading_std, 0.1 * deg);
    // A given level owes nothing to the accelerometers: their biases are all to come.
    sigmas.static_level = false;
    sigmas.level = or_else(st.level_std, 0.05 * deg), sigmas.heading = b.report.heading_std;
    pos_std = or_else(st.position_std, pos_std);
  } else {
    a = align_drive(drive, o, config, m, {lat, lon, h}, t0, d);
    if (a.has_place) lat = a.place.lat, lon = a.place.lon, h = a.place.h, pos_std = a.place_std;
    const Rot<Geographic, Ecef> C_ge = geographic_axes(lat, lon);
    s.r = to_ecef(ell, Geodetic<double>{lat, lon, h});
    s.v = transpose(C_ge) * a.v;
    s.q = to_quaternion(transpose(C_ge) * a.C_nb);
    s.t = a.t;
    b.rest = a.rest;
    b.report = a.report;
    sigmas.static_level = a.level_from_accel, sigmas.static_heading = a.from_gyros;
    sigmas.level = a.level_std, sigmas.heading = a.heading_random;
  }
  const bool at_rest = !given(st.ve) && !st.has_state && !a.has_place;
  sigmas.velocity = a.has_place ? a.velocity_std : at_rest ? 0.02 : or_else(st.velocity_std, 0.05);
  sigmas.position = pos_std;
  sigmas.gyro_scale.x = sigmas.gyro_scale.y = 0;  // only the one about the up axis is driven
  if (o.calibrated && (config.use_odometer || config.use_nhc)) sigmas.eps_p = 2 * deg;
  b.start.P = start_covariance(ell, s, sigmas);
  b.report.position_std = sigmas.position;
  s.scale = config.scale;
  s.eps_h = config.eps_h;
  s.eps_p = config.eps_p;
  s.lever = {config.lever[0], config.lever[1], config.lever[2]};
  s.tau = config.tau;
  s.offset_speed = config.offset_std > 0 ? config.offset_speed : 0.0;
  if (given(a.refine_until)) {
    refine_start(drive, config, a, b.start);
    b.report = a.report;
  }
  return b;
}

}  // namespace loxo
