// SPDX-License-Identifier: Apache-2.0
// What an IMU makes of the true increments: one kernel for drives on disk (double) and for trials
// of a campaign (lanes). No allocation after construction; noise is a pure function of (seed,
// trial, source, sample).
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "loxo/ins/samples.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/noise_sources.hpp"

namespace loxo {

// One triad, gyros [rad/s] or accelerometers [m/s^2]; 1 sigma of what is drawn for each axis.
template <Real S = double>
struct TriadModel {
  S bias{0.0};          // constant
  S noise{0.0};         // white: rad/sqrt(s), m/s/sqrt(s)
  S walk{0.0};          // of the bias: rad/s/sqrt(s), m/s^2/sqrt(s)
  S markov{0.0};        // first-order Markov part of the bias, stationary
  S scale{0.0};         // measured / true - 1
  S misalignment{0.0};  // rad, each of the six elements off the diagonal
  S temperature{0.0};   // bias per kelvin
  S quantisation{0.0};  // step of an increment as given, not drawn: rad, m/s
};
template <Real S = double>
struct ImuModel {
  TriadModel<S> gyro, accel;
  S g_sensitivity{0.0};  // rad/s per m/s^2, each of the nine elements
};

// A sine of the mounting plate that the vehicle does not follow: rms of specific force [m/s^2] and
// of angular rate [rad/s] along each body axis.
struct VibrationLine {
  double frequency = 0;  // Hz
  double accel[3]{}, gyro[3]{};
};
// What is the same in all trials.
struct ImuSurroundings {
  double gyro_markov_time = 3600, accel_markov_time = 3600;  // s
  double gyro_offset[3]{}, accel_offset[3]{};                // known constants, added: rad/s, m/s^2
  // Temperature less that of calibration [K]: from, to, linear between the two times [s].
  double temperature_from = 0, temperature_to = 0, ramp_begin = 0, ramp_end = 0;
  std::vector<VibrationLine> vibration;

