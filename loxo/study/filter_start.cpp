// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/drive_alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

bool given(double x) { return x == x; }
double or_else(double x, double other) { return given(x) ? x : other; }

template <class T>
void sort_by_time(std::vector<T>& v, const char* what, Diagnostics& d) {
  long wrong = 0;
  for (std::size_t i = 1; i < v.size(); ++i) wrong += v[i].t < v[i - 1].t;
  if (wrong == 0) return;
  d.warn("out_of_order", what,
         fmt::format("{} rows stand before an earlier one; sorted by time", wrong));
  std::stable_sort(v.begin(), v.end(), [](const T& a, const T& b) { return a.t < b.t; });
}

void check_sigma(double s, const std::string& where) {
  if (given(s) && !(s > 0 && s < 1e8))
    throw Error(ErrorKind::kInput,
                fmt::format("expected a positive standard deviation (below 1e8), found {}", s),
                where);
}

}  // namespace

bool wanted(const FilterOptions& o, const char* name) {
  if (std::find(o.without.begin(), o.without.end(), name) != o.without.end()) return false;
  return o.only.empty() || std::find(o.only.begin(), o.only.end(), name) != o.only.end();
}

double median(std::vector<double> v) {
  if (v.empty()) return kNone;
  const auto mid = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), mid, v.end());
  return *mid;
}

// All measurements but the IMU, in time order of validity.

DriveMeasurements read_measurements(const Drive& drive, const FilterOptions& o, Diagnostics& d) {
  DriveMeasurements m;
  check_sigma(drive.fix_std, drive.fix.where + ".errors.position");
  check_sigma(drive.fix_velocity_std, drive.fix.where + ".errors.velocity");
  check_sigma(drive.heading_std, drive.heading.where + ".errors.heading");
  check_sigma(drive.height_std, drive.height.where + ".errors.height");
  check_sigma(drive.velocity_std, drive.velocity.where + ".errors.velocity");
  if (drive.odometer.present) {
    m.ticks = read_odometer(drive, d);
    std::vector<double> steps;
    bool negative = false;
    for (std::size_t i = 0; i < m.ticks.size(); ++i) {
      if (i > 0 && i < 2000) steps.push_back(m.ticks[i].t - m.ticks[i - 1].t);
      negative = negative || m.ticks[i].value < 0;
    }
    double sum = 0, time = 0;
    for (std::size_t i = 1; i < m.ticks.size(); ++i) {
      const double v = std::fabs(m.ticks[i].value), dt = m.ticks[i].t - m.ticks[i - 1].t;
      if (m.ticks[i].is_speed && v > StandstillConfig{}.wheel_quiet) sum += v * dt, time += dt;
    }
    if (time > 0) m.mean_speed = sum / time;
    m.tick_interval = median(steps);
    m.unsigned_wheel = !negative;
  }
  if (drive.fix.present && wanted(o, "fixes")) {
    m.fixes = read_fixes(drive, d);
    m.fixes_wanted = true;
    std::vector<double> steps, sds;
    long without = 0, replaced = 0;
    for (std::size_t i = 0; i < m.fixes.size(); ++i) {
      Fix& f = m.fixes[i];
      if (i > 0) steps.push_back(f.t - m.fixes[i - 1].t);
      for (double* s : {&f.std_e, &f.std_n, &f.std_u}) {
        if (!(*s > 0)) {
          if (given(drive.fix_std)) {
            *s = drive.fix_std;
            replaced += s == &f.std_e;
          } else {
            *s = 5.0;
            without += s == &f.std_e;
          }
        }
      }
      sds.push_back(f.std_e);
    }
    if (without > 0)
      d.warn("no_covariance", "fix",
             fmt::format("{} fixes carry no standard deviation and the section declares none "
                         "(errors.position): 5 m is taken",
                         without));
    if (replaced > 0)
      d.warn("no_covariance", "fix",
             fmt::format("{} fixes carry no standard deviation (none, nan or 0): the section's "
                         "{:.3g} m is taken",
                         replaced, drive.fix_std));
    m.sparse_fixes = median(steps) >= 60.0;
  }
  m.all_fixes = m.fixes;
  // The thinning that the user asked for.
  std::vector<Fix> kept;
  double last = -1e300;
  for (Fix f : m.fixes) {
    bool out = false;
    for (const auto& [begin, length] : o.outages)
      out = out || (f.t >= begin && f.t < begin + length);
    if (out) continue;
    if (f.t > o.fixes_until || (o.fix_every > 0 && !std::isfinite(o.fixes_until))) {
      if (o.fix_every <= 0 ||
          f.t < std::max(last, std::isfinite(o.fixes_until) ? o.fixes_until : -1e300) + o.fix_every)
        continue;
      f.ve = f.vn = f.vu = kNone;
    }
    last = f.t;
    kept.push_back(f);
  }
  m.fixes = std::move(kept);
  if (wanted(o, "benchmarks"))
    for (const NamedBenchmark& b : drive.benchmarks) {
      if (!given(b.point.t)) continue;
      if (b.point.std < 0)
        throw Error(ErrorKind::kInput, "std of a benchmark must not be negative",
                    "benchmark " + b.name);
      Fix f;
      f.t = b.point.t;
      f.lat = b.point.lat;
      f.lon = b.point.lon;
      f.std_e = f.std_n =
          std::max(b.point.std, 0.05);  // a stamp is never better than a few centimetres of way
      f.std_u = b.point.std_h > 0 ? b.point.std_h : f.std_e;
      f.h = b.point.h != 0 ? b.point.h : kNone;
      m.benchmarks.push_back(f);
    }
  sort_by_time(m.benchmarks, "benchmark", d);
  if (drive.heading.present && wanted(o, "headings")) {
    m.headings = read_headings(drive, d);
  }
  if (drive.height.present && wanted(o, "heights") &&
      (o.vertical.empty() || o.vertical == "external")) {
    m.heights = read_heights(drive, d);
  }
  if (drive.velocity.present && wanted(o, "velocity")) {
    m.velocities = read_velocities(drive, d);
  }
  return m;
}

