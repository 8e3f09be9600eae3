// SPDX-License-Identifier: Apache-2.0
// Units as factors to SI: `0.003 * deg_per_h` is rad/s. Text with a unit is read by text/quantity.
#pragma once
#include <numbers>

namespace loxo {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double deg = kPi / 180.0;
inline constexpr double arcmin = deg / 60.0;
inline constexpr double arcsec = deg / 3600.0;
inline constexpr double mrad = 1e-3;
inline constexpr double mil = 2.0 * kPi / 6400.0;  // NATO mil, 6400 to the turn
inline constexpr double km = 1e3;
inline constexpr double minute = 60.0;
inline constexpr double hour = 3600.0;
inline constexpr double deg_per_h = deg / hour;
inline constexpr double deg_per_s = deg;
inline constexpr double deg_per_sqrt_h = deg / 60.0;  // angle random walk, rad/sqrt(s)
inline constexpr double g_standard = 9.80665;
inline constexpr double mg = 1e-3 * g_standard;
inline constexpr double ug = 1e-6 * g_standard;
inline constexpr double ug_per_sqrt_hz = ug;
inline constexpr double mps_per_sqrt_h = 1.0 / 60.0;  // velocity random walk, m/s/sqrt(s)
inline constexpr double knot = 1852.0 / 3600.0;

}  // namespace loxo
