// SPDX-License-Identifier: Apache-2.0
#include "loxo/earth/rhumb.hpp"

#include "loxo/earth/angle.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/inner.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"

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
  return select(small, S(1.0), quick_asinh(z) / z);
}
template <Real S>
S atanh_ratio(S y) {
  const auto small = fabs(y) < S(1e-8);
  const S z = select(small, S(0.5), y);
  return select(small, S(1.0), quick_atanh(z) / z);
}

// A latitude with its sine and cosine, which may know more of it than its radians do.
template <Real S>
struct Parallel {
  S lat, s, c;
};
template <Real S>
Parallel<S> parallel(S lat) {
  Parallel<S> p;
  p.lat = lat;
  kernels::sincos(lat, p.s, p.c);
  return p;
}

// (q2 - q1)/x and (m2 - m1)/(R x) with x = 2 sin((phi2 - phi1)/2): both regular at phi1 = phi2.
template <Real S>
struct Ratios {
  S x, q, mu;
};
template <Real S>
Ratios<S> divided(const Ellipsoid& ell, const Parallel<S>& p1, const Parallel<S>& p2, S delta) {
  S sh, ch;
  kernels::sincos(S(0.5) * delta, sh, ch);
  // The mean latitude; no cancellation: the nearer a point is to the pole, the smaller its cosine's
  // share.
  const S cm = p1.c * ch - p1.s * sh, sm = p1.s * ch + p1.c * sh;
  Ratios<S> r;
  r.x = S(2.0) * sh;
  // gd^-1(phi2) - gd^-1(phi1) = asinh((sin phi2 - sin phi1)/(cos phi1 cos phi2)), sin phi2 - sin
  // phi1 = x cm.
  const S k = cm / (p1.c * p2.c);
  // atanh(e s2) - atanh(e s1) = atanh(e (s2 - s1)/(1 - e^2 s1 s2)).
  const S w = cm / (S(1.0) - S(ell.e2) * p1.s * p2.s);
  r.q = k * asinh_ratio(r.x * k) - S(ell.e2) * w * atanh_ratio(S(ell.e) * r.x * w);
  // mu2 - mu1 = delta + 2 sum c_j cos(2 j phi_m) sin(j delta), sin(delta) = x ch.
  const S chord =
      select(fabs(delta) < S(1e-8), S(1.0), delta / select(fabs(r.x) > S(0.0), r.x, S(1.0)));
  r.mu =
      chord + S(2.0) * ch * mean_sum(ell.mu_of_phi, (cm - sm) * (cm + sm), (ch - sh) * (ch + sh));
  return r;
}

// At the poles themselves the line lies in the meridian: D is infinite.
template <Real S>
auto at_pole(S lat) {
  return fabs(lat) >= S(kHalfPi);
}

template <Real S>
RhumbInverse<S> inverse(const Ellipsoid& ell, const Parallel<S>& p1, const Parallel<S>& p2, S delta,
                        S dlon) {
  const Ratios<S> d = divided(ell, p1, p2, delta);
  const auto inside = (fabs(p1.lat) <= S(kHalfPi)) & (fabs(p2.lat) <= S(kHalfPi));
  const auto pole = at_pole(p1.lat) | at_pole(p2.lat);
  const S length = S(ell.rectifying_radius) * d.mu;
  RhumbInverse<S> r;
  r.north = select(inside, length * d.x, S(kNaN));  // (V-17)
  r.east = select(pole, S(0.0), dlon * (length / d.q));
  r.distance = sqrt(r.north * r.north + r.east * r.east);
  r.azimuth = quick_atan2(r.east, r.north);
  return r;
}

// Onto a pole or from it only along its meridian: 1e-7 m across is the rounding of sin(pi).
constexpr double kOnMeridian = 1e-7;

// phi2 - phi1 and the longitude difference; NaN beyond a pole.
template <Real S>
struct Step {
  S delta, dlon;
};
template <Real S>
Step<S> direct(const Ellipsoid& ell, const Parallel<S>& p1, S north, S east) {
  const S step = north * S(1.0 / ell.rectifying_radius);  // mu2 - mu1
  const S mu1 = p1.lat + sine_sum(ell.mu_of_phi, p1.s, p1.c);
  S sh, ch, sm, cm;
  kernels::sincos(S(0.5) * step, sh, ch);
  kernels::sincos(mu1 + S(0.5) * step, sm, cm);
  // phi2 - phi1 relative to its size, so that an east-west line keeps its D.
  S delta = step + S(4.0) * sh * ch *
                       mean_sum(ell.phi_of_mu, (cm - sm) * (cm + sm), (ch - sh) * (ch + sh));
  // Beyond a pole by more than rounding: no such line. Within rounding of it: the pole.
  const S slack(4.0e-16);
  const auto inside = (fabs(mu1 + step) <= S(kHalfPi) + slack) & (fabs(p1.lat) <= S(kHalfPi));
  const S lat2 = p1.lat + delta;
  const auto over = fabs(lat2) > S(kHalfPi);
  const S capped = copysign(S(kHalfPi), lat2);
  delta = select(over, capped - p1.lat, delta);
  const Parallel<S> p2 = parallel(select(over, capped, lat2));
  const Ratios<S> d = divided(ell, p1, p2, delta);
  const auto pole = at_pole(p1.lat) | at_pole(p2.lat);
  Step<S> r;
  r.dlon = select(pole, select(fabs(east) <= S(kOnMeridian), S(0.0), S(kNaN)),
                  east * (d.q / d.mu) * S(1.0 / ell.rectifying_radius));  // (V-8)
  r.dlon = select(inside, r.dlon, S(kNaN));
  r.delta = select(inside, delta, S(kNaN));
  return r;
}

