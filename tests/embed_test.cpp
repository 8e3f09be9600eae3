// SPDX-License-Identifier: Apache-2.0
// examples/embed.cpp and embed_filter.cpp as their readers would run them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include "loxo/estimate/exact_route.hpp"
#include "loxo/ins/closed_form_truth.hpp"
#include "loxo/num/units.hpp"
#include "program.hpp"

namespace loxo {
namespace {

// At rest 1 m from the pole, an odd number of exact samples: it stays there. polar.md 3.2
TEST(Embed, AStreamOfIncrementsIsNavigated) {
  const double lat = 89.99999 * deg;
  auto m = truth::great_circle(wgs84(), lat, 110 * deg, 0, 0);
  m.heading = 30 * deg;
  const std::string base = loxo::testing::scratch_folder() + "/embed";
  {
    std::ofstream in(base + ".in");
    in.precision(17);
    for (const auto& s : m.record(0.05, 401))
      in << s.t << ' ' << s.dt << ' ' << s.dtheta.x << ' ' << s.dtheta.y << ' ' << s.dtheta.z << ' '
         << s.dv.x << ' ' << s.dv.y << ' ' << s.dv.z << '\n';
  }
  const std::string program = testing::embed_program();
  ASSERT_EQ(
      std::system((program + " 89.99999 110 0 30 <" + base + ".in >" + base + ".out").c_str()), 0);
  const auto table = loxo::testing::columns(loxo::testing::slurp(base + ".out"));
  ASSERT_EQ(table.at("t_s").size(), 22u);
  EXPECT_EQ(table.at("t_s").back(), "20.050");
  EXPECT_NEAR(loxo::testing::number(table.at("lat_deg").back()), 89.99999,
              2e-9);  // the last digit printed
  EXPECT_NEAR(loxo::testing::number(table.at("lon_deg").back()), 110, 1e-3);
  EXPECT_NE(std::system((program + " north 110 0 30 </dev/null 2>/dev/null >/dev/null").c_str()),
            0);
  std::ofstream(base + ".in") << "0.05 0.05 zero";
  EXPECT_NE(std::system((program + " 50 110 0 30 <" + base + ".in >/dev/null").c_str()), 0);
}

// A drive with turns at 20 m/s whose fixes come in time, and the same with every fix 1.3 s late:
// once they have all come the output is the same text. estimation.md 2.5
TEST(Embed, LateFixesGiveTheSameSolution) {
  const double dt = 0.02;
  const ExactRoute route = make_exact_route(
      wgs84(), Geodetic<double>{50 * deg, 10 * deg, 100},
      [](double t) { return 0.6 + 0.5 * std::sin(0.2 * t); },
      [](double t) { return std::clamp(2 * (t - 5), 0.0, 20.0); }, 60, dt, 0);
  const std::string base = loxo::testing::scratch_folder() + "/embed_filter";
  const auto write = [&](double late) {
    std::ofstream in(base + ".in");
    in.precision(17);
    const auto fix = [&](std::size_t i) {
      if (i == 0 || i % 50 != 0 || i > 2850) return;
      const auto& p = route.place[i];
      in << "fix " << static_cast<double>(i) * dt << ' ' << p.lat / deg << ' ' << p.lon / deg << ' '
         << p.h << " 1\n";
    };
    const auto behind = static_cast<std::size_t>(std::lround(late / dt));
    for (std::size_t i = 1; i < route.q.size(); ++i) {
      if (i >= behind) fix(i - behind);
      if (i % 5 == 0)
        in << "odo " << static_cast<double>(i) * dt << ' '
           << 1.02 * (route.distance[i] - route.distance[i - 5]) << '\n';
      const auto &a = route.dtheta[i], &b = route.dv[i];
      in << "imu " << static_cast<double>(i) * dt << ' ' << dt << ' ' << a.x << ' ' << a.y << ' '
         << a.z << ' ' << b.x << ' ' << b.y << ' ' << b.z << '\n';
    }
  };
  const std::string program = std::string(testing::embed_program()) + "_filter";
  const auto run = [&](double late) {
    write(late);
    EXPECT_EQ(
        std::system((program + " 50 10 100 34.4 1 <" + base + ".in >" + base + ".out").c_str()), 0);
    return loxo::testing::slurp(base + ".out");
  };
  const std::string in_time = run(0), late = run(1.3);
  const auto a = loxo::testing::columns(in_time), b = loxo::testing::columns(late);
  ASSERT_EQ(a.at("t_s").size(), 60u);
  ASSERT_EQ(b.at("t_s").size(), 60u);
  int different = 0;
  for (const auto& [name, cells] : a) {
    EXPECT_EQ(cells.back(), b.at(name).back()) << name;
    for (std::size_t i = 0; i < cells.size(); ++i) different += cells[i] != b.at(name)[i];
  }
  EXPECT_GT(different, 50);  // while one is on its way it is not known
  const auto& last = route.place.back();
  EXPECT_NEAR(loxo::testing::number(a.at("lat_deg").back()) * deg, last.lat, 3 / 6.4e6);
  EXPECT_NEAR(loxo::testing::number(a.at("k").back()), 1.02, 0.01);
  EXPECT_EQ(std::system((program + " 50 10 >/dev/null 2>&1 </dev/null").c_str()) / 256, 2);
  std::ofstream(base + ".in") << "gyro 1 2 3\n";
  EXPECT_EQ(std::system((program + " 50 10 0 0 1 <" + base + ".in >/dev/null 2>&1").c_str()) / 256,
            3);
}

}  // namespace
}  // namespace loxo
