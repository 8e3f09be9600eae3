// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "loxo/num/units.hpp"
#include "loxo/study/campaign.hpp"
#include "loxo/study/drive_truth.hpp"
#include "loxo/text/toml.hpp"
#include "refusal.hpp"

namespace loxo {
namespace {

Campaign campaign(const std::string& settings, const std::string& parameters) {
  CampaignSource s;
  s.name = "test.toml";
  s.text = "kind = \"drive\"\ntrials = 1000000\nseed = 21\n[settings]\n" + settings +
           "[parameters]\n" + parameters;
  return read_campaign(s, "test");
}
std::size_t column(const Campaign& c, const std::string& name) {
  for (std::size_t j = 0; j < c.identity.columns.size(); ++j)
    if (c.identity.columns[j].name == name) return j;
  ADD_FAILURE() << name;
  return 0;
}
const char* const kErrors = R"toml(
gyro_bias = { log_uniform = ["0.001 deg/h", "1 deg/h"] }
gyro_noise = "0.002 deg/sqrt(h)"
gyro_walk = "0.01 deg/h/sqrt(h)"
gyro_scale = 1e-5
accel_bias = "30 ug"
accel_noise = "20 ug/sqrt(Hz)"
accel_scale = 1e-5
heading_error = "3 arcmin"
tilt_error = "20 arcsec"
odometer_scale = 1e-3
odometer_noise = "0.01 m"
mounting = "2 arcmin"
gyro_markov = { choice = ["0 deg/h", "0.1 deg/h"] }
gyro_misalignment = { choice = ["0 arcsec", "20 arcsec"] }
g_sensitivity = { choice = ["0 deg/h/g", "0.01 deg/h/g"] }
gyro_quantisation = { choice = ["0 arcsec", "0.1 arcsec"] }
accel_markov = "20 ug"
odometer_scale_noise = { choice = [0.0, 1e-3] }
odometer_scale_walk = { choice = ["0 1/sqrt(s)", "1e-5 1/sqrt(s)"] }
odometer_scale_markov = { choice = [0.0, 3e-4] }
odometer_quantisation = { choice = ["0 m", "0.05 m"] }
side_slip = "0.05 deg"
odometer_preset = { choice = [0.0, 0.02] }
mounting_preset = { choice = ["0 deg", "-1 deg"] }
mounting_pitch = "1 arcmin"
benchmark_std = "0.1 m"
)toml";

TEST(DriveTrial, TrialKIsBitIdenticalInAnyLaneAndAloneInEveryFrame) {
  for (const char* frame : {"geographic", "transverse", "grid", "wander", "ecef"}) {
    const std::string lat = std::string(frame) == "geographic" ? "-33 deg" : "89.9 deg";
    // One frame does everything that a trial can do.
    const bool all = std::string(frame) == "geographic";
    const Campaign c = campaign(
        "frame = \"" + std::string(frame) + "\"\nlat = \"" + lat +
            "\"\nduration = \"40 s\"\nroute = \"weave\"\n" +
            (all ? "alignment = \"static\"\nmode = [\"inertial\", \"reckon\", \"calibrate\", "
                   "\"filter\", \"segmented\", \"navigator\"]\nevery = \"7 s\"\n"
                 : ""),
        kErrors);
    const std::size_t width = c.identity.columns.size() + 1;
    const Block b = run_block(c, 0, 24);
    for (std::uint64_t t = 0; t < 24; ++t) {
      const auto alone = run_trial(c, t);
      EXPECT_EQ(alone.back(), 0.0) << frame << " trial " << t << " is not computed";
      for (std::size_t j = 0; j < width; ++j)
        ASSERT_EQ(std::bit_cast<std::uint64_t>(alone[j]),
                  std::bit_cast<std::uint64_t>(b.rows[t * width + j]))
            << frame << " trial " << t << " "
            << (j + 1 < width ? c.identity.columns[j].name : "health");
    }
  }
}

TEST(DriveTrial, WithoutErrorsThereIsNoError) {
  for (const char* frame : {"transverse", "grid", "wander", "ecef"}) {
    // Over the pole, through rounding and the disagreement of the frames of order dt^2 alone
    // (polar.md 3.2).
    const Campaign c =
        campaign("frame = \"" + std::string(frame) +
                     "\"\nlat = \"89.99 deg\"\nheading = \"0 deg\"\nroute = \"straight\"\nspeed = "
                     "\"20 m/s\"\nduration = \"200 s\"\n",
                 "gyro_bias = \"0 deg/h\"\ngyro_noise = \"0 deg/sqrt(h)\"\naccel_bias = \"0 "
                 "ug\"\naccel_noise = \"0 ug/sqrt(Hz)\"\n");
    const auto row = run_trial(c, 0);
    // Position in steps of 1e-9 m over 20000 steps, random: 1e-7 m; the frames' dt^2 terms over 200
    // s: below 1e-4 m.
    EXPECT_LT(row[column(c, "horizontal_max_m")], 1e-4) << frame;
    EXPECT_LT(std::fabs(row[column(c, "heading_end_rad")]), 1e-9) << frame;
    // Ten steps of 100 Hz in one of dead reckoning: chord against arc of a straight way, and
    // mid-attitude.
    EXPECT_LT(row[column(c, "reckoned_end_m")], 1e-2) << frame;
  }
}

TEST(DriveTrial, TruthStaysOnTheGroundLevelAndOnItsWay) {
  for (const char* route : {"weave", "mixed", "closed", "straight"}) {
    const TomlTable settings = TomlTable::parse(
        "lat = \"89.95 deg\"\nheading = \"10 deg\"\nspeed = \"30 m/s\"\nduration = \"600 "
        "s\"\nheight = \"50 m\"\nroute = \"" +
            std::string(route) + "\"\n",
        "test");
    const DriveTruth t = drive_truth(drive_scenario(settings), "test");
    ASSERT_EQ(t.epochs.size(), 601u);
    double way = 0;
    for (const auto& tick : t.ticks) way += tick.way;
    for (const auto& e : t.epochs) {
      EXPECT_NEAR(e.h, 50, 1e-9);
      const auto up = cross(e.east, e.north);
      const auto c = to_matrix(e.state.q_eb);
      EXPECT_GT(up.x * c.m[0][2] + up.y * c.m[1][2] + up.z * c.m[2][2], 1 - 1e-12);
    }
    // 30 m/s after 30 s of start, half of it in the mean: 600 * 30 - 450 m of way.
    EXPECT_NEAR(t.epochs.back().distance, 17550, 1e-6) << route;
    EXPECT_NEAR(way, 17550, 1e-6) << route;
  }
}

struct Column {
  double mean = 0, rms = 0, most = 0;
};
Column over(const Campaign& c, const Block& b, const std::string& name) {
  const std::size_t width = c.identity.columns.size() + 1, j = column(c, name);
  Column o;
  const auto n = static_cast<double>(b.rows.size() / width);
  for (std::size_t i = j; i < b.rows.size(); i += width) {
    o.mean += b.rows[i] / n;
    o.rms += b.rows[i] * b.rows[i] / n;
    o.most = std::max(o.most, std::fabs(b.rows[i]));
  }
  o.rms = std::sqrt(o.rms);
  return o;
}
// vehicle.md 7.3's sensors.
const char* const kUnit = R"toml(
gyro_bias = "0.01 deg/h"
gyro_noise = "0.001 deg/sqrt(h)"
accel_bias = "30 ug"
accel_noise = "5 ug/sqrt(Hz)"
tilt_error = "1 arcsec"
heading_error = "0.3 arcmin"
odometer_scale = 0.02
odometer_quantisation = "0.05 m"
odometer_scale_noise = 0.001
odometer_scale_markov = 3e-4
side_slip = "0.05 deg"
mounting = "1 deg"
benchmark_std = "0.1 m"
)toml";

