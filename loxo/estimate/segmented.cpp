// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/segmented.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <complex>
#include <vector>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/errors/level_errors.hpp"
#include "loxo/ins/strapdown.hpp"
#include "loxo/num/rotation_forms.hpp"

namespace loxo {
namespace {

using M2 = Eigen::Matrix2d;
using M4 = Eigen::Matrix4d;
using V2 = Eigen::Vector2d;
using V4 = Eigen::Vector4d;
using M16 = Eigen::Matrix<double, 16, 16>;
using V16 = Eigen::Matrix<double, 16, 1>;
using M18 = Eigen::Matrix<double, 18, 18>;

M2 two(const double* p) {
  M2 m;
  m << p[0], p[1], p[2], p[3];
  return m;
}
void store(const M2& m, double* p) {
  p[0] = m(0, 0), p[1] = m(0, 1), p[2] = m(1, 0), p[3] = m(1, 1);
}
M2 pseudo_inverse(const M2& a) {
  Eigen::SelfAdjointEigenSolver<M2> e(0.5 * (a + a.transpose()));
  M2 out = M2::Zero();
  const double top = e.eigenvalues().cwiseAbs().maxCoeff();
  for (int i = 0; i < 2; ++i)
    if (e.eigenvalues()[i] > 1e-9 * top)
      out += e.eigenvectors().col(i) * e.eigenvectors().col(i).transpose() / e.eigenvalues()[i];
  return out;
}
// (V-60)
M2 fused(const M2& Pa, const M2& Pb, const M2& X, const M2& W) {
  const M2 V = M2::Identity() - W;
  return V * Pa * V.transpose() + W * Pb * W.transpose() + V * X * W.transpose() +
         W * X.transpose() * V.transpose();
}

}  // namespace

void weight_minimum_variance(const double Pa[4], const double Pb[4], const double X[4], double W[4],
                             double P[4]) {
  const M2 A = two(Pa), B = two(Pb), C = two(X);
  const M2 w = (A - C) * pseudo_inverse(A + B - C - C.transpose());  // (V-57)
  store(w, W);
  store(fused(A, B, C, w), P);
}
void weight_naive(const double Pa[4], const double Pb[4], const double X[4], double W[4],
                  double P[4]) {
  const M2 A = two(Pa), B = two(Pb);
  const M2 w = A * pseudo_inverse(A + B);  // (V-58)
  store(w, W);
  store(fused(A, B, two(X), w), P);
}
void weight_intersection(const double Pa[4], const double Pb[4], double W[4], double P[4]) {
  // What is not known to be wrong at all gets a sigma far below any other's.
  const double least = 1e-12 * (Pa[0] + Pa[3] + Pb[0] + Pb[3]) + 1e-24;
  const M2 Ai = (two(Pa) + least * M2::Identity()).inverse(),
           Bi = (two(Pb) + least * M2::Identity()).inverse();
  auto at = [&](double om) { return M2((om * Ai + (1 - om) * Bi).inverse()); };
  double lo = 0, hi = 1;  // golden section: the trace is convex in om
  const double g = 0.6180339887498949;
  double a = hi - g * (hi - lo), b = lo + g * (hi - lo), fa = at(a).trace(), fb = at(b).trace();
  for (int i = 0; i < 30; ++i) {
    if (fa < fb) {
      hi = b, b = a, fb = fa;
      a = hi - g * (hi - lo);
      fa = at(a).trace();
    } else {
      lo = a, a = b, fa = fb;
      b = lo + g * (hi - lo);
      fb = at(b).trace();
    }
  }
  const double om = 0.5 * (lo + hi);
  const M2 p = at(om);
  store(p * ((1 - om) * Bi), W);  // (V-59)
  store(p, P);
}

struct SegmentedNavigator::Impl {
  SegmentedConfig c;
  SegmentedEpoch out;
  // INS alone, ECEF; the vertical channel is the dead reckoning's (level terrain: zero).
  double t = 0, t0 = 0, last_epoch = 0, last_tick = 0;
  Quat<Ecef, Body> q;
  Vec<Ecef> v;
  Point<Ecef> r;
  NormalPoint<double> np;  // of r, kept along: one Newton step a sample instead of eight
  Rot<Geographic, Body> C_nb;
  ImuIncrement<double> before;
  EarthModel earth;
  // Means over the tick and over the epoch.
  Vec<Geographic> forward;
  double forward_time = 0;
  Vec<Geographic> f_sum;
  Rot<Geographic, Body> C_sum;
  double sum_time = 0;
  // Dead reckoning
  double dr_lat = 0, dr_lon = 0, dr_h = 0, up_speed = 0;
  double se = 0, sn = 0, length = 0, distance = 0;
  std::vector<std::array<double, 2>> stored;  // one (SE, SN) a second of phase 1
  double k = 1, mu = 0;
  bool switched = false, set_off = false;
  double total_e = 0, total_n = 0;
  // What the odometer's point has gone beyond the IMU's since the start, by turning about it: east,
  // north, up. The track is reckoned for the odometer's point, from the IMU's start.
  Vec<Geographic> lever_start, lever_way, lever_before;
  // Filters
  V4 x4 = V4::Zero();
  M4 P4 = M4::Zero();
  // What INS and dead reckoning truly know of each other under phase 1's gains: the sixteen errors
  // (12, 13: of phase 1's filtered position until the switch, of the reckoned one from then on)
  // and, 16 and 17, what the increments alone have gathered: noise and the INS's azimuth.
  M18 Pf = M18::Zero();
  V16 xj = V16::Zero();
  M16 Pj = M16::Zero();
  double held_k = 1, held_mu = 0, change_since = 0;
  double joint_k = 1, joint_mu = 0;

