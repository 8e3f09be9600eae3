// SPDX-License-Identifier: Apache-2.0
#include "loxo/num/random.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "loxo/num/lanes.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

std::uint64_t seed() { return testing::seed(4711); }
// Two-sided: one run in two million of a right generator fails a check at 5 sigma.
constexpr double kSigmas = 5.0;

// The vectors published with the algorithm (Random123, kat_vectors).
TEST(Random, ThreefryGivesThePublishedVectors) {
  using W = std::array<std::uint64_t, 2>;
  constexpr std::uint64_t kOnes = ~std::uint64_t{0};
  const W pi_counter{0x243f6a8885a308d3, 0x13198a2e03707344},
      pi_key{0xa4093822299f31d0, 0x082efa98ec4e6c89};
  EXPECT_EQ(threefry({0, 0}, {0, 0}, 20), (W{0xc2b6e3a8c2c69865, 0x6f81ed42f350084d}));
  EXPECT_EQ(threefry({kOnes, kOnes}, {kOnes, kOnes}, 20),
            (W{0xe02cb7c4d95d277a, 0xd06633d0893b8b68}));
  EXPECT_EQ(threefry(pi_counter, pi_key, 20), (W{0x263c7d30bb0f0af1, 0x56be8361d3311526}));
  EXPECT_EQ(threefry({0, 0}, {0, 0}), (W{0xf167b032c3b480bd, 0xe91f9fee4b7a6fb5}));
  EXPECT_EQ(threefry({kOnes, kOnes}, {kOnes, kOnes}), (W{0xccdec5c917a874b1, 0x4df53abca26ceb01}));
  EXPECT_EQ(threefry(pi_counter, pi_key), (W{0xc3aac71561042993, 0x3fe7ae8801aff316}));
}

TEST(Random, LaneKHasTheBitsOfTrialK) {
  for (std::uint64_t trial :
       {std::uint64_t{0}, std::uint64_t{8}, std::uint64_t{0xfffffffffffffff8}}) {
    const Stream<Lanes> lanes{seed(), trial, 3};
    for (std::uint64_t sample : {0, 1, 77777}) {
      const auto n = lanes.normals<13>(sample);
      for (int k = 0; k < 8; ++k) {
        const Stream<double> alone{seed(), trial + static_cast<std::uint64_t>(k), 3};
        const auto m = alone.normals<13>(sample);
        for (std::size_t i = 0; i < 13; ++i)
          ASSERT_EQ(std::bit_cast<std::uint64_t>(n[i].lane(k)), std::bit_cast<std::uint64_t>(m[i]));
        ASSERT_EQ(lanes.uniform(sample).lane(k), alone.uniform(sample));
        ASSERT_EQ(lanes.normal(sample).lane(k), alone.normal(sample));
      }
    }
  }
}

TEST(Random, OneNormalIsTheFirstOfMany) {
  const Stream<double> s{seed(), 5, 1};
  for (std::uint64_t i = 0; i < 100; ++i) {
    EXPECT_EQ(s.normal(i), s.normals<12>(i)[0]);
    EXPECT_EQ(s.normals<3>(i)[2], s.normals<12>(i)[2]);
  }
}

TEST(Random, UniformsFillTheOpenInterval) {
  constexpr int kCount = 200000;
  double sum = 0, squares = 0, least = 1, most = 0;
  const Stream<double> s{seed(), 0, 0};
  std::vector<double> u(kCount);
  for (int i = 0; i < kCount; ++i) {
    const double x = u[static_cast<std::size_t>(i)] = s.uniform(static_cast<std::uint64_t>(i));
    sum += x, squares += x * x;
    least = std::min(least, x), most = std::max(most, x);
  }
  EXPECT_GT(least, 0.0);
  EXPECT_LT(most, 1.0);
  EXPECT_NEAR(sum / kCount, 0.5, kSigmas * std::sqrt(1.0 / 12 / kCount));
  // Variance of x^2 is 1/5 - 1/9.
  EXPECT_NEAR(squares / kCount, 1.0 / 3, kSigmas * std::sqrt(4.0 / 45 / kCount));
  std::sort(u.begin(), u.end());
  double d = 0;
  for (int i = 0; i < kCount; ++i)
    d = std::max(d, std::fabs(u[static_cast<std::size_t>(i)] - (i + 0.5) / kCount));
  // Kolmogorov: P(sqrt(n) D > 2.7) = 2 exp(-2 * 2.7^2) = 9e-7.
  EXPECT_LT(d * std::sqrt(kCount), 2.7) << "seed " << seed();
}

