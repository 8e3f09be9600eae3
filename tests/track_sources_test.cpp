// SPDX-License-Identifier: Apache-2.0
// Tracks made of other instruments than a wheel and an INS: Doppler log, yaw gyro, steering, path.
// Closed forms on small drives, as a user runs them.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/num/units.hpp"
#include "program.hpp"

namespace loxo::testing {
namespace {

// Text holds degrees to the last bit; the meridian arc promises 2e-8 m.
constexpr double kClosedForm = 3e-8;
const std::string kStart = "[start]\nt_s = 0\nlat_deg = 55.0\nlon_deg = 110.0\n";

std::string make_drive(const std::string& name, const std::string& sections,
                       const std::map<std::string, std::string>& files) {
  const std::string folder = scratch_folder() + "/" + name;
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/drive.toml") << "format = 1\nname = \"" << name << "\"\n" << sections;
  for (const auto& [file, text] : files) std::ofstream(folder + "/" + file) << text;
  return folder;
}

// One row a second, 0 … n, of `tail` behind the time.
std::string every_second(const std::string& header, int n, const std::string& tail) {
  std::ostringstream s;
  s << header << '\n';
  for (int i = 0; i <= n; ++i) s << i << ',' << tail << '\n';
  return s.str();
}

std::map<std::string, std::vector<std::string>> reckon(const std::string& drive,
                                                       const std::string& options = "") {
  const Outcome o = run("navigate " + drive + " --mode reckon " + options);
  EXPECT_EQ(o.exit_code, 0) << o.err;
  return columns(o.out);
}
double last(const std::map<std::string, std::vector<std::string>>& t, const char* column) {
  return number(t.at(column).back());
}
double from_end(const std::map<std::string, std::vector<std::string>>& t, double lat, double lon) {
  return norm(
      to_ecef(wgs84(), Geodetic<double>{last(t, "lat_deg") * deg, last(t, "lon_deg") * deg, 0.0}) -
      to_ecef(wgs84(), Geodetic<double>{lat, lon, 0.0}));
}

const std::string kOdometer =
    "[odometer]\nfile = \"odo.csv\"\nkind = \"speed\"\ncolumns = { time = \"t_s\", value = "
    "\"v_mps\" }\n";

TEST(TrackSources, ADopplerLogDriftsAndClimbs) {
  // 2 m/s ahead and to the right at 10 deg of drift, bow 30 deg up: the level way is shorter ahead.
  const double ahead = 2 * std::cos(10 * deg), right = 2 * std::sin(10 * deg), pitch = 30 * deg;
  std::ostringstream v;
  v.precision(17);
  v << right << ',' << ahead << ",0";
  const std::string drive = make_drive(
      "doppler",
      kStart +
          "[velocity]\nfile = \"dvl.csv\"\ncolumns = { time = \"t_s\", right = \"r_mps\", forward "
          "= \"f_mps\", up = \"u_mps\" }\n[attitude]\nfile = \"att.csv\"\ncolumns = { time = "
          "\"t_s\", heading = \"heading_deg\", pitch = \"pitch_deg\", roll = \"roll_deg\" }\n",
      {{"dvl.csv", every_second("t_s,r_mps,f_mps,u_mps", 100, v.str())},
       {"att.csv", every_second("t_s,heading_deg,pitch_deg,roll_deg", 100, "40,30,0")}});
  const auto t = reckon(drive);
  const double north = 100 * ahead * std::cos(pitch), east = 100 * right;
  // Reduced to the ellipsoid by the mean height of each step: 100 m of climb in 6.4e6 m of radius.
  const auto end = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 40 * deg + std::atan2(east, north),
                                std::hypot(east, north));
  EXPECT_LT(from_end(t, end.lat, end.lon), 200 * 100 / 6.3e6);
  EXPECT_NEAR(last(t, "h_m"), 100 * ahead * std::sin(pitch), 1e-9);
  EXPECT_NEAR(last(t, "heading_deg"), 40.0, 1e-9);  // the body's, not the way's
}

TEST(TrackSources, AYawGyroDrivesACircle) {
  // 10 m/s at 6 deg/s, counted counter-clockwise: round after 60 s. On the equator a circle of 95 m
  // closes to r^3/a^2.
  const std::string drive = make_drive(
      "gyro",
      "[start]\nt_s = 0\nlat_deg = 0\nlon_deg = 110\nattitude = { heading = \"20 deg\" }\n" +
          kOdometer +
          "[heading]\nfile = \"gyro.csv\"\ncolumns = { time = \"t_s\", rate = \"w_dps\" }\nunits = "
          "{ rate = \"-1 deg/s\" }\n",
      {{"odo.csv", every_second("t_s,v_mps", 60, "10")},
       {"gyro.csv", every_second("t_s,w_dps", 60, "-6")}});
  const auto t = reckon(drive);
  EXPECT_LT(from_end(t, 0, 110 * deg), 1e-6);
  // Half way round: the diameter of the polygon, ahead and to the right of the start.
  const double diameter = 10 / std::sin(3 * deg);
  const double lat = number(t.at("lat_deg")[300]) * deg, lon = number(t.at("lon_deg")[300]) * deg;
  const double a = 6378137.0, m = a * (1 - 0.00669437999014);
  EXPECT_NEAR(std::hypot(lat * m, (lon - 110 * deg) * a), diameter, 1e-4);
  EXPECT_NEAR(std::atan2((lon - 110 * deg) * a, lat * m) / deg, 20 + 90, 1e-4);
}

TEST(TrackSources, SteeringTurnsTheCarAndTheOuterWheelRunsFaster) {
  // A left wheel in a right turn: v = v_centre (1 + tan(steering) 0.76/2.83).
  const double turn = std::tan(10 * deg) / 2.83, centre = 2 * kPi / (60 * turn);
  std::ostringstream v;
  v.precision(17);
  v << centre * (1 + 0.76 * turn) << ",-9";  // shows 1 deg straight ahead, counted to the left
  const std::string drive = make_drive(
      "steering",
      "[start]\nt_s = 0\nlat_deg = 0\nlon_deg = 110\n[odometer]\nfile = \"odo.csv\"\nkind = "
      "\"speed\"\ncolumns = { time = \"t_s\", value = \"v_mps\", steering = \"s_deg\" }\nunits = { "
      "steering = \"-1 deg\" }\nwheel_base = \"2.83 m\"\nsteering_offset = \"-1 deg\"\nlever_arm = "
      "\"-0.76 0 0 m\"\n",
      {{"odo.csv", every_second("t_s,v_mps,s_deg", 60, v.str())}});
  const auto t = reckon(drive);
  EXPECT_LT(from_end(t, 0, 110 * deg), 1e-6);
  EXPECT_NEAR(number(t.at("vn_mps")[0]), centre * std::cos(3 * deg), 1e-9);
  const Outcome o = run("navigate " + drive + " --mode reckon --set odometer.wheel_base='0 m'");
  EXPECT_EQ(o.exit_code, 3);
  EXPECT_NE(o.err.find("wheel_base"), std::string::npos) << o.err;
}

TEST(TrackSources, ThePathGivesTheCourseAndTheWheelTheDistance) {
  // Reversing is motion too: the course of a path is that of the motion.
  std::ostringstream path;
  path.precision(17);
  path << "t_s,lat_deg,lon_deg\n";
  for (int i = -1; i <= 101; ++i) {
    const auto p = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 70 * deg, 3.0 * i);
    path << i << ',' << p.lat / deg << ',' << p.lon / deg << '\n';
  }
  const std::string drive =
      make_drive("path",
                 kStart + kOdometer +
                     "[heading]\nfile = \"path.csv\"\ncolumns = { time = \"t_s\", lat = "
                     "\"lat_deg\", lon = \"lon_deg\" }\n",
                 {{"odo.csv", every_second("t_s,v_mps", 100, "-4")}, {"path.csv", path.str()}});
  const auto t = reckon(drive);
  const auto end = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 70 * deg, 400.0);
  // The course of 3 m at 55 deg by radii of the middle latitude: second order in 3 m / a.
  EXPECT_LT(from_end(t, end.lat, end.lon), 1e-5);
}

