// SPDX-License-Identifier: Apache-2.0
#include "loxo/errors/level_errors.hpp"

#include "loxo/earth/gravity.hpp"

namespace loxo {
namespace {

template <Real S>
void set_rows(Block3<S>& c, const Vec<Ecef, S>& e, const Vec<Ecef, S>& n, const Vec<Ecef, S>& u) {
  const Vec<Ecef, S>* rows[3] = {&e, &n, &u};
  for (int i = 0; i < 3; ++i) {
    c.m[i][0] = rows[i]->x;
    c.m[i][1] = rows[i]->y;
    c.m[i][2] = rows[i]->z;
  }
}
template <Real S>
Curvature<S> curvature_of(const Ellipsoid& ell, const Block3<S>& c, S h) {
  return curvature(ell, c.m[0][2], c.m[1][2], c.m[2][2], h);
}
template <Real S>
Matrix9<S> rotate9(const Block3<S>& r) {
  Matrix9<S> b;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) b.m[3 * k + i][3 * k + j] = r.m[i][j];
  return b;
}
template <Real S>
void put(Matrix9<S>& a, int row, int column, const Block3<S>& b) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a.m[row + i][column + j] = b.m[i][j];
}
template <Real S>
Vec<Ecef, S> vec(const S v[3]) {
  return {v[0], v[1], v[2]};
}

}  // namespace

