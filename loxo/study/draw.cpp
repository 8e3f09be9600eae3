// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/draw.hpp"

#include "loxo/num/error.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/random.hpp"

namespace loxo {
namespace {

// Streams of the parameters stand apart from those of the sensors.
constexpr std::uint64_t kParameterStreams = std::uint64_t{1} << 32;
constexpr std::uint64_t kShiftTrial = ~std::uint64_t{0};

double ratio(const double (&num)[8], const double (&den)[7], double r) {
  double n = num[7], d = den[6];
  for (int i = 6; i >= 0; --i) n = n * r + num[i];
  for (int i = 5; i >= 0; --i) d = d * r + den[i];
  return n / (d * r + 1.0);
}

// Degree, inner coefficients of the primitive polynomial, first direction numbers.
struct Direction {
  int s;
  unsigned a;
  unsigned m[7];
};
constexpr Direction kDirections[kSobolDimensions - 1] = {
    {1, 0, {1}},
    {2, 1, {1, 3}},
    {3, 1, {1, 3, 1}},
    {3, 2, {1, 1, 1}},
    {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}},
    {5, 2, {1, 1, 5, 5, 17}},
    {5, 4, {1, 1, 5, 5, 5}},
    {5, 7, {1, 1, 7, 11, 19}},
    {5, 11, {1, 1, 5, 1, 1}},
    {5, 13, {1, 1, 1, 3, 11}},
    {5, 14, {1, 3, 5, 5, 31}},
    {6, 1, {1, 3, 3, 9, 7, 49}},
    {6, 13, {1, 1, 1, 15, 21, 21}},
    {6, 16, {1, 3, 1, 13, 27, 49}},
    {6, 19, {1, 1, 1, 15, 7, 5}},
    {6, 22, {1, 3, 1, 15, 13, 25}},
    {6, 25, {1, 1, 5, 5, 19, 61}},
    {7, 1, {1, 3, 7, 11, 23, 15, 103}},
    {7, 4, {1, 3, 7, 13, 13, 15, 69}},
};
constexpr int kBits = 52;

struct Table {
  std::uint64_t v[kSobolDimensions][kBits];
};
Table make_table() {
  Table t{};
  for (int i = 0; i < kBits; ++i) t.v[0][i] = std::uint64_t{1} << (kBits - 1 - i);
  for (int d = 1; d < kSobolDimensions; ++d) {
    const Direction& p = kDirections[d - 1];
    for (int i = 0; i < kBits; ++i) {
      if (i < p.s) {
        t.v[d][i] = static_cast<std::uint64_t>(p.m[i]) << (kBits - 1 - i);
        continue;
      }
      std::uint64_t w = t.v[d][i - p.s] ^ (t.v[d][i - p.s] >> p.s);
      for (int k = 1; k < p.s; ++k)
        if ((p.a >> (p.s - 1 - k)) & 1) w ^= t.v[d][i - k];
      t.v[d][i] = w;
    }
  }
  return t;
}

bool is_sobol(Distribution::Kind k) {
  return k == Distribution::Kind::kSobol || k == Distribution::Kind::kSobolLog ||
         k == Distribution::Kind::kSobolNormal;
}

}  // namespace

