// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>
#include <new>

#include "cli/command.hpp"
#include "loxo/num/error.hpp"

int main(int argc, char** argv) {
  using namespace loxo;
  CLI::App app{
      "loxo: inertial positioning of vehicles and ships, from the equator across the pole"};
  app.require_subcommand(1);
  app.set_version_flag("--version", LOXO_VERSION);
  cli::Globals globals;
  cli::add_demo(app, globals);
  cli::add_inspect(app, globals);
  cli::add_convert(app, globals);
  cli::add_geo(app, globals);
  cli::add_simulate(app, globals);
  cli::add_calibrate(app, globals);
  cli::add_navigate(app, globals);
  cli::add_evaluate(app, globals);
  cli::add_analyze(app, globals);
  cli::add_transfer(app, globals);
  cli::add_allan(app, globals);
  cli::add_campaign(app, globals);
  cli::add_reproduce(app, globals);
  cli::add_report(app, globals);
  return cli::run(app, argc, argv);
}
