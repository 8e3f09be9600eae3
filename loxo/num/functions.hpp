// SPDX-License-Identifier: Apache-2.0
// Elementary functions with the same operations, hence the same bits, for double and for lanes. Nothing of
// libm but sqrt, fabs, floor, copysign: glibc chooses its sin and exp by processor at run time.
#pragma once
#include <cmath>

#include "loxo/num/real.hpp"

namespace loxo {
// Placeholder until the real kernels land: the signatures are final.
inline double sqrt(double x) { return std::sqrt(x); }
inline double fabs(double x) { return std::fabs(x); }
inline double floor(double x) { return std::floor(x); }
inline double round(double x) { return std::floor(x + 0.5); }
inline double copysign(double a, double b) { return std::copysign(a, b); }
inline double min(double a, double b) { return a < b ? a : b; }
inline double max(double a, double b) { return a > b ? a : b; }
inline double sin(double x) { return std::sin(x); }
inline double cos(double x) { return std::cos(x); }
inline void sincos(double x, double& s, double& c) { s = std::sin(x); c = std::cos(x); }
inline double tan(double x) { return std::tan(x); }
inline double asin(double x) { return std::asin(x); }
inline double acos(double x) { return std::acos(x); }
inline double atan(double x) { return std::atan(x); }
inline double atan2(double y, double x) { return std::atan2(y, x); }
inline double exp(double x) { return std::exp(x); }
inline double log(double x) { return std::log(x); }
inline double log1p(double x) { return std::log1p(x); }
inline double expm1(double x) { return std::expm1(x); }
inline double sinh(double x) { return std::sinh(x); }
inline double cosh(double x) { return std::cosh(x); }
inline double tanh(double x) { return std::tanh(x); }
inline double asinh(double x) { return std::asinh(x); }
inline double atanh(double x) { return std::atanh(x); }
inline double hypot(double x, double y) { return std::sqrt(x * x + y * y); }
}  // namespace loxo
