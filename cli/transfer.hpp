// SPDX-License-Identifier: Apache-2.0
// `loxo transfer`: options shared by the drive, its budget, its plan and the table of rates.
#pragma once
#include <string>
#include <vector>

#include "cli/command.hpp"
#include "loxo/earth/ellipsoid.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/sim/transfer_budget.hpp"

namespace loxo::cli {

struct TransferOptions {
  std::string drive;
  std::string angle;                // --angle 58.96deg
  std::string meridian;             // --meridian 122.9deg
  std::string earth = "ellipsoid";  // ellipsoid | sphere
  std::string keep;                 // path | velocity
  std::string ellipsoid = "WGS84";  // rates only: a drive names its own
  std::string table = "-";          // rates: FILE
  // The reference's errors (1 sigma) and the unit's; those of the drive where it declares them.
  std::string heading_error = "3arcmin", level_error = "1arcmin", velocity_error = "0.1m/s";
  std::string gyro_bias, accel_bias;
  std::string share = "0.1";         // of the unit's own errors
  bool binary = false;               // the IMU and the reference as .h5
  bool trim = false;                 // leave out what the reference does not cover
  unsigned draws = 200;              // budget: Monte Carlo beside the formula
  std::vector<std::string> windows;  // test: lengths of the free-inertial windows
  std::string latitude;              // plan: one home latitude instead of a table
};

int transfer_rates(const Globals& globals, const TransferOptions& options);   // transfer_rates.cpp
int transfer_drive(const Globals& globals, const TransferOptions& options);   // transfer_drive.cpp
int transfer_budget(const Globals& globals, const TransferOptions& options);  // transfer_budget.cpp
int transfer_trial(const Globals& globals, const TransferOptions& options);   // transfer_trial.cpp
int transfer_plan(const Globals& globals, const TransferOptions& options);    // transfer_plan.cpp
// The move that --angle, --meridian, --earth and --keep ask for. Throws Error(kUsage).
PolarMove polar_move(const Drive& drive, const TransferOptions& options);  // transfer_drive.cpp
ReferenceSigma reference_sigma(const TransferOptions& options);            // transfer_plan.cpp

}  // namespace loxo::cli
