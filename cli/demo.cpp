// SPDX-License-Identifier: Apache-2.0
// `loxo demo`: the whole journey on embedded scenarios, each step the command a user would type.
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <vector>

#include "cli/command.hpp"
#include "loxo/num/error.hpp"

namespace loxo::cli {
namespace {

namespace fs = std::filesystem;

// A path as the shell takes it.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

int run(const Globals& globals) {
  const std::string folder = globals.output.empty() ? "loxo-demo" : globals.output;
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) throw Error(ErrorKind::kWork, "cannot make the folder: " + failed.message(), folder);
  const std::string program = fs::read_symlink("/proc/self/exe", failed).string();
  if (failed) throw Error(ErrorKind::kWork, "cannot find the program itself: " + failed.message());
  const auto in = [&](const char* name) { return quoted((fs::path(folder) / name).string()); };
  // The demo can be run again: its own drives of last time make room.
  for (const char* own : {"drive", "pole"})
    if (fs::exists(fs::path(folder) / own / "drive.toml"))
      fs::remove_all(fs::path(folder) / own, failed);
  const std::string seed = " --seed " + std::to_string(globals.seed);

  struct Step {
    const char* why;
    std::string command;
  };
  const std::vector<Step> steps = {
      {"a drive with sensors, and its truth", "simulate straight-road -o " + in("drive") + seed},
      {"odometer scale and mounting angle from the surveyed points",
       "calibrate " + in("drive") + " -o " + in("certificate.json")},
      {"dead reckoning as recorded",
       "navigate " + in("drive") + " --mode reckon -o " + in("as_recorded.csv")},
      {"dead reckoning, calibrated", "navigate " + in("drive") + " --mode reckon --calibration " +
                                         in("certificate.json") + " -o " + in("calibrated.csv")},
      {"how wrong each is", "evaluate " + in("as_recorded.csv") + " --truth " + in("drive") +
                                " -o " + in("as_recorded.json")},
      {"", "evaluate " + in("calibrated.csv") + " --truth " + in("drive") + " -o " +
               in("calibrated.json")},
      {"over the pole, inertial only", "simulate over-the-pole -o " + in("pole") + seed},
      {"", "navigate " + in("pole") + " --mode inertial --frame auto -o " + in("pole.csv")},
      {"", "evaluate " + in("pole.csv") + " --truth " + in("pole") + " -o " + in("pole.json")},
      {"one page that shows it all", "report " + in("as_recorded.csv") + " " +
                                         in("calibrated.csv") + " " + in("certificate.json") + " " +
                                         in("drive") + " -o " + in("report.html")},
      {"", "report " + in("pole.csv") + " " + in("pole") + " -o " + in("pole.html")},
  };
  int number = 0;
  for (const auto& step : steps) {
    if (*step.why != '\0') say(globals, fmt::format("\n{}. {}", ++number, step.why));
    say(globals, "   $ loxo " + step.command);
    std::fflush(stdout);
    const std::string words = globals.quiet || globals.json ? " --quiet >/dev/null" : "";
    if (std::system((quoted(program) + " " + step.command + words).c_str()) != 0)
      throw Error(ErrorKind::kWork, "this step of the demo failed", "loxo " + step.command);
  }
  if (globals.json) {
    Json json;
    json["command"] = "demo";
    json["report"] = (fs::path(folder) / "report.html").string();
    json["folder"] = folder;
    print_json(json);
  }
  say(globals,
      fmt::format("\nThe reports: {0}/report.html (calibration), {0}/pole.html (over the pole)",
                  folder));
  return 0;
}

}  // namespace

void add_demo(CLI::App& app, Globals& globals) {
  add_command(app, globals, "demo",
              "the whole journey on embedded scenarios: simulate, calibrate, navigate, evaluate, "
              "over the pole, report",
              "loxo demo -o loxo-demo", [&globals]() -> int { return run(globals); });
}

}  // namespace loxo::cli
