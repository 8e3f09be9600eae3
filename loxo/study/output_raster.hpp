// SPDX-License-Identifier: Apache-2.0
// When rows are written: on whole multiples of the output period, each to the last digit (a sum of
// periods is not: 300 s of tenths end at 299.9999999999997).
#pragma once
#include <cmath>

namespace loxo {

class OutputRaster {
 public:
  // The first row after t, s; period 0: none.
  OutputRaster(double period, double t)
      : rate_(period > 0 ? 1.0 / period : 0),
        next_(period > 0 ? std::floor(t * rate_ + 1e-6) + 1 : 0) {}
  bool on() const { return rate_ > 0; }
  double at() const { return next_ / rate_; }
  void advance() { next_ += 1; }

 private:
  double rate_, next_;
};

}  // namespace loxo
