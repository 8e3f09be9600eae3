// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/start_covariance.hpp"

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/num/functions.hpp"

namespace loxo {

StartSigmas start_sigmas(const NavigatorConfig& c) {
  StartSigmas s;
  s.gyro_bias = c.gyro_bias, s.accel_bias = c.accel_bias;
  s.gyro_scale = {c.gyro_scale, c.gyro_scale, c.gyro_scale};
  s.accel_scale = {c.accel_scale, c.accel_scale, c.accel_scale};
  s.lever = c.lever_std;
  if (c.use_odometer) s.scale = c.scale_std, s.tau = c.tau_std, s.speed_offset = c.offset_std;
  if (c.use_odometer || c.use_nhc) s.eps_h = s.eps_p = c.eps_std;
  return s;
}

Covariance<kStates> start_covariance(const Ellipsoid& ell, const NominalState& s,
                                     const StartSigmas& e) {
  Covariance<kStates> P;
  alignment_covariance(ell, s, e.gyro_bias, e.static_level ? e.accel_bias : 0.0, e.level, e.heading,
                       e.static_heading, P);
  const auto diagonal = [&](int first, const Vec<Body>& sigma) {
    P.p[first][first] = sigma.x * sigma.x;
    P.p[first + 1][first + 1] = sigma.y * sigma.y;
    P.p[first + 2][first + 2] = sigma.z * sigma.z;
  };
  const auto each = [](double sigma) { return Vec<Body>{sigma, sigma, sigma}; };
  diagonal(kDv, each(e.velocity));
  diagonal(kDr, each(e.position));
  diagonal(kBa, each(e.accel_bias));
  diagonal(kSg, e.gyro_scale);
  diagonal(kSa, e.accel_scale);
  diagonal(kLever, each(e.lever));
  P.p[kScale][kScale] = e.scale * e.scale;
  P.p[kEpsH][kEpsH] = e.eps_h * e.eps_h;
  P.p[kEpsP][kEpsP] = e.eps_p * e.eps_p;
  P.p[kTau][kTau] = e.tau * e.tau;
  P.p[kOffset][kOffset] = e.speed_offset * e.speed_offset;
  if (!e.correlated)
    for (int i = kPsi; i < kPsi + 3; ++i)
      for (int j = kBg; j < kBa + 3; ++j) P.p[i][j] = P.p[j][i] = 0;
  return P;
}

void alignment_covariance(const Ellipsoid& ell, const NominalState& s, double gyro_bias,
                          double accel_bias, double sigma_level, double sigma_heading,
                          bool static_heading, Covariance<kStates>& P) {
  const Geodetic<double> g = to_geodetic(ell, s.r);
  const Rot<Geographic, Ecef> C_ge = geographic_axes(g.lat, g.lon);
  const Rot<Geographic, Body> C = C_ge * to_matrix(s.q);
  double sl, cl;
  sincos(g.lat, sl, cl);
  const double gamma = normal_gravity(ell, sl, g.h), wn = ell.w_ie * cl, wu = ell.w_ie * sl;
  // [EST-14]: Phi_E = -a_N/g, Phi_N = a_E/g, Phi_U = (-g_E + w_U Phi_N)/w_N; A = dPhi/d(x_bg,
  // x_ba).
  double A[3][6]{};
  for (int j = 0; j < 3; ++j) {
    A[0][3 + j] = -C.m[1][j] / gamma;
    A[1][3 + j] = C.m[0][j] / gamma;
    if (static_heading) {
      A[2][j] = -C.m[0][j] / wn;
      A[2][3 + j] = wu / wn * C.m[0][j] / gamma;
    }
  }
  const double var[6] = {gyro_bias * gyro_bias,   gyro_bias * gyro_bias,   gyro_bias * gyro_bias,
                         accel_bias * accel_bias, accel_bias * accel_bias, accel_bias * accel_bias};
  const double white[3] = {sigma_level * sigma_level, sigma_level * sigma_level,
                           sigma_heading * sigma_heading};
  double L[3][3], cross_g[3][6];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      L[i][j] = i == j ? white[i] : 0.0;
      for (int k = 0; k < 6; ++k) L[i][j] += A[i][k] * var[k] * A[j][k];
    }
    for (int k = 0; k < 6; ++k) cross_g[i][k] = A[i][k] * var[k];
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double sum = 0;
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) sum += C_ge.m[a][i] * L[a][b] * C_ge.m[b][j];
      P.p[kPsi + i][kPsi + j] = sum;
    }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < i; ++j) P.p[i][j] = P.p[j][i];
  for (int k = 0; k < 6; ++k) {
    P.p[kBg + k][kBg + k] = var[k];
    for (int i = 0; i < 3; ++i) {
      double sum = 0;
      for (int a = 0; a < 3; ++a) sum += C_ge.m[a][i] * cross_g[a][k];
      P.p[kPsi + i][kBg + k] = P.p[kBg + k][kPsi + i] = sum;
    }
  }
}

}  // namespace loxo
