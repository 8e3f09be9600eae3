// SPDX-License-Identifier: Apache-2.0
// Wheels as recorded drives have them: no sign while the car reverses, a clock of their own that
// drifts, a speed in whole km/h that is cut. Whole drives on disk through `filter_drive`, settings
// from their own description; the error stays inside the filter's own 99.9 % band.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include "loxo/estimate/exact_route.hpp"
#include "loxo/study/filter_drive.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

namespace fs = std::filesystem;
constexpr double kStep = 0.02, kScaleTrue = 0.99, kEpsTrue = 1.0 * deg;
constexpr double kKmh = 1 / 3.6;

// Rest, a drive with turns and two stops; `reverses`: after each stop it backs out, once in a turn.
struct Profile {
  bool reverses = false;
  double speed(double t) const {
    struct Part {
      double begin, end, v;  // accelerates and brakes by 1 m/s^2
    };
    static constexpr Part kParts[] = {{20, 110, 12},  {120, 145, -3}, {150, 260, 15},
                                      {270, 292, -2}, {300, 400, 11}, {410, 600, 14}};
    for (const Part& p : kParts) {
      if (!reverses && p.v < 0) continue;
      const double v = std::min({t - p.begin, p.end - t, std::fabs(p.v)});
      if (v > 0) return std::copysign(v, p.v);
    }
    return 0;
  }
  double course(double t) const {
    double c = 0.6;
    for (const auto& [start, angle] : {std::pair{45.0, 80.0},
                                       {80.0, -60.0},
                                       {128.0, 45.0},
                                       {180.0, 90.0},
                                       {230.0, -70.0},
                                       {340.0, 85.0},
                                       {440.0, -90.0},
                                       {500.0, 60.0},
                                       {550.0, -80.0}})
      c += angle * deg * std::clamp((t - start) * 6.0 / std::fabs(angle), 0.0, 1.0);
    return c;
  }
};

struct Wheel {
  const char* kind = "speed";
  double interval = 1;  // s
  bool has_sign = true;
  double quantum = 0;           // m/s or m; cut
  double noise = 0.05;          // m/s, white, of a speed
  double early = 0, drift = 0;  // stamps are t (1 + drift) - early
};

struct Result {
  FilterResult filter;
  double worst = 0;    // error in sigmas of the plane, at its worst row
  double end_pct = 0;  // of the way
  double tau_true = 0;
};

