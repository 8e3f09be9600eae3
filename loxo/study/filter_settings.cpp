// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/filter_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/num/units.hpp"

namespace loxo {

NavigatorConfig settings_of(const Drive& drive, const FilterOptions& o, double imu_interval,
                            double odometer_interval, bool odometer_is_speed, double mean_speed,
                            std::map<std::string, std::string>& meta) {
  NavigatorConfig c;
  c.ellipsoid = drive.ellipsoid;
  c.imu_interval = imu_interval;
  c.late_limit = 0;  // a drive's measurements are sorted: nothing is late
  const ImuErrors& e = drive.imu_errors;
  // Undeclared sensors are taken for tactical ones; that is told.
  c.gyro_noise = or_else(e.gyro_noise, 0.1 * deg_per_sqrt_h);
  c.accel_noise = or_else(e.accel_noise, 0.05 * mps_per_sqrt_h);
  c.gyro_bias = or_else(e.gyro_bias, 1.0 * deg_per_h);
  c.accel_bias = or_else(e.accel_bias, 1.0 * mg);
  c.gyro_bias_tau = or_else(e.gyro_bias_tau, 3600.0);
  c.accel_bias_tau = or_else(e.accel_bias_tau, 3600.0);
  c.gyro_scale = or_else(e.gyro_scale, c.gyro_bias < 0.1 * deg_per_h ? 1e-5 : 1e-4);
  c.accel_scale = or_else(e.accel_scale, 0.0);
  c.use_odometer = drive.odometer.present && wanted(o, "odometer");
  c.use_nhc = wanted(o, "nhc") && o.vertical != "ship" &&
              (drive.odometer.present || !drive.velocity.present);
  c.use_zupt = wanted(o, "zupt") && o.vertical != "ship";
  c.use_zaru = wanted(o, "zaru") && o.vertical != "ship";
  const OdometerErrors& oe = drive.odometer_errors;
  c.scale_std = or_else(oe.scale, 0.03);
  c.eps_h = drive.odometer_mounting_heading;
  c.eps_p = drive.odometer_mounting_pitch;
  if (o.calibrated) {
    c.scale = o.k;
    if (given(o.k_std)) c.scale_std = std::max(o.k_std, 1e-6);
    c.eps_h = o.eps;
    if (given(o.eps_std)) c.eps_std = std::max(o.eps_std, 1e-6);
  }
  for (int i = 0; i < 3; ++i) c.lever[i] = drive.odometer_lever[i];
  c.lever_std = drive.odometer_lever_given ? 0.02 : drive.fix.present ? 1.0 : 0.3;
  // The delay is a state where the logger has a clock of its own: a speed over a bus, or five
  // readings a second or fewer.
  const bool own_clock =
      odometer_is_speed || (given(odometer_interval) && odometer_interval >= 0.1999);
  if (own_clock) {
    c.tau_std = drive.odometer.delay != 0 ? 0.3 : 0.5;
    c.tau_walk = given(odometer_interval) && odometer_interval >= 0.1999 ? 3e-3 : 0.0;
  }
  c.stamp_jitter = odometer_is_speed && given(odometer_interval) && odometer_interval < 0.2 ? 0.02
                   : odometer_is_speed                                                      ? 0.1
                                                                                            : 0.0;
  c.quantisation =
      or_else(oe.quantisation, drive.odometer_kind == "pulses" || drive.odometer_kind == "counter"
                                   ? drive.odometer_scale
                                   : 0.0);
  if (odometer_is_speed && given(oe.speed_quantisation) && mean_speed > 0) {
    // A reading in whole units is rounded (mean error 0) or cut (half a unit too small): one sigma
    // spans both.
    c.speed_quantum = oe.speed_quantisation;
    c.offset_std = 0.5 * oe.speed_quantisation;
    c.offset_speed = mean_speed;
    meta["speed_offset"] =
        fmt::format("a state: +- {:.3g} m/s, k holds at {:.3g} m/s", c.offset_std, c.offset_speed);
  }
  c.scale_noise = or_else(oe.scale_noise, odometer_is_speed ? 0.0 : 1e-3);
  c.reading_noise = or_else(oe.noise, 0.0);
  c.way_noise = or_else(oe.distance_noise, 0.0);
  c.slip_noise = or_else(oe.side_slip, 0.0);
  if (odometer_is_speed && given(oe.speed_noise))  // the figure is for 1 Hz
    c.speed_std =
        std::max(oe.speed_noise * std::sqrt(std::min(1.0, or_else(odometer_interval, 1.0))), 0.01);
  c.nhc_epoch = std::max(0.1, 10 * imu_interval);
  if (!c.use_odometer) {  // nothing but the constraint holds the drive: wide
    c.nhc_side = 0.05;
    c.nhc_up = 0.1;
    c.nhc_turn = 0.1;
  }
  for (int i = 0; i < 3; ++i) c.fix_lever[i] = drive.fix_lever[i];
  c.fix_velocity_std = or_else(drive.fix_velocity_std, 0.1);
  // Constants that are sought only where a drive declares how far off they may be.
  c.fix_lever_std = drive.fix.present ? or_else(drive.fix_lever_std, 0.0) : 0.0;
  c.height_bias_std = drive.height.present ? or_else(drive.height_bias, 0.0) : 0.0;
  // As a walk that makes the declared bias anew in the declared time; without one it lasts.
  if (given(drive.height_bias_tau) && c.height_bias_std > 0)
    c.height_bias_walk = c.height_bias_std * std::sqrt(2 / drive.height_bias_tau);
  c.heading_bias_std =
      drive.heading.present ? or_else(drive.attitude_errors.heading_bias, 0.0) : 0.0;
  c.gyro_misalignment = or_else(e.gyro_misalignment, 0.0);
  c.heading_std = or_else(drive.heading_std, 0.5 * deg);
  c.height_std = or_else(drive.height_std, 5.0);
  c.velocity_std = or_else(drive.velocity_std, 0.1);
  if (o.vertical == "fixed") c.vertical_std = 0.1;
  if (o.vertical == "ship") c.vertical_std = 3.0;
  expect_noise(c.standstill, c.gyro_noise, c.accel_noise, imu_interval);
  c.product_epoch = std::max(o.output_period > 0 ? o.output_period : imu_interval, 0.1);
  meta["gyro_noise_deg_sqrt_h"] = fmt::format("{:.4g}{}", c.gyro_noise / deg_per_sqrt_h,
                                              given(e.gyro_noise) ? "" : " (assumed)");
  meta["gyro_bias_deg_h"] =
      fmt::format("{:.4g}{}", c.gyro_bias / deg_per_h, given(e.gyro_bias) ? "" : " (assumed)");
  meta["accel_noise_mps_sqrt_h"] = fmt::format("{:.4g}{}", c.accel_noise / mps_per_sqrt_h,
                                               given(e.accel_noise) ? "" : " (assumed)");
  meta["accel_bias_ug"] =
      fmt::format("{:.4g}{}", c.accel_bias / ug, given(e.accel_bias) ? "" : " (assumed)");
  return c;
}

void take_scatter(double scatter, double way, NavigatorConfig& c,
                  std::map<std::string, std::string>& meta, Diagnostics& d) {
  if (!(scatter > 0)) return;
  const double relative = c.scale_noise * way;
  // Rounding to q shows as q sqrt(20/12)/sqrt(6) in second differences.
  const double rounding = c.quantisation * c.quantisation * (20.0 / 12 / 6);
  const double declared =
      relative * relative + c.reading_noise * c.reading_noise + c.way_noise * c.way_noise * way;
  constexpr double kSlight = 0.003;  // m: a tenth of what an epoch allows for anyway
  const double seen = scatter * scatter - rounding;
  if (!(seen > 4 * declared + kSlight * kSlight + rounding)) return;
  d.warn("reading_noise", "odometer",
         fmt::format("the readings scatter by {:.2g} m each, {:.2g} m is declared (errors.noise): "
                     "what they show is taken",
                     std::sqrt(seen), std::sqrt(declared)));
  c.reading_noise = std::sqrt(seen);
  meta["reading_noise_m"] = fmt::format("{:.3g} (seen)", c.reading_noise);
}

}  // namespace loxo
