// SPDX-License-Identifier: Apache-2.0
// Sections of a page from the JSON results of the other commands (interface.md, "JSON results").
// Unknown keys are shown, not lost; missing ones are left out.
#pragma once
#include <string>

#include "loxo/report/page.hpp"
#include "loxo/text/diagnostics.hpp"
#include "loxo/text/json.hpp"

namespace loxo::report {

enum class ResultKind {
  kUnknown,
  kCertificate,
  kCalibrate,
  kPlan,
  kEvaluate,
  kReproduce,
  kAllan,
  kBudget,
  kRoots,
  kStatic,
  kOdometer,
  kOther
};
// From the key "command" where there is one, else from the keys that only one kind has.
ResultKind kind_of(const Json& json);
std::string_view kind_name(ResultKind kind);

Section certificate_section(const Json& json, const std::string& name);
// `loxo calibrate DRIVE --json`: the methods side by side, the recommended one in front.
Section calibration_section(const Json& json, const std::string& name);
Section evaluation_section(const Json& json, const std::string& name);
// `loxo reproduce --json`: a table for each paper, and how many were reproduced, corrected, failed.
Section reproduction_section(const Json& json, const std::string& name);
Section allan_section(const Json& json, const std::string& name);
// Any other result: its numbers as pairs, its lists of objects as tables, its lists of equal length
// as curves.
Section plain_section(const Json& json, const std::string& name);
// The section of its kind.
Section result_section(const Json& json, const std::string& name);

// What a reader noticed; no block where there is nothing to say.
void add_diagnostics(Section& section, const Diagnostics& diagnostics);
void add_diagnostics(Section& section, const Json& diagnostics);

// "horizontal_pct_95" -> "horizontal, 95" with unit "% of distance": title and unit of a key of
// interface.md.
Column column_of_key(const std::string& key);

}  // namespace loxo::report
