// SPDX-License-Identifier: Apache-2.0
// Tables in, the same tables with columns added out (interface.md, "Tables on standard input"): the
// one place of geo, calibrate points, analyze static --table and transfer rates.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "cli/command.hpp"

namespace loxo::cli {

// The columns that the table has, for a job that takes optional ones.
class TableHeader {
 public:
  explicit TableHeader(std::vector<std::string> names) : names_(std::move(names)) {}
  bool has(const std::string& name) const;
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
};

// What to compute from each row.
struct TableJob {
  std::vector<std::string>
      inputs;  // columns read as numbers, in the order of `in`; all must be there
  std::vector<std::string> outputs;  // columns added, in the order of `out`
  // Fills `out`; returns "" or the reason why this row cannot be computed (its outputs become nan).
  // Inputs are finite numbers; an output left NaN without a reason is told as "not defined here".
  std::function<std::string(std::span<const double> in, std::span<double> out)> row;
  // Some outputs may be nan with a reason while the others stand (methods side by side).
  bool partial = false;
};

// Reads `path` ("-" or empty: standard input), runs the job row by row at constant memory, writes
// the table to globals.output (standard output by default) or as JSON rows with --json. Rows that
// cannot be computed get nan and a line on standard error with their line number. Output columns
// that the table already has are replaced in their place. Returns 0, or throws Error(kInput): a
// missing column (with those found and the nearest), or no row computed.
int run_table(const Globals& globals, const std::string& command, const std::string& path,
              const std::function<TableJob(const TableHeader&)>& plan);

// "" or what is wrong with a latitude or longitude in degrees, for TableJob::row.
std::string bad_latitude(const char* column, double deg);
std::string bad_longitude(const char* column, double deg);

}  // namespace loxo::cli
