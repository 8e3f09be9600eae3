// SPDX-License-Identifier: Apache-2.0
// A trial's joint filter sample by sample, lane by lane in double, to the same bits. For the .cpp
// files of kinds only.
#pragma once
#include <memory>
#include <vector>

#include "loxo/earth/geodetic.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/study/believed_axes.hpp"

namespace loxo {

// The joint filter of `loxo navigate --mode filter`, at every sample, with the same heights and
// fixes as the one at 1 Hz.
template <Real S>
class TrialNavigator {
 public:
  TrialNavigator(const DriveSetup& set, const DeclaredErrors<S>& declared,
                 const EcefState<S>& start, const S& mounting, const S& pitching, const S& scale,
                 std::uint64_t seed, std::uint64_t trial)
      : set_(&set),
        noise_{seed, trial, noise_source::kFix},
        fix_sigma_(declared.fix),
        height_sigma_(declared.height) {
    for (int k = 0; k < kWide<S>; ++k) {
      Lane& l = lanes_[k];
      l.mounting = set.mounting_heading;
      l.scale = lane_of(scale, k);
      NavigatorStart s;
      s.state = believed_start(set, start, mounting, pitching, k);
      const auto d = lane_of(declared, k);
      l.fix_std = d.fix;
      // The slip turns the unit's own axes: no belief in these.
      l.axes = BelievedAxes(set.truth, 0);
      l.navigator = std::make_unique<Navigator>(navigator_config(set, d, s));
      l.navigator->start(s);
      l.fan.assign(set.fan.size(), 0.0);
    }
  }
  void imu(double t, const ImuIncrement<S>& u) {
    const Spread<S, 6> e = sample_of(u);
    const DriveTruth& truth = set_->truth;
    for (int k = 0; k < kWide<S>; ++k) {
      ImuIncrement<double> v = lanes_[k].axes.sample(t, u.dt, e.lane[k]);
      // Back on the unit's axes, as the mounting stands.
      const auto back = [&](const Vec<Body>& x) {
        return x.x * truth.right + x.y * truth.forward + x.z * truth.up;
      };
      v.dtheta = back(v.dtheta), v.dv = back(v.dv);
      lanes_[k].navigator->imu(v);
    }
  }
  void tick(double t, const S& way) {
    for (int k = 0; k < kWide<S>; ++k) lanes_[k].navigator->odometer({t, lane_of(way, k), false});
  }
  void slip(const S& side) {
    for (int k = 0; k < kWide<S>; ++k) lanes_[k].axes.slip(lane_of(side, k));
  }
  void epoch(double t, std::size_t number) {
    const auto& at = set_->truth.epochs[number];
    const auto n = noise_.template normals<4>(number);
    const Spread<S, 4> e(
        {height_sigma_ * n[0], fix_sigma_ * n[1], fix_sigma_ * n[2], fix_sigma_ * n[3]});
    const double percent = at.distance > 1 ? 100 / at.distance : 0;
    for (int k = 0; k < kWide<S>; ++k) {
      Lane& l = lanes_[k];
      l.navigator->height({t, at.h + e.lane[k][0], kNone});
      if (at.fix) {
        const Geodetic<double> p = to_geodetic(
            set_->ellipsoid, at.state.r + Vec<Ecef>{e.lane[k][1], e.lane[k][2], e.lane[k][3]});
        Fix f;
        f.t = t, f.lat = p.lat, f.lon = p.lon, f.h = p.h;
        f.std_e = f.std_n = f.std_u = max(1e-3, l.fix_std);
        l.navigator->fix(f);
      }
      const HorizontalMiss miss =
          horizontal_miss(l.navigator->state(), l.navigator->covariance(), at);
      l.now = miss.distance;
      if (t >= 120) l.most_pct = max(percent * l.now, l.most_pct);
      l.nees_now = miss.nees;
      l.nees += l.nees_now;
      for (std::size_t i = 0; i < set_->fan.size(); ++i)
        if (set_->fan[i] == number) l.fan[i] = percent * l.now;
    }
  }
  // In the order of navigator_metrics().
  void result(S* m) const {
    const double count = static_cast<double>(set_->truth.epochs.size() - 1);
    std::vector<double> rows[kWide<S>];
    for (int k = 0; k < kWide<S>; ++k) {
      const Lane& l = lanes_[k];
      const NominalState& s = l.navigator->state();
      rows[k] = {l.now,
                 l.most_pct,
                 set_->percent * l.now,
                 l.nees / count,
                 l.nees_now,
                 s.scale - l.scale,
                 s.eps_h - l.mounting,
                 l.navigator->diverged() ? 1.0 : 0.0};
      rows[k].insert(rows[k].end(), l.fan.begin(), l.fan.end());
    }
    gather_rows(rows, rows[0].size(), m);
  }

 private:
  struct Lane {
    std::unique_ptr<Navigator> navigator;
    BelievedAxes axes;
    double mounting = 0, scale = 1, fix_std = 0, now = 0, most_pct = 0, nees = 0, nees_now = 0;
    std::vector<double> fan;
  };
  const DriveSetup* set_;
  Stream<S> noise_;
  S fix_sigma_, height_sigma_;
  Lane lanes_[kWide<S>];
};

}  // namespace loxo
