// SPDX-License-Identifier: Apache-2.0
#include "loxo/calibrate/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/projection.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// From here on replay goes by sums: 2 ns a row instead of 50.
constexpr std::size_t kManyRows = 2048;
constexpr double kLastTrueLatitude = 89.99 * deg;  // vehicle.md 4: beyond it, grid headings

double step_time(const RecordedTrack& track, std::size_t i) {
  const double t = track.steps[i].t;
  return std::isfinite(t) ? t : 0.0;
}
double step_interval(const RecordedTrack& track, std::size_t i) {
  const double before = i == 0 ? track.t0 : track.steps[i - 1].t;
  const double dt = track.steps[i].t - before;
  return std::isfinite(dt) ? dt : 0.0;
}

// Smallest singular value of [a b; c d].
double smallest_singular_value(double a, double b, double c, double d) {
  const double det = std::fabs(a * d - b * c), f = a * a + b * b + c * c + d * d;
  const double largest = std::sqrt(0.5 * (f + std::sqrt(std::max(0.0, f * f - 4.0 * det * det))));
  return largest > 0 ? det / largest : 0.0;
}

}  // namespace

Replay::Replay(const RecordedTrack& track, const Benchmark& start, std::vector<std::size_t> rows)
    : track_(track), start_(start), rows_(std::move(rows)) {
  if (!rows_.empty() && rows_.back() > track_.steps.size())
    throw Error(ErrorKind::kInput,
                fmt::format("a benchmark stands after row {}, the track has {} rows", rows_.back(),
                            track_.steps.size()));
  const std::size_t n = rows_.empty() ? 0 : rows_.back();
  if (track_.model == HeadingModel::kIndependent || track_.reference == HeadingReference::kGrid) {
    north_.resize(n);
    east_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const auto& step = track_.steps[i];
      double s, c;
      sincos(step.heading, s, c);
      const double level = step.pitch == 0 ? step.ds : step.ds * cos(step.pitch);
      north_[i] = level * c;
      east_[i] = level * s;
    }
  }
  for (std::size_t i = 0; i < n && !has_pitch_; ++i) has_pitch_ = track_.steps[i].pitch != 0;
  bool level = !has_pitch_ && n >= kManyRows && track_.reference == HeadingReference::kTrue &&
               track_.model == HeadingModel::kIndependent;
  for (std::size_t i = 0; i < n && level; ++i) level = track_.steps[i].h == 0;
  if (level) sums_ = std::make_shared<const ReplaySums>(north_, east_, rows_);
}

// Recorded heading at the instant after `row` steps: between the steps on both sides.
double Replay::heading_at(std::size_t row) const {
  const auto& s = track_.steps;
  if (s.empty()) return 0;
  if (row == 0) return s.front().heading;
  if (row >= s.size()) return s.back().heading;
  return s[row - 1].heading + 0.5 * wrap_pi(s[row].heading - s[row - 1].heading);
}

namespace {

// Body offset (right, forward) turned to (north, east).
std::array<double, 2> body_to_level(double right, double forward, double heading) {
  const double s = std::sin(heading), c = std::cos(heading);
  return {forward * c - right * s, forward * s + right * c};
}

}  // namespace

