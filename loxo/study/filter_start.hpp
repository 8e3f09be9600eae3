// SPDX-License-Identifier: Apache-2.0
// How a drive enters the filters: its alignment and the covariance it leaves.
#pragma once
#include "loxo/study/drive_measurements.hpp"
#include "loxo/study/standing_start.hpp"

namespace loxo {

struct FilterStart {
  NavigatorStart start;
  AlignmentReport report;
  StandingStart rest;
};
// Throws Error(kWork) where the alignment cannot be had, with the reason and what would help;
// Error(kInput) for no position.
FilterStart filter_start(const Drive& drive, const FilterOptions& options,
                         const NavigatorConfig& config, const DriveMeasurements& m,
                         double first_imu_t, Diagnostics& diagnostics);

}  // namespace loxo
