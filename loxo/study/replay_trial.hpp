// SPDX-License-Identifier: Apache-2.0
// A trial's calibration from surveyed ends and its segmented method: recorded in lanes, computed
// lane by lane in double, to the same bits. For the .cpp files of kinds only.
#pragma once
#include <memory>
#include <vector>

#include "loxo/ins/strapdown.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/study/calibration_trial.hpp"
#include "loxo/study/drive_modes.hpp"

namespace loxo {

// The track that a dead-reckoning set records with the INS's heading, calibrated at its end.
template <Real S>
class TrialCalibration {
 public:
  TrialCalibration(const DriveSetup& set, const S& mounting, const S& scale, std::uint64_t seed,
                   std::uint64_t trial)
      : set_(&set),
        mounting_(mounting),
        scale_(scale),
        survey_{seed, trial, noise_source::kBenchmark} {
    for (auto& track : tracks_) track.reserve(set.truth.ticks.size());
  }
  void half_tick(const EcefState<S>& x, const EarthModel& earth, const Vec<Body, S>& forward) {
    const auto n = normal_point(earth, x.r).n;
    const auto f = rotate(x.q_eb, forward);
    // East and north there, not normalised: their ratio is what counts.
    const S east = f.y * n.x - f.x * n.y;
    const S north = f.z - dot(f, n) * n.z;
    heading_ = atan2(east, north);
    const S up = dot(f, n);
    pitch_ = atan2(up, sqrt(max(S(1.0) - up * up, S(0.0))));
  }
  void tick(double t, const S& way, double h) {
    const Spread<S, 3> e({way, heading_, pitch_});
    for (int k = 0; k < kWide<S>; ++k)
      tracks_[k].push_back({t, e.lane[k][0], wrap_2pi(e.lane[k][1]), e.lane[k][2], h, 0});
  }
  void result(const S& benchmark_std, const TrackSigmas<S>& sigmas, S* m) {
    const auto n = survey_.template normals<4>(0);
    const Spread<S, 12> e({mounting_, scale_, benchmark_std, n[0], n[1], n[2], n[3], sigmas.heading,
                           sigmas.drift, sigmas.heading_noise, sigmas.scale_noise,
                           sigmas.quantisation});
    double v[kCalibrationMetrics][8];
    for (int k = 0; k < kWide<S>; ++k) {
      const double* a = e.lane[k];
      CalibrationTrial trial;
      trial.ellipsoid = &set_->ellipsoid;
      trial.track = &tracks_[k];
      trial.eps = a[0], trial.scale = a[1], trial.benchmark_std = a[2];
      for (int j = 0; j < 4; ++j) trial.survey[j] = a[2] * a[3 + j];
      trial.heading_bias = a[7], trial.heading_drift = a[8], trial.heading_noise = a[9];
      trial.scale_noise = a[10], trial.quantisation = a[11];
      trial.start = set_->truth.epochs.front().state.r;
      trial.end = set_->truth.epochs.back().state.r;
      double out[kCalibrationMetrics];
      calibrate_trial(trial, out);
      for (std::size_t j = 0; j < kCalibrationMetrics; ++j) v[j][k] = out[j];
    }
    for (std::size_t j = 0; j < kCalibrationMetrics; ++j) m[j] = gather<S>(v[j]);
  }

