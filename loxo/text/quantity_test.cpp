// SPDX-License-Identifier: Apache-2.0
#include "loxo/text/quantity.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "loxo/num/units.hpp"
#include "refusal.hpp"

namespace loxo {
namespace {

std::string message(std::string_view text, Dimension d) {
  return testing::refusal([&] { parse_quantity(text, d, "key a.b"); }, std::string(text));
}

struct Case {
  const char* text;
  Dimension d;
  double si;
};

// Two roundings at most: the factor and the product.
void expect_same(double got, double want, const std::string& what) {
  EXPECT_NEAR(got, want, 4e-16 * std::abs(want)) << what;
}

TEST(Quantity, UnitsAnEngineerWrites) {
  using enum Dimension;
  const double h = 3600, g = 9.80665;
  const Case cases[] = {
      {"55 deg", kAngle, 55 * deg},
      {"55deg", kAngle, 55 * deg},
      {"1.5°", kAngle, 1.5 * deg},
      {"-2 rad", kAngle, -2},
      {"3 mrad", kAngle, 3e-3},
      {"0.5mil", kAngle, 0.5 * 2 * kPi / 6400},
      {"3.6arcmin", kAngle, 0.06 * deg},
      {"3'", kAngle, 0.05 * deg},
      {"7 arcsec", kAngle, 7 * deg / 3600},
      {"7\"", kAngle, 7 * deg / 3600},
      {"45° 30' 36\"", kAngle, 45.51 * deg},
      {"-0° 30' 0\"", kAngle, -0.5 * deg},
      {"1e-3 m", kLength, 1e-3},
      {"90km", kLength, 9e4},
      {"5 cm", kLength, 0.05},
      {"5 mm", kLength, 5e-3},
      {"3 ft", kLength, 0.9144},
      {"2 nmi", kLength, 3704},
      {"1 m/s", kSpeed, 1},
      {"36 km/h", kSpeed, 10},
      {"10 kn", kSpeed, 18520 / h},
      {"10 mph", kSpeed, 4.4704},
      {"2 m/s^2", kAcceleration, 2},
      {"2 m/s²", kAcceleration, 2},
      {"2 m/s2", kAcceleration, 2},
      {"2 m s^-2", kAcceleration, 2},
      {"2 m·s⁻²", kAcceleration, 2},
      {"1 g", kAcceleration, g},
      {"3 mg", kAcceleration, 3e-3 * g},
      {"10ug", kAcceleration, 1e-5 * g},
      {"10 µg", kAcceleration, 1e-5 * g},
      {"10 μg", kAcceleration, 1e-5 * g},
      {"5 mGal", kAcceleration, 5e-5},
      {"0.01deg/h", kAngularRate, 0.01 * deg / h},
      {"0.01 °/h", kAngularRate, 0.01 * deg / h},
      {"3 deg/s", kAngularRate, 3 * deg},
      {"3 rad/s", kAngularRate, 3},
      {"0.003 deg/sqrt(h)", kAngleRandomWalk, 0.003 * deg / 60},
      {"0.003 deg/√h", kAngleRandomWalk, 0.003 * deg / 60},
      {"0.003 °/√(h)", kAngleRandomWalk, 0.003 * deg / 60},
      {"6 deg/h/sqrt(Hz)", kAngleRandomWalk, 6 * deg / h},
      {"6 (deg/h)/√Hz", kAngleRandomWalk, 6 * deg / h},
      {"6 deg/rt-h", kAngleRandomWalk, 6 * deg / 60},
      {"2 rad/sqrt(s)", kAngleRandomWalk, 2},
      {"50 ug/sqrt(Hz)", kVelocityRandomWalk, 50e-6 * g},
      {"0.1 m/s/sqrt(h)", kVelocityRandomWalk, 0.1 / 60},
      {"2 m/s^2/sqrt(Hz)", kVelocityRandomWalk, 2},
      {"0.6 deg/h/sqrt(h)", kRateRandomWalk, 0.6 * deg / h / 60},
      {"6 s", kTime, 6},
      {"6 ms", kTime, 6e-3},
      {"6 us", kTime, 6e-6},
      {"6 min", kTime, 360},
      {"6 h", kTime, 6 * h},
      {"100 Hz", kFrequency, 100},
      {"1 kHz", kFrequency, 1000},
      {"0.1 %", kNone, 1e-3},
      {"300 ppm", kNone, 3e-4},
      {"3 ppb", kNone, 3e-9},
      {"1e-4", kNone, 1e-4},
      {"0.0123 m/pulse", kLengthPerPulse, 0.0123},
      {"12.3 mm/pulse", kLengthPerPulse, 0.0123},
      {"2 deg/h/g", kGSensitivity, 2 * deg / h / g},
      {"5 K", kTemperature, 5},
      {"5 °C", kTemperature, 5},
      {"2 deg/h/K", kRatePerTemperature, 2 * deg / h},
      {"2 deg/h/°C", kRatePerTemperature, 2 * deg / h},
      {"2 ug/K", kAccelPerTemperature, 2e-6 * g},
      {"10 ppm/sqrt(h)", kScaleRandomWalk, 1e-5 / 60},
      {"3 m/sqrt(km)", kDistanceRandomWalk, 3 / std::sqrt(1000.0)},
      {"3 m/sqrt(h)", kLengthNoise, 3 / 60.0},
      {"10 ug/sqrt(h)", kAccelerationRandomWalk, 1e-5 * g / 60},
      {"+1.5 m", kLength, 1.5},
      {"−1.5 m", kLength, -1.5},
      {" 1.5\tm ", kLength, 1.5},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.text);
    double got = 0;
    ASSERT_NO_THROW(got = parse_quantity(c.text, c.d, "here"));
    expect_same(got, c.si, c.text);
  }
}

TEST(Quantity, BareNumberIsRefusedZeroIncluded) {
  for (const char* text : {"5", "0", "0.0", "1e-3"}) {
    EXPECT_NE(message(text, Dimension::kLength).find("has no unit; expected a length"),
              std::string::npos);
  }
  EXPECT_EQ(message("5", Dimension::kAngle).substr(0, 9), "key a.b: ");
}

TEST(Quantity, UnknownUnitNamesTheNearest) {
  EXPECT_NE(message("5 degg", Dimension::kAngle).find("unknown unit 'degg'; did you mean 'deg'?"),
            std::string::npos);
  EXPECT_NE(message("5 deg/sqrt(hz", Dimension::kAngleRandomWalk).find("unknown unit"),
            std::string::npos);
  EXPECT_NE(message("5 m/plse", Dimension::kLengthPerPulse).find("did you mean 'm/pulse'?"),
            std::string::npos);
}

TEST(Quantity, WrongDimensionNamesBoth) {
  const std::string text = message("5 m", Dimension::kAngle);
  EXPECT_NE(text.find("expected an angle"), std::string::npos) << text;
  EXPECT_NE(text.find("a length"), std::string::npos) << text;
  EXPECT_NE(message("5 deg/h", Dimension::kAngleRandomWalk).find("an angular rate"),
            std::string::npos);
}

TEST(Quantity, NonsenseIsRefused) {
  for (const char* text :
       {"", "abc", "deg", "nan deg", "inf m", "5 deg 3", "5,5 deg", "--5 deg", "5 deg/", "5 /deg",
        "5 ((((((((((deg", "1e999 m", "5 deg^9", "5 sqrt(sqrt(s))", "5 m)"}) {
    EXPECT_THROW(parse_quantity(text, Dimension::kAngle, "x"), Error) << text;
    EXPECT_THROW(parse_quantity(text, Dimension::kLength, "x"), Error) << text;
  }
}

TEST(Quantity, Vector) {
  const auto v = parse_vector3("0.4 -1.2 -0.6 m", Dimension::kLength, "x");
  EXPECT_EQ(v[0], 0.4);
  EXPECT_EQ(v[1], -1.2);
  EXPECT_EQ(v[2], -0.6);
  EXPECT_EQ(parse_vector3("1, 2, 3 cm", Dimension::kLength, "x")[2], 0.03);
  for (const char* text : {"1 2 m", "1 2 3", "1 2 3 4 m", "1 2 3 deg", "a b c m"}) {
    EXPECT_THROW(parse_vector3(text, Dimension::kLength, "x"), Error) << text;
  }
}

TEST(Quantity, UnitInAColumnName) {
  const std::pair<const char*, const char*> cases[] = {{"heading_deg", "deg"},
                                                       {"v_mps", "m/s"},
                                                       {"dw_x_radps", "rad/s"},
                                                       {"t_s", "s"},
                                                       {"ax_mps2", "m/s^2"},
                                                       {"ax_g", "g"},
                                                       {"LAT_DEG", "deg"},
                                                       {"gx (deg/s)", "deg/s"},
                                                       {"gx [rad/s]", "rad/s"},
                                                       {"x", ""},
                                                       {"time", ""},
                                                       {"deg", ""},
                                                       {"pulses", ""},
                                                       {"ve_m_s", "m/s"},
                                                       {"a_m_s2", "m/s^2"},
                                                       {"name (old)", ""}};
  for (const auto& [column, unit] : cases) EXPECT_EQ(unit_of_column(column), unit) << column;
}

}  // namespace
}  // namespace loxo
