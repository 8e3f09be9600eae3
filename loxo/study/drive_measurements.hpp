// SPDX-License-Identifier: Apache-2.0
// The measurements of a drive beside its inertial unit, as the filters take them.
#pragma once
#include "loxo/study/filter_drive.hpp"

namespace loxo {

// All measurements but the IMU, in time order of validity.
struct DriveMeasurements {
  std::vector<OdometerTick> ticks;
  std::vector<Fix> fixes, benchmarks;
  std::vector<Fix> all_fixes;  // before outages and thinning: the start position may come from one
  std::vector<HeadingSample> headings;
  std::vector<HeightSample> heights;
  std::vector<VelocitySample> velocities;
  double tick_interval = kNone;
  bool sparse_fixes = false, fixes_wanted = false;
  bool unsigned_wheel = false;
  double mean_speed = 0;  // m/s, of the speed readings in motion
  double mean_way = 0;    // m/s, of all distance readings
  double scatter = 0;     // m, white noise of a distance reading as the readings show it; 0: unseen
};
// Throws Error(kInput) for a negative or zero declared sigma.
DriveMeasurements read_measurements(const Drive& drive, const FilterOptions& options,
                                    Diagnostics& diagnostics);
bool wanted(const FilterOptions& options, const char* witness);
double median(std::vector<double> v);

}  // namespace loxo