// The joint filter finds the constants, stays inside its own covariance and beats both inputs: the
// route with turns, twelve minutes at 40 deg, alignment at rest.
TEST(DriveTrial, TheJointFilterIsConsistentAndBetterThanEither) {
  const Campaign c = campaign(
      "lat = \"40 deg\"\nheading = \"30 deg\"\nspeed = \"20 m/s\"\nduration = \"720 s\"\nroute = "
      "\"mixed\"\nodometer_rate = \"1 Hz\"\nalignment = \"static\"\nimu_rate = \"50 Hz\"\nmode = "
      "[\"inertial\", \"filter\", \"calibrate\", \"segmented\"]\n",
      kUnit);
  constexpr std::uint64_t kN = 32;
  const Block b = run_block(c, 0, kN);
  EXPECT_LT(over(c, b, "filter_end_m").rms, 0.5 * over(c, b, "horizontal_end_m").rms);
  // Mean over a drive of 2 chi-square(2)/2 values that are one draw of the start's heading: no
  // narrower than that of kN values, 5 sigma 2/sqrt(N), and a filter that knows all that is drawn.
  EXPECT_NEAR(over(c, b, "filter_nees").mean, 2, 5 * 2 / std::sqrt(static_cast<double>(kN)));
  EXPECT_GT(over(c, b, "filter_nees").mean, 0.5);
  EXPECT_LT(over(c, b, "filter_scale_error").rms, 0.05 * 0.02);
  EXPECT_LT(over(c, b, "filter_mounting_error_rad").rms, 0.1 * deg);
  // The same constants by the segmented method's first phase: nine tenths of them (7.3).
  EXPECT_LT(over(c, b, "segmented_scale_error").rms, 0.1 * 0.02);
  EXPECT_LT(over(c, b, "segmented_mounting_error_rad").rms, 0.1 * deg);
  EXPECT_LT(over(c, b, "segmented_joint_end_pct").rms, 0.3);
  EXPECT_EQ(over(c, b, "segmented_switch_s").most > 59, true);
  // And from surveyed ends.
  EXPECT_LT(over(c, b, "replay_ln_k_error").rms, 1e-3);
}

