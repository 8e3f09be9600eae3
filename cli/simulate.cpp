// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_simulate(CLI::App& app, Globals& globals) {
  add_command(app, globals, "simulate", "(not built yet)", "loxo simulate", [] () -> int {
    throw Error(ErrorKind::kWork, "simulate is not built yet");
  });
}

}  // namespace loxo::cli
