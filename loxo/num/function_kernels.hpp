// SPDX-License-Identifier: Apache-2.0
// The one body of every function of functions.hpp, for double and lanes. Included by functions.cpp
// and by inner loops that want them inline. No fused operation, no branch on data. Coefficients:
// tools/minimax.py. The exact sum and product of two doubles are Knuth's and Dekker's.
#pragma once
#include <bit>
#include <limits>

#include "loxo/num/lanes.hpp"

namespace loxo {

LOXO_INLINE std::uint64_t to_bits(double x) { return std::bit_cast<std::uint64_t>(x); }
LOXO_INLINE double from_bits(std::uint64_t x) { return std::bit_cast<double>(x); }
LOXO_INLINE bool odd(std::uint64_t x) { return (x & 1) != 0; }
template <Real S>
using BitsOf = decltype(to_bits(std::declval<S>()));

namespace kernels {

inline constexpr double kInf = std::numeric_limits<double>::infinity();
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kMagic =
    0x1.8p52;  // adding it rounds to an integer that stands in the low bits
inline constexpr std::uint64_t kSign = std::uint64_t{1} << 63;

// A number as an unevaluated sum, |lo| about an ulp of hi or less.
template <Real S>
struct Two {
  S hi, lo;
};
template <Real S>
LOXO_INLINE Two<S> two_sum(const S& a, const S& b) {
  const S s = a + b, t = s - a;
  return {s, (a - (s - t)) + (b - t)};
}
// Exact for |a| >= |b| or a = 0.
template <Real S>
LOXO_INLINE Two<S> fast_two_sum(const S& a, const S& b) {
  const S s = a + b;
  return {s, (a - s) + b};
}
// Exact for |a|, |b| < 2^996 where nothing underflows.
template <Real S>
LOXO_INLINE Two<S> two_product(const S& a, const S& b) {
  const S p = a * b, ca = 134217729.0 * a, cb = 134217729.0 * b;
  const S ah = ca - (ca - a), al = a - ah, bh = cb - (cb - b), bl = b - bh;
  return {p, ((ah * bh - p) + ah * bl + al * bh) + al * bl};
}
template <Real S>
LOXO_INLINE Two<S> divide(const Two<S>& a, const Two<S>& b) {
  const S q = a.hi / b.hi;
  const Two<S> p = two_product(q, b.hi);
  return {q, ((((a.hi - p.hi) - p.lo) + a.lo) - q * b.lo) / b.hi};
}
template <Real S>
LOXO_INLINE Two<S> root(const Two<S>& a) {
  const S r = sqrt(a.hi);
  const Two<S> p = two_product(r, r);
  return {r, select(r > 0.0, (((a.hi - p.hi) - p.lo) + a.lo) / (2.0 * r), S(0.0))};
}

// c[0] + c[1] z + c[2] z^2 …, even and odd powers in two chains.
template <int K, int N, Real S>
LOXO_INLINE S chain(const double (&c)[N], const S& w) {
  if constexpr (K + 2 >= N)
    return S(c[K]);
  else
    return c[K] + w * chain<K + 2>(c, w);
}
template <int N, Real S>
LOXO_INLINE S poly(const double (&c)[N], const S& z) {
  const S w = z * z;
  return chain<0>(c, w) + z * chain<1>(c, w);
}

// Size of x with the sign of the top bit of `flip` turned.
template <Real S>
LOXO_INLINE S flip_sign(const S& x, const BitsOf<S>& flip) {
  return from_bits(to_bits(x) ^ (flip & BitsOf<S>(kSign)));
}
// 2^n for an integer n in [-1022, 1023].
template <Real S>
LOXO_INLINE S power_of_two(const S& n) {
  return from_bits(to_bits(n + (kMagic + 1023.0)) << 52);
}

// ---- sine, cosine, tangent
// -------------------------------------------------------------------------------
inline constexpr double kSinC[] = {
    -0x1.5555555555555p-3,  0x1.1111111111110p-7,  -0x1.a01a01a019938p-13, 0x1.71de3a5460950p-19,
    -0x1.ae645412c4390p-26, 0x1.61217f0a95ad6p-33, -0x1.ab17d37ab5989p-41};
inline constexpr double kCosC[] = {0x1.5555555555555p-5,  -0x1.6c16c16c16967p-10,
                                   0x1.a01a019f4eaf9p-16, -0x1.27e4fa17d9624p-22,
                                   0x1.1eeb68e88cbb9p-29, -0x1.907da2e9cd397p-37};

// sin and cos of hi + lo, |hi| <= pi/4, as leading part and correction.
template <Real S>
LOXO_INLINE void sincos_reduced(const S& hi, const S& lo, Two<S>& s, Two<S>& c) {
  const S z = hi * hi, v = z * hi;
  // sin(hi + lo) = sin hi + lo cos hi; the cubic term apart, its rounding is what counts.
  const S r = chain<1>(kSinC, z * z) + z * chain<2>(kSinC, z * z);
  s = {hi, v * kSinC[0] + (z * (v * r - 0.5 * lo) + lo)};
  const S h = 0.5 * z, w = 1.0 - h;
  c = {w, ((1.0 - w) - h) + (z * (z * poly(kCosC, z)) - hi * lo)};
}

// |x| - n pi/2 as hi + lo (Cody and Waite in four parts: the first three products are exact for
// |x| <= kTrigDomain); returns the bits whose two lowest are n modulo 4.
template <Real S>
LOXO_INLINE BitsOf<S> reduce_quadrant(const S& a, S& hi, S& lo) {
  const S big = a * 0x1.45f306dc9c883p-1 + kMagic;
  const S n = big - kMagic;
  const S w = (a - n * 0x1.921fb54p+0) - n * 0x1.10b46p-30;
  const Two<S> t = two_sum(w, -(n * 0x1.1a62630000000p-54));
  hi = t.hi;
  lo = t.lo - n * 0x1.8a2e03707344ap-81;
  return to_bits(big);
}

template <Real S>
LOXO_INLINE void sincos(const S& x, S& sine, S& cosine) {
  using B = BitsOf<S>;
  const S ax = fabs(x);
  const S a = select(ax <= kTrigDomain, ax, S(kNan));
  S hi, lo;
  const B q = reduce_quadrant(a, hi, lo);
  Two<S> s, c;
  sincos_reduced(hi, lo, s, c);
  const S sp = s.hi + s.lo, cp = c.hi + c.lo;
  const auto swap = odd(q);
  sine = flip_sign(select(swap, cp, sp), (q << 62) ^ to_bits(x));
  cosine = flip_sign(select(swap, sp, cp), (q + B(1)) << 62);
}

template <Real S>
LOXO_INLINE S tan(const S& x) {
  const S ax = fabs(x);
  const S a = select(ax <= kTrigDomain, ax, S(kNan));
  S hi, lo;
  const BitsOf<S> q = reduce_quadrant(a, hi, lo);
  Two<S> s, c;
  const Two<S> r = fast_two_sum(hi, lo);  // next to a pole lo is far more than an ulp of hi
  sincos_reduced(r.hi, r.lo, s, c);
  s = fast_two_sum(s.hi, s.lo);
  c = fast_two_sum(c.hi, c.lo);
  const auto swap = odd(q);
  const Two<S> num{select(swap, c.hi, s.hi), select(swap, c.lo, s.lo)};
  const Two<S> den{select(swap, s.hi, c.hi), select(swap, s.lo, c.lo)};
  const Two<S> t = divide(num, den);
  return flip_sign(select(a < 0x1p-28, a, t.hi + t.lo), (q << 63) ^ to_bits(x));
}

// ---- inverse tangent, sine, cosine
// -----------------------------------------------------------------------
inline constexpr double kAtanC[] = {
    -0x1.5555555555555p-2, 0x1.9999999999953p-3, -0x1.249249248d7c2p-3, 0x1.c71c71c302a00p-4,
    -0x1.745d165d8c177p-4, 0x1.3b1392ce2c500p-4, -0x1.110e8737cc859p-4, 0x1.e19a00cdce305p-5,
    -0x1.ac7a0831e8d31p-5, 0x1.74db58766a744p-5, -0x1.1b2d56c608f2ap-5, 0x1.0ac544338d64ap-6};
inline constexpr double kPiHi = 0x1.921fb54442d18p+1, kPiLo = 0x1.1a62633145c07p-53;
inline constexpr double kPi34Hi = 0x1.2d97c7f3321d2p+1, kPi34Lo = 0x1.a79394c9e8a0ap-54;

// Angle in [0, pi] of (x, y), y >= 0, |x| and y finite, not both 0, the larger in [2^-900, 2^900].
template <Real S>
LOXO_INLINE S angle(const Two<S>& y, const Two<S>& ax, const MaskOf<S>& left) {
  // tan of the angle to the nearest of 0, pi/4, pi/2: at most tan(pi/8).
  const auto steep = y.hi > 0x1.3504f333f9de6p+1 * ax.hi;
  const auto flat = y.hi <= 0x1.a827999fcef32p-2 * ax.hi;
  const Two<S> d = two_sum(y.hi, -ax.hi), s = two_sum(y.hi, ax.hi);
  const Two<S> num{select(flat, y.hi, select(steep, -ax.hi, d.hi)),
                   select(flat, y.lo, select(steep, -ax.lo, d.lo + (y.lo - ax.lo)))};
  const Two<S> den{select(flat, ax.hi, select(steep, y.hi, s.hi)),
                   select(flat, ax.lo, select(steep, y.lo, s.lo + (y.lo + ax.lo)))};
  const Two<S> q = divide(num, den);
  const S z = q.hi * q.hi;
  const S tail = q.hi * (z * poly(kAtanC, z)) + (q.lo - q.lo * z);
  // Mirrored for negative x: pi - angle.
  const S turn = select(left, S(-1.0), S(1.0));
  const S off = select(flat, select(left, S(kPiHi), S(0.0)),
                       select(steep, S(kPiHi / 2), select(left, S(kPi34Hi), S(kPiHi / 4))));
  const S off_lo = select(flat, select(left, S(kPiLo), S(0.0)),
                          select(steep, S(kPiLo / 2), select(left, S(kPi34Lo), S(kPiLo / 4))));
  const Two<S> r = fast_two_sum(off, turn * q.hi);
  return r.hi + (r.lo + (turn * tail + off_lo));
}

template <Real S>
LOXO_INLINE S atan2(const S& y, const S& x) {
  const S ay = fabs(y), ax = fabs(x), m = max(ay, ax);
  const auto endless = m == kInf;
  const S k = select(m > 0x1p900, S(0x1p-200), select(m < 0x1p-800, S(0x1p300), S(1.0)));
  S num = select(endless, select(ay == kInf, S(1.0), S(0.0)), ay * k);
  S den = select(endless, select(ax == kInf, S(1.0), S(0.0)), ax * k);
  den = select(m == 0.0, S(1.0), den);
  const auto left = copysign(S(1.0), x) < 0.0;
  const S r = angle<S>({num, S(0.0)}, {den, S(0.0)}, left);
  const S sum = x + y;
  return select((x == x) & (y == y), copysign(r, y), sum);
}

template <Real S>
LOXO_INLINE S atan(const S& x) {
  return atan2<S>(x, S(1.0));
}

// sqrt(1 - x^2) to twice the working precision; NaN for |x| > 1.
template <Real S>
LOXO_INLINE Two<S> cosine_of_sine(const S& x) {
  const Two<S> p = two_product(x, x);
  const Two<S> d = two_sum(S(1.0), -p.hi);
  const Two<S> c = fast_two_sum(d.hi, d.lo - p.lo);
  return root(Two<S>{select(fabs(x) <= 1.0, c.hi, S(kNan)), c.lo});
}
template <Real S>
LOXO_INLINE S asin(const S& x) {
  const S a = fabs(x);
  const S r = angle<S>({a, S(0.0)}, cosine_of_sine(a), S(1.0) < S(0.0));
  return copysign(select(a < 0x1p-28, a, r), x);
}
template <Real S>
LOXO_INLINE S acos(const S& x) {
  const S a = fabs(x);
  return angle<S>(cosine_of_sine(a), {a, S(0.0)}, x < 0.0);
}

// ---- exponentials
// ----------------------------------------------------------------------------------------
inline constexpr double kExpC[] = {
    0x1.5555555555556p-3,  0x1.5555555555555p-5,  0x1.11111111109aap-7,  0x1.6c16c16c167dcp-10,
    0x1.a01a01a7cb3e6p-13, 0x1.a01a01a47f17fp-16, 0x1.71de0d92b676cp-19, 0x1.27e4e1e4b569ep-22,
    0x1.af38eb797eb13p-26, 0x1.1f670514bc822p-29};
inline constexpr double kLn2Hi = 0x1.62e42fefa3800p-1,
                        kLn2Lo = 0x1.ef35793c76730p-45;  // 42 bits and the rest

// x = n ln 2 + hi + lo, |hi| <= ln(2)/2, |x| < 2000.
template <Real S>
LOXO_INLINE void reduce_exponent(const S& x, S& n, Two<S>& r) {
  n = (x * 0x1.71547652b82fep+0 + kMagic) - kMagic;
  r = fast_two_sum(x - n * kLn2Hi, -(n * kLn2Lo));
}
template <Real S>
LOXO_INLINE S exp(const S& x) {
  const S a = select(x > 710.0, S(710.0), select(x < -746.0, S(-746.0), x));
  S n;
  Two<S> r;
  reduce_exponent(a, n, r);
  const S z = r.hi * r.hi;
  const S y = 1.0 + (r.hi + (z * (0.5 + r.hi * poly(kExpC, r.hi)) + (r.lo + r.lo * r.hi)));
  // In two steps: the first exact, the second rounds once where the result is subnormal.
  const S half = (0.5 * n + kMagic) - kMagic;
  return (y * power_of_two(half)) * power_of_two(n - half);
}
// e^r - 1 to twice the working precision (relative 2^-58).
template <Real S>
LOXO_INLINE Two<S> expm1_reduced(const Two<S>& r) {
  const Two<S> z = two_product(r.hi, r.hi);
  const Two<S> a = fast_two_sum(r.hi, 0.5 * z.hi);
  const S tail = r.hi * z.hi * poly(kExpC, r.hi) + (0.5 * z.lo + a.lo + (r.lo + r.lo * r.hi));
  return fast_two_sum(a.hi, tail);
}
template <Real S>
LOXO_INLINE S expm1(const S& x) {
  const S a = select(x > 710.0, S(710.0), select(x < -40.0, S(-40.0), x));
  S n;
  Two<S> r;
  reduce_exponent(a, n, r);
  const Two<S> p = expm1_reduced(r);
  const S m = power_of_two(n - 1.0);  // half of it, that 2^1024 be not needed
  const Two<S> base = two_sum(m, S(-0.5));
  const Two<S> sum = two_sum(base.hi, m * p.hi);
  const S y = 2.0 * (sum.hi + (sum.lo + (base.lo + m * p.lo)));
  return copysign(select(fabs(x) < 0x1p-54, fabs(x), y), x);
}

// sinh and cosh of a >= 0 from one reduction, to twice the working precision, and halved once more.
template <Real S>
LOXO_INLINE void sinh_cosh_half(const S& a, Two<S>& s, Two<S>& c) {
  S n;
  Two<S> r;
  reduce_exponent(select(a > 710.6, S(710.6), a), n, r);
  const Two<S> p = expm1_reduced(r);
  // e^-r - 1 = -p / (1 + p).
  const Two<S> d = two_sum(S(1.0), p.hi);
  const Two<S> q = divide(p, Two<S>{d.hi, d.lo + p.lo});
  // e^a/4 = up (1 + p), e^-a/4 = down (1 - q); `down` underflows long after it has become
  // negligible.
  const S up = power_of_two(n - 2.0), down = power_of_two(-2.0 - select(n > 1000.0, S(1000.0), n));
  const Two<S> bs = two_sum(up, -down), bc = two_sum(up, down);
  const Two<S> ts = two_sum(up * p.hi, down * q.hi), tc = two_sum(up * p.hi, -(down * q.hi));
  const S ls = up * p.lo + down * q.lo, lc = up * p.lo - down * q.lo;
  s = two_sum(bs.hi, ts.hi);
  s = fast_two_sum(s.hi, s.lo + (bs.lo + ts.lo + ls));
  c = two_sum(bc.hi, tc.hi);
  c = fast_two_sum(c.hi, c.lo + (bc.lo + tc.lo + lc));
}
template <Real S>
LOXO_INLINE S sinh(const S& x) {
  const S a = fabs(x);
  Two<S> s, c;
  sinh_cosh_half(a, s, c);
  return copysign(select(a < 0x1p-28, a, 2.0 * s.hi), x);
}
template <Real S>
LOXO_INLINE S cosh(const S& x) {
  Two<S> s, c;
  sinh_cosh_half(fabs(x), s, c);
  return 2.0 * c.hi;
}
template <Real S>
LOXO_INLINE S tanh(const S& x) {
  const S a = fabs(x);
  Two<S> s, c;
  sinh_cosh_half(select(a > 30.0, S(30.0), a), s, c);
  const Two<S> t = divide(s, c);
  return copysign(select(a < 0x1p-28, a, t.hi + t.lo), x);
}

// ---- logarithms
// ------------------------------------------------------------------------------------------
inline constexpr double kLogC[] = {0x1.5555555555555p-1, 0x1.9999999999a38p-2, 0x1.2492492476c24p-2,
                                   0x1.c71c72016baf2p-3, 0x1.745cf8fccb602p-3, 0x1.3b1c370092383p-3,
                                   0x1.0fbe69b2a187bp-3, 0x1.0c0569de6604dp-3};
inline constexpr std::uint64_t kRootHalf = 0x3fe6a09e667f3bcd;  // bits of sqrt(1/2)

// log(u 2^extra) + c for a normal u > 0; c is ulo / u where the argument is u + ulo.
template <Real S>
LOXO_INLINE S log_of(const S& u, const S& c, const S& extra) {
  using B = BitsOf<S>;
  // u = 2^e m, m in [sqrt(1/2), sqrt(2)).
  const B shifted = to_bits(u) + B(0x3ff0000000000000 - kRootHalf);
  const S e = (from_bits((shifted >> 52) | B(0x4330000000000000)) - (0x1p52 + 1023.0)) + extra;
  const S m = from_bits((shifted & B(0x000fffffffffffff)) + B(kRootHalf));
  const S f = m - 1.0, s = f / (2.0 + f), z = s * s;
  const S h = 0.5 * f * f;
  const Two<S> sum = fast_two_sum(e * kLn2Hi, f);
  // log(1 + f) = f - h + s (h + R), R = z (2/3 + 2/5 z + …), s = f / (2 + f).
  return sum.hi + (sum.lo - (h - (s * (h + z * poly(kLogC, z)) + (e * kLn2Lo + c))));
}
template <Real S>
LOXO_INLINE S log_ends(const S& y, const S& x) {
  const S end = select(x == 0.0, S(-kInf), select(x == kInf, S(kInf), S(kNan)));
  return select((x > 0.0) & (x < kInf), y, end);
}
template <Real S>
LOXO_INLINE S log(const S& x) {
  const auto tiny = x < 0x1p-1022;
  return log_ends<S>(log_of<S>(select(tiny, x * 0x1p54, x), S(0.0), select(tiny, S(-54.0), S(0.0))),
                     x);
}
// log(1 + a) for a > -1.
template <Real S>
LOXO_INLINE S log1p_of(const Two<S>& a) {
  const Two<S> u = two_sum(S(1.0), a.hi);
  return log_of<S>(u.hi, (u.lo + a.lo) / u.hi, S(0.0));
}
template <Real S>
LOXO_INLINE S log1p(const S& x) {
  return copysign(log_ends<S>(log1p_of<S>({x, S(0.0)}), 1.0 + x), x);
}
template <Real S>
LOXO_INLINE S asinh(const S& x) {
  // a + a^2 / (1 + sqrt(1 + a^2)) = e^y - 1; beyond 2^28 y = log(2 a).
  const S ax = fabs(x);
  const auto big = ax > 0x1p28;
  const S a = select(big, S(1.0), ax);
  const Two<S> t = two_product(a, a), t1 = two_sum(S(1.0), t.hi);
  const Two<S> r = root(Two<S>{t1.hi, t1.lo + t.lo}), d = two_sum(S(1.0), r.hi);
  const Two<S> q = divide(t, Two<S>{d.hi, d.lo + r.lo});
  const Two<S> w = two_sum(a, q.hi), u = two_sum(S(1.0), w.hi);
  const S y = log_of<S>(select(big, ax, u.hi), select(big, S(0.0), (u.lo + (w.lo + q.lo)) / u.hi),
                        select(big, S(1.0), S(0.0)));
  const S whole = select(ax < 0x1p-28, ax, y);
  return copysign(select(ax < kInf, whole, ax), x);
}
template <Real S>
LOXO_INLINE S atanh(const S& x) {
  // Half of log(1 + 2 a / (1 - a)).
  const S ax = fabs(x);
  const S a = select(ax < 1.0, ax, S(0.5));
  const Two<S> q = divide(Two<S>{2.0 * a, S(0.0)}, two_sum(S(1.0), -a));
  const S y = select(ax < 0x1p-28, ax, 0.5 * log1p_of(q));
  return copysign(select(ax < 1.0, y, select(ax == 1.0, S(kInf), S(kNan))), x);
}

// ---- the rest
// --------------------------------------------------------------------------------------------
template <Real S>
LOXO_INLINE S hypot(const S& x, const S& y) {
  const S ax = fabs(x), ay = fabs(y), m = max(ax, ay);
  const auto large = m > 0x1p500, small = m < 0x1p-400;
  const S k = select(large, S(0x1p-600), select(small, S(0x1p700), S(1.0)));
  const S back = select(large, S(0x1p600), select(small, S(0x1p-700), S(1.0)));
  const Two<S> p = two_product(ax * k, ax * k), q = two_product(ay * k, ay * k);
  const Two<S> s = two_sum(p.hi, q.hi);
  const Two<S> r = root(Two<S>{s.hi, s.lo + (p.lo + q.lo)});
  const auto endless = (ax == kInf) | (ay == kInf);
  return select(endless, S(kInf), (r.hi + r.lo) * back);
}
template <Real S>
LOXO_INLINE S round(const S& x) {
  const S a = fabs(x), f = floor(a);
  return copysign(f + select(a - f >= 0.5, S(1.0), S(0.0)), x);
}
// x - 2 pi n, n from `offset` before rounding down; 2 pi in four parts as above.
template <Real S>
LOXO_INLINE S less_turns(const S& x, const S& n) {
  const S m = 4.0 * n;
  const S w = (x - m * 0x1.921fb54p+0) - m * 0x1.10b46p-30;
  return (w - m * 0x1.1a62630000000p-54) - m * 0x1.8a2e03707344ap-81;
}
template <Real S>
LOXO_INLINE S wrap_pi(const S& x) {
  const S n = -floor(0.5 - x * 0x1.45f306dc9c883p-3);
  const S r = less_turns(x, n);
  // The quotient's rounding can leave the result a hair outside.
  const S up = select(r <= -kPiHi, r + 2.0 * kPiHi, r);
  const S in = select(up > kPiHi, S(kPiHi), up);  // -pi itself comes out as pi, not as -pi again
  return select(fabs(x) <= kTrigDomain, in, S(kNan));
}
template <Real S>
LOXO_INLINE S wrap_2pi(const S& x) {
  const S r = less_turns(x, floor(x * 0x1.45f306dc9c883p-3));
  const S up = select(r < 0.0, r + 2.0 * kPiHi, r);
  const S in = select(up >= 2.0 * kPiHi, up - 2.0 * kPiHi, up);
  return select(fabs(x) <= kTrigDomain, in, S(kNan));
}

}  // namespace kernels
}  // namespace loxo
