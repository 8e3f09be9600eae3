// SPDX-License-Identifier: Apache-2.0
// What a filter said of itself (`loxo navigate --mode filter|smooth --json`): which source was
// trusted and why, innovations against their bands, constants with theirs.
#pragma once
#include <string>

#include "loxo/report/page.hpp"
#include "loxo/text/json.hpp"

namespace loxo::report {

// True for the JSON of a filter or smoother.
bool is_filter_result(const Json& json);
Section filter_section(const Json& json, const std::string& name);

}  // namespace loxo::report
