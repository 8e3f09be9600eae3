// SPDX-License-Identifier: Apache-2.0
// The acceptance simulation of vehicle.md 7.3, its truth by a non-linear 100 Hz mechanization,
// sensors as listed there, the filters fed with what such sensors say. A few runs here; 400 a route
// with LOXO_LONG=1, and then the gates themselves.
#include "loxo/estimate/segmented.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "loxo/estimate/exact_route.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr double kDt = 0.01, kMounting = 1.0 * deg, kPreset = 0.02;
const Ellipsoid& ell() { return wgs84(); }

using Turns = std::vector<std::pair<double, double>>;
double course_of(const Turns& turns, double t) {
  double c = 30 * deg;
  for (const auto& [start, angle] : turns)
    c += angle * deg * std::clamp((t - start) * 6.0 / std::fabs(angle), 0.0, 1.0);
  return c;
}
// vehicle.md 7.3: accelerate by 1 m/s^2 to 20 m/s, turns at 6 deg/s.
ExactRoute make_route(const Turns& turns, double length) {
  return make_exact_route(
      ell(), Geodetic<double>{40 * deg, 20 * deg, 0}, [&](double t) { return course_of(turns, t); },
      [](double t) { return std::min(20.0, t); }, length, kDt, kMounting);
}

struct RunResult {
  double found_k = 0, found_mu = 0;  // share of the preset found at 120 s
  std::vector<double> weighted, naive, ci, ins, dr,
      joint;  // error in % of distance, every 60 s from 120 s
  double switch_t = 0;
  bool forced = false;
  double nees_joint = 0;
};

RunResult run(const ExactRoute& route, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> g;
  const double arw = 0.001 * deg_per_sqrt_h, vrw = 5 * ug;
  const Vec<Body> bg{0.01 * deg_per_h * g(rng), 0.01 * deg_per_h * g(rng),
                     0.01 * deg_per_h * g(rng)};
  const Vec<Body> ba{30 * ug * g(rng), 30 * ug * g(rng), 30 * ug * g(rng)};
  SegmentedConfig c;
  c.ellipsoid = ell();
  c.gyro_bias = 0.01 * deg_per_h, c.gyro_noise = arw, c.accel_bias = 30 * ug, c.accel_noise = vrw;
  c.level_std = 1 * arcsec, c.heading_std = 0.3 * arcmin;
  c.quantisation = 0.05;
  SegmentedStart s;
  s.place = route.place[0];
  const Rot<Geographic, Body> C0 =
      geographic_axes(s.place.lat, s.place.lon) * to_matrix(route.q[0]);
  // Alignment from its causes (6.1).
  const Vec<Geographic> gn = C0 * bg, an = C0 * ba;
  const double gamma = normal_gravity(ell(), std::sin(40 * deg), 0.0),
               wn = ell().w_ie * std::cos(40 * deg), wu = ell().w_ie * std::sin(40 * deg);
  const double phi_n = an.x / gamma + arcsec * g(rng), phi_e = -an.y / gamma + arcsec * g(rng);
  const double phi_u = (-gn.x + wu * phi_n) / wn + 0.3 * arcmin * g(rng);
  s.C_nb =
      to_matrix(exp_rotation<Geographic, Geographic>(Vec<Geographic>{-phi_e, -phi_n, -phi_u})) * C0;
  SegmentedNavigator nav(c, s);
  RunResult out;
  double slip = 0, white = 0, slow = 3e-4 * g(rng), indicated = 0, pulses = 0, last_distance = 0;
  const double walk = 3e-4 * std::sqrt(1 - std::exp(-2.0 / 600)), decay = std::exp(-1.0 / 600);
  const int n = static_cast<int>(route.dtheta.size()) - 1;
  for (int i = 1; i <= n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    double jump = 0;
    if ((i - 1) % 100 == 0) {  // a new second
      const double next = 0.05 * deg * g(rng);
      jump = next - slip;
      slip = next;
      white = 1e-3 * g(rng);
      slow = decay * slow + walk * g(rng);
    }
    // Side slip: the body stands turned clockwise against the way by `slip`; body axes turn by
    // -slip about up.
    const double cs = std::cos(slip), ss = std::sin(slip);
    auto turned = [&](const Vec<Body>& v) {
      return Vec<Body>{cs * v.x - ss * v.y, ss * v.x + cs * v.y, v.z};
    };
    ImuIncrement<double> u;
    u.t = i * kDt, u.dt = kDt;
    const double nw = arw * std::sqrt(kDt), nf = vrw * std::sqrt(kDt);
    u.dtheta = turned(route.dtheta[k]) + bg * kDt +
               Vec<Body>{nw * g(rng), nw * g(rng), nw * g(rng) - jump};
    u.dv = turned(route.dv[k]) + ba * kDt + Vec<Body>{nf * g(rng), nf * g(rng), nf * g(rng)};
    nav.imu(u);
    indicated += (1 + kPreset) * (1 + white + slow) * (route.distance[k] - last_distance);
    last_distance = route.distance[k];
    if (i % 10 != 0) continue;
    const double count = std::floor(indicated / c.quantisation) * c.quantisation,
                 ds = count - pulses;
    pulses = count;
    if (!nav.odometer({u.t, ds, false})) continue;
    const SegmentedEpoch& e = nav.epoch();
    const long second = std::lround(e.t);
    if (second == 120) {
      out.found_k = 1 - std::fabs(e.k - 1 - kPreset) / kPreset;
      out.found_mu = 1 - std::fabs(e.mu - kMounting) / kMounting;
    }
    if (e.switched) out.switch_t = e.t, out.forced = e.forced;
    if (second >= 120 && second % 60 == 0) {
      const Geodetic<double>& truth = route.place[k];
      const double N = prime_vertical_radius(ell(), std::sin(truth.lat)) * std::cos(truth.lat),
                   M = meridian_radius(ell(), std::sin(truth.lat));
      auto error = [&](const Horizontal& h) {
        return std::hypot((h.lon - truth.lon) * N, (h.lat - truth.lat) * M) / route.distance[k] *
               100;
      };
      out.weighted.push_back(error(e.weighted));
      out.naive.push_back(error(e.naive));
      out.ci.push_back(error(e.intersection));
      out.ins.push_back(error(e.ins));
      out.dr.push_back(error(e.reckoned));
      out.joint.push_back(error(e.joint));
      const double de = (e.joint.lon - truth.lon) * N, dn = (e.joint.lat - truth.lat) * M;
      const double a = e.joint.cov[0], b = e.joint.cov[1], d = e.joint.cov[2];
      out.nees_joint = (d * de * de - 2 * b * de * dn + a * dn * dn) / (a * d - b * b);
    }
  }
  return out;
}

