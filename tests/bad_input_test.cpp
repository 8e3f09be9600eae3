// SPDX-License-Identifier: Apache-2.0
// Bad input as a user meets it: exit code 3 and a message that names the place; nothing crashes.
#include <gtest/gtest.h>

#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo::testing {
namespace {

std::string drive(const std::string& toml, const std::string& rows) {
  const std::string folder = scratch_folder() + "/bad";
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/drive.toml", std::ios::binary) << toml;
  std::ofstream(folder + "/track.csv", std::ios::binary) << rows;
  return folder;
}
const std::string kTrack =
    "[track]\nfile = \"track.csv\"\n"
    "columns = { time = \"t_s\", distance = \"ds_m\", heading = \"heading_deg\" }\n"
    "[[benchmark]]\nafter_row = 0\nlat_deg = 55\nlon_deg = 10\nstd = \"0 m\"\n";
const std::string kHeader = "t_s,ds_m,heading_deg\n";

void refused(const std::string& path, const std::string& word) {
  for (const std::string& command :
       {"inspect " + path, "inspect --json " + path, "navigate " + path + " --mode reckon -o -"}) {
    SCOPED_TRACE(command);
    const Outcome o = run(command);
    EXPECT_EQ(o.exit_code, 3) << o.out << o.err;
    EXPECT_NE(o.err.find(word), std::string::npos) << o.err;
    EXPECT_EQ(o.out, "");
  }
}

TEST(BadInput, IsRefusedWithItsPlace) {
  refused(scratch_folder() + "/nothing_here", "nothing_here");
  refused(drive(kTrack, "t_s,ds,heading_deg\n1,2,3\n"), "ds_m");
  refused(drive("tracc = 1\n" + kTrack, kHeader + "1,2,3\n"), "tracc");
  refused(drive("format = 2\n" + kTrack, kHeader + "1,2,3\n"), "format");
  refused(drive("[track\n", kHeader + "1,2,3\n"), "drive.toml:1");
  refused(drive(kTrack, ""), "track.csv");
  refused(drive(kTrack, std::string("\0\1\2\3PNG\0", 8)), "track.csv");
}

TEST(BadInput, ADriveWithoutAReadableRow) {
  const Outcome o = run("inspect " + drive(kTrack, kHeader + "1,nan,3\n"));
  EXPECT_EQ(o.exit_code, 3);
  EXPECT_NE(o.err.find("track.csv"), std::string::npos) << o.err;
}

// A page asked of a command that writes data would be a table under a wrong name.
TEST(BadInput, APageIsWrittenByReportOnly) {
  const std::string page = scratch_folder() + "/page.html";
  for (const std::string& command :
       {std::string("analyze roots --lat 30deg"), "evaluate " + drive(kTrack, kHeader + "1,2,3\n"),
        "navigate " + drive(kTrack, kHeader + "1,2,3\n") + " --mode reckon"}) {
    const Outcome o = run(command + " -o " + page);
    EXPECT_EQ(o.exit_code, 2) << command << o.err;
    EXPECT_NE(o.err.find("loxo report"), std::string::npos) << o.err;
    EXPECT_FALSE(std::filesystem::exists(page)) << command;
  }
}

TEST(Inspect, CountsRowsAndGaps) {
  std::string rows = kHeader;
  for (int i = 1; i <= 40; ++i)
    if (i < 20 || i > 24) rows += std::to_string(0.5 * i) + ",2,90\n";
  const Outcome o = run("inspect --json " + drive(kTrack, rows));
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const Json j = parse_json(o.out, "inspect");
  const Json& c = j["channels"][0];
  EXPECT_EQ(c["rows"], 35);
  EXPECT_EQ(c["rate_hz"], 2.0);
  EXPECT_EQ(c["gaps"], 1);
  EXPECT_EQ(c["longest_gap_s"], 3.0);
  EXPECT_EQ(c["distance_m"], 70.0);
}

TEST(Inspect, ProposesADriveThatReads) {
  const std::string folder = scratch_folder() + "/bare";
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/imu.csv") << "t_s,gx,gy,gz,ax,ay,az\n0,0,0,5,0,0,1\n0.1,0,0,5,0,0,1\n"
                                        "0.2,0,0,5,0,0,1\n";
  const Outcome bare = run("inspect --json " + folder + "/imu.csv");
  ASSERT_EQ(bare.exit_code, 0) << bare.err;
  std::ofstream(folder + "/drive.toml")
      << parse_json(bare.out, "inspect")["drive_toml"].get<std::string>();
  const Outcome o = run("inspect --json " + folder);
  ASSERT_EQ(o.exit_code, 0) << o.err;
  // In g, as guessed from the norm
  EXPECT_NEAR(parse_json(o.out, "inspect")["channels"][0]["mean_force_mps2"].get<double>(), 9.80665,
              1e-12);
}

}  // namespace
}  // namespace loxo::testing
