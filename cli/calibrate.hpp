// SPDX-License-Identifier: Apache-2.0
// `loxo calibrate`: scale and mounting angles; the jobs below it.
#pragma once
#include <string>
#include <vector>

#include "cli/command.hpp"
#include "loxo/calibrate/calibration.hpp"

namespace loxo::cli {

// `calibrate points`: two-point calibration on a CSV table.
void add_calibrate_points(CLI::App& calibrate, Globals& globals);
// `calibrate plan`: which drive reaches a wanted accuracy.
void add_calibrate_plan(CLI::App& calibrate, Globals& globals);

// The states that --estimate names. Throws Error(kUsage) with the nearest name.
std::vector<State> states_of(const std::vector<std::string>& names);

}  // namespace loxo::cli
