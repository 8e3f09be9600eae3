// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_calibrate(CLI::App& app, Globals& globals) {
  add_command(app, globals, "calibrate", "(not built yet)", "loxo calibrate", [] () -> int {
    throw Error(ErrorKind::kWork, "calibrate is not built yet");
  });
}

}  // namespace loxo::cli
