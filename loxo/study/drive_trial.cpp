// SPDX-License-Identifier: Apache-2.0
// A drive with sensor errors: simulated, navigated by the strapdown loop in one of the frames,
// dead-reckoned, calibrated, filtered, and evaluated against the truth, eight trials at a time. The
// errors are those of sim/, the navigation that of ins/, estimate/ and calibrate/.
#include <algorithm>
#include <cstdio>
#include <optional>

#include "loxo/ins/strapdown.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/filter_trial.hpp"
#include "loxo/study/kernel_trial.hpp"
#include "loxo/study/navigator_trial.hpp"
#include "loxo/study/replay_trial.hpp"
#include "loxo/study/segmented_trial.hpp"
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
  kGyroMarkov,
  kGyroMisalignment,
  kGyroTemperature,
  kGyroQuantisation,
  kGSensitivity,
  kAccelMarkov,
  kAccelMisalignment,
  kAccelTemperature,
  kAccelQuantisation,
  kOdometerScaleNoise,
  kOdometerScaleWalk,
  kOdometerScaleMarkov,
  kOdometerDistanceNoise,
  kOdometerQuantisation,
  kSideSlip,
  kMountingPitch,
  kBenchmarkStd,
  kFixStd,
  kHeightStd,
  kOdometerPreset,
  kMountingPreset,
  kParameters
};
constexpr std::size_t kParts = 10;  // of the drive, for fans
// Offsets within the metrics of a mode.
enum Inertial : std::size_t {
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
  kInertialFan,
  kInertialCount = kInertialFan + kParts
};
enum Reckoned : std::size_t {
  kReckonedEnd,
  kReckonedMax,
  kReckonedPct,
  kReckonedFan,
  kReckonedCount = kReckonedFan + kParts
};

template <class Mech>
struct DriveKernel {
  EarthModel earth;
  std::shared_ptr<const DriveSetup> setup;

  template <Real S>
  static ImuModel<S> imu_model(const S* p) {
    ImuModel<S> m;
    m.gyro = {p[kGyroBias],  p[kGyroNoise],        p[kGyroWalk],        p[kGyroMarkov],
              p[kGyroScale], p[kGyroMisalignment], p[kGyroTemperature], p[kGyroQuantisation]};
    m.accel = {p[kAccelBias],  p[kAccelNoise],        p[kAccelWalk],        p[kAccelMarkov],
               p[kAccelScale], p[kAccelMisalignment], p[kAccelTemperature], p[kAccelQuantisation]};
    m.g_sensitivity = p[kGSensitivity];
    return m;
  }
  template <Real S>
  static OdometerModel<S> odometer_model(const S* p) {
    OdometerModel<S> m;
    m.scale = 1.0 + p[kOdometerPreset];
    m.scale_error = p[kOdometerScale];
    m.scale_walk = p[kOdometerScaleWalk];
    m.scale_markov = p[kOdometerScaleMarkov];
    m.noise = p[kOdometerNoise];
    m.scale_noise = p[kOdometerScaleNoise];
    m.distance_noise = p[kOdometerDistanceNoise];
    m.quantisation = p[kOdometerQuantisation];
    return m;
  }

