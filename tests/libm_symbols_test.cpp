// SPDX-License-Identifier: Apache-2.0
// Rooms whose code runs in lanes call nothing of libm but sqrt, fabs, floor, copysign (all of them
// compiled to instructions): glibc chooses its sin by processor at run time, and the bits of a
// trial with it.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "places.hpp"

namespace {

// Not here: what is exact by definition (fmod, remainder, lround, ldexp …), the same on every
// processor.
const std::set<std::string> kLibm = {
    "sin",   "cos",   "tan",   "sincos", "asin",  "acos",  "atan", "atan2",  "exp",   "exp2",
    "exp10", "expm1", "log",   "log2",   "log10", "log1p", "pow",  "cbrt",   "sinh",  "cosh",
    "tanh",  "asinh", "acosh", "atanh",  "hypot", "erf",   "erfc", "tgamma", "lgamma"};

// Where a room's door or closed form may leave the rule, and why.
struct Exception {
  const char* object;
  const char* symbol;
};
const std::vector<Exception> kExceptions = {
    // Never part of a trial: done once, in double, at a door or for an analysis.
    {"alignment.cpp.o", "*"},
    {"allan.cpp.o", "*"},
    {"static_response.cpp.o", "*"},
    // In double only: tracks for calibration, which no campaign runs.
    {"route.cpp.o", "*"},
    {"straight_drive.cpp.o", "*"},
};

struct Use {
  std::string object, symbol;
};
// The undefined symbols of an archive, as `nm` lists them.
std::vector<Use> undefined_symbols(const std::string& archive) {
  std::vector<Use> uses;
  std::FILE* pipe = popen(("nm -u -A '" + archive + "' 2>/dev/null").c_str(), "r");
  if (pipe == nullptr) return uses;
  char line[4096];
  while (std::fgets(line, sizeof line, pipe) != nullptr) {
    const std::string s(line);
    const auto u = s.rfind(" U ");
    if (u == std::string::npos) continue;
    // "libloxo_num.a:functions.cpp.o:                 U name"
    const auto last = s.rfind(':', u), first = s.rfind(':', last - 1);
    std::string symbol = s.substr(u + 3);
    while (!symbol.empty() && (symbol.back() == '\n' || symbol.back() == ' ')) symbol.pop_back();
    uses.push_back({s.substr(first + 1, last - first - 1), symbol.substr(0, symbol.find('@'))});
  }
  pclose(pipe);
  return uses;
}

TEST(Symbols, KernelRoomsCallNothingOfLibm) {
  const auto build = std::filesystem::path(loxo::testing::program()).parent_path();
  std::size_t seen = 0;
  for (const char* room : {"num", "earth", "ins", "errors", "sim", "study"}) {
    const auto archive = build / (std::string("libloxo_") + room + ".a");
    if (!std::filesystem::exists(archive)) continue;  // a room of headers only
    for (const Use& use : undefined_symbols(archive.string())) {
      // Of study/ only what makes a trial.
      if (std::string(room) == "study" && use.object != "draw.cpp.o" &&
          use.object != "drive_truth.cpp.o" && use.object != "drive_modes.cpp.o" &&
          use.object != "scenario_path.cpp.o" &&
          use.object.find("_trial.cpp.o") == std::string::npos)
        continue;
      ++seen;
      bool allowed = kLibm.count(use.symbol) == 0;
      for (const auto& e : kExceptions)
        allowed =
            allowed || (use.object == e.object && (*e.symbol == '*' || use.symbol == e.symbol));
      EXPECT_TRUE(allowed) << room << "/" << use.object << " calls libm's " << use.symbol
                           << ": use num/functions.hpp, or add an exception with its reason";
    }
  }
  if (seen == 0) GTEST_SKIP() << "no nm, or nothing to read";
}

}  // namespace
