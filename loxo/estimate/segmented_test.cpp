// SPDX-License-Identifier: Apache-2.0
// The segmented method law by law (vehicle.md 7): phase 1 (V-54), (V-55), (V-56), the switch rule,
// the replay, the weights (V-57), (V-58), (V-59), (V-60), the joint filter's freedom from bias. The
// gates are study/acceptance_test.
#include "loxo/estimate/segmented.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <vector>

#include "loxo/estimate/exact_route.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

// A drive from rest by 1 m/s^2 to 20 m/s, with a turn of 40 deg after a minute where asked; its
// wheel says 1 + dk times the way, its IMU stands mu clockwise of the way.
struct Vehicle {
  double lat = 40 * deg, lon = 20 * deg, course = 30 * deg, length = 240, turn = 0, rest = 0;
  double dk = 0.02, mu = 1 * deg;
  double scale_noise = 0;  // white, per second
  Vec<Body> gyro_bias, accel_bias;
  Vec<Geographic> phi;  // of the alignment
  double dt = 0.1;
};
ExactRoute route_of(const Vehicle& v) {
  return make_exact_route(
      wgs84(), {v.lat, v.lon, 0},
      [&](double t) {
        const double x = std::clamp((t - v.rest - 60) / 7, 0.0, 1.0);
        return v.course + v.turn * x;
      },
      [&](double t) { return std::clamp(t - v.rest, 0.0, 20.0); }, v.length, v.dt, v.mu);
}
SegmentedConfig config_of() {
  SegmentedConfig c;
  c.ellipsoid = wgs84();
  c.gyro_bias = 0.01 * deg_per_h, c.gyro_noise = 0.001 * deg_per_sqrt_h;
  c.accel_bias = 30 * ug, c.accel_noise = 5 * ug_per_sqrt_hz;
  c.level_std = 1 * arcsec, c.heading_std = 0.3 * arcmin;
  c.velocity_std = 3e-4;
  return c;
}
using Seen = std::function<void(const SegmentedEpoch&, std::size_t)>;
void drive(const Vehicle& v, const ExactRoute& route, const SegmentedConfig& c, std::uint64_t seed,
           const Seen& seen) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> g;
  SegmentedStart start;
  start.place = route.place[0];
  start.C_nb = to_matrix(exp_rotation<Geographic, Geographic>(-v.phi)) *
               (geographic_axes(v.lat, v.lon) * to_matrix(route.q[0]));
  SegmentedNavigator nav(c, start);
  const auto per_second = static_cast<std::size_t>(std::lround(1 / v.dt));
  for (std::size_t i = 1; i < route.dtheta.size(); ++i) {
    const double t = static_cast<double>(i) * v.dt;
    nav.imu({t, v.dt, route.dtheta[i] + v.gyro_bias * v.dt, route.dv[i] + v.accel_bias * v.dt});
    if (i % per_second != 0) continue;
    const double way = route.distance[i] - route.distance[i - per_second];
    if (nav.odometer({t, (1 + v.dk) * way * (1 + v.scale_noise * g(rng)), false}))
      seen(nav.epoch(), i);
  }
}
double miss(const Horizontal& h, const Geodetic<double>& at) {
  const double s = std::sin(at.lat), N = prime_vertical_radius(wgs84(), s) * std::cos(at.lat),
               M = meridian_radius(wgs84(), s);
  return std::hypot(wrap_pi(h.lon - at.lon) * N, (h.lat - at.lat) * M);
}

