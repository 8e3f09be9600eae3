// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/acceptance_drive.hpp"

#include <algorithm>
#include <cmath>

#include "loxo/estimate/exact_route.hpp"
#include "loxo/estimate/segmented.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr double kDt = 0.01;
using Turns = std::vector<std::pair<double, double>>;  // s, deg

Turns turns_of(const std::string& name) {
  if (name == "straight") return {};
  if (name == "mixed")
    return {{60, 40},   {150, -70},  {300, 90},    {480, -60}, {700, -50},
            {900, 80},  {1200, 30},  {1500, -100}, {1800, 60}, {2100, -40},
            {2400, 90}, {2700, -60}, {3000, -30},  {3300, 45}};
  if (name == "closed") {
    Turns t;
    for (int i = 1; i < 12; ++i) t.emplace_back(300.0 * i, 90.0);
    return t;
  }
  throw Error(ErrorKind::kUsage, "straight, mixed or closed expected, found '" + name + "'",
              "route");
}

}  // namespace

struct AcceptanceRoute::Impl {
  Ellipsoid ell;
  AcceptanceSensors s;
  ExactRoute route;
};

AcceptanceRoute::AcceptanceRoute(const Ellipsoid& ell, const std::string& name, double duration,
                                 const AcceptanceSensors& sensors)
    : impl_(std::make_unique<Impl>()) {
  const Turns turns = turns_of(name);
  impl_->ell = ell;
  impl_->s = sensors;
  // From rest by 1 m/s^2 to 20 m/s, turns at 6 deg/s.
  impl_->route = make_exact_route(
      ell, Geodetic<double>{40 * deg, 20 * deg, 0},
      [&](double t) {
        double c = 30 * deg;
        for (const auto& [start, angle] : turns)
          c += angle * deg * std::clamp((t - start) * 6.0 / std::fabs(angle), 0.0, 1.0);
        return c;
      },
      [](double t) { return std::min(20.0, t); }, duration, kDt,
      sensors.drawn_mounting_sign * sensors.mounting);
}
AcceptanceRoute::~AcceptanceRoute() = default;

AcceptanceRun AcceptanceRoute::run(std::uint64_t seed, std::uint64_t number) const {
  const auto& s = impl_->s;
  const auto& route = impl_->route;
  const Ellipsoid& ell = impl_->ell;
  const Stream<double> constants{seed, number, 1}, imu_noise{seed, number, 2},
      second_noise{seed, number, 3};
  const auto g = constants.normals<10>(0);
  const Vec<Body> bg{s.gyro_bias * g[0], s.gyro_bias * g[1], s.gyro_bias * g[2]},
      ba{s.accel_bias * g[3], s.accel_bias * g[4], s.accel_bias * g[5]};
  SegmentedConfig c;
  c.ellipsoid = ell;
  c.gyro_bias = s.gyro_bias, c.gyro_noise = s.gyro_noise;
  c.accel_bias = s.accel_bias, c.accel_noise = s.accel_noise;
  c.level_std = s.level, c.heading_std = s.heading;
  c.quantisation = s.quantisation;
  SegmentedStart start;
  start.place = route.place[0];
  const Rot<Geographic, Body> C0 =
      geographic_axes(start.place.lat, start.place.lon) * to_matrix(route.q[0]);
  // The alignment's errors from their causes (6.1).
  const Vec<Geographic> gn = C0 * bg, an = C0 * ba;
  const double gamma = normal_gravity(ell, std::sin(start.place.lat), 0.0),
               wn = ell.w_ie * std::cos(start.place.lat), wu = ell.w_ie * std::sin(start.place.lat);
  const double phi_n = an.x / gamma + s.level * g[6], phi_e = -an.y / gamma + s.level * g[7];
  const double phi_u = (-gn.x + wu * phi_n) / wn + s.heading * g[8];
  start.C_nb =
      to_matrix(exp_rotation<Geographic, Geographic>(Vec<Geographic>{-phi_e, -phi_n, -phi_u})) * C0;
  SegmentedNavigator nav(c, start);

  AcceptanceRun out;
  out.azimuth = phi_u;
  double slip = 0, white = 0, slow = s.slow_scale * g[9], indicated = 0, pulses = 0, last = 0;
  const double walk = s.slow_scale * std::sqrt(1 - std::exp(-2.0 / s.slow_time)),
               decay = std::exp(-1.0 / s.slow_time);
  const double nw = s.gyro_noise * std::sqrt(kDt), nf = s.accel_noise * std::sqrt(kDt);
  double cs = 1, ss = 0;
  const std::size_t n = route.dtheta.size() - 1;
  for (std::size_t i = 1; i <= n; ++i) {
    double jump = 0;
    if ((i - 1) % 100 == 0) {  // a new second
      const auto z = second_noise.normals<3>(i / 100);
      jump = s.slip * z[0] - slip;
      slip = s.slip * z[0];
      sincos(slip, ss, cs);
      white = s.scale_noise * z[1];
      slow = decay * slow + walk * z[2];
    }
    // Side slip: the body stands turned clockwise against the way by `slip`.
    const auto turned = [&](const Vec<Body>& v) {
      return Vec<Body>{cs * v.x - ss * v.y, ss * v.x + cs * v.y, v.z};
    };
    const auto z = imu_noise.normals<6>(i);
    ImuIncrement<double> u;
    u.t = static_cast<double>(i) * kDt, u.dt = kDt;
    u.dtheta =
        turned(route.dtheta[i]) + bg * kDt + Vec<Body>{nw * z[0], nw * z[1], nw * z[2] - jump};
    u.dv = turned(route.dv[i]) + ba * kDt + Vec<Body>{nf * z[3], nf * z[4], nf * z[5]};
    nav.imu(u);
    indicated += (1 + s.scale) * (1 + white + slow) * (route.distance[i] - last);
    last = route.distance[i];
    if (i % 10 != 0) continue;
    const double count = std::floor(indicated / s.quantisation) * s.quantisation,
                 ds = count - pulses;
    pulses = count;
    if (!nav.odometer({u.t, ds, false})) continue;
    const SegmentedEpoch& e = nav.epoch();
    const long second = std::lround(e.t);
    const double found = 1 - std::fabs(e.k - 1 - s.scale) / s.scale;
    if (second <= 180 && second % 5 == 0) out.scale.push_back(e.k - 1);
    if (second == 60) out.found_scale_60 = found;
    if (second == 120) {
      out.found_scale = found;
      out.mounting_error = e.mu - s.mounting;
      out.found_mounting = 1 - std::fabs(out.mounting_error) / s.mounting;
    }
    if (e.switched) out.switch_t = e.t, out.forced = e.forced;
    if (second < 120 || second % 60 != 0) continue;
    const Geodetic<double>& truth = route.place[i];
    const double sl = std::sin(truth.lat);
    const double N = prime_vertical_radius(ell, sl) * std::cos(truth.lat),
                 M = meridian_radius(ell, sl);
    const auto error = [&](const Horizontal& h) {
      return std::hypot((h.lon - truth.lon) * N, (h.lat - truth.lat) * M) / route.distance[i] * 100;
    };
    out.errors.weighted.push_back(error(e.weighted));
    out.errors.naive.push_back(error(e.naive));
    out.errors.intersection.push_back(error(e.intersection));
    out.errors.ins.push_back(error(e.ins));
    out.errors.reckoned.push_back(error(e.reckoned));
    out.errors.joint.push_back(error(e.joint));
  }
  return out;
}

}  // namespace loxo
