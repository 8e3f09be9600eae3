// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/filter_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/ins/alignment.hpp"
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

void check_sigma(double s, const char* key, const std::string& where) {
  if (given(s) && !(s > 0))
    throw Error(ErrorKind::kInput,
                fmt::format("{} must be a positive standard deviation, found {}", key, s), where);
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
  check_sigma(drive.fix_std, "errors.position", "fix");
  check_sigma(drive.fix_velocity_std, "errors.velocity", "fix");
  check_sigma(drive.heading_std, "errors.heading", "heading");
  check_sigma(drive.height_std, "errors.height", "height");
  if (drive.odometer.present) {
    m.ticks = read_odometer(drive, d);
    sort_by_time(m.ticks, "odometer", d);
    std::vector<double> steps;
    bool negative = false;
    for (std::size_t i = 0; i < m.ticks.size(); ++i) {
      if (i > 0 && i < 2000) steps.push_back(m.ticks[i].t - m.ticks[i - 1].t);
      negative = negative || m.ticks[i].value < 0;
    }
    m.tick_interval = median(steps);
    m.unsigned_wheel = !negative;
  }
  if (drive.fix.present && wanted(o, "fixes")) {
    m.fixes = read_fixes(drive, d);
    sort_by_time(m.fixes, "fix", d);
    std::vector<double> steps, sds;
    long without = 0;
    for (std::size_t i = 0; i < m.fixes.size(); ++i) {
      Fix& f = m.fixes[i];
      if (i > 0) steps.push_back(f.t - m.fixes[i - 1].t);
      for (double* s : {&f.std_e, &f.std_n, &f.std_u}) {
        if (given(*s) && *s < 0)
          throw Error(
              ErrorKind::kInput,
              fmt::format("standard deviation of a fix must be positive, found {} at t = {} s", *s,
                          f.t),
              "fix");
        if (!(*s > 0)) {
          if (given(drive.fix_std)) {
            *s = drive.fix_std;
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
    sort_by_time(m.headings, "heading", d);
  }
  if (drive.height.present && wanted(o, "heights") &&
      (o.vertical.empty() || o.vertical == "external")) {
    m.heights = read_heights(drive, d);
    sort_by_time(m.heights, "height", d);
  }
  if (drive.velocity.present && wanted(o, "velocity")) {
    m.velocities = read_velocities(drive, d);
    sort_by_time(m.velocities, "velocity", d);
  }
  return m;
}

// A standing start: means of the IMU and their scatter over windows of a second.

// From t0 for at most `duration`; ends before the first three seconds in a row that are clearly not
// at rest. A second is disturbed (a door, a passenger) where it scatters more than six times the
// median second; such seconds count for the mean attitude but not for the noise.
StandingStart standing_start(const Drive& drive, double t0, double duration, double stop,
                             Diagnostics& d) {
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
    const bool moves = all.size() >= 5 && (disturbed(q) || norm(q.w) > 0.02);
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
  double k = 1, eps = 0, explained = 0;
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
  out.eps = std::atan2(-ux, uy);
  out.windows = static_cast<int>(rows.size());
  out.found = out.explained > 0.5 && vv / n > 0.05;
  return out;
}

// The gyros' turn of heading from t0 to t1 at rest-level attitude: for the two-step alignment
// (4.4).
struct CourseBack {
  bool found = false;
  double heading = 0, t = 0;
};
CourseBack course_back(const Drive& drive, const StandingStart& rest, double lat,
                       const std::vector<Fix>& fixes, Diagnostics& d) {
  CourseBack out;
  // Attitude relative to the level frame with heading 0 at the end of the standstill.
  const Vec<Body> up = rest.mean_f * (1 / norm(rest.mean_f));
  Rot<Geographic, Body> C;
  const Vec<Body> fwd = Vec<Body>{0, 1, 0} - up * up.y;
  const Vec<Body> n = fwd * (1 / norm(fwd)), e = cross(n, up);
  const Vec<Body>* rows[3] = {&e, &n, &up};
  for (int i = 0; i < 3; ++i)
    C.m[i][0] = rows[i]->x, C.m[i][1] = rows[i]->y, C.m[i][2] = rows[i]->z;
  Quat<Geographic, Body> q = to_quaternion(C);
  (void)lat;
  const Vec<Body> bias = rest.mean_w;  // standing: everything the gyros show, Earth rate included
  ImuReader reader(drive, d);
  ImuIncrement<double> s;
  std::size_t i = 0;
  while (reader.next(s)) {
    if (s.t <= rest.end) continue;
    q = normalized(q * exp_rotation<Body, Body>(s.dtheta - bias * s.dt));
    while (i < fixes.size() && fixes[i].t < s.t - s.dt) ++i;
    if (i < fixes.size() && fixes[i].t <= s.t && given(fixes[i].ve) && given(fixes[i].vn)) {
      const double speed = std::hypot(fixes[i].ve, fixes[i].vn);
      if (speed > 5.0) {
        const Rot<Geographic, Body> A = to_matrix(q);
        const double relative = std::atan2(A.m[0][1], A.m[1][1]);
        out.found = true;
        out.heading = wrap_2pi(std::atan2(fixes[i].ve, fixes[i].vn) - relative);
        out.t = fixes[i].t;
        return out;
      }
    }
    if (s.t > rest.end + 600) break;
  }
  return out;
}

Rot<Geographic, Body> level_attitude(const Vec<Body>& up, double heading) {
  // Level from the specific force; heading of the forward axis as given.
  const Vec<Body> u = up * (1 / norm(up));
  const Vec<Body> f = Vec<Body>{0, 1, 0} - u * u.y;
  const Vec<Body> n0 = f * (1 / norm(f)), e0 = cross(n0, u);
  const double s = std::sin(heading), c = std::cos(heading);
  // Forward = s E + c N: E = c e0' ...: e0, n0 are right and forward levelled.
  const Vec<Body> e = e0 * c + n0 * s, n = n0 * c - e0 * s;
  Rot<Geographic, Body> C;
  const Vec<Body>* rows[3] = {&e, &n, &u};
  for (int i = 0; i < 3; ++i)
    C.m[i][0] = rows[i]->x, C.m[i][1] = rows[i]->y, C.m[i][2] = rows[i]->z;
  return C;
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
                         "the vehicle's (declared {:.0f} deg): taken as the start value",
                         c.eps / deg, config.eps_h / deg));
      config.eps_h = c.eps;
      config.eps_std = 10 * deg;
    }
    if (c.found && (c.k > 1.4 || c.k < 0.7)) {
      static constexpr std::pair<double, const char*> units[] = {
          {3.6, "km/h read as m/s"},    {1 / 3.6, "m/s read as km/h"},
          {2.23694, "mph read as m/s"}, {1.94384, "knots read as m/s"},
          {1000.0, "mm read as m"},     {100.0, "cm read as m"},
          {0.01, "m read as cm"},       {0.001, "m read as mm"},
          {0.3048, "ft read as m"},     {3.28084, "m read as ft"}};
      const char* best = "unit or metres per pulse wrong";
      double nearest = 0.2;
      for (const auto& [factor, text] : units)
        if (std::fabs(std::log(c.k / factor)) < nearest)
          nearest = std::fabs(std::log(c.k / factor)), best = text;
      d.bad("odometer_unit", "odometer.units",
            fmt::format("the IMU's acceleration says that the odometer shows {:.3g} times the true "
                        "speed ({}?); taken as the start value",
                        c.k, best));
      config.scale = c.k;
      config.scale_std = 0.1 * c.k;
      config.scale_walk *= c.k;
    }
  }
}

