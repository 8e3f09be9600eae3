// SPDX-License-Identifier: Apache-2.0
// A truth for this room's tests: a drive on level ground whose increments
// the non-linear ECEF mechanization turns back into it exactly, so that what a filter then shows is
// its own.
#pragma once
#include <cmath>
#include <functional>
#include <vector>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/num/rotation_forms.hpp"
#include "loxo/num/units.hpp"

namespace loxo {

struct ExactRoute {
  double dt = 0.01;
  std::vector<Vec<Body>> dtheta, dv;  // over the step that ends at i, i >= 1
  std::vector<Quat<Ecef, Body>> q;
  std::vector<Vec<Ecef>> v;
  std::vector<Point<Ecef>> r;
  std::vector<double> distance, speed;  // of the vehicle, m, m/s
  std::vector<Geodetic<double>> place;
};

// speed(t) [m/s] along course(t) [rad]; the IMU stands eps clockwise from the vehicle's forward
// axis.
inline ExactRoute make_exact_route(const Ellipsoid& ell, const Geodetic<double>& start,
                                   const std::function<double(double)>& course,
                                   const std::function<double(double)>& speed, double length,
                                   double dt, double eps) {
  ExactRoute out;
  out.dt = dt;
  const Vec<Ecef> w{0, 0, ell.w_ie};
  auto gravity_at = [&](const Point<Ecef>& r) {
    const NormalHeight<double> p = to_normal(ell, r);
    return p.n * (-normal_gravity(ell, p.n.z, p.h));
  };
  const int n = static_cast<int>(std::lround(length / dt));
  Point<Ecef> r = to_ecef(ell, start);
  double s = 0;
  for (int i = 0; i <= n; ++i) {
    const double t = i * dt, u = speed(t), c = course(t);
    auto velocity = [&](const Point<Ecef>& at) {
      const Geodetic<double> g = to_geodetic(ell, at);
      return transpose(geographic_axes(g.lat, g.lon)) *
             Vec<Geographic>{u * std::sin(c), u * std::cos(c), 0};
    };
    if (i > 0) {
      r = out.r.back() + (0.5 * dt) * (out.v.back() + velocity(out.r.back() + out.v.back() * dt));
      s += 0.5 * (u + out.speed.back()) * dt;
    }
    const Geodetic<double> g = to_geodetic(ell, r);
    Vec<Ecef> v = velocity(r);
    if (i > 0) {
      // Velocity and position agree by the trapezoid, as in the mechanization.
      v = velocity(r);
      r = out.r.back() + (0.5 * dt) * (out.v.back() + v);
    }
    const Quat<Ecef, Body> q = to_quaternion(transpose(geographic_axes(g.lat, g.lon)) *
                                             to_matrix<Geographic>(Euler<double>{c + eps, 0, 0}));
    if (i == 0) {
      out.dtheta.emplace_back(), out.dv.emplace_back();
    } else {
      const Quat<Ecef, Body>& q0 = out.q.back();
      const Quat<Body, Body> d = conjugate(q0) * exp_rotation<Ecef, Ecef>(w * dt) * q;
      const Vec<Body> rho = rotation_vector(d);
      // Coning term of the one-sample-and-its-predecessor form taken back.
      const Vec<Body>& a0 = out.dtheta.back();
      Vec<Body> a = rho;
      if (i > 1)
        for (int j = 0; j < 3; ++j) a = rho - (1.0 / 12.0) * cross(a0, a);
      const Vec<Ecef> first =
          v - out.v.back() -
          dt * (gravity_at(out.r.back() + out.v.back() * (0.5 * dt)) - cross(w, out.v.back() + v));
      Vec<Ecef> f = first;
      for (int j = 0; j < 2; ++j) f = first + (0.5 * dt) * cross(w, f);
      const Vec<Body> dvs = transpose(to_matrix(q0)) * f;
      Vec<Body> b = dvs;
      for (int j = 0; j < 4; ++j) {
        Vec<Body> rest = 0.5 * cross(a, b) + (1.0 / 6.0) * cross(a, cross(a, b));
        if (i > 1) rest = rest + (1.0 / 12.0) * (cross(a0, b) + cross(out.dv.back(), a));
        b = dvs - rest;
      }
      out.dtheta.push_back(a), out.dv.push_back(b);
    }
    out.q.push_back(q), out.v.push_back(v), out.r.push_back(r);
    out.distance.push_back(s), out.speed.push_back(u), out.place.push_back(to_geodetic(ell, r));
  }
  return out;
}

}  // namespace loxo
