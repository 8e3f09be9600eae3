// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/kalman.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "test_seed.hpp"

namespace loxo {
namespace {

template <int N>
using Dense = Eigen::Matrix<double, N, N>;

struct Draw {
  std::mt19937 rng{testing::seed()};
  std::normal_distribution<double> g;
  double operator()() { return g(rng); }
  Block3<> block(double k) {
    Block3<> b;
    for (auto& r : b.m)
      for (double& x : r) x = k * (*this)();
    return b;
  }
};
template <int N>
void random_covariance(Draw& d, Covariance<N>& P, Dense<N>& M) {
  Dense<N> L;
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) L(i, j) = d();
  M = L * L.transpose();
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) P.p[i][j] = M(i, j) = M(std::min(i, j), std::max(i, j));
}

template <int N>
void check_predict() {
  Draw d;
  Covariance<N> P;
  Dense<N> M;
  random_covariance(d, P, M);
  ErrorTransition<double> t;
  t.dt = 0.3;
  for (Block3<>* b : {&t.psi_psi, &t.psi_bg, &t.psi_sg, &t.dv_psi, &t.dv_dv, &t.dv_dr, &t.dv_bg,
                      &t.dv_sg, &t.dv_ba, &t.dv_sa, &t.dr_psi, &t.dr_dr, &t.dr_ba, &t.dr_sa})
    *b = d.block(1.0);
  t.decay_bg = 0.9, t.decay_ba = 0.8;
  AccumulatorTransition<double> a;
  for (Block3<>* b : {&a.psi, &a.dv, &a.bg, &a.lever}) *b = d.block(1.0);
  for (int i = 0; i < 3; ++i) a.eps_h[i] = d(), a.eps_p[i] = d();
  ErrorNoise<double> q;
  q.psi = 0.1, q.dv = 0.2, q.dr = 0.3, q.dr_dv = 0.05, q.bg = 0.7, q.ba = 0.9,
  q.dv_psi = d.block(0.01);
  Dense<N> F = Dense<N>::Identity(), Q = Dense<N>::Zero();
  auto put = [&](int i, int j, const Block3<>& b) {
    if (i + 2 < N && j + 2 < N)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) F(i + r, j + c) = b.m[r][c];
  };
  put(0, 0, t.psi_psi), put(0, 9, t.psi_bg), put(0, 15, t.psi_sg), put(3, 0, t.dv_psi),
      put(3, 3, t.dv_dv), put(3, 6, t.dv_dr);
  put(3, 9, t.dv_bg), put(3, 12, t.dv_ba), put(3, 15, t.dv_sg), put(3, 18, t.dv_sa),
      put(6, 0, t.dr_psi);
  put(6, 3, 0.3 * identity3<double>()), put(6, 6, t.dr_dr), put(6, 12, t.dr_ba),
      put(6, 18, t.dr_sa);
  for (int i = 0; i < 3; ++i) F(9 + i, 9 + i) = 0.9, F(12 + i, 12 + i) = 0.8;
  if (N == kStates) {
    put(28, 0, a.psi), put(28, 3, a.dv), put(28, 9, a.bg), put(28, 24, a.lever);
    for (int i = 0; i < 3; ++i)
      F((28 + i) % N, 22 % N) = a.eps_h[i], F((28 + i) % N, 23 % N) = a.eps_p[i];
  }
  for (int i = 0; i < 3; ++i) {
    Q(i, i) = 0.1, Q(3 + i, 3 + i) = 0.2, Q(6 + i, 6 + i) = 0.3,
         Q(6 + i, 3 + i) = Q(3 + i, 6 + i) = 0.05;
    Q(9 + i, 9 + i) = 0.7, Q(12 + i, 12 + i) = 0.9;
    for (int j = 0; j < 3; ++j) Q(3 + i, j) = Q(j, 3 + i) = q.dv_psi.m[i][j];
  }
  predict(P, t, q, N == kStates ? &a : nullptr);
  const Dense<N> expected = F * M * F.transpose() + Q;
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) {
      // N products of order 1 each way.
      EXPECT_NEAR(P.p[i][j], expected(i, j), 1e-12 * std::sqrt(expected(i, i) * expected(j, j)))
          << i << " " << j;
      EXPECT_EQ(P.p[i][j], P.p[j][i]);
    }
  for (int i = 0; i < N; ++i)
    for (int j = N; j < Covariance<N>::kStride; ++j) EXPECT_EQ(P.p[i][j], 0.0);
}
TEST(Kalman, PredictionEqualsTheDenseProduct) {  // [EST-4], [EST-5]
  check_predict<15>();
  check_predict<21>();
  check_predict<kStates>();
}