double probit(double u) {
  constexpr double a[8] = {3.3871328727963666080e0, 1.3314166789178437745e2,
                           1.9715909503065514427e3, 1.3731693765509461125e4,
                           4.5921953931549871457e4, 6.7265770927008700853e4,
                           3.3430575583588128105e4, 2.5090809287301226727e3};
  constexpr double b[7] = {4.2313330701600911252e1, 6.8718700749205790830e2,
                           5.3941960214247511077e3, 2.1213794301586595867e4,
                           3.9307895800092710610e4, 2.8729085735721942674e4,
                           5.2264952788528545610e3};
  constexpr double c[8] = {1.42343711074968357734e0,  4.63033784615654529590e0,
                           5.76949722146069140550e0,  3.64784832476320460504e0,
                           1.27045825245236838258e0,  2.41780725177450611770e-1,
                           2.27238449892691845833e-2, 7.74545014278341407640e-4};
  constexpr double d[7] = {2.05319162663775882187e0,  1.67638483018380384940e0,
                           6.89767334985100004550e-1, 1.48103976427480074590e-1,
                           1.51986665636164571966e-2, 5.47593808499534494600e-4,
                           1.05075007164441684324e-9};
  constexpr double e[8] = {6.65790464350110377720e0,  5.46378491116411436990e0,
                           1.78482653991729133580e0,  2.96560571828504891230e-1,
                           2.65321895265761230930e-2, 1.24266094738807843860e-3,
                           2.71155556874348757815e-5, 2.01033439929228813265e-7};
  constexpr double f[7] = {5.99832206555887937690e-1, 1.36929880922735805310e-1,
                           1.48753612908506148525e-2, 7.86869131145613259100e-4,
                           1.84631831751005468180e-5, 1.42151175831644588870e-7,
                           2.04426310338993978564e-15};
  const double q = u - 0.5;
  if (fabs(q) <= 0.425) return q * ratio(a, b, 0.180625 - q * q);
  const double r = sqrt(-log(q < 0.0 ? u : 1.0 - u));
  return copysign(r <= 5.0 ? ratio(c, d, r - 1.6) : ratio(e, f, r - 5.0), q);
}

std::uint64_t sobol_bits(std::uint64_t index, int dimension) {
  static const Table table = make_table();
  std::uint64_t x = 0;
  // Gray code: the same points as in natural order, block of 2^n by block of 2^n.
  const std::uint64_t gray = index ^ (index >> 1);
  for (int i = 0; i < kBits; ++i)
    if ((gray >> i) & 1) x ^= table.v[dimension][i];
  return x;
}

Draws::Draws(std::vector<Distribution> distributions, std::uint64_t seed)
    : distributions_(std::move(distributions)), seed_(seed) {
  int next = 0;
  for (std::size_t j = 0; j < distributions_.size(); ++j) {
    const auto& d = distributions_[j];
    if (d.kind == Distribution::Kind::kGrid) cells_ *= d.values.size();
    dimension_.push_back(is_sobol(d.kind) ? next++ : -1);
    shift_.push_back(threefry({kShiftTrial, j}, {seed, kParameterStreams})[0] >> (64 - kBits));
  }
  if (next > kSobolDimensions)
    throw Error(ErrorKind::kInput,
                "expected at most " + std::to_string(kSobolDimensions) +
                    " Sobol parameters, found " + std::to_string(next),
                "key parameters");
}

void Draws::at(std::uint64_t trial, std::span<double> out) const {
  std::uint64_t cell = trial % cells_;
  const std::uint64_t index = trial / cells_;
  for (std::size_t j = distributions_.size(); j-- > 0;) {
    const auto& d = distributions_[j];
    const auto& v = d.values;
    const auto random = [&] {
      return Stream<double>{seed_, trial, kParameterStreams + 1 + j}.uniform(0);
    };
    const auto sobol = [&] {
      const std::uint64_t bits = sobol_bits(index, dimension_[j]) ^ shift_[j];
      return (static_cast<double>(bits) + 0.5) * 0x1p-52;
    };
    switch (d.kind) {
      case Distribution::Kind::kFixed:
        out[j] = v[0];
        break;
      case Distribution::Kind::kGrid:
        out[j] = v[cell % v.size()];
        cell /= v.size();
        break;
      case Distribution::Kind::kChoice: {
        const auto n = static_cast<double>(v.size());
        out[j] = v[static_cast<std::size_t>(random() * n)];
        break;
      }
      case Distribution::Kind::kUniform:
        out[j] = v[0] + (v[1] - v[0]) * random();
        break;
      case Distribution::Kind::kSobol:
        out[j] = v[0] + (v[1] - v[0]) * sobol();
        break;
      case Distribution::Kind::kLogUniform:
        out[j] = exp(log(v[0]) + (log(v[1]) - log(v[0])) * random());
        break;
      case Distribution::Kind::kSobolLog:
        out[j] = exp(log(v[0]) + (log(v[1]) - log(v[0])) * sobol());
        break;
      case Distribution::Kind::kNormal:
        out[j] = v[0] + v[1] * probit(random());
        break;
      case Distribution::Kind::kSobolNormal:
        out[j] = v[0] + v[1] * probit(sobol());
        break;
    }
  }
}

}  // namespace loxo
