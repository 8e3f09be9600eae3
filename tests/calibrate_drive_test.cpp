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

}  // namespace
}  // namespace loxo
