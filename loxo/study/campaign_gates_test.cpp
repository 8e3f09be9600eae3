// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/campaign_gates.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "refusal.hpp"

namespace loxo {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Ten trials of metrics whose statistics are known by heart.
const std::map<std::string, std::vector<double>>& data() {
  static const std::map<std::string, std::vector<double>> columns = {
      {"x", {-5, -4, -3, -2, -1, 1, 2, 3, 4, 5}},
      {"twice", {-10, -8, -6, -4, -2, 2, 4, 6, 8, 10}},
      {"ten", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}},
      {"bad", {1, 2, 3, kNaN, 5, 6, 7, 8, 9, 10}},
      {"way_at_0060s_pct", std::vector<double>(10, 9)},
      {"way_at_0120s_pct", std::vector<double>(10, 3)},
      {"way_at_0180s_pct", std::vector<double>(10, 4)},
      {"a_at_0060s_pct", std::vector<double>(10, 1)},
      {"a_at_0120s_pct", std::vector<double>(10, 6)},
      {"a_at_0180s_pct", std::vector<double>(10, 2)},
      {"b_at_0060s_pct", std::vector<double>(10, 5)},
      {"b_at_0120s_pct", std::vector<double>(10, 2)},
      {"b_at_0180s_pct", std::vector<double>(10, 8)},
      {"part_at_010_m", std::vector<double>(10, 7)}};
  return columns;
}
std::vector<std::string> metrics() {
  std::vector<std::string> names;
  for (const auto& [name, values] : data()) names.push_back(name);
  return names;
}
GateResult result_of(const std::string& gate) {
  const auto gates = read_gates(TomlTable::parse("[[gate]]\n" + gate, "test"), metrics(), false);
  return judge(gates, metrics(), [](const std::string& m) { return data().at(m); }).at(0);
}
double value_of(const std::string& gate) { return result_of(gate).value.value; }

TEST(CampaignGates, StatisticsAreWhatTheyAreCalled) {
  EXPECT_DOUBLE_EQ(value_of("metric = \"ten\"\nstatistic = \"mean\"\n"), 5.5);
  EXPECT_NEAR(value_of("metric = \"ten\"\nstatistic = \"std\"\n"), std::sqrt(82.5 / 9), 1e-12);
  EXPECT_DOUBLE_EQ(value_of("metric = \"ten\"\n"), 5.5);  // the median
  EXPECT_DOUBLE_EQ(value_of("metric = \"ten\"\nstatistic = \"least\"\n"), 1);
  EXPECT_DOUBLE_EQ(value_of("metric = \"ten\"\nstatistic = \"most\"\n"), 10);
  EXPECT_DOUBLE_EQ(value_of("metric = \"twice\"\nstatistic = \"slope\"\non = \"x\"\n"), 2);
  EXPECT_DOUBLE_EQ(value_of("metric = \"x\"\nstatistic = \"slope\"\non = \"twice\"\n"), 0.5);
  // What is not a number is left out, not counted as met.
  EXPECT_DOUBLE_EQ(value_of("metric = \"bad\"\nstatistic = \"most\"\n"), 10);
  EXPECT_NEAR(value_of("metric = \"bad\"\nstatistic = \"mean\"\n"), 51.0 / 9, 1e-12);
  EXPECT_DOUBLE_EQ(value_of("metric = \"part\"\nstatistic = \"mean\"\n"), 7);
}

TEST(CampaignGates, AFamilyCountsByItsWorstTime) {
  auto r = result_of("metric = \"way\"\nfrom = \"120 s\"\nat_most = 4.5\n");
  EXPECT_DOUBLE_EQ(r.value.value, 4);
  EXPECT_EQ(r.where, "0180s");
  EXPECT_TRUE(r.met);
  r = result_of("metric = \"way\"\nat_most = 4.5\n");  // from the beginning
  EXPECT_DOUBLE_EQ(r.value.value, 9);
  EXPECT_FALSE(r.met);
  r = result_of("metric = \"way\"\nfrom = \"120 s\"\nat_least = 3.5\n");  // the least is the worst
  EXPECT_DOUBLE_EQ(r.value.value, 3);
  EXPECT_FALSE(r.met);
  // 9/1, 3/2, 4/2.
  r = result_of("metric = \"way\"\nfrom = \"120 s\"\nper = [\"a\", \"b\"]\nat_most = 2\n");
  EXPECT_DOUBLE_EQ(r.value.value, 2);
  EXPECT_TRUE(r.met);
}

TEST(CampaignGates, BoundsAreInclusiveAndNothingIsJudgedWithoutOne) {
  EXPECT_TRUE(result_of("metric = \"ten\"\nstatistic = \"most\"\nat_most = 10\n").met);
  EXPECT_FALSE(result_of("metric = \"ten\"\nstatistic = \"most\"\nat_most = 9.9\n").met);
  EXPECT_TRUE(result_of("metric = \"ten\"\nstatistic = \"least\"\nat_least = 1\n").met);
  EXPECT_FALSE(result_of("metric = \"ten\"\nstatistic = \"least\"\nat_least = 1.1\n").met);
  EXPECT_FALSE(result_of("metric = \"ten\"\nexpected = 3\n").judged);
  EXPECT_TRUE(result_of("metric = \"ten\"\nexpected = 3\n").met);
  const auto gates = read_gates(TomlTable::parse("[[gate]]\nmetric = \"ten\"\nat_most = 3\n", "t"),
                                metrics(), false);
  const auto none =
      judge(gates, metrics(), [](const std::string&) { return std::vector<double>(9, kNaN); });
  EXPECT_FALSE(none.at(0).met);
}

TEST(CampaignGates, WhatCannotBeIsRefusedWithItsPlace) {
  const auto refused = [](const std::string& gate, const std::string& words) {
    const std::string said = testing::refusal([&] { result_of(gate); }, gate);
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  refused("metric = \"tem\"\n", "did you mean 'ten'");
  refused("metric = \"wai\"\n", "did you mean 'way'");
  refused("metric = \"ten\"\nstatistic = \"meen\"\n", "did you mean 'mean'");
  refused("metric = \"ten\"\nstatistic = \"slope\"\n", "on");
  refused("metric = \"ten\"\nstatistic = \"slope\"\non = \"way\"\n", "unknown metric 'way'");
  refused("metric = \"ten\"\npercentile = 100\n", "between 0 and 100");
  refused("metric = \"ten\"\nfrom = \"3 s\"\n", "one number a trial");
  refused("metric = \"way\"\nfrom = \"181 s\"\n", "that late");
  refused("metric = \"way\"\nper = [\"part\"]\n", "other times");
  // A campaign changed by --set leaves out the gates whose metrics it has not, and no others.
  const std::string two = "[[gate]]\nmetric = \"tem\"\n[[gate]]\nmetric = \"ten\"\n";
  EXPECT_EQ(read_gates(TomlTable::parse(two, "t"), metrics(), true).size(), 1u);
}

}  // namespace
}  // namespace loxo
