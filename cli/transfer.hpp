// SPDX-License-Identifier: Apache-2.0
// `loxo transfer`: options shared by the drive, its budget, its plan and the table of rates.
#pragma once
#include <string>

#include "cli/command.hpp"
#include "loxo/earth/ellipsoid.hpp"

namespace loxo::cli {

struct TransferOptions {
  std::string drive;
  std::string angle;                // --angle 58.96deg
  std::string meridian;             // --meridian 122.9deg
  std::string earth = "ellipsoid";  // ellipsoid | sphere
  std::string keep;                 // path | velocity
  std::string ellipsoid = "WGS84";  // rates only: a drive names its own
  std::string table = "-";          // rates: FILE
};

int transfer_rates(const Globals& globals, const TransferOptions& options);  // transfer_rates.cpp

}  // namespace loxo::cli
