// SPDX-License-Identifier: Apache-2.0
// A Solution on disk (interface.md): CSV with "# key: value" lines above the header, or the binary
// .h5. Truth and reference files use the same columns; missing ones are allowed and read as NaN
// (heading without quaternion and so on is completed where it can be: position from lat/lon/h or
// x/y/z, attitude from Euler or quaternion).
#pragma once
#include <memory>
#include <string>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/ins/solution.hpp"
#include "loxo/text/diagnostics.hpp"

namespace loxo {

class SolutionWriter {
 public:
  // precision 0: numbers read back to the same double. Path "-" is standard output; ".h5" the
  // binary form.
  SolutionWriter(const std::string& path, const std::map<std::string, std::string>& meta,
                 int precision = 0);
  ~SolutionWriter();
  void write(const SolutionRow& row);
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// `columns` (as in [reference] of drive.toml) maps solution column names to those of the file; may
// be empty. Also takes t_s,lat_deg,lon_deg,h_m,ve,vn,vu,… and e_m,n_m (local metres, meta "local":
// "true").
Solution read_solution(const std::string& path, const Ellipsoid& ellipsoid,
                       Diagnostics& diagnostics,
                       const std::map<std::string, std::string>& columns = {});
// Completes a row: ECEF from geodetic or the reverse, Euler from quaternion or the reverse.
void complete_row(SolutionRow& row, const Ellipsoid& ellipsoid);

}  // namespace loxo
