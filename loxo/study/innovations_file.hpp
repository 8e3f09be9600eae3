// SPDX-License-Identifier: Apache-2.0
// What a filter's innovations say of its stated noise: written by `loxo navigate --innovations`,
// judged by `loxo evaluate --innovations`. estimation.md section 7.
#pragma once
#include <string>
#include <vector>

#include "loxo/estimate/navigator.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/diagnostics.hpp"

namespace loxo {

// Of the normalised innovations of one sensor; its components (three of a fix) are told apart.
struct SensorConsistency {
  std::string sensor;
  long count = 0, deweighted = 0, rejected = 0;  // count: all of them
  double nis_mean = 0;                           // expected: 1
  double nis_low = 0, nis_high = 0;              // 95 % of the mean of so many white ones
  double nis_above_95 = 0;                       // share above chi2_1(0.95), expected: 0.05
  double lag_one = 0;     // autocorrelation of successive innovations of a component
  bool coloured = false;  // |lag_one| >= 2/sqrt(count): not white, and then the band is too narrow
};

// t_s,sensor,innovation,std,verdict: one row each, in the order of use; in the sensor's SI unit,
// std with the stated (unweighted) noise; verdict used, weighted or rejected. Appears whole or not
// at all.
class InnovationWriter : public InnovationSink {
 public:
  explicit InnovationWriter(const std::string& path);
  void innovation(const Innovation& i) override;
  void commit() { file_.commit(); }
  long rows() const { return rows_; }

 private:
  OutputFile file_;
  std::string line_;
  long rows_ = 0;
};

// Such a file (within [from, to], NaN: open), or the JSON result of `loxo navigate --json` (whole).
// Sensors in the order of the file. Throws Error(kInput) for anything else.
std::vector<SensorConsistency> read_innovations(const std::string& path, double from, double to,
                                                Diagnostics& diagnostics);

}  // namespace loxo
