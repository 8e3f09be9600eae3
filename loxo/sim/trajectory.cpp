// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/trajectory.hpp"

#include <algorithm>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/ins/increments.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/units.hpp"

namespace loxo {

double Trajectory::duration() const {
  if (path) return path->duration();
  double t = 0;
  for (const Leg& leg : legs) t += leg.duration;
  return t;
}

TrajectoryWalk::TrajectoryWalk(const Trajectory& trajectory) : trajectory_(trajectory) {
  const auto mounted = to_matrix<Geographic>(
      Euler<double>{trajectory_.mounting_heading, trajectory_.mounting_pitch, 0});
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) mounting_.m[i][j] = mounted.m[i][j];
  if (trajectory.path) return;
  double t = 0, u = trajectory.speed;
  for (const Leg& leg : trajectory.legs) {
    leg_start_.push_back(t);
    speed_start_.push_back(u);
    t += leg.duration;
    u = leg.speed;
  }
  const auto axes = transpose(geographic_axes(trajectory.start.lat, trajectory.start.lon));
  x_.n = normal_of(trajectory.start.lat, trajectory.start.lon);
  x_.f = axes * Vec<Geographic>{loxo::sin(trajectory.course), loxo::cos(trajectory.course), 0};
}

TrajectoryWalk::Command TrajectoryWalk::command(double t) const {
  if (leg_start_.empty()) return {trajectory_.speed, 0, 0, true};
  const auto after = std::upper_bound(leg_start_.begin(), leg_start_.end(), t);
  const std::size_t i =
      after == leg_start_.begin() ? 0 : static_cast<std::size_t>(after - leg_start_.begin() - 1);
  const Leg& leg = trajectory_.legs[i];
  // The S of x - sin(2 pi x) / (2 pi): first and second derivative are zero at both ends.
  const double x = std::clamp((t - leg_start_[i]) / leg.duration, 0.0, 1.0);
  const double s = x - loxo::sin(2 * kPi * x) / (2 * kPi);
  const double d = (1 - loxo::cos(2 * kPi * x)) / leg.duration;
  const double gain = leg.speed - speed_start_[i];
  return {speed_start_[i] + gain * s, gain * d, leg.turn * d, leg.straight};
}

TrajectoryWalk::Angles TrajectoryWalk::angles(double t) const {
  Angles a{};
  for (const Wave& wave : trajectory_.waves) {
    const auto i = static_cast<std::size_t>(wave.axis);
    const double w = 2 * kPi / wave.period, sine = loxo::sin(w * t + wave.phase);
    a.value[i] += wave.amplitude * sine;
    a.rate[i] += wave.amplitude * w * loxo::cos(w * t + wave.phase);
    a.second[i] -= wave.amplitude * w * w * sine;
  }
  if (!trajectory_.path) a.value[3] += trajectory_.start.h;
  return a;
}

TrajectoryWalk::State TrajectoryWalk::rate(double t, const State& x) const {
  const Command c = command(t);
  const Ellipsoid& e = trajectory_.ellipsoid;
  const double h = angles(t).value[3], s = x.n.z;
  const double w = loxo::sqrt(1 - e.e2 * s * s);
  const double across = prime_vertical_radius(e, s) + h, along = meridian_radius(e, s) + h;
  const Vec<Ecef> v = c.u * x.f, axis{0, 0, 1};
  // The normal turns by v/(N+h) and, northward, by what M lacks of N: N - M = a e2 cos^2 L / w^3,
  // regular at the pole.
  const Vec<Ecef> p = axis - s * x.n;
  State d;
  d.n = (1.0 / across) * v + (e.a * e.e2 / (w * w * w * along * across) * dot(p, v)) * p;
  double turn = c.turn;
  // A true course turns against a straight way by v_E tan L / (N + h).
  if (!c.straight && c.u != 0) turn -= s * dot(v, cross(axis, x.n)) / (dot(p, p) * across);
  d.f = turn * cross(x.f, x.n) - dot(x.f, d.n) * x.n;
  d.s = c.u;
  return d;
}

