// SPDX-License-Identifier: Apache-2.0
// The command line itself: option values from a file, and what is said of a word that nobody knows.
#include <gtest/gtest.h>

#include <fstream>

#include "program.hpp"

namespace loxo::testing {
namespace {

const std::string kPoints =
    "lat1_deg,lon1_deg,lat2_deg,lon2_deg,lat3_deg,lon3_deg\n55,110,55.5,111,55.6,111.3\n";

std::string config(const std::string& text) {
  const std::string path = scratch_folder() + "/options.toml";
  std::ofstream(path) << text;
  return path;
}
void refused(const std::string& arguments, int code, const std::string& word) {
  const Outcome o = run(arguments, kPoints);
  EXPECT_EQ(o.exit_code, code) << arguments << o.err;
  EXPECT_NE(o.err.find(word), std::string::npos) << arguments << o.err;
  EXPECT_EQ(o.out, "") << arguments;
}

TEST(CommandLine, TakesOptionsFromAFile) {
  const std::string points = "calibrate points ";
  const Outcome by_hand = run(points + "--method all --std 0.1m", kPoints);
  ASSERT_EQ(by_hand.exit_code, 0) << by_hand.err;
  for (const char* text :
       {"method = \"all\"\nstd = \"0.1m\"\n",
        "[calibrate.points]\nmethod = \"all\"\nstd = \"0.1m\"\n",
        "std = \"0.1m\"\n[calibrate.points]\nmethod = \"all\"\n[navigate]\nmode = \"filter\"\n"}) {
    const Outcome o = run(points + "--config " + config(text), kPoints);
    EXPECT_EQ(o.exit_code, 0) << o.err;
    EXPECT_EQ(o.out, by_hand.out) << text;
    EXPECT_EQ(run("calibrate points --config=" + config(text), kPoints).out, by_hand.out);
  }
  // What the command line says itself rules.
  EXPECT_EQ(run(points + "--method all --config " +
                    config("method = \"rhumb\"\nstd = \"0.1m\"\nquiet = false\nseed = 3\n"),
                kPoints)
                .out,
            by_hand.out);
}

TEST(CommandLine, AnOptionsFileThatIsWrong) {
  const std::string points = "calibrate points --config ";
  refused(points + scratch_folder() + "/none.toml", 3, "none.toml: no such file");
  refused(points + config("metod = \"all\"\n"), 3,
          "options.toml:1:9: key metod: 'points' has no option of that name; did you mean "
          "'method'?");
  refused(points + config("[calibrate.points]\nseed = \"x\"\n"), 3, "options.toml:2:8");
  refused(points + config("method = \"al\"\n"), 2, "did you mean 'all'?");
  refused("calibrate points --config", 2, "--config");
}

TEST(CommandLine, AnUnknownWordIsNamedWithItsNearest) {
  refused("evalute x", 2, "'evalute' is no command; did you mean 'evaluate'?");
  refused("navigate x --mod filter", 2, "did you mean '--mode'?");
  refused("evaluate x --trth=y --json", 2, "did you mean '--truth'?");
  refused("campaign rnu x", 2, "did you mean 'run'?");
}

TEST(CommandLine, ValuesThatMeanNothing) {
  const std::string table = scratch_folder() + "/rows.csv";
  std::ofstream(table) << "t_s,lat_deg,lon_deg,h_m\n0,50,10,0\n1,50.001,10,0\n";
  const std::string evaluate = "evaluate " + table + " --truth " + table;
  EXPECT_EQ(run(evaluate).exit_code, 0);
  refused(evaluate + " --ellipsoid WGS48", 2, "did you mean 'WGS84'?");
  refused(evaluate + " --from 9s --to 5s", 2, "--from");
  refused("navigate x --mode filter --precision -3", 2, "--precision");
  refused("navigate x --mode inertial --innovations y.csv", 2, "--innovations");
}

}  // namespace
}  // namespace loxo::testing
