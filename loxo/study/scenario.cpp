// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/scenario.hpp"

#include <cmath>
#include <filesystem>

#include "loxo/num/error.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/scenario_keys.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

using enum Dimension;
using namespace scenario_keys;

std::vector<double> outages(const TomlTable& t) {
  auto list = t.get_quantities("outages", kTime).value_or(std::vector<double>{});
  if (list.size() % 2 != 0)
    refuse("expected pairs of times: from, to, from, to …", t.where("outages"));
  return list;
}
Vec<Body> lever_arm(const TomlTable& t) {
  const auto l = t.get_vector3("lever_arm", kLength).value_or(std::array<double, 3>{});
  return {l[0], l[1], l[2]};
}
void offset(const TomlTable& t, const char* key, Dimension d, double* out) {
  const auto o = t.get_vector3(key, d).value_or(std::array<double, 3>{});
  for (std::size_t k = 0; k < 3; ++k) out[k] = o[k];
}

void read_triad(const TomlTable& t, const std::string& name, bool gyro, TriadModel<double>& m,
                double& markov_time, double* constant) {
  const auto key = [&](const char* what) { return name + "_" + what; };
  const Dimension rate = gyro ? kAngularRate : kAcceleration;
  m.bias = sigma(t, key("bias"), rate);
  m.noise = sigma(t, key("noise"), gyro ? kAngleRandomWalk : kVelocityRandomWalk);
  m.walk = sigma(t, key("walk"), gyro ? kRateRandomWalk : kAccelerationRandomWalk);
  m.markov = sigma(t, key("markov"), rate);
  markov_time = positive(t, key("markov_time"), kTime, 3600);
  m.scale = sigma(t, key("scale"), kNone);
  m.misalignment = sigma(t, key("misalignment"), kAngle);
  m.temperature = sigma(t, key("temperature"), gyro ? kRatePerTemperature : kAccelPerTemperature);
  m.quantisation = sigma(t, key("quantisation"), gyro ? kAngle : kSpeed);
  offset(t, key("offset").c_str(), rate, constant);
}

void read_imu(const TomlTable& t, ScenarioImu& imu) {
  imu.rate = positive(t, "rate", kFrequency, 100.0);
  imu.rates = one_of(t, "kind", {"increment", "rate"}) == "rate";
  imu.stamp = one_of(t, "stamp", {"end", "middle", "instant"});
  if (!imu.rates && imu.stamp != "end")
    refuse("increments end at their stamp; expected kind = \"rate\" or stamp = \"end\"",
           t.where("stamp"));
  read_triad(t, "gyro", true, imu.errors.gyro, imu.around.gyro_markov_time, imu.around.gyro_offset);
  read_triad(t, "accel", false, imu.errors.accel, imu.around.accel_markov_time,
             imu.around.accel_offset);
  imu.errors.g_sensitivity = sigma(t, "g_sensitivity", kGSensitivity);
}

// Lines of equal power over the band.
constexpr int kLinesPerBand = 5;
void read_vibration(const TomlTable& t, const ScenarioImu& imu, std::vector<VibrationLine>& lines) {
  const double f = t.need_quantity("frequency", kFrequency);
  const double width = t.get_quantity("width", kFrequency).value_or(0.0);
  if (!(f > 0 && width >= 0 && width < 2 * f))
    refuse("expected a frequency above 0 and a band that does not reach 0 Hz",
           t.where("frequency"));
  const double accel = sigma(t, "accel", kAcceleration), gyro = sigma(t, "gyro", kAngularRate);
  if (accel == 0 && gyro == 0)
    refuse("missing; expected accel or gyro, the rms of the band", t.where("accel"));
  const std::string axes = t.get_string("axes").value_or("xyz");
  VibrationLine line;
  const int n = width > 0 ? kLinesPerBand : 1;
  for (const char c : axes) {
    if (c < 'x' || c > 'z') refuse("expected axes of x, y, z, as \"z\" or \"xy\"", t.where("axes"));
    line.accel[c - 'x'] = accel / loxo::sqrt(n);
    line.gyro[c - 'x'] = gyro / loxo::sqrt(n);
  }
  for (int i = 0; i < n; ++i) {
    // Not at equal distances: the sum does not repeat itself.
    const double x = (i + 0.5 + 0.2 * loxo::sin(9.1 * i)) / n - 0.5;
    line.frequency = f + width * x;
    lines.push_back(line);
  }
  if (lines.size() > 64)
    refuse("more than 64 lines of vibration (a band has " + std::to_string(kLinesPerBand) + ")",
           t.where("frequency"));
  if (f > 50 * imu.rate)
    refuse("a vibration at more than 50 times the IMU's rate", t.where("frequency"));
}

