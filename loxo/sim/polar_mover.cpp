// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/polar_mover.hpp"

#include <algorithm>
#include <cmath>

#include "loxo/earth/gravity.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/rotation_forms.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

using Turn = Quat<Ecef, Body, double>;

// exp_rotation for increments: by its series to 1e-14 where small, at a third of the time.
template <class F>
Quat<F, F, double> turn_by(const Vec<F, double>& phi) {
  const double h2 = 0.25 * dot(phi, phi);
  if (h2 > 4e-4) return exp_rotation<F, F>(phi);
  const double k = 0.5 * (1.0 - h2 * (1.0 / 6 - h2 * (1.0 / 120 - h2 / 5040)));
  return {1.0 - h2 * (0.5 - h2 * (1.0 / 24 - h2 / 720)), k * phi.x, k * phi.y, k * phi.z};
}

std::string seconds(double t) {
  std::string s = std::to_string(t);
  s.erase(s.find_last_not_of('0') + 1);
  if (!s.empty() && s.back() == '.') s.pop_back();
  return s + " s";
}

// The cubic through values and rates at both ends of an interval of T; u in [0, 1].
double cubic(double x0, double d0, double x1, double d1, double T, double u) {
  const double u2 = u * u, u3 = u2 * u;
  return x0 + (x1 - x0) * (3 * u2 - 2 * u3) + T * (d0 * (u - 2 * u2 + u3) + d1 * (u3 - u2));
}

// Transverse latitude, longitude and height of an epoch and how fast they change.
struct PlaceRates {
  double p, l, h, dp, dl, dh;
};
PlaceRates place_rates(const PolarMove& move, const EcefPose<double>& e) {
  const auto s = to_transverse_state(move.earth, move.lon0, e);
  const auto w = transverse_rates(move.earth, s.tlat, s.tlon, s.h, s.v).w_et;  // 2.2
  return {s.tlat, s.tlon, s.h, -w.x, w.y / cos(s.tlat), s.v.z};
}

}  // namespace

PolarMover::PolarMover(
    const PolarMove& move, std::function<std::optional<ReferenceEpoch>()> next_reference,
    double longest_gap, std::function<void(const MovedSample&)> emit,
    std::function<void(double, const TransverseState<double>&, const TransverseState<double>&)>
        emit_reference)
    : move_(move),
      next_(std::move(next_reference)),
      longest_gap_(longest_gap),
      emit_(std::move(emit)),
      emit_reference_(std::move(emit_reference)) {
  const auto a = next_();
  if (!a) throw Error(ErrorKind::kInput, "the reference holds no epoch");
  k1_ = *a;
  first_ = k1_.t;
  const auto home = to_transverse_state(move_.earth, move_.lon0, k1_.e);
  p_ = home.tlat;
  l_ = home.tlon - move_.angle;
  p_t_ = first_;
  p_v_ = home.v;
  emit_reference_(k1_.t, home, moved_of(home));
  ended_ = !next_interval();
}

bool PolarMover::next_interval() {
  const auto b = next_();
  if (!b) return false;
  k0_ = k1_;
  k1_ = *b;
  if (!(k1_.t > k0_.t))
    throw Error(ErrorKind::kInput, "the reference goes back in time at " + seconds(k1_.t) +
                                       " (after " + seconds(k0_.t) + ")");
  if (k1_.t - k0_.t > longest_gap_)
    throw Error(ErrorKind::kInput, "the reference has a gap of " + seconds(k1_.t - k0_.t) +
                                       " from " + seconds(k0_.t) + " to " + seconds(k1_.t) +
                                       "; longest allowed " + seconds(longest_gap_));
  started_ = true;
  return true;
}

TransverseState<double> PolarMover::moved_of(const TransverseState<double>& home) {
  if (move_.keep == Keep::kPath) return move_state(move_, home);
  TransverseState<double> m = home;
  m.tlat = p_;
  m.tlon = l_;
  return m;
}

// E1: the moved path comes along with the mean of the velocities at both ends.
void PolarMover::advance(const TransverseState<double>& home, double t) {
  advance_transverse(move_.earth, p_, l_, home.h, (p_v_ + home.v) * 0.5, t - p_t_);
  p_t_ = t;
  p_v_ = home.v;
}

void PolarMover::add(const ImuIncrement<double>& sample) {
  if (sample.t - 0.5 * sample.dt < first_) {
    ++before_;
    if (sample.t > first_ && !ended_) held_.push_back(sample);  // its second half carries the state
    return;
  }
  if (ended_) {
    ++after_;
    return;
  }
  held_.push_back(sample);
  while (!ended_ && sample.t >= k1_.t) {
    close_interval();
    ended_ = !next_interval();
  }
  if (ended_) {
    for (const auto& u : held_)
      if (u.t - 0.5 * u.dt > k1_.t) ++after_;
    held_.clear();
  }
}

