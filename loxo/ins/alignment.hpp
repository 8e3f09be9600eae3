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
// Beyond it a heading from the gyros is refused (estimation.md 4.5).
inline constexpr double kRefusedHeading = 5.0 * 3.14159265358979323846 / 180.0;  // rad

// Rows e, n, u of C_nb from the mean rate [rad/s] and specific force [m/s^2]; right only if the
// base does not turn. estimation.md 4.1
Rot<Geographic, Body> coarse_static(const Vec<Body>& mean_rate, const Vec<Body>& mean_force);
// w_north = w_ie cos(lat) [rad/s], duration [s], sway_angle: rms of the integrated, detrended rate
// [rad]. [EST-14]
HeadingSigma coarse_static_sigma(const AlignmentErrors& errors, double w_north, double duration,
                                 double sway_angle);

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

 private:
  double lat_, w_ie_, gravity_, time_ = 0;
  Quat<Inertial, Body> q_ = Quat<Inertial, Body>::identity();
  Vec<Inertial> velocity_;
  ImuIncrement<double> before_;
  bool has_before_ = false;
  double m_[3][3]{};              // sum of B A^T dt
  double sum_a_ = 0, sum_b_ = 0;  // of |A|^2 dt, |B|^2 dt
  Rot<Geographic, Inertial> wahba() const;
};

}  // namespace loxo
