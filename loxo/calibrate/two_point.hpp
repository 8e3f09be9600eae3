// SPDX-License-Identifier: Apache-2.0
// Two-point calibration (vehicle.md section 2): start A, surveyed end C, reckoned end D. Scale k =
// |AD|/|AC|, angle eps = azimuth of AD - azimuth of AC, in one of six metrics. Formula and route
// bias of each stand beside it.
#pragma once
#include <span>
#include <string>
#include <string_view>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/num/functions.hpp"

namespace loxo {

enum class ChordMethod { kStartLatitude, kMeanLatitude, kRhumb, kGeodesic, kGauss, kGaussPaper };
// "start_latitude", "mean_latitude", "rhumb", "geodesic", "gauss", "gauss_paper".
std::string_view chord_method_name(ChordMethod method);
// The five that `--method all` shows; gauss_paper comes with --series paper.
std::span<const ChordMethod> chord_methods();

template <Real S = double>
struct Chord {
  S north{}, east{};  // m
};
// The chord from (lat1, lon1) to (lat2, lon1 + dlon) in the method's metric: rad in, metres out.
// dlon is used as it is (reduce it to (-pi, pi] where only end points are known). lon0: central
// meridian of the Gauss methods. (V-14) to (V-19). Geodesic in lanes: lane by lane.
template <Real S>
Chord<S> chord(const Ellipsoid& ell, ChordMethod method, S lat1, S lat2, S dlon, S lon1_minus_lon0);

template <Real S = double>
struct TwoPoint {
  S k{}, eps{};                      // indicated / true; indicated - true, (-pi, pi]
  S chord{}, azimuth{};              // of the surveyed end [m], (-pi, pi]
  S reckoned{}, reckoned_azimuth{};  // of the reckoned end
};
// (V-13). Kernel: NaN for anything outside its domain, zero chords included.
template <Real S>
TwoPoint<S> two_point(const Chord<S>& surveyed, const Chord<S>& reckoned);

struct TwoPointInput {
  double lat1 = 0, lon1 = 0;  // start
  double lat2 = 0, lon2 = 0;  // surveyed end
  double lat3 = 0, lon3 = 0;  // reckoned end, all rad
};
struct TwoPointOptions {
  double benchmark_std = 0;     // m, 1 sigma of each end per axis
  bool own_meridian = true;     // Gauss: the start's meridian is the central one
  double central_meridian = 0;  // otherwise this [rad]
  bool continuous_lon = false;  // lon3 - lon1 runs on beyond +-pi (from a log): use it as it is
};
struct TwoPointResult {
  TwoPoint<double> value;
  double ln_k_std = 0, eps_std = 0;  // (V-44), (V-45), benchmark part
  bool valid = false;
  std::string why;  // the reason in words where not valid
};
// The door of the kernels above, with the rejection rules of section 2: non-finite, |lat| > 90 deg,
// a chord shorter than 10 benchmark sigma or 1 m.
TwoPointResult calibrate_two_point(const Ellipsoid& ell, ChordMethod method,
                                   const TwoPointInput& in, const TwoPointOptions& options = {});
// Shortest chord that is not refused [m].
double minimum_chord(double benchmark_std);

// An error "computed - true" of a method.
struct CalibrationBias {
  double ln_k = 0, eps = 0;  // 1, rad
};
// Formula bias of mean and start latitude on a constant heading phi0 of true length s0 [m] at
// latitude lat: (V-20b), (V-20c). Valid where s0 tan(lat)/a < 0.3.
CalibrationBias mean_latitude_bias(const Ellipsoid& ell, double lat, double s0, double phi0,
                                   double k, double eps);
CalibrationBias start_latitude_bias(const Ellipsoid& ell, double lat, double s0, double phi0,
                                    double k, double eps);
// Largest |bias| of mean latitude over all headings (after V-20c).
CalibrationBias mean_latitude_bound(const Ellipsoid& ell, double lat, double s0, double k);
// One line by mean latitude, computed - true: relative distance in ln_k, direction in eps (V-20a).
CalibrationBias mean_latitude_line_bias(const Ellipsoid& ell, double lat, double s0, double phi0);
// Route bias of any chord method on an H1 log: area [m^2] between route and chord, positive with
// the route to the left of the chord, true chord (north, east) [m] (V-21).
CalibrationBias route_bias(const Ellipsoid& ell, double lat, double area, double north, double east,
                           double k, double eps);

}  // namespace loxo
