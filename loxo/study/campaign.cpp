// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/campaign.hpp"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_pipeline.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "loxo/ins/solution.hpp"
#include "loxo/num/error.hpp"
#include "loxo/study/statistics.hpp"

namespace loxo {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Bits of health from what a trial gave: a metric that is not a number.
double health_of(const double* metrics, std::size_t n) {
  for (std::size_t j = 0; j < n; ++j)
    if (!std::isfinite(metrics[j])) return kHealthDomain;
  return 0;
}

// `count` trials from `first` into rows (columns and health), eight at a time; what is over runs in
// spare lanes.
void run_trials(const Campaign& c, std::uint64_t first, std::uint64_t count, double* rows) {
  const std::size_t np = c.kind->parameters().size(), nm = c.kind->metrics().size(),
                    width = np + nm + 1;
  std::vector<double> p(8 * np), m(8 * nm);
  for (std::uint64_t i = 0; i < count; i += 8) {
    for (std::uint64_t k = 0; k < 8; ++k) c.draws.at(first + i + k, {&p[k * np], np});
    c.kind->eight(p.data(), c.identity.seed, first + i, m.data());
    for (std::uint64_t k = 0; k < 8 && i + k < count; ++k) {
      double* row = rows + (i + k) * width;
      std::memcpy(row, &p[k * np], np * sizeof(double));
      std::memcpy(row + np, &m[k * nm], nm * sizeof(double));
      row[width - 1] = health_of(&m[k * nm], nm);
    }
  }
}

// Follows the stopping rule over the blocks in trial order, whoever computed them and whenever they
// came.
class Judge {
 public:
  explicit Judge(const Campaign& c)
      : campaign_(c), next_check_(std::max<std::uint64_t>(c.stop.at_least, 8)) {
    if (c.stop.metric.empty()) return;
    const auto& columns = c.identity.columns;
    for (std::size_t j = 0; j < columns.size(); ++j)
      if (columns[j].name == c.stop.metric) column_ = j;
  }
  bool on() const { return !campaign_.stop.metric.empty(); }
  void add(const Block& b) {
    if (!on() || stopped_) return;
    const std::size_t width = campaign_.identity.columns.size() + 1;
    std::vector<double> v;
    for (std::size_t i = column_; i < b.rows.size(); i += width) v.push_back(b.rows[i]);
    waiting_[b.index] = std::move(v);
    for (auto it = waiting_.find(next_); it != waiting_.end() && !stopped_;
         it = waiting_.find(next_)) {
      if (it->second.size() < campaign_.identity.block) break;  // judged on whole blocks only
      for (double x : it->second)
        if (std::isfinite(x)) {
          moments_.add(x);
          // Only a percentile needs the values themselves.
          if (campaign_.stop.statistic == StopRule::Statistic::kPercentile) values_.push_back(x);
        }
      waiting_.erase(it);
      ++next_;
      const std::uint64_t n = next_ * campaign_.identity.block;
      // Asked again when the number has grown by a twentieth: a function of the number alone.
      if (n < next_check_) continue;
      next_check_ = n + std::max<std::uint64_t>(n / 20, 1);
      if (narrow()) stopped_ = true, at_ = n;
    }
  }
  bool stopped() const { return stopped_; }
  std::uint64_t at() const { return at_; }

