// SPDX-License-Identifier: Apache-2.0
// Eight navigators side by side give, each, the bits of one alone in double: every frame, from
// ECEF, through the loop with its vertical channel, through handovers, back to ECEF.
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <random>
#include <vector>

#include "loxo/ins/closed_form_truth.hpp"
#include "loxo/ins/handover.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr int kSteps = 300;

// Start and noise-bearing samples of one trial; the motions differ in everything.
struct Trial {
  EcefState<double> start;
  std::vector<ImuIncrement<double>> imu;
};
std::vector<Trial> eight_trials() {
  const double lats[8] = {0, 45, -62, 79.9, 90, -90, 80.05, 89.9999};
  std::mt19937_64 rng(21);
  std::normal_distribution<double> g;
  std::vector<Trial> trials;
  for (int k = 0; k < 8; ++k) {
    auto m =
        truth::great_circle(wgs84(), lats[k] * deg, (20.0 * k - 60) * deg, 0.7 * k, 10 + 20 * k);
    m.roll = 3 * deg, m.pitch = 2 * deg, m.yaw = 1 * deg, m.heading = k, m.heave = 0.1 * k;
    Trial t{m.at(0).state, m.record(0.02, 2 * kSteps)};
    for (auto& s : t.imu) {
      s.dtheta.x += 1e-5 * g(rng), s.dtheta.z += 1e-5 * g(rng);
      s.dv.y += 1e-3 * g(rng), s.dv.z += 1e-3 * g(rng);
    }
    trials.push_back(t);
  }
  return trials;
}

template <Real S>
struct Inputs {
  EcefState<S> start;
  std::vector<ImuIncrement<S>> imu;
};
// The same in lanes, lane k from trial k.
Inputs<Lanes> side_by_side(const std::vector<Trial>& trials) {
  auto lanes = [&](auto get) {
    double v[8];
    for (int k = 0; k < 8; ++k) v[k] = get(trials[static_cast<std::size_t>(k)]);
    return Lanes::load(v);
  };
  Inputs<Lanes> in;
#define ALL(member) lanes([&](const Trial& t) { return t.member; })
  in.start = {{ALL(start.r.x), ALL(start.r.y), ALL(start.r.z)},
              {ALL(start.v.x), ALL(start.v.y), ALL(start.v.z)},
              {ALL(start.q_eb.w), ALL(start.q_eb.x), ALL(start.q_eb.y), ALL(start.q_eb.z)}};
  for (std::size_t i = 0; i < trials[0].imu.size(); ++i)
    in.imu.push_back({trials[0].imu[i].t,
                      trials[0].imu[i].dt,
                      {ALL(imu[i].dtheta.x), ALL(imu[i].dtheta.y), ALL(imu[i].dtheta.z)},
                      {ALL(imu[i].dv.x), ALL(imu[i].dv.y), ALL(imu[i].dv.z)}});
#undef ALL
  return in;
}

// The kernel under test, the same text for both scalars: navigate, damp, hand over to another frame
// half way, navigate on.
template <class M, class Other, Real S>
std::vector<S> navigate(const Inputs<S>& in) {
  const auto earth = make_earth_model(wgs84(), 0.4);
  const auto gains = make_vertical_gains(20);
  std::vector<S> out;
  auto put = [&](const EcefState<S>& e) {
    for (const S& x :
         {e.r.x, e.r.y, e.r.z, e.v.x, e.v.y, e.v.z, e.q_eb.w, e.q_eb.x, e.q_eb.y, e.q_eb.z})
      out.push_back(x);
  };
  auto x = M::from_ecef(earth, in.start);
  S integral(0.0);
  for (std::size_t i = 0; i < kSteps; i += 2) {
    x = step(earth, x, two_samples(in.imu[i], in.imu[i + 1]));
    x = damped(x, S(1.5), gains, 0.04, integral);
    out.push_back(M::nearness(x, 0.04));
  }
  put(M::to_ecef(earth, x));
  auto y = handover<Other>(earth, x);
  for (std::size_t i = kSteps; i + 4 <= 2 * kSteps; i += 4) {
    y = step(earth, y, combine(&in.imu[i], 4));
    y = constrained(y, S(2.0), S(0.1));
  }
  put(Other::to_ecef(earth, y));
  return out;
}

bool same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (a != a && b != b);
}
template <class M, class Other>
void lane_is_alone(const char* name) {
  const auto trials = eight_trials();
  const auto wide = navigate<M, Other>(side_by_side(trials));
  for (int k = 0; k < 8; ++k) {
    const Trial& t = trials[static_cast<std::size_t>(k)];
    const auto alone = navigate<M, Other>(Inputs<double>{t.start, t.imu});
    ASSERT_EQ(alone.size(), wide.size());
    for (std::size_t i = 0; i < alone.size(); ++i)
      ASSERT_TRUE(same(wide[i].lane(k), alone[i]))
          << name << " lane " << k << " value " << i << ": " << wide[i].lane(k) << ' ' << alone[i];
  }
}

// A trial at the pole in the geographic frame goes bad alone; its neighbours' bits do not notice.
TEST(StrapdownInLanes, EachLaneHasTheBitsOfOneAlone) {
  lane_is_alone<GeographicMechanization, TransverseMechanization>("geographic");
  lane_is_alone<TransverseMechanization, GridMechanization>("transverse");
  lane_is_alone<VirtualSphereMechanization, WanderMechanization>("virtual sphere");
  lane_is_alone<GridMechanization, EcefMechanization>("grid");
  lane_is_alone<WanderMechanization, VirtualSphereMechanization>("wander");
  lane_is_alone<EcefMechanization, GeographicMechanization>("ecef");
}

}  // namespace
}  // namespace loxo
