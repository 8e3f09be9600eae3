// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_reproduce(CLI::App& app, Globals& globals) {
  add_command(app, globals, "reproduce", "(not built yet)", "loxo reproduce",
              []() -> int { throw Error(ErrorKind::kWork, "reproduce is not built yet"); });
}

}  // namespace loxo::cli
