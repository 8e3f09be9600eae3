// SPDX-License-Identifier: Apache-2.0
#include "loxo/errors/allan.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "loxo/errors/noise_units.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

std::vector<double> noise(std::size_t n, double dt, double white, double walk, double quantum,
                          unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<double> rate(n);
  double bias = 0, before = 0;
  for (auto& r : rate) {
    const double after = quantum * normal(generator);
    bias += walk * std::sqrt(dt) * normal(generator);
    r = white / std::sqrt(dt) * normal(generator) + bias + (after - before) / dt;
    before = after;
  }
  return rate;
}

// The definition, written down: every window, no stream.
double direct(const std::vector<double>& rate, std::size_t m, std::size_t stride, double dt) {
  std::vector<double> phase(1, 0.0);
  for (double r : rate) phase.push_back(phase.back() + r * dt);
  double sum = 0;
  std::size_t n = 0;
  for (std::size_t k = 0; k + 2 * m < phase.size(); k += stride, ++n) {
    const double d = phase[k + 2 * m] - 2 * phase[k + m] + phase[k];
    sum += d * d;
  }
  return std::sqrt(sum / (2.0 * static_cast<double>(n))) / (static_cast<double>(m) * dt);
}

TEST(Allan, StreamIsTheDefinitionAtEveryAveragingTimeAndForAnyChunks) {
  const auto rate = noise(20001, 0.01, 1e-4, 1e-5, 0.0, 7);
  AllanStream whole(0.01), pieces(0.01);
  whole.add(rate);
  for (std::size_t i = 0; i < rate.size();) {
    const std::size_t n = std::min<std::size_t>(1000 + (i * 7919) % 1500, rate.size() - i);
    pieces.add(std::span(rate).subspan(i, n));
    i += n;
  }
  const auto a = whole.points(), b = pieces.points();
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GE(a.size(), 25u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i].deviation, direct(rate, a[i].m, a[i].stride, 0.01), 1e-9 * a[i].deviation)
        << a[i].m;
    EXPECT_NEAR(a[i].deviation, b[i].deviation, 1e-9 * a[i].deviation);
    EXPECT_LE(a[i].stride * 64, std::max<std::size_t>(a[i].m, 64));
  }
}

TEST(Allan, KindsAgreeWithTheirClosedFormsOnWhiteNoise) {
  const auto rate = noise(400000, 0.01, 1e-3, 0.0, 0.0, 3);
  for (auto kind : {AllanKind::kAllan, AllanKind::kHadamard, AllanKind::kModified}) {
    AllanStream stream(0.01, kind);
    stream.add(rate);
    for (const auto& p : stream.points(50)) {
      // White noise: N/sqrt(tau); the modified variance tends to half of it.
      double expected = 1e-3 / std::sqrt(p.tau);
      if (kind == AllanKind::kModified) {
        const double m = static_cast<double>(p.m / p.stride);
        expected *= std::sqrt((m * m + 1) / (2 * m * m));
      }
      EXPECT_NEAR(p.deviation, expected, 5 * p.deviation_std)
          << static_cast<int>(kind) << " m " << p.m;
    }
  }
}

TEST(Allan, ARampOfTheRateIsSeenExactly) {
  std::vector<double> rate(5000);
  for (std::size_t i = 0; i < rate.size(); ++i) rate[i] = 3.0 + 2e-5 * static_cast<double>(i) * 0.1;
  AllanStream stream(0.1);
  stream.add(rate);
  for (const auto& p : stream.points())
    EXPECT_NEAR(p.deviation, 2e-5 * p.tau / std::sqrt(2.0), 1e-7 * p.deviation + 1e-12);
}

// Noise that the five cannot make (a vehicle that rocks) is told, and does not pull the fit; noise
// that they can make is not suspected.
TEST(Allan, WhatTheFiveNoisesCannotMakeIsTold) {
  const double dt = 0.01, white = 0.01 * deg_per_sqrt_h;
  auto rate = noise(200000, dt, white, 0, 0, 11);
  AllanStream quiet(dt);
  quiet.add(rate);
  auto points = quiet.points(4);
  const auto clean = fit_allan(points, dt, rate.size());
  EXPECT_EQ(clean.model_error, 0.0);
  for (const auto& p : points)
    EXPECT_NEAR(allan_deviation(clean, p.tau), p.deviation,
                4 * p.deviation_std + 0.02 * p.deviation);
  for (std::size_t i = 0; i < rate.size(); ++i)
    rate[i] += 5e-4 * std::sin(2 * kPi * 1.3 * dt * static_cast<double>(i));
  AllanStream rocking(dt);
  rocking.add(rate);
  points = rocking.points(4);
  const auto fit = fit_allan(points, dt, rate.size());
  EXPECT_GT(fit.model_error, 0.2);
  EXPECT_NEAR(fit.chi2, static_cast<double>(fit.dof), 0.1 * static_cast<double>(fit.dof));
}

