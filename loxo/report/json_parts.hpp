// SPDX-License-Identifier: Apache-2.0
// A result's JSON as the sections take it: what is not there is no value, not an error.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "loxo/report/page.hpp"
#include "loxo/text/json.hpp"

namespace loxo::report {

inline double number(const Json& json, const std::string& key) {
  const auto it = json.find(key);
  return it != json.end() && it->is_number() ? it->get<double>() : kNoValue;
}
inline std::string words(const Json& json, const std::string& key) {
  const auto it = json.find(key);
  return it != json.end() && it->is_string() ? it->get<std::string>() : std::string();
}
inline std::vector<double> numbers(const Json& list) {
  std::vector<double> out;
  if (list.is_array())
    for (const auto& x : list) out.push_back(x.is_number() ? x.get<double>() : kNoValue);
  return out;
}
inline std::vector<double> numbers(const Json& json, const std::string& key) {
  const auto it = json.find(key);
  return it != json.end() ? numbers(*it) : std::vector<double>();
}
inline std::string with_spaces(std::string key) {
  std::replace(key.begin(), key.end(), '_', ' ');
  return key;
}

}  // namespace loxo::report
