// SPDX-License-Identifier: Apache-2.0
#include "loxo/ins/solution.hpp"

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"

namespace loxo {

SolutionRow solution_row(const Ellipsoid& earth, double t, const Point<Ecef>& r, const Vec<Ecef>& v,
                         const Quat<Ecef, Body>& q) {
  SolutionRow row;
  row.t = t;
  const Geodetic<double> g = to_geodetic(earth, r);
  const Rot<Geographic, Ecef> axes = geographic_axes(g.lat, g.lon);
  const Vec<Geographic> level = axes * v;
  const Euler<double> a = to_euler(axes * to_matrix(q));
  row.lat = g.lat, row.lon = g.lon, row.h = g.h;
  row.ve = level.x, row.vn = level.y, row.vu = level.z;
  row.roll = a.roll, row.pitch = a.pitch, row.heading = a.heading;
  row.qw = q.w, row.qx = q.x, row.qy = q.y, row.qz = q.z;
  row.x = r.x, row.y = r.y, row.z = r.z;
  return row;
}

}  // namespace loxo
