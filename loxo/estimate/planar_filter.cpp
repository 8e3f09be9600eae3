// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/planar_filter.hpp"

#include <Eigen/LU>
#include <cmath>

#include "loxo/earth/angle.hpp"

namespace loxo {
namespace {

constexpr double kWeighed = 9.21;   // chi-square of 2, 99 %: beyond it a fix counts less
constexpr double kLeftOut = 100.0;  // ten sigma
constexpr int kBelieved = 10;       // fixes in a row that say the same are right

struct Radii {
  double north, east;  // m per rad
};
Radii radii(const Ellipsoid& ell, double lat, double h) {
  const double s = std::sin(lat);
  return {meridian_radius(ell, s) + h, (prime_vertical_radius(ell, s) + h) * std::cos(lat)};
}

}  // namespace

void correct(const Ellipsoid& ell, PlanarState& s, double h, const PlanarVector& x) {
  const Radii r = radii(ell, s.at.lat, h);
  s.at = reckon_start(s.at.lat + x[kPlanarN] / r.north, s.at.lon + x[kPlanarE] / r.east);
  s.eps += x[kPlanarEps];
  s.ln_k += x[kPlanarK];
  s.drift += x[kPlanarDrift];
  s.right += x[kPlanarRight];
  s.forward += x[kPlanarForward];
}

PlanarVector difference(const Ellipsoid& ell, const PlanarState& a, const PlanarState& b,
                        double h) {
  const Radii r = radii(ell, b.at.lat, h);
  PlanarVector x;
  x << (a.at.lat - b.at.lat) * r.north, wrap_pi(a.at.lon - b.at.lon) * r.east, a.eps - b.eps,
      a.ln_k - b.ln_k, a.drift - b.drift, a.right - b.right, a.forward - b.forward;
  return x;
}

PlanarMatrix PlanarFilter::predict(double ds, double heading, double h, double dt, double share) {
  PlanarState& s = state_;
  const double d = ds * std::exp(-s.ln_k);
  double sc, cc;
  sincos(heading - s.eps, sc, cc);
  step_by(config_.ellipsoid, Integrator::kExact, s.at, d * cc, d * sc, h);
  PlanarMatrix F = PlanarMatrix::Identity();
  // (V-39): course = heading - eps, distance = recorded / k.
  F(kPlanarN, kPlanarEps) = d * sc;
  F(kPlanarE, kPlanarEps) = -d * cc;
  F(kPlanarN, kPlanarK) = -d * cc;
  F(kPlanarE, kPlanarK) = -d * sc;
  F(kPlanarEps, kPlanarDrift) = dt;
  s.eps += s.drift * dt;
  s.t += dt;
  PlanarMatrix P = F * s.P * F.transpose();
  // White errors of the whole step, of which this is a part.
  const double whole = share > 0 ? d / share : 0;
  const double along = share * (config_.scale_noise * config_.scale_noise * whole * whole +
                                config_.quantisation * config_.quantisation);
  const double across = share * config_.side_slip * config_.side_slip * whole * whole;
  P(kPlanarN, kPlanarN) += along * cc * cc + across * sc * sc;
  P(kPlanarE, kPlanarE) += along * sc * sc + across * cc * cc;
  P(kPlanarN, kPlanarE) += (along - across) * sc * cc;
  P(kPlanarE, kPlanarN) += (along - across) * sc * cc;
  P(kPlanarEps, kPlanarEps) += config_.heading_noise * config_.heading_noise * dt;
  s.P = 0.5 * (P + P.transpose());
  return F;
}

bool PlanarFilter::fix(double lat, double lon, double std_e, double std_n, double heading,
                       double h) {
  PlanarState& s = state_;
  double st, ct;
  sincos(heading - s.eps, st, ct);
  const Radii r = radii(config_.ellipsoid, s.at.lat, h);
  const Eigen::Vector2d y((lat - s.at.lat) * r.north - (s.forward * ct - s.right * st),
                          wrap_pi(lon - s.at.lon) * r.east - (s.forward * st + s.right * ct));
  Eigen::Matrix<double, 2, kPlanarStates> H = Eigen::Matrix<double, 2, kPlanarStates>::Zero();
  H(0, kPlanarN) = H(1, kPlanarE) = 1;
  H(0, kPlanarEps) = s.forward * st + s.right * ct;
  H(1, kPlanarEps) = -(s.forward * ct - s.right * st);
  H(0, kPlanarRight) = -st, H(1, kPlanarRight) = ct;
  H(0, kPlanarForward) = ct, H(1, kPlanarForward) = st;
  Eigen::Matrix2d R = Eigen::Vector2d(std_n * std_n, std_e * std_e).asDiagonal();
  Eigen::Matrix2d S = H * s.P * H.transpose() + R;
  const double nis = y.dot(S.inverse() * y);
  count_.nis_sum += 0.5 * nis;  // per component, as the other sensors count
  if (nis > 5.991) ++count_.above_95;
  if (config_.gate && nis > kLeftOut && left_out_ < kBelieved) {
    ++left_out_;
    ++count_.rejected;
    return false;
  }
  if (left_out_ >= kBelieved && nis > kLeftOut) {
    // The track itself was wrong: what they all say is let in.
    s.P.topLeftCorner<2, 2>() += Eigen::Matrix2d::Identity() * y.squaredNorm();
    S = H * s.P * H.transpose() + R;
    ++count_.used;
  } else if (nis > kWeighed) {
    R *= nis / kWeighed;
    S = H * s.P * H.transpose() + R;
    ++count_.deweighted;
  } else {
    ++count_.used;
  }
  left_out_ = 0;
  const Eigen::Matrix<double, kPlanarStates, 2> K = s.P * H.transpose() * S.inverse();
  const PlanarMatrix J = PlanarMatrix::Identity() - K * H;
  const PlanarMatrix P = J * s.P * J.transpose() + K * R * K.transpose();
  s.P = 0.5 * (P + P.transpose());
  correct(config_.ellipsoid, s, h, K * y);
  return true;
}

}  // namespace loxo
