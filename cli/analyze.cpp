// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_analyze(CLI::App& app, Globals& globals) {
  add_command(app, globals, "analyze", "(not built yet)", "loxo analyze", [] () -> int {
    throw Error(ErrorKind::kWork, "analyze is not built yet");
  });
}

}  // namespace loxo::cli
