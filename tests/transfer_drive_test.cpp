// SPDX-License-Identifier: Apache-2.0
// `loxo transfer DRIVE`: a real drive to the pole and home again.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "program.hpp"
#include "shared_folder.hpp"

namespace loxo::testing {
namespace {

const std::string kDrive = std::string(source_folder()) + "/examples/drives/kingston2008_a";

TEST(TransferDrive, ToThePoleAndHomeAgain) {
  if (shared_folder("data").empty()) GTEST_SKIP() << "no shared/data";
  ::setenv("LOXO_DATA", shared_folder("data").c_str(), 1);
  const std::string polar = scratch_folder() + "/polar", home = scratch_folder() + "/home";
  const Outcome to =
      run("transfer " + kDrive + " --angle 45.77deg --meridian -76.5deg -o " + polar);
  ASSERT_EQ(to.exit_code, 0) << to.err;
  EXPECT_TRUE(std::filesystem::exists(polar + "/drive.toml"));
  const auto p = columns(slurp(polar + "/reference.csv"));
  EXPECT_GT(number(p.at("lat_deg").back()), 89.9);
  const Outcome back =
      run("transfer " + polar + " --angle -45.77deg --meridian -76.5deg -o " + home);
  ASSERT_EQ(back.exit_code, 0) << back.err;
  const auto h = columns(slurp(home + "/reference.csv"));
  const auto given = columns(slurp(shared_folder("data") + "/kingston2008_a/reference.csv"));
  for (std::size_t i : {std::size_t{0}, std::size_t{700}, given.at("lat_deg").size() - 1}) {
    // 1e-9 m of rounding each way
    EXPECT_NEAR(number(h.at("lat_deg")[i]), number(given.at("lat_deg")[i]), 1e-12);
    EXPECT_NEAR(number(h.at("lon_deg")[i]), number(given.at("lon_deg")[i]), 1e-12);
    EXPECT_NEAR(
        std::remainder(number(h.at("heading_deg")[i]) - number(given.at("heading_deg")[i]), 360.0),
        0.0, 1e-9);
  }
}

TEST(TransferDrive, WhatCannotBeIsRefusedAndLeavesNoFile) {
  if (shared_folder("data").empty()) GTEST_SKIP() << "no shared/data";
  ::setenv("LOXO_DATA", shared_folder("data").c_str(), 1);
  const std::string out = scratch_folder() + "/nothing";
  const std::string base = "transfer " + kDrive + " -o " + out + " --angle 45.77deg ";
  // The track near the transverse pole of a meridian 90 deg away on the equator is far; at 45 N a
  // meridian 90 deg beside gives 44 deg: usable. Refusals: the sphere on an ellipsoid, no meridian,
  // unknown words.
  EXPECT_EQ(run(base + "--meridian -76.5deg --earth sphere").exit_code, 2);
  EXPECT_EQ(run(base).exit_code, 2);
  EXPECT_EQ(run(base + "--meridian -76.5deg --keep both").exit_code, 2);
  EXPECT_EQ(run("transfer /nowhere -o " + out + " --angle 1deg --meridian 0deg").exit_code, 3);
  EXPECT_FALSE(std::filesystem::exists(out));
}

// A simulated drive whose slow sensors say exactly what its reference says: moved, they must say
// what the moved reference says.
struct SlowDrive {
  std::string folder;
  explicit SlowDrive(const std::string& name) : folder(scratch_folder() + "/" + name) {
    EXPECT_EQ(run("simulate city-drive --quiet -o " + folder +
                  " --set imu.rate=20Hz --set reference.rate=1Hz")
                  .exit_code,
              0);
    const auto r = columns(slurp(folder + "/reference.csv"));
    std::ofstream fix(folder + "/fix.csv"), att(folder + "/attitude.csv"),
        vel(folder + "/velocity.csv"), head(folder + "/heading.csv"),
        height(folder + "/height.csv"), track(folder + "/track.csv");
    fix << "t_s,lat_deg,lon_deg,h_m,ve_mps,vn_mps,vu_mps\n";
    att << "t_s,heading_deg,pitch_deg,roll_deg\n";
    vel << "t_s,ve_mps,vn_mps,vu_mps\n";
    head << "t_s,heading_deg\n";
    height << "t_s,h_m,vu_mps\n";
    track << "t_s,ds_m,heading_deg\n";
    for (std::size_t i = 0; i < r.at("t_s").size(); ++i) {
      const auto c = [&](const char* name_) { return r.at(name_)[i]; };
      fix << c("t_s") << ',' << c("lat_deg") << ',' << c("lon_deg") << ',' << c("h_m") << ','
          << c("ve_mps") << ',' << c("vn_mps") << ',' << c("vu_mps") << '\n';
      att << c("t_s") << ',' << c("heading_deg") << ',' << c("pitch_deg") << ',' << c("roll_deg")
          << '\n';
      vel << c("t_s") << ',' << c("ve_mps") << ',' << c("vn_mps") << ',' << c("vu_mps") << '\n';
      head << c("t_s") << ',' << c("heading_deg") << '\n';
      height << c("t_s") << ',' << c("h_m") << ',' << c("vu_mps") << '\n';
      if (i > 0) track << c("t_s") << ",10," << c("heading_deg") << '\n';
    }
    std::string toml = slurp(folder + "/drive.toml");
    toml = toml.substr(0, toml.find("[[benchmark]]"));
    toml += R"([velocity]
file = "velocity.csv"
columns = { time = "t_s", east = "ve_mps", north = "vn_mps", up = "vu_mps" }
errors = { velocity = "0.1 m/s" }
[heading]
file = "heading.csv"
columns = { time = "t_s", heading = "heading_deg" }
errors = { heading = "0.5 deg" }
[height]
file = "height.csv"
columns = { time = "t_s", height = "h_m", rate = "vu_mps" }
[track]
file = "track.csv"
columns = { time = "t_s", distance = "ds_m", heading = "heading_deg" }
heading_model = "independent"
[[benchmark]]
name = "by row"
after_row = 100
lat_deg = )" +
            r.at("lat_deg")[100] + "\nlon_deg = " + r.at("lon_deg")[100] + "\nstd = \"1 m\"\n";
    std::ofstream(folder + "/drive.toml") << toml;
  }
};

double turn(double a, double b) { return std::remainder(a - b, 360.0); }

TEST(TransferDrive, EverySlowSensorComesAlong) {
  const SlowDrive home("slow");
  for (const std::string& keep : {std::string("path"), std::string("velocity")}) {
    const std::string polar = scratch_folder() + "/slow_polar_" + keep;
    const Outcome moved =
        run("transfer " + home.folder + " --angle 41.8deg --meridian 11.5deg --keep " + keep +
            " -o " + polar);
    ASSERT_EQ(moved.exit_code, 0) << moved.err;
    EXPECT_EQ(moved.err.find("not_moved"), std::string::npos) << moved.err;
    const auto reference = columns(slurp(polar + "/reference.csv"));
    const auto fix = columns(slurp(polar + "/fix.csv")),
               att = columns(slurp(polar + "/attitude.csv")),
               vel = columns(slurp(polar + "/velocity.csv")),
               head = columns(slurp(polar + "/heading.csv")),
               height = columns(slurp(polar + "/height.csv")),
               track = columns(slurp(polar + "/track.csv"));
    ASSERT_EQ(fix.at("t_s").size(), reference.at("t_s").size());
    ASSERT_EQ(track.at("t_s").size(), reference.at("t_s").size() - 1);
    EXPECT_GT(number(reference.at("lat_deg")[0]), 89.8);
    double lowest = 2, highest = 0;
    for (std::size_t i = 0; i < reference.at("t_s").size(); ++i) {
      const auto c = [&](const char* name) { return number(reference.at(name)[i]); };
      EXPECT_NEAR(number(fix.at("lat_deg")[i]), c("lat_deg"), 1e-11);
      // A metre of east is 1e-3 deg of longitude here and more: the same metre.
      const double metre = 111e3 * std::cos(c("lat_deg") * 3.14159265358979 / 180);
      EXPECT_NEAR(turn(number(fix.at("lon_deg")[i]), c("lon_deg")) * metre, 0, 1e-6);
      for (const char* v : {"ve_mps", "vn_mps", "vu_mps"}) {
        EXPECT_NEAR(number(fix.at(v)[i]), c(v), 1e-9);
        EXPECT_NEAR(number(vel.at(v)[i]), c(v), 1e-9);
      }
      EXPECT_NEAR(turn(number(att.at("heading_deg")[i]), c("heading_deg")), 0, 1e-9);
      EXPECT_NEAR(turn(number(head.at("heading_deg")[i]), c("heading_deg")), 0, 1e-9);
      EXPECT_NEAR(number(att.at("pitch_deg")[i]), c("pitch_deg"), 1e-12);
      // The reference went through ECEF twice, whose last place is 0.93e-9 m.
      EXPECT_NEAR(number(height.at("h_m")[i]), c("h_m"), 4e-9);
      if (i == 0) continue;
      // The track's heading holds at mid-step: between the grid headings of both ends, which a
      // step of 1 s near the pole moves by the change of place alone.
      const double ds = number(track.at("ds_m")[i - 1]);
      lowest = std::min(lowest, ds / 10), highest = std::max(highest, ds / 10);
      EXPECT_NEAR(turn(number(track.at("heading_deg")[i - 1]), c("heading_deg") - c("lon_deg")), 0,
                  1e-3);
    }
    // polar.md 7.2: up to 0.7 % where the path is kept, nothing where the velocity is.
    if (keep == "path") {
      EXPECT_GT(highest - 1, 5e-4);
      EXPECT_LT(highest - 1, 0.007);
    } else {
      EXPECT_NEAR(lowest, 1, 1e-12);
      EXPECT_NEAR(highest, 1, 1e-12);
    }
    const std::string toml = slurp(polar + "/drive.toml");
    EXPECT_NE(toml.find("heading_reference = \"grid\""), std::string::npos);
    EXPECT_NE(toml.find("lat_deg = " + reference.at("lat_deg")[100].substr(0, 12)),
              std::string::npos)
        << toml;
    // The moved drive is a drive: it can be navigated and reckoned.
    EXPECT_EQ(run("navigate " + polar + " --mode inertial --quiet -o " + polar + ".csv").exit_code,
              0);
    EXPECT_EQ(run("navigate " + polar + " --mode reckon --quiet -o " + polar + "_r.csv").exit_code,
              0);
  }
}

TEST(TransferDrive, ADriveWithoutImuIsMovedAsWell) {
  if (shared_folder("data").empty()) GTEST_SKIP() << "no shared/data";
  ::setenv("LOXO_DATA", shared_folder("data").c_str(), 1);
  // A ship's reference and gyrocompass, from the South Atlantic to the pole and home again.
  const std::string ship = std::string(source_folder()) + "/examples/drives/ship_nbp1406";
  const std::string polar = scratch_folder() + "/ship", home = scratch_folder() + "/ship_home";
  ASSERT_EQ(run("transfer " + ship + " --angle 112deg --meridian -17.9deg -o " + polar).exit_code,
            0);
  ASSERT_EQ(run("transfer " + polar + " --angle -112deg --meridian -17.9deg -o " + home).exit_code,
            0);
  const auto given = columns(slurp(shared_folder("data") + "/ship_nbp1406/gyrocompass.csv")),
             back = columns(slurp(home + "/heading.csv")),
             away = columns(slurp(polar + "/heading.csv"));
  ASSERT_GT(back.at("t_s").size(), 1000u);
  std::size_t j = 0;
  double largest = 0;
  for (std::size_t i = 0; i < back.at("t_s").size(); ++i) {
    while (std::fabs(number(given.at("t_s")[j]) - number(back.at("t_s")[i])) > 1e-9)
      ASSERT_LT(++j, given.at("t_s").size());
    EXPECT_NEAR(turn(number(back.at("heading_deg")[i]), number(given.at("heading_deg")[j])), 0,
                1e-8);
    largest = std::max(largest, std::fabs(turn(number(away.at("heading_deg")[i]),
                                               number(given.at("heading_deg")[j]))));
  }
  EXPECT_GT(largest, 10);  // seen from the pole the headings are others
}

}  // namespace
}  // namespace loxo::testing
