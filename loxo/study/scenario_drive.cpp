// SPDX-License-Identifier: Apache-2.0
// The drive on disk of a scenario: what the sensors say along the truth.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/ins/increments.hpp"
#include "loxo/log/drive_folder.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/scenario.hpp"

namespace loxo {
namespace {

// Nearer to a pole than this a drive of constant true course is refused: it would turn once round
// in a second or so.
constexpr double kPoleCap = 10;  // m

std::string wrong_start(const Scenario& s, const Truth& truth) {
  const auto& e = s.start_error;
  EcefState<double> x = truth.state;
  const Vec<Ecef> right_axis = cross(truth.forward, truth.up);
  const auto of_track = [&](double right, double forward, double up) {
    return right * right_axis + forward * truth.forward + up * truth.up;
  };
  x.r = x.r + of_track(e.right, e.forward, 0);
  x.v += of_track(e.v_right, e.v_forward, 0);
  x.q_eb = exp_rotation<Ecef, Ecef>(-of_track(e.tilt_right, e.tilt_forward, e.tilt_up)) * x.q_eb;
  // What is wrong with it is declared as a data sheet would: 1 sigma of each axis.
  const auto each = [](double a, double b) { return std::hypot(a, b) / std::sqrt(2.0); };
  return start_section(0, x.r, x.v, x.q_eb, each(e.right, e.forward), each(e.v_right, e.v_forward),
                       each(e.tilt_right, e.tilt_forward), std::fabs(e.tilt_up));
}

std::string vector_of(const Vec<Body>& v, const char* unit) {
  return fmt::format("\"{} {} {} {}\"", number_text(v.x), number_text(v.y), number_text(v.z), unit);
}

// A triad's bias as a data sheet says it: constant, slow part, over the range of temperature.
double declared_bias(const TriadModel<>& m, const ImuSurroundings& around, double more = 0) {
  const double range =
      std::max(std::fabs(around.temperature_from), std::fabs(around.temperature_to));
  return std::hypot(std::hypot(m.bias, m.markov), std::hypot(m.temperature * range, more));
}

// What a user knows of the sensors: the drive's declaration, part by part. Slow parts of a bias are
// declared with its constant.
std::string sections(const Scenario& s) {
  const auto& gyro = s.imu.errors.gyro;
  const auto& accel = s.imu.errors.accel;
  ErrorsLine imu;
  imu.add("gyro_bias", declared_bias(gyro, s.imu.around, s.imu.errors.g_sensitivity * 9.8),
          "rad/s");
  imu.add("gyro_noise", gyro.noise, "rad/sqrt(s)");
  if (gyro.markov > 0) imu.add("gyro_bias_tau", s.imu.around.gyro_markov_time, "s");
  imu.add("accel_bias", declared_bias(accel, s.imu.around), "m/s^2");
  imu.add("accel_noise", accel.noise, "m/s/sqrt(s)");
  if (accel.markov > 0) imu.add("accel_bias_tau", s.imu.around.accel_markov_time, "s");
  imu.add("gyro_scale", gyro.scale, "");
  imu.add("accel_scale", accel.scale, "");
  imu.add("gyro_misalignment", gyro.misalignment, "rad");
  std::string toml = imu_increment_section(imu);
  if (s.imu.rates)
    toml = fmt::format(
        "\n[imu]\nfile = \"imu.csv\"\nkind = \"rate\"\nstamp = \"{}\"\naxes = \"RFU\"\ncolumns = "
        "{{ "
        "time = \"t_s\", gyro = [\"wx_radps\", \"wy_radps\", \"wz_radps\"], accel = "
        "[\"fx_mps2\", \"fy_mps2\", \"fz_mps2\"] }}\n{}",
        s.imu.stamp, imu.line());
  if (s.odometer.present) {
    const auto& o = s.odometer;
    toml += o.pulses ? fmt::format(
                           "\n[odometer]\nfile = \"odometer.csv\"\nkind = "
                           "\"pulses\"\ncolumns = {{ time = \"t_s\", value = "
                           "\"pulses\" }}\nscale = \"{} m/pulse\"\n",
                           number_text(o.metres_per_pulse))
                     : "\n[odometer]\nfile = \"odometer.csv\"\nkind = "
                       "\"distance\"\ncolumns = { time = \"t_s\", value = \"ds_m\" }\n";
    // The angles in use until calibrated; what they really are is what a calibration finds.
    toml += "mounting = { heading = \"0 deg\", pitch = \"0 deg\" }\n";
    if (o.declared && o.delay > 0) toml += fmt::format("delay = \"{} s\"\n", number_text(o.delay));
    if (o.declared && dot(o.lever, o.lever) > 0)
      toml += "lever_arm = " + vector_of(o.lever, "m") + "\n";
    ErrorsLine e;
    e.add("scale_noise", o.errors.scale_noise, "");
    e.add("noise", o.errors.noise, "m");
    e.add("distance_noise", o.errors.distance_noise, "m/sqrt(m)");
    e.add("quantisation", o.errors.quantisation, "m");
    e.add("scale", o.errors.scale_error, "");
    toml += e.line();
  }
  if (s.attitude.present) {
    toml +=
        "\n[attitude]\nfile = \"attitude.csv\"\ncolumns = { time = \"t_s\", heading = "
        "\"heading_deg\", pitch = \"pitch_deg\", "
        "roll = \"roll_deg\" }\n";
    ErrorsLine e;
    e.add("heading_bias", s.attitude.heading.bias, "rad");
    e.add("heading_drift", s.attitude.heading.drift, "rad/s");
    e.add("heading_noise", s.attitude.heading.walk, "rad/sqrt(s)");
    toml += e.line();
  }
  if (s.fix.present) {
    toml +=
        "\n[fix]\nfile = \"fix.csv\"\ncolumns = { time = \"t_s\", lat = \"lat_deg\", lon = "
        "\"lon_deg\", height = \"h_m\", ve = "
        "\"ve_mps\", vn = \"vn_mps\", vu = \"vu_mps\" }\n";
    if (s.fix.delay > 0) toml += fmt::format("delay = \"{} s\"\n", number_text(s.fix.delay));
    if (dot(s.fix.lever, s.fix.lever) > 0)
      toml += "lever_arm = " + vector_of(s.fix.lever, "m") + "\n";
    ErrorsLine e;
    e.add("position", std::hypot(s.fix.position, s.fix.wander), "m");
    e.add("velocity", s.fix.velocity, "m/s");
    toml += e.line();
  }
  const auto channel = [&](const ScenarioChannel& c, const char* section, const char* columns,
                           const char* key, const char* unit) {
    if (!c.present) return;
    toml += fmt::format("\n[{0}]\nfile = \"{0}.csv\"\ncolumns = {{ time = \"t_s\", {1} }}\n",
                        section, columns);
    ErrorsLine e;
    const double slow = std::hypot(c.errors.bias, c.errors.markov);
    // A filter of the height has a state for what lasts; the others take it for noise.
    const bool apart = &c == &s.height && c.errors.noise > 0;
    e.add(key, apart ? c.errors.noise : std::hypot(c.errors.noise, slow), unit);
    if (apart) {
      e.add("bias", slow, unit);
      if (c.errors.markov > 0) e.add("bias_tau", c.errors.markov_time, "s");
    }
    toml += e.line();
  };
  channel(s.height, "height", "height = \"h_m\"", "height", "m");
  channel(s.heading, "heading", "heading = \"heading_deg\"", "heading", "rad");
  channel(s.velocity, "velocity", "velocity = [\"vx_mps\", \"vy_mps\", \"vz_mps\"]", "velocity",
          "m/s");
  toml += reference_section();
  return toml;
}

bool in_outage(const std::vector<double>& outages, double t) {
  for (std::size_t j = 0; j + 1 < outages.size(); j += 2)
    if (t >= outages[j] && t < outages[j + 1]) return true;
  return false;
}

// A vehicle that is not near the ground, or turns on the spot round a pole, is no vehicle.
void check_truth(const Scenario& s, const Truth& truth, bool true_course) {
  if (!(std::fabs(truth.h) < 1e5) || !std::isfinite(truth.state.v.x))
    throw Error(ErrorKind::kInput,
                fmt::format("the trajectory is lost at {} s: expected a vehicle near the ground",
                            number_text(truth.t)),
                s.name);
  if (true_course && std::hypot(truth.state.r.x, truth.state.r.y) < kPoleCap)
    throw Error(ErrorKind::kInput,
                fmt::format("the leg keeps a true course, which a pole does not have, and passes "
                            "one within {} m at {} s; "
                            "expected path = \"straight\"",
                            number_text(kPoleCap), number_text(truth.t)),
                s.name);
}

// One file of a slower sensor: when it speaks, and what it says of the truth.
class Speaker {
 public:
  Speaker(bool present, const Scenario& s, double rate, const std::string& path,
          const std::string& header)
      : every_(samples_between(s.imu.rate, rate)) {
    if (present) file_.emplace_back(path, header);
  }
  bool at(long i) const { return !file_.empty() && i % every_ == 0; }
  double interval(const Scenario& s) const { return static_cast<double>(every_) / s.imu.rate; }
  void row(std::initializer_list<double> values) {
    file_[0].row(values);
    ++count_;
  }
  std::uint64_t count() const { return count_; }
  void commit() {
    for (auto& f : file_) f.commit();
  }

