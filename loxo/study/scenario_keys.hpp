// SPDX-License-Identifier: Apache-2.0
// How the keys of a scenario are read, and refused: for the .cpp files of scenarios only.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "loxo/num/error.hpp"
#include "loxo/text/nearest.hpp"
#include "loxo/text/toml.hpp"

namespace loxo::scenario_keys {

[[noreturn]] inline void refuse(const std::string& what, const std::string& where) {
  throw Error(ErrorKind::kInput, what, where);
}
inline double positive(const TomlTable& t, std::string_view key, Dimension d, double otherwise) {
  const double x = t.get_quantity(key, d).value_or(otherwise);
  if (!(x > 0)) refuse("expected a value above 0", t.where(key));
  return x;
}
inline double sigma(const TomlTable& t, std::string_view key, Dimension d, double otherwise = 0) {
  const double x = t.get_quantity(key, d).value_or(otherwise);
  if (x < 0)
    refuse("expected a standard deviation of 0 or more, found a negative one", t.where(key));
  return x;
}
inline double angle(const TomlTable& t, std::string_view key) {
  return t.get_quantity(key, Dimension::kAngle).value_or(0.0);
}
// The first is the value where the key is absent.
inline std::string one_of(const TomlTable& t, std::string_view key,
                          const std::vector<std::string>& valid) {
  const std::string found = t.get_string(key).value_or(valid.front());
  for (const auto& name : valid)
    if (name == found) return found;
  refuse("unknown value '" + found + "'" + suggestion(found, valid), t.where(key));
}

}  // namespace loxo::scenario_keys
