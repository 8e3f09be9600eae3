// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_evaluate(CLI::App& app, Globals& globals) {
  add_command(app, globals, "evaluate", "(not built yet)", "loxo evaluate", [] () -> int {
    throw Error(ErrorKind::kWork, "evaluate is not built yet");
  });
}

}  // namespace loxo::cli
