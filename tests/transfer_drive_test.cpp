// SPDX-License-Identifier: Apache-2.0
// `loxo transfer DRIVE`: a real drive to the pole and home again.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "program.hpp"
#include "shared_folder.hpp"

namespace loxo::testing {
namespace {

const std::string kDrive = std::string(LOXO_SOURCE_DIR) + "/examples/drives/kingston2008_a";

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

}  // namespace
}  // namespace loxo::testing
