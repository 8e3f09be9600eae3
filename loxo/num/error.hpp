// SPDX-License-Identifier: Apache-2.0
// "The world is wrong": a file, a configuration, an argument. Kernels never throw; doors do.
#pragma once
#include <stdexcept>
#include <string>

namespace loxo {

// What the program's exit code will be.
enum class ErrorKind {
  kWork = 1,         // the work failed: no convergence, unobservable, no method valid, disk full
  kUsage = 2,        // wrong use of the command line
  kInput = 3,        // the input data is bad: a file, a key, a column, a unit
  kRequirement = 4,  // the result missed a --require
};

// `where` is "file:line:column", "file: key imu.units" or an option's name; `what` says what was
// expected and what was found, and names the nearest valid name. what() is "where: what" (or what
// alone).
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& what, const std::string& where = {})
      : std::runtime_error(where.empty() ? what : where + ": " + what),
        kind_(kind),
        where_(where) {}
  ErrorKind kind() const { return kind_; }
  int exit_code() const { return static_cast<int>(kind_); }
  const std::string& where() const { return where_; }

 private:
  ErrorKind kind_;
  std::string where_;
};

}  // namespace loxo
