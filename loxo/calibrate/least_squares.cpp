// SPDX-License-Identifier: Apache-2.0
#include "loxo/calibrate/least_squares.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "loxo/num/functions.hpp"

namespace loxo {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// Directions of the weighted Jacobian (columns of unit length) weaker than this against the
// strongest are not told apart by the benchmarks: sensitivities are good to 1e-7 at the worst
// (central differences of mechanised and grid tracks).
constexpr double kWeakest = 1e-7;
// What a state may be at the most: known no better than this, a direction is not found. A chord
// known to a fifth of itself is the least that counts (5 sigma, vehicle.md section 4); the drift is
// what turns by as much over the drive.
double widest(State s, double duration) {
  switch (s) {
    case State::kDrift:
      return 0.2 / std::max(1.0, duration);
    case State::kLeverRight:
    case State::kLeverForward:
      return 100.0;
    case State::kStartNorth:
    case State::kStartEast:
      return 1000.0;
    default:
      return 0.2;
  }
}
// Where nothing is declared, positions are taken as good to this [m] for the same question.
constexpr double kExactPosition = 1e-3;

// States that take part with more than this of a weak direction are named.
constexpr double kTakesPart = 0.3;

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

// Why a state or a mixture of states cannot be found, in words, with what would help (5.3).
std::string words_of(const Vector& direction, const std::vector<State>& states) {
  std::vector<std::string> names;
  bool pitch = false, lever = false, start = false, drift = false;
  for (Eigen::Index i = 0; i < direction.size(); ++i) {
    if (!(std::fabs(direction[i]) > kTakesPart)) continue;
    const State s = states[static_cast<std::size_t>(i)];
    names.emplace_back(state_words(s));
    pitch = pitch || s == State::kPitch;
    lever = lever || s == State::kLeverRight || s == State::kLeverForward;
    start = start || s == State::kStartNorth || s == State::kStartEast;
    drift = drift || s == State::kDrift;
  }
  std::string text = joined(names);
  if (!pitch && !lever && !start && !drift)
    return text +
           " cannot be found from these benchmarks: their chords are not five times longer than "
           "their errors";
  text += names.size() > 1 ? " cannot be told apart by these benchmarks"
                           : " cannot be found from these benchmarks";
  if (pitch) return text + ": they need heights, after a way that is driven forward";
  if (lever)
    return text +
           ": the heading at a benchmark must differ from that at the start, by 30 deg or more";
  if (drift) return text + ": it needs two benchmarks or more, at different times";
  if (start) return text + ": it needs a second benchmark";
  return text;
}

struct Problem {
  std::vector<State> states;
  int dim = 2;
  double t_mid = 0;  // s: the angle is solved for at this time, else it hangs on the drift
  double duration = 0;
  Eigen::Index n = 0, m = 0;

  Problem(const RecordedTrack& track, const std::vector<Benchmark>& benchmarks,
          const std::vector<std::size_t>& rows, const std::vector<State>& estimate) {
    states = {State::kScale, State::kAngle};
    states.insert(states.end(), estimate.begin(), estimate.end());
    dim = has(State::kPitch) ? 3 : 2;
    n = static_cast<Eigen::Index>(benchmarks.size()) * dim;
    m = static_cast<Eigen::Index>(states.size());
    const std::size_t last = rows.empty() ? 0 : rows.back();
    if (has(State::kDrift) && last > 0) {
      const double end = track.steps[last - 1].t;
      if (std::isfinite(end) && std::isfinite(track.t0)) {
        t_mid = 0.5 * (track.t0 + end);
        duration = end - track.t0;
      }
    }
  }
  bool has(State s) const { return std::find(states.begin(), states.end(), s) != states.end(); }
  Eigen::Index column(State s) const {
    return std::find(states.begin(), states.end(), s) - states.begin();
  }