  template <Real S>
  void run(const S* p, std::uint64_t seed, std::uint64_t trial, S* m) const {
    using V = Vec<Body, S>;
    const DriveSetup& set = *setup;
    const DriveTruth& t = set.truth;
    const double dt = t.dt;
    ImuSensor<S> imu(imu_model(p), set.around, dt, seed, trial);
    Odometer<S> odometer(odometer_model(p), seed, trial);
    const auto c = Stream<S>{seed, trial, noise_source::kStart}.template normals<5>(0);
    const Stream<S> slip{seed, trial, noise_source::kOdometer + (std::uint64_t{1} << 8)};

    // The start: exact position, attitude wrong by tilts and heading (clockwise +), and by what the
    // sensors' biases do to an alignment at rest.
    EcefState<S> e;
    const auto& start = t.epochs.front();
    e.r = {S(start.state.r.x), S(start.state.r.y), S(start.state.r.z)};
    e.v = {S(start.state.v.x), S(start.state.v.y), S(start.state.v.z)};
    const auto& q = start.state.q_eb;
    e.q_eb = normalized(
        Quat<Ecef, Body, S>{S(q.w), S(q.x), S(q.y), S(q.z)} *
        exp_rotation<Body, Body, S>(V{p[kTilt] * c[0], p[kTilt] * c[1], -p[kHeading] * c[2]}));
    if (set.static_alignment) {
      // [EST-14]: Phi_E = -a_N/g, Phi_N = a_E/g, Phi_U = (-g_E + w_U Phi_N)/w_N.
      const auto a = rotate(e.q_eb, imu.accel_bias()), g = rotate(e.q_eb, imu.gyro_bias());
      const auto along = [](const Vec<Ecef, S>& v, const Vec<Ecef>& axis) {
        return v.x * axis.x + v.y * axis.y + v.z * axis.z;
      };
      const Vec<Ecef> up = cross(start.east, start.north);
      const double gamma = set.gravity, wn = earth.w_ie * start.north.z, wu = earth.w_ie * up.z;
      const S phi_e = -along(a, start.north) * (1.0 / gamma),
              phi_n = along(a, start.east) * (1.0 / gamma),
              phi_u = (wu * phi_n - along(g, start.east)) * (1.0 / wn);
      const auto axis = [&](double ex, double nx, double ux) {
        return -(phi_e * ex + phi_n * nx + phi_u * ux);
      };
      e.q_eb = normalized(
          exp_rotation<Ecef, Ecef, S>(Vec<Ecef, S>{axis(start.east.x, start.north.x, up.x),
                                                   axis(start.east.y, start.north.y, up.y),
                                                   axis(start.east.z, start.north.z, up.z)}) *
          e.q_eb);
    }
    // Where the vehicle's forward axis is believed to be, body components; side slip turns it.
    const S mounting = p[kMountingPreset] + p[kMounting] * c[3],
            pitching = p[kMountingPitch] * c[4];
    const auto believed = [&](const S& turn) {
      S st, ct, sp, cp;
      sincos(turn, st, ct);
      sincos(pitching, sp, cp);
      const auto mix = [&](double f, double r, double u) {
        return (ct * f + st * r) * cp + sp * u;
      };
      return V{mix(t.forward.x, t.right.x, t.up.x), mix(t.forward.y, t.right.y, t.up.y),
               mix(t.forward.z, t.right.z, t.up.z)};
    };
    V forward = believed(mounting);

    auto nav = Mech::from_ecef(earth, e);
    auto dead = nav;
    auto attitude = nav.q_nb;
    std::optional<TrialFilter<S>> filter;
    std::optional<TrialCalibration<S>> calibration;
    std::optional<TrialSegmented<S>> segmented;
    if (set.modes.filter)
      filter.emplace(set, filter_config(p), e, mounting, pitching, odometer.scale(), seed, trial);
    if (set.modes.calibrate) calibration.emplace(set, mounting, odometer.scale(), seed, trial);
    if (set.modes.segmented)
      segmented.emplace(set, filter_config(p), e, mounting, odometer.scale());
    std::optional<TrialNavigator<S>> navigator;
    if (set.modes.navigator)
      navigator.emplace(set, filter_config(p), e, mounting, pitching, odometer.scale(), seed,
                        trial);
    const bool free = set.modes.inertial || set.modes.reckon || set.modes.calibrate;

    S most(0.0), squares(0.0), speeds(0.0), dead_most(0.0), horizontal(0.0), dead_horizontal(0.0);
    S east(0.0), north(0.0), ve(0.0), vn(0.0), heading(0.0), side(0.0);
    const std::size_t samples = t.steps.size(), epochs = t.epochs.size() - 1;
    std::size_t epoch = 0, tick = 0;
    int until_epoch = t.epoch_every, until_tick = t.odometer_every;
    const int half_tick = t.odometer_every - (t.odometer_every + 1) / 2;
    const int half_epoch = t.epoch_every - std::max(1, t.epoch_every / 2) + 1;
    const double tick_dt = dt * t.odometer_every, inv_tick_dt = 1.0 / tick_dt;
    const bool slips = any(p[kSideSlip] > S(0.0));
    ImuIncrement<S> before{0.0, dt, {}, {}};
    for (std::size_t i = 0; i < samples; ++i) {
      const auto& s = t.steps[i];
      const ImuIncrement<S> u = imu.measure(i, s.th, s.v);
      if (i == 0) before = u;  // its own predecessor: no coning
      if (free) nav = step(earth, nav, one_sample(before, u));
      if (filter) filter->imu(earth, u);
      if (segmented) segmented->imu(static_cast<double>(i + 1) * dt, u);
      if (navigator) navigator->imu(static_cast<double>(i + 1) * dt, u);
      before = u;
      if (--until_tick == half_tick) {
        attitude = nav.q_nb;
        if (filter) filter->half_tick();
        if (calibration) calibration->half_tick(Mech::to_ecef(earth, nav), earth, forward);
      }
      if (until_tick == 0) {
        until_tick = t.odometer_every;
        const auto& truth = t.ticks[tick];
        const S way = odometer.reading(tick, truth.way, truth.factor, tick_dt);
        ++tick;
        const auto& at = t.epochs[epoch];
        if (filter) filter->tick(way, tick_dt);
        if (calibration) calibration->tick(static_cast<double>(i + 1) * dt, way, at.h);
        if (segmented) segmented->tick(static_cast<double>(i + 1) * dt, way);
        if (navigator) navigator->tick(static_cast<double>(i + 1) * dt, way);
        if (free) {
          // Dead reckoning: the way as measured, along the believed forward axis.
          dead.q_nb = attitude;
          dead.v = rotate(attitude, (way * inv_tick_dt) * forward);
          dead = constrained(dead, S(at.h), S(0.0));
          dead.position =
              Mech::advance(earth, dead.position,
                            Mech::half_way(earth, dead.position, dead.v, tick_dt), dead.v, tick_dt);
          // A vehicle on the ground knows its height.
          nav = constrained(nav, S(at.h), S(at.vu));
        }
      }
      if (until_epoch == half_epoch && filter) filter->half_epoch();
      if (--until_epoch == 0) {
        until_epoch = t.epoch_every;
        ++epoch;
        const auto& at = t.epochs[epoch];
        if (slips) {
          side = p[kSideSlip] * slip.normal(epoch);
          forward = believed(mounting + side);
          if (segmented) segmented->slip(side);
          if (navigator) navigator->slip(side);
        }
        const std::size_t from = (epoch - 1) * kParts / epochs, now = epoch * kParts / epochs;
        if (filter) filter->epoch(earth, epoch, side, from, now);
        if (segmented) segmented->epoch(epoch);
        if (navigator) navigator->epoch(static_cast<double>(i + 1) * dt, epoch);
        if (!free) continue;
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
        for (std::size_t k = from; k < now; ++k) {
          if (set.modes.inertial) m[set.at_inertial + kInertialFan + k] = horizontal;
          if (set.modes.reckon) m[set.at_reckon + kReckonedFan + k] = dead_horizontal;
        }
        if (epoch == epochs) {
          const auto& qt = at.state.q_eb;
          const Quat<Body, Ecef, S> back{S(qt.w), S(-qt.x), S(-qt.y), S(-qt.z)};
          const auto off = back * x.q_eb;
          heading = wrap_pi(-2.0 * atan2(off.z, off.w));
        }
      }
    }
    const double count = static_cast<double>(epochs);
    // Of the way; a vehicle that stands has none.
    const double percent = set.percent;
    if (set.modes.inertial) {
      S* o = m + set.at_inertial;
      o[kHorizontalEnd] = horizontal;
      o[kHorizontalMax] = most;
      o[kHorizontalRms] = sqrt(squares * (1.0 / count));
      o[kHorizontalPct] = percent * horizontal;
      o[kEastEnd] = east, o[kNorthEnd] = north, o[kVeEnd] = ve, o[kVnEnd] = vn;
      o[kVelocityRms] = sqrt(speeds * (1.0 / count));
      o[kHeadingEnd] = heading;
    }
    if (set.modes.reckon) {
      S* o = m + set.at_reckon;
      o[kReckonedEnd] = dead_horizontal;
      o[kReckonedMax] = dead_most;
      o[kReckonedPct] = percent * dead_horizontal;
    }
    if (calibration) calibration->result(p[kBenchmarkStd], track_errors(p), m + set.at_calibrate);
    if (filter) filter->result(m + set.at_filter);
    if (segmented) segmented->result(m + set.at_segmented);
    if (navigator) navigator->result(m + set.at_navigator);
  }

