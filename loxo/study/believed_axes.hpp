// SPDX-License-Identifier: Apache-2.0
// The axes in which a trial's lanes hand their samples to navigators that run lane by lane. For the
// .cpp files of kinds only.
#pragma once
#include "loxo/ins/samples.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/study/drive_modes.hpp"

namespace loxo {

// The vehicle's axes as believed (turned by the mounting error from the true ones), and a body that
// slips: each second it stands turned clockwise against its way, which the gyros see as a jump.
struct BelievedAxes {
  Vec<Body> right, forward, up;
  double side = 0, jump = 0, sine = 0, cosine = 1;

  BelievedAxes() = default;
  BelievedAxes(const DriveTruth& t, double mounting) : up(t.up) {
    double s, c;
    sincos(mounting, s, c);
    forward = c * t.forward + s * t.right;
    right = c * t.right - s * t.forward;
  }
  void slip(double angle) {
    jump += angle - side;
    side = angle;
    sincos(angle, sine, cosine);
  }
  Vec<Body> of(const Vec<Body>& imu) const {
    const double r = dot(right, imu), f = dot(forward, imu);
    return {cosine * r - sine * f, sine * r + cosine * f, dot(up, imu)};
  }
  ImuIncrement<double> sample(double t, double dt, const double* a) {
    ImuIncrement<double> u{t, dt, of({a[0], a[1], a[2]}), of({a[3], a[4], a[5]})};
    u.dtheta.z -= jump;
    jump = 0;
    return u;
  }
};
template <Real S>
Spread<S, 6> sample_of(const ImuIncrement<S>& u) {
  return Spread<S, 6>({u.dtheta.x, u.dtheta.y, u.dtheta.z, u.dv.x, u.dv.y, u.dv.z});
}

}  // namespace loxo
