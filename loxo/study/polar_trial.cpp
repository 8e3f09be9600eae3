// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/polar_trial.hpp"

#include <algorithm>
#include <cmath>

#include "loxo/ins/increments.hpp"
#include "loxo/ins/strapdown.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/polar_mover.hpp"
#include "loxo/study/transfer_drive.hpp"

namespace loxo {
namespace {

using Log = std::vector<ImuIncrement<double>>;
using Epochs = std::vector<ReferenceEpoch>;

// The record and its reference at one place.
struct Place {
  const Log* log;
  const Epochs* epochs;
};

// Height and upward velocity of the reference between epochs.
struct Vertical {
  std::vector<double> t, h, vu;
  Vertical(const Ellipsoid& earth, const Epochs& epochs) {
    for (const auto& k : epochs) {
      const auto n = to_normal(earth, k.e.r);
      t.push_back(k.t), h.push_back(n.h), vu.push_back(dot(n.n, k.e.v));
    }
  }
  void at(double x, std::size_t& i, double& height, double& up) const {
    while (i + 2 < t.size() && t[i + 1] < x) ++i;
    const double u = std::clamp((x - t[i]) / (t[i + 1] - t[i]), 0.0, 1.0);
    height = h[i] + u * (h[i + 1] - h[i]);
    up = vu[i] + u * (vu[i + 1] - vu[i]);
  }
};

ImuIncrement<double> share(const ImuIncrement<double>& u, double from, double to) {
  const double k = (to - from) / u.dt;
  return {to, to - from, u.dtheta * k, u.dv * k};
}

// From epoch `a` to epoch `b`; the samples that reach across an end are taken by their share.
// `at_epoch`(state, epoch) sees the state at each epoch on the way.
template <class M, class F>
EcefState<double> navigated(const EarthModel& earth, const Place& place, const Vertical& vertical,
                            std::size_t a, std::size_t b, F at_epoch) {
  const ReferenceEpoch &from = (*place.epochs)[a], &to = (*place.epochs)[b];
  auto x = M::from_ecef(earth, EcefState<double>{from.e.r, from.e.v, to_quaternion(from.e.C_eb)});
  const Log& log = *place.log;
  std::size_t i = static_cast<std::size_t>(
      std::upper_bound(log.begin(), log.end(), from.t,
                       [](double t, const ImuIncrement<double>& u) { return t < u.t; }) -
      log.begin());
  std::size_t k = a, seen = a;
  at_epoch(M::to_ecef(earth, x), seen);
  const auto advance = [&](const StepIncrement<double>& u, double t) {
    double h = 0, vu = 0;
    x = step(earth, x, u);
    vertical.at(t, k, h, vu);
    x = constrained(x, h, vu);
    // The step's end stands for an epoch within it: a step is short beside an epoch's distance.
    while (seen < b && (*place.epochs)[seen + 1].t <= t + 1e-9)
      at_epoch(M::to_ecef(earth, x), ++seen);
  };
  while (i < log.size() && log[i].t - log[i].dt < to.t - 1e-9) {
    const auto& u = log[i];
    const double begin = u.t - u.dt;
    if (begin < from.t - 1e-9 || u.t > to.t + 1e-9) {
      const auto part = share(u, std::max(begin, from.t), std::min(u.t, to.t));
      if (part.dt > 1e-9) advance(combine(&part, 1), part.t);
      ++i;
    } else if (i + 1 < log.size() && log[i + 1].t <= to.t + 1e-9 &&
               std::fabs(log[i + 1].t - log[i + 1].dt - u.t) < 1e-6 &&
               std::fabs(log[i + 1].dt - u.dt) < 0.01 * u.dt) {
      advance(two_samples(u, log[i + 1]), log[i + 1].t);
      i += 2;
    } else {
      advance(combine(&u, 1), u.t);
      ++i;
    }
  }
  return M::to_ecef(earth, x);
}

template <class M>
EcefState<double> navigated(const EarthModel& earth, const Place& place, const Vertical& vertical,
                            std::size_t a, std::size_t b) {
  return navigated<M>(earth, place, vertical, a, b, [](const EcefState<double>&, std::size_t) {});
}

// The difference between the error at the pole and the error at home, driven by the home errors
// that are known at each epoch (first order, polar.md 4.1 at both places, height held):
// theta' = -w_in x theta - O x theta_home, dv' = theta x f + theta_home x df - (2 w_ie + w_et) x dv
// - 2 O x dv_home - g/R dr. theta turns the true axes into the computed ones.
class PhysicalDifference {
 public:
  PhysicalDifference(const PolarMove& move, const Epochs& epochs) : move_(move), epochs_(epochs) {}
  void at(const EcefState<double>& x, std::size_t k) {
    const auto& truth = epochs_[k];
    const auto s = to_transverse_state(move_.earth, move_.lon0, truth.e);
    const auto axes = transverse_axes<double>(s.tlat, s.tlon, move_.lon0);
    const auto c = to_matrix(x.q_eb) * transpose(truth.e.C_eb);
    Now now;
    now.t = truth.t;
    now.v = s.v;
    now.theta =
        axes * Vec<Ecef, double>{0.5 * (c.m[2][1] - c.m[1][2]), 0.5 * (c.m[0][2] - c.m[2][0]),
                                 0.5 * (c.m[1][0] - c.m[0][1])};
    now.dv = axes * (x.v - truth.e.v);
    now.dr = axes * (x.r - truth.e.r);
    now.place = s;
    now.home = transverse_rates(move_.earth, s.tlat, s.tlon, s.h, s.v);
    now.moved = transverse_rates(move_.earth, s.tlat, s.tlon - move_.angle, s.h, s.v);
    if (started_) advance(last_, now);
    last_ = now;
    started_ = true;
  }
  double east() const { return r_.x; }
  double north() const { return r_.y; }
  double heading() const { return -theta_.z; }

