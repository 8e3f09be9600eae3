// SPDX-License-Identifier: Apache-2.0
// What every command shares: the global options, and where its words go.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "loxo/text/diagnostics.hpp"
#include "loxo/text/json.hpp"
#include "loxo/text/quantity.hpp"

namespace loxo::cli {

// The options every command has (interface.md, "Commands").
struct Globals {
  bool json = false;  // machine-readable result on standard output, nothing else there
  bool quiet = false;
  bool verbose = false;
  std::string config;             // --config FILE: option values, TOML
  std::vector<std::string> sets;  // --set key=value
  std::string output;             // -o PATH
  unsigned long long seed = 1;    // --seed N
};

// What -o of a command takes: a page is refused where data would be written under its name.
enum class Output { kData, kPage };
// Adds a subcommand with the global options; `run` is called after parsing, its return is the exit
// code. `example` is one runnable line, shown by --help.
CLI::App* add_command(CLI::App& app, Globals& globals, const std::string& name,
                      const std::string& job, const std::string& example, std::function<int()> run,
                      Output output = Output::kData);
// The global options on a nested subcommand (`calibrate points`); `run` as above.
CLI::App* add_subcommand(CLI::App& parent, Globals& globals, const std::string& name,
                         const std::string& job, const std::string& example,
                         std::function<int()> run, Output output = Output::kData);

// Standard output: the JSON result (--json).
void print_json(const Json& json);
// Standard output for people; nothing with --json or --quiet.
void say(const Globals& globals, const std::string& text);
// Standard error: diagnostics as "warning: where: what (N times)"; nothing with --quiet.
void print_diagnostics(const Globals& globals, const Diagnostics& diagnostics);
Json to_json(const Diagnostics& diagnostics);
// Runs `work`; where it throws, what was noticed until then is told first: it is often the cause.
template <class Work>
auto telling(const Globals& globals, const Diagnostics& diagnostics, Work work) {
  try {
    return work();
  } catch (const std::exception&) {
    print_diagnostics(globals, diagnostics);
    throw;
  }
}

// An angle, length … given on the command line with its unit. Throws Error(kUsage, …, option).
double option_quantity(const std::string& text, Dimension d, const std::string& option);
// Throws Error(kUsage, …, option) with the nearest name where `value` is none of `names`.
void require_one_of(const std::string& value, const std::vector<std::string>& names,
                    const std::string& option);

// A progress bar with rate and time left, on a terminal only.
class Progress {
 public:
  Progress(const Globals& globals, std::string label, double total);
  ~Progress();
  void at(double done);

 private:
  bool on_ = false;
  std::string label_;
  double total_ = 0, started_ = 0, last_ = 0;
};

// Parses, runs the chosen command, and turns every error into its message and exit code (0 to 4).
int run(CLI::App& app, int argc, char** argv);

// One file per command: cli/NAME.cpp.
void add_demo(CLI::App& app, Globals& globals);
void add_inspect(CLI::App& app, Globals& globals);
void add_convert(CLI::App& app, Globals& globals);
void add_geo(CLI::App& app, Globals& globals);
void add_simulate(CLI::App& app, Globals& globals);
void add_calibrate(CLI::App& app, Globals& globals);
void add_navigate(CLI::App& app, Globals& globals);
void add_evaluate(CLI::App& app, Globals& globals);
void add_analyze(CLI::App& app, Globals& globals);
void add_transfer(CLI::App& app, Globals& globals);
void add_allan(CLI::App& app, Globals& globals);
void add_campaign(CLI::App& app, Globals& globals);
void add_reproduce(CLI::App& app, Globals& globals);
void add_report(CLI::App& app, Globals& globals);

}  // namespace loxo::cli
