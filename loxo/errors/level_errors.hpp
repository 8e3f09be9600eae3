// SPDX-License-Identifier: Apache-2.0
// The classical errors of a level frame and the way between them and the frame-free ones. In a
// level frame m:
//   Phi = error of C_mb (computed - true, C~ = (I - [Phi]) C), dv_m = error of the velocity
//   components, dp = dr [m]. Phi = psi + Th dr,  dv_m = dv + [v] Th dr,  dp = dr [EST-2]
// and the models written in them: polar.md 4.2 (transverse, 9 and 15 states), vehicle.md (V-53),
// (V-54).
#pragma once
#include "loxo/earth/transverse.hpp"
#include "loxo/errors/block3.hpp"

namespace loxo {

// A level frame at a place: its axes, its curvature and how its azimuth turns with position.
template <Real S = double>
struct LevelAxes {
  Block3<S> C_me;       // rows east, north, up of the frame in ECEF components
  Curvature<S> K;       // polar.md 2.1, 1/m
  S azimuth_turn[2]{};  // th_U of [EST-2] on (dE, dN): turn of the axes about up per metre, 1/m
};
// n: unit normal (ECEF), h [m]. Geographic: not defined at the poles (NaN there). Transverse, grid:
// not at |p| = 90 deg.
template <Real S>
LevelAxes<S> geographic_level_axes(const Ellipsoid& ell, const Vec<Ecef, S>& n, S h);
template <Real S>
LevelAxes<S> transverse_level_axes(const Ellipsoid& ell, const Vec<Ecef, S>& n, S h, double lon0);
template <Real S>
LevelAxes<S> grid_level_axes(const Ellipsoid& ell, const Vec<Ecef, S>& n, S h, double lon0);
// C_we: the wander frame's own axes (rows east, north, up).
template <Real S>
LevelAxes<S> wander_level_axes(const Ellipsoid& ell, const Vec<Ecef, S>& n, S h,
                               const Rot<Wander, Ecef, S>& C_we);
// Transport rate w_em on the level axes for the level velocity (E, N) [rad/s]; wander: third
// component zero by th_U = 0.
template <Real S>
void level_transport(const LevelAxes<S>& axes, S v_e, S v_n, S w_em[3]);
// Th of [EST-2], columns dE, dN, dU.
template <Real S>
Block3<S> axes_turn(const LevelAxes<S>& axes);

// 9x9, order psi|Phi, dv, dr.
template <Real S = double>
struct Matrix9 {
  S m[9][9]{};
};
// T of [EST-2] (frame-free on the level axes to classical) and its inverse; v: velocity on the
// level axes.
template <Real S>
Matrix9<S> to_classical(const LevelAxes<S>& axes, const S v[3]);
template <Real S>
Matrix9<S> from_classical(const LevelAxes<S>& axes, const S v[3]);
// S of [EST-16]: classical errors in frame a to those in frame c at the same place; v_a on a's
// axes.
template <Real S>
Matrix9<S> switch_classical(const LevelAxes<S>& a, const LevelAxes<S>& c, const S v_a[3]);
// The two matrices that estimation.md section 5 names as wrong; only for the test that must refuse
// them.
template <Real S>
Matrix9<S> switch_velocity_rotated_only(const LevelAxes<S>& a, const LevelAxes<S>& c,
                                        const S v_a[3]);
template <Real S>
Matrix9<S> switch_pure_rotation(const LevelAxes<S>& a, const LevelAxes<S>& c);

// polar.md 4.2: x = (dv_t 0-2, Phi 3-5, dp, dl [rad], dh [m], b_g 9-11, b_a 12-14 body). x' = F x +
// noise inputs: gyro noise enters Phi' with -C_tb, accelerometer noise dv' with +C_tb. Sphere: ell
// with f = 0 (and its g_constant or g0 (R/r)^2 by the ellipsoid's gravity); ellipsoid: exact, with
// the derivatives of the curvature.
struct TransversePoint {
  double tlat = 0, tlon = 0, h = 0;  // rad, rad, m
  double v[3]{};                     // transverse east, north, up, m/s
  Rot<Transverse, Body> C_tb;
  Vec<Body> f;  // m/s^2
};
struct Matrix15 {
  double m[15][15]{};
};
Matrix15 transverse_error_matrix(const Ellipsoid& ell, const TransversePoint& p);

// (V-53): x = (phiE phiN phiU, dvE dvN, pE pN [m], g_b 7-9 [rad/s], a_x a_y 10-11 [m/s^2]),
// geographic, no vertical channel.
struct GeographicPoint {
  double lat = 0, h = 0, ve = 0, vn = 0;
  double f[3]{};  // specific force on E, N, U, m/s^2
  Rot<Geographic, Body> C_nb;
};
struct Matrix12 {
  double m[12][12]{};
};
Matrix12 geographic_error_matrix(const Ellipsoid& ell, const GeographicPoint& p);

// (V-54), (V-56): one step of dead reckoning, x = (dE, dN [m], mu [rad], dK); se, sn: measured
// increments [m]. `phi_u` receives the column by which the INS azimuth error enters.
struct Matrix4 {
  double m[4][4]{};
};
Matrix4 dead_reckoning_transition(const Ellipsoid& ell, double lat, double se, double sn,
                                  double phi_u[4]);

}  // namespace loxo
