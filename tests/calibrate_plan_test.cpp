// SPDX-License-Identifier: Apache-2.0
// `loxo calibrate plan` as a user runs it: closed forms, floors by name, refusals, and the plan
// driven by simulation.
#include <gtest/gtest.h>

#include <cmath>

#include "loxo/num/units.hpp"
#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo {
namespace {

using testing::run;
using testing::scratch_folder;

Json plan(const std::string& arguments) {
  const auto o = run("calibrate plan " + arguments + " --json");
  EXPECT_EQ(o.exit_code, 0) << o.err;
  return parse_json(o.out, "plan");
}
Json shape(const Json& j, const std::string& name, std::size_t benchmarks) {
  for (const auto& p : j["plans"])
    if (p["shape"] == name && p["benchmarks"] == benchmarks) return p;
  ADD_FAILURE() << name << " is not in " << j.dump();
  return {};
}

// Benchmarks of 0.1 m at both ends: sqrt(2) 0.1 / D = 1e-4 at 1414.2 m (V-44), found to a
// thousandth of the length.
TEST(CalibratePlan, TheLengthOfAStraightDriveIsTheClosedForm) {
  const auto p = shape(plan("--latitude 55deg --k-std 1e-4 --benchmark-std 0.1m"), "straight", 1);
  EXPECT_TRUE(p["reached"].get<bool>());
  EXPECT_NEAR(p["leg_m"].get<double>(), 0.1 * std::sqrt(2.0) / 1e-4, 2.0);
  EXPECT_LE(p["k_std"].get<double>(), 1e-4);
  // (V-45): drift of 0.05 deg/h for the time of the drive, half of it.
  const auto q = shape(plan("--latitude -40deg --eps-std 12.5arcsec --benchmark-std 0.001m "
                            "--heading-drift 0.05deg/h --speed 20m/s"),
                       "straight", 1);
  EXPECT_LE(q["eps_std_deg"].get<double>() * 3600, 12.5);
  EXPECT_LT(q["leg_m"].get<double>(), 100.0);  // the shortest: 1 mm over 12.5" is 23 m
}

TEST(CalibratePlan, TheFloorIsNamedAndTheExitIsOne) {
  const auto o =
      run("calibrate plan --latitude 55deg --eps-std 10arcsec --heading-bias 1arcmin "
          "--benchmark-std 0.1m");
  EXPECT_EQ(o.exit_code, 1);
  EXPECT_NE(o.err.find("the floor is"), std::string::npos) << o.err;
  EXPECT_NE(o.err.find("heading alignment"), std::string::npos) << o.err;
  // Never separable from positions (vehicle.md 5.3): no drive is better than the alignment.
  const auto j = parse_json(run("calibrate plan --latitude 80deg --eps-std 10arcsec "
                                "--heading-bias 1arcmin --longest 500km --json")
                                .out,
                            "plan");
  EXPECT_FALSE(j["reached"].get<bool>());
  for (const auto& p : j["plans"]) EXPECT_GE(p["eps_std_deg"].get<double>() * 60, 1.0) << p.dump();
}

// What the extra states need: the plan says so for shapes that cannot give it.
TEST(CalibratePlan, StatesThatAShapeCannotTellAreNamed) {
  const auto j = plan("--latitude 55deg --k-std 1e-4 --estimate lever_arm --benchmarks 4");
  const auto straight = shape(j, "straight", 4);
  EXPECT_FALSE(straight["reached"].get<bool>());
  EXPECT_NE(straight["why"].get<std::string>().find("lever arm"), std::string::npos) << straight;
  EXPECT_TRUE(shape(j, "L", 4)["reached"].get<bool>());
  const auto few = shape(j, "straight", 1);
  EXPECT_NE(few["why"].get<std::string>().find("4 unknowns and 2 equations"), std::string::npos);
}

// The plan, driven: real simulated drives calibrated by the real methods scatter as stated.
TEST(CalibratePlan, SimulatedDrivesOfThePlanScatterAsStated) {
  for (const char* arguments :
       {"--latitude 55deg --k-std 2e-4 --eps-std 60arcsec --heading-noise '0.02deg/sqrt(h)' "
        "--scale-noise 1% --quantisation 0.2m --heading-bias 10arcsec --side-slip 0.1deg "
        "--heading-drift 0.1deg/h",
        "--latitude -70deg --course 170deg --k-std 3e-4 --heading-drift 0.5deg/h "
        "--heading-noise '0.02deg/sqrt(h)' --estimate heading_drift,lever_arm --scale 1.02 "
        "--mounting 2deg --interval 0.2s",
        "--latitude 0deg --k-std 3e-4 --estimate pitch_mounting,start_offset --scale 0.9"}) {
    const auto v = plan(std::string(arguments) + " --verify 300")["verify"];
    EXPECT_EQ(v["valid"].get<int>(), 300) << arguments;
    EXPECT_TRUE(v["inside"].get<bool>()) << arguments << v.dump();
  }
}

TEST(CalibratePlan, SensorErrorsOfADrive) {
  const std::string folder = scratch_folder() + "/planned";
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/track.csv") << "t_s,ds_m,heading_deg\n1,1,0\n2,1,0\n";
  std::ofstream(folder + "/drive.toml")
      << "format = 1\nname = \"p\"\n[track]\nfile = \"track.csv\"\nheading_model = "
         "\"independent\"\ncolumns = { time = \"t_s\", distance = \"ds_m\", heading = "
         "\"heading_deg\" }\n[[benchmark]]\nname = \"A\"\nafter_row = 0\nlat_deg = 30\nlon_deg = "
         "10\nstd = \"0.5 m\"\n";
  const auto j = plan(folder + " --k-std 1e-3");
  EXPECT_NEAR(j["latitude_deg"].get<double>(), 30.0, 1e-13);
  EXPECT_NEAR(shape(j, "straight", 1)["leg_m"].get<double>(), 0.5 * std::sqrt(2.0) / 1e-3, 1.5);
}

TEST(CalibratePlan, Refusals) {
  const struct {
    const char* arguments;
    const char* says;
  } cases[] = {
      {"--k-std 1e-4", "--latitude"},
      {"--latitude 55 --k-std 1e-4", "unit"},
      {"--latitude 55deg", "--k-std"},
      {"--latitude 89.5deg --k-std 1e-4", "-89 to 89"},
      {"--latitude 55deg --k-std 0", "above 0"},
      {"--latitude 55deg --k-std 1e-4m", "--k-std"},
      {"--latitude 55deg --k-std 1e-4 --speed 0m/s", "--speed"},
      {"--latitude 55deg --k-std 1e-4 --heading-drift 0.01deg", "--heading-drift"},
      {"--latitude 55deg --k-std 1e-4 --benchmark-std -1m", "--benchmark-std"},
      {"--latitude 55deg --k-std 1e-4 --longest 10m", "--longest"},
      {"--latitude 55deg --k-std 1e-4 --benchmarks 0", "--benchmarks"},
      {"--latitude 55deg --k-std 1e-4 --estimate heading_drif", "heading_drift"},
      {"--latitude 55deg --k-std 1e-4 --ellipsoid WGS48", "WGS84"},
  };
  for (const auto& c : cases) {
    const auto o = run(std::string("calibrate plan ") + c.arguments);
    EXPECT_EQ(o.exit_code, 2) << c.arguments << o.err;
    EXPECT_NE(o.err.find(c.says), std::string::npos) << c.arguments << "\n" << o.err;
    EXPECT_EQ(o.out, "") << c.arguments;
  }
}

}  // namespace
}  // namespace loxo
