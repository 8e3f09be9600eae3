// SPDX-License-Identifier: Apache-2.0
// Distance and heading, step by step, from whatever the drive has: the rows of [track], or a wheel
// or Doppler log with the heading of another instrument.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/log/channel.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// A course between two positions closer than this is noise; it is held over the standstill.
constexpr double kShortestCourse = 0.5;  // m

bool has(const ChannelFile& file, const char* key) { return file.columns.contains(key); }

std::vector<TrackStep> recorded_track(const Drive& drive, Diagnostics& d) {
  std::vector<TrackStep> out;
  double heading = given(drive.start.heading) ? drive.start.heading : 0.0;
  each_row(drive, "track", d, [&](const Channel& c) {
    TrackStep s;
    s.t = c.t();
    s.row = static_cast<std::uint32_t>(c.rows());
    s.ds = c.value(c.at("distance")) / drive.track_scale;
    if (drive.track_heading_is_step) {
      const double step = c.value(c.at("heading_step"));
      s.heading = heading + 0.5 * step;
      heading += step;
    } else {
      s.heading = c.value(c.at("heading"));
    }
    s.heading -= drive.track_heading_offset;
    s.pitch = c.value(c.at("pitch"), 0.0);
    s.h = c.value(c.at("height"), 0.0);
    if (!given(s.ds) || !given(s.heading)) {
      d.bad("bad_row", c.where(), "[track] expected distance and heading, found nan; row skipped");
      return;
    }
    out.push_back(s);
  });
  return out;
}

// Headings over time by a gyro about the vertical (rad/s, clockwise), from the start's heading at
// the start's time (else at the first row; 0 where nothing is known: calibration finds it as eps).
std::vector<AttitudeSample> integrated_rate(const Drive& drive, Diagnostics& d) {
  std::vector<AttitudeSample> out;
  double last = kNone, sum = 0;
  each_row(drive, "heading", d, [&](const Channel& c) {
    const double rate = c.value(c.at("rate"));
    if (!given(rate)) return;
    if (!out.empty()) sum += 0.5 * (last + rate) * (c.t() - out.back().t);
    last = rate;
    out.push_back({c.t(), sum, 0, 0});
  });
  if (out.empty() || !given(drive.start.heading)) return out;
  double at_start = out.front().heading;
  if (given(drive.start.t))
    for (const AttitudeSample& a : out)
      if (a.t <= drive.start.t) at_start = a.heading;
  for (AttitudeSample& a : out) a.heading += drive.start.heading - at_start;
  return out;
}

// Course from position to position, at the middle of each pair that lies far enough apart.
std::vector<AttitudeSample> path_course(const Drive& drive, Diagnostics& d) {
  std::vector<AttitudeSample> out;
  double t = kNone, lat = 0, lon = 0;
  each_row(drive, "heading", d, [&](const Channel& c) {
    const double a = c.value(c.at("lat")), b = c.value(c.at("lon"));
    if (!given(a) || !given(b)) return;
    if (given(t)) {
      const double s = std::sin(0.5 * (a + lat));
      const double north = (a - lat) * meridian_radius(drive.ellipsoid, s);
      const double east =
          wrap_pi(b - lon) * prime_vertical_radius(drive.ellipsoid, s) * std::cos(0.5 * (a + lat));
      if (std::hypot(north, east) < kShortestCourse) return;
      out.push_back({0.5 * (t + c.t()), std::atan2(east, north), 0, 0});
    }
    t = c.t(), lat = a, lon = b;
  });
  return out;
}

// A car's front wheels: clockwise turn by v tan(steering) / wheel base; the wheel that is read
// stands lever_arm[0] to the right of the centre line.
struct Steered {
  std::vector<AttitudeSample> headings;
  std::vector<OdometerTick> centre;  // speeds of the middle of the axle
};
Steered steered(const Drive& drive, Diagnostics& d) {
  Steered out;
  double heading = given(drive.start.heading) ? drive.start.heading : 0.0, last = kNone;
  each_row(drive, "odometer", d, [&](const Channel& c) {
    const double v = c.value(c.at("value")) * drive.odometer_scale,
                 turn =
                     std::tan(c.value(c.at("steering")) - drive.steering_offset) / drive.wheel_base;
    if (!given(v) || !given(turn)) {
      d.bad("bad_row", c.where(),
            "[odometer] expected speed and steering angle, found nan; row skipped");
      return;
    }
    const double centre = v / (1 - turn * drive.odometer_lever[0]);
    if (given(last)) heading += 0.5 * (last + centre * turn) * (c.t() - out.headings.back().t);
    last = centre * turn;
    out.headings.push_back({c.t(), heading, 0, 0});
    out.centre.push_back({c.t(), centre, true});
  });
  return out;
}

class AttitudeAt {
 public:
  explicit AttitudeAt(std::vector<AttitudeSample> rows) : rows_(std::move(rows)) {}
  bool covers(double t) const {
    return rows_.size() > 1 && t >= rows_.front().t && t <= rows_.back().t;
  }
  // Ascending times.
  AttitudeSample operator()(double t) {
    while (j_ + 2 < rows_.size() && rows_[j_ + 1].t < t) ++j_;
    const AttitudeSample &a = rows_[j_], &b = rows_[j_ + 1];
    const double u = (t - a.t) / (b.t - a.t);
    return {t, a.heading + u * wrap_pi(b.heading - a.heading), a.pitch + u * (b.pitch - a.pitch),
            a.roll + u * wrap_pi(b.roll - a.roll)};
  }
  std::size_t size() const { return rows_.size(); }

