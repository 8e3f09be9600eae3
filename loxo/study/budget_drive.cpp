// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/budget_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/filter_drive.hpp"
#include "loxo/study/reckon_drive.hpp"

namespace loxo {
namespace {

struct Epoch {
  double t = 0;
  EcefState<double> state;
};

DriveBudget analyse(const Ellipsoid& ell, const std::vector<Epoch>& motion,
                    const BudgetOptions& o) {
  if (motion.size() < 2)
    throw Error(ErrorKind::kInput, "a motion of at least two epochs expected", "budget");
  DriveBudget out;
  double highest = 0;
  std::vector<Geodetic<double>> places;
  places.reserve(motion.size());
  for (const auto& e : motion) {
    places.push_back(to_geodetic(ell, e.state.r));
    highest = std::max(highest, std::fabs(places.back().lat));
  }
  out.true_heading = o.headings == HeadingCount::kTrue ||
                     (o.headings == HeadingCount::kAuto && highest < 80 * deg);
  if (out.true_heading && highest > 89.9 * deg)
    throw Error(ErrorKind::kInput,
                fmt::format("the way comes within {:.3g} deg of a pole, where true headings mean "
                            "nothing: count without them",
                            90 - highest / deg),
                "budget");
  BudgetConfig config;
  config.ellipsoid = ell;
  config.errors = o.errors;
  config.self_aligned = o.self_aligned;
  config.height_known = o.height_known;
  config.attitude_sensor = o.attitude_sensor;
  config.true_heading = out.true_heading;
  CovarianceBudget budget(config);
  budget.start(motion.front().state);
  out.sources = budget.sources();
  const bool map = o.integrator != Integrator::kExact && highest < 89 * deg;
  if (map) out.sources.push_back(BudgetSource::kMapFormula);
  auto exact = reckon_start(places[0].lat, places[0].lon), other = exact;
  const double begin = motion.front().t;
  double distance = 0, next_row = 0, tick = 0, dn = 0, de = 0;
  for (std::size_t i = 0;; ++i) {
    const double t = motion[i].t - begin;
    const bool last = i + 1 == motion.size();
    if (t >= next_row - 1e-9 || last) {
      while (next_row <= t + 1e-9) next_row += o.row_every;
      std::array<double, 2> error{};
      if (map) {
        const double s = std::sin(exact.lat);
        error = {prime_vertical_radius(ell, s) * std::cos(exact.lat) * (other.lon - exact.lon),
                 meridian_radius(ell, s) * (other.lat - exact.lat)};
      }
      out.t.push_back(t);
      out.distance.push_back(distance);
      out.rows.push_back(budget.row(error));
      if (o.progress) o.progress(t / (motion.back().t - begin));
    }
    if (last) break;
    const double dt = motion[i + 1].t - motion[i].t;
    budget.step(motion[i + 1].state, dt);
    const Vec<Ecef> v = 0.5 * (motion[i].state.v + motion[i + 1].state.v);
    const auto level = geographic_axes(places[i].lat, places[i].lon) * v;
    distance += dt * std::hypot(level.x, level.y);
    if (map) {
      dn += dt * level.y, de += dt * level.x, tick += dt;
      if (tick >= o.errors.odometer_interval - 1e-9) {
        step_by(ell, Integrator::kExact, exact, dn, de, places[i].h);
        step_by(ell, o.integrator, other, dn, de, places[i].h);
        dn = de = tick = 0;
      }
    }
  }
  return out;
}

double finite_or_zero(double x) { return std::isfinite(x) ? x : 0.0; }

// States about a step apart from rows of a solution; `reckoned`: of heading and position alone.
class Thin {
 public:
  Thin(std::vector<Epoch>& motion, double step) : motion_(motion), step_(step) {}
  void add(const SolutionRow& r) {
    if (!motion_.empty() && r.t < motion_.back().t + step_ - 1e-6) return;
    Epoch e;
    e.t = r.t;
    e.state.r = {r.x, r.y, r.z};
    e.state.q_eb = {r.qw, r.qx, r.qy, r.qz};
    const auto axes = geographic_axes(r.lat, r.lon);
    e.state.v = transpose(axes) * Vec<Geographic>{r.ve, r.vn, r.vu};
    if (!std::isfinite(r.x + r.qw + r.ve)) return;
    motion_.push_back(e);
  }

