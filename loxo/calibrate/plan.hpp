// SPDX-License-Identifier: Apache-2.0
// Which drive reaches a wanted accuracy of scale and angle: leg lengths, courses, benchmarks.
// vehicle.md sections 5 and 8.
#pragma once
#include <string>
#include <vector>

#include "loxo/calibrate/least_squares.hpp"

namespace loxo {

struct PlanRequest {
  const Ellipsoid* ellipsoid = nullptr;
  double latitude = 0;                      // rad, where the drive starts
  double course = 0.7853981633974483;       // rad, of the first leg
  double speed = 15, interval = 1;          // m/s; s between rows of the log
  double benchmark_std = 0.1;               // m per axis, start and benchmarks
  double height_std = 0.1;                  // m
  TrackErrorModel errors;                   // of the sensors
  double ln_k_std = 1e-4, eps_std = 0;      // wanted, 1 sigma; 0: not asked
  double longest = 100e3;                   // m, the whole way
  std::size_t benchmarks = 8;               // at most
  std::vector<State> estimate;              // beside scale and angle
  double expected_k = 1, expected_eps = 0;  // before calibration, for the bias of chord methods
};

// A kind of drive: straight legs, each turned from the one before, with benchmarks spread evenly on
// each, the last at its end.
struct PlanShape {
  std::string name;
  std::vector<double> turns;  // rad, heading of each leg from the first
  std::size_t per_leg = 1;
};
// The shapes that are tried: straight, there and back, L, triangle, square, each with 1, 2, 4 …
// benchmarks a leg.
std::vector<PlanShape> plan_shapes(std::size_t benchmarks);

struct Plan {
  PlanShape shape;
  bool reached = false;
  std::string why;               // where not: what holds it
  double leg = 0, way = 0;       // m
  double duration = 0;           // s
  ExpectedAccuracy accuracy;     // at this length; not reached: where the missed one is least
  State missed = State::kScale;  // not reached: the one that holds it
  double formula_ln_k = kNone, formula_eps = kNone;  // mean latitude, largest over all courses
  double route_ln_k = kNone, route_eps = kNone;      // any chord method on this way (V-21)
};

// The track of a plan, as it would be recorded without any error; with it the rows of its
// benchmarks.
struct PlannedTrack {
  std::vector<TrackStep> steps;
  std::vector<std::size_t> rows;
  std::vector<Benchmark> benchmarks;
  Benchmark start;
};
// `steps_per_leg` 0: one step each `interval`.
PlannedTrack planned_track(const PlanRequest& request, const PlanShape& shape, double leg,
                           std::size_t steps_per_leg);

// One shape at one length.
ExpectedAccuracy plan_accuracy(const PlanRequest& request, const PlanShape& shape, double leg);
// The shortest length of a shape that reaches what is wanted.
Plan shortest_plan(const PlanRequest& request, const PlanShape& shape);
// All shapes, those that reach it first, the shortest way first.
std::vector<Plan> plan_drives(const PlanRequest& request);

// Straight drive of `length` m, one benchmark at its end: standard deviations of ln k (V-44) and
// eps (V-45).
struct StraightStd {
  double ln_k = 0, eps = 0;
};
StraightStd straight_std(const PlanRequest& request, double length);

}  // namespace loxo
