// SPDX-License-Identifier: Apache-2.0
#include "loxo/earth/rhumb.hpp"

#include "loxo/earth/angle.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/latitude_sums.hpp"

namespace loxo {
namespace {

const double kNaN = std::numeric_limits<double>::quiet_NaN();

// e^2 atanh(e w)/(e w) . w: the ellipsoid's part of the isometric latitude, as a function of w =
// sin(latitude).
template <Real S>
S eccentric_part(const Ellipsoid& ell, S w) {
  return S(ell.e) * atanh(S(ell.e) * w);
}

// y from x is divided by the chord: asinh(y)/y, regular at 0.
template <Real S>
S asinh_ratio(S y) {
  const auto small = fabs(y) < S(1e-8);
  const S z = select(small, S(1.0), y);
  return select(small, S(1.0), asinh(z) / z);
}
template <Real S>
S atanh_ratio(S y) {
  const auto small = fabs(y) < S(1e-8);
  const S z = select(small, S(0.5), y);
  return select(small, S(1.0), atanh(z) / z);
}

// (q2 - q1)/x and (m2 - m1)/(R x) with x = 2 sin((phi2 - phi1)/2): both regular at phi1 = phi2.
template <Real S>
struct Ratios {
  S q, mu;
};
template <Real S>
Ratios<S> divided(const Ellipsoid& ell, S lat1, S lat2) {
  S s1, c1, s2, c2, sh, ch;
  const S delta = lat2 - lat1, half = S(0.5) * delta;
  sincos(lat1, s1, c1);
  sincos(lat2, s2, c2);
  sincos(half, sh, ch);
  // The mean latitude; no cancellation: the nearer a point is to the pole, the smaller its cosine's
  // share.
  const S cm = c1 * ch - s1 * sh, sm = s1 * ch + c1 * sh;
  const S x = S(2.0) * sh;
  // gd^-1(phi2) - gd^-1(phi1) = asinh((sin phi2 - sin phi1)/(cos phi1 cos phi2)), sin phi2 - sin
  // phi1 = x cm.
  const S k = cm / (c1 * c2);
  // atanh(e s2) - atanh(e s1) = atanh(e (s2 - s1)/(1 - e^2 s1 s2)).
  const S w = cm / (S(1.0) - S(ell.e2) * s1 * s2);
  Ratios<S> r;
  r.q = k * asinh_ratio(x * k) - S(ell.e2) * w * atanh_ratio(S(ell.e) * x * w);
  // mu2 - mu1 = delta + 2 sum c_j cos(2 j phi_m) sin(j delta), sin(delta) = x ch.
  const S chord =
      select(fabs(delta) < S(1e-8), S(1.0), delta / select(fabs(x) > S(0.0), x, S(1.0)));
  r.mu =
      chord + S(2.0) * ch * mean_sum(ell.mu_of_phi, (cm - sm) * (cm + sm), (ch - sh) * (ch + sh));
  return r;
}

// 1/D = (m2 - m1)/(q2 - q1) [m]: the mean radius of the circle of latitude; 0 where a pole is an
// end point.
template <Real S>
S inverse_d(const Ellipsoid& ell, S lat1, S lat2) {
  const Ratios<S> r = divided(ell, lat1, lat2);
  const auto pole = (fabs(lat1) >= S(kHalfPi)) | (fabs(lat2) >= S(kHalfPi));
  return select(pole, S(0.0), S(ell.rectifying_radius) * r.mu / r.q);
}

}  // namespace

template <Real S>
S isometric_latitude(const Ellipsoid& ell, S lat) {
  S s, c;
  sincos(lat, s, c);
  const auto pole = fabs(lat) >= S(kHalfPi);
  const S q = asinh(s / select(pole, S(1.0), c)) - eccentric_part(ell, s);  // (V-3)
  return select(fabs(lat) > S(kHalfPi), S(kNaN),
                select(pole, copysign(S(std::numeric_limits<double>::infinity()), lat), q));
}

template <Real S>
S latitude_of_isometric(const Ellipsoid& ell, S q) {
  // Conformal latitude chi = gd(q) = 2 atan(tanh(q/2)), then its series.
  const S chi = S(2.0) * atan(tanh(S(0.5) * q));
  S s, c;
  sincos(chi, s, c);
  return chi + sine_sum(ell.phi_of_chi, s, c);
}

template <Real S>
S meridian_arc(const Ellipsoid& ell, S lat) {
  S s, c;
  sincos(lat, s, c);
  return S(ell.rectifying_radius) * (lat + sine_sum(ell.mu_of_phi, s, c));  // (V-4)
}

template <Real S>
S latitude_of_arc(const Ellipsoid& ell, S m) {
  const S mu = m * S(1.0 / ell.rectifying_radius);
  S s, c;
  sincos(mu, s, c);
  return mu + sine_sum(ell.phi_of_mu, s, c);
}

template <Real S>
S isometric_rate(const Ellipsoid& ell, S lat) {
  S s, c;
  sincos(lat, s, c);
  return S(1.0) / (prime_vertical_radius(ell, s) * c);
}

template <Real S>
S isometric_divided_difference(const Ellipsoid& ell, S lat1, S lat2) {
  return S(1.0) / inverse_d(ell, lat1, lat2);  // (V-8)
}

template <Real S>
RhumbInverse<S> rhumb_inverse(const Ellipsoid& ell, S lat1, S lon1, S lat2, S lon2) {
  const Ratios<S> d = divided(ell, lat1, lat2);
  const S a1 = fabs(lat1), a2 = fabs(lat2);
  const auto pole = (a1 >= S(kHalfPi)) | (a2 >= S(kHalfPi));
  const auto outside = !((a1 <= S(kHalfPi)) & (a2 <= S(kHalfPi)));
  RhumbInverse<S> r;
  const S x = S(2.0) * sin(S(0.5) * (lat2 - lat1));
  r.north = select(outside, S(kNaN), S(ell.rectifying_radius) * x * d.mu);  // (V-17)
  r.east = select(pole, S(0.0), wrap_pi(lon2 - lon1) * (S(ell.rectifying_radius) * d.mu / d.q));
  r.distance = sqrt(r.north * r.north + r.east * r.east);
  r.azimuth = wrap_2pi(atan2(r.east, r.north));
  return r;
}

template <Real S>
LatLon<S> rhumb_direct(const Ellipsoid& ell, S lat1, S lon1, S azimuth, S distance) {
  S sa, ca, s1, c1, sh, ch;
  sincos(azimuth, sa, ca);
  sincos(lat1, s1, c1);
  const S step = distance * ca * S(1.0 / ell.rectifying_radius);  // mu2 - mu1
  const S mu1 = lat1 + sine_sum(ell.mu_of_phi, s1, c1);
  const S mu2 = mu1 + step;
  sincos(S(0.5) * step, sh, ch);
  S sm, cm;
  sincos(mu1 + S(0.5) * step, sm, cm);
  // phi2 - phi1 relative to its size, so that an east-west line keeps its D.
  const S delta = step + S(4.0) * sh * ch *
                             mean_sum(ell.phi_of_mu, (cm - sm) * (cm + sm), (ch - sh) * (ch + sh));
  const S lat = lat1 + delta;
  // Beyond a pole by more than rounding: no such line. Within rounding of it: the pole.
  const S reach = fabs(mu2), slack(4.0e-16);
  const auto outside = !(reach <= S(kHalfPi) + slack) | !(fabs(lat1) <= S(kHalfPi));
  const S lat2 = min(max(lat, S(-kHalfPi)), S(kHalfPi));
  const auto pole = (fabs(lat2) >= S(kHalfPi)) | (fabs(lat1) >= S(kHalfPi));
  const Ratios<S> d = divided(ell, lat1, lat2);
  const S east = distance * sa;
  const S dlon = east * (d.q / d.mu) * S(1.0 / ell.rectifying_radius);  // (V-8)
  // Onto or from a pole only along its meridian: 1e-7 m across is rounding of sin(pi).
  const auto meridian = fabs(east) <= S(1e-7);
  LatLon<S> r;
  r.lat = select(outside, S(kNaN), lat2);
  r.lon = select(outside, S(kNaN),
                 wrap_pi(lon1 + select(pole, select(meridian, S(0.0), S(kNaN)), dlon)));
  return r;
}

#define LOXO_INSTANTIATE(S)                                                \
  template S isometric_latitude<S>(const Ellipsoid&, S);                   \
  template S latitude_of_isometric<S>(const Ellipsoid&, S);                \
  template S meridian_arc<S>(const Ellipsoid&, S);                         \
  template S latitude_of_arc<S>(const Ellipsoid&, S);                      \
  template S isometric_rate<S>(const Ellipsoid&, S);                       \
  template S isometric_divided_difference<S>(const Ellipsoid&, S, S);      \
  template RhumbInverse<S> rhumb_inverse<S>(const Ellipsoid&, S, S, S, S); \
  template LatLon<S> rhumb_direct<S>(const Ellipsoid&, S, S, S, S);
LOXO_INSTANTIATE(double)
#undef LOXO_INSTANTIATE

}  // namespace loxo
