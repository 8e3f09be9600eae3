// SPDX-License-Identifier: Apache-2.0
// Simulated drives calibrated by the real methods: is the stated error the true one? Truth comes
// from sim/route, the normalised errors must be chi-square. vehicle.md 5.2, 8.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "loxo/calibrate/least_squares.hpp"
#include "loxo/calibrate/plan.hpp"
#include "loxo/sim/route.hpp"

namespace loxo {

// One kind of drive, repeated with other noise (and another route, where `route` draws one).
struct CalibrationTrials {
  std::string name;
  std::function<Route(std::uint64_t trial)> route;
  TrackOptions track;  // errors, k and eps, speed, interval, heading model; trial is set per drive
  double speed_spread = 0;  // each drive's speed within this share of track.speed: the unread parts
                            // of pulses at one constant speed belong to that speed only
  std::vector<double> benchmarks_at{1.0};  // shares of the rows; the last at the end
  double benchmark_std = 0, start_std = 0;
  std::vector<State> estimate;  // states beside scale and angle; none and one benchmark:
                                // replay, else least squares
  double lever_right = 0, lever_forward = 0;  // m, true, where estimated
  double start_north = 0, start_east = 0;     // m, true offset of the start, where estimated
};

struct StateStatistics {
  State state = State::kScale;
  double stated = 0;  // root mean of the stated variance, SI
  double found = 0;   // root mean square of the errors
  double mean = 0;    // mean error: a bias, if many times found / sqrt(drives)
  double ratio = 0;   // mean of (error / stated)^2: 1
};
struct TrialStatistics {
  int drives = 0, valid = 0;
  std::vector<StateStatistics> states;
  double nees = 0;           // mean of e^T P^-1 e over the states that the source touches
  int dimension = 0;         // of it
  double low = 0, high = 0;  // its chi-square band at `confidence`
  double confidence = 0.9999;
  double chi2 = 0;  // least squares: mean of chi2 / dof, where dof > 0
  bool inside() const { return valid == drives && dimension > 0 && nees >= low && nees <= high; }
};
TrialStatistics run_calibration_trials(const Ellipsoid& ell, const CalibrationTrials& trials,
                                       int drives, std::uint64_t seed);

// The error sources whose stated confidence is held against simulated drives, each alone: white
// odometer noise, pulses, heading noise, drift, alignment, side slip, benchmarks, start, and the
// states of least squares; on straight, bent, hilly, mechanised and grid tracks.
std::vector<CalibrationTrials> stated_confidence_trials();

// The drive that a plan describes, with its sensor errors, simulated.
CalibrationTrials plan_trials(const PlanRequest& request, const Plan& plan);

}  // namespace loxo
