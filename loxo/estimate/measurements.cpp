// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/measurements.hpp"

#include "loxo/num/units.hpp"

namespace loxo {

MountingAxes mounting_axes(double eps_h, double eps_p) {
  double sh, ch, sp, cp;
  sincos(eps_h, sh, ch);
  sincos(eps_p, sp, cp);
  return {{{ch, sh, 0.0}, {-sh * cp, ch * cp, -sp}, {-sh * sp, ch * sp, cp}}, sp, cp};
}

namespace {
Vec<Body> point_velocity(const MeasurementPoint& p, const Vec<Body>& l) {
  return transpose(p.C) * p.v + cross(p.w_eb, l);
}
// d(R_m vb)/d eps_h on the three rows. [EST-12]
void heading_derivative(const MountingAxes& m, const Vec<Body>& vb, double out[3]) {
  const double r = dot(m.axis[0], vb);
  out[0] = m.cos_p * dot(m.axis[1], vb) + m.sin_p * dot(m.axis[2], vb);
  out[1] = -m.cos_p * r;
  out[2] = -m.sin_p * r;
}
void pitch_derivative(const MountingAxes& m, const Vec<Body>& vb, double out[3]) {
  out[0] = 0;
  out[1] = -dot(m.axis[2], vb);
  out[2] = dot(m.axis[1], vb);
}
}  // namespace

ScalarMeasurement vehicle_velocity(const MeasurementPoint& p, const NominalState& s,
                                   const MountingAxes& m, int axis, bool with_tau,
                                   double direction) {
  const Vec<Body> vb = point_velocity(p, s.lever);
  const Vec<Body>& a = m.axis[axis];
  const bool offset = axis == 1 && s.offset_speed > 0;
  const double per_speed = offset ? 1.0 / s.offset_speed : 0.0;
  const double k = axis == 1 ? s.scale - s.offset * per_speed : 1.0;
  const Vec<Ecef> g = p.C * a;
  double dh[3], dp[3];
  heading_derivative(m, vb, dh);
  pitch_derivative(m, vb, dp);
  ScalarMeasurement o;
  o.h = k * dot(a, vb);
  if (offset) {
    o.h += s.offset * direction;
    o.row.add(kOffset, direction - dot(a, vb) * per_speed);
  }
  o.row.add3(kPsi, k * cross(g, p.v));
  o.row.add3(kDv, -k * g);
  o.row.add3(kBg, k * cross(a, s.lever));
  o.row.add3(kLever, k * cross(a, p.w_eb));
  if (axis == 1) o.row.add(kScale, dot(a, vb));
  o.row.add(kEpsH, k * dh[axis]);
  o.row.add(kEpsP, k * dp[axis]);
  if (with_tau) o.row.add(kTau, -k * dot(g, p.a));
  return o;
}

AccumulatorTransition<double> accumulator_transition(const MeasurementPoint& p,
                                                     const NominalState& s, const MountingAxes& m,
                                                     double dt) {
  const Vec<Body> vb = point_velocity(p, s.lever);
  AccumulatorTransition<double> t;
  double dh[3], dp[3];
  heading_derivative(m, vb, dh);
  pitch_derivative(m, vb, dp);
  auto set = [](Block3<>& b, int i, double x, double y, double z) {
    b.m[i][0] = x;
    b.m[i][1] = y;
    b.m[i][2] = z;
  };
  for (int i = 0; i < 3; ++i) {
    const Vec<Ecef> g = p.C * m.axis[i];
    const Vec<Ecef> psi = cross(p.v, g);  // -(g x v)
    const Vec<Body> bg = cross(s.lever, m.axis[i]), lv = cross(p.w_eb, m.axis[i]);
    set(t.psi, i, psi.x * dt, psi.y * dt, psi.z * dt);
    set(t.dv, i, g.x * dt, g.y * dt, g.z * dt);
    set(t.bg, i, bg.x * dt, bg.y * dt, bg.z * dt);
    set(t.lever, i, lv.x * dt, lv.y * dt, lv.z * dt);
    t.eps_h[i] = -dh[i] * dt;
    t.eps_p[i] = -dp[i] * dt;
  }
  return t;
}
void accumulator_rate(const MeasurementPoint& p, const NominalState& s, const MountingAxes& m,
                      double rate[3]) {
  const Vec<Body> vb = point_velocity(p, s.lever);
  for (int i = 0; i < 3; ++i) rate[i] = dot(m.axis[i], vb);
}
void across_the_way(AccumulatorTransition<double>& t, const double rate[3]) {
  // Slip is an angle, and it stands both in the displacement to the side, v theta, and in the row
  // that predicts it (theta on the speed): their product has a mean, which pulls the speed down by
  // P_vv / v every second. At the constraint itself, d(v theta) less theta dv, the row has no part
  // along the way. Below 1 m/s ([EST-13]) there is no way to speak of.
  for (int i = 0; i < 3; i += 2) {
    const double slope = rate[i] * rate[1] / (rate[1] * rate[1] + 1.0);
    for (int j = 0; j < 3; ++j) {
      t.psi.m[i][j] -= slope * t.psi.m[1][j];
      t.dv.m[i][j] -= slope * t.dv.m[1][j];
      t.bg.m[i][j] -= slope * t.bg.m[1][j];
      t.lever.m[i][j] -= slope * t.lever.m[1][j];
    }
    t.eps_h[i] -= slope * t.eps_h[1];
    t.eps_p[i] -= slope * t.eps_p[1];
  }
}
ScalarMeasurement accumulated_distance(const NominalState& s, double speed_change) {
  ScalarMeasurement o;
  o.h = s.scale * s.d[1];
  o.row.add(kAcc + 1, -s.scale);
  o.row.add(kScale, s.d[1]);
  o.row.add(kTau, -speed_change);
  return o;
}
ScalarMeasurement accumulated_side(const NominalState& s, int axis) {
  ScalarMeasurement o;
  o.h = s.d[axis];
  o.row.add(kAcc + axis, -1.0);
  return o;
}

ScalarMeasurement zero_velocity(const MeasurementPoint& p, int axis) {
  ScalarMeasurement o;
  o.h = axis == 0 ? p.v.x : axis == 1 ? p.v.y : p.v.z;
  o.row.add(kDv + axis, -1.0);
  return o;
}
ScalarMeasurement zero_rate(const MeasurementPoint& p, const NominalState& s, int axis) {
  const Vec<Body> earth = transpose(p.C) * p.w_ie;
  const Vec<Body> a{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
  ScalarMeasurement o;
  o.h = dot(a, s.bg + earth);
  o.row.add3(kPsi, cross(p.C * a, p.w_ie));
  o.row.add(kBg + axis, 1.0);
  return o;
}

ScalarMeasurement position_along(const MeasurementPoint& p, const Vec<Body>& l,
                                 const Vec<Ecef>& along, const Point<Ecef>& origin) {
  const Vec<Ecef> arm = p.C * l;
  ScalarMeasurement o;
  o.h = dot(along, (p.r - origin) + arm);
  o.row.add3(kPsi, -cross(along, arm));
  o.row.add3(kDr, -along);
  return o;
}
ScalarMeasurement velocity_along(const MeasurementPoint& p, const Vec<Body>& l,
                                 const Vec<Ecef>& along) {
  const Vec<Ecef> arm = p.C * cross(p.w_eb, l);
  ScalarMeasurement o;
  o.h = dot(along, p.v + arm);
  o.row.add3(kPsi, -cross(along, arm));
  o.row.add3(kDv, -along);
  o.row.add3(kBg, cross(transpose(p.C) * along, l));
  return o;
}
ScalarMeasurement body_velocity(const MeasurementPoint& p, const Vec<Body>& l, int axis) {
  const Vec<Body> a{axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0};
  const Vec<Ecef> g = p.C * a;
  ScalarMeasurement o;
  o.h = dot(a, point_velocity(p, l));
  o.row.add3(kPsi, cross(g, p.v));
  o.row.add3(kDv, -g);
  o.row.add3(kBg, cross(a, l));
  return o;
}
ScalarMeasurement heading_in(const MeasurementPoint& p, const Vec<Ecef>& e, const Vec<Ecef>& n,
                             const Vec<Ecef>& u, const double turn[2]) {
  const Vec<Ecef> f = p.C * Vec<Body>{0, 1, 0};
  const double fe = dot(e, f), fn = dot(n, f), fu = dot(u, f);
  const double level2 = fe * fe + fn * fn;
  ScalarMeasurement o;
  const double h = atan2(fe, fn);
  o.h = h < 0 ? h + 2 * kPi : h;
  // -1 on Phi_U, +tan(pitch)(sin, cos) on (Phi_E, Phi_N), tan(pitch) sin = fu fe / level^2; then
  // Phi = psi + Th dr, whose level rows turn the level only.
  const double te = fu * fe / level2, tn = fu * fn / level2;
  o.row.add3(kPsi, te * e + tn * n - u);
  o.row.add3(kDr, -turn[0] * e - turn[1] * n);
  return o;
}

}  // namespace loxo
