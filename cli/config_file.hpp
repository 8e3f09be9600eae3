// SPDX-License-Identifier: Apache-2.0
// --config FILE: values of options from a TOML file, for the command in use.
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace loxo::cli {

// What `--config FILE` among the arguments adds to them, as "--option=value". Keys are the long
// names of the command's options, at the top or in a table with its name ([navigate],
// [campaign.run]); tables of other commands are left alone, and what the command line says itself
// rules. Throws Error(kInput) for a missing file and for a key that is no option.
std::vector<std::string> arguments_of_config(const CLI::App& app,
                                             const std::vector<std::string>& arguments);

}  // namespace loxo::cli
