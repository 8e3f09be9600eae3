// SPDX-License-Identifier: Apache-2.0
// For the tests of this room: a motion as closed functions of time in ECEF and its exact IMU
// increments, through no navigation frame. The normal runs along a great circle of normals; height
// and the ship's angles are sines.
#pragma once
#include <cmath>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/ins/mechanization.hpp"

namespace loxo::truth {

// A function of time with its first two derivatives.
struct Jet {
  double v = 0, d = 0, dd = 0;
};
inline Jet operator+(Jet a, Jet b) { return {a.v + b.v, a.d + b.d, a.dd + b.dd}; }
inline Jet operator-(Jet a, Jet b) { return {a.v - b.v, a.d - b.d, a.dd - b.dd}; }
inline Jet operator*(Jet a, Jet b) {
  return {a.v * b.v, a.d * b.v + a.v * b.d, a.dd * b.v + 2 * a.d * b.d + a.v * b.dd};
}
inline Jet operator*(double k, Jet a) { return {k * a.v, k * a.d, k * a.dd}; }
inline Jet chain(Jet a, double f, double f1, double f2) {
  return {f, f1 * a.d, f2 * a.d * a.d + f1 * a.dd};
}
inline Jet sin(Jet a) { return chain(a, std::sin(a.v), std::cos(a.v), -std::sin(a.v)); }
inline Jet cos(Jet a) { return chain(a, std::cos(a.v), -std::sin(a.v), -std::cos(a.v)); }
inline Jet inverse_sqrt(Jet a) {
  const double r = 1.0 / std::sqrt(a.v);
  return chain(a, r, -0.5 * r / a.v, 0.75 * r / (a.v * a.v));
}
struct Jet3 {
  Jet x, y, z;
};

struct Motion {
  Ellipsoid ell;
  // Orthonormal: normal = circle_s (cos(arc) e1 + sin(arc) e2) + circle_c (e1 x e2), a great circle
  // where circle_s = 1, else a small one about e1 x e2.
  Vec<Ecef, double> e1{0, 0, 1}, e2{1, 0, 0};
  double circle_s = 1, circle_c = 0;
  double arc0 = 0, rate = 0;                    // rad, rad/s
  double h0 = 0, heave = 0, heave_period = 10;  // m, m, s
  double surge = 0, surge_period = 120;         // rad of arc, s
  // Ship's angles about the along, cross and up axes: amplitude [rad], period [s].
  double roll = 0, roll_period = 9.3, pitch = 0, pitch_period = 6.7, yaw = 0, yaw_period = 17.3;
  double heading = 0;  // constant turn about up against the track [rad]

