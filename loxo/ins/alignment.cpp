// SPDX-License-Identifier: Apache-2.0
#include "loxo/ins/alignment.hpp"

#include <algorithm>
#include <cmath>

#include "loxo/num/functions.hpp"
#include "loxo/num/rotation_forms.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// Largest eigenvector of a symmetric 4 x 4 matrix by Jacobi's turns.
void largest_eigenvector(double k[4][4], double out[4]) {
  double v[4][4]{};
  for (int i = 0; i < 4; ++i) v[i][i] = 1;
  for (int sweep = 0; sweep < 30; ++sweep) {
    double off = 0, all = 0;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) (i == j ? all : off) += k[i][j] * k[i][j];
    if (!(off > 1e-34 * all)) break;
    for (int p = 0; p < 4; ++p)
      for (int q = p + 1; q < 4; ++q) {
        if (k[p][q] == 0) continue;
        const double th = (k[q][q] - k[p][p]) / (2 * k[p][q]);
        const double t = (th >= 0 ? 1 : -1) / (std::fabs(th) + std::sqrt(1 + th * th));
        const double c = 1 / std::sqrt(1 + t * t), s = t * c;
        for (int i = 0; i < 4; ++i) {
          const double a = k[i][p], b = k[i][q];
          k[i][p] = c * a - s * b, k[i][q] = s * a + c * b;
        }
        for (int i = 0; i < 4; ++i) {
          const double a = k[p][i], b = k[q][i];
          k[p][i] = c * a - s * b, k[q][i] = s * a + c * b;
          const double x = v[i][p], y = v[i][q];
          v[i][p] = c * x - s * y, v[i][q] = s * x + c * y;
        }
      }
  }
  int best = 0;
  for (int i = 1; i < 4; ++i)
    if (k[i][i] > k[best][best]) best = i;
  for (int i = 0; i < 4; ++i) out[i] = v[i][best];
}

// Davenport's form of Wahba's problem: the rotation X with the largest trace of X M^T.
Rot<Geographic, Inertial> wahba(const double (&m)[3][3]) {
  const double x = m[2][1] - m[1][2], y = m[0][2] - m[2][0], z = m[1][0] - m[0][1];
  double k[4][4] = {{m[0][0] + m[1][1] + m[2][2], x, y, z},
                    {x, m[0][0] - m[1][1] - m[2][2], m[0][1] + m[1][0], m[0][2] + m[2][0]},
                    {y, m[0][1] + m[1][0], m[1][1] - m[0][0] - m[2][2], m[1][2] + m[2][1]},
                    {z, m[0][2] + m[2][0], m[1][2] + m[2][1], m[2][2] - m[0][0] - m[1][1]}};
  double q[4];
  largest_eigenvector(k, q);
  return to_matrix(Quat<Geographic, Inertial>{q[0], q[1], q[2], q[3]});
}
double agreement(const Rot<Geographic, Inertial>& x, const double (&m)[3][3]) {
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum += x.m[i][j] * m[i][j];
  return sum;
}

}  // namespace

double latitude_limit(double gyro_bias, double w_ie, double sigma) {
  const double c = gyro_bias / (w_ie * sigma);  // sigma = bias/(w cos L)
  return c < 1 ? std::acos(c) : 0.0;
}

double gyrocompass(const Vec<Body>& w, double roll, double pitch, double lat, double w_ie,
                   const SteadyMotion& m) {
  // The level axes of the vehicle: right and forward, heading 0.
  const double sr = std::sin(roll), cr = std::cos(roll), sp = std::sin(pitch), cp = std::cos(pitch);
  const double right = cr * w.x + sr * w.z;
  const double forward = sp * sr * w.x + cp * w.y - sp * cr * w.z;
  // Azimuth of the true horizontal rate less its bearing from the bow.
  const double north = w_ie * std::cos(lat) + m.v_e * m.per_e, east = -m.v_n * m.per_n;
  return wrap_2pi(std::atan2(east, north) - std::atan2(right, forward));
}

double HeadingSigma::total() const {
  return std::hypot(std::hypot(gyro_bias, gyro_noise), std::hypot(accel_noise, sway));
}

Rot<Geographic, Body> coarse_static(const Vec<Body>& w, const Vec<Body>& f) {
  const Vec<Body> u = f * (1 / norm(f)), east = cross(w, u);
  const Vec<Body> e = east * (1 / norm(east)), n = cross(u, e);
  return from_axes<Geographic>(e, n, u);
}

HeadingSigma coarse_static_sigma(const AlignmentErrors& e, double w_north, double T,
                                 double sway_angle) {
  return {e.gyro_bias / w_north, e.gyro_noise / (std::sqrt(T) * w_north), 0,
          std::sqrt(2.0) * sway_angle / (T * w_north)};  // [EST-14]
}

