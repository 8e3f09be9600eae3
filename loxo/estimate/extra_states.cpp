// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/extra_states.hpp"

namespace loxo {

Vec<Body> misaligned(const double m[6], const Vec<Body>& w) {
  return {m[0] * w.y + m[1] * w.z, m[2] * w.x + m[3] * w.z, m[4] * w.x + m[5] * w.y};
}

MisalignmentTransition misalignment_transition(const ErrorTransition<double>& t,
                                               const Vec<Body>& w) {
  // Column of element k: the bias columns of its axis times the rate that it mixes in.
  const double rate[6] = {w.y, w.z, w.x, w.z, w.x, w.y};
  MisalignmentTransition m;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 6; ++k) {
      m.psi[i][k] = t.psi_bg.m[i][k / 2] * rate[k];
      m.dv[i][k] = t.dv_bg.m[i][k / 2] * rate[k];
    }
  return m;
}

void predict(Covariance<kStates>& P, ExtraCovariance& X, const ErrorTransition<double>& t,
             const ErrorNoise<double>& q, const AccumulatorTransition<double>* acc,
             const MisalignmentTransition* m) {
  predict(P, t, q, acc);
  advance_extra(X.c, t, acc);
  for (int i = 0; i < 6; ++i) {  // the biases' own decay
    const double d = i < 3 ? t.decay_bg : t.decay_ba;
    for (double& c : X.c[kBg + i]) c *= d;
  }
  if (!m) return;
  // With G the misalignment's columns and Y = Phi P_xe: P_xx += Y G^T + G Y^T + G P_ee G^T, P_xe +=
  // G P_ee; rows 0-5 of G are not zero.
  constexpr int kOff = kMisalignment - kStates;
  const double* G[6] = {m->psi[0], m->psi[1], m->psi[2], m->dv[0], m->dv[1], m->dv[2]};
  double ge[6][kExtraStride]{};
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k)
      for (int j = 0; j < kExtraStride; ++j) ge[i][j] += G[i][k] * X.e[kOff + k][j];
  double add[kStates][6];
  for (int r = 0; r < kStates; ++r)
    for (int i = 0; i < 6; ++i) {
      double sum = 0;
      for (int k = 0; k < 6; ++k) sum += X.c[r][kOff + k] * G[i][k];
      add[r][i] = sum;
    }
  for (int r = 6; r < kStates; ++r)
    for (int i = 0; i < 6; ++i) {
      P.p[r][i] += add[r][i];
      P.p[i][r] = P.p[r][i];
    }
  for (int r = 0; r < 6; ++r)
    for (int i = r; i < 6; ++i) {
      double sum = add[r][i] + add[i][r];
      for (int k = 0; k < 6; ++k) sum += ge[r][kOff + k] * G[i][k];
      P.p[r][i] += sum;
      P.p[i][r] = P.p[r][i];
    }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < kExtra; ++j) X.c[i][j] += ge[i][j];
}

void project(const Covariance<kStates>& P, const ExtraCovariance& X, const SparseRow<double>& h,
             FullProjection& out) {
  for (double& u : out.main.u) u = 0;
  for (double& u : out.e) u = 0;
  for (int k = 0; k < h.n; ++k) {
    const double v = h.value[k];
    const int i = h.index[k];
    if (i < kStates) {
      for (int j = 0; j < Covariance<kStates>::kStride; ++j) out.main.u[j] += v * P.p[i][j];
      for (int j = 0; j < kExtraStride; ++j) out.e[j] += v * X.c[i][j];
    } else {
      for (int j = 0; j < kStates; ++j) out.main.u[j] += v * X.c[j][i - kStates];
      for (int j = 0; j < kExtraStride; ++j) out.e[j] += v * X.e[i - kStates][j];
    }
  }
  double s = 0;
  for (int k = 0; k < h.n; ++k) s += h.value[k] * out[h.index[k]];
  out.main.s0 = s;
}

void update(Covariance<kStates>& P, ExtraCovariance& X, double* x, const FullProjection& a,
            double y, double r, double* gain) {
  // As kalman.cpp: P + K v^T + v K^T with v = (s/2) K - u.
  const double s = a.main.s0 + r, k0 = 1.0 / s, half = 0.5 * s;
  double K[kExtraStride], v[kExtraStride];
  for (int j = 0; j < kExtraStride; ++j) {
    K[j] = k0 * a.e[j];
    v[j] = half * K[j] - a.e[j];
  }
  for (int i = 0; i < kStates; ++i) {
    const double ki = k0 * a.main.u[i], vi = half * ki - a.main.u[i];
    for (int j = 0; j < kExtraStride; ++j) X.c[i][j] += ki * v[j] + vi * K[j];
  }
  for (int i = 0; i < kExtra; ++i)
    for (int j = 0; j < kExtraStride; ++j) X.e[i][j] += K[i] * v[j] + v[i] * K[j];
  if (x)
    for (int i = 0; i < kExtra; ++i) x[kStates + i] += K[i] * y;
  if (gain)
    for (int i = 0; i < kExtra; ++i) gain[kStates + i] = K[i];
  update(P, x, a.main, y, r, true, gain);
}

}  // namespace loxo
