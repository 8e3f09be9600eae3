// SPDX-License-Identifier: Apache-2.0
// Tables and drives from one form to another: row by row at constant memory, the result whole or
// not there at all.
#pragma once
#include <cstddef>
#include <functional>
#include <string>

#include "loxo/log/drive.hpp"

namespace loxo {

struct Converted {
  std::size_t tables = 0, rows = 0;
};
using ConvertProgress = std::function<void(std::size_t rows)>;

// A table or a solution to .csv, .csv.gz, "-" or .h5: all columns, the lines above the header as
// they are. Rows that cannot be read are told and left out. Throws Error.
Converted convert_table(const std::string& from, const std::string& table, const std::string& to,
                        Diagnostics& diagnostics, const ConvertProgress& progress = {});
// A drive to one .h5 file, or to a folder of CSV files. Each section's table goes over with all its
// columns, mapped or not; a row that cannot be read becomes one of nan, so that rows keep their
// number; the text of drive.toml changes only in the names of files.
Converted convert_drive(const Drive& drive, const std::string& to, Diagnostics& diagnostics,
                        const ConvertProgress& progress = {});

}  // namespace loxo
