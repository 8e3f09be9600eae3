// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/transfer_error.hpp"

#include "loxo/earth/gravity.hpp"

namespace loxo {
namespace {

using V = Vec<Transverse, double>;

struct Both {
  TransverseRates<double> home, moved;
  V v;
  Rot<Transverse, Body, double> C_tb;
};
Both both(const Ellipsoid& earth, const TransferPoint& p) {
  Both b;
  b.v = {p.ve, p.vn, 0.0};
  b.home = transverse_rates(earth, p.tlat, p.tlon, 0.0, b.v);
  b.moved = transverse_rates(earth, p.tlat, p.tlon - p.angle, 0.0, b.v);
  b.home.g = p.g;
  b.moved.g = p.gm;
  b.C_tb = to_matrix<Transverse>(Euler<double>{p.heading, p.pitch, p.roll});
  return b;
}

}  // namespace

void set_gravity(const Ellipsoid& earth, TransferPoint& point, double h) {
  point.g = normal_gravity(earth, cos(point.tlat) * cos(point.tlon), h);
  point.gm = normal_gravity(earth, cos(point.tlat) * cos(point.tlon - point.angle), h);
}

EcefPose<double> said_by(const PolarMove& move, const EcefPose<double>& truth,
                         const ReferenceError& e) {
  auto s = to_transverse_state(move.earth, move.lon0, truth);
  auto a = to_euler(s.C_tb);
  a.heading += e.heading, a.pitch += e.pitch, a.roll += e.roll;
  s.C_tb = to_matrix<Transverse>(a);
  s.v.x += e.ve, s.v.y += e.vn;
  EcefPose<double> said = to_ecef_pose(move.earth, move.lon0, s);
  said.r = truth.r;
  return said;
}

AB transfer_ab(double tlon, double angle) {
  // As products of sines: no cancellation for a small angle.
  double sh, ch, sm, cm;
  sincos(0.5 * angle, sh, ch);
  sincos(tlon - 0.5 * angle, sm, cm);
  return {-2.0 * sm * sh, 2.0 * cm * sh};  // (14)
}

Conversion<double> convert(const Ellipsoid& earth, const TransferPoint& p) {
  const Both b = both(earth, p);
  return convert_same_velocity(b.home, b.moved, b.v, b.C_tb);
}

Conversion<double> conversion_error(const Ellipsoid& earth, const TransferPoint& p,
                                    const ReferenceError& e) {
  TransferPoint q = p;
  q.tlat += e.tlat;
  q.tlon += e.tlon;
  q.ve += e.ve;
  q.vn += e.vn;
  q.heading += e.heading;
  q.pitch += e.pitch;
  q.roll += e.roll;
  q.g += e.g;
  q.gm += e.gm;
  const Conversion<double> wrong = convert(earth, q), right = convert(earth, p);
  return {wrong.df - right.df, wrong.dw - right.dw};
}

V attitude_error_vector(const TransferPoint& p, const ReferenceError& e) {
  double s, c;
  sincos(p.heading, s, c);
  const auto C = to_matrix<Transverse>(Euler<double>{p.heading, p.pitch, p.roll});
  const V x1{c, -s, 0.0}, forward{C.m[0][1], C.m[1][1], C.m[2][1]};
  return V{0.0, 0.0, e.heading} - x1 * e.pitch - forward * e.roll;  // 7.3
}

Conversion<double> conversion_error_full(const Ellipsoid& earth, const TransferPoint& p,
                                         const ReferenceError& e) {
  const Both b = both(earth, p);
  const V dv{e.ve, e.vn, 0.0}, phi = attitude_error_vector(p, e);
  const V O = b.moved.w_ie - b.home.w_ie, E = b.moved.w_et - b.home.w_et;
  // w_et is linear in the velocity.
  const V dE = transverse_rates(earth, p.tlat, p.tlon - p.angle, 0.0, dv).w_et -
               transverse_rates(earth, p.tlat, p.tlon, 0.0, dv).w_et;
  const V X = O + O + E;
  V force = cross(X, b.v);
  force.z += p.gm - p.g;
  const auto C_bt = transpose(b.C_tb);
  return {C_bt * (cross(phi, force) + cross(X, dv) + cross(dE, b.v)),  // (9)
          C_bt * (cross(phi, O + E) + dE)};                            // (10)
}

ErrorCoefficients error_coefficients(double A, double B, double w, double G, double theading) {
  double S, C;
  sincos(theading, S, C);
  ErrorCoefficients k;
  const double a = 2.0 * A * w;
  k.F_ve = {a * S, -a * C, 0.0};              // (15)
  k.F_vn = {a * C, a * S, 2.0 * B * w};       // (15)
  k.F_pe = {G * S, -G * C, 0.0};              // (16)
  k.F_pn = {G * C, G * S, 0.0};               // (16)
  k.W_pe = {-A * w * S, A * w * C, 0.0};      // (17)
  k.W_pn = {-A * w * C, -A * w * S, -B * w};  // (17)
  k.W_pu = {-B * w * S, B * w * C, 0.0};      // (18)
  return k;
}

Conversion<double> conversion_error_simple(const Ellipsoid& earth, const TransferPoint& p,
                                           const ReferenceError& e) {
  const AB ab = transfer_ab(p.tlon, p.angle);
  const ErrorCoefficients k = error_coefficients(ab.A, ab.B, earth.w_ie, p.gm - p.g, p.heading);
  const V phi = attitude_error_vector(p, e);
  return {k.F_ve * e.ve + k.F_vn * e.vn + k.F_pe * phi.x + k.F_pn * phi.y,  // (12)
          k.W_pe * phi.x + k.W_pn * phi.y + k.W_pu * phi.z};                // (13)
}

}  // namespace loxo
