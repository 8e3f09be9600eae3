// SPDX-License-Identifier: Apache-2.0
// The settings of the filters that a drive's own description leads to.
#pragma once
#include "loxo/study/drive_measurements.hpp"

namespace loxo {

// The settings that a drive's own description leads to; interval: of the IMU, s; mean_speed: of a
// speed odometer's readings in motion, m/s. Told to `meta`.
NavigatorConfig settings_of(const Drive& drive, const FilterOptions& options, double imu_interval,
                            double odometer_interval, bool odometer_is_speed, double mean_speed,
                            std::map<std::string, std::string>& meta);

// Distance readings that scatter by more than twice what is declared of them: what they show is
// taken, and told. scatter: m, white, of a reading (0: not seen); way: of a reading, m.
void take_scatter(double scatter, double way, NavigatorConfig& config,
                  std::map<std::string, std::string>& meta, Diagnostics& diagnostics);

}  // namespace loxo