template <int N>
void check_update() {
  Draw d;
  Covariance<N> P;
  Dense<N> M;
  random_covariance(d, P, M);
  SparseRow<double> h;
  Eigen::Matrix<double, 1, N> H = Eigen::Matrix<double, 1, N>::Zero();
  for (int i : {0, 4, 7, N - 1}) {
    h.add(i, d());
    H(i) = h.value[h.n - 1];
  }
  const double r = 0.3, y = d();
  Projection<N> a;
  project(P, h, a);
  double x[N]{}, K[N];
  update(P, x, a, y, r, true, K);
  const double s = (H * M * H.transpose())(0) + r;
  const Eigen::Matrix<double, N, 1> k = M * H.transpose() / s;
  const Dense<N> J = Dense<N>::Identity() - k * H;
  const Dense<N> expected = J * M * J.transpose() + r * k * k.transpose();
  EXPECT_NEAR(a.s0 + r, s, 1e-12 * s);
  for (int i = 0; i < N; ++i) {
    EXPECT_NEAR(K[i], k(i), 1e-12 * std::sqrt(M(i, i) / s));
    EXPECT_NEAR(x[i], k(i) * y, 1e-11 * std::sqrt(M(i, i)));
    for (int j = 0; j < N; ++j) {
      EXPECT_NEAR(P.p[i][j], expected(i, j), 1e-12 * std::sqrt(M(i, i) * M(j, j))) << i << " " << j;
      EXPECT_EQ(P.p[i][j], P.p[j][i]);
    }
  }
  // A lane that is not active keeps its bits.
  const Covariance<N> before = P;
  update(P, x, a, y, r, false);
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) EXPECT_EQ(P.p[i][j], before.p[i][j]);
}
TEST(Kalman, UpdateEqualsJosephsForm) {  // [EST-8]
  check_update<15>();
  check_update<21>();
  check_update<kStates>();
}

// A measurement of a millimetre against a covariance of kilometres, 10^4 times: never a negative
// variance (the reason why no square-root form is kept, docs/decisions).
TEST(Kalman, VariancesStayPositiveUnderSharpMeasurements) {
  Draw d;
  Covariance<15> P;
  for (int i = 0; i < 15; ++i) P.p[i][i] = i < 9 ? 1e6 : 1e-6;
  ErrorTransition<double> t;
  t.dt = 0.01;
  t.psi_psi = t.dv_dv = t.dr_dr = identity3<double>();
  t.dv_psi = 0.1 * skew(Vec<Ecef>{0, 0, 1});
  t.psi_bg = -0.01 * identity3<double>();
  t.dv_ba = 0.01 * identity3<double>();
  ErrorNoise<double> q;
  q.dv = 1e-8;
  for (int n = 0; n < 10000; ++n) {
    predict(P, t, q);
    for (int i = 0; i < 3; ++i) {
      SparseRow<double> h;
      h.add(kDr + i, -1.0);
      Projection<15> a;
      project(P, h, a);
      update(P, static_cast<double*>(nullptr), a, 0.0, 1e-6, true);
    }
    for (int i = 0; i < 15; ++i) ASSERT_GE(P.p[i][i], 0.0) << n << " " << i;
  }
}

TEST(Kalman, GateFollowsItsThreeRanges) {  // [EST-9]
  const Gate gate{2, 5};
  EXPECT_EQ(weigh(1.9, 0.5, 0.5, gate).verdict, Verdict::kAsIs);
  const Weighed w = weigh(4.0, 0.25, 0.75, gate);
  EXPECT_EQ(w.verdict, Verdict::kDeweighted);
  EXPECT_DOUBLE_EQ(0.25 + w.r, 2.0);  // S n/c
  EXPECT_DOUBLE_EQ(w.nis, 16.0);
  EXPECT_EQ(weigh(5.1, 0.5, 0.5, gate).verdict, Verdict::kRejected);
  EXPECT_EQ(weigh(50, 0.5, 0.5, Gate{2, 0}).verdict, Verdict::kDeweighted);
  EXPECT_EQ(weigh(std::nan(""), 0.5, 0.5, gate).verdict, Verdict::kRejected);
}

}  // namespace
}  // namespace loxo