  // What a user would declare of this trial's sensors.
  template <Real S>
  static DeclaredErrors<S> filter_config(const S* p) {
    DeclaredErrors<S> d;
    const auto both = [](const S& a, const S& b) { return sqrt(a * a + b * b); };
    d.gyro_noise = p[kGyroNoise];
    d.accel_noise = p[kAccelNoise];
    d.gyro_walk = p[kGyroWalk];
    d.accel_walk = p[kAccelWalk];
    d.gyro_bias = both(p[kGyroBias], p[kGyroMarkov]);
    d.accel_bias = both(p[kAccelBias], p[kAccelMarkov]);
    d.gyro_scale = p[kGyroScale];
    d.accel_scale = p[kAccelScale];
    d.level = p[kTilt];
    d.heading = p[kHeading];
    // A preset is an error that the navigation is not told: it expects what any new set may have
    // (vehicle.md 7, P0).
    const auto unknown = [](const S& preset, double sigma) {
      return select(fabs(preset) > S(0.0), S(sigma), S(0.0));
    };
    d.scale =
        both(both(p[kOdometerScale], unknown(p[kOdometerPreset], 0.05)), p[kOdometerScaleMarkov]);
    d.scale_walk = p[kOdometerScaleWalk];
    d.scale_markov = p[kOdometerScaleMarkov];
    d.scale_noise = p[kOdometerScaleNoise];
    d.noise = p[kOdometerNoise];
    d.distance_noise = p[kOdometerDistanceNoise];
    d.quantisation = p[kOdometerQuantisation];
    d.side_slip = p[kSideSlip];
    d.mounting = both(p[kMounting], unknown(p[kMountingPreset], 3.0 * deg));
    d.mounting_pitch = p[kMountingPitch];
    d.fix = p[kFixStd];
    d.height = p[kHeightStd];
    return d;
  }
  template <Real S>
  static TrackSigmas<S> track_errors(const S* p) {
    return {p[kHeading], p[kGyroBias], p[kGyroNoise], p[kOdometerScaleNoise],
            p[kOdometerQuantisation]};
  }
};