template <bool kSensitive, bool kFull>
std::vector<Arrival> Replay::run_true(const StateVector& x) const {
  const Ellipsoid& ell = *track_.ellipsoid;
  const double shrink = std::exp(-x[index(State::kScale)]);
  const double b = x[index(State::kDrift)], pitch_mounting = x[index(State::kPitch)];
  const double eps = x[index(State::kAngle)];
  const double ce = shrink * cos(eps), se = shrink * sin(eps);

  // The start, moved by the state and by the lever arm: the odometer starts beside the surveyed
  // point.
  const double psi0 = heading_at(0) - eps - b * track_.t0;
  const auto lever0 = body_to_level(track_.lever_right + x[index(State::kLeverRight)],
                                    track_.lever_forward + x[index(State::kLeverForward)], psi0);
  const double sl = std::sin(start_.lat), cl = std::cos(start_.lat);
  const double move_n = x[index(State::kStartNorth)] - lever0[0],
               move_e = x[index(State::kStartEast)] - lever0[1];
  auto state = reckon_start(start_.lat, start_.lon);
  if (move_n != 0 || move_e != 0) step_exact(ell, state, move_n, move_e, start_.h);
  const double lon0 = state.lon;

  std::vector<Arrival> out;
  out.reserve(rows_.size());
  // (V-39), (V-40)
  auto sensitivities = [&](Arrival& a, double sum_n, double sum_e, double up, double dn_d,
                           double slope_m, double slope_e, double slope) {
    const double parallel = prime_vertical_radius(ell, std::sin(a.lat)) * std::cos(a.lat);
    auto set = [&](State k, double m, double lon, double vertical) {
      a.by[index(k)] = {m, parallel * lon, vertical};
    };
    set(State::kScale, -sum_n, -(a.lon - lon0) - slope_m, -up);
    set(State::kAngle, sum_e, -dn_d + slope_e, 0);
    set(State::kStartNorth, 1.0, slope, 0);
    set(State::kStartEast, 0.0, 1.0 / (prime_vertical_radius(ell, sl) * cl), 0);
    return parallel;
  };
  if constexpr (!kFull) {
    if (sums_ != nullptr) {
      std::vector<ReplaySum> sums;
      double largest = 0;
      const double m0 = meridian_arc(ell, state.lat + state.lat_low);
      if (sums_->run(ell, m0, ce, se, kSensitive, sums, largest)) {
        for (std::size_t j = 0; j < rows_.size(); ++j) {
          const ReplaySum& r = sums[j];
          Arrival a;
          a.lat = latitude_of_arc(ell, m0 + r.north);
          a.lon = state.lon + (state.lon_low + r.lon);
          a.north = r.north;
          a.east = r.east;
          a.heading_t = rows_[j] > 0 ? step_time(track_, rows_[j] - 1) : track_.t0;
          a.heading = heading_at(rows_[j]) - eps;
          if constexpr (kSensitive)
            sensitivities(a, r.north, r.east, 0, r.dn_d, r.slope_m, r.slope_e, r.slope);
          out.push_back(a);
        }
        largest_latitude_ = latitude_of_arc(ell, std::min(largest, ell.quarter_meridian));
        return out;
      }
    }
  }
  double sum_n = 0, sum_e = 0, up = 0;
  // Sums of (V-40): of dn D, de w' m, de w' E, de w'; with drift: E_b, N_b and theirs; with pitch
  // likewise.
  double dn_d = 0, slope_m = 0, slope_e = 0, slope = 0;
  double drift_m = 0, drift_lon = 0, pitch_m = 0, pitch_e = 0, pitch_lon = 0, pitch_up = 0;
  double largest = std::fabs(start_.lat);
  std::size_t i = 0;
  for (const std::size_t row : rows_) {
    for (; i < row; ++i) {
      const TrackStep& step = track_.steps[i];
      double n = north_[i], e = east_[i];
      double t = 0, tilt_n = 0, tilt_e = 0;
      if constexpr (kFull) {
        t = step_time(track_, i);
        double s, c;
        sincos(step.heading - b * t, s, c);
        double sp, cp;
        sincos(step.pitch - pitch_mounting, sp, cp);
        n = step.ds * cp * c;
        e = step.ds * cp * s;
        tilt_n =
            shrink * step.ds * sp * c;  // derivative by the pitch mounting, before the turn by eps
        tilt_e = shrink * step.ds * sp * s;
        up += shrink * step.ds * sp;
        pitch_up -= shrink * step.ds * cp;
      }
      const double dn = ce * n + se * e, de = ce * e - se * n;
      const auto rates = step_exact(ell, state, dn, de, step.h);
      largest = std::max(largest, std::fabs(state.lat));
      if constexpr (kSensitive) {
        const double w = rates.east * rates.slope;
        dn_d += rates.north * rates.mean_rate;
        slope_m += w * (sum_n + 0.5 * rates.north);
        slope_e += w * (sum_e + 0.5 * rates.east);
        slope += w;
        if constexpr (kFull) {
          // psi -> psi - b t: d dn = +t de, d de = -t dn.
          drift_lon += -t * rates.north * rates.mean_rate + w * (drift_m + 0.5 * t * rates.east);
          drift_m += t * rates.east;
          const double tn = cos(eps) * tilt_n + sin(eps) * tilt_e,
                       te = cos(eps) * tilt_e - sin(eps) * tilt_n;
          pitch_lon += te * rates.mean_rate + w * (pitch_m + 0.5 * tn);
          pitch_m += tn;
          pitch_e += te;
        }
      }
      sum_n += rates.north;
      sum_e += rates.east;
    }
    Arrival a;
    a.lat = state.lat + state.lat_low;
    a.lon = state.lon + state.lon_low;
    a.north = sum_n;
    a.east = sum_e;
    a.up = up;
    a.heading_t = row > 0 ? step_time(track_, row - 1) : track_.t0;
    a.heading = heading_at(row) - eps - b * a.heading_t;
    if constexpr (kSensitive) {
      const double parallel = sensitivities(a, sum_n, sum_e, up, dn_d, slope_m, slope_e, slope);
      if constexpr (kFull) {
        a.by[index(State::kDrift)] = {drift_m, parallel * drift_lon, 0};
        a.by[index(State::kPitch)] = {pitch_m, parallel * pitch_lon, pitch_up};
      }
    }
    out.push_back(a);
  }
  largest_latitude_ = out.empty() || !std::isfinite(out.back().lat) ? kNone : largest;
  return out;
}