// Without sensor errors phase 1 finds the preset, the replayed track is the true one, and so are
// all weighted positions: at every latitude but the pole, over 180 deg, in the south, with no
// preset, a tiny and a large one. The large one tells (V-55) from the linear states, whose second
// order is 2.6e-3 of scale and 5e-2 of the angle there.
TEST(Segmented, WithoutSensorErrorsThePresetIsFoundAndTheTrackIsTrue) {
  struct Case {
    double lat, lon, course, dk, mu, rest;
  };
  const Case cases[] = {{40, 20, 30, 0.02, 1, 0},        {0, 0, 90, 0.02, 1, 5},
                        {-60, 179.999, 80, 0.02, -1, 0}, {85, -179.999, 270, -0.02, 1, 0},
                        {40, 20, 30, 0, 0, 0},           {40, 20, 200, 1e-6, 1e-4, 3},
                        {-30, 100, 300, 0.05, 3, 0},     {-30, 100, 300, -0.05, -3, 0}};
  for (const Case& k : cases) {
    Vehicle v;
    v.lat = k.lat * deg, v.lon = k.lon * deg, v.course = k.course * deg;
    v.dk = k.dk, v.mu = k.mu * deg, v.rest = k.rest, v.turn = 40 * deg;
    const ExactRoute route = route_of(v);
    SegmentedEpoch last, at_120;
    drive(v, route, config_of(), 1, [&](const SegmentedEpoch& e, std::size_t i) {
      last = e;
      if (e.t < 120.5) at_120 = e;
      // The joint filter holds from the first metre; what the largest preset's second order does to
      // the ticks before it is known, and tan L = 11, stay below 2e-5 of the way.
      EXPECT_LT(miss(e.ins, route.place[i]), 1e-3) << k.lat << " " << e.t;
      EXPECT_LT(miss(e.joint, route.place[i]), 0.01 + 2e-5 * e.distance) << k.lat << " " << e.t;
      if (!e.switched && e.phase == 2) {
        // 4e-4 of the way: what R(t) leaves of the preset after the least of times, and tan L = 11.
        const double limit = 0.02 + 4e-4 * e.distance;
        EXPECT_LT(miss(e.reckoned, route.place[i]), limit) << k.lat << " " << e.t;
        EXPECT_LT(miss(e.weighted, route.place[i]), limit) << k.lat << " " << e.t;
        EXPECT_LT(miss(e.naive, route.place[i]), limit) << k.lat << " " << e.t;
        EXPECT_LT(miss(e.intersection, route.place[i]), limit) << k.lat << " " << e.t;
      }
    });
    EXPECT_EQ(last.phase, 2);
    EXPECT_FALSE(last.forced);
    EXPECT_NEAR(at_120.k, 1 + v.dk, 2e-4) << k.lat << " " << k.dk;
    EXPECT_NEAR(at_120.mu, v.mu, 2e-4) << k.lat << " " << k.mu;
    EXPECT_NEAR(last.joint_k, 1 + v.dk, 3e-5) << k.lat << " " << k.dk;
    EXPECT_NEAR(last.joint_mu, v.mu, 3e-5) << k.lat << " " << k.mu;
  }
}

