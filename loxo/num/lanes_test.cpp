// SPDX-License-Identifier: Apache-2.0
#include "loxo/num/lanes.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "loxo/num/geometry.hpp"

namespace loxo {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kValues[] = {0.0,  -0.0, 1.0, -1.0,  0.1,    -2.5,   1e300, -1e300,
                              kInf, kNan, 3.0, -kInf, 5e-324, 2e-308, 1e16,  -0.5};

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

// Every operation on lanes against the same expression on double, all pairs of values, every lane.
template <class F>
void same_in_every_lane(const char* name, F f) {
  for (double y : kValues)
    for (int i = 0; i < 16; i += 8) {
      const Lanes r = f(Lanes::load(kValues + i), Lanes(y));
      for (int k = 0; k < 8; ++k)
        EXPECT_TRUE(same_bits(r.lane(k), f(kValues[i + k], y)))
            << name << "(" << kValues[i + k] << ", " << y << ")";
    }
}
#define LAW(expression)                                \
  same_in_every_lane(#expression, [](auto x, auto y) { \
    using S = decltype(x);                             \
    (void)y;                                           \
    return S(expression);                              \
  })

TEST(Lanes, ArithmeticHasTheBitsOfDouble) {
  LAW(x + y);
  LAW(x - y);
  LAW(x * y);
  LAW(x / y);
  LAW(-x);
  LAW(2.0 * x + y / 3.0 - 1.0);
  LAW(x * y + x);  // must not fuse
  LAW(sqrt(x));
  LAW(fabs(x));
  LAW(floor(x));
  LAW(copysign(x, y));
  LAW(min(x, y));
  LAW(max(x, y));
  same_in_every_lane("compound", [](auto x, auto y) {
    auto r = x;
    r += y;
    r *= y;
    r -= x;
    r /= y;
    return r;
  });
}

TEST(Lanes, ComparisonsAndSelectHaveTheMeaningOfDouble) {
  LAW(select(x < y, S(1.0), S(2.0)));
  LAW(select(x <= y, S(1.0), S(2.0)));
  LAW(select(x > y, S(1.0), S(2.0)));
  LAW(select(x >= y, S(1.0), S(2.0)));
  LAW(select(x == y, S(1.0), S(2.0)));
  LAW(select(x != y, S(1.0), S(2.0)));
  LAW(select(!(x < y), x, y));
  LAW(select((x < y) & (y > 0.0), x, y));
  LAW(select((x < y) | (y > 0.0), x, y));
  LAW(select(MaskOf<S>(true), x, y));
  LAW(select(MaskOf<S>(false), x, y));
}

TEST(Lanes, AnyAllAndElements) {
  Lanes x(1.0);
  EXPECT_FALSE(any(x < 0.0));
  EXPECT_TRUE(all(x > 0.0));
  for (int k = 0; k < 8; ++k) {
    Lanes y(1.0);
    y.set_lane(k, -3.0);
    for (int j = 0; j < 8; ++j) {
      EXPECT_EQ(y.lane(j), j == k ? -3.0 : 1.0);
      EXPECT_EQ((y < 0.0).lane(j), j == k);
    }
    EXPECT_TRUE(any(y < 0.0));
    EXPECT_FALSE(all(y > 0.0));
    EXPECT_TRUE(any(y > 0.0));
  }
}

struct A {};
struct B {};
// The carriers of geometry.hpp: a rotation in lanes is eight rotations.
TEST(Lanes, GeometryHasTheBitsOfDouble) {
  Vec<B, Lanes> phi{Lanes::load(kValues), 0.25, -1.5};
  const auto v = to_matrix(exp_rotation<A, B, Lanes>(phi)) * (2.0 * phi);
  const auto q = to_quaternion(to_matrix(exp_rotation<A, B, Lanes>(phi)));
  for (int k = 0; k < 8; ++k) {
    const Vec<B, double> p{kValues[k], 0.25, -1.5};
    const auto c = to_matrix(exp_rotation<A, B, double>(p));
    const auto w = c * (2.0 * p);
    const auto r = to_quaternion(c);
    EXPECT_TRUE(same_bits(v.x.lane(k), w.x) && same_bits(v.y.lane(k), w.y) &&
                same_bits(v.z.lane(k), w.z))
        << k;
    EXPECT_TRUE(same_bits(q.w.lane(k), r.w) && same_bits(q.x.lane(k), r.x) &&
                same_bits(q.z.lane(k), r.z))
        << k;
  }
}

}  // namespace
}  // namespace loxo
