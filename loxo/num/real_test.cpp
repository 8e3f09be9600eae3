// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "loxo/num/geometry.hpp"

namespace {
struct A {};
struct B {};
using namespace loxo;

TEST(Geometry, ExpRotationAgreesWithMatrixAtEveryAngle) {
  // 1 - 2 z^2: an error of z (1 u, u = 2^-53) thrice in z^2 with its own rounding, doubled; then
  // one more.
  constexpr double kTolerance = 8 * 0x1p-53;
  for (double angle : {0.0, 1e-12, 1e-3, 0.0999, 0.1001, 1.0, 3.0}) {
    const auto q = exp_rotation<A, B, double>({0.0, 0.0, angle});
    const auto c = to_matrix(q);
    EXPECT_NEAR(c.m[0][0], std::cos(angle), kTolerance);
    EXPECT_NEAR(c.m[1][0], std::sin(angle), kTolerance);
    const auto back = to_quaternion(c);
    EXPECT_NEAR(back.z, q.z, kTolerance);
  }
}
}  // namespace
