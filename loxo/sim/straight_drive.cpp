// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/straight_drive.hpp"

#include <algorithm>
#include <cmath>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodesic.hpp"
#include "loxo/ins/attitude_reckoning.hpp"
#include "loxo/ins/mechanization.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"

namespace loxo {

StraightDrive sh15_drive() {
  StraightDrive d;
  d.lat = 40 * deg;
  d.lon = 116 * deg;
  d.course = 45 * deg;
  d.geodesic = false;
  return d;
}

double StraightDrive::ramp_time() const {
  if (acceleration <= 0) return 0;
  // A drive too short for its speed turns round at its middle.
  return std::min(speed / acceleration, std::sqrt(length / acceleration));
}
double StraightDrive::duration() const {
  const double ramp = ramp_time(), top = acceleration > 0 ? acceleration * ramp : speed;
  return 2 * ramp + (length - acceleration * ramp * ramp) / top;
}
double StraightDrive::velocity(double t) const {
  const double end = duration();
  if (t < 0 || t > end) return 0;
  if (acceleration <= 0) return speed;
  return acceleration * std::min({t, ramp_time(), end - t});
}
double StraightDrive::distance(double t) const {
  const double ramp = ramp_time(), end = duration();
  const double top = acceleration > 0 ? acceleration * ramp : speed;
  t = std::clamp(t, 0.0, end);
  if (t < ramp) return 0.5 * acceleration * t * t;
  if (t > end - ramp) return length - 0.5 * acceleration * (end - t) * (end - t);
  return 0.5 * acceleration * ramp * ramp + top * (t - ramp);
}

StraightDriveEnds simulate_straight_drive(const Ellipsoid& ell, const StraightDrive& drive,
                                          const ReckoningErrors& errors) {
  if (!(drive.length > 0 && drive.speed > 0 && drive.interval > 0 && drive.acceleration >= 0 &&
        std::fabs(drive.lat) < 89.9 * deg))
    throw Error(ErrorKind::kInput,
                "a straight drive needs a positive length, speed and interval, and a latitude "
                "within 89.9 deg",
                "drive");
  struct Place {
    double lat, lon, course;
  };
  // One exact rhumb step or geodesic from the start: nothing sums up.
  const auto place = [&](double s) -> Place {
    if (drive.geodesic) {
      const auto g = geodesic_direct(ell, drive.lat, drive.lon, drive.course, s);
      return {g.lat, g.lon, g.azimuth2};
    }
    auto r = reckon_start(drive.lat, drive.lon);
    step_exact(ell, r, s * cos(drive.course), s * sin(drive.course), 0.0);
    return {r.lat, r.lon, drive.course};
  };
  const auto body = [&](const Place& p) {
    return to_quaternion(to_matrix<Geographic>(Euler<double>{p.course + errors.eps, 0.0, 0.0}));
  };
  AttitudeReckonState<double> state;
  const Vec<Geographic> phi{errors.phi_e, errors.phi_n, errors.phi_u};
  state.q_nb = exp_step<Geographic, Geographic>(-phi) * body(place(0));
  state.where = reckon_start(drive.lat, drive.lon);

  const double end = drive.duration();
  const auto steps = static_cast<long>(std::ceil(end / drive.interval - 1e-9));
  const double dt = end / static_cast<double>(steps);
  const Stream<double> gyro{errors.seed, errors.trial, 1};
  Place p0 = place(0);
  for (long i = 0; i < steps; ++i) {
    const double t1 = dt * static_cast<double>(i + 1);
    const double s0 = drive.distance(t1 - dt), s1 = drive.distance(t1);
    const Place p1 = place(s1), pm = place(0.5 * (s0 + s1));
    // Turn of the body against inertial space: Earth and transport rate at mid-step, and the way
    // its course has turned against north.
    const double s = sin(pm.lat), c = cos(pm.lat), ds = s1 - s0;
    const double n = prime_vertical_radius(ell, s);
    const Vec<Geographic> turn{-ds * cos(pm.course) / meridian_radius(ell, s),
                               ds * sin(pm.course) / n + ell.w_ie * dt * c,
                               ds * sin(pm.course) * s / (n * c) + ell.w_ie * dt * s -
                                   std::remainder(p1.course - p0.course, 2 * kPi)};
    Vec<Body> dtheta = to_matrix(conjugate(body(pm))) * turn + dt * errors.gyro_bias;
    if (errors.gyro_noise > 0) {
      const auto e = gyro.normals<3>(static_cast<std::uint64_t>(i));
      const double sigma = errors.gyro_noise * std::sqrt(dt);
      dtheta += Vec<Body>{sigma * e[0], sigma * e[1], sigma * e[2]};
    }
    step_attitude_reckoning(ell, state, dtheta, errors.k * ds, dt, 0.0);
    p0 = p1;
  }
  return {p0.lat, p0.lon, state.where.lat, state.where.lon};
}

}  // namespace loxo
