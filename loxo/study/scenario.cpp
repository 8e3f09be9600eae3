// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/scenario.hpp"

#include <cmath>
#include <filesystem>

#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

using enum Dimension;

[[noreturn]] void refuse(const std::string& what, const std::string& where) {
  throw Error(ErrorKind::kInput, what, where);
}

double positive(const TomlTable& t, const char* key, Dimension d, double otherwise) {
  const double x = t.get_quantity(key, d).value_or(otherwise);
  if (!(x > 0)) refuse("expected a value above 0", t.where(key));
  return x;
}
double sigma(const TomlTable& t, const char* key, Dimension d) {
  const double x = t.get_quantity(key, d).value_or(0.0);
  if (x < 0)
    refuse("expected a standard deviation of 0 or more, found a negative one", t.where(key));
  return x;
}
double angle(const TomlTable& t, const char* key) {
  return t.get_quantity(key, kAngle).value_or(0.0);
}
std::string one_of(const TomlTable& t, const char* key, const std::vector<std::string>& valid) {
  const std::string found = t.get_string(key).value_or(valid.front());
  for (const auto& name : valid)
    if (name == found) return found;
  refuse("unknown value '" + found + "'" + suggestion(found, valid), t.where(key));
}

void read_path(const TomlTable& t, Trajectory& path) {
  const auto start = t.get_table("start");
  if (!start) refuse("missing; expected [start] with lat_deg and lon_deg", t.where("start"));
  const double lat = start->need_number("lat_deg"), lon = start->need_number("lon_deg");
  if (!(std::fabs(lat) <= 90)) refuse("expected degrees in [-90, 90]", start->where("lat_deg"));
  if (!(std::fabs(lon) <= 360)) refuse("expected degrees in [-360, 360]", start->where("lon_deg"));
  path.start = {lat * deg, std::remainder(lon, 360.0) * deg,
                start->get_number("h_m").value_or(0.0)};
  path.course = angle(*start, "course");
  path.speed = start->get_quantity("speed", kSpeed).value_or(0.0);
  double speed = path.speed;
  const auto legs = t.get_tables("leg");
  if (legs.empty()) refuse("missing; expected one [[leg]] or more", t.where("leg"));
  const long long times = t.get_integer("repeat").value_or(1);
  if (times < 1 || times > 100000)
    refuse("expected how often the legs are gone through, 1 or more", t.where("repeat"));
  for (const auto& table : legs) {
    Leg leg;
    leg.duration = positive(table, "duration", kTime, -1.0);
    leg.speed = speed = table.get_quantity("speed", kSpeed).value_or(speed);
    leg.turn = angle(table, "turn");
    leg.straight = one_of(table, "path", {"straight", "course"}) == "straight";
    path.legs.push_back(leg);
  }
  const std::vector<Leg> once = path.legs;
  for (long long i = 1; i < times; ++i) path.legs.insert(path.legs.end(), once.begin(), once.end());
  for (const auto& table : t.get_tables("wave")) {
    const std::vector<std::string> names = {"roll", "pitch", "yaw", "heave"};
    const std::string axis = one_of(table, "axis", names);
    Wave wave;
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == axis) wave.axis = static_cast<WaveAxis>(i);
    wave.amplitude =
        table.need_quantity("amplitude", wave.axis == WaveAxis::kHeave ? kLength : kAngle);
    wave.period = positive(table, "period", kTime, 10.0);
    wave.phase = angle(table, "phase");
    path.waves.push_back(wave);
  }
  if (const auto m = t.get_table("mounting")) {
    path.mounting_heading = angle(*m, "heading");
    path.mounting_pitch = angle(*m, "pitch");
  }
}

