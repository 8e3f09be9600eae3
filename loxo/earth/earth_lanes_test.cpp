// SPDX-License-Identifier: Apache-2.0
// Every kernel of the room gives in each lane the bits of the same call on `double`, hard places
// side by side with easy ones.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <random>

#include "loxo/earth/projection.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/earth/transverse.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

using Four = std::array<double, 4>;

// NaN is NaN whatever its payload.
bool same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (a != a && b != b);
}

// f: (S, S, S, S) -> std::array<S, N>
template <class F>
void in_each_lane(const char* name, const std::vector<Four>& points, F f) {
  for (std::size_t i = 0; i + 8 <= points.size(); i += 8) {
    Lanes x[4];
    for (int k = 0; k < 4; ++k)
      for (int lane = 0; lane < 8; ++lane) x[k].set_lane(lane, points[i + lane][k]);
    const auto wide = f(x[0], x[1], x[2], x[3]);
    for (int lane = 0; lane < 8; ++lane) {
      const Four& p = points[i + lane];
      const auto narrow = f(p[0], p[1], p[2], p[3]);
      for (std::size_t k = 0; k < narrow.size(); ++k)
        ASSERT_TRUE(same(wide[k].lane(lane), narrow[k]))
            << name << " result " << k << " at " << p[0] << " " << p[1] << " " << p[2] << " "
            << p[3] << ": " << wide[k].lane(lane) << " " << narrow[k];
    }
  }
}

template <class T>
using S = std::decay_t<T>;

TEST(EarthInLanes, TheSameBits) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<Four> p;
  const double h = kPi / 2;
  const Four hard[] = {{h, 0, 0.3, 0},         {0.3, 0, h, 1},       {-h, 0, h, 0},
                       {h, 1, h, 2},           {0.5, 0.1, 0.5, 0.1}, {0.5, 3.1, 0.5, -3.1},
                       {1e-300, 0, 0, 1e-300}, {1.7, 0, 0, 0},       {NAN, 0, 0, 0},
                       {0.2, INFINITY, 0, 0},  {0, 0, 0, kPi},       {0, h, 0, 0}};
  for (int i = 0; i < 4000; ++i) {
    if (i % 5 == 0) p.push_back(hard[(i / 5) % std::size(hard)]);
    const double lat = h * u(random);
    p.push_back({lat, kPi * u(random), i % 3 == 0 ? lat + 1e-9 * u(random) : h * u(random),
                 kPi * u(random)});
  }
  const Ellipsoid& e = wgs84();
  in_each_lane("rhumb_inverse", p, [&](auto a, auto b, auto c, auto d) {
    const auto r = rhumb_inverse(e, a, b, c, d);
    return std::array{r.azimuth, r.distance, r.north, r.east};
  });
  in_each_lane("rhumb_direct", p, [&](auto a, auto b, auto c, auto d) {
    const auto r = rhumb_direct(e, a, b, c, d * 1e5);
    return std::array{r.lat, r.lon};
  });
  in_each_lane("latitudes", p, [&](auto a, auto, auto c, auto) {
    return std::array{isometric_latitude(e, a), latitude_of_isometric(e, a),
                      meridian_arc(e, a),       latitude_of_arc(e, a * 6e6),
                      isometric_rate(e, a),     isometric_divided_difference(e, a, c)};
  });
  in_each_lane("gauss", p, [&](auto a, auto b, auto c, auto d) {
    const auto f = gauss_forward(e, a, b * 0.2, 0.1);
    const auto i = gauss_inverse(e, c * 6e6, d * 1e6, 0.1);
    const auto g = gauss_forward_paper(e, a, b * 0.02, 0.1);
    const auto j = gauss_inverse_paper(e, c * 6e6, d * 1e5, 0.1);
    return std::array{f.x, f.y, i.lat, i.lon, g.x, g.y, j.lat, j.lon};
  });
  in_each_lane("stereographic", p, [&](auto a, auto b, auto c, auto d) {
    const auto f = polar_stereographic_forward(e, a, b, 0.1, false);
    const auto i = polar_stereographic_inverse(e, c * 1e6, d * 1e6, 0.1, true);
    return std::array{f.x, f.y, i.lat, i.lon};
  });
  in_each_lane("geodetic", p, [&](auto a, auto b, auto c, auto d) {
    using T = decltype(a);
    const auto r = to_ecef(e, Geodetic<T>{a, b, c * 1e4});
    const auto g = to_geodetic(e, Point<Ecef, T>{a * 6e6, b * 6e6, d * 6e6});
    const auto n = to_normal(e, r);
    return std::array{r.x, r.y, r.z, g.lat, g.lon, g.h, n.n.x, n.n.y, n.n.z, n.h};
  });
  in_each_lane("transverse", p, [&](auto a, auto b, auto c, auto d) {
    using T = decltype(a);
    const auto t = to_transverse(a, b, 0.4);
    const auto g = from_transverse(c, d, 0.4);
    const auto x = transverse_axes(c, d, 0.4);
    const auto k = curvature(e, -x.m[0][2], -x.m[1][2], x.m[2][2], T(100.0));
    return std::array{t.tlat,    t.tlon,    g.lat,     g.lon,
                      x.m[0][0], x.m[1][1], x.m[2][0], transverse_convergence(a, b, 0.4),
                      k.xx,      k.xy,      k.yy};
  });
}

}  // namespace
}  // namespace loxo