// A standing start: means of the IMU and their scatter over windows of a second.

// From t0 for at most `duration`; ends before the first three seconds in a row that are clearly not
// at rest; without jolts_end only a turn ends it (`stop` says when it moves off). A second is
// disturbed (a door, a passenger) where it scatters more than six times the median second; such
// seconds count for the mean attitude but not for the noise.
StandingStart standing_start(const Drive& drive, double t0, double duration, double stop,
                             Diagnostics& d, bool jolts_end) {
  struct Second {
    double begin, end, length, vw, vf;
    long n;
    Vec<Body> w, f;  // means
  };
  ImuReader reader(drive, d);
  ImuIncrement<double> s;
  std::vector<Second> all;
  Second q{};
  Vec<Body> sw, sf, f0;
  double ww = 0, ff = 0;
  std::vector<double> sorted_w, sorted_f;
  auto middle = [](const std::vector<double>& v) { return v[v.size() / 2]; };
  auto disturbed = [&](const Second& x) {
    return x.vw > 36 * middle(sorted_w) + 1e-12 || x.vf > 36 * middle(sorted_f) + 1e-10;
  };
  int in_a_row = 0;
  while (reader.next(s)) {
    if (s.t <= t0 || !(s.dt > 0)) continue;
    if (s.t > t0 + duration || s.t > stop) break;
    const Vec<Body> w = s.dtheta * (1 / s.dt), f = s.dv * (1 / s.dt);
    if (q.n == 0) {
      q = Second{};
      q.begin = s.t - s.dt;
      f0 = f;
      sw = sf = {};
      ww = ff = 0;
    }
    ++q.n;
    q.length += s.dt;
    sw += w;
    sf += f - f0;
    ww += dot(w, w);
    ff += dot(f - f0, f - f0);
    if (q.length < 1.0 - 1e-6) continue;
    const double k = 1.0 / static_cast<double>(q.n);
    const Vec<Body> df = sf * k;
    q.w = sw * k;
    q.f = f0 + df;
    q.vw = std::max(0.0, ww * k - dot(q.w, q.w));
    q.vf = std::max(0.0, ff * k - dot(df, df));
    q.end = s.t;
    const bool moves = all.size() >= 5 && ((jolts_end && disturbed(q)) || norm(q.w) > 0.02);
    in_a_row = moves ? in_a_row + 1 : 0;
    sorted_w.insert(std::upper_bound(sorted_w.begin(), sorted_w.end(), q.vw), q.vw);
    sorted_f.insert(std::upper_bound(sorted_f.begin(), sorted_f.end(), q.vf), q.vf);
    all.push_back(q);
    q.n = 0;
    if (in_a_row >= 3) {
      all.resize(all.size() - 3);
      break;
    }
  }
  StandingStart out;
  if (all.empty()) return out;
  out.begin = all.front().begin;
  out.end = all.back().end;
  double quiet_n = 0, sum_w = 0, sum_f = 0, time = 0, v[3]{};
  long quiet = 0;
  for (const Second& x : all) {
    out.samples += x.n;
    out.mean_w += x.w * static_cast<double>(x.n);
    out.mean_f += x.f * static_cast<double>(x.n);
  }
  out.mean_w = out.mean_w * (1.0 / static_cast<double>(out.samples));
  out.mean_f = out.mean_f * (1.0 / static_cast<double>(out.samples));
  Vec<Body> angle;
  std::vector<Vec<Body>> angles;
  for (const Second& x : all) {
    angle += x.w * x.length;
    time += x.length;
    angles.push_back(angle);
    if (disturbed(x)) continue;
    const auto n = static_cast<double>(x.n);
    quiet_n += n;
    sum_w += x.vw * n;
    sum_f += x.vf * n;
    const Vec<Body> e = x.w - out.mean_w;
    v[0] += e.x * e.x, v[1] += e.y * e.y, v[2] += e.z * e.z;
    ++quiet;
  }
  if (quiet > 0) {
    out.sigma_w = std::sqrt(sum_w / (3.0 * quiet_n));
    out.sigma_f = std::sqrt(sum_f / (3.0 * quiet_n));
    for (int i = 0; i < 3; ++i) out.sway[i] = std::sqrt(v[i] / static_cast<double>(quiet));
  }
  double a2 = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double u = static_cast<double>(i + 1) / static_cast<double>(angles.size());
    const Vec<Body> e = angles[i] - angle * u;
    a2 += (e.x * e.x + e.y * e.y) / 2;
  }
  out.sway_angle = std::sqrt(a2 / static_cast<double>(angles.size()));
  return out;
}

