// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/evaluate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/consistency.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo {
namespace {

using V = Vec<Ecef, double>;

// A row as points and vectors of ECEF; NaN where the file says nothing.
struct Pose {
  double t = 0;
  Point<Ecef, double> r;
  V v;
  Quat<Ecef, Body, double> q;
  bool has_height = true, has_velocity = false, has_up = false, has_attitude = false;
  Rot<Geographic, Ecef, double> axes;  // level axes at r
  double std[3] = {kNone, kNone, kNone};
};

bool finite(double a, double b, double c) {
  return std::isfinite(a) && std::isfinite(b) && std::isfinite(c);
}

bool is_local(const Solution& s) {
  const auto it = s.meta.find("local");
  return it != s.meta.end() && it->second == "true";
}

// Local metres: x east, y north, z up of a plane; level axes are those of the plane everywhere.
Pose local_pose(const SolutionRow& row) {
  Pose p;
  p.t = row.t;
  p.r = {row.x, row.y, std::isfinite(row.z) ? row.z : 0.0};
  p.has_height = std::isfinite(row.z);
  p.axes = Rot<Geographic, Ecef, double>::identity();
  p.has_velocity = std::isfinite(row.ve) && std::isfinite(row.vn);
  p.has_up = p.has_velocity && std::isfinite(row.vu);
  p.v = {row.ve, row.vn, p.has_up ? row.vu : 0.0};
  p.has_attitude = std::isfinite(row.heading);
  if (p.has_attitude) {
    const Euler<double> e{row.heading, std::isfinite(row.pitch) ? row.pitch : 0.0,
                          std::isfinite(row.roll) ? row.roll : 0.0};
    p.q = to_quaternion(to_matrix<Ecef>(e));
  }
  return p;
}

Pose pose(const SolutionRow& row, const Ellipsoid& ell) {
  Pose p;
  p.t = row.t;
  double lat = row.lat, lon = row.lon;
  p.has_height = std::isfinite(row.h) || (finite(row.x, row.y, row.z) && !std::isfinite(lat));
  if (finite(row.x, row.y, row.z)) {
    p.r = {row.x, row.y, row.z};
    // Longitude and axes of the row itself where given: at the pole they are a choice of the file.
    if (!std::isfinite(lat) || !std::isfinite(lon)) {
      const auto g = to_geodetic(ell, p.r);
      lat = g.lat;
      lon = g.lon;
    }
  } else {
    p.r = to_ecef(ell, Geodetic<double>{lat, lon, p.has_height ? row.h : 0.0});
  }
  p.axes = geographic_axes(lat, lon);
  p.has_velocity = std::isfinite(row.ve) && std::isfinite(row.vn);
  p.has_up = p.has_velocity && std::isfinite(row.vu);
  p.v = transpose(p.axes) * Vec<Geographic, double>{row.ve, row.vn, p.has_up ? row.vu : 0.0};
  p.has_attitude = finite(row.qx, row.qy, row.qz) && std::isfinite(row.qw) &&
                   (std::isfinite(row.heading) || row.qx != 0 || row.qy != 0 || row.qz != 0);
  p.q = {row.qw, row.qx, row.qy, row.qz};
  if (!p.has_attitude && std::isfinite(row.heading)) {
    const Euler<double> e{row.heading, std::isfinite(row.pitch) ? row.pitch : 0.0,
                          std::isfinite(row.roll) ? row.roll : 0.0};
    p.q = to_quaternion(transpose(p.axes) * to_matrix<Geographic>(e));
    p.has_attitude = true;
  }
  p.std[0] = row.std_e;
  p.std[1] = row.std_n;
  p.std[2] = row.std_u;
  return p;
}

Quat<Ecef, Body, double> slerp(const Quat<Ecef, Body, double>& a, Quat<Ecef, Body, double> b,
                               double u) {
  double c = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
  if (c < 0) {
    b = {-b.w, -b.x, -b.y, -b.z};
    c = -c;
  }
  double wa = 1 - u, wb = u;
  if (c < 1 - 1e-9) {
    const double angle = std::acos(c), s = std::sin(angle);
    wa = std::sin((1 - u) * angle) / s;
    wb = std::sin(u * angle) / s;
  }
  return normalized(Quat<Ecef, Body, double>{wa * a.w + wb * b.w, wa * a.x + wb * b.x,
                                             wa * a.y + wb * b.y, wa * a.z + wb * b.z});
}

Pose interpolate(const Pose& a, const Pose& b, double t, const Ellipsoid& ell, bool local) {
  const double dt = b.t - a.t, u = (t - a.t) / dt;
  Pose p = a;
  p.t = t;
  const V d = b.r - a.r;
  p.has_velocity = a.has_velocity && b.has_velocity;
  p.has_up = a.has_up && b.has_up;
  p.has_height = a.has_height && b.has_height;
  if (p.has_velocity && (p.has_up || !p.has_height)) {
    // Cubic Hermite; without velocities linear, which costs 0.3 % of distance in turns at 1 Hz.
    const double h01 = u * u * (3 - 2 * u), h10 = u * (1 - u) * (1 - u), h11 = u * u * (u - 1);
    p.r = a.r + (h01 * d + (h10 * dt) * a.v + (h11 * dt) * b.v);
    const double g01 = 6 * u * (1 - u) / dt, g10 = (1 - u) * (1 - 3 * u), g11 = u * (3 * u - 2);
    p.v = g01 * d + g10 * a.v + g11 * b.v;
  } else {
    p.r = a.r + u * d;
    if (p.has_velocity) p.v = (1 - u) * a.v + u * b.v;
  }
  p.has_attitude = a.has_attitude && b.has_attitude;
  if (p.has_attitude) p.q = slerp(a.q, b.q, u);
  for (int i = 0; i < 3; ++i) p.std[i] = (1 - u) * a.std[i] + u * b.std[i];
  if (!local) {
    const auto g = to_geodetic(ell, p.r);
    p.axes = geographic_axes(g.lat, g.lon);
  }
  return p;
}

double median_interval(const std::vector<Pose>& poses) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < poses.size(); ++i) steps.push_back(poses[i].t - poses[i - 1].t);
  return quantile(steps, 0.5);
}

