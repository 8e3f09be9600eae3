// SPDX-License-Identifier: Apache-2.0
#include "loxo/errors/allan.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace loxo {
namespace {

// Longest averaging length of a level, in its own steps; a level above the first starts where the
// one below ends.
constexpr std::size_t kLongest = 128;
constexpr std::size_t kBlock = 4096;  // phase samples consumed at once

std::size_t reach(AllanKind kind) { return kind == AllanKind::kAllan ? 2 : 3; }

// Sum of squared second differences of step m over `n` windows.
double sum_second(const double* x, std::size_t m, std::size_t n) {
  double sum[8]{};
  std::size_t k = 0;
  for (; k + 8 <= n; k += 8)
    for (std::size_t j = 0; j < 8; ++j) {
      const double d = x[k + j + 2 * m] - 2.0 * x[k + j + m] + x[k + j];
      sum[j] += d * d;
    }
  for (; k < n; ++k) {
    const double d = x[k + 2 * m] - 2.0 * x[k + m] + x[k];
    sum[0] += d * d;
  }
  return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

double sum_third(const double* x, std::size_t m, std::size_t n) {
  double sum = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double d = x[k + 3 * m] - 3.0 * (x[k + 2 * m] - x[k + m]) - x[k];
    sum += d * d;
  }
  return sum;
}

// Mean of m neighbouring second differences, squared: the modified variance's window.
double sum_modified(const double* x, std::size_t m, std::size_t n) {
  double inner = 0, sum = 0;
  for (std::size_t k = 0; k < m; ++k) inner += x[k + 2 * m] - 2.0 * x[k + m] + x[k];
  for (std::size_t k = 0;; ++k) {
    const double d = inner / static_cast<double>(m);
    sum += d * d;
    if (k + 1 == n) return sum;
    inner +=
        (x[k + 3 * m] - 2.0 * x[k + 2 * m] + x[k + m]) - (x[k + 2 * m] - 2.0 * x[k + m] + x[k]);
  }
}

}  // namespace

AllanStream::AllanStream(double dt, AllanKind kind) : dt_(dt), kind_(kind) {}

void AllanStream::add(std::span<const double> rates) {
  if (rates.empty()) return;
  if (count_ == 0) {
    // Near the mean the phase stays small, and differences of large numbers do not eat the digits.
    const std::size_t n = std::min<std::size_t>(rates.size(), 1000);
    for (std::size_t i = 0; i < n; ++i) offset_ += rates[i];
    offset_ /= static_cast<double>(n);
    const double zero = 0.0;
    push(0, {&zero, 1});
  }
  std::vector<double> phase(std::min(rates.size(), kBlock));
  for (std::size_t start = 0; start < rates.size(); start += kBlock) {
    const std::size_t n = std::min(kBlock, rates.size() - start);
    for (std::size_t i = 0; i < n; ++i) {
      sum_ += rates[start + i];
      phase_ += (rates[start + i] - offset_) * dt_;
      phase[i] = phase_;
    }
    push(0, {phase.data(), n});
  }
  count_ += rates.size();
}

void AllanStream::push(std::size_t number, std::span<const double> phase) {
  if (number == levels_.size()) {
    Level level;
    // 1, 2, 3, 4, 6, 8, 12 … 128 at the first level; above it 96 and 128 of ever longer steps.
    for (std::size_t octave = number == 0 ? 1 : kLongest; octave <= kLongest; octave *= 2) {
      if (octave >= 4) level.m.push_back(octave * 3 / 4);
      level.m.push_back(octave);
    }
    level.next.assign(level.m.size(), 0);
    level.sum.assign(level.m.size(), 0.0);
    level.windows.assign(level.m.size(), 0);
    levels_.push_back(std::move(level));
  }
  levels_[number].phase.insert(levels_[number].phase.end(), phase.begin(), phase.end());
  sum_windows(levels_[number]);
  double half[kBlock / 2 + 1];
  std::size_t n = 0;
  for (double x : phase) {
    if (!levels_[number].skip) half[n++] = x;
    levels_[number].skip = !levels_[number].skip;
  }
  if (n > 0 && number < 40) push(number + 1, {half, n});
}

