// SPDX-License-Identifier: Apache-2.0
#include "loxo/earth/geodetic.hpp"

#include <gtest/gtest.h>

#include <GeographicLib/Geocentric.hpp>
#include <cmath>
#include <cstdlib>
#include <random>

#include "loxo/earth/geodesic.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr double kAngleGoal = 1e-15;  // rad
constexpr double kPlace = 3e-9;       // m: three units in the last place of 6e6 m
constexpr double kHeightGoal = 4e-9;  // m

TEST(Geodetic, EcefBothWaysAgainstGeographicLib) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> lat_of(-90, 90), lon_of(-180, 180), h_of(-1e5, 1e5);
  for (const Ellipsoid& ell :
       {wgs84(), make_sphere(6371000.0), make_ellipsoid("oblate", 6.4e6, 0.01)}) {
    const GeographicLib::Geocentric oracle(ell.a, ell.f);
    for (int i = 0; i < 50000; ++i) {
      double lat = lat_of(random), lon = lon_of(random), h = i % 3 == 0 ? 0.0 : h_of(random);
      if (i % 5 == 0) lat = std::copysign(90.0 - std::pow(10.0, -1.0 - i % 14), lat);
      if (i % 11 == 0) lat = 1e-9 * lat;
      double x, y, z;
      oracle.Forward(lat, lon, h, x, y, z);
      const auto r = to_ecef(ell, Geodetic<double>{lat * deg, lon * deg, h});
      ASSERT_NEAR(r.x, x, kPlace);
      ASSERT_NEAR(r.y, y, kPlace);
      ASSERT_NEAR(r.z, z, kPlace);
      const auto g = to_geodetic(ell, r);
      ASSERT_NEAR(g.lat, lat * deg, kAngleGoal) << ell.name << " " << lat << " " << h;
      ASSERT_NEAR(wrap_pi(g.lon - lon * deg) * std::cos(lat * deg), 0.0, kAngleGoal) << lat;
      ASSERT_NEAR(g.h, h, kHeightGoal) << ell.name << " " << lat << " " << h;
      const auto n = to_normal(ell, r);
      const auto back = from_normal(ell, n);
      ASSERT_NEAR(norm(back - r), 0.0, 2 * kPlace);
      ASSERT_NEAR(norm(n.n), 1.0, 5e-16);
    }
  }
}

TEST(Geodetic, TheAxis) {
  const Ellipsoid& ell = wgs84();
  const auto r = to_ecef(ell, Geodetic<double>{kPi / 2, 1.0, 100.0});
  EXPECT_EQ(r.x, 0.0);
  EXPECT_EQ(r.y, 0.0);
  EXPECT_NEAR(r.z, ell.b + 100.0, kHeightGoal);
  const auto g = to_geodetic(ell, r);
  EXPECT_DOUBLE_EQ(g.lat, kPi / 2);
  EXPECT_EQ(g.lon, 0.0);
  EXPECT_NEAR(g.h, 100.0, kHeightGoal);
  const auto n = to_normal(ell, Point<Ecef, double>{0.0, 0.0, -ell.b});
  EXPECT_EQ(n.n.z, -1.0);
  EXPECT_EQ(n.n.x, 0.0);
  const auto centre = to_geodetic(ell, Point<Ecef, double>{});
  EXPECT_TRUE(std::isfinite(centre.lat) && std::isfinite(centre.h));
}

TEST(Geodetic, AxesAreOrthonormalAndPointUp) {
  for (double lat : {-90.0, -33.0, 0.0, 71.0, 90.0})
    for (double lon : {-180.0, -20.0, 0.0, 135.0}) {
      const auto c = geographic_axes(lat * deg, lon * deg);
      const auto I = c * transpose(c);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) EXPECT_NEAR(I.m[i][j], i == j ? 1.0 : 0.0, 4e-16);
      const auto n = normal_of(lat * deg, lon * deg);
      EXPECT_EQ(c.m[2][0], n.x);
      EXPECT_EQ(c.m[2][2], n.z);
      // east is what longitude increases
      const auto d =
          normal_of(lat * deg, lon * deg + 1e-6) - normal_of(lat * deg, lon * deg - 1e-6);
      EXPECT_GE(c.m[0][0] * d.x + c.m[0][1] * d.y, 0.0);
    }
}

TEST(Geodetic, Wrapping) {
  EXPECT_EQ(wrap_pi(kPi), kPi);
  EXPECT_EQ(wrap_pi(-kPi), kPi);
  EXPECT_EQ(wrap_pi(0.0), 0.0);
  EXPECT_NEAR(wrap_pi(7.0), 7.0 - 2 * kPi, 1e-15);
  EXPECT_NEAR(wrap_pi(-20.0), -20.0 + 6 * kPi, 4e-15);
  EXPECT_NEAR(wrap_2pi(-0.5), 2 * kPi - 0.5, 1e-15);
  EXPECT_EQ(wrap_2pi(0.0), 0.0);
  EXPECT_GE(wrap_2pi(-1e-300), 0.0);
  EXPECT_LT(wrap_2pi(-1e-300), 2 * kPi);
  EXPECT_LT(wrap_2pi(2 * kPi), 2 * kPi);
}

TEST(Ellipsoids, NamesAndNonsense) {
  EXPECT_EQ(ellipsoid_by_name("Krasovsky").a, 6378245.0);
  EXPECT_EQ(ellipsoid_by_name("wgs84").f, 1.0 / 298.257223563);
  EXPECT_EQ(ellipsoid_by_name("a=6378137m, f=1/298.257222101").f, cgcs2000().f);
  EXPECT_EQ(ellipsoid_by_name("f=0.003,a=6400km").a, 6.4e6);
  EXPECT_EQ(ellipsoid_by_name("sphere").g_constant, 9.8);
  for (const char* bad :
       {"WGS48", "a=1", "a=-3m,f=0", "a=6e6m,f=0.5", "a=6e6m,f=x", "a=6e6m,f=1/0", "", "a=nan,f=0"})
    EXPECT_THROW(ellipsoid_by_name(bad), Error) << bad;
  try {
    ellipsoid_by_name("WGS48");
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("WGS84"), std::string::npos);
  }
}

TEST(Geodesic, KnownPairs) {
  const auto r = geodesic_inverse(wgs84(), 0.0, 0.0, 0.0, 1 * deg);
  EXPECT_NEAR(r.distance, wgs84().a * deg, 1e-8);
  EXPECT_NEAR(r.azimuth1, kPi / 2, 1e-15);
  const auto up = geodesic_inverse(wgs84(), 80 * deg, 0.0, kPi / 2, 0.0);
  EXPECT_NEAR(up.azimuth1, 0.0, 1e-15);
  const auto d = geodesic_direct(wgs84(), 0.7, 3.1, 1.2, 3e6);
  const auto i = geodesic_inverse(wgs84(), 0.7, 3.1, d.lat, d.lon);
  EXPECT_NEAR(i.distance, 3e6, 2e-8);
  EXPECT_NEAR(i.azimuth1, 1.2, 1e-14);
  EXPECT_LE(d.lon, kPi);
}

}  // namespace
}  // namespace loxo
