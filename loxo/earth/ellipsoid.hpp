// SPDX-License-Identifier: Apache-2.0
// Ellipsoids of revolution and their radii. Constants are double also in lanes: all lanes share one
// Earth.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "loxo/num/functions.hpp"

namespace loxo {

// y - x = sum_j c[j] sin(2 j x), j = 1 to 8, and the same as sin(2x) times a polynomial p in
// cos(2x).
struct SineSeries {
  double c[9]{}, p[8]{};
};

// An ellipsoid and the constants derived from it once. Make one with make_ellipsoid() or by name.
struct Ellipsoid {
  std::string name;
  double a = 0, f = 0;            // semi-major axis [m], flattening [1]; f = 0 is a sphere
  double b = 0, e2 = 0, ep2 = 0;  // semi-minor axis [m], first and second eccentricity squared
  double e = 0, n = 0;            // first eccentricity, third flattening
  double w_ie = 7.292115e-5;      // rotation rate [rad/s]
  double gm = 3.986004418e14;     // [m^3/s^2]
  double g_constant =
      0;  // > 0: gravity is this constant [m/s^2] (the papers' sphere); 0: Somigliana
  double rectifying_radius = 0;  // [m]: meridian arc = rectifying_radius * mu
  double quarter_meridian = 0;   // [m]
  // Series in n between geodetic (phi), rectifying (mu) and conformal (chi) latitude; mu of chi and
  // chi of mu are Gauss-Krueger's, there of complex argument.
  SineSeries mu_of_phi, phi_of_mu, chi_of_phi, phi_of_chi, mu_of_chi, chi_of_mu;
};

// Throws Error(kInput) for a <= 0 or f outside [0, 0.1].
Ellipsoid make_ellipsoid(std::string name, double a, double f);
const Ellipsoid& wgs84();
const Ellipsoid& grs80();
const Ellipsoid& cgcs2000();
const Ellipsoid& krassovsky();
// The papers' sphere: R 6371000 m, g 9.8 m/s^2 constant.
const Ellipsoid& paper_sphere();
Ellipsoid make_sphere(double radius);
// "WGS84", "GRS80", "CGCS2000", "Krassovsky"/"Krasovsky", "sphere", "a=6378137m,f=1/298.257" (also
// f=0.003…), case-insensitive. Throws Error(kInput) with the nearest valid name.
Ellipsoid ellipsoid_by_name(std::string_view text);

// N(L) [m], prime-vertical radius (V-1); s = sin(latitude).
template <Real S>
inline S prime_vertical_radius(const Ellipsoid& ell, S s) {
  return S(ell.a) / sqrt(S(1.0) - S(ell.e2) * s * s);
}
// M(L) = R_M(L) [m], meridian radius (V-2).
template <Real S>
inline S meridian_radius(const Ellipsoid& ell, S s) {
  const S w2 = S(1.0) - S(ell.e2) * s * s;
  return S(ell.a * (1.0 - ell.e2)) / (w2 * sqrt(w2));
}

}  // namespace loxo
