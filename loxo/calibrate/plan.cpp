// SPDX-License-Identifier: Apache-2.0
#include "loxo/calibrate/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/calibrate/two_point.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr double kShortest = 50;          // m, the whole way
constexpr std::size_t kStepsPerLeg = 48;  // enough for the integrals of (V-43): 1e-4 of them

double wanted(const PlanRequest& r, State s) {
  return s == State::kScale ? r.ln_k_std : s == State::kAngle ? r.eps_std : 0.0;
}

// How far a plan is from what is wanted: at most 1 where reached.
double excess(const PlanRequest& r, const ExpectedAccuracy& a, State s) {
  const double want = wanted(r, s);
  if (!(want > 0)) return 0;
  return a.std(index(s)) / want;
}
double excess(const PlanRequest& r, const ExpectedAccuracy& a) {
  return std::max(excess(r, a, State::kScale), excess(r, a, State::kAngle));
}

// A length at which the calibration makes sense at all: chords of ten sigma (vehicle.md 2).
bool usable(const PlanRequest& r, const PlanShape& shape, double leg) {
  return leg / static_cast<double>(shape.per_leg) >= minimum_chord(r.benchmark_std);
}

}  // namespace

std::vector<PlanShape> plan_shapes(std::size_t benchmarks) {
  const std::pair<const char*, std::vector<double>> ways[] = {
      {"straight", {0}},
      {"there and back", {0, kPi}},
      {"L", {0, kPi / 2}},
      {"triangle", {0, 2 * kPi / 3, 4 * kPi / 3}},
      {"square", {0, kPi / 2, kPi, 3 * kPi / 2}},
  };
  std::vector<PlanShape> out;
  for (const auto& [name, turns] : ways)
    for (std::size_t per_leg = 1; per_leg * turns.size() <= benchmarks; per_leg *= 2)
      out.push_back({name, turns, per_leg});
  return out;
}

PlannedTrack planned_track(const PlanRequest& r, const PlanShape& shape, double leg,
                           std::size_t steps_per_leg) {
  PlannedTrack out;
  // Benchmarks stand at whole steps.
  std::size_t n = steps_per_leg;
  if (n == 0) n = static_cast<std::size_t>(std::ceil(leg / (r.speed * r.interval) - 1e-9));
  n = std::max(n, shape.per_leg);
  n = (n + shape.per_leg - 1) / shape.per_leg * shape.per_leg;
  const double ds = leg / static_cast<double>(n);
  out.start.lat = r.latitude;
  out.start.std = r.benchmark_std;
  out.start.std_h = r.height_std;
  out.start.row = 0;
  auto at = reckon_start(r.latitude, 0.0);
  double way = 0;
  for (const double turn : shape.turns) {
    const double heading = wrap_2pi(r.course + turn);
    for (std::size_t i = 1; i <= n; ++i) {
      TrackStep s;
      s.ds = ds;
      s.heading = heading;
      way += ds;
      s.t = way / r.speed;
      s.row = static_cast<std::uint32_t>(out.steps.size() + 1);
      out.steps.push_back(s);
      step_exact(*r.ellipsoid, at, ds * std::cos(heading), ds * std::sin(heading), 0.0);
      if (i % (n / shape.per_leg) != 0) continue;
      Benchmark b = out.start;
      b.lat = at.lat + at.lat_low;
      b.lon = at.lon + at.lon_low;
      b.t = s.t;
      b.row = static_cast<std::ptrdiff_t>(out.steps.size());
      out.benchmarks.push_back(b);
      out.rows.push_back(out.steps.size());
    }
    // The body still points along its leg when the benchmark at its end is passed.
    TrackStep rest = out.steps.back();
    rest.ds = 0;
    out.steps.push_back(rest);
  }
  return out;
}

ExpectedAccuracy plan_accuracy(const PlanRequest& r, const PlanShape& shape, double leg) {
  const auto planned = planned_track(r, shape, leg, kStepsPerLeg);
  RecordedTrack track;
  track.ellipsoid = r.ellipsoid;
  track.steps = planned.steps;
  // White errors come with each row of the log: the same sum of squares from longer steps.
  TrackErrorModel errors = r.errors;
  const double fewer = std::sqrt(std::min(r.speed * r.interval, leg) / planned.steps.front().ds);
  errors.scale_noise *= fewer;
  errors.side_slip *= fewer;
  return expected_accuracy(track, planned.start, planned.benchmarks, planned.rows, errors,
                           r.estimate);
}

StraightStd straight_std(const PlanRequest& r, double length) {
  const auto& e = r.errors;
  const double d2 = length * length, t = length / r.speed;
  const double rows = std::max(1.0, length / (r.speed * r.interval));
  const double ends = 2 * r.benchmark_std * r.benchmark_std / d2;
  const double squares = 1.0 / rows;  // SUM ds^2 / D^2
  StraightStd s;
  // (V-44), (V-45)
  s.ln_k = std::sqrt(ends + e.quantisation * e.quantisation / (6 * d2) +
                     e.scale_noise * e.scale_noise * squares);
  s.eps = std::sqrt(
      ends + e.heading_bias * e.heading_bias + e.heading_drift * e.heading_drift * t * t / 4 +
      e.heading_noise * e.heading_noise * t / 3 + e.side_slip * e.side_slip * squares);
  return s;
}

