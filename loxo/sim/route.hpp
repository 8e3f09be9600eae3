// SPDX-License-Identifier: Apache-2.0
// Routes on the ground and the tracks that a dead-reckoning set records on them: truth first,
// exactly, then what the sensors make of it. vehicle.md 1.1, 1.5, 5.2.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/ins/samples.hpp"

namespace loxo {

// A leg: `length` metres while the heading changes by `turn` [rad, clockwise +]: at constant
// curvature, or (smooth) with a curvature that rises from zero and falls back to it, as on roads.
// Negative length: driven in reverse.
struct RouteLeg {
  double length = 0, turn = 0;
  bool smooth = false;
};

// Heading is a function of the distance, from `heading` at the start on; true, or grid where
// `reference` says so.
struct Route {
  std::string name;
  double lat = 0, lon = 0, h = 0;  // start, rad, m
  double heading = 0;              // rad
  HeadingReference reference = HeadingReference::kTrue;
  std::vector<RouteLeg> legs;
  double hill_height = 0,
         hill_length = 1000;  // m: height h + hill_height sin(2 pi s / hill_length)
};

double route_length(const Route& route);             // m, reverse legs counted positive
double route_heading(const Route& route, double s);  // rad, continuous, at s metres of way

struct RouteStart {
  double lat = 0, lon = 0, h = 0;  // rad, m
};
Route straight_route(const RouteStart& start, double heading, double length);
Route arc_route(const RouteStart& start, double heading, double length, double turn);
// Two straight legs and a corner of `radius` between them, its length taken from neither: `turn`
// clockwise +.
Route l_route(const RouteStart& start, double heading, double first, double second, double turn,
              double radius);
// Two arcs of opposite turn: the areas on both sides of the chord cancel.
Route s_route(const RouteStart& start, double heading, double length, double turn);
// Three legs of equal length, turned by `turn` and back (the "Z" of vehicle-expected.csv).
Route z_route(const RouteStart& start, double heading, double leg, double turn, double radius);
Route semicircle_route(const RouteStart& start, double heading, double length, bool to_right);
// A square with round corners, back to its start up to the Earth's curvature.
Route closed_route(const RouteStart& start, double heading, double side, double radius,
                   bool to_right);
// Rhumb legs through the points, corners rounded with continuous curvature (smallest radius
// `radius`). Throws Error(kInput) for fewer than two points or legs too short for their corners.
Route waypoint_route(const Ellipsoid& ell, const std::vector<LatLon<double>>& points,
                     double radius);
// A road: straights of 100 to 1000 m and smooth turns up to 100 deg, drawn by (seed, trial).
Route random_road(const RouteStart& start, double length, std::uint64_t seed, std::uint64_t trial);

// What the set records wrongly. Constants k and eps are as given; everything else is 1 sigma and
// drawn per trial.
struct TrackErrors {
  double k = 1, eps = 0;           // indicated / true; indicated - true [rad]
  double heading_bias = 0;         // rad, azimuth of the alignment (adds to eps)
  double heading_drift = 0;        // rad/s, constant
  double heading_noise = 0;        // rad/sqrt(s), angle random walk
  double side_slip = 0;            // rad, white, each step
  double scale_noise = 0;          // white, each step, relative
  double quantisation = 0;         // m of indicated distance, phase drawn
  double pitch_mounting = 0;       // rad, indicated pitch - true pitch, as given
  double fixed_heading_drift = 0;  // rad/s, as given
};

struct TrackOptions {
  double speed = 15;        // m/s
  double acceleration = 0;  // m/s^2: from rest and back to rest; 0: `speed` throughout
  double interval = 1;      // s a step
  double t0 = 0;            // s, time at the start
  // Recorded steps hold one heading each. Exact steps: truth does the same, so that replay is
  // exact. Otherwise truth follows the curve inside each step (error of the recorded model: second
  // order in the step).
  bool exact_steps = true;
  HeadingModel model = HeadingModel::kIndependent;
  HeadingReference reference = HeadingReference::kTrue;
  bool earth_rate = false;  // with kMechanised
  TrackErrors errors;
  std::uint64_t seed = 1, trial = 0;
};

struct TruthPoint {
  double t = 0, lat = 0, lon = 0, h = 0;  // lon continuous, not wrapped
  double heading = 0;                     // rad, true north, at this point
};
struct SimulatedTrack {
  std::vector<TrackStep> steps;
  std::vector<TruthPoint> truth;  // steps.size() + 1; truth[i + 1] is where steps[i] ends
};
SimulatedTrack simulate_track(const Ellipsoid& ell, const Route& route,
                              const TrackOptions& options);

// The benchmark passed after `row` steps, coordinates and height in error by `std` (drawn by seed,
// trial and row). `right`, `forward` [m]: the surveyed point on the body, from the odometer.
Benchmark survey(const Ellipsoid& ell, const SimulatedTrack& track, std::size_t row, double std,
                 std::uint64_t seed, std::uint64_t trial, double right = 0, double forward = 0);

}  // namespace loxo
