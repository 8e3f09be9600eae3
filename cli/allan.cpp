// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_allan(CLI::App& app, Globals& globals) {
  add_command(app, globals, "allan", "(not built yet)", "loxo allan", [] () -> int {
    throw Error(ErrorKind::kWork, "allan is not built yet");
  });
}

}  // namespace loxo::cli
