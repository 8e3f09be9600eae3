// SPDX-License-Identifier: Apache-2.0
// A state from one frame to another: through ECEF matrices, never through longitude or true
// heading; exact at the pole. Round trip below 1e-8 m and 1e-9 arc seconds. polar.md 1.3, 3.4.
//
// The covariance: kept on ECEF axes (estimation.md [EST-1]) a handover does nothing to it, and this
// header stays as it is; filters with level axes turn theirs in estimate/ by [EST-16].
#pragma once
#include "loxo/ins/strapdown.hpp"

namespace loxo {

template <class To, class From, Real S>
inline State<To, S> handover(const EarthModel& earth, const State<From, S>& x) {
  return To::from_ecef(earth, From::to_ecef(earth, x));
}

// `--frame auto`: geographic below, transverse above, with hysteresis (polar.md 3.4).
struct SwitchRule {
  double sin2_up = 0.9698463103929541;    // sin^2(80 deg): geographic -> transverse beyond
  double sin2_down = 0.9567727288213004;  // sin^2(78 deg): transverse -> geographic below
};
// The frame to use next, from the frame in use and the ellipsoid normal's z component.
inline FrameId frame_wanted(const SwitchRule& rule, FrameId now, double sin_lat) {
  const double s2 = sin_lat * sin_lat;
  if (now == FrameId::kGeographic) return s2 > rule.sin2_up ? FrameId::kTransverse : now;
  return s2 < rule.sin2_down ? FrameId::kGeographic : now;
}

}  // namespace loxo