WheelFault read_fault(const TomlTable& t, bool dead) {
  WheelFault f;
  f.from = t.need_quantity("from", kTime);
  f.to = t.need_quantity("to", kTime);
  if (!(f.to > f.from)) refuse("expected a time after 'from'", t.where("to"));
  f.dead = dead;
  if (!dead) f.slip = t.need_quantity("slip", kNone);
  return f;
}

void read_odometer(const TomlTable& t, ScenarioOdometer& o) {
  o.present = true;
  o.rate = positive(t, "rate", kFrequency, 10.0);
  o.pulses = one_of(t, "kind", {"distance", "pulses"}) == "pulses";
  o.metres_per_pulse = positive(t, "scale", kLengthPerPulse, 0.01);
  auto& e = o.errors;
  e.scale = t.get_quantity("k", kNone).value_or(1.0);
  if (!(e.scale > 0)) refuse("expected indicated / true distance, above 0", t.where("k"));
  e.scale_error = sigma(t, "scale_error", kNone);
  e.scale_walk = sigma(t, "scale_walk", kScaleRandomWalk);
  e.scale_markov = sigma(t, "scale_markov", kNone);
  e.markov_time = positive(t, "markov_time", kTime, 600);
  e.scale_noise = sigma(t, "scale_noise", kNone);
  e.noise = sigma(t, "noise", kLength);
  e.distance_noise = sigma(t, "distance_noise", kDistanceRandomWalk);
  e.quantisation = sigma(t, "quantisation", kLength);
  if (o.pulses) e.quantisation = o.metres_per_pulse;
  const double over = positive(t, "wear_distance", kLength, 100e3);
  e.wear = t.get_quantity("wear", kNone).value_or(0.0) / over;
  o.delay = t.get_quantity("delay", kTime).value_or(0.0);
  if (!(o.delay >= 0 && o.delay <= 10)) refuse("expected a delay from 0 to 10 s", t.where("delay"));
  o.lever = lever_arm(t);
  o.declared = t.get_bool("declared").value_or(true);
  for (const auto& f : t.get_tables("slip")) o.faults.push_back(read_fault(f, false));
  for (const auto& f : t.get_tables("dead")) o.faults.push_back(read_fault(f, true));
}

void read_fix(const TomlTable& t, ScenarioFix& f) {
  f.present = true;
  f.rate = positive(t, "rate", kFrequency, 1.0);
  f.position = sigma(t, "position", kLength);
  f.velocity = sigma(t, "velocity", kSpeed);
  f.wander = sigma(t, "wander", kLength);
  f.wander_time = positive(t, "wander_time", kTime, 300);
  f.outlier_share = sigma(t, "outlier_share", kNone);
  if (f.outlier_share > 1) refuse("expected a share from 0 to 1", t.where("outlier_share"));
  f.outlier = sigma(t, "outlier_size", kLength, 100);
  f.outages = outages(t);
  f.delay = t.get_quantity("delay", kTime).value_or(0.0);
  if (!(f.delay >= 0 && f.delay <= 10)) refuse("expected a delay from 0 to 10 s", t.where("delay"));
  f.lever = lever_arm(t);
  for (const auto& o : t.get_tables("outlier"))
    f.outliers.push_back({o.need_quantity("at", kTime),
                          o.get_quantity("east", kLength).value_or(0.0),
                          o.get_quantity("north", kLength).value_or(0.0),
                          o.get_quantity("up", kLength).value_or(0.0)});
}