void AllanStream::sum_windows(Level& level) const {
  std::size_t keep = level.phase.size();
  for (std::size_t i = 0; i < level.m.size(); ++i) {
    const std::size_t span = level.m[i] * reach(kind_) + 1;
    const double* x = level.phase.data() + level.next[i];
    const std::size_t left = level.phase.size() - level.next[i];
    if (left >= span) {
      const std::size_t n = left - span + 1;
      level.sum[i] += kind_ == AllanKind::kAllan      ? sum_second(x, level.m[i], n)
                      : kind_ == AllanKind::kHadamard ? sum_third(x, level.m[i], n)
                                                      : sum_modified(x, level.m[i], n);
      level.windows[i] += n;
      level.next[i] += n;
    }
    keep = std::min(keep, level.next[i]);
  }
  level.phase.erase(level.phase.begin(), level.phase.begin() + static_cast<std::ptrdiff_t>(keep));
  for (auto& next : level.next) next -= keep;
}

std::vector<AllanPoint> AllanStream::points(std::size_t least) const {
  std::vector<AllanPoint> points;
  for (std::size_t number = 0; number < levels_.size(); ++number) {
    const std::size_t stride = std::size_t{1} << number;
    for (std::size_t i = 0; i < levels_[number].m.size(); ++i) {
      const auto& level = levels_[number];
      AllanPoint p;
      p.m = level.m[i] * stride;
      if (level.windows[i] == 0 || p.m * (least + reach(kind_) - 1) > count_) continue;
      p.stride = stride;
      p.windows = level.windows[i];
      p.tau = static_cast<double>(p.m) * dt_;
      const double mean = level.sum[i] / static_cast<double>(p.windows);
      // Allan and modified: 1/(2 tau^2); Hadamard: 1/(6 tau^2) of the squared third difference.
      p.deviation = std::sqrt(mean / (kind_ == AllanKind::kHadamard ? 6.0 : 2.0)) / p.tau;
      // White noise, overlapping windows: 2(n - m)/(3 m) … at least one degree of freedom.
      const double ratio = static_cast<double>(count_) / static_cast<double>(p.m);
      const double freedom = std::max(1.0, (1.5 * (ratio - 1.0) - 2.0) * 4.0 / 4.0);
      p.deviation_std = p.deviation / std::sqrt(2.0 * freedom);
      points.push_back(p);
    }
  }
  std::sort(points.begin(), points.end(),
            [](const AllanPoint& a, const AllanPoint& b) { return a.m < b.m; });
  return points;
}

namespace {

// Generalised autocovariance of the phase per unit of each coefficient squared, such that the
// second difference has the Allan variance of its name (decision 0008). x: lag [s]; dt: what counts
// as zero lag for quantisation.
double phase_covariance(int kind, double x, double dt) {
  x = std::fabs(x);
  switch (kind) {
    case AllanFit::kQuantisation:
      return x < 0.5 * dt ? 1.0 : 0.0;
    case AllanFit::kRandomWalk:
      return -0.5 * x;
    case AllanFit::kBiasInstability:
      return x == 0.0 ? 0.0 : x * x * std::log(x) / (2.0 * std::numbers::pi);
    case AllanFit::kRateRandomWalk:
      return x * x * x / 12.0;
    default:
      return 0.0;
  }
}

double allan_basis(int kind, double tau) {
  switch (kind) {
    case AllanFit::kQuantisation:
      return 3.0 / (tau * tau);
    case AllanFit::kRandomWalk:
      return 1.0 / tau;
    case AllanFit::kBiasInstability:
      return 2.0 * std::numbers::ln2 / std::numbers::pi;
    case AllanFit::kRateRandomWalk:
      return tau / 3.0;
    default:
      return 0.5 * tau * tau;
  }
}

// What a pair of averaging times contributes to cov(sigma^2_i, sigma^2_j), as a quadratic form in
// the noise coefficients squared: 2 sum of squared cross-covariances over all pairs of windows, and
// the cross term of a deterministic ramp.
struct PairForm {
  double product[4][4]{};
  double ramp[4]{};

