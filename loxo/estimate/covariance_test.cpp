// SPDX-License-Identifier: Apache-2.0
// The covariance budget against closed forms; against Monte Carlo in study/budget_monte_carlo_test.
#include "loxo/estimate/covariance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/errors/static_response.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

EcefState<double> at(const Ellipsoid& ell, double lat, double lon, double heading, double speed) {
  EcefState<double> x;
  const auto axes = transpose(geographic_axes(lat, lon));
  x.r = to_ecef(ell, Geodetic<double>{lat, lon, 0.0});
  x.v = axes * Vec<Geographic>{speed * std::sin(heading), speed * std::cos(heading), 0.0};
  x.q_eb = to_quaternion(axes * to_matrix<Geographic>(Euler<double>{heading, 0, 0}));
  return x;
}
const SourceVariance& of(const BudgetRow& row, BudgetSource s) {
  return row[static_cast<std::size_t>(s)];
}

// A system at rest with its body on the level axes: every constant source has a closed form
// (polar.md 5.2), sensor noise one too.
TEST(CovarianceBudget, AtRestItIsTheStaticResponse) {
  for (double lat : {-40.0, 30.0, 75.0}) {
    const auto& ell = wgs84();
    BudgetConfig config;
    config.ellipsoid = ell;
    auto& e = config.errors;
    e.gyro_bias = 0.01 * deg_per_h;
    e.accel_bias = 10 * ug;
    e.level = 5 * arcsec;
    e.heading = 60 * arcsec;
    e.velocity = 0.01;
    e.position = 3;
    e.gyro_noise = 0.002 * deg_per_sqrt_h;
    e.accel_noise = 10 * ug;
    CovarianceBudget budget(config);
    const auto x = at(ell, lat * deg, 0.3, 0.0, 0.0);
    budget.start(x);
    const double t = 3600, dt = 0.1;
    for (int i = 0; i < 36000; ++i) budget.step(x, dt);
    const auto row = budget.row();
    const auto site = geographic_site(ell, lat * deg);
    // Sum of squares over the axes of one source.
    const auto sum = [&](std::initializer_list<double StaticInputs::*> slots, double size) {
      SourceVariance v;
      for (auto slot : slots) {
        StaticInputs in;
        in.*slot = size;
        const auto r = static_response(site, in);
        const auto p = r.position(t);
        const auto s = r.at(t);
        v.nn += p[0] * p[0], v.ee += p[1] * p[1], v.en += p[0] * p[1];
        v.vee += s[0] * s[0], v.vnn += s[1] * s[1], v.heading += s[4] * s[4];
      }
      return v;
    };
    const auto near = [&](const SourceVariance& a, const SourceVariance& b, const char* what) {
      // What a step leaves out of the Earth's turn grows by 2 w^2 dt t = 4e-6 of the amplitude.
      const double p = a.ee + a.nn, v = a.vee + a.vnn;
      EXPECT_NEAR(a.ee, b.ee, 2e-5 * p) << what << lat;
      EXPECT_NEAR(a.nn, b.nn, 2e-5 * p) << what << lat;
      EXPECT_NEAR(a.en, b.en, 2e-5 * p) << what << lat;
      EXPECT_NEAR(a.vee, b.vee, 2e-5 * v) << what << lat;
      EXPECT_NEAR(a.vnn, b.vnn, 2e-5 * v) << what << lat;
      EXPECT_NEAR(a.heading, b.heading, 2e-5 * a.heading) << what << lat;
    };
    using I = StaticInputs;
    near(of(row, BudgetSource::kGyroBias), sum({&I::eps_e, &I::eps_n, &I::eps_u}, e.gyro_bias),
         "gyro bias ");
    near(of(row, BudgetSource::kAccelBias), sum({&I::nabla_e, &I::nabla_n}, e.accel_bias),
         "accel bias ");
    near(of(row, BudgetSource::kLevel), sum({&I::phie0, &I::phin0}, e.level), "level ");
    near(of(row, BudgetSource::kHeading), sum({&I::phiu0}, e.heading), "heading ");
    // Its velocity passes zero near here: held against the oscillation's size.
    const auto& moving = of(row, BudgetSource::kStartVelocity);
    const auto closed = sum({&I::dve0, &I::dvn0}, e.velocity);
    EXPECT_NEAR(moving.vee, closed.vee, 1e-5 * e.velocity * e.velocity) << lat;
    EXPECT_NEAR(moving.ee, closed.ee, 2e-5 * closed.ee) << lat;
    const auto noise = static_noise_covariance(site, 0, e.gyro_noise * e.gyro_noise, t);
    EXPECT_NEAR(of(row, BudgetSource::kGyroNoise).vee / noise[0], 1, 1e-4) << lat;
    EXPECT_NEAR(of(row, BudgetSource::kGyroNoise).vnn / noise[8], 1, 1e-4) << lat;
    EXPECT_NEAR(of(row, BudgetSource::kGyroNoise).heading / noise[32], 1, 1e-4) << lat;
    const auto force = static_noise_covariance(site, e.accel_noise * e.accel_noise, 0, t);
    EXPECT_NEAR(of(row, BudgetSource::kAccelNoise).vee / force[0], 1, 1e-4) << lat;
    EXPECT_NEAR(of(row, BudgetSource::kAccelNoise).heading / force[32], 1, 1e-3) << lat;
  }
}

