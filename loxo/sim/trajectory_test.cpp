// SPDX-License-Identifier: Apache-2.0
// Error-free navigation of a trajectory's own increments returns its truth, over the pole and round
// it too.
#include "loxo/sim/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "loxo/ins/strapdown.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

struct Miss {
  double position, velocity, attitude;  // m, m/s, rad at the end
};
Miss navigate(const Trajectory& trajectory) {
  const double dt = 0.01;
  const EarthModel earth = make_earth_model(trajectory.ellipsoid);
  TrajectoryWalk walk(trajectory);
  auto x = EcefMechanization::from_ecef(earth, walk.truth().state);
  ImuIncrement<double> before{};
  const long n = std::lround(trajectory.duration() / dt);
  for (long i = 1; i <= n; ++i) {
    const auto u = walk.to(static_cast<double>(i) * dt);
    x = step<EcefMechanization>(earth, x, i == 1 ? one_sample(u) : one_sample(before, u));
    before = u;
  }
  const auto a = EcefMechanization::to_ecef(earth, x);
  const auto b = walk.truth().state;
  const auto d = conjugate(a.q_eb) * b.q_eb;
  return {norm(a.r - b.r), norm(a.v - b.v), 2 * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z)};
}
Trajectory from(double lat_deg, double lon_deg, double course_deg, double speed) {
  Trajectory t;
  t.ellipsoid = wgs84();
  t.start = {lat_deg * deg, lon_deg * deg, 20};
  t.course = course_deg * deg;
  t.speed = speed;
  return t;
}
// The wanted closure over ten minutes.
constexpr double kPosition = 1e-3;

TEST(Trajectory, ErrorFreeNavigationReturnsTheTruth) {
  for (const double lat : {-90.0, -60.0, 0.0, 45.0, 89.9, 90.0}) {
    Trajectory t = from(lat, 179.99, 70, 0);
    t.legs = {{60, 15, 0, true},
              {30, 15, 90 * deg, true},
              {200, 20, 0, true},
              {10, 5, -170 * deg, true},
              {300, 0, 0.3, true}};
    const Miss m = navigate(t);
    EXPECT_LT(m.position, kPosition) << lat;
    EXPECT_LT(m.attitude, 1e-9) << lat;
  }
}

TEST(Trajectory, OverThePole) {
  Trajectory t = from(89.95, 30, 0, 20);  // 5.6 km before it
  t.legs = {{600, 20, 0, true}};
  EXPECT_LT(navigate(t).position, kPosition);
  TrajectoryWalk walk(t);
  walk.to(600);
  const auto g = to_geodetic(t.ellipsoid, walk.truth().state.r);
  EXPECT_NEAR(std::remainder(g.lon - (30 - 180) * deg, 2 * kPi), 0, 1e-9);
  EXPECT_NEAR(walk.truth().distance, 12000, 1e-6);
}

TEST(Trajectory, ATrueCourseRoundThePoleKeepsItsLatitude) {
  for (const double lat : {89.99, -89.99}) {
    Trajectory t = from(lat, 0, 90, 10);
    t.legs = {{600, 10, 0, false}};
    EXPECT_LT(navigate(t).position, kPosition);
    TrajectoryWalk walk(t);
    for (int i = 1; i <= 60000; ++i) walk.to(0.01 * i);
    const auto g = to_geodetic(t.ellipsoid, walk.truth().state.r);
    EXPECT_NEAR(g.lat, lat * deg, 1e-12);
    const double circle = prime_vertical_radius(t.ellipsoid, std::sin(lat * deg)) + 20;
    EXPECT_NEAR(std::remainder(g.lon - 6000 / (circle * std::cos(lat * deg)), 2 * kPi), 0, 1e-8);
  }
}

TEST(Trajectory, AShipInWaves) {
  Trajectory t = from(-72, 10, 200, 8);
  t.legs = {{600, 8, 0, false}};
  t.waves = {{WaveAxis::kRoll, 8 * deg, 9.3, 0.1},
             {WaveAxis::kPitch, 3 * deg, 6.7, 0.9},
             {WaveAxis::kYaw, 2 * deg, 17.3, 0.3},
             {WaveAxis::kHeave, 1.5, 8.1, 0.7}};
  t.mounting_heading = 1 * deg;
  t.mounting_pitch = -0.5 * deg;
  // 8 deg of roll in 9.3 s at 100 Hz: the loop's own dt^2 error is larger than on the road.
  const Miss m = navigate(t);
  EXPECT_LT(m.position, 0.02);
  EXPECT_LT(m.attitude, 1e-7);
}

}  // namespace
}  // namespace loxo
