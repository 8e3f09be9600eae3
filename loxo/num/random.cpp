// SPDX-License-Identifier: Apache-2.0
#include "loxo/num/random.hpp"

#include <bit>
#include <type_traits>

#include "loxo/num/function_kernels.hpp"

namespace loxo {
namespace {

constexpr int kRounds = 13;
constexpr std::uint64_t kParity = 0x1bd11bdaa9fc1a22;

template <int N>
LOXO_INLINE std::uint64_t rotate_left(std::uint64_t x) {
  return std::rotl(x, N);
}

// Rounds R to last - 1 of Threefry-2x64 (table 2 of the paper); the key is added after every
// fourth.
template <int R, int Last, class B>
LOXO_INLINE void mix(B& x, B& y, const std::uint64_t (&key)[3]) {
  if constexpr (R < Last) {
    constexpr int kTurns[8] = {16, 42, 12, 31, 16, 32, 24, 21};
    x = x + y;
    y = rotate_left<kTurns[R % 8]>(y) ^ x;
    if constexpr (R % 4 == 3) {
      constexpr int kStep = R / 4 + 1;
      x = x + B(key[kStep % 3]);
      y = y + B(key[(kStep + 1) % 3] + kStep);
    }
    mix<R + 1, Last>(x, y, key);
  }
}
template <int Rounds, class B>
LOXO_INLINE void encrypt(B& x, B& y, std::uint64_t k0, std::uint64_t k1) {
  const std::uint64_t key[3] = {k0, k1, kParity ^ k0 ^ k1};
  x = x + B(k0);
  y = y + B(k1);
  mix<0, Rounds>(x, y, key);
}

// The top 52 bits as an odd multiple of 2^-53 in (0, 1): exact.
template <Real S>
LOXO_INLINE S unit(const BitsOf<S>& w) {
  return from_bits((w >> 12) | BitsOf<S>(0x3ff0000000000000)) - (1.0 - 0x1p-53);
}

template <Real S>
LOXO_INLINE BitsOf<S> trial_bits(std::uint64_t trial) {
  if constexpr (std::is_same_v<S, double>) {
    return trial;
  } else {
    std::uint64_t t[Lanes::kLanes];
    for (std::uint64_t k = 0; k < Lanes::kLanes; ++k) t[k] = trial + k;
    return LaneBits::load(t);
  }
}

// Box and Muller: sqrt(-2 log u) at a uniform angle. The angle's quadrant comes from the two lowest
// bits of the word, the place in the quadrant from the top 52.
template <Real S>
LOXO_INLINE void normal_pair(const BitsOf<S>& v, const BitsOf<S>& w, S& a, S& b) {
  const S r = sqrt(-2.0 * kernels::log_of<S>(unit<S>(v), S(0.0), S(0.0)));
  const S t = (unit<S>(w) - 0.5) * (kernels::kPiHi / 2), z = t * t;
  const S s = t + t * (z * kernels::poly(kernels::kSinC, z));
  const S c = (1.0 - 0.5 * z) + z * (z * kernels::poly(kernels::kCosC, z));
  const auto swap = odd(w);
  a = r * kernels::flip_sign(select(swap, s, c), w << 62);
  b = r * kernels::flip_sign(select(swap, c, s), w << 62);
}

}  // namespace

std::array<std::uint64_t, 2> threefry(std::array<std::uint64_t, 2> counter,
                                      std::array<std::uint64_t, 2> key, int rounds) {
  if (rounds == 20)
    encrypt<20>(counter[0], counter[1], key[0], key[1]);
  else
    encrypt<kRounds>(counter[0], counter[1], key[0], key[1]);
  return counter;
}

// Words of a sample: blocks 256 sample … + 254 are pairs of normals, + 255 the uniform.
template <Real S>
S Stream<S>::uniform(std::uint64_t sample) const {
  BitsOf<S> x = trial_bits<S>(trial), y(sample << 8 | 255);
  encrypt<kRounds>(x, y, seed, stream);
  return unit<S>(x);
}

template <Real S>
S Stream<S>::normal(std::uint64_t sample) const {
  BitsOf<S> x = trial_bits<S>(trial), y(sample << 8);
  encrypt<kRounds>(x, y, seed, stream);
  S a, b;
  normal_pair(x, y, a, b);
  return a;
}

template <Real S>
void Stream<S>::fill(std::uint64_t sample, S* out, int count) const {
  const BitsOf<S> t = trial_bits<S>(trial);
  S a, b;
  for (int i = 0; i < count; i += 2) {
    BitsOf<S> x = t, y(sample << 8 | static_cast<std::uint64_t>(i / 2));
    encrypt<kRounds>(x, y, seed, stream);
    normal_pair<S>(x, y, a, b);
    out[i] = a;
    if (i + 1 < count) out[i + 1] = b;
  }
}

template struct Stream<double>;
template struct Stream<Lanes>;

}  // namespace loxo
