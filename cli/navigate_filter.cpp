// SPDX-License-Identifier: Apache-2.0
#include "cli/navigate.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {

int navigate_filter(const Globals&, const NavigateOptions& options) {
  throw Error(ErrorKind::kWork, "mode " + options.mode + " is not built yet");
}

}  // namespace loxo::cli
