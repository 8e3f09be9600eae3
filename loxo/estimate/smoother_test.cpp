// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "test_seed.hpp"

namespace loxo {
namespace {

using Mat = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// [EST-17] against the batch solution: the joint Gaussian of all epochs conditioned on all
// measurements. Singular P (states that are off, accumulators just reset) included.
template <int n>
void check() {
  std::mt19937 rng(testing::seed());
  std::normal_distribution<double> g;
  constexpr int epochs = 6;

  // Prior: some states are off (zero variance).
  Mat L = Mat::Zero(n, n);
  for (int i = 0; i < n; ++i)
    if (i < 15 || (i >= 21 && i < 28) || i >= kStates)
      for (int j = 0; j < n; ++j) L(i, j) = 0.5 * g(rng);
  Mat P = L * L.transpose();
  Vector m = Vector::Zero(n);

  // Joint: block k of `mean`, `cov` is epoch k's state before any measurement.
  Mat joint = Mat::Zero(n * epochs, n * epochs);
  joint.topLeftCorner(n, n) = P;
  struct Seen {
    Vector h;
    double z, r;
  };
  std::vector<Seen> seen;
  SmootherTape tape(n > kStates);
  auto write_epoch = [&](const Vector& mean, const Mat& cov) {
    // The nominal carries the mean of dr and of the constants that feed_back adds; enough to
    // compare.
    NominalState s;
    s.v = {-mean[3], -mean[4], -mean[5]};  // feed_back subtracts navigation errors
    s.r = {-mean[6], -mean[7], -mean[8]};
    s.bg = {mean[9], mean[10], mean[11]};
    s.ba = {mean[12], mean[13], mean[14]};
    s.scale = mean[kScale];
    s.tau = mean[kTau];
    if constexpr (n > kStates) {
      s.antenna = {mean[kAntenna], mean[kAntenna + 1], mean[kAntenna + 2]};
      s.height_bias = mean[kHeightBias], s.heading_bias = mean[kHeadingBias];
      for (int i = 0; i < 6; ++i) s.misalignment[i] = mean[kMisalignment + i];
    }
    Covariance<kStates> C;
    ExtraCovariance X;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const double c = 0.5 * (cov(i, j) + cov(j, i));
        if (i < kStates && j < kStates) C.p[i][j] = c;
        if (i < kStates && j >= kStates) X.c[i][j - kStates] = c;
        if (i >= kStates && j >= kStates) X.e[i - kStates][j - kStates] = c;
      }
    tape.epoch(s, C, n > kStates ? &X : nullptr, 7u);
  };
  for (int k = 0; k < epochs; ++k) {
    if (k > 0) {
      TransitionProduct f;
      Mat F = Mat::Identity(n, n), Q = Mat::Zero(n, n);
      for (int r : kMovingRows)
        for (int j = 0; j < n; ++j) F(r, j) = (r == j) + 0.1 * g(rng);
      if (k == 3) F.row(29).setZero();  // an accumulator's reset: singular
      for (int r : kMovingRows)
        for (int j = 0; j < n; ++j) (j < kStates ? f.f[r][j] : f.extra[r][j - kStates]) = F(r, j);
      for (int i = 0; i < 9; ++i) Q(i, i) = 0.01;
      f.identity = false;
      tape.transition(f);
      m = F * m;
      P = F * P * F.transpose() + Q;
      for (int a = 0; a < k; ++a) {
        const Mat c = F * joint.block(n * (k - 1), n * a, n, n);
        joint.block(n * k, n * a, n, n) = c;
        joint.block(n * a, n * k, n, n) = c.transpose();
      }
      joint.block(n * k, n * k, n, n) =
          F * joint.block(n * (k - 1), n * (k - 1), n, n) * F.transpose() + Q;
    }
    for (int u = 0; u < 3; ++u) {
      SparseRow<double> h;
      Vector H = Vector::Zero(n);
      for (int i : {u, 6 + u, 12 + u, 21 + 2 * u, n > kStates ? kAntenna + 3 * u : 28 + u}) {
        const double v = g(rng);
        h.add(i, v);
        H[i] = v;
      }
      const double z = g(rng), r = 0.2, s = H.dot(P * H) + r, y = z - H.dot(m);
      const Vector K = P * H / s;
      double gain[n];
      for (int i = 0; i < n; ++i) gain[i] = K[i];
      tape.measurement(h, s, y, gain);
      m += K * y;
      const Mat J = Mat::Identity(n, n) - K * H.transpose();
      P = J * P * J.transpose() + r * K * K.transpose();
      Vector all = Vector::Zero(n * epochs);
      all.segment(n * k, n) = H;
      seen.push_back({all, z, r});
    }
    write_epoch(m, P);
  }
  Mat H(seen.size(), n * epochs);
  Vector z(seen.size());
  Mat R = Mat::Zero(seen.size(), seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    H.row(i) = seen[i].h.transpose();
    z[i] = seen[i].z;
    R(i, i) = seen[i].r;
  }
  const Mat S = H * joint * H.transpose() + R;
  const Mat G = joint * H.transpose() * S.inverse();
  const Vector batch = G * z;
  const Mat cov = joint - G * H * joint;

