// SPDX-License-Identifier: Apache-2.0
// A drive with sensor errors: simulated, navigated by the strapdown loop in one of the frames,
// dead-reckoned with its attitude and an odometer, and evaluated against the truth, eight trials at
// a time.
#include <algorithm>
#include <cmath>

#include "loxo/ins/strapdown.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/drive_truth.hpp"
#include "loxo/study/kernel_trial.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

enum P : std::size_t {
  kGyroBias,
  kGyroNoise,
  kGyroWalk,
  kGyroScale,
  kAccelBias,
  kAccelNoise,
  kAccelWalk,
  kAccelScale,
  kHeading,
  kTilt,
  kOdometerScale,
  kOdometerNoise,
  kMounting,
  kParameters
};
constexpr int kParts = 10;  // of the drive, for fans
enum M : std::size_t {
  kHorizontalEnd,
  kHorizontalMax,
  kHorizontalRms,
  kHorizontalPct,
  kEastEnd,
  kNorthEnd,
  kVeEnd,
  kVnEnd,
  kVelocityRms,
  kHeadingEnd,
  kReckonedEnd,
  kReckonedMax,
  kReckonedPct,
  kFan,
  kReckonedFan = kFan + kParts,
  kMetrics = kReckonedFan + kParts
};
// Streams of a trial's random numbers.
enum Source : std::uint64_t { kWhite = 0, kWalk = 1, kConstant = 2, kOdometer = 3 };

template <class S>
Vec<Body, S> vec(const S& x, const S& y, const S& z) {
  return {x, y, z};
}

template <class Mech>
struct DriveKernel {
  EarthModel earth;
  std::shared_ptr<const DriveTruth> truth;

