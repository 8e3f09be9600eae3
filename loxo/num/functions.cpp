// SPDX-License-Identifier: Apache-2.0
#include "loxo/num/functions.hpp"

#include "loxo/num/function_kernels.hpp"

namespace loxo {

#define LOXO_FUNCTION(name)                                  \
  double name(double x) { return kernels::name<double>(x); } \
  Lanes name(const Lanes& x) { return kernels::name<Lanes>(x); }
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
LOXO_FUNCTION(round)
LOXO_FUNCTION(wrap_pi)
LOXO_FUNCTION(wrap_2pi)
#undef LOXO_FUNCTION

void sincos(double x, double& s, double& c) { kernels::sincos<double>(x, s, c); }
void sincos(const Lanes& x, Lanes& s, Lanes& c) { kernels::sincos<Lanes>(x, s, c); }
// The unused half is dropped by the compiler.
double sin(double x) {
  double s, c;
  kernels::sincos<double>(x, s, c);
  return s;
}
double cos(double x) {
  double s, c;
  kernels::sincos<double>(x, s, c);
  return c;
}
Lanes sin(const Lanes& x) {
  Lanes s, c;
  kernels::sincos<Lanes>(x, s, c);
  return s;
}
Lanes cos(const Lanes& x) {
  Lanes s, c;
  kernels::sincos<Lanes>(x, s, c);
  return c;
}
double atan2(double y, double x) { return kernels::atan2<double>(y, x); }
Lanes atan2(const Lanes& y, const Lanes& x) { return kernels::atan2<Lanes>(y, x); }
double hypot(double x, double y) { return kernels::hypot<double>(x, y); }
Lanes hypot(const Lanes& x, const Lanes& y) { return kernels::hypot<Lanes>(x, y); }

}  // namespace loxo