std::vector<ParameterInfo> parameters(const Scenario& s) {
  using enum Dimension;
  const double most = 1e3;
  const auto& g = s.imu.errors.gyro;
  const auto& a = s.imu.errors.accel;
  const auto& o = s.odometer.errors;
  return {
      {"gyro_bias", "radps", kAngularRate, g.bias, "1 sigma of each gyro's constant bias", 0.0,
       most},
      {"gyro_noise", "radpsqrts", kAngleRandomWalk, g.noise, "angle random walk", 0.0, most},
      {"gyro_walk", "radpspsqrts", kRateRandomWalk, g.walk, "rate random walk", 0.0, most},
      {"gyro_scale", "", kNone, g.scale, "1 sigma of each gyro's scale error", 0.0, 1.0},
      {"accel_bias", "mps2", kAcceleration, a.bias, "1 sigma of each accelerometer's constant bias",
       0.0, most},
      {"accel_noise", "mpspsqrts", kVelocityRandomWalk, a.noise, "velocity random walk", 0.0, most},
      {"accel_walk", "mps2psqrts", kAccelerationRandomWalk, a.walk, "acceleration random walk", 0.0,
       most},
      {"accel_scale", "", kNone, a.scale, "1 sigma of each accelerometer's scale error", 0.0, 1.0},
      {"heading_error", "rad", kAngle, 0.0, "1 sigma of the initial heading", 0.0, kPi},
      {"tilt_error", "rad", kAngle, 0.0, "1 sigma of each initial tilt", 0.0, 1.0},
      {"odometer_scale", "", kNone, o.scale_error, "1 sigma of the scale left by calibration", 0.0,
       0.9},
      {"odometer_noise", "m", kLength, o.noise, "1 sigma of the way of one odometer interval", 0.0,
       most},
      {"mounting", "rad", kAngle, 0.0, "1 sigma of the mounting angle left by calibration", 0.0,
       kPi},
      {"gyro_markov", "radps", kAngularRate, g.markov, "1 sigma of the bias's Markov part", 0.0,
       most},
      {"gyro_misalignment", "rad", kAngle, g.misalignment, "1 sigma of each cross element", 0.0,
       1.0},
      {"gyro_temperature", "radpspk", kRatePerTemperature, g.temperature,
       "1 sigma of the bias per kelvin", 0.0, most},
      {"gyro_quantisation", "rad", kAngle, g.quantisation, "step of an increment", 0.0, 1.0},
      {"g_sensitivity", "radpspmps2", kGSensitivity, s.imu.errors.g_sensitivity,
       "1 sigma of each of nine elements", 0.0, most},
      {"accel_markov", "mps2", kAcceleration, a.markov, "1 sigma of the bias's Markov part", 0.0,
       most},
      {"accel_misalignment", "rad", kAngle, a.misalignment, "1 sigma of each cross element", 0.0,
       1.0},
      {"accel_temperature", "mps2pk", kAccelPerTemperature, a.temperature,
       "1 sigma of the bias per kelvin", 0.0, most},
      {"accel_quantisation", "mps", kSpeed, a.quantisation, "step of an increment", 0.0, 1.0},
      {"odometer_scale_noise", "", kNone, o.scale_noise, "white, of each reading relative to it",
       0.0, 1.0},
      {"odometer_scale_walk", "psqrts", kScaleRandomWalk, o.scale_walk, "random walk of the scale",
       0.0, 1.0},
      {"odometer_scale_markov", "", kNone, o.scale_markov, "1 sigma of the scale's Markov part",
       0.0, 1.0},
      {"odometer_distance_noise", "mpsqrtm", kDistanceRandomWalk, o.distance_noise,
       "noise that grows as the root of the way", 0.0, most},
      {"odometer_quantisation", "m", kLength, o.quantisation, "step of the indicated way", 0.0,
       most},
      {"side_slip", "rad", kAngle, 0.0, "1 sigma of the course against the body, each second", 0.0,
       1.0},
      {"mounting_pitch", "rad", kAngle, 0.0,
       "1 sigma of the pitch mounting angle left by calibration", 0.0, 1.0},
      {"benchmark_std", "m", kLength, s.benchmarks.empty() ? 0.0 : s.benchmarks.front().std,
       "1 sigma of each surveyed end per axis (mode calibrate)", 0.0, most},
      {"fix_std", "m", kLength, s.fix.position, "1 sigma of a fix per axis (mode filter)", 0.0,
       1e6},
      {"height_std", "m", kLength, 0.1, "1 sigma of the height (mode filter)", 0.0, 1e6},
      {"odometer_preset", "", kNone, 0.0, "scale error of this size, of which nobody is told", -0.5,
       0.5},
      {"mounting_preset", "rad", kAngle, 0.0,
       "mounting error of this size, of which nobody is told", -0.5, 0.5},
  };
}

