// SPDX-License-Identifier: Apache-2.0
// `loxo calibrate`: scale and mounting angles; the jobs below it.
#pragma once
#include "cli/command.hpp"

namespace loxo::cli {

// `calibrate points`: two-point calibration on a CSV table.
void add_calibrate_points(CLI::App& calibrate, Globals& globals);

}  // namespace loxo::cli
