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
    const Spread<S, 13> e({start.r.x, start.r.y, start.r.z, start.v.x, start.v.y, start.v.z,
                           start.q_eb.w, start.q_eb.x, start.q_eb.y, start.q_eb.z, mounting,
                           pitching, scale});
    for (int k = 0; k < kWide<S>; ++k) {
      const double* a = e.lane[k];
      Lane& l = lanes_[k];
      l.mounting = set.mounting_heading;
      l.scale = a[12];
      NavigatorStart s;
      s.state.r = {a[0], a[1], a[2]};
      s.state.v = {a[3], a[4], a[5]};
      s.state.q = {a[6], a[7], a[8], a[9]};
      // Believed forward is turned clockwise by the mounting error from the true one.
      s.state.eps_h = set.mounting_heading - a[10];
      s.state.eps_p = set.mounting_pitch + a[11];
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
    double v[8];
    spread(way, v);
    for (int k = 0; k < kWide<S>; ++k) lanes_[k].navigator->odometer({t, v[k], false});
  }
  void slip(const S& side) {
    double v[8];
    spread(side, v);
    for (int k = 0; k < kWide<S>; ++k) lanes_[k].axes.slip(v[k]);
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
      const NominalState& s = l.navigator->state();
      const Vec<Ecef> dr = s.r - at.state.r;
      const double de = dot(dr, at.east), dn = dot(dr, at.north);
      const auto& P = l.navigator->covariance().p;
      const auto cov = [&](const Vec<Ecef>& a, const Vec<Ecef>& b) {
        const double u[3] = {a.x, a.y, a.z}, v[3] = {b.x, b.y, b.z};
        double sum = 0;
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) sum += u[i] * P[kDr + i][kDr + j] * v[j];
        return sum;
      };
      const double ee = cov(at.east, at.east), en = cov(at.east, at.north),
                   nn = cov(at.north, at.north);
      l.now = sqrt(de * de + dn * dn);
      if (t >= 120) l.most_pct = max(percent * l.now, l.most_pct);
      l.nees_now = (nn * de * de - 2 * en * de * dn + ee * dn * dn) / (ee * nn - en * en);
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
    double v[8];
    for (std::size_t j = 0; j < rows[0].size(); ++j) {
      for (int k = 0; k < kWide<S>; ++k) v[k] = rows[k][j];
      m[j] = gather<S>(v);
    }
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
