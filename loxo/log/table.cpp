// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/table.hpp"

#include <algorithm>

#include "loxo/num/error.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

class CsvTable : public Table {
 public:
  explicit CsvTable(const std::string& path) : reader_(path) {
    path_ = reader_.path();
    header_ = reader_.header();
    meta_ = reader_.meta();
    convention_.format = "CSV";
  }
  void select(const std::vector<std::string>& columns) override { reader_.select(columns); }
  bool next(std::span<double> row, Diagnostics& diagnostics) override {
    return reader_.next(row, diagnostics);
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
  static_cast<void>(table);
  return std::make_unique<CsvTable>(path);
}

}  // namespace loxo
