// SPDX-License-Identifier: Apache-2.0
// The drive on disk of a scenario: what the sensors say along the truth.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/log/drive_folder.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/scenario.hpp"

namespace loxo {
namespace {

// Streams of random numbers, one per source, so that one sensor's settings do not change another's
// noise.
enum : std::uint64_t { kConstants, kImu, kOdometer, kAttitude, kFix, kHeight, kBenchmark };

// Nearer to a pole than this a drive of constant true course is refused: it would turn once round
// in a second or so.
constexpr double kPoleCap = 10;  // m

// Every how many IMU samples a slower sensor speaks.
long every(double imu_rate, double rate) { return std::max(1L, std::lround(imu_rate / rate)); }

std::string start_section(const Scenario& s, const Truth& truth) {
  const auto& e = s.start_error;
  EcefState<double> x = truth.state;
  const auto g = s.trajectory.start;
  const double sine = std::sin(s.trajectory.course), cosine = std::cos(s.trajectory.course);
  const auto axes = transpose(geographic_axes(g.lat, g.lon));
  const auto of_track = [&](double right, double forward, double up) {
    return axes *
           Vec<Geographic>{cosine * right + sine * forward, cosine * forward - sine * right, up};
  };
  x.r = x.r + of_track(e.right, e.forward, 0);
  x.v += of_track(e.v_right, e.v_forward, 0);
  x.q_eb = exp_rotation<Ecef, Ecef>(-of_track(e.tilt_right, e.tilt_forward, e.tilt_up)) * x.q_eb;
  return fmt::format(
      "\n[start]\nstate = {{ t_s = 0, x_m = {}, y_m = {}, z_m = {}, vx_mps = {}, vy_mps = {}, "
      "vz_mps = {}, qw = {}, qx = {}, "
      "qy = {}, qz = {} }}\n",
      number_text(x.r.x), number_text(x.r.y), number_text(x.r.z), number_text(x.v.x),
      number_text(x.v.y), number_text(x.v.z), number_text(x.q_eb.w), number_text(x.q_eb.x),
      number_text(x.q_eb.y), number_text(x.q_eb.z));
}

std::string sections(const Scenario& s) {
  ErrorsLine imu;
  imu.add("gyro_bias", s.imu.gyro_bias, "rad/s");
  imu.add("gyro_noise", s.imu.gyro_noise, "rad/sqrt(s)");
  imu.add("accel_bias", s.imu.accel_bias, "m/s^2");
  imu.add("accel_noise", s.imu.accel_noise, "m/s/sqrt(s)");
  imu.add("gyro_scale", s.imu.gyro_scale, "");
  imu.add("accel_scale", s.imu.accel_scale, "");
  std::string toml = imu_increment_section(imu);
  if (s.odometer.present) {
    toml += s.odometer.pulses ? fmt::format(
                                    "\n[odometer]\nfile = \"odometer.csv\"\nkind = "
                                    "\"pulses\"\ncolumns = {{ time = \"t_s\", value = "
                                    "\"pulses\" }}\nscale = \"{} m/pulse\"\n",
                                    number_text(s.odometer.metres_per_pulse))
                              : "\n[odometer]\nfile = \"odometer.csv\"\nkind = "
                                "\"distance\"\ncolumns = { time = \"t_s\", value = \"ds_m\" }\n";
    ErrorsLine e;
    e.add("scale_noise", s.odometer.scale_noise, "");
    e.add("quantisation", s.odometer.pulses ? s.odometer.metres_per_pulse : s.odometer.quantisation,
          "m");
    toml += e.line();
  }
  if (s.attitude.present) {
    toml +=
        "\n[attitude]\nfile = \"attitude.csv\"\ncolumns = { time = \"t_s\", heading = "
        "\"heading_deg\", pitch = \"pitch_deg\", "
        "roll = \"roll_deg\" }\n";
    ErrorsLine e;
    e.add("heading_bias", s.attitude.heading_bias, "rad");
    e.add("heading_drift", s.attitude.heading_drift, "rad/s");
    e.add("heading_noise", s.attitude.heading_noise, "rad/sqrt(s)");
    toml += e.line();
  }
  if (s.fix.present) {
    toml +=
        "\n[fix]\nfile = \"fix.csv\"\ncolumns = { time = \"t_s\", lat = \"lat_deg\", lon = "
        "\"lon_deg\", height = \"h_m\", ve = "
        "\"ve_mps\", vn = \"vn_mps\", vu = \"vu_mps\" }\n";
    ErrorsLine e;
    e.add("position", s.fix.position, "m");
    e.add("velocity", s.fix.velocity, "m/s");
    toml += e.line();
  }
  if (s.height.present) {
    toml += "\n[height]\nfile = \"height.csv\"\ncolumns = { time = \"t_s\", height = \"h_m\" }\n";
    ErrorsLine e;
    e.add("height", s.height.height, "m");
    toml += e.line();
  }
  toml += reference_section();
  return toml;
}

}  // namespace

SimulatedDrive write_scenario(const Scenario& s, const std::string& folder,
                              const std::function<void(double)>& progress) {
  const Ellipsoid& earth = s.trajectory.ellipsoid;
  const auto file = [&](const char* name) { return folder + "/" + name; };
  const double dt = 1.0 / s.imu.rate;
  const long n = std::lround(s.trajectory.duration() * s.imu.rate);
  const long odometer_every = every(s.imu.rate, s.odometer.rate),
             attitude_every = every(s.imu.rate, s.attitude.rate),
             fix_every = every(s.imu.rate, s.fix.rate),
             height_every = every(s.imu.rate, s.height.rate),
             reference_every = every(s.imu.rate, s.reference_rate);

  const auto constants = Stream<double>{s.seed, 0, kConstants}.normals<14>(0);
  const auto drawn = [&](std::size_t first, double sigma) {
    return Vec<Body>{sigma * constants[first], sigma * constants[first + 1],
                     sigma * constants[first + 2]};
  };
  const auto& go = s.imu.gyro_offset;
  const auto& ao = s.imu.accel_offset;
  const Vec<Body> gyro = drawn(0, s.imu.gyro_bias) + Vec<Body>{go[0], go[1], go[2]},
                  accel = drawn(3, s.imu.accel_bias) + Vec<Body>{ao[0], ao[1], ao[2]},
                  gyro_k = drawn(6, s.imu.gyro_scale), accel_k = drawn(9, s.imu.accel_scale);
  const double heading_bias = s.attitude.heading_bias * constants[12],
               heading_drift = s.attitude.heading_drift * constants[13];

  ChannelWriter imu(file("imu.csv"), kImuIncrementHeader);
  SolutionWriter reference(file("reference.csv"), {{"mode", "truth"}, {"ellipsoid", earth.name}});
  std::vector<ChannelWriter> odometer, attitude, fix, height;
  if (s.odometer.present)
    odometer.emplace_back(file("odometer.csv"), s.odometer.pulses ? "t_s,pulses" : "t_s,ds_m");
  if (s.attitude.present)
    attitude.emplace_back(file("attitude.csv"), "t_s,heading_deg,pitch_deg,roll_deg");
  if (s.fix.present)
    fix.emplace_back(file("fix.csv"), "t_s,lat_deg,lon_deg,h_m,ve_mps,vn_mps,vu_mps");
  if (s.height.present) height.emplace_back(file("height.csv"), "t_s,h_m");

  SimulatedDrive made;
  std::string benchmarks;
  TrajectoryWalk walk(s.trajectory);
  const std::string start = start_section(s, walk.truth());
  double told = 0, last_distance = 0, indicated = 0,
         wander = 0;  // odometer's steps written; heading's random walk
  const double grain = s.odometer.pulses ? s.odometer.metres_per_pulse : s.odometer.quantisation;
  for (long i = 0; i <= n; ++i) {
    const double t = static_cast<double>(i) / s.imu.rate;
    const auto k = static_cast<std::uint64_t>(i);
    if (i > 0) {
      const auto u = walk.to(t);
      double noise[6]{};
      if (s.imu.gyro_noise > 0 || s.imu.accel_noise > 0)
        Stream<double>{s.seed, 0, kImu}.fill(k, noise, 6);
      const double a = s.imu.gyro_noise * std::sqrt(dt), b = s.imu.accel_noise * std::sqrt(dt);
      imu.row({t, u.dtheta.x * (1 + gyro_k.x) + gyro.x * dt + a * noise[0],
               u.dtheta.y * (1 + gyro_k.y) + gyro.y * dt + a * noise[1],
               u.dtheta.z * (1 + gyro_k.z) + gyro.z * dt + a * noise[2],
               u.dv.x * (1 + accel_k.x) + accel.x * dt + b * noise[3],
               u.dv.y * (1 + accel_k.y) + accel.y * dt + b * noise[4],
               u.dv.z * (1 + accel_k.z) + accel.z * dt + b * noise[5]});
      ++made.samples;
    }
    const bool surveyed = [&] {
      for (const auto& p : s.benchmarks)
        if (std::lround(p.t * s.imu.rate) == i) return true;
      return false;
    }();
    const bool speaks = i % odometer_every == 0 || i % attitude_every == 0 || i % fix_every == 0 ||
                        i % height_every == 0 || i % reference_every == 0 || surveyed || i == n;
    if (!speaks) continue;
    const Truth truth = walk.truth();
    const SolutionRow row =
        solution_row(earth, truth.t, truth.state.r, truth.state.v, truth.state.q_eb);
    if (!(std::fabs(truth.h) < 1e5) || !std::isfinite(truth.state.v.x))
      throw Error(ErrorKind::kInput,
                  fmt::format("the trajectory is lost at {} s: expected a vehicle near the ground",
                              number_text(t)),
                  s.name);
    if (walk.true_course() && std::hypot(truth.state.r.x, truth.state.r.y) < kPoleCap)
      throw Error(ErrorKind::kInput,
                  fmt::format("the leg keeps a true course, which a pole does not have, and passes "
                              "one within {} m at {} s; "
                              "expected path = \"straight\"",
                              number_text(kPoleCap), number_text(t)),
                  s.name);
    if (i % reference_every == 0 || i == n) reference.write(row);
    if (s.odometer.present && i > 0 && i % odometer_every == 0) {
      const double noise =
          s.odometer.scale_noise > 0
              ? s.odometer.scale_noise * Stream<double>{s.seed, 0, kOdometer}.normal(k)
              : 0;
      indicated += (truth.distance - last_distance) * s.odometer.scale * (1 + noise);
      last_distance = truth.distance;
      // Whole steps of the running sum: the remainder is not lost.
      const double now = grain > 0 ? std::floor(indicated / grain + 1e-9) : indicated;
      odometer[0].row({t, (now - told) * (grain > 0 && !s.odometer.pulses ? grain : 1.0)});
      told = now;
    }
    if (s.attitude.present && i % attitude_every == 0) {
      if (s.attitude.heading_noise > 0 && i > 0)
        wander += s.attitude.heading_noise * std::sqrt(dt * static_cast<double>(attitude_every)) *
                  Stream<double>{s.seed, 0, kAttitude}.normal(k);
      const double heading = row.heading + heading_bias + heading_drift * t + wander;
      attitude[0].row({t, heading / deg - 360 * std::floor(heading / (2 * kPi)), row.pitch / deg,
                       row.roll / deg});
    }
    const auto axes = transpose(geographic_axes(row.lat, row.lon));
    if (s.fix.present && i % fix_every == 0) {
      bool out = false;
      for (std::size_t j = 0; j + 1 < s.fix.outages.size(); j += 2)
        out = out || (t >= s.fix.outages[j] && t < s.fix.outages[j + 1]);
      if (!out) {
        const auto w = Stream<double>{s.seed, 0, kFix}.normals<6>(k);
        const double p = s.fix.position, v = s.fix.velocity;
        const auto g = to_geodetic(
            earth, truth.state.r + axes * Vec<Geographic>{p * w[0], p * w[1], p * w[2]});
        fix[0].row({t, g.lat / deg, g.lon / deg, g.h, row.ve + v * w[3], row.vn + v * w[4],
                    row.vu + v * w[5]});
        ++made.fixes;
      }
    }
    if (s.height.present && i % height_every == 0)
      height[0].row({t, row.h + s.height.height * Stream<double>{s.seed, 0, kHeight}.normal(k)});
    for (std::size_t j = 0; surveyed && j < s.benchmarks.size(); ++j) {
      const auto& point = s.benchmarks[j];
      if (std::lround(point.t * s.imu.rate) != i) continue;
      const auto w = Stream<double>{s.seed, 0, kBenchmark}.normals<3>(j);
      const auto g = to_geodetic(
          earth, truth.state.r +
                     axes * Vec<Geographic>{point.std * w[0], point.std * w[1], point.std * w[2]});
      benchmarks += benchmark_section(
          {point.name, {.t = t, .lat = g.lat, .lon = g.lon, .h = g.h, .std = point.std}});
      ++made.benchmarks;
    }
    if (progress) progress(t);
  }
  made.duration = static_cast<double>(n) * dt;
  made.distance = walk.truth().distance;
  imu.commit();
  reference.commit();
  for (auto* files : {&odometer, &attitude, &fix, &height})
    for (ChannelWriter& csv : *files) csv.commit();
  OutputFile toml(file("drive.toml"));
  toml.write(fmt::format("# Simulated; seed {}.\nformat = 1\nname = \"{}\"\nellipsoid = \"{}\"\n",
                         s.seed, s.name, s.ellipsoid_text) +
             sections(s) + benchmarks + start);
  toml.commit();
  return made;
}

}  // namespace loxo