Plan shortest_plan(const PlanRequest& r, const PlanShape& shape) {
  Plan p;
  p.shape = shape;
  const auto legs = static_cast<double>(shape.turns.size());
  const double longest = r.longest / legs;
  // Ten lengths a decade, then halving between the last that misses and the first that reaches.
  struct Best {
    double leg = 0, excess = INFINITY;
    ExpectedAccuracy accuracy;
  };
  Best least_k, least_eps, least_both;
  double before = 0, found = 0;
  std::string unobservable;
  for (double leg = kShortest / legs;; leg = std::min(leg * 1.2589254117941673, longest)) {
    if (usable(r, shape, leg)) {
      auto a = plan_accuracy(r, shape, leg);
      if (!a.unobservable.empty()) {
        unobservable = a.unobservable.front();
      } else {
        const auto keep = [&](Best& best, double value) {
          if (value < best.excess) best = {leg, value, a};
        };
        keep(least_k, excess(r, a, State::kScale));
        keep(least_eps, excess(r, a, State::kAngle));
        keep(least_both, excess(r, a));
        if (excess(r, a) <= 1) {
          found = leg;
          break;
        }
        before = leg;
      }
    }
    if (leg >= longest) break;
  }
  const auto finish = [&](double leg, ExpectedAccuracy accuracy) {
    p.leg = leg;
    p.way = leg * legs;
    p.duration = p.way / r.speed;
    p.accuracy = std::move(accuracy);
  };
  if (found > 0) {
    double reached = found;
    if (before > 0)
      for (int i = 0; i < 20 && reached - before > 1e-3 * reached; ++i) {
        const double mid = 0.5 * (before + reached);
        const auto a = plan_accuracy(r, shape, mid);
        (a.unobservable.empty() && excess(r, a) <= 1 ? reached : before) = mid;
      }
    p.reached = true;
    finish(reached, plan_accuracy(r, shape, reached));
  } else if (least_both.leg > 0) {
    // The one that cannot be had at any length; else the two want different lengths.
    const bool k_never = least_k.excess > 1, eps_never = least_eps.excess > 1;
    const bool by_angle = eps_never && (!k_never || least_eps.excess >= least_k.excess);
    const Best& best = by_angle ? least_eps : k_never ? least_k : least_both;
    p.missed = by_angle || (!k_never && excess(r, best.accuracy, State::kAngle) > 1)
                   ? State::kAngle
                   : State::kScale;
    finish(best.leg, best.accuracy);
    const auto& parts = p.accuracy.sources[index(p.missed)];
    const auto lead =
        static_cast<std::size_t>(std::max_element(parts.begin(), parts.end()) - parts.begin());
    const double std = p.accuracy.std(index(p.missed));
    p.why = fmt::format("{} {} at best, with legs of {:.3g} km: {:.0f} % of its variance is {}",
                        p.missed == State::kAngle ? "eps" : "k",
                        p.missed == State::kAngle ? fmt::format("{:.3g}\"", std / arcsec)
                                                  : fmt::format("{:.3g}", std),
                        p.leg / km, 100 * parts[lead] / (std * std),
                        source_words(static_cast<ErrorSource>(lead)));
    if (!k_never && !eps_never) p.why += "; k and eps want different lengths";
  } else {
    p.why = unobservable.empty()
                ? fmt::format("shorter than {:.3g} m between benchmarks, which their std forbids",
                              minimum_chord(r.benchmark_std))
                : unobservable;
  }
  if (p.leg > 0) {
    if (shape.turns.size() == 1) {
      // Largest over all courses, as nobody chooses a road by it (V-20b).
      for (int c = 0; c < 72; ++c) {
        const auto b = mean_latitude_bias(*r.ellipsoid, r.latitude, p.leg, c * 5 * deg,
                                          r.expected_k, r.expected_eps);
        p.formula_ln_k = std::fmax(p.formula_ln_k, std::fabs(b.ln_k));
        p.formula_eps = std::fmax(p.formula_eps, std::fabs(b.eps));
      }
    }
    double n = 0, e = 0, area = 0;
    for (const double turn : shape.turns) {
      const double dn = p.leg * std::cos(r.course + turn), de = p.leg * std::sin(r.course + turn);
      area += (n + 0.5 * dn) * de;
      n += dn;
      e += de;
    }
    area -= 0.5 * n * e;
    if (std::hypot(n, e) > 1e-3 * p.leg) {
      const auto b = route_bias(*r.ellipsoid, r.latitude, area, n, e, r.expected_k, r.expected_eps);
      p.route_ln_k = b.ln_k;
      p.route_eps = b.eps;
    }
  }
  return p;
}

std::vector<Plan> plan_drives(const PlanRequest& r) {
  std::vector<Plan> out;
  for (const auto& shape : plan_shapes(r.benchmarks)) out.push_back(shortest_plan(r, shape));
  std::stable_sort(out.begin(), out.end(), [](const Plan& a, const Plan& b) {
    if (a.reached != b.reached) return a.reached;
    return a.reached && a.way < b.way;
  });
  return out;
}

}  // namespace loxo