std::vector<Arrival> Replay::run_mechanised(const StateVector& x) const {
  const Ellipsoid& ell = *track_.ellipsoid;
  const double k = std::exp(x[index(State::kScale)]), eps = x[index(State::kAngle)];
  const double b = x[index(State::kDrift)], pitch_mounting = x[index(State::kPitch)];
  const double psi0 = heading_at(0) - eps - b * track_.t0;
  const auto lever0 = body_to_level(track_.lever_right + x[index(State::kLeverRight)],
                                    track_.lever_forward + x[index(State::kLeverForward)], psi0);
  auto state = mechanised_start(start_.lat, start_.lon);
  const double move_n = x[index(State::kStartNorth)] - lever0[0],
               move_e = x[index(State::kStartEast)] - lever0[1];
  if (move_n != 0 || move_e != 0) {
    step_exact(ell, state.truth, move_n, move_e, start_.h);
    state.recorded = state.truth;
  }
  std::vector<Arrival> out;
  out.reserve(rows_.size());
  double up = 0, sum_n = 0, sum_e = 0, last = psi0;
  std::size_t i = 0;
  double largest = std::fabs(start_.lat);
  for (const std::size_t row : rows_) {
    for (; i < row; ++i) {
      const TrackStep& step = track_.steps[i];
      const double t = step_time(track_, i),
                   dt = track_.earth_rate ? step_interval(track_, i) : 0.0;
      const double ds = step.ds * track_.taken_scale;
      const double pitch = step.pitch - pitch_mounting;
      const double cp = step.pitch == 0 && pitch_mounting == 0 ? 1.0 : std::cos(step.pitch);
      const double shrink =
          k * track_.taken_scale * (cp == 1.0 ? 1.0 : std::cos(step.pitch) / std::cos(pitch));
      // The set kept its heading with everything still in it; drift is taken off the true heading.
      const double psi = step_mechanised(ell, state, ds * cp, step.heading + track_.taken_offset,
                                         shrink, eps + track_.taken_offset + b * t, step.h, dt);
      up += step.ds / k * std::sin(pitch);
      sum_n += step.ds / k * std::cos(pitch) * std::cos(psi);
      sum_e += step.ds / k * std::cos(pitch) * std::sin(psi);
      last = psi;
      largest = std::max(largest, std::fabs(state.truth.lat));
    }
    Arrival a;
    a.lat = state.truth.lat + state.truth.lat_low;
    a.lon = state.truth.lon + state.truth.lon_low;
    a.up = up;
    a.north = sum_n;
    a.east = sum_e;
    a.heading = last;
    out.push_back(a);
  }
  largest_latitude_ = out.empty() || !std::isfinite(out.back().lat) ? kNone : largest;
  return out;
}

