// SPDX-License-Identifier: Apache-2.0
// Simulated tracks: truth is the route, the record replayed with its own constants is the truth,
// the drawn errors have the sizes asked for.
#include "loxo/sim/route.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "loxo/earth/geodetic.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr double kArc = 3e-8;  // m: the meridian arc's promise and ECEF's last digit

double apart(const TruthPoint& p, double lat, double lon) {
  return norm(to_ecef(wgs84(), Geodetic<double>{p.lat, p.lon, 0.0}) -
              to_ecef(wgs84(), Geodetic<double>{lat, lon, 0.0}));
}

TEST(Route, AStraightRouteIsARhumbLine) {
  for (double lat : {-60.0, 0.0, 55.0}) {
    const auto track =
        simulate_track(wgs84(), straight_route({lat * deg, 3.0, 0}, 0.8, 90e3), TrackOptions{});
    const auto end = rhumb_direct(wgs84(), lat * deg, 3.0, 0.8, 90e3);
    ASSERT_EQ(track.steps.size(), 6000u);
    ASSERT_EQ(track.truth.size(), 6001u);
    EXPECT_LT(apart(track.truth.back(), end.lat, end.lon), kArc);
  }
}

TEST(Route, LengthsAndHeadings) {
  const RouteStart a{0.9, 0.1, 0};
  EXPECT_NEAR(route_length(l_route(a, 0.3, 1000, 2000, -kPi / 2, 100)), 3000 + 50 * kPi, 1e-9);
  EXPECT_NEAR(route_heading(l_route(a, 0.3, 1000, 2000, -kPi / 2, 100), 2500), 0.3 - kPi / 2,
              1e-15);
  EXPECT_NEAR(route_heading(semicircle_route(a, 0.3, 1000, true), 500), 0.3 + kPi / 2, 1e-15);
  EXPECT_NEAR(route_heading(s_route(a, 0.3, 1000, 1.0), 1000), 0.3, 1e-15);
  const auto square = closed_route(a, 0.3, 1000, 50, false);
  EXPECT_NEAR(route_heading(square, route_length(square)), 0.3 - 2 * kPi, 1e-12);
  const auto track = simulate_track(wgs84(), square, TrackOptions{});
  // Closes up to the convergence: (side/a)^2 tan L of the side, and the chords of its corners.
  EXPECT_LT(apart(track.truth.back(), 0.9, 0.1), 1.0);
}

TEST(Route, WaypointsAreReached) {
  const std::vector<LatLon<double>> points = {
      {0.9, 0.1}, {0.9005, 0.1}, {0.9005, 0.102}, {0.9001, 0.103}};
  const auto route = waypoint_route(wgs84(), points, 50);
  TrackOptions fine;
  fine.interval = 0.02;
  const auto track = simulate_track(wgs84(), route, fine);
  // Corner legs are laid in the plane: (100 m/a) of 100 m, and chords of 0.3 m of the curve.
  EXPECT_LT(apart(track.truth.back(), 0.9001, 0.103), 0.05);
  EXPECT_THROW(waypoint_route(wgs84(), {{0.9, 0.1}}, 50), Error);
  EXPECT_THROW(waypoint_route(wgs84(), points, 50000), Error);
}

TEST(Route, TheRecordReplayedWithItsConstantsIsTheTruth) {
  // (V-5) the other way round, for every road, model and reference.
  for (std::uint64_t trial = 0; trial < 20; ++trial) {
    TrackOptions o;
    o.errors.k = 1.2;
    o.errors.eps = 1.6;
    const auto route = random_road({(trial % 2 == 0 ? 55 : -70) * deg, 3.14, 50}, 20e3, 7, trial);
    const auto track = simulate_track(wgs84(), route, o);
    auto state = reckon_start(route.lat, route.lon);
    for (const auto& s : track.steps) {
      const double ds = s.ds / 1.2, psi = s.heading - 1.6;
      step_exact(wgs84(), state, ds * std::cos(psi), ds * std::sin(psi), s.h);
    }
    EXPECT_LT(apart(track.truth.back(), state.lat, state.lon), 10 * kArc) << trial;

    o.model = HeadingModel::kMechanised;
    const auto kept = simulate_track(wgs84(), route, o);
    auto pair = mechanised_start(route.lat, route.lon);
    for (const auto& s : kept.steps)
      step_mechanised(wgs84(), pair, s.ds, s.heading, 1.2, 1.6, s.h, 0.0);
    EXPECT_LT(apart(kept.truth.back(), pair.truth.lat, pair.truth.lon), 1e-5) << trial;
    // At k = 1.2, eps = 92 deg the two models' records part by far more than rounding.
    EXPECT_GT(std::fabs(wrap_pi(kept.steps.back().heading - track.steps.back().heading)), 1e-4);
  }
}

