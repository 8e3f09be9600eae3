// SPDX-License-Identifier: Apache-2.0
// `loxo calibrate points`: tables in, k and eps out (interface.md).
#include <gtest/gtest.h>

#include <cmath>

#include "program.hpp"

namespace loxo::testing {
namespace {

// On the equator every metric is the same: k and eps by hand.
const char* const kRows =
    "name,lat1_deg,lon1_deg,lat2_deg,lon2_deg,lat3_deg,lon3_deg\n"
    "across,0,179.9,0,-179.8,0,-179.5\n"
    "no chord,10,20,10,20,10.1,20\n"
    "back,0,0,0,0.3,0,-0.6\n";

TEST(CalibratePoints, AcrossTheAntimeridianAndBackwards) {
  const Outcome r = run("calibrate points --method rhumb --std 0.1m", kRows);
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto t = columns(r.out);
  EXPECT_NEAR(number(t.at("k")[0]), 2.0, 1e-11);
  EXPECT_NEAR(number(t.at("eps_deg")[0]), 0.0, 1e-11);
  EXPECT_NEAR(number(t.at("k")[2]), 2.0, 1e-11);
  EXPECT_EQ(number(t.at("eps_deg")[2]), 180.0);
  const double chord = 0.3 * M_PI / 180 * 6378137.0;
  EXPECT_NEAR(number(t.at("k_std")[0]), 2.0 * std::sqrt(2.0) * 0.1 / chord, 1e-15);
  EXPECT_EQ(t.at("k")[1], "nan");
  EXPECT_NE(r.err.find(":3"), std::string::npos) << r.err;
  EXPECT_NE(r.err.find("zero chord"), std::string::npos) << r.err;
}

TEST(CalibratePoints, AllMethodsSideBySide) {
  const Outcome r = run("calibrate points --method all", kRows);
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.out.substr(0, r.out.find('\n')),
            "name,lat1_deg,lon1_deg,lat2_deg,lon2_deg,lat3_deg,lon3_deg,k_start_latitude,"
            "eps_start_latitude_deg,k_mean_latitude,eps_mean_latitude_deg,k_rhumb,eps_rhumb_deg,"
            "k_geodesic,eps_geodesic_deg,k_gauss,eps_gauss_deg");
  // One method out of its reach leaves the others standing.
  const Outcome far = run("calibrate points --method all",
                          "lat1_deg,lon1_deg,lat2_deg,lon2_deg,lat3_deg,lon3_deg\n0,0,0,60,0,30\n");
  ASSERT_EQ(far.exit_code, 0) << far.err;
  const auto t = columns(far.out);
  EXPECT_EQ(t.at("k_gauss")[0], "nan");
  EXPECT_NEAR(number(t.at("k_rhumb")[0]), 0.5, 1e-15);
  EXPECT_NE(far.err.find("gauss"), std::string::npos) << far.err;
}

TEST(CalibratePoints, WrongUse) {
  EXPECT_EQ(run("calibrate points --method meanlat", kRows).exit_code, 2);
  EXPECT_EQ(run("calibrate points --std 0.1", kRows).exit_code, 2);
  EXPECT_EQ(run("calibrate points", "lat1_deg,lon1_deg\n1,2\n").exit_code, 3);
}

}  // namespace
}  // namespace loxo::testing
