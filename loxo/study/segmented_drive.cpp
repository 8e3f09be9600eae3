// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/estimate/segmented.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/coarse_odometer.hpp"
#include "loxo/study/filter_settings.hpp"
#include "loxo/study/filter_start.hpp"

namespace loxo {

SegmentedResult segmented_drive(const Drive& drive, const FilterOptions& o, const RowSink& sink,
                                Diagnostics& d) {
  if (!drive.imu.present || !drive.odometer.present)
    throw Error(ErrorKind::kInput, "the segmented method needs [imu] and [odometer]", drive.path);
  SegmentedResult out;
  DriveMeasurements m = read_measurements(drive, o, d);
  ImuReader reader(drive, d);
  ImuIncrement<double> sample;
  if (!reader.next(sample))
    throw Error(ErrorKind::kInput, "no IMU sample could be read", drive.imu.file);
  if (m.ticks.size() < 2)
    throw Error(ErrorKind::kInput, "the odometer has fewer than two readings", drive.odometer.file);
  NavigatorConfig settings = settings_of(drive, o, reader.interval(), m.tick_interval,
                                         m.ticks.front().is_speed, m.mean_speed, out.meta);
  coarse_check(drive, m, o, sample.t - sample.dt, settings, out.meta, d);
  const FilterStart start = filter_start(drive, o, settings, m, sample.t - sample.dt, d);
  out.alignment = start.report;

  SegmentedConfig c;
  c.ellipsoid = drive.ellipsoid;
  c.gyro_bias = settings.gyro_bias, c.gyro_noise = settings.gyro_noise;
  c.accel_bias = settings.accel_bias, c.accel_noise = settings.accel_noise;
  c.level_std = 0.003 * deg;
  // A given level owes nothing to the accelerometers: their bias drives the INS from the first
  // second, and phase 1 must expect it.
  for (const char* given : {"state", "attitude", "stored", "in_motion"})
    if (start.report.method == given) c.static_level = false;
  if (!c.static_level) c.c_a = 1;
  c.static_heading = start.report.method == "static";
  c.heading_std = c.static_heading ? std::hypot(start.report.std_noise, start.report.std_sway)
                                   : start.report.heading_std;
  c.scale_std = std::max(settings.scale_std, 0.05);
  c.quantisation = settings.quantisation;
  if (settings.scale_noise > 0) c.scale_noise = settings.scale_noise;
  if (settings.slip_noise > 0) c.slip_noise = settings.slip_noise;
  SegmentedStart s;
  const NominalState& n = start.start.state;
  s.t = n.t;
  s.place = to_geodetic(drive.ellipsoid, n.r);
  const Rot<Geographic, Ecef> C = geographic_axes(s.place.lat, s.place.lon);
  // The declared (or coarsely found) mounting is taken out of the body axes; what is left is the
  // method's to find.
  double se, ce;
  sincos(settings.eps_h, se, ce);
  Rot<Body, Body> R;  // right, forward, up of the declared mounting
  R.m[0][0] = ce, R.m[0][1] = se, R.m[1][0] = -se, R.m[1][1] = ce, R.m[2][2] = 1;
  s.C_nb = C * to_matrix(n.q) * transpose(R);
  const Vec<Geographic> v = C * n.v;
  s.ve = v.x, s.vn = v.y;
  SegmentedNavigator nav(c, s);

  std::size_t i = 0;
  while (i < m.ticks.size() && m.ticks[i].t <= s.t) ++i;
  Vec<Ecef> off;  // weighted less INS position, at the row before
  double last_t = s.t;
  // The method integrates the inertial unit and nothing else: over a gap it has no answer.
  std::uint32_t health = 0, standing = 0;
  long gaps = 0, long_gaps = 0;
  auto use = [&](const OdometerTick& tick) {
    OdometerTick u = tick;
    if (u.is_speed) {  // distance by the trapezoid between stamps
      if (i == 0) return;
      u.value = 0.5 * (m.ticks[i - 1].value + tick.value) * (tick.t - m.ticks[i - 1].t);
      u.is_speed = false;
    }
    u.value /= settings.scale;
    if (!nav.odometer(u)) return;
    const SegmentedEpoch& e = nav.epoch();
    SolutionRow r;
    r.t = e.t;
    r.lat = e.weighted.lat, r.lon = e.weighted.lon, r.h = s.place.h;
    const Rot<Geographic, Ecef> C_ge = geographic_axes(r.lat, r.lon);
    const Rot<Geographic, Body> C_nb = nav.attitude() * R;
    const Quat<Ecef, Body> q = to_quaternion(transpose(C_ge) * C_nb);
    const Euler<double> a = to_euler(C_nb);
    r.heading = a.heading, r.pitch = a.pitch, r.roll = a.roll;
    r.qw = q.w, r.qx = q.x, r.qy = q.y, r.qz = q.z;
    const Point<Ecef> p = to_ecef(drive.ellipsoid, Geodetic<double>{r.lat, r.lon, r.h});
    r.x = p.x, r.y = p.y, r.z = p.z;
    // The INS's velocity, which follows every turn, less the rate at which its position leaves the
    // weighted one.
    const Point<Ecef> ins = to_ecef(drive.ellipsoid, Geodetic<double>{e.ins.lat, e.ins.lon, r.h});
    r.ve = e.ve, r.vn = e.vn;
    if (out.rows > 0 && r.t > last_t) {
      const Vec<Geographic> apart = C_ge * ((p - ins) - off) * (1 / (r.t - last_t));
      r.ve += apart.x, r.vn += apart.y;
    }
    off = p - ins;
    r.std_heading = e.heading_std;
    r.std_e = std::sqrt(std::max(e.weighted.cov[0], 0.0));
    r.std_n = std::sqrt(std::max(e.weighted.cov[2], 0.0));
    r.frame = FrameId::kGeographic;
    if (e.forced) r.health |= kHealthUncovered;
    r.health |= health | standing;
    health = 0;
    last_t = r.t;
    ++out.rows;
    sink(r);
    if (e.switched) {
      out.switch_t = e.t;
      out.forced = e.forced;
    }
    out.last = e;
    if (out.history.empty() || e.t >= out.history.back().t + 10 || e.switched)
      out.history.push_back(e);
  };
  bool more = true;
  double imu_t = s.t;
  for (; more && sample.t <= o.until; more = reader.next(sample)) {
    if (sample.t <= s.t) continue;
    const double hole = sample.t - sample.dt - imu_t;
    if (hole > 2.0 * reader.interval()) {
      ++gaps;
      health |= kHealthGap;
      if (hole > settings.long_gap) ++long_gaps, standing |= kHealthUncovered;
    }
    imu_t = sample.t;
    sample.dtheta = R * sample.dtheta;
    sample.dv = R * sample.dv;
    nav.imu(sample);
    for (; i < m.ticks.size() && m.ticks[i].t <= sample.t; ++i) use(m.ticks[i]);
  }
  if (out.rows == 0)
    throw Error(ErrorKind::kWork,
                fmt::format("the drive ends at t = {:.6g} s, before the first second of the wheel "
                            "after the start at {:.6g} s: no row",
                            imu_t, s.t),
                drive.path);
  if (gaps > 0)
    d.warn("gap", "imu",
           fmt::format("{} gaps of the inertial unit, {} of them above {:.0f} s: this method does "
                       "not bridge them, its sigmas are not to be trusted after them; --mode "
                       "filter does",
                       gaps, long_gaps, settings.long_gap));
  out.k = out.last.k * settings.scale;
  out.eps = wrap_pi(out.last.mu + settings.eps_h);
  if (out.forced)
    d.warn(
        "forced_switch", "segmented",
        fmt::format("the switch rule was not met after {:.0f} s (this INS alone is not good enough "
                    "to calibrate the odometer): switched all the same with the sigma it has; "
                    "--mode filter loses nothing",
                    c.latest));
  if (out.switch_t == 0 || !(out.switch_t > 0))
    d.warn("no_switch", "segmented",
           "the drive ended before the switch: the INS alone was weighted");
  return out;
}

}  // namespace loxo
