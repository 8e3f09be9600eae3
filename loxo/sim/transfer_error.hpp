// SPDX-License-Identifier: Apache-2.0
// What the errors of the reference put into converted inertial data (polar.md 7.3 to 7.7): by
// definition, by the full first-order formula and by the simplified formula for ships. Additive to
// the unit's own errors: an equivalent sensor error in the polar data.
#pragma once
#include <vector>

#include "loxo/sim/polar_transfer.hpp"

namespace loxo {

// A reference's state for the conversion: transverse frame, rad and m/s, gravity at both places
// [m/s^2].
struct TransferPoint {
  double tlat = 0, tlon = 0, angle = 0;
  double ve = 0, vn = 0;
  double heading = 0, pitch = 0, roll = 0;
  double g = 0, gm = 0;
};
// Gravity at both places from the ellipsoid, at height h.
void set_gravity(const Ellipsoid& earth, TransferPoint& point, double h = 0.0);

// Errors of the reference, "computed minus true".
struct ReferenceError {
  double heading = 0, pitch = 0, roll = 0;  // rad
  double ve = 0, vn = 0;                    // m/s, transverse
  double tlat = 0, tlon = 0;  // rad; by definition only, with the gravity's change g, gm
  double g = 0, gm = 0;
};

// The state that a reference with these errors says: heading, level and transverse velocity wrong,
// the position true.
EcefPose<double> said_by(const PolarMove& move, const EcefPose<double>& truth,
                         const ReferenceError& e);

// (14): A = cos l - cos(l - Lambda), B = sin l - sin(l - Lambda). dA/dl = -B, dB/dl = A, A^2 + B^2
// = 4 sin^2(Lambda/2) (25).
struct AB {
  double A = 0, B = 0;
};
AB transfer_ab(double tlon, double angle);

// (3) on `earth` (a sphere where f = 0: the transport rates cancel; h = 0).
Conversion<double> convert(const Ellipsoid& earth, const TransferPoint& p);
// (8) - (3): the conversion with the erroneous arguments minus that with the true ones, nothing
// linearised.
Conversion<double> conversion_error(const Ellipsoid& earth, const TransferPoint& p,
                                    const ReferenceError& e);
// Phi of 7.3: C~ = (I - [Phi]) C for small errors of heading, pitch and roll.
Vec<Transverse, double> attitude_error_vector(const TransferPoint& p, const ReferenceError& e);
// (9), (10); on an ellipsoid with the transport rates' difference E(v) = w_etm - w_et added:
// C_bt {Phi x [(2 O + E) x v - dg] + (2 O + E) x dv + E(dv) x v}, C_bt {Phi x (O + E) + E(dv)}.
// First order.
Conversion<double> conversion_error_full(const Ellipsoid& earth, const TransferPoint& p,
                                         const ReferenceError& e);

// (15) to (18): Delta df = F_ve dve + F_vn dvn + F_pe PhiE + F_pn PhiN, Delta dw = W_pe PhiE + W_pn
// PhiN + W_pu PhiU. Level ship on the transverse equator; w the Earth's rate, G = gm - g.
struct ErrorCoefficients {
  Vec<Body, double> F_ve, F_vn, F_pe, F_pn;
  Vec<Body, double> W_pe, W_pn, W_pu;
};
ErrorCoefficients error_coefficients(double A, double B, double w, double G, double theading);
// (12), (13). Valid to 5 to 15 % of the vector norm for total roll amplitudes of 3 to 8 deg (7.7).
Conversion<double> conversion_error_simple(const Ellipsoid& earth, const TransferPoint& p,
                                           const ReferenceError& e);

}  // namespace loxo
