// SPDX-License-Identifier: Apache-2.0
#include "loxo/errors/error_dynamics.hpp"

#include "loxo/earth/gravity.hpp"

namespace loxo {

template <Real S>
Block3<S> gravity_gradient(const Ellipsoid& ell, const Vec<Ecef, S>& n, S h) {
  const S s = n.z, s2 = s * s, one(1.0);
  const S w2 = one - S(ell.e2) * s2;
  const S N = S(ell.a) / sqrt(w2);
  const S M = N * S(1.0 - ell.e2) / w2;
  const S gamma = normal_gravity(ell, s, h);
  S gamma_s(0.0), gamma_h(0.0);
  if (ell.g_constant <= 0) {
    const double m = ell.w_ie * ell.w_ie * ell.a * ell.a * ell.b / ell.gm;
    const double c = 0.00193185265241, ge = 9.7803253359;
    const S root = sqrt(w2);
    const S g0 = S(ge) * (one + S(c) * s2) / root;
    const S g0_s =
        S(ge) * (S(2.0 * c) * s / root + (one + S(c) * s2) * S(ell.e2) * s / (w2 * root));
    const S u = h * S(1.0 / ell.a);
    const S b = S(1.0 + ell.f + m) - S(2.0 * ell.f) * s2;
    gamma_s = g0_s * (one - S(2.0) * b * u + S(3.0) * u * u) + g0 * S(8.0 * ell.f) * s * u;
    gamma_h = g0 * (S(-2.0) * b + S(6.0) * u) * S(1.0 / ell.a);
  }
  // dn = D dr with D = (I - n n^T)/(N+h) + q zh zh^T, zh the horizontal part of the polar axis
  // (polar.md 2.1).
  const S k = one / (N + h);
  const S q = S(ell.e2) * N / (w2 * (N + h) * (M + h));
  const Vec<Ecef, S> zh{-s * n.x, -s * n.y, one - s2};
  const Block3<S> D = k * (identity3<S>() - outer(n, n)) + q * outer(zh, zh);
  // ds = z . dn = zh^T D dr
  const Vec<Ecef, S> ds = zh * (k + q * (one - s2));
  return S(-1.0) * (outer(n, ds * gamma_s + n * gamma_h) + gamma * D);
}

template <class M, Real S>
ErrorRates<S> error_rates(const ErrorPoint<M, S>& p) {
  const Block3<S> C = block_of(p.C_mb);
  ErrorRates<S> r;
  auto put = [&](int row, int column, const Block3<S>& b) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) r.f[row + i][column + j] = b.m[i][j];
  };
  const S minus(-1.0);
  put(0, 0, minus * skew(p.w_ie + p.w_em));
  put(0, 9, minus * C);
  put(0, 15, minus * scale_columns(C, p.w));
  put(3, 0, skew(p.C_mb * p.f));
  put(3, 3, minus * skew(p.w_ie + p.w_ie + p.w_em));
  put(3, 6, p.gradient);
  put(3, 12, C);
  put(3, 18, scale_columns(C, p.f));
  put(6, 3, identity3<S>());
  put(6, 6, minus * skew(p.w_em));
  return r;
}

template Block3<double> gravity_gradient(const Ellipsoid&, const Vec<Ecef, double>&, double);
template ErrorRates<double> error_rates(const ErrorPoint<Ecef, double>&);
template ErrorRates<double> error_rates(const ErrorPoint<Geographic, double>&);
template ErrorRates<double> error_rates(const ErrorPoint<Transverse, double>&);
template ErrorRates<double> error_rates(const ErrorPoint<Grid, double>&);
template ErrorRates<double> error_rates(const ErrorPoint<Wander, double>&);

}  // namespace loxo
