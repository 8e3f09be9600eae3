// SPDX-License-Identifier: Apache-2.0
#include "loxo/report/solution_sections.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

namespace loxo::report {
namespace {

constexpr double kToDeg = 180.0 / std::numbers::pi;

// A curve of one number of every row. An angle that jumps by more than half a turn is broken there.
template <typename F>
std::vector<double> values_of(const Solution& s, F value, bool circular = false) {
  std::vector<double> out;
  out.reserve(s.rows.size());
  double before = kNoValue;
  for (const auto& row : s.rows) {
    double v = value(row);
    const double now = v;
    if (circular && std::fabs(v - before) > 180) v = kNoValue;
    before = now;
    out.push_back(v);
  }
  return out;
}

std::vector<double> times_of(const Solution& s, double t0) {
  return values_of(s, [t0](const SolutionRow& r) { return r.t - t0; });
}

bool any_finite(const std::vector<Curve>& curves) {
  return std::any_of(curves.begin(), curves.end(), [](const Curve& c) {
    return std::any_of(c.y.begin(), c.y.end(), [](double y) { return std::isfinite(y); });
  });
}

std::vector<Span> frame_spans(const Solution& s, double t0) {
  std::vector<Span> spans;
  for (const auto& row : s.rows) {
    const std::string name(frame_name(row.frame));
    if (!spans.empty() && spans.back().label == name)
      spans.back().to = row.t - t0;
    else if (spans.size() < 60) {
      if (!spans.empty()) spans.back().to = row.t - t0;
      spans.push_back({row.t - t0, row.t - t0, name});
    }
  }
  if (spans.size() < 2) spans.clear();
  return spans;
}

}  // namespace

double time_origin(const std::vector<NamedSolution>& solutions) {
  double t0 = INFINITY;
  for (const auto& s : solutions)
    for (const auto& row : s.solution->rows)
      if (std::isfinite(row.t)) {
        t0 = std::min(t0, row.t);
        break;
      }
  return std::isfinite(t0) && std::fabs(t0) > 86400 ? std::floor(t0) : 0.0;
}

Section map_section(const std::vector<NamedSolution>& solutions,
                    const std::vector<MapPoint>& points) {
  Section section;
  section.title = "Map";
  Map map;
  const double t0 = time_origin(solutions);
  std::string names;
  for (const auto& s : solutions) {
    Track track;
    track.name = s.name;
    track.lat = values_of(*s.solution, [](const SolutionRow& r) { return r.lat; });
    track.lon = values_of(*s.solution, [](const SolutionRow& r) { return r.lon; });
    track.t = times_of(*s.solution, t0);
    track.style = !s.truth && solutions.size() > 1 ? Style::kDashed : Style::kLine;
    names += (names.empty() ? "" : ", ") + s.name;
    map.tracks.push_back(std::move(track));
  }
  map.points = points;
  for (const auto& s : solutions) {
    const auto& rows = s.solution->rows;
    const auto placed = [](const SolutionRow& r) {
      return std::isfinite(r.lat) && std::isfinite(r.lon);
    };
    const auto first = std::find_if(rows.begin(), rows.end(), placed);
    const auto last = std::find_if(rows.rbegin(), rows.rend(), placed);
    if (first == rows.end()) continue;
    MapPoint start{"start", first->lat, first->lon}, end{"end", last->lat, last->lon};
    start.kind = PointKind::kStart;
    end.kind = PointKind::kEnd;
    map.points.push_back(start);
    if (last->lat != first->lat || last->lon != first->lon) map.points.push_back(end);
    break;
  }
  map.caption = "Tracks: " + names +
                ". Drag to move, click and turn the wheel to zoom; the points follow the cursor of "
                "the figures below.";
  section.blocks.emplace_back(std::move(map));
  return section;
}

Section motion_section(const std::vector<NamedSolution>& solutions) {
  Section section;
  section.title = "Position, velocity, attitude";
  const double t0 = time_origin(solutions);
  if (t0 != 0) {
    char text[80];
    std::snprintf(text, sizeof text, "Times are since t = %.0f s of the log.", t0);
    section.blocks.emplace_back(Text{text});
  }
  // Metres from the first point where the track is small; degrees where it is not.
  const SolutionRow* origin = nullptr;
  for (const auto& s : solutions)
    for (const auto& row : s.solution->rows)
      if (!origin && std::isfinite(row.x) && std::isfinite(row.lat)) origin = &row;
  bool local = origin != nullptr;
  double axes[3][3]{};
  if (origin) {
    const double sl = std::sin(origin->lat), cl = std::cos(origin->lat), so = std::sin(origin->lon),
                 co = std::cos(origin->lon);
    const double m[3][3] = {{-so, co, 0}, {-sl * co, -sl * so, cl}, {cl * co, cl * so, sl}};
    std::copy(&m[0][0], &m[0][0] + 9, &axes[0][0]);
    for (const auto& s : solutions)
      for (const auto& row : s.solution->rows)
        if (std::hypot(row.x - origin->x, row.y - origin->y, row.z - origin->z) > 100e3)
          local = false;
  }
  struct Figure {
    std::string title, label, unit;
    double (*value)(const SolutionRow&, const SolutionRow*, const double (*)[3]);
    bool circular = false;
  };
  using R = const SolutionRow&;
  using O = const SolutionRow*;
  using A = const double(*)[3];
  std::vector<Figure> figures;
  if (local) {
    figures.push_back({"East of the start", "east", "m", [](R r, O o, A a) {
                         return a[0][0] * (r.x - o->x) + a[0][1] * (r.y - o->y) +
                                a[0][2] * (r.z - o->z);
                       }});
    figures.push_back({"North of the start", "north", "m", [](R r, O o, A a) {
                         return a[1][0] * (r.x - o->x) + a[1][1] * (r.y - o->y) +
                                a[1][2] * (r.z - o->z);
                       }});
  } else {
    figures.push_back({"Latitude", "latitude", "deg", [](R r, O, A) { return r.lat * kToDeg; }});
    figures.push_back(
        {"Longitude", "longitude", "deg", [](R r, O, A) { return r.lon * kToDeg; }, true});
  }
  figures.push_back({"Height", "height", "m", [](R r, O, A) { return r.h; }});
  figures.push_back({"East velocity", "east", "m/s", [](R r, O, A) { return r.ve; }});
  figures.push_back({"North velocity", "north", "m/s", [](R r, O, A) { return r.vn; }});
  figures.push_back({"Up velocity", "up", "m/s", [](R r, O, A) { return r.vu; }});
  figures.push_back(
      {"Heading", "heading", "deg", [](R r, O, A) { return r.heading * kToDeg; }, true});
  figures.push_back({"Pitch", "pitch", "deg", [](R r, O, A) { return r.pitch * kToDeg; }});
  figures.push_back({"Roll", "roll", "deg", [](R r, O, A) { return r.roll * kToDeg; }});

  std::vector<std::vector<double>> times;
  for (const auto& s : solutions) times.push_back(times_of(*s.solution, t0));
  std::vector<Span> spans;
  for (const auto& s : solutions)
    if (!s.truth && spans.empty()) spans = frame_spans(*s.solution, t0);
  for (const auto& figure : figures) {
    Series series;
    series.title = figure.title;
    series.x = {"time", "s"};
    series.y = {figure.label, figure.unit};
    series.sync = "time";
    series.half = true;
    series.spans = spans;
    for (std::size_t i = 0; i < solutions.size(); ++i) {
      Curve curve;
      curve.name = solutions[i].name;
      curve.x = times[i];
      curve.y = values_of(
          *solutions[i].solution,
          [&](const SolutionRow& r) { return figure.value(r, origin, axes); }, figure.circular);
      series.curves.push_back(std::move(curve));
    }
    if (any_finite(series.curves)) section.blocks.emplace_back(std::move(series));
  }

  // Stated standard deviations.
  Series sigma;
  sigma.title = "Stated standard deviation of position";
  sigma.x = {"time", "s"};
  sigma.y = {"1 σ", "m"};
  sigma.sync = "time";
  for (std::size_t i = 0; i < solutions.size(); ++i) {
    const std::array<std::pair<const char*, double SolutionRow::*>, 3> parts{
        {{"east", &SolutionRow::std_e},
         {"north", &SolutionRow::std_n},
         {"up", &SolutionRow::std_u}}};
    for (const auto& [word, member] : parts) {
      Curve curve;
      curve.name = solutions.size() > 1 ? solutions[i].name + ", " + word : word;
      curve.source = solutions.size() > 1 ? solutions[i].name : "";
      curve.x = times[i];
      curve.y =
          values_of(*solutions[i].solution, [m = member](const SolutionRow& r) { return r.*m; });
      if (any_finite({curve})) sigma.curves.push_back(std::move(curve));
    }
  }
  if (!sigma.curves.empty()) section.blocks.emplace_back(std::move(sigma));

  // Health in words.
  static constexpr std::array<std::pair<std::uint32_t, const char*>, 10> kWords{
      {{kHealthGap, "input gap bridged"},
       {kHealthSaturated, "sensor at its limit"},
       {kHealthSingular, "frame near its singularity"},
       {kHealthDomain, "arithmetic left its domain"},
       {kHealthDeadEncoder, "dead encoder"},
       {kHealthSlip, "wheel slip de-weighted"},
       {kHealthRejected, "measurement rejected"},
       {kHealthDiverged, "filter diverged"},
       {kHealthSwitched, "navigation frame changed"},
       {kHealthUncovered, "stated error not to be trusted"}}};
  Table health;
  health.title = "Health";
  health.caption = "Rows on which something was noticed, and when first.";
  health.columns = {{"solution", ""}, {"what", ""}, {"rows", ""}, {"of", ""}, {"first at", "s"}};
  for (const auto& s : solutions)
    for (const auto& [bit, word] : kWords) {
      std::size_t n = 0;
      double first = kNoValue;
      for (const auto& row : s.solution->rows)
        if (row.health & bit) {
          if (n++ == 0) first = row.t - t0;
        }
      if (n == 0) continue;
      const bool bad = bit == kHealthDomain || bit == kHealthDiverged;
      health.rows.push_back({{Cell(s.name), Cell(word, bad ? Verdict::kBad : Verdict::kNone),
                              Cell(static_cast<double>(n)),
                              Cell(static_cast<double>(s.solution->rows.size())), Cell(first)}});
    }
  if (!health.rows.empty()) section.blocks.emplace_back(std::move(health));
  return section;
}

}  // namespace loxo::report
