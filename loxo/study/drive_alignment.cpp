// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/drive_alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/estimate/alignment.hpp"
#include "loxo/ins/alignment.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/rotation_forms.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// Below it the velocities are too short and the means are used (estimation.md 4.2).
constexpr double kShortestFollowed = 100.0;  // s
constexpr double kShortestRest = 10.0;       // s
constexpr double kCourseSpeed = 5.0;         // m/s: a course from a velocity
constexpr double kCourseStd = 3 * deg;       // between course and heading, estimation.md 4.4
constexpr double kStraight = 3 * deg;        // of turn between two looks at the course
constexpr double kFixBase = 500;             // sigmas between two fixes that give a course (4.5)
constexpr double kLevelInMotion = 0.5 * deg;
constexpr double kStoredStd = 3 * deg;
constexpr double kPoorLatitude = 5;  // sigmas between the latitude given and that found

// Level from the specific force; heading of the forward axis as given.
Rot<Geographic, Body> level_attitude(const Vec<Body>& up, double heading) {
  const Vec<Body> u = up * (1 / norm(up));
  const Vec<Body> f = Vec<Body>{0, 1, 0} - u * u.y;
  const Vec<Body> n0 = f * (1 / norm(f)), e0 = cross(n0, u);  // forward and right, levelled
  const double s = std::sin(heading), c = std::cos(heading);
  return from_axes<Geographic>(e0 * c + n0 * s, n0 * c - e0 * s, u);
}

