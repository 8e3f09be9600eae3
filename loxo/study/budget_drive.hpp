// SPDX-License-Identifier: Apache-2.0
// The error budget of a scenario or of a recorded drive: covariance analysis along the motion that
// the scenario describes, or that the drive's own filter found.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "loxo/estimate/covariance.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/study/scenario.hpp"

namespace loxo {

enum class HeadingCount { kAuto, kTrue, kFree };
struct BudgetOptions {
  BudgetErrors errors;  // as declared, and what the user adds
  bool self_aligned = false;
  bool height_known = true;
  bool attitude_sensor = false;
  // True headings below 80 deg of latitude, none above, as navigation switches its frame.
  HeadingCount headings = HeadingCount::kAuto;
  double step = 0.1;                           // s
  double row_every = 10;                       // s
  Integrator integrator = Integrator::kExact;  // of the reckoning: its own error is a source
  std::function<void(double)> progress = {};   // share done
};
struct DriveBudget {
  std::string nominal;  // where the motion comes from, in words
  bool true_heading = true;
  std::vector<BudgetSource> sources;
  std::vector<double> t, distance;  // s from the start, m
  std::vector<BudgetRow> rows;
};

// What a scenario and a drive declare of their own sensors.
BudgetErrors declared_errors(const Scenario& scenario);
BudgetErrors declared_errors(const Drive& drive);

DriveBudget scenario_budget(const Scenario& scenario, const BudgetOptions& options);
// Motion by the joint filter where the drive has an IMU, else by dead reckoning. Throws
// Error(kInput) where the drive has neither, and what those throw.
DriveBudget drive_budget(const Drive& drive, const BudgetOptions& options,
                         Diagnostics& diagnostics);

}  // namespace loxo