std::vector<Arrival> Replay::run_grid(const StateVector& x) const {
  const Ellipsoid& ell = *track_.ellipsoid;
  const bool north = start_.lat >= 0;
  const double shrink = std::exp(-x[index(State::kScale)]), eps = x[index(State::kAngle)];
  const double b = x[index(State::kDrift)], pitch_mounting = x[index(State::kPitch)];
  const double g0 = heading_at(0) - eps - b * track_.t0;
  const auto lever0 = body_to_level(track_.lever_right + x[index(State::kLeverRight)],
                                    track_.lever_forward + x[index(State::kLeverForward)], g0);
  auto state = grid_start(start_.lat, start_.lon);
  const double move_n = x[index(State::kStartNorth)] - lever0[0],
               move_e = x[index(State::kStartEast)] - lever0[1];
  const double move = std::hypot(move_n, move_e);
  if (move > 0) step_grid(ell, north, state, move, std::atan2(move_e, move_n), start_.h);
  std::vector<Arrival> out;
  out.reserve(rows_.size());
  double up = 0, sum_n = 0, sum_e = 0, last = g0;
  std::size_t i = 0;
  for (const std::size_t row : rows_) {
    for (; i < row; ++i) {
      const TrackStep& step = track_.steps[i];
      const double pitch = step.pitch - pitch_mounting;
      const double ds = step.ds * shrink * (pitch == 0 ? 1.0 : std::cos(pitch));
      const double g = step.heading - eps - (b == 0 ? 0.0 : b * step_time(track_, i));
      step_grid(ell, north, state, ds, g, step.h);
      if (pitch != 0) up += step.ds * shrink * std::sin(pitch);
      sum_n += ds * std::cos(g);
      sum_e += ds * std::sin(g);
      last = g;
    }
    Arrival a;
    latlon_of_normal(state.n, a.lat, a.lon);
    a.up = up;
    a.north = sum_n;
    a.east = sum_e;
    a.heading = last;
    out.push_back(a);
  }
  largest_latitude_ = out.empty() || !std::isfinite(out.back().lat) ? kNone : 0.0;
  return out;
}

std::vector<Arrival> Replay::positions(const StateVector& x) const {
  if (track_.reference == HeadingReference::kGrid) return run_grid(x);
  if (track_.model == HeadingModel::kMechanised) return run_mechanised(x);
  const bool full = x[index(State::kDrift)] != 0 || x[index(State::kPitch)] != 0 || has_pitch_;
  return full ? run_true<false, true>(x) : run_true<false, false>(x);
}

// The lever arm: surveyed points stand beside the odometer.
void Replay::finish(std::vector<Arrival>& arrivals, const StateVector& x, bool sensitive) const {
  const double right = track_.lever_right + x[index(State::kLeverRight)];
  const double forward = track_.lever_forward + x[index(State::kLeverForward)];
  const Ellipsoid& ell = *track_.ellipsoid;
  for (auto& a : arrivals) {
    const auto lever = body_to_level(right, forward, a.heading);
    if (sensitive) {
      // C(psi_j) - C(psi_0) in the lever's derivatives, and the lever's turn by eps and drift:
      // dC/dpsi = (-e, n).
      const double psi0 =
          heading_at(0) - x[index(State::kAngle)] - x[index(State::kDrift)] * track_.t0;
      const auto start = body_to_level(right, forward, psi0);
      const auto by_n = a.by[index(State::kStartNorth)], by_e = a.by[index(State::kStartEast)];
      auto moved = [&](const std::array<double, 2>& end, const std::array<double, 2>& begin,
                       double factor) {
        std::array<double, 3> r{};
        r[0] = factor * (end[0] - (begin[0] * by_n[0] + begin[1] * by_e[0]));
        r[1] = factor * (end[1] - (begin[0] * by_n[1] + begin[1] * by_e[1]));
        return r;
      };
      a.by[index(State::kLeverRight)] =
          moved(body_to_level(1, 0, a.heading), body_to_level(1, 0, psi0), 1.0);
      a.by[index(State::kLeverForward)] =
          moved(body_to_level(0, 1, a.heading), body_to_level(0, 1, psi0), 1.0);
      const auto turn = moved({-lever[1], lever[0]}, {-start[1], start[0]}, -1.0);
      const double t = a.heading_t;
      const auto drift =
          moved({-t * lever[1], t * lever[0]}, {-track_.t0 * start[1], track_.t0 * start[0]}, -1.0);
      for (int c = 0; c < 2; ++c) {
        a.by[index(State::kAngle)][c] += turn[c];
        a.by[index(State::kDrift)][c] += drift[c];
      }
    }
    if (right == 0 && forward == 0) continue;
    if (track_.reference == HeadingReference::kGrid) {
      auto grid = grid_start(a.lat, a.lon);
      step_grid(ell, start_.lat >= 0, grid, std::hypot(lever[0], lever[1]),
                std::atan2(lever[1], lever[0]), start_.h);
      latlon_of_normal(grid.n, a.lat, a.lon);
    } else {
      auto moved = reckon_start(a.lat, a.lon);
      step_exact(ell, moved, lever[0], lever[1], start_.h);
      a.lat = moved.lat;
      a.lon = moved.lon;
    }
  }
}