// The gyros' turn of heading from the standstill to the first course: two-step alignment (4.4).
struct CourseBack {
  bool found = false;
  double heading = 0, t = 0;
};
CourseBack course_back(const Drive& drive, const StandingStart& rest, const std::vector<Fix>& fixes,
                       Diagnostics& d) {
  CourseBack out;
  Quat<Geographic, Body> q = to_quaternion(level_attitude(rest.mean_f, 0));
  const Vec<Body> bias = rest.mean_w;  // standing: everything the gyros show, Earth rate included
  ImuReader reader(drive, d);
  ImuIncrement<double> s;
  std::size_t i = 0;
  while (reader.next(s)) {
    if (s.t <= rest.end) continue;
    q = normalized(q * exp_rotation<Body, Body>(s.dtheta - bias * s.dt));
    while (i < fixes.size() && fixes[i].t < s.t - s.dt) ++i;
    if (i < fixes.size() && fixes[i].t <= s.t && given(fixes[i].ve) && given(fixes[i].vn)) {
      if (std::hypot(fixes[i].ve, fixes[i].vn) > kCourseSpeed) {
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

// Course, level and velocity on the way, from two fixes between which the vehicle hardly turned.
struct OnTheWay {
  bool found = false;
  double heading = 0, std = 0;
  Vec<Body> up;
  Vec<Geographic> v;
  Fix fix;
  bool by_velocity = false;
};
OnTheWay on_the_way(const Drive& drive, const Ellipsoid& ell, const std::vector<Fix>& fixes,
                    double t0, Diagnostics& d) {
  struct Look {
    const Fix* fix;
    double turn, turn_low, turn_high;  // of heading since the start; extremes since the last look
    Vec<Body> dv;                      // since the start
  };
  OnTheWay out;
  std::vector<Look> looks;
  ImuReader reader(drive, d);
  ImuIncrement<double> s;
  std::size_t i = 0;
  while (i < fixes.size() && fixes[i].t < t0) ++i;
  double turn = 0, low = 0, high = 0;
  Vec<Body> dv;
  auto use = [&](const Look& a, const Look& b, bool by_velocity, double course, double std) {
    const double dt = b.fix->t - a.fix->t;
    const auto p = to_ecef(ell, Geodetic<double>{a.fix->lat, a.fix->lon, 0}),
               q = to_ecef(ell, Geodetic<double>{b.fix->lat, b.fix->lon, 0});
    const auto v = geographic_axes(b.fix->lat, b.fix->lon) * ((q - p) * (1 / dt));
    out.v = by_velocity ? Vec<Geographic>{b.fix->ve, b.fix->vn, or_else(b.fix->vu, 0)}
                        : Vec<Geographic>{v.x, v.y, 0};
    Vec<Body> f = (b.dv - a.dv) * (1 / dt);
    if (by_velocity) {  // what the speed and the course changed is no gravity
      const double along =
          (std::hypot(b.fix->ve, b.fix->vn) - std::hypot(a.fix->ve, a.fix->vn)) / dt;
      const double rate = (b.turn - a.turn) / dt;  // counter-clockwise
      f = f - Vec<Body>{-rate * std::hypot(b.fix->ve, b.fix->vn), along, 0};
    }
    out.up = f;
    // The mean course holds in the middle: half of the turn is to come.
    out.heading = wrap_2pi(course - (by_velocity ? 0.0 : 0.5 * (b.turn - a.turn)));
    out.std = std;
    out.fix = *b.fix;
    out.by_velocity = by_velocity;
    out.found = true;
  };
  while (reader.next(s) && i < fixes.size() && !out.found) {
    if (s.t <= t0) continue;
    turn += s.dtheta.z;
    dv += s.dv;
    low = std::min(low, turn), high = std::max(high, turn);
    if (fixes[i].t > s.t) continue;
    while (i + 1 < fixes.size() && fixes[i + 1].t <= s.t) ++i;
    const Look b{&fixes[i++], turn, low, high, dv};
    low = high = turn;
    double lowest = b.turn_low, highest = b.turn_high;
    for (auto a = looks.rbegin(); a != looks.rend() && !out.found; ++a) {
      const Fix &p = *a->fix, &q = *b.fix;
      lowest = std::min(lowest, a->turn), highest = std::max(highest, a->turn);
      if (highest - lowest > kStraight || q.t - p.t > 120) break;
      const double v0 = std::hypot(p.ve, p.vn), v1 = std::hypot(q.ve, q.vn);
      if (v0 > kCourseSpeed && v1 > kCourseSpeed && q.t - p.t >= 0.2) {
        use(*a, b, true, std::atan2(q.ve, q.vn), kCourseStd);
      } else if (!given(v1)) {
        const auto e =
            geographic_axes(q.lat, q.lon) * (to_ecef(ell, Geodetic<double>{q.lat, q.lon, 0}) -
                                             to_ecef(ell, Geodetic<double>{p.lat, p.lon, 0}));
        const double way = std::hypot(e.x, e.y),
                     sd = std::hypot(std::max(p.std_e, p.std_n), std::max(q.std_e, q.std_n));
        if (way >= kFixBase * std::max(p.std_e, q.std_e) && way > kCourseSpeed * (q.t - p.t))
          use(*a, b, false, std::atan2(e.x, e.y), std::hypot(kCourseStd, sd / way));
      }
      lowest = std::min(lowest, a->turn_low), highest = std::max(highest, a->turn_high);
    }
    looks.push_back(b);
  }
  return out;
}

// The inertial-frame method over (begin, end]; t: where it ended.
struct FollowedStart {
  InertialFrameAlignment alignment;
  double t;
};
FollowedStart followed_start(const Drive& drive, const Geodetic<double>& at, double begin,
                             double end) {
  Diagnostics told_before;
  ImuReader reader(drive, told_before);
  FollowedStart out{
      {at.lat, drive.ellipsoid.w_ie, normal_gravity(drive.ellipsoid, std::sin(at.lat), at.h)},
      begin};
  for (ImuIncrement<double> s; reader.next(s) && s.t <= end + 1e-9;) {
    if (s.t - s.dt < begin - 1e-9 || !(s.dt > 0)) continue;
    out.alignment.add(s);
    out.t = s.t;
  }
  return out;
}

// Until when it stands, by the wheel and the fixes [s]; 1e300 where neither can say.
double moves_at(const DriveMeasurements& m, double t0) {
  double until = 1e300;
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
  if (until > 1e299 && !m.ticks.empty()) until = m.ticks.back().t;  // it never moves
  return until;
}

// estimation.md 4.5: the two terms, the latitude, and what would help.
std::string refusal(double sigma, const NavigatorConfig& config, const AlignmentReport& r,
                    double lat, double T) {
  const double wn = config.ellipsoid.w_ie * std::cos(lat);
  std::string text = fmt::format(
      "this alignment would know the heading to {:.3g} deg only (gyro bias {:.3g} deg/h: {:.3g} "
      "deg; noise and sway over {:.0f} s: {:.3g} deg): at latitude {:.4f} deg the Earth turns by "
      "{:.3g} deg/h about north. ",
      sigma / deg, config.gyro_bias / deg_per_h, r.std_gyro / deg, T,
      std::hypot(r.std_noise, r.std_sway) / deg, lat / deg, wn / deg_per_h);
  const double limit = latitude_limit(config.gyro_bias, config.ellipsoid.w_ie, kRefusedHeading);
  text += limit > 0 ? fmt::format("With these gyros 5 deg are had up to latitude {:.2f} deg. ",
                                  limit / deg)
                    : "These gyros find no heading at any latitude. ";
  return text +
         "Needed instead: [start] attitude = { heading, heading_std } (stored or from another "
         "instrument), state = { … } from another INS, alignment = { kind = \"in-motion\" } with "
         "fixes; or --force to go on with that sigma";
}

// Heading, level and their sigmas from the standstill; what the kinds at rest share.
void align_at_rest(DriveAlignment& a, const Drive& drive, const FilterOptions& o,
                   const NavigatorConfig& config, const DriveMeasurements& m,
                   const Geodetic<double>& at, double t0, double duration, const std::string& kind,
                   Diagnostics& d) {
  const Ellipsoid& ell = drive.ellipsoid;
  const StartSection& st = drive.start;
  const bool swaying = kind == "swaying", compass = kind == "gyrocompass";
  const bool steaming = compass && (given(st.ve) || given(st.vn));
  const double until = steaming ? 1e300 : moves_at(m, t0);
  a.rest = standing_start(drive, t0, duration, until, d);
  double T = a.rest.end - a.rest.begin;
  AlignmentReport& r = a.report;
  if (a.rest.samples == 0 || T < kShortestRest)
    throw Error(ErrorKind::kWork,
                fmt::format("{} alignment from t = {:.1f} s: only {:.1f} s at rest were found, at "
                            "least {:.0f} s are needed; give [start] attitude and velocity, or "
                            "another start time",
                            kind, t0, T, kShortestRest),
                "start.alignment");
  const double wn = ell.w_ie * std::cos(at.lat);
  const AlignmentErrors errors{config.gyro_bias, config.gyro_noise, config.accel_noise};
  const HeadingSigma mean = coarse_static_sigma(errors, wn, T, a.rest.sway_angle);
  r.std_gyro = mean.gyro_bias, r.std_noise = mean.gyro_noise, r.std_sway = mean.sway;
  double sigma = mean.total();
  // 4.1: the level is trusted, the heading is the gyros'.
  double heading;
  if (compass) {
    const Euler<double> e = to_euler(level_attitude(a.rest.mean_f, 0));
    const double sl = std::sin(at.lat);
    const double N = ell.a / std::sqrt(1 - ell.e2 * sl * sl);
    const double M = N * (1 - ell.e2) / (1 - ell.e2 * sl * sl);
    heading = gyrocompass(a.rest.mean_w, or_else(st.roll, e.roll), or_else(st.pitch, e.pitch),
                          at.lat, ell.w_ie,
                          {or_else(st.ve, 0), or_else(st.vn, 0), 1 / (N + at.h), 1 / (M + at.h)});
    r.method = "gyrocompass";
  } else {
    heading = to_euler(coarse_static(a.rest.mean_w, a.rest.mean_f)).heading;
    r.method = "static";
  }
  // 4.2: the gyros follow the base; a swaying one gives its level as well, at rest the mean is
  // better.
  const double end = swaying ? std::min(t0 + duration, until) : a.rest.end;
  Rot<Geographic, Body> level{};
  a.level_std = 0.003 * deg;
  a.t = a.rest.end;
  if (!compass && end - a.rest.begin >= kShortestFollowed) {
    const FollowedStart f = followed_start(drive, at, a.rest.begin, end);
    const HeadingSigma s0 = f.alignment.sigma(errors);
    if (f.alignment.duration() >= kShortestFollowed) {
      r.latitude = f.alignment.latitude();
      r.latitude_std = s0.total() * std::cos(at.lat);
      const double off = std::fabs(r.latitude - at.lat);
      if (off > kPoorLatitude * r.latitude_std && !given(st.heading))
        d.warn("latitude", "start.lat_deg",
               fmt::format("gravity and the Earth's turn say latitude {:.2f} deg +- {:.2g} deg, "
                           "given is {:.2f} deg: place, axes or gyro errors are not as declared",
                           r.latitude / deg, r.latitude_std / deg, at.lat / deg));
    }
    if (f.alignment.duration() >= kShortestFollowed && (swaying || s0.total() < kRefusedHeading)) {
      T = f.alignment.duration();
      r.std_gyro = s0.gyro_bias;
      r.std_noise = std::hypot(s0.gyro_noise, s0.accel_noise);
      r.std_sway = s0.sway;
      sigma = s0.total();
      level = f.alignment.attitude();
      heading = to_euler(level).heading;
      if (swaying) a.t = f.t;
      a.level_std = std::hypot(a.level_std, swaying ? 0.25 * config.gyro_bias * T : 0.0);
      r.method = "inertial_frame";
    }
  } else if (swaying) {
    throw Error(ErrorKind::kWork,
                fmt::format("alignment on a swaying base needs {:.0f} s, found {:.1f} s",
                            kShortestFollowed, end - a.rest.begin),
                "start.alignment");
  }
  r.heading_std = sigma;
  r.duration = T;
  a.from_gyros = true;
  if (given(st.heading)) {  // a stored heading beside the static level
    heading = st.heading;
    r.method = "stored";
    r.heading_std = or_else(st.heading_std, kStoredStd);
    if (!given(st.heading_std)) r.note = "no attitude.heading_std: 3 deg is taken";
    a.from_gyros = false;
  } else if (!(sigma < kRefusedHeading)) {
    const CourseBack c = course_back(drive, a.rest, m.fixes, d);
    if (c.found) {
      heading = c.heading;
      r.method = "two_step";
      r.heading_std = kCourseStd;
      r.note = fmt::format(
          "the gyros alone would give {:.1f} deg; heading from the course of the fix at t = "
          "{:.1f} s, carried back by the gyros",
          sigma / deg, c.t);
      a.from_gyros = false;
    } else if (!o.force) {
      throw Error(ErrorKind::kWork, refusal(sigma, config, r, at.lat, T), "start.alignment");
    } else {
      r.note = "poor heading, continued by --force with its own sigma";
    }
  }
  r.heading = heading;
  const bool followed = swaying && r.method == "inertial_frame";
  a.C_nb = followed ? level
           : compass && given(st.roll) && given(st.pitch) && a.from_gyros
               ? to_matrix<Geographic>(Euler<double>{heading, st.pitch, st.roll})
               : level_attitude(a.rest.mean_f, heading);
  if (steaming) a.v = {or_else(st.ve, 0), or_else(st.vn, 0), or_else(st.vu, 0)};
  a.heading_random = a.from_gyros ? std::hypot(r.std_noise, r.std_sway) : r.heading_std;
  // At rest on a known place the mean rate less Earth's is the bias; that is the filter's work
  // (ZARU, fine alignment), not done twice.
}

void align_given(DriveAlignment& a, const Drive& drive, const DriveMeasurements& m, double t0,
                 double duration, Diagnostics& d) {
  const StartSection& st = drive.start;
  const bool moving = given(st.ve) || given(st.vn);
  if (!moving) a.rest = standing_start(drive, t0, duration, moves_at(m, t0), d);
  // Heading given; level from the standstill where there is one, else as given.
  const double T = a.rest.end - a.rest.begin;
  const bool level = !given(st.pitch) && a.rest.samples > 0 && T > 5;
  a.C_nb = level ? level_attitude(a.rest.mean_f, st.heading)
                 : to_matrix<Geographic>(
                       Euler<double>{st.heading, or_else(st.pitch, 0), or_else(st.roll, 0)});
  a.t = level ? a.rest.end : t0;
  a.v = {or_else(st.ve, 0), or_else(st.vn, 0), or_else(st.vu, 0)};
  a.level_std = level ? 0.003 * deg : or_else(st.level_std, 0.1 * deg);
  a.level_from_accel = level;
  a.report.method = "attitude";
  a.report.heading = st.heading;
  a.report.heading_std = a.heading_random = or_else(st.heading_std, 0.1 * deg);
  a.report.duration = T;
}

void align_in_motion(DriveAlignment& a, const Drive& drive, const FilterOptions& o,
                     const NavigatorConfig& config, const DriveMeasurements& m,
                     const Geodetic<double>& at, double t0, double duration, Diagnostics& d) {
  const auto& fixes = m.all_fixes;
  a.rest = standing_start(drive, t0, duration, moves_at(m, t0), d);
  if (a.rest.end - a.rest.begin >= kShortestRest) {
    const CourseBack c = course_back(drive, a.rest, fixes, d);
    if (c.found) {
      a.C_nb = level_attitude(a.rest.mean_f, c.heading);
      a.t = a.rest.end;
      a.level_std = 0.003 * deg;
      a.report.method = "two_step";
      a.report.heading = c.heading;
      a.report.heading_std = a.heading_random = kCourseStd;
      a.report.duration = a.rest.end - a.rest.begin;
      a.report.note = fmt::format(
          "level at rest, heading from the course of the fix at t = {:.1f} s, carried back by the "
          "gyros",
          c.t);
      return;
    }
  }
  const OnTheWay w = on_the_way(drive, drive.ellipsoid, fixes, t0, d);
  if (!w.found) {
    if (a.rest.end - a.rest.begin >= kShortestRest) {
      d.warn("in_motion", "start.alignment",
             "no course could be had from the fixes: aligned at rest instead");
      return align_at_rest(a, drive, o, config, m, at, t0, duration, "static", d);
    }
    throw Error(ErrorKind::kWork,
                fmt::format("in-motion alignment takes the heading from the course of fixes: {}, "
                            "and none show a course (a speed above {:.0f} m/s twice within 120 s, "
                            "or two places {:.0f} sigma apart, without a turn between). Stand "
                            "still for kind = \"static\", or give [start] attitude and velocity",
                            fixes.empty() ? "the drive has none"
                                          : fmt::format("there are {}", fixes.size()),
                            kCourseSpeed, kFixBase),
                "start.alignment");
  }
  a.rest = StandingStart{};
  a.C_nb = level_attitude(w.up, w.heading);
  a.t = w.fix.t;
  a.v = w.v;
  a.level_std = kLevelInMotion;
  a.level_from_accel = false;
  a.has_place = true;
  a.place = {w.fix.lat, w.fix.lon, or_else(w.fix.h, at.h)};
  a.place_std = std::max({w.fix.std_e, w.fix.std_n, config.fix_std_min});
  a.velocity_std =
      w.by_velocity ? std::max(or_else(w.fix.std_v, 0.0), config.fix_velocity_std) : 1.0;
  a.report.method = "in_motion";
  a.report.heading = w.heading;
  a.report.heading_std = a.heading_random = w.std;
  a.report.note = fmt::format(
      "under way: heading from the course of the fixes up to t = {:.1f} s, level to 0.5 deg from "
      "the mean force between them{}",
      w.fix.t, w.by_velocity ? "" : "; velocity from two fixes");
}

}  // namespace

DriveAlignment align_drive(const Drive& drive, const FilterOptions& o,
                           const NavigatorConfig& config, const DriveMeasurements& m,
                           const Geodetic<double>& at, double t0, Diagnostics& d) {
  const StartSection& st = drive.start;
  DriveAlignment a;
  const std::string kind = st.alignment_kind.value_or(given(st.heading) ? "given" : "static");
  const double duration = or_else(st.alignment_duration, 300.0);
  if ((kind == "given" || kind == "stored") && !given(st.heading))
    throw Error(
        ErrorKind::kInput,
        fmt::format("alignment kind \"{}\" needs [start] attitude = {{ heading = \"…deg\"{} "
                    "}}",
                    kind, kind == "given" ? ", pitch, roll" : ", heading_std = \"…deg\""),
        "start.attitude");
  a.report.gyro_bias = config.gyro_bias;
  a.report.place_lat = at.lat;
  a.report.latitude_limit = latitude_limit(config.gyro_bias, drive.ellipsoid.w_ie, kRefusedHeading);
  if (kind == "given") {
    align_given(a, drive, m, t0, duration, d);
  } else if (kind == "in-motion") {
    align_in_motion(a, drive, o, config, m, at, t0, duration, d);
  } else if (kind == "fine") {
    // A coarse one over the first third (100 s for the inertial-frame method where there are), then
    // the filter: the same samples do not count twice.
    // A wheel or fixes that say when it moves off know better than a jolt in the IMU.
    const double until = moves_at(m, t0);
    const StandingStart whole = standing_start(drive, t0, duration, until, d, until > 1e299);
    const double T = whole.end - whole.begin;
    double coarse = given(st.heading) ? 15.0 : std::max(T / 3, kShortestFollowed);
    if (coarse > 0.8 * T) coarse = 0.5 * T;
    align_at_rest(a, drive, o, config, m, at, t0, std::max(coarse, kShortestRest), "static", d);
    a.rest = whole;
    a.refine_until = whole.end;
  } else {
    align_at_rest(a, drive, o, config, m, at, t0, duration, kind == "stored" ? "static" : kind, d);
  }
  return a;
}

void refine_start(const Drive& drive, const NavigatorConfig& config, DriveAlignment& a,
                  NavigatorStart& start) {
  FineAlignmentConfig c;
  c.sensors = config;
  // A base that rocks moves the unit by its lever arm about it (20 m at most), slower than a
  // second.
  c.place_std = std::hypot(0.02, 20.0 * a.rest.sway_angle);
  c.place_epoch = a.rest.sway_angle > 0.1 * deg ? 10.0 : 1.0;
  double sway = 0;
  for (int i = 0; i < 3; ++i) {
    sway = std::max(sway, a.rest.sway[i]);
    c.sensors.zaru_sway[i] = a.rest.sway[i];
  }
  c.quiet = sway < 3.0 * config.gyro_noise;
  c.sensors.standstill.sigma_w = std::max(a.rest.sigma_w, 1e-6);
  c.sensors.standstill.sigma_f = std::max(a.rest.sigma_f, 1e-5);
  FineAlignment fine(c, start);
  Diagnostics told_before;
  ImuReader reader(drive, told_before);
  for (ImuIncrement<double> s; reader.next(s) && s.t <= a.refine_until + 1e-9;)
    if (s.t > start.state.t + 1e-9 && s.dt > 0) fine.add(s);
  const double begin = start.state.t;
  start = fine.result();
  const SolutionRow row =
      solution_row(drive.ellipsoid, start.state, start.P, FrameId::kGeographic, 0);
  AlignmentReport& r = a.report;
  const double coarse = r.heading_std;
  const std::string how = r.method;
  r.method = "fine";
  r.heading = row.heading;
  r.heading_std = row.std_heading;
  r.duration += start.state.t - begin;
  r.note = fmt::format(
      "{} over {:.0f} s gave {:.3g} deg, then the filter over {:.0f} s{}; gyro bias {:.3g} {:.3g} "
      "{:.3g} deg/h, accelerometer bias {:.0f} {:.0f} {:.0f} ug taken off",
      how, r.duration - (start.state.t - begin), coarse / deg, start.state.t - begin,
      c.quiet ? ", the base at rest to the gyros' noise" : "", start.state.bg.x / deg_per_h,
      start.state.bg.y / deg_per_h, start.state.bg.z / deg_per_h, start.state.ba.x / ug,
      start.state.ba.y / ug, start.state.ba.z / ug);
}

}  // namespace loxo
