// SPDX-License-Identifier: Apache-2.0
// A streaming CSV reader and writer at constant memory: plain or gzip, file or standard input
// ("-"), CRLF and UTF-8 BOM read, comment lines (#) above the header kept as meta. At least 3
// million rows of 7 columns a second.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "loxo/text/diagnostics.hpp"

namespace loxo {

class CsvReader {
 public:
  // Opens and reads the header. Throws Error(kInput): missing file, empty file, binary file, no
  // header.
  explicit CsvReader(const std::string& path);
  ~CsvReader();
  CsvReader(CsvReader&&) noexcept;
  CsvReader& operator=(CsvReader&&) noexcept;

  const std::string& path() const;
  const std::vector<std::string>& header() const;
  // "# key: value" lines above the header.
  const std::map<std::string, std::string>& meta() const;
  bool has(std::string_view column) const;
  // Index of a column; throws Error(kInput) naming the file, the missing column, those found and
  // the nearest.
  std::size_t index(std::string_view column) const;

  // Choose the columns that next() returns, in this order.
  void select(const std::vector<std::string>& columns);
  // The next row's chosen numbers into `row` (size = chosen). False at the end. A row that is
  // malformed (wrong column count, not a number, truncated gzip) is reported to `diagnostics` as
  // "bad_row" with file:line and skipped; empty cells and "nan" read as NaN. An untranslatable end
  // of a gzip stream is "truncated".
  bool next(std::span<double> row, Diagnostics& diagnostics);
  // The text cells of the row that next()/next_text() read last, all columns.
  bool next_text(std::vector<std::string_view>& cells);
  const std::vector<std::string_view>& cells() const;
  // 1-based line in the file of the row read last; data rows seen so far (bad ones counted).
  std::size_t line() const;
  std::size_t rows() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Shortest text that reads back to the same double ("nan" for NaN).
void append_number(std::string& out, double x);
// With `precision` significant digits (0: shortest).
void append_number(std::string& out, double x, int precision);

// A file that appears whole or not at all: written aside, renamed by commit(); "-" is standard
// output; ".gz" compresses. Throws Error(kWork) on a full disk or a missing folder (named).
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();  // removes the unfinished file if commit() was not called
  OutputFile(OutputFile&&) noexcept;
  void write(std::string_view text);
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// 64-bit hash of a file's bytes as 16 hex digits, the input hash of certificates and solutions:
// FNV-1a of the tail behind the whole 64-byte strides, which go over eight lanes of words first.
std::string file_hash(const std::string& path);

}  // namespace loxo
