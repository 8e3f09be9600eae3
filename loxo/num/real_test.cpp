// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "loxo/num/geometry.hpp"

namespace {
struct A {};
struct B {};
using namespace loxo;

TEST(Geometry, ExpRotationAgreesWithMatrixAtEveryAngle) {
  for (double angle : {0.0, 1e-12, 1e-3, 0.0999, 0.1001, 1.0, 3.0}) {
    const auto q = exp_rotation<A, B, double>({0.0, 0.0, angle});
    const auto c = to_matrix(q);
    EXPECT_NEAR(c.m[0][0], std::cos(angle), 4e-16);
    EXPECT_NEAR(c.m[1][0], std::sin(angle), 4e-16);
    const auto back = to_quaternion(c);
    EXPECT_NEAR(back.z, q.z, 4e-16);
  }
}
}  // namespace