  double temperature(double t) const {
    if (!(ramp_end > ramp_begin)) return t < ramp_begin ? temperature_from : temperature_to;
    const double x = std::clamp((t - ramp_begin) / (ramp_end - ramp_begin), 0.0, 1.0);
    return temperature_from + x * (temperature_to - temperature_from);
  }
};

// Whole steps of a running sum; what is left over is told next time. step 0: as it is.
template <Real S = double>
struct Quantiser {
  S rest{0.0};
  S told(S x, S step) {
    const auto on = step > S(0.0);
    const S q = select(on, step, S(1.0));
    const S sum = rest + x;
    const S whole = q * floor(sum / q + 0.5);
    rest = select(on, sum - whole, S(0.0));
    return select(on, whole, x);
  }
};

template <Real S = double>
class ImuSensor {
 public:
  // dt: of a sample [s]. Processes slower than white noise go on once a second, and at least twenty
  // times in a Markov time; a temperature is that of the middle of such a stretch.
  ImuSensor(const ImuModel<S>& model, const ImuSurroundings& around, double dt, std::uint64_t seed,
            std::uint64_t trial)
      : model_(model),
        around_(&around),
        dt_(dt),
        white_{seed, trial, noise_source::kImu},
        slow_{seed, trial, noise_source::kImuSlow} {
    using Body3 = Vec<Body, S>;
    const auto c = Stream<S>{seed, trial, noise_source::kImuConstants}.template normals<45>(0);
    const auto three = [&](S sigma, int i) {
      // Adding to +0 leaves no -0, so that a source of size 0 gives the bits of one that is off.
      return Body3{0.0 + sigma * c[i], 0.0 + sigma * c[i + 1], 0.0 + sigma * c[i + 2]};
    };
    bias_[0] = three(model.gyro.bias, 0);
    bias_[1] = three(model.accel.bias, 3);
    gain_[0] = three(model.gyro.scale, 6);
    gain_[1] = three(model.accel.scale, 9);
    for (int k = 0; k < 6; ++k) {
      across_[0][k] = 0.0 + model.gyro.misalignment * c[12 + k];
      across_[1][k] = 0.0 + model.accel.misalignment * c[18 + k];
    }
    for (int k = 0; k < 9; ++k) g_[k] = 0.0 + model.g_sensitivity * c[24 + k];
    warmth_[0] = three(model.gyro.temperature, 33);
    warmth_[1] = three(model.accel.temperature, 36);
    markov_[0] = three(model.gyro.markov, 39);
    markov_[1] = three(model.accel.markov, 42);
    const double root = loxo::sqrt(dt);
    noise_[0] = root * model.gyro.noise;
    noise_[1] = root * model.accel.noise;
    const S zero(0.0);
    noisy_ = any(model.gyro.noise > zero) || any(model.accel.noise > zero);
    crossed_ = any(model.gyro.misalignment > zero) || any(model.accel.misalignment > zero);
    heavy_ = any(model.g_sensitivity > zero);
    stepped_ = any(model.gyro.quantisation > zero) || any(model.accel.quantisation > zero);
    walks_ = any(model.gyro.walk > zero) || any(model.accel.walk > zero);
    wanders_ = any(model.gyro.markov > zero) || any(model.accel.markov > zero);
    warms_ = any(model.gyro.temperature > zero) || any(model.accel.temperature > zero);
    // The same in every trial, whatever its sources: lanes go on together.
    const double stretch = min(1.0, min(around.gyro_markov_time, around.accel_markov_time) / 20.0);
    every_ = static_cast<int>(max(1.0, loxo::round(stretch / dt)));
    const double whole = every_ * dt;
    const double tau[2] = {around.gyro_markov_time, around.accel_markov_time};
    const S size[2] = {model.gyro.markov, model.accel.markov};
    const S walk[2] = {model.gyro.walk, model.accel.walk};
    for (int k = 0; k < 2; ++k) {
      decay_[k] = loxo::exp(-whole / tau[k]);
      fresh_[k] = size[k] * loxo::sqrt(-loxo::expm1(-2.0 * whole / tau[k]));
      stride_[k] = walk[k] * loxo::sqrt(whole);
    }
    for (std::size_t l = 0; l < around.vibration.size(); ++l) {
      for (int k = 0; k < 6; ++k) {
        Phase p;
        sincos(2.0 * kPi * Stream<S>{seed, trial, noise_source::kVibration}.uniform(6 * l + k), p.s,
               p.c);
        phases_.push_back(p);
      }
    }
    settle();
  }

  // What the sensor gives for the true increments th [rad], v [m/s] of sample i: 0, 1, 2 … in turn.
  // The stamp is the caller's.
  ImuIncrement<S> measure(std::uint64_t i, const double* th, const double* v) {
    if (until_ == 0) go_on();
    --until_;
    S e[6] = {gain_[0].x * th[0] + drift_[0].x, gain_[0].y * th[1] + drift_[0].y,
              gain_[0].z * th[2] + drift_[0].z, gain_[1].x * v[0] + drift_[1].x,
              gain_[1].y * v[1] + drift_[1].y,  gain_[1].z * v[2] + drift_[1].z};
    if (noisy_) {
      const auto n = white_.template normals<6>(i);
      for (int k = 0; k < 3; ++k) {
        e[k] = e[k] + noise_[0] * n[k];
        e[k + 3] = e[k + 3] + noise_[1] * n[k + 3];
      }
    }
    if (crossed_) {
      for (int t = 0; t < 2; ++t) {
        const double* x = t == 0 ? th : v;
        const S* m = across_[t];
        S* y = e + 3 * t;
        y[0] = y[0] + (m[0] * x[1] + m[1] * x[2]);
        y[1] = y[1] + (m[2] * x[0] + m[3] * x[2]);
        y[2] = y[2] + (m[4] * x[0] + m[5] * x[1]);
      }
    }
    if (heavy_)
      for (int k = 0; k < 3; ++k)
        e[k] = e[k] + (g_[3 * k] * v[0] + g_[3 * k + 1] * v[1] + g_[3 * k + 2] * v[2]);
    if (!phases_.empty()) shake(i, e);
    ImuIncrement<S> u{0.0,
                      dt_,
                      {th[0] + e[0], th[1] + e[1], th[2] + e[2]},
                      {v[0] + e[3], v[1] + e[4], v[2] + e[5]}};
    if (stepped_) {
      const S qw = model_.gyro.quantisation, qf = model_.accel.quantisation;
      u.dtheta = {steps_[0].told(u.dtheta.x, qw), steps_[1].told(u.dtheta.y, qw),
                  steps_[2].told(u.dtheta.z, qw)};
      u.dv = {steps_[3].told(u.dv.x, qf), steps_[4].told(u.dv.y, qf), steps_[5].told(u.dv.z, qf)};
    }
    return u;
  }

