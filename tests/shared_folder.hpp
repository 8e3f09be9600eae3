// SPDX-License-Identifier: Apache-2.0
// What tests read from outside the project: the tables of values to meet and the real recordings.
// Both may be missing; a test that needs them skips and says so.
#pragma once
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "places.hpp"

namespace loxo::testing {

// Folder `name` ("spec", "data") of the shared material: $LOXO_SPEC or $LOXO_DATA, else shared/NAME
// beside the checkout or above it. Empty if there is none.
inline std::string shared_folder(const std::string& name) {
  const char* variable = std::getenv(name == "spec" ? "LOXO_SPEC" : "LOXO_DATA");
  if (variable != nullptr && std::filesystem::is_directory(variable)) return variable;
  for (const char* up : {"/../shared/", "/../../shared/"}) {
    const std::string path = std::string(source_folder()) + up + name;
    if (std::filesystem::is_directory(path)) return path;
  }
  return {};
}

struct ExpectedRow {
  std::string id, quantity, paper, ours, tolerance, remarks;
  double value() const { return std::strtod(ours.c_str(), nullptr); }
};

// The rows of a table of values to meet, by id; empty if the table is not there. Cells may be
// quoted.
inline std::map<std::string, ExpectedRow> expected_rows(const std::string& file) {
  std::map<std::string, ExpectedRow> rows;
  std::ifstream in(shared_folder("spec") + "/" + file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (char c : line) {
      if (c == '"') {
        quoted = !quoted;
      } else if (c == ',' && !quoted) {
        cells.emplace_back();
      } else {
        cells.back() += c;
      }
    }
    cells.resize(7);
    rows[cells[0]] = {cells[0], cells[1], cells[2], cells[3], cells[4], cells[5]};
  }
  return rows;
}

}  // namespace loxo::testing
