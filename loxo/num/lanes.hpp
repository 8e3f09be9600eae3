// SPDX-License-Identifier: Apache-2.0
// Eight trials side by side: the second and last scalar of the kernels. Always eight doubles, held
// in one, two or four registers as the compiler's flags allow (eight plain doubles where there are
// none). Every operation gives in each lane the bits of the same operation on `double`; a NaN stays
// in its lane.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>

// GCC 12 calls its own AVX-512 intrinsics uninitialised (bug 105593).
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <xsimd/xsimd.hpp>
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

#include "loxo/num/functions.hpp"
#include "loxo/num/real.hpp"

#define LOXO_INLINE [[gnu::always_inline]] inline

namespace loxo {

// One register of the processor, under the names that the rest of this page uses.
namespace batches {
#if defined(XSIMD_NO_SUPPORTED_ARCHITECTURE) || defined(LOXO_PLAIN_LANES)
using D = double;
using U = std::uint64_t;
using M = bool;
inline constexpr int kWidth = 1;
LOXO_INLINE D pick(M m, D a, D b) { return m ? a : b; }
LOXO_INLINE D root(D a) { return std::sqrt(a); }
LOXO_INLINE D down(D a) { return std::floor(a); }
LOXO_INLINE U bits(D a) { return std::bit_cast<U>(a); }
LOXO_INLINE D value(U a) { return std::bit_cast<D>(a); }
LOXO_INLINE M invert(M a) { return !a; }
LOXO_INLINE M both(M a, M b) { return a && b; }
LOXO_INLINE M either(M a, M b) { return a || b; }
LOXO_INLINE M odd(U a) { return (a & 1) != 0; }
LOXO_INLINE bool some(M a) { return a; }
template <int N>
LOXO_INLINE U turn(U a) {
  return std::rotl(a, N);
}
LOXO_INLINE D load(const double* p) { return *p; }
LOXO_INLINE U load(const std::uint64_t* p) { return *p; }
LOXO_INLINE void store(double* p, D a) { *p = a; }
LOXO_INLINE void store(std::uint64_t* p, U a) { *p = a; }
#else
using D = xsimd::batch<double>;
using U = xsimd::batch<std::uint64_t>;
using M = D::batch_bool_type;
inline constexpr int kWidth = static_cast<int>(D::size);
LOXO_INLINE D pick(const M& m, const D& a, const D& b) { return xsimd::select(m, a, b); }
LOXO_INLINE D root(const D& a) { return xsimd::sqrt(a); }
LOXO_INLINE D down(const D& a) { return xsimd::floor(a); }
LOXO_INLINE U bits(const D& a) { return xsimd::bitwise_cast<U>(a); }
LOXO_INLINE D value(const U& a) { return xsimd::bitwise_cast<D>(a); }
LOXO_INLINE M invert(const M& a) { return !a; }
LOXO_INLINE M both(const M& a, const M& b) { return a & b; }
LOXO_INLINE M either(const M& a, const M& b) { return a | b; }
// The lowest bit, moved into the sign of +-1.
LOXO_INLINE M odd(const U& a) { return value((a << 63) | bits(D(1.0))) < D(0.0); }
LOXO_INLINE bool some(const M& a) { return xsimd::any(a); }
template <int N>
LOXO_INLINE U turn(const U& a) {
#ifdef __AVX512F__
  return _mm512_rol_epi64(a.data, N);  // xsimd 8.1 has no rotation
#else
  return (a << N) | (a >> (64 - N));
#endif
}
LOXO_INLINE D load(const double* p) { return D::load_unaligned(p); }
LOXO_INLINE U load(const std::uint64_t* p) { return U::load_unaligned(p); }
LOXO_INLINE void store(double* p, const D& a) { a.store_unaligned(p); }
LOXO_INLINE void store(std::uint64_t* p, const U& a) { a.store_unaligned(p); }
#endif
}  // namespace batches

inline constexpr std::size_t kBatches = 8 / batches::kWidth;

// `Result{}` with expression(I) in each register, written out (GCC does not unroll such a loop at
// -O2).
#define LOXO_EACH(Result, expression)                                               \
  [&]<std::size_t... I>(std::index_sequence<I...>) __attribute__((always_inline)) { \
    Result r;                                                                       \
    ((r.b[I] = (expression)), ...);                                                 \
    return r;                                                                       \
  }                                                                                 \
  (std::make_index_sequence<kBatches>{})

// The truth value of a comparison, one a lane.
struct LaneMask {
  batches::M b[kBatches];

