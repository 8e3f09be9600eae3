// SPDX-License-Identifier: Apache-2.0
// Each source of sensor error alone: its exact effect, or its statistics over many trials against
// the law it is drawn from. The same bits in lanes as in double.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <random>

#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/odometer_errors.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

struct Moments {
  double n = 0, sum = 0, squares = 0;
  void add(double x) { n += 1, sum += x, squares += x * x; }
  double mean() const { return sum / n; }
  double rms() const { return std::sqrt(squares / n); }
};
// 5.5 sigma of a normal sample's rms and mean: one false alarm in 10^7.
void expect_normal(const Moments& m, double sigma, const std::string& what) {
  EXPECT_NEAR(m.rms() / sigma, 1.0, 5.5 / std::sqrt(2 * m.n)) << what;
  EXPECT_NEAR(m.mean() / sigma, 0.0, 5.5 / std::sqrt(m.n)) << what;
}

const double kTh[3] = {2e-3, -1e-3, 5e-4}, kV[3] = {0.05, -0.02, 0.0981};
constexpr double kDt = 0.01;

// Error of the six increments of the first sample over trials, each divided by what one sigma is.
void over_trials(const ImuModel<double>& model, const std::string& what,
                 const std::function<double(const Vec<Body>&, const Vec<Body>&)>& value,
                 double sigma) {
  Moments m;
  const ImuSurroundings around;
  for (std::uint64_t trial = 0; trial < 4000; ++trial) {
    ImuSensor<double> sensor(model, around, kDt, testing::seed(), trial);
    const auto u = sensor.measure(0, kTh, kV);
    m.add(value({u.dtheta.x - kTh[0], u.dtheta.y - kTh[1], u.dtheta.z - kTh[2]},
                {u.dv.x - kV[0], u.dv.y - kV[1], u.dv.z - kV[2]}));
  }
  expect_normal(m, sigma, what);
}

TEST(ImuSensor, ConstantsHaveTheirSigmaAndTheirEffect) {
  ImuModel<double> m;
  using V = Vec<Body>;
  m.gyro.bias = 1e-4;
  over_trials(
      m, "gyro bias", [](const V& w, const V&) { return w.y; }, 1e-4 * kDt);
  m = {};
  m.accel.bias = 1e-3;
  over_trials(
      m, "accel bias", [](const V&, const V& f) { return f.z; }, 1e-3 * kDt);
  m = {};
  m.gyro.scale = 1e-3;
  over_trials(
      m, "gyro scale", [](const V& w, const V&) { return w.x; }, 1e-3 * kTh[0]);
  m = {};
  m.accel.scale = 1e-3;
  over_trials(
      m, "accel scale", [](const V&, const V& f) { return f.z; }, 1e-3 * kV[2]);
  m = {};
  m.gyro.misalignment = 1e-3;
  over_trials(
      m, "gyro axes", [](const V& w, const V&) { return w.x; }, 1e-3 * std::hypot(kTh[1], kTh[2]));
  m = {};
  m.accel.misalignment = 1e-3;
  over_trials(
      m, "accel axes", [](const V&, const V& f) { return f.y; }, 1e-3 * std::hypot(kV[0], kV[2]));
  m = {};
  m.g_sensitivity = 1e-5;
  over_trials(
      m, "g-sensitivity", [](const V& w, const V&) { return w.z; },
      1e-5 * std::sqrt(kV[0] * kV[0] + kV[1] * kV[1] + kV[2] * kV[2]));
  m = {};
  m.gyro.noise = 1e-3;
  over_trials(
      m, "gyro noise", [](const V& w, const V&) { return w.x; }, 1e-3 * std::sqrt(kDt));
  m = {};
  m.accel.noise = 1e-3;
  over_trials(
      m, "accel noise", [](const V&, const V& f) { return f.x; }, 1e-3 * std::sqrt(kDt));
}

TEST(ImuSensor, KnownOffsetsAreAddedAsTheyStand) {
  ImuSurroundings around;
  around.gyro_offset[2] = 1e-3;
  around.accel_offset[0] = -0.5;
  ImuSensor<double> sensor({}, around, kDt, 1, 0);
  const auto u = sensor.measure(0, kTh, kV);
  EXPECT_DOUBLE_EQ(u.dtheta.x, kTh[0]);
  EXPECT_DOUBLE_EQ(u.dtheta.z, kTh[2] + 1e-5);
  EXPECT_DOUBLE_EQ(u.dv.x, kV[0] - 5e-3);
}