double rms(const std::vector<double>& x) {
  double sum = 0;
  std::size_t n = 0;
  for (double v : x)
    if (!std::isnan(v)) {
      sum += v * v;
      ++n;
    }
  return n == 0 ? kNone : std::sqrt(sum / static_cast<double>(n));
}

double largest(const std::vector<double>& x) {
  double m = kNone;
  for (double v : x)
    if (!std::isnan(v) && !(std::fabs(v) <= m)) m = std::fabs(v);
  return m;
}

std::vector<Pose> poses_of(const Solution& s, const Ellipsoid& ell, bool local, const char* what,
                           Diagnostics& diagnostics) {
  std::vector<Pose> out;
  out.reserve(s.rows.size());
  std::size_t bad = 0, back = 0;
  for (const auto& row : s.rows) {
    const Pose p = local ? local_pose(row) : pose(row, ell);
    if (!finite(p.r.x, p.r.y, p.r.z) || !std::isfinite(p.t)) {
      ++bad;
      continue;
    }
    if (!out.empty() && p.t <= out.back().t) {
      ++back;
      continue;
    }
    out.push_back(p);
  }
  if (bad > 0)
    diagnostics.warn("nan_row", what, fmt::format("{} rows without a position are left out", bad));
  if (back > 0)
    diagnostics.warn("time_back", what,
                     fmt::format("{} rows whose time does not advance are left out", back));
  return out;
}

}  // namespace

