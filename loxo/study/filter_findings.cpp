// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/filter_findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/earth/geodetic.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

template <class T>
void tell_unused(const char* section, bool present, const std::vector<T>& v, const RunFacts& run,
                 Diagnostics& d) {
  if (!present) return;
  if (v.empty()) {
    d.warn("no_readings", section, "the section gives no reading that could be used");
    return;
  }
  const double begin = std::round(run.first_t * 1e6) * 1e-6;  // without the rounding of t - dt
  const auto outside = std::count_if(v.begin(), v.end(), [&](const T& x) {
    return x.t < run.first_t - 1.0 || x.t > run.end + 1.0;
  });
  // What a filter that gave up has not come to is no fault of the readings.
  if (!run.gave_up && 2 * outside > static_cast<std::ptrdiff_t>(v.size()))
    d.warn("outside", section,
           fmt::format("{} of {} readings ({:.6g} to {:.6g} s) lie outside the time of the IMU "
                       "({:.6g} to {:.6g} s) and are not used: unit or origin of the time wrong?",
                       outside, v.size(), v.front().t, v.back().t, begin, run.end));
}

void tell_innovations(const FilterResult& r, Diagnostics& d) {
  for (const SensorReport& s : r.sensors) {
    const InnovationCount& c = s.count;
    const long all = c.used + c.deweighted + c.rejected;
    // The wheel's, and single fixes', are told as slip, skid, outlier or wrong stamp.
    if (s.name != "odometer" && c.rejected > 5 && 10 * c.rejected > all)
      d.warn("rejected", s.name,
             fmt::format("{} of {} measurements contradict the rest and are left out{}", c.rejected,
                         all,
                         2 * c.rejected > all ? ": axes, unit, sign or stated sigma wrong?" : ""));
    // One in twenty is expected beyond two sigma; single gross errors make no half.
    if (all >= 20 && c.above_95_share() > 0.5)
      d.warn("optimistic", s.name,
             fmt::format("{:.0f} % of the innovations are beyond 95 % of what the stated sigmas "
                         "allow: the sensor's sigma is too small, or it contradicts the others",
                         100 * c.above_95_share()));
  }
}

std::string benchmark_at(const Drive& drive, double t) {
  const NamedBenchmark* best = nullptr;
  for (const NamedBenchmark& b : drive.benchmarks)
    if (given(b.point.t) && (!best || std::fabs(b.point.t - t) < std::fabs(best->point.t - t)))
      best = &b;
  return best ? best->name : std::string();
}

}  // namespace

void refuse_swapped_fixes(const Drive& drive, const std::vector<Fix>& fixes) {
  double lat = drive.start.lat, lon = drive.start.lon;
  if (drive.start.has_state) {
    const double* r = drive.start.r;
    const Geodetic<double> g = to_geodetic(drive.ellipsoid, Point<Ecef>{r[0], r[1], r[2]});
    lat = g.lat, lon = g.lon;
  }
  if (!given(lat) && !drive.benchmarks.empty())
    lat = drive.benchmarks.front().point.lat, lon = drive.benchmarks.front().point.lon;
  if (!given(lat) || fixes.size() < 3) return;
  const auto away = [&](double a, double b) {
    return norm(to_ecef(drive.ellipsoid, Geodetic<double>{a, b, 0}) -
                to_ecef(drive.ellipsoid, Geodetic<double>{lat, lon, 0}));
  };
  std::vector<double> as_told, exchanged;
  for (const Fix& f : fixes) {
    as_told.push_back(away(f.lat, f.lon));
    exchanged.push_back(std::fabs(f.lon) <= 0.5 * kPi ? away(f.lon, f.lat) : 1e9);
  }
  const double told = median(as_told), other = median(exchanged);
  // A drive does not lead a thousand kilometres away and back to where an exchange would put it.
  if (told > 1e6 && other < 1e5)
    throw Error(ErrorKind::kInput,
                fmt::format("the fixes lie {:.0f} km from the start, with latitude and longitude "
                            "exchanged {:.0f} km: are the columns exchanged?",
                            told / 1e3, other / 1e3),
                drive.fix.where + ".columns");
}