 private:
  long every_;
  std::uint64_t count_ = 0;
  std::vector<ChannelWriter> file_;
};

// GNSS: white noise, a wandering part, gross errors.
class FixSensor {
 public:
  explicit FixSensor(const Scenario& s) : s_(s) {
    ChannelModel<double> wander;
    wander.markov = s.fix.wander;
    wander.markov_time = s.fix.wander_time;
    for (std::uint64_t k = 0; k < 3; ++k)
      wander_.emplace_back(wander, noise_source::kFixSlow, k, s.seed, 0);
  }
  // Errors of position [m] and velocity [m/s], east, north, up, of fix k (0, 1, 2 … in turn).
  void errors(std::uint64_t k, double t, double dt, Vec<Geographic>& position,
              Vec<Geographic>& velocity) {
    const auto& f = s_.fix;
    const Stream<double> stream{s_.seed, 0, noise_source::kFix};
    const auto w = stream.normals<9>(k);
    position = {f.position * w[0], f.position * w[1], f.position * w[2]};
    velocity = {f.velocity * w[3], f.velocity * w[4], f.velocity * w[5]};
    double slow[3];
    for (std::size_t i = 0; i < 3; ++i) slow[i] = wander_[i].error(k, t, dt);
    position += {slow[0], slow[1], slow[2]};
    if (f.outlier_share > 0 && stream.uniform(k) < f.outlier_share)
      position += f.outlier * Vec<Geographic>{w[6], w[7], w[8]};
    for (std::size_t i = 0; i < f.outliers.size(); ++i) {
      const auto& o = f.outliers[i];
      if (t >= o.t && (k == 0 || t - dt < o.t)) position += {o.east, o.north, o.up};
    }
  }