Evaluation evaluate(const Solution& solution, const Solution& truth, const Ellipsoid& ell,
                    const EvaluateConfig& config, Diagnostics& diagnostics) {
  const bool truth_local = is_local(truth), solution_local = is_local(solution);
  if (solution_local && !truth_local)
    throw Error(
        ErrorKind::kInput,
        "the solution is in local metres (e_m, n_m) and the truth is geodetic; expected both alike",
        "solution");
  auto ref = poses_of(truth, ell, truth_local, "truth", diagnostics);
  auto sol = poses_of(solution, ell, solution_local, "solution", diagnostics);
  if (ref.empty()) throw Error(ErrorKind::kInput, "no row with a time and a position", "truth");
  if (sol.empty()) throw Error(ErrorKind::kInput, "no row with a time and a position", "solution");

  const double slack = 1e-6;  // s: stamps written with microseconds meet
  if (ref.front().t > sol.back().t + slack || sol.front().t > ref.back().t + slack) {
    throw Error(
        ErrorKind::kInput,
        fmt::format(
            "solution and truth have no time in common: solution {} to {} s, truth {} to {} s",
            sol.front().t, sol.back().t, ref.front().t, ref.back().t),
        "t_s");
  }

  Evaluation out;
  out.local = truth_local;
  if (truth_local && !solution_local) {
    // Lay the geodetic solution into the plane: its own level axes at the first common epoch,
    // origin on the truth there.
    std::size_t k = 0;
    while (k + 1 < sol.size() && sol[k].t < ref.front().t - slack) ++k;
    const auto axes = sol[k].axes;
    const auto origin = sol[k].r;
    const auto level = [&](const V& v) {
      const auto g = axes * v;
      return V{g.x, g.y, g.z};
    };
    std::size_t i = 0;
    while (i + 1 < ref.size() && ref[i].t < sol[k].t - slack) ++i;
    const auto base = ref[i].r;
    const Quat<Ecef, Ecef, double> turn = to_quaternion([&] {
      Rot<Ecef, Ecef, double> c;
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) c.m[a][b] = axes.m[a][b];
      return c;
    }());
    for (auto& p : sol) {
      p.r = base + level(p.r - origin);
      p.v = level(p.v);
      p.q = turn * p.q;
      p.axes = Rot<Geographic, Ecef, double>::identity();
    }
    diagnostics.note("local_truth", "truth",
                     "local metres without an origin: the solution is laid on the truth's first "
                     "point, its start error is not seen");
  }

  const double gap = std::isnan(config.max_gap) ? 3 * std::max(median_interval(sol), 1e-3) + slack
                                                : config.max_gap;
  std::size_t in_gap = 0, j = 0;
  Point<Ecef, double> last_r{};
  std::vector<Point<Ecef, double>> true_r, sol_r;  // of each kept epoch
  std::vector<V> up_axis;
  for (std::size_t i = 0; i < ref.size(); ++i) {
    const double t = ref[i].t;
    if (t < config.from || t > config.to) continue;
    if (t < sol.front().t - slack || t > sol.back().t + slack) continue;
    while (j + 1 < sol.size() && sol[j + 1].t <= t + slack) ++j;
    Pose s;
    if (std::fabs(sol[j].t - t) <= slack || j + 1 >= sol.size()) {
      s = sol[j];
    } else if (sol[j].t > t) {
      s = sol[j];
    } else {
      if (sol[j + 1].t - sol[j].t > gap) {
        ++in_gap;
        continue;
      }
      s = interpolate(sol[j], sol[j + 1], t, ell, truth_local);
    }
    Pose r = ref[i];
    EvaluationEpoch e;
    e.t = t;
    const bool heights = r.has_height && s.has_height;
    if (!heights && !truth_local) {
      // One side has no height: both are brought onto the ellipsoid, the horizontal difference is
      // what is asked.
      auto gr = to_geodetic(ell, r.r), gs = to_geodetic(ell, s.r);
      gr.h = gs.h = 0;
      r.r = to_ecef(ell, gr);
      s.r = to_ecef(ell, gs);
    }
    const auto d = r.axes * (s.r - r.r);
    e.east = d.x;
    e.north = d.y;
    e.up = heights ? d.z : kNone;
    e.horizontal = std::hypot(d.x, d.y);
    const V up{r.axes.m[2][0], r.axes.m[2][1], r.axes.m[2][2]};
    if (!true_r.empty()) {
      const V step = r.r - last_r;
      const double vertical = dot(step, up);
      e.s = out.series.back().s + std::sqrt(std::max(0.0, dot(step, step) - vertical * vertical));
    }
    if (r.has_velocity && s.has_velocity) {
      const auto dv = r.axes * (s.v - r.v);
      e.ve = dv.x;
      e.vn = dv.y;
      e.vu = r.has_up && s.has_up ? dv.z : kNone;
    }
    double ce = kNone, cn = kNone;  // true course as a level vector
    if (r.has_velocity) {
      const auto v = r.axes * r.v;
      ce = v.x;
      cn = v.y;
    } else if (i + 1 < ref.size() && i > 0) {
      const auto v = r.axes * (ref[i + 1].r - ref[i - 1].r) * (1 / (ref[i + 1].t - ref[i - 1].t));
      ce = v.x;
      cn = v.y;
    }
    const double speed = std::hypot(ce, cn);
    if (speed > 1.0) {
      e.along = (d.x * ce + d.y * cn) / speed;
      e.across = (d.x * cn - d.y * ce) / speed;
    }
    if (r.has_attitude && s.has_attitude) {
      // C~ C^T = I - [psi] [EST-1]: psi up > 0 reads as a heading too large (polar.md 4.1).
      const auto dq = s.q * conjugate(r.q);
      const double n = std::sqrt(dq.x * dq.x + dq.y * dq.y + dq.z * dq.z);
      const double k = n < 1e-12 ? (dq.w < 0 ? 2.0 : -2.0)
                                 : -2.0 * std::atan2(dq.w < 0 ? -n : n, std::fabs(dq.w)) / n;
      const V psi{k * dq.x, k * dq.y, k * dq.z};
      const auto level = r.axes * psi;
      e.heading = level.z;
      // Bow and starboard of the true body: tilt about right is pitch, about forward is roll.
      const auto body = transpose(to_matrix(r.q)) * psi;
      e.pitch = -body.x;
      e.roll = -body.y;
    }
    if (s.std[0] > 0 && s.std[1] > 0) {
      const auto own = s.axes * (s.r - r.r);
      e.nees = own.x * own.x / (s.std[0] * s.std[0]) + own.y * own.y / (s.std[1] * s.std[1]);
      if (heights && s.std[2] > 0) e.nees += own.z * own.z / (s.std[2] * s.std[2]);
    }
    last_r = r.r;
    true_r.push_back(r.r);
    sol_r.push_back(s.r);
    up_axis.push_back(up);
    out.series.push_back(e);
    if (out.series.size() == 1) out.nees_dof = heights && s.std[2] > 0 ? 3 : 2;
  }
  if (in_gap > 0)
    diagnostics.warn(
        "gap", "solution",
        fmt::format(
            "{} truth epochs fall into gaps of the solution longer than {:.3g} s and are left out",
            in_gap, gap));
  auto& series = out.series;
  if (series.empty()) {
    throw Error(
        ErrorKind::kInput,
        fmt::format(
            "no truth epoch lies inside the solution: solution {} to {} s, truth {} to {} s",
            sol.front().t, sol.back().t, ref.front().t, ref.back().t),
        "t_s");
  }

  out.epochs = series.size();
  out.t_begin = series.front().t;
  out.t_end = series.back().t;
  out.distance_m = series.back().s;
  const auto column = [&](auto get) {
    std::vector<double> x;
    x.reserve(series.size());
    for (const auto& e : series) x.push_back(get(e));
    return x;
  };
  const auto horizontal = column([](const auto& e) { return e.horizontal; });
  out.horizontal_rms_m = rms(horizontal);
  out.horizontal_max_m = largest(horizontal);
  out.horizontal_end_m = horizontal.back();
  out.cep50_m = quantile(horizontal, 0.5);
  out.cep95_m = quantile(horizontal, 0.95);
  const auto up = column([](const auto& e) { return e.up; });
  out.up_rms_m = rms(up);
  out.up_max_m = largest(up);
  out.position_3d_max_m = largest(column(
      [](const auto& e) { return std::hypot(e.horizontal, std::isnan(e.up) ? 0.0 : e.up); }));
  out.along_rms_m = rms(column([](const auto& e) { return e.along; }));
  out.across_rms_m = rms(column([](const auto& e) { return e.across; }));
  const auto heading = column([](const auto& e) { return e.heading; });
  out.heading_rms_deg = rms(heading) / deg;
  out.heading_max_deg = largest(heading) / deg;
  out.heading_rms_mil = rms(heading) / mil;
  out.pitch_rms_deg = rms(column([](const auto& e) { return e.pitch; })) / deg;
  out.roll_rms_deg = rms(column([](const auto& e) { return e.roll; })) / deg;
  const auto velocity = column([](const auto& e) {
    return std::isnan(e.vu) ? std::hypot(e.ve, e.vn) : std::hypot(e.ve, e.vn, e.vu);
  });
  out.velocity_rms_mps = rms(velocity);
  out.velocity_max_mps = largest(velocity);

  // Error in % of distance: start offset taken out (estimation.md 7, "whole").
  const double from = std::min(config.min_pct_distance, 0.5 * out.distance_m);
  std::vector<double> pct;
  const V offset = sol_r.front() - true_r.front();
  for (std::size_t i = 0; i < series.size(); ++i) {
    const V d = sol_r[i] - true_r[i] - offset;
    const double h = std::sqrt(std::max(0.0, dot(d, d) - dot(d, up_axis[i]) * dot(d, up_axis[i])));
    if (series[i].s > 0 && series[i].s >= from) {
      pct.push_back(100 * h / series[i].s);
      out.horizontal_pct_end = pct.back();
    }
  }
  out.horizontal_pct_50 = quantile(pct, 0.5);
  out.horizontal_pct_95 = quantile(pct, 0.95);
  out.horizontal_pct_max = largest(pct);

  // NEES of one run: each epoch against the two-sided band of its dimension.
  const auto nees = column([](const auto& e) { return e.nees; });
  double sum = 0;
  std::size_t known = 0, inside = 0;
  const Band band = chi_square_band(out.nees_dof, 1);
  for (double v : nees) {
    if (std::isnan(v)) continue;
    ++known;
    sum += v;
    inside += v >= band.low && v <= band.high ? 1 : 0;
  }
  if (known > 0) {
    out.nees_mean = sum / static_cast<double>(known);
    out.nees_95_inside = static_cast<double>(inside) / static_cast<double>(known);
    out.nees_low = band.low;
    out.nees_high = band.high;
  } else {
    out.nees_dof = kNone;
  }

  // Fixed-length pieces: displacement errors, heading error not removed.
  const auto at_distance = [&](double s) {
    const auto it = std::lower_bound(series.begin(), series.end(), s,
                                     [](const EvaluationEpoch& e, double x) { return e.s < x; });
    return static_cast<std::size_t>(it - series.begin());
  };
  for (double length : config.lengths) {
    LengthRow row;
    row.length = length;
    row.independent = out.distance_m / length;
    std::vector<double> x;
    const double stride = std::max(length / 20, 50.0);
    for (double s = 0; s + length <= out.distance_m; s += stride) {
      const auto a = at_distance(s), b = at_distance(series[a].s + length);
      if (b >= series.size()) break;
      const V d = (sol_r[b] - sol_r[a]) - (true_r[b] - true_r[a]);
      const double vertical = dot(d, up_axis[b]);
      x.push_back(100 * std::sqrt(std::max(0.0, dot(d, d) - vertical * vertical)) /
                  (series[b].s - series[a].s));
    }
    row.pieces = x.size();
    if (x.empty()) continue;
    row.pct_50 = quantile(x, 0.5);
    row.pct_95 = quantile(x, 0.95);
    row.pct_max = largest(x);
    out.by_length.push_back(row);
  }

  // KITTI: 100 to 800 m, a start every second, each displacement in its own starting heading, 3-D.
  double translation = 0, rotation = 0;
  std::size_t pieces = 0;
  for (double length = 100; length <= 800; length += 100) {
    double next_start = series.front().t;
    for (std::size_t a = 0; a < series.size(); ++a) {
      if (series[a].t < next_start) continue;
      next_start = series[a].t + 1;
      const auto b = at_distance(series[a].s + length);
      if (b >= series.size()) break;
      if (std::isnan(series[a].heading) || std::isnan(series[b].heading)) continue;
      const V moved = sol_r[b] - sol_r[a], true_moved = true_r[b] - true_r[a];
      // A heading too large turns the displacement clockwise seen from above: turn it back about
      // up.
      const double c = std::cos(series[a].heading), s = std::sin(series[a].heading);
      const V& u = up_axis[a];
      const V turned = c * moved + s * cross(u, moved) + ((1 - c) * dot(u, moved)) * u;
      const double way = series[b].s - series[a].s;
      translation += 100 * norm(turned - true_moved) / way;
      rotation += std::fabs(series[b].heading - series[a].heading) / deg / way;
      ++pieces;
    }
  }
  if (pieces > 0) {
    out.kitti_translation_pct = translation / static_cast<double>(pieces);
    out.kitti_rotation_deg_per_m = rotation / static_cast<double>(pieces);
  }
  return out;
}

