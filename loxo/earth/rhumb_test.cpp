// SPDX-License-Identifier: Apache-2.0
// Rhumb lines and meridian arcs against GeographicLib and against their own laws.
#include "loxo/earth/rhumb.hpp"

#include <gtest/gtest.h>

#include <GeographicLib/EllipticFunction.hpp>
#include <GeographicLib/Rhumb.hpp>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "loxo/earth/geodetic.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

// vehicle.md section 10.
constexpr double kDistanceGoal = 1e-7;  // m
constexpr double kAcrossGoal = 2e-8;    // m
constexpr double kAzimuthGoal = 2e-12 * deg;
constexpr double kDirectGoal = 2e-13 * deg;  // of position: longitude times cos(latitude)
constexpr double kArcGoal = 2e-8;            // m
constexpr double kMany = 0x1p20;

int pairs() { return std::getenv("LOXO_LONG") != nullptr ? 2000000 : 100000; }

std::vector<Ellipsoid> earths() {
  return {wgs84(), krassovsky(), make_sphere(6371000.0), make_ellipsoid("oblate", 6.4e6, 0.01)};
}

struct Pair {
  double lat1, lon1, lat2, lon2;  // deg
};

// Random and hard pairs: everywhere, near each other, east-west to the last bit, near the poles,
// across +-180.
struct Pairs {
  std::mt19937_64 random;
  double uniform(double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  }
  double tiny() { return std::pow(10.0, uniform(-13.0, 0.0)) * (uniform(0, 1) < 0.5 ? -1.0 : 1.0); }
  Pair next(int i) {
    Pair p{uniform(-89.99, 89.99), uniform(-180, 180), uniform(-89.99, 89.99), uniform(-180, 180)};
    switch (i % 8) {
      case 0:
      case 1:
        break;
      case 2:
        p.lat2 = p.lat1;
        break;
      case 3:
        p.lat2 = std::max(-89.99, std::min(89.99, p.lat1 + tiny()));
        break;
      case 4:
        p.lat2 = std::max(-89.99, std::min(89.99, p.lat1 + tiny()));
        p.lon2 = p.lon1 + tiny();
        break;
      case 5:
        p.lat1 = tiny();
        p.lat2 = tiny();
        break;
      case 6:
        p.lat1 = std::copysign(90.0 - std::pow(10.0, uniform(-6.0, 0.0)), p.lat1);
        break;
      default:
        p.lon1 = 180.0 - std::fabs(tiny());
        p.lon2 = -180.0 + std::fabs(tiny());
        break;
    }
    return p;
  }
};