// Walk: variance N^2 t. Markov: stationary, correlation exp(-t/tau). Whole seconds, as the process
// goes.
TEST(ImuSensor, SlowProcessesHaveTheVarianceAndTheCorrelationOfTheirLaw) {
  ImuModel<double> m;
  m.gyro.walk = 1e-5;
  m.accel.markov = 2e-3;
  ImuSurroundings around;
  around.accel_markov_time = 60;
  Moments walk, start, end, product;
  const double none[3] = {0, 0, 0};
  for (std::uint64_t trial = 0; trial < 3000; ++trial) {
    ImuSensor<double> sensor(m, around, 0.1, testing::seed(), trial);
    start.add(sensor.accel_bias().x);
    const double first = sensor.accel_bias().x;
    for (std::uint64_t i = 0; i < 301; ++i) sensor.measure(i, none, none);  // 30 steps of a second
    walk.add(sensor.gyro_bias().y);
    end.add(sensor.accel_bias().x);
    product.add(first * sensor.accel_bias().x);
  }
  expect_normal(walk, 1e-5 * std::sqrt(30.0), "walk");
  expect_normal(start, 2e-3, "Markov at the start");
  expect_normal(end, 2e-3, "Markov after half a time constant");
  // Of a product of normals with correlation rho: mean rho, variance 1 + rho^2.
  const double rho = std::exp(-0.5);
  EXPECT_NEAR(product.mean() / 4e-6, rho, 5.5 * std::sqrt((1 + rho * rho) / 3000));
}

TEST(ImuSensor, BiasFollowsTheTemperatureRamp) {
  ImuModel<double> m;
  m.gyro.temperature = 1e-6;
  ImuSurroundings around;
  around.temperature_from = -10;
  around.temperature_to = 30;
  around.ramp_begin = 10;
  around.ramp_end = 50;
  const double none[3] = {0, 0, 0};
  Moments slope;
  for (std::uint64_t trial = 0; trial < 3000; ++trial) {
    ImuSensor<double> sensor(m, around, 0.5, testing::seed(), trial);
    const double cold = sensor.gyro_bias().z;
    for (std::uint64_t i = 0; i < 61; ++i) sensor.measure(i, none, none);
    // The stretch from 30 s to 31 s: 30.5 s stands for it, 20.5 K above the start.
    const double warm = sensor.gyro_bias().z;
    ASSERT_NEAR(warm, cold * (10.5 / -10.0), 1e-18);
    slope.add(cold / -10.0);
  }
  expect_normal(slope, 1e-6, "temperature coefficient");
}

TEST(ImuSensor, QuantisedIncrementsLoseNothing) {
  ImuModel<double> m;
  m.gyro.quantisation = 1e-5;
  m.accel.quantisation = 3e-4;
  const ImuSurroundings around;
  ImuSensor<double> sensor(m, around, kDt, 1, 0);
  double told = 0, truth = 0;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto u = sensor.measure(i, kTh, kV);
    told += u.dv.y;
    truth += kV[1];
    EXPECT_LE(std::fabs(told - truth), 1.5e-4 + 1e-12);
    EXPECT_NEAR(u.dtheta.x / 1e-5, std::round(u.dtheta.x / 1e-5), 1e-6);
  }
}

// The sum of a sine's increments is its integral: at whole periods nothing, and the rms of its rate
// is as given where the sample is short.
TEST(ImuSensor, VibrationIsASineOfTheGivenRmsAndItsIncrementsItsIntegral) {
  ImuSurroundings around;
  around.vibration = {{5.0, {0, 0, 2.0}, {0.1, 0, 0}}};
  const double none[3] = {0, 0, 0};
  ImuSensor<double> sensor({}, around, 1e-3, testing::seed(), 3);
  Moments f;
  double sum = 0, most = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {  // ten periods
    const auto u = sensor.measure(i, none, none);
    f.add(u.dv.z / 1e-3);
    sum += u.dv.z;
    most = std::max(most, std::fabs(u.dtheta.x) / 1e-3);
    EXPECT_EQ(u.dv.x, 0.0);
  }
  // sinc(w dt/2) = 1 - 4e-5.
  EXPECT_NEAR(f.rms(), 2.0, 1e-3);
  EXPECT_NEAR(sum, 0.0, 1e-9);
  EXPECT_NEAR(most, 0.1 * std::sqrt(2.0), 1e-4);
}