  void start(const SegmentedStart& s) {
    earth = make_earth_model(c.ellipsoid);
    t = t0 = last_epoch = last_tick = s.t;
    const Rot<Geographic, Ecef> C = geographic_axes(s.place.lat, s.place.lon);
    C_nb = s.C_nb;
    lever_start = C_nb * c.lever;
    q = to_quaternion(transpose(C) * s.C_nb);
    v = transpose(C) * Vec<Geographic>{s.ve, s.vn, 0};
    r = to_ecef(c.ellipsoid, s.place);
    np = normal_point(earth, r);
    dr_lat = s.place.lat, dr_lon = s.place.lon, dr_h = s.place.h;
    ins_before = s.place;
    stored.reserve(static_cast<std::size_t>(c.latest) + 10);
    // P0 from its causes, correlated (6.1): phiN0 = aE/g, phiE0 = -aN/g, phiU0 = (-gE + wU
    // phiN0)/wN.
    double sl, cl;
    sincos(s.place.lat, sl, cl);
    const double g = normal_gravity(c.ellipsoid, sl, s.place.h), wn = c.ellipsoid.w_ie * cl,
                 wu = c.ellipsoid.w_ie * sl;
    Eigen::Matrix<double, 12, 5> A =
        Eigen::Matrix<double, 12, 5>::Zero();  // from (gx, gy, gz, ax, ay)
    for (int j = 0; j < 2 && c.static_level; ++j) {
      A(0, 3 + j) = -C_nb.m[1][j] / g;
      A(1, 3 + j) = C_nb.m[0][j] / g;
    }
    if (c.static_heading)
      for (int j = 0; j < 5; ++j) A(2, j) = j < 3 ? -C_nb.m[0][j] / wn : wu / wn * A(1, j);
    for (int j = 0; j < 5; ++j) A(7 + j, j) = 1;
    Eigen::Matrix<double, 5, 1> var;
    var << c.gyro_bias * c.gyro_bias * Eigen::Vector3d::Ones(),
        c.accel_bias * c.accel_bias * Eigen::Vector2d::Ones();
    M16 P = M16::Zero();
    P.topLeftCorner<12, 12>() = A * var.asDiagonal() * A.transpose();
    const double level = max(c.level_std, c.given_level_std),
                 speed = max(c.velocity_std, c.given_velocity_std);
    P(0, 0) += level * level;
    P(1, 1) += level * level;
    P(2, 2) += c.heading_std * c.heading_std;
    P(3, 3) = P(4, 4) = speed * speed;
    // Both start at the same point: the position's error is common and cancels in every difference.
    P(14, 14) = c.mounting_std * c.mounting_std;
    P(15, 15) = c.scale_std * c.scale_std;
    P(12, 12) = P(13, 13) = 1e-6;
    Pj = P;
    Pf.topLeftCorner<16, 16>() = P;
    P4.diagonal() << 0.01, 0.01, P(14, 14), P(15, 15);
  }