 private:
  std::vector<AttitudeSample> rows_;
  std::size_t j_ = 0;
};

std::vector<AttitudeSample> attitude_or_heading(const Drive& drive, Diagnostics& d) {
  return drive.attitude.present ? read_attitude(drive, d) : read_heading_log(drive, d);
}

// One step between two rows of a velocity log. Body velocities are levelled by the attitude; the
// way's direction is then the heading and the drift angle together.
TrackStep velocity_step(const VelocitySample& a, const VelocitySample& b,
                        const AttitudeSample& at) {
  double v[3];
  for (std::size_t i = 0; i < 3; ++i) {
    v[i] = 0.5 * (a.v[i] + b.v[i]);
    if (!given(v[i])) v[i] = 0;
  }
  if (!a.level) {
    const auto C = to_matrix<Geographic>(Euler<double>{0, at.pitch, at.roll});
    const Vec<Geographic> level = C * Vec<Body>{v[0], v[1], v[2]};
    v[0] = level.x, v[1] = level.y, v[2] = level.z;
  }
  TrackStep s;
  const double flat = std::hypot(v[0], v[1]);
  s.ds = std::hypot(flat, v[2]) * (b.t - a.t);
  s.heading = at.heading + std::atan2(v[0], v[1]);
  s.pitch = flat > 0 ? std::atan2(v[2], flat) : 0;
  return s;
}

}  // namespace

std::string track_lacks(const Drive& drive) {
  if (drive.track.present) return {};
  const bool distance = drive.odometer.present || drive.velocity.present;
  const bool level_velocity =
      drive.velocity.present && (has(drive.velocity, "east") || has(drive.velocity, "north"));
  const bool heading = drive.attitude.present || drive.heading.present ||
                       has(drive.odometer, "steering") ||
                       (!drive.odometer.present && level_velocity);
  if (distance && heading) return {};
  if (!distance && !heading) return "[track], or [odometer] and [attitude]";
  return distance ? "[attitude] or [heading] beside its distances"
                  : "[odometer] or [velocity] beside its [attitude]";
}

std::vector<AttitudeSample> read_heading_log(const Drive& drive, Diagnostics& d) {
  if (has(drive.heading, "rate")) return integrated_rate(drive, d);
  if (has(drive.heading, "lat")) return path_course(drive, d);
  std::vector<AttitudeSample> out;
  for (const HeadingSample& h : read_headings(drive, d)) out.push_back({h.t, h.heading, 0, 0});
  return out;
}

std::vector<AttitudeSample> read_body_attitude(const Drive& drive, Diagnostics& d) {
  if (drive.track.present) return {};
  if (drive.attitude.present || has(drive.heading, "heading")) return attitude_or_heading(drive, d);
  return {};
}

std::vector<TrackStep> read_track(const Drive& drive, Diagnostics& d) {
  if (drive.track.present) return recorded_track(drive, d);
  if (const std::string lacks = track_lacks(drive); !lacks.empty())
    throw Error(ErrorKind::kInput, "the drive has no " + lacks + " to make a track of",
                drive.toml_path);
  std::vector<AttitudeSample> headings;
  std::vector<OdometerTick> ticks;
  std::vector<VelocitySample> velocities;
  const bool other = drive.attitude.present || drive.heading.present;
  if (!other && has(drive.odometer, "steering")) {
    Steered s = steered(drive, d);
    headings = std::move(s.headings);
    ticks = std::move(s.centre);
  } else {
    if (other) headings = attitude_or_heading(drive, d);
    if (drive.odometer.present)
      ticks = read_odometer(drive, d);
    else
      velocities = read_velocities(drive, d);
    if (other && headings.size() < 2)
      throw Error(ErrorKind::kInput, "expected at least two rows of heading",
                  drive.attitude.present ? drive.attitude.file : drive.heading.file);
  }
  // The course of a path is that of the motion: there is no reversing in it.
  const bool path = !drive.attitude.present && has(drive.heading, "lat");
  const bool level = !velocities.empty() && velocities.front().level;
  AttitudeAt attitude(std::move(headings));
  std::vector<TrackStep> out;
  long outside = 0;
  const std::size_t n = std::max(ticks.size(), velocities.size());
  for (std::size_t i = 1; i < n; ++i) {
    const double t1 = velocities.empty() ? ticks[i].t : velocities[i].t,
                 t0 = velocities.empty() ? ticks[i - 1].t : velocities[i - 1].t,
                 mid = 0.5 * (t0 + t1);
    if (!level && !attitude.covers(mid)) {
      ++outside;
      continue;
    }
    const AttitudeSample at = level ? AttitudeSample{mid, 0, 0, 0} : attitude(mid);
    TrackStep s;
    if (velocities.empty()) {
      s.ds = ticks[i].is_speed ? 0.5 * (ticks[i - 1].value + ticks[i].value) * (t1 - t0)
                               : ticks[i].value;
      if (path) s.ds = std::fabs(s.ds);
      s.heading = at.heading;
      // The way's direction: the body's without the declared mounting (indicated - true).
      s.pitch = at.pitch - drive.odometer_mounting_pitch;
    } else {
      s = velocity_step(velocities[i - 1], velocities[i], at);
    }
    s.heading -= drive.odometer_mounting_heading;
    s.t = t1;
    s.row = static_cast<std::uint32_t>(i + 1);
    out.push_back(s);
  }
  if (outside > 0)
    d.warn("uncovered", velocities.empty() ? "odometer" : "velocity",
           std::to_string(outside) + " readings outside the attitude's time left out");
  return out;
}

}  // namespace loxo
