// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/kalman.hpp"

namespace loxo {
namespace {

// y[0..2][:] += b * p[0..2][:] over W columns, all rows of constant length: the compiler's vector
// loop.
template <int W, int LD, int LP, Real S>
inline void add_block(S (*__restrict y)[LD], const Block3<S>& b, const S (*__restrict p)[LP]) {
  for (int i = 0; i < 3; ++i) {
    const S b0 = b.m[i][0], b1 = b.m[i][1], b2 = b.m[i][2];
    for (int j = 0; j < W; ++j) y[i][j] = y[i][j] + (b0 * p[0][j] + b1 * p[1][j] + b2 * p[2][j]);
  }
}
template <int W, int LD, int LP, Real S>
inline void add_scaled(S (*__restrict y)[LD], S k, const S (*__restrict p)[LP]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < W; ++j) y[i][j] = y[i][j] + k * p[i][j];
}

// out (rows 0-8, and 9-11 the accumulators) = Phi's dynamic rows times p (all N states as rows, W
// columns).
template <int N, int W, int LD, int LP, Real S>
inline void apply(S (*__restrict out)[LD], const ErrorTransition<S>& t,
                  const AccumulatorTransition<S>* acc, const S (*__restrict p)[LP]) {
  constexpr int rows = N > kAcc ? 12 : 9;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < W; ++j) out[i][j] = S(0.0);
  add_block<W>(out, t.psi_psi, p + kPsi);
  add_block<W>(out, t.psi_bg, p + kBg);
  add_block<W>(out + 3, t.dv_psi, p + kPsi);
  add_block<W>(out + 3, t.dv_dv, p + kDv);
  add_block<W>(out + 3, t.dv_dr, p + kDr);
  add_block<W>(out + 3, t.dv_bg, p + kBg);
  add_block<W>(out + 3, t.dv_ba, p + kBa);
  add_block<W>(out + 6, t.dr_psi, p + kPsi);
  add_scaled<W>(out + 6, t.dt, p + kDv);
  add_block<W>(out + 6, t.dr_dr, p + kDr);
  add_block<W>(out + 6, t.dr_ba, p + kBa);
  if constexpr (N > kSa) {
    add_block<W>(out, t.psi_sg, p + kSg);
    add_block<W>(out + 3, t.dv_sg, p + kSg);
    add_block<W>(out + 3, t.dv_sa, p + kSa);
    add_block<W>(out + 6, t.dr_sa, p + kSa);
  }
  if constexpr (N > kAcc) {
    add_scaled<W>(out + 9, S(1.0), p + kAcc);
    if (acc) {
      add_block<W>(out + 9, acc->psi, p + kPsi);
      add_block<W>(out + 9, acc->dv, p + kDv);
      add_block<W>(out + 9, acc->bg, p + kBg);
      add_block<W>(out + 9, acc->lever, p + kLever);
      for (int i = 0; i < 3; ++i) {
        const S a = acc->eps_h[i], b = acc->eps_p[i];
        for (int j = 0; j < W; ++j)
          out[9 + i][j] = out[9 + i][j] + (a * p[kEpsH][j] + b * p[kEpsP][j]);
      }
    }
  }
}

}  // namespace

