// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_campaign(CLI::App& app, Globals& globals) {
  add_command(app, globals, "campaign", "(not built yet)", "loxo campaign", [] () -> int {
    throw Error(ErrorKind::kWork, "campaign is not built yet");
  });
}

}  // namespace loxo::cli