std::vector<Arrival> Replay::run(const StateVector& x, std::span<const State> estimated) const {
  if (estimated.empty()) {
    auto out = positions(x);
    finish(out, x, false);
    return out;
  }
  const bool analytic =
      track_.model == HeadingModel::kIndependent && track_.reference == HeadingReference::kTrue;
  if (analytic) {
    bool full = x[index(State::kDrift)] != 0 || x[index(State::kPitch)] != 0 || has_pitch_;
    for (const State s : estimated) full = full || s == State::kDrift || s == State::kPitch;
    auto out = full ? run_true<true, true>(x) : run_true<true, false>(x);
    finish(out, x, true);
    // Parallel metres per metre at the start: the lever's start part above used the raw numbers.
    return out;
  }
  auto out = run(x);
  const double largest = largest_latitude_;
  const double span =
      std::max(1.0, out.empty() ? 1.0 : std::fabs(track_.steps[rows_.back() - 1].t - track_.t0));
  for (const State s : estimated) {
    // Central differences (vehicle.md 4: 1e-6 is fine), sized so that each moves the end by about
    // 1e-6 of the way.
    double h = 1e-6;
    if (s == State::kDrift) h = 1e-6 / (std::isfinite(span) ? span : 1.0);
    if (s == State::kPitch) h = 1e-5;
    if (s >= State::kLeverRight) h = 0.1;
    StateVector up = x, down = x;
    up[index(s)] += h;
    down[index(s)] -= h;
    const auto plus = run(up), minus = run(down);
    for (std::size_t j = 0; j < out.size(); ++j) {
      Benchmark at;
      at.lat = out[j].lat;
      at.lon = out[j].lon;
      const auto p = residual(plus[j], at), m = residual(minus[j], at);
      out[j].by[index(s)] = {(p[0] - m[0]) / (2 * h), (p[1] - m[1]) / (2 * h),
                             (plus[j].up - minus[j].up) / (2 * h)};
    }
  }
  largest_latitude_ = largest;
  return out;
}

std::array<double, 3> Replay::residual(const Arrival& a, const Benchmark& b) const {
  const Ellipsoid& ell = *track_.ellipsoid;
  const double s = std::sin(b.lat);
  const double rn = meridian_radius(ell, s), re = prime_vertical_radius(ell, s);
  double north, east;
  if (track_.reference == HeadingReference::kGrid) {
    // By normals: longitude means nothing at the pole. Geographic parts with their own radii,
    // turned to grid north.
    const auto axes = geographic_axes(b.lat, b.lon);
    const auto d = normal_of(a.lat, a.lon) - normal_of(b.lat, b.lon);
    const double e = re * (axes.m[0][0] * d.x + axes.m[0][1] * d.y + axes.m[0][2] * d.z);
    const double n = rn * (axes.m[1][0] * d.x + axes.m[1][1] * d.y + axes.m[1][2] * d.z);
    const double turn = (start_.lat >= 0 ? -1.0 : 1.0) * b.lon;  // grid = true + turn
    north = n * std::cos(turn) - e * std::sin(turn);
    east = n * std::sin(turn) + e * std::cos(turn);
  } else {
    north = rn * (a.lat - b.lat);
    east = re * std::cos(b.lat) * wrap_pi(a.lon - b.lon);
  }
  return {north, east, start_.h + a.up - b.h};
}

