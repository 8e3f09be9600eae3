// SPDX-License-Identifier: Apache-2.0
// What users hand to the joint filter that is wrong: said, with its place, and what can be used is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "loxo/text/csv.hpp"
#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo::testing {
namespace {

namespace fs = std::filesystem;
using Rows = std::vector<std::string>;  // the lines of a file, header first

Rows lines_of(const std::string& path) {
  Rows out;
  std::istringstream in(slurp(path));
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}
std::string cell(const std::string& line, std::size_t i) {
  std::istringstream in(line);
  std::string c;
  for (std::size_t k = 0; k <= i; ++k) std::getline(in, c, ',');
  return c;
}
std::string with_cell(const std::string& line, std::size_t i, const std::string& text) {
  std::istringstream in(line);
  std::string c, out;
  for (std::size_t k = 0; std::getline(in, c, ','); ++k)
    out += (k > 0 ? "," : "") + (k == i ? text : c);
  return out;
}
std::string times(const std::string& line, std::size_t i, double factor) {
  std::string text;
  append_number(text, number(cell(line, i)) * factor);
  return with_cell(line, i, text);
}

// A minute at rest, then three of driving with turns: as the simulator writes it, once.
const std::string& base() {
  static const std::string made = [] {
    const std::string toml = scratch_folder() + "/filter_bad.toml",
                      path = scratch_folder() + "/filter_bad";
    std::ofstream(toml)
        << "format = 1\nabout = \"bad\"\n[start]\nlat_deg = 50\nlon_deg = 10\ncourse = \"30 deg\"\n"
           "[[leg]]\nduration = \"60 s\"\nspeed = \"0 m/s\"\n[[leg]]\nduration = \"12 s\"\n"
           "speed = \"12 m/s\"\n[[leg]]\nduration = \"12 s\"\nturn = \"70 deg\"\n[[leg]]\nduration "
           "= \"20 s\"\nspeed = \"5 m/s\"\n[[leg]]\nduration = \"14 s\"\nturn = \"-85 deg\"\n"
           "[[leg]]\nduration = \"20 s\"\nspeed = \"14 m/s\"\n[[leg]]\nduration = \"42 s\"\n[imu]\n"
           "rate = \"50 Hz\"\nkind = \"rate\"\ngyro_bias = \"0.01 deg/h\"\ngyro_noise = \"0.002 "
           "deg/sqrt(h)\"\naccel_bias = \"20 ug\"\naccel_noise = \"10 ug/sqrt(Hz)\"\n[odometer]\n"
           "k = 1.02\n[fix]\nrate = \"1 Hz\"\nposition = \"2 m\"\n";
    const Outcome o = run("simulate " + toml + " -o " + path);
    EXPECT_EQ(o.exit_code, 0) << o.err;
    return path;
  }();
  return made;
}
using Spoil = std::function<void(Rows&)>;
struct Drive {
  std::string path;
  explicit Drive(const std::string& name) : path(scratch_folder() + "/filter_bad_" + name) {
    fs::remove_all(path);
    fs::copy(base(), path);
  }
  Drive& spoil(const std::string& file, const Spoil& how) {
    Rows rows = lines_of(path + "/" + file);
    how(rows);
    std::ofstream out(path + "/" + file);
    for (const auto& r : rows) out << r << '\n';
    return *this;
  }
  Drive& toml(const std::string& from, const std::string& to) {
    std::string text = slurp(path + "/drive.toml");
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
    std::ofstream(path + "/drive.toml") << text;
    return *this;
  }
};
Spoil each(const std::function<std::string(const std::string&)>& f) {
  return [f](Rows& rows) {
    for (std::size_t i = 1; i < rows.size(); ++i) rows[i] = f(rows[i]);
  };
}
// Every row by the program: no number missing, exit code and words as wanted. The last row.
std::string navigated(const Drive& d, int code, const std::vector<std::string>& words,
                      const std::string& options = "--mode filter") {
  SCOPED_TRACE(d.path + " " + options);
  const std::string out = d.path + "/solution.csv";
  std::ofstream(out) << "an older solution\n";
  const Outcome o = run("navigate " + d.path + " " + options + " -o " + out);
  EXPECT_EQ(o.exit_code, code) << o.err.substr(0, 600);
  for (const auto& w : words)
    EXPECT_NE(o.err.find(w), std::string::npos) << "'" << w << "' in: " << o.err.substr(0, 900);
  const std::string text = slurp(out);
  if (code == 3 || code == 2) {
    EXPECT_EQ(text, "an older solution\n");
    return "";
  }
  const auto table = columns(text);
  if (!table.contains("lat_deg")) return "";
  for (const char* name : {"lat_deg", "std_e_m", "std_n_m", "heading_deg"})
    for (const auto& x : table.at(name)) EXPECT_TRUE(std::isfinite(number(x))) << name;
  return text.substr(text.rfind('\n', text.size() - 2) + 1);
}

TEST(FilterBadInput, RowsOutOfOrderAreSortedAndSaid) {
  const std::string clean = navigated(Drive("clean"), 0, {});
  const auto shuffle = [](Rows& rows) {
    std::mt19937_64 g(3);
    std::shuffle(rows.begin() + 1, rows.end(), g);
  };
  EXPECT_EQ(navigated(Drive("order_fix").spoil("fix.csv", shuffle), 0,
                      {"fix.csv:", "time goes back in", "sorted by time"}),
            clean);
  EXPECT_EQ(navigated(Drive("order_odometer").spoil("odometer.csv", shuffle), 0,
                      {"odometer.csv:", "time goes back in", "sorted by time"}),
            clean);
  const auto twice = [](Rows& rows) { rows.insert(rows.begin() + 9, {rows[5], rows[8]}); };
  EXPECT_EQ(navigated(Drive("order_twice").spoil("fix.csv", twice), 0,
                      {"two rows with the stamp 4 s", "sorted by time"}),
            clean);
}
TEST(FilterBadInput, SigmasOfFixes) {
  const std::string errors = "errors = { position = \"2 m\" }", key = "key fix.errors.position";
  const auto declared = [&](const std::string& name, const std::string& value) {
    return Drive("sigma_" + name).toml(errors, "errors = { position = \"" + value + "\" }");
  };
  navigated(declared("zero", "0 m"), 3, {"drive.toml:", key, "positive", "found 0"});
  navigated(declared("negative", "-2 m"), 3, {"drive.toml:", key, "negative"});
  navigated(declared("nan", "nan m"), 3, {"drive.toml:", key, "not a number"});
  navigated(declared("huge", "1e300 m"), 3, {"drive.toml:", key, "1e8", "1e+300"});
  navigated(declared("bare", "2"), 3, {"drive.toml:", key, "no unit"});
  navigated(declared("wrong", "2 s"), 3, {"drive.toml:", key, "a time"});
  navigated(declared("tiny", "1e-9 m"), 0, {"fix", "sigma is too small"});
  const auto column = [&](const std::string& name, const std::string& value) {
    return Drive("column_" + name)
        .toml("vu = \"vu_mps\" }\nerrors",
              "vu = \"vu_mps\", std_e = \"se_m\", std_n = \"sn_m\", std_u = \"su_m\" }\nerrors")
        .spoil("fix.csv", [&](Rows& rows) {
          rows[0] += ",se_m,sn_m,su_m";
          for (std::size_t i = 1; i < rows.size(); ++i)
            for (int k = 0; k < 3; ++k) rows[i] += i == 80 ? "," + value : ",2";
        });
  };
  navigated(column("negative", "-1"), 3, {"fix.csv:81", "standard deviation", "-1"});
  for (const char* none : {"0", "nan", ""})
    navigated(column("none", none), 0, {"1 fixes carry no standard deviation", "2 m is taken"});
  navigated(column("infinite", "inf"), 0, {"fix.csv:81", "found 'inf'", "row skipped"});
}
TEST(FilterBadInput, PositionsThatCannotBe) {
  navigated(Drive("swapped").spoil("fix.csv", each([](const std::string& r) {
                                     return with_cell(with_cell(r, 1, cell(r, 2)), 2, cell(r, 1));
                                   })),
            3, {"drive.toml:", "fix.columns", "latitude and longitude exchanged"});
  navigated(Drive("beyond").spoil("fix.csv", [](Rows& r) { r[90] = with_cell(r[90], 1, "100"); }),
            0, {"fix.csv:91", "latitude beyond 90"});
  navigated(Drive("null_island")
                .spoil("fix.csv",
                       [](Rows& r) {
                         for (std::size_t i = 100; i < 140; ++i)
                           r[i] = with_cell(with_cell(r[i], 1, "0"), 2, "0");
                       }),
            0, {"40 fixes outside the gate"});
  navigated(Drive("velocities").spoil("fix.csv", each([](const std::string& r) {
                                        return with_cell(with_cell(r, 4, cell(r, 5)), 5,
                                                         cell(r, 4));
                                      })),
            0, {"fix_velocity", "contradict the rest"});
}
TEST(FilterBadInput, StampsOfAnotherClock) {
  const auto shifted = [](double factor, double by) {
    return each([=](const std::string& r) {
      std::string t;
      append_number(t, number(cell(r, 0)) * factor + by);
      return with_cell(r, 0, t);
    });
  };
  navigated(Drive("milliseconds").spoil("fix.csv", shifted(1000, 0)), 0,
            {"fix", "lie outside the time of the IMU", "unit or origin"});
  navigated(Drive("epoch").spoil("odometer.csv", shifted(1, 1e9)), 0,
            {"odometer", "lie outside the time of the IMU"});
  navigated(Drive("late").spoil("fix.csv", shifted(1, 3)), 0,
            {"fit only with another stamp", "s late", "fix.delay"});
  navigated(Drive("after").toml("[start]",
                                "[[benchmark]]\nname = \"Z\"\nt_s = 1500\nlat_deg = 50\nlon_deg = "
                                "10\nh_m = 0\nstd = \"0.1 m\"\n[start]"),
            0, {"benchmark Z", "1500 s lies outside the drive"});
  navigated(Drive("far").toml("[start]",
                              "[[benchmark]]\nname = \"Q\"\nt_s = 120\nlat_deg = 50.1\nlon_deg = "
                              "10\nh_m = 0\nstd = \"0.1 m\"\n[start]"),
            0, {"benchmark Q", "far from the track", "120.0 s"});
}
TEST(FilterBadInput, UnitsOfTheWheelAreFoundFromTheImu) {
  for (const auto& [factor, text] : {std::pair<double, const char*>{3.6, "km/h read as m/s"},
                                     {100, "cm read as m"},
                                     {2.23694, "mph read as m/s"},
                                     {3.28084, "ft read as m"},
                                     {0.001, "km read as m"},
                                     {10.0, "a speed declared as a distance"}}) {
    const Drive d = Drive("unit").spoil(
        "odometer.csv", each([f = factor](const std::string& r) { return times(r, 1, f); }));
    navigated(d, 0, {"odometer.units", text});
  }
  navigated(Drive("backward").spoil("odometer.csv", each([](const std::string& r) {
                                      return times(r, 1, -1);
                                    })),
            0, {"odometer.mounting", "the wheel counts backward"});
}
TEST(FilterBadInput, SectionsWithoutARow) {
  const auto header = [](Rows& rows) { rows.resize(1); };
  navigated(Drive("no_odometer").spoil("odometer.csv", header), 0,
            {"odometer", "no reading that could be used"});
  navigated(Drive("no_fix").spoil("fix.csv", header), 0, {"fix", "no reading that could be used"});
  navigated(Drive("no_imu").spoil("imu.csv", header), 3, {"imu.csv", "no IMU sample"});
  for (const char* mode : {"filter", "smooth"})
    navigated(Drive("one").spoil("imu.csv", [](Rows& rows) { rows.resize(2); }), 0,
              {"the drive moves 0.0 m"}, std::string("--mode ") + mode);
  Drive one("one_segmented");
  one.spoil("imu.csv", [](Rows& rows) { rows.resize(2); });
  navigated(one, 1, {"before the first second", "no row"}, "--mode segmented");
  EXPECT_EQ(slurp(one.path + "/solution.csv"), "an older solution\n");
}
// The method `online`: alone it needs neither track nor benchmarks, and says why it cannot.
TEST(FilterBadInput, CalibrateOnline) {
  const Outcome o = run("calibrate " + base() + " --method online --json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const Json j = parse_json(o.out, "calibrate");
  const Json& m = j["methods"]["online"];
  EXPECT_EQ(j["recommended"], "online");
  EXPECT_NEAR(static_cast<double>(m["k"]), 1.02, 4 * static_cast<double>(m["k_std"]));
  EXPECT_NEAR(static_cast<double>(m["eps_deg"]), 0, 4 * static_cast<double>(m["eps_std_deg"]));
  Drive parked("parked");
  parked.spoil("imu.csv", [](Rows& rows) { rows.resize(2900); });
  const Outcome p = run("calibrate " + parked.path + " --method online");
  EXPECT_EQ(p.exit_code, 1);
  EXPECT_NE((p.err + p.out).find("does not show"), std::string::npos) << p.err << p.out;
  // With a track and benchmarks: beside the others.
  const std::string toml = scratch_folder() + "/online.toml", both = scratch_folder() + "/online";
  std::ofstream(toml) << slurp(scratch_folder() + "/filter_bad.toml")
                      << "[[benchmark]]\nname = \"A\"\nat = \"start\"\nstd = \"0.05 m\"\n"
                         "[[benchmark]]\nname = \"B\"\nat = \"end\"\nstd = \"0.05 m\"\n"
                         "[attitude]\nrate = \"10 Hz\"\n";
  ASSERT_EQ(run("simulate " + toml + " -o " + both).exit_code, 0);
  const Outcome b = run("calibrate " + both + " --json");
  ASSERT_EQ(b.exit_code, 0) << b.err;
  const Json side = parse_json(b.out, "calibrate");
  EXPECT_EQ(side["recommended"], "replay");
  const Json &replay = side["methods"]["replay"], &online = side["methods"]["online"];
  EXPECT_TRUE(static_cast<bool>(online["valid"])) << online["why"];
  EXPECT_NEAR(static_cast<double>(online["k"]), static_cast<double>(replay["k"]),
              4 * static_cast<double>(online["k_std"]));
}
// The smoother's spool: without a name, so that nothing stays behind; where it cannot be, said.
TEST(FilterBadInput, TheSmoothersDisk) {
  const Drive d("disk");
  const std::string out = d.path + "/solution.csv", err = d.path + "/err",
                    command = std::string(program()) + " navigate " + d.path +
                              " --mode smooth -o " + out + " >/dev/null 2>" + err;
  const auto code = [](const std::string& shell) {
    const int status = std::system(shell.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  };
  // A full disk, as a limit of a file's size is seen: 1 MB of some 20.
  EXPECT_EQ(code("trap '' XFSZ; ulimit -f 2000; " + command), 1);
  EXPECT_NE(slurp(err).find("disk full?"), std::string::npos) << slurp(err);
  EXPECT_NE(slurp(err).find("TMPDIR"), std::string::npos) << slurp(err);
  EXPECT_FALSE(fs::exists(out));
  EXPECT_EQ(code("TMPDIR=" + d.path + "/none " + command), 1);
  EXPECT_NE(slurp(err).find("none"), std::string::npos) << slurp(err);
  const std::string here = d.path + "/here";
  fs::create_directories(here);
  EXPECT_EQ(code("TMPDIR=" + here + " " + command), 0);
  EXPECT_TRUE(fs::exists(out));
  EXPECT_TRUE(fs::is_empty(here));
  code("TMPDIR=" + here + " timeout -s KILL 0.05 " + command);  // killed on the way
  EXPECT_TRUE(fs::is_empty(here));
}
// Without what makes a track the filter's method still stands, and the others say what they miss.
TEST(FilterBadInput, OnlineStandsWhereNoTrackCanBeMade) {
  Drive d("no_track");
  d.spoil("drive.toml", [](Rows& rows) {
    bool attitude = false;
    for (std::string& line : rows) {
      if (line.starts_with('[')) attitude = line == "[attitude]";
      if (attitude) line.clear();
    }
  });
  const Outcome o = run("calibrate " + d.path + " --json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const Json j = parse_json(o.out, "calibrate");
  EXPECT_EQ(j["recommended"], "online");
  EXPECT_TRUE(static_cast<bool>(j["methods"]["online"]["valid"]));
  const Json& replay = j["methods"]["replay"];
  EXPECT_FALSE(static_cast<bool>(replay["valid"]));
  EXPECT_NE(replay["why"].get<std::string>().find("[attitude]"), std::string::npos) << replay;
}
// A wheel that is read twice a second has a clock of its own (estimation.md 1.3): its delay is
// found. It is told whole, declared part and found part, as scale and mounting are: of a wheel that
// is late by 0.4 s it is the same number whether that is declared or not.
TEST(FilterBadInput, ADeclaredDelayIsPartOfTheDelayTold) {
  const std::string path = scratch_folder() + "/late_wheel";
  const std::string set = " --set 'odometer.rate=\"2 Hz\"' --set 'odometer.delay=\"0.4 s\"'";
  ASSERT_EQ(run("simulate mixed --quiet --seed 4 -o " + path + set).exit_code, 0);
  for (const char* declared : {"0.4 s", "0.1 s", "0 s"}) {
    const Outcome o = run("navigate " + path + " --mode filter --json --set 'odometer.delay=\"" +
                          declared + "\"'");
    ASSERT_EQ(o.exit_code, 0) << o.err;
    const Json j = parse_json(o.out, "navigate");
    const Json &c = j["constants"], &last = j["history"].back();
    EXPECT_NEAR(static_cast<double>(c["delay_s"]), 0.4, 4 * static_cast<double>(c["delay_s_std"]))
        << declared;
    EXPECT_NEAR(static_cast<double>(last["delay_s"]), 0.4,
                4 * static_cast<double>(last["delay_std_s"]))
        << declared;
  }
}
TEST(FilterBadInput, AStartAfterTheLastSample) {
  const Outcome o = run("navigate " + base() + " --mode filter --set start.state.t_s=5000.0");
  EXPECT_EQ(o.exit_code, 3) << o.err;
  EXPECT_NE(o.err.find("no IMU sample after the start at t = 5000"), std::string::npos) << o.err;
}
// -o -: the rows are the standard output, and nothing beside them; their stamps are multiples of
// the period to the last digit.
TEST(FilterBadInput, RowsOnStandardOutput) {
  for (const char* mode : {"filter", "smooth", "segmented", "inertial"}) {
    const Outcome o = run("navigate " + base() + " --output-rate 10Hz -o - --mode " + mode);
    ASSERT_EQ(o.exit_code, 0) << o.err;
    std::istringstream in(o.out);
    std::string line, last;
    long rows = 0, first = 0;
    while (std::getline(in, line)) {
      if (line.starts_with('#') || line.starts_with("t_s")) continue;
      const double tenths = 10 * number(cell(line, 0));
      if (rows == 0) first = std::lround(tenths);
      if (rows > 0) {  // the start's own row stands where the first sample begins
        EXPECT_EQ(number(cell(line, 0)), static_cast<double>(first + rows) / 10) << mode << line;
      }
      ++rows;
    }
    EXPECT_GT(rows, 1000) << mode;
    EXPECT_EQ(run(std::string("navigate ") + base() + " --json -o - --mode " + mode).exit_code, 2);
  }
}
TEST(FilterBadInput, NoTimeBetweenFixes) {
  for (const char* time : {"0s", "-3s"}) {
    const Outcome o = run("navigate " + base() + " --mode filter --fix-every=" + time);
    EXPECT_EQ(o.exit_code, 2) << o.err;
    EXPECT_NE(o.err.find("--fix-every: the time between two fixes must be positive"),
              std::string::npos)
        << o.err;
  }
}
// A long gap: said in the rows of every mode, and the fixes give the heading back.
TEST(FilterBadInput, AGapOfHalfAMinute) {
  const auto gap = [](Rows& rows) { rows.erase(rows.begin() + 3700, rows.begin() + 5200); };
  constexpr std::uint32_t kGap = 1, kUncovered = 512;
  for (const char* options :
       {"--mode filter", "--mode smooth", "--mode filter --no-fixes", "--mode segmented"}) {
    const Drive d = Drive("gap").spoil("imu.csv", gap);
    navigated(d, 0, {"gap of 30.02 s"}, options);
    const auto rows = columns(slurp(d.path + "/solution.csv"));
    std::uint32_t in = 0, last = 0;
    for (std::size_t i = 0; i < rows.at("t_s").size(); ++i) {
      const auto health = static_cast<std::uint32_t>(number(rows.at("health")[i]));
      const double t = number(rows.at("t_s")[i]);
      if (t < 73.9) {
        EXPECT_EQ(health & (kGap | kUncovered), 0u) << options << t;
      }
      if (t > 74 && t < 104.5) in |= health;
      // The heading may have turned by anything up to 0.03 rad/s, and the rows between two samples
      // say so as well: above the 0.05 rad from which it is lost, until the first fixes after.
      if (t > 74 && t < 104.5 && std::string(options).find("filter") != std::string::npos) {
        EXPECT_GT(number(rows.at("std_heading_deg")[i]), 0.05 * 57.3) << options << t;
        EXPECT_TRUE(health & kUncovered) << options << t;
      }
      last = health;
    }
    EXPECT_TRUE(in & (kGap | kUncovered)) << options;
    const bool fixes = std::string(options).find("--no") == std::string::npos &&
                       std::string(options).find("segmented") == std::string::npos;
    EXPECT_EQ((last & kUncovered) != 0, !fixes) << options;
    if (!fixes) continue;
    const Outcome o = run("evaluate " + d.path + "/solution.csv --truth " + d.path + " --json");
    EXPECT_LT(static_cast<double>(parse_json(o.out, "evaluate")["horizontal_end_m"]), 5.0);
  }
}

}  // namespace
}  // namespace loxo::testing
