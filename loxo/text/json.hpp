// SPDX-License-Identifier: Apache-2.0
// The door of JSON. Numbers are written so that they read back to the same double; NaN becomes
// null.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

namespace loxo {

using Json = nlohmann::ordered_json;
// Throws Error(kInput) with file:line:column.
Json read_json(const std::string& path);
Json parse_json(const std::string& text, const std::string& where);
std::string dump_json(const Json& json, int indent = 2);

}  // namespace loxo
