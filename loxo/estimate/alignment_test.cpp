// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/alignment.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <random>

#include "loxo/earth/attitude.hpp"
#include "loxo/ins/closed_form_truth.hpp"
#include "loxo/ins/geographic.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

constexpr double kLat = 40 * deg, kLon = 110 * deg, kStep = 0.1;  // s
constexpr double kGyroBias = 0.05 * deg_per_h, kGyroNoise = 0.005 * deg_per_sqrt_h,
                 kAccelBias = 100 * ug, kAccelNoise = 0.01 * mps_per_sqrt_h;

truth::Motion standing(double heading) {
  auto m = truth::great_circle(wgs84(), kLat, kLon, 0, 0);
  m.heading = heading;
  return m;
}

FineAlignmentConfig config_of(bool quiet) {
  FineAlignmentConfig c;
  NavigatorConfig& n = c.sensors;
  n.ellipsoid = wgs84();
  n.imu_interval = kStep;
  n.gyro_bias = kGyroBias, n.gyro_noise = kGyroNoise;
  n.accel_bias = kAccelBias, n.accel_noise = kAccelNoise;
  n.bias_moving = 0;
  n.standstill.sigma_w = kGyroNoise / std::sqrt(kStep);
  n.standstill.sigma_f = kAccelNoise / std::sqrt(kStep);
  c.place_std = 0.01;
  c.quiet = quiet;
  return c;
}

struct Outcome {
  double nees = 0, heading = 0;  // of psi and the gyro biases (6); error [rad]
  NavigatorStart end;
};

// Draws biases and noise and a coarse start with the errors its covariance states; aligns for T.
Outcome align(std::mt19937_64& rng, const std::vector<ImuIncrement<double>>& clean,
              const truth::Motion& m, double heading_std, bool from_gyros, bool quiet) {
  std::normal_distribution<double> g;
  auto three = [&](double s) { return Vec<Body>{s * g(rng), s * g(rng), s * g(rng)}; };
  const FineAlignmentConfig c = config_of(quiet);
  const Vec<Body> bg = three(kGyroBias), ba = three(kAccelBias);
  NavigatorStart s;
  const auto truth = m.at(0).state;
  s.state.r = truth.r, s.state.q = truth.q_eb;
  StartSigmas sigmas;
  sigmas.gyro_bias = kGyroBias, sigmas.accel_bias = kAccelBias;
  sigmas.level = 0.003 * deg, sigmas.heading = heading_std, sigmas.static_heading = from_gyros;
  sigmas.velocity = 1e-3, sigmas.position = 1;
  s.P = start_covariance(c.sensors.ellipsoid, s.state, sigmas);
  // psi given the biases: mean A b, covariance the rest. psi = computed - true on ECEF axes.
  Eigen::Matrix3d pp;
  Eigen::Matrix<double, 3, 6> pb;
  Eigen::Matrix<double, 6, 1> b, var;
  b << bg.x, bg.y, bg.z, ba.x, ba.y, ba.z;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pp(i, j) = s.P.p[kPsi + i][kPsi + j];
    for (int j = 0; j < 6; ++j) pb(i, j) = s.P.p[kPsi + i][kBg + j];
  }
  for (int j = 0; j < 6; ++j) var(j) = s.P.p[kBg + j][kBg + j];
  const Eigen::Matrix<double, 3, 6> a = pb * var.cwiseInverse().asDiagonal();
  const Eigen::Matrix3d rest = pp - a * pb.transpose();
  const Eigen::Vector3d psi =
      a * b + Eigen::LLT<Eigen::Matrix3d>(rest).matrixL() * Eigen::Vector3d(g(rng), g(rng), g(rng));
  double x[kStates]{};
  for (int i = 0; i < 3; ++i) x[kPsi + i] = -psi(i);  // fed back, it becomes the error
  feed_back(s.state, x);
  s.state.v = {};
  FineAlignment fine(c, s);
  for (ImuIncrement<double> i : clean) {
    i.dtheta += bg * i.dt + three(kGyroNoise * std::sqrt(i.dt));
    i.dv += ba * i.dt + three(kAccelNoise * std::sqrt(i.dt));
    fine.add(i);
  }
  Outcome o;
  o.end = fine.result();
  const auto now = m.at(clean.back().t).state;
  // The error that is left: C_computed = (I - [psi]) C_true.
  const auto d = to_matrix(o.end.state.q * conjugate(now.q_eb));
  Eigen::Matrix<double, 6, 1> e;
  e << -0.5 * (d.m[2][1] - d.m[1][2]), -0.5 * (d.m[0][2] - d.m[2][0]),
      -0.5 * (d.m[1][0] - d.m[0][1]), bg.x - o.end.state.bg.x, bg.y - o.end.state.bg.y,
      bg.z - o.end.state.bg.z;
  static const int at[6] = {kPsi, kPsi + 1, kPsi + 2, kBg, kBg + 1, kBg + 2};
  Eigen::Matrix<double, 6, 6> P;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) P(i, j) = o.end.P.p[at[i]][at[j]];
  o.nees = e.dot(P.ldlt().solve(e));
  const UnitAngle<double> lat{std::sin(kLat), std::cos(kLat)};
  const auto c_ne = GeographicMechanization::axes(lat, std::sin(kLon), std::cos(kLon));
  auto heading = [&](const Quat<Ecef, Body>& q) { return to_euler(c_ne * to_matrix(q)).heading; };
  o.heading = std::remainder(heading(o.end.state.q) - heading(now.q_eb), 2 * kPi);
  return o;
}

