// SPDX-License-Identifier: Apache-2.0
// What users hand in that is wrong, item by item, through the program: the message, the exit code,
// and where something can be saved, that it is there and marked in `health`. An item of the list
// without a case is a failure of its own.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>

#include "loxo/text/csv.hpp"
#include "program.hpp"

namespace loxo::testing {
namespace {

namespace fs = std::filesystem;

const char* const kItems[] = {
    "missing column", "unknown column key", "unknown key", "wrong unit", "missing unit",
    "bare number", "NaN", "time going back", "duplicate rows", "truncated gzip", "empty file",
    "header only", "binary file", "CRLF and BOM", "one row", "zero chord", "unobservable state",
    "latitude beyond 90", "true headings across the pole", "no solution of a projection",
    "disk full", "output folder missing", "benchmark beyond the end",
    // of the inertial unit
    "deg/s declared as rad/s", "rad/s declared as deg/s", "g declared as m/s^2",
    "m/s^2 declared as g", "increments declared as rates", "rates declared as increments",
    "wrong axis triple", "left-handed triple", "z sign", "half-rate stamps", "gap of 1 sample",
    "gap of 1 s", "gap of 1 h", "duplicated stamps", "reversed stamps", "a stamp far ahead",
    "NaN of the unit", "no row of numbers", "saturated as declared", "saturated as seen",
    "start without alignment data", "alignment at the pole", "unknown frame", "unknown scenario"};
std::string folder(const std::string& name) {
  const std::string path = scratch_folder() + "/bad_" + name;
  fs::remove_all(path);
  fs::create_directories(path);
  return path;
}
void put(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

// One command on a bad input: its code, what its message says, what it must not leave behind.
void refused(const std::string& item, const std::string& command, int code,
             const std::vector<std::string>& words) {
  SCOPED_TRACE(item + ": loxo " + command);
  const Outcome o = run(command);
  EXPECT_EQ(o.exit_code, code) << o.err.substr(0, 400);
  for (const auto& w : words)
    EXPECT_NE(o.err.find(w), std::string::npos) << "'" << w << "' in: " << o.err.substr(0, 600);
  if (code == 2 || code == 3) {
    EXPECT_EQ(o.out, "");
  }
}

const std::string kTrack =
    "[track]\nfile = \"track.csv\"\n"
    "columns = { time = \"t_s\", distance = \"ds_m\", heading = \"heading_deg\" }\n"
    "heading_model = \"independent\"\n"
    "[[benchmark]]\nafter_row = 0\nlat_deg = 55\nlon_deg = 10\nstd = \"0.1 m\"\n"
    "[[benchmark]]\nafter_row = 40\nlat_deg = 55.0035\nlon_deg = 10.002\nstd = \"0.1 m\"\n";
std::vector<std::string> track_rows() {
  std::vector<std::string> rows;
  for (int i = 1; i <= 40; ++i) rows.push_back(std::to_string(i) + ",10,20");
  return rows;
}
std::string track_csv(const std::vector<std::string>& rows) {
  std::string text = "t_s,ds_m,heading_deg\n";
  for (const auto& r : rows) text += r + "\n";
  return text;
}
std::string track(const std::string& name, const std::string& toml = kTrack,
                  const std::string& csv = track_csv(track_rows()),
                  const std::string& file = "track.csv") {
  const std::string path = folder(name);
  put(path + "/drive.toml", toml);
  put(path + "/" + file, csv);
  return path;
}
std::string output(const std::string& name = "o.csv") { return scratch_folder() + "/" + name; }

// The three commands that read a track: all refuse, with the same reason.
void track_refused(const std::string& item, const std::string& drive,
                   const std::vector<std::string>& words, bool inspect_too = true) {
  refused(item, "calibrate --json " + drive, 3, words);
  refused(item, "navigate " + drive + " --mode reckon -o " + output(), 3, words);
  EXPECT_FALSE(fs::exists(output())) << item;
  if (inspect_too) refused(item, "inspect " + drive, 3, words);
}
// The rest is saved: told, and navigated to the end.
void track_saved(const std::string& item, const std::string& drive,
                 const std::vector<std::string>& words) {
  refused(item, "inspect --quiet " + drive, 0, {});
  refused(item, "calibrate " + drive, 0, words);
  refused(item, "navigate " + drive + " --mode reckon -o " + output(), 0, words);
  const auto rows = columns(slurp(output()));
  ASSERT_TRUE(rows.contains("t_s")) << item;
  EXPECT_EQ(number(rows.at("t_s").back()), 40.0) << item;
  for (const auto& lat : rows.at("lat_deg")) EXPECT_TRUE(std::isfinite(number(lat))) << item;
  fs::remove(output());
}

TEST(BadDrive, WhatDriveTomlSays) {
  const std::string csv = track_csv(track_rows());
  track_refused("missing column", track("column", kTrack, replaced(csv, "ds_m", "ds_metres")),
                {"drive.toml:2", "track.columns.distance", "track.csv", "'ds_m'", "ds_metres"});
  track_refused("unknown column key",
                track("columnkey", replaced(kTrack, "distance =", "distence =")),
                {"drive.toml:3", "distence", "distance"});
  track_refused("unknown key", track("key", replaced(kTrack, "heading_model", "heading_modell")),
                {"drive.toml:4", "heading_modell", "did you mean 'heading_model'"});
  track_refused("wrong unit",
                track("unit", replaced(kTrack, "heading_model",
                                       "units = { distance = \"deg\" }\nheading_model")),
                {"drive.toml:4", "track.units.distance", "length", "'deg'", "angle"});
  track_refused("missing unit",
                track("nounit", replaced(kTrack, "ds_m", "ds"), replaced(csv, "ds_m", "ds")),
                {"'ds' has no unit", "length", "units"});
  track_refused("bare number", track("bare", replaced(kTrack, "\"0.1 m\"", "0.1")),
                {"drive.toml:9", "benchmark[0].std", "no unit"});
  track_refused("latitude beyond 90", track("lat", replaced(kTrack, "55.0035", "95")),
                {"drive.toml:12", "lat_deg", "[-90, 90]", "95"});
  refused("benchmark beyond the end",
          "calibrate " + track("after", replaced(kTrack, "after_row = 40", "after_row = 400")), 3,
          {"400", "40 rows"});
}

TEST(BadDrive, WhatTheFileHolds) {
  const std::string csv = track_csv(track_rows());
  track_refused("empty file", track("empty", kTrack, ""), {"track.csv", "empty file"});
  track_refused("binary file", track("binary", kTrack, std::string("\x89PNG\0\1\2\3", 8)),
                {"track.csv", "binary"});
  track_refused("header only", track("header", kTrack, track_csv({})), {"rows"});
  track_refused("one row", track("one", kTrack, track_csv({"1,10,20"})), {"two rows", "found 1"},
                false);
  auto rows = track_rows();
  rows[5] = "6,nan,20";
  track_saved("NaN", track("nan", kTrack, track_csv(rows)), {"track.csv:7", "nan"});
  rows = track_rows();
  rows[5] = "4.5,10,20";
  track_saved("time going back", track("back", kTrack, track_csv(rows)),
              {"track.csv:7", "from 5 s to 4.5 s"});
  rows = track_rows();
  rows.insert(rows.begin() + 5, rows[4]);
  track_saved("duplicate rows", track("twice", kTrack, track_csv(rows)), {"track.csv:7", "5 s"});
  track_saved("CRLF and BOM",
              [&] {
                std::string toml = "\xEF\xBB\xBF", text = "\xEF\xBB\xBF";
                for (char c : kTrack) toml += c == '\n' ? std::string("\r\n") : std::string(1, c);
                for (char c : csv) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
                return track("crlf", toml, text);
              }(),
              {});
  // A log that was cut while it was written: the rows before are there, and the cut is told.
  std::string many = "t_s,ds_m,heading_deg\n";
  for (int i = 1; i <= 4000; ++i)
    many += std::to_string(i) + "," + std::to_string(10 + 0.001 * ((i * 7919) % 997)) + ",20\n";
  const std::string cut = track("gzip", replaced(kTrack, "track.csv", "track.csv.gz"), "");
  {
    OutputFile gz(cut + "/track.csv.gz");
    gz.write(many);
    gz.commit();
  }
  const std::string bytes = slurp(cut + "/track.csv.gz");
  put(cut + "/track.csv.gz", bytes.substr(0, bytes.size() * 3 / 4));
  refused("truncated gzip", "navigate " + cut + " --mode reckon -o " + output(), 0,
          {"track.csv.gz:", "truncated gzip", "are kept"});
  EXPECT_GT(columns(slurp(output())).at("t_s").size(), 1000u);
  fs::remove(output());
  // What follows from the cut comes after it: the user reads the cause first.
  std::string late = kTrack;
  late.insert(late.find("[[benchmark]]", late.find("[[benchmark]]") + 1),
              "[[benchmark]]\nname = \"late\"\nafter_row = 3990\nlat_deg = 55.2\nlon_deg = 10.1\n");
  put(cut + "/drive.toml", replaced(late, "track.csv", "track.csv.gz"));
  const Outcome told = run("calibrate " + cut);
  EXPECT_NE(told.exit_code, 0);
  EXPECT_NE(told.err.find("3990"), std::string::npos) << told.err;
  EXPECT_LT(told.err.find("truncated gzip"), told.err.find("3990")) << told.err;
}

TEST(BadDrive, WhatCannotBeComputed) {
  refused(
      "zero chord",
      "calibrate " + track("chord", replaced(replaced(kTrack, "55.0035", "55"), "10.002", "10")), 1,
      {"zero chord", "0 m apart"});
  const Outcome o = run("calibrate " + track("states") + " --estimate lever_arm");
  // "unobservable state"
  EXPECT_EQ(o.exit_code, 0);  // the other methods stand
  EXPECT_NE(o.out.find("4 unknowns and 2 equations"), std::string::npos) << o.out;
  refused("unobservable state",
          "calibrate " + track("states2") + " --estimate lever_arm --method least_squares", 1,
          {"4 unknowns and 2 equations"});
  std::vector<std::string> north;
  for (int i = 1; i <= 40; ++i) north.push_back(std::to_string(i) + ",10,0");
  const std::string pole = track(
      "pole",
      replaced(
          replaced(replaced(kTrack, "lat_deg = 55\n", "lat_deg = 89.999\n"), "55.0035", "89.999"),
          "10.002", "-170"),
      track_csv(north));
  refused("true headings across the pole",
          "navigate " + pole + " --mode reckon -o " + output("pole.csv"), 3,
          {"crosses the pole in row 12", "heading_reference = \"grid\""});
  refused("true headings across the pole", "calibrate " + pole, 1, {"crosses a pole", "grid"});
  put(output("gk.csv"), "x_m,y_m\n1e12,5e5\n");
  const Outcome gk = run("geo gauss-inverse", "x_m,y_m\n1e12,5e5\n");
  // "no solution of a projection"
  EXPECT_EQ(gk.exit_code, 3);
  EXPECT_NE(gk.err.find("standard input:2"), std::string::npos) << gk.err;
}

TEST(BadDrive, WhereNothingCanBeWritten) {
  const std::string drive = track("write");
  for (const std::string& command : std::vector<std::string>{
           "navigate " + drive + " --mode reckon -o ", "calibrate " + drive + " -o ",
           "report " + drive + " -o ", "convert " + drive + "/track.csv "}) {
    if (command.find("convert") == std::string::npos)
      refused("disk full", command + "/dev/full", 1, {"/dev/full", "disk full"});
    refused("output folder missing", command + scratch_folder() + "/none/x.csv", 1,
            {"none", "does not exist"});
  }
  refused("output folder missing", "simulate straight-road -o " + scratch_folder() + "/none/x", 1,
          {"none/x"});
  const Outcome full =
      run("geo rhumb-inverse -o /dev/full", "lat1_deg,lon1_deg,lat2_deg,lon2_deg\n1,2,3,4\n");
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_NE(full.err.find("disk full"), std::string::npos) << full.err;
}

// A minute at rest and a drive of 20 s, as rates at 50 Hz.
using Rows = std::vector<std::vector<double>>;
struct Unit {
  Rows rows;
  std::string rest;  // drive.toml behind [imu]
};
const Unit& unit() {
  static const Unit made = [] {
    put(output("unit.toml"),
        "format = 1\nabout = \"unit\"\n[start]\nlat_deg = 45\nlon_deg = 10\ncourse = \"35 deg\"\n"
        "[[leg]]\nduration = \"60 s\"\nspeed = \"0 m/s\"\n[[leg]]\nduration = \"10 s\"\n"
        "speed = \"15 m/s\"\n[[leg]]\nduration = \"10 s\"\n[imu]\nrate = \"50 Hz\"\n"
        "gyro_bias = \"0.01 deg/h\"\ngyro_noise = \"0.001 deg/sqrt(h)\"\n"
        "accel_noise = \"5 ug/sqrt(Hz)\"\n[odometer]\nk = 1.0\n");
    const std::string path = scratch_folder() + "/unit_drive";
    const Outcome o = run("simulate " + output("unit.toml") + " -o " + path);
    EXPECT_EQ(o.exit_code, 0) << o.err;
    Unit u;
    const auto c = columns(slurp(path + "/imu.csv"));
    for (std::size_t i = 0; i < c.at("t_s").size(); ++i) {
      std::vector<double> row = {number(c.at("t_s")[i])};
      for (const char* name : {"dthx_rad", "dthy_rad", "dthz_rad", "dvx_mps", "dvy_mps", "dvz_mps"})
        row.push_back(number(c.at(name)[i]) * 50);
      u.rows.push_back(row);
    }
    put(output("unit_odometer.csv"), slurp(path + "/odometer.csv"));
    return u;
  }();
  return made;
}
const std::string kImu =
    "[imu]\nfile = \"imu.csv\"\nkind = \"rate\"\naxes = \"RFU\"\ncolumns = { time = \"t_s\", "
    "gyro = [\"gx\", \"gy\", \"gz\"], accel = [\"ax\", \"ay\", \"az\"] }\n"
    "units = { gyro = \"rad/s\", accel = \"m/s^2\" }\n"
    "errors = { gyro_bias = \"0.01 deg/h\", gyro_noise = \"0.001 deg/sqrt(h)\" }\n";
const std::string kStart =
    "[start]\nt_s = 0\nlat_deg = 45\nlon_deg = 10\nh_m = 0\n"
    "alignment = { kind = \"static\", duration = \"55 s\" }\n";
std::string imu(const std::string& name, const std::function<void(Rows&)>& spoil = {},
                const std::string& section = kImu, const std::string& start = kStart) {
  Rows rows = unit().rows;
  if (spoil) spoil(rows);
  const std::string path = folder(name);
  put(path + "/drive.toml", section + start);
  std::string csv = "t_s,gx,gy,gz,ax,ay,az\n";
  for (const auto& row : rows) {
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (k > 0) csv += ',';
      append_number(csv, row[k]);
    }
    csv += '\n';
  }
  put(path + "/imu.csv", csv);
  return path;
}
std::function<void(Rows&)> scaled(double gyro, double accel) {
  return [=](Rows& rows) {
    for (auto& r : rows)
      for (std::size_t k = 1; k < 7; ++k) r[k] *= k < 4 ? gyro : accel;
  };
}

// Refused by navigation with the reason and no output, told by inspect, and obeyed with --force.
void imu_refused(const std::string& item, const std::string& drive,
                 const std::vector<std::string>& words) {
  fs::remove(output());
  for (const std::string mode : {"inertial", "filter"})
    refused(item, "navigate " + drive + " --mode " + mode + " -o " + output(), 3, words);
  EXPECT_FALSE(fs::exists(output())) << item;
  const Outcome told = run("inspect --quiet --json " + drive);
  EXPECT_EQ(told.exit_code, 0) << item;
  for (const auto& w : words)
    EXPECT_NE(told.out.find(w), std::string::npos) << item << ": " << w << "\n" << told.out;
}
// Saved: the solution reaches its end, the bit stands where it should and nowhere before.
void imu_saved(const std::string& item, const std::string& drive,
               const std::vector<std::string>& words, std::uint32_t bit, double from, double end) {
  refused(item, "navigate " + drive + " --mode inertial -o " + output(), 0, words);
  const auto rows = columns(slurp(output()));
  ASSERT_TRUE(rows.contains("health")) << item;
  EXPECT_NEAR(number(rows.at("t_s").back()), end, 1e-6) << item;
  bool marked = bit == 0;
  for (std::size_t i = 0; i < rows.at("t_s").size(); ++i) {
    const auto health = static_cast<std::uint32_t>(number(rows.at("health")[i]));
    marked = marked || (health & bit) != 0;
    if (number(rows.at("t_s")[i]) < from - 0.11) {
      EXPECT_EQ(health, 0u) << item;
    }
    ASSERT_TRUE(std::isfinite(number(rows.at("lat_deg")[i]))) << item;
  }
  EXPECT_TRUE(marked) << item;
  fs::remove(output());
}

TEST(BadImu, Units) {
  // A unit whose gyros cannot tell: told, not refused (a bias may look so).
  refused("deg/s declared as rad/s", "inspect " + imu("dps", scaled(57.29578, 1)), 0,
          {"imu.units.gyro", "57.", "deg/s, not rad/s?"});
  refused("rad/s declared as deg/s",
          "inspect " + imu("rps", {}, replaced(kImu, "\"rad/s\"", "\"deg/s\"")), 0,
          {"imu.units.gyro", "rad/s, not deg/s?"});
  imu_refused("g declared as m/s^2", imu("g", scaled(1, 1 / 9.80665)),
              {"imu.units.accel", "is it in g, not m/s^2?"});
  imu_refused("m/s^2 declared as g", imu("mps2", {}, replaced(kImu, "\"m/s^2\"", "\"g\"")),
              {"imu.units.accel", "is it in m/s^2, not g?"});
  imu_refused("increments declared as rates", imu("increments", scaled(0.02, 0.02)),
              {"increments (kind"});
  imu_refused(
      "rates declared as increments",
      imu("rates", {},
          replaced(replaced(replaced(kImu, "\"rate\"", "\"increment\""), "rad/s\"", "rad\""),
                   "m/s^2\"", "m/s\"")),
      {"rates (kind"});
  // While it drives: rates no vehicle has.
  refused("deg/s declared as rad/s",
          "inspect " + imu("turning",
                           [](Rows& rows) {
                             for (std::size_t i = 3000; i < 3400; ++i) rows[i][3] = 20.0;
                           }),
          0, {"imu.units.gyro", "deg/s, not rad/s?"});
}

TEST(BadImu, Axes) {
  imu_refused("wrong axis triple", imu("side", {}, replaced(kImu, "\"RFU\"", "\"URF\"")),
              {"imu.axes", "declared axis triple"});
  imu_refused("z sign", imu("down", {}, replaced(kImu, "\"RFU\"", "\"FRD\"")),
              {"imu.axes", "points down", "FRD?"});
  imu_refused("z sign",
              imu("gravity",
                  [](Rows& rows) {
                    for (auto& r : rows) r[6] = -r[6];
                  }),
              {"imu.axes", "gravity with the other sign"});
  for (const auto& [axes, word] : {std::pair<std::string, std::string>{"RUF", "left-handed"},
                                   {"RRU", "named twice"},
                                   {"XYZ", "expected three letters"}}) {
    const std::string drive = imu("triple", {}, replaced(kImu, "\"RFU\"", "\"" + axes + "\""));
    refused("left-handed triple", "inspect " + drive, 3, {"drive.toml:4", axes, word});
    refused("left-handed triple", "navigate " + drive + " --mode inertial -o " + output(), 3,
            {"drive.toml:4", word});
  }
}

TEST(BadImu, Stamps) {
  const double end = unit().rows.back()[0];
  imu_saved("gap of 1 sample", imu("gap1", [](Rows& rows) { rows.erase(rows.begin() + 3100); }),
            {"imu.csv:3102", "gap of 0.04 s"}, 1, 62, end);
  imu_saved("gap of 1 s",
            imu("gap50", [](Rows& rows) { rows.erase(rows.begin() + 3100, rows.begin() + 3150); }),
            {"imu.csv:3102", "gap of 1.02 s"}, 1, 62, end);
  imu_saved("gap of 1 h",
            imu("hour",
                [](Rows& rows) {
                  for (std::size_t i = 3100; i < rows.size(); ++i) rows[i][0] += 3600;
                }),
            {"imu.csv:3102", "3600.02 s", "not to be trusted"}, 512, 62, end + 3600);
  imu_saved("duplicated stamps",
            imu("twice", [](Rows& rows) { rows.insert(rows.begin() + 3100, rows[3099]); }),
            {"imu.csv:3102", "two rows with the stamp 62 s"}, 0, 1e9, end);
  imu_saved("reversed stamps", imu("swap", [](Rows& rows) { std::swap(rows[3100], rows[3101]); }),
            {"imu.csv:3103", "time goes back"}, 1, 62, end);
  imu_saved("a stamp far ahead", imu("ahead", [](Rows& rows) { rows[3100][0] = 1e9; }),
            {"imu.csv:3102", "far ahead"}, 1, 62, end);
  imu_saved("NaN of the unit", imu("nan", [](Rows& rows) { rows[3100][2] = std::nan(""); }),
            {"imu.csv:3102", "nan"}, 1, 62, end);
  imu_saved("NaN of the unit", imu("huge", [](Rows& rows) { rows[3100][2] = 1e300; }),
            {"imu.csv:3102"}, 1, 62, end);
  refused("no row of numbers",
          "navigate " +
              imu("nans",
                  [](Rows& rows) {
                    for (auto& r : rows) r[5] = std::nan("");
                  }) +
              " --mode inertial -o " + output(),
          3, {"imu.csv", "no IMU sample"});
  // Stamps of half the rate: the numbers of rates cannot tell, the other channels can.
  const std::string half = imu(
      "half",
      [](Rows& rows) {
        for (auto& r : rows) r[0] *= 0.5;
      },
      kImu +
          "[odometer]\nfile = \"odometer.csv\"\nkind = \"distance\"\ncolumns = { time = \"t_s\", "
          "value = \"ds_m\" }\n");
  put(half + "/odometer.csv", slurp(output("unit_odometer.csv")));
  refused("half-rate stamps", "inspect " + half, 0, {"imu", "odometer", "half"});
}

TEST(BadImu, SaturationIsMarked) {
  const double end = unit().rows.back()[0];
  imu_saved("saturated as declared",
            imu(
                "limit",
                [](Rows& rows) {
                  for (std::size_t i = 3100; i < 3110; ++i) rows[i][4] = 12.0;
                },
                replaced(kImu, "errors", "accel_range = \"12 m/s^2\"\nerrors")),
            {"imu.csv:3102", "declared limit"}, 2, 62, end);
  imu_saved("saturated as seen",
            imu("clipped",
                [](Rows& rows) {
                  for (std::size_t i = 3100; i < 3120; ++i) rows[i][4] = 19.6;
                }),
            {"imu.csv:31", "stands still"}, 2, 62, end);
}

TEST(BadImu, Start) {
  refused("start without alignment data",
          "navigate " + imu("nowhere", {}, kImu, "") + " --mode inertial -o " + output(), 3,
          {"start", "alignment", "state"});
  const std::string pole =
      imu("polar", {}, kImu, replaced(kStart, "lat_deg = 45", "lat_deg = 89.9999"));
  for (const std::string mode : {"inertial", "filter"})
    refused("alignment at the pole", "navigate " + pole + " --mode " + mode + " -o " + output(), 1,
            {"start.alignment", "latitude 89.9999", "attitude"});
  refused("unknown frame",
          "navigate " + imu("frame") + " --mode inertial --frame transvers -o " + output(), 2,
          {"--frame", "'transvers'", "transverse"});
  refused("unknown scenario", "simulate straigth-road -o " + output("never"), 2,
          {"straigth-road", "straight-road"});
  EXPECT_FALSE(fs::exists(output()));
}

// Each test may run in a process of its own: the list is held against this file.
TEST(BadDrive, EveryItemHasItsCase) {
  const std::string text = slurp(std::string(source_folder()) + "/tests/bad_drive_test.cpp");
  const auto end_of_list = text.find("};", text.find("kItems[]"));
  for (const char* item : kItems)
    EXPECT_NE(text.find("\"" + std::string(item) + "\"", end_of_list), std::string::npos) << item;
}

}  // namespace
}  // namespace loxo::testing
