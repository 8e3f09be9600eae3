// SPDX-License-Identifier: Apache-2.0
// The streams of a trial's random numbers: one a source, so that one sensor's settings do not
// change another's noise. Drives on disk are trial 0.
#pragma once
#include <cstdint>

namespace loxo {

// The numbers are part of the promise that a seed gives the same drive: add at the end.
namespace noise_source {
enum : std::uint64_t {
  kImu,           // white noise of a sample
  kImuSlow,       // walks and Markov processes, once a second or so
  kImuConstants,  // biases, scales, axes
  kOdometer,      // of a reading
  kOdometerConstants,
  kAttitude,
  kFix,
  kFixSlow,
  kHeight,
  kHeading,
  kVelocity,
  kBenchmark,
  kVibration,  // phases
  kSea,        // phases of waves
  kStart,      // errors of the stated start
  kRoad,       // a road drawn at random
};
}  // namespace noise_source

}  // namespace loxo
