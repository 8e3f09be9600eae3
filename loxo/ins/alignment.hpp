// SPDX-License-Identifier: Apache-2.0
// Attitude from standing still, in closed form, and how well it can be known. estimation.md 4.
#pragma once
#include "loxo/ins/increments.hpp"

namespace loxo {

// What the sensors declare of themselves, 1 sigma.
struct AlignmentErrors {
  double gyro_bias = 0;                    // rad/s
  double gyro_noise = 0, accel_noise = 0;  // rad/sqrt(s), m/s/sqrt(s)
};
// What the heading's sigma is made of [rad]. At a pole w_N is zero and every part infinite: no
// heading there.
struct HeadingSigma {
  double gyro_bias = 0, gyro_noise = 0, accel_noise = 0, sway = 0;
  double total() const;
};
// The latitude [rad] at which an east gyro bias [rad/s] alone makes a heading's sigma reach `sigma`
// [rad]; 0 where it does so everywhere. estimation.md 4.5
double latitude_limit(double gyro_bias, double w_ie, double sigma);
// Beyond it a heading from the gyros is refused (estimation.md 4.5).
inline constexpr double kRefusedHeading = 5.0 * 3.14159265358979323846 / 180.0;  // rad

// Rows e, n, u of C_nb from the mean rate [rad/s] and specific force [m/s^2]; right only if the
// base does not turn. estimation.md 4.1
Rot<Geographic, Body> coarse_static(const Vec<Body>& mean_rate, const Vec<Body>& mean_force);
// w_north = w_ie cos(lat) [rad/s], duration [s], sway_angle: rms of the integrated, detrended rate
// [rad]. [EST-14]
HeadingSigma coarse_static_sigma(const AlignmentErrors& errors, double w_north, double duration,
                                 double sway_angle);

// Heading [rad, 0 … 2 pi) of the forward axis from the mean rate [rad/s] as seen on the level given
// [rad]: the horizontal rate sensed points where that of the Earth, and of a steady known velocity
// [m/s] over it, must point (without it the north-steaming error v_N/(R w cos L)). The base must
// not turn on the way; roll and pitch may be any. estimation.md 4.1, vehicle rates by polar.md 2.4
struct SteadyMotion {
  double v_e = 0, v_n = 0;      // m/s
  double per_e = 0, per_n = 0;  // 1/(N + h), 1/(M + h) [1/m]
};
double gyrocompass(const Vec<Body>& mean_rate, double roll, double pitch, double lat, double w_ie,
                   const SteadyMotion& motion = {});

// The inertial-frame (i0) method: the gyros follow the base however it rocks, the velocity grown
// from the specific force shows how gravity turns with the Earth. For 100 s and more.
// estimation.md 4.2
class InertialFrameAlignment {
 public:
  // lat [rad], Earth rate [rad/s], gravity [m/s^2]. The base stays at its place and moves about it
  // only.
  InertialFrameAlignment(double lat, double w_ie, double gravity);
  void add(const ImuIncrement<double>& sample);
  double duration() const { return time_; }  // s
  // C_nb at the end of the last sample; needs two samples.
  Rot<Geographic, Body> attitude() const;
  // [EST-15], and a bounded sway from the velocities' misfit.
  HeadingSigma sigma(const AlignmentErrors& errors) const;
  // Latitude [rad] of a base that stands, from how gravity turns in inertial space (its north part)
  // and the rate about it (its up part); the latitude given at construction does not enter.
  // Sigma: that of the rates, sigma().total() cos(lat).
  double latitude() const;

 private:
  double lat_, w_ie_, gravity_, time_ = 0;
  Quat<Inertial, Body> q_ = Quat<Inertial, Body>::identity();
  Vec<Inertial> velocity_;
  ImuIncrement<double> before_;
  bool has_before_ = false;
  // B(t) = g (cosL V, cosL sinL R, S + sin^2 L R) with V, R, S functions of time alone: their sums
  // serve any latitude.
  double parts_[3][3]{};  // sum of (V, R, S) A^T dt
  double grams_[3][3]{};  // sum of (V, R, S)(V, R, S)^T dt
  double sum_a_ = 0;      // of |A|^2 dt
  // The turn in inertial axes, its sum over time and over time times time: its mean rate by least
  // squares, in which a base that yaws to and fro leaves least.
  Vec<Inertial> turned_, turned_dt_, turned_t_dt_;
  struct Fit {
    double m[3][3];  // sum of B A^T dt
    double sum_b;    // of |B|^2 dt
  };
  Fit fit_at(double lat) const;
};

}  // namespace loxo