template <Real S>
LevelAxes<S> geographic_level_axes(const Ellipsoid& ell, const Vec<Ecef, S>& n, S h) {
  LevelAxes<S> a;
  const S c = sqrt(n.x * n.x + n.y * n.y);  // cos L
  const S one(1.0);
  const Vec<Ecef, S> east{-n.y / c, n.x / c, S(0.0)};
  const Vec<Ecef, S> north{-n.z * n.x / c, -n.z * n.y / c, c};
  set_rows(a.C_me, east, north, n);
  a.K = curvature_of(ell, a.C_me, h);
  const S tan_l = n.z / c;
  a.azimuth_turn[0] = tan_l * a.K.xx;
  a.azimuth_turn[1] = tan_l * a.K.xy * one;
  return a;
}
template <Real S>
LevelAxes<S> transverse_level_axes(const Ellipsoid& ell, const Vec<Ecef, S>& n, S h, double lon0) {
  LevelAxes<S> a;
  double s0, c0;
  sincos(lon0, s0, c0);
  // x' = z_e, y' = (cos lon0, sin lon0, 0), z' = (-sin lon0, cos lon0, 0); polar.md 1.1.
  const S nx = n.z, ny = S(c0) * n.x + S(s0) * n.y, nz = S(c0) * n.y - S(s0) * n.x;
  const S cp = sqrt(nx * nx + ny * ny);
  const S sl = ny / cp, cl = nx / cp, zero(0.0);
  auto ecef = [&](S x, S y, S z) {
    return Vec<Ecef, S>{S(c0) * y - S(s0) * z, S(s0) * y + S(c0) * z, x};
  };
  set_rows(a.C_me, ecef(-sl, cl, zero), ecef(-nz * cl, -nz * sl, cp), n);
  a.K = curvature_of(ell, a.C_me, h);
  const S tan_p = nz / cp;
  a.azimuth_turn[0] = tan_p * a.K.xx;
  a.azimuth_turn[1] = tan_p * a.K.xy;
  return a;
}
template <Real S>
LevelAxes<S> grid_level_axes(const Ellipsoid& ell, const Vec<Ecef, S>& n, S h, double lon0) {
  const LevelAxes<S> t = transverse_level_axes(ell, n, h, lon0);
  LevelAxes<S> a;
  for (int j = 0; j < 3; ++j) {
    a.C_me.m[0][j] = t.C_me.m[1][j];   // G_E = N_t
    a.C_me.m[1][j] = -t.C_me.m[0][j];  // G_N = -E_t
    a.C_me.m[2][j] = t.C_me.m[2][j];
  }
  a.K = curvature_of(ell, a.C_me, h);
  // The same turn about up, on the grid's own axes: dE_t = -dN_G, dN_t = dE_G.
  a.azimuth_turn[0] = t.azimuth_turn[1];
  a.azimuth_turn[1] = -t.azimuth_turn[0];
  return a;
}
template <Real S>
LevelAxes<S> wander_level_axes(const Ellipsoid& ell, const Vec<Ecef, S>&, S h,
                               const Rot<Wander, Ecef, S>& C_we) {
  LevelAxes<S> a;
  a.C_me = block_of(C_we);
  a.K = curvature_of(ell, a.C_me, h);
  return a;
}
template <Real S>
void level_transport(const LevelAxes<S>& a, S v_e, S v_n, S w_em[3]) {
  const S rx = a.K.xx * v_e + a.K.xy * v_n, ry = a.K.xy * v_e + a.K.yy * v_n;
  w_em[0] = -ry;
  w_em[1] = rx;
  w_em[2] = a.azimuth_turn[0] * v_e + a.azimuth_turn[1] * v_n;
}
template <Real S>
Block3<S> axes_turn(const LevelAxes<S>& a) {
  Block3<S> t;
  t.m[0][0] = -a.K.xy;
  t.m[0][1] = -a.K.yy;
  t.m[1][0] = a.K.xx;
  t.m[1][1] = a.K.xy;
  t.m[2][0] = a.azimuth_turn[0];
  t.m[2][1] = a.azimuth_turn[1];
  return t;
}
namespace {
template <Real S>
Matrix9<S> classical(const LevelAxes<S>& axes, const S v[3], S sign) {
  Matrix9<S> t = rotate9(identity3<S>());
  const Block3<S> th = sign * axes_turn(axes);
  put(t, 0, 6, th);
  put(t, 3, 6, skew(vec(v)) * th);
  return t;
}
}  // namespace
template <Real S>
Matrix9<S> to_classical(const LevelAxes<S>& axes, const S v[3]) {
  return classical(axes, v, S(1.0));
}
template <Real S>
Matrix9<S> from_classical(const LevelAxes<S>& axes, const S v[3]) {
  return classical(axes, v, S(-1.0));
}
template <Real S>
Matrix9<S> switch_classical(const LevelAxes<S>& a, const LevelAxes<S>& c, const S v_a[3]) {
  // [EST-16]: Th_c R - R Th_a has only its up row; the levels agree in all level frames.
  const Block3<S> R = c.C_me * transpose(a.C_me);
  Matrix9<S> s = rotate9(R);
  const Block3<S> d = axes_turn(c) * R - R * axes_turn(a);
  put(s, 0, 6, d);
  put(s, 3, 6, skew(R * vec(v_a)) * d);
  return s;
}
template <Real S>
Matrix9<S> switch_velocity_rotated_only(const LevelAxes<S>& a, const LevelAxes<S>& c,
                                        const S v_a[3]) {
  Matrix9<S> s = switch_classical(a, c, v_a);
  put(s, 3, 6, Block3<S>{});
  return s;
}
template <Real S>
Matrix9<S> switch_pure_rotation(const LevelAxes<S>& a, const LevelAxes<S>& c) {
  return rotate9(c.C_me * transpose(a.C_me));
}

