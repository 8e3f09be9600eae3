// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/drive_truth.hpp"

#include <algorithm>
#include <bit>

#include "loxo/earth/attitude.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/scenario_keys.hpp"

namespace loxo {
namespace {

using enum Dimension;
using namespace scenario_keys;

constexpr double kMostSamples = 2'000'000;  // 96 MB

// Legs until the duration is used up.
class Legs {
 public:
  Legs(Trajectory& path, double duration) : path_(path), left_(duration) {}
  bool over() const { return left_ <= 0; }
  double used() const { return used_; }
  void add(double duration, double speed, double turn) {
    if (over() || duration <= 0) return;
    const double part = min(duration, left_);
    path_.legs.push_back({part, speed, turn * (part / duration), true});
    left_ -= part;
    used_ += part;
  }

 private:
  Trajectory& path_;
  double left_, used_ = 0;
};

// vehicle.md 7.3: when to turn [s], by how much [deg], at 6 deg/s.
constexpr double kMixed[14][2] = {{60, 40},   {150, -70},  {300, 90},    {480, -60}, {700, -50},
                                  {900, 80},  {1200, 30},  {1500, -100}, {1800, 60}, {2100, -40},
                                  {2400, 90}, {2700, -60}, {3000, -30},  {3300, 45}};
constexpr double kTurnRate = 6.0 * deg;

void lay_route(const std::string& route, const TomlTable& t, double speed, double duration,
               Trajectory& path) {
  Legs legs(path, duration);
  if (route == "static") {
    legs.add(duration, 0, 0);
    return;
  }
  legs.add(fabs(speed), speed, 0);  // 1 m/s^2 in the mean
  if (route == "weave") {
    const double swing = t.get_quantity("weave_angle", kAngle).value_or(30.0 * deg);
    const double period = positive(t, "weave_period", kTime, 300.0);
    legs.add(0.25 * period, speed, swing);
    for (double turn = -2 * swing; !legs.over(); turn = -turn) legs.add(0.5 * period, speed, turn);
  } else if (route == "mixed") {
    for (const auto& [at, turn] : kMixed) {
      legs.add(at - legs.used(), speed, 0);
      legs.add(fabs(turn * deg) / kTurnRate, speed, turn * deg);
    }
  } else if (route == "closed") {
    for (double at = 300; !legs.over(); at += 300) {
      legs.add(at - legs.used(), speed, 0);
      legs.add(90 * deg / kTurnRate, speed, 90 * deg);
    }
  }
  legs.add(duration, speed, 0);
}

}  // namespace

Scenario drive_scenario(const TomlTable& t) {
  Scenario s;
  if (const auto name = t.get_string("scenario")) {
    for (const char* key : {"route", "lat", "lon", "heading", "speed", "duration"})
      if (t.has(key))
        refuse("found both a scenario and a route's " + std::string(key) + "; expected one of them",
               t.where(key));
    try {
      s = read_scenario(*name);
    } catch (const Error& e) {
      if (e.exit_code() == 2) refuse(e.what(), t.where("scenario"));
      throw;
    }
    s.imu.rate = positive(t, "imu_rate", kFrequency, s.imu.rate);
    s.odometer.rate = positive(t, "odometer_rate", kFrequency, s.odometer.rate);
    return s;
  }
  s.ellipsoid_text = t.get_string("ellipsoid").value_or("WGS84");
  auto& path = s.trajectory;
  path.ellipsoid = ellipsoid_by_name(s.ellipsoid_text);
  const std::vector<std::string> routes{"weave", "static", "straight", "mixed", "closed"};
  const std::string route = one_of(t, "route", routes);
  path.start = {t.get_quantity("lat", kAngle).value_or(45.0 * deg),
                t.get_quantity("lon", kAngle).value_or(0.0),
                t.get_quantity("height", kLength).value_or(0.0)};
  if (!(fabs(path.start.lat) <= 0.5 * kPi))
    refuse("expected a latitude within 90 deg", t.where("lat"));
  path.course = t.get_quantity("heading", kAngle).value_or(45.0 * deg);
  const double speed = t.get_quantity("speed", kSpeed).value_or(15.0);
  if (!(fabs(speed) <= 1000)) refuse("expected at most 1000 m/s", t.where("speed"));
  const double duration = positive(t, "duration", kTime, 3600.0);
  if (duration < 1) refuse("expected a duration of 1 s or more", t.where("duration"));
  lay_route(route, t, speed, duration, path);
  s.imu.rate = positive(t, "imu_rate", kFrequency, 100.0);
  if (s.imu.rate < 1 || s.imu.rate > 2000)
    refuse("expected a rate from 1 Hz to 2000 Hz", t.where("imu_rate"));
  s.odometer.present = true;
  s.odometer.rate = positive(t, "odometer_rate", kFrequency, s.imu.rate / 10.0);
  s.imu.errors.gyro.bias = 0.01 * deg_per_h;
  s.imu.errors.gyro.noise = 0.001 * deg_per_sqrt_h;
  s.imu.errors.accel.bias = 10.0 * ug;
  s.imu.errors.accel.noise = 5.0 * ug_per_sqrt_hz;
  return s;
}

DriveTruth drive_truth(const Scenario& s, const std::string& where) {
  DriveTruth t;
  const double samples = loxo::round(s.trajectory.duration() * s.imu.rate);
  if (samples > kMostSamples)
    refuse("expected at most 2 million IMU samples (the truth is held in memory), found " +
               std::to_string(static_cast<long long>(samples)) + ": lower the rate or the duration",
           where);
  const double every = s.imu.rate / s.odometer.rate;
  if (!(fabs(every - loxo::round(every)) < 1e-9 && every >= 1))
    refuse("expected an odometer's rate that is a whole part of the IMU's rate", where);
  t.dt = 1.0 / s.imu.rate;
  t.odometer_every = static_cast<int>(loxo::round(every));
  t.epoch_every = std::max(1, static_cast<int>(loxo::round(s.imu.rate)));
  const long fix_every =
      std::max(1L, static_cast<long>(loxo::round(s.imu.rate / (s.fix.rate * t.epoch_every))));

  TrajectoryWalk walk(s.trajectory);
  WayMemory memory(s.odometer.delay);
  const auto mounting = to_matrix<Geographic>(
      Euler<double>{s.trajectory.mounting_heading, s.trajectory.mounting_pitch, 0});
  // Rows of the IMU-to-vehicle matrix.
  t.right = {mounting.m[0][0], mounting.m[0][1], mounting.m[0][2]};
  t.forward = {mounting.m[1][0], mounting.m[1][1], mounting.m[1][2]};
  t.up = {mounting.m[2][0], mounting.m[2][1], mounting.m[2][2]};
  const auto n = static_cast<std::size_t>(samples);
  t.steps.reserve(n);
  double last_way = 0;
  for (std::size_t i = 0;; ++i) {
    const double now = static_cast<double>(i) / s.imu.rate;
    if (i > 0) {
      const auto u = walk.to(now);
      t.steps.push_back({{u.dtheta.x, u.dtheta.y, u.dtheta.z}, {u.dv.x, u.dv.y, u.dv.z}});
    }
    if (s.odometer.delay > 0)
      memory.add(now, walk.wheel_way(s.odometer.lever), walk.wheel_speed(s.odometer.lever));
    if (i % static_cast<std::size_t>(t.odometer_every) == 0) {
      const double way = s.odometer.delay > 0 ? memory.way() : walk.wheel_way(s.odometer.lever);
      const double end = now - s.odometer.delay;
      if (i > 0)
        t.ticks.push_back(
            {way - last_way, wheel_factor(s.odometer.faults, end - t.dt * t.odometer_every, end)});
      last_way = way;
    }
    if (i % static_cast<std::size_t>(t.epoch_every) == 0) {
      const Truth truth = walk.truth();
      DriveTruth::Epoch e;
      e.state = truth.state;
      const auto& up = truth.up;
      const double c = sqrt(up.x * up.x + up.y * up.y);
      e.east = c > 1e-12 ? (1.0 / c) * Vec<Ecef>{-up.y, up.x, 0.0} : Vec<Ecef>{0.0, 1.0, 0.0};
      e.north = cross(up, e.east);
      e.h = truth.h;
      e.vu = truth.vu;
      e.distance = truth.distance;
      e.fix = s.fix.present && t.epochs.size() % static_cast<std::size_t>(fix_every) == 0;
      for (std::size_t j = 0; j + 1 < s.fix.outages.size(); j += 2)
        e.fix = e.fix && !(now >= s.fix.outages[j] && now < s.fix.outages[j + 1]);
      t.epochs.push_back(e);
    }
    if (i == n) break;
  }
  if (t.epochs.size() < 2) refuse("expected a drive of a second or more", where);
  return t;
}

std::uint64_t DriveTruth::hash() const {
  std::uint64_t h = 0xcbf29ce484222325;
  const auto add = [&](double x) {
    h = (h ^ std::bit_cast<std::uint64_t>(x)) * 0x100000001b3;
    h ^= h >> 29;
  };
  for (const auto& s : steps)
    for (int k = 0; k < 3; ++k) add(s.th[k]), add(s.v[k]);
  for (const auto& t : ticks) add(t.way), add(t.factor);
  for (const auto& e : epochs) {
    for (const double x : {e.state.r.x, e.state.r.y, e.state.r.z, e.state.v.x, e.state.v.y,
                           e.state.v.z, e.state.q_eb.w, e.state.q_eb.x, e.state.q_eb.y,
                           e.state.q_eb.z, e.h, e.vu, e.distance, e.fix ? 1.0 : 0.0})
      add(x);
  }
  return h;
}

}  // namespace loxo
