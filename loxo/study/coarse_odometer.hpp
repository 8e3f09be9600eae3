// SPDX-License-Identifier: Apache-2.0
// What the inertial unit's own acceleration says of the odometer, before any filter runs.
#pragma once
#include "loxo/study/drive_measurements.hpp"

namespace loxo {

// A wrong unit or an IMU mounted across or backward, seen from how the odometer's speed changes
// with the IMU's own acceleration over two seconds; told, and taken into the settings as a start
// value.
void coarse_check(const Drive& drive, const DriveMeasurements& m, const FilterOptions& options,
                  double first_t, NavigatorConfig& config, std::map<std::string, std::string>& meta,
                  Diagnostics& diagnostics);

}  // namespace loxo
