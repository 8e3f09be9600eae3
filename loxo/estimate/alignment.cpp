// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/alignment.hpp"

#include "loxo/earth/geodetic.hpp"

namespace loxo {
namespace {

NavigatorConfig standing(const FineAlignmentConfig& c) {
  NavigatorConfig n = c.sensors;
  n.use_odometer = n.use_nhc = n.use_zupt = false;
  n.use_zaru = c.quiet;
  n.vertical_std = 0;
  n.fix_std_min = 0;
  n.late_limit = 0;
  n.fix_lever_std = n.height_bias_std = n.heading_bias_std = n.gyro_misalignment = 0;
  for (double& l : n.fix_lever) l = 0;
  return n;
}

}  // namespace

FineAlignment::FineAlignment(const FineAlignmentConfig& config, const NavigatorStart& coarse)
    : config_(config), start_(coarse), navigator_(standing(config)) {
  // The place is what it is measured against: its own error is no error of this filter.
  NavigatorStart s = coarse;
  for (int i = kDr; i < kDr + 3; ++i)
    for (int j = 0; j < kStates; ++j) s.P.p[i][j] = s.P.p[j][i] = 0;
  for (int i = kDr; i < kDr + 3; ++i) s.P.p[i][i] = config.place_std * config.place_std;
  navigator_.start(s);
  const Geodetic<double> g = to_geodetic(config.sensors.ellipsoid, coarse.state.r);
  place_.lat = g.lat, place_.lon = g.lon, place_.h = g.h;
  place_.std_e = place_.std_n = place_.std_u = config.place_std;
  next_ = coarse.state.t + config.place_epoch;
}

void FineAlignment::add(const ImuIncrement<double>& sample) {
  if (sample.t >= next_) {
    place_.t = sample.t;
    navigator_.benchmark(place_);
    next_ += config_.place_epoch;
    if (next_ < sample.t) next_ = sample.t + config_.place_epoch;  // after a gap
  }
  navigator_.imu(sample);
}

NavigatorStart FineAlignment::result() const {
  NavigatorStart s{navigator_.state(), navigator_.covariance()};
  s.state.r = start_.state.r;
  for (int i = kDr; i < kDr + 3; ++i)
    for (int j = 0; j < kStates; ++j) s.P.p[i][j] = s.P.p[j][i] = 0;
  for (int i = kDr; i < kDr + 3; ++i)
    for (int j = kDr; j < kDr + 3; ++j) s.P.p[i][j] = start_.P.p[i][j];
  return s;
}

}  // namespace loxo