double quantile(std::vector<double> v, double q) {
  std::sort(v.begin(), v.end());
  const double i = q * static_cast<double>(v.size() - 1);
  const auto k = static_cast<std::size_t>(i);
  return k + 1 < v.size() ? v[k] + (i - static_cast<double>(k)) * (v[k + 1] - v[k]) : v[k];
}

struct Gates {
  const char* name;
  std::vector<std::pair<double, double>> turns;
};

TEST(Segmented, AcceptanceOfTheThreeRoutes) {  // vehicle.md 7.3; (V-54) to (V-60)
  const bool all = std::getenv("LOXO_LONG") != nullptr;
  const char* given = std::getenv("LOXO_TEST_SEED");
  const unsigned seed = given ? static_cast<unsigned>(std::atoi(given)) : 1u;
  const int runs = all ? 400 : 6;
  const double length = all ? 3600 : 900;
  std::printf("seed %u, %d runs a route, %.0f s\n", seed, runs, length);
  std::vector<Gates> routes = {{"straight", {}},
                               {"mixed",
                                {{60, 40},
                                 {150, -70},
                                 {300, 90},
                                 {480, -60},
                                 {700, -50},
                                 {900, 80},
                                 {1200, 30},
                                 {1500, -100},
                                 {1800, 60},
                                 {2100, -40},
                                 {2400, 90},
                                 {2700, -60},
                                 {3000, -30},
                                 {3300, 45}}},
                               {"closed", {}}};
  for (int i = 1; i < 12; ++i) routes[2].turns.emplace_back(300.0 * i, 90.0);
  for (const Gates& gate : routes) {
    const ExactRoute route = make_route(gate.turns, length);
    std::vector<RunResult> r;
    for (int i = 0; i < runs; ++i)
      r.push_back(run(route, seed + 1000003u * static_cast<unsigned>(i)));
    std::vector<double> fk, fm;
    double nees = 0;
    int forced = 0;
    for (const RunResult& x : r) {
      fk.push_back(x.found_k), fm.push_back(x.found_mu);
      nees += x.nees_joint / runs;
      forced += x.forced;
    }
    auto column = [&](auto member, std::size_t i) {
      std::vector<double> v;
      for (const RunResult& x : r) v.push_back((x.*member)[i]);
      return v;
    };
    const std::size_t epochs = r[0].weighted.size();
    double worst[3] = {0, 0, 0}, ratio = 0;
    for (std::size_t i = 0; i < epochs; ++i) {
      const double w = quantile(column(&RunResult::weighted, i), 0.95),
                   a = quantile(column(&RunResult::ins, i), 0.95),
                   b = quantile(column(&RunResult::dr, i), 0.95);
      worst[0] = std::max(worst[0], w);
      worst[1] = std::max(worst[1], quantile(column(&RunResult::naive, i), 0.95));
      worst[2] = std::max(worst[2], quantile(column(&RunResult::ci, i), 0.95));
      ratio = std::max(ratio, w / std::min(a, b));
    }
    auto end = [&](auto member) {
      const auto v = column(member, epochs - 1);
      std::printf(" %.3f/%.3f", quantile(v, 0.5), quantile(v, 0.95));
    };
    std::printf(
        "%-8s dK found %.1f %% (5 %%: %.1f, worst %.1f), mu %.1f %% (5 %%: %.1f, worst %.1f); "
        "forced %d\n",
        gate.name, 100 * quantile(fk, 0.5), 100 * quantile(fk, 0.05), 100 * quantile(fk, 0),
        100 * quantile(fm, 0.5), 100 * quantile(fm, 0.05), 100 * quantile(fm, 0), forced);
    std::printf(
        "   95 %% of distance, worst t: weighted %.3f, naive %.3f, CI %.3f; weighted/best %.2f; "
        "end (50/95): INS",
        worst[0], worst[1], worst[2], ratio);
    end(&RunResult::ins);
    std::printf(", DR");
    end(&RunResult::dr);
    std::printf(", weighted");
    end(&RunResult::weighted);
    std::printf(", joint");
    end(&RunResult::joint);
    std::printf("; joint NEES(2) %.2f\n", nees);
    EXPECT_GE(quantile(fk, 0), 0.90);
    EXPECT_GE(quantile(fm, 0), 0.90);
    if (all) {
      EXPECT_GE(quantile(fk, 0.05), 0.94);
      EXPECT_GE(quantile(fm, 0.05), 0.94);
      EXPECT_LE(worst[0], 0.20);
      EXPECT_LE(ratio, 1.1);
      if (std::string(gate.name) == "mixed") {
        EXPECT_LE(quantile(column(&RunResult::joint, epochs - 1), 0.95), 0.06);
      }
    } else {
      // Six runs: each within what 400 showed at worst, 0.35 % (phi_U at three sigma is 0.26 % of a
      // straight way).
      EXPECT_LE(worst[0], 0.35);
    }
  }
}

