// SPDX-License-Identifier: Apache-2.0
// Measurements that come after their time (estimation.md 2.5): the filter goes back and is what it
// would be had they come in time, to the bit. In turns at 20 m/s, out of order, every kind at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "loxo/estimate/exact_route.hpp"
#include "loxo/estimate/navigator.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

constexpr double kStep = 0.02;

const ExactRoute& route() {
  static const ExactRoute r = make_exact_route(
      wgs84(), Geodetic<double>{50 * deg, 10 * deg, 120},
      [](double t) { return 0.6 + 0.5 * std::sin(0.2 * t); },  // up to 6 deg/s
      [](double t) { return std::clamp(2 * (t - 5.0), 0.0, 20.0); }, 60, kStep, 0);
  return r;
}
NavigatorConfig settings() {
  NavigatorConfig c;
  c.ellipsoid = wgs84();
  c.imu_interval = kStep;
  c.gyro_noise = 1e-5, c.gyro_bias = 1 * deg_per_h, c.accel_noise = 3e-4, c.accel_bias = 300 * ug;
  c.standstill.sigma_w = 1e-3, c.standstill.sigma_f = 1e-2;
  c.quantisation = 0.001;
  return c;
}
NavigatorStart beginning() {
  NavigatorStart s;
  s.state.r = route().r[0], s.state.q = route().q[0];
  StartSigmas sigmas;
  sigmas.gyro_bias = 1 * deg_per_h, sigmas.accel_bias = 300 * ug;
  sigmas.level = 0.003 * deg, sigmas.heading = 0.5 * deg;
  sigmas.position = 2, sigmas.velocity = 0.02;
  sigmas.scale = 0.03, sigmas.eps_h = sigmas.eps_p = 0.03;
  s.P = start_covariance(wgs84(), s.state, sigmas);
  return s;
}

