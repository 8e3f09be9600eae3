// SPDX-License-Identifier: Apache-2.0
// `loxo geo`: tables in, tables out (interface.md).
#include <gtest/gtest.h>

#include <cmath>

#include "program.hpp"

namespace loxo::testing {
namespace {

// Exact to the last bit but one: mpmath 50 digits for a meridian quarter, a parallel, and
// equal-latitude limits.
TEST(Geo, RhumbInverseAndDirectReturn) {
  const std::string points =
      "name,lat1_deg,lon1_deg,lat2_deg,lon2_deg\n"
      "plain,55,110,60,120\n"
      "parallel,55,10,55,11\n"
      "across,10,179.5,-20,-179.5\n"
      "to the pole,0,7,90,8\n"
      "near the pole,89.9999999,0,89.9999998,90\n"
      "tiny,45,45,45.0000000001,45\n";
  const Outcome inverse = run("geo rhumb-inverse", points);
  ASSERT_EQ(inverse.exit_code, 0) << inverse.err;
  const auto t = columns(inverse.out);
  EXPECT_EQ(t.at("name")[3], "to the pole");
  EXPECT_EQ(t.at("lat1_deg")[4], "89.9999999");  // the same rows, to the letter
  EXPECT_NEAR(number(t.at("distance_m")[3]), 10001965.729312724, 4e-9);
  EXPECT_EQ(number(t.at("azimuth_deg")[1]), 90.0);
  const double N =
      6378137.0 / std::sqrt(1 - 0.0066943799901413165 * std::pow(std::sin(55 * M_PI / 180), 2));
  EXPECT_NEAR(number(t.at("distance_m")[1]), N * std::cos(55 * M_PI / 180) * M_PI / 180, 1e-9);
  EXPECT_NEAR(number(t.at("distance_m")[5]), 1e-10 * M_PI / 180 * 6367381.816, 1e-9);

  const Outcome direct = run("geo rhumb-direct", inverse.out);
  ASSERT_EQ(direct.exit_code, 0) << direct.err;
  const auto d = columns(direct.out);
  const auto given = columns(points);
  for (const std::size_t i : {0u, 1u, 2u, 4u, 5u}) {
    EXPECT_NEAR(number(d.at("lat2_deg")[i]), number(given.at("lat2_deg")[i]), 3e-14) << i;
    // a near pole turns 1e-9 m into its share of the circle
    const double c = std::cos(number(given.at("lat2_deg")[i]) * M_PI / 180);
    EXPECT_NEAR(number(d.at("lon2_deg")[i]) * c, number(given.at("lon2_deg")[i]) * c, 1e-13) << i;
  }
  EXPECT_NEAR(number(d.at("lat2_deg")[3]), 90.0, 3e-14);
}

TEST(Geo, BadRowsAreNamedAndTheOthersComputed) {
  const Outcome r = run("geo rhumb-inverse",
                        "\xef\xbb\xbflat1_deg,lon1_deg,lat2_deg,lon2_deg\r\n91,0,0,0\r\n1,2,3,"
                        "4\r\n1,2,x,4\r\n1,2\r\n1,2,nan,4\r\n");
  EXPECT_EQ(r.exit_code, 0);
  const auto t = columns(r.out);
  ASSERT_EQ(t.at("azimuth_deg").size(), 5u);
  EXPECT_EQ(t.at("azimuth_deg")[0], "nan");
  EXPECT_GT(number(t.at("distance_m")[1]), 3e5);
  for (const std::size_t i : {2u, 3u, 4u}) EXPECT_EQ(t.at("distance_m")[i], "nan");
  for (const char* line : {":2:", ":4:", ":5:", ":6:"})
    EXPECT_NE(r.err.find(line), std::string::npos) << r.err;
  EXPECT_EQ(r.err.find(":3:"), std::string::npos);
}

TEST(Geo, ExitCodes) {
  EXPECT_EQ(run("geo rhumb-inverse", "lat1_deg,lon1_deg,lat2_deg,lon2_deg\n91,0,0,0\n").exit_code,
            3);
  EXPECT_EQ(run("geo rhumb-inverse", "lat1_deg,lon1_deg,lat2_deg,lon2_deg\n").exit_code, 3);
  EXPECT_EQ(run("geo rhumb-inverse", "").exit_code, 3);
  const Outcome missing = run("geo rhumb-inverse", "lat1_deg,lon1_deg,lat2_deg\n1,2,3\n");
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_NE(missing.err.find("lon2_deg"), std::string::npos);
  const Outcome name = run("geo to-ecef --ellipsoid WSG84", "lat_deg,lon_deg\n1,2\n");
  EXPECT_EQ(name.exit_code, 2);
  EXPECT_NE(name.err.find("WGS84"), std::string::npos);
  EXPECT_EQ(run("geo gauss-forward --central-meridian 117", "lat_deg,lon_deg\n1,2\n").exit_code, 2);
  EXPECT_EQ(run("geo rhumb").exit_code, 2);
  EXPECT_EQ(run("geo to-ecef /nowhere/at/all.csv").exit_code, 3);
}

TEST(Geo, TransverseThereAndBackAtEveryKindOfPlace) {
  const std::string places =
      "lat_deg,lon_deg,ve_mps,vn_mps,heading_deg\n90,30,1,2,90\n-90,30,1,2,90\n0,90,1,2,30\n45,-20,"
      "1,2,359\n0,-90,3,4,5\n12,180,0,1,0\n";
  for (const char* meridian : {"0deg", "122.9deg", "-0.5rad"}) {
    const Outcome to = run(std::string("geo to-transverse --meridian ") + meridian, places);
    ASSERT_EQ(to.exit_code, 0) << to.err;
    const auto t = columns(to.out);
    EXPECT_EQ(number(t.at("tlat_deg")[0]), 0.0);
    EXPECT_EQ(number(t.at("tlon_deg")[0]), 0.0);
    EXPECT_EQ(number(t.at("tlon_deg")[1]), 180.0);
    // hide what is to be found again
    std::string hidden = to.out;
    hidden.replace(0, hidden.find('\n'),
                   "a,b,c,d,e,tlat_deg,tlon_deg,vte_mps,vtn_mps,theading_deg");
    const Outcome back = run(std::string("geo from-transverse --meridian ") + meridian, hidden);
    ASSERT_EQ(back.exit_code, 0) << back.err;
    const auto b = columns(back.out), g = columns(places);
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(number(b.at("lat_deg")[i]), number(g.at("lat_deg")[i]), 1e-13) << meridian << i;
      if (i < 2)
        continue;  // a pole's longitude is the reference meridian's: velocity and heading agree
                   // with that
      EXPECT_NEAR(std::remainder(number(b.at("lon_deg")[i]) - number(g.at("lon_deg")[i]), 360.0),
                  0.0, 1e-13);
      EXPECT_NEAR(number(b.at("ve_mps")[i]), number(g.at("ve_mps")[i]), 1e-14);
      EXPECT_NEAR(number(b.at("vn_mps")[i]), number(g.at("vn_mps")[i]), 1e-14);
      EXPECT_NEAR(
          std::remainder(number(b.at("heading_deg")[i]) - number(g.at("heading_deg")[i]), 360.0),
          0.0, 3e-13);
    }
    // at the pole: course and heading turn together
    const double course =
        std::atan2(number(b.at("ve_mps")[0]), number(b.at("vn_mps")[0])) * 180 / M_PI;
    EXPECT_NEAR(
        std::remainder(
            number(b.at("heading_deg")[0]) - course - (90 - std::atan2(1, 2) * 180 / M_PI), 360.0),
        0.0, 1e-12);
  }
  EXPECT_NE(run("geo to-transverse", "lat_deg,lon_deg,ve_mps\n1,2,3\n").err.find("vn_mps"),
            std::string::npos);
}

TEST(Geo, GaussBothSeriesAndTheLimits) {
  const std::string table = "lat_deg,lon_deg\n40,116.5\n-33,118.9\n89.99,100\n";
  for (const char* series : {"exact", "paper"}) {
    const Outcome f = run(
        std::string("geo gauss-forward --central-meridian 117deg --ellipsoid Krasovsky --series ") +
            series,
        table);
    ASSERT_EQ(f.exit_code, 0) << f.err;
    std::string hidden = f.out;
    hidden.replace(0, hidden.find('\n'), "a,b,x_m,y_m");
    const Outcome i =
        run(std::string(
                "geo gauss-inverse --central-meridian 117deg --ellipsoid Krassovsky --series ") +
                series,
            hidden);
    ASSERT_EQ(i.exit_code, 0) << i.err;
    const auto b = columns(i.out), g = columns(table);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(number(b.at("lat_deg")[k]), number(g.at("lat_deg")[k]), 1e-12);
      EXPECT_NEAR(number(b.at("lon_deg")[k]), number(g.at("lon_deg")[k]), 1e-10);
    }
  }
  EXPECT_EQ(run("geo gauss-forward --central-meridian 0deg", "lat_deg,lon_deg\n0,89.9\n").exit_code,
            3);
  const auto zero = columns(
      run("geo gauss-forward --false-easting 0m --central-meridian 9deg", "lat_deg,lon_deg\n50,9\n")
          .out);
  EXPECT_EQ(number(zero.at("y_m")[0]), 0.0);
}

TEST(Geo, FilesJsonAndReplacedColumns) {
  const std::string path = scratch_folder() + "/table.csv";
  const Outcome r =
      run("geo to-ecef -o " + path, "# source: test\nlat_deg,lon_deg,h_m,x_m\n90,0,100,7\n");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(r.out.empty());
  const std::string text = slurp(path);
  EXPECT_EQ(text.rfind("# source: test\nlat_deg,lon_deg,h_m,x_m,y_m,z_m\n", 0), 0u) << text;
  const auto t = columns(text);
  EXPECT_EQ(number(t.at("x_m")[0]), 0.0);
  EXPECT_NEAR(number(t.at("z_m")[0]), 6356852.314245179, 2e-9);
  const Outcome json = run("geo from-ecef --json " + path);
  EXPECT_EQ(json.exit_code, 0);
  EXPECT_NE(json.out.find("\"rows\""), std::string::npos);
  EXPECT_EQ(run("geo from-ecef -o /nowhere/out.csv " + path).exit_code, 1);
}

}  // namespace
}  // namespace loxo::testing
