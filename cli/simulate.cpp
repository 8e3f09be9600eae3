// SPDX-License-Identifier: Apache-2.0
// `loxo simulate SCENARIO -o DRIVE`: a drive or voyage with truth, from a scenario.
#include <fmt/format.h>

#include <memory>

#include "cli/command.hpp"
#include "loxo/log/drive_folder.hpp"
#include "loxo/num/error.hpp"
#include "loxo/study/scenario.hpp"

namespace loxo::cli {
namespace {

int list(const Globals& globals) {
  Json out = Json::array();
  for (const auto& ready : ready_scenarios()) {
    const Scenario s = read_scenario(ready.name);
    say(globals, fmt::format("{:<16} {}", s.name, s.about));
    out.push_back({{"name", s.name}, {"about", s.about}, {"duration_s", s.trajectory.duration()}});
  }
  if (globals.json) print_json(out);
  return 0;
}

int simulate(const Globals& globals, const std::string& scenario, bool seeded) {
  if (scenario.empty())
    throw Error(ErrorKind::kUsage,
                "expected a scenario: a file or a name of 'loxo simulate --list'");
  auto sets = globals.sets;
  if (seeded) sets.push_back("seed=" + std::to_string(globals.seed));
  const Scenario s = read_scenario(scenario, sets);
  if (globals.output.empty())
    throw Error(ErrorKind::kUsage, "expected -o DRIVE, the folder of the drive");
  DriveFolder folder(globals.output);
  Progress progress(globals, "simulate", s.trajectory.duration());
  const SimulatedDrive made = write_scenario(s, folder.path(), [&](double t) { progress.at(t); });
  folder.commit();
  say(globals,
      fmt::format("{}: {}, {:.6g} s, {:.6g} m, {} IMU samples, {} fixes, {} benchmarks, seed {}",
                  globals.output, s.name, made.duration, made.distance, made.samples, made.fixes,
                  made.benchmarks, s.seed));
  if (globals.json)
    print_json({{"command", "simulate"},
                {"scenario", s.name},
                {"output", globals.output},
                {"seed", s.seed},
                {"duration_s", made.duration},
                {"distance_m", made.distance},
                {"samples", made.samples},
                {"fixes", made.fixes},
                {"benchmarks", made.benchmarks}});
  return 0;
}

}  // namespace

void add_simulate(CLI::App& app, Globals& globals) {
  struct Options {
    std::string scenario;
    bool list = false;
    CLI::App* command = nullptr;
  };
  const auto o = std::make_shared<Options>();
  o->command =
      add_command(app, globals, "simulate", "a drive or voyage with truth, IMU, odometer and fixes",
                  "loxo simulate straight-road -o road", [&globals, o]() -> int {
                    if (o->list) return list(globals);
                    return simulate(globals, o->scenario, o->command->count("--seed") > 0);
                  });
  o->command->add_option("scenario", o->scenario, "a scenario's file, or the name of a ready one");
  o->command->add_flag("--list", o->list, "the ready scenarios");
}

}  // namespace loxo::cli
