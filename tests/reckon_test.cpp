// SPDX-License-Identifier: Apache-2.0
// `loxo navigate DRIVE --mode reckon` as a user runs it, on small drives with a closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/json.hpp"
#include "program.hpp"

namespace loxo::testing {
namespace {

// Text holds degrees to the last bit; the meridian arc promises 2e-8 m.
constexpr double kClosedForm = 3e-8;
const std::string kTrack =
    "[track]\nfile = \"track.csv\"\n"
    "columns = { time = \"t_s\", distance = \"ds_m\", heading = \"heading_deg\" }\n";
const std::string kBenchmark =
    "[[benchmark]]\nname = \"A\"\nafter_row = 0\nlat_deg = 55.0\nlon_deg = 110.0\nstd = \"0 m\"\n";

std::string make_drive(const std::string& name, const std::string& sections,
                       const std::string& rows) {
  const std::string folder = scratch_folder() + "/" + name;
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/drive.toml") << "format = 1\nname = \"" << name << "\"\n" << sections;
  std::ofstream(folder + "/track.csv") << "t_s,ds_m,heading_deg\n" << rows;
  return folder;
}

// n steps of ds, one each second from t = 1.
std::string straight(int n, double ds, double heading_deg) {
  std::ostringstream s;
  s.precision(17);
  for (int i = 1; i <= n; ++i) s << i << ',' << ds << ',' << heading_deg << '\n';
  return s.str();
}

double apart(double lat1, double lon1, double lat2, double lon2) {
  return norm(to_ecef(wgs84(), Geodetic<double>{lat1, lon1, 0.0}) -
              to_ecef(wgs84(), Geodetic<double>{lat2, lon2, 0.0}));
}

struct End {
  double lat, lon;
  std::map<std::string, std::vector<std::string>> table;
};
End reckon(const std::string& drive, const std::string& options = "") {
  const std::string out = scratch_folder() + "/solution.csv";
  std::filesystem::remove(out);
  const Outcome o = run("navigate " + drive + " --mode reckon -o " + out + " " + options);
  EXPECT_EQ(o.exit_code, 0) << o.err;
  End e{0, 0, columns(slurp(out))};
  if (o.exit_code == 0) {
    e.lat = number(e.table.at("lat_deg").back()) * deg;
    e.lon = number(e.table.at("lon_deg").back()) * deg;
  }
  return e;
}

TEST(Reckon, TheEndIsTheRhumbLines) {
  const std::string drive = make_drive("line", kTrack + kBenchmark, straight(900, 100, 45));
  const auto truth = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 45 * deg, 90e3);
  const End exact = reckon(drive);
  EXPECT_LT(apart(exact.lat, exact.lon, truth.lat, truth.lon), kClosedForm);
  // vehicle.md 1.2 at steps of 100 m; [S0-DR]
  const End midpoint = reckon(drive, "--integrator midpoint");
  EXPECT_NEAR(apart(midpoint.lat, midpoint.lon, truth.lat, truth.lon), 1.65e-6, kClosedForm);
  const End start = reckon(drive, "--integrator start-latitude");
  EXPECT_NEAR(apart(start.lat, start.lon, truth.lat, truth.lon), 0.5044, 0.0005);

  // One row a period, the first and the last among them, each on the line.
  ASSERT_EQ(exact.table.at("t_s").size(), 9001u);
  EXPECT_EQ(number(exact.table.at("t_s").front()), 0.0);
  EXPECT_EQ(number(exact.table.at("t_s")[3]), 0.3);
  EXPECT_EQ(number(exact.table.at("t_s").back()), 900.0);
  EXPECT_EQ(number(exact.table.at("lat_deg").front()), 55.0);
  const auto middle = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 45 * deg, 45030.0);
  EXPECT_LT(apart(number(exact.table.at("lat_deg")[4503]) * deg,
                  number(exact.table.at("lon_deg")[4503]) * deg, middle.lat, middle.lon),
            kClosedForm);
  EXPECT_NEAR(number(exact.table.at("vn_mps")[10]), 100 * std::cos(45 * deg), 1e-12 * 100);
  EXPECT_NEAR(number(exact.table.at("heading_deg")[10]), 45.0, 1e-12);
  EXPECT_EQ(reckon(drive, "--output-rate 0.4Hz").table.at("t_s").size(), 361u);
}

