// SPDX-License-Identifier: Apache-2.0
// The error equations as matrices, x' = F x + G u, for whoever wants them whole (covariance
// analysis, other filters); the filter itself works with the blocks of error_dynamics.hpp. On any
// axes M: ECEF, geographic, transverse, grid or wander; sphere and ellipsoid by the point.
//   9 states: psi, dv, dr;  12: and x_bg;  15: and x_ba;  21: and x_sg, x_sa. [EST-3]
//   u: white noise of the gyros 0-2 [rad/sqrt(s)] and accelerometers 3-5 [m/s/sqrt(s)] as they
//   read too much, driving noise of the biases 6-8 and 9-11.
#pragma once
#include "loxo/errors/error_dynamics.hpp"

namespace loxo {

inline constexpr int kErrorInputs = 12;

template <int N>
struct ErrorModel {
  static_assert(N == 9 || N == 12 || N == 15 || N == 21);
  double f[N][N]{}, g[N][kErrorInputs]{};
};
// Correlation times of the biases in s; 0: random constants, or walks.
struct BiasTimes {
  double gyro = 0, accel = 0;
};
template <int N, class M>
ErrorModel<N> error_model(const ErrorPoint<M, double>& p, const BiasTimes& times = {}) {
  const ErrorRates<double> rates = error_rates(p);
  ErrorModel<N> m;
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < N; ++j) m.f[i][j] = rates.f[i][j];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      // A reading that is too large is what a bias left in it is: [EST-3]'s own columns.
      m.g[i][j] = rates.f[i][9 + j];
      m.g[3 + i][3 + j] = rates.f[3 + i][12 + j];
    }
  for (int i = 0; i < 3; ++i) {
    if constexpr (N >= 12) {
      m.f[9 + i][9 + i] = times.gyro > 0 ? -1.0 / times.gyro : 0.0;
      m.g[9 + i][6 + i] = 1.0;
    }
    if constexpr (N >= 15) {
      m.f[12 + i][12 + i] = times.accel > 0 ? -1.0 / times.accel : 0.0;
      m.g[12 + i][9 + i] = 1.0;
    }
  }
  return m;
}

}  // namespace loxo
