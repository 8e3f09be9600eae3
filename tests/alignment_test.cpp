// SPDX-License-Identifier: Apache-2.0
// [start] alignment = { kind = … } as a user writes it: every kind, its predicted accuracy, and
// what it says where it cannot be had.
#include <gtest/gtest.h>

#include "inertial_drive.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/text/json.hpp"

namespace loxo {
namespace {

using namespace loxo::testing;

const std::string kErrors =
    "errors = { gyro_bias = \"0.01 deg/h\", gyro_noise = \"0.001 deg/sqrt(h)\", accel_bias = \"10 "
    "ug\", accel_noise = \"0.001 m/s/sqrt(h)\" }\n";
constexpr double kHeading = 100;  // deg

truth::Motion standing(double lat) {
  auto m = truth::great_circle(wgs84(), lat, 110 * deg, 0, 0);
  m.heading = kHeading * deg;
  return m;
}
fs::path standing_drive(const std::string& name, double lat, const std::string& start,
                        long samples = 3400) {
  DriveSpec spec;
  spec.imu_extra = kErrors;
  spec.start =
      "t_s = 0.0\nlat_deg = " + number_text(lat / deg) + "\nlon_deg = 110.0\nh_m = 0.0\n" + start;
  return write_drive(name, standing(lat), samples, spec);
}
Json align(const fs::path& folder) {
  const Ran r = navigate(folder, "--vertical fixed --output-rate 1Hz --json");
  EXPECT_EQ(r.code, 0) << r.err;
  return r.code == 0 ? Json::parse(r.out)["alignment"] : Json();
}

// The increments are exact; what is left is the rounding of the file and the filter's trust in the
// sensors' declared errors.
TEST(Alignment, EveryKindAtRest) {
  struct Kind {
    std::string name, attitude, method;
    double limit, std;  // deg
  };
  // 0.01 deg/h over 15.04 cos 40 deg/h: 0.0497 deg.
  const std::vector<Kind> kinds = {
      {"static", "", "inertial_frame", 0.001, 0.05},
      {"swaying", "", "inertial_frame", 0.001, 0.05},
      {"gyrocompass", "", "gyrocompass", 0.001, 0.05},
      {"gyrocompass", "attitude = { pitch = \"0deg\", roll = \"0deg\" }\n", "gyrocompass", 0.001,
       0.05},
      {"fine", "", "fine", 0.005, 0.05},
      {"fine", "attitude = { heading = \"101deg\", heading_std = \"1deg\" }\n", "fine", 0.05, 0.06},
      {"stored", "attitude = { heading = \"100deg\", heading_std = \"0.2deg\" }\n", "stored", 1e-9,
       0.2},
      {"given", "attitude = { heading = \"100deg\", pitch = \"0deg\", roll = \"0deg\" }\n",
       "attitude", 1e-9, 0.1}};
  for (const Kind& k : kinds) {
    const std::string start =
        "alignment = { kind = \"" + k.name + "\", duration = \"150 s\" }\n" + k.attitude;
    const Json a = align(standing_drive("alignment_kinds", 40 * deg, start));
    ASSERT_FALSE(a.is_null()) << k.name;
    EXPECT_EQ(a["method"], k.method);
    EXPECT_NEAR(a["heading_deg"].get<double>(), kHeading, k.limit) << k.name << a;
    EXPECT_NEAR(a["heading_std_deg"].get<double>(), k.std, 0.2 * k.std) << k.name << a;
    // acos(0.01 deg/h/(15.041 deg/h 5 deg))
    EXPECT_NEAR(a["latitude_limit_deg"].get<double>(), 89.5635, 1e-3);
    if (k.method == "inertial_frame") {
      EXPECT_NEAR(a["latitude_deg"].get<double>(), 40, 0.05);
    }
  }
}

TEST(Alignment, ThePredictionIsPrinted) {
  const Ran r =
      navigate(standing_drive("alignment_text", 40 * deg,
                              "alignment = { kind = \"static\", duration = \"150 s\" }\n"),
               "");
  ASSERT_EQ(r.code, 0) << r.err;
  EXPECT_NE(
      r.out.find("an east gyro drift of 0.01 deg/h at latitude 40.00 deg turns the heading by "
                 "0.05 deg; 5 deg are reached at latitude 89.56 deg"),
      std::string::npos)
      << r.out;
}

// estimation.md 4.5: beyond the limit of latitude every kind that needs the Earth's turn is
// refused, says why and what would do; what does not need it works at the pole itself.
TEST(Alignment, NearThePole) {
  for (const std::string kind : {"static", "swaying", "gyrocompass", "fine"}) {
    const std::string start = "alignment = { kind = \"" + kind + "\", duration = \"120 s\" }\n";
    const fs::path folder = standing_drive("alignment_pole", 89.9 * deg, start, 2500);
    const Ran r = navigate(folder, "");
    EXPECT_EQ(r.code, 1) << kind;
    for (const char* word : {"heading", "latitude 89.9000", "up to latitude 89.56", "attitude",
                             "state", "in-motion", "--force"})
      EXPECT_NE(r.err.find(word), std::string::npos) << kind << ": " << word << "\n" << r.err;
    const Ran forced = navigate(folder, "--force --json");
    ASSERT_EQ(forced.code, 0) << forced.err;
    // 0.01/(15.04 cos 89.9) rad and more, never less.
    EXPECT_GT(Json::parse(forced.out)["alignment"]["heading_std_deg"].get<double>(), 21.0) << kind;
  }
  const Json a = align(standing_drive(
      "alignment_pole", 89.9 * deg,
      "alignment = { kind = \"stored\", duration = \"60 s\" }\nattitude = { heading = \"100deg\", "
      "heading_std = \"0.5deg\" }\n",
      2500));
  EXPECT_EQ(a["method"], "stored");
}

// estimation.md 4.4 as far as it needs no filter: under way, from the course of fixes.
TEST(Alignment, InMotion) {
  auto m = truth::great_circle(wgs84(), 50 * deg, 10 * deg, 40 * deg, 20);
  DriveSpec spec;
  spec.imu_extra = kErrors;
  spec.start = "alignment = { kind = \"in-motion\" }\n";
  for (const bool velocity : {true, false}) {
    spec.more = std::string(
                    "[fix]\nfile = \"fix.csv\"\ncolumns = { time = \"t_s\", lat = "
                    "\"lat_deg\", lon = \"lon_deg\", height = \"h_m\"") +
                (velocity ? ", ve = \"ve_mps\", vn = \"vn_mps\"" : "") +
                " }\nerrors = { position = \"0.5 m\" }\n";
    const fs::path folder = write_drive("alignment_motion", m, 1200, spec);
    std::ofstream fixes(folder / "fix.csv");
    fixes << "t_s,lat_deg,lon_deg,h_m,ve_mps,vn_mps\n";
    for (int i = 0; i <= 60; i += velocity ? 1 : 15) {
      const auto s = m.at(i).state;
      const auto g = to_geodetic(m.ell, s.r);
      const auto v = geographic_axes(g.lat, g.lon) * s.v;
      for (double x : {g.lat / deg, g.lon / deg, g.h, v.x, v.y})
        fixes << (x == g.lat / deg ? number_text(i) + "," : ",") << number_text(x);
      fixes << '\n';
    }
    fixes.close();
    const Ran r = navigate(folder, "--vertical fixed --json");
    ASSERT_EQ(r.code, 0) << r.err;
    const Json a = Json::parse(r.out)["alignment"];
    EXPECT_EQ(a["method"], "in_motion");
    EXPECT_NEAR(a["heading_deg"].get<double>(), 40, 0.1);
    EXPECT_GE(a["heading_std_deg"].get<double>(), 3.0);
    EXPECT_LT(end_error(r, m),
              velocity ? 3.0 : 10.0);  // m: 0.1 m/s and the Coriolis tilt over 60 s
  }
  spec.more.clear();
  spec.start = "lat_deg = 50.0\nlon_deg = 10.0\nh_m = 0.0\n" + spec.start;
  m.yaw = 3 * deg, m.roll = 3 * deg, m.roll_period = 4;  // clearly no standstill
  const Ran none = navigate(write_drive("alignment_motion_none", m, 1200, spec), "");
  EXPECT_EQ(none.code, 1);
  EXPECT_NE(none.err.find("fixes"), std::string::npos) << none.err;
  EXPECT_NE(none.err.find("static"), std::string::npos) << none.err;
}

TEST(Alignment, BadDescriptionsAreRefused) {
  const Ran r = navigate(
      standing_drive("alignment_bad", 40 * deg, "alignment = { kind = \"swaing\" }\n", 200), "");
  EXPECT_EQ(r.code, 3);
  EXPECT_NE(r.err.find("did you mean 'swaying'"), std::string::npos) << r.err;
  for (const std::string kind : {"given", "stored"}) {
    const Ran g = navigate(
        standing_drive("alignment_bad", 40 * deg, "alignment = { kind = \"" + kind + "\" }\n", 200),
        "");
    EXPECT_EQ(g.code, 3);
    EXPECT_NE(g.err.find("start.attitude"), std::string::npos) << g.err;
  }
  const Ran brief = navigate(
      standing_drive("alignment_bad", 40 * deg, "alignment = { kind = \"static\" }\n", 100), "");
  EXPECT_EQ(brief.code, 1);
  EXPECT_NE(brief.err.find("at least 10 s"), std::string::npos) << brief.err;
}

}  // namespace
}  // namespace loxo