TEST(NoiseUnits, EveryFormAndBack) {
  // ADIS16405: 2.0 deg/sqrt(h) and 0.05 deg/s/sqrt(Hz) rms stand side by side in its data sheet;
  // the density is one-sided.
  EXPECT_NEAR(density_of_random_walk(2.0 * deg_per_sqrt_h) / deg, 0.05, 0.003);
  EXPECT_DOUBLE_EQ(random_walk_of_density(density_of_random_walk(3.0)), 3.0);
  EXPECT_DOUBLE_EQ(random_walk_of_sample(sample_of_random_walk(3.0, 50.0), 50.0), 3.0);
  EXPECT_DOUBLE_EQ(rate_walk_of_step(step_of_rate_walk(3.0, 50.0), 50.0), 3.0);
  EXPECT_DOUBLE_EQ(instability_of_floor(floor_of_instability(3.0)), 3.0);
  // The figures are those of the Allan deviation: white noise at one sample, flicker's floor.
  AllanFit fit;
  fit.value[AllanFit::kRandomWalk] = 2e-4;
  EXPECT_DOUBLE_EQ(allan_deviation(fit, 0.01), sample_of_random_walk(2e-4, 100.0));
  fit = {};
  fit.value[AllanFit::kBiasInstability] = 5e-6;
  EXPECT_DOUBLE_EQ(allan_deviation(fit, 77.0), floor_of_instability(5e-6));
  // The top of a Gauss-Markov process' Allan deviation.
  const double sigma = markov_of_floor(1.0);
  double top = 0;
  for (double x = 0.5; x < 5; x += 1e-3)
    top = std::max(
        top, sigma * std::sqrt(2 / x * (1 - (3 - 4 * std::exp(-x) + std::exp(-2 * x)) / (2 * x))));
  EXPECT_NEAR(top, 1.0, 1e-4);
  EXPECT_NEAR(drive_of_markov(sigma, 100.0), sigma * std::sqrt(0.02), 1e-15);
}

// The stated bands are true: normalised errors of the fitted coefficients over many logs.
TEST(Allan, FitIsRightInsideItsBands) {
  const int runs = std::getenv("LOXO_LONG") != nullptr ? 200 : 40;
  const double white = 0.1 * deg_per_sqrt_h, walk = 2e-7, quantum = 2e-6, dt = 0.05;
  int inside[3] = {};
  double sum[3] = {}, square[3] = {};
  for (int run = 0; run < runs; ++run) {
    const std::size_t n = 200000;
    const auto rate = noise(n, dt, white, walk, quantum, static_cast<unsigned>(100 + run));
    AllanStream stream(dt);
    stream.add(rate);
    auto points = stream.points(4);
    const auto fit = fit_allan(points, dt, n, {true, true, false, true, false});
    const double truth[3] = {quantum, white, walk};
    const int kinds[3] = {AllanFit::kQuantisation, AllanFit::kRandomWalk,
                          AllanFit::kRateRandomWalk};
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(kinds[i]);
      const double z = (fit.value[k] - truth[i]) / fit.std[k];
      inside[i] += std::fabs(z) < 1.96;
      sum[i] += z;
      square[i] += z * z;
    }
  }
  for (int i = 0; i < 3; ++i) {
    // 95 % of the runs; four sigma of the binomial count either way would be a fault of the bands.
    const double expected = 0.95 * runs, spread = std::sqrt(0.05 * 0.95 * runs);
    EXPECT_GE(inside[i], expected - 4 * spread) << i;
    EXPECT_NEAR(square[i] / runs, 1.0, 5.0 * std::sqrt(2.0 / runs))
        << i << " mean " << sum[i] / runs;
  }
}

}  // namespace
}  // namespace loxo
