// SPDX-License-Identifier: Apache-2.0
// Text with a unit to SI and back: "0.003 deg/h", "1.5deg", "10 ug/sqrt(Hz)", "0.0123 m/pulse",
// "0.1 %".
#pragma once
#include <array>
#include <string>
#include <string_view>

namespace loxo {

// What a number measures. A quantity of the wrong dimension is refused by name.
enum class Dimension {
  kNone,  // a pure number; also %, ppm, 1e-4
  kLength,
  kTime,
  kAngle,
  kSpeed,
  kAcceleration,
  kAngularRate,
  kFrequency,
  kTemperature,
  kAngleRandomWalk,         // rad/sqrt(s): deg/sqrt(h), rad/s/sqrt(Hz), deg/h/sqrt(Hz)
  kVelocityRandomWalk,      // m/s/sqrt(s): m/s/sqrt(h), ug/sqrt(Hz), m/s^2/sqrt(Hz)
  kRateRandomWalk,          // rad/s/sqrt(s): deg/h/sqrt(h)
  kAccelerationRandomWalk,  // m/s^2/sqrt(s)
  kScaleRandomWalk,         // 1/sqrt(s)
  kDistanceRandomWalk,      // m/sqrt(m)
  kLengthPerPulse,
  kGSensitivity /* rad/s per m/s^2: deg/h/g */,
  kRatePerTemperature,
  kAccelPerTemperature,
  kLengthNoise  // m/sqrt(s)
};
std::string_view dimension_name(Dimension d);

// SI value of `text` ("1.5 deg" -> 0.02618). Throws Error(kInput, …, where) for a bare number where
// d needs a unit (0 included, except for kNone), an unknown unit (nearest named), a wrong
// dimension, trailing text, NaN.
double parse_quantity(std::string_view text, Dimension d, std::string_view where);
// Several numbers and one unit at the end: "0.4 -1.2 -0.6 m".
std::array<double, 3> parse_vector3(std::string_view text, Dimension d, std::string_view where);
// SI factor of a unit alone ("deg/s" -> pi/180). Throws Error(kInput) naming the nearest unit.
double unit_factor(std::string_view unit, Dimension d, std::string_view where);
// Dimension of a unit text, or throws.
Dimension unit_dimension(std::string_view unit, std::string_view where);
// Unit in a column's name: "heading_deg" -> "deg", "v_mps" -> "m/s", "dw_x_radps" -> "rad/s", "t_s"
// -> "s"; "" if none.
std::string_view unit_of_column(std::string_view column);

}  // namespace loxo
