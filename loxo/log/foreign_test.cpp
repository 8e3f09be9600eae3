// SPDX-License-Identifier: Apache-2.0
// Other programs' logs: files of each format, and the real samples against the same data in CSV.
#include "loxo/log/foreign.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "loxo/earth/geodetic.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "shared_folder.hpp"

namespace loxo {
namespace {

namespace fs = std::filesystem;
using Columns = std::vector<std::vector<double>>;

Columns read(const std::string& path, std::vector<std::string> names = {},
             const std::string& table = {}) {
  const auto t = open_table(path, table);
  if (names.empty()) names = t->header();
  t->select(names);
  Columns out(names.size());
  std::vector<double> row(names.size());
  Diagnostics d;
  while (t->next(row, d))
    for (std::size_t i = 0; i < row.size(); ++i) out[i].push_back(row[i]);
  EXPECT_EQ(d.count("bad_row"), 0u);
  return out;
}
double path_length(const std::vector<double>& lat, const std::vector<double>& lon, double unit) {
  double sum = 0;
  for (std::size_t i = 1; i < lat.size(); ++i)
    sum += norm(to_ecef(wgs84(), Geodetic<double>{lat[i] * unit, lon[i] * unit, 0}) -
                to_ecef(wgs84(), Geodetic<double>{lat[i - 1] * unit, lon[i - 1] * unit, 0}));
  return sum;
}

class Format : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = (fs::temp_directory_path() / ("loxo_foreign_" + std::to_string(::getpid()))).string();
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string file(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ + "/" + name, std::ios::binary) << bytes;
    return folder_ + "/" + name;
  }
  // A drive of one section that names the file and nothing else.
  Drive drive(const std::string& section, const std::string& name) const {
    file("drive.toml", "[" + section + "]\nfile = \"" + name + "\"\n");
    return read_drive(folder_);
  }
  static std::string fault(auto&& f) {
    try {
      f();
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }
  std::string folder_;
  Diagnostics d_;
};

TEST_F(Format, KfGinsImuNeedsItsNameOnly) {
  std::string text;
  for (int i = 1; i <= 50; ++i)
    text += std::to_string(100 + 0.005 * i) + "  1e-5 2e-5 -3e-5   0.001 0.002 -0.049\r\n";
  EXPECT_EQ(foreign_format(file("imu.txt", text)), Foreign::kKfGinsImu);
  const Drive d = drive("imu", "imu.txt");
  EXPECT_EQ(d.imu_kind, "increment");
  EXPECT_EQ(d.imu_axes, "FRD");
  ImuReader imu(d, d_);
  ImuIncrement<double> s;
  int n = 0;
  for (; imu.next(s); ++n) {  // right, forward, up
    EXPECT_EQ(s.dtheta.x, 2e-5);
    EXPECT_EQ(s.dtheta.y, 1e-5);
    EXPECT_EQ(s.dtheta.z, 3e-5);
    EXPECT_EQ(s.dv.z, 0.049);
  }
  EXPECT_EQ(n, 50);
  EXPECT_EQ(d_.count("imu_axes") + d_.count("imu_units"), 0u);
}

TEST_F(Format, KfGinsGnssAndNavigation) {
  file("g.txt", "1 30 114 20 0.01 0.02 0.03 \n2 30.1 114 20 0.01 0.02 0.03");
  const auto fixes = read_fixes(drive("fix", "g.txt"), d_);
  ASSERT_EQ(fixes.size(), 2u);  // the last line has no end
  EXPECT_DOUBLE_EQ(fixes[1].lat, 30.1 * deg);
  EXPECT_EQ(fixes[0].std_e, 0.02);
  EXPECT_EQ(fixes[0].std_n, 0.01);
  file("v.txt", "1 30 114 20 0.01 0.02 0.03 1 2 3 0.1 0.1 0.2\n");
  const auto moving = read_fixes(drive("fix", "v.txt"), d_);
  ASSERT_EQ(moving.size(), 1u);
  EXPECT_EQ(moving[0].vn, 1);
  EXPECT_EQ(moving[0].ve, 2);
  EXPECT_EQ(moving[0].vu, -3);  // down in the file
  file("n.txt", "2000 10 30 114 20 1 2 3 0.5 0.6 179\n2000 11 30 114 20 1 2 3 0.5 0.6 179\n");
  const auto ref = read_reference(drive("reference", "n.txt"), d_).rows;
  ASSERT_EQ(ref.size(), 2u);
  EXPECT_EQ(ref[0].vu, -3);
  EXPECT_DOUBLE_EQ(ref[0].heading, 179 * deg);
}

TEST_F(Format, ATextOfNumbersHasColumnsByPlace) {
  const auto c = read(file("x.txt", "# anything\n1 2 3\n4 5 6\n"));
  ASSERT_EQ(c.size(), 3u);
  EXPECT_EQ(c[1], (std::vector<double>{2, 5}));
}

TEST_F(Format, PsinsPulsesBecomeIncrements) {
  file("x.imu",
       "% PSINS-format SIMU log file.\n% more\n\n1 2 -90.6 0 0 0\n34 108 380 5 10 9.8\n"
       "0.1 0.1 0.1 125 125 125\n0 -3 2 0 0 80\n1 0 0 0 0 80\n");
  ImuReader imu(drive("imu", "x.imu"), d_);
  ImuIncrement<double> s;
  ASSERT_TRUE(imu.next(s));
  EXPECT_DOUBLE_EQ(s.t, 5.01);
  EXPECT_DOUBLE_EQ(s.dtheta.y, -0.3 * arcsec);
  EXPECT_DOUBLE_EQ(s.dv.z, 80 * 125e-6 * 9.8);
  ASSERT_TRUE(imu.next(s));
  EXPECT_DOUBLE_EQ(s.t, 5.02);
  EXPECT_EQ(open_table(folder_ + "/x.imu")->meta().at("heading0_deg"), "90.6");
}

// A file as Waypoint describes it, in both byte orders.
TEST_F(Format, Imr) {
  for (const bool motorola : {false, true}) {
    std::string bytes(512, '\0');
    const auto put = [&](std::size_t at, auto x) {
      char raw[sizeof x];
      std::memcpy(raw, &x, sizeof x);
      if (motorola) std::reverse(raw, raw + sizeof x);
      if (bytes.size() < at + sizeof x) bytes.resize(at + sizeof x);
      std::memcpy(&bytes[at], raw, sizeof x);
    };
    std::memcpy(&bytes[0], "$IMURAW", 8);
    bytes[8] = motorola ? 1 : 0;
    put(9, 8.8);
    put(17, std::int32_t{1});
    put(21, std::int32_t{1});
    put(25, 100.0);
    put(33, 1e-6);
    put(41, 2e-6);
    put(57, 0.5);
    std::memcpy(&bytes[65], "HG1700", 6);
    for (std::size_t i = 0; i < 3; ++i) {
      put(512 + 32 * i, 1000 + 0.01 * static_cast<double>(i));
      for (std::size_t k = 0; k < 6; ++k)
        put(512 + 32 * i + 8 + 4 * k, static_cast<std::int32_t>(k == 5 ? 49000 : -10 * (int)k));
    }
    file("x.imr", bytes + "cut");
    ImuReader imu(drive("imu", "x.imr"), d_);
    ImuIncrement<double> s;
    ASSERT_TRUE(imu.next(s));
    EXPECT_DOUBLE_EQ(s.t, 1000.5);
    EXPECT_DOUBLE_EQ(s.dtheta.y, -10e-6 * deg);
    EXPECT_DOUBLE_EQ(s.dv.z, 0.098);
    EXPECT_EQ(open_table(folder_ + "/x.imr")->meta().at("imu"), "HG1700");
    EXPECT_EQ(d_.count("truncated"), 1u);
    d_ = {};
  }
}

TEST_F(Format, Gpx) {
  file("x.gpx",
       "<?xml version='1.0'?>\n<gpx><trk><trkseg>\n<trkpt lat=\"55.5\" lon = '-10.25'><ele>12.5"
       "</ele><time>2014-07-31T23:59:59Z</time></trkpt>\n<trkpt lon=\"-10\" lat=\"56\"><time>"
       "2014-08-01T02:00:00.5+02:00</time></trkpt><trkpt lat=\"56\" lon=\"-10\"/></trkseg></trk>"
       "</gpx>");
  const auto c = read(folder_ + "/x.gpx");
  ASSERT_EQ(c[0].size(), 3u);
  EXPECT_EQ(c[0][1], 1.5);
  EXPECT_TRUE(std::isnan(c[0][2]));
  EXPECT_EQ(c[1][0], 55.5);
  EXPECT_EQ(c[2][0], -10.25);
  EXPECT_EQ(c[3][0], 12.5);
  EXPECT_EQ(read_fixes(drive("fix", "x.gpx"), d_).size(), 2u);
}

TEST_F(Format, GeoJson) {
  file("x.json",
       "{\"type\":\"FeatureCollection\",\"features\":[{\"type\":\"Feature\",\"properties\":"
       "{\"coordTimes\":[\"2020-02-29T00:00:00Z\",\"2020-03-01T00:00:00Z\"]},\"geometry\":"
       "{\"type\":\"LineString\",\"coordinates\":[[10,55,3],[11,56]]}}]}");
  const auto c = read(folder_ + "/x.json");
  ASSERT_EQ(c[0].size(), 2u);
  EXPECT_EQ(c[0][1], 86400.0);  // a leap day
  EXPECT_EQ(c[1][1], 56.0);
  EXPECT_EQ(c[2][1], 11.0);
  EXPECT_NE(fault([&] {
              read(file("y.json", "{\"type\":\"LineString\",\"coordinates\":[[1,\"x\"]]}"));
            }).find("longitude"),
            std::string::npos);
}

TEST_F(Format, Nmea) {
  const std::string path =
      file("x.nmea",
           "$GPGGA,235959.50,5530.000,N,01015.000,W,1,8,1.0,12.5,M,40.0,M,,\r\n"
           "$GPGGA,000000.50,5530.600,S,01015.000,E,1,8,1.0,12.5,M,,M,,\r\n"
           "$GPGGA,000001.50,5530.600,S,01015.000,E,1,8,1.0,12.5,M,,M,,*00\r\n"
           "2014-08-01T00:00:00.316000Z $HEHDT,218.53,T*12\n$GPXXX,1\n");
  EXPECT_EQ(nmea_tables(path), (std::vector<std::string>{"GGA", "HDT"}));
  const auto c = read(path, {}, "GGA");
  ASSERT_EQ(c[0].size(), 2u);  // the third's checksum is wrong
  EXPECT_EQ(c[0][1] - c[0][0], 1.0);
  EXPECT_DOUBLE_EQ(c[1][0], 55.5);
  EXPECT_DOUBLE_EQ(c[2][0], -10.25);
  EXPECT_DOUBLE_EQ(c[1][1], -55.51);
  EXPECT_EQ(c[3][0], 52.5);
  EXPECT_DOUBLE_EQ(read(path, {}, "HDT")[0][0], 0.316);
  const std::string text = fault([&] { open_table(path); });
  EXPECT_NE(text.find("GGA, HDT"), std::string::npos) << text;
  EXPECT_NE(text.find("XXX"), std::string::npos) << text;
}

// What is no format of these stays CSV, with its messages.
TEST_F(Format, OthersAreNot) {
  EXPECT_EQ(foreign_format(file("a.csv", "t_s,x\n1,2\n")), std::nullopt);
  EXPECT_EQ(foreign_format(file("b.csv", "1,2\n3,4\n")), std::nullopt);
  EXPECT_EQ(foreign_format(file("c.csv", "")), std::nullopt);
  EXPECT_EQ(foreign_format(file("d.csv", "t_s x\n1 2\n")), std::nullopt);
  EXPECT_EQ(foreign_format(folder_ + "/none"), std::nullopt);
  EXPECT_EQ(foreign_format(folder_), std::nullopt);
}

// The real samples.
std::string data() { return testing::shared_folder("data"); }
#define LOXO_SAMPLE(path) \
  if (!fs::exists(data() + "/" path)) GTEST_SKIP() << path " is not here (LOXO_DATA)"

void expect_same(const std::vector<double>& a, const std::vector<double>& b, double tolerance,
                 double unit = 1) {
  ASSERT_EQ(a.size(), b.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::fabs(a[i] * unit - b[i]));
  EXPECT_LE(worst, tolerance);
}

TEST(Sample, PsinsLog) {
  LOXO_SAMPLE("static_lasergyro_a/original/lasergyro_part.imu");
  const std::string set = data() + "/static_lasergyro_a/";
  const auto a = read(set + "original/lasergyro_part.imu");
  const auto b = read(set + "imu.csv.gz");
  ASSERT_EQ(a[0].size(), 90000u);
  expect_same(a[6], b[0], 1e-9);
  for (std::size_t k = 0; k < 3; ++k) {
    expect_same(a[k], b[k + 1], 1e-10, 100);       // nine digits of up to 0.02 rad/s are printed
    expect_same(a[k + 3], b[k + 4], 5.1e-7, 100);  // six decimals are printed
  }
}

TEST(Sample, PsinsMatrices) {
  LOXO_SAMPLE("fog_mems_vehicle/original/transfer_align_fog_mems.mat");
  const std::string set = data() + "/fog_mems_vehicle/";
  const std::string mat = set + "original/transfer_align_fog_mems.mat";
  EXPECT_GE(tables_of(mat).size(), 2u);
  const auto imu = read(mat, {}, "mimu"), b = read(set + "imu.csv.gz");
  ASSERT_EQ(imu.size(), 7u);
  expect_same(imu[6], b[0], 1e-6);
  for (std::size_t k = 0; k < 6; ++k) expect_same(imu[k], b[k + 1], 1e-5, 100);
  const auto avp = read(mat, {}, "fogavp");
  EXPECT_EQ(avp.size(), 10u);
  EXPECT_NEAR(path_length(avp[6], avp[7], 1), 1389.43, 3);
  try {
    open_table(mat);
    FAIL() << "two tables, none named";
  } catch (const Error& e) {
    const std::string text = e.what();
    EXPECT_NE(text.find("mimu (10001 rows)"), std::string::npos) << text;
  }
}

TEST(Sample, ApFlight) {
  LOXO_SAMPLE("import_samples/psins/ap_flight.mat");
  const auto c = read(data() + "/import_samples/psins/ap_flight.mat", {"ap_ll_1", "ap_ll_2"});
  ASSERT_EQ(c[0].size(), 6001u);
  EXPECT_NEAR(path_length(c[0], c[1], 1), 76132, 76132 * 2e-3);  // at its height, or at none
}

TEST(Sample, NaveGoStructs) {
  LOXO_SAMPLE("import_samples/navego/ref.mat");
  const std::string folder = data() + "/import_samples/navego/";
  const auto ref = tables_of(folder + "ref.mat");
  ASSERT_FALSE(ref.empty());
  EXPECT_EQ(ref[0], "ref.t");  // a struct with fields of two lengths
  const auto t = open_table(folder + "ref.mat", "ref.lat");
  EXPECT_TRUE(t->has("lat") && t->has("yaw") && t->has("t")) << t->header().size();
  EXPECT_FALSE(tables_of(folder + "ekinox_gnss.mat").empty());
}

TEST(Sample, Plaza) {
  LOXO_SAMPLE("plaza1/original/Plaza1.mat");
  const std::string mat = data() + "/plaza1/original/Plaza1.mat";
  const auto tables = tables_of(mat);
  ASSERT_GE(tables.size(), 2u);
  const auto dr = read(mat, {}, "DR"), csv = read(data() + "/plaza1/odo.csv");
  double a = 0, b = 0;
  for (double x : dr[1]) a += x;
  for (double x : csv[1]) b += x;
  EXPECT_EQ(dr[0].size(), 9657u);
  EXPECT_NEAR(a, b, 1e-4);
}

TEST(Sample, KfGins) {
  LOXO_SAMPLE("import_samples/kfgins/GNSS-RTK.txt");
  const std::string folder = data() + "/import_samples/kfgins/";
  const auto rtk = read(folder + "GNSS-RTK.txt", {"t_s", "lat_deg"});
  EXPECT_EQ(rtk[0].size(), 3413u);
  EXPECT_EQ(rtk[0][0], 456250.0);
  EXPECT_EQ(rtk[1][0], 30.4447858054);
  EXPECT_EQ(read(folder + "GNSS-POSVEL_dataset2.txt", {"vu_mps"})[0].size(), 203u);
  const auto nav = read(folder + "truth_dataset2.nav", {"t_s", "lat_deg", "lon_deg"});
  EXPECT_EQ(nav[0].size(), 3882u);
  EXPECT_EQ(nav[0].front(), 116454.0);
  EXPECT_NEAR(path_length(nav[1], nav[2], deg), 442.9, 0.5);  // steps of centimetres
}

TEST(Sample, Palmer) {
  LOXO_SAMPLE("ship_nbp1406/original/NBP1406_gp02-2014-08-01");
  const std::string set = data() + "/ship_nbp1406/";
  const auto gll = read(set + "original/NBP1406_gp02-2014-08-01", {"lat_deg", "lon_deg"}, "GLL");
  const auto gnss = read(set + "gnss.csv", {"lat_deg", "lon_deg"});
  expect_same(gll[0], gnss[0], 5.1e-8);  // seven decimals are printed
  expect_same(gll[1], gnss[1], 5.1e-8);
  const auto hdt = read(set + "original/NBP1406_gyr1-2014-08-01", {"t_s", "heading_deg"}, "HDT");
  const auto gyro = read(set + "gyrocompass.csv", {"t_s", "heading_deg"});
  ASSERT_EQ(hdt[0].size(), 5000u);
  expect_same(hdt[1], gyro[1], 0);
  const auto gga = read(set + "original/NBP1406_s330-2014-08-01", {"t_s", "lat_deg"}, "GGA");
  EXPECT_EQ(gga[0].size(), 625u);
}

TEST(Sample, VectorNav) {
  LOXO_SAMPLE("import_samples/vectornav/Static_vn310-imu.csv");
  const std::string folder =
      (fs::temp_directory_path() / ("loxo_vn_" + std::to_string(::getpid()))).string();
  fs::create_directories(folder);
  std::ofstream(folder + "/drive.toml")
      << "[imu]\nfile = \"" << data() << "/import_samples/vectornav/Static_vn310-imu.csv\"\n";
  Diagnostics d;
  const Drive drive = read_drive(folder);
  ImuReader imu(drive, d);
  ImuIncrement<double> s;
  std::size_t n = 0;
  double up = 0;
  while (imu.next(s)) ++n, up += s.dv.z / s.dt;
  EXPECT_EQ(n, 690u);
  EXPECT_NEAR(up / 690, 9.77, 0.02);
  EXPECT_NEAR(imu.interval(), 0.05, 1e-6);
  EXPECT_EQ(d.count("imu_axes") + d.count("imu_units"), 0u);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace loxo
