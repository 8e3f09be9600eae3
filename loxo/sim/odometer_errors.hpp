// SPDX-License-Identifier: Apache-2.0
// What an odometer makes of the wheel's true way, and what a sensor of one number makes of the
// truth: kernels for drives on disk (double) and for campaigns (lanes).
#pragma once
#include <cstdint>
#include <deque>
#include <vector>

#include "loxo/num/random.hpp"
#include "loxo/sim/imu_errors.hpp"

namespace loxo {

// From `from` to `to` [s] the wheel turns (1 + slip) times what the ground says; dead: not at all.
struct WheelFault {
  double from = 0, to = 0, slip = 0;
  bool dead = false;
};
// Turned / true over (t0, t1], faults weighted by their share of it.
double wheel_factor(const std::vector<WheelFault>& faults, double t0, double t1);

template <Real S = double>
struct OdometerModel {
  S scale{1.0};              // k: indicated / true, as given
  S scale_error{0.0};        // 1 sigma, relative, constant, drawn
  S wear{0.0};               // relative change of k per metre of way, as given
  S scale_walk{0.0};         // of k, relative: 1/sqrt(s)
  S scale_markov{0.0};       // of k, relative: first-order Markov, stationary
  S noise{0.0};              // m, white, of each reading
  S scale_noise{0.0};        // white, of each reading relative to it
  S distance_noise{0.0};     // m/sqrt(m)
  S quantisation{0.0};       // m of indicated way, its phase drawn
  double markov_time = 600;  // s
};

template <Real S = double>
class Odometer {
 public:
  Odometer(const OdometerModel<S>& model, std::uint64_t seed, std::uint64_t trial)
      : model_(model), stream_{seed, trial, noise_source::kOdometer} {
    const Stream<S> constants{seed, trial, noise_source::kOdometerConstants};
    scale_ = model.scale * (1.0 + model.scale_error * constants.normal(0));
    const S zero(0.0);
    stepped_ = any(model.quantisation > zero);
    if (stepped_) steps_.rest = model.quantisation * (constants.uniform(1) - 0.5);
    markov_ = 0.0 + model.scale_markov * constants.normal(2);
    count_ = any(model.scale_markov > zero)     ? 5
             : any(model.scale_walk > zero)     ? 4
             : any(model.distance_noise > zero) ? 3
             : any(model.scale_noise > zero)    ? 2
             : any(model.noise > zero)          ? 1
                                                : 0;
    wears_ = any(model.wear != zero);
  }
  // Indicated metres over an interval of dt [s] with the true way `way` [m] (reverse: negative), of
  // which the wheel turned `factor` times; reading `tick`: 0, 1, 2 … in turn.
  S reading(std::uint64_t tick, double way, double factor, double dt) {
    S n[5] = {S(0.0), S(0.0), S(0.0), S(0.0), S(0.0)};
    if (count_ > 0) stream_.fill(tick, n, count_);
    S k = scale_;
    if (wears_) {
      driven_ += 0.5 * loxo::fabs(way);
      k = k * (1.0 + driven_ * model_.wear);
      driven_ += 0.5 * loxo::fabs(way);
    }
    if (count_ >= 4) {
      const S half = loxo::sqrt(0.5 * dt) * model_.scale_walk;
      // A walk at mid-interval has half the interval's variance; both halves share one draw.
      k = k * (1.0 + (walked_ + half * n[3]));
      walked_ = walked_ + loxo::sqrt(2.0) * half * n[3];
    }
    if (count_ == 5) {
      k = k * (1.0 + markov_);
      const double a = loxo::exp(-dt / model_.markov_time);
      markov_ = a * markov_ + (loxo::sqrt(1.0 - a * a) * model_.scale_markov) * n[4];
    }
    if (factor == 0) return S(0.0);  // a dead encoder has no noise either
    const double turned = way * factor;
    S x = turned * k * (1.0 + model_.scale_noise * n[1]) + model_.noise * n[0] +
          loxo::sqrt(loxo::fabs(turned)) * model_.distance_noise * n[2];
    if (stepped_) x = steps_.told(x, model_.quantisation);
    return x;
  }
  S scale() const { return scale_; }  // k of this trial before wear and walk

 private:
  OdometerModel<S> model_;
  Stream<S> stream_;
  S scale_, walked_{0.0}, markov_;
  Quantiser<S> steps_;
  double driven_ = 0;
  int count_ = 0;
  bool stepped_ = false, wears_ = false;
};

// A sensor of one number, or of one of several alike: constant, drift, white noise and a
// first-order Markov part, 1 sigma each.
template <Real S = double>
struct ChannelModel {
  S bias{0.0}, drift{0.0}, noise{0.0}, markov{0.0};  // x, x/s, x, x
  S walk{0.0};                                       // x/sqrt(s)
  double markov_time = 300;                          // s
};
template <Real S = double>
class Channel {
 public:
  // `source`: noise_source; `which`: of several alike.
  Channel(const ChannelModel<S>& model, std::uint64_t source, std::uint64_t which,
          std::uint64_t seed, std::uint64_t trial)
      : model_(model), stream_{seed, trial, source + (which << 8)} {
    // Readings count from 1: sample 0 is for the constants.
    const auto c = stream_.template normals<3>(0);
    bias_ = 0.0 + model.bias * c[0];
    drift_ = 0.0 + model.drift * c[1];
    markov_ = 0.0 + model.markov * c[2];
  }
  // The error of reading k (0, 1, 2 … in turn) at time t, the last reading dt before.
  S error(std::uint64_t k, double t, double dt) {
    const auto n = stream_.template normals<3>(k + 1);
    if (k > 0) {
      const double a = loxo::exp(-dt / model_.markov_time);
      markov_ = a * markov_ + (model_.markov * loxo::sqrt(1.0 - a * a)) * n[1];
      walked_ = walked_ + (loxo::sqrt(dt) * model_.walk) * n[2];
    }
    return bias_ + t * drift_ + markov_ + walked_ + model_.noise * n[0];
  }

 private:
  ChannelModel<S> model_;
  Stream<S> stream_;
  S bias_, drift_, markov_, walked_{0.0};
};

// Gross errors of a fix.
struct FixOutlier {
  double t = 0, east = 0, north = 0, up = 0;  // s, m: added to the first fix at or after t
};

// The wheel's way as it was some time ago: Hermite between the samples given, straight on before
// the first. Error (w dt)^4 / 384 of an acceleration that turns with w.
class WayMemory {
 public:
  explicit WayMemory(double delay) : delay_(delay) {}
  void add(double t, double way, double speed) {
    points_.push_back({t, way, speed});
    while (points_.size() > 2 && points_[1].t <= t - delay_) points_.pop_front();
  }
  // At the last t added, less the delay.
  double way() const;

 private:
  struct At {
    double t, way, speed;
  };
  double delay_;
  std::deque<At> points_;
};

}  // namespace loxo
