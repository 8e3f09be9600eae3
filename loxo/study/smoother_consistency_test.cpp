// SPDX-License-Identifier: Apache-2.0
// Is the smoother's covariance true, at every epoch of the drive and for the constants? Runs on
// non-linear truth; with a long gap of the inertial unit in them as well. [EST-17]
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "loxo/estimate/navigator.hpp"
#include "loxo/estimate/smoother.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/consistency.hpp"
#include "loxo/study/simulated_vehicle.hpp"

namespace loxo {
namespace {

VehicleErrors sensors() {
  VehicleErrors e;
  e.gyro_bias = 1 * deg_per_h, e.gyro_noise = 0.05 * deg_per_sqrt_h;
  e.accel_bias = 300 * ug, e.accel_noise = 0.02 * mps_per_sqrt_h;
  e.gyro_bias_walk = 0.3 * e.gyro_bias * std::sqrt(2.0 / 3600);
  e.accel_bias_walk = 0.3 * e.accel_bias * std::sqrt(2.0 / 3600);
  e.scale_std = 0.03, e.eps_h_std = e.eps_p_std = 2 * deg, e.scale_walk = 3e-5;
  e.scale_noise = 1e-3, e.distance_noise = 0.01, e.quantisation = 0.001;
  e.lever_std = 0.3;
  e.side = 0.02, e.up = 0.03, e.side_turn = 0.02;
  e.level_std = 0.003 * deg, e.heading_std = 0.5 * deg;
  e.position_std = 1, e.velocity_std = 0.02;
  e.fix_every = 30;
  return e;
}
NavigatorConfig config_of(const VehicleErrors& e, double dt) {
  NavigatorConfig c;
  c.ellipsoid = wgs84();
  c.imu_interval = dt;
  c.gyro_noise = e.gyro_noise, c.gyro_bias = e.gyro_bias;
  c.accel_noise = e.accel_noise, c.accel_bias = e.accel_bias;
  c.scale_std = e.scale_std, c.scale_walk = e.scale_walk;
  c.quantisation = e.quantisation, c.scale_noise = e.scale_noise;
  c.nhc_side = e.side, c.nhc_up = e.up, c.nhc_turn = e.side_turn, c.nhc_std = 1e-4;
  c.distance_std = e.distance_noise, c.stamp_jitter = 0;
  c.use_zupt = false;  // the simulated vehicle stands exactly still: the band would be too wide
  c.standstill.sigma_w = 3 * e.gyro_noise / std::sqrt(dt);
  c.standstill.sigma_f = 3 * e.accel_noise / std::sqrt(dt);
  return c;
}

struct Sums {
  std::vector<double> nine;           // mean NEES of the nine navigation states, by epoch
  double k = 0, eps = 0;              // at the start of the drive, mean squares in sigmas
  double position = 0, filtered = 0;  // m, rms of both
  long epochs = 0;
};
Sums run(const char* name, double length, int runs, std::uint64_t seed) {
  const VehicleErrors e = sensors();
  const double rate = 50;
  const RouteTruth route = route_truth(acceptance_route(name, length), rate);
  Sums out;
  for (int r = 0; r < runs; ++r) {
    SimulatedVehicle vehicle(route, e, seed, static_cast<std::uint64_t>(r));
    SmootherTape tape;
    Navigator nav(config_of(e, route.dt));
    nav.set_tape(&tape);
    nav.start({vehicle.start(), vehicle.start_covariance()});
    std::vector<NominalState> truth = {vehicle.truth()};
    while (vehicle.next()) {
      if (vehicle.tick()) nav.odometer(*vehicle.tick());
      if (vehicle.fix()) nav.fix(*vehicle.fix());
      nav.imu(vehicle.imu());
      if (std::floor(vehicle.t() + 0.5 / rate) == std::floor(vehicle.t() - 0.5 / rate)) continue;
      truth.push_back(vehicle.truth());
      const Vec<Ecef> d = nav.state().r - truth.back().r;
      out.filtered += dot(d, d);
    }
    tape.smooth([&](const NominalState& s, const Covariance<kStates>& P, std::uint32_t) {
      const auto i = static_cast<std::size_t>(std::lround(s.t));
      if (i >= truth.size() || std::fabs(s.t - static_cast<double>(i)) > 1e-6) return;
      if (out.nine.size() < truth.size()) out.nine.resize(truth.size());
      out.nine[i] += nees_of(s, P, truth[i]).nine / runs;
      const Vec<Ecef> d = s.r - truth[i].r;
      out.position += dot(d, d);
      ++out.epochs;
      if (i != 0) return;
      const double dk = s.scale - truth[0].scale, de = s.eps_h - truth[0].eps_h;
      out.k += dk * dk / P.p[kScale][kScale] / runs;
      out.eps += de * de / P.p[kEpsH][kEpsH] / runs;
    });
  }
  out.position = std::sqrt(out.position / static_cast<double>(out.epochs));
  out.filtered = std::sqrt(out.filtered / static_cast<double>(out.epochs));
  return out;
}

TEST(SmootherConsistency, NeesIsInItsBand) {
  const bool all = std::getenv("LOXO_LONG") != nullptr;
  const char* given = std::getenv("LOXO_TEST_SEED");
  const std::uint64_t seed = given ? std::strtoull(given, nullptr, 10) : 1;
  const int runs = all ? 100 : 10;
  for (const char* name : {"straight", "mixed"}) {
    const Sums s = run(name, all ? 400 : 120, runs, seed);
    const Band band = chi_square_band(9, runs), one = chi_square_band(1, runs, 1 - 1e-6),
               wide = chi_square_band(9, runs, 1 - 1e-6);
    int inside = 0;
    double mean = 0;
    for (const double x : s.nine) {
      inside += x > band.low && x < band.high;
      mean += x / static_cast<double>(s.nine.size());
    }
    const double share = inside / static_cast<double>(s.nine.size());
    std::printf(
        "%s, seed %llu, %d runs: NEES/9 %.2f, %.0f %% of epochs inside, k %.2f eps %.2f, "
        "position rms %.2f m (filter %.2f)\n",
        name, static_cast<unsigned long long>(seed), runs, mean / 9, 100 * share, s.k, s.eps,
        s.position, s.filtered);
    // A run's epochs are one draw: their mean scatters at most as one epoch's does, and the share
    // of epochs inside says little.
    EXPECT_GT(mean, wide.low) << name;
    EXPECT_LT(mean, wide.high) << name;
    for (const double x : {s.k, s.eps}) {
      EXPECT_GT(x, one.low) << name;
      EXPECT_LT(x, one.high) << name;
    }
    EXPECT_LT(s.position, s.filtered) << name;
  }
}

}  // namespace
}  // namespace loxo