TEST(Reckon, ACertificateIsTakenOut) {
  const std::string drive =
      make_drive("measured", kTrack + kBenchmark, straight(900, 120, 45 + 92.5));
  const auto truth = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 45 * deg, 90e3);
  for (const std::string text :
       {R"({"k": 1.2, "eps_deg": 92.5})", R"({"result": {"k": 1.2, "eps_deg": 92.5}})",
        R"({"recommended": "replay", "methods": {"replay": {"k": 1.2, "eps_deg": 92.5}}})"}) {
    const std::string cert = scratch_folder() + "/cert.json";
    std::ofstream(cert) << text;
    const End end = reckon(drive, "--calibration " + cert);
    EXPECT_LT(apart(end.lat, end.lon, truth.lat, truth.lon), kClosedForm) << text;
  }
  for (const std::string text : {R"({"k": 1.2})", R"({"k": 0, "eps_deg": 1})", R"([1, 2])", "{",
                                 R"({"k": "1.2", "eps_deg": 1})"}) {
    const std::string cert = scratch_folder() + "/bad.json";
    std::ofstream(cert) << text;
    const Outcome o = run("navigate " + drive + " --mode reckon --calibration " + cert);
    EXPECT_EQ(o.exit_code, 3) << text;
    EXPECT_NE(o.err.find("bad.json"), std::string::npos) << o.err;
    EXPECT_EQ(o.out, "");
  }
}

TEST(Reckon, SummaryAsJson) {
  const std::string drive = make_drive("json", kTrack + kBenchmark, straight(10, 100, 45));
  const Outcome o = run("navigate " + drive + " --mode reckon --json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const Json j = parse_json(o.out, "stdout");
  EXPECT_EQ(j.at("rows").get<long>(), 101);
  EXPECT_EQ(j.at("steps").get<long>(), 10);
  EXPECT_DOUBLE_EQ(j.at("distance_m").get<double>(), 1000.0);
  const auto truth = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 45 * deg, 1000.0);
  EXPECT_NEAR(j.at("end_lat_deg").get<double>(), truth.lat / deg, 1e-12);
  // Without -o and --json the solution itself goes to standard output.
  const Outcome csv = run("navigate " + drive + " --mode reckon");
  EXPECT_EQ(columns(csv.out).at("t_s").size(), 101u);
  EXPECT_NE(csv.out.find("# ellipsoid: WGS84"), std::string::npos);
  EXPECT_NE(csv.out.find("# input_hash: "), std::string::npos);
}

TEST(Reckon, TheStartSectionRulesAndTheAntimeridianIsNothing) {
  const std::string start = "[start]\nt_s = 10.0\nlat_deg = -30.0\nlon_deg = 179.9\nh_m = 0.0\n";
  const std::string drive =
      make_drive("start", kTrack + start + kBenchmark, straight(310, 100, 90));
  const End end = reckon(drive);
  const auto truth = rhumb_direct(wgs84(), -30 * deg, 179.9 * deg, 90 * deg, 30e3);
  EXPECT_LT(apart(end.lat, end.lon, truth.lat, truth.lon), kClosedForm);
  EXPECT_LT(end.lon, 0);
  EXPECT_EQ(number(end.table.at("t_s").front()), 10.0);
}

