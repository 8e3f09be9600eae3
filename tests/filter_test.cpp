// SPDX-License-Identifier: Apache-2.0
// `loxo navigate --mode filter|smooth|segmented` as a user runs it, on a small drive written here:
// what it finds, and what it says about bad input.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>
#include <string>

#include "loxo/estimate/exact_route.hpp"
#include "loxo/log/solution_file.hpp"
#include "loxo/study/filter_settings.hpp"
#include "loxo/study/filter_start.hpp"
#include "loxo/study/online_calibration.hpp"
#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo {
namespace {

namespace fs = std::filesystem;

struct Spec {
  double odometer_unit = 1.0;   // factor on the readings
  double mounting = 1.0 * deg;  // IMU clockwise from the vehicle
  bool moves = true;
  bool unsigned_reverse = false;
  double length = 240;
  std::string fix_errors = "errors = { position = \"3 m\" }\n";
  std::string extra;
  double gyro_up = 1.0;  // factor on the up gyro: -1 is a wrong axis
  std::string start =
      "alignment = { kind = \"static\", duration = \"60 s\" }\nattitude = { heading = \"34.3775 "
      "deg\", heading_std = \"1 deg\" }\n";
  std::function<std::string(int, double)> fix_line;  // replaces a line of the fixes
};

// 60 s at rest, then a drive of turns; 50 Hz IMU, 10 Hz distances, a fix a second.
fs::path write_drive(const std::string& name, const Spec& spec) {
  const fs::path folder = fs::path(loxo::testing::scratch_folder()) / name;
  fs::create_directories(folder);
  const double dt = 0.02;
  const ExactRoute route = make_exact_route(
      wgs84(), Geodetic<double>{50 * deg, 10 * deg, 100},
      [](double t) {
        return 0.6 + std::clamp((t - 90) * 0.1, 0.0, 1.2) - std::clamp((t - 140) * 0.1, 0.0, 1.5) +
               std::clamp((t - 190) * 0.1, 0.0, 1.0);
      },
      [&](double t) {
        if (!spec.moves) return 0.0;
        const double u = std::clamp(t - 60, 0.0, 12.0);
        return u - std::clamp((t - 210) * 2, 0.0, spec.unsigned_reverse ? 16.0 : 8.0);
      },
      spec.length, dt, spec.mounting);
  std::mt19937_64 rng(5);
  std::normal_distribution<double> g;
  std::ofstream imu(folder / "imu.csv"), odo(folder / "odo.csv"), fix(folder / "fix.csv"),
      toml(folder / "drive.toml");
  imu << "t_s,gx,gy,gz,ax,ay,az\n";
  odo << "t_s,ds_m\n";
  fix << "t_s,lat_deg,lon_deg,h_m\n";
  imu.precision(12), odo.precision(9), fix.precision(14);
  for (std::size_t i = 1; i < route.q.size(); ++i) {
    const double t = static_cast<double>(i) * dt, w = 2e-4, f = 5e-3;
    const Vec<Body>& a = route.dtheta[i];
    const Vec<Body>& b = route.dv[i];
    imu << t << ',' << a.x / dt + w * g(rng) << ',' << a.y / dt + w * g(rng) << ','
        << spec.gyro_up * a.z / dt + w * g(rng) << ',' << b.x / dt + f * g(rng) << ','
        << b.y / dt + f * g(rng) << ',' << b.z / dt + f * g(rng) << '\n';
    if (i % 5 == 0) {
      double ds = route.distance[i] - route.distance[i - 5];
      if (spec.unsigned_reverse) ds = std::fabs(ds);
      odo << t << ',' << 1.02 * ds * spec.odometer_unit << '\n';
    }
    if (i % 50 == 0) {
      const Geodetic<double> p =
          to_geodetic(wgs84(), route.r[i] + Vec<Ecef>{3 * g(rng), 3 * g(rng), 3 * g(rng)});
      const std::string line = spec.fix_line ? spec.fix_line(static_cast<int>(i / 50), t) : "";
      if (!line.empty()) {
        fix << line << '\n';
      } else {
        fix << t << ',' << p.lat / deg << ',' << p.lon / deg << ',' << p.h << '\n';
      }
    }
  }
  toml << "format = 1\nname = \"" << name
       << "\"\n[imu]\nfile = \"imu.csv\"\ncolumns = { time = \"t_s\", gyro = [\"gx\", \"gy\", "
          "\"gz\"], accel = [\"ax\", \"ay\", \"az\"] }\n"
       << "units = { gyro = \"rad/s\", accel = \"m/s^2\" }\nerrors = { gyro_bias = \"1 deg/h\", "
          "gyro_noise = \"0.1 deg/sqrt(h)\", accel_bias = \"300 ug\", accel_noise = \"0.05 "
          "m/s/sqrt(h)\" }\n"
       << "[odometer]\nfile = \"odo.csv\"\nkind = \"distance\"\ncolumns = { time = \"t_s\", value "
          "= \"ds_m\" }\n"
       << "[fix]\nfile = \"fix.csv\"\ncolumns = { time = \"t_s\", lat = \"lat_deg\", lon = "
          "\"lon_deg\", height = \"h_m\" }\n"
       << spec.fix_errors << "[start]\nt_s = 0.0\nlat_deg = 50.0\nlon_deg = 10.0\nh_m = 100.0\n"
       << spec.start << spec.extra;
  return folder;
}

std::size_t rows_of(const fs::path& solution) {
  Diagnostics d;
  return read_solution(solution.string(), wgs84(), d).rows.size();
}

struct Ran {
  loxo::testing::Outcome result;
  fs::path solution;
};
Ran navigate(const fs::path& folder, const std::string& mode, const std::string& options = "") {
  Ran r;
  r.solution = folder / (mode + ".csv");
  r.result = loxo::testing::run("navigate " + folder.string() + " --mode " + mode + " " + options +
                                " -o " + r.solution.string());
  return r;
}

TEST(Filter, FindsScaleAndMountingOnASmallDrive) {
  const Spec spec;
  const fs::path d = write_drive("plain", spec);
  for (const char* mode : {"filter", "smooth"}) {
    const Ran r = navigate(d, mode, "--json");
    ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
    const Json j = parse_json(r.result.out, "stdout");
    const double k = j["constants"]["k"], ks = j["constants"]["k_std"],
                 e = j["constants"]["eps_deg"], es = j["constants"]["eps_deg_std"];
    EXPECT_NEAR(k, 1.02, 4 * ks);
    EXPECT_LT(ks, 5e-3);
    EXPECT_NEAR(e, 1.0, 4 * es);
    EXPECT_GT(rows_of(r.solution), 1000u);
    const Json& odometer = j["innovations"]["odometer"];
    EXPECT_LT(static_cast<double>(odometer["nis_low"]), 1.0);
    EXPECT_GT(static_cast<double>(odometer["nis_high"]), 1.0);
    EXPECT_EQ(j["innovation_history"]["t_s"].size(), j["innovation_history"]["odometer"].size());
    EXPECT_GT(j["innovation_history"]["t_s"].size(), 10u);
  }
  const Ran s = navigate(d, "segmented", "--json");
  ASSERT_EQ(s.result.exit_code, 0) << s.result.err;
  EXPECT_EQ(parse_json(s.result.out, "stdout")["mode"], "segmented");
  // In the turn from 90 s on, at 6 deg/s, the velocity points where the vehicle does: the IMU
  // stands 1 deg clockwise of it. A velocity of the second behind it would point 3 deg back.
  Diagnostics told;
  int turning = 0;
  for (const SolutionRow& r : read_solution(s.solution.string(), wgs84(), told).rows) {
    EXPECT_GT(r.std_heading, 0) << r.t;
    if (r.t < 92 || r.t > 101) continue;
    EXPECT_NEAR(wrap_pi(std::atan2(r.ve, r.vn) - r.heading) / deg, -1, 1) << r.t;
    ++turning;
  }
  EXPECT_GT(turning, 5);
}
// Every innovation in a file, and evaluate's judgement of it equals the filter's own.
TEST(Filter, InnovationsAreWrittenAndJudged) {
  const fs::path d = write_drive("innovations", Spec{});
  const std::string file = (d / "innovations.csv").string(), json = (d / "result.json").string();
  const Ran r = navigate(d, "filter", "--json --innovations " + file);
  ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
  std::ofstream(json) << r.result.out;
  const Json own = parse_json(r.result.out, "navigate")["innovations"];
  const std::string evaluate =
      "evaluate " + r.solution.string() + " --truth " + r.solution.string() + " --json ";
  const auto judged = loxo::testing::run(evaluate + "--innovations " + file);
  ASSERT_EQ(judged.exit_code, 0) << judged.err;
  const Json j = parse_json(judged.out, "evaluate");
  ASSERT_EQ(j["innovations"].size(), own.size());
  for (const auto& [name, e] : own.items()) {
    const Json& f = j["innovations"][name];
    EXPECT_EQ(f["count"].get<long>(),
              e["used"].get<long>() + e["deweighted"].get<long>() + e["rejected"].get<long>());
    EXPECT_NEAR(f["nis_mean"].get<double>(), e["nis_mean"].get<double>(), 1e-9) << name;
    EXPECT_NEAR(f["nis_above_95"].get<double>(), e["nis_above_95"].get<double>(), 1e-12) << name;
  }
  const auto summary = loxo::testing::run(evaluate + "--innovations " + json);
  ASSERT_EQ(summary.exit_code, 0) << summary.err;
  EXPECT_NEAR(parse_json(summary.out, "summary")["nis_mean"].get<double>(),
              j["nis_mean"].get<double>(), 1e-9);
  EXPECT_EQ(navigate(d, "segmented", "--innovations " + file).result.exit_code, 2);
}
// What a drive declares of an external height, a heading sensor, an antenna and the gyros' triad
// becomes a state; without the declaration it is none.
TEST(Filter, DeclaredBiasesAreEstimated) {
  Spec spec;
  const std::string sensors =
      "[height]\nfile = \"alt.csv\"\ncolumns = { time = \"t_s\", height = \"h_m\" }\nerrors = { "
      "height = \"0.5 m\"%s }\n[heading]\nfile = \"heading.csv\"\ncolumns = { time = \"t_s\", "
      "heading = \"heading_deg\" }\nerrors = { heading = \"0.3 deg\"%s }\n";
  const auto with = [&](const std::string& height, const std::string& heading) {
    std::string text = sensors;
    text.replace(text.find("%s"), 2, height);
    text.replace(text.find("%s"), 2, heading);
    return text;
  };
  spec.extra = with(", bias = \"20 m\"", ", heading_bias = \"5 deg\"");
  spec.fix_errors = "errors = { position = \"3 m\", lever_arm = \"1 m\" }\n";
  const fs::path d = write_drive("biases", spec);
  {
    std::ofstream alt(d / "alt.csv"), heading(d / "heading.csv");
    alt << "t_s,h_m\n", heading << "t_s,heading_deg\n";
    alt.precision(12), heading.precision(12);
    std::mt19937_64 rng(7);
    std::normal_distribution<double> g;
    for (int t = 1; t < 240; ++t) {
      alt << t << ',' << 100 + 8 + 0.5 * g(rng) << '\n';
      const double course = 0.6 + std::clamp((t - 90) * 0.1, 0.0, 1.2) -
                            std::clamp((t - 140) * 0.1, 0.0, 1.5) +
                            std::clamp((t - 190) * 0.1, 0.0, 1.0);
      heading << t << ',' << course / deg + 1.0 - 2.0 + 0.3 * g(rng) << '\n';
    }
  }
  for (const char* mode : {"filter", "smooth"}) {
    const Ran r = navigate(d, mode, "--json");
    ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
    const Json j = parse_json(r.result.out, "stdout");
    const auto expect = [&](const std::string& key, double truth, double prior) {
      ASSERT_TRUE(j["constants"].contains(key)) << key;
      const double value = j["constants"][key], std = j["constants"][key + "_std"];
      EXPECT_NEAR(value, truth, 4 * std) << key;
      EXPECT_LT(std, prior) << key;
    };
    expect("height_bias_m", 8.0, 2.0);
    expect("heading_bias_deg", -2.0, 1.0);
    expect("antenna_right_m", 0.0, 1.0);
    EXPECT_FALSE(j["constants"].contains("gyro_misalignment_right_to_up_mrad"));
  }
  spec.extra = with("", "");
  spec.fix_errors = "errors = { position = \"3 m\" }\n";
  write_drive("biases", spec);
  const Ran none = navigate(d, "filter", "--json --without heights,headings");
  ASSERT_EQ(none.result.exit_code, 0) << none.result.err;
  const Json j = parse_json(none.result.out, "stdout");
  EXPECT_FALSE(j["constants"].contains("height_bias_m"));
  EXPECT_FALSE(j["constants"].contains("antenna_up_m"));
  const Ran misaligned =
      navigate(d, "filter", "--json --set 'imu.errors.gyro_misalignment=\"1 mrad\"'");
  ASSERT_EQ(misaligned.result.exit_code, 0) << misaligned.result.err;
  EXPECT_TRUE(parse_json(misaligned.result.out, "stdout")["constants"].contains(
      "gyro_misalignment_right_to_up_mrad"));
}
TEST(Filter, OnlineCalibrationTellsWhatItKnows) {
  Diagnostics d;
  const OnlineCalibration c =
      online_calibration(read_drive(write_drive("online", Spec{}).string()), d);
  ASSERT_TRUE(c.valid) << c.why;
  EXPECT_NEAR(c.k, 1.02, 4 * c.k_std);
  EXPECT_NEAR(c.eps, 1 * deg, 4 * c.eps_std);
  Spec still;
  still.moves = false;
  still.length = 100;
  const OnlineCalibration n =
      online_calibration(read_drive(write_drive("online_still", still).string()), d);
  EXPECT_FALSE(n.valid);
  EXPECT_NE(n.why.find("scale"), std::string::npos) << n.why;
}
TEST(Filter, WrongOdometerUnitIsFoundFromTheImu) {
  Spec spec;
  spec.odometer_unit = 3.6;
  const Ran r = navigate(write_drive("unit", spec), "filter", "--json");
  EXPECT_EQ(r.result.exit_code, 0) << r.result.err;
  EXPECT_NE(r.result.out.find("odometer_unit"), std::string::npos) << r.result.out;
  EXPECT_NE(r.result.out.find("km/h"), std::string::npos);
}
// Ten sigma from what an undeclared scale is taken for: without a start from the IMU its wheel
// would be rejected from the first metre.
TEST(Filter, AScaleFarFromOneIsFound) {
  for (const double k : {0.8, 1.3}) {
    Spec spec;
    spec.odometer_unit = k;
    const Ran r =
        navigate(write_drive("scale" + std::to_string(k), spec), "filter", "--no-fixes --json");
    ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
    EXPECT_NE(r.result.out.find("times the true way"), std::string::npos) << r.result.out;
    const Json c = parse_json(r.result.out, "stdout")["constants"];
    EXPECT_LT(std::fabs(c["k"].get<double>() - 1.02 * k), 4 * c["k_std"].get<double>()) << c;
    EXPECT_LT(c["k_std"].get<double>(), 0.02);
  }
}

TEST(Filter, MountingNear90And180IsFound) {
  for (double eps : {90.0, 179.0, -90.0}) {
    Spec spec;
    spec.mounting = eps * deg;
    spec.start =
        "alignment = { kind = \"static\", duration = \"60 s\" }\nattitude = { heading = \"" +
        std::to_string(0.6 / deg + eps) + " deg\", heading_std = \"1 deg\" }\n";
    const Ran r = navigate(write_drive("mount" + std::to_string(static_cast<int>(eps)), spec),
                           "filter", "--json");
    ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
    const Json j = parse_json(r.result.out, "stdout");
    const double e = j["constants"]["eps_deg"], es = j["constants"]["eps_deg_std"];
    EXPECT_NEAR(std::remainder(e - eps, 360.0), 0.0, 4 * es + 0.05) << eps;
    EXPECT_NEAR(static_cast<double>(j["constants"]["k"]), 1.02, 0.02);
  }
}
TEST(Filter, UnsignedWheelAndReversing) {
  Spec spec;
  spec.unsigned_reverse = true;
  const Ran r = navigate(write_drive("reverse", spec), "filter", "--json");
  ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
  const Json j = parse_json(r.result.out, "stdout");
  EXPECT_NE(r.result.out.find("unsigned_wheel"), std::string::npos);
  EXPECT_NEAR(static_cast<double>(j["constants"]["k"]), 1.02,
              5 * static_cast<double>(j["constants"]["k_std"]));
}
TEST(Filter, NoMotionIsSaid) {
  Spec spec;
  spec.moves = false;
  spec.length = 100;
  const Ran r = navigate(write_drive("still", spec), "filter");
  EXPECT_EQ(r.result.exit_code, 0) << r.result.err;
  EXPECT_NE(r.result.err.find("cannot be observed"), std::string::npos) << r.result.err;
}
TEST(Filter, BenchmarkFarFromTheTrackIsSaid) {
  Spec spec;
  spec.extra =
      "[[benchmark]]\nname = \"B\"\nt_s = 120\nlat_deg = 50.02\nlon_deg = 10.0\nh_m = 100\nstd = "
      "\"0.1 m\"\n";
  const Ran r = navigate(write_drive("far", spec), "filter");
  EXPECT_EQ(r.result.exit_code, 0) << r.result.err;
  EXPECT_NE(r.result.err.find("far from the track"), std::string::npos) << r.result.err;
}
TEST(Filter, MeasurementsWithoutCovarianceAreSaid) {
  Spec spec;
  spec.fix_errors = "";
  const Ran r = navigate(write_drive("nocov", spec), "filter");
  EXPECT_EQ(r.result.exit_code, 0) << r.result.err;
  EXPECT_NE(r.result.err.find("no standard deviation"), std::string::npos) << r.result.err;
}
TEST(Filter, ZeroAndNegativeSigmasAreRefused) {
  for (const char* s : {"0 m", "-3 m"}) {
    Spec spec;
    spec.fix_errors = std::string("errors = { position = \"") + s + "\" }\n";
    const Ran r = navigate(write_drive("sigma", spec), "filter");
    EXPECT_EQ(r.result.exit_code, 3) << s;
    EXPECT_NE(r.result.err.find("position"), std::string::npos) << r.result.err;
    EXPECT_FALSE(fs::exists(r.solution));
  }
}
TEST(Filter, RowsOutOfOrderAreSaid) {
  Spec spec;
  spec.fix_line = [](int n, double) {
    return n == 100 ? std::string("50.0,50.0,10.0,100.0") : std::string();
  };
  const Ran r = navigate(write_drive("order", spec), "filter");
  EXPECT_EQ(r.result.exit_code, 0) << r.result.err;
  EXPECT_NE(r.result.err.find("time goes back"), std::string::npos) << r.result.err;
}
TEST(Filter, PoorAlignmentIsRefusedWithTheReason) {
  Spec spec;
  spec.start = "alignment = { kind = \"static\", duration = \"60 s\" }\n";
  const fs::path d = write_drive("align", spec);
  const Ran r = navigate(d, "filter");
  EXPECT_EQ(r.result.exit_code, 1);
  EXPECT_NE(r.result.err.find("heading to"), std::string::npos) << r.result.err;
  EXPECT_NE(r.result.err.find("--force"), std::string::npos);
  EXPECT_EQ(navigate(d, "filter", "--force").result.exit_code, 0);
}
TEST(Filter, OptionsAreChecked) {
  const fs::path d = write_drive("options", Spec{});
  for (const char* o : {"--use wheel", "--without nhcc", "--outage 100s", "--outage 100:20",
                        "--fixes-until 100", "--output-rate 0Hz"}) {
    const Ran r = navigate(d, "filter", o);
    EXPECT_EQ(r.result.exit_code, 2) << o << r.result.err;
  }
  EXPECT_EQ(
      navigate(d, "filter", "--use odometer,nhc,zupt,zaru --outage 100s:50s").result.exit_code, 0);
}

Solution solution_of(const fs::path& path) {
  Diagnostics d;
  return read_solution(path.string(), wgs84(), d);
}
// The frame of the rows is a choice of words: covariance and strapdown stand on ECEF axes.
TEST(Filter, EveryFrameGivesTheSameSolution) {
  Spec spec;
  spec.length = 120;
  const fs::path d = write_drive("frames", spec);
  Solution first;
  for (const char* frame : {"ecef", "geographic", "transverse", "grid", "wander", "auto"}) {
    const Ran r = navigate(d, "filter", std::string("--meridian 12deg --frame ") + frame);
    ASSERT_EQ(r.result.exit_code, 0) << frame << r.result.err;
    const Solution s = solution_of(r.solution);
    const std::string want = std::string(frame) == "auto" ? "geographic" : frame;
    for (const SolutionRow& row : s.rows) ASSERT_EQ(frame_name(row.frame), want);
    if (first.rows.empty()) {
      first = s;
      continue;
    }
    ASSERT_EQ(s.rows.size(), first.rows.size());
    EXPECT_EQ(s.rows.back().x, first.rows.back().x) << frame;
    EXPECT_EQ(s.rows.back().std_e, first.rows.back().std_e) << frame;
  }
  const Ran r = navigate(d, "filter", "--meridian 12");
  EXPECT_EQ(r.result.exit_code, 2);
  EXPECT_NE(r.result.err.find("--meridian"), std::string::npos) << r.result.err;
}
TEST(Filter, StartsFromACertificate) {
  Spec spec;
  spec.length = 150;
  const fs::path d = write_drive("certificate", spec);
  const fs::path c = d / "cert.json";
  std::ofstream(c) << R"({"k": 1.02, "k_std": 1e-4, "eps_deg": 1.0, "eps_std_deg": 0.01})";
  for (const char* mode : {"filter", "smooth"}) {
    const Ran r = navigate(d, mode, "--json --no-fixes --calibration " + c.string());
    ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
    const Json j = parse_json(r.result.out, "stdout");
    const double k = j["constants"]["k"], ks = j["constants"]["k_std"],
                 eps = j["constants"]["eps_deg"], es = j["constants"]["eps_deg_std"];
    // No more than the certificate's own sigma and the walk of k over the drive.
    EXPECT_LT(ks, std::hypot(1e-4, 3e-5 * std::sqrt(spec.length)) * 1.001);
    EXPECT_NEAR(k, 1.02, 4 * ks);
    EXPECT_LE(es, 0.0101);
    EXPECT_NEAR(eps, 1.0, 4 * es);
  }
  const Ran s = navigate(d, "segmented", "--json --calibration " + c.string());
  ASSERT_EQ(s.result.exit_code, 0) << s.result.err;
  fs::remove(d / "filter.csv");
  std::ofstream(c) << R"({"k": 1.02, "k_std": -1, "eps_deg": 1.0})";
  const Ran bad = navigate(d, "filter", "--calibration " + c.string());
  EXPECT_EQ(bad.result.exit_code, 3);
  EXPECT_NE(bad.result.err.find("k_std"), std::string::npos) << bad.result.err;
  EXPECT_FALSE(fs::exists(bad.solution));
  EXPECT_EQ(navigate(d, "filter", "--calibration nowhere.json").result.exit_code, 3);
}
TEST(Filter, AStateGivenNamesItsHeading) {
  const fs::path folder = fs::path(loxo::testing::scratch_folder()) / "filter_state";
  ASSERT_EQ(loxo::testing::run("simulate city-drive --quiet -o " + folder.string() +
                               " --set imu.rate=20Hz --set reference.rate=1Hz")
                .exit_code,
            0);
  const auto r = loxo::testing::run("navigate " + folder.string() + " --mode filter --json -o " +
                                    folder.string() + "/s.csv");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto reference =
      loxo::testing::columns(loxo::testing::slurp(folder.string() + "/reference.csv"));
  const Json a = parse_json(r.out, "stdout")["alignment"];
  EXPECT_EQ(a["method"], "state");
  // To the reference's rounding on its way through a quaternion.
  EXPECT_NEAR(a["heading_deg"].get<double>(),
              std::strtod(reference.at("heading_deg")[0].c_str(), nullptr), 1e-9);
}

// A level that is given owes nothing to the accelerometers: were it believed to, their bias would
// cancel against it and be missing from the velocity's sigma.
TEST(Filter, AStateGivenSaysNothingOfTheAccelerometers) {
  const std::string folder = loxo::testing::scratch_folder() + "/filter_given";
  ASSERT_EQ(loxo::testing::run("simulate city-drive --quiet -o " + folder + " --set imu.rate=20Hz")
                .exit_code,
            0);
  const Drive drive = read_drive(folder);
  NavigatorConfig c;
  c.ellipsoid = drive.ellipsoid;
  c.gyro_bias = 1e-5, c.accel_bias = 0.02;
  Diagnostics d;
  const FilterStart b = filter_start(drive, FilterOptions{}, c, DriveMeasurements{}, 0.05, d);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_EQ(b.start.P.p[kPsi + i][kBa + j], 0) << i << j;
    EXPECT_DOUBLE_EQ(b.start.P.p[kBa + i][kBa + i], 0.02 * 0.02);
  }
}

