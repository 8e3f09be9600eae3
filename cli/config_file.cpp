// SPDX-License-Identifier: Apache-2.0
#include "cli/config_file.hpp"

#include <algorithm>

#include "loxo/num/error.hpp"
#include "loxo/text/nearest.hpp"
#include "loxo/text/toml.hpp"

namespace loxo::cli {
namespace {

std::vector<const CLI::App*> commands_below(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}
const CLI::App* command_named(const CLI::App& app, const std::string& name) {
  for (const CLI::App* sub : commands_below(app))
    if (sub->get_name() == name) return sub;
  return nullptr;
}

bool is_given(const CLI::Option& option, const std::vector<std::string>& arguments) {
  for (const std::string& a : arguments) {
    for (const std::string& n : option.get_lnames())
      if (a == "--" + n || a.rfind("--" + n + "=", 0) == 0) return true;
    for (const std::string& n : option.get_snames())
      if (a.rfind("-" + n, 0) == 0) return true;
  }
  return false;
}

void add_value(const TomlTable& t, const std::string& key, const CLI::Option& option,
               std::vector<std::string>& out) {
  const std::string name = "--" + key;
  if (option.get_expected_max() == 0) {
    if (*t.get_bool(key)) out.push_back(name);
  } else if (option.get_expected_max() > 1) {
    const std::vector<std::string> all = t.get_strings(key).value();
    for (const std::string& text : all) out.push_back(name + "=" + text);
  } else if (option.get_type_name() == "TEXT") {
    out.push_back(name + "=" + *t.get_string(key));
  } else {
    out.push_back(name + "=" + std::to_string(*t.get_integer(key)));
  }
}

}  // namespace

std::vector<std::string> arguments_of_config(const CLI::App& app,
                                             const std::vector<std::string>& arguments) {
  std::string file;
  std::vector<const CLI::App*> path{&app};
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& a = arguments[i];
    if (a == "--config" && i + 1 < arguments.size()) file = arguments[++i];
    if (a.rfind("--config=", 0) == 0) file = a.substr(9);
    if (const CLI::App* sub = command_named(*path.back(), a)) path.push_back(sub);
  }
  std::vector<std::string> out;
  if (file.empty() || path.size() < 2) return out;
  const CLI::App& command = *path.back();
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& n : option->get_lnames())
      if (n != "help" && n != "config") names.push_back(n);
  TomlTable table = TomlTable::read(file);
  for (std::size_t depth = 0;; ++depth) {
    for (const std::string& key : table.keys()) {
      if (command_named(*path[depth], key)) continue;
      if (std::find(names.begin(), names.end(), key) == names.end())
        throw Error(
            ErrorKind::kInput,
            "'" + command.get_name() + "' has no option of that name" + suggestion(key, names),
            table.where(key));
      const CLI::Option& option = *command.get_option("--" + key);
      if (!is_given(option, arguments)) add_value(table, key, option, out);
    }
    if (depth + 1 >= path.size() || !table.has(path[depth + 1]->get_name())) break;
    table = *table.get_table(path[depth + 1]->get_name());
  }
  return out;
}

}  // namespace loxo::cli