  double at(const std::array<double, 5>& q) const {
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) sum += q[i] * q[j] * product[i][j];
      sum += q[i] * q[AllanFit::kRamp] * ramp[i];
    }
    return sum;
  }
};

PairForm pair_form(double a, double b, double dt, double length) {
  static constexpr double kWeight[3] = {1.0, -2.0, 1.0};
  PairForm form;
  // The squared covariance is smooth on the scale of the shorter window and gone beyond both
  // windows.
  const double wide = 1.5 * (a + b);
  const double step = std::max({dt, std::min(a, b) / 8.0, (a + b) / 100.0});
  const auto half = static_cast<long>(std::ceil(wide / step));
  const double room_a = length - 2.0 * a, room_b = length - 2.0 * b;
  for (long k = -half; k <= half; ++k) {
    const double lag =
        a - b + static_cast<double>(k) * step;  // zero: the windows share their middle
    const double fits = std::min(room_a, room_b - lag) - std::max(0.0, -lag);
    if (fits <= 0.0) continue;
    double c[4];
    for (int kind = 0; kind < 4; ++kind) {
      c[kind] = 0;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          c[kind] += kWeight[i] * kWeight[j] * phase_covariance(kind, lag + j * b - i * a, dt);
    }
    const double weight = (fits + dt) * step;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) form.product[i][j] += c[i] * c[j] * weight;
      form.ramp[i] += c[i] * weight;
    }
  }
  const double scale = 1.0 / ((room_a + dt) * (room_b + dt) * 4.0 * a * a * b * b);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) form.product[i][j] *= 2.0 * scale;
    form.ramp[i] *= 4.0 * a * a * b * b * scale;
  }
  return form;
}

}  // namespace

