// SPDX-License-Identifier: Apache-2.0
#include "loxo/ins/alignment.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace

double HeadingSigma::total() const {
  return std::hypot(std::hypot(gyro_bias, gyro_noise), std::hypot(accel_noise, sway));
}

Rot<Geographic, Body> coarse_static(const Vec<Body>& w, const Vec<Body>& f) {
  const Vec<Body> u = f * (1 / norm(f)), east = cross(w, u);
  const Vec<Body> e = east * (1 / norm(east)), n = cross(u, e);
  Rot<Geographic, Body> c;
  const Vec<Body>* rows[3] = {&e, &n, &u};
  for (int i = 0; i < 3; ++i)
    c.m[i][0] = rows[i]->x, c.m[i][1] = rows[i]->y, c.m[i][2] = rows[i]->z;
  return c;
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
  q_ = renormalized(q_ * exp_rotation<Body, Body>(u.rotation));
  before_ = s;
  has_before_ = true;
  time_ += s.dt;
  // B(t): the integral of up turned about (0, cosL, sinL) by w t.
  const double cl = std::cos(lat_), sl = std::sin(lat_), a = w_ie_ * time_;
  const double sine = std::sin(a) / w_ie_, half = std::sin(0.5 * a),
               versine = 2 * half * half / w_ie_;
  const double rest = sl * (time_ - sine);
  const double b[3] = {gravity_ * cl * versine, gravity_ * cl * rest,
                       gravity_ * (sine + sl * rest)};
  const double v[3] = {velocity_.x, velocity_.y, velocity_.z};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m_[i][j] += s.dt * b[i] * v[j];
    sum_a_ += s.dt * v[i] * v[i];
    sum_b_ += s.dt * b[i] * b[i];
  }
}

// Davenport's form of Wahba's problem: the rotation X with the largest trace of X M^T.
Rot<Geographic, Inertial> InertialFrameAlignment::wahba() const {
  const auto& m = m_;
  const double x = m[2][1] - m[1][2], y = m[0][2] - m[2][0], z = m[1][0] - m[0][1];
  double k[4][4] = {{m[0][0] + m[1][1] + m[2][2], x, y, z},
                    {x, m[0][0] - m[1][1] - m[2][2], m[0][1] + m[1][0], m[0][2] + m[2][0]},
                    {y, m[0][1] + m[1][0], m[1][1] - m[0][0] - m[2][2], m[1][2] + m[2][1]},
                    {z, m[0][2] + m[2][0], m[1][2] + m[2][1], m[2][2] - m[0][0] - m[1][1]}};
  double q[4];
  largest_eigenvector(k, q);
  return to_matrix(Quat<Geographic, Inertial>{q[0], q[1], q[2], q[3]});
}

Rot<Geographic, Body> InertialFrameAlignment::attitude() const {
  const double cl = std::cos(lat_), sl = std::sin(lat_), a = w_ie_ * time_;
  // Back from the level axes at the start to those now.
  const auto turn =
      to_matrix(exp_rotation<Geographic, Geographic>(Vec<Geographic>{0, cl * a, sl * a}));
  return transpose(turn) * (wahba() * to_matrix(q_));
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
  const auto x = wahba();
  double fit = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) fit += x.m[i][j] * m_[i][j];
  const double r2 = std::max(0.0, sum_b_ - fit * fit / sum_a_) / T;
  s.sway = 2.0 * std::sqrt(80.0 * r2 * 10.0 / T) / (gravity_ * wn * T * T);
  return s;
}

}  // namespace loxo