namespace {

// Scale and mounting heading of the odometer, coarsely, from how its speed changes with the IMU's
// own acceleration over two seconds: enough to see a wrong unit or an IMU mounted across or
// backward.
struct CoarseOdometer {
  bool found = false;
  double k = 1, k_std = 0, eps = 0, explained = 0;
  int windows = 0;
};
CoarseOdometer coarse_odometer(const Drive& drive, const std::vector<OdometerTick>& ticks,
                               double t0, Diagnostics& d) {
  CoarseOdometer out;
  if (ticks.size() < 10) return out;
  constexpr double kWindow = 2.0;
  ImuReader reader(drive, d);
  ImuIncrement<double> s;
  std::size_t i = 0;
  auto speed_at = [&](double t) {  // mean speed over the second about t
    while (i + 1 < ticks.size() && ticks[i].t < t - 0.5) ++i;
    double sum = 0, weight = 0;
    for (std::size_t j = i; j < ticks.size() && ticks[j].t <= t + 0.5; ++j) {
      if (ticks[j].is_speed) {
        sum += ticks[j].value;
        weight += 1;
      } else if (j > 0) {
        sum += ticks[j].value;
        weight += ticks[j].t - ticks[j - 1].t;
      }
    }
    return weight > 0 ? sum / weight : kNone;
  };
  double begin = kNone, v0 = kNone, x = 0, y = 0, turn = 0, moving = 0;
  struct Row {
    double dv, x, y;
  };
  std::vector<Row> rows;
  while (reader.next(s) && moving < 240) {
    if (s.t < t0) continue;
    if (!given(begin)) {
      begin = s.t;
      v0 = speed_at(s.t);
      x = y = turn = 0;
      continue;
    }
    x += s.dv.x, y += s.dv.y, turn += s.dtheta.z;
    if (s.t < begin + kWindow) continue;
    const double v1 = speed_at(s.t);
    if (given(v0) && given(v1) && std::fabs(turn) < 0.1 &&
        (std::fabs(v0) > 0 || std::fabs(v1) > 0)) {
      rows.push_back({v1 - v0, x, y});
      moving += kWindow;
    }
    begin = s.t, v0 = v1, x = y = turn = 0;
  }
  if (rows.size() < 15) return out;
  Row mean{0, 0, 0};
  for (const Row& r : rows) mean.dv += r.dv, mean.x += r.x, mean.y += r.y;
  const auto n = static_cast<double>(rows.size());
  double xx = 0, xy = 0, yy = 0, xv = 0, yv = 0, vv = 0;
  for (const Row& r : rows) {
    const double v = r.dv - mean.dv / n, a = r.x - mean.x / n, b = r.y - mean.y / n;
    xx += a * a, xy += a * b, yy += b * b, xv += a * v, yv += b * v, vv += v * v;
  }
  // Total along the direction that explains the speed: slope by the axis of the correlation, k =
  // speed change / IMU change.
  const double cx = xv, cy = yv, c = std::hypot(cx, cy);
  if (!(c > 0) || !(vv > 0)) return out;
  const double ux = cx / c, uy = cy / c, uu = ux * ux * xx + 2 * ux * uy * xy + uy * uy * yy,
               uv = ux * xv + uy * yv;
  out.explained = uv * uv / (uu * vv);
  out.k = std::sqrt(vv / uu);
  // Of the slope's scatter, and 2 % for slopes of the road and gravity's part in them.
  out.k_std = out.k * std::sqrt((1 - out.explained) / (out.explained * n) + 4e-4);
  out.eps = std::atan2(-ux, uy);
  out.windows = static_cast<int>(rows.size());
  out.found = out.explained > 0.5 && uu / n > 0.05;  // of the IMU: any unit of the wheel
  return out;
}

}  // namespace