 private:
  const DriveSetup* set_;
  S mounting_, scale_, heading_{0.0}, pitch_{0.0};
  Stream<S> survey_;
  std::vector<TrackStep> tracks_[kWide<S>];
};

// The segmented method, lane by lane: its body axes are those believed to be the vehicle's.
template <Real S>
class TrialSegmented {
 public:
  TrialSegmented(const DriveSetup& set, const DeclaredErrors<S>& declared,
                 const EcefState<S>& start, const S& mounting, const S& scale)
      : set_(&set) {
    const Spread<S, 9> e({start.q_eb.w, start.q_eb.x, start.q_eb.y, start.q_eb.z, mounting, scale,
                          start.v.x, start.v.y, start.v.z});
    for (int k = 0; k < kWide<S>; ++k) {
      const double* a = e.lane[k];
      Lane& l = lanes_[k];
      l.mounting = a[4];
      l.scale = a[5];
      double sm, cm;
      sincos(a[4], sm, cm);
      l.forward = cm * set.truth.forward + sm * set.truth.right;
      l.right = cm * set.truth.right - sm * set.truth.forward;
      const auto place = to_geodetic(set.ellipsoid, set.truth.epochs.front().state.r);
      const auto level = geographic_axes(place.lat, place.lon);
      const Rot<Geographic, Body> C = level * to_matrix(Quat<Ecef, Body>{a[0], a[1], a[2], a[3]});
      SegmentedStart s;
      s.place = place;
      const Vec<Geographic> columns[3] = {C * l.right, C * l.forward, C * set.truth.up};
      for (int j = 0; j < 3; ++j) {
        s.C_nb.m[0][j] = columns[j].x;
        s.C_nb.m[1][j] = columns[j].y;
        s.C_nb.m[2][j] = columns[j].z;
      }
      const auto v = level * Vec<Ecef>{a[6], a[7], a[8]};
      s.ve = v.x, s.vn = v.y;
      l.navigator =
          std::make_unique<SegmentedNavigator>(segmented_config(set, lane_of(declared, k)), s);
    }
  }
  void imu(double t, const ImuIncrement<S>& u) {
    const Spread<S, 6> e({u.dtheta.x, u.dtheta.y, u.dtheta.z, u.dv.x, u.dv.y, u.dv.z});
    for (int k = 0; k < kWide<S>; ++k) {
      Lane& l = lanes_[k];
      const double* a = e.lane[k];
      const Vec<Body> w{a[0], a[1], a[2]}, f{a[3], a[4], a[5]};
      const auto& up = set_->truth.up;
      l.navigator->imu({t,
                        u.dt,
                        {dot(l.right, w), dot(l.forward, w), dot(up, w)},
                        {dot(l.right, f), dot(l.forward, f), dot(up, f)}});
    }
  }
  void tick(double t, const S& way) {
    double v[8];
    spread(way, v);
    for (int k = 0; k < kWide<S>; ++k) lanes_[k].navigator->odometer({t, v[k], false});
  }
  void epoch(std::size_t number) {
    const auto& at = set_->truth.epochs[number];
    const auto place = to_geodetic(set_->ellipsoid, at.state.r);
    const double sl = sin(place.lat), M = meridian_radius(set_->ellipsoid, sl) + place.h,
                 N = (prime_vertical_radius(set_->ellipsoid, sl) + place.h) * cos(place.lat);
    for (int k = 0; k < kWide<S>; ++k) {
      Lane& l = lanes_[k];
      const SegmentedEpoch& e = l.navigator->epoch();
      const auto miss = [&](const Horizontal& h) {
        const double n = (h.lat - place.lat) * M, east = wrap_pi(h.lon - place.lon) * N;
        return sqrt(n * n + east * east);
      };
      l.ins = miss(e.ins), l.reckoned = miss(e.reckoned), l.weighted = miss(e.weighted),
      l.joint = miss(e.joint);
      if (e.phase == 1) l.k = e.k, l.mu = e.mu;
      if (e.t >= 120 && at.distance > 0)
        l.most_pct = max(100 * l.weighted / at.distance, l.most_pct);
      if (e.switched) l.switched = e.t, l.k = e.k, l.mu = e.mu;
    }
  }
  void result(S* m) const {
    double v[8];
    for (std::size_t j = 0; j < 9; ++j) {
      for (int k = 0; k < kWide<S>; ++k) {
        const Lane& l = lanes_[k];
        const double out[9] = {l.weighted,
                               l.most_pct,
                               set_->percent * l.weighted,
                               l.joint,
                               set_->percent * l.joint,
                               l.reckoned,
                               l.switched,
                               l.k - l.scale,
                               l.mu - l.mounting};
        v[k] = out[j];
      }
      m[j] = gather<S>(v);
    }
  }

 private:
  struct Lane {
    std::unique_ptr<SegmentedNavigator> navigator;
    Vec<Body> right, forward;
    double mounting = 0, scale = 1, k = 1, mu = 0, switched = 0;
    double ins = 0, reckoned = 0, weighted = 0, joint = 0, most_pct = 0;
  };
  const DriveSetup* set_;
  Lane lanes_[kWide<S>];
};

}  // namespace loxo
