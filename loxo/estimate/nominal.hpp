// SPDX-License-Identifier: Apache-2.0
// What the filter holds to be true, and how an estimate is fed back into it.
#pragma once
#include <cstdint>

#include "loxo/estimate/extra_states.hpp"

namespace loxo {

// SI, radians. q: body to ECEF. Constants are the values in use; corrected gyro = (measured -
// bg)/(1 + sg).
struct NominalState {
  double t = 0;
  Quat<Ecef, Body> q = Quat<Ecef, Body>::identity();
  Vec<Ecef> v;
  Point<Ecef> r;
  Vec<Body> bg, ba, sg, sa;
  double scale = 1;             // k = indicated/true
  double eps_h = 0, eps_p = 0;  // IMU heading - course, IMU pitch - climb angle
  Vec<Body> lever;              // from the IMU to the odometer point
  double tau = 0;               // odo(t) = k speed(t - tau)
  // A speed reading in whole units is rounded or cut: it has an offset b [m/s] beside its scale,
  // odo = k v + b (1 - v/offset_speed) forward; k is indicated/true at offset_speed. 0: no offset.
  double offset = 0, offset_speed = 0;
  double d[3]{};  // right, forward, up displacement since the last tick of each
  // extra_states.hpp; the antenna is where fixes are measured.
  Vec<Body> antenna;
  double height_bias = 0, heading_bias = 0;  // reading - true
  double misalignment[6]{};
};

// [EST-6]: navigation errors are subtracted, constants added.
void feed_back(NominalState& s, const double x[kStates]);
// The same for the extra states, x[kExtra].
void feed_back_extra(NominalState& s, const double x[kExtra]);
// [EST-7]: G_psi = I + 1/2 [psi] on the rows and columns of psi.
void reset_attitude(Covariance<kStates>& P, const double x[kStates]);
void reset_attitude(ExtraCovariance& X, const double x[kStates]);

// The product of transitions since the last record of a tape: rows of the moving states, constants
// are identity.
struct alignas(64) TransitionProduct {
  double f[kStates][Covariance<kStates>::kStride];
  double extra[kStates][kExtraStride];  // columns of the extra states, where one moves the others
  bool identity = true;
  TransitionProduct() { clear(); }
  void clear();
  void advance(const ErrorTransition<double>& t, const AccumulatorTransition<double>& acc);
  void advance_extra(const ErrorTransition<double>& t, const AccumulatorTransition<double>& acc,
                     const MisalignmentTransition& m);
  void reset_attitude(const double x[kStates]);  // [EST-7]
  void reset_accumulator(int axis);
};
inline constexpr int kMovingRows[12] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 28, 29, 30};

// Receives the filter's steps in true order (estimation.md section 6); the smoother's tape is one.
class FilterTape {
 public:
  virtual ~FilterTape() = default;
  virtual void transition(const TransitionProduct& f) = 0;
  // gain: 32, or 43 where the filter has extra states; X is null where it has none.
  virtual void measurement(const SparseRow<double>& h, double s, double y, const double* gain) = 0;
  virtual void epoch(const NominalState& nominal, const Covariance<kStates>& P,
                     const ExtraCovariance* X, std::uint32_t health) = 0;
};

}  // namespace loxo
