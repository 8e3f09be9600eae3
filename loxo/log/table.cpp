// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/table.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>

#include "loxo/log/foreign.hpp"
#include "loxo/log/hdf5_file.hpp"
#include "loxo/log/matlab_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

enum class Kind { kH5, kMatlab, kOther };
// MATLAB files of v7.3 are HDF5 as well, behind a block that says MATLAB.
Kind kind_of(const std::string& path) {
  if (path == "-") return Kind::kOther;
  char head[16]{};
  std::ifstream(path, std::ios::binary).read(head, sizeof head - 1);
  const std::string_view text(head);
  if (text.starts_with("MATLAB 5.0 MAT") || text.starts_with("MATLAB 7.3 MAT"))
    return Kind::kMatlab;
  return is_h5(path) ? Kind::kH5 : Kind::kOther;
}

// VectorNav's CSV as INSTINCT writes it: quantities by name, body axes forward-right-down.
void vectornav(TableConvention& c, const std::vector<std::string>& header) {
  const auto has = [&](const std::string& name) {
    return std::find(header.begin(), header.end(), name) != header.end();
  };
  const std::string clock = "Time::TimeStartup [ns]";
  if (!has(clock)) return;
  const std::string gyro = "IMU::UncompGyro::", accel = "IMU::UncompAccel::";
  const std::string place = "GNSS1::PosLla::", speed = "GNSS1::VelNed::";
  if (has(gyro + "X [rad/s]") && has(accel + "X [m/s^2]")) {
    c = {"VectorNav CSV", "imu", "rate", "end", "FRD", {{"time", {clock}}}};
    for (const char* axis : {"X", "Y", "Z"}) {
      c.columns["gyro"].push_back(gyro + axis + " [rad/s]");
      c.columns["accel"].push_back(accel + axis + " [m/s^2]");
    }
  } else if (has(place + "latitude [deg]")) {
    c = {"VectorNav CSV",
         "fix",
         "",
         "",
         "",
         {{"time", {clock}},
          {"lat", {place + "latitude [deg]"}},
          {"lon", {place + "longitude [deg]"}},
          {"height", {place + "altitude [m]"}}}};
    if (has(speed + "E [m/s]"))
      c.columns["ve"] = {speed + "E [m/s]"}, c.columns["vn"] = {speed + "N [m/s]"};
  }
}

const std::string kBetween = " | ";  // names in a list of columns

class CsvTable : public Table {
 public:
  explicit CsvTable(const std::string& path) : reader_(path) {
    path_ = reader_.path();
    header_ = reader_.header();
    meta_ = reader_.meta();
    convention_.format = "CSV";
    vectornav(convention_, header_);
    take_convention();
  }
  void select(const std::vector<std::string>& columns) override { reader_.select(columns); }
  bool next(std::span<double> row, Diagnostics& diagnostics) override {
    return reader_.next(row, diagnostics);
  }
  // Columns whose first given cells are no numbers.
  std::vector<std::string> word_columns() override {
    constexpr int kLookedAt = 100;  // rows
    if (path_ == "standard input") return {};
    CsvReader look(path_);
    std::vector<int> numbers(header_.size(), 0), words(header_.size(), 0);
    std::vector<std::string_view> cells;
    for (int i = 0; i < kLookedAt && look.next_text(cells); ++i) {
      for (std::size_t k = 0; k < std::min(cells.size(), header_.size()); ++k) {
        if (cells[k].empty() || cells[k] == "nan") continue;
        double x = 0;
        const auto [end, error] =
            std::from_chars(cells[k].data(), cells[k].data() + cells[k].size(), x);
        ++(error == std::errc() && end == cells[k].data() + cells[k].size() ? numbers : words)[k];
      }
    }
    std::vector<std::string> out;
    for (std::size_t k = 0; k < header_.size(); ++k)
      if (words[k] > numbers[k]) out.push_back(header_[k]);
    return out;
  }
  std::string_view word(const std::string& column) override {
    const auto& cells = reader_.cells();
    const std::size_t i = reader_.index(column);
    return i < cells.size() ? cells[i] : std::string_view();
  }
  std::size_t rows() const override { return reader_.rows(); }
  std::string where() const override { return path_ + ":" + std::to_string(reader_.line()); }