  // The sensor's bias now, all slow parts together: rad/s, m/s^2.
  Vec<Body, S> gyro_bias() const { return (1.0 / dt_) * drift_[0]; }
  Vec<Body, S> accel_bias() const { return (1.0 / dt_) * drift_[1]; }

 private:
  struct Phase {
    S s, c;
  };
  // The next stretch begins.
  void go_on() {
    ++stretch_;
    if (walks_ || wanders_) {
      S n[12];
      slow_.fill(stretch_, n, wanders_ ? 12 : 6);
      for (int k = 0; k < 2; ++k) {
        const S* w = n + 3 * k;
        bias_[k] = bias_[k] + stride_[k] * Vec<Body, S>{w[0], w[1], w[2]};
        if (wanders_) {
          const S* m = n + 6 + 3 * k;
          markov_[k] = decay_[k] * markov_[k] + fresh_[k] * Vec<Body, S>{m[0], m[1], m[2]};
        }
      }
    }
    settle();
  }
  void settle() {
    until_ = every_;
    for (int k = 0; k < 2; ++k) {
      const double* o = k == 0 ? around_->gyro_offset : around_->accel_offset;
      Vec<Body, S> b = bias_[k];
      if (wanders_) b = b + markov_[k];
      if (warms_) {
        const double t = (static_cast<double>(stretch_) + 0.5) * every_ * dt_;
        b = b + around_->temperature(t) * warmth_[k];
      }
      drift_[k] = dt_ * Vec<Body, S>{b.x + o[0], b.y + o[1], b.z + o[2]};
    }
  }
  // The integral of a sine over the sample: amplitude dt sinc(w dt/2) at its middle.
  void shake(std::uint64_t i, S* e) const {
    const double mid = (static_cast<double>(i) + 0.5) * dt_;
    const auto& lines = around_->vibration;
    for (std::size_t l = 0; l < lines.size(); ++l) {
      const double turns = lines[l].frequency * mid, half = kPi * lines[l].frequency * dt_;
      double s, c;
      sincos(2.0 * kPi * (turns - loxo::floor(turns)), s, c);
      const double size = loxo::sqrt(2.0) * dt_ * loxo::sin(half) / half;
      for (int k = 0; k < 6; ++k) {
        const double rms = k < 3 ? lines[l].gyro[k] : lines[l].accel[k - 3];
        const Phase& p = phases_[6 * l + static_cast<std::size_t>(k)];
        e[k] = e[k] + (size * rms) * (s * p.c + c * p.s);
      }
    }
  }

  ImuModel<S> model_;
  const ImuSurroundings* around_;
  double dt_;
  Stream<S> white_, slow_;
  Vec<Body, S> bias_[2], gain_[2], warmth_[2], markov_[2], drift_[2];
  S across_[2][6], g_[9], noise_[2], fresh_[2], stride_[2];
  double decay_[2]{};
  bool noisy_ = false, crossed_ = false, heavy_ = false, stepped_ = false, walks_ = false,
       wanders_ = false, warms_ = false;
  int every_ = 1, until_ = 0;
  std::uint64_t stretch_ = 0;
  Quantiser<S> steps_[6];
  std::vector<Phase> phases_;
};

}  // namespace loxo
