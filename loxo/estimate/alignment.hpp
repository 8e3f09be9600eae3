// SPDX-License-Identifier: Apache-2.0
// Fine alignment: the joint filter over a standstill, told that the base stays at its place.
// estimation.md 4.3
#pragma once
#include "loxo/estimate/navigator.hpp"

namespace loxo {

struct FineAlignmentConfig {
  NavigatorConfig sensors;   // noise and biases; witnesses other than standing still are not used
  double place_std = 0.05;   // m: the base moves about its place by this
  double place_epoch = 1.0;  // s between looks at the place: longer than its motion remembers
  bool quiet = false;        // the base does not turn: its rate is the Earth's (ZARU)
};

// Level, heading, gyro and accelerometer biases with their covariance. It cannot beat [EST-14] in
// heading: the east gyro bias and the heading are one unknown on a fixed heading, and its value is
// the correlation that it keeps, so that the first turn frees both.
class FineAlignment {
 public:
  // coarse: where it starts from, P on ECEF axes (start_covariance). Its place and the sigma of
  // it are given back unchanged.
  FineAlignment(const FineAlignmentConfig& config, const NavigatorStart& coarse);
  void add(const ImuIncrement<double>& sample);
  double duration() const { return navigator_.t() - start_.state.t; }  // s
  NavigatorStart result() const;

 private:
  FineAlignmentConfig config_;
  NavigatorStart start_;
  Navigator navigator_;
  Fix place_;
  double next_ = 0;
};

}  // namespace loxo
