// SPDX-License-Identifier: Apache-2.0
// Is this reference good enough to test this unit at this transfer? The conversion error as an
// equivalent sensor error along a track: its constant part (a bias) and its spectrum, by formula
// and by Monte Carlo, beside the unit's own.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "loxo/sim/transfer_error.hpp"

namespace loxo {

// 1 sigma of the reference's errors, constant over the voyage and independent of each other.
struct ReferenceSigma {
  double heading = 0, level = 0;  // rad; level: pitch and roll each
  double velocity = 0;            // m/s, east and north each
};

// 1 sigma per body axis over the reference's errors.
struct EquivalentError {
  Vec<Body, double> bias_f, bias_w;  // of the mean over the voyage [m/s^2, rad/s]
  Vec<Body, double> rms_f, rms_w;    // of the value at an instant, all of it
};

// Share of the variance about the mean (all axes together) by period: slower than half an hour
// (manoeuvres, change of A and B), half an hour to a minute, faster than a minute (sea).
struct ErrorSpectrum {
  std::array<double, 3> f{}, w{};
};

struct TransferBudget {
  EquivalentError formula, monte_carlo;
  ErrorSpectrum spectrum;
  std::size_t draws = 0, points = 0;
};

// `track` in equal steps of `step` s. Formula: (9), (10) with what the ellipsoid adds; Monte Carlo:
// the definition (8) - (3) with normal errors, a pure function of the seed.
TransferBudget transfer_budget(const Ellipsoid& earth, const std::vector<TransferPoint>& track,
                               double step, const ReferenceSigma& sigma, std::size_t draws,
                               std::uint64_t seed);

// The unit: 1 sigma of its constant biases.
struct UnitSigma {
  double gyro_bias = 0, accel_bias = 0;  // rad/s, m/s^2
};
// The larger of conversion bias / unit bias over the horizontal axes and the vertical gyro; `share`
// 0.1: good enough where at most a tenth.
struct Verdict {
  double gyro_ratio = 0, accel_ratio = 0;
  bool good = false;
};
Verdict transfer_verdict(const EquivalentError& e, const UnitSigma& unit, double share = 0.1);

// For a level ship on any heading at transverse longitude l: 1 sigma of one horizontal axis, mean
// over headings, and of the vertical gyro; and what each error of the reference may be at most (1
// sigma) for the share, each having an equal part.
struct PlanRow {
  double latitude = 0,
         angle = 0;            // rad: of the track's middle at home; the middle comes to the pole
  double A = 0, B = 0, G = 0;  // (14), m/s^2
  double accel = 0, gyro = 0, gyro_up = 0;  // m/s^2, rad/s
  Verdict verdict;
  ReferenceSigma needed;  // infinite where the unit does not see it
};
PlanRow plan_row(const Ellipsoid& earth, double latitude, double angle, const ReferenceSigma& sigma,
                 const UnitSigma& unit, double share = 0.1);

}  // namespace loxo
