// SPDX-License-Identifier: Apache-2.0
// examples/embed.cpp as its reader would run it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

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

}  // namespace
}  // namespace loxo