InertialFrameAlignment::InertialFrameAlignment(double lat, double w_ie, double gravity)
    : lat_(lat), w_ie_(w_ie), gravity_(gravity) {}

void InertialFrameAlignment::add(const ImuIncrement<double>& s) {
  const StepIncrement<double> u = has_before_ ? one_sample(before_, s) : one_sample(s);
  velocity_ += rotate(q_, u.velocity);
  turned_ += rotate(q_, u.rotation);
  q_ = renormalized(q_ * exp_rotation<Body, Body>(u.rotation));
  before_ = s;
  has_before_ = true;
  time_ += s.dt;
  turned_dt_ += s.dt * turned_;
  turned_t_dt_ += (s.dt * time_) * turned_;
  // B(t): the integral of up turned about (0, cosL, sinL) by w t.
  const double a = w_ie_ * time_, half = std::sin(0.5 * a), sine = std::sin(a) / w_ie_;
  const double b[3] = {2 * half * half / w_ie_, time_ - sine, sine};
  const double v[3] = {velocity_.x, velocity_.y, velocity_.z};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      parts_[i][j] += s.dt * b[i] * v[j];
      grams_[i][j] += s.dt * b[i] * b[j];
    }
    sum_a_ += s.dt * v[i] * v[i];
  }
}

InertialFrameAlignment::Fit InertialFrameAlignment::fit_at(double lat) const {
  const double c = std::cos(lat), s = std::sin(lat), g = gravity_;
  // B = W (V, R, S)
  const double w[3][3] = {{g * c, 0, 0}, {0, g * c * s, 0}, {0, g * s * s, g}};
  Fit f{};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) f.m[i][j] += w[i][k] * parts_[k][j];
      for (int l = 0; l < 3; ++l) f.sum_b += w[i][k] * grams_[k][l] * w[i][l];
    }
  return f;
}

Rot<Geographic, Body> InertialFrameAlignment::attitude() const {
  const double cl = std::cos(lat_), sl = std::sin(lat_), a = w_ie_ * time_;
  // Back from the level axes at the start to those now.
  const auto turn =
      to_matrix(exp_rotation<Geographic, Geographic>(Vec<Geographic>{0, cl * a, sl * a}));
  return transpose(turn) * (wahba(fit_at(lat_).m) * to_matrix(q_));
}

HeadingSigma InertialFrameAlignment::sigma(const AlignmentErrors& e) const {
  const double wn = w_ie_ * std::cos(lat_), T = time_;
  HeadingSigma s;
  s.gyro_bias = e.gyro_bias / wn;
  s.gyro_noise = e.gyro_noise / (std::sqrt(T) * wn);
  s.accel_noise = std::sqrt(12.0 / (T * T * T)) * e.accel_noise / (gravity_ * wn);  // [EST-15]
  // Velocity = tilt g t + heading g w_N t^2/2: least squares with misfit sd r, independent every 10
  // s, gives the coefficient of t^2 a variance of 80 r^2 10 s/T^5. The accelerometers' scale is no
  // misfit.
  const Fit f = fit_at(lat_);
  const double fit = agreement(wahba(f.m), f.m);
  const double r2 = std::max(0.0, f.sum_b - fit * fit / sum_a_) / T;
  s.sway = 2.0 * std::sqrt(80.0 * r2 * 10.0 / T) / (gravity_ * wn * T * T);
  return s;
}

double InertialFrameAlignment::latitude() const {
  // Slope of the turn over time, about the mean direction of gravity.
  const auto slope = (12.0 / (time_ * time_ * time_)) * (turned_t_dt_ - (0.5 * time_) * turned_dt_);
  const double w_up = dot(slope, velocity_) / norm(velocity_);
  // What of the velocities no turn of the pattern B(lat) explains; the accelerometers' scale is
  // free.
  const double sign = w_up < 0 ? -1.0 : 1.0;
  auto misfit = [&](double lat) {
    const Fit f = fit_at(sign * lat);
    const double fit = agreement(wahba(f.m), f.m);
    return f.sum_b - fit * fit / sum_a_;
  };
  double lo = 0, hi = 0.5 * kPi;
  constexpr double kGolden = 0.6180339887498949;
  double a = hi - kGolden * (hi - lo), b = lo + kGolden * (hi - lo), fa = misfit(a), fb = misfit(b);
  for (int i = 0; i < 40; ++i) {  // 1.57 rad 0.618^40: 7e-9
    if (fa < fb) {
      hi = b, b = a, fb = fa;
      a = hi - kGolden * (hi - lo), fa = misfit(a);
    } else {
      lo = a, a = b, fa = fb;
      b = lo + kGolden * (hi - lo), fb = misfit(b);
    }
  }
  return std::atan2(w_up, w_ie_ * std::cos(0.5 * (lo + hi)));
}

}  // namespace loxo