// The interval's samples are all here (or the log ends): carry the state through them, close it on
// k1, emit.
void PolarMover::close_interval() {
  const Vec<Ecef, double> w_ie{0.0, 0.0, move_.earth.w_ie};
  struct Mid {
    std::size_t sample;
    double t;
    Turn q;
    Vec<Ecef, double> v;
  };
  std::vector<Mid> mids;
  Turn q = to_quaternion(k0_.e.C_eb);
  Vec<Ecef, double> v = k0_.e.v;
  double t = k0_.t;
  bool whole = true;
  // Gravity and Coriolis along the way: slow, so from the reference's own ends.
  const auto pull = [&](const EcefPose<double>& e) {
    const auto n = to_normal(move_.earth, e.r);
    return n.n * -normal_gravity<double>(move_.earth, n.n.z, n.h) - cross(w_ie, e.v) * 2.0;
  };
  const Vec<Ecef, double> a0 = pull(k0_.e), a1 = pull(k1_.e);
  const double T = k1_.t - k0_.t;
  // From t to `to` within sample u whose increments change by `slope` from sample to sample: second
  // order in the rate.
  ImuIncrement<double> slope;
  Turn q_middle;  // of the stretch carried last
  const auto carry = [&](const ImuIncrement<double>& u, double to) {
    const double h = to - t;
    if (h <= 0) return;
    const double a = (t - u.t) / u.dt + 0.5, b = (to - u.t) / u.dt + 0.5, m = 0.5 * (a + b);
    const auto part = [&](const Vec<Body, double>& whole_, const Vec<Body, double>& d, double x,
                          double y) { return whole_ * (y - x) + d * (0.5 * (y * y - x * x)); };
    const double s = (t + 0.5 * h - k0_.t) / T;
    const auto earth = turn_by(w_ie * (-0.5 * h));
    const Turn half = earth * (q * turn_by(part(u.dtheta, slope.dtheta, a, m)));
    q_middle = half;
    v = v + to_matrix(half) * part(u.dv, slope.dv, a, b) + (a0 * (1 - s) + a1 * s) * h;
    q = normalized(earth * (half * turn_by(part(u.dtheta, slope.dtheta, m, b))));
    t = to;
  };
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const auto& u = held_[i];
    if (u.t - u.dt > t + 0.01 * u.dt) {  // a hole in the log
      whole = false;
      t = std::min(u.t - u.dt, k1_.t);
    }
    const auto& last = i > 0 ? held_[i - 1] : last_;
    const auto& next = i + 1 < held_.size() ? held_[i + 1] : u;
    slope = {};
    if (last.dt > 0 && std::fabs(last.t + u.dt - u.t) < 0.01 * u.dt) {
      const double k = &next == &u ? 1.0 : 0.5;
      slope.dtheta = (next.dtheta - last.dtheta) * k;
      slope.dv = (next.dv - last.dv) * k;
    }
    const double middle = u.t - 0.5 * u.dt;
    const bool emitted =
        middle <= k1_.t &&
        (middle > k0_.t || (middle == k0_.t && sums_.intervals + sums_.open_intervals == 0));
    if (emitted && u.t <= k1_.t && std::fabs(u.t - u.dt - t) < 1e-9) {
      // All of it lies in the interval: its middle is on the way. The velocity there is the mean of
      // both ends, to w dt/4 of the sample's dv: 1e-5 m/s, which the conversion does not see.
      const Vec<Ecef, double> before = v;
      carry(u, u.t);
      mids.push_back({i, middle, q_middle, (before + v) * 0.5});
      continue;
    }
    if (emitted) {
      carry(u, middle);
      mids.push_back({i, middle, q, v});
    }
    carry(u, std::min(u.t, k1_.t));
  }
  if (held_.empty() || t < k1_.t - 0.01 * held_.back().dt) whole = false;
  // What is missing at k1. With holes nothing can be carried: between the epochs then by the
  // shortest turn.
  if (!whole) {
    const Vec<Body, double> all =
        rotation_vector(conjugate(to_quaternion(k0_.e.C_eb)) * to_quaternion(k1_.e.C_eb));
    for (auto& m : mids) {
      const double u = (m.t - k0_.t) / T;
      m.q = to_quaternion(k0_.e.C_eb) * turn_by(all * u);
      m.v = k0_.e.v * (1 - u) + k1_.e.v * u;
    }
    q = to_quaternion(k1_.e.C_eb);
    v = k1_.e.v;
    --sums_.intervals;
    ++sums_.open_intervals;
  }
  const Turn q1 = to_quaternion(k1_.e.C_eb);
  const Vec<Body, double> turn = rotation_vector(conjugate(q) * q1);
  const Vec<Ecef, double> push = k1_.e.v - v;
  ++sums_.intervals;
  sums_.attitude_rms += dot(turn, turn);
  sums_.attitude_max = std::max(sums_.attitude_max, norm(turn));
  sums_.velocity_rms += dot(push, push);
  sums_.velocity_max = std::max(sums_.velocity_max, norm(push));
  sums_.interval_mean += T;
  sums_.interval_max = std::max(sums_.interval_max, T);

  const auto check = [&](const TransverseState<double>& s, double at) {
    if (fabs(s.tlat) > 80 * deg)
      throw Error(ErrorKind::kInput, "the track comes to transverse latitude " +
                                         std::to_string(s.tlat / deg) + " deg at " + seconds(at) +
                                         ": within 10 deg of a transverse pole the frame is not "
                                         "usable; choose another --meridian");
  };
  const PlaceRates g0 = place_rates(move_, k0_.e);
  PlaceRates g1 = place_rates(move_, k1_.e);
  g1.l = g0.l + wrap_pi(g1.l - g0.l);
  for (const auto& m : mids) {
    const auto& u = held_[m.sample];
    const double s = (m.t - k0_.t) / T;
    MovedSample out;
    out.home.tlat = cubic(g0.p, g0.dp, g1.p, g1.dp, T, s);
    out.home.tlon = wrap_pi(cubic(g0.l, g0.dl, g1.l, g1.dl, T, s));
    out.home.h = cubic(g0.h, g0.dh, g1.h, g1.dh, T, s);
    const auto axes = transverse_axes<double>(out.home.tlat, out.home.tlon, move_.lon0);
    out.home.v = axes * (m.v + push * s);
    out.home.C_tb = axes * to_matrix(m.q * turn_by(turn * s));
    check(out.home, m.t);
    if (move_.keep == Keep::kPath) {
      const auto r = move_path(move_, out.home, u.dv * (1.0 / u.dt));
      out.conversion = r.conversion;
      out.moved = r.state;
    } else {
      advance(out.home, m.t);
      out.moved = moved_of(out.home);
      out.conversion = convert_velocity(move_, out.home, p_, l_);
    }
    out.imu = moved_increment(u, out.conversion);
    emit_(out);
  }
  const auto home = to_transverse_state(move_.earth, move_.lon0, k1_.e);
  check(home, k1_.t);
  if (move_.keep == Keep::kVelocity) advance(home, k1_.t);
  emit_reference_(k1_.t, home, moved_of(home));
  // Samples that reach beyond k1 stay: their second half carries the next interval.
  std::size_t keep = held_.size();
  while (keep > 0 && held_[keep - 1].t > k1_.t) --keep;
  if (keep > 0) last_ = held_[keep - 1];
  held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(keep));
}

