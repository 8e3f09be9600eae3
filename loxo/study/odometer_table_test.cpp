// SPDX-License-Identifier: Apache-2.0
// SH15 tables 3 and 4 by simulation: the drive of vehicle.md 3.4 with one error at a time.
#include <gtest/gtest.h>

#include <cmath>

#include "loxo/calibrate/odometer_errors.hpp"
#include "loxo/calibrate/two_point.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/straight_drive.hpp"
#include "shared_folder.hpp"

namespace loxo {
namespace {

struct Found {
  double dk = 0, dalpha = 0;  // of K_D relative, of alpha [deg]
};
Found calibrated(ChordMethod method, const ReckoningErrors& errors, double meridian = 0) {
  const auto drive = sh15_drive();
  const auto e = simulate_straight_drive(wgs84(), drive, errors);
  const auto at = [&](double lat, double lon) {
    return chord(wgs84(), method, drive.lat, lat, lon - drive.lon, -meridian);
  };
  const auto r = two_point(at(e.lat2, e.lon2), at(e.lat3, e.lon3));
  // K_D = K_0/k, alpha = -eps.
  return {errors.k / r.k - 1, -(r.eps - errors.eps) / deg};
}
ReckoningErrors paper_errors() {
  ReckoningErrors e;
  e.k = 1.2;
  e.eps = -1 * deg;
  return e;
}

TEST(OdometerTable, TheDriveIsThePapers) {
  const auto d = sh15_drive();
  EXPECT_EQ(d.duration(), 600);
  EXPECT_EQ(d.distance(40), 400);
  EXPECT_EQ(d.distance(560), 10800);
  EXPECT_EQ(d.distance(600), 11200);
  EXPECT_EQ(d.velocity(300), 20);
}

TEST(OdometerTable, ErrorFreeRunByEveryChord) {
  const auto rows = testing::expected_rows("vehicle-expected.csv");
  if (rows.empty()) GTEST_SKIP() << "vehicle-expected.csv is not here";
  const struct {
    const char* id;
    ChordMethod method;
    double k, alpha, tk, ta;
  } cases[] = {{"S1-T3-base-gauss", ChordMethod::kGauss, -7.95e-8, 7.0e-6, 2e-9, 5e-7},
               {"S1-T3-base-geod", ChordMethod::kGeodesic, 2.06e-8, 5.1e-7, 2e-9, 5e-7},
               {"S1-T3-base-rhumb", ChordMethod::kRhumb, 3.0e-9, -5.346e-3, 2e-9, 1e-5},
               {"S1-T3-base-start", ChordMethod::kStartLatitude, -4.57e-5, -8.669e-3, 1e-7, 1e-5}};
  for (const auto& c : cases) {
    const auto f = calibrated(c.method, paper_errors());
    const std::string& ours = rows.at(c.id).ours;  // "dK ; dalpha"
    EXPECT_NEAR(f.dk, std::stod(ours), c.tk) << c.id;
    EXPECT_NEAR(f.dalpha, std::stod(ours.substr(ours.find(';') + 1)), c.ta) << c.id;
  }
  // "geometry dependent: meridian 1 deg east +1.43e-6 ; -9.73e-5, 2.9 deg east +4.40e-6 ; -2.90e-4"
  const auto one = calibrated(ChordMethod::kGauss, paper_errors(), 1 * deg);
  EXPECT_NEAR(one.dk, 1.43e-6, 1e-8);
  EXPECT_NEAR(one.dalpha, -9.73e-5, 5e-7);
  const auto far = calibrated(ChordMethod::kGauss, paper_errors(), 2.9 * deg);
  EXPECT_NEAR(far.dk, 4.40e-6, 1e-8);
  EXPECT_NEAR(far.dalpha, -2.90e-4, 1e-6);
}

TEST(OdometerTable, TablesThreeAndFourByOneErrorAtATime) {
  const auto rows = testing::expected_rows("vehicle-expected.csv");
  if (rows.empty()) GTEST_SKIP() << "vehicle-expected.csv is not here";
  const auto base = calibrated(ChordMethod::kGauss, paper_errors());
  const double drift = 0.01 * deg_per_h;
  const auto meet = [&](const std::string& id, const ReckoningErrors& e) {
    const auto f = calibrated(ChordMethod::kGauss, e);
    const auto& a = rows.at("S1-T3-" + id + "-alpha");
    const auto& k = rows.at("S1-T3-" + id + "-K");
    EXPECT_NEAR(f.dalpha - base.dalpha, a.value(), std::stod(a.tolerance)) << id;
    EXPECT_NEAR(f.dk - base.dk, k.value(), std::stod(k.tolerance)) << id;
    return Found{f.dk - base.dk, f.dalpha - base.dalpha};
  };
  ReckoningErrors e = paper_errors(), all = e;
  e.gyro_bias.x = all.gyro_bias.x = drift;
  meet("eps_x", e);
  e = paper_errors();
  e.gyro_bias.y = all.gyro_bias.y = drift;
  meet("eps_y", e);
  e = paper_errors();
  e.gyro_bias.z = all.gyro_bias.z = drift;
  const auto z = meet("eps_z", e);
  e = paper_errors();
  e.phi_e = all.phi_e = 0.5 * arcmin;
  meet("phiE0", e);
  e = paper_errors();
  e.phi_n = all.phi_n = 0.5 * arcmin;
  meet("phiN0", e);
  e = paper_errors();
  e.phi_u = all.phi_u = 3.6 * arcmin;
  const auto u = meet("phiU0", e);
  meet("all", all);
  // Table 4 is the same drive beside the formulas.
  for (const auto& [id, value] : {std::pair<const char*, double>{"S1-T4-simK-epsz", z.dk},
                                  {"S1-T4-simK-phiU", u.dk},
                                  {"S1-T4-sima-epsz", z.dalpha},
                                  {"S1-T4-sima-phiU", u.dalpha}})
    EXPECT_NEAR(value, rows.at(id).value(), std::stod(rows.at(id).tolerance)) << id;
  for (const char* id : {"S1-T4-forK-epsz", "S1-T4-forK-phiU"})  // zero at first order (V-38)
    EXPECT_NEAR(id[12] == 'e' ? z.dk : u.dk, 0.0, std::stod(rows.at(id).tolerance)) << id;
}

// The linear chain (V-32) to (V-36) with (V-28) to (V-31) against the same drive simulated: first
// order in errors of 1e-4, the sphere for the ellipsoid (1/300), k and eps left out of it.
TEST(OdometerTable, ChainAgreesWithTheSimulatedDrive) {
  const double arw = 0.001 * deg_per_sqrt_h;
  for (double course : {10.0, 45.0, 200.0, 300.0}) {
    auto drive = sh15_drive();
    drive.course = course * deg;
    const auto simulated = [&](const ReckoningErrors& errors) {
      const auto e = simulate_straight_drive(wgs84(), drive, errors);
      const auto r = calibrate_two_point(wgs84(), ChordMethod::kGeodesic,
                                         {drive.lat, drive.lon, e.lat2, e.lon2, e.lat3, e.lon3});
      return r.value.eps;
    };
    const double none = simulated({});
    OdometerSources only;
    const CalibrationDrive c{drive.lat, drive.course, drive.length, drive.speed,
                             drive.acceleration};
    ReckoningErrors e;
    e.phi_u = only.heading = 3.6 * arcmin;
    EXPECT_NEAR(simulated(e) - none,
                odometer_budget(wgs84(), c, only, HeadingModel::kMechanised).eps, 0.005 * e.phi_u)
        << course;
    e = {};
    only = {};
    e.gyro_bias.z = 0.01 * deg_per_h;
    only.gyro_bias = e.gyro_bias.z;
    const auto b = odometer_budget(wgs84(), c, only, HeadingModel::kMechanised);
    for (const auto& s : b.sources)
      if (s.name == "gyro_up") {
        EXPECT_NEAR(std::fabs(simulated(e) - none), s.eps, 0.005 * s.eps) << course;
      }
  }
  // S1-ARW: sd of alpha over runs, 2.357e-4 by formula for constant speed.
  const int runs = 120;
  double sum = 0, square = 0;
  auto drive = sh15_drive();
  drive.interval = 1;
  for (int i = 0; i < runs; ++i) {
    auto errors = paper_errors();
    errors.gyro_noise = arw;
    errors.trial = static_cast<std::uint64_t>(i);
    const auto e = simulate_straight_drive(wgs84(), drive, errors);
    const auto r = calibrate_two_point(wgs84(), ChordMethod::kGauss,
                                       {drive.lat, drive.lon, e.lat2, e.lon2, e.lat3, e.lon3});
    const double x = (r.value.eps - errors.eps) / deg;
    sum += x;
    square += x * x;
  }
  const double sd = std::sqrt((square - sum * sum / runs) / (runs - 1));
  OdometerSources only;
  only.gyro_noise = arw;
  const CalibrationDrive c{drive.lat, drive.course, drive.length, drive.speed, drive.acceleration};
  const double formula = odometer_budget(wgs84(), c, only, HeadingModel::kMechanised).eps / deg;
  EXPECT_NEAR(formula, 2.357e-4, 0.05 * 2.357e-4);
  // Four sigma of a standard deviation of 120 draws.
  EXPECT_NEAR(sd / formula, 1.0, 4.0 / std::sqrt(2.0 * runs));
}

}  // namespace
}  // namespace loxo
