// SPDX-License-Identifier: Apache-2.0
// `loxo calibrate DRIVE` as a user runs it: vehicle.md sections 2 to 5 on tracks written by the
// test.
#include <gtest/gtest.h>

#include <cmath>

#include "loxo/earth/rhumb.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo {
namespace {

using testing::run;
using testing::scratch_folder;

// A drive of `legs` (course, steps of 20 m) recorded with k and eps (V-5); benchmarks after each
// leg's end, known to `std`.
std::string drive(const std::string& name, double lat, double lon,
                  const std::vector<std::pair<double, int>>& legs, double k, double eps,
                  const std::string& std = "0.1 m") {
  const std::string folder = scratch_folder() + "/" + name;
  std::filesystem::create_directories(folder);
  std::ofstream track(folder + "/track.csv"), toml(folder + "/drive.toml");
  track.precision(17);
  toml.precision(17);
  track << "t_s,ds_m,heading_deg\n";
  toml << "format = 1\nname = \"" << name << "\"\n[track]\nfile = \"track.csv\"\n"
       << "columns = { time = \"t_s\", distance = \"ds_m\", heading = \"heading_deg\" "
          "}\nheading_model = \"independent\"\n";
  int row = 0;
  const auto benchmark = [&](const std::string& n) {
    toml << "[[benchmark]]\nname = \"" << n << "\"\nafter_row = " << row
         << "\nlat_deg = " << lat / deg << "\nlon_deg = " << lon / deg << "\nstd = \"" << std
         << "\"\n";
  };
  lat *= deg;
  lon *= deg;
  benchmark("A");
  for (const auto& [course, steps] : legs) {
    for (int i = 0; i < steps; ++i) {
      const auto next = rhumb_direct(wgs84(), lat, lon, course * deg, 20.0);
      lat = next.lat;
      lon = next.lon;
      double heading = course + eps;
      heading -= 360.0 * std::floor(heading / 360.0);
      track << ++row << ',' << 20.0 * k << ',' << heading << '\n';
    }
    benchmark(std::string(1, static_cast<char>('B' + (&course - &legs[0].first) / 2 % 20)));
  }
  return folder;
}

// Replay is exact for any route (V-39, V-40); the chord methods are wrong by (V-21) on a bent one;
// the goals of section 10.
TEST(CalibrateDrive, ReplayAndLeastSquaresFindTheConstantsOfBentRoutesEverywhere) {
  const struct {
    const char* name;
    double lat, lon, k, eps;
  } cases[] = {{"mid", 55, 110, 1.02, 1},
               {"line", -40, 179.99, 1.2, 92.5},
               {"equator", -0.01, 0, 0.7, -120},
               {"high", 88, 20, 1.05, 3}};
  for (const auto& c : cases) {
    const auto folder = drive(c.name, c.lat, c.lon, {{30, 300}, {110, 200}, {60, 100}}, c.k, c.eps);
    const auto o = run("calibrate " + folder + " --json");
    ASSERT_EQ(o.exit_code, 0) << o.err;
    const auto j = parse_json(o.out, c.name);
    for (const char* method : {"replay", "least_squares"}) {
      const auto& m = j["methods"][method];
      ASSERT_TRUE(m["valid"].get<bool>()) << c.name << method << m["why"];
      // 1e-11 + 2e-7 m over the chord of 8 km, and the rounding of degrees in the files (1e-14 deg
      // of 180).
      EXPECT_NEAR(m["k"].get<double>(), c.k, 1e-10) << c.name << method;
      EXPECT_NEAR(m["eps_deg"].get<double>(), c.eps, 1e-8) << c.name << method;
    }
    const double bend = j["methods"]["rhumb"]["k"].get<double>() - c.k;
    const double predicted = j["methods"]["rhumb"]["route_bias_k"].get<double>();
    if (std::fabs(c.lat) > 1 && c.lat < 80) {
      EXPECT_NEAR(bend, predicted, 0.1 * std::fabs(predicted) + 1e-7) << c.name;  // (V-21)
    }
    EXPECT_EQ(j["recommended"], "least_squares");
    EXPECT_EQ(j["methods"]["least_squares"]["dof"].get<int>(), 4);
  }
}

// (V-44), (V-45): both ends known to s, chord D: sqrt(2) s/D in ln k and in eps.
TEST(CalibrateDrive, StatedErrorsAreThoseOfTheBenchmarks) {
  const auto folder = drive("straight", 50, 7, {{45, 500}}, 1.0, 0.0);
  const auto j = parse_json(run("calibrate " + folder + " --json").out, "straight");
  for (const char* method : {"replay", "rhumb", "least_squares"}) {
    EXPECT_NEAR(j["methods"][method]["k_std"].get<double>(), std::sqrt(2.0) * 0.1 / 1e4, 1e-8)
        << method;
    EXPECT_NEAR(j["methods"][method]["eps_std_deg"].get<double>() * deg, std::sqrt(2.0) * 0.1 / 1e4,
                1e-8)
        << method;
  }
  EXPECT_EQ(j["recommended"], "replay");
  EXPECT_NEAR(j["chord_m"].get<double>(), 1e4, 1e-3);
}

TEST(CalibrateDrive, CertificateIsWrittenAndHeldAgainstALaterDrive) {
  const auto first = drive("first", 50, 7, {{45, 500}}, 1.01, 0.5);
  const auto same = drive("same", 50, 7, {{120, 500}}, 1.01, 0.5);
  const auto worn = drive("worn", 50, 7, {{120, 500}}, 1.0125, 0.5);
  const std::string cert = scratch_folder() + "/first.json";
  ASSERT_EQ(run("calibrate " + first + " -o " + cert).exit_code, 0);
  const auto j = parse_json(testing::slurp(cert), "certificate");
  EXPECT_NEAR(j["k"].get<double>(), 1.01, 1e-9);
  EXPECT_EQ(j["input_hash"].get<std::string>().size(), 16u);
  const auto ok = parse_json(run("calibrate " + same + " --json --against " + cert).out, "same");
  EXPECT_FALSE(ok["against"]["drifted"].get<bool>());
  const auto bad = parse_json(run("calibrate " + worn + " --json --against " + cert).out, "worn");
  EXPECT_TRUE(bad["against"]["drifted"].get<bool>());
}

TEST(CalibrateDrive, WhatCannotBeFoundIsSaid) {
  const auto loop = drive("loop", 50, 7, {{0, 100}, {90, 100}, {180, 100}, {270, 100}}, 1.01, 0.5);
  const auto o = run("calibrate " + loop + " --json --method replay");
  EXPECT_EQ(o.exit_code, 1);
  EXPECT_NE(o.err.find("replay"), std::string::npos) << o.err;
  const auto all = run("calibrate " + loop + " --json");
  EXPECT_EQ(all.exit_code, 0) << all.err;
  EXPECT_EQ(parse_json(all.out, "loop")["recommended"], "least_squares");
  EXPECT_EQ(run("calibrate " + loop + " --method rumb").exit_code, 2);
  EXPECT_EQ(run("calibrate " + scratch_folder() + "/no_such_drive").exit_code, 3);
}

// A drive with everything that --estimate finds, in the file as a user has it: rows of `ds` m on
// courses, heading = course + eps + drift t_s, pitch = slope + mounting, benchmarks at a point of
// the body, the start given wrongly by `offset` m north. Nothing else errs.
std::string full_drive(const std::string& name, double lat, double t0, double drift_deg_h,
                       double pitch_deg, double right, double forward, double offset) {
  const std::string folder = scratch_folder() + "/" + name;
  std::filesystem::create_directories(folder);
  std::ofstream track(folder + "/track.csv"), toml(folder + "/drive.toml");
  track.precision(17);
  toml.precision(17);
  track << "t_s,ds_m,heading_deg,pitch_deg\n";
  toml << "format = 1\nname = \"full\"\n[track]\nfile = \"track.csv\"\ncolumns = { time = "
          "\"t_s\", distance = \"ds_m\", heading = \"heading_deg\", pitch = \"pitch_deg\" "
          "}\nheading_model = \"independent\"\n";
  const Ellipsoid& ell = wgs84();
  double at_lat = lat * deg, at_lon = 179.999 * deg, up = 0;
  int row = 0;
  const auto benchmark = [&](double course) {
    const double c = course * deg;
    const double n = forward * std::cos(c) - right * std::sin(c) + (row == 0 ? -offset : 0.0),
                 e = forward * std::sin(c) + right * std::cos(c);
    const auto point = rhumb_direct(ell, at_lat, at_lon, std::atan2(e, n), std::hypot(n, e));
    toml << "[[benchmark]]\nname = \"P" << row << "\"\nafter_row = " << row
         << "\nlat_deg = " << point.lat / deg << "\nlon_deg = " << point.lon / deg
         << "\nh_m = " << up << "\nstd = \"0.01 m\"\n";
  };
  benchmark(20);
  for (const double course : {20., 20., 110., 110., 250., 250., 330., 20., 20.}) {
    for (int i = 0; i < 60; ++i) {
      const double slope = 0.03 * std::sin(0.05 * row);
      const auto next = rhumb_direct(ell, at_lat, at_lon, course * deg, 15.0 * std::cos(slope));
      at_lat = next.lat;
      at_lon = next.lon;
      up += 15.0 * std::sin(slope);
      ++row;
      const double t = t0 + row;
      track << t << ',' << 15.0 * 1.02 << ',' << course + 1.5 + drift_deg_h / 3600 * t << ','
            << slope / deg + pitch_deg << '\n';
    }
    // Passed with the next leg's heading already half taken: only in the middle of a leg does the
    // body point along it.
    for (int i = 0; i < 3; ++i) {
      const auto next = rhumb_direct(ell, at_lat, at_lon, course * deg, 15.0);
      at_lat = next.lat;
      at_lon = next.lon;
      ++row;
      const double t = t0 + row;
      track << t << ',' << 15.0 * 1.02 << ',' << course + 1.5 + drift_deg_h / 3600 * t << ','
            << pitch_deg << '\n';
      if (i == 1) benchmark(course);
    }
  }
  return folder;
}

// interface.md: heading_i - drift t_i with the row's own t_s. Tolerances: 1 mm over the ways of
// some km, the lever arm's own millimetre.
TEST(CalibrateDrive, FurtherStatesAreFoundTogether) {
  for (const auto& [name, lat, t0] :
       {std::tuple{"equator", 0.0, 0.0}, std::tuple{"north", 60.0, 40000.0},
        std::tuple{"south", -75.0, 4e5}}) {
    const auto folder = full_drive(std::string("full_") + name, lat, t0, 4.0, 0.8, 0.7, 2.5, 12.0);
    const auto o = run("calibrate " + folder +
                       " --json --method least_squares --estimate "
                       "heading_drift,pitch_mounting,lever_arm,start_offset");
    ASSERT_EQ(o.exit_code, 0) << o.err;
    const auto m = parse_json(o.out, name)["methods"]["least_squares"];
    ASSERT_TRUE(m["valid"].get<bool>()) << m["why"];
    EXPECT_NEAR(m["k"].get<double>(), 1.02, 1e-6) << name;
    EXPECT_NEAR(m["heading_drift_deg_h"].get<double>(), 4.0, 1e-3) << name;
    EXPECT_NEAR(m["pitch_mounting_deg"].get<double>(), 0.8, 1e-4) << name;
    EXPECT_NEAR(m["lever_arm_right_m"].get<double>(), 0.7, 2e-3) << name;
    EXPECT_NEAR(m["lever_arm_forward_m"].get<double>(), 2.5, 2e-3) << name;
    EXPECT_NEAR(m["start_offset_north_m"].get<double>(), 12.0, 2e-3) << name;
    EXPECT_NEAR(m["start_offset_east_m"].get<double>(), 0.0, 2e-3) << name;
    // The angle belongs to t_s = 0.
    EXPECT_NEAR(m["eps_deg"].get<double>(), 1.5, 1e-4 + 1e-3 / 3600 * t0) << name;
    EXPECT_GT(m["heading_drift_std_deg_h"].get<double>(), 0) << name;
  }
  // In words, for people.
  const auto text =
      run("calibrate " + scratch_folder() +
          "/full_north --estimate heading_drift,pitch_mounting,lever_arm,start_offset");
  EXPECT_NE(text.out.find("heading drift 4"), std::string::npos) << text.out;
  // Not estimated, the same drive does not fit: chi2 says so.
  const auto poor = parse_json(
      run("calibrate " + scratch_folder() + "/full_north --json --method least_squares").out, "");
  EXPECT_GT(poor["methods"]["least_squares"]["chi2"].get<double>(), 1000.0);
}

TEST(CalibrateDrive, StatesThatCannotBeFoundAreNamed) {
  const auto folder = drive("straight_states", 50, 7, {{45, 200}, {45, 300}}, 1.0, 0.0);
  const auto o = run("calibrate " + folder + " --method least_squares --estimate lever_arm");
  EXPECT_EQ(o.exit_code, 1);
  EXPECT_NE(o.err.find("lever arm"), std::string::npos) << o.err;
  EXPECT_NE(o.err.find("heading at a benchmark must differ"), std::string::npos) << o.err;
  const auto few =
      run("calibrate " + folder + " --method least_squares --estimate heading_drift,start_offset");
  EXPECT_EQ(few.exit_code, 1);
  EXPECT_NE(few.err.find("5 unknowns and 4 equations"), std::string::npos) << few.err;
  EXPECT_EQ(run("calibrate " + folder + " --estimate pitch").exit_code, 2);
}

}  // namespace
}  // namespace loxo
