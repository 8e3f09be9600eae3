// SPDX-License-Identifier: Apache-2.0
// Where a scenario's vehicle goes: manoeuvres, waypoints, a recorded track, a road drawn at random,
// a sea. These numbers become trials: no libm but what is the same on every processor.
#include <filesystem>

#include "loxo/earth/geodesic.hpp"
#include "loxo/log/track_points.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/noise_sources.hpp"
#include "loxo/study/scenario.hpp"
#include "loxo/study/scenario_keys.hpp"

namespace loxo {
namespace {

using enum Dimension;
using namespace scenario_keys;

void read_start(const TomlTable& t, Trajectory& path) {
  const auto start = t.get_table("start");
  if (!start)
    refuse("missing; expected [start] with lat_deg and lon_deg, [[waypoint]] or [path]",
           t.where("start"));
  const double lat = start->need_number("lat_deg"), lon = start->need_number("lon_deg");
  if (!(fabs(lat) <= 90)) refuse("expected degrees in [-90, 90]", start->where("lat_deg"));
  if (!(fabs(lon) <= 360)) refuse("expected degrees in [-360, 360]", start->where("lon_deg"));
  path.start = {lat * deg, wrap_pi(lon * deg), start->get_number("h_m").value_or(0.0)};
  path.course = angle(*start, "course");
  path.speed = start->get_quantity("speed", kSpeed).value_or(0.0);
}

void read_legs(const TomlTable& t, Trajectory& path) {
  double speed = path.speed;
  const auto legs = t.get_tables("leg");
  if (legs.empty()) refuse("missing; expected one [[leg]] or more", t.where("leg"));
  const long long times = t.get_integer("repeat").value_or(1);
  if (times < 1 || times > 100000)
    refuse("expected how often the legs are gone through, 1 or more", t.where("repeat"));
  for (const auto& table : legs) {
    Leg leg;
    leg.duration = positive(table, "duration", kTime, -1.0);
    leg.speed = speed = table.get_quantity("speed", kSpeed).value_or(speed);
    leg.turn = angle(table, "turn");
    leg.straight = one_of(table, "path", {"straight", "course"}) == "straight";
    if (!(fabs(leg.speed) <= 1e4))
      refuse("expected a speed of at most 10 km/s, found " + std::to_string(leg.speed) + " m/s",
             table.where("speed"));
    if (!leg.straight && fabs(path.start.lat) > 89.9999 * deg)
      refuse("a true course does not exist at a pole; expected path = \"straight\"",
             table.where("path"));
    path.legs.push_back(leg);
  }
  const std::vector<Leg> once = path.legs;
  for (long long i = 1; i < times; ++i) path.legs.insert(path.legs.end(), once.begin(), once.end());
}

void read_waves(const TomlTable& t, Trajectory& path, std::uint64_t seed) {
  for (const auto& table : t.get_tables("wave")) {
    const std::vector<std::string> names = {"roll", "pitch", "yaw", "heave"};
    const std::string axis = one_of(table, "axis", names);
    Wave wave;
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == axis) wave.axis = static_cast<WaveAxis>(i);
    wave.amplitude =
        table.need_quantity("amplitude", wave.axis == WaveAxis::kHeave ? kLength : kAngle);
    wave.period = positive(table, "period", kTime, 10.0);
    wave.phase = angle(table, "phase");
    path.waves.push_back(wave);
  }
  const auto sea = t.get_table("sea");
  if (!sea) return;
  // Bretschneider's spectrum S ~ w^-5 exp(-1.25 (w_p/w)^4) in components of equal energy: their
  // frequencies are its quantiles, F(w) = exp(-1.25 (w_p/w)^4).
  const double peak = positive(*sea, "period", kTime, 8.0);
  const double rms[4] = {sigma(*sea, "roll", kAngle), sigma(*sea, "pitch", kAngle),
                         sigma(*sea, "yaw", kAngle), sigma(*sea, "height", kLength) / 4};
  const long long n = sea->get_integer("components").value_or(12);
  if (n < 1 || n > 100) refuse("expected from 1 to 100 components", sea->where("components"));
  const Stream<double> draw{seed, 0, noise_source::kSea};
  std::uint64_t k = 0;
  for (int axis = 0; axis < 4; ++axis) {
    for (long long i = 0; i < n; ++i, k += 2) {
      if (rms[axis] == 0) continue;
      const double u = (static_cast<double>(i) + draw.uniform(k)) / static_cast<double>(n);
      const double x = -log(u) / 1.25;
      // The long and the short tails end where a ship feels nothing.
      const double ratio = max(0.4, min(4.0, 1.0 / sqrt(sqrt(x))));
      path.waves.push_back({static_cast<WaveAxis>(axis),
                            rms[axis] * sqrt(2.0 / static_cast<double>(n)), peak / ratio,
                            2 * kPi * draw.uniform(k + 1)});
    }
  }
}

// A recorded track that turns more tightly turns back on itself, m.
constexpr double kCusp = 1.0;

// The distance of control points at which the sharpest corner has the radius: r = 0.75 d
// cos^2(a/2)/sin(a/2) for a turn by a.
double spacing_of(const Ellipsoid& ell, const std::vector<PathPoint>& points, double radius) {
  double most = 0.1;
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const auto before =
        geodesic_inverse(ell, points[i - 1].lat, points[i - 1].lon, points[i].lat, points[i].lon);
    const auto after =
        geodesic_inverse(ell, points[i].lat, points[i].lon, points[i + 1].lat, points[i + 1].lon);
    most = max(most, fabs(wrap_pi(after.azimuth1 - before.azimuth2)));
  }
  const double half = 0.5 * min(most, 120 * deg), c = cos(half);
  return radius * sin(half) / (0.75 * c * c);
}