void coarse_check(const Drive& drive, const DriveMeasurements& m, const FilterOptions& o,
                  double first_t, NavigatorConfig& config, std::map<std::string, std::string>& meta,
                  Diagnostics& d) {
  if (config.use_odometer && !o.calibrated) {
    const CoarseOdometer c = coarse_odometer(drive, m.ticks, or_else(drive.start.t, first_t), d);
    if (c.found)
      meta["coarse_odometer"] = fmt::format("k {:.2f}, mounting {:.0f} deg, {:.0f} % explained",
                                            c.k, c.eps / deg, 100 * c.explained);
    if (c.found && std::fabs(wrap_pi(c.eps - config.eps_h)) > 25 * deg) {
      d.warn("mounting", "odometer.mounting",
             fmt::format("the IMU's acceleration says that its forward axis stands {:.0f} deg from "
                         "the vehicle's (declared {:.0f} deg){}: taken as the start value",
                         c.eps / deg, config.eps_h / deg,
                         std::fabs(wrap_pi(c.eps - config.eps_h)) > 150 * deg
                             ? ", or the wheel counts backward"
                             : ""));
      config.eps_h = c.eps;
      config.eps_std = 10 * deg;
    }
    if (c.found && (c.k > 1.4 || c.k < 0.7)) {
      static constexpr std::pair<double, const char*> units[] = {
          {3.6, "km/h read as m/s"},    {1 / 3.6, "m/s read as km/h"},
          {2.23694, "mph read as m/s"}, {1.94384, "knots read as m/s"},
          {1000.0, "mm read as m"},     {100.0, "cm read as m"},
          {0.01, "m read as cm"},       {0.001, "km read as m, or m as mm"},
          {3.28084, "ft read as m"},    {0.3048, "m read as ft"}};
      const char* best = "unit or metres per pulse wrong";
      double nearest = 0.2;
      for (const auto& [factor, text] : units)
        if (std::fabs(std::log(c.k / factor)) < nearest)
          nearest = std::fabs(std::log(c.k / factor)), best = text;
      // One reading after the other: a speed told as a way is its rate times too large.
      const double per_second =
          given(m.tick_interval) && m.tick_interval > 0 ? 1 / m.tick_interval : 0.0;
      if (!m.ticks.front().is_speed && per_second > 1.5 &&
          std::fabs(std::log(c.k / per_second)) < nearest)
        best = "a speed declared as a distance";
      d.bad("odometer_unit", "odometer.units",
            fmt::format("the IMU's acceleration says that the odometer shows {:.3g} times the true "
                        "speed ({}?); taken as the start value",
                        c.k, best));
      config.scale_walk *= c.k / config.scale;
      config.scale = c.k;
      config.scale_std = 0.1 * c.k;
      config.standstill.wheel_quiet *= c.k;  // of what it shows
    } else if (c.found &&
               std::fabs(c.k - config.scale) > 3 * std::hypot(config.scale_std, c.k_std)) {
      d.warn(
          "odometer_scale", "odometer",
          fmt::format("the IMU's acceleration says that the odometer shows {:.2f} times the true "
                      "way (expected {:.2f} +- {:.2f}); taken as the start value, +- {:.2f}",
                      c.k, config.scale, config.scale_std, 2 * c.k_std));
      config.scale_walk *= c.k / config.scale;
      config.scale = c.k;
      config.scale_std = std::max(config.scale_std, 2 * c.k_std);
    }
  }
}

