// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_transfer(CLI::App& app, Globals& globals) {
  add_command(app, globals, "transfer", "(not built yet)", "loxo transfer", [] () -> int {
    throw Error(ErrorKind::kWork, "transfer is not built yet");
  });
}

}  // namespace loxo::cli