  void imu(const ImuIncrement<double>& sample) {
    const double dt = sample.t - t;
    if (!(dt > 0)) return;
    const bool same = before.dt > 0 && fabs(before.dt - sample.dt) < 0.01 * sample.dt;
    const StepIncrement<double> u = same ? one_sample(before, sample) : one_sample(sample);
    before = sample;
    const State<EcefMechanization, double> after =
        step(earth, State<EcefMechanization, double>{q, v, {r, np.n, np.h, np.zeta}}, u);
    q = normalized(after.q_nb);
    r = after.position.r;
    v = after.v;
    t = sample.t;
    // The vertical channel follows the dead reckoning.
    np = refine_normal(earth, r, np.zeta);
    const auto& n = np;
    dr_h += up_speed * dt;
    v = v + (up_speed - dot(v, n.n)) * n.n;
    r = r + (dr_h - n.h) * n.n;
    np.h = dr_h;
    // Means for the dead reckoning and the filters' F.
    const double hyp = hypot(n.n.x, n.n.y);
    const Vec<Ecef> east{-n.n.y / hyp, n.n.x / hyp, 0.0};
    const Vec<Ecef> north = cross(n.n, east);
    const auto C = from_axes<Geographic>(east, north, n.n);
    const Rot<Geographic, Body> now = C * to_matrix(q);
    forward = forward + Vec<Geographic>{0.5 * (now.m[0][1] + C_nb.m[0][1]),
                                        0.5 * (now.m[1][1] + C_nb.m[1][1]),
                                        0.5 * (now.m[2][1] + C_nb.m[2][1])} *
                            dt;
    forward_time += dt;
    C_nb = now;
    f_sum = f_sum + now * sample.dv;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) C_sum.m[i][j] += now.m[i][j] * dt;
    sum_time += dt;
  }

  // One increment of the track on the ellipsoid, at the latitude of its middle.
  void advance(double de, double dn) {
    const double s0 = std::sin(dr_lat),
                 half = dr_lat + 0.5 * dn / (meridian_radius(c.ellipsoid, s0) + dr_h),
                 s = std::sin(half);
    dr_lat += dn / (meridian_radius(c.ellipsoid, s) + dr_h);
    dr_lon += de / ((prime_vertical_radius(c.ellipsoid, s) + dr_h) * std::cos(half));
  }

  bool odometer(const OdometerTick& tick) {
    const double interval = tick.t - last_tick;
    if (!(interval > 0)) return false;
    const double ds = tick.value;
    // (V-46), (V-47): along the body's forward axis, its mean over the tick; (V-48), (V-49): as
    // indicated and by the attitude in use, whose first order is (V-50).
    if (forward_time > 0) {
      const Vec<Geographic> dir = forward * (1.0 / forward_time);
      const double e = ds * dir.x, n = ds * dir.y;  // as indicated
      se += e, sn += n;
      const std::complex<double> z = std::complex<double>(n, e) * std::polar(1.0, -mu) / k;
      advance(z.imag(), z.real());
      const Vec<Geographic> turned = C_nb * c.lever - lever_start;
      up_speed = (ds * dir.z / k - (turned.z - lever_way.z)) / interval;
      lever_way = turned;
    }
    length += fabs(ds);
    distance += fabs(ds);
    last_tick = tick.t;
    forward = {};
    forward_time = 0;
    if (tick.t - last_epoch < 1.0 - 1e-6 || sum_time <= 0) return false;
    epoch_end(tick.t);
    return true;
  }

