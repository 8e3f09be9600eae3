// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/coarse_odometer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/num/units.hpp"
#include "loxo/study/filter_settings.hpp"

namespace loxo {
namespace {

// Over a window: what the wheel's speed changed by, in its own unit, and the IMU's right and
// forward integrals, m/s.
struct SpeedChange {
  double dv = 0, x = 0, y = 0;
  bool follows = false;  // the window before ends where this one begins
};

// Windows of two seconds in motion without a turn, four minutes of them at most.
std::vector<SpeedChange> speed_changes(const Drive& drive, const std::vector<OdometerTick>& ticks,
                                       double t0, Diagnostics& d) {
  std::vector<SpeedChange> rows;
  if (ticks.size() < 10) return rows;
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
  // At rest a wheel with noise tells a speed as well; whatever its unit, it is a small one.
  std::vector<double> speeds;
  for (std::size_t j = 1; j < ticks.size(); ++j)
    speeds.push_back(std::fabs(ticks[j].value) /
                     (ticks[j].is_speed ? 1.0 : std::max(ticks[j].t - ticks[j - 1].t, 1e-6)));
  const auto fast = speeds.begin() + static_cast<std::ptrdiff_t>(speeds.size() * 19 / 20);
  std::nth_element(speeds.begin(), fast, speeds.end());
  const double slow = 0.1 * *fast;
  double begin = kNone, v0 = kNone, x = 0, y = 0, turn = 0, moving = 0;
  bool follows = false;
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
        (std::fabs(v0) > slow || std::fabs(v1) > slow)) {
      rows.push_back({v1 - v0, x, y, follows});
      moving += kWindow;
      follows = true;
    } else {
      follows = false;
    }
    begin = s.t, v0 = v1, x = y = turn = 0;
  }
  return rows;
}

// dv = k (along u): forward is the direction whose acceleration goes with the speed. The wheel's
// noise shortens (xv, yv) and does not turn it; what happens across matters for its scatter only.
struct SpeedLine {
  double n = 0, ux = 0, uy = 0, k = 0;
  double c = 0, pp = 0, pv = 0, vv = 0, aside = 0;  // sums of products, means taken off

  double left(const SpeedChange& r) const { return r.dv - k * (ux * r.x + uy * r.y); }
  // Takes the means off the rows. False: too few, or nothing in them.
  bool fit(std::vector<SpeedChange>& rows) {
    constexpr std::size_t kFewest = 8;
    if (rows.size() < kFewest) return false;
    n = static_cast<double>(rows.size());
    SpeedChange mean;
    for (const auto& r : rows) mean.dv += r.dv / n, mean.x += r.x / n, mean.y += r.y / n;
    double xv = 0, yv = 0;
    vv = pp = pv = aside = 0;
    for (auto& r : rows) {
      r.dv -= mean.dv, r.x -= mean.x, r.y -= mean.y;
      xv += r.x * r.dv, yv += r.y * r.dv, vv += r.dv * r.dv;
    }
    c = std::hypot(xv, yv);
    if (!(c > 0)) return false;
    ux = xv / c, uy = yv / c;
    for (const auto& r : rows) {
      const double p = ux * r.x + uy * r.y, q = uy * r.x - ux * r.y;
      pp += p * p, pv += p * r.dv, aside += q * q;
    }
    k = pv / pp;
    return true;
  }
  // Rows far off the line: an encoder dies and wakes.
  void drop_far(std::vector<SpeedChange>& rows) const {
    std::vector<double> off;
    double largest = 0;
    for (const auto& r : rows) {
      off.push_back(std::fabs(left(r)));
      largest = std::max(largest, std::fabs(r.dv));
    }
    const double far = 4 * std::max(1.4826 * median(off), 0.1 * largest);
    for (std::size_t j = rows.size(); j-- > 0;)
      if (off[j] > far) {
        rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(j));
        if (j < rows.size()) rows[j].follows = false;
      }
  }
};

