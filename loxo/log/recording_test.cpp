// SPDX-License-Identifier: Apache-2.0
// The real recordings, with the numbers that their own descriptions say a correct loader
// reproduces. The name of a test is the folder; a number's tolerance is half of its last printed
// digit, where the description says how it was made, else what its kind allows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/log/table.hpp"
#include "loxo/num/units.hpp"
#include "shared_folder.hpp"

namespace loxo {
namespace {

namespace fs = std::filesystem;

std::string recording(const std::string& set) {
  const std::string data = testing::shared_folder("data");
  return data.empty() || !fs::exists(data + "/" + set) ? "" : data;
}
#define LOXO_RECORDING(set)                                                                    \
  if (recording(set).empty()) GTEST_SKIP() << "the recording " set " is not here (LOXO_DATA)"; \
  Diagnostics d;                                                                               \
  const Drive drive = read_drive(std::string(testing::source_folder()) + "/examples/drives/" set)

// Steps in the local plane, as the descriptions take them.
double path(const std::vector<SolutionRow>& rows) {
  double sum = 0;
  for (std::size_t i = 1; i < rows.size(); ++i)
    sum += norm(to_ecef(wgs84(), Geodetic<double>{rows[i].lat, rows[i].lon, rows[i].h}) -
                to_ecef(wgs84(), Geodetic<double>{rows[i - 1].lat, rows[i - 1].lon, rows[i].h}));
  return sum;
}
// The printed lengths come from a local plane or a sphere: radii of curvature of one latitude agree
// to about 1e-4.
constexpr double kPlane = 2e-4;

double linear(const std::vector<double>& t, const std::vector<double>& y, double at) {
  const auto it = std::lower_bound(t.begin(), t.end(), at);
  if (it == t.begin()) return y.front();
  if (it == t.end()) return y.back();
  const auto i = static_cast<std::size_t>(it - t.begin());
  return y[i - 1] + (y[i] - y[i - 1]) * (at - t[i - 1]) / (t[i] - t[i - 1]);
}
double linear(const std::vector<OdometerTick>& v, double at) {
  std::vector<double> t, y;  // few calls, short logs
  const auto it = std::lower_bound(v.begin(), v.end(), at,
                                   [](const OdometerTick& a, double x) { return a.t < x; });
  if (it == v.begin()) return v.front().value;
  if (it == v.end()) return v.back().value;
  const auto& a = *(it - 1);
  return a.value + (it->value - a.value) * (at - a.t) / (it->t - a.t);
}
double median(std::vector<double> x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  if (x.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(x.begin(), middle));
}
double deviation(const std::vector<double>& x) {
  double sum = 0, square = 0;
  for (double v : x) sum += v;
  const double mean = sum / static_cast<double>(x.size());
  for (double v : x) square += (v - mean) * (v - mean);
  return std::sqrt(square / static_cast<double>(x.size()));
}
// Columns of a file of a set, bad rows left out.
std::vector<std::vector<double>> read(const std::string& file,
                                      const std::vector<std::string>& names) {
  const auto table = open_table(testing::shared_folder("data") + "/" + file);
  table->select(names);
  std::vector<std::vector<double>> out(names.size());
  std::vector<double> row(names.size());
  Diagnostics d;
  while (table->next(row, d))
    for (std::size_t i = 0; i < row.size(); ++i) out[i].push_back(row[i]);
  return out;
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
  // Driving straight: what the body's axes miss of the way's direction.
  std::vector<double> side, up;
  for (std::size_t i = 1; i + 1 < ref.rows.size(); ++i) {
    const auto& r = ref.rows[i];
    const double v_h = std::hypot(r.ve, r.vn);
    const double turn = wrap_pi(ref.rows[i + 1].heading - ref.rows[i - 1].heading) /
                        (ref.rows[i + 1].t - ref.rows[i - 1].t);
    if (v_h < 5 || std::fabs(turn) > 0.02) continue;
    side.push_back(wrap_pi(std::atan2(r.ve, r.vn) - r.heading) / deg);
    up.push_back((std::atan2(r.vu, v_h) - r.pitch) / deg);
  }
  EXPECT_NEAR(median(side), 0.252, 5e-3);  // how a rate was made of 1 Hz headings is not said
  EXPECT_NEAR(median(up), 0.855, 5e-3);
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
  // Over 1 s, five rows: the RTK's way against the wheel's, and the course against the heading.
  const auto r = read("plaza1/reference.csv", {"t_s", "e_m", "n_m", "heading_deg"});
  double rtk = 0, wheel = 0;
  std::vector<double> angle;
  for (std::size_t i = 0; i + 5 < r[0].size() && i + 5 <= track.size(); i += 5) {
    double ds = 0;
    for (std::size_t k = i; k < i + 5; ++k) ds += track[k].ds;
    const double east = r[1][i + 5] - r[1][i], north = r[2][i + 5] - r[2][i];
    if (ds < 0.3) continue;
    rtk += std::hypot(east, north);
    wheel += ds;
    const double middle = r[3][i] * deg + 0.5 * wrap_pi((r[3][i + 5] - r[3][i]) * deg);
    angle.push_back(-wrap_pi(std::atan2(east, north) - middle) / deg);
  }
  EXPECT_NEAR(rtk / wheel, 0.99675, 5e-4);
  EXPECT_NEAR(median(angle), -0.942, 0.05);
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
  const auto odo = read("comma2k19_seg40/odo.csv.gz", {"t_s", "v_rl", "v_rr"});
  std::vector<double> rear;
  for (std::size_t i = 0; i < odo[0].size(); ++i) rear.push_back(0.5 * (odo[1][i] + odo[2][i]));
  double v = 0, w = 0;
  for (const auto& r : ref.rows) v += std::hypot(r.ve, r.vn, r.vu), w += linear(odo[0], rear, r.t);
  EXPECT_NEAR(v / w, 1.00967, 5e-5);
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
  // Seconds with a path speed above 1 m/s, the odometer in their middle; then in five equal parts.
  // The columns as they stand, without what the drive takes out.
  const auto odometer = read("wheelins_car/odo.csv", {"t_s", "v_mps"});
  const auto place = read("wheelins_car/reference.csv", {"t_s", "lat_deg", "lon_deg"});
  std::vector<double> way, wheel;
  for (std::size_t i = 1; i < place[0].size(); ++i) {
    SolutionRow from, to;
    from.lat = place[1][i - 1] * deg, from.lon = place[2][i - 1] * deg;
    to.lat = place[1][i] * deg, to.lon = place[2][i] * deg;
    const double ds = path({from, to}), t = 0.5 * (place[0][i - 1] + place[0][i]);
    if (ds < 1.0 || t < odometer[0].front() || t > odometer[0].back()) continue;
    way.push_back(ds);
    wheel.push_back(std::fabs(linear(odometer[0], odometer[1], t)));
  }
  const auto ratio = [&](std::size_t from, std::size_t to) {
    double a = 0, b = 0;
    for (std::size_t i = from; i < to; ++i) a += way[i], b += wheel[i];
    return a / b;
  };
  EXPECT_NEAR(ratio(0, way.size()), 0.99683, 2e-4);
  const double parts[] = {0.9978, 0.9926, 0.9987, 0.9987, 0.9963};
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(ratio(i * way.size() / 5, (i + 1) * way.size() / 5), parts[i], 3e-4) << i;
}

TEST(Recording, Obd) {
  LOXO_RECORDING("obd_k19_1");
  const auto odo = read_odometer(drive, d);  // stamps less the delay of -0.1 s: read at t - 0.1 s
  EXPECT_EQ(odo.size(), 35400u);
  EXPECT_EQ(read_reference(drive, d).rows.size(), 12517u);
  const auto v = read("obd_k19_1/reference_speed.csv.gz", {"t_s", "v_ref_mps", "v_obd_mps"});
  double way = 0, ref = 0, obd = 0, raw = 0;
  for (std::size_t i = 0; i < v[0].size(); ++i) {
    way += 0.2 * v[1][i];
    if (!(v[1][i] > 3)) continue;
    ref += v[1][i];
    obd += v[2][i];
    raw += linear(odo, v[0][i]);
  }
  EXPECT_NEAR(way, 12609.8, 0.05);
  EXPECT_NEAR(ref / obd, 1.00460, 5e-6);
  EXPECT_NEAR(ref / raw, 1.00471, 5e-6);
}

TEST(Recording, Snapir) {
  struct Piece {
    const char* name;
    double path, scale, angle, std[3];
  };
  for (const Piece& p : {Piece{"01", 753.7, 0.9821, 0.997, {0.086, 0.174, 0.032}},
                         {"03", 678.7, 0.9895, 0.868, {0.029, 0.109, 0.022}},
                         {"05", 818.3, 0.9909, 1.620, {0.022, 0.114, 0.016}},
                         {"07", 888.0, 0.9973, 0.144, {0.050, 0.056, 0.084}},
                         {"09", 864.0, 0.9897, -2.031, {0.098, 0.168, 0.109}},
                         {"11", 649.6, 0.9991, 0.112, {0.073, 0.130, 0.174}}}) {
    if (recording("auv_snapir_a").empty())
      GTEST_SKIP() << "the recording auv_snapir_a is not here (LOXO_DATA)";
    SCOPED_TRACE(p.name);
    const std::string file = std::string("data:auv_snapir_a/traj") + p.name;
    const Drive drive = read_drive(
        std::string(testing::source_folder()) + "/examples/drives/auv_snapir_a",
        {"velocity.file=\"" + file + "_dvl.csv\"", "reference.file=\"" + file + "_reference.csv\"",
         "attitude.file=\"" + file + "_reference.csv\""});
    Diagnostics d;
    const auto dvl = read_velocities(drive, d);
    const auto ref = read_reference(drive, d).rows;
    ASSERT_EQ(dvl.size(), 400u);
    ASSERT_EQ(ref.size(), 400u);
    EXPECT_NEAR(path(ref), p.path, 0.05 + kPlane * p.path);
    std::complex<double> cross = 0;
    double square = 0;
    std::vector<double> error[3];
    for (std::size_t i = 0; i < 400; ++i) {
      const auto body = transpose(to_matrix<Geographic>(
                            Euler<double>{ref[i].heading, ref[i].pitch, ref[i].roll})) *
                        Vec<Geographic>{ref[i].ve, ref[i].vn, ref[i].vu};
      const std::complex<double> a(dvl[i].v[1], dvl[i].v[0]), b(body.y, body.x);
      cross += std::conj(a) * b;
      square += std::norm(a);
      error[0].push_back(dvl[i].v[1] - body.y);
      error[1].push_back(dvl[i].v[0] - body.x);
      error[2].push_back(dvl[i].v[2] - body.z);
    }
    // The scale alone, before it is turned: the real part.
    EXPECT_NEAR(cross.real() / square, p.scale, 5e-5);
    EXPECT_NEAR(std::arg(cross) / deg, p.angle, 5e-4);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(deviation(error[k]), p.std[k], 1e-3) << k;
  }
}

TEST(Recording, FogMems) {
  LOXO_RECORDING("fog_mems_vehicle");
  ImuReader imu(drive, d);
  ImuIncrement<double> s;
  std::size_t n = 0;
  std::vector<double> force;
  while (imu.next(s)) ++n, force.push_back(norm(s.dv) / s.dt);
  EXPECT_EQ(n, 10001u);
  EXPECT_NEAR(median(force), 9.777, 5e-4);
  const auto ref = read_reference(drive, d).rows;
  EXPECT_EQ(ref.size(), 1000u);
  EXPECT_NEAR(path(ref), 1389.43, 1389.43 * 3e-3);  // the third dimension, or not
  std::vector<double> side, up, speed;
  for (const auto& r : ref) {
    side.push_back(wrap_pi(std::atan2(r.ve, r.vn) - r.heading) / deg);
    up.push_back((std::atan2(r.vu, std::hypot(r.ve, r.vn)) - r.pitch) / deg);
    speed.push_back(std::hypot(r.ve, r.vn, r.vu));
  }
  EXPECT_NEAR(*std::min_element(speed.begin(), speed.end()), 11.54, 0.02);
  EXPECT_NEAR(*std::max_element(speed.begin(), speed.end()), 15.77, 0.02);
  EXPECT_NEAR(median(side), -4.5779, 5e-5);
  EXPECT_NEAR(deviation(side), 0.1104, 1e-4);
  EXPECT_NEAR(median(up), 1.4228, 5e-5);
  EXPECT_NEAR(deviation(up), 0.1613, 1e-4);
}

TEST(Recording, Genivi) {
  LOXO_RECORDING("genivi_munich");
  const auto counts = read("genivi_munich/odo_counts.csv", {"t_s", "counts"});
  EXPECT_EQ(counts[1].back() - counts[1].front(), 570315.0);
  double way = 0;
  for (const auto& tick : read_odometer(drive, d)) way += tick.value;
  EXPECT_NEAR(way, 570315 * 0.010159, 1e-6);
  const auto v = read("genivi_munich/odo.csv.gz", {"t_s", "v_mps"});
  ASSERT_EQ(v[0].size(), 19115u);
  double sum = 0;
  for (std::size_t i = 0; i + 1 < v[0].size(); ++i) sum += v[1][i] * (v[0][i + 1] - v[0][i]);
  EXPECT_NEAR(sum, 5793.80, 5e-3);
  EXPECT_NEAR(sum / 570315, 0.010159, 5e-7);
  const auto g = read("genivi_munich/gnss.csv", {"t_s", "speed_mps", "course_deg"});
  double gps = 0, car = 0;
  for (std::size_t i = 0; i < g[0].size(); ++i) {
    const double at = g[0][i] - 1.0, w = linear(v[0], v[1], at);
    if (at < v[0].front() || at > v[0].back() || !(w > 3)) continue;
    gps += g[1][i], car += w;
  }
  EXPECT_NEAR(gps / car, 0.9764, 2e-4);
}

TEST(Recording, VictoriaPark) {
  LOXO_RECORDING("victoria_park_a");
  const auto odo = read_odometer(drive, d);
  EXPECT_EQ(odo.size(), 31123u);
  double sum = 0;
  for (std::size_t i = 0; i + 1 < odo.size(); ++i) sum += odo[i].value * (odo[i + 1].t - odo[i].t);
  EXPECT_NEAR(sum, 2107.22, 5e-3);
  const auto g = read("victoria_park_a/gnss.csv", {"t_s", "e_m", "n_m"});
  EXPECT_EQ(g[0].size(), 2267u);
  EXPECT_EQ(read_fixes(drive, d).size(), 2267u);
  double gap = 0;
  std::size_t jumps = 0;
  std::vector<double> ratio;
  for (std::size_t i = 1; i < g[0].size(); ++i) {
    const double dt = g[0][i] - g[0][i - 1];
    const double ds = std::hypot(g[1][i] - g[1][i - 1], g[2][i] - g[2][i - 1]);
    gap = std::max(gap, dt);
    jumps += ds > 3;
    const double w = linear(odo, 0.5 * (g[0][i] + g[0][i - 1]));
    if (dt < 0.35 && ds / dt < 12 && w > 1) ratio.push_back(ds / dt / w);
  }
  EXPECT_NEAR(gap, 51.05, 5e-3);
  EXPECT_EQ(jumps, 50u);
  EXPECT_NEAR(median(ratio), 1.0389, 3e-3);
}

TEST(Recording, Palmer) {
  LOXO_RECORDING("ship_nbp1406");
  const auto ref = read_reference(drive, d).rows;
  EXPECT_EQ(ref.size(), 625u);
  EXPECT_NEAR(path(ref), 3034.68, 3034.68 * kPlane);
  EXPECT_NEAR(ref.back().t - ref.front().t, 624, 0.05);
  const auto gyro = read("ship_nbp1406/gyrocompass.csv", {"t_s", "heading_deg"});
  EXPECT_EQ(gyro[0].size(), 5000u);
  EXPECT_EQ(read("ship_nbp1406/log_adcp.csv", {"t_s"})[0].size(), 5000u);
  EXPECT_EQ(read_fixes(drive, d).size(), 1667u);
  EXPECT_EQ(read_velocities(drive, d).size(), 4998u);  // two stamps that do not increase
  std::vector<double> error;
  double sum = 0;
  for (const auto& r : ref) {
    const double e = wrap_pi(linear(gyro[0], gyro[1], r.t) * deg - r.heading) / deg;
    error.push_back(e);
    sum += e;
  }
  EXPECT_NEAR(sum / static_cast<double>(error.size()), 0.007, 1e-3);
  EXPECT_NEAR(deviation(error), 0.373, 1e-3);
}

TEST(Recording, Polarlys) {
  struct Voyage {
    const char* name;
    std::size_t rows;
    double span, south, north, path, speed, angle, gap;
  };
  for (const Voyage& v :
       {Voyage{"2024-10-21", 112, 10703, 66.3414, 66.8708, 77279.4, 76973.8, -1.28, 180},
        {"2024-11-23", 141, 14956, 66.2002, 66.8704, 96739.3, 96364.1, 4.59, 281}}) {
    if (recording("ship_arctic_ais_a").empty())
      GTEST_SKIP() << "the recording ship_arctic_ais_a is not here (LOXO_DATA)";
    SCOPED_TRACE(v.name);
    const auto c = read(std::string("ship_arctic_ais_a/") + v.name + ".csv",
                        {"t_s", "lat_deg", "lon_deg", "speed_kn", "course_deg", "heading_deg"});
    ASSERT_EQ(c[0].size(), v.rows);
    EXPECT_EQ(c[0].back() - c[0].front(), v.span);
    EXPECT_NEAR(*std::min_element(c[1].begin(), c[1].end()), v.south, 5.1e-5);
    EXPECT_NEAR(*std::max_element(c[1].begin(), c[1].end()), v.north, 5.1e-5);
    // The path is in the plane of the first row, a knot is 0.514444 m/s.
    const double s = std::sin(c[1][0] * deg);
    const double east = prime_vertical_radius(wgs84(), s) * std::cos(c[1][0] * deg) * deg,
                 north = meridian_radius(wgs84(), s) * deg;
    double length = 0, way = 0, angle = 0, gap = 0;
    for (std::size_t i = 0; i < v.rows; ++i) {
      angle += wrap_pi((c[4][i] - c[5][i]) * deg) / deg;
      if (i == 0) continue;
      const double dt = c[0][i] - c[0][i - 1];
      way += 0.5 * (c[3][i] + c[3][i - 1]) * 0.514444 * dt;
      gap = std::max(gap, dt);
      length += std::hypot(east * (c[2][i] - c[2][i - 1]), north * (c[1][i] - c[1][i - 1]));
    }
    EXPECT_NEAR(length, v.path, v.path * 1e-3);  // which plane is not said
    EXPECT_NEAR(way, v.speed, 0.05);
    EXPECT_NEAR(angle / static_cast<double>(v.rows), v.angle, 5e-3);
    EXPECT_EQ(gap, v.gap);
  }
}

TEST(Recording, Kitti) {
  struct Set {
    const char* name;
    std::size_t rows;
    double end, force, path, turn, heading;
  };
  for (const Set& s : {Set{"2011_09_30_0020", 11350, 113.608, 9.8803, 1220.1, 359.91, 359.94},
                       {"2011_09_30_0033", 16581, 165.977, 9.9026, 1708.1, -346.50, -345.70},
                       {"2011_10_03_0034", 47909, 484.115, 9.9035, 5070.3, -311.11, -313.55},
                       {"2011_10_03_0042", 12188, 121.916, 9.9226, 2598.4, -403.67, -403.88}}) {
    const std::string set = std::string("kitti_") + s.name;
    if (recording(set).empty()) GTEST_SKIP() << "the recording " << set << " is not here";
    SCOPED_TRACE(set);
    const auto c = read(set + "/imu.csv.gz", {"t_s", "gz", "ax", "ay", "az"});
    ASSERT_EQ(c[0].size(), s.rows);
    EXPECT_NEAR(c[0].back(), s.end, 5.1e-4);
    std::vector<double> force;
    double turn = 0;
    for (std::size_t i = 0; i < s.rows; ++i) {
      force.push_back(std::hypot(c[2][i], c[3][i], c[4][i]));
      if (i > 0) turn += 0.5 * (c[1][i] + c[1][i - 1]) * (c[0][i] - c[0][i - 1]);
    }
    EXPECT_NEAR(median(force), s.force, 5.1e-5);
    EXPECT_NEAR(turn / deg, s.turn, 5.1e-3);
    Diagnostics d;
    const Drive drive =
        read_drive(std::string(testing::source_folder()) + "/examples/drives/" + set);
    const auto ref = read_reference(drive, d).rows;
    double heading = 0;
    for (std::size_t i = 1; i < ref.size(); ++i)
      heading -= wrap_pi(ref[i].heading - ref[i - 1].heading) / deg;
    EXPECT_NEAR(heading, s.heading, 0.1);  // every fifth row: up to 0.04 s short of the end
    double way = 0;
    const auto en = read(set + "/reference.csv.gz", {"e_m", "n_m"});
    for (std::size_t i = 1; i < en[0].size(); ++i)
      way += std::hypot(en[0][i] - en[0][i - 1], en[1][i] - en[1][i - 1]);
    EXPECT_NEAR(way, s.path, s.path * kPlane);
    EXPECT_NEAR(path(ref), s.path, s.path * 2e-3);  // with its slopes
    ImuReader imu(drive, d);
    ImuIncrement<double> u;
    std::size_t n = 0;
    while (imu.next(u)) ++n;
    EXPECT_EQ(n, s.rows);
  }
}

TEST(Recording, Adis16405) {
  LOXO_RECORDING("static_adis16405_1");
  const auto c = read("static_adis16405_1/imu_counts.csv.gz", {"gx", "gy", "gz", "ax", "ay", "az"});
  ASSERT_EQ(c[0].size(), 1000000u);
  const double mean[] = {0.401686, -0.415849, -0.293543, -0.004411, -0.002353, -1.016129};
  struct Allan {
    std::size_t m;
    double sigma[6];
  };
  const Allan allan[] = {{1, {0.31912, 0.33690, 0.38489, kNone, kNone, kNone}},
                         {100, {0.040900, 0.043017, 0.038668, 0.0007207, 0.0005122, 0.0006206}},
                         {10000, {0.007224, 0.008442, 0.008173, 0.0003381, 0.0002845, 0.0002406}}};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const double unit = axis < 3 ? 0.05 : 0.00333;
    std::vector<double> sum(1, 0.0);
    for (double x : c[axis]) sum.push_back(sum.back() + x * unit);
    EXPECT_NEAR(sum.back() / 1e6, mean[axis], 5.1e-7) << axis;
    for (const Allan& a : allan) {
      if (std::isnan(a.sigma[axis])) continue;
      double square = 0;
      std::size_t n = 0;
      for (std::size_t i = 0; i + 2 * a.m < sum.size(); ++i, ++n)
        square += std::pow(sum[i + 2 * a.m] - 2 * sum[i + a.m] + sum[i], 2);
      const double sigma =
          std::sqrt(0.5 * square / static_cast<double>(n)) / static_cast<double>(a.m);
      EXPECT_NEAR(sigma / a.sigma[axis], 1, 2e-4) << axis << " at " << a.m;
    }
  }
  // The reader's view: SI, turned to right-forward-up.
  ImuReader imu(drive, d);
  ImuIncrement<double> s;
  Vec<Body> w{}, f{};
  for (int i = 0; i < 20000 && imu.next(s); ++i) w = w + s.dtheta, f = f + s.dv;
  EXPECT_GT(f.z, 0.98 * 9.8 * 200);
}

TEST(Recording, LaserGyro) {
  LOXO_RECORDING("static_lasergyro_a");
  ImuReader imu(drive, d);
  ImuIncrement<double> s;
  Vec<Body> w{}, f{};
  std::size_t n = 0;
  double t = 0;
  while (imu.next(s)) ++n, t += s.dt, w = w + s.dtheta, f = f + s.dv;
  EXPECT_EQ(n, 90000u);
  w = w * (1 / t / deg_per_h), f = f * (1 / t);
  EXPECT_NEAR(w.x, -12.3666,
              1e-3);  // stamps end at the last row; a mean over rows is not over time
  EXPECT_NEAR(w.y, 0.7828, 1e-3);
  EXPECT_NEAR(w.z, 8.3548, 1e-3);
  EXPECT_NEAR(norm(w), 14.9448, 1e-3);
  EXPECT_NEAR(f.x, -0.05400, 2e-5);
  EXPECT_NEAR(f.y, 0.15010, 2e-5);
  EXPECT_NEAR(f.z, 9.79417, 2e-5);
  EXPECT_NEAR(norm(f), 9.79547, 2e-5);
  // North is where the Earth's turn, seen level, points: heading of the forward axis.
  const Vec<Body> up = f * (1 / norm(f));
  const Vec<Body> north = w - up * dot(w, up);
  const Vec<Body> east = cross(north, up);
  EXPECT_NEAR(wrap_pi(std::atan2(east.y, north.y)) / deg, 86.963, 0.02);
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