TEST(Random, NormalsAreStandardNormal) {
  // In lanes, many trials and samples of twelve: 2.4 million.
  constexpr int kTrials = 2000, kSamples = 100;
  std::vector<double> all;
  all.reserve(kTrials * kSamples * 12);
  for (std::uint64_t t = 0; t < kTrials; t += 8)
    for (std::uint64_t i = 0; i < kSamples; ++i) {
      const auto n = Stream<Lanes>{seed(), t, 7}.normals<12>(i);
      double v[8];
      for (const Lanes& x : n) {
        x.store(v);
        all.insert(all.end(), v, v + 8);
      }
    }
  const auto count = static_cast<double>(all.size());
  double m1 = 0, m2 = 0, m3 = 0, m4 = 0;
  int beyond3 = 0, beyond4 = 0;
  for (double x : all) {
    m1 += x, m2 += x * x, m3 += x * x * x, m4 += x * x * x * x;
    beyond3 += std::fabs(x) > 3.0;
    beyond4 += std::fabs(x) > 4.0;
  }
  // Variances of x, x^2, x^3, x^4 of a standard normal: 1, 2, 15, 96.
  EXPECT_NEAR(m1 / count, 0.0, kSigmas * std::sqrt(1.0 / count)) << "seed " << seed();
  EXPECT_NEAR(m2 / count, 1.0, kSigmas * std::sqrt(2.0 / count)) << "seed " << seed();
  EXPECT_NEAR(m3 / count, 0.0, kSigmas * std::sqrt(15.0 / count)) << "seed " << seed();
  EXPECT_NEAR(m4 / count, 3.0, kSigmas * std::sqrt(96.0 / count)) << "seed " << seed();
  const double e3 = count * std::erfc(3.0 / std::sqrt(2.0)),
               e4 = count * std::erfc(4.0 / std::sqrt(2.0));
  EXPECT_NEAR(beyond3, e3, kSigmas * std::sqrt(e3)) << "seed " << seed();
  EXPECT_NEAR(beyond4, e4, kSigmas * std::sqrt(e4)) << "seed " << seed();
  std::sort(all.begin(), all.end());
  double d = 0;
  for (std::size_t i = 0; i < all.size(); ++i)
    d = std::max(d, std::fabs(0.5 * std::erfc(-all[i] / std::sqrt(2.0)) -
                              (static_cast<double>(i) + 0.5) / count));
  EXPECT_LT(d * std::sqrt(count), 2.7) << "seed " << seed();
}

// Correlation over n pairs of independent normals is normal with variance 1/n.
TEST(Random, NeighboursAreUncorrelated) {
  constexpr int kCount = 100000;
  double axes = 0, samples = 0, trials = 0, streams = 0, seeds = 0, squares = 0;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const auto n = Stream<double>{seed(), 9, 1}.normals<2>(i);
    axes += n[0] * n[1];
    squares += (n[0] * n[0] - 1.0) * (n[1] * n[1] - 1.0) / 2.0;
    samples += n[0] * Stream<double>{seed(), 9, 1}.normal(i + 1);
    trials += n[0] * Stream<double>{seed(), 10, 1}.normal(i);
    streams += n[0] * Stream<double>{seed(), 9, 2}.normal(i);
    seeds += n[0] * Stream<double>{seed() + 1, 9, 1}.normal(i);
  }
  for (double sum : {axes, squares, samples, trials, streams, seeds})
    EXPECT_LT(std::fabs(sum), kSigmas * std::sqrt(kCount)) << "seed " << seed();
}

}  // namespace
}  // namespace loxo