TrajectoryWalk::State TrajectoryWalk::advanced(double t, const State& x, double dt) const {
  if (trajectory_.path) {  // only the way is an integral: Simpson
    const double sum = motion_on_path(t).speed + 4 * motion_on_path(t + 0.5 * dt).speed +
                       motion_on_path(t + dt).speed;
    return {x.n, x.f, x.s + dt / 6 * sum};
  }
  const auto plus = [](const State& a, double k, const State& b) {
    return State{a.n + k * b.n, a.f + k * b.f, a.s + k * b.s};
  };
  const State a = rate(t, x), b = rate(t + dt / 2, plus(x, dt / 2, a)),
              c = rate(t + dt / 2, plus(x, dt / 2, b)), d = rate(t + dt, plus(x, dt, c));
  State y = plus(plus(plus(plus(x, dt / 6, a), dt / 3, b), dt / 3, c), dt / 6, d);
  y.n = (1.0 / norm(y.n)) * y.n;
  y.f = y.f - dot(y.f, y.n) * y.n;
  y.f = (1.0 / norm(y.f)) * y.f;
  return y;
}

TrajectoryWalk::Motion TrajectoryWalk::motion_on_path(double t) const {
  const Ellipsoid& e = trajectory_.ellipsoid;
  const Path::Place p = trajectory_.path->at(t);
  const Angles a = angles(t);
  Motion m;
  m.n = p.n;
  m.dn = p.q1 * p.n1;
  m.h = p.h + a.value[3];
  m.vu = p.h1 * p.q1 + a.rate[3];
  m.au = p.h2 * p.q1 * p.q1 + p.h1 * p.q2 + a.second[3];
  // Metres by the parameter: g = (N + h) n' - b (n'.p) p with p = axis - s n, b = a e2/w^3: what
  // the meridian's radius lacks of N, regular at the pole. Then its derivatives by q and by h.
  const double s = p.n.z, ds = p.n1.z, w2 = 1 - e.e2 * s * s, w = loxo::sqrt(w2);
  const double N = e.a / w, b = e.a * e.e2 / (w2 * w);
  const double dN = b * s * ds, db = 3 * e.e2 * s * ds * b / w2;
  const Vec<Ecef> axis{0, 0, 1}, pole = axis - s * p.n, dpole = -ds * p.n - s * p.n1;
  const double along = dot(p.n1, pole), dalong = dot(p.n2, pole) + dot(p.n1, dpole);
  const Vec<Ecef> g = (N + m.h) * p.n1 - (b * along) * pole;
  const Vec<Ecef> dg =
      dN * p.n1 + (N + m.h) * p.n2 - (db * along + b * dalong) * pole - (b * along) * dpole;
  const Vec<Ecef> turned = p.q1 * dg + m.vu * p.n1;  // dg/dt
  const double size = norm(g);
  m.f = (1.0 / size) * g;
  const double dsize = dot(m.f, turned);
  m.df = (1.0 / size) * (turned - dsize * m.f);
  m.v = p.q1 * g;
  m.dv = p.q2 * g + p.q1 * turned;
  m.pitch = loxo::atan2(p.h1, size);
  m.dpitch = (p.h2 * p.q1 * size - p.h1 * dsize) / (size * size + p.h1 * p.h1);
  m.speed = p.q1 * loxo::sqrt(size * size + p.h1 * p.h1);
  return m;
}

TrajectoryWalk::Motion TrajectoryWalk::motion(double t, const State& x) const {
  if (trajectory_.path) return motion_on_path(t);
  const Command c = command(t);
  const Angles a = angles(t);
  const State d = rate(t, x);
  Motion m;
  m.n = x.n;
  m.f = x.f;
  m.dn = d.n;
  m.df = d.f;
  m.v = c.u * x.f;
  m.dv = c.du * x.f + c.u * d.f;
  m.h = a.value[3];
  m.vu = a.rate[3];
  m.au = a.second[3];
  m.pitch = m.dpitch = 0;
  m.speed = c.u;
  return m;
}

