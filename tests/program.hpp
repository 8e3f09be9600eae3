// SPDX-License-Identifier: Apache-2.0
// Runs the program as a user does: a shell command with `loxo` in front, text on standard input,
// and what came back.
#pragma once
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "places.hpp"

namespace loxo::testing {

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

// A folder of its own for each test program run, removed at its end.
inline const std::string& scratch_folder() {
  struct Folder {
    std::string path =
        (std::filesystem::temp_directory_path() / ("loxo_test_" + std::to_string(::getpid())))
            .string();
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder folder;
  return folder.path;
}

inline std::string slurp(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// run("geo rhumb-inverse", "lat1_deg,…\n…"): arguments as typed in a shell.
inline Outcome run(const std::string& arguments, const std::string& input = {}) {
  const std::string base = scratch_folder() + "/run";
  std::ofstream(base + ".in", std::ios::binary) << input;
  const int status = std::system((std::string(program()) + " " + arguments + " <" + base + ".in >" +
                                  base + ".out 2>" + base + ".err")
                                     .c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, slurp(base + ".out"),
          slurp(base + ".err")};
}

// CSV text as columns of cells, by name; no quotes.
inline std::map<std::string, std::vector<std::string>> columns(const std::string& csv) {
  std::map<std::string, std::vector<std::string>> table;
  std::vector<std::string> names;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> cells;
    std::istringstream parts(line);
    for (std::string cell; std::getline(parts, cell, ',');) cells.push_back(cell);
    if (!line.empty() && line.back() == ',') cells.emplace_back();
    if (names.empty()) {
      names = cells;
      for (const auto& n : names) table[n];
    } else {
      for (std::size_t i = 0; i < names.size() && i < cells.size(); ++i)
        table[names[i]].push_back(cells[i]);
    }
  }
  return table;
}
inline double number(const std::string& cell) { return std::strtod(cell.c_str(), nullptr); }

}  // namespace loxo::testing