TEST(Reckon, OverThePoleByGridHeadingsOnly) {
  const std::string start = "[start]\nt_s = 0.0\nlat_deg = 89.9\nlon_deg = 0.0\n";
  const std::string rows = straight(230, 100, 0);
  const std::string blind = make_drive("blind", kTrack + start, rows);
  const std::string out = scratch_folder() + "/blind.csv";
  for (const char* i : {"exact", "midpoint", "start-latitude"}) {
    const Outcome o = run("navigate " + blind + " --mode reckon -o " + out + " --integrator " + i);
    EXPECT_EQ(o.exit_code, 3) << o.err;
    EXPECT_NE(o.err.find("heading_reference = \"grid\""), std::string::npos) << o.err;
    EXPECT_FALSE(std::filesystem::exists(out));
  }
  const std::string seeing =
      make_drive("seeing", kTrack + "heading_reference = \"grid\"\n" + start, rows);
  const End end = reckon(seeing);
  // The same meridian on the other side.
  const double arc = meridian_arc(wgs84(), 89.9 * deg) + 23000.0;
  const double lat = latitude_of_arc(wgs84(), 2 * wgs84().quarter_meridian - arc);
  EXPECT_LT(apart(end.lat, end.lon, lat, kPi), 1e-6);
  EXPECT_NEAR(number(end.table.at("heading_deg").back()), 180.0, 1e-6);
}

TEST(Reckon, FromTheBenchmarkAfterItsRow) {
  std::string late = kBenchmark;
  late.replace(late.find("after_row = 0"), 13, "after_row = 10");
  const End end = reckon(make_drive("after", kTrack + late, straight(310, 100, 45)));
  const auto truth = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 45 * deg, 30e3);
  EXPECT_LT(apart(end.lat, end.lon, truth.lat, truth.lon), kClosedForm);
  EXPECT_EQ(number(end.table.at("t_s").front()), 10.0);
}

TEST(Reckon, PitchAndHeight) {
  // Along the equator, dlon = s cos(pitch)/(a + h) (vehicle.md 0), (V-5).
  const std::string start = "[start]\nt_s = 0.0\nlat_deg = 0.0\nlon_deg = 0.0\nh_m = 1000.0\n";
  const std::string folder = make_drive(
      "slope",
      "[track]\nfile = \"slope.csv\"\ncolumns = { time = \"t_s\", distance = \"ds_m\", heading = "
      "\"heading_deg\", pitch = \"pitch_deg\", height = \"h_m\" }\n" +
          start,
      "");
  std::ofstream file(folder + "/slope.csv");
  file << "t_s,ds_m,heading_deg,pitch_deg,h_m\n";
  for (int i = 1; i <= 100; ++i) file << i << ",200,90,60,1000\n";
  file.close();
  const End flat = reckon(folder);
  EXPECT_NEAR(flat.lon * (wgs84().a + 1000), 10e3, kClosedForm);
  EXPECT_EQ(number(flat.table.at("h_m").back()), 1000.0);
  // Without a column of heights the pitch carries the height along.
  const std::string climb = make_drive(
      "climb",
      "[track]\nfile = \"slope.csv\"\ncolumns = { time = \"t_s\", distance = \"ds_m\", heading = "
      "\"heading_deg\", pitch = \"pitch_deg\" }\n" +
          start,
      "");
  std::filesystem::copy_file(folder + "/slope.csv", climb + "/slope.csv",
                             std::filesystem::copy_options::overwrite_existing);
  const End up = reckon(climb);
  EXPECT_NEAR(number(up.table.at("h_m").back()), 1000 + 20e3 * std::sin(60 * deg), 1e-9);
  EXPECT_NEAR(number(up.table.at("vu_mps")[5]), 200 * std::sin(60 * deg), 1e-10);
}

TEST(Reckon, OdometerWithAttitude) {
  const std::string folder = make_drive(
      "wheel",
      "[odometer]\nfile = \"odo.csv\"\nkind = \"speed\"\ncolumns = { time = \"t_s\", value = "
      "\"v_mps\" }\n[attitude]\nfile = \"att.csv\"\ncolumns = { time = \"t_s\", heading = "
      "\"heading_deg\", pitch = \"pitch_deg\", roll = \"roll_deg\" }\n" +
          kBenchmark,
      "");
  std::ofstream odo(folder + "/odo.csv"), att(folder + "/att.csv");
  odo << "t_s,v_mps\n";
  att << "t_s,heading_deg,pitch_deg,roll_deg\n";
  for (int i = 0; i <= 100; ++i) odo << i << ",10\n" << std::flush;
  for (int i = -1; i <= 101; ++i) att << i << ",30,0,0\n" << std::flush;
  const End end = reckon(folder);
  const auto truth = rhumb_direct(wgs84(), 55 * deg, 110 * deg, 30 * deg, 1000.0);
  EXPECT_LT(apart(end.lat, end.lon, truth.lat, truth.lon), kClosedForm);
  EXPECT_EQ(number(end.table.at("t_s").front()), 0.0);
  // A mounting that the drive declares is taken out.
  const std::string turned = folder + "/turned.csv";
  std::ofstream(turned) << "t_s,heading_deg,pitch_deg,roll_deg\n-1,35,2,0\n101,35,2,0\n";
  const End known = reckon(folder,
                           "--set 'odometer.mounting={ heading = \"5 deg\", pitch = \"2 deg\" }' "
                           "--set attitude.file=" +
                               turned);
  EXPECT_LT(apart(known.lat, known.lon, truth.lat, truth.lon), kClosedForm);
}

