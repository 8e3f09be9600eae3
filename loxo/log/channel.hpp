// SPDX-License-Identifier: Apache-2.0
// One section of sensors as numbers in SI: the columns that the drive names, found in the file,
// with the factor of their unit. Used by the readers of this room.
#pragma once
#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "loxo/log/drive.hpp"
#include "loxo/log/table.hpp"
#include "loxo/text/quantity.hpp"

namespace loxo {

// A key of `columns`: how many columns it names and what they measure.
struct ChannelKey {
  std::string name;
  std::size_t count = 1;
  Dimension dimension = Dimension::kNone;
  bool required = false;
};
// The keys that a section takes; some depend on its kind.
std::vector<ChannelKey> section_keys(const Drive& drive, const std::string& section);
// SI factor of what `units` says for a key: a unit, or a multiple of one ("0.05 deg/s", "-1 rad").
// Throws Error(kInput).
double declared_unit(const std::string& text, Dimension d, const std::string& where,
                     bool& multiple);
const ChannelFile& section_file(const Drive& drive, const std::string& section);

// Order of stamps: duplicates, time going back and gaps are told. Feed stamps in file order.
class StampCheck {
 public:
  explicit StampCheck(std::string section) : section_(std::move(section)) {}
  enum class Verdict { kForward, kDuplicate, kBack };
  // `where` tells the row's place, asked only where something is to be told.
  Verdict check(double t, const std::function<std::string()>& where, Diagnostics& diagnostics);
  // A step so long that the stamp may be wrong: more than kFar usual ones.
  bool far(double t) const { return t - last_ > kFar * usual_; }
  double last() const { return last_; }
  // Median of the steps lately; kNone before the eighth.
  double usual_step() const { return usual_; }

 private:
  static constexpr std::size_t kWindow = 32, kFirst = 8;
  static constexpr double kFar = 1000;
  void learn();
  void tell_gap(double from, double to, const std::string& where, Diagnostics& diagnostics) const;

  std::string section_;
  bool started_ = false;
  double last_ = 0;
  std::size_t steps_ = 0;
  double window_[kWindow]{};                // the last steps
  double usual_ = kNone, longest_ = kNone;  // their median; what is no gap yet
  struct Early {
    double from, to;
    std::string where;
  };
  std::vector<Early> early_;  // steps before the median is known
};

class Channel {
 public:
  // Opens the file, finds the columns, resolves the units. Throws Error(kInput). Columns that no
  // section maps are noted.
  Channel(const Drive& drive, const std::string& section, Diagnostics& diagnostics);
  // The next row whose stamp is a number and after the last one's; false at the end. Duplicates,
  // time going back and gaps are told. A stamp far ahead of its neighbours is its row's fault: the
  // row is left out, not all that follow it.
  bool next(Diagnostics& diagnostics);
  // From now on rows come as they stand; who reads them puts them in order and checks them then.
  void in_any_order() { any_order_ = true; }
  bool went_back() const { return went_back_; }
  bool has(std::string_view key) const;
  // Place of a key's first value in values(); of a key that is not mapped, npos.
  std::size_t at(std::string_view key) const;
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);
  // SI values of the row, in the order of the keys. value() of an unmapped key is `otherwise`.
  const std::vector<double>& values() const { return values_; }
  double value(std::size_t place, double otherwise = kNone) const {
    return place == npos ? otherwise : values_[place];
  }
  // Stamp with the section's delay taken out.
  double t() const { return t_; }
  std::size_t rows() const {
    return displaced_ ? here_.rows : from_held_ ? held_.rows : table_->rows();
  }
  std::string where() const {
    return displaced_ ? here_.where : from_held_ ? held_.where : table_->where();
  }
  const Table& table() const { return *table_; }
  // What the format fixes, or what the drive says.
  const TableConvention& convention() const { return table_->convention(); }

 private:
  struct Place {
    std::string name;
    std::size_t at;
  };
  std::unique_ptr<Table> table_;
  std::vector<Place> places_;
  std::vector<double> values_, factors_;
  std::size_t time_ = npos;
  double delay_ = 0, rate_ = kNone, t_ = 0;

  std::string section_;
  bool read(Diagnostics& diagnostics);
  std::optional<StampCheck> stamps_;
  struct Held {  // a row that was looked at ahead of its turn
    std::vector<double> values;
    double t = 0;
    std::size_t rows = 0;
    std::string where;
  };
  Held held_, here_;  // here_: the row given out while the table stands one further
  bool has_held_ = false, from_held_ = false, displaced_ = false;
  bool any_order_ = false, went_back_ = false;
};

// Rows of a small channel in time order; a row whose stamp is not after the last is told and
// skipped.
template <class F>
void each_row(const Drive& drive, const std::string& section, Diagnostics& d, F use) {
  Channel c(drive, section, d);
  while (c.next(d)) use(c);
}

// Rows of a small channel whose rows each stand for themselves: those out of order are put in order
// of time, and told. `use(channel, diagnostics, rows)` may add one.
template <class T, class F>
std::vector<T> rows_in_order(const Drive& drive, const std::string& section, Diagnostics& d,
                             F use) {
  std::vector<T> out;
  {
    Diagnostics trial = d;
    Channel c(drive, section, trial);
    while (c.next(trial)) use(c, trial, out);
    if (!c.went_back()) {
      d = std::move(trial);
      return out;
    }
  }
  Channel c(drive, section, d);
  c.in_any_order();
  struct At {
    T row;
    std::string where;
  };
  std::vector<At> all;
  long wrong = 0;
  std::string first;
  out.clear();
  while (c.next(d)) {
    use(c, d, out);
    if (out.empty()) continue;
    if (!all.empty() && out.back().t < all.back().row.t && ++wrong == 1) first = c.where();
    all.push_back({out.back(), c.where()});
    out.clear();
  }
  d.warn("time_back", first,
         "[" + section + "] time goes back in " + std::to_string(wrong) +
             (wrong == 1 ? " row" : " rows") + "; sorted by time");
  std::stable_sort(all.begin(), all.end(),
                   [](const At& a, const At& b) { return a.row.t < b.row.t; });
  StampCheck stamps(section);
  for (const At& a : all)
    if (stamps.check(
            a.row.t, [&] { return a.where; }, d) == StampCheck::Verdict::kForward)
      out.push_back(a.row);
  return out;
}

}  // namespace loxo
