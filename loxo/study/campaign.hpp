// SPDX-License-Identifier: Apache-2.0
// Ten thousand drives: trials in lanes, lanes on threads, threads on ranks. The rows depend on the
// campaign alone.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "loxo/study/draw.hpp"
#include "loxo/study/store.hpp"
#include "loxo/study/trial.hpp"
#include "loxo/text/toml.hpp"

namespace loxo {

// Stop when the confidence interval of a statistic of a metric is narrow enough; judged on whole
// blocks in trial order.
struct StopRule {
  enum class Statistic { kMean, kStd, kPercentile };
  std::string metric;  // empty: no rule
  Statistic statistic = Statistic::kMean;
  double percentile = 50;
  double half_width = 0;  // of the interval, in the metric's unit; 0: see relative
  double relative = 0;    // half width over |statistic|
  double confidence = 0.95;
  std::uint64_t at_least = 1000;  // trials before it is asked
};
struct Interval {
  double value = 0, lo = 0, hi = 0;
};
// The interval of a statistic; NaN where it cannot be told (fewer than 8 values).
// Running sums of a sample, in the order given.
struct RunningMoments {
  double n = 0, mean = 0, m2 = 0, m3 = 0, m4 = 0;  // sums of powers of the deviation from the mean
  void add(double x);
};
Interval confidence_interval(const RunningMoments& moments, StopRule::Statistic statistic,
                             double confidence);
Interval confidence_interval(const std::vector<double>& values, StopRule::Statistic statistic,
                             double percentile, double confidence);

struct Campaign {
  StoreIdentity identity;
  std::unique_ptr<TrialKind> kind;
  Draws draws;
  std::uint64_t trials = 1000;  // at most
  StopRule stop;
};
struct CampaignSource {
  std::string text, name;              // TOML; the file's name, for messages
  std::vector<std::string> sets;       // key=value on top
  std::uint64_t seed = 0, trials = 0;  // replace the file's where not 0
};
// Refuses unknown kinds, parameters, metrics and distributions that cannot be, with
// file:line:column.
Campaign read_campaign(const CampaignSource& source, const std::string& version);
// The campaign of a store, finished or not. Throws Error(kInput) where `version` is not the one
// that began it.
Campaign campaign_of(const StoreIdentity& identity, const std::string& version,
                     const std::string& store);
// The campaigns that come with the program; examples/campaigns/ holds the same files.
struct ReadyCampaign {
  std::string name, text;
};
const std::vector<ReadyCampaign>& ready_campaigns();

// One trial alone, in double: columns in the store's order and the health bits.
std::vector<double> run_trial(const Campaign& campaign, std::uint64_t trial);
// A block of trials on this thread, in lanes.
Block run_block(const Campaign& campaign, std::uint64_t index, std::uint64_t count);

// The processes of one campaign: alone, or the ranks of an MPI job (mpirun, srun). One object a
// process, in main().
class Ranks {
 public:
  Ranks();
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;
  int rank() const { return rank_; }
  int size() const { return size_; }
  // Whether every rank gave the same number.
  bool all_equal(std::uint64_t x) const;
  // Waits for all; the largest of what the ranks gave.
  int largest(int x) const;
  double sum(double x) const;
  // Rank 0's list, to all.
  void share(std::vector<std::uint64_t>& list) const;
  static bool built_in();

 private:
  int rank_ = 0, size_ = 1;
  bool mine_ = false;
};

struct RunOptions {
  std::string store;
  int threads = 0;                         // 0: as many as there are
  std::function<void(double)> progress{};  // trials done, of this process
  const std::atomic<bool>* interrupted = nullptr;
};
struct RunResult {
  std::uint64_t trials = 0;    // held in the store
  std::uint64_t computed = 0;  // now, by all ranks
  std::uint64_t resumed = 0;   // found done
  bool complete = false;       // false: interrupted
  bool stopped_by_rule = false;
  double seconds = 0;
  int threads = 1;
};
// Runs what is missing and merges. Throws Error(kWork) for a full disk, Error(kInput) for a store
// of another campaign.
RunResult run_campaign(const Campaign& campaign, const RunOptions& options, const Ranks& ranks);

// Merges what a running or interrupted campaign holds so far into STORE; its trials in order,
// without gaps.
std::uint64_t merge_parts(const std::string& store);

}  // namespace loxo