TEST(Reckon, AMechanisedLog) {
  // Recorded by (V-12) with k = 1.2 and eps = -1 deg on a curved way, navigated by (V-42).
  const double k = 1.2, eps = -1 * deg;
  auto state = mechanised_start(55 * deg, 110 * deg);
  std::ostringstream rows;
  rows.precision(17);
  for (int i = 1; i <= 300; ++i) {
    const double psi = record_mechanised(wgs84(), state, 100.0, 0.2 + 0.005 * i, k, eps, 0.0, 0.0);
    rows << i << ",120," << psi / deg << '\n';
  }
  const std::string drive = make_drive(
      "mechanised", kTrack + "heading_model = \"mechanised\"\n" + kBenchmark, rows.str());
  const std::string cert = scratch_folder() + "/mechanised.json";
  std::ofstream(cert) << R"({"heading_model": "mechanised", "k": 1.2, "eps_deg": -1})";
  const End end = reckon(drive, "--calibration " + cert);
  // Two passes of the half step leave 1e-11 rad of 30 km.
  EXPECT_LT(apart(end.lat, end.lon, state.truth.lat, state.truth.lon), 1e-6);
  // The same log taken for an independent one goes elsewhere: it must be declared (vehicle.md 1.5).
  const End wrong =
      reckon(drive, "--calibration " + cert + " --set track.heading_model=independent");
  EXPECT_GT(apart(wrong.lat, wrong.lon, state.truth.lat, state.truth.lon), 1.0);
  EXPECT_EQ(run("navigate " + drive + " --mode reckon --integrator midpoint").exit_code, 2);
}

TEST(Reckon, BadInputIsNamed) {
  const auto refused = [](const std::string& drive, const std::string& word) {
    const Outcome o = run("navigate " + drive + " --mode reckon");
    EXPECT_EQ(o.exit_code, 3) << drive;
    EXPECT_NE(o.err.find(word), std::string::npos) << o.err;
    EXPECT_EQ(o.out, "");
  };
  refused(make_drive("one", kTrack + kBenchmark, straight(1, 100, 0)), "at least two rows");
  refused(make_drive("nowhere", kTrack, straight(5, 100, 0)), "no start position");
  refused(make_drive("late", kTrack + "[start]\nt_s = 99.0\nlat_deg = 1.0\nlon_deg = 1.0\n",
                     straight(5, 100, 0)),
          "last row");
  const std::string odometer =
      "[odometer]\nfile = \"track.csv\"\nkind = \"speed\"\n"
      "columns = { time = \"t_s\", value = \"ds_m\" }\nunits = { value = \"m/s\" }\n";
  refused(make_drive("half", odometer + kBenchmark, straight(5, 100, 0)), "[attitude]");
  const std::string line = make_drive("usage", kTrack + kBenchmark, straight(5, 100, 0));
  EXPECT_EQ(run("navigate " + line + " --mode reckon --integrator euler").exit_code, 2);
  EXPECT_EQ(run("navigate " + line + " --mode reckon --output-rate 0Hz").exit_code, 2);
  EXPECT_EQ(run("navigate " + line + " --mode reckon --json -o -").exit_code, 2);
}

}  // namespace
}  // namespace loxo::testing