// Straights of 100 m to 1 km and turns up to 100 deg.
std::vector<PathPoint> random_way(const Trajectory& path, double length, std::uint64_t seed) {
  const Stream<double> draw{seed, 0, noise_source::kRoad};
  std::vector<PathPoint> points{{path.start.lat, path.start.lon, path.start.h, loxo::kNone}};
  double left = length, azimuth = path.course;
  for (std::uint64_t k = 0; left > 0; k += 2) {
    const double straight = min(left, 100.0 + 900.0 * draw.uniform(k));
    const auto next =
        geodesic_direct(path.ellipsoid, points.back().lat, points.back().lon, azimuth, straight);
    points.push_back({next.lat, next.lon, path.start.h, loxo::kNone});
    azimuth = next.azimuth2 + (2.0 * draw.uniform(k + 1) - 1.0) * 100.0 * deg;
    left -= straight;
  }
  return points;
}

void read_way(const TomlTable& t, Trajectory& path, std::uint64_t seed, const std::string& folder) {
  const auto settings = t.get_table("path").value_or(TomlTable::parse("", "path"));
  std::vector<PathPoint> points;
  const auto waypoints = t.get_tables("waypoint");
  const auto file = settings.get_string("file");
  const auto random = settings.get_quantity("random", kLength);
  std::string where = t.where("path");
  if ((waypoints.empty() ? 0 : 1) + (file ? 1 : 0) + (random ? 1 : 0) != 1)
    refuse(
        "expected one of [[waypoint]] tables, path.file (a recorded track) and path.random (a "
        "road's length)",
        where);
  bool timed = false;
  if (file) {
    const auto full = std::filesystem::path(*file).is_absolute()
                          ? std::filesystem::path(*file)
                          : std::filesystem::path(folder) / *file;
    where = full.string();
    bool have = true;
    for (const auto& p : read_track_points(where)) {
      points.push_back({p.lat, p.lon, p.h, p.t});
      have = have && given(p.t);
    }
    const auto wanted = settings.get_bool("times");
    timed = wanted.value_or(have);
    if (timed && !have)
      refuse("the track has no times; expected times = false and a speed", settings.where("times"));
    // A recorder that stands or stutters repeats a stamp.
    if (timed) {
      std::vector<PathPoint> rising;
      for (const auto& p : points)
        if (rising.empty() || p.t > rising.back().t) rising.push_back(p);
      points = rising;
    }
    if (!settings.get_bool("heights").value_or(true))
      for (auto& p : points) p.h = settings.get_quantity("height", kLength).value_or(0.0);
  } else if (random) {
    if (!(*random > 0)) refuse("expected a length above 0", settings.where("random"));
    if (*random > 2e6) refuse("expected a road of at most 2000 km", settings.where("random"));
    read_start(t, path);
    points = random_way(path, *random, seed);
  } else {
    for (const auto& w : waypoints) {
      const double lat = w.need_number("lat_deg"), lon = w.need_number("lon_deg");
      if (!(fabs(lat) <= 90)) refuse("expected degrees in [-90, 90]", w.where("lat_deg"));
      if (!(fabs(lon) <= 360)) refuse("expected degrees in [-360, 360]", w.where("lon_deg"));
      points.push_back({lat * deg, lon * deg, w.get_number("h_m").value_or(0.0), loxo::kNone});
    }
    where = t.where("waypoint");
  }
  if (!timed)
    for (auto& p : points) p.t = loxo::kNone;
  const double radius = positive(settings, "radius", kLength, 15.0);
  const double tightest = file ? kCusp : 0.4 * radius;
  const double spacing =
      file ? positive(settings, "smoothing", kLength, 5.0)
           : positive(settings, "smoothing", kLength, spacing_of(path.ellipsoid, points, radius));
  PathSpeed v;
  v.speed = positive(settings, "speed", kSpeed, 15.0);
  v.acceleration = positive(settings, "acceleration", kAcceleration, 1.0);
  v.lateral = positive(settings, "lateral_acceleration", kAcceleration, 2.0);
  v.from_rest = settings.get_bool("from_rest").value_or(true);
  v.to_rest = settings.get_bool("to_rest").value_or(true);
  path.path = std::make_shared<const Path>(path.ellipsoid, points, spacing, tightest, v, where);
}

}  // namespace

Trajectory read_trajectory(const TomlTable& t, const Ellipsoid& ellipsoid, std::uint64_t seed,
                           const std::string& folder) {
  Trajectory path;
  path.ellipsoid = ellipsoid;
  if (t.has("path") || t.has("waypoint")) {
    if (t.has("leg"))
      refuse("found both [[leg]] and a [path] or [[waypoint]]; expected one of them",
             t.where("leg"));
    read_way(t, path, seed, folder);
  } else {
    read_start(t, path);
    read_legs(t, path);
  }
  read_waves(t, path, seed);
  if (const auto m = t.get_table("mounting")) {
    path.mounting_heading = angle(*m, "heading");
    path.mounting_pitch = angle(*m, "pitch");
  }
  return path;
}

}  // namespace loxo