class RealWheel : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("loxo_wheel_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Result run(const ExactRoute& route, const Wheel& wheel, std::uint64_t seed) {
    std::mt19937_64 rng(seed);
    std::normal_distribution<double> g;
    auto three = [&](double x) { return Vec<Body>{x * g(rng), x * g(rng), x * g(rng)}; };
    const double gyro_noise = 0.05 * deg_per_sqrt_h, accel_noise = 0.02 * mps_per_sqrt_h;
    const Vec<Body> bg = three(1 * deg_per_h), ba = three(300 * ug);
    std::ofstream imu(folder_ / "imu.csv"), odo(folder_ / "odo.csv");
    imu.precision(17), odo.precision(17);
    imu << "t_s,gx,gy,gz,ax,ay,az\n";
    odo << "t_s,value\n";
    const auto every = static_cast<std::size_t>(std::lround(wheel.interval / kStep));
    double told = 0, way = 0;
    for (std::size_t i = 1; i < route.q.size(); ++i) {
      const Vec<Body> w = route.dtheta[i] + bg * kStep + three(gyro_noise * std::sqrt(kStep)),
                      f = route.dv[i] + ba * kStep + three(accel_noise * std::sqrt(kStep));
      const double t = static_cast<double>(i) * kStep;
      imu << t << ',' << w.x << ',' << w.y << ',' << w.z << ',' << f.x << ',' << f.y << ',' << f.z
          << '\n';
      const double ds = kScaleTrue * (route.distance[i] - route.distance[i - 1]);
      way += wheel.has_sign ? ds : std::fabs(ds);
      if (i % every != 0) continue;
      double value = kScaleTrue * route.speed[i];
      if (value != 0) value += wheel.noise * g(rng);
      if (!wheel.has_sign) value = std::fabs(value);
      if (std::string(wheel.kind) != "speed") {
        const double count = std::floor(way / wheel.quantum) * wheel.quantum;
        value = count - told;
        told = count;
      } else if (wheel.quantum > 0) {
        value = std::trunc(value / wheel.quantum) * wheel.quantum;
      }
      odo << t * (1 + wheel.drift) - wheel.early << ',' << value << '\n';
    }
    imu.close(), odo.close();
    // Level and heading as an alignment leaves them: the heading is 0.5 deg off by one sigma.
    const Euler<double> e =
        to_euler(geographic_axes(route.place[0].lat, route.place[0].lon) * to_matrix(route.q[0]));
    std::ofstream(folder_ / "drive.toml")
        << "format = 1\nname = \"wheel\"\n[imu]\nfile = \"imu.csv\"\nkind = \"increment\"\n"
           "columns = { time = \"t_s\", gyro = [\"gx\", \"gy\", \"gz\"], accel = [\"ax\", \"ay\", "
           "\"az\"] }\nunits = { gyro = \"rad\", accel = \"m/s\" }\n"
           "errors = { gyro_bias = \"1 deg/h\", gyro_noise = \"0.05 deg/sqrt(h)\", accel_bias = "
           "\"300 ug\", accel_noise = \"0.02 m/s/sqrt(h)\" }\n[odometer]\nfile = \"odo.csv\"\nkind "
           "= \""
        << wheel.kind << "\"\ncolumns = { time = \"t_s\", value = \"value\" }\nunits = { value = \""
        << (std::string(wheel.kind) == "speed" ? "m/s" : "m") << "\" }\n"
        << (wheel.quantum > 0 ? "errors = { quantisation = \"" + std::to_string(wheel.quantum) +
                                    (std::string(wheel.kind) == "speed" ? " m/s\" }\n" : " m\" }\n")
                              : "")
        << "[start]\nt_s = 0\nlat_deg = " << std::to_string(route.place[0].lat / deg)
        << "\nlon_deg = " << std::to_string(route.place[0].lon / deg)
        << "\nh_m = 120\nattitude = { heading = \""
        << std::to_string(e.heading / deg + 0.5 * g(rng))
        << " deg\", heading_std = \"0.5 deg\" }\n";
    const Drive drive = read_drive((folder_ / "drive.toml").string());
    FilterOptions options;
    options.output_period = 1;
    Diagnostics told_of;
    Result out;
    double begin_e = kNone, begin_n = kNone;
    out.filter = filter_drive(
        drive, options,
        [&](const SolutionRow& r) {
          const auto i =
              std::min(static_cast<std::size_t>(std::lround(r.t / kStep)), route.q.size() - 1);
          const double m = 6.37e6;
          const double de = (r.lon - route.place[i].lon) * m * std::cos(r.lat),
                       dn = (r.lat - route.place[i].lat) * m;
          if (std::isnan(begin_e)) begin_e = de, begin_n = dn;
          const double error = std::hypot(de, dn), sigma = std::hypot(r.std_e, r.std_n);
          // The root sum of both axes bounds the larger one.
          out.worst = std::max(out.worst, error / sigma);
          out.end_pct = 100 * error / way;
        },
        told_of);
    out.tau_true = wheel.drift * (static_cast<double>(route.q.size() - 1) * kStep) - wheel.early;
    return out;
  }
  static double constant(const Result& r, const std::string& name, bool std = false) {
    for (const Estimated& e : r.filter.constants)
      if (e.name == name) return std ? e.std : e.value;
    ADD_FAILURE() << name;
    return kNone;
  }

  fs::path folder_;
};