 private:
  bool narrow() const {
    const StopRule& s = campaign_.stop;
    const Interval i = s.statistic == StopRule::Statistic::kPercentile
                           ? confidence_interval(values_, s.statistic, s.percentile, s.confidence)
                           : confidence_interval(moments_, s.statistic, s.confidence);
    const double half = 0.5 * (i.hi - i.lo);
    return s.half_width > 0 ? half <= s.half_width : half <= s.relative * std::fabs(i.value);
  }
  const Campaign& campaign_;
  std::size_t column_ = 0;
  std::uint64_t next_ = 0, next_check_, at_ = 0;
  bool stopped_ = false;
  std::map<std::uint64_t, std::vector<double>> waiting_;
  RunningMoments moments_;
  std::vector<double> values_;
};

std::uint64_t block_size(const Campaign& c, std::uint64_t index) {
  const std::uint64_t first = index * c.identity.block;
  return first >= c.trials ? 0 : std::min(c.identity.block, c.trials - first);
}

// The rows of a finished store become a segment again, to be continued.
void reopen(const std::string& store, const Campaign& c, SegmentReader& reader) {
  Store held(store);
  SegmentWriter writer(parts_folder(store), c.identity, 0);
  for (std::uint64_t b = 0; b * c.identity.block < held.trials(); ++b)
    if (reader.held(b) == 0) writer.append(held.block(b));
}

}  // namespace

std::vector<double> run_trial(const Campaign& c, std::uint64_t trial) {
  const std::size_t np = c.kind->parameters().size(), nm = c.kind->metrics().size();
  std::vector<double> row(np + nm + 1);
  c.draws.at(trial, {row.data(), np});
  c.kind->alone(row.data(), c.identity.seed, trial, row.data() + np);
  row.back() = health_of(row.data() + np, nm);
  return row;
}

Block run_block(const Campaign& c, std::uint64_t index, std::uint64_t count) {
  Block b;
  b.index = index;
  b.rows.resize(count * (c.identity.columns.size() + 1));
  run_trials(c, index * c.identity.block, count, b.rows.data());
  return b;
}

namespace {

// What is on disk, as rank 0 sees it: one reader of all segments, however many ranks there are.
struct OnDisk {
  SegmentReader reader;
  Judge judge;
  OnDisk(const Campaign& c, const std::string& folder) : reader(folder, c.identity), judge(c) {}
  void look() {
    reader.scan([&](const Block& b) { judge.add(b); });
  }
};

// A store continued by a program that computes other bits would mix two campaigns.
void check_bits(const Campaign& c, const SegmentReader& reader, std::uint64_t blocks,
                const std::string& store) {
  for (std::uint64_t b = 0; b < blocks; ++b) {
    if (reader.held(b) == 0) continue;
    const Block held = reader.read(b);
    const auto again = run_trial(c, b * c.identity.block);
    for (std::size_t j = 0; j < again.size(); ++j)
      if (again[j] != held.rows[j] && !(std::isnan(again[j]) && std::isnan(held.rows[j])))
        throw Error(ErrorKind::kInput,
                    "trial " + std::to_string(b * c.identity.block) +
                        " gives other bits in this program than in the store; finish it with the "
                        "program that began it, or choose another store",
                    store);
    return;
  }
}

// TBB runs the filters of a pipeline in an order that the thread sanitizer cannot see, as the
// library itself is not instrumented: under it, and only there, the order is said aloud.
class FilterOrder {
#ifdef __SANITIZE_THREAD__
 public:
  void seen() const { static_cast<void>(count_.load(std::memory_order_acquire)); }
  void done() { count_.fetch_add(1, std::memory_order_acq_rel); }

 private:
  std::atomic<unsigned> count_ = 0;
#else
 public:
  void seen() const {}
  void done() {}
#endif
};

// Rank 0 tells the others through the folder that the stopping rule is satisfied.
std::string enough_file(const std::string& store) { return parts_folder(store) + "/enough"; }

// `held`: trials on disk of each block. `disk`: rank 0 alone.
RunResult run_here(const Campaign& c, const RunOptions& options, const Ranks& ranks,
                   const std::vector<std::uint64_t>& held, OnDisk* disk) {
  RunResult result;
  const double started = now();
  const std::uint64_t blocks = held.size();
  for (std::uint64_t b = 0; b < blocks; ++b)
    if (held[b] >= block_size(c, b)) result.resumed += block_size(c, b);

  SegmentWriter writer(parts_folder(options.store), c.identity, ranks.rank());
  result.threads = options.threads > 0 ? options.threads : oneapi::tbb::info::default_concurrency();
  const auto threads = static_cast<std::size_t>(result.threads);
  oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism, threads);
  const std::size_t width = c.identity.columns.size() + 1;
  const auto grain = static_cast<std::uint64_t>(c.kind->grain());

