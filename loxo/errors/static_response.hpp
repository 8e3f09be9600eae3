// SPDX-License-Identifier: Apache-2.0
// How the errors of an inertial system at rest move: the exact closed form, Foucault included, on
// the sphere and on the ellipsoid, in any level frame. polar.md 5.2 (sphere); on the ellipsoid the
// two curvatures make two elliptic Schuler modes instead of two circular ones, and the form stays
// closed (decision 0007).
#pragma once
#include <array>
#include <span>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"

namespace loxo {

// Where the system stands, in the axes of the level frame that the errors are written in.
struct StaticSite {
  double w = 0;                      // Earth rate [rad/s]
  double g = 0;                      // gravity [m/s^2]
  double u[3]{};                     // unit vector of the Earth's axis in E, N, U of the frame
  double kee = 0, ken = 0, knn = 0;  // curvature matrix K [1/m] (polar.md 2.1)
  double tan_e = 0, tan_n = 0;       // Phi_U = psi_U + tan_e (K dr)_E + tan_n (K dr)_N [EST-2]
  double cos_lat = 1;                // dlon = (K dr)_E / cos_lat, of the frame's own latitude
  bool neglect_foucault = false;     // the papers' form (polar.md 5.3)
};

// Transverse latitude and longitude [rad]. Throws Error(kInput) at a transverse pole.
StaticSite transverse_site(const Ellipsoid& ell, double tlat, double tlon);
// Geographic east-north-up; throws Error(kInput) at a geographic pole.
StaticSite geographic_site(const Ellipsoid& ell, double lat);
// Grid east = transverse north, grid north = - transverse east; dlat, dlon are the two tilt angles.
StaticSite grid_site(const Ellipsoid& ell, double tlat, double tlon);
// Wander-azimuth with its y axis turned by `azimuth` from true north, clockwise; dlat, dlon are the
// two tilt angles.
StaticSite wander_site(const Ellipsoid& ell, double lat, double azimuth);

// Initial errors (computed - true) and constant sensor errors (measured - true), in the frame's
// axes.
struct StaticInputs {
  double dve0 = 0, dvn0 = 0;               // m/s
  double phie0 = 0, phin0 = 0, phiu0 = 0;  // rad, C_comp = (I - [Phi]) C
  double dlat0 = 0, dlon0 = 0;             // rad
  double nabla_e = 0, nabla_n = 0;         // m/s^2
  double eps_e = 0, eps_n = 0, eps_u = 0;  // rad/s
};
// dve, dvn [m/s], phie, phin, phiu [rad], dlat, dlon [rad].
using StaticState = std::array<double, 7>;

// The response as coefficients of 1, t, cos wt, sin wt, cos O1 t, sin O1 t, cos O2 t, sin O2 t;
// linear in the inputs.
struct StaticResponse {
  std::array<std::array<double, 8>, 7> coefficient{};
  std::array<std::array<double, 8>, 2> metres{};  // position error north, east [m], same basis
  double w = 0, o1 = 0, o2 = 0;                   // rad/s

  StaticState at(double t) const;
  std::array<double, 2> position(double t) const;  // north, east [m]
};
StaticResponse static_response(const StaticSite& site, const StaticInputs& in);

// Roots of the characteristic polynomial, all on the imaginary axis [rad/s]: earth (= w), low and
// high Schuler-Foucault; and zero. polar.md 5.1
struct StaticRoots {
  double earth = 0, low = 0, high = 0;
};
StaticRoots static_roots(const StaticSite& site);

// out[k][component][i] = responses[k] at t0 + i dt, i < n, for responses of one site; equal to at()
// but for the rounding of the terms that are summed (1e-15).
void static_series(std::span<const StaticResponse> responses, double t0, double dt, std::size_t n,
                   std::span<std::array<std::vector<double>, 7>> out);

// White noise of density qa [(m/s^2)^2 s] on both horizontal accelerometers and qg [(rad/s)^2 s] on
// the three gyros from 0 to t: covariance of the state (7 x 7, row major), by Gauss-Legendre
// quadrature of squared impulse responses.
std::array<double, 49> static_noise_covariance(const StaticSite& site, double qa, double qg,
                                               double t);

}  // namespace loxo
