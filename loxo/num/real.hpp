// SPDX-License-Identifier: Apache-2.0
// The closed list of scalars: `double`, and `Lanes` (eight trials side by side). Kernels are
// templates over a Real, instantiated for both in their .cpp, and choose with select(); they never
// branch on data.
#pragma once
#include <cmath>
#include <concepts>

namespace loxo {

class Lanes;      // num/lanes.hpp
struct LaneMask;  // num/lanes.hpp

template <class S>
concept Real = std::same_as<S, double> || std::same_as<S, Lanes>;

template <class S>
struct ScalarTraits;
template <>
struct ScalarTraits<double> {
  using Mask = bool;
  static constexpr int kLanes = 1;
};
template <>
struct ScalarTraits<Lanes> {
  using Mask = LaneMask;
  static constexpr int kLanes = 8;
};

// The truth value of a comparison of two S: bool, or one bit a lane.
template <Real S>
using MaskOf = typename ScalarTraits<S>::Mask;

inline double select(bool c, double yes, double no) { return c ? yes : no; }
inline bool any(bool c) { return c; }
inline bool all(bool c) { return c; }

}  // namespace loxo
