// SPDX-License-Identifier: Apache-2.0
// Key figures of docs/real-drives.md, so that they cannot rot unseen. Skipped where the recordings
// are not there.
#include <gtest/gtest.h>

#include <cmath>

#include "loxo/text/json.hpp"
#include "program.hpp"
#include "shared_folder.hpp"

namespace loxo::testing {
namespace {

std::string example(const std::string& name) {
  return std::string(LOXO_SOURCE_DIR) + "/examples/drives/" + name;
}

class RealDrives : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string folder = shared_folder("data");
    if (folder.empty()) GTEST_SKIP() << "the recordings are not here (LOXO_DATA)";
    ::setenv("LOXO_DATA", folder.c_str(), 1);
  }
  static Json json(const std::string& arguments) {
    const Outcome o = run(arguments + " --json");
    EXPECT_EQ(o.exit_code, 0) << o.err;
    return o.exit_code == 0 ? parse_json(o.out, arguments) : Json::object();
  }
};

// What the reference of each set lets one expect, and how far its own accuracy lets it stray.
struct Expected {
  const char *drive, *options;
  double k, k_within, eps_deg, eps_within;
};

TEST_F(RealDrives, CalibrationFindsWhatTheReferencesSay) {
  for (const Expected& e : {
           // The speed scale of the three parts of the drive: 0.986 to 0.990; heading good to 0.1
           // deg
           Expected{"kingston2008_a/calibration.toml", "--estimate pitch_mounting", 0.9877, 0.002,
                    -0.252, 0.2},
           Expected{"plaza1", "", 1.0033, 0.015, -0.942, 0.9},
           Expected{"comma2k19_seg40/calibration.toml", "--estimate pitch_mounting", 0.992, 0.003,
                    -0.895, 0.2},
           Expected{"fog_mems_vehicle/calibration.toml", "", 1.0, 0.001, 4.578, 0.11},
           // 1.0013 to 1.0075 in five parts
           Expected{"wheelins_car", "", 1.0032, 0.0045, 0.0, 0.1},
           Expected{"genivi_munich", "--estimate heading_drift", 1.0242, 0.005, NAN, NAN},
       }) {
    SCOPED_TRACE(e.drive);
    const Json j = json("calibrate " + example(e.drive) + " " + e.options);
    ASSERT_EQ(j.value("recommended", ""), "least_squares");
    const Json& m = j.at("methods").at("least_squares");
    EXPECT_NEAR(m.at("k").get<double>(), e.k, e.k_within);
    if (!std::isnan(e.eps_deg)) {
      EXPECT_NEAR(m.at("eps_deg").get<double>(), e.eps_deg, e.eps_within);
    }
    if (m.contains("pitch_mounting_deg") && std::string(e.drive).starts_with("kingston")) {
      EXPECT_NEAR(m.at("pitch_mounting_deg").get<double>(), -0.855, 0.06);
    }
  }
}

TEST_F(RealDrives, ACalibratedCarStaysBelowOnePercentAndKeepsItsOwnHeading) {
  const std::string drive = example("kingston2008_a/calibration.toml");
  const std::string certificate = scratch_folder() + "/kingston.json",
                    solution = scratch_folder() + "/kingston.csv";
  ASSERT_EQ(run("calibrate " + drive + " --estimate pitch_mounting -o " + certificate).exit_code,
            0);
  ASSERT_EQ(
      run("navigate " + drive + " --mode reckon --calibration " + certificate + " -o " + solution)
          .exit_code,
      0);
  // The heading of the reference is what was reckoned with: the body keeps it.
  const Outcome o = run("evaluate " + solution + " --truth " + drive +
                        " --require 'horizontal_pct_95<1' --require 'heading_rms_deg<0.01'");
  EXPECT_EQ(o.exit_code, 0) << o.out << o.err;
}

}  // namespace
}  // namespace loxo::testing