// A unit that stands, tilted, while its wheel is told to run: what the dead reckoning makes of ten
// increments of 20 m, and the INS of its start's velocity, free of every calibration.
struct Standing {
  double lat = 50 * deg, heading = 0.7, pitch = 0.1;
  double scale = 1, heading_error = 0, pitch_error = 0, lat_error = 0, ve = 0, vn = 0;
};
SegmentedEpoch stood(const Standing& a) {
  SegmentedConfig c = config_of();
  c.scale_std = c.mounting_std = 1e-12;
  c.scale_walk = c.mounting_walk = 0;
  const Rot<Body, Geographic> level =
      transpose(to_matrix<Geographic>(Euler<double>{a.heading, a.pitch, 0}));
  const double w = c.ellipsoid.w_ie, g = normal_gravity(c.ellipsoid, std::sin(a.lat), 0.0);
  const Vec<Body> rate = level * Vec<Geographic>{0, w * std::cos(a.lat), w * std::sin(a.lat)},
                  force = level * Vec<Geographic>{0, 0, g};
  SegmentedStart start;
  start.place = {a.lat + a.lat_error, 0.3, 0};
  start.C_nb =
      to_matrix<Geographic>(Euler<double>{a.heading + a.heading_error, a.pitch + a.pitch_error, 0});
  start.ve = a.ve, start.vn = a.vn;
  SegmentedNavigator nav(c, start);
  for (int i = 1; i <= 100; ++i) {
    nav.imu({0.1 * i, 0.1, rate * 0.1, force * 0.1});
    if (i % 10 == 0) nav.odometer({0.1 * i, a.scale * 20, false});
  }
  return nav.epoch();
}
// East and north of the reckoned position from where it started, m.
std::complex<double> way(const Standing& a) {
  const Horizontal h = stood(a).reckoned;
  const double s = std::sin(a.lat + a.lat_error), north = h.lat - a.lat - a.lat_error;
  const double middle = a.lat + a.lat_error + north / 2;
  return {(h.lon - 0.3) * prime_vertical_radius(wgs84(), std::sin(middle)) * std::cos(middle),
          north * meridian_radius(wgs84(), s)};
}
// (V-46), (V-47): an increment lies along the body's forward axis; (V-48), (V-49): as indicated, by
// the attitude in use; (V-50): what scale and azimuth do to it in first order.
TEST(Segmented, AnIncrementLiesAlongTheForwardAxis) {
  for (const double lat : {-70 * deg, 0.0, 50 * deg})
    for (const double heading : {-2.5, 0.0, 0.7, 1.9}) {
      Standing a;
      a.lat = lat, a.heading = heading;
      const std::complex<double> truth =
          200 * std::cos(a.pitch) * std::complex<double>(std::sin(heading), std::cos(heading));
      // The unit's transport turns its axes by 1e-6 while the vertical channel follows the wheel.
      EXPECT_LT(std::abs(way(a) - truth), 1e-3) << lat << " " << heading;
      Standing b = a;
      b.scale = 1.02, b.heading_error = 1 * deg, b.pitch_error = 0.5 * deg;
      EXPECT_LT(std::abs(way(b) - 200 * 1.02 * std::cos(a.pitch + 0.5 * deg) *
                                      std::complex<double>(std::sin(heading + 1 * deg),
                                                           std::cos(heading + 1 * deg))),
                3e-3)
          << lat << " " << heading;
      Standing d = a;
      d.scale = 1 + 1e-4, d.heading_error = 2e-4;
      const std::complex<double> off = way(d) - way(a);
      EXPECT_NEAR(off.real(), 2e-4 * truth.imag() + 1e-4 * truth.real(), 1e-5);
      EXPECT_NEAR(off.imag(), -2e-4 * truth.real() + 1e-4 * truth.imag(), 1e-5);
    }
}
// (V-51), (V-52): a latitude that is wrong scales the longitude run since, by the velocity in the
// INS and by the increments in the dead reckoning; an east velocity that is wrong runs at sec L/N.
TEST(Segmented, AWrongLatitudeScalesTheLongitudeRun) {
  for (const double lat : {-75 * deg, -20 * deg, 40 * deg, 75 * deg}) {
    Standing a;
    a.lat = lat, a.heading = 90 * deg, a.pitch = 0, a.ve = 20;
    Standing north = a, fast = a;
    north.lat_error = 1e-4, fast.ve += 0.1;
    const double s = std::sin(lat), N = prime_vertical_radius(wgs84(), s);
    const double run = 200 * std::tan(lat) / std::cos(lat) / N * 1e-4;
    const SegmentedEpoch e = stood(a), n = stood(north), f = stood(fast);
    // N's own change with latitude, 0.7 %, and the second order, 4e-4, are not in these.
    EXPECT_NEAR((n.reckoned.lon - e.reckoned.lon) / run, 1, 0.02) << lat;
    EXPECT_NEAR((n.ins.lon - e.ins.lon) / run, 1, 0.02) << lat;
    EXPECT_NEAR((f.ins.lon - e.ins.lon) / (0.1 * 10 / std::cos(lat) / N), 1, 0.01) << lat;
  }
}