void add_fan(std::vector<MetricInfo>& m, const std::string& which) {
  for (std::size_t k = 1; k <= kParts; ++k)
    m.push_back({which + "_at_" + (k < 10 ? "0" : "") + std::to_string(10 * k) + "_m",
                 which + " error after " + std::to_string(10 * k) + " % of the time"});
}

std::vector<MetricInfo> metrics(DriveSetup& set) {
  std::vector<MetricInfo> m;
  const auto add = [&](std::size_t& at, std::vector<MetricInfo> list) {
    at = m.size();
    m.insert(m.end(), list.begin(), list.end());
  };
  if (set.modes.inertial) {
    add(set.at_inertial,
        {{"horizontal_end_m", "inertial: horizontal error at the end"},
         {"horizontal_max_m", "inertial: largest horizontal error"},
         {"horizontal_rms_m", "inertial: root mean square over the drive"},
         {"horizontal_end_pct", "inertial: error at the end in percent of the distance"},
         {"east_end_m", "inertial: error to the east at the end"},
         {"north_end_m", "inertial: error to the north at the end"},
         {"ve_end_mps", "inertial: east velocity error at the end"},
         {"vn_end_mps", "inertial: north velocity error at the end"},
         {"velocity_rms_mps", "inertial: root mean square velocity error"},
         {"heading_end_rad", "inertial: heading error at the end, clockwise"}});
    add_fan(m, "horizontal");
  }
  if (set.modes.reckon) {
    add(set.at_reckon,
        {{"reckoned_end_m", "dead reckoning: horizontal error at the end"},
         {"reckoned_max_m", "dead reckoning: largest horizontal error"},
         {"reckoned_end_pct", "dead reckoning: error at the end in percent of the distance"}});
    add_fan(m, "reckoned");
  }
  if (set.modes.calibrate) add(set.at_calibrate, calibration_metrics());
  if (set.modes.filter) {
    add(set.at_filter, filter_metrics());
    add_fan(m, "filter");
  }
  if (set.modes.segmented) add(set.at_segmented, segmented_metrics(set));
  if (set.modes.navigator) add(set.at_navigator, navigator_metrics(set));
  return m;
}