TEST(ImuSensor, TrialKHasTheSameBitsInAnyLaneWithEverySource) {
  ImuSurroundings around;
  around.gyro_markov_time = 3;
  around.temperature_to = 40;
  around.ramp_end = 20;
  around.vibration = {{31.0, {1, 0, 1}, {0, 1e-3, 0}}};
  ImuModel<Lanes> m;
  // Half the trials have each source, in another order: lanes must not see their neighbours.
  ImuModel<double> one[8];
  int k = 0;
  const auto set = [&](auto member, double size) {
    double v[8];
    for (int l = 0; l < 8; ++l) {
      v[l] = ((l >> (k % 3)) & 1) != 0 ? size : 0.0;
      member(one[l]) = v[l];
    }
    member(m) = Lanes::load(v);
    ++k;
  };
  set(
      [](auto& x) -> auto& { return x.gyro.bias; }, 1e-4);
  set(
      [](auto& x) -> auto& { return x.gyro.noise; }, 1e-4);
  set(
      [](auto& x) -> auto& { return x.gyro.walk; }, 1e-5);
  set(
      [](auto& x) -> auto& { return x.gyro.markov; }, 1e-4);
  set(
      [](auto& x) -> auto& { return x.gyro.scale; }, 1e-3);
  set(
      [](auto& x) -> auto& { return x.gyro.misalignment; }, 1e-3);
  set(
      [](auto& x) -> auto& { return x.gyro.temperature; }, 1e-6);
  set(
      [](auto& x) -> auto& { return x.gyro.quantisation; }, 1e-6);
  set(
      [](auto& x) -> auto& { return x.accel.bias; }, 1e-3);
  set(
      [](auto& x) -> auto& { return x.accel.noise; }, 1e-3);
  set(
      [](auto& x) -> auto& { return x.accel.walk; }, 1e-4);
  set(
      [](auto& x) -> auto& { return x.accel.markov; }, 1e-3);
  set(
      [](auto& x) -> auto& { return x.accel.misalignment; }, 1e-3);
  set(
      [](auto& x) -> auto& { return x.accel.quantisation; }, 1e-5);
  set(
      [](auto& x) -> auto& { return x.g_sensitivity; }, 1e-5);
  ImuSensor<Lanes> lanes(m, around, kDt, 9, 100);
  std::vector<ImuSensor<double>> alone;
  for (std::uint64_t l = 0; l < 8; ++l) alone.emplace_back(one[l], around, kDt, 9, 100 + l);
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto u = lanes.measure(i, kTh, kV);
    for (int l = 0; l < 8; ++l) {
      const auto w = alone[static_cast<std::size_t>(l)].measure(i, kTh, kV);
      const double a[6] = {w.dtheta.x, w.dtheta.y, w.dtheta.z, w.dv.x, w.dv.y, w.dv.z};
      const double b[6] = {u.dtheta.x.lane(l), u.dtheta.y.lane(l), u.dtheta.z.lane(l),
                           u.dv.x.lane(l),     u.dv.y.lane(l),     u.dv.z.lane(l)};
      for (int j = 0; j < 6; ++j)
        ASSERT_EQ(std::bit_cast<std::uint64_t>(a[j]), std::bit_cast<std::uint64_t>(b[j]))
            << i << " lane " << l << " " << j;
    }
  }
}

TEST(Odometer, ScaleWearAndNoisesHaveTheirEffect) {
  const auto many = [](const OdometerModel<double>& m, double way, int readings,
                       const std::string& what, double mean, double sigma) {
    Moments e;
    for (std::uint64_t trial = 0; trial < 3000; ++trial) {
      Odometer<double> o(m, testing::seed(), trial);
      double sum = 0;
      for (int i = 0; i < readings; ++i)
        sum += o.reading(static_cast<std::uint64_t>(i), way, 1.0, 1.0);
      e.add(sum - mean);
    }
    expect_normal(e, sigma, what);
  };
  OdometerModel<double> m;
  m.scale = 1.2;
  m.wear = -1e-3;
  // k (1 + wear s) over 100 m: 120 - 120 * 1e-3 * 50.
  Odometer<double> worn(m, 1, 0);
  double sum = 0;
  for (std::uint64_t i = 0; i < 10; ++i) sum += worn.reading(i, 10, 1, 1);
  EXPECT_NEAR(sum, 114, 1e-10);
  EXPECT_NEAR(Odometer<double>(m, 1, 0).reading(0, -10, 1, 1), -12 * (1 - 5e-3), 1e-12)
      << "reverse";
  m = {};
  m.scale_error = 1e-3;
  many(m, 10, 5, "scale error", 50, 0.05);
  m = {};
  m.scale_markov = 1e-3;
  many(m, 10, 1, "scale Markov", 10, 0.01);
  // Sum of n stationary values with correlation a: n + 2 sum (n - k) a^k.
  m.markov_time = 5;
  const double a = std::exp(-1.0 / 5);
  double correlated = 20;
  for (int k = 1; k < 20; ++k) correlated += 2 * (20 - k) * std::pow(a, k);
  many(m, 10, 20, "scale Markov, correlated", 200, 0.01 * std::sqrt(correlated));
  m = {};
  m.scale_noise = 1e-2;
  many(m, 10, 5, "scale noise", 50, 0.1 * std::sqrt(5.0));
  m = {};
  m.noise = 0.02;
  many(m, 10, 5, "noise", 50, 0.02 * std::sqrt(5.0));
  m = {};
  m.distance_noise = 0.01;
  many(m, 10, 5, "distance noise", 50, 0.01 * std::sqrt(50.0));
  m = {};
  m.scale_walk = 1e-3;
  // Mid-interval steps: increments of half, then 1, of which each counts for the readings to come:
  // sum over k of ((n - k) + 1/2 ...)^2, the walk's mean to the trapezoid.
  double variance = 0;
  for (int k = 0; k < 40; ++k) {
    const double rest = 40 - k - 1;
    variance += (rest + std::sqrt(0.5)) * (rest + std::sqrt(0.5));
  }
  many(m, 10, 40, "scale walk", 400, 10 * 1e-3 * std::sqrt(variance));
}

