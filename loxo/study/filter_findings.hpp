// SPDX-License-Identifier: Apache-2.0
// What a run of the joint filter found wrong with its input, in words: nothing is left out or
// repaired in silence.
#pragma once
#include "loxo/study/drive_measurements.hpp"

namespace loxo {

struct RunFacts {
  double begin = 0, end = 0;  // s, of the filter
  double first_t = 0;         // s, where the IMU begins
  double travelled = 0;       // m
  bool gave_up = false;       // diverged before the drive's end
};
void tell_findings(const Drive& drive, const DriveMeasurements& m, const NavigatorConfig& config,
                   const FilterResult& result, const RunFacts& run, Diagnostics& diagnostics);

// Throws Error(kInput) where the fixes are far from the start and would be near it with latitude
// and longitude exchanged.
void refuse_swapped_fixes(const Drive& drive, const std::vector<Fix>& fixes);

}  // namespace loxo
