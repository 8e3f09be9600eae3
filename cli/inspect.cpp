// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_inspect(CLI::App& app, Globals& globals) {
  add_command(app, globals, "inspect", "(not built yet)", "loxo inspect", [] () -> int {
    throw Error(ErrorKind::kWork, "inspect is not built yet");
  });
}

}  // namespace loxo::cli
