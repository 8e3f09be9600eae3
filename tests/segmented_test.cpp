// SPDX-License-Identifier: Apache-2.0
// `loxo navigate --mode segmented` as users run it: the switch, the switch that is forced, and the
// drive that is over before it.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "loxo/text/json.hpp"
#include "program.hpp"

namespace {
using loxo::testing::run;
using loxo::testing::scratch_folder;

loxo::testing::Outcome simulated(const std::string& name, const std::string& options) {
  const std::string drive = scratch_folder() + "/" + name;
  std::filesystem::remove_all(drive);
  const auto r = run("simulate mixed --quiet --seed 4 -o " + drive + " " + options);
  EXPECT_EQ(r.exit_code, 0) << r.err;
  return run("navigate " + drive + " --mode segmented --json -o " + drive + ".csv");
}

// A navigation-grade unit: phase 1 finds 2 % and 1 deg in little more than a minute. The start's
// attitude is given, so that 20 ug of accelerometer bias act in full: 0.5 m in 70 s of 1 km, 5e-4
// for one sigma; four of them.
TEST(Segmented, SwitchesAndSaysWhatItFound) {
  const auto r = simulated("good", "");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto j = loxo::parse_json(r.out, "navigate");
  EXPECT_FALSE(j.at("forced").get<bool>());
  EXPECT_GE(j.at("switch_s").get<double>(), 60);
  EXPECT_LT(j.at("switch_s").get<double>(), 120);
  EXPECT_NEAR(j.at("k").get<double>(), 1.02, 4 * 5e-4);
  EXPECT_NEAR(j.at("eps_deg").get<double>(), 1, 4 * 5e-4 * 57.3);
  EXPECT_LT(std::fabs(j.at("k").get<double>() - 1.02), 4 * j.at("k_std").get<double>());
  EXPECT_EQ(j.at("rows").get<int>(), 5991);  // 10 Hz, from the first epoch at 1 s
  EXPECT_EQ(r.err.find("switch"), std::string::npos) << r.err;
  // Phases in their order.
  int phase = 1;
  for (const auto& e : j.at("history")) {
    EXPECT_GE(e.at("phase").get<int>(), phase);
    phase = e.at("phase").get<int>();
  }
  EXPECT_EQ(phase, 2);
}

double worst(const std::string& name) {
  const std::string drive = scratch_folder() + "/" + name;
  const auto r = run("evaluate " + drive + ".csv --truth " + drive + " --json");
  return loxo::parse_json(r.out, "evaluate").at("horizontal_max_m").get<double>();
}

// The wheel stands beside the IMU: in each turn its way is not the IMU's. The same
// sensors, so that what is left is a pulse (0.05 m) and what the odometer's noise of 1e-3 does to
// ways that differ by less than the lever.
TEST(Segmented, TheLeverArmOfTheWheelIsTakenOut) {
  simulated("middle", "");
  simulated("lever", "--set 'odometer.lever_arm=\"3 0 -0.5 m\"'");
  EXPECT_NEAR(worst("lever"), worst("middle"), 0.5);
}

TEST(Segmented, RowsComeAtTheOutputRate) {
  simulated("rate", "");
  const std::string drive = scratch_folder() + "/rate";
  for (const auto& [rate, rows] : {std::pair{"1Hz", 600}, {"20Hz", 11981}, {"0.1Hz", 60}}) {
    const auto j = run("navigate " + drive + " --mode segmented --json --output-rate " + rate +
                       " -o " + drive + ".csv");
    EXPECT_EQ(loxo::parse_json(j.out, "navigate").at("rows").get<int>(), rows) << rate;
  }
}

// Latitude and longitude are what the method reckons in: past a pole it must say so.
TEST(Segmented, NearAPoleItsSigmasAreTakenBack) {
  const auto r = simulated("pole", "--set start.lat_deg=89.97");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_NE(r.err.find("from a pole"), std::string::npos) << r.err;
  const auto rows = loxo::testing::columns(loxo::testing::slurp(scratch_folder() + "/pole.csv"));
  for (const auto& health : rows.at("health")) EXPECT_TRUE(std::stoi(health) & 512) << health;
}

// 7: on a tactical unit the rule is never met; at 180 s it is switched all the same, and said.
TEST(Segmented, ATacticalUnitIsForcedAndToldWhatToDo) {
  const auto r =
      simulated("poor", "--set 'imu.accel_bias=\"3000 ug\"' --set 'imu.gyro_bias=\"1 deg/h\"'");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto j = loxo::parse_json(r.out, "navigate");
  EXPECT_TRUE(j.at("forced").get<bool>());
  EXPECT_EQ(j.at("switch_s").get<double>(), 180);
  EXPECT_NE(r.err.find("the switch rule was not met after 180 s"), std::string::npos) << r.err;
  EXPECT_NE(r.err.find("--mode filter"), std::string::npos) << r.err;
}

}  // namespace
