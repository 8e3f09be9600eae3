// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_demo(CLI::App& app, Globals& globals) {
  add_command(app, globals, "demo", "(not built yet)", "loxo demo", [] () -> int {
    throw Error(ErrorKind::kWork, "demo is not built yet");
  });
}

}  // namespace loxo::cli
