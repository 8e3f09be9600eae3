// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/coarse_odometer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// Scale and mounting heading of the odometer, coarsely, from how its speed changes with the IMU's
// own acceleration over two seconds: enough to see a wrong unit or an IMU mounted across or
// backward.
struct CoarseOdometer {
  bool found = false;
  double k = 1, k_std = 0, eps = 0, explained = 0;
  int windows = 0;
};
CoarseOdometer coarse_odometer(const Drive& drive, const std::vector<OdometerTick>& ticks,
                               double t0, Diagnostics& d) {
  CoarseOdometer out;
  if (ticks.size() < 10) return out;
  constexpr double kWindow = 2.0;
  ImuReader reader(drive, d);
  ImuIncrement<double> s;
  std::size_t i = 0;
  auto speed_at = [&](double t) {  // mean speed over the second about t
    while (i + 1 < ticks.size() && ticks[i].t < t - 0.5) ++i;
    double sum = 0, weight = 0;
    for (std::size_t j = i; j < ticks.size() && ticks[j].t <= t + 0.5; ++j) {
      if (ticks[j].is_speed) {
        sum += ticks[j].value;
        weight += 1;
      } else if (j > 0) {
        sum += ticks[j].value;
        weight += ticks[j].t - ticks[j - 1].t;
      }
    }
    return weight > 0 ? sum / weight : kNone;
  };
  double begin = kNone, v0 = kNone, x = 0, y = 0, turn = 0, moving = 0;
  struct Row {
    double dv, x, y;
  };
  std::vector<Row> rows;
  while (reader.next(s) && moving < 240) {
    if (s.t < t0) continue;
    if (!given(begin)) {
      begin = s.t;
      v0 = speed_at(s.t);
      x = y = turn = 0;
      continue;
    }
    x += s.dv.x, y += s.dv.y, turn += s.dtheta.z;
    if (s.t < begin + kWindow) continue;
    const double v1 = speed_at(s.t);
    if (given(v0) && given(v1) && std::fabs(turn) < 0.1 &&
        (std::fabs(v0) > 0 || std::fabs(v1) > 0)) {
      rows.push_back({v1 - v0, x, y});
      moving += kWindow;
    }
    begin = s.t, v0 = v1, x = y = turn = 0;
  }
  if (rows.size() < 15) return out;
  Row mean{0, 0, 0};
  for (const Row& r : rows) mean.dv += r.dv, mean.x += r.x, mean.y += r.y;
  const auto n = static_cast<double>(rows.size());
  double xx = 0, xy = 0, yy = 0, xv = 0, yv = 0, vv = 0;
  for (const Row& r : rows) {
    const double v = r.dv - mean.dv / n, a = r.x - mean.x / n, b = r.y - mean.y / n;
    xx += a * a, xy += a * b, yy += b * b, xv += a * v, yv += b * v, vv += v * v;
  }
  // Total along the direction that explains the speed: slope by the axis of the correlation, k =
  // speed change / IMU change.
  const double cx = xv, cy = yv, c = std::hypot(cx, cy);
  if (!(c > 0) || !(vv > 0)) return out;
  const double ux = cx / c, uy = cy / c, uu = ux * ux * xx + 2 * ux * uy * xy + uy * uy * yy,
               uv = ux * xv + uy * yv;
  out.explained = uv * uv / (uu * vv);
  out.k = std::sqrt(vv / uu);
  // Of the slope's scatter, and 2 % for slopes of the road and gravity's part in them.
  out.k_std = out.k * std::sqrt((1 - out.explained) / (out.explained * n) + 4e-4);
  out.eps = std::atan2(-ux, uy);
  out.windows = static_cast<int>(rows.size());
  out.found = out.explained > 0.5 && uu / n > 0.05;  // of the IMU: any unit of the wheel
  return out;
}

}  // namespace

void coarse_check(const Drive& drive, const DriveMeasurements& m, const FilterOptions& o,
                  double first_t, NavigatorConfig& config, std::map<std::string, std::string>& meta,
                  Diagnostics& d) {
  if (config.use_odometer && !o.calibrated) {
    const CoarseOdometer c = coarse_odometer(drive, m.ticks, or_else(drive.start.t, first_t), d);
    if (c.found)
      meta["coarse_odometer"] = fmt::format("k {:.2f}, mounting {:.0f} deg, {:.0f} % explained",
                                            c.k, c.eps / deg, 100 * c.explained);
    if (c.found && std::fabs(wrap_pi(c.eps - config.eps_h)) > 25 * deg) {
      d.warn("mounting", "odometer.mounting",
             fmt::format("the IMU's acceleration says that its forward axis stands {:.0f} deg from "
                         "the vehicle's (declared {:.0f} deg){}: taken as the start value",
                         c.eps / deg, config.eps_h / deg,
                         std::fabs(wrap_pi(c.eps - config.eps_h)) > 150 * deg
                             ? ", or the wheel counts backward"
                             : ""));
      config.eps_h = c.eps;
      config.eps_std = 10 * deg;
    }
    if (c.found && (c.k > 1.4 || c.k < 0.7)) {
      static constexpr std::pair<double, const char*> units[] = {
          {3.6, "km/h read as m/s"},    {1 / 3.6, "m/s read as km/h"},
          {2.23694, "mph read as m/s"}, {1.94384, "knots read as m/s"},
          {1000.0, "mm read as m"},     {100.0, "cm read as m"},
          {0.01, "m read as cm"},       {0.001, "km read as m, or m as mm"},
          {3.28084, "ft read as m"},    {0.3048, "m read as ft"}};
      const char* best = "unit or metres per pulse wrong";
      double nearest = 0.2;
      for (const auto& [factor, text] : units)
        if (std::fabs(std::log(c.k / factor)) < nearest)
          nearest = std::fabs(std::log(c.k / factor)), best = text;
      // One reading after the other: a speed told as a way is its rate times too large.
      const double per_second =
          given(m.tick_interval) && m.tick_interval > 0 ? 1 / m.tick_interval : 0.0;
      if (!m.ticks.front().is_speed && per_second > 1.5 &&
          std::fabs(std::log(c.k / per_second)) < nearest)
        best = "a speed declared as a distance";
      d.bad("odometer_unit", "odometer.units",
            fmt::format("the IMU's acceleration says that the odometer shows {:.3g} times the true "
                        "speed ({}?); taken as the start value",
                        c.k, best));
      config.scale_walk *= c.k / config.scale;
      config.scale = c.k;
      config.scale_std = 0.1 * c.k;
      config.standstill.wheel_quiet *= c.k;  // of what it shows
    } else if (c.found &&
               std::fabs(c.k - config.scale) > 3 * std::hypot(config.scale_std, c.k_std)) {
      d.warn(
          "odometer_scale", "odometer",
          fmt::format("the IMU's acceleration says that the odometer shows {:.2f} times the true "
                      "way (expected {:.2f} +- {:.2f}); taken as the start value, +- {:.2f}",
                      c.k, config.scale, config.scale_std, 2 * c.k_std));
      config.scale_walk *= c.k / config.scale;
      config.scale = c.k;
      config.scale_std = std::max(config.scale_std, 2 * c.k_std);
    }
  }
}

}  // namespace loxo
