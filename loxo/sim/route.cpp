// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/route.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/geodetic.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// The numbers of one source, in order.
class Draw {
 public:
  Draw(std::uint64_t seed, std::uint64_t trial, std::uint64_t source)
      : stream_{seed, trial, source} {}
  double uniform() { return stream_.uniform(count_++); }
  double normal() { return stream_.normal(count_++); }

 private:
  Stream<double> stream_;
  std::uint64_t count_ = 0;
};

enum Source : std::uint64_t { kConstants = 1, kWalk, kSlip, kScaleNoise, kPhase, kRoad, kSurvey };

// Heading change after the fraction x of a leg. Smooth: curvature 1 - cos(2 pi x).
double turned(const RouteLeg& leg, double x) {
  return leg.turn * (leg.smooth ? x - std::sin(2.0 * kPi * x) / (2.0 * kPi) : x);
}

Route route_at(std::string name, const RouteStart& start, double heading) {
  Route r;
  r.name = std::move(name);
  r.lat = start.lat;
  r.lon = start.lon;
  r.h = start.h;
  r.heading = heading;
  return r;
}

// A walk along the legs that remembers where it is: heading and direction (+1 forward, -1 reverse)
// at any way s.
class Follower {
 public:
  explicit Follower(const Route& route) : route_(route), heading_(route.heading) {}
  double heading(double s) {
    seek(s);
    if (leg_ >= route_.legs.size()) return heading_;
    const auto& leg = route_.legs[leg_];
    return heading_ + turned(leg, (s - begin_) / std::fabs(leg.length));
  }
  double direction(double s) {
    seek(s);
    const auto& leg = route_.legs[std::min(leg_, route_.legs.size() - 1)];
    return leg.length < 0 ? -1.0 : 1.0;
  }
  // Way left until this leg ends.
  double left(double s) {
    seek(s);
    return leg_ >= route_.legs.size() ? 0.0 : begin_ + std::fabs(route_.legs[leg_].length) - s;
  }

 private:
  void seek(double s) {
    while (leg_ < route_.legs.size() && s >= begin_ + std::fabs(route_.legs[leg_].length)) {
      begin_ += std::fabs(route_.legs[leg_].length);
      heading_ += route_.legs[leg_].turn;
      ++leg_;
    }
  }
  const Route& route_;
  std::size_t leg_ = 0;
  double begin_ = 0, heading_ = 0;
};

// Way driven after time t: trapezoid from rest to rest, or constant speed.
double way_at(double t, double length, const TrackOptions& o) {
  if (o.acceleration <= 0) return std::min(length, o.speed * t);
  const double a = o.acceleration, peak = std::min(o.speed, std::sqrt(a * length));
  const double rise = peak / a, cruise = (length - peak * peak / a) / peak,
               end = 2.0 * rise + cruise;
  if (t <= rise) return 0.5 * a * t * t;
  if (t <= rise + cruise) return 0.5 * a * rise * rise + peak * (t - rise);
  if (t >= end) return length;
  return length - 0.5 * a * (end - t) * (end - t);
}
double duration(double length, const TrackOptions& o) {
  if (o.acceleration <= 0) return length / o.speed;
  const double a = o.acceleration, peak = std::min(o.speed, std::sqrt(a * length));
  return 2.0 * peak / a + (length - peak * peak / a) / peak;
}

}  // namespace

double route_length(const Route& route) {
  double sum = 0;
  for (const auto& leg : route.legs) sum += std::fabs(leg.length);
  return sum;
}

double route_heading(const Route& route, double s) { return Follower(route).heading(s); }

