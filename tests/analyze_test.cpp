// SPDX-License-Identifier: Apache-2.0
// `loxo analyze` and `loxo allan` as a user runs them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "loxo/num/units.hpp"
#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo {
namespace {

using testing::columns;
using testing::number;
using testing::run;
using testing::scratch_folder;

const char kHeader[] =
    "tlat_deg,tlon_deg,t_s,dve0_mps,dvn0_mps,phie0_rad,phin0_rad,phiu0_rad,dtlat0_rad,dtlon0_rad,"
    "nabla_e_mps2,nabla_n_mps2,eps_e_radps,eps_n_radps,eps_u_radps\n";

TEST(AnalyzeStatic, TableAnswersRowByRowAndKeepsTheOthersWhenOneIsBad) {
  const auto o = run("analyze static --table - --earth sphere",
                     std::string(kHeader) + "0,0,3600,0.01,0,0,0,0,0,0,0,0,0,0,0\n" +
                         "90,0,3600,0.01,0,0,0,0,0,0,0,0,0,0,0\n" +
                         "0,0,0,0.01,0.02,1e-4,0,0,0,0,0,0,0,0,0\n");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  auto c = columns(o.out);
  // At the pole from rest with dv0 east: dve = dv0 cos(kt) cos(mt) + ..., here from the two roots.
  const double w = 7.292115e-5, m = std::sqrt(9.8 / 6371000 + w * w), t = 3600;
  const double expected =
      0.01 * (std::cos(w * t) * std::cos(m * t) - w / m * std::sin(w * t) * std::sin(m * t));
  EXPECT_NEAR(number(c["dve_mps"][0]), expected, 1e-12);
  EXPECT_TRUE(std::isnan(number(c["dve_mps"][1])));
  EXPECT_NE(o.err.find(":3"), std::string::npos) << o.err;  // the bad row's line
  EXPECT_NEAR(number(c["dvn_mps"][2]), 0.02, 1e-16);        // t = 0: the initial error, to rounding
  EXPECT_EQ(run("analyze static --table -", "a,b\n1,2\n").exit_code, 3);
}

TEST(AnalyzeRoots, AtThePoleOnTheSphere) {
  const auto o = run("analyze roots --lat 90deg --earth sphere --json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto j = parse_json(o.out, "roots");
  EXPECT_NEAR(j["schuler_foucault_low_radps"].get<double>(), 0.001169470718, 1e-12);
  EXPECT_NEAR(j["schuler_foucault_high_radps"].get<double>(), 0.001315313018, 1e-12);
  EXPECT_EQ(run("analyze roots --lat 95deg").exit_code, 2);
  EXPECT_EQ(run("analyze roots --lat 30").exit_code, 2);
  EXPECT_EQ(run("analyze roots --lat 30deg --earth moon").exit_code, 2);
}

TEST(AnalyzeOdometer, NamesWhatLeadsAndWhatHelps) {
  const std::string drive =
      "analyze odometer --length 11.2km --heading-std 3.6arcmin --level-std 0.5arcmin --gyro-bias "
      "0.01deg/h --gyro-noise '0.001deg/sqrt(h)' --benchmark-std 0.1m ";
  const auto o = run(drive + "--json -o " + scratch_folder() + "/odometer.csv");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto j = parse_json(o.out, "odometer");
  EXPECT_EQ(j["leading_angle"], "heading_alignment");
  EXPECT_EQ(j["leading_scale"], "benchmarks");
  EXPECT_EQ(j["improves_angle_most"], "heading of the alignment twice as good");
  EXPECT_EQ(j["improves_scale_most"], "benchmarks twice as good");
  EXPECT_NEAR(j["eps_std_deg"].get<double>(), 0.06, 0.001);
  EXPECT_NEAR(j["ln_k_std"].get<double>(), 0.1 * std::sqrt(2.0) / 11200, 2e-7);
  EXPECT_NEAR(j["duration_s"].get<double>(), 600, 1e-9);
  auto c = columns(testing::slurp(scratch_folder() + "/odometer.csv"));
  double sum = 0;
  for (const auto& x : c["eps_std_deg"]) sum += number(x) * number(x);
  EXPECT_NEAR(std::sqrt(sum), j["eps_std_deg"].get<double>(), 1e-12);
  const auto text = run(drive);
  EXPECT_NE(text.out.find("led by heading of the alignment"), std::string::npos) << text.out;
}

TEST(AnalyzeOdometer, RefusesWhatMeansNothing) {
  const struct {
    const char* arguments;
    int code;
    const char* says;
  } cases[] = {
      {"", 2, "--length"},
      {"--length 10km", 2, "no error given"},
      {"--length 10km --heading-std=-1deg", 2, "never negative"},
      {"--length 10km --heading-std 1", 2, "--heading-std"},
      {"--length 10km --heading-std 1deg --heading-model mechanized", 2, "mechanised"},
      {"--length 10km --heading-std 1deg --lat 95deg", 2, "--lat"},
      {"--length 100km --heading-std 1deg --lat 89.5deg", 3, "pole"},
      {"--length 0km --heading-std 1deg", 3, "positive length"},
  };
  for (const auto& c : cases) {
    const auto o = run(std::string("analyze odometer ") + c.arguments);
    EXPECT_EQ(o.exit_code, c.code) << c.arguments << o.err;
    EXPECT_NE(o.err.find(c.says), std::string::npos) << c.arguments << ": " << o.err;
  }
}

TEST(AnalyzeBudget, OfAScenarioAndOfTheDriveSimulatedFromIt) {
  const std::string errors = " --mode inertial --heading-std 1arcmin --deflection 5arcsec --json";
  const auto o = run("analyze budget straight-road" + errors);
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto j = parse_json(o.out, "budget");
  EXPECT_EQ(j["leading"], "gravity_deflection");
  const auto t = j["t_s"].size();
  double sum = 0, share = 0;
  for (const auto& s : j["sources"]) {
    ASSERT_EQ(s["horizontal_variance_m2"].size(), t);
    sum += s["horizontal_variance_m2"].back().get<double>();
    share += s["share"].get<double>();
  }
  EXPECT_NEAR(std::sqrt(sum), j["horizontal_end_m"].get<double>(), 1e-9);
  EXPECT_NEAR(share, 1.0, 1e-12);
  EXPECT_NEAR(j["total_m"].back().get<double>(), std::sqrt(sum), 1e-9);
  // The recorded drive's own filter finds the same motion.
  const std::string drive = scratch_folder() + "/budget_drive";
  ASSERT_EQ(run("simulate straight-road -o " + drive).exit_code, 0);
  const std::string csv = scratch_folder() + "/budget.csv";
  const auto d = run("analyze budget " + drive + errors + " -o " + csv);
  ASSERT_EQ(d.exit_code, 0) << d.err;
  const auto k = parse_json(d.out, "budget");
  EXPECT_NEAR(k["horizontal_end_m"].get<double>() / j["horizontal_end_m"].get<double>(), 1.0, 0.01);
  auto c = columns(testing::slurp(csv));
  EXPECT_EQ(c["source"].size(), c["t_s"].size());
  EXPECT_EQ(c["source"][0], "total");
}

TEST(AnalyzeBudget, RefusesWhatMeansNothing) {
  const struct {
    const char* arguments;
    int code;
    const char* says;
  } cases[] = {
      {"straight-raod", 2, "straight-road"},
      {"straight-road --gyro-noise=-1deg/sqrt(h)", 2, "never negative"},
      {"straight-road --gyro-bias 1deg", 2, "--gyro-bias"},
      {"straight-road --mode inertail", 2, "inertial"},
      {"over-the-pole --headings true", 3, "pole"},
      {"over-the-pole --alignment self --mode inertial", 3, "pole"},
      {"straight-road --step 0s", 2, "--step"},
  };
  for (const auto& c : cases) {
    std::string quoted = c.arguments;
    if (const auto at = quoted.find("(h)"); at != std::string::npos)
      quoted.replace(at, 3, "\\(h\\)");
    const auto o = run("analyze budget " + quoted);
    EXPECT_EQ(o.exit_code, c.code) << c.arguments << o.err;
    EXPECT_NE(o.err.find(c.says), std::string::npos) << c.arguments << ": " << o.err;
  }
}

TEST(Allan, CommandFindsTheCoefficientsOfASimulatedLog) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  const std::string path = scratch_folder() + "/rest.csv";
  std::ofstream out(path);
  out << "t_s,gx,ax,ay,az\n";
  for (int i = 0; i < 100000; ++i)
    out << i * 0.01 << ',' << 0.1 * deg_per_sqrt_h * 10 * normal(generator) << ",0,"
        << 0.02 / 60 * 10 * normal(generator) << ",9.8\n";
  out.close();
  const auto o = run("allan " + path + " --json");
  // az is constant: its variance is zero and no fit may invent noise; gx has 0.1 deg/sqrt(h).
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto j = parse_json(o.out, "allan");
  const auto& gx = j["axes"]["gyro_x"];
  const double z = (gx["angle_random_walk_deg_sqrt_h"].get<double>() - 0.1) /
                   gx["angle_random_walk_deg_sqrt_h_std"].get<double>();
  EXPECT_LT(std::fabs(z), 4.0);
  EXPECT_NEAR(j["axes"]["accel_y"]["velocity_random_walk_mps_sqrt_h"].get<double>(), 0.02, 0.001);
  EXPECT_LT(j["axes"]["accel_z"]["velocity_random_walk_mps_sqrt_h"].get<double>(), 1e-9);
  std::ofstream(scratch_folder() + "/short.csv") << "t_s,gx\n0,1\n1,2\n";
  EXPECT_EQ(run("allan " + scratch_folder() + "/short.csv").exit_code, 3);
  EXPECT_EQ(run("allan " + scratch_folder() + "/none.csv").exit_code, 3);
}

}  // namespace
}  // namespace loxo
