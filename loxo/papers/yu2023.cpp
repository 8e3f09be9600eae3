// SPDX-License-Identifier: Apache-2.0
// Yu and Peng 2023: scale and mounting angle from a start, a surveyed end and a reckoned end. Lines
// by rhumb_direct, calibrated by calibrate_two_point; routes by simulate_track, calibrated by
// replay.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/calibrate/replay.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/units.hpp"
#include "loxo/papers/reproduce.hpp"
#include "loxo/sim/route.hpp"

namespace loxo::papers {
namespace {

constexpr Claim kClaims[] = {
#include "loxo/papers/yu2023.inc"
};

constexpr double kLat = 55 * deg, kLon = 110 * deg;

// Errors of a calibration, computed - true.
struct Errors {
  double eps = 0, k = 0;  // arcsec, relative
};
struct Largest {
  double eps = 0, k = 0;
  void add(const Errors& e) {
    eps = std::max(eps, std::fabs(e.eps));
    k = std::max(k, std::fabs(e.k));
  }
};

struct Setting {
  Ellipsoid ell;
  double sign = 1;

  // A straight line driven from the start on a constant true heading, and what the set makes of it.
  TwoPointInput line(double lat, double heading, double length, double k, double eps) const {
    const auto c = rhumb_direct(ell, lat, kLon, heading, length);
    const auto d = rhumb_direct(ell, lat, kLon, heading + sign * eps, k * length);
    return {lat, kLon, c.lat, c.lon, d.lat, d.lon};
  }
  Errors of(ChordMethod method, double lat, double heading, double length, double k,
            double eps) const {
    const auto r = calibrate_two_point(ell, method, line(lat, heading, length, k, eps));
    return {wrap_pi(r.value.eps - eps) / arcsec, r.value.k / k - 1.0};
  }
  // The largest over headings every `step` deg.
  Largest over_headings(ChordMethod method, double length, double k, double eps,
                        double step = 0.25) const {
    Largest m;
    for (int i = 0; i < std::lround(360 / step); ++i)
      m.add(of(method, kLat, step * i * deg, length, k, eps));
    return m;
  }
};

report::Axis heading_axis() { return {"true heading", "deg", false, 0, 360}; }
report::Axis eps_axis() { return {"error of the mounting angle", "arcsec"}; }
report::Axis k_axis() { return {"error of the scale, relative", ""}; }

struct Panel {
  report::Series eps, k;
};
Panel panels(const std::string& title, const std::string& caption) {
  Panel p;
  p.eps.title = title + ", mounting angle";
  p.k.title = title + ", scale";
  p.eps.caption = caption;
  p.k.caption = caption;
  p.eps.x = p.k.x = heading_axis();
  p.eps.y = eps_axis();
  p.k.y = k_axis();
  p.eps.half = p.k.half = true;
  for (int h = 0; h <= 360; h += 2) p.eps.at.push_back(h);
  p.k.at = p.eps.at;
  return p;
}
template <class F>
void add_curve(Panel& p, const std::string& name, report::Style style, const F& errors) {
  report::Curve e, k;
  e.name = k.name = name;
  e.style = k.style = style;
  for (double h : p.eps.at) {
    const Errors x = errors(h * deg);
    e.y.push_back(x.eps);
    k.y.push_back(x.k);
  }
  p.eps.curves.push_back(e);
  p.k.curves.push_back(k);
}
// The paper's bound, drawn.
void mark(Panel& p, double eps, double k) {
  for (double sign : {1.0, -1.0}) {
    p.eps.marks.push_back({sign * eps, sign > 0 ? "printed" : "", true});
    p.k.marks.push_back({sign * k, sign > 0 ? "printed" : "", true});
  }
}
void keep(Paper& paper, const char* id, Panel&& p) {
  paper.figures.push_back({std::string(id) + "-eps", std::move(p.eps)});
  paper.figures.push_back({std::string(id) + "-k", std::move(p.k)});
}

// Section 2.1: one line, mean latitude 55 deg, against what it is.
void one_line(const Setting& s, Book& book) {
  const auto largest = [&](double length) {
    struct {
      double distance = 0, direction = 0;
    } m;
    const double middle = meridian_arc(s.ell, kLat);
    for (int i = 0; i < 1440; ++i) {
      const double h = 0.25 * i * deg;
      const double lat1 = latitude_of_arc(s.ell, middle - 0.5 * length * std::cos(h));
      const auto end = rhumb_direct(s.ell, lat1, kLon, h, length);
      const auto c =
          chord(s.ell, ChordMethod::kMeanLatitude, lat1, end.lat, wrap_pi(end.lon - kLon), 0.0);
      m.distance = std::max(m.distance, std::fabs(std::hypot(c.north, c.east) - length));
      m.direction = std::max(m.direction, std::fabs(wrap_pi(std::atan2(c.east, c.north) - h)));
    }
    return m;
  };
  const auto far = largest(277.8e3), near = largest(90e3);
  book.add("S0-33-277", far.distance);
  book.add("S0-33-277r", far.distance / 277.8e3);
  book.add("S0-33-90", near.distance);
  book.add("S0-33-90r", near.distance / 90e3);
  book.add("S0-26-90", near.direction / arcsec);
  book.add("S0-26-277", far.direction / arcsec);
}

// Figures 4 and 6: formula against simulation; the printed sign of (37), (39) as the proof of E-6.
void formulas(const Setting& s, Book& book, Paper& paper) {
  const double k = 1.2, eps = 92.5 * deg;
  const auto by_formula = [&](bool mean, double h) {
    const auto b = mean ? mean_latitude_bias(s.ell, kLat, 90e3, h, k, eps)
                        : start_latitude_bias(s.ell, kLat, 10e3, h, k, eps);
    return Errors{b.eps / arcsec, b.ln_k};
  };
  const auto simulated = [&](bool mean, double h) {
    return s.of(mean ? ChordMethod::kMeanLatitude : ChordMethod::kStartLatitude, kLat, h,
                mean ? 90e3 : 10e3, k, eps);
  };
  for (const bool mean : {true, false}) {
    Largest apart, printed_sign, all;
    for (int i = 0; i < 1440; ++i) {
      const double h = 0.25 * i * deg;
      const Errors f = by_formula(mean, h), x = simulated(mean, h);
      apart.add({x.eps - f.eps, x.k - f.k});
      printed_sign.add({x.eps + f.eps, x.k + f.k});
      all.add(x);
    }
    book.add(mean ? "S0-F4-a" : "S0-F6-a", apart.eps);
    book.add(mean ? "S0-F4-k" : "S0-F6-k", apart.k);
    if (mean) {
      book.add("S0-F4-sign-a", printed_sign.eps);
      book.add("S0-F4-sign-k", printed_sign.k);
      book.add("S0-F4-max-a", all.eps);
      book.add("S0-F4-max-k", all.k);
    }
    Panel p = mean ? panels("Figure 4: mean latitude, formula and simulation",
                            "k = 1.2, eps = 92.5 deg, 90 km from 55 N. The formula (37), (39) with "
                            "its sign corrected (E-6) follows the simulation within 0.13 arcsec "
                            "and 6e-7; with the printed sign it is its mirror image.")
                   : panels("Figure 6: start latitude, formula and simulation",
                            "k = 1.2, eps = 92.5 deg, 10 km from 55 N. Formula (44), (45), whose "
                            "sign is right in print, lies on the simulation.");
    add_curve(p, "simulation", report::Style::kPoints,
              [&](double h) { return simulated(mean, h); });
    add_curve(p, "formula", report::Style::kLine, [&](double h) { return by_formula(mean, h); });
    if (mean)
      add_curve(p, "formula as printed", report::Style::kDashed, [&](double h) {
        const Errors f = by_formula(mean, h);
        return Errors{-f.eps, -f.k};
      });
    keep(paper, mean ? "figure4" : "figure6", std::move(p));
  }
}

// Figures 5, 7, 8: sets of k and eps.
void sets(const Setting& s, const Options& o, Book& book, Paper& paper) {
  const double listed[] = {-60, 0, 10, 30, 60, 90, 92.5, 120, 150, 180};
  for (double e : listed) {
    const auto m = s.over_headings(ChordMethod::kMeanLatitude, 90e3, 1.2, e * deg);
    book.add(fmt::format("S0-F5-eps{:g}/eps", e), m.eps);
    book.add(fmt::format("S0-F5-eps{:g}/k", e), m.k);
  }
  Largest any, start_any;
  const double grid = o.full ? 2.5 : 5;  // both hold the maxima at -60 and 135 deg
  for (double e = -180; e < 180; e += grid) {
    const auto m = s.over_headings(ChordMethod::kMeanLatitude, 90e3, 1.2, e * deg, 1);
    any.add({m.eps, m.k});
    const auto b = s.over_headings(ChordMethod::kStartLatitude, 10e3, 1.2, e * deg, 1);
    start_any.add({b.eps, b.k});
  }
  book.add("S0-F5-a", any.eps);
  book.add("S0-F5-k", any.k);
  paper.numbers["start-latitude-any-eps"] = start_any.eps;
  const auto seven = s.over_headings(ChordMethod::kStartLatitude, 10e3, 1.2, 90 * deg);
  book.add("S0-F7-a", seven.eps);
  book.add("S0-F7-k", seven.k);
  const auto eight = s.over_headings(ChordMethod::kStartLatitude, 10e3, 1.2, 10 * deg);
  book.add("S0-F8-a", eight.eps);
  book.add("S0-F8-k", eight.k);
  for (const double length : {10e3, 90e3}) {
    const auto mean = s.over_headings(ChordMethod::kMeanLatitude, length, 1.2, 92.5 * deg);
    const auto start = s.over_headings(ChordMethod::kStartLatitude, length, 1.2, 92.5 * deg);
    book.add(length < 50e3 ? "S0-90pc/10km" : "S0-90pc/90km", 1 - mean.eps / start.eps);
    if (length > 50e3) paper.numbers["start-latitude-90km"] = start.eps;
  }
  struct Curve {
    double k, eps;
  };
  const auto draw = [&](const char* id, Panel p, double bound_eps, double bound_k,
                        ChordMethod method, double length, const std::vector<Curve>& curves) {
    mark(p, bound_eps, bound_k);
    for (const auto& c : curves)
      add_curve(p, fmt::format("k {:g}, eps {:g} deg", c.k, c.eps), report::Style::kLine,
                [&](double h) { return s.of(method, kLat, h, length, c.k, c.eps * deg); });
    keep(paper, id, std::move(p));
  };
  draw(
      "figure5",
      panels("Figure 5: mean latitude, sets of k and eps",
             "90 km from 55 N, 110 E. The paper's bound of 7 arcsec holds but for the second "
             "digit (7.07 at eps = -60 deg); its 6 arcsec (conclusion 1) and 1.5e-5 do not (E-9)."),
      7, 1.5e-5, ChordMethod::kMeanLatitude, 90e3,
      {{1.2, -60}, {1.2, 0}, {1.2, 30}, {1.2, 60}, {1.2, 90}, {1.2, 135}, {1.2, 180}, {0.8, 90}});
  draw("figure7",
       panels(
           "Figure 7: start latitude, sets of k and eps",
           "10 km from 55 N. Nine times shorter than figure 5 and 28 times worse. The printed 180 "
           "arcsec and 9e-4 fit eps = 90 deg (181 arcsec); at eps = -70 and 180 deg it is 196 "
           "arcsec and 9.4e-4."),
       180, 9e-4, ChordMethod::kStartLatitude, 10e3,
       {{1.2, -70}, {1.2, 0}, {1.2, 30}, {1.2, 60}, {1.2, 90}, {1.2, 120}, {1.2, 180}, {0.8, 90}});
  draw("figure8",
       panels("Figure 8: start latitude, small mounting angles",
              "10 km from 55 N. Below 50 arcsec and 2.5e-4 while |eps| stays within 10 deg: the "
              "paper's advice to load a first estimate and drive again."),
       50, 2.5e-4, ChordMethod::kStartLatitude, 10e3,
       {{1.2, -10}, {1.2, -5}, {1.2, 0}, {1.2, 5}, {1.2, 10}, {0.8, -10}, {0.8, 0}, {0.8, 10}});
}

void exact_chord(const Setting& s, Book& book) {
  Largest m;
  for (int i = 0; i < 360; ++i)
    m.add(s.of(ChordMethod::kRhumb, kLat, i * deg, 90e3, 1.2, 92.5 * deg));
  book.add("S0-RHUMB/eps", m.eps);
  book.add("S0-RHUMB/k", m.k);
}

// A driven track calibrated by its ends (chords) and through the whole log (replay).
struct Driven {
  Errors mean, rhumb, geodesic, gauss, route, replay;
};
Driven drive(const Setting& s, const Route& route, TrackOptions o, HeadingModel assumed) {
  const double k = o.errors.k, eps = o.errors.eps;
  o.errors.eps = s.sign * eps;
  const auto track = simulate_track(s.ell, route, o);
  const auto start = survey(s.ell, track, 0, 0.0, 1, 0),
             end = survey(s.ell, track, track.steps.size(), 0.0, 1, 0);
  RecordedTrack recorded;
  recorded.ellipsoid = &s.ell;
  recorded.steps = track.steps;
  recorded.model = assumed;
  const Replay replay(recorded, start, {track.steps.size()});
  const auto ends = chord_start(replay, end, 0);
  TwoPointInput in{start.lat, start.lon, end.lat, end.lon, ends.end_lat, ends.end_lon};
  TwoPointOptions as_driven;
  as_driven.continuous_lon = true;
  const auto by = [&](ChordMethod method) {
    const auto r = calibrate_two_point(s.ell, method, in, as_driven);
    return Errors{wrap_pi(r.value.eps - eps) / arcsec, r.value.k / k - 1};
  };
  Driven d;
  d.mean = by(ChordMethod::kMeanLatitude);
  d.rhumb = by(ChordMethod::kRhumb);
  d.geodesic = by(ChordMethod::kGeodesic);
  d.gauss = by(ChordMethod::kGauss);
  const auto c = calibrate_replay(recorded, start, end);
  d.replay = {wrap_pi(c.eps - eps) / arcsec, c.k / k - 1};
  StateVector truth{};
  truth[index(State::kScale)] = std::log(k);
  truth[index(State::kAngle)] = eps;
  const auto m = replay.moments(truth).front();
  const auto b = route_bias(s.ell, start.lat, m.area, m.north, m.east, k, eps);
  d.route = {b.eps / arcsec, b.ln_k};
  return d;
}
TrackOptions steps_of(double metres, double k, double eps) {
  TrackOptions o;
  o.speed = metres;
  o.interval = 1;
  o.errors.k = k;
  o.errors.eps = eps;
  return o;
}

void routes(const Setting& s, Book& book, Paper& paper) {
  const RouteStart at{kLat, kLon, 0};
  const Route straight = straight_route(at, 30 * deg, 90e3), arc = arc_route(at, 0, 90e3, 60 * deg),
              l = l_route(at, 0, 45e3, 45e3, 90 * deg, 100),
              semi = semicircle_route(at, 0, 90e3, true),
              z = z_route(at, 20 * deg, 30e3, 60 * deg, 200);
  const struct {
    const char* id;
    const Route* route;
    double k, eps;
  } rows[] = {{"straight30-1.02-1", &straight, 1.02, 1},
              {"straight30-1.2-92.5", &straight, 1.2, 92.5},
              {"arc60-1.02-1", &arc, 1.02, 1},
              {"arc60-1.2-92.5", &arc, 1.2, 92.5},
              {"L45+45-1.02-1", &l, 1.02, 1},
              {"L45+45-1.2-1", &l, 1.2, 1},
              {"L45+45-1.2-92.5", &l, 1.2, 92.5},
              {"semicircle-1.2-92.5", &semi, 1.2, 92.5},
              {"Z 3x30-1.2-92.5", &z, 1.2, 92.5}};
  report::Table table;
  table.title = "What the paper did not see: the route";
  table.caption =
      "90 km driven from 55 N; error of the mounting angle in arc seconds and of the scale. The "
      "paper's claim that the end point does not depend on the path holds in the plane only "
      "(E-10): "
      "on curved routes every chord, the exact one too, errs by (V-21), up to hundreds of times "
      "what mean latitude saves. Replay through the log has no such error.";
  table.columns = {{"route", ""},
                   {"k, eps", ""},
                   {"mean latitude", "arcsec"},
                   {"", "scale"},
                   {"rhumb chord", "arcsec"},
                   {"", "scale"},
                   {"(V-21)", "arcsec"},
                   {"", "scale"},
                   {"replay", "arcsec"}};
  for (const auto& r : rows) {
    const auto d = drive(s, *r.route, steps_of(50, r.k, r.eps * deg), HeadingModel::kIndependent);
    const std::string id = std::string("S0-PATH-") + r.id;
    book.add(id + "/mean-eps", d.mean.eps);
    book.add(id + "/mean-k", d.mean.k);
    book.add(id + "/rhumb-eps", d.rhumb.eps);
    book.add(id + "/rhumb-k", d.rhumb.k);
    book.add(id + "/replay", std::max(std::fabs(d.replay.eps) * arcsec, std::fabs(d.replay.k)));
    report::Row row;
    row.cells = {report::Cell(r.route->name),
                 report::Cell(fmt::format("{:g}, {:g} deg", r.k, r.eps)),
                 report::Cell(fmt::format("{:.2f}", d.mean.eps)),
                 report::Cell(fmt::format("{:.2e}", d.mean.k)),
                 report::Cell(fmt::format("{:.2f}", d.rhumb.eps)),
                 report::Cell(fmt::format("{:.2e}", d.rhumb.k)),
                 report::Cell(fmt::format("{:.2f}", d.route.eps)),
                 report::Cell(fmt::format("{:.2e}", d.route.k)),
                 report::Cell(fmt::format("{:.1e}", d.replay.eps))};
    table.rows.push_back(row);
  }
  paper.tables.emplace_back(table);

  report::Series f;
  f.title = "Not in the paper: the route";
  f.caption =
      "Arcs of 90 km from due north at 55 N, k = 1.2, eps = 92.5 deg, against how far they turn. "
      "Mean latitude and the exact rhumb chord err alike, as (V-21) says; replay does not.";
  f.x = {"turn of the arc", "deg"};
  f.y = eps_axis();
  report::Curve mean, rhumb, theory, replay;
  mean.name = "mean latitude";
  rhumb.name = "rhumb chord";
  theory.name = "(V-21)";
  theory.style = report::Style::kDashed;
  replay.name = "replay";
  for (int turn = -180; turn <= 180; turn += 15) {
    const auto d = drive(s, arc_route(at, 0, 90e3, turn * deg), steps_of(500, 1.2, 92.5 * deg),
                         HeadingModel::kIndependent);
    f.at.push_back(turn);
    mean.y.push_back(d.mean.eps);
    rhumb.y.push_back(d.rhumb.eps);
    theory.y.push_back(d.route.eps);
    replay.y.push_back(d.replay.eps);
  }
  f.curves = {mean, rhumb, theory, replay};
  paper.figures.push_back({"route", f});
}

// Heading models (vehicle.md 1.5): which chord is exact depends on who kept the heading.
void heading_models(const Setting& s, Book& book, Paper& paper) {
  const RouteStart at{40 * deg, 116 * deg, 0};
  const auto recorded = [&](double heading, HeadingModel kept, HeadingModel assumed) {
    auto o = steps_of(40, 1.2, -1 * deg);
    o.model = kept;
    return drive(s, straight_route(at, heading, 11200), o, assumed);
  };
  const auto h2 = HeadingModel::kMechanised, h1 = HeadingModel::kIndependent;
  const auto right = recorded(45 * deg, h2, h2), wrong = recorded(45 * deg, h2, h1);
  book.add("H2-chords/rhumb", wrong.rhumb.eps);
  book.add("H2-chords/gauss", wrong.gauss.eps);
  book.add("H2-chords/geodesic", wrong.geodesic.eps);
  book.add("H2-chords/replay-h1", wrong.replay.eps);
  book.add("H2-chords/replay-h2", right.replay.eps);
  report::Series f;
  f.title = "Not in the paper: who kept the heading";
  f.caption =
      "11.2 km at 40 N, k = 1.2, eps = -1 deg, the heading kept by the dead reckoning itself (H2, "
      "as "
      "in Shi et al. 2015). The rhumb chord, exact for an independent heading, errs by up to 30 "
      "arcsec; the geodesic chord is exact and Gauss on the start's meridian nearly so. On a log "
      "of "
      "independent headings (H1) it is the other way round.";
  f.x = heading_axis();
  f.y = eps_axis();
  report::Curve rhumb, gauss, geodesic, other;
  rhumb.name = "rhumb chord on H2";
  gauss.name = "Gauss chord on H2";
  geodesic.name = "geodesic chord on H2";
  other.name = "geodesic chord on H1";
  other.style = report::Style::kDashed;
  for (int h = 0; h <= 360; h += 10) {
    const auto d = recorded(h * deg, h2, h1), e = recorded(h * deg, h1, h1);
    f.at.push_back(h);
    rhumb.y.push_back(d.rhumb.eps);
    gauss.y.push_back(d.gauss.eps);
    geodesic.y.push_back(d.geodesic.eps);
    other.y.push_back(e.geodesic.eps);
  }
  f.curves = {rhumb, gauss, geodesic, other};
  paper.figures.push_back({"heading-model", f});
}

// Conclusion 3 of the paper, its open question: steps by the start latitude, at high latitude.
double reckoned_error(const Ellipsoid& ell, Integrator integrator, double lat, double heading,
                      double length, double step) {
  auto state = reckon_start(lat, kLon);
  const auto n = static_cast<int>(std::lround(length / step));
  for (int i = 0; i < n; ++i)
    step_by(ell, integrator, state, step * std::cos(heading), step * std::sin(heading), 0.0);
  const auto end = rhumb_direct(ell, lat, kLon, heading, length);
  const double s = std::sin(end.lat);
  return std::hypot(
      meridian_radius(ell, s) * (state.lat - end.lat),
      prime_vertical_radius(ell, s) * std::cos(end.lat) * wrap_pi(state.lon - end.lon));
}

void steps(const Setting& s, Book& book, Paper& paper) {
  const double length = 90e3, heading = 45 * deg;
  book.add("S0-DR", reckoned_error(s.ell, Integrator::kStartLatitude, kLat, heading, length, 100));
  paper.numbers["midpoint-100m"] =
      reckoned_error(s.ell, Integrator::kMidpoint, kLat, heading, length, 100);
  paper.numbers["start-latitude-1km-85"] =
      reckoned_error(s.ell, Integrator::kStartLatitude, 85 * deg, heading, length, 1000);
  paper.numbers["midpoint-1km-85"] =
      reckoned_error(s.ell, Integrator::kMidpoint, 85 * deg, heading, length, 1000);
  report::Series f;
  f.title = "The open question: integrator error against step and latitude";
  f.caption =
      "Position error after 90 km on heading 45 deg. Steps by the start latitude (the paper's (3), "
      "(4)) err in proportion to the step and to tan of the latitude: half a metre at 55 N with "
      "100 m, hundreds of metres near the pole. The midpoint gains two powers; rhumb steps are "
      "exact "
      "(below a nanometre: rounding, not drawn).";
  f.x = {"step", "m", true};
  f.y = {"position error after 90 km", "m", true};
  f.at = {1000, 500, 200, 100, 50, 20, 10};
  std::reverse(f.at.begin(), f.at.end());
  for (const auto integrator : {Integrator::kStartLatitude, Integrator::kMidpoint})
    for (const double lat : {30.0, 55.0, 75.0, 85.0, 89.0}) {
      report::Curve c;
      c.name = fmt::format("{}, {:g} N", integrator_name(integrator), lat);
      c.style = integrator == Integrator::kMidpoint ? report::Style::kDashed : report::Style::kLine;
      for (double step : f.at)
        c.y.push_back(reckoned_error(s.ell, integrator, lat * deg, heading, length, step));
      f.curves.push_back(c);
    }
  paper.figures.push_back({"integrator", f});
}

// The uncertainty that the paper does not speak of (vehicle.md 5.2, examples).
void uncertainty(const Setting& s, Book& book) {
  TwoPointOptions o;
  o.benchmark_std = 0.1;
  const auto r =
      calibrate_two_point(s.ell, ChordMethod::kRhumb, s.line(kLat, 0.5, 10e3, 1.01, 0.01), o);
  book.add("U-10km/k", r.ln_k_std);
  book.add("U-10km/eps", r.eps_std / arcsec);
  // On the equator, where a line is straight in the plane that the formulas mean (55 N: 1e-3 more).
  auto t = steps_of(20, 1, 0);  // 500 s
  t.interval = 0.05;
  const auto track = simulate_track(s.ell, straight_route({0, kLon, 0}, 0.5, 10e3), t);
  const auto start = survey(s.ell, track, 0, 0.0, 1, 0),
             end = survey(s.ell, track, track.steps.size(), 0.0, 1, 0);
  RecordedTrack recorded;
  recorded.ellipsoid = &s.ell;
  recorded.steps = track.steps;
  const auto with = [&](const TrackErrorModel& e) {
    return calibrate_replay(recorded, start, end, e);
  };
  TrackErrorModel e;
  e.quantisation = 0.5;
  book.add("U-quant", with(e).ln_k_std);
  e = {};
  e.heading_noise = 0.005 * deg_per_sqrt_h;
  book.add("U-arw", with(e).eps_std / arcsec);
  e = {};
  e.heading_drift = 0.05 * deg_per_h;
  book.add("U-drift", with(e).eps_std / arcsec);
}

constexpr const char* kPage = R"md(## yu2023: Yu and Peng, calibration from end points

*H. Yu, F. Peng, calibration of a vehicle's inertial positioning with the mean latitude, 2023 (in Chinese).*

**Question.** A vehicle drives from a surveyed point to another. Its dead reckoning, with an odometer scale k and a mounting angle eps
that nobody knows, ends somewhere else. What are k and eps, and how wrong is the formula that says so?

**Method.** The two chords start to surveyed end and start to reckoned end, their lengths divided, their directions subtracted; metres
from degrees by the radii at the mean latitude of each chord (the paper's proposal) or at the start latitude (the common way).

**What holds.** Over 90 km at 55 N, k = 1.2, mean latitude errs by at most {{S0-F5-a:.2f}}" and {{S0-F5-k:.3g}} whatever the mounting
angle (printed: {{printed S0-F5-a:.0f}}" and {{printed S0-F5-k:.1e}}); start latitude errs by {{S0-F7-a:.1f}}" on 10 km (printed:
{{printed S0-F7-a:.0f}}") and {{start-latitude-90km:.0f}}" on 90 km. The error formulas (44), (45) stand within {{S0-F6-a:.2f}}" and
{{S0-F6-k:.2g}} of a simulation. Mean latitude takes {{S0-90pc/10km:.4f}} of the largest error away on 10 km and {{S0-90pc/90km:.4f}} on
90 km (printed: 0.9).

**What does not.** The sign of (37) and (39): as printed they miss the simulation by {{S0-F4-sign-a:.2f}}", corrected by
{{S0-F4-a:.3f}}" (E-6). The direction error of one 90 km line is {{S0-26-90:.2f}}", not 4.3" (E-8). And the claim under it all, that the
end point does not depend on the path (E-10): on a 60 deg arc of 90 km, k = 1.2, eps = 92.5 deg, mean latitude errs by
{{S0-PATH-arc60-1.2-92.5/mean-eps:.0f}}" and {{S0-PATH-arc60-1.2-92.5/mean-k:.1e}}, on an L by
{{S0-PATH-L45+45-1.2-92.5/mean-eps:.0f}}", and the exact chord errs alike ({{S0-PATH-arc60-1.2-92.5/rhumb-eps:.0f}}",
{{S0-PATH-L45+45-1.2-92.5/rhumb-eps:.0f}}"). With an odometer that is nearly right (k = 1.02, eps = 1 deg) the L still costs
{{S0-PATH-L45+45-1.02-1/mean-k:.1e}} of scale.

**What loxo does instead.** The rhumb chord, exact on straight lines (to rounding: below 1e-7" and 1e-12), and where there is a log,
replay through the whole of it: no route error on any of the routes above (below 1e-9). The heading model
is asked for: on a log whose heading the dead reckoning kept itself, the rhumb chord errs by {{H2-chords/rhumb:.2f}}" on 11.2 km and the
geodesic chord by less than 0.001". Error bars come with it: {{U-10km/k:.2e}} and {{U-10km/eps:.2f}}" from 0.1 m at either
end of 10 km.

**The open question** (conclusion 3: large steps at high latitude). Steps of 100 m by the start latitude lose {{S0-DR:.3f}} m over 90 km
at 55 N, midpoint steps {{midpoint-100m:.1e}} m. At 85 N with steps of 1 km: {{start-latitude-1km-85:.0f}} m and
{{midpoint-1km-85:.3f}} m; loxo's rhumb steps are exact to rounding at any latitude.
)md";

}  // namespace

Paper yu2023(const Options& o) {
  Paper paper;
  paper.name = "yu2023";
  paper.title = "calibration from end points";
  paper.reference =
      "Yu and Peng 2023: mean latitude against start latitude in the calibration of an odometer's "
      "scale and mounting angle (in Chinese). WGS84; the paper names no ellipsoid.";
  Book book(paper, kClaims);
  const Setting s{o.model.of(wgs84()), o.model.angle_sign};
  const auto at = [&](double x) {
    if (o.progress) o.progress(x);
  };
  one_line(s, book);
  formulas(s, book, paper);
  at(0.1);
  sets(s, o, book, paper);
  at(0.6);
  exact_chord(s, book);
  routes(s, book, paper);
  at(0.8);
  heading_models(s, book, paper);
  steps(s, book, paper);
  uncertainty(s, book);
  // As the paper numbers them.
  std::stable_sort(paper.figures.begin(), paper.figures.end(),
                   [](const Figure& a, const Figure& b) { return a.id < b.id; });
  book.close(kPage);
  at(1);
  return paper;
}

}  // namespace loxo::papers
