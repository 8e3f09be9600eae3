// SPDX-License-Identifier: Apache-2.0
// Rhumb lines and Gauss-Krueger beside GeographicLib in the same run, time per point. Random pairs
// up to 80 deg, offsets up to 3 deg of the central meridian. "lanes" gives the time of one point of
// eight.
#include <benchmark/benchmark.h>

#include <GeographicLib/Rhumb.hpp>
#include <GeographicLib/TransverseMercator.hpp>
#include <random>
#include <vector>

#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/projection.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr std::size_t kPoints = 1024;

struct Points {
  std::vector<double> lat1, lon1, lat2, lon2, azimuth, distance, offset, x, y;
  Points() {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> lat(-80, 80), lon(-180, 180), off(-3, 3);
    for (std::size_t i = 0; i < kPoints; ++i) {
      lat1.push_back(lat(random) * deg);
      lon1.push_back(lon(random) * deg);
      lat2.push_back(lat(random) * deg);
      lon2.push_back(lon(random) * deg);
      offset.push_back(off(random) * deg);
      const auto r = rhumb_inverse(wgs84(), lat1[i], lon1[i], lat2[i], lon2[i]);
      azimuth.push_back(r.azimuth);
      distance.push_back(r.distance);
      const auto g = gauss_forward(wgs84(), lat1[i], offset[i], 0.0);
      x.push_back(g.x);
      y.push_back(g.y);
    }
  }
};
const Points& points() {
  static const Points p;
  return p;
}
std::vector<double> in_degrees(const std::vector<double>& v) {
  std::vector<double> d;
  for (double x : v) d.push_back(x / deg);
  return d;
}

