// SPDX-License-Identifier: Apache-2.0
// A trial's joint filter: its strapdown runs in lanes, what is asked once a second runs lane by
// lane in double, to the same bits. For the .cpp files of kinds only.
#pragma once
#include <array>
#include <iterator>
#include <vector>

#include "loxo/ins/strapdown.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/study/drive_modes.hpp"

namespace loxo {

// The joint filter at 1 Hz: strapdown in ECEF with what it estimates fed back.
template <Real S>
class TrialFilter {
 public:
  using V = Vec<Body, S>;
  TrialFilter(const DriveSetup& set, const DeclaredErrors<S>& declared, const EcefState<S>& start,
              const S& mounting, const S& pitching, const S& scale, std::uint64_t seed,
              std::uint64_t trial)
      : set_(&set),
        earth_(make_earth_model(set.ellipsoid)),
        x_(EcefMechanization::from_ecef(earth_, start)),
        mid_(x_),
        tick_(x_),
        noise_{seed, trial, noise_source::kFix},
        fix_sigma_(declared.fix),
        height_sigma_(declared.height) {
    for (int k = 0; k < kWide<S>; ++k) {
      nominal_[k] = believed_start(set, start, mounting, pitching, k);
      true_scale_[k] = lane_of(scale, k);
      filters_.emplace_back(epoch_filter_config(set, lane_of(declared, k)), nominal_[k]);
    }
    settle();
  }
  void imu(const EarthModel&, const ImuIncrement<S>& u) {
    ImuIncrement<S> c = u;
    c.dtheta = {gain_w_.x * (u.dtheta.x - bias_w_.x), gain_w_.y * (u.dtheta.y - bias_w_.y),
                gain_w_.z * (u.dtheta.z - bias_w_.z)};
    c.dv = {gain_f_.x * (u.dv.x - bias_f_.x), gain_f_.y * (u.dv.y - bias_f_.y),
            gain_f_.z * (u.dv.z - bias_f_.z)};
    if (first_) before_ = c;
    first_ = false;
    x_ = step(earth_, x_, one_sample(before_, c));
    before_ = c;
    sum_w_ = sum_w_ + c.dtheta;
    sum_f_ = sum_f_ + c.dv;
  }
  void half_tick() { tick_ = x_; }
  void half_epoch() { mid_ = x_; }
  void tick(const S& way, double dt) {
    const V v = rotate(conjugate(tick_.q_nb), tick_.v);
    for (int i = 0; i < 3; ++i) d_[i] = d_[i] + dt * dot(axes_[i], v);
    way_ = way_ + way;
  }
  // `side`: how far the vehicle slips sideways this second, rad. Parts [from, to) of the fan.
  void epoch(const EarthModel&, std::size_t number, const S& side, std::size_t from,
             std::size_t to) {
    const auto& at = set_->truth.epochs[number];
    const double dt = set_->truth.dt * set_->truth.epoch_every;
    const auto n = noise_.template normals<4>(number);
    const auto& p = x_.position.r;
    const Spread<S, 32> e({x_.q_nb.w,
                           x_.q_nb.x,
                           x_.q_nb.y,
                           x_.q_nb.z,
                           x_.v.x,
                           x_.v.y,
                           x_.v.z,
                           p.x,
                           p.y,
                           p.z,
                           mid_.q_nb.w,
                           mid_.q_nb.x,
                           mid_.q_nb.y,
                           mid_.q_nb.z,
                           mid_.v.x,
                           mid_.v.y,
                           mid_.v.z,
                           sum_w_.x,
                           sum_w_.y,
                           sum_w_.z,
                           sum_f_.x,
                           sum_f_.y,
                           sum_f_.z,
                           d_[0],
                           d_[1],
                           d_[2],
                           way_,
                           side,
                           height_sigma_ * n[0],
                           fix_sigma_ * n[1],
                           fix_sigma_ * n[2],
                           fix_sigma_ * n[3]});
    for (int k = 0; k < kWide<S>; ++k) {
      const double* a = e.lane[k];
      NominalState& s = nominal_[k];
      s.q = {a[0], a[1], a[2], a[3]};
      s.v = {a[4], a[5], a[6]};
      s.r = {a[7], a[8], a[9]};
      // A slip to the right shows as way to the right that the truth has not.
      s.d[0] = a[23] - a[26] * a[27], s.d[1] = a[24], s.d[2] = a[25];
      EpochMotion m;
      m.dt = dt;
      m.C = to_matrix(Quat<Ecef, Body>{a[10], a[11], a[12], a[13]});
      m.v = {a[14], a[15], a[16]};
      m.dtheta = {a[17], a[18], a[19]};
      m.dv = {a[20], a[21], a[22]};
      EpochMeasurements z;
      if (!set_->truth.ticks.empty()) z.way = a[26];
      z.height = at.h + a[28];
      z.has_fix = at.fix;
      z.fix = at.state.r + Vec<Ecef>{a[29], a[30], a[31]};
      filters_[static_cast<std::size_t>(k)].epoch(s, m, z);
      judge(k, number, from, to);
    }
    load();
    settle();
  }
  // In the order of filter_metrics().
  void result(S* m) const {
    const double count = static_cast<double>(set_->truth.epochs.size() - 1);
    std::vector<double> rows[kWide<S>];
    for (int k = 0; k < kWide<S>; ++k) {
      const Score& s = scores_[k];
      rows[k] = {s.now,
                 s.most,
                 sqrt(s.squares / count),
                 set_->percent * s.now,
                 s.heading,
                 s.nees / count,
                 nominal_[k].scale - true_scale_[k],
                 nominal_[k].eps_h - set_->mounting_heading};
      rows[k].insert(rows[k].end(), std::begin(s.fan), std::end(s.fan));
    }
    gather_rows(rows, rows[0].size(), m);
  }

