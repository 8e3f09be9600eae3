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
  EXPECT_EQ(j.at("rows").get<int>(), 600);
  EXPECT_EQ(r.err.find("switch"), std::string::npos) << r.err;
  // Phases in their order.
  int phase = 1;
  for (const auto& e : j.at("history")) {
    EXPECT_GE(e.at("phase").get<int>(), phase);
    phase = e.at("phase").get<int>();
  }
  EXPECT_EQ(phase, 2);
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
