// SPDX-License-Identifier: Apache-2.0
// The polar test: recorded inertial data moved to the pole (polar.md section 7). The track is
// turned by `angle` about the transverse axis z' (the point of the equator at lon0 + 90 deg):
// transverse latitude, height and attitude in the transverse frame stay, transverse longitude
// becomes l - angle.
#pragma once
#include "loxo/earth/attitude.hpp"
#include "loxo/earth/transverse.hpp"
#include "loxo/ins/samples.hpp"

namespace loxo {

// Path and velocity cannot both stay on an ellipsoid: keeping both is wrong by 0.7 % of the speed
// and 4.6e-4 m/s^2 in turns. On a sphere they are the same thing.
enum class Keep {
  kPath,  // E2: position, hence the shape of the track, stays; the velocity is rescaled by K_m^-1 K
  kVelocity,  // E1: the velocity in the transverse frame stays; the path is integrated anew and
              // slightly deformed
};

struct PolarMove {
  Ellipsoid earth;
  double lon0 = 0;   // reference meridian [rad]
  double angle = 0;  // Lambda [rad], > 0: toward the north pole along lon0
  Keep keep = Keep::kPath;
};

// Position, velocity [m/s] and attitude in the transverse frame of lon0.
template <Real S = double>
struct TransverseState {
  S tlat{}, tlon{}, h{};
  Vec<Transverse, S> v;
  Rot<Transverse, Body, S> C_tb;
};

// Rates and gravity that the frame sees at a place. 2.2, 3.1.
template <Real S>
struct TransverseRates {
  Vec<Transverse, S> w_ie, w_et;  // rad/s
  S g{};                          // downward [m/s^2]
  Curvature<S> K;                 // 1/m
};
template <Real S>
TransverseRates<S> transverse_rates(const Ellipsoid& earth, S tlat, S tlon, S h,
                                    const Vec<Transverse, S>& v);

// What is added to the recorded rates: specific force [m/s^2] and angular rate [rad/s], body axes.
template <Real S = double>
struct Conversion {
  Vec<Body, S> df, dw;
};

// The formula (3) itself: rates at home and at the moved place, attitude and velocity the same at
// both.
template <Real S>
Conversion<S> convert_same_velocity(const TransverseRates<S>& home, const TransverseRates<S>& moved,
                                    const Vec<Transverse, S>& v,
                                    const Rot<Transverse, Body, S>& C_tb);

// 7.2 E2 and, on a sphere, 7.1: exact where `f` is the specific force at `home` [m/s^2]. Second
// order in a step when applied at mid-interval. Also gives the moved state (velocity P_m v).
template <Real S>
struct MovedByPath {
  Conversion<S> conversion;
  TransverseState<S> state;
};
template <Real S>
MovedByPath<S> move_path(const PolarMove& move, const TransverseState<S>& home,
                         const Vec<Body, S>& f);

// The state alone (E2, sphere): what the reference becomes.
template <Real S>
TransverseState<S> move_state(const PolarMove& move, const TransverseState<S>& home);

// 7.2 E1: (3) between `home` and the moved place (tlat, tlon), transport rates each at its own.
template <Real S>
Conversion<S> convert_velocity(const PolarMove& move, const TransverseState<S>& home, S tlat,
                               S tlon);

// E1's path: (tlat, tlon) advanced over dt with the velocity at its middle; second order in dt.
template <Real S>
void advance_transverse(const Ellipsoid& earth, S& tlat, S& tlon, S h, const Vec<Transverse, S>& v,
                        double dt);

// Increments over dt with the conversion at mid-interval: dtheta + dw dt, dv + df dt.
template <Real S>
ImuIncrement<S> moved_increment(const ImuIncrement<S>& home, const Conversion<S>& c);

// Between the transverse frame and ECEF, exact at the pole.
template <Real S>
struct EcefPose {
  Point<Ecef, S> r;
  Vec<Ecef, S> v;
  Rot<Ecef, Body, S> C_eb;
};
template <Real S>
TransverseState<S> to_transverse_state(const Ellipsoid& earth, double lon0, const EcefPose<S>& e);
template <Real S>
EcefPose<S> to_ecef_pose(const Ellipsoid& earth, double lon0, const TransverseState<S>& t);

}  // namespace loxo
