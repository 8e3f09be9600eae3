// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/drive_truth.hpp"

#include <algorithm>
#include <cmath>

#include "loxo/ins/strapdown.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

constexpr double kMostSamples = 2'000'000;  // 96 MB

Vec<Ecef, double> unit(const Vec<Ecef, double>& v) { return (1.0 / norm(v)) * v; }
// East at a normal; at the pole itself that of longitude 0.
Vec<Ecef, double> east_of(const Vec<Ecef, double>& n) {
  const double c = n.x * n.x + n.y * n.y;
  return c > 1e-24 ? unit(Vec<Ecef, double>{-n.y, n.x, 0.0}) : Vec<Ecef, double>{0.0, 1.0, 0.0};
}

}  // namespace

DriveSettings read_drive_settings(const TomlTable& t) {
  DriveSettings s;
  const std::vector<std::string> routes{"static", "straight", "weave"};
  s.route = t.get_string("route").value_or("weave");
  if (std::find(routes.begin(), routes.end(), s.route) == routes.end())
    throw Error(ErrorKind::kInput, "unknown route '" + s.route + "'" + suggestion(s.route, routes),
                t.where("route"));
  s.lat = t.get_quantity("lat", Dimension::kAngle).value_or(45.0 * deg);
  s.lon = t.get_quantity("lon", Dimension::kAngle).value_or(0.0);
  s.heading = t.get_quantity("heading", Dimension::kAngle).value_or(45.0 * deg);
  s.speed = t.get_quantity("speed", Dimension::kSpeed).value_or(15.0);
  s.duration = t.get_quantity("duration", Dimension::kTime).value_or(3600.0);
  s.imu_rate = t.get_quantity("imu_rate", Dimension::kFrequency).value_or(100.0);
  const double odometer =
      t.get_quantity("odometer_rate", Dimension::kFrequency).value_or(s.imu_rate / 10.0);
  s.weave_angle = t.get_quantity("weave_angle", Dimension::kAngle).value_or(30.0 * deg);
  s.weave_period = t.get_quantity("weave_period", Dimension::kTime).value_or(300.0);
  const auto need = [&](bool ok, const char* key, const std::string& what) {
    if (!ok) throw Error(ErrorKind::kInput, "expected " + what, t.where(key));
  };
  need(std::fabs(s.lat) <= 0.5 * kPi, "lat", "a latitude within 90 deg");
  need(s.imu_rate >= 1 && s.imu_rate <= 2000, "imu_rate", "a rate from 1 Hz to 2000 Hz");
  need(s.duration >= 1 && s.duration * s.imu_rate <= kMostSamples, "duration",
       "from 1 s to 2 million IMU samples (the truth is held in memory: lower the rate or the "
       "duration)");
  need(std::fabs(s.speed) <= 1000, "speed", "at most 1000 m/s");
  need(s.weave_period > 1, "weave_period", "more than 1 s");
  const double every = s.imu_rate / odometer;
  need(odometer > 0 && std::fabs(every - std::round(every)) < 1e-9 && every >= 1, "odometer_rate",
       "a whole part of the IMU rate");
  s.odometer_every = static_cast<int>(std::round(every));
  return s;
}

DriveTruth drive(const EarthModel& earth, const DriveSettings& s) {
  using V = Vec<Body, double>;
  DriveTruth t;
  t.dt = 1.0 / s.imu_rate;
  t.odometer_every = s.odometer_every;
  t.epoch_every = std::max(1, static_cast<int>(std::lround(s.imu_rate)));
  const bool still = s.route == "static";
  const double speed = still ? 0.0 : s.speed;

  // Level start: right, forward, up.
  double sl, cl, so, co, sp, cp;
  sincos(s.lat, sl, cl);
  sincos(s.lon, so, co);
  sincos(s.heading, sp, cp);
  const Vec<Ecef, double> n0{cl * co, cl * so, sl}, e0{-so, co, 0.0}, no0{-sl * co, -sl * so, cl};
  const Vec<Ecef, double> forward = sp * e0 + cp * no0, right = cp * e0 - sp * no0;
  Rot<Ecef, Body, double> c;
  const Vec<Ecef, double> columns[3] = {right, forward, n0};
  for (int j = 0; j < 3; ++j)
    c.m[0][j] = columns[j].x, c.m[1][j] = columns[j].y, c.m[2][j] = columns[j].z;
  EcefState<double> start{point_of_normal(earth, n0, 0.0), {}, to_quaternion(c)};
  auto x = EcefMechanization::from_ecef(earth, start);
  const double h0 = x.position.h;

  const auto samples = static_cast<std::size_t>(std::lround(s.duration * s.imu_rate));
  t.steps.reserve(samples);
  double distance = 0, tick = 0;
  const auto keep_epoch = [&] {
    DriveTruth::Epoch e;
    e.state = EcefMechanization::to_ecef(earth, x);
    const auto np = normal_point(earth, x.position.r);
    e.east = east_of(np.n);
    e.north = cross(np.n, e.east);
    e.h = np.h;
    e.vu = dot(x.v, np.n);
    e.distance = distance;
    t.epochs.push_back(e);
  };
  keep_epoch();
  const double w_weave = 2.0 * kPi / s.weave_period;
  for (std::size_t i = 0; i < samples; ++i) {
    const double time = (static_cast<double>(i) + 0.5) * t.dt;
    const auto c_be = transpose(to_matrix(x.q_nb));
    const auto np = refine_normal(earth, x.position.r, x.position.zeta);
    const V v = c_be * x.v, up = c_be * np.n, w_ie = c_be * Vec<Ecef, double>{0.0, 0.0, earth.w_ie};
    const double wanted = std::min(time, std::fabs(speed)) * (speed < 0 ? -1.0 : 1.0);
    const double thrust = time < std::fabs(speed) ? (speed < 0 ? -1.0 : 1.0) : 0.0;
    // Clockwise turn of the weave; feed-forward of what keeps the vehicle level, on its way and at
    // its height, and a little feedback for what feed-forward leaves.
    const double turn = s.route == "weave" ? s.weave_angle * w_weave * cos(w_weave * time) : 0.0;
    const double R = earth.a;
    const V w_en{-v.y / R, v.x / R, 0.0};
    const V level = 0.1 * cross(V{0.0, 0.0, 1.0}, up);
    const V w_ib = w_ie + w_en + V{0.0, 0.0, -turn} + level;
    const V a{v.y * turn - 0.5 * v.x, thrust + 0.5 * (wanted - v.y),
              -0.5 * v.z - 0.05 * (np.h - h0)};
    const double gamma = gravity_of(earth, np.s2, np.inv_u, np.h);
    const V f = a + cross(2.0 * w_ie + w_en, v) + gamma * up;
    const V th = t.dt * w_ib, dv = t.dt * f;
    t.steps.push_back({{th.x, th.y, th.z}, {dv.x, dv.y, dv.z}});
    const auto r = x.position.r;
    x = step(earth, x, one_sample(ImuIncrement<double>{0.0, t.dt, th, dv}));
    const double way = norm(x.position.r - r) * (speed < 0 ? -1.0 : 1.0);
    distance += std::fabs(way);
    tick += way;
    if ((i + 1) % static_cast<std::size_t>(t.odometer_every) == 0) {
      t.ticks.push_back(tick);
      tick = 0;
    }
    if ((i + 1) % static_cast<std::size_t>(t.epoch_every) == 0) keep_epoch();
  }
  return t;
}

}  // namespace loxo
