// SPDX-License-Identifier: Apache-2.0
// The forms of `loxo analyze` that have a file of their own.
#pragma once
#include "cli/command.hpp"

namespace loxo::cli {

void add_analyze_noise(CLI::App& analyze, Globals& globals);
void add_analyze_budget(CLI::App& analyze, Globals& globals);
void add_analyze_odometer(CLI::App& analyze, Globals& globals);

}  // namespace loxo::cli