// The switch rule, condition by condition: each alone holds the switch back, and at 180 s of
// driving it is made all the same and said to be forced.
TEST(Segmented, EveryConditionOfTheSwitchRuleHoldsItBack) {
  Vehicle v;
  v.rest = 7;
  const ExactRoute route = route_of(v);
  struct Found {
    double t = 0, distance = 0;
    bool forced = false;
    int times = 0;
  };
  const auto run = [&](const SegmentedConfig& c) {
    Found f;
    drive(v, route, c, 1, [&](const SegmentedEpoch& e, std::size_t) {
      EXPECT_EQ(e.phase, f.times > 0 || e.switched ? 2 : 1) << e.t;
      if (!e.switched) return;
      f.t = e.t, f.distance = e.distance, f.forced = e.forced;
      ++f.times;
    });
    EXPECT_EQ(f.times, 1);
    return f;
  };
  const Found base = run(config_of());
  EXPECT_GE(base.t, v.rest + 60);  // the clock runs from the start of the drive
  EXPECT_LT(base.t, v.rest + 90);
  EXPECT_FALSE(base.forced);
  SegmentedConfig c = config_of();
  c.earliest = 100;
  EXPECT_NEAR(run(c).t, v.rest + 100, 1.01);
  c = config_of();
  c.distance = 2500;  // 2500 m indicated: one tick of 20.4 m more at most
  EXPECT_GE(run(c).distance, 2500);
  EXPECT_LT(run(c).distance, 2521);
  EXPECT_FALSE(run(c).forced);
  // The sigma of phase 1 after 120 s of 20 m/s is a few 1e-4, doubled: the limit at half of what
  // the base case had makes it later.
  c = config_of();
  c.sd_limit = 2.5e-4;
  EXPECT_GT(run(c).t, base.t + 5);
  c.scale_std = 1e-9;  // known: the angle alone holds it back …
  EXPECT_GT(run(c).t, base.t + 5);
  c.scale_std = 0.05, c.mounting_std = 1e-9;  // … and the scale
  EXPECT_GT(run(c).t, base.t + 5);
  const auto forced = [&](const SegmentedConfig& s) {
    const Found f = run(s);
    EXPECT_TRUE(f.forced);
    EXPECT_NEAR(f.t, v.rest + 180, 1.01);
  };
  c = config_of(), c.sd_limit = 1e-9, forced(c);
  c = config_of(), c.change_limit = 0, forced(c);
  c = config_of(), c.distance = 1e6, forced(c);
}

// At the switch the track is the increments replayed with (k, mu), not the INS's position: with a
// gyro that leads the INS metres away it ends at the indicated way / k from the start, and its
// positions and weights do not jump.
TEST(Segmented, TheTrackIsReplayedAndNothingJumpsAtTheSwitch) {
  Vehicle v;
  v.accel_bias = {6e-4, -5e-4, 0};
  const ExactRoute route = route_of(v);
  SegmentedEpoch before;
  std::size_t i_before = 0;
  bool seen = false;
  drive(v, route, config_of(), 1, [&](const SegmentedEpoch& e, std::size_t i) {
    if (e.switched) {
      seen = true;
      const Geodetic<double>& from = route.place[0];
      const double s = std::sin(0.5 * (e.reckoned.lat + from.lat));
      const double chord = std::hypot(
          (e.reckoned.lon - from.lon) * prime_vertical_radius(wgs84(), s) * std::sqrt(1 - s * s),
          (e.reckoned.lat - from.lat) * meridian_radius(wgs84(), s));
      // A constant course's chord at its mean latitude falls short by 1e-8 of a kilometre.
      EXPECT_NEAR(chord, e.distance / e.k, 1e-3);
      EXPECT_GT(miss(e.ins, {e.reckoned.lat, e.reckoned.lon, 0}), 0.1);
      const auto step = [&](const Horizontal& now, const Horizontal& was) {
        return std::fabs(miss(now, route.place[i]) - miss(was, route.place[i_before]));
      };
      // A second's change of any solution's error: well under the decimetre that the INS itself
      // moves away in it.
      EXPECT_LT(step(e.reckoned, before.reckoned), 0.1);
      EXPECT_LT(step(e.weighted, before.weighted), 0.1);
      EXPECT_LT(step(e.naive, before.naive), 0.1);
      EXPECT_LT(step(e.intersection, before.intersection), 0.1);
      EXPECT_LT(step(e.joint, before.joint), 0.1);
      EXPECT_NEAR(e.ins_weight, before.ins_weight, 0.05);
      for (int j = 0; j < 3; j += 2) {
        EXPECT_NEAR(e.weighted.cov[j] / before.weighted.cov[j], 1, 0.1);
        EXPECT_NEAR(e.reckoned.cov[j] / before.reckoned.cov[j], 1, 0.1);
      }
    }
    before = e, i_before = i;
  });
  EXPECT_TRUE(seen);
}

