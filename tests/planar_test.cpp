// SPDX-License-Identifier: Apache-2.0
// `loxo navigate --mode filter` and `smooth` on drives without an inertial unit.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "loxo/earth/rhumb.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo::testing {
namespace {

// Ten minutes of curves at 10 m/s on true rhumb steps, recorded with k = 1.03 and as turns of the
// heading only, from an azimuth that nobody told; fixes of 2 m in the first half. With `gross`, one
// of them lies 300 m off.
std::string make_drive(const std::string& name, bool gross, const std::string& more = "") {
  const std::string folder = scratch_folder() + "/" + name;
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/drive.toml")
      << "format = 1\nname = \"" << name
      << "\"\n[track]\nfile = \"track.csv\"\ncolumns = { time = \"t_s\", distance = \"ds_m\", "
         "heading_step = \"dh_deg\" }\nerrors = { scale_noise = \"1 %\", side_slip = \"0.5 deg\", "
         "heading_noise = \"1 deg/sqrt(h)\", heading_drift = \"0 deg/h\" }\n[fix]\nfile = "
         "\"fix.csv\"\ncolumns = { time = \"t_s\", lat = \"lat_deg\", lon = \"lon_deg\" "
         "}\nlever_arm = \"0.001 0 0 m\"\nerrors = { position = \"2 m\" }\n"
      << more;
  std::ofstream track(folder + "/track.csv"), fix(folder + "/fix.csv"),
      truth(folder + "/truth.csv");
  track.precision(17), fix.precision(17), truth.precision(17);
  track << "t_s,ds_m,dh_deg\n";
  fix << "t_s,lat_deg,lon_deg\n";
  truth << "t_s,lat_deg,lon_deg\n";
  std::mt19937 rng(7);
  std::normal_distribution<double> normal;
  double lat = 48 * deg, lon = 11 * deg, last = 200 * deg;
  for (int i = 0; i <= 600; ++i) {
    const double end = 200 * deg + 60 * deg * std::sin(0.01 * i) + 0.4 * deg * i;
    if (i > 0) {
      const auto p = rhumb_direct(wgs84(), lat, lon, 0.5 * (last + end), 10.0);
      lat = p.lat, lon = p.lon;
      track << i << ',' << 10.3 << ',' << (end - last) / deg << '\n';
    }
    last = end;
    truth << i << ',' << lat / deg << ',' << lon / deg << '\n';
    if (i <= 300) {
      const double off = gross && i == 250 ? 300 : 2 * normal(rng);
      fix << i << ',' << (lat + off / 6.37e6) / deg << ','
          << (lon + 2 * normal(rng) / 6.37e6 / std::cos(lat)) / deg << '\n';
    }
  }
  return folder;
}

TEST(PlanarProgram, FindsScaleAndAzimuthAndCarriesOnWithoutFixes) {
  const std::string drive = make_drive("turns", true), out = scratch_folder() + "/turns.csv";
  const Outcome o = run("navigate " + drive + " --mode filter --json -o " + out);
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const Json j = parse_json(o.out, "stdout");
  const Json& c = j.at("constants");
  EXPECT_NEAR(c.at("k").get<double>(), 1.03, 4 * c.at("k_std").get<double>());
  EXPECT_LT(c.at("k_std").get<double>(), 0.003);
  // The track began at 0 where the truth had 200 deg.
  EXPECT_NEAR(c.at("eps_deg").get<double>(), 160.0, 4 * c.at("eps_deg_std").get<double>());
  EXPECT_EQ(j.at("alignment").at("method"), "first_course");
  EXPECT_EQ(j.at("innovations").at("fix").at("rejected"), 1);
  // 3 km without a fix: within 1 %, and within what is stated (two components: 4 sigma).
  EXPECT_EQ(run("evaluate " + out + " --truth " + drive +
                "/truth.csv --from 310s --require "
                "'horizontal_max_m<30'")
                .exit_code,
            0);
  const std::string smoothed = scratch_folder() + "/turns_smooth.csv";
  ASSERT_EQ(run("navigate " + drive + " --mode smooth -o " + smoothed).exit_code, 0);
  const auto rms = [&](const std::string& file) {
    return parse_json(
               run("evaluate " + file + " --truth " + drive + "/truth.csv --to 300s --json").out,
               file)
        .at("horizontal_rms_m")
        .get<double>();
  };
  EXPECT_LT(rms(smoothed), 0.8 * rms(out));
  EXPECT_EQ(columns(slurp(smoothed)).at("t_s").size(), columns(slurp(out)).at("t_s").size());
}

TEST(PlanarProgram, SaysWhatIsMissing) {
  const std::string drive =
      make_drive("blind", false, "[start]\nt_s = 0\nlat_deg = 48\nlon_deg = 11\n");
  const Outcome o = run("navigate " + drive + " --mode filter --no-fixes");
  EXPECT_EQ(o.exit_code, 1);
  EXPECT_NE(o.err.find("[start] attitude"), std::string::npos) << o.err;
  EXPECT_EQ(run("navigate " + drive +
                " --mode filter --no-fixes --set 'start.attitude={ heading = \"200 deg\" }'")
                .exit_code,
            0);
  const Outcome grid =
      run("navigate " + drive + " --mode filter --set track.heading_reference=grid");
  EXPECT_EQ(grid.exit_code, 3);
  EXPECT_NE(grid.err.find("grid"), std::string::npos) << grid.err;
}

}  // namespace
}  // namespace loxo::testing