std::vector<NamedValue> evaluation_values(const Evaluation& e) {
  std::vector<NamedValue> values = {{"horizontal_rms_m", e.horizontal_rms_m},
                                    {"horizontal_max_m", e.horizontal_max_m},
                                    {"horizontal_end_m", e.horizontal_end_m},
                                    {"distance_m", e.distance_m},
                                    {"horizontal_pct_50", e.horizontal_pct_50},
                                    {"horizontal_pct_95", e.horizontal_pct_95},
                                    {"horizontal_pct_max", e.horizontal_pct_max},
                                    {"horizontal_pct_end", e.horizontal_pct_end},
                                    {"cep50_m", e.cep50_m},
                                    {"cep95_m", e.cep95_m},
                                    {"along_rms_m", e.along_rms_m},
                                    {"across_rms_m", e.across_rms_m},
                                    {"up_rms_m", e.up_rms_m},
                                    {"up_max_m", e.up_max_m},
                                    {"position_3d_max_m", e.position_3d_max_m},
                                    {"heading_rms_deg", e.heading_rms_deg},
                                    {"heading_max_deg", e.heading_max_deg},
                                    {"heading_rms_mil", e.heading_rms_mil},
                                    {"pitch_rms_deg", e.pitch_rms_deg},
                                    {"roll_rms_deg", e.roll_rms_deg},
                                    {"velocity_rms_mps", e.velocity_rms_mps},
                                    {"velocity_max_mps", e.velocity_max_mps},
                                    {"nees_mean", e.nees_mean},
                                    {"nees_95_inside", e.nees_95_inside},
                                    {"nees_dof", e.nees_dof},
                                    {"kitti_translation_pct", e.kitti_translation_pct},
                                    {"kitti_rotation_deg_per_m", e.kitti_rotation_deg_per_m},
                                    {"epochs", static_cast<double>(e.epochs)},
                                    {"t_begin_s", e.t_begin},
                                    {"t_end_s", e.t_end}};
  if (!std::isnan(e.nis_mean)) {
    values.push_back({"nis_mean", e.nis_mean});
    values.push_back({"nis_above_95", e.nis_above_95});
  }
  return values;
}