// 7: an INS that is no navigation-grade one never meets the rule, and is told so.
TEST(Segmented, ATacticalUnitIsForced) {
  Vehicle v;
  const ExactRoute route = route_of(v);
  SegmentedConfig c = config_of();
  c.accel_bias = 2000 * ug, c.accel_noise = 100 * ug_per_sqrt_hz;
  bool forced = false;
  drive(v, route, c, 1, [&](const SegmentedEpoch& e, std::size_t) { forced |= e.forced; });
  EXPECT_TRUE(forced);
}

// `found`: the attitude from the sensors, with their biases in it; else given, with errors of its
// own. What the method says of its errors is what they are: drawn from their sigmas, the errors of
// INS, track, weighted and joint position over their own covariance, before and after the switch.
// The INS's phi_U, which both share, is what makes the cross covariance.
void stated_covariances_are_true(bool found) {
  const std::uint64_t seed = testing::seed();
  std::mt19937 rng(seed);
  std::normal_distribution<double> g;
  constexpr int kRuns = 48;
  Vehicle v;
  v.turn = 40 * deg, v.length = 200;
  const ExactRoute route = route_of(v);
  SegmentedConfig c = config_of();
  c.static_heading = c.static_level = found;
  if (!found) c.c_a = 1;
  const double gamma = normal_gravity(c.ellipsoid, std::sin(v.lat), 0.0),
               wn = c.ellipsoid.w_ie * std::cos(v.lat), wu = c.ellipsoid.w_ie * std::sin(v.lat);
  const Rot<Geographic, Body> C = geographic_axes(v.lat, v.lon) * to_matrix(route.q[0]);
  const double times[] = {30, 60, 100, 200};
  double nees[4][4]{};
  for (int r = 0; r < kRuns; ++r) {
    v.scale_noise = c.scale_noise;
    v.gyro_bias = c.gyro_bias * Vec<Body>{g(rng), g(rng), g(rng)};
    v.accel_bias = c.accel_bias * Vec<Body>{g(rng), g(rng), 0};
    const Vec<Geographic> gn = C * v.gyro_bias, an = C * v.accel_bias;
    v.phi = {c.level_std * g(rng), c.level_std * g(rng), c.heading_std * g(rng)};
    if (found)
      v.phi =
          v.phi + Vec<Geographic>{-an.y / gamma, an.x / gamma, (-gn.x + wu * an.x / gamma) / wn};
    drive(v, route, c, seed + static_cast<std::uint64_t>(r),
          [&](const SegmentedEpoch& e, std::size_t i) {
            for (int j = 0; j < 4; ++j) {
              if (std::fabs(e.t - times[j]) > 0.01) continue;
              const Horizontal* h[4] = {&e.ins, &e.reckoned, &e.weighted, &e.joint};
              const Geodetic<double>& at = route.place[i];
              const double s = std::sin(at.lat);
              for (int m = 0; m < 4; ++m) {
                const double de = wrap_pi(h[m]->lon - at.lon) * prime_vertical_radius(wgs84(), s) *
                                  std::cos(at.lat),
                             dn = (h[m]->lat - at.lat) * meridian_radius(wgs84(), s);
                const double a = h[m]->cov[0], b = h[m]->cov[1], d = h[m]->cov[2];
                nees[m][j] +=
                    (d * de * de - 2 * b * de * dn + a * dn * dn) / (a * d - b * b) / kRuns;
              }
            }
          });
  }
  // Chi-square of two degrees over 48 runs: 3e-8 above 3.98, for each of 32 checks. Slip and walk
  // are declared and not drawn, so that covariances are a little wide: over 60 seeds the means are
  // 1.4 to 2.0, from a given attitude down to 0.8 +- 0.1 for weighted and joint.
  const char* names[] = {"INS", "reckoned", "weighted", "joint"};
  for (int m = 0; m < 4; ++m)
    std::printf("%-8s NEES of 2: %.2f %.2f %.2f %.2f\n", names[m], nees[m][0], nees[m][1],
                nees[m][2], nees[m][3]);
  for (int m = 0; m < 4; ++m)
    for (int j = 0; j < 4; ++j) {
      EXPECT_LT(nees[m][j], 3.98) << names[m] << " at " << times[j];
      EXPECT_GT(nees[m][j], m < 2 ? 0.5 : 0.8 - 4 * 0.13) << names[m] << " at " << times[j];
    }
}
TEST(Segmented, StatedCovariancesAreTrueAfterAnAlignment) { stated_covariances_are_true(true); }
TEST(Segmented, StatedCovariancesAreTrueFromAGivenAttitude) { stated_covariances_are_true(false); }