// `noise`: the name of the white part.
// The white part is `noise` or `std`, as one likes.
ScenarioChannel read_channel(const TomlTable& t, Dimension d) {
  ScenarioChannel c;
  c.present = true;
  c.rate = positive(t, "rate", kFrequency, 1.0);
  c.errors.noise = sigma(t, "noise", d);
  if (const double std = sigma(t, "std", d); std > 0) {
    if (c.errors.noise > 0) refuse("'std' and 'noise' are the same: give one", t.where("std"));
    c.errors.noise = std;
  }
  c.errors.bias = sigma(t, "bias", d);
  c.errors.markov = sigma(t, "markov", d);
  c.errors.markov_time = positive(t, "markov_time", kTime, 300);
  c.outages = outages(t);
  return c;
}

void read_sensors(const TomlTable& t, Scenario& s) {
  if (const auto i = t.get_table("imu")) read_imu(*i, s.imu);
  if (const auto ramp = t.get_table("temperature")) {
    auto& a = s.imu.around;
    a.temperature_from = ramp->get_quantity("from", kTemperature).value_or(0.0);
    a.temperature_to = ramp->get_quantity("to", kTemperature).value_or(a.temperature_from);
    a.ramp_begin = ramp->get_quantity("begin", kTime).value_or(0.0);
    a.ramp_end = ramp->get_quantity("end", kTime).value_or(s.trajectory.duration());
    if (!(a.ramp_end > a.ramp_begin)) refuse("expected a time after 'begin'", ramp->where("end"));
  }
  for (const auto& v : t.get_tables("vibration")) read_vibration(v, s.imu, s.imu.around.vibration);
  if (const auto o = t.get_table("odometer")) read_odometer(*o, s.odometer);
  if (const auto a = t.get_table("attitude")) {
    s.attitude.present = true;
    s.attitude.rate = positive(*a, "rate", kFrequency, 20.0);
    s.attitude.heading.bias = sigma(*a, "heading_bias", kAngle);
    s.attitude.heading.drift = sigma(*a, "heading_drift", kAngularRate);
    s.attitude.heading.walk = sigma(*a, "heading_noise", kAngleRandomWalk);
    s.attitude.heading.noise = sigma(*a, "heading_white", kAngle);
  }
  if (const auto f = t.get_table("fix")) read_fix(*f, s.fix);
  if (const auto h = t.get_table("height")) s.height = read_channel(*h, kLength);
  if (const auto h = t.get_table("heading")) s.heading = read_channel(*h, kAngle);
  if (const auto v = t.get_table("velocity")) {
    s.velocity = read_channel(*v, kSpeed);
    s.velocity.scale = sigma(*v, "scale", kNone);
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
      refuse("expected start, end or a time within the drive's " + std::to_string(end) + " s",
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
  Ellipsoid ellipsoid;
  try {
    ellipsoid = ellipsoid_by_name(s.ellipsoid_text);
  } catch (const Error& e) {
    refuse(e.what(), t.where("ellipsoid"));
  }
  const auto folder = ready != nullptr ? std::filesystem::path(".")
                                       : std::filesystem::path(path_or_name).parent_path();
  s.trajectory = read_trajectory(t, ellipsoid, s.seed, folder.string());
  read_sensors(t, s);
  t.refuse_unknown();
  const double samples = s.trajectory.duration() * s.imu.rate;
  if (samples < 2)
    refuse("expected a drive of two IMU samples or more, found " + std::to_string(samples),
           t.where("imu"));
  if (samples > 2e8)
    refuse("expected at most 200 million IMU samples, found " + std::to_string(samples),
           t.where("imu"));
  return s;
}

long samples_between(double imu_rate, double rate) {
  return std::max(1L, std::lround(imu_rate / rate));
}

}  // namespace loxo
