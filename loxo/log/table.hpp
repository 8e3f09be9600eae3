// SPDX-License-Identifier: Apache-2.0
// A table of numbers with named columns, whatever its format: CSV, HDF5, MATLAB, logs of other
// programs.
#pragma once
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "loxo/text/diagnostics.hpp"

namespace loxo {

// What a format fixes by itself, so that a section of drive.toml need not say it again.
struct TableConvention {
  std::string format;             // "CSV", "KF-GINS IMU text" …
  std::string section;            // "imu", "fix" … the section it is made for; may be empty
  std::string kind, stamp, axes;  // empty: not fixed
  std::map<std::string, std::vector<std::string>> columns;  // key of the section -> its columns
};

class Table {
 public:
  virtual ~Table();
  const std::string& path() const { return path_; }
  const std::vector<std::string>& header() const { return header_; }
  const std::map<std::string, std::string>& meta() const { return meta_; }
  const TableConvention& convention() const { return convention_; }
  // meta() and what the format fixes, as keys and values that a file of another form carries along
  // ("convention.axes: FRD"); its reader takes them back.
  std::map<std::string, std::string> described() const;
  bool has(const std::string& column) const;
  // Choose the columns of next(), in this order. Throws Error(kInput) naming what is there and the
  // nearest.
  virtual void select(const std::vector<std::string>& columns) = 0;
  // The next row; false at the end. Bad rows are told and skipped.
  virtual bool next(std::span<double> row, Diagnostics& diagnostics) = 0;
  // Columns of text, where the format tells them from numbers; their text in the row read last.
  virtual std::vector<std::string> word_columns() { return {}; }
  virtual std::string_view word(const std::string&) { return {}; }
  // Data rows so far, bad ones counted; "file:line" of the row read last.
  virtual std::size_t rows() const = 0;
  virtual std::string where() const = 0;

 protected:
  std::size_t index(const std::string& column) const;
  // From meta_ into convention_.
  void take_convention();
  std::string path_;
  std::vector<std::string> header_;
  std::map<std::string, std::string> meta_;
  TableConvention convention_;
};

// A table held in memory: what the readers of small foreign formats return.
class MemoryTable : public Table {
 public:
  MemoryTable(std::string path, TableConvention convention, std::vector<std::string> header,
              std::vector<std::vector<double>> columns,
              std::map<std::string, std::string> meta = {});
  void select(const std::vector<std::string>& columns) override;
  bool next(std::span<double> row, Diagnostics& diagnostics) override;
  std::size_t rows() const override { return at_; }
  std::string where() const override;
  const std::vector<std::vector<double>>& columns() const { return columns_; }

 private:
  std::vector<std::vector<double>> columns_;
  std::vector<std::size_t> chosen_;
  std::size_t at_ = 0;
};

// Opens a file by its content; `table` names one of several tables in it. Throws Error(kInput).
std::unique_ptr<Table> open_table(const std::string& path, const std::string& table = {});
// The tables of a file that holds several (groups, variables, kinds of message); {""} else.
std::vector<std::string> tables_of(const std::string& path);
// Its format, and whether it is one whose sections the format fixes: then drive.toml may leave out
// what the convention says. A look at the head of the file only.
TableConvention convention_of(const std::string& path, const std::string& table = {});

}  // namespace loxo
