// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/calibration_trials.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/consistency.hpp"

namespace loxo {
namespace {

constexpr std::uint64_t kSpeed = 77;  // stream of the speeds

struct Outcome {
  Calibration found;
  std::vector<double> error;
};

Outcome one_drive(const Ellipsoid& ell, const CalibrationTrials& c, std::uint64_t seed,
                  std::uint64_t trial) {
  TrackOptions options = c.track;
  options.seed = seed;
  options.trial = trial;
  if (c.speed_spread > 0)
    options.speed *= 1 + c.speed_spread * (2 * Stream<double>{seed, trial, kSpeed}.uniform(0) - 1);
  const auto simulated = simulate_track(ell, c.route(trial), options);
  const std::size_t n = simulated.steps.size();
  const auto& truth0 = simulated.truth.front();

  std::vector<Benchmark> points;
  std::vector<std::size_t> rows;
  for (const double share : c.benchmarks_at) {
    const auto row = std::max<std::size_t>(
        1, static_cast<std::size_t>(std::lround(share * static_cast<double>(n))));
    points.push_back(
        survey(ell, simulated, row, c.benchmark_std, seed, trial, c.lever_right, c.lever_forward));
    rows.push_back(row);
  }
  // The start as it is believed to be: with the error of its survey, or moved by what is estimated.
  Benchmark start =
      survey(ell, simulated, 0, c.start_std, seed, trial, c.lever_right, c.lever_forward);
  if (c.start_north != 0 || c.start_east != 0) {
    auto moved = reckon_start(start.lat, start.lon);
    step_exact(ell, moved, -c.start_north, -c.start_east, start.h);
    start.lat = moved.lat;
    start.lon = moved.lon;
  }
  start.row = 0;

  RecordedTrack track;
  track.ellipsoid = &ell;
  track.steps = simulated.steps;
  track.t0 = truth0.t;
  track.model = options.model;
  track.reference = options.reference;
  track.earth_rate = options.earth_rate;
  TrackErrorModel errors;
  const auto& e = options.errors;
  errors.heading_bias = e.heading_bias;
  errors.heading_drift = e.heading_drift;
  errors.heading_noise = e.heading_noise;
  errors.side_slip = e.side_slip;
  errors.scale_noise = e.scale_noise;
  errors.quantisation = e.quantisation;

  Outcome out;
  out.found = c.estimate.empty() && points.size() == 1
                  ? calibrate_replay(track, start, points.back(), errors)
                  : calibrate_least_squares(track, start, points, rows, errors, c.estimate);
  if (!out.found.valid) return out;
  StateVector truth{};
  truth[index(State::kScale)] = std::log(e.k);
  truth[index(State::kAngle)] = e.eps;
  // The simulator's drift acts from mid-step, counted from the start; the state's from the row's
  // own time (interface.md): the angle takes up the difference.
  truth[index(State::kDrift)] = e.fixed_heading_drift;
  if (e.fixed_heading_drift != 0)
    truth[index(State::kAngle)] -= e.fixed_heading_drift * (options.t0 + 0.5 * options.interval);
  truth[index(State::kPitch)] = e.pitch_mounting;
  truth[index(State::kLeverRight)] = c.lever_right;
  truth[index(State::kLeverForward)] = c.lever_forward;
  truth[index(State::kStartNorth)] = c.start_north;
  truth[index(State::kStartEast)] = c.start_east;
  for (std::size_t i = 0; i < out.found.states.size(); ++i) {
    const State s = out.found.states[i];
    const double d = out.found.values[i] - truth[index(s)];
    out.error.push_back(s == State::kAngle ? wrap_pi(d) : d);
  }
  return out;
}

// Of scale and angle, one that is stated this much better than the other is not touched by the
// source: an alignment error turns the whole way and stretches nothing.
constexpr double kNothing = 1e-3;

}  // namespace

TrialStatistics run_calibration_trials(const Ellipsoid& ell, const CalibrationTrials& c, int drives,
                                       std::uint64_t seed) {
  TrialStatistics out;
  out.drives = drives;
  double chi2 = 0;
  int with_dof = 0;
  std::vector<std::vector<double>> errors;
  std::vector<std::vector<double>> covariances;
  for (int i = 0; i < drives; ++i) {
    const auto o = one_drive(ell, c, seed, static_cast<std::uint64_t>(i));
    if (!o.found.valid) continue;
    ++out.valid;
    if (out.states.empty())
      for (const State s : o.found.states) out.states.push_back({s});
    errors.push_back(o.error);
    covariances.push_back(o.found.covariance);
    if (o.found.dof > 0) {
      chi2 += o.found.chi2 / o.found.dof;
      ++with_dof;
    }
  }
  if (errors.empty()) return out;
  out.chi2 = with_dof > 0 ? chi2 / with_dof : 0;
  const std::size_t m = out.states.size();
  const double count = static_cast<double>(errors.size());
  for (std::size_t s = 0; s < m; ++s) {
    auto& st = out.states[s];
    double p = 0, ee = 0, e1 = 0, z = 0;
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const double v = covariances[i][s * m + s], e = errors[i][s];
      p += v;
      ee += e * e;
      e1 += e;
      if (v > 0) z += e * e / v;
    }
    st.stated = std::sqrt(p / count);
    st.found = std::sqrt(ee / count);
    st.mean = e1 / count;
    st.ratio = z / count;
  }
  // The states that are touched; of two that always err together only one counts.
  std::vector<std::size_t> used;
  for (std::size_t s = 0; s < m; ++s)
    if (s > 1 || out.states[s].stated > kNothing * out.states[1 - s].stated) used.push_back(s);
  if (used.empty()) return out;
  double sum = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const auto d = static_cast<Eigen::Index>(used.size());
    Eigen::MatrixXd p(d, d);
    Eigen::VectorXd e(d);
    for (Eigen::Index a = 0; a < d; ++a) {
      const std::size_t sa = used[static_cast<std::size_t>(a)];
      const double na = std::sqrt(covariances[i][sa * m + sa]);
      e[a] = errors[i][sa] / na;
      for (Eigen::Index b = 0; b < d; ++b) {
        const std::size_t sb = used[static_cast<std::size_t>(b)];
        p(a, b) = covariances[i][sa * m + sb] / (na * std::sqrt(covariances[i][sb * m + sb]));
      }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(p);
    int rank = 0;
    for (Eigen::Index a = 0; a < d; ++a) {
      const double value = eigen.eigenvalues()[a];
      if (!(value > 1e-6)) continue;
      const double along = eigen.eigenvectors().col(a).dot(e);
      sum += along * along / value;
      ++rank;
    }
    out.dimension = std::max(out.dimension, rank);
  }
  out.nees = sum / count;
  const Band band = chi_square_band(out.dimension, count, out.confidence);
  out.low = band.low;
  out.high = band.high;
  return out;
}

