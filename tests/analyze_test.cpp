// SPDX-License-Identifier: Apache-2.0
// `loxo analyze` and `loxo allan` as a user runs them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "loxo/num/units.hpp"
#include "loxo/text/json.hpp"
#include "program.hpp"
#include "shared_folder.hpp"

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

// Numbers that the set's README asks of a loader: means and overlapping Allan deviations, from
// counts without a time column.
TEST(AllanRealData, Adis16405CountsMeetTheReadme) {
  const std::string folder = testing::shared_folder("data");
  if (folder.empty()) GTEST_SKIP() << "shared data is not here";
  const auto o = run("allan " + folder +
                     "/static_adis16405_1/imu_counts.csv.gz --rate 100Hz --gyro-unit 0.05deg/s "
                     "--accel-unit 0.00333g --json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto j = parse_json(o.out, "allan");
  EXPECT_EQ(j["samples"].get<long>(), 1000000);
  const struct {
    const char* axis;
    double unit, mean, at_10ms, at_1s, at_100s;
  } rows[] = {{"gyro_x", deg, 0.401686, 0.31912, 0.040900, 0.007224},
              {"gyro_y", deg, -0.415849, 0.33690, 0.043017, 0.008442},
              {"gyro_z", deg, -0.293543, 0.38489, 0.038668, 0.008173},
              {"accel_x", g_standard, -0.004411, 0, 0.0007207, 0.0003381},
              {"accel_y", g_standard, -0.002353, 0, 0.0005122, 0.0002845},
              {"accel_z", g_standard, -1.016129, 0, 0.0006206, 0.0002406}};
  for (const auto& r : rows) {
    const auto& a = j["axes"][r.axis];
    EXPECT_NEAR(a["mean"].get<double>() / r.unit, r.mean, 2e-6) << r.axis;
    // The curve between our averaging times (1.28 s, 0.96 s …), straight in logarithms.
    const auto at = [&](double tau) {
      const auto& p = a["points"];
      for (std::size_t i = 0; i < p.size(); ++i) {
        const double t1 = p[i]["tau_s"], y1 = p[i]["deviation"];
        if (t1 < tau * (1 - 1e-9)) continue;
        if (i == 0 || t1 < tau * (1 + 1e-9)) return y1 / r.unit;
        const double t0 = p[i - 1]["tau_s"], y0 = p[i - 1]["deviation"];
        return std::exp(std::log(y0) + std::log(y1 / y0) * std::log(tau / t0) / std::log(t1 / t0)) /
               r.unit;
      }
      return 0.0;
    };
    if (r.at_10ms > 0) {
      EXPECT_NEAR(at(0.01), r.at_10ms, 1e-5) << r.axis;
    }
    // Between 0.96 s and 1.28 s; the accelerometers' curve bends there by a slope of 1 (log 1.33 *
    // 1 / 8 = 4 % at most, half of it near an end).
    EXPECT_NEAR(at(1.0), r.at_1s, 0.02 * r.at_1s) << r.axis;
    // 100 windows: windows stepped by a 64th and interpolation, against every window at 100 s.
    EXPECT_NEAR(at(100.0), r.at_100s, 0.03 * r.at_100s) << r.axis;
    EXPECT_TRUE(a["usable"].get<bool>()) << a["why"];
  }
  // Data sheet: 2.0 deg/sqrt(h), 0.007 deg/s = 25 deg/h, 0.2 m/s/sqrt(h), 200 ug: the same size.
  EXPECT_NEAR(j["axes"]["gyro_x"]["angle_random_walk_deg_sqrt_h"].get<double>(), 2.3, 0.2);
  EXPECT_NEAR(j["axes"]["accel_y"]["velocity_random_walk_mps_sqrt_h"].get<double>(), 0.21, 0.03);
}

// A vehicle that rocks: no gyro axis may be taken for a sensor's noise, and the reason is said.
TEST(AllanRealData, LaserGyroOnARockingVehicleIsNotAtRest) {
  const std::string folder = testing::shared_folder("data");
  if (folder.empty()) GTEST_SKIP() << "shared data is not here";
  const auto o = run("allan " + folder + "/static_lasergyro_a/imu.csv.gz --json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto j = parse_json(o.out, "allan");
  for (const char* axis : {"gyro_x", "gyro_y", "gyro_z", "accel_z"}) {
    EXPECT_FALSE(j["axes"][axis]["usable"].get<bool>()) << axis;
    EXPECT_NE(j["axes"][axis]["why"].get<std::string>().find("moves or vibrates"),
              std::string::npos)
        << axis;
  }
  EXPECT_NE(j.dump().find("not_at_rest"), std::string::npos);
}

TEST(Allan, IncrementsAndTheLineForADrive) {
  std::mt19937_64 generator(9);
  std::normal_distribution<double> normal;
  const std::string path = scratch_folder() + "/increments.csv";
  std::ofstream out(path);
  out << "gx,gy,gz,ax,ay,az\n";  // counts of 0.1 arcsec and 0.1 mm/s at 100 Hz
  const double g = 0.05 * deg_per_sqrt_h * 0.1 / (0.1 * arcsec), a = 0.03 / 60 * 0.1 / 1e-4;
  for (int i = 0; i < 60000; ++i) {
    for (int k = 0; k < 3; ++k) out << (k ? "," : "") << g * normal(generator);
    for (int k = 0; k < 3; ++k) out << ',' << a * normal(generator) + (k == 2 ? 981 : 0);
    out << '\n';
  }
  out.close();
  const std::string table = path +
                            " --rate 100Hz --increments --gyro-unit 0.1arcsec --accel-unit "
                            "0.1mm/s ";
  const auto o = run("allan " + table + "--json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto j = parse_json(o.out, "allan");
  for (const char* axis : {"gyro_x", "gyro_y", "gyro_z"})
    EXPECT_NEAR(j["axes"][axis]["angle_random_walk_deg_sqrt_h"].get<double>(), 0.05, 0.002);
  EXPECT_NEAR(j["axes"]["accel_z"]["mean"].get<double>(), 9.81, 1e-4);
  const auto line = run("allan " + table + "--errors");
  ASSERT_EQ(line.exit_code, 0) << line.err;
  EXPECT_EQ(line.out.rfind("errors = { gyro_noise = \"0.0", 0), 0u) << line.out;
  // It drops into a drive.
  const std::string drive = scratch_folder() + "/with_errors";
  ASSERT_EQ(run("simulate straight-road -o " + drive).exit_code, 0);
  std::string toml = testing::slurp(drive + "/drive.toml");
  const auto from = toml.find("errors = ", toml.find("[imu]")), to = toml.find('\n', from);
  ASSERT_NE(from, std::string::npos);
  toml.replace(from, to - from, line.out.substr(0, line.out.find('\n')));
  std::ofstream(drive + "/drive.toml") << toml;
  EXPECT_EQ(run("inspect " + drive).exit_code, 0);
}

TEST(Allan, RefusesAndTells) {
  const std::string path = scratch_folder() + "/gaps.csv";
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  std::ofstream out(path);
  out << "t_s,gx\n";
  for (int i = 0; i < 3000; ++i)
    out << (i < 2000 ? 0.01 * i : 0.01 * i + 5) << ',' << normal(generator) << '\n';
  out.close();
  const auto gaps = run("allan " + path);
  EXPECT_EQ(gaps.exit_code, 0);
  EXPECT_NE(gaps.err.find("5.01 s without samples"), std::string::npos) << gaps.err;
  const struct {
    std::string arguments;
    int code;
    const char* says;
  } cases[] = {
      {path + " --tau-max 1000s", 3, "shorter than the asked averaging times"},
      {path + " --kind hadamrad", 2, "hadamard"},
      {path + " --gyro-unit 0deg/s", 2, "above 0"},
      {path + " --gyro-unit 0.1", 2, "--gyro-unit"},
      {path + " --rate 0Hz", 2, "--rate"},
      {path + " --kind modified --errors", 2, "--errors"},
  };
  for (const auto& c : cases) {
    const auto o = run("allan " + c.arguments);
    EXPECT_EQ(o.exit_code, c.code) << c.arguments << o.err;
    EXPECT_NE(o.err.find(c.says), std::string::npos) << c.arguments << ": " << o.err;
  }
  std::ofstream(scratch_folder() + "/untimed.csv") << "gx\n1\n2\n";
  const auto untimed = run("allan " + scratch_folder() + "/untimed.csv");
  EXPECT_EQ(untimed.exit_code, 3);
  EXPECT_NE(untimed.err.find("--rate"), std::string::npos) << untimed.err;
}

// Each analysis as a page: its figures are in it.
TEST(AnalyzeReport, EveryAnalysisHasItsPage) {
  const std::string f = scratch_folder();
  ASSERT_EQ(run("analyze static --lat 89.9deg --lon 45deg --earth sphere --gyro-bias 0.001deg/h "
                "--accel-bias 10ug --tilt 30arcsec --gyro-noise '0.001deg/sqrt(h)' -o " +
                f + "/static.json")
                .exit_code,
            0);
  ASSERT_EQ(run("analyze roots --lat 30deg -o " + f + "/roots.json").exit_code, 0);
  ASSERT_EQ(run("analyze budget city-drive --heading-std 1arcmin --scale-std 0.1% -o " + f +
                "/budget.json")
                .exit_code,
            0);
  ASSERT_EQ(run("analyze odometer --length 10km --heading-std 1arcmin --benchmark-std 0.1m -o " +
                f + "/odometer.json")
                .exit_code,
            0);
  const auto o = run("report " + f + "/static.json " + f + "/roots.json " + f + "/budget.json " +
                     f + "/odometer.json -o " + f + "/analysis.html");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto page = testing::slurp(f + "/analysis.html");
  for (const char* title :
       {"Static response", "Azimuth error", "White noise at the end", "Characteristic roots",
        "Schuler-Foucault low", "Variance of the horizontal position, by source",
        "What each source alone would do", "Odometer calibration, error analysis",
        "Angle over the length of the drive"})
    EXPECT_NE(page.find(title), std::string::npos) << title;
}

TEST(AnalyzeNoise, DataSheetToSamplesAndBack) {
  const auto o = run("analyze noise '2deg/sqrt(h)' --rate 100Hz --json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto j = parse_json(o.out, "noise");
  EXPECT_NEAR(j["sample_std_deg_s"].get<double>(), 2.0 / 60 * 10, 1e-12);
  EXPECT_NEAR(j["density_one_sided_deg_s_sqrt_hz"].get<double>(), 2.0 / 60 * std::sqrt(2.0), 1e-12);
  const auto back = parse_json(
      run("analyze noise 0.33333333333333333deg/s --as sample --rate 100Hz --json").out, "noise");
  EXPECT_NEAR(back["angle_random_walk_deg_sqrt_h"].get<double>(), 2.0, 1e-12);
  const auto floor =
      parse_json(run("analyze noise 25deg/h --as floor --tau 100s --rate 100Hz --json").out, "n");
  EXPECT_NEAR(floor["bias_instability_deg_h"].get<double>(), 25 / 0.664282470, 1e-6);
  EXPECT_EQ(run("analyze noise -- -1deg/h").exit_code, 2);
  EXPECT_EQ(run("analyze noise 1deg/h").exit_code, 2);  // what of it? --as
  EXPECT_EQ(run("analyze noise 1deg/h --as sample").exit_code, 2);
  EXPECT_EQ(run("analyze noise 1kg").exit_code, 2);
}

TEST(AnalyzeStatic, RefusesWhatMeansNothing) {
  const struct {
    const char* arguments;
    int code;
    const char* says;
  } cases[] = {
      {"--lat 0deg --lon 90deg --gyro-bias 0.01deg/h", 3, "no axes at its pole"},
      {"--frame geographic --lat 90deg --gyro-bias 0.01deg/h", 3, "no axes at its pole"},
      {"--lat 91deg --gyro-bias 0.01deg/h", 2, "--lat"},
      {"--lat 40deg", 2, "no error given"},
      {"--lat 40deg --gyro-bias 0.01deg", 2, "--gyro-bias"},
      {"--lat 40deg --gyro-noise=-1deg/sqrt\\(h\\)", 2, "never negative"},
      {"--lat 40deg --gyro-bias 0.01deg/h --frame transvers", 2, "transverse"},
      {"--lat 40deg --gyro-bias 0.01deg/h --step 0s", 2, "--step"},
  };
  for (const auto& c : cases) {
    const auto o = run(std::string("analyze static ") + c.arguments);
    EXPECT_EQ(o.exit_code, c.code) << c.arguments << o.err;
    EXPECT_NE(o.err.find(c.says), std::string::npos) << c.arguments << ": " << o.err;
  }
}

}  // namespace
}  // namespace loxo
