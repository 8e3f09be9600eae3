// SPDX-License-Identifier: Apache-2.0
// Oracle: the 64-bit-mantissa libm, an ulp of which is 1/2048 of ours. Lanes against double: the
// same bits.
#include "loxo/num/functions.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include "loxo/num/lanes.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kTiny = std::numeric_limits<double>::denorm_min();
constexpr double kMax = std::numeric_limits<double>::max();

using One = double (*)(double);
using OneLanes = Lanes (*)(const Lanes&);
using Exact = long double (*)(long double);

std::uint64_t seed() { return testing::seed(20261123); }

// Distance of `ours` from `exact` in ulps of the double nearest to `exact`.
double ulps(double ours, long double exact) {
  const auto near = static_cast<double>(exact);
  if (std::isnan(near)) return std::isnan(ours) ? 0.0 : kInf;
  if (std::isnan(ours)) return kInf;
  if (std::isinf(near) || std::isinf(ours)) {
    if (near == ours) return 0.0;
    // Just at the threshold of overflow either is within an ulp.
    return std::fabs(near) == kMax || std::fabs(ours) == kMax ? 1.0 : kInf;
  }
  if (near == 0.0 && ours == 0.0) return std::signbit(near) == std::signbit(ours) ? 0.0 : kInf;
  const double size = std::fabs(near);
  const double ulp =
      size == kMax ? size - std::nextafter(size, 0.0) : std::nextafter(size, kInf) - size;
  return static_cast<double>(std::fabs(static_cast<long double>(ours) - exact) /
                             static_cast<long double>(ulp));
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

struct Case {
  const char* name;
  One f;
  OneLanes lanes;
  Exact exact;
  double from, to;  // range of the uniform points
  double measured;  // largest error seen over 10^7 points, ulp; the tests allow kMargin more
};
constexpr double kMargin = 0.05;

#define CASE(name, from, to, measured)                                 \
  Case {                                                               \
#name, static_cast < One>(name), static_cast < OneLanes>(name),    \
        [](long double x) { return std::name(x); }, from, to, measured \
  }
const Case kCases[] = {
    CASE(sin, -10.0, 10.0, 0.78),  CASE(cos, -10.0, 10.0, 0.78), CASE(tan, -10.0, 10.0, 1.00),
    CASE(asin, -1.0, 1.0, 0.68),   CASE(acos, -1.0, 1.0, 0.66),  CASE(atan, -10.0, 10.0, 0.65),
    CASE(exp, -20.0, 20.0, 0.82),  CASE(expm1, -3.0, 3.0, 0.60), CASE(log, 0.01, 10.0, 0.83),
    CASE(log1p, -0.9, 3.0, 0.85),  CASE(sinh, -5.0, 5.0, 0.58),  CASE(cosh, -5.0, 5.0, 0.55),
    CASE(tanh, -3.0, 3.0, 0.57),   CASE(asinh, -5.0, 5.0, 0.83), CASE(atanh, -1.0, 1.0, 0.86),
    CASE(round, -10.0, 10.0, 0.0),
};
#undef CASE

bool trig(const Case& c) {
  const std::string n = c.name;
  return n == "sin" || n == "cos" || n == "tan";
}

// Uniform points, points of every size, the neighbourhood of every hard place, and the ends.
std::vector<double> points(const Case& c, std::size_t count, std::uint64_t s) {
  std::mt19937_64 gen(s);
  std::vector<double> x;
  std::uniform_real_distribution<double> flat(c.from, c.to), power(-1074.0, 1024.0),
      near(-60.0, 6.0);
  for (std::size_t i = 0; i < count; ++i) x.push_back(flat(gen));
  for (std::size_t i = 0; i < count / 4; ++i) {
    const double sign = gen() & 1 ? 1.0 : -1.0;
    x.push_back(sign * std::exp2(near(gen)));
    x.push_back(sign * std::exp2(power(gen)));
    // Close to multiples of pi/4 and of ln 2, the places of cancellation.
    const auto n = static_cast<double>(static_cast<std::int64_t>(gen() % 260000) - 130000);
    x.push_back(std::nextafter(n * (kTrigDomain > 0 ? 0.78539816339744830962 : 0.0), sign * kInf));
    x.push_back(n * 0.78539816339744830962);
    x.push_back((n / 200.0) * 0.69314718055994530942);
    x.push_back(1e5 * (2.0 * (static_cast<double>(gen() >> 11) * 0x1p-53) - 1.0));
    x.push_back(sign * (1.0 - std::exp2(near(gen) - 6.0)));
  }
  for (double h : {0.0,
                   0.25,
                   0.41421356237309503,
                   0.41421356237309510,
                   0.5,
                   0.7071067811865475,
                   0.7071067811865476,
                   1.0,
                   1.4142135623730949,
                   1.4142135623730951,
                   2.0,
                   2.414213562373095,
                   2.5,
                   22.0,
                   36.0,
                   40.0,
                   0.49999999999999994,
                   708.0,
                   709.78,
                   709.782712893384,
                   710.0,
                   710.4758600739439,
                   711.0,
                   745.0,
                   745.13321910194122,
                   746.0,
                   1e8,
                   0x1p28,
                   0x1p52,
                   0x1p53,
                   0x1p500,
                   0x1p1000,
                   kMax,
                   0x1p-1022,
                   kTiny,
                   kInf})
    for (double sign : {1.0, -1.0}) {
      x.push_back(sign * h);
      x.push_back(sign * std::nextafter(h, 0.0));
      x.push_back(sign * std::nextafter(h, kInf));
    }
  x.push_back(kNan);
  return x;
}

TEST(Functions, AgreeWithLongDoubleToUlpsStated) {
  const std::size_t count = std::getenv("LOXO_LONG") ? 10000000 : 60000;
  for (const Case& c : kCases) {
    double worst = 0, at = 0;
    for (double x : points(c, count, seed())) {
      if (trig(c) && !(std::fabs(x) <= kTrigDomain)) {
        EXPECT_TRUE(std::isnan(c.f(x))) << c.name << "(" << x << ")";
        continue;
      }
      const double e = ulps(c.f(x), c.exact(x));
      if (e > worst) worst = e, at = x;
    }
    RecordProperty(c.name, std::to_string(worst));
    if (std::getenv("LOXO_LONG")) std::printf("%-6s %.4f ulp at %.17g\n", c.name, worst, at);
    EXPECT_LE(worst, c.measured + kMargin)
        << c.name << "(" << std::hexfloat << at << "), seed " << seed();
  }
}

TEST(Functions, TwoArgumentsAgreeWithLongDouble) {
  std::mt19937_64 gen(seed());
  std::uniform_real_distribution<double> flat(-1.0, 1.0), power(-300.0, 300.0), near(-3.0, 3.0);
  double worst_angle = 0, worst_size = 0;
  const std::size_t count = std::getenv("LOXO_LONG") ? 10000000 : 200000;
  for (std::size_t i = 0; i < count; ++i) {
    const double k = i % 3 == 0 ? 1.0 : std::pow(10.0, i % 3 == 1 ? near(gen) : power(gen));
    const double y = flat(gen), x = flat(gen) * k;
    const double ea =
        ulps(atan2(y, x), std::atan2(static_cast<long double>(y), static_cast<long double>(x)));
    const double es =
        ulps(hypot(y, x), std::hypot(static_cast<long double>(y), static_cast<long double>(x)));
    worst_angle = std::max(worst_angle, ea);
    worst_size = std::max(worst_size, es);
  }
  if (std::getenv("LOXO_LONG"))
    std::printf("atan2 %.4f ulp, hypot %.4f ulp\n", worst_angle, worst_size);
  EXPECT_LE(worst_angle, 0.67 + kMargin) << "seed " << seed();
  EXPECT_LE(worst_size, 0.51 + kMargin) << "seed " << seed();
}

TEST(Functions, Atan2AndHypotKeepEveryRuleOfC) {
  const double ends[] = {0.0,  -0.0,  1.0,   -1.0,   3.0,  kTiny, -kTiny, 0x1p-1022,
                         kMax, -kMax, 1e300, 1e-300, kInf, -kInf, kNan};
  for (double y : ends)
    for (double x : ends) {
      EXPECT_LE(
          ulps(atan2(y, x), std::atan2(static_cast<long double>(y), static_cast<long double>(x))),
          1.0)
          << y << " " << x;
      EXPECT_LE(
          ulps(hypot(y, x), std::hypot(static_cast<long double>(y), static_cast<long double>(x))),
          1.0)
          << y << " " << x;
    }
}

TEST(Functions, SincosIsSinAndCos) {
  for (double x : {0.0, -0.0, 1e-300, 0.5, -2.0, 99.0, -1e7, 2e8, kInf, kNan}) {
    double s, c;
    sincos(x, s, c);
    EXPECT_TRUE(same_bits(s, sin(x)));
    EXPECT_TRUE(same_bits(c, cos(x)));
  }
}

TEST(Functions, IntegersConvertToDouble) {
  EXPECT_EQ(sin(1), sin(1.0));
  EXPECT_EQ(atan2(1, 2), atan2(1.0, 2.0));
  EXPECT_EQ(sqrt(2), sqrt(2.0));
}

TEST(Functions, WrappedAnglesAreTheSameAnglesInRange) {
  std::mt19937_64 gen(seed());
  std::uniform_real_distribution<double> flat(-1e5, 1e5);
  constexpr double kPi = 3.14159265358979323846;
  std::vector<double> x{0.0,
                        kPi,
                        -kPi,
                        2 * kPi,
                        -2 * kPi,
                        std::nextafter(kPi, 4.0),
                        std::nextafter(-kPi, -4.0),
                        -1e-300,
                        3 * kPi};
  for (int i = 0; i < 100000; ++i) x.push_back(flat(gen));
  for (double v : x) {
    const double a = wrap_pi(v), b = wrap_2pi(v);
    EXPECT_GT(a, -kPi);
    EXPECT_LE(a, kPi);
    EXPECT_GE(b, 0.0);
    EXPECT_LT(b, 2 * kPi);
    const auto exact =
        std::remainder(static_cast<long double>(v), 2 * 3.141592653589793238462643383279502884L);
    // Error of 2 pi in 64 bits over 16000 turns, and half an ulp of the result.
    const double tolerance = 16000 * 7e-19 + 4.5e-16;
    EXPECT_NEAR(std::remainder(static_cast<double>(a - exact), 2 * kPi), 0.0, tolerance) << v;
    EXPECT_NEAR(std::remainder(static_cast<double>(b - exact), 2 * kPi), 0.0, 2 * tolerance) << v;
  }
  EXPECT_TRUE(std::isnan(wrap_pi(kInf)));
}

TEST(Functions, LaneKHasTheBitsOfDouble) {
  for (const Case& c : kCases) {
    auto x = points(c, 20000, seed());
    while (x.size() % 8) x.push_back(0.0);
    for (std::size_t i = 0; i < x.size(); i += 8) {
      double out[8];
      c.lanes(Lanes::load(&x[i])).store(out);
      for (int k = 0; k < 8; ++k)
        ASSERT_TRUE(same_bits(out[k], c.f(x[i + static_cast<std::size_t>(k)])))
            << c.name << "(" << x[i + static_cast<std::size_t>(k)] << ") lane " << k;
    }
  }
}

TEST(Functions, LaneKOfTwoArgumentsHasTheBitsOfDouble) {
  const double ends[] = {0.0,  -0.0,  1.0,   -1.0,   0.3,  -7.0,  kTiny, 0x1p-1022,
                         kMax, -kMax, 1e300, 1e-300, kInf, -kInf, kNan,  2e-8};
  for (double y : ends)
    for (std::size_t i = 0; i < 16; i += 8)
      for (int k = 0; k < 8; ++k) {
        const double x = ends[i + static_cast<std::size_t>(k)];
        const Lanes lx = Lanes::load(&ends[i]);
        EXPECT_TRUE(same_bits(atan2(Lanes(y), lx).lane(k), atan2(y, x))) << y << " " << x;
        EXPECT_TRUE(same_bits(hypot(Lanes(y), lx).lane(k), hypot(y, x))) << y << " " << x;
        EXPECT_TRUE(same_bits(wrap_pi(lx).lane(k), wrap_pi(x))) << x;
        EXPECT_TRUE(same_bits(wrap_2pi(lx).lane(k), wrap_2pi(x))) << x;
        Lanes s, c;
        sincos(lx, s, c);
        EXPECT_TRUE(same_bits(s.lane(k), sin(x)));
        EXPECT_TRUE(same_bits(c.lane(k), cos(x)));
      }
}

}  // namespace
}  // namespace loxo