constexpr double kPlane = 3.7169;  // sqrt(-2 ln 0.001): 99.9 % of a plane normal
constexpr double kLine = 3.2905;   // 99.9 % of one constant
int runs() { return std::getenv("LOXO_LONG") ? 40 : 3; }

ExactRoute route_of(const Profile& p, double length) {
  return make_exact_route(
      wgs84(), Geodetic<double>{-40 * deg, 170 * deg, 120}, [=](double t) { return p.course(t); },
      [=](double t) { return p.speed(t); }, length, kStep, kEpsTrue);
}

TEST_F(RealWheel, WithoutASignStillReversesTwice) {
  const std::uint64_t seed = testing::seed(31);
  const ExactRoute route = route_of({true}, 450);
  for (const Wheel& wheel : {Wheel{"speed", 1, false}, Wheel{"distance", 0.1, false, 0.02},
                             Wheel{"speed", 1, true}, Wheel{"distance", 0.1, true, 0.02}}) {
    SCOPED_TRACE(std::string(wheel.kind) + (wheel.has_sign ? " with sign" : " without sign"));
    for (int i = 0; i < runs(); ++i) {
      const Result r = run(route, wheel, seed + static_cast<std::uint64_t>(i));
      std::printf("%s %d: worst %.2f sigma, end %.3f %%, signs %ld, k %.4f +- %.4f\n", wheel.kind,
                  wheel.has_sign, r.worst, r.end_pct, r.filter.events.signs_turned,
                  constant(r, "k"), constant(r, "k", true));
      EXPECT_LT(r.worst, kPlane);
      EXPECT_EQ(r.filter.events.signs_turned > 0, !wheel.has_sign);
      EXPECT_EQ(r.filter.events.slip + r.filter.events.skid, 0);
      EXPECT_NEAR(constant(r, "k"), kScaleTrue, kLine * constant(r, "k", true));
      EXPECT_NEAR(constant(r, "eps_deg"), kEpsTrue / deg, kLine * constant(r, "eps_deg", true));
    }
  }
}

TEST_F(RealWheel, AClockThatDriftsIsFollowed) {
  const std::uint64_t seed = testing::seed(31);
  const ExactRoute route = route_of({false}, 600);
  Wheel wheel{"speed", 1, true};
  wheel.early = 0.45, wheel.drift = 3e-4;
  for (int i = 0; i < runs(); ++i) {
    const Result r = run(route, wheel, seed + static_cast<std::uint64_t>(i));
    const double tau = constant(r, "delay_s"), std = constant(r, "delay_s", true);
    std::printf("worst %.2f sigma, end %.3f %%, delay %.3f +- %.3f (true %.3f)\n", r.worst,
                r.end_pct, tau, std, r.tau_true);
    EXPECT_LT(r.worst, kPlane);
    EXPECT_NEAR(tau, r.tau_true, kLine * std);
    EXPECT_LT(std, 0.06);  // it is known at all: 0.5 s before the drive
    EXPECT_NEAR(constant(r, "k"), kScaleTrue, kLine * constant(r, "k", true));
  }
}

// A speed in whole km/h, cut: half a unit too small in the mean.
TEST_F(RealWheel, ASpeedInWholeUnitsHasAnOffset) {
  const std::uint64_t seed = testing::seed(31);
  const ExactRoute route = route_of({false}, 600);
  Wheel wheel{"speed", 1, true, kKmh};
  wheel.early = 0.3;
  for (int i = 0; i < runs(); ++i) {
    const Result r = run(route, wheel, seed + static_cast<std::uint64_t>(i));
    const double b = constant(r, "speed_offset_mps"), std = constant(r, "speed_offset_mps", true);
    std::printf("worst %.2f sigma, end %.3f %%, offset %.3f +- %.3f\n", r.worst, r.end_pct, b, std);
    EXPECT_LT(r.worst, kPlane);
    EXPECT_NEAR(b, -0.5 * kKmh, kLine * std);
    EXPECT_LT(std, 0.25 * kKmh);
  }
}

}  // namespace
}  // namespace loxo
