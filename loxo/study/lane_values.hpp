// SPDX-License-Identifier: Apache-2.0
// From a trial's lanes to doubles and back: what runs lane by lane takes its numbers out of scalars
// of lanes here, and puts its results into them. For the .cpp files of kinds only.
#pragma once
#include <array>
#include <concepts>
#include <cstddef>

#include "loxo/ins/mechanization.hpp"
#include "loxo/num/lanes.hpp"

namespace loxo {

// A scalar's lanes as doubles and back.
inline void spread(double x, double* out) { out[0] = x; }
inline void spread(const Lanes& x, double* out) { x.store(out); }
template <Real S>
S gather(const double* in) {
  if constexpr (std::same_as<S, double>)
    return in[0];
  else
    return Lanes::load(in);
}
template <Real S>
inline constexpr int kWide = ScalarTraits<S>::kLanes;

// The lanes of several numbers, one row a lane.
template <Real S, std::size_t N>
struct Spread {
  double lane[kWide<S>][N];
  explicit Spread(const std::array<S, N>& x) {
    double v[Lanes::kLanes];
    for (std::size_t j = 0; j < N; ++j) {
      spread(x[j], v);
      for (int k = 0; k < kWide<S>; ++k) lane[k][j] = v[k];
    }
  }
};
// The way back: rows[k][j] is lane k of out[j], j < count.
template <Real S, class Rows>
void gather_rows(const Rows& rows, std::size_t count, S* out) {
  double v[Lanes::kLanes];
  for (std::size_t j = 0; j < count; ++j) {
    for (int k = 0; k < kWide<S>; ++k) v[k] = rows[k][j];
    out[j] = gather<S>(v);
  }
}

// Lane k alone, of a number and of a state.
template <Real S>
double lane_of(const S& x, int k) {
  double v[Lanes::kLanes];
  spread(x, v);
  return v[k];
}
template <Real S>
EcefState<double> lane_of(const EcefState<S>& x, int k) {
  const auto of = [&](const S& y) { return lane_of(y, k); };
  return {{of(x.r.x), of(x.r.y), of(x.r.z)},
          {of(x.v.x), of(x.v.y), of(x.v.z)},
          {of(x.q_eb.w), of(x.q_eb.x), of(x.q_eb.y), of(x.q_eb.z)}};
}

}  // namespace loxo