 private:
  struct Now {
    double t = 0;
    Vec<Transverse, double> v, theta, dv, dr;
    TransverseState<double> place;
    TransverseRates<double> home, moved;
  };
  void advance(const Now& a, const Now& b) {
    using V = Vec<Transverse, double>;
    const double T = b.t - a.t;
    const V theta_home = (a.theta + b.theta) * 0.5, dv_home = (a.dv + b.dv) * 0.5;
    const V O = b.moved.w_ie - b.home.w_ie, w_et = b.moved.w_et;
    const V w_in = b.moved.w_ie + w_et;
    const V w_c = b.moved.w_ie * 2.0 + w_et;
    V f = (b.v - a.v) * (1.0 / T) + cross(w_c, b.v);
    f.z += b.moved.g;
    const double schuler = b.moved.g * 0.5 * (b.moved.K.xx + b.moved.K.yy);
    const V turn = (cross(w_in, theta_) + cross(O, theta_home)) * -T;
    const V mean = theta_ + turn * 0.5;
    V push = cross(mean, f) + cross(theta_home, V{0.0, 0.0, b.moved.g - b.home.g}) -
             cross(w_c, v_) - cross(O, dv_home) * 2.0 - V{r_.x, r_.y, 0.0} * schuler;
    // The kept path rescales the recorded force (7.2 E2: v' from f), the unit's own error in it
    // too: that error is what the velocity error at home has no other cause for.
    if (move_.keep == Keep::kPath) {
      const V w_home = b.home.w_ie * 2.0 + b.home.w_et;
      V f_home = (b.v - a.v) * (1.0 / T) + cross(w_home, b.v);
      f_home.z += b.home.g;
      const double schuler_home = b.home.g * 0.5 * (b.home.K.xx + b.home.K.yy);
      V own = (b.dv - a.dv) * (1.0 / T) - cross(theta_home, f_home) + cross(w_home, dv_home) +
              (a.dr + b.dr) * (0.5 * schuler_home);
      own.z = 0;
      TransverseState<double> s = b.place;
      s.v = own;
      push += move_state(move_, s).v - own;
    }
    push.z = 0;
    r_ += (v_ + push * (0.5 * T)) * T;
    v_ += push * T;
    theta_ += turn;
  }
  const PolarMove& move_;
  const Epochs& epochs_;
  bool started_ = false;
  Now last_;
  Vec<Transverse, double> theta_, v_, r_;
};

struct EndError {
  double e[2], heading;
};
// In the transverse axes at the true end.
EndError end_error(const PolarMove& move, const EcefState<double>& x, const ReferenceEpoch& truth) {
  const auto t = to_transverse_state(move.earth, move.lon0, truth.e);
  const auto axes = transverse_axes<double>(t.tlat, t.tlon, move.lon0);
  const auto r = axes * (x.r - truth.e.r);
  const auto c = to_matrix(x.q_eb) * transpose(truth.e.C_eb);
  const auto turn =
      axes * Vec<Ecef, double>{0.5 * (c.m[2][1] - c.m[1][2]), 0.5 * (c.m[0][2] - c.m[2][0]),
                               0.5 * (c.m[1][0] - c.m[0][1])};
  return {{r.x, r.y}, -turn.z};
}

Epochs with_error(const PolarMove& move, Epochs epochs, const ReferenceError& e) {
  for (ReferenceEpoch& k : epochs) k.e = said_by(move, k.e, e);
  return epochs;
}

struct Moved {
  Log log;
  Epochs epochs;
};
Moved moved_by(const PolarMove& move, const Log& log, const Epochs& said, double longest_gap) {
  Moved out;
  out.log.reserve(log.size());
  std::size_t k = 0;
  PolarMover mover(
      move,
      [&]() -> std::optional<ReferenceEpoch> {
        return k < said.size() ? std::optional(said[k++]) : std::nullopt;
      },
      longest_gap, [&](const MovedSample& s) { out.log.push_back(s.imu); },
      [&](double t, const TransverseState<double>&, const TransverseState<double>& m) {
        out.epochs.push_back({t, to_ecef_pose(move.earth, move.lon0, m)});
      });
  for (const auto& u : log) mover.add(u);
  mover.finish();
  return out;
}

}  // namespace

Quantiles quantiles(std::vector<double> v) {
  if (v.empty()) return {};
  std::sort(v.begin(), v.end());
  const auto at = [&](double q) {
    const double x = q * static_cast<double>(v.size() - 1);
    const auto i = static_cast<std::size_t>(x);
    return i + 1 < v.size() ? v[i] + (x - static_cast<double>(i)) * (v[i + 1] - v[i]) : v[i];
  };
  return {at(0.5), at(0.95), v.back()};
}

PolarTrialResult polar_trial(const Drive& drive, const PolarTrialSettings& settings,
                             Diagnostics& diagnostics,
                             const std::function<void(double)>& progress) {
  const PolarMove& move = settings.move;
  if (!drive.imu.present)
    throw Error(ErrorKind::kInput, "the drive has no [imu]: there is no unit to test", drive.path);
  const ReferenceEpochs reference = reference_epochs(drive, diagnostics);
  Log log;
  {
    ImuReader reader(drive, diagnostics);
    if (!reader.unit_fault().empty()) throw Error(ErrorKind::kInput, reader.unit_fault());
    ImuIncrement<double> u;
    while (reader.next(u)) log.push_back(u);
  }
  const Epochs& home_epochs = reference.epochs;
  const Moved pole = moved_by(move, log, home_epochs, reference.longest_gap);
  if (pole.log.empty())
    throw Error(ErrorKind::kInput, "the reference and the IMU log have no time in common",
                drive.path);
  const EarthModel earth = make_earth_model(move.earth, move.lon0);
  const Vertical home_vertical(move.earth, home_epochs), pole_vertical(move.earth, pole.epochs);

  PolarTrialResult out;
  out.samples = pole.log.size();
  // Where both log and reference are.
  const double begin = std::max(home_epochs.front().t, log.front().t - log.front().dt),
               end = std::min(home_epochs.back().t, log.back().t);
  out.begin_t = begin, out.end_t = end;
  const auto epoch_at = [&](double t) {
    return static_cast<std::size_t>(
        std::lower_bound(home_epochs.begin(), home_epochs.end(), t - 1e-9,
                         [](const ReferenceEpoch& k, double x) { return k.t < x; }) -
        home_epochs.begin());
  };
  struct Piece {
    std::size_t a, b;
  };
  std::vector<std::vector<Piece>> pieces;
  for (const double length : settings.windows) {
    PolarTrialWindow w;
    w.length = length;
    std::vector<Piece> of;
    if (end - begin >= length) {
      // Apart by the window where there is room for enough of them, else overlapping.
      const double spread = end - begin - length;
      const double apart = std::max(spread / static_cast<double>(settings.most_starts),
                                    std::min(length, spread / 20));
      for (double t = begin; t <= begin + spread + 1e-9; t += apart) {
        const Piece p{epoch_at(t), epoch_at(t + length)};
        if (p.b < home_epochs.size() && p.b > p.a) of.push_back(p);
        if (!(apart > 0)) break;
      }
    }
    if (of.empty())
      diagnostics.note("window", drive.path,
                       "the record is too short for a window of " + std::to_string(length) + " s");
    pieces.push_back(of);
    out.windows.push_back(std::move(w));
  }
  if (std::all_of(pieces.begin(), pieces.end(), [](const auto& p) { return p.empty(); }))
    throw Error(ErrorKind::kInput, "the record is shorter than the shortest window", drive.path);

  const Place at_home{&log, &home_epochs}, at_pole{&pole.log, &pole.epochs};
  // Once in every polar mechanization.
  std::vector<std::vector<EcefState<double>>> ends(out.windows.size());
  for (std::size_t w = 0; w < pieces.size(); ++w)
    for (const Piece& p : pieces[w]) {
      PolarTrialStart s;
      s.t = home_epochs[p.a].t;
      PhysicalDifference physical(move, home_epochs);
      const auto h =
          end_error(move,
                    navigated<TransverseMechanization>(
                        earth, at_home, home_vertical, p.a, p.b,
                        [&](const EcefState<double>& x, std::size_t k) { physical.at(x, k); }),
                    home_epochs[p.b]);
      s.physics[0] = physical.east(), s.physics[1] = physical.north();
      s.physics_heading = physical.heading();
      const EcefState<double> by[] = {
          navigated<TransverseMechanization>(earth, at_pole, pole_vertical, p.a, p.b),
          navigated<GridMechanization>(earth, at_pole, pole_vertical, p.a, p.b),
          navigated<WanderMechanization>(earth, at_pole, pole_vertical, p.a, p.b),
          navigated<EcefMechanization>(earth, at_pole, pole_vertical, p.a, p.b)};
      const auto e = end_error(move, by[0], pole.epochs[p.b]);
      for (int i = 0; i < 2; ++i) s.home[i] = h.e[i], s.pole[i] = e.e[i];
      s.home_heading = h.heading, s.pole_heading = e.heading;
      for (const auto& x : by)
        for (const auto& y : by) s.mechanization = std::max(s.mechanization, norm(x.r - y.r));
      ends[w].push_back(by[0]);
      out.windows[w].starts.push_back(s);
    }
  if (progress) progress(1.0 / 6);
  // Each error of the reference alone: what it puts into the data, carried to the window's end.
  for (int source = 0; source < 5; ++source) {
    ReferenceError e;
    double* part[] = {&e.heading, &e.pitch, &e.roll, &e.ve, &e.vn};
    const double sigma[] = {settings.sigma.heading, settings.sigma.level, settings.sigma.level,
                            settings.sigma.velocity, settings.sigma.velocity};
    *part[source] = sigma[source];
    if (sigma[source] == 0) continue;
    const Moved wrong =
        moved_by(move, log, with_error(move, home_epochs, e), reference.longest_gap);
    const Place place{&wrong.log, &pole.epochs};
    for (std::size_t w = 0; w < pieces.size(); ++w)
      for (std::size_t i = 0; i < pieces[w].size(); ++i) {
        const Piece& p = pieces[w][i];
        const auto d = end_error(
            move, navigated<TransverseMechanization>(earth, place, pole_vertical, p.a, p.b),
            {pole.epochs[p.b].t, {ends[w][i].r, pole.epochs[p.b].e.v, to_matrix(ends[w][i].q_eb)}});
        out.windows[w].starts[i].conversion += d.e[0] * d.e[0] + d.e[1] * d.e[1];
        out.windows[w].starts[i].conversion_heading += d.heading * d.heading;
      }
    if (progress) progress((source + 2) / 6.0);
  }
  for (auto& w : out.windows)
    for (auto& s : w.starts) {
      s.conversion = std::sqrt(s.conversion);
      s.conversion_heading = std::sqrt(s.conversion_heading);
    }
  const std::size_t every = std::max<std::size_t>(1, home_epochs.size() / 2000);
  for (std::size_t i = 0; i < home_epochs.size() && i < pole.epochs.size(); i += every) {
    const auto a = to_geodetic(move.earth, home_epochs[i].e.r),
               b = to_geodetic(move.earth, pole.epochs[i].e.r);
    out.t.push_back(home_epochs[i].t);
    out.home_lat.push_back(a.lat), out.home_lon.push_back(a.lon);
    out.pole_lat.push_back(b.lat), out.pole_lon.push_back(b.lon);
  }
  return out;
}

}  // namespace loxo