void PolarMover::finish() {
  while (!ended_) {
    close_interval();
    ended_ = !next_interval();
  }
}

ClosureStatistics PolarMover::closure() const {
  ClosureStatistics c = sums_;
  const double n = std::max<double>(1.0, static_cast<double>(c.intervals));
  c.attitude_rms = sqrt(c.attitude_rms / n);
  c.velocity_rms = sqrt(c.velocity_rms / n);
  c.interval_mean /= n;
  return c;
}

ReferenceEpoch reference_epoch(const SolutionRow& row, const std::string& where) {
  const auto need = [&](double x, const char* what) {
    if (!std::isfinite(x))
      throw Error(ErrorKind::kInput,
                  std::string("the reference has no ") + what + " at " + seconds(row.t) +
                      "; a transfer needs position, velocity and attitude",
                  where);
  };
  need(row.x, "position");
  need(row.y, "position");
  need(row.z, "position");
  need(row.ve, "velocity");
  need(row.vn, "velocity");
  need(row.qw, "attitude");
  need(row.qz, "attitude");
  ReferenceEpoch k;
  k.t = row.t;
  k.e.r = {row.x, row.y, row.z};
  const double vu = std::isfinite(row.vu) ? row.vu : 0.0;
  k.e.v =
      transpose(geographic_axes(row.lat, row.lon)) * Vec<Geographic, double>{row.ve, row.vn, vu};
  k.e.C_eb = to_matrix(normalized(Turn{row.qw, row.qx, row.qy, row.qz}));
  return k;
}

}  // namespace loxo