TEST(Rhumb, InverseAndDirectAgreeWithGeographicLib) {  // (V-8), (V-17)
  const std::uint64_t s = testing::seed();
  double worst_distance = 0, worst_across = 0, worst_angle = 0, worst_lat = 0, worst_lon = 0;
  for (const Ellipsoid& ell : earths()) {
    Pairs make{std::mt19937_64(s)};
    const GeographicLib::Rhumb oracle(ell.a, ell.f, true);
    for (int i = 0; i < pairs() / 4; ++i) {
      const Pair p = make.next(i);
      double distance, azimuth;
      oracle.Inverse(p.lat1, p.lon1, p.lat2, p.lon2, distance, azimuth);
      const auto r = rhumb_inverse(ell, p.lat1 * deg, p.lon1 * deg, p.lat2 * deg, p.lon2 * deg);
      // Near a pole the latitude's own rounding to radians counts: what one unit in its last place
      // does.
      const double near1 = std::nextafter(p.lat1 * deg, 0.0);
      const double near2 = std::nextafter(p.lat2 * deg, 0.0);
      const auto r1 = rhumb_inverse(ell, near1, p.lon1 * deg, p.lat2 * deg, p.lon2 * deg);
      const auto r2 = rhumb_inverse(ell, p.lat1 * deg, p.lon1 * deg, near2, p.lon2 * deg);
      const double input =
          std::fabs(wrap_pi(r1.azimuth - r.azimuth)) + std::fabs(wrap_pi(r2.azimuth - r.azimuth));
      const double input_m =
          std::fabs(r1.distance - r.distance) + std::fabs(r2.distance - r.distance);
      ASSERT_NEAR(r.distance, distance, kDistanceGoal + input_m)
          << ell.name << " " << p.lat1 << " " << p.lon1 << " " << p.lat2 << " " << p.lon2;
      const double turn = std::fabs(wrap_pi(r.azimuth - azimuth * deg));
      ASSERT_TRUE(turn < kAzimuthGoal + input || turn * distance < kAcrossGoal)
          << ell.name << " " << p.lat1 << " " << p.lon1 << " " << p.lat2 << " " << p.lon2 << ": "
          << turn / deg << " deg over " << distance;
      worst_distance = std::max(worst_distance, std::fabs(r.distance - distance));
      if (turn >= kAzimuthGoal)
        worst_across = std::max(worst_across, turn * distance);
      else
        worst_angle = std::max(worst_angle, turn);

      double lat2, lon2;
      oracle.Direct(p.lat1, p.lon1, azimuth, distance, lat2, lon2);
      if (std::isnan(lon2)) continue;
      const auto d = rhumb_direct(ell, p.lat1 * deg, p.lon1 * deg, azimuth * deg, distance);
      // The azimuth in radians is rounded: 1.1e-16 of the distance, once more for the oracle's
      // degrees.
      const double rounding = 4.5e-16 * distance / ell.a;
      const double dlat = std::fabs(d.lat - lat2 * deg),
                   dlon = std::fabs(wrap_pi(d.lon - lon2 * deg)) * std::cos(lat2 * deg);
      ASSERT_LT(dlat, kDirectGoal + rounding)
          << ell.name << " " << p.lat1 << " " << azimuth << " " << distance;
      const double dq = isometric_latitude(ell, lat2 * deg) - isometric_latitude(ell, p.lat1 * deg);
      // The roundings before a near pole multiply, the oracle's in degrees too: sixteen units in
      // the latitude's last place. What one does is the millionth part of what 2^20 do: of one
      // alone the longitude's own rounding may leave nothing.
      const double unit = p.lat1 * deg - near1;
      const double moved =
          rhumb_direct(ell, p.lat1 * deg - kMany * unit, p.lon1 * deg, azimuth * deg, distance).lon;
      // A turn of several radians carries four roundings relative to itself, ours and the oracle's.
      const double turned = 9e-16 * std::fabs(std::tan(azimuth * deg) * dq) * std::cos(lat2 * deg);
      const double shift = std::fabs(wrap_pi(moved - d.lon)) / kMany * std::cos(lat2 * deg);
      ASSERT_LT(dlon, kDirectGoal + rounding + turned + 16 * shift)
          << ell.name << " " << p.lat1 << " " << azimuth << " " << distance;
      worst_lat = std::max(worst_lat, dlat);
      worst_lon = std::max(worst_lon, dlon);
    }
  }
  std::printf(
      "worst: distance %.2g m, across %.2g m, angle %.2g deg; direct %.2g deg, %.2g deg across\n",
      worst_distance, worst_across, worst_angle / deg, worst_lat / deg, worst_lon / deg);
}

TEST(Rhumb, MeridianArcIsTheEllipticIntegral) {  // (V-4)
  for (const Ellipsoid& ell : earths()) {
    const GeographicLib::EllipticFunction E(ell.e2);
    for (double lat = -90.0; lat <= 90.0; lat += 0.37) {
      const double s = std::sin(lat * deg), c = std::cos(lat * deg);
      const double m =
          ell.a * (E.E(s, c, E.Delta(s, c)) - ell.e2 * s * c / std::sqrt(1.0 - ell.e2 * s * s));
      EXPECT_NEAR(meridian_arc(ell, lat * deg), m, kArcGoal) << ell.name << " " << lat;
      EXPECT_NEAR(latitude_of_arc(ell, m), lat * deg, 2e-15);
    }
  }
  EXPECT_NEAR(wgs84().quarter_meridian, 10001965.729312724, 5e-9);
}

TEST(Rhumb, IsometricLatitudeAndItsInverse) {  // (V-3)
  for (const Ellipsoid& ell : earths())
    for (double lat = -89.9; lat <= 89.9; lat += 0.1) {
      const long double s = std::sin(static_cast<long double>(lat) * kPi / 180), e = ell.e;
      const long double q = std::atanh(s) - e * std::atanh(e * s);
      EXPECT_NEAR(isometric_latitude(ell, lat * deg), static_cast<double>(q),
                  4e-15 / std::cos(lat * deg));
      EXPECT_NEAR(latitude_of_isometric(ell, static_cast<double>(q)), lat * deg, 4e-16 * 2);
      EXPECT_NEAR(isometric_rate(ell, lat * deg) * prime_vertical_radius(ell, std::sin(lat * deg)) *
                      std::cos(lat * deg),
                  1.0, 1e-15);
    }
  EXPECT_EQ(isometric_latitude(wgs84(), kPi / 2), std::numeric_limits<double>::infinity());
  EXPECT_EQ(isometric_latitude(wgs84(), -kPi / 2), -std::numeric_limits<double>::infinity());
}

