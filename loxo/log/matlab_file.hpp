// SPDX-License-Identifier: Apache-2.0
// The door of matio: MATLAB files (v4, v5 with and without compression, v7.3), read whole.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "loxo/log/table.hpp"

namespace loxo {

// Variables and fields of structs that have the same number of rows make one table; a matrix is its
// columns name_1, name_2 …; a row vector is a column. The name of a table is that of its struct, or
// of its first variable where several lengths stand side by side; any of its variables names it
// too.
std::vector<std::string> mat_tables(const std::string& path);
// Throws Error(kInput): damaged, no such table (those found are named), several and none named.
std::unique_ptr<Table> open_mat_table(const std::string& path, const std::string& table);

}  // namespace loxo