Requirement parse_requirement(const std::string& text) {
  const std::string where = "--require '" + text + "'";
  Requirement r;
  r.text = text;
  const auto op = text.find_first_of("<>");
  if (op == std::string::npos)
    throw Error(ErrorKind::kUsage,
                "expected KEY<NUMBER (or <=, >, >=), for example 'horizontal_pct_max<0.2'", where);
  const auto trim = [](std::string s) {
    const auto a = s.find_first_not_of(" \t"), b = s.find_last_not_of(" \t");
    return a == std::string::npos ? std::string() : s.substr(a, b - a + 1);
  };
  r.key = trim(text.substr(0, op));
  r.op = text.substr(op, op + 1 < text.size() && text[op + 1] == '=' ? 2 : 1);
  const std::string number = trim(text.substr(op + r.op.size()));
  const auto [end, failed] = std::from_chars(number.data(), number.data() + number.size(), r.limit);
  if (number.empty() || failed != std::errc() || end != number.data() + number.size() ||
      !std::isfinite(r.limit))
    throw Error(
        ErrorKind::kUsage,
        "expected a number after '" + r.op + "', found '" + number + "' (the key carries the unit)",
        where);
  std::vector<std::string> names;
  Evaluation every;
  every.nis_mean = 0;
  for (const auto& v : evaluation_values(every)) names.push_back(v.name);
  if (std::find(names.begin(), names.end(), r.key) == names.end())
    throw Error(ErrorKind::kUsage, "unknown key '" + r.key + "'" + suggestion(r.key, names), where);
  return r;
}

bool meets(const Requirement& r, const Evaluation& evaluation) {
  for (const auto& v : evaluation_values(evaluation)) {
    if (v.name != r.key) continue;
    if (r.op == "<") return v.value < r.limit;
    if (r.op == "<=") return v.value <= r.limit;
    if (r.op == ">") return v.value > r.limit;
    return v.value >= r.limit;
  }
  return false;
}

void write_evaluation_series(const std::string& path, const Evaluation& evaluation) {
  OutputFile file(path);
  file.write(
      "t_s,distance_m,east_m,north_m,up_m,horizontal_m,along_m,across_m,ve_mps,vn_mps,vu_mps,"
      "heading_deg,pitch_deg,roll_deg,nees\n");
  std::string line;
  for (const auto& e : evaluation.series) {
    line.clear();
    for (double x : {e.t, e.s, e.east, e.north, e.up, e.horizontal, e.along, e.across, e.ve, e.vn,
                     e.vu, e.heading / deg, e.pitch / deg, e.roll / deg, e.nees}) {
      if (!line.empty()) line += ',';
      append_number(line, x);
    }
    line += '\n';
    file.write(line);
  }
  file.commit();
}

}  // namespace loxo
