// SPDX-License-Identifier: Apache-2.0
// The transverse frame and the curvature: polar.md sections 1 and 2.
#include "loxo/earth/transverse.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr double kRounding = 4e-16;  // of a unit vector's component
constexpr double kMeridians[] = {0.0, 122.9 * deg, -77.0 * deg, kPi};

template <class F>
void everywhere(F f) {
  for (double lon0 : kMeridians)
    for (double lat : {-90.0, -89.9999999, -45.0, -1e-10, 0.0, 30.0, 85.0, 89.9999999, 90.0})
      for (double d : {-179.9999, -90.0, -89.99, -30.0, 0.0, 1e-12, 60.0, 135.0, 180.0})
        f(lat * deg, wrap_pi(lon0 + d * deg), lon0);
}

TEST(Transverse, ThereAndBackEverywhere) {  // polar.md 1.1
  everywhere([](double lat, double lon, double lon0) {
    const auto t = to_transverse(lat, lon, lon0);
    const auto n = normal_of(lat, lon);
    EXPECT_NEAR(norm(normal_of_transverse(t.tlat, t.tlon, lon0) - n), 0.0, 5e-16);
    EXPECT_NEAR(std::sin(t.tlat), std::cos(lat) * std::sin(lon - lon0), kRounding);
    const auto g = from_transverse(t.tlat, t.tlon, lon0);
    EXPECT_NEAR(norm(normal_of(g.lat, g.lon) - n), 0.0, 1e-15);
    EXPECT_GT(g.lon, -kPi);
    EXPECT_LE(g.lon, kPi);
    const auto u = to_transverse(n, lon0);
    EXPECT_NEAR(norm(normal_of_transverse(u.tlat, u.tlon, lon0) - n), 0.0, 5e-16);
  });
}

TEST(Transverse, ThePolesExactly) {
  for (double lon0 : kMeridians) {
    const auto north = to_transverse(kPi / 2, 0.3, lon0);
    EXPECT_EQ(north.tlat, 0.0);
    EXPECT_EQ(north.tlon, 0.0);
    const auto south = to_transverse(-kPi / 2, 0.3, lon0);
    EXPECT_EQ(south.tlat, 0.0);
    EXPECT_EQ(south.tlon, kPi);
    const auto g = from_transverse(0.0, 0.0, lon0);
    EXPECT_EQ(g.lat, kPi / 2);
    EXPECT_EQ(g.lon, wrap_pi(lon0));
    const auto pole = to_transverse(0.0, lon0 + kPi / 2, lon0);  // the transverse pole
    EXPECT_NEAR(pole.tlat, kPi / 2, 1e-15);
  }
}

TEST(Transverse, AxesAndConvergence) {  // polar.md 1.1, 1.2
  everywhere([](double lat, double lon, double lon0) {
    const auto t = to_transverse(lat, lon, lon0);
    const auto C_te = transverse_axes(t.tlat, t.tlon, lon0);
    const auto I = C_te * transpose(C_te);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) EXPECT_NEAR(I.m[i][j], i == j ? 1.0 : 0.0, 2 * kRounding);
    const auto C_ge = grid_axes(t.tlat, t.tlon, lon0);
    for (int j = 0; j < 3; ++j) {
      EXPECT_EQ(C_ge.m[0][j], C_te.m[1][j]);
      EXPECT_EQ(C_ge.m[1][j], -C_te.m[0][j]);
    }
    if (std::fabs(std::fabs(t.tlat) - kPi / 2) < 1e-3) return;  // sigma turns with l there
    // sigma from the matrices: transverse north in geographic components.
    const auto C_gt = geographic_axes(lat, lon) * transpose(C_te);
    const double sigma = std::atan2(C_gt.m[0][1], C_gt.m[1][1]);
    const double s = transverse_convergence(lat, lon, lon0);
    EXPECT_NEAR(wrap_pi(sigma - s), 0.0, 4e-15) << lat / deg << " " << lon / deg;
    // vE = vEt cos sigma + vNt sin sigma, heading = theading + sigma
    EXPECT_NEAR(C_gt.m[0][0], std::cos(s), 4e-15);
    EXPECT_NEAR(C_gt.m[1][0], -std::sin(s), 4e-15);
    if (std::cos(lat) > 1e-3) {
      EXPECT_NEAR(std::sin(s), std::sin(t.tlon) / std::cos(lat), 1e-12);
      EXPECT_NEAR(std::cos(s), -std::sin(t.tlat) * std::cos(t.tlon) / std::cos(lat), 1e-12);
    }
  });
  // On the reference meridian transverse north points east.
  EXPECT_NEAR(transverse_convergence(0.5, 122.9 * deg, 122.9 * deg), kPi / 2, 1e-15);
}