void tell_findings(const Drive& drive, const DriveMeasurements& m, const NavigatorConfig& config,
                   const FilterResult& out, const RunFacts& run, Diagnostics& d) {
  const Navigator::Events& e = out.events;
  tell_unused("odometer", drive.odometer.present && config.use_odometer, m.ticks, run, d);
  if (drive.odometer.present && !config.use_odometer && m.ticks.empty())
    d.warn("no_readings", "odometer", "the section gives no reading that could be used");
  tell_unused("fix", drive.fix.present && !m.all_fixes.empty(), m.all_fixes, run, d);
  if (drive.fix.present && m.all_fixes.empty() && m.fixes_wanted)
    d.warn("no_readings", "fix", "the section gives no reading that could be used");
  tell_unused("heading", !m.headings.empty(), m.headings, run, d);
  tell_unused("height", !m.heights.empty(), m.heights, run, d);
  tell_unused("velocity", !m.velocities.empty(), m.velocities, run, d);
  for (const NamedBenchmark& b : drive.benchmarks)
    if (given(b.point.t) && !out.diverged &&
        (b.point.t > run.end + 0.1 || b.point.t < run.first_t - 60.0))
      d.warn("outside", "benchmark " + b.name,
             fmt::format("its time {:.6g} s lies outside the drive ({:.6g} to {:.6g} s): not used",
                         b.point.t, std::round(run.first_t * 1e6) * 1e-6, run.end));
  if (run.travelled < 10.0)
    d.warn("no_motion", drive.path,
           fmt::format("the drive moves {:.1f} m in all: constants of the odometer and the "
                       "mounting cannot be observed",
                       run.travelled));
  if (e.gaps > 0)
    d.warn("gap", "imu",
           fmt::format("{} gaps bridged, {} of them above {:.0f} s (after these the sigmas are not "
                       "to be trusted until fixes agree)",
                       e.gaps, e.long_gaps, config.long_gap));
  if (e.dead_encoder > 0)
    d.warn("dead_encoder", "odometer",
           fmt::format("the wheel stood still for {:.0f} s while the IMU moved, first at t = "
                       "{:.1f} s; not read as parked",
                       e.dead_encoder, e.first_dead));
  if (e.slip + e.skid > 0)
    d.warn("slip", "odometer",
           fmt::format("{:.0f} readings too fast (slip) and {:.0f} too slow (skid) left out, first "
                       "at t = {:.1f} s",
                       e.slip, e.skid, e.first_slip));
  if (e.wrong_stamps > 0) {
    const double shift = e.stamp_shift / static_cast<double>(e.wrong_stamps);
    d.warn("wrong_stamp", "fix",
           fmt::format(
               "{} fixes fit only with another stamp (up to 5 s; on the mean {:.1f} s {}), "
               "first at t = {:.1f} s; not used{}",
               e.wrong_stamps, std::fabs(shift), shift > 0 ? "early" : "late", e.first_wrong_stamp,
               e.wrong_stamps > 10 ? "; a constant delay can be declared (fix.delay)" : ""));
  }
  if (e.outlier_fixes > 0)
    d.warn("outlier", "fix", fmt::format("{} fixes outside the gate", e.outlier_fixes));
  if (e.far_benchmarks > 0)
    d.bad("far_benchmark", "benchmark " + benchmark_at(drive, e.first_far),
          fmt::format("{} benchmarks lie far from the track (up to {:.1f} m, beyond five sigma), "
                      "first at t = {:.1f} s; used with reduced weight",
                      e.far_benchmarks, e.far_metres, e.first_far));
  if (e.signs_turned > 0)
    d.note("unsigned_wheel", "odometer",
           fmt::format("{} readings taken as reversing: the wheel has no sign", e.signs_turned));
  if (e.lock_recoveries > 0)
    d.warn("lock_out", "odometer",
           fmt::format("the odometer was rejected for longer than {:.0f} s of motion; the filter "
                       "opened itself {} times",
                       config.lock_time, e.lock_recoveries));
  if (config.use_odometer && run.travelled > 100 &&
      (out.k < 0.5 * config.scale || out.k > 2.0 * config.scale || out.k <= 0))
    d.bad("odometer_scale", "odometer",
          fmt::format("scale k = {:.3f} is far from the {:.3f} it started from: unit or metres per "
                      "pulse wrong?",
                      out.k, config.scale));
  const bool angle_sought = config.use_odometer || config.use_nhc;
  if (angle_sought && run.travelled > 100 &&
      std::fabs(out.eps_h - config.eps_h) > 5 * config.eps_std)
    d.bad("mounting", "odometer.mounting",
          fmt::format("mounting {:.1f} deg is far from the {:.1f} +- {:.1f} deg it started from: "
                      "declare odometer.mounting",
                      out.eps_h / deg, config.eps_h / deg, config.eps_std / deg));
  tell_innovations(out, d);
}

}  // namespace loxo