TEST(TrackSources, TheBodyStandsOffTheCourseByEps) {
  const std::string drive = make_drive(
      "body",
      kStart + kOdometer +
          "mounting = { heading = \"2 deg\" }\n[attitude]\nfile = \"att.csv\"\ncolumns = { time = "
          "\"t_s\", heading = \"heading_deg\", pitch = \"pitch_deg\", roll = \"roll_deg\" }\n",
      {{"odo.csv", every_second("t_s,v_mps", 50, "10")},
       {"att.csv",
        "t_s,heading_deg,pitch_deg,roll_deg\n-1,359,1,3\n20,359,1,3\n40,9,1,3\n51,9,1,3\n"}});
  const std::string certificate = scratch_folder() + "/body.json";
  std::ofstream(certificate)
      << R"({"k": 1, "eps_deg": 5, "method": "x", "methods": {"x": {"pitch_mounting_deg": 1}}})";
  const auto t = reckon(drive, "--calibration " + certificate);
  EXPECT_NEAR(number(t.at("heading_deg").front()), 359.0, 1e-9);
  EXPECT_NEAR(number(t.at("heading_deg")[325]), 5.25, 1e-9);  // at 32.5 s, between its rows
  EXPECT_NEAR(last(t, "heading_deg"), 9.0, 1e-9);
  EXPECT_NEAR(last(t, "roll_deg"), 3.0, 1e-12);
  EXPECT_NEAR(last(t, "pitch_deg"), 1.0, 1e-12);
  EXPECT_NEAR(std::atan2(last(t, "ve_mps"), last(t, "vn_mps")) / deg, 9 - 2 - 5, 1e-9);
  EXPECT_NEAR(last(t, "h_m"), 0, 1e-9);  // the slope is the body's pitch less the mounting
}

