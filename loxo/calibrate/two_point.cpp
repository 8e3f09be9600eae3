// SPDX-License-Identifier: Apache-2.0
#include "loxo/calibrate/two_point.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <utility>

#include "loxo/earth/geodesic.hpp"
#include "loxo/earth/projection.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/num/units.hpp"

namespace loxo {

std::string_view chord_method_name(ChordMethod method) {
  switch (method) {
    case ChordMethod::kStartLatitude:
      return "start_latitude";
    case ChordMethod::kMeanLatitude:
      return "mean_latitude";
    case ChordMethod::kRhumb:
      return "rhumb";
    case ChordMethod::kGeodesic:
      return "geodesic";
    case ChordMethod::kGauss:
      return "gauss";
    case ChordMethod::kGaussPaper:
      return "gauss_paper";
  }
  return "?";
}

std::span<const ChordMethod> chord_methods() {
  static constexpr std::array<ChordMethod, 5> all{ChordMethod::kStartLatitude,
                                                  ChordMethod::kMeanLatitude, ChordMethod::kRhumb,
                                                  ChordMethod::kGeodesic, ChordMethod::kGauss};
  return all;
}

namespace {

template <Real S>
Chord<S> chord_at_latitude(const Ellipsoid& ell, S lat0, S dlat, S dlon) {
  S s, c;
  sincos(lat0, s, c);
  return {meridian_radius(ell, s) * dlat, prime_vertical_radius(ell, s) * c * dlon};
}

Chord<double> chord_geodesic(const Ellipsoid& ell, double lat1, double lat2, double dlon) {
  const auto g = geodesic_inverse(ell, lat1, 0.0, lat2, dlon);
  return {g.distance * std::cos(g.azimuth1), g.distance * std::sin(g.azimuth1)};
}

}  // namespace

template <Real S>
Chord<S> chord(const Ellipsoid& ell, ChordMethod method, S lat1, S lat2, S dlon, S from_meridian) {
  switch (method) {
    case ChordMethod::kStartLatitude:  // (V-14)
      return chord_at_latitude(ell, lat1, lat2 - lat1, dlon);
    case ChordMethod::kMeanLatitude:  // (V-15)
      return chord_at_latitude(ell, S(0.5) * (lat1 + lat2), lat2 - lat1, dlon);
    case ChordMethod::kRhumb:  // (V-17)
      return {meridian_arc(ell, lat2) - meridian_arc(ell, lat1),
              dlon / isometric_divided_difference(ell, lat1, lat2)};
    case ChordMethod::kGeodesic:  // (V-18)
      if constexpr (std::same_as<S, double>) return chord_geodesic(ell, lat1, lat2, dlon);
      break;
    case ChordMethod::kGauss: {  // (V-16), (V-19)
      const auto a = gauss_forward(ell, lat1, from_meridian, 0.0);
      const auto p = gauss_forward(ell, lat2, from_meridian + dlon, 0.0);
      return {p.x - a.x, p.y - a.y};
    }
    case ChordMethod::kGaussPaper: {  // (V-22) to (V-24)
      const auto a = gauss_forward_paper(ell, lat1, from_meridian, 0.0);
      const auto p = gauss_forward_paper(ell, lat2, from_meridian + dlon, 0.0);
      return {p.x - a.x, p.y - a.y};
    }
  }
  return {S(std::nan("")), S(std::nan(""))};
}

template <Real S>
TwoPoint<S> two_point(const Chord<S>& surveyed, const Chord<S>& reckoned) {
  // (V-13); in the Gauss plane S1, S2 of (V-25), 1/k = K_D/K_0 of (V-26), -eps of (V-27).
  TwoPoint<S> r;
  r.chord = hypot(surveyed.north, surveyed.east);
  r.reckoned = hypot(reckoned.north, reckoned.east);
  r.azimuth = atan2(surveyed.east, surveyed.north);
  r.reckoned_azimuth = atan2(reckoned.east, reckoned.north);
  const auto none = r.chord > S(0.0);
  r.k = select(none, r.reckoned / r.chord, S(std::nan("")));
  // The angle between the chords from their products: no loss where both azimuths are near +-pi.
  const S c = surveyed.north * reckoned.north + surveyed.east * reckoned.east;
  const S s = surveyed.north * reckoned.east - surveyed.east * reckoned.north;
  r.eps = select(none, atan2(s, c), S(std::nan("")));
  r.eps = select(r.eps > S(-kPi), r.eps, select(none, S(kPi), r.eps));
  return r;
}

double minimum_chord(double benchmark_std) { return std::max(1.0, 10.0 * benchmark_std); }

TwoPointResult calibrate_two_point(const Ellipsoid& ell, ChordMethod method,
                                   const TwoPointInput& in, const TwoPointOptions& options) {
  TwoPointResult r;
  r.value.k = r.value.eps = std::nan("");
  r.ln_k_std = r.eps_std = std::nan("");
  auto invalid = [&](std::string why) {
    r.why = std::move(why);
    return r;
  };
  for (const double x : {in.lat1, in.lon1, in.lat2, in.lon2, in.lat3, in.lon3})
    if (!std::isfinite(x)) return invalid("a coordinate is not finite");
  for (const double lat : {in.lat1, in.lat2, in.lat3})
    if (std::fabs(lat) > kPi / 2)
      return invalid(fmt::format("latitude {:.9g} deg is beyond 90 deg", lat / deg));
  if (std::fabs(in.lat1) >= kPi / 2 && method != ChordMethod::kGeodesic)
    return invalid("the start is a pole: true headings mean nothing there");
  const double from = options.own_meridian ? 0.0 : wrap_pi(in.lon1 - options.central_meridian);
  const double dlon2 = wrap_pi(in.lon2 - in.lon1);
  const double dlon3 = options.continuous_lon ? in.lon3 - in.lon1 : wrap_pi(in.lon3 - in.lon1);
  const auto surveyed = chord(ell, method, in.lat1, in.lat2, dlon2, from);
  const auto reckoned = chord(ell, method, in.lat1, in.lat3, dlon3, from);
  if (method == ChordMethod::kGauss || method == ChordMethod::kGaussPaper) {
    // The series is exact within 40 deg of the central meridian (earth/projection.hpp).
    const double reach = std::sin(40.0 * deg);
    for (const auto& [lat, dlon] :
         {std::pair{in.lat2, from + dlon2}, std::pair{in.lat3, from + dlon3}})
      if (std::cos(dlon) < 0.0 || std::fabs(std::cos(lat) * std::sin(dlon)) > reach)
        return invalid("an end is beyond 40 deg from the central meridian of the Gauss plane");
  }
  r.value = two_point(surveyed, reckoned);
  const double least = minimum_chord(options.benchmark_std);
  if (!(r.value.chord >= least)) {
    const double found = r.value.chord;
    r.value.k = r.value.eps = std::nan("");
    return invalid(fmt::format(
        "zero chord: start and surveyed end are {:.3g} m apart, at least {:.3g} m are needed",
        found, least));
  }
  if (!(r.value.reckoned >= least)) {
    const double found = r.value.reckoned;
    r.value.k = r.value.eps = std::nan("");
    return invalid(fmt::format(
        "zero chord: start and reckoned end are {:.3g} m apart, at least {:.3g} m are needed",
        found, least));
  }
  if (!std::isfinite(r.value.k) || !std::isfinite(r.value.eps))
    return invalid("not defined for these points");
  r.ln_k_std = std::sqrt(2.0) * options.benchmark_std / r.value.chord;  // (V-44)
  r.eps_std = r.ln_k_std;                                               // (V-45)
  r.valid = true;
  return r;
}

CalibrationBias mean_latitude_line_bias(const Ellipsoid& ell, double lat, double s0, double phi) {
  // (V-20a)
  const double t = std::tan(lat), d = s0 / ell.a;
  const double tau2 = d * d * (1.0 + 2.0 * t * t);
  const double s2 = std::sin(2.0 * phi), c = std::cos(phi);
  return {tau2 / 96.0 * s2 * s2 - ell.e2 / 8.0 * d * d * std::cos(2.0 * lat) * c * c,
          tau2 / 48.0 * s2 * c * c};
}

CalibrationBias mean_latitude_bias(const Ellipsoid& ell, double lat, double s0, double phi0,
                                   double k, double eps) {
  // (V-20b), the sign corrected (E-6)
  const double t = std::tan(lat), d = s0 / ell.a;
  const double tau2 = d * d * (1.0 + 2.0 * t * t);
  auto angle = [](double x) { return std::cos(x) * std::cos(x) * std::sin(2.0 * x); };
  auto scale = [](double x) { return std::sin(2.0 * x) * std::sin(2.0 * x); };
  return {tau2 / 96.0 * (k * k * scale(phi0 + eps) - scale(phi0)),
          tau2 / 48.0 * (k * k * angle(phi0 + eps) - angle(phi0))};
}

CalibrationBias start_latitude_bias(const Ellipsoid& ell, double lat, double s0, double phi0,
                                    double k, double eps) {
  // (V-20c)
  const double c1 = s0 / (4.0 * ell.a) * std::tan(lat);
  auto angle = [](double x) { return std::sin(2.0 * x) * std::cos(x); };
  auto scale = [](double x) { return std::sin(2.0 * x) * std::sin(x); };
  return {c1 * (k * scale(phi0 + eps) - scale(phi0)), c1 * (k * angle(phi0 + eps) - angle(phi0))};
}

CalibrationBias mean_latitude_bound(const Ellipsoid& ell, double lat, double s0, double k) {
  const double t = std::tan(lat), d = s0 / ell.a;
  const double tau2 = d * d * (1.0 + 2.0 * t * t);
  return {std::max(1.0, k * k) * tau2 / 96.0,
          3.0 * std::sqrt(3.0) / 8.0 * (1.0 + k * k) * tau2 / 48.0};
}

CalibrationBias route_bias(const Ellipsoid& ell, double lat, double area, double north, double east,
                           double k, double eps) {
  // (V-21)
  const double tau = std::tan(lat) / meridian_radius(ell, std::sin(lat));
  const std::complex<double> i(0.0, 1.0), z(north, east);
  const auto b = i * tau * area * (k * std::exp(-i * eps) - 1.0) / z;
  return {b.real(), b.imag()};
}

#define LOXO_INSTANTIATE(S)                                           \
  template Chord<S> chord(const Ellipsoid&, ChordMethod, S, S, S, S); \
  template TwoPoint<S> two_point(const Chord<S>&, const Chord<S>&);
LOXO_INSTANTIATE(double)

}  // namespace loxo
