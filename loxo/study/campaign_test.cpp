// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/campaign.hpp"
#include "places.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "loxo/study/statistics.hpp"
#include "refusal.hpp"

namespace loxo {
namespace {
namespace fs = std::filesystem;

constexpr const char* kText = R"toml(
kind = "two_point"
trials = 2500
seed = 11
block = 512
[parameters]
lat = { uniform = ["-80 deg", "80 deg"] }
course = { sobol = ["0 deg", "360 deg"] }
length = { grid = ["2 km", "20 km"] }
scale = { normal = [1.0, 0.02] }
azimuth_std = "10 arcsec"
angle_random_walk = "0.005 deg/sqrt(h)"
)toml";

Campaign campaign(const std::string& text = kText, std::uint64_t trials = 0) {
  CampaignSource s;
  s.text = text, s.name = "test.toml", s.trials = trials;
  return read_campaign(s, "test");
}

struct Folder {
  std::string path =
      (fs::temp_directory_path() / ("loxo_campaign_" + std::to_string(::getpid()))).string();
  Folder() { fs::create_directories(path); }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

bool same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

std::string refusal(const std::string& text) {
  return testing::refusal([&] { campaign(text); }, text);
}

// The promise of the house (architecture.md, Monte Carlo).
TEST(Campaign, TrialKIsBitIdenticalInAnyLaneAndAlone) {
  const Campaign c = campaign();
  const std::size_t width = c.identity.columns.size() + 1;
  const Block b = run_block(c, 1, 512);
  for (std::uint64_t i = 0; i < 512; i += 7) {
    const auto alone = run_trial(c, 512 + i);
    for (std::size_t j = 0; j < width; ++j)
      EXPECT_TRUE(same(alone[j], b.rows[i * width + j])) << "trial " << 512 + i << " column " << j;
  }
  // In another lane: the same trial as the first of a block that starts there.
  Campaign shifted = campaign();
  shifted.identity.block = 3;
  const Block d = run_block(shifted, 201, 3);  // trials 603, 604, 605
  for (std::size_t j = 0; j < width; ++j)
    EXPECT_TRUE(same(d.rows[width + j], b.rows[(604 - 512) * width + j]));
}

TEST(Campaign, RowsAreThoseOfTheTrialsWhateverTheThreads) {
  const Folder folder;
  const Campaign c = campaign();
  const Ranks ranks;
  for (int threads : {1, 2, 3}) {
    RunOptions o;
    o.store = folder.path + "/t" + std::to_string(threads);
    o.threads = threads;
    const RunResult r = run_campaign(c, o, ranks);
    EXPECT_EQ(r.trials, 2500u);
    EXPECT_TRUE(r.complete);
    EXPECT_FALSE(has_parts(o.store));
    const Store store(o.store);
    ASSERT_EQ(store.trials(), 2500u);
    for (std::uint64_t t : {0u, 1u, 511u, 512u, 1700u, 2499u}) {
      const auto row = store.row(t), alone = run_trial(c, t);
      for (std::size_t j = 0; j < row.size(); ++j)
        EXPECT_TRUE(same(row[j], alone[j])) << t << " " << j;
    }
  }
}

TEST(Campaign, GoesOnWhereItWasAndCanBeMadeLonger) {
  const Folder folder;
  const Ranks ranks;
  RunOptions o;
  o.store = folder.path + "/s";
  EXPECT_EQ(run_campaign(campaign(kText, 1000), o, ranks).trials, 1000u);
  const RunResult again = run_campaign(campaign(kText, 1000), o, ranks);
  EXPECT_EQ(again.computed, 0u);
  EXPECT_EQ(again.resumed, 1000u);
  const RunResult longer = run_campaign(campaign(kText, 2500), o, ranks);
  EXPECT_EQ(longer.trials, 2500u);
  EXPECT_EQ(longer.resumed, 512u);  // the short last block is computed anew
  const Store store(o.store);
  const auto row = store.row(999), alone = run_trial(campaign(), 999);
  for (std::size_t j = 0; j < row.size(); ++j) EXPECT_TRUE(same(row[j], alone[j]));
}

TEST(Campaign, ATornOrDamagedBlockIsAsIfItHadNeverBeen) {
  const Folder folder;
  const Campaign c = campaign();
  const std::string store = folder.path + "/s";
  open_parts(store, c.identity);
  {
    SegmentWriter w(parts_folder(store), c.identity, 0);
    for (std::uint64_t b = 0; b < 3; ++b) w.append(run_block(c, b, 512));
  }
  std::string segment;
  for (const auto& e : fs::directory_iterator(parts_folder(store)))
    if (e.path().extension() == ".seg") segment = e.path().string();
  const auto size = fs::file_size(segment);
  for (const auto cut : {size - 1, size - 4000, size / 2, std::uintmax_t{30}, std::uintmax_t{3}}) {
    fs::resize_file(segment, cut);
    SegmentReader r(parts_folder(store), c.identity);
    std::set<std::uint64_t> seen;
    r.scan([&](const Block& b) {
      EXPECT_EQ(b.rows, run_block(c, b.index, 512).rows);
      seen.insert(b.index);
    });
    EXPECT_LT(seen.size(), 3u);
  }
  // A flipped bit in the first block.
  fs::remove(segment);
  {
    SegmentWriter w(parts_folder(store), c.identity, 0);
    w.append(run_block(c, 0, 512));
  }
  for (const auto& e : fs::directory_iterator(parts_folder(store)))
    if (e.path().extension() == ".seg") segment = e.path().string();
  std::fstream f(segment, std::ios::in | std::ios::out | std::ios::binary);
  f.seekg(5000);
  char byte = 0;
  f.get(byte);
  f.seekp(5000);
  f.put(static_cast<char>(byte ^ 4));
  f.close();
  SegmentReader r(parts_folder(store), c.identity);
  r.scan([](const Block&) { ADD_FAILURE() << "a damaged block was believed"; });
  const Ranks ranks;
  RunOptions o;
  o.store = store;
  EXPECT_EQ(run_campaign(c, o, ranks).trials, 2500u);
}

TEST(Campaign, StopsByItsRuleAtTheSameTrialWhateverTheThreads) {
  const Folder folder;
  const Ranks ranks;
  const std::string text =
      std::string(kText) + "[stop]\nmetric = \"nees\"\nhalf_width = 0.05\nat_least = 1000\n";
  std::uint64_t first = 0;
  for (int threads : {1, 2}) {
    RunOptions o;
    o.store = folder.path + "/s" + std::to_string(threads);
    o.threads = threads;
    const RunResult r = run_campaign(campaign(text, 200000), o, ranks);
    EXPECT_TRUE(r.stopped_by_rule);
    EXPECT_EQ(r.trials % 512, 0u);
    EXPECT_LT(r.trials, 200000u);
    if (first == 0) first = r.trials;
    EXPECT_EQ(r.trials, first);
    const Summary s = summarize("nees", Store(o.store).column("nees"));
    EXPECT_LE(0.5 * (s.mean_hi - s.mean_lo), 0.0501);
  }
  // Begun without reaching the rule, its last block short: continued, it stops where the
  // undisturbed run does.
  RunOptions o;
  o.store = folder.path + "/begun";
  EXPECT_EQ(run_campaign(campaign(text, 1300), o, ranks).trials, 1300u);
  EXPECT_EQ(run_campaign(campaign(text, 200000), o, ranks).trials, first);
}

// (V-44), (V-45): the errors of two-point calibrations have the variances that the formulas
// predict; their squares over the predicted variances are chi-square with 2 degrees of freedom
// (mean 2, variance 4).
TEST(Campaign, TwoPointErrorsHaveTheVariancesOfV44AndV45) {
  const std::string text = R"toml(
kind = "two_point"
trials = 40000
[parameters]
lat = { uniform = ["-60 deg", "60 deg"] }
course = { uniform = ["0 deg", "360 deg"] }
length = "10 km"
duration = "500 s"
scale = 1.2
mounting = "3 deg"
benchmark_std = "0.2 m"
azimuth_std = "4 arcsec"
drift_std = "0.05 deg/h"
angle_random_walk = "0.005 deg/sqrt(h)"
scale_noise = 1e-5
)toml";
  const Campaign c = campaign(text);
  const std::size_t np = c.kind->parameters().size(), width = c.identity.columns.size() + 1;
  double k2 = 0, e2 = 0, nees = 0, pk = 0, pe = 0;
  constexpr std::uint64_t kN = 40000;
  const Block b = run_block(c, 0, kN);
  for (std::uint64_t i = 0; i < kN; ++i) {
    const double* m = &b.rows[i * width + np];
    k2 += m[0] * m[0] / kN, e2 += m[1] * m[1] / kN, nees += m[4] / kN;
    pk = m[2], pe = m[3];
  }
  EXPECT_NEAR(pk * pk, 2 * 0.04 / 1e8 + 1e-10, 1e-14);
  // A variance from N normal values has a relative sigma of sqrt(2/N).
  const double five = 5 * std::sqrt(2.0 / kN);
  EXPECT_NEAR(k2 / (pk * pk), 1.0, five);
  EXPECT_NEAR(e2 / (pe * pe), 1.0, five);
  EXPECT_NEAR(nees, 2.0, 5 * std::sqrt(4.0 / kN));
}

TEST(Campaign, RefusesWhatCannotBe) {
  const std::string head = "kind = \"two_point\"\n[parameters]\n";
  EXPECT_NE(refusal(head + "lenght = \"1 km\"").find("did you mean 'length'"), std::string::npos);
  EXPECT_NE(refusal(head + "lenght = \"1 km\"").find("test.toml:3"), std::string::npos);
  EXPECT_NE(refusal("kind = \"two_pont\"").find("did you mean 'two_point'"), std::string::npos);
  EXPECT_NE(
      refusal(head + "length = { unifrom = [\"1 km\", \"2 km\"] }").find("did you mean 'uniform'"),
      std::string::npos);
  EXPECT_NE(
      refusal(head + "length = { uniform = [\"3 km\", \"2 km\"] }").find("least is above most"),
      std::string::npos);
  EXPECT_NE(refusal(head + "length = { normal = [\"3 km\", \"-2 m\"] }").find("negative sigma"),
            std::string::npos);
  EXPECT_NE(refusal(head + "length = { log_uniform = [\"0 m\", \"2 m\"] }").find("impossible"),
            std::string::npos);
  EXPECT_NE(refusal(head + "lat = \"91 deg\"").find("possible range"), std::string::npos);
  EXPECT_NE(refusal(head + "length = { grid = [] }").find("impossible"), std::string::npos);
  EXPECT_NE(refusal(head + "length = { grid = [\"1 km\"], normal = [\"1 km\", \"1 m\"] }")
                .find("choose one"),
            std::string::npos);
  EXPECT_NE(refusal(head + "length = 3").find("length"), std::string::npos);
  EXPECT_NE(refusal("kind = \"two_point\"\n[stop]\nmetric = \"ness\"\nrelative = 0.1")
                .find("did you mean 'nees'"),
            std::string::npos);
  EXPECT_NE(refusal("kind = \"two_point\"\ntrials = 0").find("from 1 to"), std::string::npos);
  EXPECT_NE(refusal("kind = \"two_point\"\ntirals = 5").find("tirals"), std::string::npos);
}

TEST(Campaign, AStoreOfAnotherCampaignOrVersionIsRefused) {
  const Folder folder;
  const Ranks ranks;
  RunOptions o;
  o.store = folder.path + "/s";
  run_campaign(campaign(kText, 600), o, ranks);
  const auto refused = [&](const Campaign& c) {
    return testing::refusal([&] { run_campaign(c, o, ranks); });
  };
  CampaignSource s;
  s.text = kText, s.seed = 12;
  EXPECT_NE(refused(read_campaign(s, "test")).find("seed 11, found seed 12"), std::string::npos);
  s.seed = 0;
  EXPECT_NE(refused(read_campaign(s, "other")).find("version test, this is other"),
            std::string::npos);
  s.sets = {"parameters.azimuth_std=\"11 arcsec\""};
  EXPECT_NE(refused(read_campaign(s, "test")).find("other parameters"), std::string::npos);
}

TEST(Campaign, ReadyCampaignsAreTheFilesOfTheExamples) {
  std::set<std::string> files;
  for (const auto& e :
       fs::directory_iterator(std::string(testing::source_folder()) + "/examples/campaigns"))
    files.insert(e.path().stem().string());
  for (const auto& ready : ready_campaigns()) {
    std::ifstream in(std::string(testing::source_folder()) + "/examples/campaigns/" + ready.name +
                     ".toml");
    std::ostringstream text;
    text << in.rdbuf();
    EXPECT_EQ(text.str(), ready.text) << "run tools/embed_campaigns";
    EXPECT_EQ(files.erase(ready.name), 1u);
    CampaignSource s;
    s.text = ready.text, s.name = ready.name;
    EXPECT_NO_THROW(run_trial(read_campaign(s, "test"), 0)) << ready.name;
  }
  EXPECT_TRUE(files.empty()) << "run tools/embed_campaigns";
}

// ---- draws
// -----------------------------------------------------------------------------------------------
TEST(Draw, ProbitInvertsTheNormalDistribution) {
  for (double u : {1e-300, 1e-20, 1e-5, 0.02425, 0.075, 0.2, 0.5, 0.7, 0.925, 0.999999}) {
    // Relative error of the probability: density times error of the quantile, x^2 1e-15 and
    // rounding.
    const double back = 0.5 * std::erfc(-probit(u) / std::sqrt(2.0));
    const double x = probit(u);
    EXPECT_NEAR(back / u, 1.0, (2 + x * x) * 1e-15) << u;
  }
}

TEST(Draw, SobolPointsAreStratified) {
  // Every one of 2^m equal slices holds exactly one of the first 2^m points, in each dimension.
  for (int d = 0; d < kSobolDimensions; ++d) {
    std::set<std::uint64_t> slices;
    for (std::uint64_t i = 0; i < 1024; ++i) slices.insert(sobol_bits(i, d) >> 42);
    EXPECT_EQ(slices.size(), 1024u) << d;
  }
  // Dimensions 0 and 1 together form a (0, m, 2)-net: every elementary box holds one point.
  for (int a = 0; a <= 8; ++a) {
    std::set<std::uint64_t> boxes;
    for (std::uint64_t i = 0; i < 256; ++i)
      boxes.insert(((sobol_bits(i, 0) >> 44) >> (8 - a) << 8) | ((sobol_bits(i, 1) >> 44) >> a));
    EXPECT_EQ(boxes.size(), 256u) << a;
  }
}

TEST(Draw, GridGivesEveryCombinationEquallyOften) {
  const Draws draws({{Distribution::Kind::kGrid, {1, 2, 3, 4}},
                     {Distribution::Kind::kUniform, {0, 1}},
                     {Distribution::Kind::kGrid, {10, 20}}},
                    3);
  EXPECT_EQ(draws.cells(), 8u);
  std::map<std::pair<double, double>, int> seen;
  for (std::uint64_t t = 0; t < 80; ++t) {
    double p[3];
    draws.at(t, p);
    ++seen[{p[0], p[2]}];
  }
  EXPECT_EQ(seen.size(), 8u);
  for (const auto& [cell, n] : seen) EXPECT_EQ(n, 10);
}

// ---- statistics
// ------------------------------------------------------------------------------------------
TEST(Statistics, IntervalsHoldTheTruthAsOftenAsTheySay) {
  // 400 samples of 200 uniform values: mean 1/2, std 1/sqrt(12), 95th percentile 0.95; each
  // interval at 95 %.
  int mean = 0, std_ = 0, p95 = 0;
  for (std::uint64_t k = 0; k < 400; ++k) {
    std::vector<double> v;
    for (std::uint64_t i = 0; i < 200; ++i) {
      double x;
      Draws({{Distribution::Kind::kUniform, {0, 1}}}, 99).at(1000 * k + i, {&x, 1});
      v.push_back(x);
    }
    const Summary s = summarize("x", v);
    mean += s.mean_lo <= 0.5 && 0.5 <= s.mean_hi;
    std_ += s.std_lo <= std::sqrt(1.0 / 12) && std::sqrt(1.0 / 12) <= s.std_hi;
    p95 += s.percentiles[4].lo <= 0.95 && 0.95 <= s.percentiles[4].hi;
  }
  // Binomial, 5 sigma below 95 % (percentile intervals are conservative).
  const double least = 400 * 0.95 - 5 * std::sqrt(400 * 0.95 * 0.05);
  EXPECT_GT(mean, least);
  EXPECT_GT(std_, least);
  EXPECT_GT(p95, least);
}

TEST(Statistics, RunningMomentsAreThoseOfTheWholeSample) {
  std::vector<double> v;
  RunningMoments r;
  for (std::uint64_t i = 0; i < 500; ++i) {
    double x;
    Draws({{Distribution::Kind::kLogUniform, {1, 100}}}, 3).at(i, {&x, 1});
    v.push_back(x);
    r.add(x);
  }
  using St = StopRule::Statistic;
  for (const St s : {St::kMean, St::kStd}) {
    const Interval a = confidence_interval(r, s, 0.9), b = confidence_interval(v, s, 50, 0.9);
    EXPECT_NEAR(a.value, b.value, 1e-12 * b.value);
    EXPECT_NEAR(a.hi - a.lo, b.hi - b.lo, 1e-10 * b.value);
  }
}

TEST(Statistics, InfluenceNamesTheParameterThatMatters) {
  std::vector<double> x, y, z;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    double v[3];
    Draws({{Distribution::Kind::kUniform, {0, 1}},
           {Distribution::Kind::kUniform, {0, 1}},
           {Distribution::Kind::kUniform, {0, 1}}},
          5)
        .at(i, v);
    x.push_back(v[0]), y.push_back(v[1]);
    z.push_back(2 * v[0] + v[1] + 0 * v[2]);
  }
  // Variance of 2x + y: 4/12 + 1/12.
  EXPECT_NEAR(influence("x", x, z).share, 0.8, 0.03);
  EXPECT_NEAR(influence("y", y, z).share, 0.2, 0.03);
  EXPECT_GT(influence("x", x, z).rank_correlation, 0.85);
}

TEST(Statistics, DifferenceFindsAShiftAndNothingWhereNothingIs) {
  std::vector<double> a, b, c;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    double v[2];
    Draws({{Distribution::Kind::kNormal, {0, 1}}, {Distribution::Kind::kNormal, {0, 1}}}, 6)
        .at(i, v);
    a.push_back(v[0]), b.push_back(v[1]), c.push_back(v[0] + 0.2);
  }
  EXPECT_GT(difference(a, b, false).p_value, 1e-6);
  EXPECT_LT(difference(a, c, false).p_value, 1e-10);
  EXPECT_NEAR(difference(a, c, true).mean, 0.2, 1e-12);
  EXPECT_LT(difference(a, c, true).hi - difference(a, c, true).lo, 1e-12);
}

}  // namespace
}  // namespace loxo