// Sine and cosine of degrees, |x| <= 720: the quadrant is taken off before the radians. Exact at 0,
// 90, 180 …
void sincos_degrees(double x, double& s, double& c) {
  const double quadrant = round(x / 90.0);
  double s0, c0;
  kernels::sincos((x - 90.0 * quadrant) * deg, s0, c0);
  switch (static_cast<int>(quadrant) & 3) {
    case 0:
      s = s0;
      c = c0;
      break;
    case 1:
      s = c0;
      c = -s0;
      break;
    case 2:
      s = -s0;
      c = -c0;
      break;
    default:
      s = -c0;
      c = s0;
      break;
  }
}

Parallel<double> parallel_degrees(double lat) {
  Parallel<double> p{};
  p.lat = fabs(lat) == 90.0 ? copysign(kHalfPi, lat) : lat * deg;
  sincos_degrees(lat, p.s, p.c);
  // The pole's own cosine stays above 0: the kernel divides by it before it selects.
  if (p.c < 6e-17) p.c = 6e-17;
  return p;
}

// Into (-180, 180]; the subtractions are exact for |x| <= 720.
double wrap_degrees(double x) {
  while (x > 180.0) x -= 360.0;
  while (x <= -180.0) x += 360.0;
  return x;
}

}  // namespace

template <Real S>
S isometric_latitude(const Ellipsoid& ell, S lat) {
  S s, c;
  kernels::sincos(lat, s, c);
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
  kernels::sincos(chi, s, c);
  return chi + sine_sum(ell.phi_of_chi, s, c);
}

template <Real S>
S meridian_arc(const Ellipsoid& ell, S lat) {
  S s, c;
  kernels::sincos(lat, s, c);
  return S(ell.rectifying_radius) * (lat + sine_sum(ell.mu_of_phi, s, c));  // (V-4)
}

template <Real S>
S latitude_of_arc(const Ellipsoid& ell, S m) {
  const S mu = m * S(1.0 / ell.rectifying_radius);
  S s, c;
  kernels::sincos(mu, s, c);
  return mu + sine_sum(ell.phi_of_mu, s, c);
}

template <Real S>
S isometric_rate(const Ellipsoid& ell, S lat) {
  S s, c;
  kernels::sincos(lat, s, c);
  return S(1.0) / (prime_vertical_radius(ell, s) * c);
}

template <Real S>
S isometric_divided_difference(const Ellipsoid& ell, S lat1, S lat2) {
  const Ratios<S> d = divided(ell, parallel(lat1), parallel(lat2), lat2 - lat1);  // (V-8)
  return select(at_pole(lat1) | at_pole(lat2), S(std::numeric_limits<double>::infinity()),
                d.q / (S(ell.rectifying_radius) * d.mu));
}

template <Real S>
RhumbInverse<S> rhumb_inverse(const Ellipsoid& ell, S lat1, S lon1, S lat2, S lon2) {
  RhumbInverse<S> r =
      inverse(ell, parallel(lat1), parallel(lat2), lat2 - lat1, kernels::wrap_pi(lon2 - lon1));
  const S turned = r.azimuth + S(kTwoPi);
  r.azimuth = select(r.azimuth < S(0.0), select(turned < S(kTwoPi), turned, S(0.0)), r.azimuth);
  return r;
}

template <Real S>
LatLon<S> rhumb_direct(const Ellipsoid& ell, S lat1, S lon1, S azimuth, S distance) {
  S sa, ca;
  kernels::sincos(azimuth, sa, ca);
  const Step<S> d = direct(ell, parallel(lat1), distance * ca, distance * sa);
  return {lat1 + d.delta, kernels::wrap_pi(lon1 + d.dlon)};
}

RhumbInverse<double> rhumb_inverse_degrees(const Ellipsoid& ell, double lat1, double lon1,
                                           double lat2, double lon2) {
  const Parallel<double> p1 = parallel_degrees(lat1), p2 = parallel_degrees(lat2);
  RhumbInverse<double> r =
      inverse(ell, p1, p2, (lat2 - lat1) * deg, wrap_degrees(lon2 - lon1) * deg);
  r.azimuth = r.azimuth / deg;
  if (r.azimuth < 0.0) r.azimuth += 360.0;
  if (r.azimuth >= 360.0) r.azimuth = 0.0;
  return r;
}

LatLon<double> rhumb_direct_degrees(const Ellipsoid& ell, double lat1, double lon1, double azimuth,
                                    double distance) {
  double sa, ca;
  sincos_degrees(azimuth, sa, ca);
  const Step<double> d = direct(ell, parallel_degrees(lat1), distance * ca, distance * sa);
  LatLon<double> r{lat1 + d.delta / deg, d.dlon / deg};
  r.lat = min(max(r.lat, -90.0), 90.0);
  if (!(d.delta == d.delta)) r.lat = kNaN;
  // Whole turns of a spiral are taken off before the starting longitude is added.
  r.lon = wrap_degrees(wrap_degrees(lon1) + (r.lon - 360.0 * round(r.lon / 360.0)));
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
LOXO_INSTANTIATE(Lanes)
#undef LOXO_INSTANTIATE

}  // namespace loxo
