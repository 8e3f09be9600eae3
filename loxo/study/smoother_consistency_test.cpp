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
#include "loxo/study/consistency.hpp"
#include "loxo/study/simulated_vehicle.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

struct Sums {
  std::vector<double> nine;           // mean NEES of the nine navigation states, by epoch
  double k = 0, eps = 0;              // at the start of the drive, mean squares in sigmas
  double position = 0, filtered = 0;  // m, rms of both
  long epochs = 0;
};
Sums run(const char* name, double length, int runs, std::uint64_t seed) {
  VehicleErrors e = tactical_vehicle();
  e.tau_std = 0, e.fix_every = 30;
  const double rate = 50;
  const RouteTruth route = route_truth(acceptance_route(name, length), rate);
  Sums out;
  for (int r = 0; r < runs; ++r) {
    SimulatedVehicle vehicle(route, e, seed, static_cast<std::uint64_t>(r));
    SmootherTape tape;
    Navigator nav(filter_config(e, route.dt));
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
  const std::uint64_t seed = testing::seed(1);
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
        "%s, %d runs: NEES/9 %.2f, %.0f %% of epochs inside, k %.2f eps %.2f, "
        "position rms %.2f m (filter %.2f)\n",
        name, runs, mean / 9, 100 * share, s.k, s.eps, s.position, s.filtered);
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