  struct At {
    EcefState<double> state;
    Vec<Body, double> w_ib, f;  // rad/s, m/s^2
    double h, vu;
  };
  At at(double t) const {
    const double tau = 6.283185307179586;
    const Jet time{t, 1, 0};
    const Jet arc = Jet{arc0, 0, 0} + rate * time + surge * sin((tau / surge_period) * time);
    const Jet ca = cos(arc), sa = sin(arc);
    const Vec<Ecef, double> e3 = cross(e1, e2);
    const double cs = circle_s, cc = circle_c;
    const Jet one{1, 0, 0};
    const Jet n[3] = {cs * (e1.x * ca + e2.x * sa) + (cc * e3.x) * one,
                      cs * (e1.y * ca + e2.y * sa) + (cc * e3.y) * one,
                      cs * (e1.z * ca + e2.z * sa) + (cc * e3.z) * one};
    const Jet along[3] = {e2.x * ca - e1.x * sa, e2.y * ca - e1.y * sa, e2.z * ca - e1.z * sa};
    const Jet h = Jet{h0, 0, 0} + heave * sin((tau / heave_period) * time);
    const Jet N = ell.a * inverse_sqrt(one - ell.e2 * (n[2] * n[2]));
    const Jet r[3] = {(N + h) * n[0], (N + h) * n[1], ((1 - ell.e2) * N + h) * n[2]};
    // Columns of C_ep: right, along, up of the path; right = along x up.
    const Jet right[3] = {cc * (e1.x * ca + e2.x * sa) - (cs * e3.x) * one,
                          cc * (e1.y * ca + e2.y * sa) - (cs * e3.y) * one,
                          cc * (e1.z * ca + e2.z * sa) - (cs * e3.z) * one};
    Jet c[3][3];
    for (int i = 0; i < 3; ++i) {
      c[i][0] = right[i];
      c[i][1] = along[i];
      c[i][2] = n[i];
    }
    const Jet psi = Jet{heading, 0, 0} + yaw * sin((tau / yaw_period) * time + Jet{0.3, 0, 0});
    const Jet th = pitch * sin((tau / pitch_period) * time + Jet{0.9, 0, 0});
    const Jet ga = roll * sin((tau / roll_period) * time + Jet{0.1, 0, 0});
    const Jet sp = sin(psi), cp = cos(psi), st = sin(th), ct = cos(th), sg = sin(ga), cg = cos(ga);
    const Jet zero{};
    const Jet e[3][3] = {{cp * cg + sp * st * sg, sp * ct, cp * sg - sp * st * cg},
                         {zero - sp * cg + cp * st * sg, cp * ct, zero - sp * sg - cp * st * cg},
                         {zero - ct * sg, st, ct * cg}};
    Jet b[3][3];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        b[i][j] = c[i][0] * e[0][j] + c[i][1] * e[1][j] + c[i][2] * e[2][j];

    At a;
    Rot<Ecef, Body, double> c_eb;
    double s[3][3];  // C^T C'
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        c_eb.m[i][j] = b[i][j].v;
        s[i][j] = b[0][i].v * b[0][j].d + b[1][i].v * b[1][j].d + b[2][i].v * b[2][j].d;
      }
    a.state.r = {r[0].v, r[1].v, r[2].v};
    a.state.v = {r[0].d, r[1].d, r[2].d};
    a.state.q_eb = to_quaternion(c_eb);
    const auto c_be = transpose(c_eb);
    a.w_ib = Vec<Body, double>{0.5 * (s[2][1] - s[1][2]), 0.5 * (s[0][2] - s[2][0]),
                               0.5 * (s[1][0] - s[0][1])} +
             c_be * Vec<Ecef, double>{0, 0, ell.w_ie};
    const auto earth = make_earth_model(ell);
    const double s2 = n[2].v * n[2].v;
    const double gamma = gravity_of(earth, s2, 1.0 / std::sqrt(1.0 - earth.g_e2 * s2), h.v);
    const double w = ell.w_ie;
    a.f = c_be * Vec<Ecef, double>{r[0].dd - 2 * w * r[1].d + gamma * n[0].v,
                                   r[1].dd + 2 * w * r[0].d + gamma * n[1].v,
                                   r[2].dd + gamma * n[2].v};
    a.h = h.v;
    a.vu = h.d;
    return a;
  }
  // Integrals over (t0, t1] by three-point Gauss: relative error (w dt)^6/2e6.
  ImuIncrement<double> imu(double t0, double t1) const {
    const double m = 0.5 * (t0 + t1), d = 0.5 * (t1 - t0), x = 0.7745966692414834;
    const At a = at(m - d * x), b = at(m), c = at(m + d * x);
    const double w1 = 5.0 / 9.0 * d, w2 = 8.0 / 9.0 * d;
    return {t1, t1 - t0, w1 * a.w_ib + w2 * b.w_ib + w1 * c.w_ib, w1 * a.f + w2 * b.f + w1 * c.f};
  }
  std::vector<ImuIncrement<double>> record(double interval, long samples) const {
    std::vector<ImuIncrement<double>> out;
    out.reserve(static_cast<std::size_t>(samples));
    for (long i = 0; i < samples; ++i)
      out.push_back(imu(static_cast<double>(i) * interval, static_cast<double>(i + 1) * interval));
    return out;
  }
};

// A great circle of normals through the point (lat, lon) at the course given, at arc 0 there [rad].
inline Motion great_circle(const Ellipsoid& ell, double lat, double lon, double course,
                           double speed) {
  Motion m;
  m.ell = ell;
  const double sl = std::sin(lat), cl = std::cos(lat), so = std::sin(lon), co = std::cos(lon);
  m.e1 = {cl * co, cl * so, sl};
  const Vec<Ecef, double> east{-so, co, 0}, north{-sl * co, -sl * so, cl};
  m.e2 = std::sin(course) * east + std::cos(course) * north;
  m.rate = speed / (ell.a * (1.0 + 0.5 * ell.e2));
  return m;
}

// Round the pole of the side given (+1 north, -1 south) eastward, `radius` [m] from it, starting on
// the meridian lon.
inline Motion round_the_pole(const Ellipsoid& ell, double side, double radius, double lon,
                             double speed) {
  Motion m;
  m.ell = ell;
  const double so = std::sin(lon), co = std::cos(lon);
  m.e1 = {co, so, 0};
  m.e2 = {-side * so, side * co, 0};  // e1 x e2 = side z
  const double polar = ell.a * ell.a / ell.b;
  m.circle_s = std::sin(radius / polar);
  m.circle_c = std::cos(radius / polar);
  m.rate = side * speed / radius;  // east is the sense of rotation of the Earth
  return m;
}

// |position error| [m] and |attitude error| [rad] between two states.
inline double position_error(const EcefState<double>& a, const EcefState<double>& b) {
  return norm(a.r - b.r);
}
inline double attitude_error(const EcefState<double>& a, const EcefState<double>& b) {
  const auto d = conjugate(a.q_eb) * b.q_eb;
  return 2.0 * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
}

}  // namespace loxo::truth