std::vector<Moments> Replay::moments(const StateVector& x) const {
  // Plain metres from the start are enough: the covariance is first order.
  const double shrink = std::exp(-x[index(State::kScale)]), eps = x[index(State::kAngle)];
  const double b = x[index(State::kDrift)];
  std::vector<Moments> out;
  out.reserve(rows_.size());
  Moments m;
  double integral = 0;  // INT n de
  std::size_t i = 0, turned = 0;
  bool moved = false;
  for (const std::size_t row : rows_) {
    for (; i < row; ++i) {
      const TrackStep& step = track_.steps[i];
      double dt = step_interval(track_, i);
      if (!(dt > 0)) dt = 0;
      double se, c, sp = 0, cp = 1;
      sincos(step.heading - eps - (b == 0 ? 0.0 : b * step_time(track_, i)), se, c);
      const double pitch = step.pitch - x[index(State::kPitch)];
      if (pitch != 0) sincos(pitch, sp, cp);
      const double ds = shrink * step.ds * cp;
      const double dn = ds * c, de = ds * se;
      const double pn = m.north + 0.5 * dn, pe = m.east + 0.5 * de;
      // INT over the step of P P^T with P linear: midpoint and the twelfth of the step's square.
      m.sn += dt * pn;
      m.se += dt * pe;
      m.qnn += dt * (pn * pn + dn * dn / 12);
      m.qne += dt * (pn * pe + dn * de / 12);
      m.qee += dt * (pe * pe + de * de / 12);
      const double tm = m.t + 0.5 * dt;
      m.bn += tm * dn;
      m.be += tm * de;
      m.cnn += de * de;
      m.cne -= dn * de;
      m.cee += dn * dn;
      if (ds != 0) {
        // Quantisation acts along the way that the wheel turned: the heading vector, its sign left
        // out.
        const double way = shrink * step.ds;
        const double t[3] = {c * cp, se * cp, sp};
        for (int r = 0; r < 3; ++r)
          for (int q = 0; q < 3; ++q) {
            m.along[r][q] += way * way * t[r] * t[q];
            if (moved) m.change[r][q] += (t[r] - m.last[r]) * (t[q] - m.last[q]);
          }
        for (; moved && turned < out.size(); ++turned)
          for (int r = 0; r < 3; ++r) out[turned].next[r] = t[r] - m.last[r];
        for (int r = 0; r < 3; ++r) {
          if (!moved) m.first[r] = t[r];
          m.last[r] = t[r];
        }
        moved = true;
      }
      integral += pn * de;
      m.north += dn;
      m.east += de;
      m.t += dt;
      m.rows += 1;
      m.route += std::fabs(ds);
    }
    m.area = integral - 0.5 * m.north * m.east;
    m.turn[0] = -m.east;
    m.turn[1] = m.north;
    m.drift[0] = -m.be;
    m.drift[1] = m.bn;
    out.push_back(m);
  }
  return out;
}

void exact_turns(const RecordedTrack& track, std::span<const Arrival> arrivals, bool with_drift,
                 std::vector<Moments>& moments) {
  for (std::size_t j = 0; j < moments.size(); ++j) {
    const auto &angle = arrivals[j].by[index(State::kAngle)],
               &drift = arrivals[j].by[index(State::kDrift)];
    // Errors drift from the start on and are those of mid-step, the state counts from t = 0 and by
    // the row's own time.
    const double since = track.t0 + 0.5 * moments[j].t / std::max(1.0, moments[j].rows);
    for (std::size_t c = 0; c < 2; ++c) {
      moments[j].turn[c] = -angle[c];
      if (with_drift) moments[j].drift[c] = since * angle[c] - drift[c];
    }
  }
}

std::vector<double> residual_covariance(std::span<const Moments> moments,
                                        std::span<const Benchmark> benchmarks,
                                        const Benchmark& start, const TrackErrorModel& e, double k,
                                        int dim, bool with_start, bool with_drift) {
  // (V-43). Jr = [0 -1; 1 0]: Jr (n, e) = (-e, n).
  const std::size_t count = moments.size(), n = count * static_cast<std::size_t>(dim);
  std::vector<double> sigma(n * n, 0.0);
  auto at = [&](std::size_t j, int a, std::size_t l, int b) -> double& {
    return sigma[(j * dim + static_cast<std::size_t>(a)) * n + l * dim +
                 static_cast<std::size_t>(b)];
  };
  const double psi2 = e.heading_bias * e.heading_bias,
               drift2 = with_drift ? e.heading_drift * e.heading_drift : 0.0;
  const double walk2 = e.heading_noise * e.heading_noise, slip2 = e.side_slip * e.side_slip;
  const double noise2 = e.scale_noise * e.scale_noise,
               quant2 = e.quantisation * e.quantisation / (12.0 * k * k);
  for (std::size_t j = 0; j < count; ++j)
    for (std::size_t l = 0; l < count; ++l) {
      const Moments &mj = moments[j], &ml = moments[l], &first = moments[std::min(j, l)];
      const double jn[2] = {-mj.east, mj.north}, ln[2] = {-ml.east, ml.north};
      // INT (Pj - P)(Pl - P)^T dt = T Pj Pl^T - Pj S^T - S Pl^T + Q, then turned on both sides.
      const double s[2] = {-first.se, first.sn};
      const double q[2][2] = {{first.qee, -first.qne}, {-first.qne, first.qnn}};
      const double across[2][2] = {{first.cnn, first.cne}, {first.cne, first.cee}};
      // The odometer's: along the way, climbing with it.
      for (int a = 0; a < dim; ++a)
        for (int b = 0; b < dim; ++b) {
          double v = noise2 * first.along[a][b] +
                     quant2 * (first.first[a] * first.first[b] + first.change[a][b]);
          // The unread part of a pulse at the earlier row stands there along the last heading, and
          // in every later row along the change of heading that follows, taken off.
          if (j == l) v += quant2 * first.last[a] * first.last[b];
          if (j < l) v -= quant2 * first.last[a] * first.next[b];
          if (j > l) v -= quant2 * first.next[a] * first.last[b];
          at(j, a, l, b) = v;
        }
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) {
          double v = psi2 * mj.turn[a] * ml.turn[b] + drift2 * mj.drift[a] * ml.drift[b];
          v += walk2 * (first.t * jn[a] * ln[b] - jn[a] * s[b] - s[a] * ln[b] + q[a][b]);
          v += slip2 * across[a][b];
          if (a == b) {
            if (j == l) v += benchmarks[j].std * benchmarks[j].std;
            if (with_start) v += start.std * start.std;
          }
          at(j, a, l, b) += v;
        }
      if (dim == 3) {
        double v = with_start ? start.std_h * start.std_h : 0.0;
        if (j == l) v += benchmarks[j].std_h * benchmarks[j].std_h;
        at(j, 2, l, 2) += v;
      }
    }
  return sigma;
}

