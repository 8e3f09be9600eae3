// SPDX-License-Identifier: Apache-2.0
// What a navigator keeps beside its state: measurements that wait or were used lately, and the
// filter as it was at a few past times. For navigator*.cpp only.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "loxo/estimate/navigator.hpp"
#include "loxo/num/functions.hpp"

namespace loxo {

// What waits and what was used lately, in order of its times; fixed capacity. `from`: not before
// the strapdown has passed this time, so that doing a stretch again finds every measurement when it
// came.
template <class T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : data_(capacity) {}
  bool ready(double now, double shift = 0) const {
    return next_ < end_ && at(next_).x.t - shift <= now + 1e-9 && at(next_).from < now;
  }
  T take() { return at(next_++).x; }
  bool push(const T& x, double from) {
    if (end_ - begin_ == data_.size()) {
      if (begin_ == next_) return false;
      begin_ = next_;  // what was used is forgotten first
    }
    std::uint64_t i = end_;
    while (i > begin_ && at(i - 1).x.t > x.t) {
      slot(i) = at(i - 1);
      --i;
    }
    slot(i) = {x, from};
    if (i < next_) ++next_;
    ++end_;
    return true;
  }
  std::uint64_t cursor() const { return next_; }
  bool remembers(std::uint64_t cursor) const { return cursor >= begin_; }
  void go_back(std::uint64_t cursor) { next_ = cursor; }
  void forget(std::uint64_t before) { begin_ = before; }

 private:
  struct Entry {
    T x;
    double from = 0;
  };
  Entry& slot(std::uint64_t i) { return data_[i % data_.size()]; }
  const Entry& at(std::uint64_t i) const { return data_[i % data_.size()]; }
  std::vector<Entry> data_;
  std::uint64_t begin_ = 0, next_ = 0, end_ = 0;
};

struct Navigator::Pending {
  Ring<OdometerTick> ticks{4096};
  struct Position {
    double t = 0;
    Fix fix;
    bool user = false;
  };
  Ring<Position> fixes{1024};
  Ring<HeadingSample> headings{1024};
  Ring<HeightSample> heights{1024};
  Ring<VelocitySample> velocities{1024};
  double last_tick = -1e300;
  bool started = false;
  std::array<std::uint64_t, 5> cursors() const {
    return {ticks.cursor(), fixes.cursor(), headings.cursor(), heights.cursor(),
            velocities.cursor()};
  }
  bool remembers(const std::array<std::uint64_t, 5>& c) const {
    return ticks.remembers(c[0]) && fixes.remembers(c[1]) && headings.remembers(c[2]) &&
           heights.remembers(c[3]) && velocities.remembers(c[4]);
  }
  void go_back(const std::array<std::uint64_t, 5>& c) {
    ticks.go_back(c[0]), fixes.go_back(c[1]), headings.go_back(c[2]), heights.go_back(c[3]),
        velocities.go_back(c[4]);
  }
  void forget(const std::array<std::uint64_t, 5>& c) {
    ticks.forget(c[0]), fixes.forget(c[1]), headings.forget(c[2]), heights.forget(c[3]),
        velocities.forget(c[4]);
  }
};

// The filter as it was at a few past times, and the samples since the first of them.
struct Navigator::History {
  struct Mark {
    NavigatorMemory memory;
    std::array<std::uint64_t, 5> cursors{};
    std::uint64_t sample = 0;  // of the next sample
  };
  History(const NavigatorConfig& c)
      : limit(c.late_limit),
        period(max(0.25, c.late_limit / 16)),
        marks(static_cast<std::size_t>(c.late_limit / period) + 3,
              Mark{NavigatorMemory(c.standstill), {}, 0}),
        samples(static_cast<std::size_t>(
                    min(1e6, (c.late_limit + 2 * period) / max(c.imu_interval, 1e-4))) +
                64) {}
  Mark& mark(std::size_t i) { return marks[(first + i) % marks.size()]; }
  ImuIncrement<double>& sample(std::uint64_t i) { return samples[i % samples.size()]; }
  void drop_oldest() {
    first = (first + 1) % marks.size();
    --count;
  }
  double limit, period;
  std::vector<Mark> marks;
  std::vector<ImuIncrement<double>> samples;
  std::size_t first = 0, count = 0;
  std::uint64_t end = 0;
};

}  // namespace loxo