// (V-57) is the minimum of (V-60) over all weights; (V-59) never claims less than the better input
// in trace.
TEST(Segmented, WeightsAreWhatTheyClaim) {
  std::mt19937 rng(std::random_device{}());
  std::normal_distribution<double> g;
  for (int n = 0; n < 50; ++n) {
    double L[4][4], P[4][4];
    for (auto& row : L)
      for (double& e : row) e = g(rng);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        P[i][j] = i == j ? 0.1 : 0;
        for (int k = 0; k < 4; ++k) P[i][j] += L[i][k] * L[j][k];
      }
    const double a[4] = {P[0][0], P[0][1], P[1][0], P[1][1]},
                 b[4] = {P[2][2], P[2][3], P[3][2], P[3][3]},
                 x[4] = {P[0][2], P[0][3], P[1][2], P[1][3]};
    double w[4], p[4], wn[4], pn[4], wc[4], pc[4];
    weight_minimum_variance(a, b, x, w, p);
    weight_naive(a, b, x, wn, pn);
    weight_intersection(a, b, wc, pc);
    EXPECT_LE(p[0] + p[3], pn[0] + pn[3] + 1e-9);
    EXPECT_LE(p[0] + p[3], std::min(a[0] + a[3], b[0] + b[3]) + 1e-9);
    EXPECT_LE(pc[0] + pc[3], std::min(a[0] + a[3], b[0] + b[3]) * (1 + 1e-6));
    // Where the cross covariance is zero the first two agree.
    const double zero[4] = {0, 0, 0, 0};
    weight_minimum_variance(a, b, zero, w, p);
    weight_naive(a, b, zero, wn, pn);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(w[i], wn[i], 1e-9);
  }
}

}  // namespace
}  // namespace loxo