Route straight_route(const RouteStart& start, double heading, double length) {
  Route r = route_at("straight", start, heading);
  r.legs = {{length, 0, false}};
  return r;
}
Route arc_route(const RouteStart& start, double heading, double length, double turn) {
  Route r = route_at("arc", start, heading);
  r.legs = {{length, turn, false}};
  return r;
}
Route l_route(const RouteStart& start, double heading, double first, double second, double turn,
              double radius) {
  Route r = route_at("L", start, heading);
  r.legs = {{first, 0, false}, {std::fabs(turn) * radius, turn, false}, {second, 0, false}};
  return r;
}
Route s_route(const RouteStart& start, double heading, double length, double turn) {
  Route r = route_at("S", start, heading);
  r.legs = {{length / 2, turn, false}, {length / 2, -turn, false}};
  return r;
}
Route z_route(const RouteStart& start, double heading, double leg, double turn, double radius) {
  Route r = route_at("Z", start, heading);
  const double corner = std::fabs(turn) * radius;
  r.legs = {{leg, 0, false},
            {corner, turn, false},
            {leg, 0, false},
            {corner, -turn, false},
            {leg, 0, false}};
  return r;
}
Route semicircle_route(const RouteStart& start, double heading, double length, bool to_right) {
  Route r = route_at("semicircle", start, heading);
  r.legs = {{length, to_right ? kPi : -kPi, false}};
  return r;
}
Route closed_route(const RouteStart& start, double heading, double side, double radius,
                   bool to_right) {
  Route r = route_at("closed", start, heading);
  const double turn = to_right ? kPi / 2 : -kPi / 2, straight = side - 2 * radius;
  r.legs.push_back({straight / 2, 0, false});
  for (int i = 0; i < 4; ++i) {
    r.legs.push_back({kPi / 2 * radius, turn, false});
    r.legs.push_back({i < 3 ? straight : straight / 2, 0, false});
  }
  return r;
}

Route waypoint_route(const Ellipsoid& ell, const std::vector<LatLon<double>>& points,
                     double radius) {
  if (points.size() < 2)
    throw Error(ErrorKind::kInput, "a route needs at least two waypoints", "waypoints");
  std::vector<RhumbInverse<double>> lines;
  for (std::size_t i = 0; i + 1 < points.size(); ++i)
    lines.push_back(
        rhumb_inverse(ell, points[i].lat, points[i].lon, points[i + 1].lat, points[i + 1].lon));
  Route r = route_at("waypoints", {points[0].lat, points[0].lon, 0}, lines[0].azimuth);
  // A smooth turn by `turn` in length l has its largest curvature 2 turn/l; its ends lie as far
  // from the corner as its shape in the plane says (both ends alike, by symmetry).
  auto turn_of = [&](std::size_t i) { return wrap_pi(lines[i + 1].azimuth - lines[i].azimuth); };
  auto corner_length = [&](double turn) { return 2.0 * radius * std::fabs(turn); };
  auto tangent = [&](double turn) {
    const double l = corner_length(turn);
    if (l == 0) return 0.0;
    const RouteLeg leg{l, turn, true};
    const int n = 64;
    double x = 0, y = 0;
    for (int k = 0; k < n; ++k) {
      const double a = turned(leg, (k + 0.5) / n);
      x += l / n * std::cos(a);
      y += l / n * std::sin(a);
    }
    return x - y / std::tan(turn);
  };
  double used = 0;  // way already taken from this line by the last corner
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double turn = i + 1 < lines.size() ? turn_of(i) : 0.0;
    const double next = tangent(turn);
    const double straight = lines[i].distance - used - next;
    if (straight < 0)
      throw Error(
          ErrorKind::kInput,
          fmt::format("leg {} is {:.0f} m long, too short for its corners of radius {:.0f} m",
                      i + 1, lines[i].distance, radius),
          "waypoints");
    r.legs.push_back({straight, 0, false});
    if (turn != 0) r.legs.push_back({corner_length(turn), turn, true});
    used = next;
  }
  return r;
}