  struct Piece {
    std::uint64_t block = 0, offset = 0, count = 0;
    bool last = false;
    std::vector<double> rows;
  };
  FilterOrder order;
  std::uint64_t block = static_cast<std::uint64_t>(ranks.rank()), offset = 0;
  const bool rule = !c.stop.metric.empty();
  bool enough = disk != nullptr && disk->judge.stopped();
  Block growing;
  const auto interrupted = [&] {
    return options.interrupted != nullptr && options.interrupted->load();
  };
  const auto look = [&] {
    if (disk == nullptr) {
      enough = std::filesystem::exists(enough_file(options.store));
      return;
    }
    disk->look();
    enough = disk->judge.stopped();
    if (enough && ranks.size() > 1) std::ofstream(enough_file(options.store)) << "yes\n";
  };

  // As many pieces are under way as there are tokens, and they end in their order: the piece that
  // used a slot before is kept when the slot comes round again.
  std::vector<Piece> ring(4 * threads);
  std::size_t fed = 0;
  const auto feed = [&](oneapi::tbb::flow_control& flow) -> Piece* {
    if (offset == 0) {
      while (block < blocks && held[block] >= block_size(c, block))
        block += static_cast<std::uint64_t>(ranks.size());
      if (block >= blocks || enough || interrupted()) {
        flow.stop();
        order.done();
        return nullptr;
      }
    } else if (interrupted()) {
      flow.stop();
      order.done();
      return nullptr;
    }
    const std::uint64_t size = block_size(c, block);
    Piece& piece = ring[fed++ % ring.size()];
    piece.block = block;
    piece.offset = offset;
    piece.count = std::min(grain, size - offset);
    offset += piece.count;
    piece.last = offset == size;
    if (piece.last) offset = 0, block += static_cast<std::uint64_t>(ranks.size());
    order.done();
    return &piece;
  };
  const auto work = [&](Piece* piece) -> Piece* {
    order.seen();
    piece->rows.resize(piece->count * width);
    run_trials(c, piece->block * c.identity.block + piece->offset, piece->count,
               piece->rows.data());
    order.done();
    return piece;
  };
  const auto keep = [&](const Piece* kept) {
    order.seen();
    const Piece& piece = *kept;
    growing.index = piece.block;
    growing.rows.insert(growing.rows.end(), piece.rows.begin(), piece.rows.end());
    result.computed += piece.count;
    if (piece.last) {
      writer.append(growing);
      growing.rows.clear();
    }
    if (options.progress) options.progress(static_cast<double>(result.resumed + result.computed));
    order.done();
  };
  // With a rule, the pipeline runs in stretches of half a second, between which the folder is read:
  // the blocks of other ranks come through it, without messages and without a master to lose.
  do {
    const double until = rule ? now() + 0.5 : std::numeric_limits<double>::infinity();
    const auto timed = [&](oneapi::tbb::flow_control& flow) -> Piece* {
      order.seen();
      if (offset == 0 && now() > until) {
        flow.stop();
        order.done();
        return nullptr;
      }
      return feed(flow);
    };
    namespace tbb = oneapi::tbb;
    tbb::parallel_pipeline(
        4 * threads, tbb::make_filter<void, Piece*>(tbb::filter_mode::serial_in_order, timed) &
                         tbb::make_filter<Piece*, Piece*>(tbb::filter_mode::parallel, work) &
                         tbb::make_filter<Piece*, void>(tbb::filter_mode::serial_in_order, keep));
    order.seen();
    if (rule) look();
    order.done();
  } while (block < blocks && !enough && !interrupted());
  writer.sync();
  result.complete = !interrupted();
  result.seconds = now() - started;
  return result;
}

