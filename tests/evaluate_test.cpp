// SPDX-License-Identifier: Apache-2.0
// `loxo evaluate` as a user runs it, and the laws of its errors. estimation.md section 7.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo {
namespace {

using testing::run;
using testing::scratch_folder;

// A straight way north from (lat, lon) at 10 m/s for 600 s, every point moved by error(t) metres to
// the east.
std::string track(const std::string& name, double lat, double lon, double (*error)(double),
                  double t0 = 0) {
  const std::string path = scratch_folder() + "/" + name + ".csv";
  std::ofstream out(path);
  out.precision(17);
  out << "t_s,x_m,y_m,z_m,std_e_m,std_n_m\n";
  for (int i = 0; i <= 600; ++i) {
    const double t = i;
    const double arc = meridian_arc(wgs84(), lat * deg) + 10 * t;
    // Beyond the pole the way goes down the other meridian.
    const double over = arc - wgs84().quarter_meridian;
    const double here = latitude_of_arc(wgs84(), over > 0 ? wgs84().quarter_meridian - over : arc);
    auto p = to_ecef(wgs84(), Geodetic<double>{here, lon * deg + (over > 0 ? kPi : 0.0), 0.0});
    const double e = error(t);
    // East of the way is the same direction in space on both sides of the pole.
    out << t0 + t << ',' << p.x - e * std::sin(lon * deg) << ',' << p.y + e * std::cos(lon * deg)
        << ',' << p.z << ",1,1\n";
  }
  return path;
}
double none(double) { return 0; }
double growing(double t) { return 5 * t / 600; }
double constant(double) { return 3; }

TEST(Evaluate, ErrorIsThatOfThePlaneAtEveryPlaceAlsoOverThePoleAndTheDateLine) {
  const struct {
    const char* name;
    double lat, lon;
  } places[] = {{"mid", 55, 10},
                {"equator", -0.02, 0},
                {"south", -70, 33},
                {"line", 10, 180},
                {"pole", 89.97, 77}};
  for (const auto& place : places) {
    const auto truth = track(std::string(place.name) + "_truth", place.lat, place.lon, none);
    const auto sol = track(std::string(place.name) + "_sol", place.lat, place.lon, growing);
    const auto o = run("evaluate " + sol + " --truth " + truth + " --json");
    ASSERT_EQ(o.exit_code, 0) << place.name << o.err;
    const auto j = parse_json(o.out, place.name);
    EXPECT_NEAR(j["horizontal_end_m"].get<double>(), 5.0, 1e-4) << place.name;
    EXPECT_NEAR(j["horizontal_max_m"].get<double>(), 5.0, 1e-4);
    EXPECT_NEAR(j["horizontal_rms_m"].get<double>(),
                5 * std::sqrt(601 * (2.0 * 600 + 1) / (6.0 * 600) / 601), 1e-2);
    // Chords of 10 m against arcs: 1e-12; the way itself.
    EXPECT_NEAR(j["distance_m"].get<double>(), 6000.0, 1e-3);
    EXPECT_NEAR(j["horizontal_pct_max"].get<double>(), 100 * 5.0 / 6000, 1e-4);
    EXPECT_NEAR(j["cep50_m"].get<double>(), 2.5, 0.02);
    // The first epoch has no course yet: one of 601 left out of the mean square.
    EXPECT_NEAR(j["across_rms_m"].get<double>(), j["horizontal_rms_m"].get<double>(), 3e-3);
    EXPECT_EQ(j["epochs"].get<int>(), 601);
  }
}

TEST(Evaluate, NeesIsThatOfTheStatedStd) {
  const auto truth = track("n_truth", 40, 5, none);
  const auto sol = track("n_sol", 40, 5, constant);
  const auto j = parse_json(run("evaluate " + sol + " --truth " + truth + " --json").out, "nees");
  EXPECT_NEAR(j["nees_mean"].get<double>(), 9.0, 1e-5);  // 3 m at 1 m std, two dimensions
  EXPECT_EQ(j["nees_95_inside"].get<double>(), 0.0);     // 9 > chi2(0.975, 2) = 7.38
}

TEST(Evaluate, RequirementsDecideTheExitCode) {
  const auto truth = track("r_truth", 40, 5, none);
  const auto sol = track("r_sol", 40, 5, growing);
  const std::string base = "evaluate " + sol + " --truth " + truth + " --quiet --require ";
  EXPECT_EQ(run(base + "'horizontal_pct_max<0.2'").exit_code, 0);
  const auto missed = run(base + "'horizontal_pct_max<0.02'");
  EXPECT_EQ(missed.exit_code, 4);
  EXPECT_NE(missed.err.find("horizontal_pct_max<0.02"), std::string::npos) << missed.err;
  const auto unknown = run(base + "'horizontal_pct_mox<0.2'");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find("horizontal_pct_max"), std::string::npos) << unknown.err;
}

// A drive named by a relative path: its files are found beside its drive.toml, once.
TEST(Evaluate, TruthOfADriveNamedRelatively) {
  const auto o = run("simulate straight-road -o " + scratch_folder() + "/relative");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(scratch_folder());
  const auto e = run("evaluate relative/reference.csv --truth relative --json");
  std::filesystem::current_path(before);
  ASSERT_EQ(e.exit_code, 0) << e.err;
  EXPECT_LT(parse_json(e.out, "relative")["horizontal_max_m"].get<double>(), 1e-6);
}