 private:
  std::vector<Epoch>& motion_;
  double step_;
};

}  // namespace

BudgetErrors declared_errors(const Scenario& s) {
  BudgetErrors e;
  const auto& gyro = s.imu.errors.gyro;
  const auto& accel = s.imu.errors.accel;
  e.gyro_bias = std::hypot(gyro.bias, gyro.markov);
  e.accel_bias = std::hypot(accel.bias, accel.markov);
  if (gyro.markov > 0) e.gyro_bias_tau = s.imu.around.gyro_markov_time;
  if (accel.markov > 0) e.accel_bias_tau = s.imu.around.accel_markov_time;
  e.gyro_scale = gyro.scale, e.accel_scale = accel.scale;
  e.gyro_noise = gyro.noise, e.accel_noise = accel.noise;
  if (s.odometer.present) {
    e.scale_noise = s.odometer.errors.scale_noise;
    e.quantisation = s.odometer.errors.quantisation;
    e.odometer_interval = 1.0 / s.odometer.rate;
  }
  if (s.attitude.present) {
    e.attitude_bias = s.attitude.heading.bias;
    e.attitude_drift = s.attitude.heading.drift;
    e.attitude_noise = s.attitude.heading.walk;
  }
  for (const auto& b : s.benchmarks)
    if (b.t <= 0) e.position = std::max(e.position, b.std);
  return e;
}

BudgetErrors declared_errors(const Drive& d) {
  BudgetErrors e;
  e.gyro_bias = finite_or_zero(d.imu_errors.gyro_bias),
  e.accel_bias = finite_or_zero(d.imu_errors.accel_bias);
  e.gyro_bias_tau = finite_or_zero(d.imu_errors.gyro_bias_tau);
  e.accel_bias_tau = finite_or_zero(d.imu_errors.accel_bias_tau);
  e.gyro_scale = finite_or_zero(d.imu_errors.gyro_scale),
  e.accel_scale = finite_or_zero(d.imu_errors.accel_scale);
  e.gyro_noise = finite_or_zero(d.imu_errors.gyro_noise),
  e.accel_noise = finite_or_zero(d.imu_errors.accel_noise);
  e.scale_noise = finite_or_zero(d.odometer_errors.scale_noise);
  e.quantisation = finite_or_zero(d.odometer_errors.quantisation);
  e.side_slip = finite_or_zero(d.odometer_errors.side_slip);
  e.scale = finite_or_zero(d.odometer_errors.scale);
  e.attitude_bias = finite_or_zero(d.attitude_errors.heading_bias);
  e.attitude_drift = finite_or_zero(d.attitude_errors.heading_drift);
  e.attitude_noise = finite_or_zero(d.attitude_errors.heading_noise);
  if (!d.benchmarks.empty()) e.position = d.benchmarks.front().point.std;
  return e;
}

DriveBudget scenario_budget(const Scenario& scenario, const BudgetOptions& o) {
  TrajectoryWalk walk(scenario.trajectory);
  std::vector<Epoch> motion;
  const auto keep = [&] {
    const Truth x = walk.truth();
    motion.push_back({x.t, x.state});
  };
  keep();
  const double end = scenario.trajectory.duration();
  const auto steps = std::max(1L, std::lround(end / o.step));
  // The walk's own integration wants short steps (trajectory.hpp), the budget does not.
  const int inner = std::max(1, static_cast<int>(std::ceil(o.step / 0.02 - 1e-9)));
  for (long i = 1; i <= steps; ++i) {
    for (int j = 1; j <= inner; ++j)
      walk.to(end * (static_cast<double>(i - 1) + static_cast<double>(j) / inner) /
              static_cast<double>(steps));
    keep();
  }
  auto out = analyse(scenario.trajectory.ellipsoid, motion, o);
  out.nominal = "truth of the scenario " + scenario.name;
  return out;
}

DriveBudget drive_budget(const Drive& drive, const BudgetOptions& o, Diagnostics& diagnostics) {
  std::vector<Epoch> motion;
  Thin thin(motion, o.step);
  std::string nominal;
  if (drive.imu.present) {
    FilterOptions f;
    f.output_period = o.step;
    f.force = true;  // the way is wanted, not its last word about the start
    filter_drive(
        drive, f, [&](const SolutionRow& r) { thin.add(r); }, diagnostics);
    nominal = "joint filter over " + drive.path;
  } else if (drive.track.present || (drive.odometer.present && drive.attitude.present)) {
    ReckonOptions r;
    r.output_rate = 1.0 / o.step;
    // A reckoned row has a heading and a place; the velocity is the way between rows.
    std::optional<SolutionRow> before;
    const auto sink = [&](const SolutionRow& row) {
      SolutionRow x = row;
      const auto axes = geographic_axes(x.lat, x.lon);
      const Point<Ecef> p = to_ecef(drive.ellipsoid, Geodetic<double>{x.lat, x.lon, x.h});
      x.x = p.x, x.y = p.y, x.z = p.z;
      const auto q = to_quaternion(transpose(axes) * to_matrix<Geographic>(Euler<double>{
                                                         x.heading, finite_or_zero(x.pitch), 0.0}));
      x.qw = q.w, x.qx = q.x, x.qy = q.y, x.qz = q.z;
      if (before && x.t > before->t + 1e-9) {
        const auto v = axes * ((1.0 / (x.t - before->t)) *
                               Vec<Ecef>{x.x - before->x, x.y - before->y, x.z - before->z});
        x.ve = v.x, x.vn = v.y, x.vu = 0;
      } else {
        x.ve = x.vn = x.vu = 0;
      }
      before = x;
      thin.add(x);
    };
    reckon_drive(drive, r, sink, diagnostics);
    nominal = "dead reckoning of " + drive.path;
  } else {
    throw Error(ErrorKind::kInput,
                "no motion: [imu], or [track], or [odometer] and [attitude] expected", drive.path);
  }
  auto out = analyse(drive.ellipsoid, motion, o);
  out.nominal = nominal;
  return out;
}

}  // namespace loxo
