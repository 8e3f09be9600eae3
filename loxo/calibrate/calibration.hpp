// SPDX-License-Identifier: Apache-2.0
// What every method of calibration concludes, and the names of the states it may estimate.
#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "loxo/calibrate/two_point.hpp"
#include "loxo/ins/samples.hpp"

namespace loxo {

// The unknowns of vehicle.md 5.1, in SI: ln k, eps [rad], heading drift [rad/s], pitch mounting
// [rad], lever arm from the odometer to the surveyed point of the body [m, right and forward],
// offset of the start [m, north and east].
enum class State {
  kScale,
  kAngle,
  kDrift,
  kPitch,
  kLeverRight,
  kLeverForward,
  kStartNorth,
  kStartEast
};
inline constexpr std::size_t kStates = 8;
using StateVector = std::array<double, kStates>;
constexpr std::size_t index(State s) { return static_cast<std::size_t>(s); }
std::string_view state_name(State s);   // "heading_drift", "lever_arm_right" …
std::string_view state_words(State s);  // "heading drift", "lever arm to the right" …

// Benchmark minus calibrated track, metres, in the track's own heading reference (true or grid
// north, east).
struct BenchmarkResidual {
  std::string name;
  double north = 0, east = 0, up = kNone;
  double chord = 0;  // m from the start
};

struct Calibration {
  std::string method;
  bool valid = false;
  std::string why;                // the reason where not valid, or what weakens it
  double k = kNone, eps = kNone;  // indicated / true; indicated - true [rad], (-pi, pi]
  double ln_k_std = kNone, eps_std = kNone, correlation = kNone;
  double closure = kNone;  // m: residual at the end, or largest residual
  int iterations = 0;
  double smallest_singular = kNone;  // m: metres of position per unit of the weakest of ln k, eps
  double formula_ln_k = kNone,
         formula_eps = kNone;  // bias of the method's formula (V-20), computed - true
  double route_ln_k = kNone, route_eps = kNone;  // and of the route (V-21)
  double chi2 = kNone;
  int dof = -1;
  std::vector<State> states;              // kScale, kAngle, then those estimated beside them
  std::vector<double> values;             // their values
  std::vector<double> covariance;         // row-major, of `states`; never scaled by chi2/dof
  std::vector<std::string> unobservable;  // in words
  std::vector<BenchmarkResidual> residuals;
};

}  // namespace loxo
