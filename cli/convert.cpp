// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_convert(CLI::App& app, Globals& globals) {
  add_command(app, globals, "convert", "(not built yet)", "loxo convert",
              []() -> int { throw Error(ErrorKind::kWork, "convert is not built yet"); });
}

}  // namespace loxo::cli
