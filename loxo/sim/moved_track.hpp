// SPDX-License-Identifier: Apache-2.0
// Where the moved voyage is at any time, and how what was measured along the way is moved with it:
// points, velocities, directions and distances of slow sensors (polar.md 7.2).
#pragma once
#include <vector>

#include "loxo/sim/polar_transfer.hpp"

namespace loxo {

class MovedTrack {
 public:
  // `spacing` [s]: epochs nearer than this to the last one kept are dropped. Between two, the
  // places are interpolated in the transverse frame: 1 s at 30 m/s is 3e-5 m of the turn's
  // curvature, which no slow sensor sees.
  explicit MovedTrack(const PolarMove& move, double spacing = 1.0)
      : move_(move), spacing_(spacing) {}
  // In time order: the voyage at home and where it came to.
  void add(double t, const TransverseState<double>& home, const TransverseState<double>& moved);

  bool empty() const { return nodes_.empty(); }
  bool covers(double t) const;
  // All need covers() or take the nearest end. rad, m, m/s; home's values in, the moved ones out.
  Geodetic<double> home_point(double t) const;
  Geodetic<double> point(double t, const Geodetic<double>& home) const;
  // A level velocity (east, north, up at `home`), in the axes of the moved point.
  Vec<Geographic, double> velocity(double t, const Geodetic<double>& home,
                                   const Vec<Geographic, double>& v) const;
  // The same in body axes; the attitude is the reference's.
  Vec<Body, double> velocity(double t, const Vec<Body, double>& v) const;
  // A true heading at the track's own place: clockwise, [0, 2 pi).
  double heading(double t, double heading) const;
  // By which a wheel's distance along the true course `heading` grows.
  double distance_factor(double t, double heading) const;
  double forward_factor(double t) const;  // the same along the vehicle's own forward axis
  // A whole state in ECEF.
  EcefPose<double> pose(double t, const EcefPose<double>& home) const;

 private:
  struct Node {
    double t, tlat, tlon, dp, dl, h;  // dp, dl: moved minus (tlat, tlon - angle)
    Quat<Transverse, Body, double> q;
  };
  Node at(double t) const;
  Vec<Transverse, double> rescaled(const Node& n, const Vec<Transverse, double>& v) const;
  Vec<Geographic, double> turned(const Node& n, const Geodetic<double>& home,
                                 const Vec<Geographic, double>& v, bool rescale) const;

  PolarMove move_;
  double spacing_;
  std::vector<Node> nodes_;
};

}  // namespace loxo