  template <Real S>
  void run(const S* p, std::uint64_t seed, std::uint64_t trial, S* m) const {
    const DriveTruth& t = *truth;
    const double dt = t.dt, root = std::sqrt(dt);
    const Stream<S> white{seed, trial, kWhite}, walk{seed, trial, kWalk},
        odometer{seed, trial, kOdometer};
    const auto c = Stream<S>{seed, trial, kConstant}.template normals<17>(0);
    // Constants of the trial, 1 sigma each as given.
    Vec<Body, S> bias_w = p[kGyroBias] * vec(c[0], c[1], c[2]),
                 bias_f = p[kAccelBias] * vec(c[3], c[4], c[5]);
    const Vec<Body, S> gain_w = p[kGyroScale] * vec(c[6], c[7], c[8]),
                       gain_f = p[kAccelScale] * vec(c[9], c[10], c[11]);
    const S scale = 1.0 + p[kOdometerScale] * c[15], mounting = p[kMounting] * c[16];
    S sin_mount, cos_mount;
    sincos(mounting, sin_mount, cos_mount);
    const S noise_w = p[kGyroNoise] * root, noise_f = p[kAccelNoise] * root;
    const double second = t.epoch_every * dt, root_second = std::sqrt(second);
    const S step_w = p[kGyroWalk] * root_second, step_f = p[kAccelWalk] * root_second;

    // The start: exact position, at rest, attitude wrong by tilts and heading (clockwise +).
    EcefState<S> e;
    const auto& start = t.epochs.front().state;
    e.r = {S(start.r.x), S(start.r.y), S(start.r.z)};
    e.v = {S(start.v.x), S(start.v.y), S(start.v.z)};
    const Quat<Ecef, Body, S> q0{S(start.q_eb.w), S(start.q_eb.x), S(start.q_eb.y),
                                 S(start.q_eb.z)};
    e.q_eb = normalized(q0 * exp_rotation<Body, Body, S>(
                                 vec(p[kTilt] * c[12], p[kTilt] * c[13], -p[kHeading] * c[14])));
    auto nav = Mech::from_ecef(earth, e);
    auto dead = nav;
    auto attitude = nav.q_nb;

    S most(0.0), squares(0.0), speeds(0.0), dead_most(0.0), horizontal(0.0), dead_horizontal(0.0);
    S east(0.0), north(0.0), ve(0.0), vn(0.0), heading(0.0);
    const std::size_t samples = t.steps.size(), epochs = t.epochs.size() - 1;
    std::size_t epoch = 0, tick = 0;
    int until_epoch = t.epoch_every, until_tick = t.odometer_every;
    const int half_tick = t.odometer_every - t.odometer_every / 2;
    const double tick_dt = dt * t.odometer_every, inv_tick_dt = 1.0 / tick_dt;
    for (std::size_t i = 0; i < samples; ++i) {
      const auto n = white.template normals<6>(i);
      const auto& s = t.steps[i];
      const ImuIncrement<S> imu{
          0.0, dt,
          vec(s.th[0] + (gain_w.x * s.th[0] + (bias_w.x * dt + noise_w * n[0])),
              s.th[1] + (gain_w.y * s.th[1] + (bias_w.y * dt + noise_w * n[1])),
              s.th[2] + (gain_w.z * s.th[2] + (bias_w.z * dt + noise_w * n[2]))),
          vec(s.v[0] + (gain_f.x * s.v[0] + (bias_f.x * dt + noise_f * n[3])),
              s.v[1] + (gain_f.y * s.v[1] + (bias_f.y * dt + noise_f * n[4])),
              s.v[2] + (gain_f.z * s.v[2] + (bias_f.z * dt + noise_f * n[5])))};
      nav = step(earth, nav, one_sample(imu));
      --until_tick;
      if (until_tick == half_tick) attitude = nav.q_nb;
      if (until_tick == 0) {
        until_tick = t.odometer_every;
        if (t.odometer_every == 1) attitude = nav.q_nb;
        // Dead reckoning: the way as measured, along the body's forward axis turned by the mounting
        // angle.
        const S way = t.ticks[tick] * scale + p[kOdometerNoise] * odometer.normal(tick);
        ++tick;
        const S v = way * inv_tick_dt;
        dead.q_nb = attitude;
        dead.v = rotate(attitude, vec(v * sin_mount, v * cos_mount, S(0.0)));
        const auto& at = t.epochs[epoch];
        dead = constrained(dead, S(at.h), S(0.0));
        dead.position =
            Mech::advance(earth, dead.position,
                          Mech::half_way(earth, dead.position, dead.v, tick_dt), dead.v, tick_dt);
        // A vehicle on the ground knows its height.
        nav = constrained(nav, S(at.h), S(at.vu));
      }
      if (--until_epoch == 0) {
        until_epoch = t.epoch_every;
        ++epoch;
        const auto w = walk.template normals<6>(epoch);
        bias_w = bias_w + step_w * vec(w[0], w[1], w[2]);
        bias_f = bias_f + step_f * vec(w[3], w[4], w[5]);
        const auto& at = t.epochs[epoch];
        const auto x = Mech::to_ecef(earth, nav), d = Mech::to_ecef(earth, dead);
        const auto along = [](const Vec<Ecef, S>& v, const Vec<Ecef, double>& axis) {
          return v.x * axis.x + v.y * axis.y + v.z * axis.z;
        };
        const Vec<Ecef, S> dr{x.r.x - at.state.r.x, x.r.y - at.state.r.y, x.r.z - at.state.r.z};
        const Vec<Ecef, S> dd{d.r.x - at.state.r.x, d.r.y - at.state.r.y, d.r.z - at.state.r.z};
        const Vec<Ecef, S> dv{x.v.x - at.state.v.x, x.v.y - at.state.v.y, x.v.z - at.state.v.z};
        east = along(dr, at.east), north = along(dr, at.north);
        ve = along(dv, at.east), vn = along(dv, at.north);
        const S h2 = east * east + north * north;
        horizontal = sqrt(h2);
        most = max(horizontal, most);
        squares = squares + h2;
        speeds = speeds + (ve * ve + vn * vn);
        const S de = along(dd, at.east), dn = along(dd, at.north);
        dead_horizontal = sqrt(de * de + dn * dn);
        dead_most = max(dead_horizontal, dead_most);
        const std::size_t before = (epoch - 1) * kParts / epochs, now = epoch * kParts / epochs;
        for (std::size_t k = before; k < now; ++k)
          m[kFan + k] = horizontal, m[kReckonedFan + k] = dead_horizontal;
        if (epoch == epochs) {
          const auto& q = at.state.q_eb;
          const Quat<Body, Ecef, S> back{S(q.w), S(-q.x), S(-q.y), S(-q.z)};
          const auto off = back * x.q_eb;
          heading = wrap_pi(-2.0 * atan2(off.z, off.w));
        }
      }
    }
    const double count = static_cast<double>(epochs), distance = t.epochs.back().distance;
    m[kHorizontalEnd] = horizontal;
    m[kHorizontalMax] = most;
    m[kHorizontalRms] = sqrt(squares * (1.0 / count));
    // Of the way; a vehicle that stands has none.
    const double percent = distance > 1.0 ? 100.0 / distance : 0.0;
    m[kHorizontalPct] = percent * horizontal;
    m[kEastEnd] = east, m[kNorthEnd] = north, m[kVeEnd] = ve, m[kVnEnd] = vn;
    m[kVelocityRms] = sqrt(speeds * (1.0 / count));
    m[kHeadingEnd] = heading;
    m[kReckonedEnd] = dead_horizontal;
    m[kReckonedMax] = dead_most;
    m[kReckonedPct] = percent * dead_horizontal;
  }
};

