// SPDX-License-Identifier: Apache-2.0
// What a campaign must reach: statistics of its metrics beside what was expected and what is
// required, stated in the campaign's own file ([[gate]]).
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "loxo/study/campaign.hpp"
#include "loxo/text/toml.hpp"

namespace loxo {

struct CampaignGate {
  enum class Statistic { kMean, kStd, kPercentile, kLeast, kMost, kSlope };
  std::string name;
  // A metric, or the front NAME of a family NAME_at_… over the drive, of which the worst time
  // counts.
  std::string metric;
  Statistic statistic = Statistic::kPercentile;
  double percentile = 50;
  std::string on;                // slope: of `metric` on this metric, through zero
  std::vector<std::string> per;  // families: divided, time by time, by the smallest of these
  double from = 0;               // families: from this time on, s (where their times are seconds)
  // NaN where not given, in the metric's unit.
  double expected, at_least, at_most;
};
struct GateResult {
  CampaignGate gate;
  Interval value;     // 95 %; NaN bounds where none is known
  std::string where;  // the family's member that counts
  bool judged = false, met = true;
};

// Throws Error(kInput), with file:line:column, for what cannot be: unknown metric, statistic, key.
// `varied`: the campaign was changed by --set; a gate whose metric it then has not is left out.
std::vector<CampaignGate> read_gates(const TomlTable& campaign,
                                     const std::vector<std::string>& metrics, bool varied);
// Of a store's own file.
std::vector<CampaignGate> gates_of(const StoreIdentity& identity);
// `column`: a metric's values in trial order, those that are not finite included.
std::vector<GateResult> judge(const std::vector<CampaignGate>& gates,
                              const std::vector<std::string>& metrics,
                              const std::function<std::vector<double>(const std::string&)>& column);
// As "95 % of segmented_weighted, worst time from 120 s".
std::string meaning(const CampaignGate& gate);

}  // namespace loxo
