// SPDX-License-Identifier: Apache-2.0
// A section of a page about evaluations: errors over time and distance, in numbers and as
// distributions.
#pragma once
#include <string>
#include <vector>

#include "loxo/ins/solution.hpp"
#include "loxo/report/page.hpp"
#include "loxo/study/evaluate.hpp"

namespace loxo::report {

struct NamedEvaluation {
  std::string name;
  const Evaluation* evaluation = nullptr;
  const Solution* solution = nullptr;  // for its stated standard deviations; may be null
};

// `t0`: as time_origin() gave it for the other figures of the page.
Section error_section(const std::vector<NamedEvaluation>& evaluations, double t0);

}  // namespace loxo::report