 private:
  const Scenario& s_;
  std::vector<Channel<double>> wander_;
};

}  // namespace

SimulatedDrive write_scenario(const Scenario& s, const std::string& folder,
                              const std::function<void(double)>& progress) {
  const Ellipsoid& earth = s.trajectory.ellipsoid;
  const auto file = [&](const char* name) { return folder + "/" + name; };
  const double dt = 1.0 / s.imu.rate;
  const long n = std::lround(s.trajectory.duration() * s.imu.rate);
  const long reference_every = samples_between(s.imu.rate, s.reference_rate);

  ImuSensor<double> imu_sensor(s.imu.errors, s.imu.around, dt, s.seed, 0);
  Odometer<double> wheel(s.odometer.errors, s.seed, 0);
  WayMemory memory(s.odometer.delay);
  Channel<double> heading_error(s.attitude.heading, noise_source::kAttitude, 0, s.seed, 0),
      height_error(s.height.errors, noise_source::kHeight, 0, s.seed, 0),
      compass_error(s.heading.errors, noise_source::kHeading, 0, s.seed, 0);
  std::vector<Channel<double>> log_error;
  for (std::uint64_t k = 0; k < 3; ++k)
    log_error.emplace_back(s.velocity.errors, noise_source::kVelocity, k, s.seed, 0);
  const double log_scale =
      1 + s.velocity.scale * Stream<double>{s.seed, 0, noise_source::kVelocity}.normal(1ull << 40);
  FixSensor fixes(s);

  ChannelWriter imu(file("imu.csv"), s.imu.rates
                                         ? "t_s,wx_radps,wy_radps,wz_radps,fx_mps2,fy_mps2,fz_mps2"
                                         : kImuIncrementHeader);
  SolutionWriter reference(file("reference.csv"), {{"mode", "truth"}, {"ellipsoid", earth.name}});
  Speaker odometer(s.odometer.present, s, s.odometer.rate, file("odometer.csv"),
                   s.odometer.pulses ? "t_s,pulses" : "t_s,ds_m"),
      attitude(s.attitude.present, s, s.attitude.rate, file("attitude.csv"),
               "t_s,heading_deg,pitch_deg,roll_deg"),
      fix(s.fix.present, s, s.fix.rate, file("fix.csv"),
          "t_s,lat_deg,lon_deg,h_m,ve_mps,vn_mps,vu_mps"),
      height(s.height.present, s, s.height.rate, file("height.csv"), "t_s,h_m"),
      compass(s.heading.present, s, s.heading.rate, file("heading.csv"), "t_s,heading_deg"),
      log(s.velocity.present, s, s.velocity.rate, file("velocity.csv"), "t_s,vx_mps,vy_mps,vz_mps");

  SimulatedDrive made;
  std::string benchmarks;
  TrajectoryWalk walk(s.trajectory);
  const std::string start = wrong_start(s, walk.truth());
  const bool needs_memory = s.odometer.present && s.odometer.delay > 0;
  double last_way = 0;
  std::uint64_t fix_number = 0, height_number = 0, compass_number = 0, log_number = 0;
  for (long i = 0; i <= n; ++i) {
    const double t = static_cast<double>(i) / s.imu.rate;
    if (i > 0) {
      ImuIncrement<double> u;
      double stamp = t;
      if (s.imu.rates && s.imu.stamp == "instant") {
        walk.to(t);
        const Truth now = walk.truth();
        u = {t, dt, dt * now.w_ib, dt * now.f};
      } else {
        u = walk.to(t);
        if (s.imu.stamp == "middle") stamp = t - 0.5 * dt;
      }
      const double th[3] = {u.dtheta.x, u.dtheta.y, u.dtheta.z}, v[3] = {u.dv.x, u.dv.y, u.dv.z};
      const auto m = imu_sensor.measure(static_cast<std::uint64_t>(i - 1), th, v);
      const double k = s.imu.rates ? s.imu.rate : 1.0;
      imu.row({stamp, k * m.dtheta.x, k * m.dtheta.y, k * m.dtheta.z, k * m.dv.x, k * m.dv.y,
               k * m.dv.z});
      ++made.samples;
    }
    if (needs_memory)
      memory.add(t, walk.wheel_way(s.odometer.lever), walk.wheel_speed(s.odometer.lever));
    const bool surveyed = [&] {
      for (const auto& p : s.benchmarks)
        if (std::lround(p.t * s.imu.rate) == i) return true;
      return false;
    }();
    const bool speaks = odometer.at(i) || attitude.at(i) || fix.at(i) || height.at(i) ||
                        compass.at(i) || log.at(i) || i % reference_every == 0 || surveyed ||
                        i == n;
    if (!speaks) continue;
    const Truth truth = walk.truth();
    check_truth(s, truth, walk.true_course());
    const SolutionRow row =
        solution_row(earth, truth.t, truth.state.r, truth.state.v, truth.state.q_eb);
    if (i % reference_every == 0 || i == n) reference.write(row);
    if (odometer.at(i)) {
      const double way = needs_memory ? memory.way() : walk.wheel_way(s.odometer.lever);
      if (i > 0) {
        const double span = odometer.interval(s), end = t - s.odometer.delay;
        const double told = wheel.reading(odometer.count(), way - last_way,
                                          wheel_factor(s.odometer.faults, end - span, end), span);
        odometer.row(
            {t, s.odometer.pulses ? std::round(told / s.odometer.metres_per_pulse) : told});
      }
      last_way = way;
    }
    if (attitude.at(i)) {
      const double heading =
          row.heading + heading_error.error(attitude.count(), t, attitude.interval(s));
      attitude.row({t, heading / deg - 360 * std::floor(heading / (2 * kPi)), row.pitch / deg,
                    row.roll / deg});
    }
    const auto axes = transpose(geographic_axes(row.lat, row.lon));
    if (fix.at(i)) {
      Vec<Geographic> dp, dv;
      fixes.errors(fix_number++, t, fix.interval(s), dp, dv);
      if (!in_outage(s.fix.outages, t)) {
        const auto g =
            to_geodetic(earth, truth.state.r + rotate(truth.state.q_eb, s.fix.lever) + axes * dp);
        const auto turning = rotate(truth.state.q_eb, cross(walk.earth_rate(), s.fix.lever));
        const auto v = transpose(axes) * turning + dv;
        // A late fix: its stamp says when it arrived.
        fix.row({t + s.fix.delay, g.lat / deg, g.lon / deg, g.h, row.ve + v.x, row.vn + v.y,
                 row.vu + v.z});
        ++made.fixes;
      }
    }
    if (height.at(i)) {
      const double e = height_error.error(height_number++, t, height.interval(s));
      if (!in_outage(s.height.outages, t)) height.row({t, row.h + e});
    }
    if (compass.at(i)) {
      const double h = row.heading + compass_error.error(compass_number++, t, compass.interval(s));
      if (!in_outage(s.heading.outages, t))
        compass.row({t, h / deg - 360 * std::floor(h / (2 * kPi))});
    }
    if (log.at(i)) {
      const Vec<Body> v = rotate(conjugate(truth.state.q_eb), truth.state.v);
      double e[3];
      for (std::size_t j = 0; j < 3; ++j) e[j] = log_error[j].error(log_number, t, log.interval(s));
      ++log_number;
      if (!in_outage(s.velocity.outages, t))
        log.row({t, v.x * log_scale + e[0], v.y * log_scale + e[1], v.z * log_scale + e[2]});
    }
    for (std::size_t j = 0; surveyed && j < s.benchmarks.size(); ++j) {
      const auto& point = s.benchmarks[j];
      if (std::lround(point.t * s.imu.rate) != i) continue;
      const auto w = Stream<double>{s.seed, 0, noise_source::kBenchmark}.normals<3>(j);
      const auto g = to_geodetic(
          earth, truth.state.r +
                     axes * Vec<Geographic>{point.std * w[0], point.std * w[1], point.std * w[2]});
      benchmarks +=
          benchmark_section({point.name, {t, -1, g.lat, g.lon, g.h, point.std, point.std}});
      ++made.benchmarks;
    }
    if (progress) progress(t);
  }
  made.duration = static_cast<double>(n) * dt;
  made.distance = walk.truth().distance;
  imu.commit();
  reference.commit();
  for (auto* f : {&odometer, &attitude, &fix, &height, &compass, &log}) f->commit();
  OutputFile toml(file("drive.toml"));
  toml.write(fmt::format("# Simulated; seed {}.\nformat = 1\nname = \"{}\"\nellipsoid = \"{}\"\n",
                         s.seed, s.name, s.ellipsoid_text) +
             sections(s) + benchmarks + start);
  toml.commit();
  return made;
}

}  // namespace loxo
