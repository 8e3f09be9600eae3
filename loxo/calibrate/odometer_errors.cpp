// SPDX-License-Identifier: Apache-2.0
#include "loxo/calibrate/odometer_errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "loxo/earth/projection.hpp"
#include "loxo/earth/rhumb.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {

PlaneError gauss_position_error(const Ellipsoid& ell, double lat, double dlon, double dlat,
                                double dlongitude) {
  const double s = std::sin(lat), c = std::cos(lat), l2 = dlon * dlon;
  const double n = prime_vertical_radius(ell, s), m = meridian_radius(ell, s);
  return {(m + 0.5 * n * std::cos(2 * lat) * l2) * dlat + n * s * c * dlon * dlongitude,  // (V-30)
          -n * s * dlon * (1 + l2 * (6 * c * c - 1) / 6) * dlat +
              n * c * (1 + 0.5 * l2 * std::cos(2 * lat)) * dlongitude};  // (V-31)
}

ConstantsError chord_error(double north, double east, const PlaneError& e) {
  const double s2 = north * north + east * east;
  return {-(north * e.dx + east * e.dy) / s2,  // (V-28) / K_D
          (east * e.dx - north * e.dy) / s2};  // (V-29)
}
double odometer_scale_error(double k0, double surveyed, double north, double east,
                            const PlaneError& e) {
  const double s2 = std::hypot(north, east);
  return -k0 * surveyed / (s2 * s2 * s2) * (north * e.dx + east * e.dy);  // (V-28)
}

ReckoningMatrix reckoning_error_matrix(double radius, double earth_rate, double lat, double ve,
                                       double vn) {
  const double s = std::sin(lat), c = std::cos(lat), t = s / c, w = earth_rate, R = radius;
  enum { E, N, U, L, G };
  ReckoningMatrix f{};
  // The vehicle knows its speed but not its course: dvE = phiU vN, dvN = -phiU vE. These stand in
  // the transport rate too, and take its part out of the columns of phiU.
  f[E][N] = w * s + ve * t / R;  // (V-32)
  f[E][U] = -w * c;
  f[N][E] = -(w * s + ve * t / R);  // (V-33)
  f[N][L] = -w * s;
  f[U][E] = w * c + ve / R;  // (V-34)
  f[U][N] = vn / R;
  f[U][U] = vn * t / R;
  f[U][L] = w * c + ve / (c * c * R);
  f[L][U] = -ve / R;       // (V-35)
  f[G][U] = vn / (c * R);  // (V-36)
  f[G][L] = ve * t / (c * R);
  return f;
}

double CalibrationDrive::duration() const {
  if (acceleration <= 0) return length / speed;
  const double ramp = std::min(speed / acceleration, std::sqrt(length / acceleration));
  return 2 * ramp + (length - acceleration * ramp * ramp) / (acceleration * ramp);
}
double CalibrationDrive::velocity(double t) const {
  const double end = duration();
  if (t < 0 || t > end) return 0;
  if (acceleration <= 0) return speed;
  return std::min({acceleration * t, speed, std::sqrt(length / acceleration) * acceleration,
                   acceleration * (end - t)});
}

std::array<double, 5> propagate_reckoning_errors(const CalibrationDrive& drive, double radius,
                                                 double earth_rate,
                                                 const std::array<double, 3>& gyro,
                                                 const std::array<double, 3>& phi0) {
  using X = std::array<double, 5>;
  const double end = drive.duration();
  const int steps = std::max(200, static_cast<int>(std::ceil(end / 5.0)));
  const double dt = end / steps, sc = std::sin(drive.course), cc = std::cos(drive.course);
  X x{phi0[0], phi0[1], phi0[2], 0, 0};
  double lat = drive.lat;
  const auto rate = [&](double t, double at, const X& y) {
    const double v = drive.velocity(t);
    const auto f = reckoning_error_matrix(radius, earth_rate, at, v * sc, v * cc);
    X r{};
    for (std::size_t i = 0; i < 5; ++i) {
      for (std::size_t j = 0; j < 5; ++j) r[i] += f[i][j] * y[j];
      if (i < 3) r[i] -= gyro[i];
    }
    return r;
  };
  const auto moved = [](const X& a, double k, const X& b) {
    X r{};
    for (std::size_t i = 0; i < 5; ++i) r[i] = a[i] + k * b[i];
    return r;
  };
  for (int i = 0; i < steps; ++i) {
    const double t = dt * i, v = drive.velocity(t + 0.5 * dt) * cc / radius;
    const double mid = lat + 0.5 * dt * v, next = lat + dt * v;
    const X k1 = rate(t, lat, x), k2 = rate(t + 0.5 * dt, mid, moved(x, 0.5 * dt, k1)),
            k3 = rate(t + 0.5 * dt, mid, moved(x, 0.5 * dt, k2)),
            k4 = rate(t + dt, next, moved(x, dt, k3));
    for (std::size_t j = 0; j < 5; ++j) x[j] += dt / 6.0 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]);
    lat = next;
  }
  return x;
}

