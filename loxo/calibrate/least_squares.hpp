// SPDX-License-Identifier: Apache-2.0
// Scale, angle and further states from many benchmarks by least squares, and the accuracy that a
// drive not yet driven will reach by it. vehicle.md section 5.
#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "loxo/calibrate/replay.hpp"

namespace loxo {

// Gauss-Newton with the full covariance of the residuals (V-43). `rows`: steps before each
// benchmark. Covariance: that of the benchmarks, the start and the declared sensor errors, never
// scaled by chi2/dof. A state that is estimated has no prior: the start's std is not used beside
// the start offset, nor the declared drift beside the heading drift. Not valid, with the reason in
// words (5.3): zero chords, too few benchmarks, a state that they cannot tell.
Calibration calibrate_least_squares(const RecordedTrack& track, const Benchmark& start,
                                    const std::vector<Benchmark>& benchmarks,
                                    const std::vector<std::size_t>& rows,
                                    const TrackErrorModel& errors,
                                    const std::vector<State>& estimate);

// What makes a calibration uncertain, one by one.
enum class ErrorSource {
  kBenchmarks,
  kStart,
  kHeadingBias,
  kHeadingDrift,
  kHeadingNoise,
  kSideSlip,
  kScaleNoise,
  kQuantisation
};
inline constexpr std::size_t kErrorSources = 8;
std::string_view source_name(ErrorSource s);   // "heading_drift" …
std::string_view source_words(ErrorSource s);  // "heading drift" …

// What least squares would state for a track that is driven as `track` says (true, nothing to
// correct), and each source's part of it: parts sum up to the whole.
struct ExpectedAccuracy {
  std::vector<State> states;
  std::vector<double> covariance;                          // row-major, of `states`
  std::vector<std::array<double, kErrorSources>> sources;  // variance of each state by source
  std::vector<std::string> unobservable;                   // in words; then no covariance
  double std(std::size_t state) const;
};
ExpectedAccuracy expected_accuracy(const RecordedTrack& track, const Benchmark& start,
                                   const std::vector<Benchmark>& benchmarks,
                                   const std::vector<std::size_t>& rows,
                                   const TrackErrorModel& errors,
                                   const std::vector<State>& estimate);

}  // namespace loxo
