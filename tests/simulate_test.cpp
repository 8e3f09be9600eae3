// SPDX-License-Identifier: Apache-2.0
// `loxo simulate`: what it writes reads back, and error-free it navigates home.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "loxo/ins/strapdown.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/study/scenario.hpp"
#include "program.hpp"

namespace loxo::testing {
namespace {

TEST(Simulate, ListNamesTheScenariosThatStandInTheExamples) {
  const Outcome list = run("simulate --list");
  ASSERT_EQ(list.exit_code, 0) << list.err;
  std::size_t files = 0;
  for (const auto& s : ready_scenarios()) {
    EXPECT_NE(list.out.find(s.name), std::string::npos) << s.name;
    EXPECT_EQ(slurp(std::string(source_folder()) + "/examples/scenarios/" + s.name + ".toml"),
              s.toml)
        << s.name;
  }
  for (const auto& f :
       std::filesystem::directory_iterator(std::string(source_folder()) + "/examples/scenarios"))
    files += f.path().extension() == ".toml";
  EXPECT_EQ(files, ready_scenarios().size());
}

TEST(Simulate, WhatCannotBeIsRefusedWithTheNearestName) {
  const std::string out = scratch_folder() + "/no-drive";
  const Outcome name = run("simulate straigt-road -o " + out);
  EXPECT_EQ(name.exit_code, 2);
  EXPECT_NE(name.err.find("straight-road"), std::string::npos) << name.err;
  const Outcome key = run("simulate straight-road --set imu.gyr_bias='\"1 deg/h\"' -o " + out);
  EXPECT_EQ(key.exit_code, 3);
  EXPECT_NE(key.err.find("gyro_bias"), std::string::npos) << key.err;
  EXPECT_EQ(run("simulate straight-road --set imu.gyro_bias='\"1 deg/hh\"' -o " + out).exit_code,
            3);
  EXPECT_EQ(run("simulate straight-road --set imu.gyro_bias=1 -o " + out).exit_code, 3);
  EXPECT_EQ(run("simulate straight-road").exit_code, 2);
  EXPECT_EQ(run("simulate").exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(Simulate, TheSameSeedIsTheSameDrive) {
  const std::string a = scratch_folder() + "/seed-a", b = scratch_folder() + "/seed-b",
                    c = scratch_folder() + "/seed-c";
  ASSERT_EQ(run("simulate straight-road --seed 5 -o " + a).exit_code, 0);
  ASSERT_EQ(run("simulate straight-road --seed 5 -o " + b).exit_code, 0);
  ASSERT_EQ(run("simulate straight-road --seed 6 -o " + c).exit_code, 0);
  EXPECT_EQ(slurp(a + "/imu.csv"), slurp(b + "/imu.csv"));
  EXPECT_NE(slurp(a + "/imu.csv"), slurp(c + "/imu.csv"));
}

// 1e-3 m in ten minutes: the wanted closure of an error-free drive that is written, read back and
// navigated in ECEF.
TEST(Simulate, ErrorFreeTheDriveNavigatesBackToItsReference) {
  for (const std::string name :
       {"over-the-pole", "city-drive", "around-the-pole", "south-pole", "antimeridian"}) {
    const std::string folder = scratch_folder() + "/exact-" + name;
    const Outcome made =
        run("simulate " + name +
            " --set imu.gyro_bias='\"0 deg/h\"' --set imu.gyro_noise='\"0 deg/sqrt(h)\"' --set "
            "imu.accel_bias='\"0 ug\"' --set imu.accel_noise='\"0 ug/sqrt(Hz)\"' -o " +
            folder);
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const Drive drive = read_drive(folder);
    Diagnostics diagnostics;
    const EarthModel earth = make_earth_model(drive.ellipsoid);
    const auto& s = drive.start;
    auto x =
        EcefMechanization::from_ecef(earth, EcefState<double>{{s.r[0], s.r[1], s.r[2]},
                                                              {s.v[0], s.v[1], s.v[2]},
                                                              {s.q[0], s.q[1], s.q[2], s.q[3]}});
    ImuReader reader(drive, diagnostics);
    ImuIncrement<double> u, before;
    for (bool first = true; reader.next(u); first = false, before = u)
      x = step<EcefMechanization>(earth, x, first ? one_sample(u) : one_sample(before, u));
    const auto end = read_reference(drive, diagnostics).rows.back();
    EXPECT_NEAR(end.t, u.t, 1e-9) << name;
    EXPECT_LT(std::hypot(x.position.r.x - end.x, x.position.r.y - end.y, x.position.r.z - end.z),
              1e-3)
        << name;
    EXPECT_FALSE(read_track(drive, diagnostics).empty()) << name;
  }
}

TEST(Simulate, ATrueCourseThroughThePoleIsRefused) {
  const std::string file = scratch_folder() + "/through.toml", out = scratch_folder() + "/through";
  std::ofstream(file)
      << "[start]\nlat_deg = 89.99\nlon_deg = 0\ncourse = \"0 deg\"\nspeed = \"20 m/s\"\n"
         "[[leg]]\nduration = \"100 s\"\npath = \"course\"\n";
  const Outcome refused = run("simulate " + file + " -o " + out);
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.err.find("straight"), std::string::npos) << refused.err;
  EXPECT_FALSE(std::filesystem::exists(out));
}

// interface.md, "Signs and words": k = indicated / true distance, eps = indicated course - true
// course.
TEST(Simulate, TheTrackSaysTrueDistanceTimesKAndCoursePlusEps) {
  for (const std::string kind : {"distance", "pulses"}) {
    const std::string folder = scratch_folder() + "/track-" + kind;
    ASSERT_EQ(run("simulate straight-road --set odometer.k=1.2 --set odometer.scale_noise=0 --set "
                  "odometer.kind='\"" +
                  kind +
                  "\"' --set attitude.heading_bias='\"0 deg\"' --set attitude.heading_noise='\"0 "
                  "deg/sqrt(h)\"' --set "
                  "mounting.heading='\"-2 deg\"' -o " +
                  folder)
                  .exit_code,
              0);
    const Drive drive = read_drive(folder);
    Diagnostics diagnostics;
    const auto track = read_track(drive, diagnostics);
    double way = 0;
    for (const auto& s : track) way += s.ds;
    // 11400 m: 540 s of 20 m/s and two halves of 30 s; a pulse is 0.01 m.
    EXPECT_NEAR(way, 1.2 * 11400, kind == "pulses" ? 0.011 : 1e-6);
    ASSERT_FALSE(track.empty());
    // At 20 m/s and 45 N a tenth of a second's way turns the meridian by 1e-5 deg at most.
    EXPECT_NEAR(track.front().heading / 0.017453292519943295, 33, 1e-5);
    EXPECT_EQ(drive.benchmarks.size(), 2u);
  }
}

// polar.md 6, [F2]: 24 h at 89.9 N with constant errors, no noise: position error at most 3.21 km.
TEST(Simulate, TheStaticDayNearThePoleErrsAsPublished) {
  const std::string folder = scratch_folder() + "/f2", solution = scratch_folder() + "/f2.csv";
  ASSERT_EQ(run("simulate liu-f2 --set imu.gyro_noise='\"0 deg/sqrt(h)\"' --set "
                "imu.accel_noise='\"0 ug/sqrt(Hz)\"' -o " +
                folder)
                .exit_code,
            0);
  const Outcome done =
      run("navigate " + folder +
          " --mode inertial --frame transverse --vertical ship --output-rate 0.1Hz -o " + solution);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  auto found = columns(slurp(solution)), stood = columns(slurp(folder + "/reference.csv"));
  double most = 0;
  for (std::size_t i = 0; i < found["x_m"].size(); ++i) {
    double d[3];
    int j = 0;
    for (const char* axis : {"x_m", "y_m", "z_m"})
      d[j++] = number(found[axis][i]) - number(stood[axis][0]);
    most = std::max(most, std::hypot(d[0], d[1], d[2]));
  }
  constexpr double kPrinted = 10;  // the published maximum is given to 10 m
  EXPECT_NEAR(most, 3210, kPrinted);
}

}  // namespace
}  // namespace loxo::testing