// A simulated drive declares what its sensors have: a bias over its range of temperature, and what
// lasts of a height apart from its noise.
TEST(Filter, ASimulatedDriveDeclaresWhatLasts) {
  const std::string folder = loxo::testing::scratch_folder() + "/filter_declared";
  ASSERT_EQ(
      loxo::testing::run("simulate mountain-road --quiet -o " + folder + " --set imu.rate=20Hz")
          .exit_code,
      0);
  const Drive drive = read_drive(folder);
  // 5 deg/h, 0.5 deg/h/K over 15 K, 2 deg/h/g; 1 mg, 20 ug/K over 15 K.
  EXPECT_NEAR(drive.imu_errors.gyro_bias / deg_per_h, std::hypot(5, 7.5, 2), 2e-3);
  EXPECT_NEAR(drive.imu_errors.accel_bias / ug, std::hypot(1000, 300), 1e-6);
  EXPECT_DOUBLE_EQ(drive.height_std, 0.3);
  EXPECT_DOUBLE_EQ(drive.height_bias, 2);
  EXPECT_DOUBLE_EQ(drive.height_bias_tau, 900);
  std::map<std::string, std::string> meta;
  const NavigatorConfig c = settings_of(drive, FilterOptions{}, 0.05, 0.1, false, kNone, meta);
  EXPECT_DOUBLE_EQ(c.height_bias_walk, 2 * std::sqrt(2.0 / 900));
}

