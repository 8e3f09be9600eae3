// SPDX-License-Identifier: Apache-2.0
// Replay: sums against steps, derivatives against differences, the covariance of residuals against
// its plain definition.
#include "loxo/calibrate/replay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "loxo/calibrate/least_squares.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/num/units.hpp"
#include "test_seed.hpp"

namespace loxo {
namespace {

// A winding way, `n` rows of about `ds` m, reversing now and then.
std::vector<TrackStep> winding(std::size_t n, double ds, std::mt19937_64& random, double height = 0,
                               double pitch = 0) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<TrackStep> out;
  double heading = 6 * uniform(random), t = 100;
  for (std::size_t i = 0; i < n; ++i) {
    heading += 0.05 * normal(random);
    t += 0.5 + uniform(random);
    TrackStep s;
    s.t = t;
    s.ds = (i % 97 < 5 ? -1 : 1) * ds * uniform(random);
    s.heading = heading;
    s.h = height;
    s.pitch = pitch == 0 ? 0 : pitch * std::sin(0.01 * static_cast<double>(i));
    s.row = static_cast<std::uint32_t>(i + 1);
    out.push_back(s);
  }
  return out;
}

RecordedTrack track_of(const std::vector<TrackStep>& steps) {
  RecordedTrack t;
  t.ellipsoid = &wgs84();
  t.steps = steps;
  t.t0 = 100;
  return t;
}

Benchmark at(double lat, double lon, double std = 0) {
  Benchmark b;
  b.lat = lat * deg;
  b.lon = lon * deg;
  b.std = b.std_h = std;
  b.row = 0;
  return b;
}

// (V-10): a long level track goes by sums, the same one a nanometre up goes step by step. Positions
// agree within the two arcs' errors of 2e-8 m (section 10), sensitivities within the step's share
// of a derivative that both take at mid-step, 1e-9 of the way.
TEST(Replay, SumsAreTheSteps) {
  std::mt19937_64 random(testing::seed());
  for (const double lat : {0.0, 55.0, -70.0, 88.5, -89.6})
    for (const double ds : {0.02, 2.5, 9.0, 60.0}) {
      // No draw may cross the pole, where a track has no position: scale 1.3, every row straight
      // on.
      const double scale = 1.3, to_pole = (90 - std::fabs(lat)) * 111e3;
      if (20000 * ds * scale > to_pole) continue;
      const auto level = winding(20000, ds, random);
      auto raised = level;
      for (auto& s : raised) s.h = 1e-9;
      const std::vector<std::size_t> rows{1, 700, 700, 2048, 12345, 20000};
      const auto start = at(lat, 179.99);
      const Replay by_sums(track_of(level), start, rows), by_steps(track_of(raised), start, rows);
      StateVector x{};
      x[index(State::kScale)] = std::log(scale);
      x[index(State::kAngle)] = 2.0;
      const std::vector<State> states{State::kScale,        State::kAngle,      State::kLeverRight,
                                      State::kLeverForward, State::kStartNorth, State::kStartEast};
      const auto a = by_sums.run(x, states), b = by_steps.run(x, states);
      const auto c = by_sums.run(x);
      ASSERT_EQ(a.size(), rows.size());
      for (std::size_t j = 0; j < rows.size(); ++j) {
        const double parallel = 6.4e6 * std::cos(b[j].lat);
        EXPECT_NEAR((a[j].lat - b[j].lat) * 6.4e6, 0, 4e-8) << lat << ' ' << ds << ' ' << j;
        EXPECT_NEAR((a[j].lon - b[j].lon) * parallel, 0, 4e-8) << lat << ' ' << ds << ' ' << j;
        EXPECT_EQ(a[j].lon, c[j].lon);
        EXPECT_NEAR(a[j].heading, b[j].heading, 1e-14);
        const double way = ds * 20000;
        for (const State s : states)
          for (int k = 0; k < 2; ++k)
            EXPECT_NEAR(a[j].by[index(s)][k], b[j].by[index(s)][k], 1e-9 * way + 1e-9)
                << state_name(s) << ' ' << lat << ' ' << ds << ' ' << j;
      }
      // An upper bound, by less than one block of 512 rows.
      EXPECT_GE(by_sums.largest_latitude(), by_steps.largest_latitude() - 1e-14);
      EXPECT_LE(by_sums.largest_latitude(),
                by_steps.largest_latitude() + 512 * 1.5 * ds / 6.3e6 + 1e-6);
    }
}

// Beside a pole blocks of rows reach too far: the steps take over, and a track across it has no
// position.
TEST(Replay, SumsGiveWayAtThePole) {
  std::vector<TrackStep> north(5000);
  for (std::size_t i = 0; i < north.size(); ++i) {
    north[i].ds = 5;
    north[i].t = static_cast<double>(i + 1);
  }
  const Replay across(track_of(north), at(89.9, 10), {2000, 5000});
  const auto a = across.run({});
  EXPECT_NEAR(a[0].lat, 89.9 * deg + 10e3 / meridian_radius(wgs84(), 1.0), 1e-8);
  EXPECT_TRUE(std::isnan(a[1].lat) || std::isnan(a[1].lon));
}

// (V-39), (V-40) and the columns of 5.1 against central differences, in every regime. The
// derivatives of a step are those at mid-step: 1e-7 of the way for steps of 10 m.
TEST(Replay, SensitivitiesAreDerivatives) {
  std::mt19937_64 random(testing::seed());
  for (const double lat : {0.0, 55.0, -70.0, 89.0})
    for (const bool hills : {false, true}) {
      auto steps = winding(400, 10, random, hills ? 300 : 0, hills ? 0.1 : 0);
      auto track = track_of(steps);
      const Replay replay(track, at(lat, -179.999), {150, 400});
      StateVector x{};
      x[index(State::kScale)] = 0.1;
      x[index(State::kAngle)] = -1;
      x[index(State::kDrift)] = 1e-5;
      x[index(State::kPitch)] = 0.02;
      x[index(State::kLeverRight)] = 1;
      x[index(State::kLeverForward)] = -2;
      x[index(State::kStartNorth)] = 5;
      x[index(State::kStartEast)] = 7;
      const std::vector<State> states{State::kScale,      State::kAngle,      State::kDrift,
                                      State::kPitch,      State::kLeverRight, State::kLeverForward,
                                      State::kStartNorth, State::kStartEast};
      const auto by = replay.run(x, states);
      for (const State s : states) {
        const double h = s == State::kDrift ? 1e-8 : s >= State::kLeverRight ? 0.5 : 1e-5;
        auto up = x, down = x;
        up[index(s)] += h;
        down[index(s)] -= h;
        const auto plus = replay.run(up), minus = replay.run(down);
        for (std::size_t j = 0; j < by.size(); ++j) {
          Benchmark b;
          b.lat = by[j].lat;
          b.lon = by[j].lon;
          const auto p = replay.residual(plus[j], b), m = replay.residual(minus[j], b);
          const double size = s >= State::kLeverRight ? 1.0 : s == State::kDrift ? 2e6 : 4e3;
          for (int c = 0; c < 3; ++c) {
            const double d = c < 2 ? (p[c] - m[c]) / (2 * h) : (plus[j].up - minus[j].up) / (2 * h);
            EXPECT_NEAR(by[j].by[index(s)][c], d, 3e-4 * size)
                << state_name(s) << ' ' << lat << ' ' << hills << ' ' << j << ' ' << c;
          }
        }
      }
    }
}

// (V-43) term by term against its definition: positions as sums of increments, each with its error,
// the errors' covariance written out. Rounding only.
TEST(Replay, CovarianceOfResidualsIsThatOfItsErrors) {
  std::mt19937_64 random(testing::seed());
  auto steps = winding(40, 20, random, 0, 0.1);
  steps[17].ds = 0;  // at rest: no heading of its own
  const auto track = track_of(steps);
  const std::vector<std::size_t> rows{9, 18, 19, 40};
  const auto start = at(0, 10, 0.3);
  std::vector<Benchmark> benchmarks{at(0, 10, 0.1), at(0, 10, 0.2), at(0, 10, 0.4), at(0, 10, 0.5)};
  const Replay replay(track, start, rows);
  const auto moments = replay.moments({});
  struct Step {
    double t0, t1, n, e, u;  // increments
    double unit[3];
  };
  std::vector<Step> all;
  double before = track.t0;
  for (const auto& s : steps) {
    const double c = std::cos(s.pitch);
    Step q{before - track.t0,
           s.t - track.t0,
           s.ds * c * std::cos(s.heading),
           s.ds * c * std::sin(s.heading),
           s.ds * std::sin(s.pitch),
           {}};
    q.unit[0] = c * std::cos(s.heading);
    q.unit[1] = c * std::sin(s.heading);
    q.unit[2] = std::sin(s.pitch);
    before = s.t;
    all.push_back(q);
  }
  // Covariance of the mean over a step of a random walk that starts at 0.
  const auto walk = [&](std::size_t i, std::size_t j) {
    if (i == j) return all[i].t0 + (all[i].t1 - all[i].t0) / 3;
    const Step& s = all[std::min(i, j)];
    return 0.5 * (s.t0 + s.t1);
  };
  for (int source = 0; source < 7; ++source) {
    TrackErrorModel e;
    if (source == 0) e.heading_bias = 0.01;
    if (source == 1) e.heading_drift = 1e-4;
    if (source == 2) e.heading_noise = 1e-3;
    if (source == 3) e.side_slip = 0.02;
    if (source == 4) e.scale_noise = 0.03;
    if (source == 5) e.quantisation = 0.7;
    std::vector<Benchmark> points = benchmarks;
    auto origin = start;
    if (source < 6) {
      origin.std = origin.std_h = 0;
      for (auto& b : points) b.std = b.std_h = 0;
    }
    const auto sigma = residual_covariance(moments, points, origin, e, 1.0, 3, true, true);
    const std::size_t size = 3 * rows.size();
    for (std::size_t j = 0; j < rows.size(); ++j)
      for (std::size_t l = 0; l < rows.size(); ++l)
        for (std::size_t a = 0; a < 3; ++a)
          for (std::size_t b = 0; b < 3; ++b) {
            double want = 0;
            const auto turned = [&](const Step& s, std::size_t c) {
              return c == 0 ? -s.e : c == 1 ? s.n : 0.0;
            };
            const auto increment = [&](const Step& s, std::size_t c) {
              return c == 0 ? s.n : c == 1 ? s.e : s.u;
            };
            for (std::size_t p = 0; p < rows[j]; ++p)
              for (std::size_t q = 0; q < rows[l]; ++q) {
                const double turn = turned(all[p], a) * turned(all[q], b);
                const double tp = 0.5 * (all[p].t0 + all[p].t1), tq = 0.5 * (all[q].t0 + all[q].t1);
                want += e.heading_bias * e.heading_bias * turn;
                want += e.heading_drift * e.heading_drift * tp * tq * turn;
                want += e.heading_noise * e.heading_noise * walk(p, q) * turn;
                if (p == q) {
                  want += e.side_slip * e.side_slip * turn;
                  want +=
                      e.scale_noise * e.scale_noise * increment(all[p], a) * increment(all[q], b);
                }
              }
            if (source == 5) {
              // Indicated distance at row i errs by its rest e_i, uniform and independent; an
              // increment by e_i - e_(i-1), along the step. At rest nothing is added to it.
              std::vector<std::array<double, 3>> ca(42), cb(42);
              const auto fill = [&](std::vector<std::array<double, 3>>& c, std::size_t end) {
                std::size_t last = 0;  // the rest before the next moving step
                for (std::size_t p = 0; p < end; ++p) {
                  if (steps[p].ds == 0) continue;
                  for (std::size_t k = 0; k < 3; ++k) {
                    c[p + 1][k] += all[p].unit[k];
                    c[last][k] -= all[p].unit[k];
                  }
                  last = p + 1;
                }
              };
              fill(ca, rows[j]);
              fill(cb, rows[l]);
              for (std::size_t r = 0; r < 42; ++r) want += 0.49 / 12 * ca[r][a] * cb[r][b];
            }
            if (source == 6 && a == b)
              want = origin.std * origin.std + (j == l ? points[j].std * points[j].std : 0);
            EXPECT_NEAR(sigma[(3 * j + a) * size + 3 * l + b], want, 1e-9 * (1 + std::fabs(want)))
                << source << ' ' << j << ' ' << l << ' ' << a << ' ' << b;
          }
  }
}

// An alignment error turns the whole way and stretches nothing: the scale's error bar is zero,
// never a root of what rounding leaves below it.
TEST(Replay, AlignmentLeavesTheScaleAlone) {
  std::mt19937_64 random(testing::seed());
  TrackErrorModel errors;
  errors.heading_bias = 1 * arcmin;
  for (int i = 0; i < 200; ++i) {
    const auto steps = winding(60, 20, random);
    const auto start = at(60 * std::sin(i), 7);
    const Replay truth(track_of(steps), start, {60});
    auto end = start;
    end.lat = truth.run({})[0].lat;
    end.lon = truth.run({})[0].lon;
    end.row = 60;
    const auto c = calibrate_replay(track_of(steps), start, end, errors);
    ASSERT_TRUE(c.valid) << c.why;
    EXPECT_LE(c.ln_k_std, 1e-9);  // NaN fails
    EXPECT_NEAR(c.eps_std, 1 * arcmin, 1e-9);
  }
}

// 5.3: what positions cannot tell is refused in words that say what would help.
TEST(LeastSquares, UnobservableStatesAreNamed) {
  const auto straight = [](double k) {
    std::vector<TrackStep> steps(100);
    for (std::size_t i = 0; i < 100; ++i) {
      steps[i].t = 100 + static_cast<double>(i + 1);
      steps[i].ds = 20 * k;
      steps[i].heading = 0.7;
    }
    return steps;
  };
  const auto steps = straight(1.0), indicated = straight(1.02);
  const auto start = at(50, 7, 0.1);
  const auto solve = [&](const std::vector<std::size_t>& rows, const std::vector<State>& states) {
    const Replay truth(track_of(steps), start, rows);
    std::vector<Benchmark> points;
    for (const auto& a : truth.run({})) {
      auto b = start;
      b.lat = a.lat;
      b.lon = a.lon;
      points.push_back(b);
    }
    return calibrate_least_squares(track_of(indicated), start, points, rows, {}, states);
  };
  const auto says = [&](const Calibration& c, const char* words) {
    EXPECT_FALSE(c.valid);
    EXPECT_NE(c.why.find(words), std::string::npos) << c.why;
  };
  EXPECT_TRUE(solve({100}, {}).valid);
  says(solve({100}, {State::kDrift}), "3 unknowns and 2 equations");
  EXPECT_TRUE(solve({50, 100}, {State::kDrift}).valid);
  const auto lever = solve({50, 100}, {State::kLeverRight, State::kLeverForward});
  says(lever, "lever arm");
  says(lever, "heading at a benchmark must differ");
  EXPECT_FALSE(lever.unobservable.empty());
  // Two benchmarks at one place are one.
  says(solve({100, 100}, {State::kStartNorth, State::kStartEast}), "needs a second benchmark");
  EXPECT_TRUE(solve({50, 100}, {State::kStartNorth, State::kStartEast}).valid);
  says(solve({100, 100}, {State::kDrift}), "at different times");
  // Benchmarks known to half their chord.
  auto vague = start;
  vague.std = 900;
  Benchmark end = vague;
  const Replay truth(track_of(steps), vague, {100});
  end.lat = truth.run({})[0].lat;
  end.lon = truth.run({})[0].lon;
  end.row = 100;
  const auto c = calibrate_least_squares(track_of(indicated), vague, {end}, {100}, {}, {});
  EXPECT_FALSE(c.valid) << c.ln_k_std;
  EXPECT_FALSE(c.why.empty());
}

}  // namespace
}  // namespace loxo
