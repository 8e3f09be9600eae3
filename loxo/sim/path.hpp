// SPDX-License-Identifier: Apache-2.0
// A way over the ground through given points, and when the vehicle is where on it: both quintic
// B-splines, so that curvature, its change and the jerk are continuous and truth is an explicit
// function of time. The points are normals of the ellipsoid: a pole or 180 deg is a place like any
// other.
#pragma once
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/earth/frames.hpp"
#include "loxo/ins/samples.hpp"
#include "loxo/num/geometry.hpp"

namespace loxo {

struct PathPoint {
  double lat = 0, lon = 0, h = 0;  // rad, m
  double t = kNone;                // s, or not known
};

// How fast a way is driven where the points have no times.
struct PathSpeed {
  double speed = 15;        // m/s
  double acceleration = 1;  // m/s^2, gaining and losing it
  double lateral = 2;       // m/s^2 in curves
  bool from_rest = true, to_rest = true;
};

class Path {
 public:
  // `spacing` [m]: distance of the control points. A corner is rounded over about three of them; a
  // turn by a [rad] has a smallest radius of spacing / (0.55 a). Throws Error(kInput), at `where`,
  // for fewer than two places, times that do not rise, or a curve tighter than `tightest` [m]
  // (the way turns back on itself), naming the point.
  Path(const Ellipsoid& ell, const std::vector<PathPoint>& points, double spacing, double tightest,
       const PathSpeed& speed, const std::string& where);

  double duration() const { return duration_; }
  double length() const { return length_; }  // m, along the points

  // Where the vehicle is at t, with the derivatives that truth needs.
  struct Place {
    Vec<Ecef> n, n1, n2;           // normal; its derivatives by the parameter q
    double h = 0, h1 = 0, h2 = 0;  // m
    double q1 = 0, q2 = 0;         // dq/dt, d2q/dt2
  };
  Place at(double t) const;

 private:
  Place geometry(double q) const;
  double metres_per_q(const Ellipsoid& ell, const Place& p) const;

  std::vector<Vec<Ecef>> normal_;  // control points, two before the first and three after the last
  std::vector<double> height_, progress_;
  double tick_ = 1, duration_ = 0, length_ = 0;
};

}  // namespace loxo