// Replay's stated covariance is true for what it knows of: heading of the start, benchmarks.
TEST(DriveTrial, CalibrationFromSurveyedEndsHasItsStatedCovariance) {
  const Campaign c = campaign(
      "lat = \"-50 deg\"\nroute = \"closed\"\nduration = \"400 s\"\nimu_rate = \"10 "
      "Hz\"\nodometer_rate = \"10 Hz\"\nspeed = \"20 m/s\"\nmode = [\"calibrate\"]\n",
      "gyro_bias = \"0 deg/h\"\ngyro_noise = \"0 deg/sqrt(h)\"\naccel_bias = \"0 ug\"\naccel_noise "
      "= \"0 ug/sqrt(Hz)\"\nodometer_scale = 0.02\nmounting = \"1 deg\"\nheading_error = \"5 "
      "arcmin\"\nbenchmark_std = \"1 m\"\n");
  constexpr double kN = 512;
  const Block b = run_block(c, 0, static_cast<std::uint64_t>(kN));
  // chi-square(2): variance 4.
  EXPECT_NEAR(over(c, b, "replay_nees").mean, 2, 5 * 2 / std::sqrt(kN));
  EXPECT_NEAR(over(c, b, "replay_eps_error_rad").rms / over(c, b, "replay_eps_std_rad").rms, 1,
              5 / std::sqrt(2 * kN));
}

TEST(DriveTrial, AScenarioIsDrivenWithItsOwnSensors) {
  const Campaign c = campaign("scenario = \"mountain-road\"\nmode = [\"reckon\", \"filter\"]\n",
                              "gyro_bias = \"4 deg/h\"\n");
  const auto row = run_trial(c, 0);
  EXPECT_EQ(row.back(), 0.0);
  EXPECT_NEAR(row[column(c, "gyro_bias_radps")], 4 * deg_per_h, 1e-12);
  EXPECT_NEAR(row[column(c, "gyro_misalignment_rad")], arcmin, 1e-12);
  EXPECT_NEAR(row[column(c, "fix_std_m")], 1.5, 1e-12);
  EXPECT_LT(row[column(c, "filter_end_m")], 20);
}

