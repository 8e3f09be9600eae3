// SPDX-License-Identifier: Apache-2.0
// A trial's calibration from surveyed ends: recorded in lanes, computed lane by lane in double, to
// the same bits. For the .cpp files of kinds only.
#pragma once
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
    double rows[kWide<S>][kCalibrationMetrics];
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
      calibrate_trial(trial, rows[k]);
    }
    gather_rows(rows, kCalibrationMetrics, m);
  }

 private:
  const DriveSetup* set_;
  S mounting_, scale_, heading_{0.0}, pitch_{0.0};
  Stream<S> survey_;
  std::vector<TrackStep> tracks_[kWide<S>];
};

}  // namespace loxo