  int k = epochs - 1;
  tape.smooth([&](const NominalState& s, const Covariance<kStates>& C, std::uint32_t health) {
    EXPECT_EQ(health, 7u);
    const Vector b = batch.segment(n * k, n);
    const double got[] = {-s.v.x, -s.v.y, -s.v.z, -s.r.x, -s.r.y, -s.r.z,
                          s.bg.x, s.bg.y, s.bg.z, s.ba.x, s.ba.y, s.ba.z};
    for (int i = 0; i < 12; ++i)
      EXPECT_NEAR(got[i], b[3 + i], 1e-10) << "epoch " << k << " state " << 3 + i;
    EXPECT_NEAR(s.scale, b[kScale], 1e-10);
    EXPECT_NEAR(s.tau, b[kTau], 1e-10);
    for (int i = 0; i < 9; ++i)
      for (int j = 0; j < 9; ++j) EXPECT_NEAR(C.p[i][j], cov(n * k + i, n * k + j), 1e-10);
    for (int i = 9; i < kStates; ++i) EXPECT_NEAR(C.p[i][i], cov(n * k + i, n * k + i), 1e-10) << i;
    if constexpr (n > kStates) {
      EXPECT_NEAR(s.antenna.y, b[kAntenna + 1], 1e-10);
      EXPECT_NEAR(s.height_bias, b[kHeightBias], 1e-10);
      EXPECT_NEAR(s.heading_bias, b[kHeadingBias], 1e-10);
      for (int i = 0; i < 6; ++i) EXPECT_NEAR(s.misalignment[i], b[kMisalignment + i], 1e-10);
      for (int i = 0; i < kExtra; ++i)
        EXPECT_NEAR(tape.extra_variances()[i], cov(n * k + kStates + i, n * k + kStates + i),
                    1e-10);
    }
    --k;
  });
  EXPECT_EQ(k, -1);
}
TEST(Smoother, EqualsTheBatchSolution) { check<kStates>(); }
TEST(Smoother, EqualsTheBatchSolutionOfAllStates) { check<kAllStates>(); }

// Eight hours with the vertical channel, which by itself grows by e every 570 s, and a fix now and
// then: the smoothed sigmas are neither zero nor above the filter's. What rounding makes
// unsymmetric in Lambda no measurement damps; left alone it grows as the channel does, and is all
// that is left after four hours.
TEST(Smoother, HoursDoNotWearOutTheCovariance) {
  constexpr int kSteps = 28800;
  constexpr double kDt = 1;
  Mat F = Mat::Identity(kStates, kStates), P = Mat::Zero(kStates, kStates);
  TransitionProduct f;
  f.identity = false;
  // As in the filter: what turns with the Earth, what a tilt does to the velocity.
  F(0, 1) = 1e-4, F(1, 0) = -1e-4, F(0, 9) = F(1, 10) = kDt;
  F(4, 0) = 9.8 * kDt, F(3, 1) = -9.8 * kDt, F(3, 6) = F(4, 7) = -1.5e-6 * kDt;
  F(6, 3) = F(7, 4) = kDt;
  F(5, 8) = 3.07e-6 * kDt, F(8, 5) = F(5, 14) = kDt;
  for (int r : kMovingRows) std::copy_n(Vector(F.row(r)).data(), kStates, f.f[r]);
  const double sigma[] = {1e-2, 1e-2, 0, 0.1, 0.1, 0.1, 10, 10, 10, 1e-6, 1e-6, 0, 0, 0, 1e-3};
  for (int i = 0; i < 15; ++i) P(i, i) = sigma[i] * sigma[i];
  P(kTau, kTau) = 0.25;
  SmootherTape tape(false);
  std::vector<Vector> filtered;
  std::mt19937_64 random(testing::seed());
  std::normal_distribution<double> g;
  const auto measure = [&](const SparseRow<double>& h, double r) {
    Vector H = Vector::Zero(kStates);
    for (int a = 0; a < h.n; ++a) H[h.index[a]] += h.value[a];
    const Vector PH = P * H;
    const double s = H.dot(PH) + r;
    const Vector K = PH / s;
    tape.measurement(h, s, 0, K.data());
    P -= K * PH.transpose();
    P = 0.5 * (P + Mat(P.transpose()));
  };
  for (int k = 0; k < kSteps; ++k) {
    tape.transition(f);
    P = F * P * F.transpose();
    for (int i : {0, 1}) P(i, i) += 1e-13;
    for (int i : {3, 4, 5}) P(i, i) += 1e-8;
    for (int i : {9, 10}) P(i, i) += 1e-18;
    P(14, 14) += 1e-12;
    P(kTau, kTau) += 1e-5;
    // A speed that comes late by what nobody knows: v + a tau; and its way across.
    SparseRow<double> speed, side, up;
    speed.add(3, 1), speed.add(kTau, 0.5 * g(random));
    side.add(4, 1), side.add(0, -10);
    up.add(5, 1), up.add(1, 10);
    measure(speed, 1e-2);
    measure(side, 1e-3);
    measure(up, 1e-3);
    if (k % 600 == 599)
      for (int i : {6, 7, 8}) {
        SparseRow<double> fix;
        fix.add(i, 1);
        measure(fix, 1);
      }
    if (k % 100 == 0) {
      Covariance<kStates> C;
      for (int i = 0; i < kStates; ++i)
        for (int j = 0; j < kStates; ++j) C.p[i][j] = P(i, j);
      tape.epoch(NominalState{}, C, nullptr, 0);
      filtered.push_back(P.diagonal());
    }
  }
  std::size_t k = filtered.size();
  tape.smooth([&](const NominalState&, const Covariance<kStates>& C, std::uint32_t) {
    const Vector& before = filtered.at(--k);
    for (int i = 0; i < kStates; ++i) {
      if (!(before[i] > 0)) continue;
      EXPECT_GT(C.p[i][i], 0) << i << " epoch " << k;
      EXPECT_LE(C.p[i][i], before[i] * (1 + 1e-6)) << i << " epoch " << k;
    }
  });
  EXPECT_EQ(k, 0u);
}

}  // namespace
}  // namespace loxo