std::vector<CalibrationTrials> stated_confidence_trials() {
  // 3 km and some: long enough for every source, short enough for thousands; no whole number of
  // pulses, whose errors belong to one length only (vehicle.md 5.2).
  const auto way = [](std::uint64_t trial) {
    return 3000.0 + 0.7071 * static_cast<double>(trial % 997);
  };
  const RouteStart here{55 * deg, 110 * deg, 100.0};
  CalibrationTrials base;
  base.route = [=](std::uint64_t trial) { return random_road(here, way(trial), 5, trial); };
  base.track.speed = 15;
  base.track.interval = 1;
  base.track.errors.k = 1.02;
  base.track.errors.eps = 1.5 * deg;
  std::vector<CalibrationTrials> all;
  const auto add = [&](const std::string& name, auto change) {
    CalibrationTrials c = base;
    c.name = name;
    change(c);
    all.push_back(std::move(c));
  };
  const std::vector<double> five{0.2, 0.4, 0.6, 0.8, 1.0};
  // One source at a time, one benchmark at the end: replay.
  add("benchmark at the end, 0.5 m", [](auto& c) { c.benchmark_std = 0.5; });
  add("start point, 0.5 m", [](auto& c) { c.start_std = 0.5; });
  add("odometer white noise, 1 % a row", [](auto& c) { c.track.errors.scale_noise = 0.01; });
  // Speed that changes all the way, as on roads: at a constant one the unread parts of pulses
  // repeat in a rhythm of their own.
  add("odometer pulses of 0.5 m", [](auto& c) {
    c.track.errors.quantisation = 0.5;
    c.track.acceleration = 0.05;
  });
  add("heading noise, 0.2 deg/sqrt(h)",
      [](auto& c) { c.track.errors.heading_noise = 0.2 * deg / 60; });
  add("heading drift, 1 deg/h", [](auto& c) { c.track.errors.heading_drift = 1 * deg_per_h; });
  add("heading alignment, 3.6'", [](auto& c) { c.track.errors.heading_bias = 3.6 * arcmin; });
  add("side slip, 0.5 deg a row", [](auto& c) { c.track.errors.side_slip = 0.5 * deg; });
  const auto everything = [](CalibrationTrials& c) {
    c.benchmark_std = c.start_std = 0.2;
    c.track.errors.scale_noise = 0.003;
    c.track.errors.quantisation = 0.2;
    c.track.errors.heading_noise = 0.05 * deg / 60;
    c.track.errors.heading_drift = 0.2 * deg_per_h;
    c.track.errors.heading_bias = 0.5 * arcmin;
    c.track.errors.side_slip = 0.1 * deg;
  };
  add("all of these at once", everything);
  add("all, straight", [=](auto& c) {
    everything(c);
    c.route = [=](std::uint64_t t) {
      return straight_route(here, 0.37 * static_cast<double>(t), way(t));
    };
  });
  add("all, mechanised headings", [=](auto& c) {
    everything(c);
    c.track.model = HeadingModel::kMechanised;
  });
  add("all, grid headings at 89.95 deg", [=](auto& c) {
    everything(c);
    c.track.reference = HeadingReference::kGrid;
    c.route = [way](std::uint64_t trial) {
      return random_road({89.95 * deg, 110 * deg, 0}, way(trial), 5, trial);
    };
  });
  add("all, south", [=](auto& c) {
    everything(c);
    c.route = [way](std::uint64_t trial) {
      return random_road({-70 * deg, 179.99 * deg, 0}, way(trial), 5, trial);
    };
  });
  // Several benchmarks: least squares.
  add("all, five benchmarks", [=](auto& c) {
    everything(c);
    c.benchmarks_at = five;
  });
  add("pulses of 0.5 m, five benchmarks", [=](auto& c) {
    c.track.errors.quantisation = 0.5;
    c.track.acceleration = 0.05;
    c.benchmark_std = 0.05;
    c.benchmarks_at = five;
  });
  add("drift as a state, 5 deg/h", [=](auto& c) {
    everything(c);
    c.track.errors.heading_drift = 0;
    c.track.errors.fixed_heading_drift = 5 * deg_per_h;
    c.track.t0 = 40000;  // seconds of the day: the angle belongs to t_s = 0
    c.benchmarks_at = five;
    c.estimate = {State::kDrift};
  });
  add("pitch mounting as a state, 1 deg, hills", [=](auto& c) {
    everything(c);
    c.track.errors.pitch_mounting = 1 * deg;
    c.route = [=](std::uint64_t trial) {
      Route r = random_road(here, way(trial), 5, trial);
      r.hill_height = 10;
      return r;
    };
    c.benchmarks_at = five;
    c.estimate = {State::kPitch};
  });
  add("lever arm as a state, 0.8 m right, 3 m forward", [=](auto& c) {
    everything(c);
    c.lever_right = 0.8;
    c.lever_forward = 3;
    c.benchmarks_at = five;
    c.estimate = {State::kLeverRight, State::kLeverForward};
  });
  add("start offset as a state, 20 m", [=](auto& c) {
    everything(c);
    c.start_std = 0;
    c.start_north = 12;
    c.start_east = -16;
    c.benchmarks_at = five;
    c.estimate = {State::kStartNorth, State::kStartEast};
  });
  add("all four states at once", [=](auto& c) {
    everything(c);
    c.track.errors.heading_drift = 0;
    c.start_std = 0;
    c.track.errors.fixed_heading_drift = 5 * deg_per_h;
    c.track.errors.pitch_mounting = 1 * deg;
    c.lever_right = 0.8;
    c.lever_forward = 3;
    c.start_north = 12;
    c.start_east = -16;
    c.route = [=](std::uint64_t trial) {
      Route r = random_road(here, way(trial), 5, trial);
      r.hill_height = 10;
      return r;
    };
    c.benchmarks_at = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0};
    c.estimate = {State::kDrift,        State::kPitch,      State::kLeverRight,
                  State::kLeverForward, State::kStartNorth, State::kStartEast};
  });
  return all;
}

