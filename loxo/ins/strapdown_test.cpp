// SPDX-License-Identifier: Apache-2.0
// Laws of the strapdown room: all mechanizations agree in ECEF, and their disagreement falls with
// dt^2.
#include "loxo/ins/strapdown.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <random>

#include "loxo/ins/closed_form_truth.hpp"
#include "loxo/ins/handover.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

using truth::Motion;

Motion over_the_pole(const Ellipsoid& ell, double seconds, double speed, double side = 1) {
  // Half the time before the pole, half behind it; along the meridians 25 E and 155 W.
  auto m = truth::great_circle(ell, side * 90 * deg, 25 * deg, 0, speed);
  m.arc0 = -0.5 * seconds * m.rate;
  return m;
}

enum class Height { kFree, kAided };

struct Outcome {
  double position = 0, attitude = 0, velocity = 0;
};

template <class M>
Outcome navigate(const Motion& m, const std::vector<ImuIncrement<double>>& imu, Height height,
                 double lon0 = 0, int n = 2) {
  const auto earth = make_earth_model(m.ell, lon0);
  auto x = M::from_ecef(earth, m.at(0).state);
  double t = 0;
  for (std::size_t i = 0; i + static_cast<std::size_t>(n) <= imu.size();
       i += static_cast<std::size_t>(n)) {
    x = step(earth, x, combine(&imu[i], n));
    t = imu[i + static_cast<std::size_t>(n) - 1].t;
    if (height == Height::kAided) {
      const double w = 2 * kPi / m.heave_period;
      x = constrained(x, m.h0 + m.heave * std::sin(w * t), m.heave * w * std::cos(w * t));
    }
  }
  const auto end = M::to_ecef(earth, x);
  const auto truth = m.at(t).state;
  return {truth::position_error(end, truth), truth::attitude_error(end, truth),
          norm(end.v - truth.v)};
}

// The gyro and force increments of a real instrument never see this: the specification's [NAV-T]
// and [NAV-TA], with the limits.
constexpr double kPositionLimit = 1e-4, kAttitudeLimit = 1e-4 * arcsec, kFreeLimit = 0.05;

class OverThePole : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    motion = new Motion(over_the_pole(wgs84(), 3600, 10));
    imu = new std::vector<ImuIncrement<double>>(motion->record(0.01, 360000));
  }
  static void TearDownTestSuite() {
    delete motion;
    delete imu;
  }
  template <class M>
  static void meets(const char* name) {
    const auto a = navigate<M>(*motion, *imu, Height::kAided);
    std::printf("%s: %.2g m, %.2g arcsec\n", name, a.position, a.attitude / arcsec);
    EXPECT_LT(a.position, kPositionLimit) << name;
    EXPECT_LT(a.attitude, kAttitudeLimit) << name;
    const auto f = navigate<M>(*motion, *imu, Height::kFree);
    std::printf("%s, free vertical: %.2g m\n", name, f.position);
    EXPECT_LT(f.position, kFreeLimit) << name;
  }
  static Motion* motion;
  static std::vector<ImuIncrement<double>>* imu;
};
Motion* OverThePole::motion = nullptr;
std::vector<ImuIncrement<double>>* OverThePole::imu = nullptr;

// [NAV-T] [NAV-TA] [NAV-TF]: one hour exactly over the pole at 100 Hz.
TEST_F(OverThePole, TransverseReturnsTheTruth) { meets<TransverseMechanization>("transverse"); }
TEST_F(OverThePole, VirtualSphereReturnsTheTruth) {
  meets<VirtualSphereMechanization>("virtual sphere");
}
TEST_F(OverThePole, GridReturnsTheTruth) { meets<GridMechanization>("grid"); }
TEST_F(OverThePole, WanderReturnsTheTruth) { meets<WanderMechanization>("wander"); }
TEST_F(OverThePole, EcefReturnsTheTruth) { meets<EcefMechanization>("ecef"); }
}  // namespace
}  // namespace loxo
