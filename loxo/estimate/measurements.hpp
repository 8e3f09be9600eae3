// SPDX-License-Identifier: Apache-2.0
// What each sensor says about the error state: predicted value and row of H, so that y = z - h = H
// x + noise with navigation errors computed - true and constants true - used. All on ECEF axes; a
// function per sensor, one row each.
#pragma once
#include "loxo/estimate/nominal.hpp"

namespace loxo {

// The rows of R_m: the vehicle's right, forward, up axes in body components. [EST-10]
struct MountingAxes {
  Vec<Body> axis[3];
  double sin_p = 0, cos_p = 1;
};
MountingAxes mounting_axes(double eps_h, double eps_p);

// The nominal motion at the time a measurement is valid.
struct MeasurementPoint {
  Rot<Ecef, Body> C;
  Vec<Ecef> v;     // m/s
  Point<Ecef> r;   // m
  Vec<Ecef> a;     // acceleration relative to the Earth, m/s^2
  Vec<Body> w_eb;  // body rate relative to the Earth, rad/s
  Vec<Ecef> w_ie;  // rad/s
};

// Axis i of level axes, as the rows of C_e^level say it.
inline Vec<Ecef> row_of(const Block3<>& c, int i) { return {c.m[i][0], c.m[i][1], c.m[i][2]}; }

struct ScalarMeasurement {
  double h = 0;  // predicted value
  SparseRow<double> row;
};

// Velocity of the odometer point along an axis of the vehicle: 0 right and 2 up (non-holonomic, z =
// 0), 1 forward times k (odometer, z = reading at t - tau) with its offset, which has the sign of
// the motion (`direction` 1 or -1). with_tau: the delay's column too. [EST-10], [EST-11]
ScalarMeasurement vehicle_velocity(const MeasurementPoint& p, const NominalState& s,
                                   const MountingAxes& m, int axis, bool with_tau,
                                   double direction = 1.0);

// The accumulators' part of a step of dt, nominal at mid-step, and the displacement itself.
// [EST-12]
AccumulatorTransition<double> accumulator_transition(const MeasurementPoint& p,
                                                     const NominalState& s, const MountingAxes& m,
                                                     double dt);
void accumulator_rate(const MeasurementPoint& p, const NominalState& s, const MountingAxes& m,
                      double rate[3]);
// Rows right and up of the transition across the way: less their part along it (rate: of
// accumulator_rate), which is what keeps the constraint from pulling the speed. [EST-12]
void across_the_way(AccumulatorTransition<double>& t, const double rate[3]);
// A tick: z = indicated distance; speed_change = v_odo(t2) - v_odo(t1) for the delay's column.
// [EST-12]
ScalarMeasurement accumulated_distance(const NominalState& s, double speed_change);
// Non-holonomic: z = 0 against d right (0) or up (2). [EST-12]
ScalarMeasurement accumulated_side(const NominalState& s, int axis);

// Zero velocity along an ECEF axis; zero rate about a body axis against the mean measured rate less
// the bias. (section 2.3)
ScalarMeasurement zero_velocity(const MeasurementPoint& p, int axis);
ScalarMeasurement zero_rate(const MeasurementPoint& p, const NominalState& s, int axis);

// Position of the body point l along the unit direction `along` (ECEF): z = along . position; h
// relative to `origin`.
ScalarMeasurement position_along(const MeasurementPoint& p, const Vec<Body>& l,
                                 const Vec<Ecef>& along, const Point<Ecef>& origin);
// Velocity of the body point l along a unit direction (ECEF).
ScalarMeasurement velocity_along(const MeasurementPoint& p, const Vec<Body>& l,
                                 const Vec<Ecef>& along);
// Velocity relative to the Earth along a body axis at the point l (Doppler log), no constants.
ScalarMeasurement body_velocity(const MeasurementPoint& p, const Vec<Body>& l, int axis);
// True heading (clockwise) from a level frame's axes E, N, U in ECEF; turn: th_U of that frame on
// (dE, dN), 1/m, which carries the position error into the azimuth ([EST-2]; zero for heading
// against fixed axes). h in [0, 2 pi).
ScalarMeasurement heading_in(const MeasurementPoint& p, const Vec<Ecef>& e, const Vec<Ecef>& n,
                             const Vec<Ecef>& u, const double turn[2]);

}  // namespace loxo