CalibrationTrials plan_trials(const PlanRequest& r, const Plan& plan) {
  CalibrationTrials c;
  c.name = plan.shape.name;
  Route route = straight_route({r.latitude, 0, 0}, r.course, plan.leg);
  route.legs.clear();
  // Corners of 1 mm: the plan's legs are straight, its corners cost no way.
  constexpr double kCorner = 1e-3;
  for (std::size_t i = 0; i < plan.shape.turns.size(); ++i) {
    if (i > 0)
      route.legs.push_back(
          {kCorner, wrap_pi(plan.shape.turns[i] - plan.shape.turns[i - 1]), false});
    route.legs.push_back({plan.leg, 0, false});
  }
  c.route = [=](std::uint64_t) { return route; };
  c.track.speed = r.speed;
  c.track.interval = r.interval;
  auto& e = c.track.errors;
  e.k = r.expected_k;
  e.eps = r.expected_eps;
  e.heading_bias = r.errors.heading_bias;
  // A state that is estimated has a true value; the others are drawn.
  const auto estimated = [&](State s) {
    return std::find(r.estimate.begin(), r.estimate.end(), s) != r.estimate.end();
  };
  (estimated(State::kDrift) ? e.fixed_heading_drift : e.heading_drift) = r.errors.heading_drift;
  e.heading_noise = r.errors.heading_noise;
  e.side_slip = r.errors.side_slip;
  e.scale_noise = r.errors.scale_noise;
  e.quantisation = r.errors.quantisation;
  c.benchmark_std = r.benchmark_std;
  c.start_std = estimated(State::kStartNorth) ? 0 : r.benchmark_std;
  c.speed_spread = 0.02;
  c.estimate = r.estimate;
  c.benchmarks_at.clear();
  const std::size_t n = plan.shape.turns.size() * plan.shape.per_leg;
  // Those at corners are passed two rows before: while the body still points along its leg.
  const double row = r.speed * r.interval / plan.way;
  for (std::size_t i = 1; i <= n; ++i)
    c.benchmarks_at.push_back(static_cast<double>(i) / static_cast<double>(n) -
                              (i % plan.shape.per_leg == 0 && i < n ? 2 * row : 0.0));
  return c;
}

}  // namespace loxo
