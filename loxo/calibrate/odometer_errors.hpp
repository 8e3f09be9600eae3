// SPDX-License-Identifier: Apache-2.0
// What the errors of alignment, gyros, odometer and benchmarks do to the scale and the mounting
// angle that a straight calibration drive finds: the chain of vehicle.md 3.3, corrected, and the
// budget made of it. alpha = azimuth of the surveyed chord - azimuth of the reckoned chord = -eps.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/ins/samples.hpp"

namespace loxo {

// Plane errors [m] of the reckoned end: x north, y east on the Gauss plane.
struct PlaneError {
  double dx = 0, dy = 0;
};
// (V-30), (V-31): from errors of latitude and longitude [rad] at (lat, dlon = lon - lon0). Error
// of the coefficients: dlon^3.
PlaneError gauss_position_error(const Ellipsoid& ell, double lat, double dlon, double dlat,
                                double dlongitude);

// Errors of the constants: relative error of K_D = K_0/k_hat, and of alpha [rad].
struct ConstantsError {
  double dk = 0, dalpha = 0;
};
// (V-28), (V-29): the reckoned chord (north, east) [m] is in error by e. With K_0 S1/S2 = K_D the
// surveyed chord leaves the relative form; odometer_scale_error() gives dK_D itself.
ConstantsError chord_error(double north, double east, const PlaneError& e);
double odometer_scale_error(double k0, double surveyed, double north, double east,
                            const PlaneError& e);

// (V-32) to (V-36): x' = F x - (e_E, e_N, e_U, 0, 0), x = (phiE, phiN, phiU [rad], dL, dlambda
// [rad]), on a sphere of radius R [m]; level vehicle, attitude kept by the dead reckoning itself.
// [row][column]; gyro errors e in rad/s.
using ReckoningMatrix = std::array<std::array<double, 5>, 5>;
ReckoningMatrix reckoning_error_matrix(double radius, double earth_rate, double lat, double ve,
                                       double vn);

// A straight drive from rest to rest as the chain sees it; level, course constant.
struct CalibrationDrive {
  double lat = 0, course = 0;         // rad
  double length = 10000, speed = 20;  // m, m/s
  double acceleration = 0.5;          // m/s^2; 0: `speed` throughout
  double duration() const;            // s
  double velocity(double t) const;    // m/s
};
// The state of (V-32) to (V-36) at the end, from constant gyro errors [rad/s] on E, N, U and
// initial attitude errors; Runge-Kutta of order 4 with at least 200 steps.
std::array<double, 5> propagate_reckoning_errors(const CalibrationDrive& drive, double radius,
                                                 double earth_rate,
                                                 const std::array<double, 3>& gyro,
                                                 const std::array<double, 3>& phi0);

// (V-37): the same, simplified, for constant speed; A = eU t^2/2 - phiU0 t.
struct StraightDriveError {
  double dlat = 0, dlon = 0;  // rad
  ConstantsError constants;   // (V-38)
};
StraightDriveError straight_drive_error(double radius, double lat, double ve, double vn,
                                        double phi_u0, double gyro_up, double t);

// (V-41): how an error of heading dpsi [rad] and of scale dlnk along a corrected track grows with
// its arc length: d(dm)/ds [1], d(dlambda)/ds [1/m]; dm [m] is the error of the meridian arc so
// far.
struct TrackErrorRates {
  double dm = 0, dlon = 0;
};
TrackErrorRates track_error_rates(const Ellipsoid& ell, double lat, double heading, double dm,
                                  double dpsi, double dlnk);

// What the drive's instruments are worth, 1 sigma; 0: perfect.
struct OdometerSources {
  double heading = 0, level = 0;          // alignment: azimuth, each level axis [rad]
  double gyro_bias = 0, gyro_noise = 0;   // each axis: rad/s constant, rad/sqrt(s)
  double benchmark = 0;                   // each end, each axis [m]
  double quantisation = 0;                // m of indicated distance
  double scale_noise = 0, side_slip = 0;  // white, each step: 1, rad
  double step = 1;                        // m: the step that those two are stated for
};
struct SourceError {
  std::string name;          // "heading_alignment", "gyro_up" …
  std::string words;         // "heading of the alignment" …
  double ln_k = 0, eps = 0;  // 1 sigma: 1, rad
};
// What one change of the drive or its instruments makes of the totals.
struct Improvement {
  std::string change;  // "heading_alignment halved", "drive twice as long" …
  double ln_k = 0, eps = 0;
};
struct OdometerBudget {
  double duration = 0;       // s
  double ln_k = 0, eps = 0;  // totals, 1 sigma
  std::vector<SourceError> sources;
  std::size_t leading_ln_k = 0, leading_eps = 0;  // in `sources`
  std::vector<Improvement> improvements;          // best for eps first
  std::size_t best_ln_k = 0, best_eps = 0;        // in `improvements`
};
// The first-order chain (V-28) to (V-38) for a heading that the reckoning keeps itself
// (kMechanised), (V-41) for an independent one, with (V-44), (V-45) for what is random. Throws
// Error(kInput) for negative or non-finite sources, a drive without length or speed, a latitude
// beyond 89.9 deg.
OdometerBudget odometer_budget(const Ellipsoid& ell, const CalibrationDrive& drive,
                               const OdometerSources& sources, HeadingModel model);

}  // namespace loxo
