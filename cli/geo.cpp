// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_geo(CLI::App& app, Globals& globals) {
  add_command(app, globals, "geo", "(not built yet)", "loxo geo", [] () -> int {
    throw Error(ErrorKind::kWork, "geo is not built yet");
  });
}

}  // namespace loxo::cli