Matrix15 transverse_error_matrix(const Ellipsoid& ell, const TransversePoint& p) {
  double sp, cp, sl, cl;
  sincos(p.tlat, sp, cp);
  sincos(p.tlon, sl, cl);
  const double tp = sp / cp, s = cp * cl, h = p.h, w = ell.w_ie;
  const double vE = p.v[0], vN = p.v[1], vU = p.v[2];
  const double w2 = 1.0 - ell.e2 * s * s;
  const double N = ell.a / sqrt(w2), M = N * (1.0 - ell.e2) / w2;
  const double kN = 1.0 / (N + h), kM = 1.0 / (M + h);
  const double q = ell.e2 * N * kN * kM / w2;
  // Derivatives by s = sin L, then by p and l: ds/dp = -sin p cos l, ds/dl = -cos p sin l.
  const double N_s = N * ell.e2 * s / w2, M_s = 3.0 * M * ell.e2 * s / w2;
  const double q_s = q * (N_s / N + 2.0 * ell.e2 * s / w2 - N_s * kN - M_s * kM);
  const double k_s = -N_s * kN * kN;
  const double a1 = -sl, a2 = -sp * cl;
  const double ds[3] = {-sp * cl, -cp * sl, 0.0};
  const double da1[3] = {0.0, -cl, 0.0}, da2[3] = {-cp * cl, sp * sl, 0.0};
  const double k_h = -kN * kN, q_h = -q * (kN + kM);
  const double kx = kN + q * a1 * a1, ky = kN + q * a2 * a2, kt = q * a1 * a2;
  const double rE = kx * vE + kt * vN, rN = kt * vE + ky * vN;
  double drE[3], drN[3];
  for (int j = 0; j < 3; ++j) {
    const double dk = j == 2 ? k_h : k_s * ds[j], dq = j == 2 ? q_h : q_s * ds[j];
    const double dkx = dk + dq * a1 * a1 + 2.0 * q * a1 * da1[j];
    const double dky = dk + dq * a2 * a2 + 2.0 * q * a2 * da2[j];
    const double dkt = dq * a1 * a2 + q * (da1[j] * a2 + a1 * da2[j]);
    drE[j] = dkx * vE + dkt * vN;
    drN[j] = dkt * vE + dky * vN;
  }
  const Vec<Transverse> v{vE, vN, vU};
  const Vec<Transverse> w_ie{-w * sl, -w * sp * cl, w * cp * cl};
  const Vec<Transverse> w_et{-rN, rE, rE * tp};
  Block3<> Av, Dx, Ap;
  Av.m[0][0] = -kt, Av.m[0][1] = -ky;
  Av.m[1][0] = kx, Av.m[1][1] = kt;
  Av.m[2][0] = kx * tp, Av.m[2][1] = kt * tp;
  Dx.m[1][0] = -w * cp * cl, Dx.m[2][0] = -w * sp * cl;
  Dx.m[0][1] = -w * cl, Dx.m[1][1] = w * sp * sl, Dx.m[2][1] = -w * cp * sl;
  for (int j = 0; j < 3; ++j) {
    Ap.m[0][j] = -drN[j];
    Ap.m[1][j] = drE[j];
    Ap.m[2][j] = drE[j] * tp + (j == 0 ? rE / (cp * cp) : 0.0);
  }
  // Gravity along the normal: only the up row. Differences of the one formula, exact to rounding.
  Block3<> G;
  if (ell.g_constant <= 0) {
    const double es = 1e-4,
                 eh = 10.0;  // the formula is smooth: central differences to 1e-10 relative
    const double g_s =
        (normal_gravity(ell, s + es, h) - normal_gravity(ell, s - es, h)) / (2.0 * es);
    const double g_h =
        (normal_gravity(ell, s, h + eh) - normal_gravity(ell, s, h - eh)) / (2.0 * eh);
    G.m[2][0] = -g_s * ds[0];
    G.m[2][1] = -g_s * ds[1];
    G.m[2][2] = -g_h;
  }
  Matrix15 F;
  auto place = [&](int row, int column, const Block3<>& b) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) F.m[row + i][column + j] = b.m[i][j];
  };
  const Vec<Transverse> f = p.C_tb * p.f;
  place(0, 0, skew(v) * Av - skew(w_ie + w_ie + w_et));
  place(0, 3, skew(f));
  place(0, 6, skew(v) * (2.0 * Dx + Ap) + G);
  place(3, 0, Av);
  place(3, 3, -1.0 * skew(w_ie + w_et));
  place(3, 6, Dx + Ap);
  // p' = r_N, l' = r_E / cos p, h' = v_U.
  F.m[6][0] = kt, F.m[6][1] = ky;
  F.m[7][0] = kx / cp, F.m[7][1] = kt / cp;
  for (int j = 0; j < 3; ++j) {
    F.m[6][6 + j] = drN[j];
    F.m[7][6 + j] = drE[j] / cp + (j == 0 ? rE * tp / cp : 0.0);
  }
  F.m[8][2] = 1.0;
  place(3, 9, -1.0 * block_of(p.C_tb));
  place(0, 12, block_of(p.C_tb));
  return F;
}