 private:
  struct Score {
    double now = 0, most = 0, squares = 0, nees = 0, heading = 0, fan[10]{};
  };
  void judge(int k, std::size_t number, std::size_t from, std::size_t to) {
    const auto& at = set_->truth.epochs[number];
    const NominalState& s = nominal_[k];
    Score& score = scores_[k];
    const HorizontalMiss miss =
        horizontal_miss(s, filters_[static_cast<std::size_t>(k)].covariance(), at);
    score.now = miss.distance;
    score.most = max(score.now, score.most);
    score.squares += miss.squared;
    score.nees += miss.nees;
    for (std::size_t i = from; i < to; ++i) score.fan[i] = score.now;
    if (number + 1 == set_->truth.epochs.size()) {
      const auto off = conjugate(at.state.q_eb) * s.q;
      score.heading = wrap_pi(-2.0 * atan2(off.z, off.w));
    }
  }
  // The corrected states back into the strapdown.
  void load() {
    std::array<double, 10> rows[kWide<S>];
    for (int k = 0; k < kWide<S>; ++k) {
      const NominalState& s = nominal_[k];
      rows[k] = {s.q.w, s.q.x, s.q.y, s.q.z, s.v.x, s.v.y, s.v.z, s.r.x, s.r.y, s.r.z};
    }
    S x[10];
    gather_rows(rows, 10, x);
    EcefState<S> e;
    e.q_eb = {x[0], x[1], x[2], x[3]};
    e.v = {x[4], x[5], x[6]};
    e.r = {x[7], x[8], x[9]};
    x_ = EcefMechanization::from_ecef(earth_, e);
  }
  // The constants in use, for the next epoch.
  void settle() {
    const double dt = set_->truth.dt;
    std::array<double, 21> rows[kWide<S>];
    for (int k = 0; k < kWide<S>; ++k) {
      const NominalState& s = nominal_[k];
      const MountingAxes m = mounting_axes(s.eps_h, s.eps_p);
      rows[k] = {s.bg.x * dt,      s.bg.y * dt,      s.bg.z * dt,      s.ba.x * dt,
                 s.ba.y * dt,      s.ba.z * dt,      1 / (1 + s.sg.x), 1 / (1 + s.sg.y),
                 1 / (1 + s.sg.z), 1 / (1 + s.sa.x), 1 / (1 + s.sa.y), 1 / (1 + s.sa.z),
                 m.axis[0].x,      m.axis[0].y,      m.axis[0].z,      m.axis[1].x,
                 m.axis[1].y,      m.axis[1].z,      m.axis[2].x,      m.axis[2].y,
                 m.axis[2].z};
    }
    S x[21];
    gather_rows(rows, 21, x);
    const auto vec = [&](int j) { return V{x[j], x[j + 1], x[j + 2]}; };
    bias_w_ = vec(0), bias_f_ = vec(3), gain_w_ = vec(6), gain_f_ = vec(9);
    for (int i = 0; i < 3; ++i) axes_[i] = vec(12 + 3 * i), d_[i] = S(0.0);
    way_ = S(0.0);
    sum_w_ = sum_f_ = V{S(0.0), S(0.0), S(0.0)};
  }

  const DriveSetup* set_;
  EarthModel earth_;
  State<EcefMechanization, S> x_, mid_, tick_;
  Stream<S> noise_;
  S fix_sigma_, height_sigma_;
  NominalState nominal_[kWide<S>];
  double true_scale_[kWide<S>]{};
  Score scores_[kWide<S>];
  std::vector<EpochFilter> filters_;
  ImuIncrement<S> before_;
  bool first_ = true;
  V bias_w_, bias_f_, gain_w_, gain_f_, axes_[3], sum_w_, sum_f_;
  S d_[3], way_;
};

}  // namespace loxo
