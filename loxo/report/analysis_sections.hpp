// SPDX-License-Identifier: Apache-2.0
// Sections of a page from what `loxo analyze` and `loxo allan` say with --json.
#pragma once
#include <string>

#include "loxo/report/page.hpp"
#include "loxo/text/json.hpp"

namespace loxo::report {

// Curves of each component, sources switched on and off together.
Section static_response_section(const Json& json, const std::string& name);
Section roots_section(const Json& json, const std::string& name);
// Stacked shares of the variance over time, the contributions, the total.
Section budget_section(const Json& json, const std::string& name);
Section odometer_section(const Json& json, const std::string& name);
// `axes` with `points`: deviations with bands and the fitted noise.
Section allan_log_section(const Json& json, const std::string& name);

}  // namespace loxo::report