TEST(Curvature, GeographicAxesGiveTheRadii) {  // polar.md 2.1, 2.2
  for (const Ellipsoid& ell : {wgs84(), paper_sphere()})
    everywhere([&](double lat, double lon, double lon0) {
      const double h = 1234.0, s = std::sin(lat),
                   c = std::fabs(lat) >= kPi / 2 ? 0.0 : std::cos(lat);
      const double N = prime_vertical_radius(ell, s), M = meridian_radius(ell, s);
      const auto g = curvature(ell, 0.0, c, s, h);
      EXPECT_NEAR(g.xx * (N + h), 1.0, 1e-15);
      EXPECT_NEAR(g.yy * (M + h), 1.0, 2e-15);
      EXPECT_EQ(g.xy, 0.0);
      const auto t = to_transverse(lat, lon, lon0);
      const double sl = std::sin(t.tlon), cl = std::cos(t.tlon), sp = std::sin(t.tlat);
      const auto k = curvature(ell, -sl, -sp * cl, s, h);
      if (std::fabs(std::fabs(t.tlat) - kPi / 2) < 1e-3) return;
      const double sigma = transverse_convergence(lat, lon, lon0), ss = std::sin(sigma),
                   cs = std::cos(sigma);
      // 1e-15 / R: rounding of the direction cosines times the difference of the curvatures.
      const double tol = 4e-22;
      EXPECT_NEAR(k.xx, cs * cs / (N + h) + ss * ss / (M + h), tol);
      EXPECT_NEAR(k.xy, ss * cs * (1.0 / (N + h) - 1.0 / (M + h)), tol);
      EXPECT_NEAR(k.yy, ss * ss / (N + h) + cs * cs / (M + h), tol);
    });
}

TEST(Curvature, VirtualSphere) {  // polar.md 2.3: the same rates to 1e-18 rad/s
  const Ellipsoid& ell = wgs84();
  everywhere([&](double lat, double lon, double lon0) {
    const auto t = to_transverse(lat, lon, lon0);
    if (std::fabs(t.tlat) > 80 * deg) return;
    const double vE = 7.0, vN = -3.0, Rv = 6371000.0, h = 50.0;
    const double sl = std::sin(t.tlon), cl = std::cos(t.tlon), sp = std::sin(t.tlat);
    const auto k = curvature(ell, -sl, -sp * cl, std::sin(lat), h);
    const double rE = k.xx * vE + k.xy * vN, rN = k.xy * vE + k.yy * vN;
    // the virtual velocity from geographic components, on a sphere of any radius
    const double N = prime_vertical_radius(ell, std::sin(lat)),
                 M = meridian_radius(ell, std::sin(lat));
    const double sigma = transverse_convergence(lat, lon, lon0), c = std::cos(sigma),
                 s = std::sin(sigma);
    const double gE = (vE * c + vN * s) * Rv / (N + h), gN = (-vE * s + vN * c) * Rv / (M + h);
    const double uE = gE * c - gN * s, uN = gE * s + gN * c;
    EXPECT_NEAR(uN / Rv, rN, 1e-18);
    EXPECT_NEAR(uE / Rv, rE, 1e-18);
    EXPECT_NEAR(uE / Rv * std::tan(t.tlat), rE * std::tan(t.tlat), 5e-18);
  });
}

TEST(Curvature, AtThePoleASphereOfThePolarRadius) {  // polar.md 2.2
  const auto k = curvature(wgs84(), 0.0, 0.0, 1.0, 0.0);
  EXPECT_NEAR(1.0 / k.xx, 6399593.6, 0.05);
  EXPECT_EQ(k.xx, k.yy);
  EXPECT_EQ(k.xy, 0.0);
}

TEST(Attitude, EulerThereAndBack) {  // polar.md 0
  for (double h : {0.0, 1.0, 3.0, 6.0})
    for (double p : {-1.5, 0.0, 0.7})
      for (double r : {-3.0, 0.0, 1.0}) {
        const Euler<double> e{h, p, r};
        const auto b = to_euler(to_matrix<Geographic>(e));
        EXPECT_NEAR(b.heading, h, 1e-14);
        EXPECT_NEAR(b.pitch, p, 1e-14);
        EXPECT_NEAR(b.roll, r, 1e-14);
      }
  // forward axis: heading clockwise from north, bow up
  const auto c = to_matrix<Geographic>(Euler<double>{30 * deg, 10 * deg, 0.0});
  EXPECT_NEAR(c.m[0][1], std::sin(30 * deg) * std::cos(10 * deg), kRounding);
  EXPECT_NEAR(c.m[1][1], std::cos(30 * deg) * std::cos(10 * deg), kRounding);
  EXPECT_NEAR(c.m[2][1], std::sin(10 * deg), kRounding);
}

}  // namespace
}  // namespace loxo