TEST(TrackSources, AGyroDriftThatCalibrationFoundIsTakenOut) {
  std::ostringstream track;
  track.precision(17);
  track << "t_s,ds_m,heading_deg\n";
  // heading_i - drift t_i, 36 deg/h
  for (int i = 1; i <= 100; ++i) track << i << ",10," << 45 + 2.5 + 0.01 * i << '\n';
  const std::string drive =
      make_drive("drift",
                 kStart +
                     "[track]\nfile = \"track.csv\"\ncolumns = { time = \"t_s\", distance = "
                     "\"ds_m\", heading = \"heading_deg\" }\n",
                 {{"track.csv", track.str()}});
  const std::string certificate = scratch_folder() + "/drift.json";
  std::ofstream(certificate) << R"({"k": 1, "eps_deg": 2.5, "heading_drift_deg_h": 36})";
  const auto end = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 45 * deg, 1000.0);
  EXPECT_LT(from_end(reckon(drive, "--calibration " + certificate), end.lat, end.lon), kClosedForm);
}

TEST(TrackSources, KnownBiasesOfTheUnitAreTakenOut) {
  const std::string drive = make_drive(
      "bias",
      "[imu]\nfile = \"imu.csv\"\naxes = \"FRD\"\ncolumns = { time = \"t_s\", gyro = [\"a\", "
      "\"b\", \"c\"], accel = [\"d\", \"e\", \"f\"] }\nunits = { gyro = \"rad/s\", accel = "
      "\"m/s^2\" }\nbias = { gyro = \"1 2 3 deg/h\", accel = \"0.1 0.2 0.3 m/s^2\" }\n",
      {{"imu.csv", every_second("t_s,a,b,c,d,e,f", 5, "0.01,0.02,0.03,0.5,0.6,-9.8")}});
  Diagnostics d;
  ImuReader reader(read_drive(drive), d);
  ImuIncrement<double> s;
  ASSERT_TRUE(reader.next(s));
  ASSERT_TRUE(reader.next(s));
  EXPECT_NEAR(s.dtheta.x, 0.02 - 1 * deg_per_h, 1e-15);  // right, forward, up
  EXPECT_NEAR(s.dtheta.z, -0.03 - 3 * deg_per_h, 1e-15);
  EXPECT_NEAR(s.dv.y, 0.5 - 0.2, 1e-15);
}

TEST(TrackSources, WhatIsMissingIsNamed) {
  const auto refused = [](const std::string& name, const std::string& sections,
                          const std::string& word) {
    const std::string drive =
        make_drive(name, kStart + sections,
                   {{"odo.csv", every_second("t_s,v_mps", 9, "1")},
                    {"h.csv", every_second("t_s,heading_deg,lat_deg,lon_deg", 9, "1,1,1")}});
    const Outcome o = run("navigate " + drive + " --mode reckon");
    EXPECT_EQ(o.exit_code, 3) << name;
    EXPECT_NE(o.err.find(word), std::string::npos) << o.err;
  };
  refused("no_heading", kOdometer, "[attitude] or [heading]");
  refused("no_distance",
          "[attitude]\nfile = \"h.csv\"\ncolumns = { time = \"t_s\", heading = \"heading_deg\" }\n",
          "[odometer] or [velocity]");
  refused("two_headings",
          kOdometer +
              "[heading]\nfile = \"h.csv\"\ncolumns = { time = \"t_s\", heading = \"heading_deg\", "
              "lat = \"lat_deg\", lon = \"lon_deg\" }\n",
          "expected one of");
  refused("no_speed",
          "[odometer]\nfile = \"odo.csv\"\nkind = \"speed\"\ncolumns = { time = \"t_s\", east = "
          "\"v_mps\" }\n[heading]\nfile = \"h.csv\"\ncolumns = { time = \"t_s\", heading = "
          "\"heading_deg\" }\n",
          "columns.value");
}

}  // namespace
}  // namespace loxo::testing
