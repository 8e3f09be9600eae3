// SPDX-License-Identifier: Apache-2.0
#include "cli/command.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <new>
#include <sstream>

#include "cli/config_file.hpp"
#include "loxo/num/error.hpp"
#include "loxo/text/nearest.hpp"
#include "loxo/text/quantity.hpp"

namespace loxo::cli {
namespace {

double now() {
  using namespace std::chrono;
  return duration<double>(steady_clock::now().time_since_epoch()).count();
}

// The exit code of the command that ran; callbacks of CLI11 return nothing.
int exit_code = 0;

void add_globals(CLI::App* app, Globals& g) {
  app->add_flag("--json", g.json, "machine-readable result on standard output, nothing else there");
  app->add_flag("--quiet", g.quiet, "no words but errors");
  app->add_flag("-v,--verbose", g.verbose, "say more");
  app->add_option("--config", g.config, "read option values from FILE (TOML)");
  app->add_option("--set", g.sets, "key=value: replaces a key of the drive, scenario or campaign")
      ->allow_extra_args(false);
  app->add_option("--seed", g.seed, "seed of the random numbers");
  app->add_option("-o,--output", g.output, "output PATH ('-': standard output)");
}

// The names CLI11 knows at the place where parsing failed, for "did you mean".
void known_names(const CLI::App* app, std::vector<std::string>& names) {
  for (const auto* sub : app->get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(sub->get_name());
  for (const auto* option : app->get_options()) {
    for (const auto& n : option->get_lnames()) names.push_back("--" + n);
    for (const auto& n : option->get_snames()) names.push_back("-" + n);
  }
  for (const auto* sub : app->get_subcommands()) known_names(sub, names);
}

// What the command line says and the program does not know: of what CLI11 names after its colon
// (last argument first) the option, else the first word.
std::string unknown_word(const std::string& message) {
  const auto colon = message.rfind(": ");
  if (colon == std::string::npos) return {};
  std::istringstream words(message.substr(colon + 2));
  std::string found;
  for (std::string word; words >> word;) {
    while (!word.empty() && (word.front() == '[' || word.front() == '\'')) word.erase(0, 1);
    while (!word.empty() && (word.back() == ']' || word.back() == '\'')) word.pop_back();
    if (found.empty() || found.front() != '-' || (!word.empty() && word.front() == '-'))
      found = word;
  }
  return found.substr(0, found.find('='));
}

}  // namespace

CLI::App* add_command(CLI::App& app, Globals& globals, const std::string& name,
                      const std::string& job, const std::string& example, std::function<int()> run,
                      Output output) {
  return add_subcommand(app, globals, name, job, example, std::move(run), output);
}

CLI::App* add_subcommand(CLI::App& parent, Globals& globals, const std::string& name,
                         const std::string& job, const std::string& example,
                         std::function<int()> run, Output output) {
  auto* sub = parent.add_subcommand(name, job);
  add_globals(sub, globals);
  sub->footer("Example:\n  " + example);
  // A command with subcommands of its own runs only when none of them was chosen.
  sub->final_callback([sub, &globals, output, run = std::move(run)] {
    if (!sub->get_subcommands().empty()) return;
    if (output == Output::kData && globals.output.ends_with(".html"))
      throw Error(ErrorKind::kUsage,
                  "this command writes data, not a page; 'loxo report' makes the page of what it "
                  "writes (or of its --json) with -o " +
                      globals.output,
                  "-o");
    exit_code = run();
  });
  return sub;
}

void print_json(const Json& json) { std::cout << dump_json(json) << '\n'; }

void say(const Globals& globals, const std::string& text) {
  if (globals.json || globals.quiet) return;
  // With -o - the data is the standard output.
  (globals.output == "-" ? std::cerr : std::cout) << text << '\n';
}

void print_diagnostics(const Globals& globals, const Diagnostics& diagnostics) {
  if (globals.quiet) return;
  for (const auto& d : diagnostics.list()) {
    const char* level = d.severity == Severity::kNote      ? "note"
                        : d.severity == Severity::kWarning ? "warning"
                                                           : "bad";
    std::cerr << level << ": " << (d.where.empty() ? "" : d.where + ": ") << d.what;
    if (d.count > 1) std::cerr << " (" << d.count << " times)";
    std::cerr << '\n';
  }
}

Json to_json(const Diagnostics& diagnostics) {
  Json list = Json::array();
  for (const auto& d : diagnostics.list()) {
    list.push_back({{"severity", d.severity == Severity::kNote      ? "note"
                                 : d.severity == Severity::kWarning ? "warning"
                                                                    : "bad"},
                    {"kind", d.kind},
                    {"where", d.where},
                    {"what", d.what},
                    {"count", d.count}});
  }
  return list;
}

double option_quantity(const std::string& text, Dimension d, const std::string& option) {
  try {
    return parse_quantity(text, d, option);
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what());
  }
}

void require_one_of(const std::string& value, const std::vector<std::string>& names,
                    const std::string& option) {
  if (std::find(names.begin(), names.end(), value) == names.end())
    throw Error(ErrorKind::kUsage, "'" + value + "' is not known" + suggestion(value, names),
                option);
}

Progress::Progress(const Globals& globals, std::string label, double total)
    : on_(!globals.json && !globals.quiet && isatty(2) != 0),
      label_(std::move(label)),
      total_(total),
      started_(now()) {}

Progress::~Progress() {
  if (on_ && last_ > 0) std::cerr << "\r\033[K";
}

void Progress::at(double done) {
  if (!on_) return;
  const double t = now();
  if (t - last_ < 0.1) return;
  last_ = t;
  const double rate = done / (t - started_ + 1e-9);
  char line[160];
  std::snprintf(line, sizeof line, "\r%s %3.0f %%  %.3g/s  %.0f s left\033[K", label_.c_str(),
                100.0 * done / total_, rate, (total_ - done) / (rate + 1e-9));
  std::cerr << line << std::flush;
}

int run(CLI::App& app, int argc, char** argv) {
  try {
    std::vector<std::string> arguments(argv + 1, argv + argc);
    const std::vector<std::string> more = arguments_of_config(app, arguments);
    arguments.insert(arguments.end(), more.begin(), more.end());
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
    app.name(argv[0]);
    app.parse(std::move(arguments));
    std::cout.flush();
    return exit_code;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {  // --help, --version
      app.exit(e, std::cout, std::cerr);
      return 0;
    }
    std::vector<std::string> names;
    if (argc > 1 && argv[1][0] != '-' && app.get_subcommands().empty()) {
      for (const auto* sub : app.get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(sub->get_name());
      std::cerr << "loxo: '" << argv[1] << "' is no command" << suggestion(argv[1], names)
                << "\nloxo: see 'loxo --help'\n";
      return static_cast<int>(ErrorKind::kUsage);
    }
    known_names(&app, names);
    std::string hint;
    const std::string word = unknown_word(e.what());
    if (!word.empty()) {
      const auto near = nearest(word, names);
      if (!near.empty() && near != word) hint = "; did you mean '" + near + "'?";
    }
    std::cerr << "loxo: " << e.what() << hint << "\nloxo: see 'loxo --help'\n";
    return static_cast<int>(ErrorKind::kUsage);
  } catch (const Error& e) {
    std::cout.flush();
    std::cerr << "loxo: " << e.what() << '\n';
    return e.exit_code();
  } catch (const std::bad_alloc&) {
    std::cerr << "loxo: out of memory\n";
    return 1;
  } catch (const std::exception& e) {
    std::cerr << "loxo: internal error: " << e.what() << '\n';
    return 1;
  }
}

}  // namespace loxo::cli
