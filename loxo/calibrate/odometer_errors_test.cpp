// SPDX-License-Identifier: Apache-2.0
#include "loxo/calibrate/odometer_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "loxo/earth/projection.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "shared_folder.hpp"

namespace loxo {
namespace {

constexpr double kEarthRate = 7.292115e-5, kPaperRadius = 6378137.0;

// (V-30), (V-31) against differences of the exact projection: what is left out is of the order
// dlon^4 (and eta^2 dlon^2 of the ellipsoid).
TEST(OdometerErrors, PlaneErrorsAreTheDerivativesOfTheProjection) {
  const auto& ell = krassovsky();
  for (double lat : {-60.0, 0.0, 40.0, 75.0})
    for (double dlon : {-2.9, -1.0, 0.0, 1.0, 2.9}) {
      const double L = lat * deg, l = dlon * deg, h = 1e-5;
      const auto at = [&](double a, double b) { return gauss_forward<double>(ell, a, b, 0.0); };
      const auto n = at(L + h, l), s = at(L - h, l), e = at(L, l + h), w = at(L, l - h);
      const auto by_lat = gauss_position_error(ell, L, l, 1, 0);
      const auto by_lon = gauss_position_error(ell, L, l, 0, 1);
      const double R = ell.a, left = R * (l * l * l * l + ell.ep2 * l * l) + 1e-3;
      EXPECT_NEAR(by_lat.dx, (n.x - s.x) / (2 * h), left);
      EXPECT_NEAR(by_lat.dy, (n.y - s.y) / (2 * h), left * 1.0 + R * std::fabs(l) * ell.ep2);
      EXPECT_NEAR(by_lon.dx, (e.x - w.x) / (2 * h), left + R * std::fabs(l * l * l));
      EXPECT_NEAR(by_lon.dy, (e.y - w.y) / (2 * h), left);
    }
}

// (V-28), (V-29) against differences of (V-26), (V-27), in every quadrant.
TEST(OdometerErrors, ConstantsFollowTheReckonedEnd) {
  const double k0 = 0.01, s1 = 9000;
  for (double az = -175; az <= 180; az += 35) {
    const double n = 11000 * std::cos(az * deg), e = 11000 * std::sin(az * deg), h = 0.01;
    const auto scale = [&](double x, double y) { return k0 * s1 / std::hypot(x, y); };
    const auto alpha = [&](double x, double y) { return -std::atan2(y, x); };
    for (int axis = 0; axis < 2; ++axis) {
      const double dx = axis == 0 ? h : 0, dy = axis == 0 ? 0 : h;
      const PlaneError err{dx, dy};
      const auto c = chord_error(n, e, err);
      const double dk = (scale(n + dx, e + dy) - scale(n - dx, e - dy)) / 2;
      // Central differences: (h/S)^2 = 1e-12 of the value, and rounding of K0 (1e-18).
      EXPECT_NEAR(odometer_scale_error(k0, s1, n, e, err), dk, 1e-17) << az;
      EXPECT_NEAR(c.dk, dk / scale(n, e), 1e-14) << az;
      EXPECT_NEAR(c.dalpha,
                  std::remainder(alpha(n + dx, e + dy) - alpha(n - dx, e - dy), 2 * kPi) / 2, 1e-14)
          << az;
    }
  }
}

// SH15 tables 1 and 2: the coefficients of (V-32), (V-33), (V-34), (V-35) and (V-36) at 40 deg, 14
// m/s east and north.
TEST(OdometerErrors, TablesOneAndTwo) {
  const auto rows = testing::expected_rows("vehicle-expected.csv");
  if (rows.empty()) GTEST_SKIP() << "vehicle-expected.csv is not here";
  const auto f = reckoning_error_matrix(kPaperRadius, kEarthRate, 40 * deg, 14, 14);
  const char* const names[5] = {"phiE", "phiN", "phiU", "dL", "dlam"};
  const double sizes[5] = {0.5 * arcmin, 0.5 * arcmin, 3.6 * arcmin, 10 / kPaperRadius, 0};
  int seen = 0;
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t j = 0; j < 5; ++j) {
      const std::string id = std::string(names[i]) + "dot<-" + names[j];
      if (rows.count("S1-T1-" + id) == 0) {
        EXPECT_EQ(f[i][j], 0.0) << id << " is not in the table";
        continue;
      }
      ++seen;
      const auto& one = rows.at("S1-T1-" + id);
      EXPECT_NEAR(std::fabs(f[i][j]), one.value(), std::stod(one.tolerance)) << id;
      const auto& two = rows.at("S1-T2-" + id);
      EXPECT_NEAR(std::fabs(f[i][j]) * sizes[j], two.value(), std::stod(two.tolerance)) << id;
    }
  EXPECT_EQ(seen, 11);
  EXPECT_NEAR(0.01 * deg_per_h, rows.at("S1-T2-gyro").value(), 1e-12);
}

// SH15 table 4, the formulas (V-37), (V-38), and the angle random walk of (V-45).
TEST(OdometerErrors, TableFourByFormula) {
  const auto rows = testing::expected_rows("vehicle-expected.csv");
  if (rows.empty()) GTEST_SKIP() << "vehicle-expected.csv is not here";
  const double v = 20 / std::sqrt(2.0), t = 600;
  const auto drift = straight_drive_error(kPaperRadius, 40 * deg, v, v, 0, 0.01 * deg_per_h, t);
  const auto start = straight_drive_error(kPaperRadius, 40 * deg, v, v, 3.6 * arcmin, 0, t);
  EXPECT_NEAR(drift.constants.dalpha / deg, rows.at("S1-T4-fora-epsz").value(), 1e-8);
  EXPECT_NEAR(start.constants.dalpha / deg, rows.at("S1-T4-fora-phiU").value(), 1e-9);
  // What the table prints as dK is zero at first order: the error stands across the chord.
  for (const auto& e : {drift, start}) {
    EXPECT_EQ(e.constants.dk, 0.0);
    const PlaneError p{kPaperRadius * e.dlat, kPaperRadius * std::cos(40 * deg) * e.dlon};
    const auto c = chord_error(v * t, v * t, p);
    EXPECT_NEAR(c.dk, 0.0, 1e-15);
    EXPECT_NEAR(c.dalpha, e.constants.dalpha, 1e-14);
  }
  const CalibrationDrive drive{40 * deg, 45 * deg, 12000, 20, 0};
  OdometerSources s;
  s.gyro_noise = 0.001 * deg_per_sqrt_h;
  const auto b = odometer_budget(wgs84(), drive, s, HeadingModel::kMechanised);
  EXPECT_NEAR(b.eps / deg, 2.357e-4, 1e-6 * 0.24);  // N sqrt(T/3), the midpoint rule's 1e-6
}

// The whole chain and its simplified solution: they differ by what (V-37) leaves out, Earth rate
// and latitude over the drive.
TEST(OdometerErrors, SimplifiedSolutionIsTheChainWithoutTheSmallTerms) {
  for (double course : {0.0, 45.0, 130.0, 270.0}) {
    const CalibrationDrive drive{40 * deg, course * deg, 12000, 20, 0};
    const double T = drive.duration(), small = (kEarthRate + 20 / kPaperRadius) * T;
    const double ve = 20 * std::sin(course * deg), vn = 20 * std::cos(course * deg);
    for (int source = 0; source < 2; ++source) {
      const double gyro = source == 0 ? 5e-8 : 0, phi = source == 0 ? 0 : 1e-3;
      const auto x =
          propagate_reckoning_errors(drive, kPaperRadius, kEarthRate, {0, 0, gyro}, {0, 0, phi});
      const auto s = straight_drive_error(kPaperRadius, 40 * deg, ve, vn, phi, gyro, T);
      const double size = std::hypot(s.dlat, s.dlon);
      EXPECT_NEAR(x[3], s.dlat, small * size) << course;
      EXPECT_NEAR(x[4], s.dlon, small * size) << course;
    }
  }
}

// (V-41) against differences of exact dead reckoning along a curved track, heading and scale errors
// that change on the way.
TEST(OdometerErrors, TrackErrorRatesAreTheDerivativesOfDeadReckoning) {
  const auto& ell = wgs84();
  for (double lat : {-70.0, 0.0, 55.0, 84.0}) {
    const int n = 2000;
    const double ds = 10, h = 1e-5;
    const auto heading = [&](int i) { return 0.3 + 2.0 * i / n; };
    const auto dpsi = [&](int i) { return 1.0 + 0.5 * std::sin(0.01 * i); };
    const auto dlnk = [&](int i) { return 0.7 - 1.0 * i / n; };
    const auto end = [&](double size) {
      auto x = reckon_start(lat * deg, 0.1);
      for (int i = 0; i < n; ++i) {
        const double a = heading(i) + size * dpsi(i), d = ds * (1 + size * dlnk(i));
        step_exact(ell, x, d * std::cos(a), d * std::sin(a), 0.0);
      }
      return x;
    };
    double dm = 0, dlon = 0;
    auto x = reckon_start(lat * deg, 0.1);
    for (int i = 0; i < n; ++i) {
      auto mid = x;
      step_exact(ell, mid, 0.5 * ds * std::cos(heading(i)), 0.5 * ds * std::sin(heading(i)), 0.0);
      step_exact(ell, x, ds * std::cos(heading(i)), ds * std::sin(heading(i)), 0.0);
      const double half =
          dm + 0.5 * ds * track_error_rates(ell, mid.lat, heading(i), dm, dpsi(i), dlnk(i)).dm;
      const auto r = track_error_rates(ell, mid.lat, heading(i), half, dpsi(i), dlnk(i));
      dm += ds * r.dm;
      dlon += ds * r.dlon;
    }
    const auto up = end(h), down = end(-h);
    const double m = (meridian_arc(ell, up.lat) - meridian_arc(ell, down.lat)) / (2 * h);
    const double l = (up.lon - down.lon) / (2 * h);
    // Midpoint rule over 10 m: (ds tan/R)^2; differences: h^2 and 1e-8 m of the arc / h.
    EXPECT_NEAR(dm, m, 2e-3) << lat;
    EXPECT_NEAR(dlon, l, 1e-8 * std::fabs(l) + 1e-14 / h) << lat;
  }
}

TEST(OdometerErrors, BudgetNamesWhatLeadsAndWhatHelps) {
  const CalibrationDrive drive{40 * deg, 45 * deg, 11200, 20, 0.5};
  OdometerSources s;
  s.heading = 3.6 * arcmin;
  s.level = 0.5 * arcmin;
  s.gyro_bias = 0.01 * deg_per_h;
  s.gyro_noise = 0.001 * deg_per_sqrt_h;
  s.benchmark = 0.1;
  s.quantisation = 0.5;
  for (auto model : {HeadingModel::kMechanised, HeadingModel::kIndependent}) {
    const auto b = odometer_budget(wgs84(), drive, s, model);
    EXPECT_EQ(b.sources[b.leading_eps].name, "heading_alignment");
    // (V-45): an error of the initial azimuth goes into the angle one to one; Earth rate and
    // curvature over 600 s take at most w T = 4 % of it.
    EXPECT_NEAR(b.sources[b.leading_eps].eps, s.heading, 0.044 * s.heading);
    EXPECT_EQ(b.sources[b.leading_ln_k].name, "quantisation");
    EXPECT_NEAR(b.sources[b.leading_ln_k].ln_k, 0.5 / std::sqrt(6.0) / 11200, 1e-12);
    EXPECT_EQ(b.improvements[b.best_eps].change, "heading of the alignment twice as good");
    EXPECT_EQ(b.improvements[b.best_ln_k].change, "drive twice as long");
    EXPECT_NEAR(b.improvements[b.best_ln_k].ln_k, b.ln_k / 2, 0.02 * b.ln_k);
    // (V-38): the scale is immune to an azimuth error at first order; what the chain leaves is of
    // the order (w T)(D/R).
    for (const auto& x : b.sources)
      if (x.name == "heading_alignment") {
        EXPECT_LT(x.ln_k, s.heading * 0.044 * 11200 / 6.4e6) << static_cast<int>(model);
      }
  }
  s.heading = -1;
  EXPECT_THROW(odometer_budget(wgs84(), drive, s, HeadingModel::kMechanised), Error);
  s.heading = 0;
  CalibrationDrive polar = drive;
  polar.lat = 89.89 * deg;
  EXPECT_THROW(odometer_budget(wgs84(), polar, s, HeadingModel::kMechanised), Error);
}

}  // namespace
}  // namespace loxo