  // (V-54) and its parts (V-50), (V-52) for an increment (N + iE): the reckoned states of a joint
  // transition, and these alone.
  M4 reckoning_step(M16& A, const std::complex<double>& increment) const {
    double phi_u[4];
    const Matrix4 F =
        dead_reckoning_transition(c.ellipsoid, dr_lat, increment.imag(), increment.real(), phi_u);
    M4 D;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) D(i, j) = F.m[i][j];
    A.bottomRightCorner<4, 4>() = D;
    for (int i = 0; i < 2; ++i) A(12 + i, 2) = phi_u[i];
    return D;
  }

  void epoch_end(double now) {
    const double T = now - last_epoch;
    last_epoch = now;
    // No pulse yet is no rest: a wheel of coarse pulses turns unseen while the vehicle sets off,
    // and the INS must not be held then. From zero, a second of rest shows no more than bias, level
    // and noise at five sigma.
    const double unseen =
        5.0 * ((c.accel_bias + 9.8 * c.level_std) * T + c.accel_noise * std::sqrt(T) + 1e-4);
    if (distance == 0 && !(norm(v) < unseen)) set_off = true;
    if (distance == 0 && !set_off) {
      // Still at rest: both wait for each other, the clock of phase 1 has not begun. Velocity and
      // position are known here.
      v = {};
      r = to_ecef(c.ellipsoid, start_place);
      np = normal_point(earth, r);
      t0 = now;
      const double ng = c.gyro_noise * c.gyro_noise * T;
      for (int i = 0; i < 3; ++i) Pf(i, i) += ng, Pj(i, i) += ng;
      // At rest the velocity is zero, to what a second unwatched may add.
      const double still = std::pow(unseen / 5.0, 2);
      for (int i = 3; i < 5; ++i) Pf(i, i) = Pj(i, i) = std::min(Pj(i, i), still);
      se = sn = 0;
      f_sum = {};
      C_sum = Rot<Geographic, Body>{};
      sum_time = 0;
      change_since = now;
      out = SegmentedEpoch{};
      out.t = now;
      const Geodetic<double> here = start_place;
      ins_before = here;
      fill(here,
           (prime_vertical_radius(c.ellipsoid, std::sin(here.lat)) + here.h) * std::cos(here.lat),
           meridian_radius(c.ellipsoid, std::sin(here.lat)) + here.h);
      return;
    }
    const NormalHeight<double> place = to_normal(c.ellipsoid, r);
    const Geodetic<double> ins = to_geodetic(c.ellipsoid, r);
    const Rot<Geographic, Ecef> C_ge = geographic_axes(ins.lat, ins.lon);
    const Vec<Geographic> vn = C_ge * v;
    GeographicPoint p;
    p.lat = ins.lat, p.h = ins.h, p.ve = vn.x, p.vn = vn.y;
    p.f[0] = f_sum.x / sum_time, p.f[1] = f_sum.y / sum_time, p.f[2] = f_sum.z / sum_time;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) p.C_nb.m[i][j] = C_sum.m[i][j] / sum_time;
    // (V-53), with (V-51) in its position rows.
    const Matrix12 F12 = geographic_error_matrix(c.ellipsoid, p);
    Eigen::Matrix<double, 12, 12> F;
    for (int i = 0; i < 12; ++i)
      for (int j = 0; j < 12; ++j) F(i, j) = F12.m[i][j];
    const Eigen::Matrix<double, 12, 12> FT = F * T;
    // z = p_DR - p_INS in metres with the local scale.
    const double ke = (prime_vertical_radius(c.ellipsoid, place.n.z) + ins.h) * std::cos(ins.lat),
                 kn = meridian_radius(c.ellipsoid, place.n.z) + ins.h;
    // Increments of this epoch as the present calibration has them.
    const std::complex<double> z = std::complex<double>(sn, se) * std::polar(1.0, -mu) / k;
    const double e = z.imag(), n = z.real();
    // The state moves with the increments as measured, of which (V-54) is exact; gains must not
    // know the noise of the very reading that they weigh (mean of gain times innovation: not zero,
    // and on a straight road, where scale and speed hardly part, the scale drifts away). For them
    // the increment is foretold from the INS and what the filter has found so far.
    const std::complex<double> moved(
        (ins.lat - ins_before.lat) * kn + lever_way.y - lever_before.y,
        wrap_pi(ins.lon - ins_before.lon) * ke + lever_way.x - lever_before.x);
    ins_before = ins;
    lever_before = lever_way;
    M16 A = M16::Identity();
    A.topLeftCorner<12, 12>() += FT + 0.5 * FT * FT;
    M16 foretold = A;
    const M4 D = reckoning_step(A, z);
    reckoning_step(foretold, (moved - T * std::complex<double>(xj[4], xj[3])) /
                                 std::complex<double>(1 - xj[15], -xj[14]));
    // Of the two phases, which do not know the joint filter.
    M16 own = A;
    const M4 D4 =
        reckoning_step(own, switched ? z : moved / std::complex<double>(1 - x4[3], -x4[2]));
    M18 apart = M18::Identity();
    apart.topLeftCorner<16, 16>() = own;
    apart.bottomRightCorner<2, 2>() = own.block<2, 2>(12, 12);
    apart.block<2, 1>(16, 2) = own.block<2, 1>(12, 2);
    M16 Q = M16::Zero();
    for (int i = 0; i < 3; ++i) Q(i, i) = c.gyro_noise * c.gyro_noise * T;
    for (int i = 3; i < 5; ++i) Q(i, i) = c.accel_noise * c.accel_noise * T;
    for (int i = 5; i < 7; ++i) Q(i, i) = c.accel_noise * c.accel_noise * T * T * T / 3;
    // White scale and side slip of the increment, quantisation; walks of the constants.
    const double s2 = e * e + n * n, along = c.scale_noise * c.scale_noise,
                 across = c.slip_noise * c.slip_noise,
                 q6 = c.quantisation * c.quantisation / 6 + c.way_noise * c.way_noise * T;
    M2 Qd;
    Qd << along * e * e + across * n * n + q6, (along - across) * e * n, (along - across) * e * n,
        along * n * n + across * e * e + q6;
    Q.block<2, 2>(12, 12) = Qd;
    const bool moves = s2 > 1e-4;
    Q(14, 14) = moves ? c.mounting_walk * c.mounting_walk * T : 0.0;
    Q(15, 15) = moves ? c.scale_walk * c.scale_walk * T : 0.0;
    M18 Qf = M18::Zero();
    Qf.topLeftCorner<16, 16>() = Q;
    Qf.block<2, 2>(16, 16) = Qf.block<2, 2>(12, 16) = Qf.block<2, 2>(16, 12) = Qd;
    Pf = apart * Pf * apart.transpose() + Qf;
    Pj = foretold * Pj * foretold.transpose() + Q;
    xj = A * xj;

    const V2 difference = apart_by(ins, ke, kn);
    if (!switched) {
      stored.push_back({se, sn});
      total_e += se, total_n += sn;
      M4 Q4 = M4::Zero();
      const double qs = 1e-6 * s2 + q6;
      Q4.diagonal() << qs, qs, 1e-12 * T, 1e-10 * T;
      x4 = D * x4;
      P4 = D4 * P4 * D4.transpose() + Q4;
      const double age = now - t0, drift = c.c_a * c.accel_bias * age * age / 2,
                   tilt = 9.8 * c.given_level_std * age * age / 2,
                   start = c.given_velocity_std * age;
      const M2 R = (c.r0 * c.r0 + drift * drift + tilt * tilt + start * start) * M2::Identity();
      const Eigen::Matrix<double, 4, 2> K =
          P4.leftCols<2>() * (P4.topLeftCorner<2, 2>() + R).inverse();
      x4 += K * (difference - x4.head<2>());
      M4 J = M4::Identity();
      J.leftCols<2>() -= K;
      P4 = J * P4 * J.transpose() + K * R * K.transpose();
      // The same gains on the joint covariance: DR errors become (I - K H) d + K p_I.
      M18 B = M18::Identity();
      B.block<4, 4>(12, 12) = J;
      B.block<4, 2>(12, 5) = K;
      Pf = B * Pf * B.transpose();
    }
    // Joint filter: z = p_INS - p_DR = p_I - d + noise.
    {
      const V2 zj = -difference;
      Eigen::Matrix<double, 2, 16> H = Eigen::Matrix<double, 2, 16>::Zero();
      H(0, 5) = H(1, 6) = 1;
      H(0, 12) = H(1, 13) = -1;
      const M2 S = H * Pj * H.transpose() + 0.05 * 0.05 * M2::Identity();
      const Eigen::Matrix<double, 16, 2> K = Pj * H.transpose() * S.inverse();
      xj += K * (zj - H * xj);
      const M16 J = M16::Identity() - K * H;
      Pj = J * Pj * J.transpose() + 0.05 * 0.05 * K * K.transpose();
      Pj = 0.5 * (Pj + Pj.transpose()).eval();
    }

    out = SegmentedEpoch{};
    out.t = now;
    out.distance = distance;
    if (!switched) {
      // (V-55): k and mu from the linear states.
      const std::complex<double> zeta(1 - x4[3], -x4[2]);
      const double kk = 1 / std::abs(zeta), mm = -std::arg(zeta);
      out.k = kk, out.mu = mm;
      out.mu_std = std::sqrt(Pf(14, 14));
      out.k_std = std::sqrt(Pf(15, 15));
      const double age = now - t0;
      if (fabs(kk - held_k) > c.change_limit || fabs(mm - held_mu) > c.change_limit) {
        held_k = kk, held_mu = mm;
        change_since = now;
      }
      // The rule speaks of this filter's own sigmas, doubled because they are optimistic by about
      // two.
      const double rule_k = 2 * std::sqrt(P4(3, 3)), rule_mu = 2 * std::sqrt(P4(2, 2));
      const bool met = age >= c.earliest && distance >= c.distance && rule_k <= c.sd_limit &&
                       rule_mu <= c.sd_limit && now - change_since >= 20;
      if (met || age >= c.latest) {
        out.switched = true;
        out.forced = !met;
        calibrate(kk, mm);
      }
    } else {
      out.k = k, out.mu = mu;
      out.mu_std = std::sqrt(Pf(14, 14));
      out.k_std = std::sqrt(Pf(15, 15));
    }
    out.phase = switched ? 2 : 1;
    se = sn = 0;
    length = 0;
    f_sum = {};
    C_sum = Rot<Geographic, Body>{};
    sum_time = 0;
    fill(ins, ke, kn);
  }

  // Errors of the track replayed with phase 1's calibration, in place of its filtered position:
  // what the increments gathered, and what is left of (mu, K) times the way.
  M18 replayed() const {
    M18 B = M18::Identity();
    B(12, 12) = B(13, 13) = 0;
    B(12, 16) = B(13, 17) = 1;
    B(12, 14) = total_n, B(12, 15) = total_e;
    B(13, 14) = -total_e, B(13, 15) = total_n;
    return B;
  }

  // The switch: replay the stored increments with the final calibration, and what this does to the
  // errors.
  void calibrate(double kk, double mm) {
    const double old_lat = dr_lat, old_lon = dr_lon;
    const Geodetic<double> origin = start_place;
    dr_lat = origin.lat, dr_lon = origin.lon;
    k = kk, mu = mm;
    for (const auto& s : stored) {
      const std::complex<double> z = std::complex<double>(s[1], s[0]) * std::polar(1.0, -mu) / k;
      advance(z.imag(), z.real());
    }
    const M18 B = replayed();
    Pf = B * Pf * B.transpose();
    // Joint filter: the same shift of the nominal track; its residual (mu, K) becomes what it
    // believes beyond (k, mu).
    const double ke =
        (prime_vertical_radius(c.ellipsoid, std::sin(dr_lat)) + dr_h) * std::cos(dr_lat);
    const double kn = meridian_radius(c.ellipsoid, std::sin(dr_lat)) + dr_h;
    xj[12] += wrap_pi(dr_lon - old_lon) * ke;
    xj[13] += (dr_lat - old_lat) * kn;
    const std::complex<double> zeta(1 - xj[15], -xj[14]);
    const double jk = 1 / std::abs(zeta), jm = -std::arg(zeta);
    // Residual zeta relative to the new nominal: e^{-i dm} / dk = 1 - K' - i M'.
    const std::complex<double> rest = std::polar(k / jk, -(jm - mu));
    xj[15] = 1 - rest.real();
    xj[14] = -rest.imag();
    switched = true;
  }

  // East, north: the reckoned position of the IMU less the INS's, m.
  V2 apart_by(const Geodetic<double>& ins, double ke, double kn) const {
    return {wrap_pi(dr_lon - ins.lon) * ke - lever_way.x, (dr_lat - ins.lat) * kn - lever_way.y};
  }

  void fill(const Geodetic<double>& ins, double ke, double kn) {
    auto place = [&](Horizontal& h, double e, double n, const M2& P) {
      h.lat = ins.lat + n / kn;
      h.lon = wrap_pi(ins.lon + e / ke);
      h.cov[0] = P(0, 0), h.cov[1] = 0.5 * (P(0, 1) + P(1, 0)), h.cov[2] = P(1, 1);
    };
    const V2 d = apart_by(ins, ke, kn);
    // Until the switch too the reckoned position is the increments' with the present calibration,
    // so that neither it nor the weights jump there.
    const M18 B = switched ? M18::Identity() : replayed();
    const M18 P = B * Pf * B.transpose();
    const M2 Pi = P.block<2, 2>(5, 5), Pd = P.block<2, 2>(12, 12), X = P.block<2, 2>(5, 12);
    place(out.ins, 0, 0, Pi);
    V2 reckoned = d;
    if (!switched)
      reckoned -= V2{total_n * x4[2] + total_e * x4[3], total_n * x4[3] - total_e * x4[2]};
    place(out.reckoned, reckoned[0], reckoned[1], Pd);
    double pa[4], pb[4], x[4], w[4], p[4];
    store(Pi + 1e-6 * M2::Identity(), pa);
    store(Pd + 1e-6 * M2::Identity(), pb);
    store(X, x);
    weight_minimum_variance(pa, pb, x, w, p);
    out.ins_weight = 1 - 0.5 * (w[0] + w[3]);
    V2 s = two(w) * reckoned;
    place(out.weighted, s[0], s[1], two(p));
    weight_naive(pa, pb, x, w, p);
    s = two(w) * reckoned;
    place(out.naive, s[0], s[1], two(p));
    weight_intersection(pa, pb, w, p);
    s = two(w) * reckoned;
    place(out.intersection, s[0], s[1], two(p));
    place(out.joint, -xj[5], -xj[6], Pj.block<2, 2>(5, 5));
    const Vec<Geographic> level = geographic_axes(ins.lat, ins.lon) * v;
    out.ve = level.x, out.vn = level.y;
    out.heading_std = std::sqrt(P(2, 2));
    const std::complex<double> zeta(1 - xj[15], -xj[14]);
    out.joint_k = k / std::abs(zeta);
    out.joint_mu = mu - std::arg(zeta);
    out.joint_k_std = std::sqrt(Pj(15, 15));
    out.joint_mu_std = std::sqrt(Pj(14, 14));
  }

  Geodetic<double> start_place, ins_before;
};

SegmentedNavigator::SegmentedNavigator(const SegmentedConfig& config, const SegmentedStart& start)
    : impl_(std::make_unique<Impl>()) {
  impl_->c = config;
  impl_->start_place = start.place;
  impl_->start(start);
}
SegmentedNavigator::~SegmentedNavigator() = default;
void SegmentedNavigator::imu(const ImuIncrement<double>& sample) { impl_->imu(sample); }
bool SegmentedNavigator::odometer(const OdometerTick& tick) { return impl_->odometer(tick); }
const SegmentedEpoch& SegmentedNavigator::epoch() const { return impl_->out; }
const Point<Ecef>& SegmentedNavigator::ins() const { return impl_->r; }
const Vec<Ecef>& SegmentedNavigator::velocity() const { return impl_->v; }
const Rot<Geographic, Body>& SegmentedNavigator::attitude() const { return impl_->C_nb; }
double SegmentedNavigator::t() const { return impl_->t; }

}  // namespace loxo
