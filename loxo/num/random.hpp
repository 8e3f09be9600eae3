// SPDX-License-Identifier: Apache-2.0
// Random numbers as a pure function of (campaign seed, trial, stream, sample): no state, any order,
// any thread. Source: Threefry-2x64, 13 rounds (Salmon, Moraes, Dror, Shaw, "Parallel random
// numbers: as easy as 1, 2, 3", SC'11); normals by Box and Muller on 52-bit uniforms (largest
// size 8.57).
#pragma once
#include <array>
#include <cstdint>

#include "loxo/num/real.hpp"

namespace loxo {

// Two words of Threefry-2x64 after `rounds` rounds; the published test vectors are those of 13
// and 20.
std::array<std::uint64_t, 2> threefry(std::array<std::uint64_t, 2> counter,
                                      std::array<std::uint64_t, 2> key, int rounds = 13);

// One source of noise of one trial: a gyro axis, a draw of a parameter. In lanes, lane k belongs to
// trial + k and has the bits that Stream<double>{seed, trial + k, stream} gives.
template <Real S = double>
struct Stream {
  std::uint64_t seed = 0;
  std::uint64_t trial = 0;
  std::uint64_t stream = 0;

  static constexpr int kMaxNormals = 510;  // per sample

  // Uniform in the open interval (0, 1), on odd multiples of 2^-53.
  S uniform(std::uint64_t sample) const;
  // Standard normal; the same as normals<N>(sample)[0]. sample < 2^56. Independent of
  // uniform(sample).
  S normal(std::uint64_t sample) const;
  // The first N of a sample's standard normals, for one step of several sensor axes.
  template <int N>
  std::array<S, N> normals(std::uint64_t sample) const {
    static_assert(N > 0 && N <= kMaxNormals);
    std::array<S, N> out;
    fill(sample, out.data(), N);
    return out;
  }
  void fill(std::uint64_t sample, S* out, int count) const;
};

}  // namespace loxo