// A measurement: when it was valid, when it is handed over.
struct Message {
  double t = 0, handed = 0;
  std::function<bool(Navigator&)> give;
};
// Fixes with velocities, headings, heights and a velocity log of a seeded drive, and the wheel.
// `delay`: of message n.
std::vector<Message> messages(std::uint64_t seed, const std::function<double(int)>& delay,
                              double wheel_delay) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> g;
  std::vector<Message> out;
  int n = 0;
  for (std::size_t i = 1; i < route().q.size(); ++i) {
    const double t = static_cast<double>(i) * kStep;
    const auto& p = route().place[i];
    const Vec<Geographic> v = geographic_axes(p.lat, p.lon) * route().v[i];
    if (i % 10 == 0) {
      const double way = route().distance[i] - route().distance[i - 10];
      out.push_back({t, t + wheel_delay, [=](Navigator& nav) {
                       return nav.odometer({t, 1.01 * way, false});
                     }});
    }
    // Off the grid of samples, as real stamps are.
    if (i % 50 == 7) {
      Fix f;
      f.t = t - 0.007, f.lat = p.lat + 3e-7 * g(rng), f.lon = p.lon + 5e-7 * g(rng);
      f.h = p.h + 2 * g(rng), f.std_e = f.std_n = f.std_u = 2;
      f.ve = v.x, f.vn = v.y, f.std_v = 0.1;
      out.push_back({f.t, f.t + delay(n++), [=](Navigator& nav) { return nav.fix(f); }});
    }
    if (i % 100 == 31)
      out.push_back({t, t + delay(n++), [=](Navigator& nav) {
                       return nav.heading({t, 0.6 + 0.5 * std::sin(0.2 * t), 0.01});
                     }});
    if (i % 70 == 11)
      out.push_back({t, t + delay(n++), [=](Navigator& nav) {
                       return nav.height({t, p.h, kNone});
                     }});
    if (i % 60 == 3)
      out.push_back({t, t + delay(n++), [=](Navigator& nav) {
                       return nav.velocity({t, {v.x, v.y, v.z}, true});
                     }});
  }
  return out;
}
void drive(Navigator& nav, std::vector<Message> m, double until = 60) {
  std::stable_sort(m.begin(), m.end(),
                   [](const Message& a, const Message& b) { return a.handed < b.handed; });
  nav.start(beginning());
  std::size_t next = 0;
  for (std::size_t i = 1; i < route().q.size(); ++i) {
    const double t = static_cast<double>(i) * kStep;
    if (t > until + 1e-9) break;
    for (; next < m.size() && m[next].handed <= t + 1e-9; ++next) EXPECT_TRUE(m[next].give(nav));
    ImuIncrement<double> u;
    u.t = t, u.dt = kStep, u.dtheta = route().dtheta[i], u.dv = route().dv[i];
    nav.imu(u);
  }
}
// No tolerance: the same operations in the same order.
void expect_same(const Navigator& a, const Navigator& b) {
  EXPECT_EQ(a.t(), b.t());
  const NominalState &s = a.state(), &r = b.state();
  EXPECT_EQ(norm(s.r - r.r), 0.0);
  EXPECT_EQ(norm(s.v - r.v), 0.0);
  EXPECT_EQ(s.q.w, r.q.w);
  EXPECT_EQ(s.q.z, r.q.z);
  EXPECT_EQ(s.scale, r.scale);
  EXPECT_EQ(s.d[1], r.d[1]);
  for (int i = 0; i < kStates; ++i)
    for (int j = 0; j < kStates; ++j)
      EXPECT_EQ(a.covariance().p[i][j], b.covariance().p[i][j]) << i << " " << j;
  for (int i = 0; i < static_cast<int>(Sensor::kCount); ++i) {
    const auto& x = a.innovations(static_cast<Sensor>(i));
    const auto& y = b.innovations(static_cast<Sensor>(i));
    EXPECT_EQ(x.used, y.used) << i;
    EXPECT_EQ(x.nis_sum, y.nis_sum) << i;
  }
  EXPECT_EQ(a.events().standing, b.events().standing);
}
TEST(LateMeasurements, ComeToTheSameStateAsInTime) {
  const std::uint64_t k = testing::seed();
  Navigator in_time(settings());
  drive(in_time, messages(
                     k, [](int) { return 0.0; }, 0.0));
  ASSERT_GT(in_time.innovations(Sensor::kFix).used, 50);
  // All of them by half a second, by two; each by another time, so that they overtake each other.
  std::mt19937_64 rng(k + 1);
  std::uniform_real_distribution<double> u(0.0, 1.95);
  std::vector<double> own;
  for (int i = 0; i < 400; ++i) own.push_back(u(rng));
  for (int kind = 0; kind < 3; ++kind) {
    Navigator late(settings());
    // The last ones in time: nothing is outstanding at the end.
    const auto delay = [&](int n) {
      return kind == 0 ? 0.5 : kind == 1 ? 1.98 : own[static_cast<std::size_t>(n)];
    };
    auto m = messages(k, delay, 0.0);
    for (auto& x : m) x.handed = x.t > 57.5 ? x.t : x.handed;
    drive(late, m);
    EXPECT_GT(late.events().rewound, 100) << kind;
    EXPECT_EQ(late.events().late, 0) << kind;
    expect_same(late, in_time);
  }
}
// The bus brings the wheel's readings 80 ms late, the fixes half a second.
TEST(LateMeasurements, TheWheelToo) {
  const std::uint64_t k = testing::seed();
  Navigator in_time(settings()), late(settings());
  drive(in_time, messages(
                     k, [](int) { return 0.0; }, 0.0));
  auto m = messages(
      k, [](int) { return 0.5; }, 0.08);
  for (auto& x : m) x.handed = x.t > 59 ? x.t : x.handed;
  drive(late, m);
  expect_same(late, in_time);
}
// Until it comes nothing of it is known; while it waits for the next sample the state is the old
// one.
TEST(LateMeasurements, AreUsedAtTheNextSample) {
  const std::uint64_t k = testing::seed();
  Navigator without(settings()), with(settings());
  auto m = messages(
      k, [](int) { return 0.0; }, 0.0);
  m.erase(std::remove_if(m.begin(), m.end(), [](const Message& x) { return x.t > 30; }), m.end());
  drive(without, m, 40);
  drive(with, m, 40);
  Fix f;
  const auto at = static_cast<std::size_t>(std::lround(38.6 / kStep));
  f.t = 38.6, f.lat = route().place[at].lat, f.lon = route().place[at].lon;
  f.h = route().place[at].h;
  f.std_e = f.std_n = f.std_u = 0.1;
  const double before = std::sqrt(with.covariance().p[kDr][kDr]);
  ASSERT_TRUE(with.fix(f));
  EXPECT_EQ(norm(with.state().r - without.state().r), 0.0);
  ImuIncrement<double> u;
  u.t = 40 + kStep, u.dt = kStep;
  const auto next = static_cast<std::size_t>(std::lround(u.t / kStep));
  u.dtheta = route().dtheta[next], u.dv = route().dv[next];
  with.imu(u);
  EXPECT_LT(std::sqrt(with.covariance().p[kDr][kDr]), 0.5 * before);
  // 0.1 m of the fix and what 1.4 s of a velocity known to some cm/s add.
  EXPECT_LT(norm(with.state().r - route().r[next]), 0.6);
}
// Older than what is remembered, before the start, or with a tape: refused, said, nothing changed.
TEST(LateMeasurements, TooOldOnesAreRefusedAndSaid) {
  const std::uint64_t k = testing::seed();
  Navigator a(settings()), b(settings());
  const auto m = messages(
      k, [](int) { return 0.0; }, 0.0);
  drive(a, m, 40);
  drive(b, m, 40);
  Fix f;
  f.lat = 1, f.lon = 0.2, f.h = 0;
  f.std_e = f.std_n = f.std_u = 1;
  for (const double t : {37.9, 20.0, -3.0}) {
    f.t = t;
    EXPECT_FALSE(b.fix(f));
    EXPECT_FALSE(b.benchmark(f));
    EXPECT_FALSE(b.heading({t, 0, 0.1}));
    EXPECT_FALSE(b.height({t, 0, kNone}));
    EXPECT_FALSE(b.velocity({t, {0, 0, 0}, true}));
  }
  EXPECT_EQ(b.events().late, 15);
  EXPECT_EQ(b.events().rewound, 0);
  ImuIncrement<double> u;
  u.t = 40 + kStep, u.dt = kStep;
  const auto next = static_cast<std::size_t>(std::lround(u.t / kStep));
  u.dtheta = route().dtheta[next], u.dv = route().dv[next];
  a.imu(u);
  b.imu(u);
  EXPECT_FALSE(a.health() & kHealthRejected);
  EXPECT_TRUE(b.health() & kHealthRejected);
  expect_same(a, b);
  // The first two seconds reach back to the start, not before it.
  Navigator young(settings());
  drive(young, m, 1.0);
  f.t = -0.1;
  EXPECT_FALSE(young.fix(f));
  // Nothing comes late by a caller's word.
  NavigatorConfig c = settings();
  c.late_limit = 0;
  Navigator none(c);
  drive(none, m, 2.0);
  f.t = 1.9;
  EXPECT_FALSE(none.fix(f));
}
// A longer memory where the receiver needs it.
TEST(LateMeasurements, TheMemoryIsAsLongAsAsked) {
  const std::uint64_t k = testing::seed();
  NavigatorConfig c = settings();
  c.late_limit = 20;
  Navigator in_time(c), late(c);
  drive(in_time, messages(
                     k, [](int) { return 0.0; }, 0.0));
  auto m = messages(
      k, [](int n) { return n % 9 == 0 ? 19.5 : 0.0; }, 0.0);
  for (auto& x : m) x.handed = x.t > 40 ? x.t : x.handed;
  drive(late, m);
  EXPECT_GT(late.events().rewound, 5);
  expect_same(late, in_time);
}
// A late fix that does not fit is told in the next row, as one in time is.
TEST(LateMeasurements, ARejectedOneIsSaid) {
  Navigator nav(settings());
  drive(nav,
        messages(
            testing::seed(), [](int) { return 0.0; }, 0.0),
        40);
  Fix f;
  f.t = 39.0;
  const auto at = static_cast<std::size_t>(std::lround(f.t / kStep));
  f.lat = route().place[at].lat + 1e-4, f.lon = route().place[at].lon + 1e-4;  // 640 m, 460 m
  f.h = route().place[at].h;
  f.std_e = f.std_n = f.std_u = 1;
  ASSERT_TRUE(nav.fix(f));
  ImuIncrement<double> u;
  u.t = 40 + kStep, u.dt = kStep;
  const auto next = static_cast<std::size_t>(std::lround(u.t / kStep));
  u.dtheta = route().dtheta[next], u.dv = route().dv[next];
  nav.imu(u);
  EXPECT_TRUE(nav.health() & kHealthRejected);
  EXPECT_EQ(nav.events().outlier_fixes + nav.events().wrong_stamps, 1);
}

}  // namespace
}  // namespace loxo