StraightDriveError straight_drive_error(double radius, double lat, double ve, double vn,
                                        double phi_u0, double gyro_up, double t) {
  const double a = 0.5 * gyro_up * t * t - phi_u0 * t;
  StraightDriveError r;
  r.dlat = ve / radius * a;  // (V-37)
  r.dlon = -vn / (std::cos(lat) * radius) * a;
  r.constants = {0.0, a / t};  // (V-38)
  return r;
}

TrackErrorRates track_error_rates(const Ellipsoid& ell, double lat, double heading, double dm,
                                  double dpsi, double dlnk) {
  const double s = std::sin(heading), c = std::cos(heading), w = isometric_rate(ell, lat);
  return {-s * dpsi + c * dlnk,  // (V-41)
          w * (c * dpsi + s * dlnk) + s * (std::sin(lat) * w * w) * dm};
}

namespace {

struct Weighted {
  double mean = 0;    // (1/D) INT t v dt [s]
  double square = 0;  // INT (1 - s/D)^2 dt [s]
};
Weighted weights(const CalibrationDrive& d) {
  const double end = d.duration();
  const int n = 2000;
  const double h = end / n;
  Weighted w;
  double s = 0;
  for (int i = 0; i < n; ++i) {
    const double t = h * (i + 0.5), v = d.velocity(t);
    const double share = 1 - (s + 0.5 * h * v) / d.length;
    s += h * v;
    w.mean += h * t * v / d.length;
    w.square += h * share * share;
  }
  return w;
}

OdometerBudget sources_of(const Ellipsoid& ell, const CalibrationDrive& drive,
                          const OdometerSources& in, HeadingModel model) {
  OdometerBudget b;
  b.duration = drive.duration();
  const double D = drive.length, sc = std::sin(drive.course), cc = std::cos(drive.course);
  const auto put = [&](const char* name, const char* words, double ln_k, double eps) {
    b.sources.push_back({name, words, std::fabs(ln_k), std::fabs(eps)});
  };
  const Weighted w = weights(drive);
  if (model == HeadingModel::kMechanised) {
    // The chain itself, one unit source at a time: (V-32) to (V-36), (V-30), (V-31), (V-28),
    // (V-29).
    const double radius = prime_vertical_radius(ell, std::sin(drive.lat));
    // The plane of the drive's own meridian, its radii those of the sphere of the equations, and
    // the chord as that plane shows it: with the course instead, its convergence (V-38 knows none)
    // would pass for an error of scale.
    const Ellipsoid sphere = make_sphere(radius);
    auto place = reckon_start(drive.lat, 0.0);
    step_exact(sphere, place, D * cc, D * sc, 0.0);
    const auto from = gauss_forward(sphere, drive.lat, 0.0, 0.0, 0.0);
    const auto to = gauss_forward(sphere, place.lat, place.lon, 0.0, 0.0);
    const auto both = [&](const std::array<double, 3>& gyro, const std::array<double, 3>& phi) {
      const auto x = propagate_reckoning_errors(drive, radius, ell.w_ie, gyro, phi);
      return chord_error(to.x - from.x, to.y - from.y,
                         gauss_position_error(sphere, place.lat, place.lon, x[3], x[4]));
    };
    const auto u = both({0, 0, 0}, {0, 0, in.heading});
    put("heading_alignment", "heading of the alignment", u.dk, u.dalpha);
    const auto e = both({0, 0, 0}, {in.level, 0, 0}), n = both({0, 0, 0}, {0, in.level, 0});
    put("level_alignment", "levelling of the alignment", std::hypot(e.dk, n.dk),
        std::hypot(e.dalpha, n.dalpha));
    const auto gr = both({in.gyro_bias * cc, -in.gyro_bias * sc, 0}, {0, 0, 0});
    const auto gf = both({in.gyro_bias * sc, in.gyro_bias * cc, 0}, {0, 0, 0});
    put("gyro_level", "drift of the level gyros", std::hypot(gr.dk, gf.dk),
        std::hypot(gr.dalpha, gf.dalpha));
    const auto gu = both({0, 0, in.gyro_bias}, {0, 0, 0});
    put("gyro_up", "drift of the azimuth gyro", gu.dk, gu.dalpha);
  } else {
    // (V-41): the heading's error acts through the metre of way it is made on.
    const auto constants = [&](double psi0, double drift) {
      const int steps = 400;
      const double end = b.duration, h = end / steps;
      double dm = 0, dlon = 0, m = meridian_arc(ell, drive.lat);
      for (int i = 0; i < steps; ++i) {
        const double t = h * (i + 0.5), ds = h * drive.velocity(t);
        const double lat = latitude_of_arc(ell, m + 0.5 * ds * cc);
        const double dpsi = psi0 + drift * t;
        const double half =
            dm + 0.5 * ds * track_error_rates(ell, lat, drive.course, dm, dpsi, 0).dm;
        const auto r = track_error_rates(ell, lat, drive.course, half, dpsi, 0);
        dm += ds * r.dm;
        dlon += ds * r.dlon;
        m += ds * cc;
      }
      // The rhumb chord (V-17): east = dlon/D, and D itself moves with the end's latitude.
      const double lat = latitude_of_arc(ell, m), north = D * cc, east = D * sc;
      const double rate = isometric_divided_difference(ell, drive.lat, lat);
      const double w_end = isometric_rate(ell, lat);
      const double slope =
          std::fabs(north) > 1 ? (w_end - rate) / north : 0.5 * std::sin(lat) * w_end * w_end;
      return chord_error(north, east, {dm, (dlon - east * slope * dm) / rate});
    };
    const auto u = constants(in.heading, 0), g = constants(0, in.gyro_bias);
    put("heading_alignment", "heading of the alignment", u.dk, u.dalpha);
    put("heading_drift", "drift of the heading", g.dk, g.dalpha);
  }
  // (V-45) with the drive's own speed: N^2 INT (1 - s/D)^2 dt, which is N^2 T/3 at constant speed.
  put("gyro_noise", "angle random walk", 0, in.gyro_noise * std::sqrt(w.square));
  const double point = std::sqrt(2.0) * in.benchmark / D;  // (V-44), (V-45)
  put("benchmarks", "surveyed points", point, point);
  put("quantisation", "quantisation of the odometer", in.quantisation / (std::sqrt(6.0) * D), 0);
  const double root = std::sqrt(in.step / D);
  put("scale_noise", "noise of the odometer's scale", in.scale_noise * root, 0);
  put("side_slip", "side slip", 0, in.side_slip * root);
  double k2 = 0, e2 = 0;
  for (std::size_t i = 0; i < b.sources.size(); ++i) {
    const auto& s = b.sources[i];
    k2 += s.ln_k * s.ln_k;
    e2 += s.eps * s.eps;
    if (s.ln_k > b.sources[b.leading_ln_k].ln_k) b.leading_ln_k = i;
    if (s.eps > b.sources[b.leading_eps].eps) b.leading_eps = i;
  }
  b.ln_k = std::sqrt(k2);
  b.eps = std::sqrt(e2);
  return b;
}

}  // namespace