 private:
  CsvReader reader_;
};

}  // namespace

Table::~Table() = default;

bool Table::has(const std::string& column) const {
  return std::find(header_.begin(), header_.end(), column) != header_.end();
}

std::size_t Table::index(const std::string& column) const {
  const auto it = std::find(header_.begin(), header_.end(), column);
  if (it != header_.end()) return static_cast<std::size_t>(it - header_.begin());
  std::string found;
  for (const auto& name : header_) found += (found.empty() ? "" : ", ") + name;
  const std::string near = nearest(column, header_);
  throw Error(ErrorKind::kInput,
              "no column '" + column + "'; found: " + found +
                  (near.empty() ? "" : "; did you mean '" + near + "'?"),
              path_);
}

std::map<std::string, std::string> Table::described() const {
  auto out = meta_;
  const TableConvention& c = convention_;
  for (const auto& [key, value] : {std::pair{"section", &c.section},
                                   {"kind", &c.kind},
                                   {"stamp", &c.stamp},
                                   {"axes", &c.axes}})
    if (!value->empty()) out[std::string("convention.") + key] = *value;
  for (const auto& [key, names] : c.columns) {
    std::string& list = out["convention.columns." + key];
    for (const auto& n : names) list += (list.empty() ? "" : kBetween) + n;
  }
  return out;
}

void Table::take_convention() {
  const std::string mark = "convention.";
  for (auto it = meta_.lower_bound(mark); it != meta_.end() && it->first.starts_with(mark);
       it = meta_.erase(it)) {
    const std::string key = it->first.substr(mark.size());
    const std::string& value = it->second;
    if (key == "section") convention_.section = value;
    if (key == "kind") convention_.kind = value;
    if (key == "stamp") convention_.stamp = value;
    if (key == "axes") convention_.axes = value;
    if (!key.starts_with("columns.")) continue;
    auto& names = convention_.columns[key.substr(8)];
    for (std::size_t from = 0; from <= value.size();) {
      const auto to = std::min(value.find(kBetween, from), value.size());
      names.push_back(value.substr(from, to - from));
      from = to + kBetween.size();
    }
  }
}

MemoryTable::MemoryTable(std::string path, TableConvention convention,
                         std::vector<std::string> header, std::vector<std::vector<double>> columns,
                         std::map<std::string, std::string> meta)
    : columns_(std::move(columns)) {
  path_ = std::move(path);
  header_ = std::move(header);
  meta_ = std::move(meta);
  convention_ = std::move(convention);
  for (std::size_t i = 0; i < header_.size(); ++i) chosen_.push_back(i);
}

void MemoryTable::select(const std::vector<std::string>& columns) {
  chosen_.clear();
  for (const auto& c : columns) chosen_.push_back(index(c));
}

bool MemoryTable::next(std::span<double> row, Diagnostics&) {
  if (columns_.empty() || at_ >= columns_[0].size()) return false;
  for (std::size_t i = 0; i < chosen_.size(); ++i) row[i] = columns_[chosen_[i]][at_];
  ++at_;
  return true;
}

std::string MemoryTable::where() const { return path_ + ": row " + std::to_string(at_); }

std::unique_ptr<Table> open_table(const std::string& path, const std::string& table) {
  switch (kind_of(path)) {
    case Kind::kMatlab:
      return open_mat_table(path, table);
    case Kind::kH5:
      return open_h5_table(path, table);
    case Kind::kOther:
      break;
  }
  if (const auto foreign = foreign_format(path)) return open_foreign(path, *foreign, table);
  if (!table.empty())
    throw Error(ErrorKind::kInput, "a CSV file is one table; it has no '" + table + "'", path);
  return std::make_unique<CsvTable>(path);
}

std::vector<std::string> tables_of(const std::string& path) {
  switch (kind_of(path)) {
    case Kind::kMatlab:
      return mat_tables(path);
    case Kind::kH5:
      return h5_tables(path);
    case Kind::kOther:
      break;
  }
  if (foreign_format(path) == Foreign::kNmea) return nmea_tables(path);
  return {""};
}

TableConvention convention_of(const std::string& path, const std::string& table) {
  if (kind_of(path) == Kind::kMatlab) return {"MATLAB", "", "", "", "", {}};
  return open_table(path, table)->convention();
}

}  // namespace loxo
