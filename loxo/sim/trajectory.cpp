// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/num/units.hpp"

namespace loxo {

double Trajectory::duration() const {
  double t = 0;
  for (const Leg& leg : legs) t += leg.duration;
  return t;
}

TrajectoryWalk::TrajectoryWalk(const Trajectory& trajectory) : trajectory_(trajectory) {
  double t = 0, u = trajectory.speed;
  for (const Leg& leg : trajectory.legs) {
    leg_start_.push_back(t);
    speed_start_.push_back(u);
    t += leg.duration;
    u = leg.speed;
  }
  const auto axes = transpose(geographic_axes(trajectory.start.lat, trajectory.start.lon));
  x_.n = normal_of(trajectory.start.lat, trajectory.start.lon);
  x_.f = axes * Vec<Geographic>{std::sin(trajectory.course), std::cos(trajectory.course), 0};
}

TrajectoryWalk::Command TrajectoryWalk::command(double t) const {
  if (leg_start_.empty()) return {trajectory_.speed, 0, 0, true};
  const auto after = std::upper_bound(leg_start_.begin(), leg_start_.end(), t);
  const std::size_t i =
      after == leg_start_.begin() ? 0 : static_cast<std::size_t>(after - leg_start_.begin() - 1);
  const Leg& leg = trajectory_.legs[i];
  // The S of x - sin(2 pi x) / (2 pi): first and second derivative are zero at both ends.
  const double x = std::clamp((t - leg_start_[i]) / leg.duration, 0.0, 1.0);
  const double s = x - std::sin(2 * kPi * x) / (2 * kPi);
  const double d = (1 - std::cos(2 * kPi * x)) / leg.duration;
  const double gain = leg.speed - speed_start_[i];
  return {speed_start_[i] + gain * s, gain * d, leg.turn * d, leg.straight};
}

TrajectoryWalk::Angles TrajectoryWalk::angles(double t) const {
  Angles a{};
  for (const Wave& wave : trajectory_.waves) {
    const auto i = static_cast<std::size_t>(wave.axis);
    const double w = 2 * kPi / wave.period, sine = std::sin(w * t + wave.phase);
    a.value[i] += wave.amplitude * sine;
    a.rate[i] += wave.amplitude * w * std::cos(w * t + wave.phase);
    a.second[i] -= wave.amplitude * w * w * sine;
  }
  a.value[3] += trajectory_.start.h;
  return a;
}

TrajectoryWalk::State TrajectoryWalk::rate(double t, const State& x) const {
  const Command c = command(t);
  const Ellipsoid& e = trajectory_.ellipsoid;
  const double h = angles(t).value[3], s = x.n.z;
  const double w = std::sqrt(1 - e.e2 * s * s);
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

Truth TrajectoryWalk::truth_at(double t, const State& x) const {
  const Ellipsoid& e = trajectory_.ellipsoid;
  const Command c = command(t);
  const Angles a = angles(t);
  const State d = rate(t, x);
  Truth out;
  out.t = t;
  out.distance = x.s;
  out.h = a.value[3];
  out.vu = a.rate[3];
  out.state.r = from_normal(e, NormalHeight<double>{x.n, out.h});
  out.state.v = c.u * x.f + out.vu * x.n;

  // Track axes right, forward, up; the vehicle's angles in them; the IMU in the vehicle.
  const Vec<Ecef> right = cross(x.f, x.n);
  Rot<Ecef, Geographic> track;  // level axes with the way as north
  const Vec<Ecef> columns[3] = {right, x.f, x.n};
  for (int j = 0; j < 3; ++j) {
    track.m[0][j] = columns[j].x;
    track.m[1][j] = columns[j].y;
    track.m[2][j] = columns[j].z;
  }
  const double roll = a.value[0], pitch = a.value[1];
  const auto vehicle = to_matrix<Geographic>(Euler<double>{a.value[2], pitch, roll});
  const auto mounted = to_matrix<Geographic>(
      Euler<double>{trajectory_.mounting_heading, trajectory_.mounting_pitch, 0});
  Rot<Body, Body> mounting;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) mounting.m[i][j] = mounted.m[i][j];
  const auto c_eb = track * vehicle * mounting;
  const auto c_be = transpose(c_eb);
  out.state.q_eb = to_quaternion(c_eb);

  const Vec<Body> against_track{
      a.rate[1] * std::cos(roll) + a.rate[2] * std::cos(pitch) * std::sin(roll),
      a.rate[0] - a.rate[2] * std::sin(pitch),
      a.rate[1] * std::sin(roll) - a.rate[2] * std::cos(pitch) * std::cos(roll)};
  const Vec<Ecef> w_ie{0, 0, e.w_ie};
  const Vec<Ecef> turn = cross(x.n, d.n) - dot(d.f, right) * x.n;
  out.w_ib = transpose(mounting) * against_track + c_be * (w_ie + turn);
  const Vec<Ecef> acceleration = c.du * x.f + c.u * d.f + a.second[3] * x.n + out.vu * d.n;
  // f = a + 2 w x v - gravity, gravity downward along the normal (polar.md 3.1).
  out.f = c_be *
          (acceleration + 2.0 * cross(w_ie, out.state.v) + normal_gravity(e, x.n.z, out.h) * x.n);
  return out;
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
  }
  return u;
}

Truth TrajectoryWalk::truth() const { return truth_at(t_, x_); }

}  // namespace loxo