// What a simulated start and wheel have wrong stands in the drive, and the filter takes it from
// there.
TEST(Filter, ASimulatedDriveDeclaresItsStartAndItsWheel) {
  const std::string folder = loxo::testing::scratch_folder() + "/filter_declared_start";
  ASSERT_EQ(
      loxo::testing::run(
          "simulate city-drive --quiet -o " + folder +
          " --set imu.rate=20Hz --set odometer.noise='\"0.05 m\"' --set "
          "odometer.distance_noise='\"0.01 m/sqrt(m)\"' --set start_error.right='\"3 m\"' "
          "--set start_error.forward='\"4 m\"' --set start_error.v_right='\"0.2 m/s\"' "
          "--set start_error.tilt_forward='\"0.2 deg\"' --set start_error.tilt_up='\"-2 deg\"'")
          .exit_code,
      0);
  const Drive drive = read_drive(folder);
  EXPECT_NEAR(drive.start.position_std, 5 / std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(drive.start.velocity_std, 0.2 / std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(drive.start.level_std / deg, 0.2 / std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(drive.start.heading_std / deg, 2, 1e-9);
  EXPECT_DOUBLE_EQ(drive.odometer_errors.noise, 0.05);
  EXPECT_DOUBLE_EQ(drive.odometer_errors.distance_noise, 0.01);
  std::map<std::string, std::string> meta;
  const NavigatorConfig c = settings_of(drive, FilterOptions{}, 0.05, 0.1, false, kNone, meta);
  EXPECT_DOUBLE_EQ(c.reading_noise, 0.05);
  EXPECT_DOUBLE_EQ(c.way_noise, 0.01);
  Diagnostics d;
  const FilterStart b = filter_start(drive, FilterOptions{}, c, DriveMeasurements{}, 0.05, d);
  const auto& P = b.start.P.p;
  EXPECT_NEAR(P[kDr][kDr], 12.5, 1e-9);
  EXPECT_NEAR(P[kDv][kDv], 0.02, 0.02);  // and what the level and the position carry
  EXPECT_NEAR(P[0][0] + P[1][1] + P[2][2], (0.04 + 4) * deg * deg, 1e-3 * deg * deg);
}

// What the IMU's own acceleration says of an odometer nobody has mounted straight: noisy readings
// of a slow vehicle, an encoder that dies, one start and a constant speed. From there the filter
// finds the rest, inside what it states.
TEST(Filter, AMountingIsFoundFromLittle) {
  struct Case {
    const char *name, *speed, *length;
    double mounting;
    const char* odometer;
  };
  for (const Case& c :
       {Case{"slow", "2.7 m/s", "0.7 km", 180, "rate = \"10 Hz\"\nnoise = \"0.05 m\""},
        Case{"dead", "7 m/s", "2 km", -84,
             "rate = \"20 Hz\"\n[[odometer.dead]]\nfrom = \"160 s\"\nto = \"190 s\""},
        Case{"once", "3 m/s", "0.8 km", 111,
             "rate = \"20 Hz\"\nscale_noise = \"1 %\"\nnoise = \"0.05 m\""}}) {
    const std::string folder = loxo::testing::scratch_folder() + "/filter_mounting_" + c.name;
    std::ofstream(folder + ".toml")
        << "seed = 3\n[start]\nlat_deg = 48\nlon_deg = 9\n[path]\nrandom = \"" << c.length
        << "\"\nspeed = \"" << c.speed << "\"\n[mounting]\nheading = \"" << c.mounting
        << " deg\"\n[imu]\nrate = \"50 Hz\"\ngyro_bias = \"1 deg/h\"\ngyro_noise = \"0.05 "
           "deg/sqrt(h)\"\naccel_bias = \"500 ug\"\naccel_noise = \"50 ug/sqrt(Hz)\"\n"
           "[odometer]\n"
        << c.odometer << "\n";
    ASSERT_EQ(loxo::testing::run("simulate --quiet " + folder + ".toml -o " + folder).exit_code, 0);
    const Ran r = navigate(folder, "filter", "--json");
    ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
    const Json constants = parse_json(r.result.out, "stdout")["constants"];
    const double eps = constants["eps_deg"], std = constants["eps_deg_std"];
    EXPECT_NEAR(std::remainder(eps - c.mounting, 360), 0, 4 * std) << c.name;
    EXPECT_LT(std, 1) << c.name;
    // Noise of the wheel is not read as its scale, which is 1.
    EXPECT_EQ(r.result.err.find("times the true"), std::string::npos) << c.name << r.result.err;
  }
}
// Five minutes at rest whose noise looks like motion, then the road.
TEST(Filter, ANoisyStandDoesNotHideTheMounting) {
  const std::string folder = loxo::testing::scratch_folder() + "/filter_noisy_stand";
  std::ofstream(folder + ".toml")
      << "seed = 5\n[start]\nlat_deg = 60\nlon_deg = -20\ncourse = \"30 deg\"\nspeed = \"0 m/s\"\n"
         "[[leg]]\nduration = \"300 s\"\nspeed = \"0 m/s\"\n[[leg]]\nduration = \"6 s\"\nspeed = "
         "\"6 m/s\"\n[[leg]]\nduration = \"60 s\"\nspeed = \"6 m/s\"\n[[leg]]\nduration = \"20 "
         "s\"\nspeed = \"2 m/s\"\n[[leg]]\nduration = \"20 s\"\nspeed = \"6 m/s\"\nturn = \"60 "
         "deg\"\n[mounting]\nheading = \"70 deg\"\n[imu]\nrate = \"50 Hz\"\ngyro_bias = \"0.1 "
         "deg/h\"\ngyro_noise = \"0.01 deg/sqrt(h)\"\naccel_bias = \"100 ug\"\naccel_noise = \"20 "
         "ug/sqrt(Hz)\"\n[odometer]\nrate = \"20 Hz\"\nnoise = \"0.05 m\"\n";
  ASSERT_EQ(loxo::testing::run("simulate --quiet " + folder + ".toml -o " + folder).exit_code, 0);
  const Ran r = navigate(folder, "filter", "--json");
  ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
  const Json constants = parse_json(r.result.out, "stdout")["constants"];
  EXPECT_NEAR(constants["eps_deg"].get<double>(), 70, 4 * constants["eps_deg_std"].get<double>());
}

// Readings that scatter more than anybody has declared: what they show is taken, and told, of a
// fast wheel by its second differences, of a slow one beside the IMU; the errors stay inside what
// is stated.
TEST(Filter, UndeclaredNoiseOfAWheelIsSeen) {
  for (const char* rate : {"20 Hz", "1 Hz"}) {
    const fs::path folder = fs::path(loxo::testing::scratch_folder()) / "filter_undeclared" / rate;
    fs::create_directories(folder.parent_path());
    std::ofstream(folder.string() + ".toml")
        << "seed = 4\n[start]\nlat_deg = -33\nlon_deg = 180\n[path]\nrandom = \"1.5 km\"\nspeed = "
           "\"5 m/s\"\n[imu]\nrate = \"50 Hz\"\ngyro_bias = \"1 deg/h\"\ngyro_noise = \"0.05 "
           "deg/sqrt(h)\"\naccel_bias = \"500 ug\"\naccel_noise = \"50 ug/sqrt(Hz)\"\n[odometer]\n"
           "noise = \"0.08 m\"\nrate = \""
        << rate << "\"\n";
    ASSERT_EQ(loxo::testing::run("simulate --quiet '" + folder.string() + ".toml' -o '" +
                                 folder.string() + "'")
                  .exit_code,
              0);
    std::string toml = loxo::testing::slurp((folder / "drive.toml").string());
    const auto at = toml.find("noise = \"0.08 m\"");
    ASSERT_NE(at, std::string::npos) << toml;
    toml.replace(at, 16, "");
    std::ofstream(folder / "drive.toml") << toml;
    const std::string solution = (folder / "s.csv").string();
    const auto r = loxo::testing::run("navigate '" + folder.string() +
                                      "' --mode filter --json -o '" + solution + "'");
    ASSERT_EQ(r.exit_code, 0) << r.err;
    EXPECT_NE(r.err.find("readings scatter"), std::string::npos) << rate << r.err;
    const std::string noise = parse_json(r.out, "stdout")["settings"]["reading_noise_m"];
    EXPECT_NEAR(std::strtod(noise.c_str(), nullptr), 0.08, 0.025) << rate;
    const auto e = loxo::testing::run("evaluate '" + solution + "' --truth '" +
                                      (folder / "reference.csv").string() + "' --json");
    EXPECT_LT(parse_json(e.out, "stdout")["nees_mean"].get<double>(), 8) << rate << e.err;
  }
}

TEST(Filter, VerticalModes) {
  Spec spec;
  spec.length = 150;
  const fs::path d = write_drive("vertical", spec);
  auto worst = [&](const Ran& r) {
    double w = 0;
    for (const SolutionRow& row : solution_of(r.solution).rows)
      w = std::max(w, std::fabs(row.h - 100));
    return w;
  };
  for (const auto& [mode, limit] :
       {std::pair<const char*, double>{"free", 60.0}, {"fixed", 1.0}, {"ship", 15.0}}) {
    const Ran r = navigate(d, "filter", std::string("--no-fixes --without nhc --vertical ") + mode);
    ASSERT_EQ(r.result.exit_code, 0) << mode << r.result.err;
    EXPECT_LT(worst(r), limit) << mode;
  }
  const Ran refused = navigate(d, "filter", "--vertical external");
  EXPECT_EQ(refused.result.exit_code, 3);
  EXPECT_NE(refused.result.err.find("[height]"), std::string::npos) << refused.result.err;

  Spec with = spec;
  with.extra =
      "[height]\nfile = \"h.csv\"\ncolumns = { time = \"t_s\", height = \"h_m\" }\nerrors = { "
      "height = \"0.5 m\" }\n";
  const fs::path e = write_drive("heights", with);
  std::ofstream h(e / "h.csv");
  h << "t_s,h_m\n";
  for (int i = 0; i <= 150; ++i) h << i << ',' << 100 + 0.5 * std::sin(2.1 * i) << '\n';
  h.close();
  for (const char* option : {"--vertical external", ""}) {  // the default where there are heights
    const Ran r = navigate(e, "filter", std::string("--json --no-fixes --without nhc ") + option);
    ASSERT_EQ(r.result.exit_code, 0) << r.result.err;
    EXPECT_LT(worst(r), 2.0) << option;
    EXPECT_GT(static_cast<int>(parse_json(r.result.out, "stdout")["innovations"]["height"]["used"]),
              50)
        << option;
  }
}
// A wrong axis: every turn contradicts fixes and wheel.
TEST(Filter, DivergenceIsFoundSaidAndItsRowsAreKept) {
  Spec spec;
  spec.gyro_up = -1;
  const Ran r = navigate(write_drive("diverges", spec), "filter");
  EXPECT_EQ(r.result.exit_code, 1) << r.result.err;
  EXPECT_NE(r.result.err.find("diverged"), std::string::npos) << r.result.err;
  const Solution s = solution_of(r.solution);
  ASSERT_GT(s.rows.size(), 500u);
  EXPECT_LT(s.rows.back().t, 239);
  spec.gyro_up = 1;
  EXPECT_EQ(navigate(write_drive("does_not", spec), "filter").result.exit_code, 0);
}

}  // namespace
}  // namespace loxo
