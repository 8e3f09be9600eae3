// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/channel.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "loxo/num/error.hpp"

namespace loxo {
namespace {

std::string seconds(double t) {
  char text[40];
  std::snprintf(text, sizeof text, "%.10g s", t);
  return text;
}

// The unit of a column: said for its key, else in its name.
double column_factor(const ChannelFile& file, const ChannelKey& key, const std::string& column,
                     Diagnostics& diagnostics) {
  const auto said = file.units.find(key.name);
  const std::string where = file.where + ".units." + key.name;
  const std::string in_name(unit_of_column(column));
  if (key.dimension == Dimension::kNone) return 1.0;
  if (said != file.units.end()) {
    const std::string& text = said->second;
    bool multiple = false;
    const double factor = declared_unit(text, key.dimension, where, multiple);
    if (!in_name.empty() && !multiple) {
      bool same = false;
      try {
        same = std::abs(unit_factor(in_name, key.dimension, where) / factor - 1) < 1e-12;
      } catch (const Error&) {
      }
      if (!same) {
        diagnostics.warn("unit_contradiction", where,
                         "column '" + column + "' is read in " + text +
                             " as declared, though its name says " + in_name);
      }
    }
    return factor;
  }
  if (!in_name.empty())
    return unit_factor(in_name, key.dimension, where + " (column '" + column + "')");
  // Names that every file of this house uses for metres per second.
  if (key.dimension == Dimension::kSpeed &&
      (column == "ve" || column == "vn" || column == "vu" || column == "vd"))
    return 1.0;
  throw Error(ErrorKind::kInput,
              "column '" + column + "' has no unit; expected " +
                  std::string(dimension_name(key.dimension)) + ": say units = { " + key.name +
                  " = \"…\" } or put it into the column's name (_deg, _m, _mps, _s …)",
              where);
}

}  // namespace

double declared_unit(const std::string& text, Dimension d, const std::string& where,
                     bool& multiple) {
  const char c = text.empty() ? ' ' : text[0];
  multiple = (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.';
  if (multiple) {
    try {
      return parse_quantity(text, d, where);
    } catch (const Error&) {
      multiple = false;  // "1/s": a unit that begins with a digit, or a fault told below
    }
  }
  return unit_factor(text, d, where);
}

const ChannelFile& section_file(const Drive& d, const std::string& section) {
  if (section == "imu") return d.imu;
  if (section == "odometer") return d.odometer;
  if (section == "attitude") return d.attitude;
  if (section == "track") return d.track;
  if (section == "fix") return d.fix;
  if (section == "velocity") return d.velocity;
  if (section == "heading") return d.heading;
  if (section == "height") return d.height;
  return d.reference;
}

std::vector<ChannelKey> section_keys(const Drive& d, const std::string& section) {
  using enum Dimension;
  const ChannelKey time{"time", 1, kTime, false};
  if (section == "imu") {
    const bool rate = d.imu_kind == "rate";
    return {time,
            {"gyro", 3, rate ? kAngularRate : kAngle, true},
            {"accel", 3, rate ? kAcceleration : kSpeed, true},
            {"temperature", 1, kTemperature, false}};
  }
  if (section == "odometer") {
    const Dimension value = d.odometer_kind == "speed"      ? kSpeed
                            : d.odometer_kind == "distance" ? kLength
                                                            : kNone;
    const bool speed = d.odometer_kind == "speed";
    std::vector<ChannelKey> keys = {time,
                                    {"value", 1, value, !speed},
                                    {"side", 1, value, false},
                                    {"steering", 1, kAngle, false}};
    if (speed) keys.insert(keys.end(), {{"east", 1, kSpeed, false}, {"north", 1, kSpeed, false}});
    return keys;
  }
  if (section == "attitude")
    return {time,
            {"heading", 1, kAngle, true},
            {"pitch", 1, kAngle, false},
            {"roll", 1, kAngle, false}};
  if (section == "track") {
    return {time,
            {"distance", 1, kLength, true},
            {"heading", 1, kAngle, false},
            {"heading_step", 1, kAngle, false},
            {"pitch", 1, kAngle, false},
            {"height", 1, kLength, false}};
  }
  if (section == "fix") {
    return {time,
            {"lat", 1, kAngle, false},
            {"lon", 1, kAngle, false},
            {"height", 1, kLength, false},
            {"east", 1, kLength, false},
            {"north", 1, kLength, false},
            {"up", 1, kLength, false},
            {"ve", 1, kSpeed, false},
            {"vn", 1, kSpeed, false},
            {"vu", 1, kSpeed, false},
            {"std_e", 1, kLength, false},
            {"std_n", 1, kLength, false},
            {"std_u", 1, kLength, false},
            {"std_v", 1, kSpeed, false}};
  }
  if (section == "velocity") {
    return {time,
            {"velocity", 3, kSpeed, false},
            {"right", 1, kSpeed, false},
            {"forward", 1, kSpeed, false},
            {"east", 1, kSpeed, false},
            {"north", 1, kSpeed, false},
            {"up", 1, kSpeed, false}};
  }
  if (section == "heading")
    return {time,
            {"heading", 1, kAngle, false},
            {"std", 1, kAngle, false},
            {"rate", 1, kAngularRate, false},
            {"lat", 1, kAngle, false},
            {"lon", 1, kAngle, false}};
  if (section == "height") return {time, {"height", 1, kLength, true}, {"rate", 1, kSpeed, false}};
  // [reference]: the columns of a solution
  return {time,
          {"lat", 1, kAngle, false},
          {"lon", 1, kAngle, false},
          {"height", 1, kLength, false},
          {"east", 1, kLength, false},
          {"north", 1, kLength, false},
          {"x", 1, kLength, false},
          {"y", 1, kLength, false},
          {"z", 1, kLength, false},
          {"ve", 1, kSpeed, false},
          {"vn", 1, kSpeed, false},
          {"vu", 1, kSpeed, false},
          {"speed", 1, kSpeed, false},
          {"roll", 1, kAngle, false},
          {"pitch", 1, kAngle, false},
          {"heading", 1, kAngle, false},
          {"qw", 1, kNone, false},
          {"qx", 1, kNone, false},
          {"qy", 1, kNone, false},
          {"qz", 1, kNone, false}};
}

Channel::Channel(const Drive& drive, const std::string& section, Diagnostics& diagnostics) {
  const ChannelFile& file = section_file(drive, section);
  table_ = open_table(file.file, file.table);
  section_ = section;
  stamps_.emplace(section);
  delay_ = file.delay;
  rate_ = file.rate;
  auto columns = file.columns;
  for (const auto& [key, names] : table_->convention().columns) {
    if (table_->convention().section == section && !columns.contains(key)) columns[key] = names;
  }
  if (!columns.contains("time") && !std::isfinite(rate_) && table_->has("t_s"))
    columns["time"] = {"t_s"};

  std::vector<std::string> chosen;
  std::vector<std::size_t> place_of_value;
  for (const auto& key : section_keys(drive, section)) {
    const auto it = columns.find(key.name);
    if (it == columns.end()) {
      if (key.required) {
        throw Error(
            ErrorKind::kInput,
            "missing; expected the column" + std::string(key.count > 1 ? "s" : "") + " of " +
                (key.dimension == Dimension::kNone ? key.name
                                                   : std::string(dimension_name(key.dimension))),
            file.where + ".columns." + key.name);
      }
      continue;
    }
    places_.push_back({key.name, place_of_value.size()});
    if (key.name == "time") time_ = place_of_value.size();
    for (const auto& column : it->second) {
      const auto known = std::find(chosen.begin(), chosen.end(), column);
      place_of_value.push_back(static_cast<std::size_t>(known - chosen.begin()));
      if (known == chosen.end()) {
        if (!table_->has(column)) {
          try {
            table_->select({column});
          } catch (const Error& e) {
            throw Error(ErrorKind::kInput, e.what(), file.where + ".columns." + key.name);
          }
        }
        chosen.push_back(column);
      } else {
        throw Error(ErrorKind::kInput, "column '" + column + "' is named twice",
                    file.where + ".columns." + key.name);
      }
      factors_.push_back(column_factor(file, key, column, diagnostics));
    }
  }
  if (time_ == npos && !std::isfinite(rate_)) {
    throw Error(
        ErrorKind::kInput,
        "missing; expected the column of time, or rate = \"100 Hz\" for rows without stamps",
        file.where + ".columns.time");
  }
  table_->select(chosen);
  values_.resize(chosen.size());

  std::set<std::string> mapped;
  for (const char* name : {"imu", "odometer", "attitude", "track", "fix", "velocity", "heading",
                           "height", "reference"}) {
    const ChannelFile& other = section_file(drive, name);
    if (!other.present || other.named != file.named || other.named_table != file.named_table)
      continue;
    for (const auto& [key, names] : other.columns) mapped.insert(names.begin(), names.end());
  }
  mapped.insert(chosen.begin(), chosen.end());
  std::string unmapped;
  for (const auto& name : table_->header()) {
    if (!mapped.contains(name)) unmapped += (unmapped.empty() ? "" : ", ") + name;
  }
  const bool told =
      std::any_of(diagnostics.list().begin(), diagnostics.list().end(), [&](const Diagnostic& d) {
        return d.kind == "unmapped_columns" && d.where == table_->path();
      });
  if (!unmapped.empty() && !told && section != "reference") {
    diagnostics.note("unmapped_columns", table_->path(), "columns that nothing maps: " + unmapped);
  }
}

bool Channel::read(Diagnostics& diagnostics) {
  while (table_->next(values_, diagnostics)) {
    for (std::size_t i = 0; i < values_.size(); ++i) values_[i] *= factors_[i];
    t_ =
        (time_ == npos ? static_cast<double>(table_->rows() - 1) / rate_ : values_[time_]) - delay_;
    if (std::isfinite(t_)) return true;
    diagnostics.bad("bad_row", table_->where(), "expected a time, found nan; row skipped");
  }
  return false;
}

bool Channel::next(Diagnostics& diagnostics) {
  for (;;) {
    from_held_ = has_held_;
    displaced_ = false;
    if (has_held_) {
      has_held_ = false;
      values_ = held_.values;
      t_ = held_.t;
    } else if (!read(diagnostics)) {
      return false;
    }
    if (any_order_) return true;
    if (stamps_->far(t_) && !from_held_) {
      // Look at the row behind: if it goes on from before, this one's stamp is wrong.
      const Held here{values_, t_, table_->rows(), table_->where()};
      if (read(diagnostics)) {
        if (t_ > stamps_->last() && t_ < here.t && !stamps_->far(t_)) {
          diagnostics.bad("stamp_ahead", here.where,
                          "[" + section_ + "] the stamp " + seconds(here.t) +
                              " is far ahead of its neighbours (" + seconds(stamps_->last()) +
                              ", " + seconds(t_) + "); row skipped");
        } else {
          held_ = {values_, t_, table_->rows(), table_->where()};
          has_held_ = true;
          values_ = here.values;
          t_ = here.t;
          here_ = here;
          displaced_ = true;
        }
      } else {
        values_ = here.values;
        t_ = here.t;
        here_ = here;
        displaced_ = true;
      }
    }
    const StampCheck::Verdict verdict = stamps_->check(
        t_, [this] { return where(); }, diagnostics);
    if (verdict == StampCheck::Verdict::kForward) return true;
    went_back_ = went_back_ || verdict == StampCheck::Verdict::kBack;
  }
}

std::size_t Channel::at(std::string_view key) const {
  for (const auto& p : places_) {
    if (p.name == key) return p.at;
  }
  return npos;
}
bool Channel::has(std::string_view key) const { return at(key) != npos; }

// A regular sensor (half of its steps within a twentieth of their median) misses a sample at one
// and a half steps; one whose stamps come in bunches at three.
void StampCheck::learn() {
  const std::size_t n = std::min(steps_, kWindow);
  double sorted[kWindow]{};
  std::copy(window_, window_ + n, sorted);
  const auto middle = sorted + n / 2;
  std::nth_element(sorted, middle, sorted + n);
  usual_ = *middle;
  std::size_t close = 0;
  for (std::size_t i = 0; i < n; ++i) close += std::abs(window_[i] - usual_) <= 0.05 * usual_;
  longest_ = usual_ * (2 * close > n ? 1.5 : 3.0);
}

void StampCheck::tell_gap(double from, double to, const std::string& where,
                          Diagnostics& diagnostics) const {
  diagnostics.warn("gap", where,
                   "[" + section_ + "] a gap of " + seconds(to - from) + " before " + seconds(to) +
                       " (usual step " + seconds(usual_) + ")");
}

StampCheck::Verdict StampCheck::check(double t, const std::function<std::string()>& where,
                                      Diagnostics& diagnostics) {
  if (!started_) {
    started_ = true;
    last_ = t;
    return Verdict::kForward;
  }
  const double step = t - last_;
  if (step == 0) {
    diagnostics.warn(
        "duplicate", where(),
        "[" + section_ + "] two rows with the stamp " + seconds(t) + "; the second is skipped");
    return Verdict::kDuplicate;
  }
  if (step < 0) {
    diagnostics.warn("time_back", where(),
                     "[" + section_ + "] time goes back from " + seconds(last_) + " to " +
                         seconds(t) + "; row skipped");
    return Verdict::kBack;
  }
  if (steps_ >= kFirst) {
    if (step > longest_) tell_gap(last_, t, where(), diagnostics);
  } else {
    early_.push_back({last_, t, where()});
  }
  window_[steps_++ % kWindow] = step;
  last_ = t;
  if (steps_ == kFirst) {
    learn();
    for (const Early& e : early_)
      if (e.to - e.from > longest_) tell_gap(e.from, e.to, e.where, diagnostics);
    early_.clear();
  } else if (steps_ > kFirst && steps_ % (kWindow / 2) == 0) {
    learn();
  }
  return Verdict::kForward;
}

}  // namespace loxo