namespace {

// One fit with a relative model error beside the covariance that the noise implies.
AllanFit fit_with(std::vector<AllanPoint>& points, const std::vector<PairForm>& forms,
                  const std::array<bool, 5>& allowed, double model_error) {
  AllanFit fit;
  fit.model_error = model_error;
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd a(n, 5);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& p = points[static_cast<std::size_t>(i)];
    y[i] = p.deviation * p.deviation;
    for (int kind = 0; kind < 5; ++kind) a(i, kind) = allan_basis(kind, p.tau);
  }
  std::array<double, 5> q{};
  Eigen::MatrixXd cov = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& p = points[static_cast<std::size_t>(i)];
    const double s = 2.0 * p.deviation * p.deviation_std;
    const double extra = 2.0 * model_error * y[i];
    cov(i, i) = s * s + extra * extra + 1e-300;
  }
  std::array<bool, 5> active = allowed;
  Eigen::MatrixXd information;
  for (int round = 0; round < 6; ++round) {
    const Eigen::LLT<Eigen::MatrixXd> factor(cov);
    // Least squares over the active columns; drop the most negative until none is.
    active = allowed;
    Eigen::VectorXd x;
    std::vector<int> columns;
    for (;;) {
      columns.clear();
      for (int kind = 0; kind < 5; ++kind)
        if (active[static_cast<std::size_t>(kind)]) columns.push_back(kind);
      if (columns.empty()) return fit;
      Eigen::MatrixXd b(n, static_cast<Eigen::Index>(columns.size()));
      for (std::size_t k = 0; k < columns.size(); ++k)
        b.col(static_cast<Eigen::Index>(k)) = a.col(columns[k]);
      const Eigen::MatrixXd wb = factor.matrixL().solve(b);
      const Eigen::VectorXd wy = factor.matrixL().solve(y);
      // Columns differ by many orders of magnitude.
      const Eigen::VectorXd scale = wb.colwise().norm().cwiseInverse();
      const Eigen::MatrixXd scaled = wb * scale.asDiagonal();
      x = scale.asDiagonal() * scaled.colPivHouseholderQr().solve(wy);
      information = scaled.transpose() * scaled;
      information =
          scale.cwiseInverse().asDiagonal() * information * scale.cwiseInverse().asDiagonal();
      Eigen::Index worst = 0;
      if (x.cwiseProduct(scale.cwiseInverse()).minCoeff(&worst) >= 0.0) {
        fit.chi2 = (wy - wb * x).squaredNorm();
        fit.dof = points.size() - columns.size();
        break;
      }
      active[static_cast<std::size_t>(columns[static_cast<std::size_t>(worst)])] = false;
    }
    q = {};
    for (std::size_t k = 0; k < columns.size(); ++k)
      q[static_cast<std::size_t>(columns[k])] = x[static_cast<Eigen::Index>(k)];
    const Eigen::MatrixXd variance = information.inverse();
    fit.std = {};
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const auto kind = static_cast<std::size_t>(columns[k]);
      const auto index = static_cast<Eigen::Index>(k);
      fit.value[kind] = std::sqrt(q[kind]);
      const double s = std::sqrt(variance(index, index));
      // d sqrt(q) = dq/(2 sqrt(q)); near zero the square root is no longer linear.
      fit.std[kind] =
          q[kind] > s ? s / (2.0 * fit.value[kind]) : std::sqrt(q[kind] + s) - fit.value[kind];
      fit.found[kind] = q[kind] > 2.0 * s;
    }
    std::size_t pair = 0;
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = i; j < n; ++j) cov(i, j) = cov(j, i) = forms[pair++].at(q);
    // Neighbouring averaging times share most of their windows: keep the factorisation away from
    // singular.
    for (Eigen::Index i = 0; i < n; ++i) {
      const double extra = 2.0 * model_error * y[i];  // of the variance
      cov(i, i) = cov(i, i) * (1.0 + 1e-3) + extra * extra;
    }
  }
  for (int kind = 0; kind < 5; ++kind) {
    const auto k = static_cast<std::size_t>(kind);
    if (active[k]) continue;
    // A coefficient found zero: what one sigma of the estimates would have hidden.
    fit.value[k] = 0.0;
    double best = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double limit = std::sqrt(std::sqrt(cov(i, i)) / a(i, kind));
      if (best == 0 || limit < best) best = limit;
    }
    fit.std[k] = allowed[k] ? best : 0.0;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    auto& p = points[static_cast<std::size_t>(i)];
    p.deviation_std = std::sqrt(cov(i, i)) / (2.0 * p.deviation);
  }
  return fit;
}

}  // namespace

double allan_deviation(const AllanFit& fit, double tau) {
  double sum = 0;
  for (int kind = 0; kind < 5; ++kind) {
    const double c = fit.value[static_cast<std::size_t>(kind)];
    sum += c * c * allan_basis(kind, tau);
  }
  return std::sqrt(sum);
}

AllanFit fit_allan(std::vector<AllanPoint>& points, double dt, std::size_t samples,
                   const std::array<bool, 5>& allowed) {
  if (points.empty()) return {};
  const double length = static_cast<double>(samples) * dt;
  std::vector<PairForm> forms;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = i; j < points.size(); ++j)
      forms.push_back(pair_form(points[i].tau, points[j].tau, dt, length));
  const std::vector<AllanPoint> first = points;  // each fit starts from the same guess of the bands
  AllanFit fit = fit_with(points, forms, allowed, 0.0);
  const auto fits = [](const AllanFit& f) {
    const auto dof = static_cast<double>(f.dof);
    return f.dof == 0 || f.chi2 <= dof + 4.0 * std::sqrt(2.0 * dof);
  };
  if (fits(fit)) return fit;
  // The five noises are not all there is (a sensor's filter, vibration, motion): with the tight
  // bands of short averaging times the fit would follow those alone. The smallest model error that
  // explains the misfit, by bisection of its logarithm.
  double low = 1e-4, high = 3.0;
  for (int i = 0; i < 14; ++i) {
    const double middle = std::sqrt(low * high);
    auto trial = first;
    const AllanFit at = fit_with(trial, forms, allowed, middle);
    (at.chi2 > static_cast<double>(at.dof) ? low : high) = middle;
  }
  points = first;
  return fit_with(points, forms, allowed, high);
}

}  // namespace loxo
