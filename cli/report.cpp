// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

void add_report(CLI::App& app, Globals& globals) {
  add_command(app, globals, "report", "(not built yet)", "loxo report", [] () -> int {
    throw Error(ErrorKind::kWork, "report is not built yet");
  });
}

}  // namespace loxo::cli