  // Sensitivities of all residuals, with the angle at t_mid instead of at t = 0.
  Matrix jacobian(const std::vector<Arrival>& arrivals) const {
    Matrix j(n, m);
    for (std::size_t a = 0; a < arrivals.size(); ++a)
      for (int c = 0; c < dim; ++c)
        for (Eigen::Index s = 0; s < m; ++s)
          j(static_cast<Eigen::Index>(a) * dim + c, s) =
              arrivals[a]
                  .by[index(states[static_cast<std::size_t>(s)])][static_cast<std::size_t>(c)];
    if (has(State::kDrift)) j.col(column(State::kDrift)) -= t_mid * j.col(1);
    return j;
  }
  // Back from (angle at t_mid, drift) to (angle at t = 0, drift).
  Vector outward(Vector v) const {
    if (has(State::kDrift)) v[1] -= t_mid * v[column(State::kDrift)];
    return v;
  }
  Matrix outward(const Matrix& covariance) const {
    Matrix t = Matrix::Identity(m, m);
    if (has(State::kDrift)) t(1, column(State::kDrift)) = -t_mid;
    return t * covariance * t.transpose();
  }
  Matrix sigma(const std::vector<Moments>& moments, const std::vector<Benchmark>& benchmarks,
               const Benchmark& start, const TrackErrorModel& errors, double k) const {
    const auto s = residual_covariance(moments, benchmarks, start, errors, k, dim,
                                       !has(State::kStartNorth), !has(State::kDrift));
    return Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(s.data(), n, n);
  }
};

// The sums of (V-43) at x, with exact turns.
std::vector<Moments> moments_at(const Replay& replay, const StateVector& x,
                                const TrackErrorModel& errors) {
  auto moments = replay.moments(x);
  const bool drift = errors.heading_drift > 0;
  if (errors.heading_bias > 0 || drift) {
    std::vector<State> turns{State::kScale, State::kAngle};
    if (drift) turns.push_back(State::kDrift);
    exact_turns(replay.track(), replay.run(x, turns), drift, moments);
  }
  return moments;
}

// Weights, the exact case (nothing declared) included.
struct Weights {
  bool exact = false;
  Eigen::LLT<Matrix> factor;
  explicit Weights(Matrix sigma) {
    exact = !(sigma.diagonal().maxCoeff() > 0);
    // Known exactly: any weight will do, the stated error is zero.
    if (exact) sigma.setIdentity();
    sigma.diagonal().array() += 1e-12 * sigma.diagonal().maxCoeff();
    factor.compute(sigma);
  }
  bool good() const { return factor.info() == Eigen::Success; }
  Matrix apply(const Matrix& x) const { return factor.matrixL().solve(x); }
};

// (J^T Sigma^-1 J)^-1 from the weighted Jacobian, with what it cannot tell.
struct Solved {
  Matrix covariance, gain;  // gain: states from weighted residuals
  std::vector<std::string> unobservable;
  double smallest = 0;
};
Solved solved(const Matrix& wj, const Problem& p, bool exact) {
  Solved out;
  const auto& states = p.states;
  const Vector norm = wj.colwise().norm();
  for (Eigen::Index i = 0; i < norm.size(); ++i)
    if (!(norm[i] > 0)) {
      Vector only = Vector::Zero(norm.size());
      only[i] = 1;
      out.unobservable.push_back(words_of(only, states));
    }
  if (!out.unobservable.empty()) return out;
  const Vector scale = norm.cwiseInverse();
  const Eigen::JacobiSVD<Matrix> svd(wj * scale.asDiagonal(),
                                     Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Vector& s = svd.singularValues();
  for (Eigen::Index i = 0; i < s.size(); ++i)
    if (s[i] < kWeakest * s[0]) out.unobservable.push_back(words_of(svd.matrixV().col(i), states));
  if (!out.unobservable.empty()) return out;
  out.smallest = s[s.size() - 1];
  out.gain = scale.asDiagonal() * svd.matrixV() * s.cwiseInverse().asDiagonal() *
             svd.matrixU().transpose();
  out.covariance = out.gain * out.gain.transpose();
  Vector limit(p.m);
  for (Eigen::Index i = 0; i < p.m; ++i)
    limit[i] =
        widest(states[static_cast<std::size_t>(i)], p.duration) / (exact ? kExactPosition : 1.0);
  const Matrix inverse = limit.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(inverse * out.covariance * inverse);
  for (Eigen::Index i = 0; i < p.m; ++i)
    if (!(eigen.eigenvalues()[i] < 1))
      out.unobservable.push_back(words_of(eigen.eigenvectors().col(i), states));
  return out;
}

TrackErrorModel only(const TrackErrorModel& all, ErrorSource s) {
  TrackErrorModel e;
  if (s == ErrorSource::kHeadingBias) e.heading_bias = all.heading_bias;
  if (s == ErrorSource::kHeadingDrift) e.heading_drift = all.heading_drift;
  if (s == ErrorSource::kHeadingNoise) e.heading_noise = all.heading_noise;
  if (s == ErrorSource::kSideSlip) e.side_slip = all.side_slip;
  if (s == ErrorSource::kScaleNoise) e.scale_noise = all.scale_noise;
  if (s == ErrorSource::kQuantisation) e.quantisation = all.quantisation;
  return e;
}

}  // namespace

std::string_view source_name(ErrorSource s) {
  constexpr std::string_view names[] = {"benchmarks",    "start",         "heading_bias",
                                        "heading_drift", "heading_noise", "side_slip",
                                        "scale_noise",   "quantisation"};
  return names[static_cast<std::size_t>(s)];
}
std::string_view source_words(ErrorSource s) {
  constexpr std::string_view words[] = {"benchmarks",    "start point",    "heading alignment",
                                        "heading drift", "heading noise",  "side slip",
                                        "scale noise",   "odometer pulses"};
  return words[static_cast<std::size_t>(s)];
}

Calibration calibrate_least_squares(const RecordedTrack& track, const Benchmark& start,
                                    const std::vector<Benchmark>& benchmarks,
                                    const std::vector<std::size_t>& rows,
                                    const TrackErrorModel& errors,
                                    const std::vector<State>& estimate) {
  Calibration out;
  out.method = "least_squares";
  const Problem p(track, benchmarks, rows, estimate);
  out.states = p.states;
  const Replay replay(track, start, rows);
  // A start from the farthest benchmark's chord.
  ChordStart from;
  const auto recorded = replay.run({});
  for (std::size_t j = 0; j < benchmarks.size(); ++j) {
    const auto c = chord_start(replay, recorded[j], benchmarks[j]);
    if (c.valid && c.chord > from.chord) from = c;
    if (j == 0 && !c.valid) from.why = c.why;
  }
  if (!from.valid) {
    out.why = from.why.empty()
                  ? "no benchmark stands away from the start: nothing fixes scale and angle"
                  : from.why;
    return out;
  }
  StateVector x{};
  x[index(State::kScale)] = from.ln_k;
  x[index(State::kAngle)] = from.eps;
  if (p.n < p.m) {
    out.why = fmt::format("{} unknowns and {} equations: more benchmarks are needed", p.m, p.n);
    return out;
  }
  const Weights weights(
      p.sigma(moments_at(replay, x, errors), benchmarks, start, errors, std::exp(from.ln_k)));
  if (!weights.good()) {
    out.why = "the covariance of the benchmarks is not positive definite: give each a std";
    return out;
  }
  const auto residuals = [&](const std::vector<Arrival>& at) {
    Vector r(p.n);
    for (std::size_t j = 0; j < benchmarks.size(); ++j) {
      const auto d = replay.residual(at[j], benchmarks[j]);
      for (int c = 0; c < p.dim; ++c)
        r[static_cast<Eigen::Index>(j) * p.dim + c] = d[static_cast<std::size_t>(c)];
    }
    return r;
  };
  Matrix wj;
  double damping = 1e-3, cost = 0;
  bool converged = false;
  std::vector<Arrival> arrivals = replay.run(x, out.states);
  for (out.iterations = 0; out.iterations < 50 && !converged; ++out.iterations) {
    const Vector r = residuals(arrivals);
    if (!r.allFinite()) {
      out.why = "the track leaves the domain of its headings (a pole crossed with true headings?)";
      return out;
    }
    wj = weights.apply(p.jacobian(arrivals));
    const Vector wr = weights.apply(r);
    cost = wr.squaredNorm();
    // States differ by many orders of magnitude: columns of unit length.
    const Vector scale = wj.colwise().norm().cwiseMax(1e-300).cwiseInverse();
    const Matrix a = wj * scale.asDiagonal();
    for (;;) {
      Matrix normal = a.transpose() * a;
      normal.diagonal().array() += damping;
      const Vector step = scale.asDiagonal() * normal.ldlt().solve(a.transpose() * wr);
      const Vector moved = p.outward(step);
      StateVector y = x;
      for (Eigen::Index s = 0; s < p.m; ++s)
        y[index(out.states[static_cast<std::size_t>(s)])] -= moved[s];
      auto next = replay.run(y, out.states);
      const Vector r2 = residuals(next);
      const double c2 = r2.allFinite() ? weights.apply(r2).squaredNorm() : INFINITY;
      if (c2 <= cost * (1 + 1e-12) + 1e-20) {
        const double angle = std::max(std::fabs(step[0]), std::fabs(step[1]));
        converged = angle < 1e-12 || std::fabs(cost - c2) <= 1e-12 * (cost + 1e-12);
        x = y;
        cost = c2;
        arrivals = std::move(next);
        damping = std::max(damping * 0.03, 1e-15);
        break;
      }
      damping = std::max(damping * 10, 1e-12);
      if (damping > 1e8) {
        converged = true;  // at the minimum to rounding
        break;
      }
    }
  }
  if (!converged) {
    out.why = "no convergence in 50 iterations";
    return out;
  }
  const Solved s = solved(weights.apply(p.jacobian(arrivals)), p, weights.exact);
  out.unobservable = s.unobservable;
  if (!out.unobservable.empty()) {
    out.why = out.unobservable.front();
    return out;
  }
  const Matrix covariance = (weights.exact ? 0.0 : 1.0) * p.outward(s.covariance);
  out.covariance.resize(static_cast<std::size_t>(p.m * p.m));
  for (Eigen::Index i = 0; i < p.m; ++i)
    for (Eigen::Index j = 0; j < p.m; ++j)
      out.covariance[static_cast<std::size_t>(i * p.m + j)] = covariance(i, j);
  for (State state : out.states) out.values.push_back(x[index(state)]);
  out.k = std::exp(x[index(State::kScale)]);
  out.eps = wrap_pi(x[index(State::kAngle)]);
  out.values[1] = out.eps;
  out.ln_k_std = std::sqrt(covariance(0, 0));
  out.eps_std = std::sqrt(covariance(1, 1));
  out.correlation = weights.exact ? 0.0 : covariance(0, 1) / (out.ln_k_std * out.eps_std);
  out.smallest_singular = s.smallest;
  out.chi2 = weights.exact ? 0.0 : cost;
  out.dof = static_cast<int>(p.n - p.m);
  out.closure = 0;
  for (std::size_t j = 0; j < benchmarks.size(); ++j) {
    const auto d = replay.residual(arrivals[j], benchmarks[j]);
    out.closure = std::max(out.closure, std::hypot(d[0], d[1]));
    out.residuals.push_back(
        {{}, -d[0], -d[1], -d[2], std::hypot(arrivals[j].north, arrivals[j].east)});
  }
  out.valid = true;
  return out;
}

double ExpectedAccuracy::std(std::size_t state) const {
  return std::sqrt(std::max(0.0, covariance[state * states.size() + state]));
}

ExpectedAccuracy expected_accuracy(const RecordedTrack& track, const Benchmark& start,
                                   const std::vector<Benchmark>& benchmarks,
                                   const std::vector<std::size_t>& rows,
                                   const TrackErrorModel& errors,
                                   const std::vector<State>& estimate) {
  const Problem p(track, benchmarks, rows, estimate);
  ExpectedAccuracy out;
  out.states = p.states;
  if (p.n < p.m) {
    out.unobservable.push_back(
        fmt::format("{} unknowns and {} equations: more benchmarks are needed", p.m, p.n));
    return out;
  }
  const Replay replay(track, start, rows);
  const auto arrivals = replay.run({}, p.states);
  const auto moments = moments_at(replay, {}, errors);
  const Weights weights(p.sigma(moments, benchmarks, start, errors, 1.0));
  const Matrix jacobian = p.jacobian(arrivals);
  if (!weights.good() || !jacobian.allFinite()) {
    out.unobservable.emplace_back("the track leaves the domain of its headings");
    return out;
  }
  const Solved s = solved(weights.apply(jacobian), p, weights.exact);
  out.unobservable = s.unobservable;
  if (!out.unobservable.empty()) return out;
  const auto size = static_cast<std::size_t>(p.m);
  out.covariance.assign(size * size, 0.0);
  out.sources.assign(size, {});
  if (weights.exact) return out;
  // What the residuals' own covariance makes of the states, source by source: gain W S W^T gain^T.
  for (std::size_t i = 0; i < kErrorSources; ++i) {
    const auto source = static_cast<ErrorSource>(i);
    auto points = benchmarks;
    auto origin = start;
    if (source != ErrorSource::kBenchmarks)
      for (auto& b : points) b.std = b.std_h = 0;
    if (source != ErrorSource::kStart) origin.std = origin.std_h = 0;
    const Matrix sigma = p.sigma(moments, points, origin, only(errors, source), 1.0);
    if (!(sigma.diagonal().maxCoeff() > 0)) continue;
    const Matrix half = weights.apply(weights.apply(sigma).transpose());
    const Matrix part = p.outward(Matrix(s.gain * half * s.gain.transpose()));
    for (std::size_t a = 0; a < size; ++a) {
      out.sources[a][i] = part(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(a));
      for (std::size_t b = 0; b < size; ++b)
        out.covariance[a * size + b] +=
            part(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
    }
  }
  return out;
}

}  // namespace loxo