TEST(Route, GridHeadingsOverThePole) {
  TrackOptions o;
  o.reference = HeadingReference::kGrid;
  auto route = straight_route({89.95 * deg, 0.0, 0}, 0.0, 11e3);
  route.reference = HeadingReference::kGrid;
  const auto track = simulate_track(wgs84(), route, o);
  EXPECT_NEAR(std::fabs(track.truth.back().lon), kPi, 1e-9);
  EXPECT_NEAR(meridian_arc(wgs84(), track.truth.back().lat),
              2 * wgs84().quarter_meridian - meridian_arc(wgs84(), 89.95 * deg) - 11e3, 1e-5);
  EXPECT_THROW(simulate_track(wgs84(), route, TrackOptions{}), Error);
}

TEST(Route, DrawnErrorsHaveTheirSizes) {
  // 400 trials: the sample variance of a normal is known to sqrt(2/400) = 7 %; four of it.
  const double tolerance = 4 * std::sqrt(2.0 / 400);
  double bias = 0, drift = 0, walk = 0;
  const auto route = straight_route({0.7, 0, 0}, 1.0, 1500);
  for (std::uint64_t trial = 0; trial < 400; ++trial) {
    const auto last = [&](const TrackErrors& e) {
      TrackOptions o;
      o.trial = trial;
      o.errors = e;
      return wrap_pi(simulate_track(wgs84(), route, o).steps.back().heading - 1.0);
    };
    TrackErrors b, d, w;
    b.heading_bias = 1e-3, d.heading_drift = 1e-5, w.heading_noise = 1e-4;
    bias += std::pow(last(b) / 1e-3, 2) / 400;
    drift += std::pow(last(d) / (1e-5 * 99.5), 2) / 400;  // mid of the last of 100 steps
    walk += std::pow(last(w) / (1e-4 * std::sqrt(99.5)), 2) / 400;
  }
  EXPECT_NEAR(bias, 1.0, tolerance);
  EXPECT_NEAR(drift, 1.0, tolerance);
  EXPECT_NEAR(walk, 1.0, tolerance);
}

TEST(Route, PulsesCountTheWayAndTrialsRepeat) {
  TrackOptions o;
  o.errors.quantisation = 0.7;
  o.errors.scale_noise = 0.01;
  o.errors.side_slip = 0.01;
  o.acceleration = 1;
  const auto route = random_road({0.7, 0, 0}, 3000, 3, 4);
  const auto a = simulate_track(wgs84(), route, o), b = simulate_track(wgs84(), route, o);
  ASSERT_EQ(a.steps.size(), b.steps.size());
  for (std::size_t i = 0; i < a.steps.size(); ++i) {
    EXPECT_EQ(a.steps[i].heading, b.steps[i].heading);
    EXPECT_NEAR(std::remainder(a.steps[i].ds, 0.7), 0.0, 1e-12);
  }
  o.errors.scale_noise = 0;
  double sum = 0;
  for (const auto& s : simulate_track(wgs84(), route, o).steps) sum += s.ds;
  EXPECT_NEAR(sum, 3000, 0.7);
  o.trial = 1;
  EXPECT_NE(simulate_track(wgs84(), route, o).steps.back().heading, a.steps.back().heading);
}

TEST(Route, ASurveyedPointKnowsItsLever) {
  const auto track =
      simulate_track(wgs84(), straight_route({0.7, 0, 0}, kPi / 2, 1500), TrackOptions{});
  const auto exact = survey(wgs84(), track, 100, 0.0, 1, 0);
  EXPECT_LT(apart(track.truth[100], exact.lat, exact.lon), kArc);
  // Heading east: 3 m right is 3 m south, 4 m forward 4 m east.
  const auto lever = survey(wgs84(), track, 100, 0.0, 1, 0, 3.0, 4.0);
  EXPECT_NEAR((lever.lat - exact.lat) * meridian_radius(wgs84(), std::sin(exact.lat)), -3.0, 1e-5);
  EXPECT_NEAR(apart(track.truth[100], lever.lat, lever.lon), 5.0, 1e-5);
  EXPECT_THROW(survey(wgs84(), track, 101, 0.0, 1, 0), Error);
}

}  // namespace
}  // namespace loxo