TEST(Odometer, QuantisedWayIsNeverMoreThanAStepOff) {
  OdometerModel<double> m;
  m.quantisation = 0.05;
  Odometer<double> o(m, testing::seed(), 0);
  double told = 0;
  for (std::uint64_t i = 0; i < 500; ++i) {
    const double way = i < 250 ? 0.0123 : -0.0123;
    const double x = o.reading(i, way, 1, 0.1);
    told += x;
    EXPECT_NEAR(x / 0.05, std::round(x / 0.05), 1e-9);
    const double truth =
        0.0123 * (i < 250 ? static_cast<double>(i) + 1.0 : 499.0 - static_cast<double>(i));
    EXPECT_LE(std::fabs(told - truth), 0.0501);
  }
}

TEST(Odometer, SlipAndADeadEncoderCountByTheirShareOfTheInterval) {
  const std::vector<WheelFault> faults{{10, 20, 0.1, false}, {30, 40, 0, true}};
  EXPECT_DOUBLE_EQ(wheel_factor(faults, 0, 1), 1.0);
  EXPECT_DOUBLE_EQ(wheel_factor(faults, 12, 13), 1.1);
  EXPECT_DOUBLE_EQ(wheel_factor(faults, 9.5, 10.5), 1.05);
  EXPECT_DOUBLE_EQ(wheel_factor(faults, 35, 36), 0.0);
  EXPECT_DOUBLE_EQ(wheel_factor(faults, 39.75, 40.75), 0.75);
  Odometer<double> o({}, 1, 0);
  EXPECT_DOUBLE_EQ(o.reading(0, 10, 1.1, 1), 11.0);
}

TEST(Odometer, ADeadEncoderHasNoNoise) {
  OdometerModel<double> m;
  m.noise = 0.05, m.scale_noise = 0.01, m.distance_noise = 0.01, m.quantisation = 0.02;
  Odometer<double> o(m, testing::seed(), 0);
  for (std::uint64_t i = 0; i < 100; ++i) EXPECT_EQ(o.reading(i, 2, 0, 0.1), 0);
  EXPECT_NEAR(o.reading(100, 2, 1, 0.1), 2, 0.5);
}

TEST(Odometer, TheWayADelayAgoIsThatOfTheSmoothDrive) {
  const auto way = [](double t) { return 20 * t + 3 * std::sin(0.7 * t); };
  const auto speed = [](double t) { return 20 + 2.1 * std::cos(0.7 * t); };
  WayMemory memory(0.237);
  for (int i = 0; i <= 1000; ++i) {
    const double t = 0.01 * i;
    memory.add(t, way(t), speed(t));
    // Hermite: (w dt)^4/384 of 3 m, 2e-11 m, and rounding of 200 m; before the start it rolled as
    // it does then.
    const double before = t - 0.237;
    EXPECT_NEAR(memory.way(), before >= 0 ? way(before) : 22.1 * before, 1e-10) << t;
  }
}

TEST(Channel, EachPartHasItsLaw) {
  const auto after = [](const ChannelModel<double>& m, double t, const std::string& what,
                        double sigma) {
    Moments e;
    for (std::uint64_t trial = 0; trial < 3000; ++trial) {
      Channel<double> c(m, noise_source::kHeading, 0, testing::seed(), trial);
      double x = 0;
      const int n = static_cast<int>(std::lround(t / 2)) + 1;
      for (int k = 0; k < n; ++k) x = c.error(static_cast<std::uint64_t>(k), 2.0 * k, 2.0);
      e.add(x);
    }
    expect_normal(e, sigma, what);
  };
  ChannelModel<double> m;
  m.bias = 0.3;
  after(m, 10, "bias", 0.3);
  m = {};
  m.drift = 0.01;
  after(m, 30, "drift", 0.3);
  m = {};
  m.noise = 0.2;
  after(m, 4, "noise", 0.2);
  m = {};
  m.markov = 0.4;
  m.markov_time = 10;
  after(m, 8, "Markov", 0.4);
  m = {};
  m.walk = 0.1;
  after(m, 18, "walk", 0.1 * std::sqrt(18.0));
}

}  // namespace
}  // namespace loxo
