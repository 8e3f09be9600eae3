// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/transfer_budget.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "loxo/earth/gravity.hpp"
#include "loxo/num/random.hpp"

namespace loxo {
namespace {

using V = Vec<Body, double>;

V squared(const V& v) { return {v.x * v.x, v.y * v.y, v.z * v.z}; }
V rooted(const V& v) { return {std::sqrt(v.x), std::sqrt(v.y), std::sqrt(v.z)}; }

// Mean and mean square of a series of conversions, with the variance split by block means.
class Series {
 public:
  explicit Series(double step)
      : slow_(std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(1800.0 / step)))),
        fast_(std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(60.0 / step)))) {}
  void add(const V& v) {
    sum_ += v;
    square_ += squared(v);
    minute_ += v;
    half_hour_ += v;
    ++n_;
    if (n_ % fast_ == 0) {
      minutes_ += dot(minute_, minute_) / static_cast<double>(fast_);
      minute_ = {};
    }
    if (n_ % slow_ == 0) {
      half_hours_ += dot(half_hour_, half_hour_) / static_cast<double>(slow_);
      half_hour_ = {};
    }
  }
  V mean() const { return sum_ * (1.0 / static_cast<double>(n_)); }
  V mean_square() const { return square_ * (1.0 / static_cast<double>(n_)); }
  // Variances: of half-hour means about the mean, of minute means within, of the rest.
  std::array<double, 3> bands() const {
    const double n = static_cast<double>(n_);
    const double n_slow = static_cast<double>(n_ / slow_ * slow_),
                 n_fast = static_cast<double>(n_ / fast_ * fast_);
    const double all = square_.x + square_.y + square_.z, mean2 = dot(mean(), mean());
    const double slow = n_slow > 0 ? half_hours_ / n_slow : mean2,
                 fast = n_fast > 0 ? minutes_ / n_fast : mean2;
    return {std::max(0.0, slow - mean2), std::max(0.0, fast - slow), std::max(0.0, all / n - fast)};
  }

 private:
  std::size_t slow_, fast_, n_ = 0;
  V sum_, square_, minute_, half_hour_;
  double minutes_ = 0, half_hours_ = 0;
};

void finish(EquivalentError& e) {
  e.bias_f = rooted(e.bias_f);
  e.bias_w = rooted(e.bias_w);
  e.rms_f = rooted(e.rms_f);
  e.rms_w = rooted(e.rms_w);
}

}  // namespace

TransferBudget transfer_budget(const Ellipsoid& earth, const std::vector<TransferPoint>& track,
                               double step, const ReferenceSigma& sigma, std::size_t draws,
                               std::uint64_t seed) {
  TransferBudget b;
  b.draws = draws;
  b.points = track.size();
  const auto take = [&](EquivalentError& e, const ReferenceError& error, bool definition,
                        double weight, ErrorSpectrum* spectrum) {
    Series f(step), w(step);
    for (const auto& p : track) {
      const auto c =
          definition ? conversion_error(earth, p, error) : conversion_error_full(earth, p, error);
      f.add(c.df);
      w.add(c.dw);
    }
    e.bias_f += squared(f.mean()) * weight;
    e.bias_w += squared(w.mean()) * weight;
    e.rms_f += f.mean_square() * weight;
    e.rms_w += w.mean_square() * weight;
    if (spectrum != nullptr)
      for (std::size_t i = 0; i < 3; ++i) {
        spectrum->f[i] += f.bands()[i] * weight;
        spectrum->w[i] += w.bands()[i] * weight;
      }
  };
  // First order: the errors' variances add.
  for (int source = 0; source < 5; ++source) {
    ReferenceError e;
    if (source == 0) e.heading = sigma.heading;
    if (source == 1) e.pitch = sigma.level;
    if (source == 2) e.roll = sigma.level;
    if (source == 3) e.ve = sigma.velocity;
    if (source == 4) e.vn = sigma.velocity;
    take(b.formula, e, false, 1.0, &b.spectrum);
  }
  finish(b.formula);
  for (auto* share : {&b.spectrum.f, &b.spectrum.w}) {
    const double all = (*share)[0] + (*share)[1] + (*share)[2];
    for (double& x : *share) x = all > 0 ? x / all : 0.0;
  }
  for (std::size_t k = 0; k < draws; ++k) {
    const auto z = Stream<double>{seed, k, 0}.normals<5>(0);
    ReferenceError e;
    e.heading = sigma.heading * z[0];
    e.pitch = sigma.level * z[1];
    e.roll = sigma.level * z[2];
    e.ve = sigma.velocity * z[3];
    e.vn = sigma.velocity * z[4];
    take(b.monte_carlo, e, true, 1.0 / static_cast<double>(draws), nullptr);
  }
  finish(b.monte_carlo);
  return b;
}

Verdict transfer_verdict(const EquivalentError& e, const UnitSigma& unit, double share) {
  const auto ratio = [](double x, double y) { return x == 0 ? 0.0 : x / y; };
  Verdict v;
  v.gyro_ratio = ratio(std::max({e.bias_w.x, e.bias_w.y, e.bias_w.z}), unit.gyro_bias);
  v.accel_ratio = ratio(std::max(e.bias_f.x, e.bias_f.y), unit.accel_bias);
  v.good = v.gyro_ratio <= share && v.accel_ratio <= share;
  return v;
}

PlanRow plan_row(const Ellipsoid& earth, double latitude, double angle, const ReferenceSigma& sigma,
                 const UnitSigma& unit, double share) {
  PlanRow r;
  r.latitude = latitude;
  r.angle = angle;
  const double l = 0.5 * 3.141592653589793 - latitude;
  TransferPoint p;
  p.tlon = l;
  p.angle = angle;
  set_gravity(earth, p);
  const AB ab = transfer_ab(l, angle);
  r.A = ab.A;
  r.B = ab.B;
  r.G = p.gm - p.g;
  const double w = earth.w_ie, A = std::fabs(ab.A), B = std::fabs(ab.B), G = std::fabs(r.G);
  // Mean square over headings of one horizontal axis: half of the sum of the coefficients' squares
  // (15)-(18).
  const double f_v = 2 * A * w * sigma.velocity, f_p = G * sigma.level;
  r.accel = std::sqrt(f_v * f_v + f_p * f_p);  // two velocity axes, two tilts, each half
  const double w_p = A * w * sigma.level, w_u = B * w * sigma.heading;
  r.gyro = std::sqrt(w_p * w_p + 0.5 * w_u * w_u);
  r.gyro_up = B * w * sigma.level;
  EquivalentError e;
  e.bias_f = {r.accel, r.accel, 0.0};
  e.bias_w = {r.gyro, r.gyro, r.gyro_up};
  r.verdict = transfer_verdict(e, unit, share);
  const double inf = std::numeric_limits<double>::infinity();
  const auto limit = [&](double allowed, double k) { return k > 0 ? allowed / k : inf; };
  const double half = std::sqrt(0.5);  // two sources to an axis, equal parts
  const double af = share * unit.accel_bias, aw = share * unit.gyro_bias;
  r.needed.velocity = limit(af * half, 2 * A * w);
  r.needed.level = std::min({limit(af * half, G), limit(aw * half, A * w), limit(aw, B * w)});
  r.needed.heading = limit(aw * half, B * w * std::sqrt(0.5));
  return r;
}

}  // namespace loxo
