// SPDX-License-Identifier: Apache-2.0
#include "loxo/num/rotation_forms.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

struct A {};
struct B {};
constexpr double kEps = std::numeric_limits<double>::epsilon();

// There by exp_rotation and back, of the quaternion and its negative: none, far below what squares
// can hold, tiny, small, about the threshold, any, nearly half a turn.
TEST(RotationVector, IsTheInverseOfTheExponential) {
  std::mt19937_64 rng(testing::seed());
  std::normal_distribution<double> g;
  for (const double size : {0.0, 1e-300, 1e-20, 1.9e-12, 2.1e-12, 1e-6, 0.05, 1.0, 3.0, kPi - 1e-9})
    for (int i = 0; i < 50; ++i) {
      Vec<A> axis{g(rng), g(rng), g(rng)};
      axis = axis * (1 / norm(axis));
      const Vec<A> phi = size * axis;
      const Quat<A, A> q = exp_rotation<A, A>(phi);
      for (const double sign : {1.0, -1.0}) {
        const Vec<A> back =
            rotation_vector(Quat<A, A>{sign * q.w, sign * q.x, sign * q.y, sign * q.z});
        // A dozen operations, relative to the vector.
        EXPECT_LE(std::max({std::fabs(back.x - phi.x), std::fabs(back.y - phi.y),
                            std::fabs(back.z - phi.z)}),
                  12 * kEps * size)
            << size << ' ' << sign;
      }
    }
}

TEST(RotationVector, LanesAreTheBitsOfDoubles) {
  std::mt19937_64 rng(testing::seed());
  std::normal_distribution<double> g;
  double c[4][8];
  Quat<A, A> q[8];
  for (int k = 0; k < 8; ++k) {
    const double size = k == 0 ? 0.0 : std::pow(10.0, 2.0 * (k - 7));
    q[k] = exp_rotation<A, A>(size * Vec<A>{g(rng), g(rng), g(rng)});
    c[0][k] = q[k].w, c[1][k] = q[k].x, c[2][k] = q[k].y, c[3][k] = q[k].z;
  }
  const Vec<A, Lanes> all = rotation_vector(Quat<A, A, Lanes>{
      Lanes::load(c[0]), Lanes::load(c[1]), Lanes::load(c[2]), Lanes::load(c[3])});
  double x[8], y[8], z[8];
  all.x.store(x), all.y.store(y), all.z.store(z);
  for (int k = 0; k < 8; ++k) {
    const Vec<A> one = rotation_vector(q[k]);
    EXPECT_EQ(x[k], one.x) << k;
    EXPECT_EQ(y[k], one.y) << k;
    EXPECT_EQ(z[k], one.z) << k;
  }
}

// Each axis of A, told in B, is a unit vector of A.
TEST(FromAxes, AxesComeOutAsUnitVectors) {
  const Vec<B> x{0.6, 0.0, 0.8}, y{0.0, 1.0, 0.0}, z{-0.8, 0.0, 0.6};
  const Rot<A, B> C = from_axes<A>(x, y, z);
  const Vec<B> axes[3] = {x, y, z};
  for (int i = 0; i < 3; ++i) {
    const Vec<A> e = C * axes[i];
    EXPECT_NEAR(e.x, i == 0, kEps);
    EXPECT_NEAR(e.y, i == 1, kEps);
    EXPECT_NEAR(e.z, i == 2, kEps);
  }
}

}  // namespace
}  // namespace loxo
