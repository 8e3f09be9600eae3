// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/transfer_voyage.hpp"

#include "loxo/earth/transverse.hpp"
#include "loxo/num/functions.hpp"

namespace loxo {
namespace {
double step_at(double t, double start, double width) {
  return 0.5 * (1 + tanh((t - start) / width));
}
}  // namespace

double VoyageWave::at(double t) const { return amplitude * sin(2 * kPi * t / period + phase); }

std::vector<VoyageLeg> TransferVoyage::standard_legs() {
  return {{0, 20 * deg, 6},       {5400, 75 * deg, 7.5}, {10800, 140 * deg, 7.5},
          {14400, 140 * deg, 5},  {18000, 230 * deg, 7}, {25200, 310 * deg, 8},
          {32400, 30 * deg, 6.5}, {37800, 190 * deg, 4}};
}

double TransferVoyage::course(double t) const {
  double c = legs[0].course;
  for (std::size_t i = 1; i < legs.size(); ++i) {
    const double turn = wrap_pi(legs[i].course - legs[i - 1].course);
    c += turn * step_at(t, legs[i].start, max(fabs(turn) / (1.6 * deg), 20.0));
  }
  return c;
}

double TransferVoyage::speed(double t) const {
  double v = legs[0].speed;
  for (std::size_t i = 1; i < legs.size(); ++i)
    v += (legs[i].speed - legs[i - 1].speed) * step_at(t, legs[i].start, 60.0);
  return v;
}

std::vector<VoyagePoint> sail(const Ellipsoid& earth, const TransferVoyage& voyage, double step,
                              bool level) {
  std::vector<VoyagePoint> points;
  double lat = voyage.lat, lon = voyage.lon;
  for (double t = 0; t <= voyage.end; t += step) {
    const double sigma = transverse_convergence(lat, lon, voyage.lon0);
    const auto tr = to_transverse(lat, lon, voyage.lon0);
    const double c = voyage.course(t), v = voyage.speed(t);
    TransferPoint p;
    p.tlat = tr.tlat;
    p.tlon = tr.tlon;
    p.angle = voyage.angle;
    p.ve = v * sin(c - sigma);
    p.vn = v * cos(c - sigma);
    p.heading = c - sigma + voyage.yaw[0].at(t) + voyage.yaw[1].at(t);
    if (!level) {
      p.pitch = voyage.pitch[0].at(t) + voyage.pitch[1].at(t) + voyage.mean_pitch;
      p.roll = voyage.roll[0].at(t) + voyage.roll[1].at(t) + voyage.mean_roll;
    }
    set_gravity(earth, p);
    points.push_back({t, lat, lon, p});
    // The midpoint rule: the track itself matters to metres only.
    const double cm = voyage.course(t + step / 2), vm = voyage.speed(t + step / 2);
    const double mid = lat + vm * cos(cm) * step / 2 / meridian_radius(earth, sin(lat));
    lat += vm * cos(cm) * step / meridian_radius(earth, sin(mid));
    lon += vm * sin(cm) * step / (prime_vertical_radius(earth, sin(mid)) * cos(mid));
  }
  return points;
}

ReferenceError voyage_reference_error(const Ellipsoid& earth, const TransferVoyage& voyage,
                                      const VoyagePoint& at, bool position) {
  ReferenceError e;
  e.pitch = e.roll = 1 * arcmin;
  e.heading = 3 * arcmin;
  e.ve = 0.1;
  e.vn = -0.1;
  if (!position) return e;
  const double s = sin(at.lat);
  TransferPoint q = at.p;
  const auto tr =
      to_transverse(at.lat + 5.0 / meridian_radius(earth, s),
                    at.lon + 5.0 / (prime_vertical_radius(earth, s) * cos(at.lat)), voyage.lon0);
  q.tlat = tr.tlat;
  q.tlon = tr.tlon;
  set_gravity(earth, q);
  e.tlat = q.tlat - at.p.tlat;
  e.tlon = q.tlon - at.p.tlon;
  e.g = q.g - at.p.g;
  e.gm = q.gm - at.p.gm;
  return e;
}

}  // namespace loxo
