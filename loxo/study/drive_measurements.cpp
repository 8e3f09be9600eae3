// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/drive_measurements.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

template <class T>
void sort_by_time(std::vector<T>& v, const char* what, Diagnostics& d) {
  long wrong = 0;
  for (std::size_t i = 1; i < v.size(); ++i) wrong += v[i].t < v[i - 1].t;
  if (wrong == 0) return;
  d.warn("out_of_order", what,
         fmt::format("{} rows stand before an earlier one; sorted by time", wrong));
  std::stable_sort(v.begin(), v.end(), [](const T& a, const T& b) { return a.t < b.t; });
}

void check_sigma(double s, const std::string& where) {
  if (given(s) && !(s > 0 && s < 1e8))
    throw Error(ErrorKind::kInput,
                fmt::format("expected a positive standard deviation (below 1e8), found {}", s),
                where);
}

}  // namespace

bool wanted(const FilterOptions& o, const char* name) {
  if (std::find(o.without.begin(), o.without.end(), name) != o.without.end()) return false;
  return o.only.empty() || std::find(o.only.begin(), o.only.end(), name) != o.only.end();
}

double median(std::vector<double> v) {
  if (v.empty()) return kNone;
  const auto mid = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), mid, v.end());
  return *mid;
}

namespace {

// From second differences, which know no speed and no acceleration: their median, as slips and the
// ends of a dead encoder are few. Between readings more than a quarter of a second apart too much
// happens.
double reading_scatter(const std::vector<OdometerTick>& ticks) {
  constexpr double kLongest = 0.25;
  std::vector<double> off;
  for (std::size_t i = 2; i < ticks.size(); ++i) {
    const OdometerTick &a = ticks[i - 2], &b = ticks[i - 1], &c = ticks[i];
    const double first = b.t - a.t, second = c.t - b.t;
    if (a.is_speed || !(second > 0 && second <= kLongest) ||
        std::fabs(first - second) > 0.1 * second)
      continue;
    if (a.value != 0 || b.value != 0 || c.value != 0)
      off.push_back(std::fabs(a.value - 2 * b.value + c.value));
  }
  return off.size() < 100 ? 0.0 : median(std::move(off)) / (0.6745 * std::sqrt(6.0));
}

}  // namespace

DriveMeasurements read_measurements(const Drive& drive, const FilterOptions& o, Diagnostics& d) {
  DriveMeasurements m;
  check_sigma(drive.fix_std, drive.fix.where + ".errors.position");
  check_sigma(drive.fix_velocity_std, drive.fix.where + ".errors.velocity");
  check_sigma(drive.heading_std, drive.heading.where + ".errors.heading");
  check_sigma(drive.height_std, drive.height.where + ".errors.height");
  check_sigma(drive.velocity_std, drive.velocity.where + ".errors.velocity");
  if (drive.odometer.present) {
    m.ticks = read_odometer(drive, d);
    std::vector<double> steps;
    bool negative = false;
    for (std::size_t i = 0; i < m.ticks.size(); ++i) {
      if (i > 0 && i < 2000) steps.push_back(m.ticks[i].t - m.ticks[i - 1].t);
      negative = negative || m.ticks[i].value < 0;
    }
    double sum = 0, time = 0;
    for (std::size_t i = 1; i < m.ticks.size(); ++i) {
      const double v = std::fabs(m.ticks[i].value), dt = m.ticks[i].t - m.ticks[i - 1].t;
      if (m.ticks[i].is_speed && v > StandstillConfig{}.wheel_quiet) sum += v * dt, time += dt;
    }
    if (time > 0) m.mean_speed = sum / time;
    double way = 0;
    for (const OdometerTick& t : m.ticks) way += t.is_speed ? 0.0 : std::fabs(t.value);
    if (m.ticks.size() > 1) m.mean_way = way / std::max(1e-3, m.ticks.back().t - m.ticks[0].t);
    m.tick_interval = median(steps);
    m.scatter = reading_scatter(m.ticks);
    m.unsigned_wheel = !negative;
  }
  if (drive.fix.present && wanted(o, "fixes")) {
    m.fixes = read_fixes(drive, d);
    m.fixes_wanted = true;
    std::vector<double> steps, sds;
    long without = 0, replaced = 0;
    for (std::size_t i = 0; i < m.fixes.size(); ++i) {
      Fix& f = m.fixes[i];
      if (i > 0) steps.push_back(f.t - m.fixes[i - 1].t);
      for (double* s : {&f.std_e, &f.std_n, &f.std_u}) {
        if (!(*s > 0)) {
          if (given(drive.fix_std)) {
            *s = drive.fix_std;
            replaced += s == &f.std_e;
          } else {
            *s = 5.0;
            without += s == &f.std_e;
          }
        }
      }
      sds.push_back(f.std_e);
    }
    if (without > 0)
      d.warn("no_covariance", "fix",
             fmt::format("{} fixes carry no standard deviation and the section declares none "
                         "(errors.position): 5 m is taken",
                         without));
    if (replaced > 0)
      d.warn("no_covariance", "fix",
             fmt::format("{} fixes carry no standard deviation (none, nan or 0): the section's "
                         "{:.3g} m is taken",
                         replaced, drive.fix_std));
    m.sparse_fixes = median(steps) >= 60.0;
  }
  m.all_fixes = m.fixes;
  // The thinning that the user asked for.
  std::vector<Fix> kept;
  double last = -1e300;
  for (Fix f : m.fixes) {
    bool out = false;
    for (const auto& [begin, length] : o.outages)
      out = out || (f.t >= begin && f.t < begin + length);
    if (out) continue;
    if (f.t > o.fixes_until || (o.fix_every > 0 && !std::isfinite(o.fixes_until))) {
      if (o.fix_every <= 0 ||
          f.t < std::max(last, std::isfinite(o.fixes_until) ? o.fixes_until : -1e300) + o.fix_every)
        continue;
      f.ve = f.vn = f.vu = kNone;
    }
    last = f.t;
    kept.push_back(f);
  }
  m.fixes = std::move(kept);
  if (wanted(o, "benchmarks"))
    for (const NamedBenchmark& b : drive.benchmarks) {
      if (!given(b.point.t)) continue;
      if (b.point.std < 0)
        throw Error(ErrorKind::kInput, "std of a benchmark must not be negative",
                    "benchmark " + b.name);
      Fix f;
      f.t = b.point.t;
      f.lat = b.point.lat;
      f.lon = b.point.lon;
      f.std_e = f.std_n =
          std::max(b.point.std, 0.05);  // a stamp is never better than a few centimetres of way
      f.std_u = b.point.std_h > 0 ? b.point.std_h : f.std_e;
      f.h = b.point.h != 0 ? b.point.h : kNone;
      m.benchmarks.push_back(f);
    }
  sort_by_time(m.benchmarks, "benchmark", d);
  if (drive.heading.present && wanted(o, "headings")) {
    m.headings = read_headings(drive, d);
  }
  if (drive.height.present && wanted(o, "heights") &&
      (o.vertical.empty() || o.vertical == "external")) {
    m.heights = read_heights(drive, d);
  }
  if (drive.velocity.present && wanted(o, "velocity")) {
    m.velocities = read_velocities(drive, d);
  }
  return m;
}

}  // namespace loxo
