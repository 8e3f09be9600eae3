// SPDX-License-Identifier: Apache-2.0
// Plans: the covariance of a straight drive is the closed form, in every regime.
#include "loxo/calibrate/plan.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// (V-44), (V-45) against the covariance of the planned track: each source alone and all together.
// What remains: the flat closed form against the ellipsoid, length tan(lat) / R; 48 steps a leg in
// the integrals of drift and walk, 1e-3; rows of white noise, whole in the closed form.
TEST(Plan, StraightDriveIsTheClosedForm) {
  for (const double lat : {0.0, 55.0, -55.0, 85.0})
    for (const double course : {0.0, 45.0, 90.0, 200.0})
      for (const double length : {200.0, 11.2e3, 60e3})
        for (int source = 0; source < 8; ++source) {
          PlanRequest r;
          r.ellipsoid = &wgs84();
          r.latitude = lat * deg;
          r.course = course * deg;
          r.benchmark_std = source == 0 || source == 7 ? 0.1 : 1e-6;
          if (source == 1 || source == 7) r.errors.heading_bias = 1 * arcmin;
          if (source == 2 || source == 7) r.errors.heading_drift = 1 * deg_per_h;
          if (source == 3 || source == 7) r.errors.heading_noise = 0.1 * deg / 60;
          if (source == 4 || source == 7) r.errors.side_slip = 0.5 * deg;
          if (source == 5 || source == 7) r.errors.scale_noise = 0.01;
          if (source == 6 || source == 7) r.errors.quantisation = 0.5;
          const auto a = plan_accuracy(r, {"straight", {0}, 1}, length);
          ASSERT_TRUE(a.unobservable.empty());
          const auto s = straight_std(r, length);
          const double flat =
              1e-3 + 3 * length * std::max(0.1, std::fabs(std::tan(lat * deg))) / 6.37e6;
          // What turns on the ellipsoid also stretches, by as much (V-41).
          if (source == 0 || source > 4) {
            EXPECT_NEAR(a.std(0), s.ln_k, flat * std::hypot(s.ln_k, s.eps))
                << lat << ' ' << course << ' ' << length << ' ' << source;
          }
          if (source < 5 || source == 7) {
            EXPECT_NEAR(a.std(1), s.eps, flat * std::hypot(s.ln_k, s.eps))
                << lat << ' ' << course << ' ' << length << ' ' << source;
          }
          // The parts sum up to the whole.
          for (const std::size_t i : {0u, 1u}) {
            double sum = 0;
            for (const double part : a.sources[i]) sum += part;
            EXPECT_NEAR(sum / (a.std(i) * a.std(i)), 1, 1e-9);
          }
        }
}

// The examples after (V-45) and rows U-* of the table of expected values.
TEST(Plan, WorkedExamples) {
  PlanRequest r;
  r.ellipsoid = &wgs84();
  r.speed = 20;
  EXPECT_NEAR(straight_std(r, 10e3).ln_k, 1.414e-5, 1e-8);       // U-10km
  EXPECT_NEAR(straight_std(r, 10e3).eps / arcsec, 2.917, 1e-3);  // U-10km
  r.benchmark_std = 0;
  r.errors.quantisation = 0.5;
  EXPECT_NEAR(straight_std(r, 10e3).ln_k, 2.041e-5, 1e-8);  // U-quant
  r.errors.heading_noise = 0.005 * deg / 60;
  EXPECT_NEAR(straight_std(r, 10e3).eps / arcsec, 3.873, 1e-3);  // U-arw: 500 s
  r.errors.heading_noise = 0;
  r.errors.heading_drift = 0.05 * deg_per_h;
  EXPECT_NEAR(straight_std(r, 10e3).eps / arcsec, 12.5, 1e-6);  // U-drift: 500 s
}

// Two benchmarks on a line find a drift (B_j = P_j t_j / 2), one does not; a start offset or a
// lever arm hides on a straight line behind others (5.3).
TEST(Plan, WhatShapesCannotTell) {
  PlanRequest r;
  r.ellipsoid = &wgs84();
  r.latitude = 40 * deg;
  const auto unobservable = [&](const PlanShape& shape, std::vector<State> states) {
    r.estimate = std::move(states);
    const auto a = plan_accuracy(r, shape, 5e3);
    return a.unobservable.empty() ? std::string() : a.unobservable.front();
  };
  EXPECT_NE(unobservable({"", {0}, 1}, {State::kDrift}).find("more benchmarks"), std::string::npos);
  EXPECT_EQ(unobservable({"", {0}, 2}, {State::kDrift}), "");
  EXPECT_NE(unobservable({"", {0}, 1}, {State::kStartNorth, State::kStartEast}).find("more bench"),
            std::string::npos);
  EXPECT_EQ(unobservable({"", {0}, 2}, {State::kStartNorth, State::kStartEast}), "");
  EXPECT_EQ(unobservable({"", {0, kPi / 2}, 2}, {State::kLeverRight, State::kLeverForward}), "");
  EXPECT_EQ(unobservable({"", {0}, 2}, {State::kPitch}), "");
}

}  // namespace
}  // namespace loxo