std::uint64_t merge_blocks(const Campaign* c, const std::string& store, const StoreIdentity& id,
                           bool finished, bool* by_rule) {
  SegmentReader reader(parts_folder(store), id);
  std::unique_ptr<Judge> judge;
  if (c != nullptr) judge = std::make_unique<Judge>(*c);
  reader.scan([&](const Block& b) {
    if (judge) judge->add(b);
  });
  std::uint64_t count = 0;
  const std::uint64_t most = c != nullptr ? c->trials : std::numeric_limits<std::uint64_t>::max();
  for (std::uint64_t b = 0; reader.held(b) > 0 && count < most; ++b) {
    count = b * id.block + reader.held(b);
    if (reader.held(b) < id.block) break;
  }
  count = std::min(count, most);
  if (judge && judge->stopped()) {
    count = std::min(count, judge->at());
    if (by_rule != nullptr) *by_rule = true;
  }
  write_store(store, id, count, {{"complete", finished ? "yes" : "no"}},
              [&](std::uint64_t b) { return reader.read(b); });
  return count;
}

}  // namespace

RunResult run_campaign(const Campaign& c, const RunOptions& options, const Ranks& ranks) {
  if (options.store.empty()) throw Error(ErrorKind::kUsage, "expected -o STORE");
  // Ranks with different binaries or campaigns would write one store together.
  const auto self = std::filesystem::exists("/proc/self/exe") && ranks.size() > 1
                        ? file_fingerprint("/proc/self/exe")
                        : 0;
  if (!ranks.all_equal(self))
    throw Error(ErrorKind::kInput,
                "the ranks run different programs: install the same one on every machine");
  if (!ranks.all_equal(c.identity.hash()) || !ranks.all_equal(c.trials))
    throw Error(ErrorKind::kInput,
                "the ranks read different campaigns: give every machine the same file");

  // Every rank must reach the same meeting points, also the one that failed.
  std::unique_ptr<Error> failed;
  const auto together = [&](const std::function<void()>& work) {
    try {
      if (!failed) work();
    } catch (const Error& e) {
      failed = std::make_unique<Error>(e);
    }
    const int worst = ranks.largest(failed ? failed->exit_code() : 0);
    if (failed) throw *failed;
    if (worst != 0)
      throw Error(static_cast<ErrorKind>(worst), "another rank failed; the same command resumes");
  };
  RunResult result;
  const std::uint64_t blocks = (c.trials + c.identity.block - 1) / c.identity.block;
  std::vector<std::uint64_t> held(blocks);
  std::unique_ptr<OnDisk> disk;
  together([&] {
    if (ranks.rank() != 0) return;
    const bool fresh = !has_parts(options.store);
    open_parts(options.store, c.identity);
    if (fresh && std::filesystem::exists(options.store)) {
      SegmentReader reader(parts_folder(options.store), c.identity);
      reopen(options.store, c, reader);
    }
    std::filesystem::remove(enough_file(options.store));
    disk = std::make_unique<OnDisk>(c, parts_folder(options.store));
    disk->look();
    check_bits(c, disk->reader, blocks, options.store);
    for (std::uint64_t b = 0; b < blocks; ++b) held[b] = disk->reader.held(b);
  });
  ranks.share(held);
  together([&] { result = run_here(c, options, ranks, held, disk.get()); });
  disk.reset();
  result.computed = static_cast<std::uint64_t>(ranks.sum(static_cast<double>(result.computed)));
  const bool interrupted = ranks.largest(result.complete ? 0 : 1) != 0;
  result.complete = !interrupted;
  together([&] {
    if (ranks.rank() != 0) return;
    if (interrupted) return;
    result.trials = merge_blocks(&c, options.store, c.identity, true, &result.stopped_by_rule);
    remove_parts(options.store);
  });
  return result;
}

std::uint64_t merge_parts(const std::string& store) {
  return merge_blocks(nullptr, store, read_identity(store), false, nullptr);
}

}  // namespace loxo