template <class Mech>
std::unique_ptr<TrialKind> make(const EarthModel& earth, std::shared_ptr<const DriveTruth> truth,
                                const std::string& canonical) {
  const double most = 1e3;
  std::vector<ParameterInfo> p = {
      {"gyro_bias", "radps", Dimension::kAngularRate, 0.01 * deg_per_h,
       "1 sigma of each gyro's constant bias", 0.0, most},
      {"gyro_noise", "radpsqrts", Dimension::kAngleRandomWalk, 0.001 * deg_per_sqrt_h,
       "angle random walk", 0.0, most},
      {"gyro_walk", "radpspsqrts", Dimension::kRateRandomWalk, 0.0, "rate random walk", 0.0, most},
      {"gyro_scale", "", Dimension::kNone, 0.0, "1 sigma of each gyro's scale error", 0.0, 1.0},
      {"accel_bias", "mps2", Dimension::kAcceleration, 10.0 * ug,
       "1 sigma of each accelerometer's constant bias", 0.0, most},
      {"accel_noise", "mpspsqrts", Dimension::kVelocityRandomWalk, 5.0 * ug_per_sqrt_hz,
       "velocity random walk", 0.0, most},
      {"accel_walk", "mps2psqrts", Dimension::kAccelerationRandomWalk, 0.0,
       "acceleration random walk", 0.0, most},
      {"accel_scale", "", Dimension::kNone, 0.0, "1 sigma of each accelerometer's scale error", 0.0,
       1.0},
      {"heading_error", "rad", Dimension::kAngle, 0.0, "1 sigma of the initial heading", 0.0, kPi},
      {"tilt_error", "rad", Dimension::kAngle, 0.0, "1 sigma of each initial tilt", 0.0, 1.0},
      {"odometer_scale", "", Dimension::kNone, 0.0, "1 sigma of the scale left by calibration", 0.0,
       0.9},
      {"odometer_noise", "m", Dimension::kLength, 0.0,
       "1 sigma of the way of one odometer interval", 0.0, most},
      {"mounting", "rad", Dimension::kAngle, 0.0,
       "1 sigma of the mounting angle left by calibration", 0.0, kPi},
  };
  std::vector<MetricInfo> m = {
      {"horizontal_end_m", "inertial: horizontal error at the end"},
      {"horizontal_max_m", "inertial: largest horizontal error"},
      {"horizontal_rms_m", "inertial: root mean square over the drive"},
      {"horizontal_end_pct", "inertial: error at the end in percent of the distance"},
      {"east_end_m", "inertial: error to the east at the end"},
      {"north_end_m", "inertial: error to the north at the end"},
      {"ve_end_mps", "inertial: east velocity error at the end"},
      {"vn_end_mps", "inertial: north velocity error at the end"},
      {"velocity_rms_mps", "inertial: root mean square velocity error"},
      {"heading_end_rad", "inertial: heading error at the end, clockwise"},
      {"reckoned_end_m", "dead reckoning: horizontal error at the end"},
      {"reckoned_max_m", "dead reckoning: largest horizontal error"},
      {"reckoned_end_pct", "dead reckoning: error at the end in percent of the distance"},
  };
  for (const char* which : {"horizontal", "reckoned"})
    for (int k = 1; k <= kParts; ++k)
      m.push_back(
          {std::string(which) + "_at_" + (k < 10 ? "0" : "") + std::to_string(10 * k) + "_m",
           std::string(which) + " error after " + std::to_string(10 * k) + " % of the time"});
  return std::make_unique<KernelTrial<DriveKernel<Mech>>>(
      DriveKernel<Mech>{earth, std::move(truth)}, p, m, canonical, 8);
}

}  // namespace

std::unique_ptr<TrialKind> make_drive_trial(const TomlTable& settings) {
  const DriveSettings s = read_drive_settings(settings);
  const std::string ellipsoid = settings.get_string("ellipsoid").value_or("WGS84");
  const double meridian = settings.get_quantity("meridian", Dimension::kAngle).value_or(0.0);
  const std::string frame = settings.get_string("frame").value_or("geographic");
  const std::vector<std::string> frames{"geographic", "transverse", "grid", "wander", "ecef"};
  if (std::find(frames.begin(), frames.end(), frame) == frames.end())
    throw Error(ErrorKind::kInput, "unknown frame '" + frame + "'" + suggestion(frame, frames),
                settings.where("frame"));
  const EarthModel earth = make_earth_model(ellipsoid_by_name(ellipsoid), meridian);
  char numbers[400];
  std::snprintf(numbers, sizeof numbers, "%a %a %a %a %a %a %d %a %a %a", s.lat, s.lon, s.heading,
                s.speed, s.duration, s.imu_rate, s.odometer_every, s.weave_angle, s.weave_period,
                meridian);
  const std::string canonical =
      "frame=" + frame + " route=" + s.route + " ellipsoid=" + ellipsoid + " " + numbers;
  auto truth = std::make_shared<const DriveTruth>(drive(earth, s));
  if (frame == "geographic") return make<GeographicMechanization>(earth, truth, canonical);
  if (frame == "transverse") return make<TransverseMechanization>(earth, truth, canonical);
  if (frame == "grid") return make<GridMechanization>(earth, truth, canonical);
  if (frame == "wander") return make<WanderMechanization>(earth, truth, canonical);
  return make<EcefMechanization>(earth, truth, canonical);
}

}  // namespace loxo