// Static, white noise, one Schuler channel (the Earth's rate couples the channels by (w_ie t)^2 =
// 0.002 at 600 s): dv' = -g phi + n_a, phi' = dv/R + n_g. With W = sqrt(g/R):
//   var dv = N_a^2 (t/2 + sin 2Wt / 4W) + N_g^2 g R (t/2 - sin 2Wt / 4W)
//   var dp = N_a^2/W^2 (t/2 - sin 2Wt / 4W) + N_g^2 R^2 (3t/2 - 2 sin Wt / W + sin 2Wt / 4W)
TEST(DriveTrial, StaticWhiteNoiseHasTheCovarianceOfTheClosedForm) {
  constexpr double T = 600, kN = 4096;
  struct Case {
    const char* parameters;
    double na, ng;
  };
  const Case cases[] = {
      {"gyro_noise = \"0 deg/sqrt(h)\"\naccel_noise = \"100 ug/sqrt(Hz)\"\n", 100 * ug, 0},
      {"gyro_noise = \"0.01 deg/sqrt(h)\"\naccel_noise = \"0 ug/sqrt(Hz)\"\n", 0,
       0.01 * deg_per_sqrt_h},
  };
  for (const Case& k : cases) {
    const Campaign c = campaign(
        "route = \"static\"\nlat = \"35 deg\"\nframe = \"geographic\"\nduration = \"600 "
        "s\"\nimu_rate = \"10 Hz\"\n"
        "odometer_rate = \"10 Hz\"\n",
        std::string("gyro_bias = \"0 deg/h\"\naccel_bias = \"0 ug\"\n") + k.parameters);
    const Block b = run_block(c, 0, static_cast<std::uint64_t>(kN));
    const double g = 9.797, R = 6.37e6, W = std::sqrt(g / R);
    const double minus = T / 2 - std::sin(2 * W * T) / (4 * W),
                 plus = T / 2 + std::sin(2 * W * T) / (4 * W);
    const double var_v = k.na * k.na * plus + k.ng * k.ng * g * R * minus;
    const double var_p =
        k.na * k.na / (W * W) * minus +
        k.ng * k.ng * R * R * (1.5 * T - 2 * std::sin(W * T) / W + std::sin(2 * W * T) / (4 * W));
    const std::size_t width = c.identity.columns.size() + 1;
    const struct {
      const char* name;
      double variance;
    } metrics[] = {{"east_end_m", var_p},
                   {"north_end_m", var_p},
                   {"ve_end_mps", var_v},
                   {"vn_end_mps", var_v}};
    for (const auto& m : metrics) {
      double sum = 0, squares = 0;
      const std::size_t j = column(c, m.name);
      for (std::size_t i = 0; i < static_cast<std::size_t>(kN); ++i) {
        const double x = b.rows[i * width + j];
        sum += x / kN, squares += x * x / kN;
      }
      // 5 sigma of a variance from N values, and 1 % for R, g and the coupling left out.
      EXPECT_NEAR(squares / m.variance, 1.0, 5 * std::sqrt(2 / kN) + 0.01) << m.name << "\n"
                                                                           << k.parameters;
      EXPECT_LT(std::fabs(sum), 5 * std::sqrt(m.variance / kN)) << m.name;
    }
  }
}

// A bias constant over a trial: dead reckoning's end error is the distance times the errors of
// scale and angle.
TEST(DriveTrial, ReckonedErrorIsDistanceTimesScaleAndAngle) {
  const Campaign c = campaign(
      "route = \"straight\"\nlat = \"20 deg\"\nduration = \"300 s\"\nimu_rate = \"10 "
      "Hz\"\nodometer_rate = \"10 Hz\"\n",
      "gyro_bias = \"0 deg/h\"\ngyro_noise = \"0 deg/sqrt(h)\"\naccel_bias = \"0 ug\"\naccel_noise "
      "= \"0 ug/sqrt(Hz)\"\n"
      "odometer_scale = 1e-3\nmounting = \"2 mrad\"\n");
  constexpr std::uint64_t kN = 2048;
  const Block b = run_block(c, 0, kN);
  const std::size_t width = c.identity.columns.size() + 1, j = column(c, "reckoned_end_pct");
  double squares = 0;
  for (std::uint64_t i = 0; i < kN; ++i)
    squares += b.rows[i * width + j] * b.rows[i * width + j] / static_cast<double>(kN);
  // E |error|^2 / D^2 = scale^2 + angle^2; that of two chi-squares with unequal weights: at most
  // sqrt(2/N) relative sigma.
  EXPECT_NEAR(squares / 1e4 / (1e-6 + 4e-6), 1.0,
              5 * std::sqrt(2.0 / static_cast<double>(kN)) + 0.005);
}