namespace {

// The inertial-frame method over (begin, end]; t: where it ended.
struct FollowedStart {
  InertialFrameAlignment alignment;
  double t;
};
FollowedStart followed_start(const Drive& drive, double lat, double h, double begin, double end) {
  Diagnostics told_before;
  ImuReader reader(drive, told_before);
  FollowedStart out{{lat, drive.ellipsoid.w_ie, normal_gravity(drive.ellipsoid, std::sin(lat), h)},
                    begin};
  for (ImuIncrement<double> s; reader.next(s) && s.t <= end + 1e-9;) {
    if (s.t - s.dt < begin - 1e-9 || !(s.dt > 0)) continue;
    out.alignment.add(s);
    out.t = s.t;
  }
  return out;
}

// Below it the velocities are too short and the means are used (estimation.md 4.2).
constexpr double kShortestFollowed = 100.0;  // s

}  // namespace

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
  Covariance<kStates>& P = b.start.P;

  if (st.has_state) {
    t0 = std::max(or_else(st.state_t, t0), first_imu_t);
    s.r = {st.r[0], st.r[1], st.r[2]};
    s.v = {st.v[0], st.v[1], st.v[2]};
    s.q = normalized(Quat<Ecef, Body>{st.q[0], st.q[1], st.q[2], st.q[3]});
    s.t = t0;
    b.report.method = "state";
    b.report.heading_std = or_else(st.heading_std, 0.1 * deg);
    alignment_covariance(ell, s, config.gyro_bias, config.accel_bias, 0.05 * deg,
                         b.report.heading_std, false, P);
  } else {
    const Rot<Geographic, Ecef> C_ge = geographic_axes(lat, lon);
    s.r = to_ecef(ell, Geodetic<double>{lat, lon, h});
    const bool moving_start = given(st.ve) || given(st.vn);
    const bool attitude = given(st.heading) && !st.alignment_kind;
    double until = 1e300;  // the wheel or a fix says that it moves
    for (const OdometerTick& k : m.ticks)
      if (k.t > t0 && std::fabs(k.value) > (k.is_speed ? 0.2 : 0.02)) {
        until = std::min(until, k.t - 2.0);
        break;
      }
    for (const Fix& f : m.fixes)
      if (f.t > t0 && given(f.ve) && std::hypot(f.ve, f.vn) > 1.0) {
        until = std::min(until, f.t - 2.0);
        break;
      }
    const double duration = or_else(st.alignment_duration, attitude ? 300.0 : 300.0);
    if (!moving_start) b.rest = standing_start(drive, t0, duration, until, d);
    double T = b.rest.end - b.rest.begin;
    double slat, clat;
    sincos(lat, slat, clat);
    const double wn = ell.w_ie * clat;
    if (attitude) {
      // Heading given; level from the standstill where there is one, else as given.
      const bool level = !given(st.pitch) && b.rest.samples > 0 && T > 5;
      Rot<Geographic, Body> C_nb =
          level ? level_attitude(b.rest.mean_f, st.heading)
                : to_matrix<Geographic>(
                      Euler<double>{st.heading, or_else(st.pitch, 0), or_else(st.roll, 0)});
      s.q = to_quaternion(transpose(C_ge) * C_nb);
      s.t = level ? b.rest.end : t0;
      b.report.method = "attitude";
      b.report.heading = st.heading;
      b.report.heading_std = or_else(st.heading_std, 0.1 * deg);
      s.v = transpose(C_ge) *
            Vec<Geographic>{or_else(st.ve, 0), or_else(st.vn, 0), or_else(st.vu, 0)};
      alignment_covariance(ell, s, config.gyro_bias, level ? config.accel_bias : 0.0,
                           level ? 0.003 * deg : 0.1 * deg, b.report.heading_std, false, P);
      for (int i = 0; i < 3; ++i) P.p[kBa + i][kBa + i] = config.accel_bias * config.accel_bias;
    } else {
      if (b.rest.samples == 0 || T < 10)
        throw Error(ErrorKind::kWork,
                    fmt::format("static alignment from t = {:.1f} s: only {:.1f} s at rest were "
                                "found, at least 10 s are needed; give [start] attitude and "
                                "velocity, or another start time",
                                t0, T),
                    "start.alignment");
      // 4.1: u = f, e = w x f, n = u x e; the level is trusted, the heading is the gyros'.
      const Vec<Body> u = b.rest.mean_f * (1 / norm(b.rest.mean_f));
      const Vec<Body> e0 = cross(b.rest.mean_w, u);
      b.report.std_gyro = config.gyro_bias / wn;
      b.report.std_noise = config.gyro_noise / (std::sqrt(T) * wn);
      b.report.std_sway = std::sqrt(2.0) * b.rest.sway_angle / (T * wn);
      double sigma = std::hypot(b.report.std_gyro, b.report.std_noise, b.report.std_sway);
      const Vec<Body> e = e0 * (1 / norm(e0)), n = cross(u, e);
      double heading = wrap_2pi(std::atan2(e.y, n.y));
      b.report.method = "static";
      // 4.2: the gyros follow the base; a swaying one gives its level as well, at rest the mean is
      // better.
      const bool swaying = st.alignment_kind && *st.alignment_kind == "swaying";
      const double end = swaying ? std::min(t0 + duration, until) : b.rest.end;
      Rot<Geographic, Body> level{};
      double level_std = 0.003 * deg, end_t = b.rest.end;
      if (end - b.rest.begin >= kShortestFollowed) {
        const FollowedStart f = followed_start(drive, lat, h, b.rest.begin, end);
        const HeadingSigma s0 =
            f.alignment.sigma({config.gyro_bias, config.gyro_noise, config.accel_noise});
        if (f.alignment.duration() >= kShortestFollowed &&
            (swaying || s0.total() < kRefusedHeading)) {
          T = f.alignment.duration();
          b.report.std_gyro = s0.gyro_bias;
          b.report.std_noise = std::hypot(s0.gyro_noise, s0.accel_noise);
          b.report.std_sway = s0.sway;
          sigma = s0.total();
          level = f.alignment.attitude();
          heading = to_euler(level).heading;
          end_t = swaying ? f.t : end_t;
          level_std = std::hypot(level_std, swaying ? 0.25 * config.gyro_bias * T : 0.0);
          b.report.method = "inertial_frame";
        }
      } else if (swaying) {
        throw Error(ErrorKind::kWork,
                    fmt::format("alignment on a swaying base needs {:.0f} s, found {:.1f} s",
                                kShortestFollowed, end - b.rest.begin),
                    "start.alignment");
      }
      b.report.heading_std = sigma;
      bool from_gyros = true;
      if (given(st.heading)) {  // a stored heading beside the static level
        heading = st.heading;
        b.report.method = "stored";
        b.report.heading_std = or_else(st.heading_std, 3.0 * deg);
        from_gyros = false;
      } else if (!(sigma < 5.0 * deg)) {
        const CourseBack c = course_back(drive, b.rest, lat, m.fixes, d);
        if (c.found) {
          heading = c.heading;
          b.report.method = "two_step";
          b.report.heading_std = 3.0 * deg;
          b.report.note = fmt::format(
              "the gyros alone would give {:.1f} deg; heading from the course of the fix at t = "
              "{:.1f} s, carried back by the gyros",
              sigma / deg, c.t);
          from_gyros = false;
        } else if (!o.force) {
          throw Error(
              ErrorKind::kWork,
              fmt::format(
                  "static alignment would know the heading to {:.1f} deg only (gyro bias {:.3g} "
                  "deg/h: {:.1f} deg, noise and sway over {:.0f} s: "
                  "{:.2f} deg, latitude {:.2f} deg). Give [start] attitude with heading_std, two "
                  "fixes with velocity, or --force to go on with that sigma",
                  sigma / deg, config.gyro_bias / deg_per_h, b.report.std_gyro / deg, T,
                  std::hypot(b.report.std_noise, b.report.std_sway) / deg, lat / deg),
              "start.alignment");
        } else {
          b.report.note = "poor heading, continued by --force with its own sigma";
        }
      }
      b.report.heading = heading;
      const bool followed = swaying && b.report.method == "inertial_frame";
      s.q = to_quaternion(transpose(C_ge) *
                          (followed ? level : level_attitude(b.rest.mean_f, heading)));
      s.t = end_t;
      const double random =
          from_gyros ? std::hypot(b.report.std_noise, b.report.std_sway) : b.report.heading_std;
      alignment_covariance(ell, s, config.gyro_bias, config.accel_bias, level_std, random,
                           from_gyros, P);
      // At rest on a known place the mean rate less Earth's is the bias; that is the filter's work
      // (ZARU), not done twice.
    }
    b.report.duration = T;
  }
  const bool at_rest = !given(st.ve) && !st.has_state;
  for (int i = 0; i < 3; ++i) {
    P.p[kDv + i][kDv + i] = at_rest ? 0.02 * 0.02 : 0.05 * 0.05;
    P.p[kDr + i][kDr + i] = pos_std * pos_std;
    P.p[kSa + i][kSa + i] = config.accel_scale * config.accel_scale;
    P.p[kLever + i][kLever + i] = config.lever_std * config.lever_std;
  }
  P.p[kSg + 2][kSg + 2] =
      config.gyro_scale * config.gyro_scale;  // about the up axis: the others are not driven
  if (config.use_odometer) {
    P.p[kScale][kScale] = config.scale_std * config.scale_std;
    P.p[kTau][kTau] = config.tau_std * config.tau_std;
  }
  if (config.use_odometer || config.use_nhc) {
    P.p[kEpsH][kEpsH] = config.eps_std * config.eps_std;
    P.p[kEpsP][kEpsP] = o.calibrated ? 4 * deg * deg : config.eps_std * config.eps_std;
  }
  s.scale = config.scale;
  s.eps_h = config.eps_h;
  s.eps_p = config.eps_p;
  s.lever = {config.lever[0], config.lever[1], config.lever[2]};
  s.tau = config.tau;
  return b;
}

NavigatorConfig settings_of(const Drive& drive, const FilterOptions& o, double imu_interval,
                            double odometer_interval, bool odometer_is_speed,
                            std::map<std::string, std::string>& meta) {
  NavigatorConfig c;
  c.ellipsoid = drive.ellipsoid;
  c.imu_interval = imu_interval;
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
    c.scale_std = std::max(o.k_std, 1e-6);
    c.eps_h = o.eps;
    c.eps_std = std::max(o.eps_std, 1e-6);
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
