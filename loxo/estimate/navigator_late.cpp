// SPDX-License-Identifier: Apache-2.0
// Measurements as they come, ahead of their time or late: the queue, and the way back.
#include "loxo/estimate/navigator_queue.hpp"

namespace loxo {

// The time from which a measurement may be used: now, where it is ahead of the strapdown; its own
// time, where the filter can go back to it; NaN: too old. Within one sample of its own it is in
// time too where nothing is remembered of before, and for a wheel always.
double Navigator::arrival(double t, bool near_is_in_time) {
  if (!pending_->started) return -1e300;
  const double age = s_.t - t;
  const bool near = age <= config_.imu_interval * (1 + 1e-6);
  if (age < -1e-9 || (near && near_is_in_time)) return s_.t;
  const bool remembered =
      history_ && !tape_ && history_->count > 0 && age <= history_->limit + 1e-9 &&
      history_->mark(0).memory.s_.t < t - 1e-9 && pending_->remembers(history_->mark(0).cursors);
  if (remembered) {
    ++events_.rewound;
    rewind_to_ = min(rewind_to_, t);
    return t - 1e-8;
  }
  if (near) return s_.t;
  ++events_.late;
  next_health_ |= kHealthRejected;
  return kNone;
}

bool Navigator::odometer(const OdometerTick& tick) {
  if (!(tick.t > pending_->last_tick)) return false;
  const double from = arrival(tick.t, true);
  // A lost distance: the next reading begins anew.
  if (!given(from)) return have_tick_ = have_tick_ && tick.is_speed, false;
  if (!pending_->ticks.push(tick, from)) return false;
  pending_->last_tick = tick.t;
  return true;
}

bool Navigator::fix(const Fix& f) {
  const double from = arrival(f.t, false);
  return given(from) && pending_->fixes.push({f.t, f, false}, from);
}

bool Navigator::benchmark(const Fix& f) {
  const double from = arrival(f.t, false);
  return given(from) && pending_->fixes.push({f.t, f, true}, from);
}

bool Navigator::heading(const HeadingSample& h) {
  const double from = arrival(h.t, false);
  return given(from) && pending_->headings.push(h, from);
}

bool Navigator::height(const HeightSample& h) {
  const double from = arrival(h.t, false);
  return given(from) && pending_->heights.push(h, from);
}

bool Navigator::velocity(const VelocitySample& v) {
  const double from = arrival(v.t, false);
  return given(from) && pending_->velocities.push(v, from);
}

// A mark of the filter as it is; those no longer needed are dropped.
void Navigator::remember() {
  History& h = *history_;
  while (h.count > 1 && h.mark(1).memory.s_.t < s_.t - h.limit - 1e-9) h.drop_oldest();
  if (h.count == h.marks.size()) h.drop_oldest();
  History::Mark& m = h.mark(h.count++);
  m.memory = *this;
  m.cursors = pending_->cursors();
  m.sample = h.end;
  pending_->forget(h.mark(0).cursors);
}

// Back to the last mark before the oldest late measurement, and forward again. What the row to come
// has to tell of it.
std::uint32_t Navigator::rewind() {
  History& h = *history_;
  const double to = rewind_to_;
  rewind_to_ = 1e300;
  while (h.count > 1 && !(h.mark(h.count - 1).memory.s_.t < to - 1e-9)) --h.count;
  const auto rejected = [&] {
    long sum = 0;
    for (const InnovationCount& c : counts_) sum += c.rejected;
    return sum;
  };
  const long before = rejected(), late = events_.late, rewound = events_.rewound;
  const History::Mark& m = h.mark(h.count - 1);
  if (!pending_->remembers(m.cursors)) return 0;
  static_cast<NavigatorMemory&>(*this) = m.memory;
  pending_->go_back(m.cursors);
  events_.late = late;
  events_.rewound = rewound;
  for (std::uint64_t i = m.sample; i < h.end; ++i) {
    if (s_.t - h.mark(h.count - 1).memory.s_.t >= h.period) {
      const std::uint64_t end = h.end;
      h.end = i;
      remember();
      h.end = end;
    }
    process(h.sample(i), 0);
  }
  return rejected() > before ? kHealthRejected : 0u;
}

}  // namespace loxo