// Self-alignment [EST-14]: at rest nothing moves at first, whatever the accelerometers' bias and
// the deflection are; and the heading error is the east gyro's.
TEST(CovarianceBudget, SelfAlignmentCancelsWhatItWasMadeFrom) {
  BudgetConfig config;
  config.ellipsoid = wgs84();
  config.self_aligned = true;
  config.errors.accel_bias = 100 * ug;
  config.errors.gyro_bias = 0.01 * deg_per_h;
  config.errors.deflection = 5 * arcsec;
  CovarianceBudget budget(config);
  const double lat = 50 * deg;
  const auto x = at(config.ellipsoid, lat, 0.3, 1.0, 0.0);
  budget.start(x);
  EXPECT_NEAR(std::sqrt(of(budget.row(), BudgetSource::kGyroBias).heading),
              config.errors.gyro_bias / (config.ellipsoid.w_ie * std::cos(lat)), 1e-9);
  for (int i = 0; i < 600; ++i) budget.step(x, 0.1);
  const auto row = budget.row();
  // A tilt of 100 ug left alone would be at 0.06 m/s after 60 s; the Earth's turn of the tilt
  // leaves w t^2 g tilt/2 of it.
  EXPECT_LT(std::sqrt(of(row, BudgetSource::kAccelBias).vee), 4e-4);
  EXPECT_LT(std::sqrt(of(row, BudgetSource::kDeflection).vee), 1e-4);
  config.self_aligned = false;
  CovarianceBudget free(config);
  free.start(x);
  for (int i = 0; i < 600; ++i) free.step(x, 0.1);
  EXPECT_NEAR(std::sqrt(of(free.row(), BudgetSource::kAccelBias).vee), 100 * ug * 60, 3e-4);
}

// A straight drive with a heading sensor: (V-43) for one benchmark, that is (V-44), (V-45) of
// vehicle.md 5.2.
TEST(CovarianceBudget, AStraightDriveHasTheClosedForm) {
  BudgetConfig config;
  config.ellipsoid = wgs84();
  config.attitude_sensor = true;
  auto& e = config.errors;
  e.attitude_bias = 1e-3;
  e.attitude_drift = 1e-6;
  e.attitude_noise = 1e-5;
  e.scale = 1e-3;
  e.mounting_heading = 2e-3;
  e.scale_noise = 0.02;
  e.side_slip = 0.01;
  e.quantisation = 0.5;
  e.position = 0.2;
  e.odometer_interval = 0.1;
  CovarianceBudget budget(config);
  const double lat = 0.0, heading = 90 * deg, v = 20,
               dt = 0.1;  // along the equator: no convergence
  const int n = 5000;
  const auto& ell = config.ellipsoid;
  budget.start(at(ell, lat, 0, heading, v));
  for (int i = 1; i <= n; ++i) budget.step(at(ell, lat, v * dt * i / ell.a, heading, v), dt);
  const auto row = budget.row();
  const double T = n * dt, D = v * T, ds = v * dt;
  const auto near = [&](double found, double expected, const char* what) {
    EXPECT_NEAR(std::sqrt(found), expected, 1e-5 * expected) << what;
  };
  near(of(row, BudgetSource::kOdometerScale).dee, e.scale * D, "scale");
  near(of(row, BudgetSource::kMountingHeading).dnn, e.mounting_heading * D, "mounting");
  near(of(row, BudgetSource::kAttitudeBias).dnn, e.attitude_bias * D, "bias");
  near(of(row, BudgetSource::kAttitudeDrift).dnn, e.attitude_drift * T / 2 * D, "drift");
  near(of(row, BudgetSource::kAttitudeNoise).dnn, e.attitude_noise * std::sqrt(T / 3) * D, "noise");
  near(of(row, BudgetSource::kScaleNoise).dee, e.scale_noise * ds * std::sqrt(1.0 * n),
       "scale noise");
  near(of(row, BudgetSource::kSideSlip).dnn, e.side_slip * ds * std::sqrt(1.0 * n), "slip");
  near(of(row, BudgetSource::kQuantisation).dee, e.quantisation / std::sqrt(6.0), "quantisation");
  near(of(row, BudgetSource::kStartPosition).dee, e.position, "start");
  const auto sum = total(row);
  double all = 0;
  for (const auto& s : row) all += s.dee + s.dnn;
  EXPECT_DOUBLE_EQ(sum.dee + sum.dnn, all);
}

TEST(CovarianceBudget, RefusesWhatMeansNothing) {
  BudgetConfig config;
  config.ellipsoid = wgs84();
  config.errors.gyro_noise = -1;
  EXPECT_THROW(CovarianceBudget{config}, Error);
  config.errors.gyro_noise = 1e-6;
  CovarianceBudget budget(config);
  EXPECT_THROW(budget.start(at(config.ellipsoid, 90 * deg, 0, 0, 0)), Error);
  config.true_heading = false;
  CovarianceBudget polar(config);
  polar.start(at(config.ellipsoid, 90 * deg, 0, 0, 0));
  polar.step(at(config.ellipsoid, 90 * deg, 0, 0, 0), 0.1);
  EXPECT_TRUE(std::isfinite(total(polar.row()).vee));
}

}  // namespace
}  // namespace loxo