// NIS per sensor with its band, whiteness per component, windows, and the JSON result's summary.
// estimation.md section 7
TEST(Evaluate, InnovationsAreJudged) {
  const auto truth = track("n_truth", 40, 5, none), there = track("n_there", 40, 5, constant);
  const std::string path = scratch_folder() + "/innovations.csv";
  const auto write = [&](double scale, double memory) {
    std::mt19937_64 rng(3);
    std::normal_distribution<double> g;
    std::ofstream out(path);
    out << "t_s,sensor,innovation,std,verdict\n";
    double a[3]{};
    for (int i = 0; i < 2000; ++i) {
      for (double& x : a) {  // three components at one time, each with its own memory
        x = memory * x + std::sqrt(1 - memory * memory) * g(rng);
        out << 0.3 * i << ",fix," << 2 * scale * x << ",2,used\n";
      }
      if (i % 4 == 0) out << 0.3 * i << ",odometer," << 0.1 * g(rng) << ",0.1,weighted\n";
    }
    out << "600,odometer,nan,0.1,used\n";
  };
  const std::string command =
      "evaluate " + there + " --truth " + truth + " --innovations " + path + " ";
  write(1, 0);
  const auto white = run(command + "--json");
  ASSERT_EQ(white.exit_code, 0) << white.err;
  Json j = parse_json(white.out, "white");
  EXPECT_EQ(j["innovations"]["fix"]["count"], 6000);
  EXPECT_EQ(j["innovations"]["odometer"]["deweighted"], 500);
  EXPECT_EQ(j["innovations"].size(), 2u);
  // chi-square of 6000: sd of the mean sqrt(2/6000) = 0.018, and the band 1.96 of them; four here,
  // so that the stream of the standard library's normals does not matter.
  EXPECT_NEAR(j["innovations"]["fix"]["nis_mean"].get<double>(), 1, 0.073);
  EXPECT_NEAR(j["innovations"]["fix"]["nis_low"].get<double>(), 0.9645, 1e-3);
  EXPECT_NEAR(j["innovations"]["fix"]["nis_high"].get<double>(), 1.0361, 1e-3);
  EXPECT_NEAR(j["innovations"]["fix"]["nis_above_95"].get<double>(), 0.05, 0.012);
  EXPECT_LT(std::fabs(j["innovations"]["fix"]["lag_one"].get<double>()), 0.052);
  EXPECT_NEAR(j["nis_mean"].get<double>(), 1, 0.073);
  EXPECT_NE(j["diagnostics"].dump().find("innovations.csv:"), std::string::npos);
  write(1, 0.5);
  j = parse_json(run(command + "--json").out, "coloured");
  EXPECT_TRUE(j["innovations"]["fix"]["coloured"].get<bool>());
  EXPECT_NEAR(j["innovations"]["fix"]["lag_one"].get<double>(), 0.5, 0.06);
  write(2, 0);  // the stated noise is half the true one
  EXPECT_EQ(run(command + "--require 'nis_mean<1.2'").exit_code, 4);
  EXPECT_EQ(run(command + "--require 'nis_mean>3'").exit_code, 0);
  const auto text = run(command);
  EXPECT_NE(text.out.find("above 95 %"), std::string::npos) << text.out;
  j = parse_json(run(command + "--json --from 300s").out, "half");
  EXPECT_EQ(j["innovations"]["fix"]["count"], 3000);
  // Without the file there is nothing to require.
  EXPECT_EQ(run("evaluate " + there + " --truth " + truth + " --require 'nis_mean<9'").exit_code,
            4);
  // The result of navigate --json, its summary as it is.
  std::ofstream(path) << R"({"command":"navigate","innovations":{"height":{"used":90,"deweighted":8,
    "rejected":2,"nis_mean":1.1,"nis_above_95":0.06,"lag_one":0.3}}})";
  j = parse_json(run(command + "--json").out, "json");
  EXPECT_EQ(j["innovations"]["height"]["count"], 100);
  EXPECT_TRUE(j["innovations"]["height"]["coloured"].get<bool>());
  for (const char* bad :
       {"{}", "{\"innovations\":{\"fix\":{\"used\":1}}}", "t_s,innovation,std\n1,1,1\n",
        "t_s,sensor,innovation,std\n", "t_s,sensor,innovation,std\n1,fix,1,0\n"}) {
    std::ofstream(path) << bad;
    const auto refused = run(command);
    EXPECT_EQ(refused.exit_code, 3) << bad;
    EXPECT_NE(refused.err.find("innovations.csv"), std::string::npos) << refused.err;
  }
}

TEST(Evaluate, BadInputIsNamed) {
  const auto truth = track("b_truth", 40, 5, none);
  const auto later = track("b_later", 40, 5, none, 5000);
  const auto apart = run("evaluate " + later + " --truth " + truth);
  EXPECT_EQ(apart.exit_code, 3);
  EXPECT_NE(apart.err.find("5000"), std::string::npos) << apart.err;
  EXPECT_EQ(run("evaluate " + scratch_folder() + "/nothing.csv --truth " + truth).exit_code, 3);
  EXPECT_EQ(run("evaluate " + truth).exit_code, 2);
  std::ofstream(scratch_folder() + "/empty.csv") << "";
  EXPECT_EQ(run("evaluate " + scratch_folder() + "/empty.csv --truth " + truth).exit_code, 3);
}

}  // namespace
}  // namespace loxo
