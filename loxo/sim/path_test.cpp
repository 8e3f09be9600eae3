// SPDX-License-Identifier: Apache-2.0
// A way through points: truth is a function of time whose increments navigate back to it, in every
// regime; it keeps to its points, its speed and its radius.
#include "loxo/sim/path.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "loxo/earth/geodesic.hpp"
#include "loxo/ins/strapdown.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/trajectory.hpp"
#include "refusal.hpp"

namespace loxo {
namespace {

// A zigzag of legs of 400 m with corners of 90 and 60 degrees, hills between.
std::vector<PathPoint> zigzag(double lat_deg, double lon_deg, double azimuth_deg) {
  std::vector<PathPoint> points{{lat_deg * deg, lon_deg * deg, 100}};
  double azimuth = azimuth_deg * deg;
  int i = 0;
  for (const double turn : {90.0, -60.0, -90.0, 45.0, 60.0, 0.0}) {
    const auto g = geodesic_direct(wgs84(), points.back().lat, points.back().lon, azimuth, 400);
    points.push_back({g.lat, g.lon, ++i % 2 == 0 ? 100.0 : 112.0});
    azimuth = g.azimuth2 + turn * deg;
  }
  return points;
}
Trajectory on(const std::vector<PathPoint>& points, double spacing, const PathSpeed& v = {}) {
  Trajectory t;
  t.ellipsoid = wgs84();
  t.path = std::make_shared<const Path>(t.ellipsoid, points, spacing, 3.0, v, "test");
  return t;
}
double miss(const TrajectoryWalk& walk, const PathPoint& p) {
  const auto r = to_ecef(wgs84(), Geodetic<double>{p.lat, p.lon, p.h});
  return norm(walk.truth().state.r - r);
}

TEST(Path, ErrorFreeNavigationReturnsTheTruthInEveryRegime) {
  struct Case {
    double lat, lon, azimuth;
  };
  for (const Case c : {Case{48, 11, 30}, Case{-33, -179.999, 80}, Case{90, 0, 0},
                       Case{-89.9999, 20, 45}, Case{0, 180, -20}}) {
    Trajectory t = on(zigzag(c.lat, c.lon, c.azimuth), 20);
    t.mounting_heading = 1.5 * deg;
    t.mounting_pitch = -0.5 * deg;
    t.waves = {{WaveAxis::kHeave, 0.05, 3.1, 0.2}, {WaveAxis::kPitch, 0.2 * deg, 2.3, 0.1}};
    const double dt = 0.01;
    const EarthModel earth = make_earth_model(t.ellipsoid);
    TrajectoryWalk walk(t);
    auto x = EcefMechanization::from_ecef(earth, walk.truth().state);
    ImuIncrement<double> before{};
    const long n = std::lround(t.duration() / dt);
    for (long i = 1; i <= n; ++i) {
      const auto u = walk.to(static_cast<double>(i) * dt);
      x = step<EcefMechanization>(earth, x, i == 1 ? one_sample(u) : one_sample(before, u));
      before = u;
    }
    const auto a = EcefMechanization::to_ecef(earth, x), b = walk.truth().state;
    const auto d = conjugate(a.q_eb) * b.q_eb;
    // Three minutes; the loop's own coning error at 100 Hz of 0.5 rad/s and a pitch of 2.3 s.
    EXPECT_LT(norm(a.r - b.r), 1e-3) << c.lat;
    EXPECT_LT(2 * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), 1e-8) << c.lat;
  }
}

TEST(Path, ItStartsAndEndsAtRestAtItsEndsAndKeepsToItsSpeed) {
  const auto points = zigzag(-60, 179.998, 10);
  PathSpeed v;
  v.speed = 12;
  const Trajectory t = on(points, 15, v);
  TrajectoryWalk walk(t);
  // The spline of control points goes through the first within what the first corner is away: here
  // exactly, for the ends are straight.
  EXPECT_LT(miss(walk, points.front()), 1e-3);
  EXPECT_EQ(norm(walk.truth().state.v), 0.0);
  double most = 0, sum = 0;
  const long n = std::lround(t.duration() / 0.05);
  for (long i = 1; i <= n; ++i) {
    walk.to(0.05 * static_cast<double>(i));
    const Truth now = walk.truth();
    most = std::max(most, norm(now.state.v));
    sum += 0.05 * norm(now.state.v);
    // Level acceleration: what gravity and the Earth's turning leave of the force.
    EXPECT_LT(std::hypot(now.f.x, now.f.y), 3.2) << now.t;
  }
  EXPECT_LT(most, 12.05);
  EXPECT_GT(most, 11.5);
  EXPECT_EQ(norm(walk.truth().state.v), 0.0);
  EXPECT_LT(miss(walk, points.back()), 1e-3);
  EXPECT_NEAR(walk.truth().distance, sum, 0.01);
  // Corners are cut: shorter than the legs, by less than a spacing each.
  EXPECT_LT(walk.truth().distance, t.path->length());
  EXPECT_GT(walk.truth().distance, t.path->length() - 5 * 15);
}

// The rule that scenarios use: r = 0.75 d cos^2(a/2)/sin(a/2).
TEST(Path, ACornersRadiusIsThatOfTheRule) {
  for (const double turn : {20.0, 45.0, 90.0}) {
    std::vector<PathPoint> p{{0.5, 1.0, 0}};
    const double d = 20;
    auto g = geodesic_direct(wgs84(), 0.5, 1.0, 0.3, 15 * d);
    p.push_back({g.lat, g.lon, 0});
    g = geodesic_direct(wgs84(), g.lat, g.lon, g.azimuth2 + turn * deg, 15 * d);
    p.push_back({g.lat, g.lon, 0});
    const Trajectory t = on(p, d);
    TrajectoryWalk walk(t);
    double tightest = 1e9;
    for (long i = 1; i <= std::lround(t.duration() / 0.02); ++i) {
      walk.to(0.02 * static_cast<double>(i));
      const Truth now = walk.truth();
      const double speed = norm(now.state.v);
      if (speed > 1) {
        const auto w = walk.earth_rate();
        tightest = std::min(tightest, speed / std::fabs(w.z));
      }
    }
    const double half = 0.5 * turn * deg;
    EXPECT_NEAR(tightest / (0.75 * d * std::cos(half) * std::cos(half) / std::sin(half)), 1.0, 0.01)
        << turn;
  }
}

TEST(Path, RecordedTimesAreKept) {
  std::vector<PathPoint> p;
  for (int i = 0; i <= 60; ++i)
    p.push_back({0.8, 0.1 + 10.0 * i / 4.45e6, 0, i < 30 ? 1.0 * i : 2.0 * i - 30});
  const Trajectory t = on(p, 5);
  EXPECT_NEAR(t.duration(), 90, 1e-12);
  TrajectoryWalk walk(t);
  walk.to(15);
  EXPECT_LT(miss(walk, p[15]), 0.05);
  walk.to(60);  // half the speed since 30 s
  EXPECT_LT(miss(walk, p[45]), 0.05);
  EXPECT_NEAR(norm(walk.truth().state.v), 5.0, 0.05);
}

TEST(Path, WhatNoVehicleDrivesIsRefused) {
  const auto refused = [](const std::vector<PathPoint>& p, const std::string& words) {
    const std::string said = testing::refusal([&] { Path(wgs84(), p, 5, 3, {}, "here"); }, words);
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  refused({{0.5, 0.5, 0}}, "longer than");
  refused({{0.5, 0.5, 0}, {0.5, 0.5, 0}}, "longer than");
  refused({{0.5, 0.5, 0}, {0.5001, 0.5, 0}, {0.5, 0.5, 0}}, "turn back on itself");
  refused({{0.5, 0.5, 0, 0}, {0.5001, 0.5, 0, 0}}, "does not come after");
}

}  // namespace
}  // namespace loxo
