// SPDX-License-Identifier: Apache-2.0
// The constants that most drives do not need (estimation.md 1.3, last row), after the 32:
//   32-34 antenna lever arm [m], 35 bias of the external height [m], 36 bias of the heading sensor
//   [rad], 37-42 misalignment of the gyro triad [rad]: right gyro towards forward, up; forward
//   towards right, up; up towards right, forward.
// They are the rest of one covariance of 43 states, kept in blocks of their own: the same filter to
// rounding, and one that pays for them only where they are on. "true - used", like all constants.
#pragma once
#include "loxo/estimate/kalman.hpp"

namespace loxo {

inline constexpr int kAntenna = 32, kHeightBias = 35, kHeadingBias = 36, kMisalignment = 37;
static_assert(kAntenna == kStates);
inline constexpr int kExtra = 11, kAllStates = kStates + kExtra;

struct alignas(64) ExtraCovariance {
  static constexpr int kStride = kExtraStride;
  double c[kStates][kStride]{};  // the 32 against the extra
  double e[kExtra][kStride]{};   // the extra among themselves
};

// How the misalignment enters psi and dv in a step: columns 37-42 of Phi. The corrected rate is the
// true one + M(x) w.
struct MisalignmentTransition {
  double psi[3][6]{}, dv[3][6]{};
};
// w: corrected body rate at mid-step [rad/s], t: the step's transition.
MisalignmentTransition misalignment_transition(const ErrorTransition<double>& t,
                                               const Vec<Body>& w);
// M w for the six elements.
Vec<Body> misaligned(const double m[6], const Vec<Body>& w);

// P <- Phi P Phi^T + Q over all 43. `m` null: the misalignment is off.
void predict(Covariance<kStates>& P, ExtraCovariance& X, const ErrorTransition<double>& t,
             const ErrorNoise<double>& q, const AccumulatorTransition<double>* acc,
             const MisalignmentTransition* m);

// u = P H^T over all 43, and H u.
struct FullProjection {
  Projection<kStates> main;
  double e[kExtraStride]{};
  double operator[](int i) const { return i < kStates ? main.u[i] : e[i - kStates]; }
};
void project(const Covariance<kStates>& P, const ExtraCovariance& X, const SparseRow<double>& h,
             FullProjection& out);
// [EST-8] over all 43; x and gain (may be null): 43.
void update(Covariance<kStates>& P, ExtraCovariance& X, double* x, const FullProjection& a,
            double y, double r, double* gain);

}  // namespace loxo