template <int N, Real S>
void predict(Covariance<N, S>& P, const ErrorTransition<S>& t, const ErrorNoise<S>& q,
             const AccumulatorTransition<S>* acc) {
  constexpr int kLd = Covariance<N, S>::kStride;
  constexpr int kDynamic = N > kAcc ? 12 : 9;
  constexpr int kWide = ScalarTraits<S>::kLanes > 1 ? kDynamic : (N > kAcc ? 12 : 12);
  alignas(64) S y[12][kLd];
  apply<N, kLd, kLd, kLd, S>(y, t, acc, P.p);
  // y^T, then Phi y^T: the dynamic states among themselves.
  alignas(64) S yt[kLd][12];
  for (int i = 0; i < kDynamic; ++i)
    for (int j = 0; j < N; ++j) yt[j][i] = y[i][j];
  if constexpr (kDynamic < 12)
    for (int i = kDynamic; i < 12; ++i)
      for (int j = 0; j < N; ++j) yt[j][i] = S(0.0);
  alignas(64) S a[12][12];
  apply<N, kWide, 12, 12, S>(a, t, acc, yt);
  auto row_of = [](int i) { return i < 9 ? i : kAcc + i - 9; };
  // Constants: decay of the Gauss-Markov ones, their rows and columns among themselves.
  for (int i = kBg; i < kBa + 3; ++i) {
    const S d = i < kBa ? t.decay_bg : t.decay_ba;
    for (int j = 0; j < kLd; ++j) P.p[i][j] = P.p[i][j] * d;
    for (int j = 0; j < N; ++j) P.p[j][i] = P.p[j][i] * d;
    for (int k = 0; k < kDynamic; ++k) y[k][i] = y[k][i] * d;
  }
  for (int i = 0; i < kDynamic; ++i) {
    const int r = row_of(i);
    for (int j = 9; j < N; ++j) {
      if (j >= kAcc && j < kAcc + 3) continue;
      P.p[r][j] = y[i][j];
      P.p[j][r] = y[i][j];
    }
    // The upper triangle of the product, mirrored: equal to the bit.
    for (int j = i; j < kDynamic; ++j) {
      P.p[r][row_of(j)] = a[j][i];
      P.p[row_of(j)][r] = a[j][i];
    }
  }
  for (int i = 0; i < 3; ++i) {
    P.p[kPsi + i][kPsi + i] = P.p[kPsi + i][kPsi + i] + q.psi;
    P.p[kDv + i][kDv + i] = P.p[kDv + i][kDv + i] + q.dv;
    P.p[kDr + i][kDr + i] = P.p[kDr + i][kDr + i] + q.dr;
    P.p[kDr + i][kDv + i] = P.p[kDr + i][kDv + i] + q.dr_dv;
    P.p[kDv + i][kDr + i] = P.p[kDr + i][kDv + i];
    P.p[kBg + i][kBg + i] = P.p[kBg + i][kBg + i] + q.bg;
    P.p[kBa + i][kBa + i] = P.p[kBa + i][kBa + i] + q.ba;
    for (int j = 0; j < 3; ++j) {
      P.p[kDv + i][kPsi + j] = P.p[kDv + i][kPsi + j] + q.dv_psi.m[i][j];
      P.p[kPsi + j][kDv + i] = P.p[kDv + i][kPsi + j];
    }
  }
}

namespace {
template <int W>
void advance(double (*f)[W], const ErrorTransition<double>& t,
             const AccumulatorTransition<double>* acc) {
  alignas(64) double y[12][W];
  apply<kStates, W, W, W, double>(y, t, acc, f);
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < W; ++j) f[i < 9 ? i : kAcc + i - 9][j] = y[i][j];
}
}  // namespace
void advance_product(double (*f)[Covariance<kStates>::kStride], const ErrorTransition<double>& t,
                     const AccumulatorTransition<double>* acc) {
  advance<Covariance<kStates>::kStride>(f, t, acc);
}
void advance_extra(double (*c)[kExtraStride], const ErrorTransition<double>& t,
                   const AccumulatorTransition<double>* acc) {
  advance<kExtraStride>(c, t, acc);
}

template <int N, Real S>
void project(const Covariance<N, S>& P, const SparseRow<S>& h, Projection<N, S>& out) {
  constexpr int kLd = Covariance<N, S>::kStride;
  S* __restrict u = out.u;
  for (int j = 0; j < kLd; ++j) u[j] = S(0.0);
  for (int k = 0; k < h.n; ++k) {
    const S* __restrict row = P.p[h.index[k]];
    const S v = h.value[k];
    for (int j = 0; j < kLd; ++j) u[j] = u[j] + v * row[j];
  }
  S s(0.0);
  for (int k = 0; k < h.n; ++k) s = s + h.value[k] * u[h.index[k]];
  out.s0 = s;
}

