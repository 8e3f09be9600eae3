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
#include "loxo/study/output_raster.hpp"

namespace loxo {
namespace {

// m from a pole: here the two tracks, kept as latitude and longitude, no longer tell how they lie
// to each other.
constexpr double kPoleNear = 5000;

}  // namespace

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
  take_scatter(m.scatter, m.mean_way * m.tick_interval, settings, out.meta, d);
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
  if (!c.static_level) {
    c.c_a = 1;
    c.given_level_std = or_else(drive.start.level_std, 0.0);
    c.given_velocity_std = or_else(drive.start.velocity_std, 0.0);
  }
  c.static_heading = start.report.method == "static";
  c.heading_std = c.static_heading ? std::hypot(start.report.std_noise, start.report.std_sway)
                                   : start.report.heading_std;
  c.scale_std = std::max(settings.scale_std, 0.05);
  c.quantisation = settings.quantisation;
  // Of a second, from those of a reading.
  const double readings = std::clamp(1 / m.tick_interval, 1.0, 1e3);  // equal stamps: no rate
  if (settings.scale_noise > 0) c.scale_noise = settings.scale_noise / std::sqrt(readings);
  c.way_noise = std::sqrt(readings * settings.reading_noise * settings.reading_noise +
                          m.mean_way * settings.way_noise * settings.way_noise);
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
  c.lever = R * n.lever;
  const Vec<Geographic> v = C * n.v;
  s.ve = v.x, s.vn = v.y;
  SegmentedNavigator nav(c, s);

  std::size_t i = 0;
  while (i < m.ticks.size() && m.ticks[i].t <= s.t) ++i;
  Vec<Ecef> off, drift;  // weighted less INS position at the last epoch, and the rate of that
  double last_t = s.t, nearest_pole = 1e9;
  // The method integrates the inertial unit and nothing else: over a gap it has no answer.
  std::uint32_t health = 0, standing = 0;
  long gaps = 0, long_gaps = 0;
  bool begun = false;
  const auto level = [&](Geodetic<double> g) {  // on the start's height
    g.h = s.place.h;
    return to_ecef(drive.ellipsoid, g);
  };
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
    const Vec<Ecef> now =
        level({e.weighted.lat, e.weighted.lon, 0}) - level({e.ins.lat, e.ins.lon, 0});
    if (begun && e.t > last_t) drift = (now - off) * (1 / (e.t - last_t));
    off = now;
    last_t = e.t;
    begun = true;
    if (e.forced) health |= kHealthUncovered;
    nearest_pole = std::min(nearest_pole, drive.ellipsoid.a * std::cos(e.weighted.lat));
    if (nearest_pole < kPoleNear) standing |= kHealthUncovered;
    if (e.switched) {
      out.switch_t = e.t;
      out.forced = e.forced;
    }
    out.last = e;
    if (out.history.empty() || e.t >= out.history.back().t + 10 || e.switched)
      out.history.push_back(e);
  };
  // Between two epochs: the INS's way since the last one on the position weighted there.
  auto emit = [&](double t, double age) {
    const SegmentedEpoch& e = out.last;
    const Point<Ecef> ins = level(to_geodetic(drive.ellipsoid, nav.ins() - nav.velocity() * age));
    const Geodetic<double> at = to_geodetic(drive.ellipsoid, ins + off);
    SolutionRow r;
    r.t = t;
    r.lat = at.lat, r.lon = at.lon, r.h = s.place.h;
    const Rot<Geographic, Ecef> C_ge = geographic_axes(r.lat, r.lon);
    const Rot<Geographic, Body> C_nb = nav.attitude() * R;
    const Quat<Ecef, Body> q = to_quaternion(transpose(C_ge) * C_nb);
    const Euler<double> a = to_euler(C_nb);
    r.heading = a.heading, r.pitch = a.pitch, r.roll = a.roll;
    r.qw = q.w, r.qx = q.x, r.qy = q.y, r.qz = q.z;
    const Point<Ecef> p = level(at);
    r.x = p.x, r.y = p.y, r.z = p.z;
    // The INS's velocity, which follows every turn, and the rate at which the weighted position
    // leaves its own.
    const Vec<Geographic> speed = C_ge * (nav.velocity() + drift);
    r.ve = speed.x, r.vn = speed.y;
    r.std_heading = e.heading_std;
    // The method knows the way from the start; where that was is another matter.
    const double place = start.report.position_std * start.report.position_std;
    r.std_e = std::sqrt(std::max(e.weighted.cov[0], 0.0) + place);
    r.std_n = std::sqrt(std::max(e.weighted.cov[2], 0.0) + place);
    r.frame = FrameId::kGeographic;
    r.health = health | standing;
    health = 0;
    ++out.rows;
    sink(r);
  };
  OutputRaster raster(o.output_period, s.t);
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
    if (!raster.on() && begun) emit(nav.t(), 0);
    for (; raster.on() && raster.at() <= nav.t() + 1e-9; raster.advance())
      if (begun) emit(raster.at(), nav.t() - raster.at());
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
  if (nearest_pole < kPoleNear)
    d.warn("near_pole", "segmented",
           fmt::format("{:.0f} m from a pole: this method reckons in latitude and longitude, its "
                       "sigmas are not to be trusted from {:.0f} km on; --mode filter crosses it",
                       std::max(nearest_pole, 0.0), kPoleNear / 1000));
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