Matrix12 geographic_error_matrix(const Ellipsoid& ell, const GeographicPoint& p) {
  double sL, cL;
  sincos(p.lat, sL, cL);
  const double tL = sL / cL, w = ell.w_ie, vE = p.ve, vN = p.vn;
  const double N = prime_vertical_radius(ell, sL) + p.h, RM = meridian_radius(ell, sL) + p.h;
  const double wE = -vN / RM, wN = w * cL + vE / N, wU = w * sL + vE * tL / N;
  const double sec2 = 1.0 / (cL * cL);
  Matrix12 F;
  auto& m = F.m;
  // (V-53)
  m[0][1] = wU, m[0][2] = -wN, m[0][4] = -1.0 / RM;
  m[1][0] = -wU, m[1][2] = wE, m[1][3] = 1.0 / N, m[1][6] = -w * sL / RM;
  m[2][0] = wN, m[2][1] = -wE, m[2][3] = tL / N, m[2][6] = (w * cL + vE * sec2 / N) / RM;
  m[3][1] = -p.f[2], m[3][2] = p.f[1], m[3][3] = vN * tL / N, m[3][4] = 2.0 * w * sL + vE * tL / N;
  m[3][6] = (2.0 * w * cL * vN + vE * vN * sec2 / N) / RM;
  m[4][0] = p.f[2], m[4][2] = -p.f[0], m[4][3] = -2.0 * (w * sL + vE * tL / N);
  m[4][6] = -(2.0 * w * cL * vE + vE * vE * sec2 / N) / RM;
  m[5][3] = 1.0, m[5][6] = vE * tL / RM;
  m[6][4] = 1.0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m[i][7 + j] = -p.C_nb.m[i][j];
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      // Columns 10, 11: accelerometer biases x, y of the body.
      m[3 + i][10 + j] = p.C_nb.m[i][j];
    }
  return F;
}

Matrix4 dead_reckoning_transition(const Ellipsoid& ell, double lat, double se, double sn,
                                  double phi_u[4]) {
  double sL, cL;
  sincos(lat, sL, cL);
  Matrix4 F;
  for (int i = 0; i < 4; ++i) F.m[i][i] = 1.0;
  F.m[0][1] = se * (sL / cL) / meridian_radius(ell, sL);
  F.m[0][2] = sn, F.m[0][3] = se;
  F.m[1][2] = -se, F.m[1][3] = sn;
  phi_u[0] = sn, phi_u[1] = -se, phi_u[2] = 0, phi_u[3] = 0;
  return F;
}

template LevelAxes<double> geographic_level_axes(const Ellipsoid&, const Vec<Ecef, double>&,
                                                 double);
template LevelAxes<double> transverse_level_axes(const Ellipsoid&, const Vec<Ecef, double>&, double,
                                                 double);
template LevelAxes<double> grid_level_axes(const Ellipsoid&, const Vec<Ecef, double>&, double,
                                           double);
template LevelAxes<double> wander_level_axes(const Ellipsoid&, const Vec<Ecef, double>&, double,
                                             const Rot<Wander, Ecef, double>&);
template void level_transport(const LevelAxes<double>&, double, double, double[3]);
template Block3<double> axes_turn(const LevelAxes<double>&);
template Matrix9<double> to_classical(const LevelAxes<double>&, const double[3]);
template Matrix9<double> from_classical(const LevelAxes<double>&, const double[3]);
template Matrix9<double> switch_classical(const LevelAxes<double>&, const LevelAxes<double>&,
                                          const double[3]);
template Matrix9<double> switch_velocity_rotated_only(const LevelAxes<double>&,
                                                      const LevelAxes<double>&, const double[3]);
template Matrix9<double> switch_pure_rotation(const LevelAxes<double>&, const LevelAxes<double>&);

}  // namespace loxo
