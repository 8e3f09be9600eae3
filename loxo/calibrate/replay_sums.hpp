// SPDX-License-Identifier: Apache-2.0
// Replay by quadrature instead of step by step (V-10): on true independent headings the meridian
// arc is a prefix sum, and the longitude the integral of w(m) along it. Blocks of rows in eight
// lanes, w(m) by interpolation over the block's arc.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"

namespace loxo {

// Sums at one row, of the increments corrected by scale and angle.
struct ReplaySum {
  double north = 0, east = 0;  // m
  double lon = 0;              // rad from the start of the sums
  // (V-40): of dn D, de w' n, de w' e, de w'.
  double dn_d = 0, slope_m = 0, slope_e = 0, slope = 0;
};

class ReplaySums {
 public:
  // Level increments as recorded [m], at ellipsoidal height 0; `rows`: where to report, ascending.
  ReplaySums(const std::vector<double>& north, const std::vector<double>& east,
             const std::vector<std::size_t>& rows);
  // From meridian arc m0 [m], with increments corrected as dn = c n + s e, de = c e - s n. Error of
  // the longitude: rounding, 1e-14 of the way for steps up to 1e-3 of the distance to the pole.
  // False where steps or blocks are too long beside that distance: go step by step then.
  // `largest`: of |m| met [m].
  bool run(const Ellipsoid& ell, double m0, double c, double s, bool sensitive,
           std::vector<ReplaySum>& out, double& largest) const;

 private:
  struct Block {
    std::size_t begin = 0, end = 0;  // of the padded arrays, multiples of eight
    double north = 0, east = 0;      // sums before it
    double reach = 0, step = 0;      // m: farthest from its begin, longest step
    bool stop = false;               // a row to report ends here
  };
  std::vector<Block> blocks_;
  std::vector<double> n_, e_, mid_n_, mid_e_;  // increments; sums up to mid-step within the block
  std::vector<double> stop_north_, stop_east_;
  std::vector<int> repeats_;  // how many of the asked rows end at each stop
};

}  // namespace loxo
