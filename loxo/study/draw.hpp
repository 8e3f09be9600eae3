// SPDX-License-Identifier: Apache-2.0
// The parameters of trial k: a pure function of (campaign seed, k), whatever ran before.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

namespace loxo {

// Inverse of the standard normal distribution, u in (0, 1); relative error below 1e-15 (Wichura, AS
// 241).
double probit(double u);

// Point `index` of the Sobol sequence in dimension 0 … kSobolDimensions - 1, in 52 bits; direction
// numbers of Joe and Kuo (2008).
inline constexpr int kSobolDimensions = 21;
std::uint64_t sobol_bits(std::uint64_t index, int dimension);

struct Distribution {
  enum class Kind {
    kFixed,    // values[0]
    kGrid,     // every value of the list; several grids: every combination, the last runs fastest
    kChoice,   // one of the list at random
    kUniform,  // values[0] to values[1]
    kLogUniform,
    kNormal,  // mean values[0], sigma values[1]
    kSobol,   // as uniform, low-discrepancy
    kSobolLog,
    kSobolNormal,
  };
  Kind kind = Kind::kFixed;
  std::vector<double> values;  // SI
};

class Draws {
 public:
  Draws() = default;
  Draws(std::vector<Distribution> distributions, std::uint64_t seed);
  // Parameters of a trial, in the order given.
  void at(std::uint64_t trial, std::span<double> out) const;
  std::size_t size() const { return distributions_.size(); }
  // Combinations of the grids; trial k belongs to combination k modulo this.
  std::uint64_t cells() const { return cells_; }

 private:
  std::vector<Distribution> distributions_;
  std::vector<std::uint64_t> shift_;  // random digital shift of a Sobol dimension
  std::vector<int> dimension_;        // Sobol dimension, -1 where not
  std::uint64_t seed_ = 0, cells_ = 1;
};

}  // namespace loxo