void read_sensors(const TomlTable& t, Scenario& s) {
  if (const auto i = t.get_table("imu")) {
    s.imu.rate = positive(*i, "rate", kFrequency, 100.0);
    s.imu.gyro_bias = sigma(*i, "gyro_bias", kAngularRate);
    s.imu.accel_bias = sigma(*i, "accel_bias", kAcceleration);
    s.imu.gyro_noise = sigma(*i, "gyro_noise", kAngleRandomWalk);
    s.imu.accel_noise = sigma(*i, "accel_noise", kVelocityRandomWalk);
    s.imu.gyro_scale = sigma(*i, "gyro_scale", kNone);
    s.imu.accel_scale = sigma(*i, "accel_scale", kNone);
    s.imu.gyro_offset =
        i->get_vector3("gyro_offset", kAngularRate).value_or(std::array<double, 3>{});
    s.imu.accel_offset =
        i->get_vector3("accel_offset", kAcceleration).value_or(std::array<double, 3>{});
  }
  if (const auto o = t.get_table("odometer")) {
    s.odometer.present = true;
    s.odometer.rate = positive(*o, "rate", kFrequency, 10.0);
    s.odometer.pulses = one_of(*o, "kind", {"distance", "pulses"}) == "pulses";
    s.odometer.scale = o->get_quantity("k", kNone).value_or(1.0);
    if (!(s.odometer.scale > 0))
      refuse("expected indicated / true distance, above 0", o->where("k"));
    s.odometer.metres_per_pulse = positive(*o, "scale", kLengthPerPulse, 0.01);
    s.odometer.scale_noise = sigma(*o, "scale_noise", kNone);
    s.odometer.quantisation = sigma(*o, "quantisation", kLength);
  }
  if (const auto a = t.get_table("attitude")) {
    s.attitude.present = true;
    s.attitude.rate = positive(*a, "rate", kFrequency, 20.0);
    s.attitude.heading_bias = sigma(*a, "heading_bias", kAngle);
    s.attitude.heading_drift = sigma(*a, "heading_drift", kAngularRate);
    s.attitude.heading_noise = sigma(*a, "heading_noise", kAngleRandomWalk);
  }
  if (const auto f = t.get_table("fix")) {
    s.fix.present = true;
    s.fix.rate = positive(*f, "rate", kFrequency, 1.0);
    s.fix.position = sigma(*f, "position", kLength);
    s.fix.velocity = sigma(*f, "velocity", kSpeed);
    s.fix.outages = f->get_quantities("outages", kTime).value_or(std::vector<double>{});
    if (s.fix.outages.size() % 2 != 0)
      refuse("expected pairs of times: from, to, from, to …", f->where("outages"));
  }
  if (const auto h = t.get_table("height")) {
    s.height.present = true;
    s.height.rate = positive(*h, "rate", kFrequency, 1.0);
    s.height.height = sigma(*h, "std", kLength);
  }
  if (const auto r = t.get_table("reference"))
    s.reference_rate = positive(*r, "rate", kFrequency, 10.0);
  const double end = s.trajectory.duration();
  for (const auto& b : t.get_tables("benchmark")) {
    ScenarioBenchmark point;
    point.name = b.get_string("name").value_or(std::to_string(s.benchmarks.size() + 1));
    const std::string at = b.need_string("at");
    point.t = at == "start" ? 0 : at == "end" ? end : b.need_quantity("at", kTime);
    if (!(point.t >= 0 && point.t <= end))
      refuse("expected start, end or a time within the " + std::to_string(end) + " s of the legs",
             b.where("at"));
    point.std = sigma(b, "std", kLength);
    s.benchmarks.push_back(point);
  }
  if (const auto e = t.get_table("start_error")) {
    s.start_error = {e->get_quantity("right", kLength).value_or(0.0),
                     e->get_quantity("forward", kLength).value_or(0.0),
                     e->get_quantity("v_right", kSpeed).value_or(0.0),
                     e->get_quantity("v_forward", kSpeed).value_or(0.0),
                     angle(*e, "tilt_right"),
                     angle(*e, "tilt_forward"),
                     angle(*e, "tilt_up")};
  }
}

}  // namespace

Scenario read_scenario(const std::string& path_or_name, const std::vector<std::string>& sets) {
  const std::string* ready = nullptr;
  std::vector<std::string> names;
  for (const auto& s : ready_scenarios()) {
    names.push_back(s.name);
    if (s.name == path_or_name) ready = &s.toml;
  }
  if (ready == nullptr && !std::filesystem::exists(path_or_name))
    throw Error(ErrorKind::kUsage, "no such file and no ready scenario '" + path_or_name + "'" +
                                       suggestion(path_or_name, names) +
                                       " ('loxo simulate --list' shows them)");
  TomlTable t =
      ready != nullptr ? TomlTable::parse(*ready, path_or_name) : TomlTable::read(path_or_name);
  for (const auto& set : sets) {
    const auto equals = set.find('=');
    if (equals == std::string::npos || equals == 0)
      throw Error(ErrorKind::kUsage, "expected key=value, found '" + set + "'", "--set");
    t.set(set.substr(0, equals), set.substr(equals + 1));
  }
  Scenario s;
  if (const auto format = t.get_integer("format").value_or(1); format != 1)
    refuse("expected format = 1, found " + std::to_string(format), t.where("format"));
  s.name = t.get_string("name").value_or(std::filesystem::path(path_or_name).stem().string());
  s.about = t.get_string("about").value_or("");
  if (const auto seed = t.get_integer("seed")) s.seed = static_cast<std::uint64_t>(*seed);
  s.ellipsoid_text = t.get_string("ellipsoid").value_or("WGS84");
  try {
    s.trajectory.ellipsoid = ellipsoid_by_name(s.ellipsoid_text);
  } catch (const Error& e) {
    refuse(e.what(), t.where("ellipsoid"));
  }
  read_path(t, s.trajectory);
  read_sensors(t, s);
  t.refuse_unknown();
  for (const Leg& leg : s.trajectory.legs)
    if (!(std::fabs(leg.speed) <= 1e4))
      refuse("expected a speed of at most 10 km/s, found " + std::to_string(leg.speed) + " m/s",
             t.where("leg"));
  const double samples = s.trajectory.duration() * s.imu.rate;
  if (samples < 2)
    refuse("expected legs of two IMU samples or more, found " + std::to_string(samples),
           t.where("imu"));
  if (samples > 2e8)
    refuse("expected at most 200 million IMU samples, found " + std::to_string(samples),
           t.where("imu"));
  for (const Leg& leg : s.trajectory.legs)
    if (!leg.straight && std::fabs(s.trajectory.start.lat) > 89.9999 * deg)
      refuse("a true course does not exist at a pole; expected path = \"straight\"",
             t.where("leg"));
  return s;
}

}  // namespace loxo