template <int N, Real S>
void update(Covariance<N, S>& P, S* x, const Projection<N, S>& a, S y, S r, MaskOf<S> active,
            S* gain) {
  constexpr int kLd = Covariance<N, S>::kStride;
  const S s = a.s0 + r;
  const S k0 = select(active, S(1.0) / s, S(0.0));
  alignas(64) S K[kLd];
  alignas(64) S v[kLd];
  // s K K^T - K u^T - u K^T  =  K_i v_j + v_i K_j with v = (s/2) K - u.
  const S half = S(0.5) * s;
  const S on = select(active, S(1.0), S(0.0));
  for (int j = 0; j < kLd; ++j) {
    K[j] = k0 * a.u[j];
    v[j] = half * K[j] - on * a.u[j];
  }
  for (int i = 0; i < N; ++i) {
    const S ki = K[i], vi = v[i];
    S* __restrict row = P.p[i];
    for (int j = 0; j < kLd; ++j) row[j] = row[j] + (ki * v[j] + vi * K[j]);
  }
  if (x)
    for (int i = 0; i < N; ++i) x[i] = x[i] + K[i] * y;
  if (gain)
    for (int i = 0; i < N; ++i) gain[i] = K[i];
}

Weighed weigh(double y, double s0, double r, const Gate& gate) {
  Weighed w;
  const double s = s0 + r, n = fabs(y) / sqrt(s);
  w.nis = n * n;
  w.r = r;
  if (!(n <= gate.c)) {
    w.verdict = Verdict::kDeweighted;
    w.r = r + s * (n / gate.c - 1.0);  // total S grows to S n/c
    if (!(n <= gate.g) && gate.g > 0) w.verdict = Verdict::kRejected;
  }
  return w;
}
template <Real S>
void weigh_lanes(S y, S s0, S r, const Gate& gate, S& r_used, MaskOf<S>& used) {
  const S s = s0 + r, n = fabs(y) / sqrt(s);
  r_used = select(n <= S(gate.c), r, r + s * (n * S(1.0 / gate.c) - S(1.0)));
  used = gate.g > 0 ? n <= S(gate.g) : n >= S(0.0);
}

void InnovationCount::add(double y, double s, const Weighed& w) {
  (w.verdict == Verdict::kAsIs         ? used
   : w.verdict == Verdict::kDeweighted ? deweighted
                                       : rejected) += 1;
  nis_sum += w.nis;
  constexpr double kChi2_95 = 3.841458820694124;  // one degree of freedom
  if (w.nis > kChi2_95) ++above_95;
  const double n = y / sqrt(s);
  if (used + deweighted + rejected > 1) {
    lag_sum += n * last;
    ++lag_count;
  }
  last = n;
}
double InnovationCount::above_95_share() const {
  const long n = used + deweighted + rejected;
  return n > 0 ? static_cast<double>(above_95) / static_cast<double>(n) : 0.0;
}

#define LOXO_KALMAN(N)                                                                        \
  template void predict(Covariance<N, double>&, const ErrorTransition<double>&,               \
                        const ErrorNoise<double>&, const AccumulatorTransition<double>*);     \
  template void project(const Covariance<N, double>&, const SparseRow<double>&,               \
                        Projection<N, double>&);                                              \
  template void update(Covariance<N, double>&, double*, const Projection<N, double>&, double, \
                       double, bool, double*);
LOXO_KALMAN(15)
LOXO_KALMAN(21)
LOXO_KALMAN(kStates)
#undef LOXO_KALMAN
template void weigh_lanes(double, double, double, const Gate&, double&, bool&);

}  // namespace loxo