FilterStart filter_start(const Drive& drive, const FilterOptions& o, const NavigatorConfig& config,
                         const DriveMeasurements& m, double first_imu_t, Diagnostics& d) {
  const Ellipsoid& ell = drive.ellipsoid;
  const StartSection& st = drive.start;
  FilterStart b;
  NominalState& s = b.start.state;
  double lat = st.lat, lon = st.lon, h = st.h, pos_std = 1.0;
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
    sigmas.level = 0.05 * deg, sigmas.heading = b.report.heading_std;
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
  sigmas.velocity = a.has_place ? a.velocity_std : at_rest ? 0.02 : 0.05;
  sigmas.position = pos_std;
  sigmas.gyro_scale.x = sigmas.gyro_scale.y = 0;  // only the one about the up axis is driven
  if (o.calibrated && (config.use_odometer || config.use_nhc)) sigmas.eps_p = 2 * deg;
  b.start.P = start_covariance(ell, s, sigmas);
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

NavigatorConfig settings_of(const Drive& drive, const FilterOptions& o, double imu_interval,
                            double odometer_interval, bool odometer_is_speed, double mean_speed,
                            std::map<std::string, std::string>& meta) {
  NavigatorConfig c;
  c.ellipsoid = drive.ellipsoid;
  c.imu_interval = imu_interval;
  c.late_limit = 0;  // a drive's measurements are sorted: nothing is late
  const ImuErrors& e = drive.imu_errors;
  // Undeclared sensors are taken for tactical ones; that is told.
  c.gyro_noise = or_else(e.gyro_noise, 0.1 * deg_per_sqrt_h);
  c.accel_noise = or_else(e.accel_noise, 0.05 * mps_per_sqrt_h);
  c.gyro_bias = or_else(e.gyro_bias, 1.0 * deg_per_h);
  c.accel_bias = or_else(e.accel_bias, 1.0 * mg);
  c.gyro_bias_tau = or_else(e.gyro_bias_tau, 3600.0);
  c.accel_bias_tau = or_else(e.accel_bias_tau, 3600.0);
  c.gyro_scale = or_else(e.gyro_scale, c.gyro_bias < 0.1 * deg_per_h ? 1e-5 : 1e-4);
  c.accel_scale = or_else(e.accel_scale, 0.0);
  c.use_odometer = drive.odometer.present && wanted(o, "odometer");
  c.use_nhc = wanted(o, "nhc") && o.vertical != "ship" &&
              (drive.odometer.present || !drive.velocity.present);
  c.use_zupt = wanted(o, "zupt") && o.vertical != "ship";
  c.use_zaru = wanted(o, "zaru") && o.vertical != "ship";
  const OdometerErrors& oe = drive.odometer_errors;
  c.scale_std = or_else(oe.scale, 0.03);
  c.eps_h = drive.odometer_mounting_heading;
  c.eps_p = drive.odometer_mounting_pitch;
  if (o.calibrated) {
    c.scale = o.k;
    if (given(o.k_std)) c.scale_std = std::max(o.k_std, 1e-6);
    c.eps_h = o.eps;
    if (given(o.eps_std)) c.eps_std = std::max(o.eps_std, 1e-6);
  }
  for (int i = 0; i < 3; ++i) c.lever[i] = drive.odometer_lever[i];
  c.lever_std = drive.odometer_lever_given ? 0.02 : drive.fix.present ? 1.0 : 0.3;
  // The delay is a state where the logger has a clock of its own: a speed over a bus, or five
  // readings a second or fewer.
  const bool own_clock =
      odometer_is_speed || (given(odometer_interval) && odometer_interval >= 0.2);
  if (own_clock && odometer_is_speed) {
    c.tau_std = drive.odometer.delay != 0 ? 0.3 : 0.5;
    c.tau_walk = given(odometer_interval) && odometer_interval >= 0.2 ? 3e-3 : 0.0;
  }
  c.stamp_jitter = odometer_is_speed && given(odometer_interval) && odometer_interval < 0.2 ? 0.02
                   : odometer_is_speed                                                      ? 0.1
                                                                                            : 0.0;
  c.quantisation =
      or_else(oe.quantisation, drive.odometer_kind == "pulses" || drive.odometer_kind == "counter"
                                   ? drive.odometer_scale
                                   : 0.0);
  if (odometer_is_speed && given(oe.speed_quantisation) && mean_speed > 0) {
    // A reading in whole units is rounded (mean error 0) or cut (half a unit too small): one sigma
    // spans both.
    c.speed_quantum = oe.speed_quantisation;
    c.offset_std = 0.5 * oe.speed_quantisation;
    c.offset_speed = mean_speed;
    meta["speed_offset"] =
        fmt::format("a state: +- {:.3g} m/s, k holds at {:.3g} m/s", c.offset_std, c.offset_speed);
  }
  c.scale_noise = or_else(oe.scale_noise, odometer_is_speed ? 0.0 : 1e-3);
  c.slip_noise = or_else(oe.side_slip, 0.0);
  c.nhc_epoch = std::max(0.1, 10 * imu_interval);
  if (!c.use_odometer) {  // nothing but the constraint holds the drive: wide
    c.nhc_side = 0.05;
    c.nhc_up = 0.1;
    c.nhc_turn = 0.1;
  }
  for (int i = 0; i < 3; ++i) c.fix_lever[i] = drive.fix_lever[i];
  c.fix_velocity_std = or_else(drive.fix_velocity_std, 0.1);
  // Constants that are sought only where a drive declares how far off they may be.
  c.fix_lever_std = drive.fix.present ? or_else(drive.fix_lever_std, 0.0) : 0.0;
  c.height_bias_std = drive.height.present ? or_else(drive.height_bias, 0.0) : 0.0;
  // As a walk that makes the declared bias anew in the declared time; without one it lasts.
  if (given(drive.height_bias_tau) && c.height_bias_std > 0)
    c.height_bias_walk = c.height_bias_std * std::sqrt(2 / drive.height_bias_tau);
  c.heading_bias_std =
      drive.heading.present ? or_else(drive.attitude_errors.heading_bias, 0.0) : 0.0;
  c.gyro_misalignment = or_else(e.gyro_misalignment, 0.0);
  c.heading_std = or_else(drive.heading_std, 0.5 * deg);
  c.height_std = or_else(drive.height_std, 5.0);
  c.velocity_std = or_else(drive.velocity_std, 0.1);
  if (o.vertical == "fixed") c.vertical_std = 0.1;
  if (o.vertical == "ship") c.vertical_std = 3.0;
  c.standstill.sigma_w = 3.0 * c.gyro_noise / std::sqrt(imu_interval);
  c.standstill.sigma_f = 3.0 * c.accel_noise / std::sqrt(imu_interval);
  c.product_epoch = std::max(o.output_period > 0 ? o.output_period : imu_interval, 0.1);
  meta["gyro_noise_deg_sqrt_h"] = fmt::format("{:.4g}{}", c.gyro_noise / deg_per_sqrt_h,
                                              given(e.gyro_noise) ? "" : " (assumed)");
  meta["gyro_bias_deg_h"] =
      fmt::format("{:.4g}{}", c.gyro_bias / deg_per_h, given(e.gyro_bias) ? "" : " (assumed)");
  meta["accel_noise_mps_sqrt_h"] = fmt::format("{:.4g}{}", c.accel_noise / mps_per_sqrt_h,
                                               given(e.accel_noise) ? "" : " (assumed)");
  meta["accel_bias_ug"] =
      fmt::format("{:.4g}{}", c.accel_bias / ug, given(e.accel_bias) ? "" : " (assumed)");
  return c;
}

}  // namespace loxo
