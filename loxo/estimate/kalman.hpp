// SPDX-License-Identifier: Apache-2.0
// The error-state Kalman filter's arithmetic: fixed sizes, block by block, no allocation, same
// operations for every scalar. States as in errors/error_dynamics.hpp (0-20), then
// (estimation.md 1.3)
//   21 x_k odometer scale [1], 22 eps_h, 23 eps_p mounting [rad], 24-26 lever arm [m], 27 delay tau
//   [s], 28-30 accumulated displacement d right, forward, up [m], 31 x_b offset of a speed reading
//   [m/s].
// Constants are "true - used", navigation errors "computed - true". A state that is off has zero
// variance and noise.
#pragma once
#include "loxo/errors/error_dynamics.hpp"

namespace loxo {

inline constexpr int kPsi = 0, kDv = 3, kDr = 6, kBg = 9, kBa = 12, kSg = 15, kSa = 18;
inline constexpr int kScale = 21, kEpsH = 22, kEpsP = 23, kLever = 24, kTau = 27, kAcc = 28;
inline constexpr int kOffset = 31, kStates = 32;
inline constexpr int kExtraStride = 16;  // of the blocks in extra_states.hpp

// Symmetric; both triangles are kept and stay equal to the bit. N: 15, 21 or 32. Rows are padded
// for vectors; the padding stays zero.
template <int N, Real S = double>
struct alignas(64) Covariance {
  static constexpr int kStride = (N + 7) / 8 * 8;
  S p[N][kStride]{};
};

// How the accumulators take part in a step: d' = d + ... ; blocks of [EST-12] times dt. Rows right,
// forward, up.
template <Real S = double>
struct AccumulatorTransition {
  Block3<S> psi, dv, bg, lever;
  S eps_h[3]{}, eps_p[3]{};
};

// P <- Phi P Phi^T + Q of the navigation errors and constants up to 20 (and of the accumulators, N
// = 32). Products of non-zero blocks only. Noise of the constants of 21-31 is added by the caller
// to the diagonal. [EST-4], [EST-5]
template <int N, Real S>
void predict(Covariance<N, S>& P, const ErrorTransition<S>& t, const ErrorNoise<S>& q,
             const AccumulatorTransition<S>* acc = nullptr);

// F <- Phi F for the moving rows (0-8 and 28-30) of a 32-state product of transitions; the
// constants' rows stay.
void advance_product(double (*f)[Covariance<kStates>::kStride], const ErrorTransition<double>& t,
                     const AccumulatorTransition<double>* acc);

// The same for columns that are constants' (extra_states.hpp).
void advance_extra(double (*c)[kExtraStride], const ErrorTransition<double>& t,
                   const AccumulatorTransition<double>* acc);

// A row of H by its non-zero elements.
template <Real S = double>
struct SparseRow {
  static constexpr int kMax = 20;
  int n = 0;
  int index[kMax]{};
  S value[kMax]{};
  void add(int i, S v) {
    index[n] = i;
    value[n] = v;
    ++n;
  }
  template <class F>
  void add3(int i, const Vec<F, S>& v) {
    add(i, v.x);
    add(i + 1, v.y);
    add(i + 2, v.z);
  }
};

// One scalar measurement, prepared: u = P H^T, s0 = H u (without R).
template <int N, Real S = double>
struct alignas(64) Projection {
  S u[Covariance<N, S>::kStride]{};
  S s0{};
};
template <int N, Real S>
void project(const Covariance<N, S>& P, const SparseRow<S>& h, Projection<N, S>& out);
// [EST-8] in Joseph's form, expanded for one row so that it stays symmetric to the bit:
//   P <- P - K u^T - u K^T + (s0 + r) K K^T,  x <- x + K y,  with K = u/(s0 + r).
// `gain` (may be null) receives K. `active` false in a lane: that lane is left alone.
template <int N, Real S>
void update(Covariance<N, S>& P, S* x, const Projection<N, S>& a, S y, S r, MaskOf<S> active,
            S* gain = nullptr);

// [EST-9]: what a robust filter makes of an innovation. c, g: Huber and rejection limits in sigmas
// (g = 0: never rejected).
struct Gate {
  double c = 2.0, g = 5.0;
};
enum class Verdict { kAsIs, kDeweighted, kRejected };
struct Weighed {
  Verdict verdict = Verdict::kAsIs;
  double r = 0;    // variance to use
  double nis = 0;  // y^2/S with the unweighted S
};
Weighed weigh(double y, double s0, double r, const Gate& gate);
// The same choice for every lane: variance to use, and whether the measurement is used at all.
template <Real S>
void weigh_lanes(S y, S s0, S r, const Gate& gate, S& r_used, MaskOf<S>& used);

// Innovation statistics of one sensor.
struct InnovationCount {
  long used = 0, deweighted = 0, rejected = 0, above_95 = 0;
  double nis_sum = 0, last = 0, lag_sum = 0;
  long lag_count = 0;
  void add(double y, double s, const Weighed& w);
  double nis_mean() const {
    return used + deweighted + rejected > 0
               ? nis_sum / static_cast<double>(used + deweighted + rejected)
               : 0.0;
  }
  double above_95_share() const;
  // Correlation of one normalised innovation with the next.
  double lag_one() const {
    return lag_count > 0 && nis_sum > 0 ? lag_sum / static_cast<double>(lag_count) / nis_mean()
                                        : 0.0;
  }
};

}  // namespace loxo