template <class Mech>
std::unique_ptr<TrialKind> make(const EarthModel& earth, std::shared_ptr<DriveSetup> set,
                                const std::vector<ParameterInfo>& p, const std::string& canonical) {
  const auto m = metrics(*set);
  return std::make_unique<KernelTrial<DriveKernel<Mech>>>(DriveKernel<Mech>{earth, std::move(set)},
                                                          p, m, canonical, 8);
}

}  // namespace

std::unique_ptr<TrialKind> make_drive_trial(const TomlTable& settings) {
  const Scenario s = drive_scenario(settings);
  const double meridian = settings.get_quantity("meridian", Dimension::kAngle).value_or(0.0);
  const std::string frame = settings.get_string("frame").value_or("geographic");
  const std::vector<std::string> frames{"geographic", "transverse", "grid", "wander", "ecef"};
  if (std::find(frames.begin(), frames.end(), frame) == frames.end())
    throw Error(ErrorKind::kInput, "unknown frame '" + frame + "'" + suggestion(frame, frames),
                settings.where("frame"));
  auto set = std::make_shared<DriveSetup>(drive_setup(settings, s));
  const EarthModel earth = make_earth_model(s.trajectory.ellipsoid, meridian);
  char numbers[200];
  std::snprintf(numbers, sizeof numbers, "%a %a %a %016llx %d", meridian, set->truth.dt,
                s.trajectory.duration(), static_cast<unsigned long long>(set->truth.hash()),
                set->truth.odometer_every);
  std::string fans = "fan";
  for (const std::size_t at : set->fan) fans += " " + std::to_string(at);
  const std::string canonical = "frame=" + frame + " modes=" + set->modes.text() +
                                " ellipsoid=" + s.trajectory.ellipsoid.name + " " + numbers + " " +
                                set->around_text + fans;
  const auto p = parameters(s);
  if (frame == "geographic") return make<GeographicMechanization>(earth, set, p, canonical);
  if (frame == "transverse") return make<TransverseMechanization>(earth, set, p, canonical);
  if (frame == "grid") return make<GridMechanization>(earth, set, p, canonical);
  if (frame == "wander") return make<WanderMechanization>(earth, set, p, canonical);
  return make<EcefMechanization>(earth, set, p, canonical);
}

}  // namespace loxo
