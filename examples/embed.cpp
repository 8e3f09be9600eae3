// SPDX-License-Identifier: Apache-2.0
// The strapdown loop inside a program of yours: reads increments from standard input, prints the
// solution once a second.
//   embed lat_deg lon_deg h_m heading_deg < increments
// A line is "t dt  angle_right angle_forward angle_up  dv_right dv_forward dv_up" in s, rad and
// m/s; at rest at the start, level. Nothing is allocated in the loop; the wander frame is regular
// everywhere, the poles too.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/ins/strapdown.hpp"
#include "loxo/num/units.hpp"

using namespace loxo;
using Navigator = WanderMechanization;  // or Transverse, Grid, Ecef, Geographic

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "expected: embed lat_deg lon_deg h_m heading_deg < increments\n");
    return 2;
  }
  double given[4];
  for (int i = 0; i < 4; ++i) {
    char* end = nullptr;
    given[i] = std::strtod(argv[i + 1], &end);
    if (end == argv[i + 1] || *end != '\0' || !std::isfinite(given[i])) {
      std::fprintf(stderr, "expected a number, found '%s'\n", argv[i + 1]);
      return 2;
    }
  }
  const double lat = given[0] * deg, lon = given[1] * deg;
  const Ellipsoid ellipsoid = wgs84();
  const EarthModel earth = make_earth_model(ellipsoid);
  const auto level = to_matrix<Geographic>(Euler<double>{given[3] * deg, 0.0, 0.0});
  const EcefState<double> start{to_ecef(ellipsoid, Geodetic<double>{lat, lon, given[2]}),
                                {},
                                to_quaternion(transpose(geographic_axes(lat, lon)) * level)};
  auto state = Navigator::from_ecef(earth, start);

  ImuIncrement<double> pair[2];
  int held = 0;
  double next = -1e300;
  std::printf("t_s,lat_deg,lon_deg,h_m,ve_mps,vn_mps,vu_mps\n");
  for (;;) {
    ImuIncrement<double>& s = pair[held];
    const int n = std::scanf("%lf %lf %lf %lf %lf %lf %lf %lf", &s.t, &s.dt, &s.dtheta.x,
                             &s.dtheta.y, &s.dtheta.z, &s.dv.x, &s.dv.y, &s.dv.z);
    if (n == 8 && ++held < 2) continue;
    if (held > 0) state = step(earth, state, combine(pair, held));  // an odd last sample on its own
    const double t = held > 0 ? pair[held - 1].t : 0.0;
    if (held > 0 && (t >= next || n != 8)) {
      const auto e = Navigator::to_ecef(earth, state);
      const auto g = to_geodetic(ellipsoid, e.r);
      const auto v = geographic_axes(g.lat, g.lon) * e.v;
      std::printf("%.3f,%.9f,%.9f,%.3f,%.4f,%.4f,%.4f\n", t, g.lat / deg, g.lon / deg, g.h, v.x,
                  v.y, v.z);
      next = std::floor(t + 1e-6) + 1.0 - 1e-6;
    }
    held = 0;
    if (n != 8) return n == EOF ? 0 : 3;
  }
}
