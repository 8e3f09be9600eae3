// SPDX-License-Identifier: Apache-2.0
// Dead reckoning: from distance and heading increments to position. Kernels for double and lanes:
// no allocation, no throw; a step outside its domain (a true heading across a pole) gives NaN.
// vehicle.md section 1.
#pragma once
#include <string_view>

#include "loxo/earth/ellipsoid.hpp"
#include "loxo/earth/frames.hpp"
#include "loxo/ins/samples.hpp"
#include "loxo/num/geometry.hpp"

namespace loxo {

// Exact: every step a rhumb line, exact to rounding (V-8). Midpoint: second order in the step
// (V-7). Start latitude: first order, only to compare with the papers (V-6).
enum class Integrator { kExact, kMidpoint, kStartLatitude };
inline constexpr std::string_view integrator_name(Integrator i) {
  return i == Integrator::kExact      ? "exact"
         : i == Integrator::kMidpoint ? "midpoint"
                                      : "start-latitude";
}

// Position by true headings. Geodetic, rad; lon runs on beyond +-pi. The low parts hold what
// rounding took away, so that 10^7 short steps sum up like one.
template <Real S = double>
struct ReckonState {
  S lat{}, lon{};
  S lat_low{}, lon_low{};
};
template <Real S>
inline ReckonState<S> reckon_start(S lat, S lon) {
  return {lat, lon, S(0.0), S(0.0)};
}

// What a step knows of the way between its ends, for sensitivities and convergence.
template <Real S = double>
struct StepRates {
  S north{}, east{};  // the step on the ellipsoid [m]
  S mean_rate{};      // D = dq/dm over the step [1/m] (V-8)
  S slope{};          // w'(m) at mid-step [1/m^2] (V-40)
  S sin_mid{};        // sin of the latitude at mid-step
};

// One rhumb step: dn metres of meridian arc, de metres along the parallel, both at ellipsoidal
// height h [m] and reduced to the ellipsoid by it. Exact to 1e-15 of the step for any length: steps
// below 2 km and 6e-4 of the distance to the pole by a two-point-order expansion, others by divided
// differences (V-8). NaN where |m| would pass the quarter meridian.
template <Real S>
StepRates<S> step_exact(const Ellipsoid& ell, ReckonState<S>& state, S dn, S de, S h);
// (V-7), second order in the step; (V-6), first order. NaN beyond a pole.
template <Real S>
void step_midpoint(const Ellipsoid& ell, ReckonState<S>& state, S dn, S de, S h);
template <Real S>
void step_start_latitude(const Ellipsoid& ell, ReckonState<S>& state, S dn, S de, S h);
template <Real S>
void step_by(const Ellipsoid& ell, Integrator integrator, ReckonState<S>& state, S dn, S de, S h);

// Position by grid headings: the outward normal, regular at its pole. North: G = psi - lon; south:
// G = psi + lon.
template <Real S = double>
struct GridState {
  Vec<Ecef, S> n;
};
template <Real S>
GridState<S> grid_start(S lat, S lon);
// One step of constant grid heading (V-11), Runge-Kutta of order 4 over at most 2 km at a time:
// below 1e-9 m a step. `north` chooses the pole that stays regular; the other pole is singular.
template <Real S>
void step_grid(const Ellipsoid& ell, bool north, GridState<S>& state, S ds, S grid_heading, S h);
// Unit vectors of grid north and grid east at n (V-11), as components in ECEF.
template <Real S>
struct GridAxes {
  Vec<Ecef, S> north, east;
};
template <Real S>
GridAxes<S> grid_axes(bool north, const Vec<Ecef, S>& n);
// Latitude and longitude of a normal, lon in (-pi, pi]; lon 0 at the pole.
template <Real S>
void latlon_of_normal(const Vec<Ecef, S>& n, S& lat, S& lon);

// H2 (V-12), (V-42): the recorded heading holds the difference of convergence between the dead
// reckoning that kept it (as recorded) and the truth (as corrected). Both tracks run side by side.
template <Real S = double>
struct MechanisedState {
  ReckonState<S> recorded, truth;
  S chi_recorded{}, chi_truth{};  // INT sin L dlon [rad]
  S earth{};                      // omega INT (sin L_recorded - sin L_truth) dt [rad]
};
template <Real S>
inline MechanisedState<S> mechanised_start(S lat, S lon) {
  return {reckon_start<S>(lat, lon), reckon_start<S>(lat, lon), S(0.0), S(0.0), S(0.0)};
}
// One recorded step (distance ds, heading psi_rec) corrected by scale k and angle eps [rad];
// returns the true heading. dt [s] = 0 leaves the Earth-rate term out.
template <Real S>
S step_mechanised(const Ellipsoid& ell, MechanisedState<S>& state, S ds, S psi_rec, S k, S eps, S h,
                  S dt);
// The other way round, for the simulator: a true step (ds_true, psi) recorded with k and eps;
// returns psi_rec.
template <Real S>
S record_mechanised(const Ellipsoid& ell, MechanisedState<S>& state, S ds_true, S psi, S k, S eps,
                    S h, S dt);

}  // namespace loxo