// A gain that knows the noise of the reading it weighs has a mean that is not zero: on a straight
// road, where scale and speed hardly part, the scale runs away: here by more than a sigma in an
// hour.
TEST(Segmented, TheJointFiltersScaleDoesNotDriftOnAStraightRoad) {
  const std::uint64_t seed = testing::seed();
  constexpr int kRuns = 24;
  Vehicle v;
  v.scale_noise = 5e-3, v.length = 3600;
  const ExactRoute route = route_of(v);
  SegmentedConfig c = config_of();
  c.scale_noise = v.scale_noise;
  double mean = 0;
  for (int r = 0; r < kRuns; ++r) {
    double last = 0;
    drive(v, route, c, seed + static_cast<std::uint64_t>(r),
          [&](const SegmentedEpoch& e, std::size_t) {
            last = (e.joint_k - 1 - v.dk) / e.joint_k_std;
          });
    mean += last / kRuns;
  }
  std::printf("mean of the scale's error %+.2f sigma\n", mean);
  // The mean of 24 errors of at most one sigma: beyond 4.9 of its own once in a million runs. The
  // gain that knows its reading makes 1.6.
  EXPECT_LT(std::fabs(mean), 4.9 / std::sqrt(kRuns));
}

struct Two {
  double a[4], b[4], x[4];  // P_a, P_b, X
};
// A positive definite joint covariance of two positions, from random factors.
Two draw(std::mt19937& rng, double least) {
  std::normal_distribution<double> g;
  double L[4][4], P[4][4];
  for (auto& row : L)
    for (double& e : row) e = g(rng);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      P[i][j] = i == j ? least : 0;
      for (int k = 0; k < 4; ++k) P[i][j] += L[i][k] * L[j][k];
    }
  return {{P[0][0], P[0][1], P[1][0], P[1][1]},
          {P[2][2], P[2][3], P[3][2], P[3][3]},
          {P[0][2], P[0][3], P[1][2], P[1][3]}};
}
// (V-60), written out element by element.
void fused_by_hand(const Two& p, const double W[4], double out[4]) {
  const double V[4] = {1 - W[0], -W[1], -W[2], 1 - W[3]};
  const auto part = [](const double* A, const double* M, const double* B, int i, int j) {
    double sum = 0;
    for (int k = 0; k < 2; ++k)
      for (int l = 0; l < 2; ++l) sum += A[2 * i + k] * M[2 * k + l] * B[2 * j + l];
    return sum;
  };
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      out[2 * i + j] = part(V, p.a, V, i, j) + part(W, p.b, W, i, j) + part(V, p.x, W, i, j) +
                       part(V, p.x, W, j, i);
}
double smaller_eigenvalue(const double m[4]) {
  const double mean = 0.5 * (m[0] + m[3]), half = 0.5 * (m[0] - m[3]), off = 0.5 * (m[1] + m[2]);
  return mean - std::hypot(half, off);
}

// (V-60) is the covariance of what the weights make; (V-57) is its least over all weights, and
// (V-58) what (V-57) becomes without cross covariance.
TEST(SegmentedWeights, MinimumVarianceIsTheLeastOfAllAndNaiveIgnoresWhatIsShared) {
  std::mt19937 rng(testing::seed());
  std::normal_distribution<double> g;
  for (int n = 0; n < 200; ++n) {
    const Two p = draw(rng, 0.1);
    double w[4], P[4], wn[4], Pn[4], hand[4];
    weight_minimum_variance(p.a, p.b, p.x, w, P);
    weight_naive(p.a, p.b, p.x, wn, Pn);
    fused_by_hand(p, w, hand);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(P[i], hand[i], 1e-9 * (p.a[0] + p.b[0]) + 1e-12);
    fused_by_hand(p, wn, hand);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(Pn[i], hand[i], 1e-9 * (p.a[0] + p.b[0]) + 1e-12);
    for (int k = 0; k < 8; ++k) {  // near it and far from it
      double other[4], Q[4];
      for (int i = 0; i < 4; ++i) other[i] = w[i] + (k < 4 ? 1e-2 : 1) * g(rng);
      fused_by_hand(p, other, Q);
      const double more[4] = {Q[0] - P[0], Q[1] - P[1], Q[2] - P[2], Q[3] - P[3]};
      EXPECT_GE(smaller_eigenvalue(more), -1e-9 * (p.a[0] + p.b[0])) << n;
    }
    const double zero[4] = {0, 0, 0, 0};
    weight_minimum_variance(p.a, p.b, zero, w, P);
    weight_naive(p.a, p.b, zero, wn, Pn);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(w[i], wn[i], 1e-9);
  }
}