SolutionRow row_of(const NavigatorStart& s) {
  return solution_row(wgs84(), s.state, s.P, FrameId::kGeographic, 0);
}

// estimation.md 4.3: the stated covariance is that of the errors, from a heading found by the gyros
// and from a poor one given; noise, biases and the coarse start drawn anew each run.
TEST(FineAlignment, StatedCovarianceIsTheErrors) {
  const auto m = standing(30 * deg);
  const auto clean = m.record(kStep, 3000);
  const std::uint64_t first = testing::seed();
  for (const bool from_gyros : {true, false}) {
    std::mt19937_64 rng(first + (from_gyros ? 1 : 0));
    constexpr int kRuns = 40;
    double sum = 0;
    for (int k = 0; k < kRuns; ++k)
      sum += align(rng, clean, m, from_gyros ? 0.05 * deg : 1.0 * deg, from_gyros, false).nees;
    // chi2 of 6 x 40 degrees over its degrees, 2.5e-7 either side, twice.
    const double mean = sum / (6.0 * kRuns);
    std::printf("%s: NEES/6 %.2f\n", from_gyros ? "gyros" : "given", mean);
    EXPECT_GT(mean, 0.606);
    EXPECT_LT(mean, 1.528);
  }
}

// It cannot beat the east gyro bias, and keeps the correlation that the first turn will use.
TEST(FineAlignment, HeadingAndEastBiasStayOneUnknown) {
  const auto m = standing(0);
  const auto clean = m.record(kStep, 3000);
  std::mt19937_64 rng(3);
  const Outcome o = align(rng, clean, m, 0.3 * deg, true, false);
  const double floor = kGyroBias / (wgs84().w_ie * std::cos(kLat));
  const double sd = row_of(o.end).std_heading;
  EXPECT_GT(sd, 0.98 * floor);
  EXPECT_LT(sd, 1.15 * floor);  // the noise of 300 s is a quarter of it
  // psi about up against the east gyro, which is the right one here: e-axes to level.
  const UnitAngle<double> lat{std::sin(kLat), std::cos(kLat)};
  const auto c = GeographicMechanization::axes(lat, std::sin(kLon), std::cos(kLon));
  double cov = 0, var = 0;
  for (int i = 0; i < 3; ++i) {
    cov += c.m[2][i] * o.end.P.p[kPsi + i][kBg];
    for (int j = 0; j < 3; ++j) var += c.m[2][i] * o.end.P.p[kPsi + i][kPsi + j] * c.m[2][j];
  }
  EXPECT_LT(cov / std::sqrt(var * o.end.P.p[kBg][kBg]), -0.9);
}

// A heading of 3 deg, from a store say, becomes that of the gyros; the up gyro's bias needs a base
// that does not turn.
TEST(FineAlignment, StoredHeadingIsRefinedAndAQuietBaseShowsItsBiases) {
  const auto m = standing(200 * deg);
  const auto clean = m.record(kStep, 6000);
  std::mt19937_64 rng(11);
  const double floor = kGyroBias / (wgs84().w_ie * std::cos(kLat));
  const Outcome a = align(rng, clean, m, 3 * deg, false, false);
  const Outcome b = align(rng, clean, m, 3 * deg, false, true);
  for (const Outcome* o : {&a, &b}) {
    const double sd = row_of(o->end).std_heading;
    EXPECT_LT(sd, 1.2 * floor);
    EXPECT_LT(std::fabs(o->heading), 4 * sd);
  }
  EXPECT_GT(std::sqrt(a.end.P.p[kBg + 2][kBg + 2]), 0.9 * kGyroBias);
  EXPECT_LT(std::sqrt(b.end.P.p[kBg + 2][kBg + 2]), 0.5 * kGyroBias);
}

}  // namespace
}  // namespace loxo