ChordStart chord_start(const Replay& replay, const Arrival& a, const Benchmark& end) {
  const RecordedTrack& track = replay.track();
  const Ellipsoid& ell = *track.ellipsoid;
  const Benchmark& start = replay.start();
  ChordStart r;
  r.end_lat = a.lat;
  r.end_lon = a.lon;
  if (!std::isfinite(a.lat) || !std::isfinite(a.lon)) {
    r.why = track.reference == HeadingReference::kGrid
                ? "the track holds numbers that are not finite"
                : "the track as recorded crosses a pole with true headings: log grid headings "
                  "there (heading_reference = "
                  "\"grid\")";
    return r;
  }
  TwoPoint<double> value;
  if (track.reference == HeadingReference::kGrid) {
    // The polar stereographic plane is conformal and its north is grid north: its chords are good
    // start values.
    const bool north = start.lat >= 0;
    auto plane = [&](double lat, double lon) {
      return polar_stereographic_forward(ell, lat, lon, 0.0, north);
    };
    const auto p = plane(start.lat, start.lon), c = plane(end.lat, end.lon),
               d = plane(a.lat, a.lon);
    // Grid north is the meridian of longitude 180 deg seen from the pole (V-11): along +y; grid
    // east along +x.
    value = two_point(Chord<double>{c.y - p.y, c.x - p.x}, Chord<double>{d.y - p.y, d.x - p.x});
  } else {
    const auto method =
        track.model == HeadingModel::kMechanised ? ChordMethod::kGeodesic : ChordMethod::kRhumb;
    value = two_point(chord(ell, method, start.lat, end.lat, wrap_pi(end.lon - start.lon), 0.0),
                      chord(ell, method, start.lat, a.lat, a.lon - start.lon, 0.0));
  }
  r.chord = value.chord;
  const double least = minimum_chord(std::max(start.std, end.std));
  if (!(value.chord >= least)) {
    r.why = fmt::format(
        "zero chord: start and surveyed end are {:.3g} m apart, at least {:.3g} m are needed; one "
        "end "
        "point of a closed loop says nothing of scale and angle, a benchmark on the way does",
        value.chord, least);
    return r;
  }
  if (!(value.reckoned >= least)) {
    r.why = fmt::format(
        "zero chord: the track as recorded ends {:.3g} m from its start, at least {:.3g} m are "
        "needed",
        value.reckoned, least);
    return r;
  }
  r.ln_k = std::log(value.k);
  r.eps = value.eps;
  r.valid = true;
  return r;
}

ChordStart chord_start(const Replay& replay, const Benchmark& end, std::size_t which) {
  return chord_start(replay, replay.run({})[which], end);
}

