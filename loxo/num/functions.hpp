// SPDX-License-Identifier: Apache-2.0
// Elementary functions with the same operations, hence the same bits, for double and for lanes, on
// every processor. Nothing of libm but sqrt, fabs, floor, copysign: glibc chooses its sin and exp
// by processor at run time. Largest errors measured against 64-bit-mantissa results are in
// functions_test.cpp; the largest is 0.86 ulp (tan: 1.00). Arguments outside the domain give NaN,
// NaN gives NaN, zeros keep their signs, poles give infinities, as in C99 Annex F, but where noted.
// Integers convert to double.
#pragma once
#include <cmath>

#include "loxo/num/real.hpp"

namespace loxo {

inline double sqrt(double x) { return std::sqrt(x); }
inline double fabs(double x) { return std::fabs(x); }
inline double floor(double x) { return std::floor(x); }
inline double copysign(double size, double sign) { return std::copysign(size, sign); }
// The second where either is NaN.
inline double min(double a, double b) { return a < b ? a : b; }
inline double max(double a, double b) { return a > b ? a : b; }
Lanes sqrt(const Lanes& x);
Lanes fabs(const Lanes& x);
Lanes floor(const Lanes& x);
Lanes copysign(const Lanes& size, const Lanes& sign);
Lanes min(const Lanes& a, const Lanes& b);
Lanes max(const Lanes& a, const Lanes& b);

// Angles in radians. Beyond kTrigDomain sin, cos and tan are NaN: wrap a phase before it gets
// there.
inline constexpr double kTrigDomain = 1e8;

#define LOXO_FUNCTION(name) \
  double name(double x);    \
  Lanes name(const Lanes& x);
LOXO_FUNCTION(sin)
LOXO_FUNCTION(cos)
LOXO_FUNCTION(tan)
LOXO_FUNCTION(asin)
LOXO_FUNCTION(acos)
LOXO_FUNCTION(atan)
LOXO_FUNCTION(exp)
LOXO_FUNCTION(expm1)
LOXO_FUNCTION(log)
LOXO_FUNCTION(log1p)
LOXO_FUNCTION(sinh)
LOXO_FUNCTION(cosh)
LOXO_FUNCTION(tanh)
LOXO_FUNCTION(asinh)
LOXO_FUNCTION(atanh)
LOXO_FUNCTION(round)     // halves away from zero
LOXO_FUNCTION(wrap_pi)   // the same angle in (-pi, pi], |x| < kTrigDomain
LOXO_FUNCTION(wrap_2pi)  // the same angle in [0, 2 pi)
#undef LOXO_FUNCTION

void sincos(double x, double& s, double& c);
void sincos(const Lanes& x, Lanes& s, Lanes& c);
// Angle of (x, y) in [-pi, pi], signed zeros as in C: atan2(0, -0.0) = pi.
double atan2(double y, double x);
Lanes atan2(const Lanes& y, const Lanes& x);
// No overflow or underflow in between.
double hypot(double x, double y);
Lanes hypot(const Lanes& x, const Lanes& y);

}  // namespace loxo
