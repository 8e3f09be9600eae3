// SPDX-License-Identifier: Apache-2.0
// Faults of drives, each told with its place; and the real recordings, with the numbers that their
// own descriptions say a correct loader reproduces.
#include "loxo/log/drive.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

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
TEST_F(DriveFault, MissingFile) {
  expect_words(fault("t_s,v_mps\n0,1\n",
                     "[odometer]\nfile = \"none.csv\"\nkind = \"speed\"\n"
                     "columns = { time = \"t_s\", value = \"v_mps\" }\n"),
               {"none.csv", "drive.toml"});
}
TEST_F(DriveFault, EmptyFile) { expect_words(fault(""), {"odo.csv"}); }
TEST_F(DriveFault, BinaryFile) {
  expect_words(fault(std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0", 20)), {"odo.csv"});
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
TEST_F(DriveFault, TimeBackAndDuplicatesAreToldAndSkipped) {
  const auto t = ticks("t_s,v_mps\n0,1\n1,2\n1,3\n0.5,4\n2,5\n");
  ASSERT_EQ(t.size(), 3u);
  EXPECT_EQ(t[2].value, 5.0);
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

// The real recordings.
std::string recording(const std::string& set) {
  const std::string data = testing::shared_folder("data");
  return data.empty() || !fs::exists(data + "/" + set) ? "" : data;
}
#define LOXO_RECORDING(set)                                                                    \
  if (recording(set).empty()) GTEST_SKIP() << "the recording " set " is not here (LOXO_DATA)"; \
  Diagnostics d;                                                                               \
  const Drive drive = read_drive(std::string(testing::source_folder()) + "/examples/drives/" set)

// Sum of horizontal steps on the ellipsoid.
double path(const std::vector<SolutionRow>& rows) {
  double sum = 0;
  for (std::size_t i = 1; i < rows.size(); ++i)
    sum += norm(to_ecef(wgs84(), Geodetic<double>{rows[i].lat, rows[i].lon, rows[i].h}) -
                to_ecef(wgs84(), Geodetic<double>{rows[i - 1].lat, rows[i - 1].lon, rows[i].h}));
  return sum;
}
// The printed lengths come from a local plane: radii of curvature of one latitude agree to about
// 1e-4.
constexpr double kPlane = 2e-4;

double linear(const std::vector<OdometerTick>& v, double t) {
  auto it = std::lower_bound(v.begin(), v.end(), t,
                             [](const OdometerTick& a, double x) { return a.t < x; });
  if (it == v.begin()) return v.front().value;
  if (it == v.end()) return v.back().value;
  const auto& a = *(it - 1);
  return a.value + (it->value - a.value) * (t - a.t) / (it->t - a.t);
}

TEST(Recording, Kingston) {
  LOXO_RECORDING("kingston2008_a");
  const Solution ref = read_reference(drive, d);
  const auto odo = read_odometer(drive, d);
  EXPECT_NEAR(path(ref.rows), 8698.5, 8698.5 * kPlane);
  double v = 0, o = 0, force = 0;
  for (const auto& r : ref.rows) {
    const double speed = std::hypot(r.ve, r.vn, r.vu);
    if (speed > 3) v += speed, o += linear(odo, r.t - 0.2);
  }
  EXPECT_NEAR(v / o, 1.01243, 2e-4);
  ImuReader imu(drive, d);
  ImuIncrement<double> s;
  std::size_t n = 0, still = 0;
  while (imu.next(s)) {
    ++n;
    const auto i = static_cast<std::size_t>(std::max(0.0, std::round(s.t)));
    if (i >= ref.rows.size()) continue;
    const auto& r = ref.rows[i];
    if (std::hypot(r.ve, r.vn, r.vu) < 0.03) force += norm(s.dv) / s.dt, ++still;
  }
  EXPECT_EQ(n, 17440u);
  EXPECT_NEAR(force / static_cast<double>(still), 9.8053, 5e-4);
}

TEST(Recording, Plaza) {
  LOXO_RECORDING("plaza1");
  const auto track = read_track(drive, d);
  ASSERT_EQ(track.size(), 9657u);
  double sum = 0, e = 0, n = 0, heading = drive.start.heading;
  for (const auto& s : track) {
    sum += s.ds;
    heading += 2 * (s.heading - heading);  // a step's heading is its middle's
    e += s.ds * std::sin(heading);
    n += s.ds * std::cos(heading);
  }
  EXPECT_NEAR(sum, 1861.2781, 5e-5);
  const Solution ref = read_reference(drive, d);
  const auto& last = ref.rows.back();
  const auto& first = ref.rows.front();
  const double sl = std::sin(first.lat);
  const double de =
      e - (last.lon - first.lon) * prime_vertical_radius(wgs84(), sl) * std::cos(first.lat);
  const double dn = n - (last.lat - first.lat) * meridian_radius(wgs84(), sl);
  EXPECT_NEAR(std::hypot(de, dn), 4.50, 0.02);
}

TEST(Recording, Comma2k19) {
  LOXO_RECORDING("comma2k19_seg40");
  ImuReader imu(drive, d);
  ImuIncrement<double> s;
  std::size_t n = 0;
  double force = 0;
  while (imu.next(s)) ++n, force += norm(s.dv) / s.dt;
  EXPECT_EQ(n, 6256u);
  EXPECT_NEAR(force / 6256, 9.7282, 5e-5);
  EXPECT_EQ(read_odometer(drive, d).size(), 4974u);
  const Solution ref = read_reference(drive, d);
  EXPECT_EQ(ref.rows.size(), 1200u);
  EXPECT_NEAR(path(ref.rows), 1011.25, 1011.25 * 5e-4);
}

TEST(Recording, WheelIns) {
  LOXO_RECORDING("wheelins_car");
  const auto odo = read_odometer(drive, d);
  ASSERT_EQ(odo.size(), 5210u);
  double sum = 0;
  for (const auto& o : odo) sum += 0.5 * std::fabs(o.value);
  EXPECT_NEAR(sum, 12236.51, 5e-3);
  const Solution ref = read_reference(drive, d);
  EXPECT_EQ(ref.rows.size(), 2704u);
  EXPECT_NEAR(path(ref.rows), 12198.10, 12198.10 * kPlane);
}

TEST(Recording, Obd) {
  LOXO_RECORDING("obd_k19_1");
  const auto odo = read_odometer(drive, d);
  EXPECT_EQ(odo.size(), 35400u);
  EXPECT_EQ(read_reference(drive, d).rows.size(), 12517u);
}

TEST(Recording, EveryExampleReads) {
  for (const auto& entry :
       fs::directory_iterator(std::string(testing::source_folder()) + "/examples/drives")) {
    if (!fs::exists(entry.path() / "drive.toml")) continue;
    if (recording(entry.path().filename().string()).empty())
      GTEST_SKIP() << "the recordings are not here (LOXO_DATA)";
    SCOPED_TRACE(entry.path().string());
    Diagnostics d;
    ASSERT_NO_THROW({
      const Drive drive = read_drive(entry.path().string());
      if (drive.odometer.present) {
        EXPECT_GT(read_odometer(drive, d).size(), 0u);
      }
      if (drive.attitude.present) {
        EXPECT_GT(read_attitude(drive, d).size(), 0u);
      }
      if (drive.track.present) {
        EXPECT_GT(read_track(drive, d).size(), 0u);
      }
      if (drive.fix.present) {
        EXPECT_GT(read_fixes(drive, d).size(), 0u);
      }
      if (drive.velocity.present) {
        EXPECT_GT(read_velocities(drive, d).size(), 0u);
      }
      if (drive.heading.present) {
        EXPECT_GT(read_heading_log(drive, d).size(), 0u);
      }
      if (drive.reference.present) {
        EXPECT_GT(read_reference(drive, d).rows.size(), 0u);
      }
      if (drive.imu.present) {
        ImuReader imu(drive, d);
        ImuIncrement<double> s;
        EXPECT_TRUE(imu.next(s));
      }
    });
    EXPECT_EQ(d.count("bad_row"), 0u);
    EXPECT_EQ(d.count("imu_units") + d.count("imu_axes"), 0u);
  }
}

}  // namespace
}  // namespace loxo
