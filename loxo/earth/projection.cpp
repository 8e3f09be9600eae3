// SPDX-License-Identifier: Apache-2.0
#include "loxo/earth/projection.hpp"

#include "loxo/earth/angle.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/inner.hpp"

namespace loxo {
namespace {

// Conformal latitude's sine and cosine: the series turns the geodetic latitude by a small angle.
template <Real S>
void conformal(const Ellipsoid& ell, S lat, S& s, S& c) {
  S s0, c0;
  kernels::sincos(lat, s0, c0);
  c0 = select(fabs(lat) >= S(kHalfPi), S(0.0), c0);
  turn_by_small(s0, c0, sine_sum(ell.chi_of_phi, s0, c0), s, c);
}

// Geodetic latitude from the sine and cosine of the conformal one.
template <Real S>
S geodetic_of_conformal(const Ellipsoid& ell, S s, S c) {
  return quick_atan2(s, c) + sine_sum(ell.phi_of_chi, s, c);
}

}  // namespace

template <Real S>
GaussXY<S> gauss_forward(const Ellipsoid& ell, S lat, S lon, double lon0, double false_easting) {
  S s, c, sl, cl;
  conformal(ell, lat, s, c);
  kernels::sincos(lon - S(lon0), sl, cl);
  // Conformal sphere: xi' = atan2(s, b), eta' = atanh(t).
  const S b = c * cl, t = c * sl;
  const S r2 = S(1.0) / (s * s + b * b);  // cosh^2 eta'
  const Complex<S> w = sine_sum(ell.mu_of_chi, S(2.0) * s * b * r2, (b - s) * (b + s) * r2,
                                S(2.0) * t * r2, (S(1.0) + t * t) * r2);
  return {S(ell.rectifying_radius) * (quick_atan2(s, b) + w.re),
          S(ell.rectifying_radius) * (quick_atanh(t) + w.im) + S(false_easting)};
}

template <Real S>
LatLon<S> gauss_inverse(const Ellipsoid& ell, S x, S y, double lon0, double false_easting) {
  const S xi = x * S(1.0 / ell.rectifying_radius);
  const S eta = (y - S(false_easting)) * S(1.0 / ell.rectifying_radius);
  S s, c;
  kernels::sincos(xi, s, c);
  // Absolute rounding is enough for the hyperbolic functions: eta carries the rest.
  const S up = kernels::exp(S(2.0) * eta), down = S(1.0) / up;
  const Complex<S> w = sine_sum(ell.chi_of_mu, S(2.0) * s * c, (c - s) * (c + s),
                                S(0.5) * (up - down), S(0.5) * (up + down));
  S sx, cx;
  turn_by_small(s, c, w.re, sx, cx);
  const S grow = kernels::exp(eta + w.im);
  const S sh = S(0.5) * (grow - S(1.0) / grow);
  // sin chi = sin xi' / cosh eta', tan lon = sinh eta' / cos xi'.
  const S k = S(1.0) / sqrt(S(1.0) + sh * sh);
  return {geodetic_of_conformal(ell, sx * k, sqrt(sh * sh + cx * cx) * k),
          kernels::wrap_pi(S(lon0) + quick_atan2(sh, cx))};
}

namespace {

// (V-22..24). X (V-22) is the meridian arc: its three constants C1 to C3 are the arc to 5e-5 m, so
// it stands here itself.
template <Real S>
GaussXY<S> paper_series(const Ellipsoid& ell, S lat, S dlon) {
  S s, c;
  sincos(lat, s, c);
  const S cc = max(c, S(1e-300)), t = s / cc, t2 = t * t;
  const S eta2 = S(ell.ep2) * c * c, N = S(ell.a * ell.a / ell.b) / sqrt(S(1.0) + eta2);
  const S m = dlon * c, m2 = m * m;
  const S X = S(ell.rectifying_radius) * (lat + sine_sum(ell.mu_of_phi, s, c));  // (V-22)
  const S x =
      X + N * t * m2 *
              (S(0.5) + m2 * (S(1.0 / 24) * (S(5.0) - t2 + S(9.0) * eta2 + S(4.0) * eta2 * eta2) +
                              m2 * S(1.0 / 720) * (S(61.0) - S(58.0) * t2 + t2 * t2)));  // (V-23)
  const S y = N * m *
              (S(1.0) + m2 * (S(1.0 / 6) * (S(1.0) - t2 + eta2) +
                              m2 * S(1.0 / 120) *
                                  (S(5.0) - S(18.0) * t2 + t2 * t2 + S(14.0) * eta2 -
                                   S(58.0) * eta2 * t2)));  // (V-24)
  return {x, y};
}

}  // namespace

template <Real S>
GaussXY<S> gauss_forward_paper(const Ellipsoid& ell, S lat, S lon, double lon0,
                               double false_easting) {
  GaussXY<S> r = paper_series(ell, lat, wrap_pi(lon - S(lon0)));
  r.y = r.y + S(false_easting);
  return r;
}

template <Real S>
LatLon<S> gauss_inverse_paper(const Ellipsoid& ell, S x, S y, double lon0, double false_easting) {
  // From the exact inverse, 0.1 m off, the conformal map's own derivative is good enough: each step
  // gains five digits (rotation by the convergence sin L dlon neglected at second order only).
  const LatLon<S> start = gauss_inverse(ell, x, y, 0.0, false_easting);
  S lat = start.lat, dlon = start.lon;
  for (int i = 0; i < 4; ++i) {
    const GaussXY<S> at = paper_series(ell, lat, dlon);
    S s, c, sg, cg;
    sincos(lat, s, c);
    sincos(s * dlon, sg, cg);
    const S dx = x - at.x, dy = (y - S(false_easting)) - at.y;
    const S north = dx * cg - dy * sg, east = dx * sg + dy * cg;
    lat = lat + north / meridian_radius(ell, s);
    dlon = dlon + east / (prime_vertical_radius(ell, s) * max(c, S(1e-12)));
  }
  return {lat, wrap_pi(S(lon0) + dlon)};
}

namespace {
// rho = scale * tan(colatitude of chi / 2): 2 a / sqrt((1+e)^(1+e) (1-e)^(1-e)).
double stereographic_scale(const Ellipsoid& ell) {
  return 2.0 * ell.a * exp(-0.5 * ((1.0 + ell.e) * log1p(ell.e) + (1.0 - ell.e) * log1p(-ell.e)));
}
}  // namespace

template <Real S>
PlaneXY<S> polar_stereographic_forward(const Ellipsoid& ell, S lat, S lon, double lon0,
                                       bool north) {
  const S sign(north ? 1.0 : -1.0);
  S s, c, sl, cl;
  conformal(ell, sign * lat, s, c);
  sincos(lon - S(lon0), sl, cl);
  // tan(colatitude/2) = c/(1 + s); nearer the other pole (1 - s)/c.
  const auto far = s < S(0.0);
  const S rho = S(stereographic_scale(ell)) * select(far, (S(1.0) - s) / c, c / (S(1.0) + s));
  return {rho * sl, -sign * rho * cl};
}

template <Real S>
LatLon<S> polar_stereographic_inverse(const Ellipsoid& ell, S x, S y, double lon0, bool north) {
  const S sign(north ? 1.0 : -1.0);
  const S t = sqrt(x * x + y * y) * S(1.0 / stereographic_scale(ell));
  const S k = S(1.0) / (S(1.0) + t * t);
  const S s = (S(1.0) - t) * (S(1.0) + t) * k, c = S(2.0) * t * k;
  return {sign * geodetic_of_conformal(ell, s, c), wrap_pi(S(lon0) + atan2(x, -sign * y))};
}

#define LOXO_INSTANTIATE(S)                                                                 \
  template GaussXY<S> gauss_forward<S>(const Ellipsoid&, S, S, double, double);             \
  template LatLon<S> gauss_inverse<S>(const Ellipsoid&, S, S, double, double);              \
  template GaussXY<S> gauss_forward_paper<S>(const Ellipsoid&, S, S, double, double);       \
  template LatLon<S> gauss_inverse_paper<S>(const Ellipsoid&, S, S, double, double);        \
  template PlaneXY<S> polar_stereographic_forward<S>(const Ellipsoid&, S, S, double, bool); \
  template LatLon<S> polar_stereographic_inverse<S>(const Ellipsoid&, S, S, double, bool);
LOXO_INSTANTIATE(double)
LOXO_INSTANTIATE(Lanes)
#undef LOXO_INSTANTIATE

}  // namespace loxo