template <class F>
void each(benchmark::State& state, F f) {
  for (auto _ : state)
    for (std::size_t i = 0; i < kPoints; ++i) f(i);
  state.counters["ns/point"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kPoints * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
template <class F>
void each_eight(benchmark::State& state, F f) {
  for (auto _ : state)
    for (std::size_t i = 0; i < kPoints; i += 8) f(i);
  state.counters["ns/point"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * kPoints * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
Lanes at(const std::vector<double>& v, std::size_t i) { return Lanes::load(v.data() + i); }

void rhumb_inverse_geographiclib(benchmark::State& state) {
  const GeographicLib::Rhumb g(wgs84().a, wgs84().f, true);
  const auto a = in_degrees(points().lat1), b = in_degrees(points().lon1),
             c = in_degrees(points().lat2), d = in_degrees(points().lon2);
  each(state, [&](std::size_t i) {
    double s, az;
    g.Inverse(a[i], b[i], c[i], d[i], s, az);
    benchmark::DoNotOptimize(s);
    benchmark::DoNotOptimize(az);
  });
}
BENCHMARK(rhumb_inverse_geographiclib);
void rhumb_inverse_loxo(benchmark::State& state) {
  const auto& p = points();
  each(state, [&](std::size_t i) {
    benchmark::DoNotOptimize(rhumb_inverse(wgs84(), p.lat1[i], p.lon1[i], p.lat2[i], p.lon2[i]));
  });
}
BENCHMARK(rhumb_inverse_loxo);
void rhumb_inverse_degrees_loxo(benchmark::State& state) {
  const auto a = in_degrees(points().lat1), b = in_degrees(points().lon1),
             c = in_degrees(points().lat2), d = in_degrees(points().lon2);
  each(state, [&](std::size_t i) {
    benchmark::DoNotOptimize(rhumb_inverse_degrees(wgs84(), a[i], b[i], c[i], d[i]));
  });
}
BENCHMARK(rhumb_inverse_degrees_loxo);
void rhumb_inverse_lanes(benchmark::State& state) {
  const auto& p = points();
  each_eight(state, [&](std::size_t i) {
    benchmark::DoNotOptimize(
        rhumb_inverse(wgs84(), at(p.lat1, i), at(p.lon1, i), at(p.lat2, i), at(p.lon2, i)));
  });
}
BENCHMARK(rhumb_inverse_lanes);

void rhumb_direct_geographiclib(benchmark::State& state) {
  const GeographicLib::Rhumb g(wgs84().a, wgs84().f, true);
  const auto a = in_degrees(points().lat1), b = in_degrees(points().lon1),
             c = in_degrees(points().azimuth);
  const auto& s = points().distance;
  each(state, [&](std::size_t i) {
    double lat, lon;
    g.Direct(a[i], b[i], c[i], s[i], lat, lon);
    benchmark::DoNotOptimize(lat);
    benchmark::DoNotOptimize(lon);
  });
}
BENCHMARK(rhumb_direct_geographiclib);
void rhumb_direct_loxo(benchmark::State& state) {
  const auto& p = points();
  each(state, [&](std::size_t i) {
    benchmark::DoNotOptimize(
        rhumb_direct(wgs84(), p.lat1[i], p.lon1[i], p.azimuth[i], p.distance[i]));
  });
}
BENCHMARK(rhumb_direct_loxo);
void rhumb_direct_lanes(benchmark::State& state) {
  const auto& p = points();
  each_eight(state, [&](std::size_t i) {
    benchmark::DoNotOptimize(
        rhumb_direct(wgs84(), at(p.lat1, i), at(p.lon1, i), at(p.azimuth, i), at(p.distance, i)));
  });
}
BENCHMARK(rhumb_direct_lanes);

void gauss_forward_geographiclib(benchmark::State& state) {
  const GeographicLib::TransverseMercator g(wgs84().a, wgs84().f, 1.0);
  const auto a = in_degrees(points().lat1), b = in_degrees(points().offset);
  each(state, [&](std::size_t i) {
    double x, y;
    g.Forward(0.0, a[i], b[i], x, y);
    benchmark::DoNotOptimize(x);
    benchmark::DoNotOptimize(y);
  });
}
BENCHMARK(gauss_forward_geographiclib);
void gauss_forward_loxo(benchmark::State& state) {
  const auto& p = points();
  each(state, [&](std::size_t i) {
    benchmark::DoNotOptimize(gauss_forward(wgs84(), p.lat1[i], p.offset[i], 0.0));
  });
}
BENCHMARK(gauss_forward_loxo);
void gauss_forward_lanes(benchmark::State& state) {
  const auto& p = points();
  each_eight(state, [&](std::size_t i) {
    benchmark::DoNotOptimize(gauss_forward(wgs84(), at(p.lat1, i), at(p.offset, i), 0.0));
  });
}
BENCHMARK(gauss_forward_lanes);

void gauss_inverse_geographiclib(benchmark::State& state) {
  const GeographicLib::TransverseMercator g(wgs84().a, wgs84().f, 1.0);
  const auto& p = points();
  each(state, [&](std::size_t i) {
    double lat, lon;
    g.Reverse(0.0, p.y[i] - 500000.0, p.x[i], lat, lon);
    benchmark::DoNotOptimize(lat);
    benchmark::DoNotOptimize(lon);
  });
}
BENCHMARK(gauss_inverse_geographiclib);
void gauss_inverse_loxo(benchmark::State& state) {
  const auto& p = points();
  each(state, [&](std::size_t i) {
    benchmark::DoNotOptimize(gauss_inverse(wgs84(), p.x[i], p.y[i], 0.0));
  });
}
BENCHMARK(gauss_inverse_loxo);
void gauss_inverse_lanes(benchmark::State& state) {
  const auto& p = points();
  each_eight(state, [&](std::size_t i) {
    benchmark::DoNotOptimize(gauss_inverse(wgs84(), at(p.x, i), at(p.y, i), 0.0));
  });
}
BENCHMARK(gauss_inverse_lanes);

void to_geodetic_loxo(benchmark::State& state) {
  std::vector<Point<Ecef, double>> r;
  for (std::size_t i = 0; i < kPoints; ++i)
    r.push_back(to_ecef(wgs84(), Geodetic<double>{points().lat1[i], points().lon1[i], 100.0}));
  each(state, [&](std::size_t i) { benchmark::DoNotOptimize(to_geodetic(wgs84(), r[i])); });
}
BENCHMARK(to_geodetic_loxo);

}  // namespace
}  // namespace loxo
