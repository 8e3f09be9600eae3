// SPDX-License-Identifier: Apache-2.0
// `loxo report` as a user runs it.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "program.hpp"

namespace loxo::testing {
namespace {

std::string written(const std::string& name, const std::string& text) {
  const std::string path = scratch_folder() + "/" + name;
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

const char* kCalibration = R"({ "command": "calibrate", "recommended": "replay", "methods": {
  "replay": { "k": 1.25, "k_std": 1e-4, "eps_deg": 0.5, "eps_std_deg": 0.01, "valid": true, "why": "" },
  "rhumb": { "k": 1.26, "k_std": 1e-2, "eps_deg": 0.6, "eps_std_deg": 0.1, "valid": true, "why": "" } }, "diagnostics": [] })";

// A straight drive of 1 km northward, and the same a little longer with stated errors.
std::string drive_table(double scale, bool stated) {
  std::string text =
      "# mode: reckon\n# ellipsoid: "
      "WGS84\nt_s,lat_deg,lon_deg,h_m,ve_mps,vn_mps,vu_mps,heading_deg";
  text += stated ? ",std_e_m,std_n_m\n" : "\n";
  for (int i = 0; i <= 100; ++i) {
    char row[200];
    std::snprintf(row, sizeof row, "%d,%.12f,110,0,0,10,0,0%s\n", i, 55 + scale * i * 8.98e-5,
                  stated ? ",1,2" : "");
    text += row;
  }
  return text;
}

bool solutions_readable() {
  return run("report " + written("probe.csv", drive_table(1, false)) + " -o " + scratch_folder() +
             "/probe.html")
             .err.find("cannot be read by this build") == std::string::npos;
}

TEST(Report, OnePageFromACalibration) {
  const std::string page = scratch_folder() + "/calibration.html";
  const auto outcome = run("report " + written("calibration.json", kCalibration) + " -o " + page);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string html = slurp(page);
  EXPECT_GT(html.size(), 100'000u);
  EXPECT_LT(html.size(), 2'000'000u);
  EXPECT_EQ(html.find("http:/"), std::string::npos);
  EXPECT_EQ(html.find("https:/"), std::string::npos);
  EXPECT_NE(html.find("1.25000 ± 0.00010"), std::string::npos);
  EXPECT_NE(html.find("calibration.json, hash "), std::string::npos);
}

TEST(Report, JsonSaysWhatWasMade) {
  const std::string page = scratch_folder() + "/said.html";
  const auto outcome =
      run("report --json " + written("calibration.json", kCalibration) + " -o " + page);
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.out.find("\"kind\": \"calibration\""), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("\"bytes\": " + std::to_string(std::filesystem::file_size(page))),
            std::string::npos)
      << outcome.out;
}

TEST(Report, TheSameInputsGiveTheSameBytes) {
  const std::string input = written("calibration.json", kCalibration),
                    page = scratch_folder() + "/twice";
  run("report " + input + " -o " + page + "1.html");
  run("report " + input + " -o " + page + "2.html");
  EXPECT_EQ(slurp(page + "1.html"), slurp(page + "2.html"));
}

TEST(Report, RefusesWhatItDoesNotKnow) {
  const std::string page = scratch_folder() + "/refused.html";
  const struct {
    std::string path, says;
    int code;
  } cases[] = {{written("empty.csv", ""), "empty", 3},
               {written("speeds.csv", "t_s,v_mps\n0,1\n"), "columns t_s, v_mps", 3},
               {written("other.json", "{\"a\": 1}"), "no known kind", 3},
               {written("broken.json", "{\"a\": "), "broken.json:1", 3},
               {written("bytes.csv", std::string("\x7f\x45LF\0\0\0\1", 8)), "bytes.csv", 3},
               {written("store.db", "SQLite format 3 and more"), "store.db", 3},
               {scratch_folder() + "/absent.csv", "no such file", 3},
               {scratch_folder(), "without drive.toml", 3}};
  for (const auto& c : cases) {
    const auto outcome = run("report " + c.path + " -o " + page);
    EXPECT_EQ(outcome.exit_code, c.code) << c.path;
    EXPECT_NE(outcome.err.find(c.says), std::string::npos) << c.path << ": " << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(page)) << c.path;
  }
  EXPECT_EQ(run("report").exit_code, 2);
  EXPECT_EQ(run("report " + written("calibration.json", kCalibration) + " -o /nowhere/at/all.html")
                .exit_code,
            1);
}

TEST(Report, ACampaignBesideACalibration) {
  const std::string store = scratch_folder() + "/legs.sqlite",
                    page = scratch_folder() + "/campaign.html";
  ASSERT_EQ(run("campaign run leg-length --trials 2000 -o " + store).exit_code, 0);
  const auto outcome = run("report --json " + store + " " +
                           written("calibration.json", kCalibration) + " -o " + page);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* words : {"\"kind\": \"campaign\"", "What came out", "Calibration: calibration"})
    EXPECT_NE(outcome.out.find(words), std::string::npos) << words;
  EXPECT_NE(slurp(page).find("\"kind\":\"scatter\""), std::string::npos);
}

TEST(Report, SolutionHeldAgainstTheTruth) {
  if (!solutions_readable()) GTEST_SKIP() << "no readers of solutions in this build";
  const std::string page = scratch_folder() + "/solution.html";
  const auto outcome = run("report --json " + written("longer.csv", drive_table(1.01, true)) + " " +
                           written("truth.csv", drive_table(1, false)).append(" -o ") + page);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* title : {"Map", "Errors against the truth", "Position, velocity, attitude"})
    EXPECT_NE(outcome.out.find(title), std::string::npos) << title << outcome.out;
  const std::string html = slurp(page);
  EXPECT_LT(html.size(), 2'000'000u);
  // 1 % of 1000 m at the end: 100 * 8.98e-5 deg of the meridian at 55 deg are 999.8 m.
  EXPECT_NE(html.find(" m horizontal error (rms), 10 m at the end of "), std::string::npos)
      << html.substr(html.find("\"subtitle\""), 120);
}

TEST(Report, ALoneSolutionNeedsNoTruth) {
  if (!solutions_readable()) GTEST_SKIP() << "no readers of solutions in this build";
  const std::string page = scratch_folder() + "/alone.html";
  const auto outcome = run("report " + written("alone.csv", drive_table(1, false)) + " -o " + page);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(slurp(page).find("Errors against the truth"), std::string::npos);
  const auto header_only = run("report " + written("none.csv", "t_s,lat_deg,lon_deg\n") + " -o " +
                               scratch_folder() + "/none.html");
  EXPECT_EQ(header_only.exit_code, 3) << header_only.err;
}

}  // namespace
}  // namespace loxo::testing