Calibration calibrate_replay(const RecordedTrack& track, const Benchmark& start,
                             const Benchmark& end, const TrackErrorModel& errors) {
  Calibration r;
  r.method = "replay";
  r.states = {State::kScale, State::kAngle};
  auto invalid = [&](std::string why) {
    r.why = std::move(why);
    return r;
  };
  const Replay replay(track, start, {static_cast<std::size_t>(end.row)});
  const auto first = chord_start(replay, replay.run({})[0], end);
  if (!first.valid) return invalid(first.why);
  const bool by_true = track.reference == HeadingReference::kTrue;
  const State wanted[] = {State::kScale, State::kAngle};
  StateVector x{};
  x[0] = first.ln_k;
  x[1] = first.eps;
  auto solve = [&](const StateVector& y) { return replay.run(y, wanted)[0]; };
  // Newton with halving: until both unknowns stand still, or what is left is the rounding of the
  // position.
  const double sigma = std::hypot(start.std, end.std);
  constexpr double kRounding = 4e-9;  // m: some units in the last place of a position
  Arrival arrival = solve(x);
  auto res = replay.residual(arrival, end);
  double size = std::hypot(res[0], res[1]);
  bool converged = false;
  while (r.iterations < 30) {
    if (!std::isfinite(size))
      return invalid(
          "the track crosses a pole with true headings: log grid headings there (heading_reference "
          "= \"grid\")");
    const auto &ju = arrival.by[0], &je = arrival.by[1];
    r.smallest_singular = smallest_singular_value(ju[0], je[0], ju[1], je[1]);
    if (!(r.smallest_singular > 5.0 * sigma) || !(r.smallest_singular > 0.5))
      return invalid(fmt::format(
          "weak geometry: the end moves only {:.3g} m per unit of scale and angle, less than 5 "
          "sigma of its position ({:.3g} m)",
          r.smallest_singular, std::max(0.5, 5.0 * sigma)));
    const double det = ju[0] * je[1] - je[0] * ju[1];
    const double du = -(je[1] * res[0] - je[0] * res[1]) / det,
                 dangle = -(ju[0] * res[1] - ju[1] * res[0]) / det;
    ++r.iterations;
    double factor = 1.0;
    bool better = false;
    for (int halving = 0; halving < 25; ++halving, factor *= 0.5) {
      StateVector y = x;
      y[0] += factor * du;
      y[1] += factor * dangle;
      const Arrival next = solve(y);
      const auto next_res = replay.residual(next, end);
      const double next_size = std::hypot(next_res[0], next_res[1]);
      if (next_size < size || (halving == 0 && next_size <= kRounding)) {
        better = next_size < size;
        if (better) {
          x = y;
          arrival = next;
          res = next_res;
          size = next_size;
        }
        break;
      }
      if (size <= 1e-6) break;  // nothing to gain: rounding
    }
    if ((std::fabs(factor * du) < 1e-13 && std::fabs(factor * dangle) < 1e-13) ||
        size <= kRounding || (!better && size <= 1e-6)) {
      converged = true;
      break;
    }
    if (!better) break;
  }
  r.closure = size;
  if (!converged)
    return invalid(fmt::format("no convergence: after {} iterations the end is still {:.3g} m off",
                               r.iterations, size));
  if (by_true && !(replay.largest_latitude() < kLastTrueLatitude))
    return invalid(fmt::format(
        "the calibrated track comes within {:.3g} deg of a pole with true headings: log grid "
        "headings there (heading_reference = \"grid\")",
        90.0 - replay.largest_latitude() / deg));

  r.k = std::exp(x[0]);
  r.eps = wrap_pi(x[1]);
  r.values = {x[0], r.eps};
  auto moments = replay.moments(x);
  exact_turns(track, std::span(&arrival, 1), false, moments);
  const auto sigma2 =
      residual_covariance(moments, std::span(&end, 1), start, errors, r.k, 2, true, true);
  const auto &ju = arrival.by[0], &je = arrival.by[1];
  const double det = ju[0] * je[1] - je[0] * ju[1];
  // x = J^-1 r: covariance J^-1 Sigma J^-T.
  const double inv[2][2] = {{je[1] / det, -je[0] / det}, {-ju[1] / det, ju[0] / det}};
  double p[2][2]{};
  for (int a = 0; a < 2; ++a)
    for (int b = 0; b < 2; ++b)
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j)
          p[a][b] += inv[a][i] * sigma2[static_cast<std::size_t>(2 * i + j)] * inv[b][j];
  // What an error does not touch is zero but for rounding, which may be negative.
  p[0][0] = std::max(0.0, p[0][0]);
  p[1][1] = std::max(0.0, p[1][1]);
  r.covariance = {p[0][0], p[0][1], p[1][0], p[1][1]};
  r.ln_k_std = std::sqrt(p[0][0]);
  r.eps_std = std::sqrt(p[1][1]);
  r.correlation = r.ln_k_std > 0 && r.eps_std > 0
                      ? std::clamp(p[0][1] / (r.ln_k_std * r.eps_std), -1.0, 1.0)
                      : 0.0;
  BenchmarkResidual last;
  last.north = -res[0];
  last.east = -res[1];
  last.chord = first.chord;
  r.residuals = {last};
  r.valid = true;
  return r;
}

}  // namespace loxo