// (V-59) holds for every cross covariance that can be, and is the least trace of its family.
TEST(SegmentedWeights, IntersectionIsConsistentForAnyCrossCovariance) {
  std::mt19937 rng(testing::seed());
  for (int n = 0; n < 100; ++n) {
    const Two p = draw(rng, 0.01);
    double w[4], P[4], Q[4];
    weight_intersection(p.a, p.b, w, P);
    fused_by_hand(p, w, Q);
    const double margin[4] = {P[0] - Q[0], P[1] - Q[1], P[2] - Q[2], P[3] - Q[3]};
    EXPECT_GE(smaller_eigenvalue(margin), -1e-9 * (P[0] + P[3])) << n;
    const auto inverse = [](const double m[4], double out[4]) {
      const double d = m[0] * m[3] - m[1] * m[2];
      out[0] = m[3] / d, out[1] = -m[1] / d, out[2] = -m[2] / d, out[3] = m[0] / d;
    };
    double ai[4], bi[4];
    inverse(p.a, ai), inverse(p.b, bi);
    for (double om = 0; om <= 1.0001; om += 0.05) {
      double m[4], at[4];
      for (int i = 0; i < 4; ++i) m[i] = om * ai[i] + (1 - om) * bi[i];
      inverse(m, at);
      EXPECT_LE(P[0] + P[3], (at[0] + at[3]) * (1 + 1e-6)) << n << " " << om;
    }
  }
}

// Near singular, as in the first seconds: the pseudo-inverse takes what is common as it is and
// weighs the rest; nothing is ever infinite or not a number.
TEST(SegmentedWeights, NearSingularDifferencesTakeThePseudoInverse) {
  const double a[4] = {4, 1, 1, 9}, none[4] = {0, 0, 0, 0};
  double w[4], P[4];
  const auto finite = [&] {
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(std::isfinite(w[i]) && std::isfinite(P[i])) << i;
  };
  // The same source twice: no weight changes it.
  weight_minimum_variance(a, a, a, w, P);
  finite();
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(P[i], a[i], 1e-12);
  // East is the same error in both, north is not: east kept, north weighed.
  const double first[4] = {4, 0, 0, 9}, second[4] = {4, 0, 0, 1}, cross[4] = {4, 0, 0, 0};
  weight_minimum_variance(first, second, cross, w, P);
  finite();
  EXPECT_NEAR(P[0], 4, 1e-12);
  EXPECT_NEAR(P[3], 0.9, 1e-12);
  EXPECT_NEAR(w[3], 0.9, 1e-12);
  // A difference that is singular but for rounding must not be divided by.
  const double third[4] = {4 + 1e-13, 0, 0, 1};
  weight_minimum_variance(first, third, cross, w, P);
  finite();
  EXPECT_LT(std::fabs(w[0]), 2);
  // Nothing known to be wrong yet, of one or both.
  weight_minimum_variance(none, none, none, w, P);
  finite();
  weight_naive(none, none, none, w, P);
  finite();
  weight_intersection(none, none, w, P);
  finite();
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(P[i], 0, 1e-12);
  weight_intersection(none, a, w, P);
  finite();
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(w[i], 0, 1e-6);
  weight_intersection(a, none, w, P);
  finite();
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(w[i], i % 3 == 0 ? 1 : 0, 1e-6);
}

}  // namespace
}  // namespace loxo