OdometerBudget odometer_budget(const Ellipsoid& ell, const CalibrationDrive& drive,
                               const OdometerSources& sources, HeadingModel model) {
  const auto refuse = [](const std::string& what) {
    throw Error(ErrorKind::kInput, what, "drive");
  };
  if (!(drive.length > 0 && drive.speed > 0 && drive.acceleration >= 0) ||
      !std::isfinite(drive.length + drive.speed + drive.acceleration))
    refuse("a positive length and speed and an acceleration of at least 0 expected");
  if (!(std::fabs(drive.lat) + drive.length / ell.b <= 89.9 * deg))
    refuse("true headings mean nothing at a pole: a drive within 89.9 deg of latitude expected");
  const std::pair<const char*, double> all[] = {
      {"heading", sources.heading},         {"level", sources.level},
      {"gyro bias", sources.gyro_bias},     {"gyro noise", sources.gyro_noise},
      {"benchmark", sources.benchmark},     {"quantisation", sources.quantisation},
      {"scale noise", sources.scale_noise}, {"side slip", sources.side_slip}};
  for (const auto& [name, value] : all)
    if (!(value >= 0 && std::isfinite(value)))
      refuse(fmt::format("{}: a finite sigma of at least 0 expected, found {:g}", name, value));
  if (!(sources.step > 0)) refuse("a positive step of the odometer expected");

  OdometerBudget b = sources_of(ell, drive, sources, model);
  const auto consider = [&](std::string change, const CalibrationDrive& d,
                            const OdometerSources& s) {
    const auto other = sources_of(ell, d, s, model);
    b.improvements.push_back({std::move(change), other.ln_k, other.eps});
  };
  const std::pair<const char*, double OdometerSources::*> halves[] = {
      {"heading of the alignment twice as good", &OdometerSources::heading},
      {"levelling twice as good", &OdometerSources::level},
      {"gyro drift halved", &OdometerSources::gyro_bias},
      {"gyro noise halved", &OdometerSources::gyro_noise},
      {"benchmarks twice as good", &OdometerSources::benchmark},
      {"odometer resolution halved", &OdometerSources::quantisation},
      {"scale noise halved", &OdometerSources::scale_noise},
      {"side slip halved", &OdometerSources::side_slip}};
  for (const auto& [change, member] : halves) {
    if (sources.*member == 0) continue;
    OdometerSources s = sources;
    s.*member *= 0.5;
    consider(change, drive, s);
  }
  CalibrationDrive other = drive;
  other.length *= 2;
  if (std::fabs(other.lat) + other.length / ell.b <= 89.9 * deg)
    consider("drive twice as long", other, sources);
  other = drive;
  other.length *= 0.5;
  consider("drive half as long", other, sources);
  other = drive;
  other.speed *= 2;
  consider("driven twice as fast", other, sources);
  std::stable_sort(b.improvements.begin(), b.improvements.end(),
                   [](const Improvement& a, const Improvement& c) { return a.eps < c.eps; });
  for (std::size_t i = 0; i < b.improvements.size(); ++i)
    if (b.improvements[i].ln_k < b.improvements[b.best_ln_k].ln_k) b.best_ln_k = i;
  return b;
}

}  // namespace loxo