  LaneMask() = default;
  LOXO_INLINE LaneMask(bool same) {  // NOLINT(google-explicit-constructor)
    const batches::M m = batches::odd(batches::U(std::uint64_t{same}));
    *this = LOXO_EACH(LaneMask, m);
  }
  inline bool lane(int i) const;
};

// The 64 bits of eight doubles: exponents, signs, random numbers. Arithmetic is modulo 2^64.
struct LaneBits {
  batches::U b[kBatches];

  LaneBits() = default;
  LOXO_INLINE LaneBits(std::uint64_t same) {  // NOLINT(google-explicit-constructor)
    *this = LOXO_EACH(LaneBits, batches::U(same));
  }
  LOXO_INLINE static LaneBits load(const std::uint64_t* p) {
    return LOXO_EACH(LaneBits, batches::load(p + batches::kWidth * I));
  }
  LOXO_INLINE void store(std::uint64_t* p) const {
    for (std::size_t i = 0; i < kBatches; ++i) batches::store(p + batches::kWidth * i, b[i]);
  }
};

class Lanes {
 public:
  static constexpr int kLanes = 8;
  batches::D b[kBatches];

  Lanes() = default;
  // The same value in every lane; implicit, so that `2.0 * x` works for any scalar.
  LOXO_INLINE Lanes(double same) {  // NOLINT(google-explicit-constructor)
    *this = LOXO_EACH(Lanes, batches::D(same));
  }
  // Eight doubles, lane 0 first; no alignment asked for.
  LOXO_INLINE static Lanes load(const double* p) {
    return LOXO_EACH(Lanes, batches::load(p + batches::kWidth * I));
  }
  LOXO_INLINE void store(double* p) const {
    for (std::size_t i = 0; i < kBatches; ++i) batches::store(p + batches::kWidth * i, b[i]);
  }
  double lane(int i) const {
    double v[kLanes];
    store(v);
    return v[i];
  }
  void set_lane(int i, double x) {
    double v[kLanes];
    store(v);
    v[i] = x;
    *this = load(v);
  }
  inline Lanes& operator+=(const Lanes& o);
  inline Lanes& operator-=(const Lanes& o);
  inline Lanes& operator*=(const Lanes& o);
  inline Lanes& operator/=(const Lanes& o);
};

LOXO_INLINE Lanes operator+(const Lanes& x, const Lanes& y) {
  return LOXO_EACH(Lanes, x.b[I] + y.b[I]);
}
LOXO_INLINE Lanes operator-(const Lanes& x, const Lanes& y) {
  return LOXO_EACH(Lanes, x.b[I] - y.b[I]);
}
LOXO_INLINE Lanes operator*(const Lanes& x, const Lanes& y) {
  return LOXO_EACH(Lanes, x.b[I] * y.b[I]);
}
LOXO_INLINE Lanes operator/(const Lanes& x, const Lanes& y) {
  return LOXO_EACH(Lanes, x.b[I] / y.b[I]);
}
LOXO_INLINE Lanes operator+(const Lanes& x) { return x; }
LOXO_INLINE Lanes operator-(const Lanes& x) {
  const batches::U sign(std::uint64_t{1} << 63);
  return LOXO_EACH(Lanes, batches::value(batches::bits(x.b[I]) ^ sign));
}
LOXO_INLINE Lanes& Lanes::operator+=(const Lanes& o) { return *this = *this + o; }
LOXO_INLINE Lanes& Lanes::operator-=(const Lanes& o) { return *this = *this - o; }
LOXO_INLINE Lanes& Lanes::operator*=(const Lanes& o) { return *this = *this * o; }
LOXO_INLINE Lanes& Lanes::operator/=(const Lanes& o) { return *this = *this / o; }

LOXO_INLINE LaneMask operator<(const Lanes& x, const Lanes& y) {
  return LOXO_EACH(LaneMask, x.b[I] < y.b[I]);
}
LOXO_INLINE LaneMask operator<=(const Lanes& x, const Lanes& y) {
  return LOXO_EACH(LaneMask, x.b[I] <= y.b[I]);
}
LOXO_INLINE LaneMask operator>(const Lanes& x, const Lanes& y) { return y < x; }
LOXO_INLINE LaneMask operator>=(const Lanes& x, const Lanes& y) { return y <= x; }
LOXO_INLINE LaneMask operator==(const Lanes& x, const Lanes& y) {
  return LOXO_EACH(LaneMask, x.b[I] == y.b[I]);
}
LOXO_INLINE LaneMask operator!(const LaneMask& m) {
  return LOXO_EACH(LaneMask, batches::invert(m.b[I]));
}
LOXO_INLINE LaneMask operator!=(const Lanes& x, const Lanes& y) { return !(x == y); }
LOXO_INLINE LaneMask operator&(const LaneMask& m, const LaneMask& n) {
  return LOXO_EACH(LaneMask, batches::both(m.b[I], n.b[I]));
}
LOXO_INLINE LaneMask operator|(const LaneMask& m, const LaneMask& n) {
  return LOXO_EACH(LaneMask, batches::either(m.b[I], n.b[I]));
}

LOXO_INLINE Lanes select(const LaneMask& m, const Lanes& yes, const Lanes& no) {
  return LOXO_EACH(Lanes, batches::pick(m.b[I], yes.b[I], no.b[I]));
}
LOXO_INLINE bool any(const LaneMask& m) {
  bool r = false;
  for (std::size_t i = 0; i < kBatches; ++i) r = batches::some(m.b[i]) || r;
  return r;
}
LOXO_INLINE bool all(const LaneMask& m) { return !any(!m); }
inline bool LaneMask::lane(int i) const {
  return select(*this, Lanes(1.0), Lanes(0.0)).lane(i) != 0.0;
}

// Bits and back; the operators that exponents and counters need.
LOXO_INLINE LaneBits to_bits(const Lanes& x) { return LOXO_EACH(LaneBits, batches::bits(x.b[I])); }
LOXO_INLINE Lanes from_bits(const LaneBits& x) { return LOXO_EACH(Lanes, batches::value(x.b[I])); }
// Where the lowest bit is 1.
LOXO_INLINE LaneMask odd(const LaneBits& x) { return LOXO_EACH(LaneMask, batches::odd(x.b[I])); }
LOXO_INLINE LaneBits operator+(const LaneBits& x, const LaneBits& y) {
  return LOXO_EACH(LaneBits, x.b[I] + y.b[I]);
}
LOXO_INLINE LaneBits operator&(const LaneBits& x, const LaneBits& y) {
  return LOXO_EACH(LaneBits, x.b[I] & y.b[I]);
}
LOXO_INLINE LaneBits operator|(const LaneBits& x, const LaneBits& y) {
  return LOXO_EACH(LaneBits, x.b[I] | y.b[I]);
}
LOXO_INLINE LaneBits operator^(const LaneBits& x, const LaneBits& y) {
  return LOXO_EACH(LaneBits, x.b[I] ^ y.b[I]);
}
LOXO_INLINE LaneBits operator<<(const LaneBits& x, int n) {
  return LOXO_EACH(LaneBits, x.b[I] << n);
}
LOXO_INLINE LaneBits operator>>(const LaneBits& x, int n) {
  return LOXO_EACH(LaneBits, x.b[I] >> n);
}
template <int N>
LOXO_INLINE LaneBits rotate_left(const LaneBits& x) {
  return LOXO_EACH(LaneBits, batches::turn<N>(x.b[I]));
}

// The operations of libm that are exact or correctly rounded everywhere.
LOXO_INLINE Lanes sqrt(const Lanes& x) { return LOXO_EACH(Lanes, batches::root(x.b[I])); }
LOXO_INLINE Lanes floor(const Lanes& x) { return LOXO_EACH(Lanes, batches::down(x.b[I])); }
LOXO_INLINE Lanes fabs(const Lanes& x) {
  const batches::U rest(~(std::uint64_t{1} << 63));
  return LOXO_EACH(Lanes, batches::value(batches::bits(x.b[I]) & rest));
}
LOXO_INLINE Lanes copysign(const Lanes& size, const Lanes& sign) {
  const batches::U top(std::uint64_t{1} << 63), rest(~(std::uint64_t{1} << 63));
  return LOXO_EACH(
      Lanes, batches::value((batches::bits(size.b[I]) & rest) | (batches::bits(sign.b[I]) & top)));
}
LOXO_INLINE Lanes min(const Lanes& x, const Lanes& y) { return select(x < y, x, y); }
LOXO_INLINE Lanes max(const Lanes& x, const Lanes& y) { return select(x > y, x, y); }
#undef LOXO_EACH

}  // namespace loxo
