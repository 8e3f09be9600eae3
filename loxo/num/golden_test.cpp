// SPDX-License-Identifier: Apache-2.0
// A change of a single bit of any function shows here. The same number must come from every
// processor level (tools/check_bits builds and runs all three) and from lanes.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "loxo/num/lanes.hpp"
#include "loxo/num/random.hpp"

namespace loxo {
namespace {

struct Hash {
  std::uint64_t h = 0xcbf29ce484222325;
  void add(double x) {
    auto w = std::isnan(x) ? 0x7ff8000000000000 : std::bit_cast<std::uint64_t>(x);
    for (int i = 0; i < 8; ++i, w >>= 8) h = (h ^ (w & 255)) * 0x100000001b3;
  }
};

constexpr std::size_t kResults = 25;

template <class S>
std::array<S, kResults> everything(std::uint64_t trial) {
  const Stream<S> stream{20261123, trial, 1};
  const S u = stream.uniform(0), n = stream.normal(1), x = 30.0 * n, big = 1e5 * n,
          y = stream.normal(2);
  S s, c;
  sincos(big, s, c);
  return {u,
          n,
          s,
          c,
          sin(x),
          cos(x),
          tan(big),
          asin(2.0 * u - 1.0),
          acos(2.0 * u - 1.0),
          atan(x),
          atan2(n, y),
          exp(x),
          expm1(n),
          log(u),
          log1p(n),
          sinh(x),
          cosh(x),
          tanh(n),
          asinh(x),
          atanh(n),
          hypot(n, y),
          round(x),
          wrap_pi(x),
          wrap_2pi(x),
          stream.template normals<12>(7)[11]};
}

// Result by result, lane 0 to 7 of each, over blocks of eight trials.
template <class S>
std::uint64_t hash_of_everything() {
  Hash h;
  for (std::uint64_t t = 0; t < 512; t += 8) {
    if constexpr (std::is_same_v<S, Lanes>) {
      for (const Lanes& r : everything<Lanes>(t))
        for (int k = 0; k < 8; ++k) h.add(r.lane(k));
    } else {
      std::array<double, kResults> r[8];
      for (std::uint64_t k = 0; k < 8; ++k) r[k] = everything<double>(t + k);
      for (std::size_t i = 0; i < kResults; ++i)
        for (const auto& lane : r) h.add(lane[i]);
    }
  }
  return h.h;
}

constexpr std::uint64_t kGolden = 0x596ebd0686ae2c68;

TEST(Golden, BitsAreThoseOfEveryOtherProcessor) {
  EXPECT_EQ(hash_of_everything<Lanes>(), kGolden) << std::hex << hash_of_everything<Lanes>();
  EXPECT_EQ(hash_of_everything<double>(), kGolden) << std::hex << hash_of_everything<double>();
}

}  // namespace
}  // namespace loxo