TEST(Rhumb, DividedDifferenceIsSmoothThroughEqualLatitudes) {  // (V-8)
  const Ellipsoid& ell = wgs84();
  for (double lat : {-89.0, -55.0, 0.0, 10.0, 55.0, 89.9}) {
    const double w = isometric_rate(ell, lat * deg);
    EXPECT_NEAR(isometric_divided_difference(ell, lat * deg, lat * deg) / w, 1.0, 2e-15);
    for (double d = 1e-16; d < 1e-3; d *= 10) {
      // Symmetric about lat: the mean rate differs from the middle one by w''/24 of the span, 1e-6
      // relative to span^2/cos^2.
      const double D = isometric_divided_difference(ell, lat * deg - d, lat * deg + d);
      const double t = d / std::cos(lat * deg);
      EXPECT_NEAR(D / w, 1.0, 2e-15 / std::cos(lat * deg) + t * t) << lat << " " << d;
    }
  }
}

TEST(Rhumb, ThePolesAreOrdinaryEndPoints) {
  const Ellipsoid& ell = wgs84();
  const double north = kPi / 2;
  const auto up = rhumb_inverse(ell, 80 * deg, 10 * deg, north, 100 * deg);
  EXPECT_EQ(up.azimuth, 0.0);
  EXPECT_NEAR(up.distance, ell.quarter_meridian - meridian_arc(ell, 80 * deg), kArcGoal);
  const auto down = rhumb_inverse(ell, north, 10 * deg, 80 * deg, 100 * deg);
  EXPECT_DOUBLE_EQ(down.azimuth, kPi);
  const auto across = rhumb_inverse(ell, -north, 0.0, north, 0.0);
  EXPECT_NEAR(across.distance, 2 * ell.quarter_meridian, kArcGoal);
  const auto none = rhumb_inverse(ell, north, 1.0, north, 2.0);
  EXPECT_EQ(none.distance, 0.0);
  EXPECT_EQ(none.azimuth, 0.0);
  const auto there = rhumb_direct(ell, 80 * deg, 10 * deg, 0.0, up.distance);
  EXPECT_NEAR(there.lat, north, 1e-15);
  EXPECT_NEAR(there.lon, 10 * deg, 1e-15);
  const auto away = rhumb_direct(ell, north, 10 * deg, kPi, up.distance);
  EXPECT_NEAR(away.lat, 80 * deg, 1e-15);
  EXPECT_NEAR(away.lon, 10 * deg, 1e-15);
  EXPECT_TRUE(std::isnan(rhumb_direct(ell, 80 * deg, 0.0, 0.3, 3e6).lat));
  EXPECT_TRUE(std::isnan(rhumb_direct(ell, 80 * deg, 0.0, 0.3, 3e6).lon));
  EXPECT_TRUE(std::isnan(rhumb_inverse(ell, 1.6, 0.0, 0.0, 0.0).distance));
  EXPECT_TRUE(std::isnan(rhumb_inverse(ell, std::nan(""), 0.0, 0.0, 0.0).azimuth));
}

TEST(Rhumb, IdenticalPointsAndTheShorterWay) {
  const Ellipsoid& ell = wgs84();
  const auto none = rhumb_inverse(ell, 0.3, 0.4, 0.3, 0.4);
  EXPECT_EQ(none.distance, 0.0);
  EXPECT_EQ(none.azimuth, 0.0);
  const auto east = rhumb_inverse(ell, 0.5, 179 * deg, 0.5, -179 * deg);
  EXPECT_NEAR(east.azimuth, kPi / 2, 1e-15);
  EXPECT_NEAR(east.distance, 2 * deg * prime_vertical_radius(ell, std::sin(0.5)) * std::cos(0.5),
              kArcGoal);
  const auto west = rhumb_inverse(ell, 0.5, -179 * deg, 0.5, 179 * deg);
  EXPECT_NEAR(west.azimuth, 1.5 * kPi, 1e-15);
}

}  // namespace
}  // namespace loxo