Truth TrajectoryWalk::truth_at(double t, const State& x) const {
  const Ellipsoid& e = trajectory_.ellipsoid;
  const Motion m = motion(t, x);
  const Angles a = angles(t);
  Truth out;
  out.t = t;
  out.distance = x.s;
  out.h = m.h;
  out.vu = m.vu;
  out.forward = m.f;
  out.up = m.n;
  out.state.r = from_normal(e, NormalHeight<double>{m.n, out.h});
  out.state.v = m.v + m.vu * m.n;

  // Track axes right, forward, up; the vehicle's angles in them; the IMU in the vehicle.
  const Vec<Ecef> right = cross(m.f, m.n);
  Rot<Ecef, Geographic> track;  // level axes with the way as north
  const Vec<Ecef> columns[3] = {right, m.f, m.n};
  for (int j = 0; j < 3; ++j) {
    track.m[0][j] = columns[j].x;
    track.m[1][j] = columns[j].y;
    track.m[2][j] = columns[j].z;
  }
  const double roll = a.value[0], pitch = a.value[1] + m.pitch, dpitch = a.rate[1] + m.dpitch;
  double sr, cr, sp, cp;
  sincos(roll, sr, cr);
  sincos(pitch, sp, cp);
  const auto c_eb =
      track * to_matrix<Geographic>(Euler<double>{a.value[2], pitch, roll}) * mounting_;
  const auto c_be = transpose(c_eb);
  out.state.q_eb = to_quaternion(c_eb);

  const Vec<Body> against_track{dpitch * cr + a.rate[2] * cp * sr, a.rate[0] - a.rate[2] * sp,
                                dpitch * sr - a.rate[2] * cp * cr};
  const Vec<Ecef> w_ie{0, 0, e.w_ie};
  const Vec<Ecef> turn = cross(m.n, m.dn) - dot(m.df, right) * m.n;
  out.w_ib = transpose(mounting_) * against_track + c_be * (w_ie + turn);
  const Vec<Ecef> acceleration = m.dv + m.au * m.n + m.vu * m.dn;
  // f = a + 2 w x v - gravity, gravity downward along the normal (polar.md 3.1).
  out.f = c_be *
          (acceleration + 2.0 * cross(w_ie, out.state.v) + normal_gravity(e, m.n.z, out.h) * m.n);
  return out;
}

bool TrajectoryWalk::true_course() const { return !trajectory_.path && !command(t_).straight; }

Vec<Body> TrajectoryWalk::earth_rate(const Truth& truth) const {
  return truth.w_ib -
         rotate(conjugate(truth.state.q_eb), Vec<Ecef>{0, 0, trajectory_.ellipsoid.w_ie});
}

double TrajectoryWalk::wheel_way(const Vec<Body>& lever) const {
  return x_.s + (mounting_ * cross(turned_, lever)).y;
}
double TrajectoryWalk::wheel_speed(const Vec<Body>& lever) const {
  return motion(t_, x_).speed + (mounting_ * cross(earth_rate(), lever)).y;
}

ImuIncrement<double> TrajectoryWalk::to(double t) {
  const double dt = t - t_, node = 0.5 * dt * (1 - 0.7745966692414834);
  const double at[4] = {t_ + node, t_ + 0.5 * dt, t - node, t};
  const double weight[3] = {5.0 / 18.0 * dt, 8.0 / 18.0 * dt, 5.0 / 18.0 * dt};
  ImuIncrement<double> u{t, dt, {}, {}};
  for (int i = 0; i < 4; ++i) {
    x_ = advanced(t_, x_, at[i] - t_);
    t_ = at[i];
    if (i == 3) break;
    const Truth here = truth_at(t_, x_);
    u.dtheta += weight[i] * here.w_ib;
    u.dv += weight[i] * here.f;
    turned_ += weight[i] * earth_rate(here);
  }
  return u;
}

Truth TrajectoryWalk::truth() const { return truth_at(t_, x_); }

}  // namespace loxo
