// SPDX-License-Identifier: Apache-2.0
// How a drive enters the filters: its measurements in time order, the settings that its own
// description leads to, the standing start and the alignment. Shared by filter_drive and
// segmented_drive.
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
};
// Throws Error(kInput) for a negative or zero declared sigma.
DriveMeasurements read_measurements(const Drive& drive, const FilterOptions& options,
                                    Diagnostics& diagnostics);
bool wanted(const FilterOptions& options, const char* witness);
double median(std::vector<double> v);

// A standing start: means of the IMU and their scatter over windows of a second.
struct StandingStart {
  double begin = 0, end = 0;  // s
  long samples = 0;
  Vec<Body> mean_w, mean_f;         // rad/s, m/s^2
  double sigma_w = 0, sigma_f = 0;  // of one sample
  double sway[3]{};                 // sd of the 1 s means of the rate, rad/s
  double sway_angle = 0;            // rms of the integrated, detrended rate, rad
};
// From t0 for at most `duration`; ends before the first three seconds in a row that are clearly not
// at rest; without jolts_end only a turn ends it (`stop` says when it moves off). A second is
// disturbed (a door, a passenger) where it scatters more than six times the median second; such
// seconds count for the mean attitude but not for the noise.
StandingStart standing_start(const Drive& drive, double t0, double duration, double stop,
                             Diagnostics& diagnostics, bool jolts_end = true);

// A wrong unit or an IMU mounted across or backward, seen from how the odometer's speed changes
// with the IMU's own acceleration over two seconds; told, and taken into the settings as a start
// value.
void coarse_check(const Drive& drive, const DriveMeasurements& m, const FilterOptions& options,
                  double first_t, NavigatorConfig& config, std::map<std::string, std::string>& meta,
                  Diagnostics& diagnostics);

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