// Scale, mounting heading and noise of the odometer, coarsely: enough to see a wrong unit or an IMU
// mounted across or backward.
struct CoarseOdometer {
  bool found = false;
  double k = 1, k_std = 0, eps = 0, eps_std = 0, explained = 0;
  double noise = 0;  // m/s, of the wheel's mean speed over a second
};
CoarseOdometer coarse_odometer(std::vector<SpeedChange> rows) {
  CoarseOdometer out;
  SpeedLine line;
  if (!line.fit(rows)) return out;
  line.drop_far(rows);
  if (!line.fit(rows)) return out;
  const double n = line.n, k = line.k, vv = line.vv;
  const double s2 = std::max(vv - line.pv * line.pv / line.pp, 0.0) / (n - 3),
               along = s2 / (line.pp * k * k);
  // What is left is the wheel's, or the road's in the IMU (slopes). The noise of a speed ends one
  // window and begins the next, so the wheel's part is correlated by -1/2; slopes make the slope of
  // the line too small, the wheel's noise does not.
  double next = 0;
  long pairs = 0;
  for (std::size_t j = 1; j < rows.size(); ++j)
    if (rows[j].follows) {
      next += line.left(rows[j - 1]) * line.left(rows[j]);
      ++pairs;
    }
  const double wheel =
      pairs > 0 ? std::clamp(-2 * next / static_cast<double>(pairs), 0.0, s2) : 0.0;
  const double told = vv / n - wheel;
  if (!(told > 0)) return out;
  out.explained = 1 - (s2 - wheel) / told;
  out.eps = std::atan2(-line.ux, line.uy);
  out.eps_std = std::sqrt(line.aside / (n - 2) * vv) / line.c;
  // A line by chance has k^2/variance above 20 once in 20,000; a poor one says nothing either.
  out.found = 20 * along < 1 && out.explained > 0.3 && out.eps_std < 15 * deg;
  if (!out.found) return out;
  out.k = k / out.explained;
  out.noise = std::sqrt(0.5 * wheel);
  // How well line and noise are told apart, and 2 % for slopes that keep in step with the speed.
  const double share = 2 * s2 / (std::sqrt(n) * told);
  out.k_std = out.k * std::sqrt(along + share * share + 4e-4);
  return out;
}

}  // namespace

void coarse_check(const Drive& drive, const DriveMeasurements& m, const FilterOptions& o,
                  double first_t, NavigatorConfig& config, std::map<std::string, std::string>& meta,
                  Diagnostics& d) {
  if (config.use_odometer && !o.calibrated) {
    const CoarseOdometer c =
        coarse_odometer(speed_changes(drive, m.ticks, or_else(drive.start.t, first_t), d));
    // A slow wheel's noise is seen beside the IMU only (a fast one's: take_scatter).
    if (c.found && m.scatter == 0 && !m.ticks.front().is_speed && given(m.tick_interval)) {
      const double dt = m.tick_interval;
      take_scatter(c.noise * (dt < 1 ? std::sqrt(dt) : dt), m.mean_way * dt, config, meta, d);
    }
    if (c.found)
      meta["coarse_odometer"] = fmt::format("k {:.2f}, mounting {:.0f} deg, {:.0f} % explained",
                                            c.k, c.eps / deg, 100 * c.explained);
    if (c.found && std::fabs(wrap_pi(c.eps - config.eps_h)) > std::max(25 * deg, 4 * c.eps_std)) {
      d.warn("mounting", "odometer.mounting",
             fmt::format("the IMU's acceleration says that its forward axis stands {:.0f} deg from "
                         "the vehicle's (declared {:.0f} deg){}: taken as the start value",
                         c.eps / deg, config.eps_h / deg,
                         std::fabs(wrap_pi(c.eps - config.eps_h)) > 150 * deg
                             ? ", or the wheel counts backward"
                             : ""));
      config.eps_h = c.eps;
      config.eps_std = std::max(10 * deg, 2 * c.eps_std);
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
