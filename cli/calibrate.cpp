// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate.hpp"

#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_calibrate(CLI::App& app, Globals& globals) {
  auto* sub = add_command(app, globals, "calibrate", "scale and mounting angles of a vehicle",
                          "loxo calibrate DRIVE", []() -> int {
                            throw Error(ErrorKind::kUsage,
                                        "calibrate needs a drive, or 'points' or 'plan'");
                          });
  add_calibrate_points(*sub, globals);
}

}  // namespace loxo::cli
