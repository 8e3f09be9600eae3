// SPDX-License-Identifier: Apache-2.0
// Faults of drives, each told with its place; and the real recordings, with the numbers that their
// own descriptions say a correct loader reproduces.
#include "loxo/log/drive.hpp"

#include <gtest/gtest.h>

#include <unistd.h>
#include <array>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "loxo/earth/geodetic.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "shared_folder.hpp"

namespace loxo {
namespace {

namespace fs = std::filesystem;

const std::string kOdometer =
    "format = 1\n[odometer]\nfile = \"odo.csv\"\nkind = \"speed\"\n"
    "columns = { time = \"t_s\", value = \"v_mps\" }\n";
const std::string kFix =
    "format = 1\n[fix]\nfile = \"odo.csv\"\n"
    "columns = { time = \"t_s\", lat = \"lat_deg\", lon = \"lon_deg\" }\n";

class DriveFault : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = (fs::temp_directory_path() / ("loxo_drive_" + std::to_string(::getpid()))).string();
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string make(const std::string& toml, const std::string& rows) {
    std::ofstream(folder_ + "/drive.toml", std::ios::binary) << toml;
    std::ofstream(folder_ + "/odo.csv", std::ios::binary) << rows;
    return folder_;
  }
  std::vector<OdometerTick> ticks(const std::string& rows, const std::string& toml = kOdometer) {
    return read_odometer(read_drive(make(toml, rows)), diagnostics_);
  }
  // The message of the fault; "" if there was none.
  std::string fault(const std::string& rows, const std::string& toml = kOdometer) {
    try {
      ticks(rows, toml);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::kInput) << e.what();
      return e.what();
    }
    return "";
  }
  static void expect_words(const std::string& text, const std::vector<std::string>& words) {
    for (const auto& w : words)
      EXPECT_NE(text.find(w), std::string::npos) << "'" << w << "' in: " << text;
  }
  std::string folder_;
  Diagnostics diagnostics_;
};

TEST_F(DriveFault, MissingColumnNamesTheNearest) {
  expect_words(fault("t_s,v_mpz\n0,1\n"), {"odo.csv", "odometer.columns.value", "v_mps", "v_mpz"});
}
TEST_F(DriveFault, UnknownKeyNamesTheNearest) {
  expect_words(fault("t_s,v_mps\n0,1\n", kOdometer + "dellay = \"1 s\"\n"),
               {"drive.toml:6", "dellay", "delay"});
}
TEST_F(DriveFault, UnknownKeyOfColumns) {
  expect_words(fault("t_s,v_mps\n0,1\n",
                     "[odometer]\nfile = \"odo.csv\"\nkind = \"speed\"\n"
                     "columns = { time = \"t_s\", value = \"v_mps\", speed = \"v_mps\" }\n"),
               {"drive.toml", "speed"});
}
TEST_F(DriveFault, WrongUnit) {
  expect_words(fault("t_s,v_mps\n0,1\n", kOdometer + "units = { value = \"deg\" }\n"),
               {"drive.toml", "value", "deg"});
}
TEST_F(DriveFault, BareNumberWhereAQuantityIsDue) {
  expect_words(fault("t_s,v_mps\n0,1\n", kOdometer + "delay = 0.1\n"), {"drive.toml:6", "delay"});
}
// The unit of a speed reading is a speed; of its way, a length; anything else is refused.
TEST_F(DriveFault, QuantisationOfASpeed) {
  auto errors = [&](const std::string& q) {
    return read_drive(
               make(kOdometer + "errors = { quantisation = \"" + q + "\" }\n", "t_s,v_mps\n"))
        .odometer_errors;
  };
  EXPECT_NEAR(errors("1 km/h").speed_quantisation, 1 / 3.6, 1e-15);
  EXPECT_TRUE(std::isnan(errors("1 km/h").quantisation));
  EXPECT_EQ(errors("0.05 m").quantisation, 0.05);
  EXPECT_TRUE(std::isnan(errors("0.05 m").speed_quantisation));
  expect_words(fault("t_s,v_mps\n0,1\n", kOdometer + "errors = { quantisation = \"1 rad\" }\n"),
               {"quantisation", "length"});
}
TEST_F(DriveFault, MissingFile) {
  expect_words(fault("t_s,v_mps\n0,1\n",
                     "[odometer]\nfile = \"none.csv\"\nkind = \"speed\"\n"
                     "columns = { time = \"t_s\", value = \"v_mps\" }\n"),
               {"none.csv", "drive.toml"});
}
TEST_F(DriveFault, EmptyFile) { expect_words(fault(""), {"odo.csv"}); }
TEST_F(DriveFault, BinaryFile) {
  expect_words(fault(std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0", 18)), {"odo.csv"});
}
TEST_F(DriveFault, LatitudeBeyondThePole) {
  expect_words(
      fault("t_s,v_mps\n0,1\n", kOdometer + "[start]\nt_s = 0\nlat_deg = 90.5\nlon_deg = 0\n"),
      {"drive.toml:8", "lat_deg", "90.5"});
  const auto fixes = read_fixes(
      read_drive(make(kFix, "t_s,lat_deg,lon_deg\n0,89,0\n1,91,0\n2,-90,0\n")), diagnostics_);
  EXPECT_EQ(fixes.size(), 2u);
  EXPECT_EQ(diagnostics_.count("bad_row"), 1u);
}
TEST_F(DriveFault, NanRowsAreToldAndSkipped) {
  const auto t = ticks("t_s,v_mps\n0,1\n1,nan\n2,\n3,2\nnan,2\n4,x\n");
  ASSERT_EQ(t.size(), 2u);
  EXPECT_EQ(t[1].value, 2.0);
  EXPECT_EQ(diagnostics_.count("bad_row"), 4u);
}
// Of rows that stand each for themselves: put in order. Of two with one stamp the first counts.
TEST_F(DriveFault, TimeBackIsSortedAndDuplicatesAreSkippedBothTold) {
  const auto t = ticks("t_s,v_mps\n0,1\n1,2\n1,3\n0.5,4\n2,5\n");
  ASSERT_EQ(t.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(t[i].t, (std::array{0.0, 0.5, 1.0, 2.0})[i]);
    EXPECT_EQ(t[i].value, (std::array{1.0, 4.0, 2.0, 5.0})[i]);
  }
  EXPECT_EQ(diagnostics_.count("duplicate"), 1u);
  EXPECT_EQ(diagnostics_.count("time_back"), 1u);
}
TEST_F(DriveFault, OtherLineEndsAndAByteOrderMark) {
  const auto t = ticks("\xEF\xBB\xBFt_s,v_mps\r\n0,1\r\n1,2\r\n", "\xEF\xBB\xBF" + kOdometer);
  ASSERT_EQ(t.size(), 2u);
  EXPECT_EQ(t[1].value, 2.0);
  EXPECT_EQ(diagnostics_.count("bad_row"), 0u);
}
TEST_F(DriveFault, OneRow) { EXPECT_EQ(ticks("t_s,v_mps\n7,3\n").size(), 1u); }

}  // namespace
}  // namespace loxo
