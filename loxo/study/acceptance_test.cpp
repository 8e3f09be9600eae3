// SPDX-License-Identifier: Apache-2.0
// The gates of vehicle.md 7.3 on the three routes, by the campaigns acceptance-straight, -mixed and
// -closed: sensor errors from the non-linear simulator, 400 hours each with LOXO_LONG=1, four
// minutes of eight drives else. (V-54), (V-55), (V-56), (V-57), (V-58), (V-59), (V-60)
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "loxo/study/campaign_gates.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

void gates(const std::string& route) {
  const bool all = std::getenv("LOXO_LONG") != nullptr;
  CampaignSource source;
  source.name = "acceptance-" + route;
  for (const auto& ready : ready_campaigns())
    if (ready.name == source.name) source.text = ready.text;
  ASSERT_FALSE(source.text.empty()) << source.name;
  if (!all) source.sets = {"settings.duration=\"240 s\"", "settings.every=\"30 s\""};
  // The seed of the file, unless another is asked for.
  source.seed = testing::seed(read_campaign(source, "test").identity.seed);
  Campaign c = read_campaign(source, "test");
  if (!all) c.trials = 8;
  const std::size_t width = c.identity.columns.size() + 1;
  std::vector<double> rows;
  for (std::uint64_t b = 0; b * c.identity.block < c.trials; ++b) {
    const Block block =
        run_block(c, b, std::min(c.identity.block, c.trials - b * c.identity.block));
    rows.insert(rows.end(), block.rows.begin(), block.rows.end());
  }
  std::vector<std::string> metrics;
  for (const auto& column : c.identity.columns)
    if (!column.parameter) metrics.push_back(column.name);
  c.identity.source = source.text, c.identity.sets = source.sets;
  const auto results = judge(gates_of(c.identity), metrics, [&](const std::string& name) {
    std::vector<double> v;
    for (std::size_t j = 0; j < c.identity.columns.size(); ++j)
      if (c.identity.columns[j].name == name)
        for (std::size_t i = j; i < rows.size(); i += width) v.push_back(rows[i]);
    return v;
  });
  std::printf("%s, %llu drives\n", route.c_str(), static_cast<unsigned long long>(c.trials));
  int judged = 0;
  for (const auto& r : results) {
    std::printf("  %-52s %8.4g %8.4g\n", r.gate.name.c_str(), r.value.value, r.gate.expected);
    EXPECT_TRUE(std::isfinite(r.value.value)) << r.gate.name;
    // Of eight drives a 95 % value is the largest of eight of phi_U, 3' and more: 0.2 % of the
    // distance it may exceed. The finding of scale and angle holds in every one.
    if (!all && r.gate.metric.find("found") == std::string::npos &&
        r.gate.metric.find("forced") == std::string::npos)
      continue;
    judged += r.judged;
    EXPECT_TRUE(r.met) << r.gate.name << ": " << r.value.value << ", required "
                       << (std::isfinite(r.gate.at_least) ? r.gate.at_least : r.gate.at_most);
  }
  EXPECT_GE(judged, all ? 8 : 5);
}

TEST(Acceptance, Straight) { gates("straight"); }
TEST(Acceptance, Mixed) { gates("mixed"); }
TEST(Acceptance, Closed) { gates("closed"); }

}  // namespace
}  // namespace loxo
