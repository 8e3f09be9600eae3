// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/moved_track.hpp"

#include <algorithm>
#include <cmath>

#include "loxo/num/units.hpp"

namespace loxo {

void MovedTrack::add(double t, const TransverseState<double>& home,
                     const TransverseState<double>& moved) {
  // The last epoch is always kept: it replaces one that stood too near to its forerunner.
  if (nodes_.size() > 1 && t - nodes_[nodes_.size() - 2].t < spacing_) nodes_.pop_back();
  nodes_.push_back({t, home.tlat, home.tlon, moved.tlat - home.tlat,
                    moved.tlon - (home.tlon - move_.angle), home.h, to_quaternion(home.C_tb)});
}

bool MovedTrack::covers(double t) const {
  return !nodes_.empty() && t >= nodes_.front().t && t <= nodes_.back().t;
}

MovedTrack::Node MovedTrack::at(double t) const {
  const auto after = std::lower_bound(nodes_.begin(), nodes_.end(), t,
                                      [](const Node& a, double x) { return a.t < x; });
  if (after == nodes_.begin()) return nodes_.front();
  if (after == nodes_.end()) return nodes_.back();
  const Node &b = *after, &a = *(after - 1);
  const double u = (t - a.t) / (b.t - a.t);
  const auto mix = [u](double x, double y) { return x + u * (y - x); };
  const double sign =
      a.q.w * b.q.w + a.q.x * b.q.x + a.q.y * b.q.y + a.q.z * b.q.z < 0 ? -1.0 : 1.0;
  return {t,
          mix(a.tlat, b.tlat),
          a.tlon + u * wrap_pi(b.tlon - a.tlon),
          mix(a.dp, b.dp),
          mix(a.dl, b.dl),
          mix(a.h, b.h),
          normalized(
              Quat<Transverse, Body, double>{mix(a.q.w, sign * b.q.w), mix(a.q.x, sign * b.q.x),
                                             mix(a.q.y, sign * b.q.y), mix(a.q.z, sign * b.q.z)})};
}

Vec<Transverse, double> MovedTrack::rescaled(const Node& n,
                                             const Vec<Transverse, double>& v) const {
  if (move_.keep == Keep::kVelocity) return v;
  TransverseState<double> s;
  s.tlat = n.tlat, s.tlon = n.tlon, s.h = n.h, s.v = v;
  return move_state(move_, s).v;
}

Geodetic<double> MovedTrack::home_point(double t) const {
  const Node n = at(t);
  auto g = from_transverse(n.tlat, n.tlon, move_.lon0);
  g.h = n.h;
  return g;
}

Geodetic<double> MovedTrack::point(double t, const Geodetic<double>& home) const {
  const Node n = at(t);
  const auto here = to_transverse(home.lat, home.lon, move_.lon0);
  auto g = from_transverse(here.tlat + n.dp, here.tlon - move_.angle + n.dl, move_.lon0);
  g.h = home.h;
  return g;
}

Vec<Geographic, double> MovedTrack::turned(const Node& n, const Geodetic<double>& home,
                                           const Vec<Geographic, double>& v, bool rescale) const {
  const auto here = to_transverse(home.lat, home.lon, move_.lon0);
  const double p = here.tlat + n.dp, l = here.tlon - move_.angle + n.dl;
  const auto moved = from_transverse(p, l, move_.lon0);
  const Vec<Transverse, double> at_home =
      transverse_axes<double>(here.tlat, here.tlon, move_.lon0) *
      (transpose(geographic_axes(home.lat, home.lon)) * v);
  return geographic_axes(moved.lat, moved.lon) *
         (transpose(transverse_axes<double>(p, l, move_.lon0)) *
          (rescale ? rescaled(n, at_home) : at_home));
}

Vec<Geographic, double> MovedTrack::velocity(double t, const Geodetic<double>& home,
                                             const Vec<Geographic, double>& v) const {
  return turned(at(t), home, v, true);
}

Vec<Body, double> MovedTrack::velocity(double t, const Vec<Body, double>& v) const {
  const Node n = at(t);
  const auto C_tb = to_matrix(n.q);
  return transpose(C_tb) * rescaled(n, C_tb * v);
}

double MovedTrack::heading(double t, double heading) const {
  const Vec<Geographic, double> d =
      turned(at(t), home_point(t), {sin(heading), cos(heading), 0.0}, false);
  const double h = atan2(d.x, d.y);
  return h < 0 ? h + 2 * kPi : h;
}

double MovedTrack::distance_factor(double t, double heading) const {
  return norm(turned(at(t), home_point(t), {sin(heading), cos(heading), 0.0}, true));
}

double MovedTrack::forward_factor(double t) const {
  const Node n = at(t);
  return norm(rescaled(n, to_matrix(n.q) * Vec<Body, double>{0.0, 1.0, 0.0}));
}

EcefPose<double> MovedTrack::pose(double t, const EcefPose<double>& home) const {
  const Node n = at(t);
  TransverseState<double> s = to_transverse_state(move_.earth, move_.lon0, home);
  s.v = rescaled({n.t, s.tlat, s.tlon, n.dp, n.dl, s.h, n.q}, s.v);
  s.tlat += n.dp;
  s.tlon += n.dl - move_.angle;
  return to_ecef_pose(move_.earth, move_.lon0, s);
}

}  // namespace loxo