Route random_road(const RouteStart& start, double length, std::uint64_t seed, std::uint64_t trial) {
  Draw draw(seed, trial, kRoad);
  Route r = route_at("random road", start, 2.0 * kPi * draw.uniform());
  double left = length;
  while (left > 0) {
    const double straight = std::min(left, 100.0 + 900.0 * draw.uniform());
    r.legs.push_back({straight, 0, false});
    left -= straight;
    if (left <= 0) break;
    const double turn = (2.0 * draw.uniform() - 1.0) * 100.0 * deg;
    const double radius = 20.0 + 180.0 * draw.uniform();
    const double corner = std::min(left, 2.0 * radius * std::fabs(turn));
    r.legs.push_back({corner, turn * corner / (2.0 * radius * std::fabs(turn)), true});
    left -= corner;
  }
  return r;
}

SimulatedTrack simulate_track(const Ellipsoid& ell, const Route& route, const TrackOptions& o) {
  if (route.legs.empty())
    throw Error(ErrorKind::kInput, "a route needs at least one leg", route.name);
  if (!(o.interval > 0) || !(o.speed > 0))
    throw Error(ErrorKind::kInput, "speed and interval must be positive", route.name);
  const auto& e = o.errors;
  Draw constants(o.seed, o.trial, kConstants), walk(o.seed, o.trial, kWalk),
      slip(o.seed, o.trial, kSlip);
  Draw scale_noise(o.seed, o.trial, kScaleNoise), phase(o.seed, o.trial, kPhase);
  const double bias = e.heading_bias * constants.normal();
  const double drift = e.heading_drift * constants.normal() + e.fixed_heading_drift;
  const double q = e.quantisation, phase0 = phase.uniform();

  const double length = route_length(route), total = duration(length, o);
  const bool north = route.lat >= 0;
  const bool by_grid = o.reference == HeadingReference::kGrid;
  const double sign = north ? 1.0 : -1.0;
  if (route.reference == HeadingReference::kGrid && !by_grid)
    throw Error(ErrorKind::kInput, "a route in grid headings is recorded with grid headings",
                route.name);

  SimulatedTrack track;
  const auto count = static_cast<std::size_t>(std::ceil(total / o.interval - 1e-9));
  track.steps.reserve(count);
  track.truth.reserve(count + 1);
  ReckonState<double> state = reckon_start(route.lat, route.lon);
  GridState<double> grid = grid_start(route.lat, route.lon);
  MechanisedState<double> mech = mechanised_start(route.lat, route.lon);
  double height = route.h;
  Follower follower(route), inner(route);
  double lat = route.lat, lon = route.lon;
  auto true_heading = [&](double psi) {
    return wrap_2pi(route.reference == HeadingReference::kGrid ? psi + sign * lon : psi);
  };
  track.truth.push_back({o.t0, lat, lon, height, true_heading(route.heading)});
  double s0 = 0, indicated = 0, counted = std::floor(phase0), walked = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double t1 = std::min(total, static_cast<double>(i + 1) * o.interval);
    const double dt = t1 - static_cast<double>(i) * o.interval;
    const double s1 = i + 1 == count ? length : way_at(t1, length, o);
    const double direction = follower.direction(0.5 * (s0 + s1));
    const double psi_begin = o.exact_steps ? 0.0 : inner.heading(s0);
    double psi = follower.heading(0.5 * (s0 + s1));
    const double ds = direction * (s1 - s0);
    // The slope at mid-step; truth climbs in straight steps, as the record says.
    const double slope =
        route.hill_height == 0
            ? 0.0
            : std::asin(std::clamp(2.0 * kPi * route.hill_height / route.hill_length *
                                       std::cos(kPi * (s0 + s1) / route.hill_length),
                                   -0.9, 0.9)) *
                  direction;
    const double level = std::cos(slope), climb = ds * std::sin(slope);
    const double h_mid = height + 0.5 * climb;

    // What the set says.
    double indicated_ds =
        e.k * ds * (1.0 + (e.scale_noise > 0 ? e.scale_noise * scale_noise.normal() : 0.0));
    if (q > 0) {
      indicated += indicated_ds;
      const double count1 = std::floor(indicated / q + phase0);
      indicated_ds = q * (count1 - counted);
      counted = count1;
    }
    double noise = bias + drift * (t1 - 0.5 * dt);
    if (e.heading_noise > 0) {
      const double half = e.heading_noise * std::sqrt(0.5 * dt);
      walked += half * walk.normal();
      noise += walked;
      walked += half * walk.normal();
    }
    if (e.side_slip > 0) noise += e.side_slip * slip.normal();

    // Truth, then the heading recorded on it.
    double psi_rec;
    if (by_grid) {
      // Grid heading is held over the step; on a route in true headings it is taken at mid-step.
      const double mid_lon =
          lon + (route.reference == HeadingReference::kGrid
                     ? 0.0
                     : 0.5 * ds * level * std::sin(psi) * isometric_rate(ell, lat));
      const double g = route.reference == HeadingReference::kGrid ? psi : psi - sign * mid_lon;
      step_grid(ell, north, grid, ds * level, g, h_mid);
      double raw;
      latlon_of_normal(grid.n, lat, raw);
      lon += wrap_pi(raw - lon);
      psi_rec = g + e.eps + noise;
    } else if (o.model == HeadingModel::kMechanised) {
      const double k_step = ds != 0 ? indicated_ds / ds : e.k;
      psi_rec = record_mechanised(ell, mech, ds * level, psi, k_step, e.eps + noise, h_mid,
                                  o.earth_rate ? dt : 0.0);
      lat = mech.truth.lat;
      lon = mech.truth.lon;
    } else {
      if (o.exact_steps) {
        step_exact(ell, state, ds * level * std::cos(psi), ds * level * std::sin(psi), h_mid);
      } else {
        // The curve inside the step: chords of eight parts, each with its own mid heading.
        const int parts = 8;
        double before = psi_begin;
        for (int k = 0; k < parts; ++k) {
          const double a = s0 + (s1 - s0) * k / parts, b = s0 + (s1 - s0) * (k + 1) / parts;
          const double mid = inner.heading(0.5 * (a + b)), after = inner.heading(b);
          const double half = 0.5 * (after - before);
          const double shrink = std::fabs(half) < 1e-9 ? 1.0 : std::sin(half) / half;
          const double part = ds * level / parts * shrink;
          step_exact(ell, state, part * std::cos(mid), part * std::sin(mid), h_mid);
          before = after;
        }
      }
      lat = state.lat;
      lon = state.lon;
      psi_rec = psi + e.eps + noise;
    }
    height += climb;
    TrackStep step;
    step.t = o.t0 + t1;
    step.ds = indicated_ds;
    step.heading = wrap_2pi(psi_rec);
    step.pitch = slope + e.pitch_mounting;
    step.h = h_mid;
    step.row = static_cast<std::uint32_t>(i + 1);
    track.steps.push_back(step);
    track.truth.push_back({step.t, lat, lon, height, true_heading(follower.heading(s1))});
    s0 = s1;
  }
  return track;
}

Benchmark survey(const Ellipsoid& ell, const SimulatedTrack& track, std::size_t row, double std,
                 std::uint64_t seed, std::uint64_t trial, double right, double forward) {
  if (row >= track.truth.size())
    throw Error(ErrorKind::kInput, "the track has fewer rows than the benchmark's", "survey");
  Draw draw(seed, trial, kSurvey + (static_cast<std::uint64_t>(row) << 8));
  const auto& p = track.truth[row];
  const double s = std::sin(p.heading), c = std::cos(p.heading);
  const double north = forward * c - right * s + std * draw.normal();
  const double east = forward * s + right * c + std * draw.normal();
  Benchmark b;
  b.t = p.t;
  b.row = static_cast<std::ptrdiff_t>(row);
  const double sl = std::sin(p.lat);
  b.lat = p.lat + north / (meridian_radius(ell, sl) + p.h);
  b.lon = wrap_pi(p.lon + east / ((prime_vertical_radius(ell, sl) + p.h) * std::cos(p.lat)));
  b.h = p.h + std * draw.normal();
  b.std = std;
  b.std_h = std;
  return b;
}

}  // namespace loxo