TEST(DriveTrial, ALaneThatGoesBadLeavesItsNeighboursAlone) {
  // An accelerometer that is wrong by a hundred g in lane 5 alone throws that trial off the Earth.
  const Campaign c = campaign(
      "frame = \"geographic\"\nlat = \"89.9 deg\"\nheading = \"0 deg\"\nduration = \"100 "
      "s\"\nimu_rate = \"10 Hz\"\n",
      "accel_bias = { grid = [\"10 ug\", \"11 ug\", \"12 ug\", \"13 ug\", \"14 ug\", \"980 "
      "m/s^2\", \"15 ug\", \"16 ug\"] }\n");
  const Block b = run_block(c, 0, 8);
  const std::size_t width = c.identity.columns.size() + 1;
  for (std::uint64_t t = 0; t < 8; ++t) {
    const auto alone = run_trial(c, t);
    const double max = alone[column(c, "horizontal_max_m")];
    if (t == 5)
      EXPECT_FALSE(max < 1e5) << "lane 5 was to go bad";
    else
      EXPECT_LT(max, 100.0) << t;
    for (std::size_t j = 0; j < width; ++j)
      EXPECT_TRUE(alone[j] == b.rows[t * width + j] ||
                  (std::isnan(alone[j]) && std::isnan(b.rows[t * width + j])))
          << t << " " << j;
  }
}

// The bits of campaigns, the same from every processor level: computed with LOXO_ARCH=v4; a build
// for v2 or v3 must give this number too.
TEST(DriveTrial, BitsAreThoseOfEveryOtherProcessor) {
  std::uint64_t h = 0xcbf29ce484222325;
  const auto add = [&](const Campaign& c) {
    for (const double x : run_block(c, 0, 16).rows) {
      h = (h ^ (std::isnan(x) ? 1 : std::bit_cast<std::uint64_t>(x))) * 0x100000001b3;
      h ^= h >> 29;
    }
  };
  for (const char* frame : {"geographic", "transverse", "grid", "wander", "ecef"})
    add(campaign("frame = \"" + std::string(frame) + "\"\nlat = \"84 deg\"\nduration = \"60 s\"\n",
                 kErrors));
  CampaignSource s;
  s.name = "test.toml";
  s.text =
      "kind = \"two_point\"\n[parameters]\nlat = { sobol = [\"-80 deg\", \"80 deg\"] }\nscale = { "
      "normal = [1.0, 0.02] }\n"
      "course = { uniform = [\"0 deg\", \"360 deg\"] }\nlength = { log_uniform = [\"1 km\", \"90 "
      "km\"] }\n";
  add(read_campaign(s, "test"));
  EXPECT_EQ(h, 0xab7061a332768b6cu) << std::hex << h;
}

TEST(DriveTrial, RefusesSettingsThatCannotBe) {
  const auto refused = [](const std::string& settings, const std::string& words) {
    const std::string said = testing::refusal([&] { campaign(settings, ""); }, settings);
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  refused("route = \"weeve\"\n", "did you mean 'weave'");
  refused("frame = \"eecf\"\n", "did you mean 'ecef'");
  refused("duration = \"100000 h\"\n", "2 million");
  refused("mode = [\"filterr\"]\n", "did you mean 'filter'");
  refused("mode = []\n", "one mode or more");
  refused("scenario = \"citydrive\"\n", "did you mean 'city-drive'");
  refused("scenario = \"city-drive\"\nspeed = \"3 m/s\"\n", "both a scenario");
  refused("alignment = \"static\"\nlat = \"89.9 deg\"\n", "finds north");
  refused("odometer_rate = \"7 Hz\"\n", "whole part");
  refused("lat = \"95 deg\"\n", "latitude");
  refused("duration = \"10 s\"\nevery = \"0.1 s\"\n", "a second or more");
  refused("duration = \"300 s\"\nimu_rate = \"10 Hz\"\nevery = \"1 s\"\n", "at most 200 times");
  refused("speeed = \"5 m/s\"\n", "did you mean 'speed'");
}

}  // namespace
}  // namespace loxo
