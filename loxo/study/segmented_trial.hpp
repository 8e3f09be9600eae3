// SPDX-License-Identifier: Apache-2.0
// A trial's segmented method, lane by lane in double, to the same bits. For the .cpp files of kinds
// only.
#pragma once
#include <memory>
#include <vector>

#include "loxo/earth/geodetic.hpp"
#include "loxo/study/believed_axes.hpp"

namespace loxo {

template <Real S>
class TrialSegmented {
 public:
  TrialSegmented(const DriveSetup& set, const DeclaredErrors<S>& declared,
                 const EcefState<S>& start, const S& mounting, const S& scale)
      : set_(&set) {
    for (int k = 0; k < kWide<S>; ++k) {
      const EcefState<double> x = lane_of(start, k);
      Lane& l = lanes_[k];
      l.mounting = lane_of(mounting, k), l.scale = lane_of(scale, k);
      l.axes = BelievedAxes(set.truth, l.mounting);
      const EcefState<double>& truth = set.truth.epochs.front().state;
      const auto place = to_geodetic(set.ellipsoid, truth.r);
      const auto level = geographic_axes(place.lat, place.lon);
      const Rot<Ecef, Body> C_eb = to_matrix(x.q_eb);
      // C~ = (I - [phi]) C.
      const auto off = C_eb * transpose(to_matrix(truth.q_eb));
      const Rot<Geographic, Geographic> E = level * (off * transpose(level));
      l.azimuth = 0.5 * (E.m[0][1] - E.m[1][0]);
      const Rot<Geographic, Body> C = level * C_eb;
      SegmentedStart s;
      s.place = place;
      const Vec<Geographic> columns[3] = {C * l.axes.right, C * l.axes.forward, C * l.axes.up};
      for (int j = 0; j < 3; ++j) {
        s.C_nb.m[0][j] = columns[j].x;
        s.C_nb.m[1][j] = columns[j].y;
        s.C_nb.m[2][j] = columns[j].z;
      }
      const auto v = level * x.v;
      s.ve = v.x, s.vn = v.y;
      l.navigator =
          std::make_unique<SegmentedNavigator>(segmented_config(set, lane_of(declared, k)), s);
      l.fan.assign(kSegmentedSeries * set.fan.size(), 0.0);
      l.scales.assign(set.early_fan.size(), 0.0);
    }
  }
  void imu(double t, const ImuIncrement<S>& u) {
    const Spread<S, 6> e = sample_of(u);
    for (int k = 0; k < kWide<S>; ++k)
      lanes_[k].navigator->imu(lanes_[k].axes.sample(t, u.dt, e.lane[k]));
  }
  void tick(double t, const S& way) {
    for (int k = 0; k < kWide<S>; ++k) lanes_[k].navigator->odometer({t, lane_of(way, k), false});
  }
  void slip(const S& side) {
    for (int k = 0; k < kWide<S>; ++k) lanes_[k].axes.slip(lane_of(side, k));
  }
  void epoch(std::size_t number) {
    const auto& at = set_->truth.epochs[number];
    const auto place = to_geodetic(set_->ellipsoid, at.state.r);
    const double sl = sin(place.lat), M = meridian_radius(set_->ellipsoid, sl) + place.h,
                 N = (prime_vertical_radius(set_->ellipsoid, sl) + place.h) * cos(place.lat);
    const double percent = at.distance > 1 ? 100 / at.distance : 0;
    for (int k = 0; k < kWide<S>; ++k) {
      Lane& l = lanes_[k];
      const SegmentedEpoch& e = l.navigator->epoch();
      const auto miss = [&](const Horizontal& h) {
        const double n = (h.lat - place.lat) * M, east = wrap_pi(h.lon - place.lon) * N;
        return sqrt(n * n + east * east);
      };
      const double series[kSegmentedSeries] = {miss(e.ins),          miss(e.reckoned),
                                               miss(e.weighted),     miss(e.naive),
                                               miss(e.intersection), miss(e.joint)};
      l.reckoned = series[1], l.weighted = series[2], l.joint = series[5];
      if (e.phase == 1 || e.switched) l.k = e.k, l.mu = e.mu;
      if (e.switched) l.switched = e.t, l.forced = e.forced;
      const double t = set_->truth.dt * set_->truth.epoch_every * static_cast<double>(number);
      if (t <= 60.5) l.k_60 = l.k;
      if (t <= 120.5) l.k_120 = l.k, l.mu_120 = l.mu;
      if (t >= 120) l.most_pct = max(percent * l.weighted, l.most_pct);
      for (std::size_t i = 0; i < set_->fan.size(); ++i)
        if (set_->fan[i] == number)
          for (std::size_t j = 0; j < kSegmentedSeries; ++j)
            l.fan[j * set_->fan.size() + i] = percent * series[j];
      for (std::size_t i = 0; i < set_->early_fan.size(); ++i)
        if (set_->early_fan[i] == number) l.scales[i] = l.k - 1;
    }
  }
  // In the order of segmented_metrics().
  void result(S* m) const {
    const auto found = [](double estimated, double preset) {
      // Of nothing, all is found.
      return fabs(preset) > 1e-12 ? 100 - 100 * fabs(estimated - preset) / fabs(preset) : 100.0;
    };
    std::vector<double> rows[kWide<S>];
    for (int k = 0; k < kWide<S>; ++k) {
      const Lane& l = lanes_[k];
      rows[k] = {l.weighted,
                 l.most_pct,
                 set_->percent * l.weighted,
                 l.joint,
                 set_->percent * l.joint,
                 l.reckoned,
                 l.switched,
                 l.forced ? 1.0 : 0.0,
                 l.k - l.scale,
                 l.mu - l.mounting,
                 found(l.k_60 - 1, l.scale - 1),
                 found(l.k_120 - 1, l.scale - 1),
                 found(l.mu_120, l.mounting),
                 l.mu_120 - l.mounting,
                 l.azimuth,
                 100 * fabs(l.azimuth)};
      rows[k].insert(rows[k].end(), l.scales.begin(), l.scales.end());
      rows[k].insert(rows[k].end(), l.fan.begin(), l.fan.end());
    }
    gather_rows(rows, rows[0].size(), m);
  }

 private:
  struct Lane {
    std::unique_ptr<SegmentedNavigator> navigator;
    BelievedAxes axes;
    double mounting = 0, scale = 1, azimuth = 0, k = 1, mu = 0, k_60 = 1, k_120 = 1, mu_120 = 0;
    double switched = 0, reckoned = 0, weighted = 0, joint = 0, most_pct = 0;
    bool forced = false;
    std::vector<double> fan, scales;
  };
  const DriveSetup* set_;
  Lane lanes_[kWide<S>];
};

}  // namespace loxo
