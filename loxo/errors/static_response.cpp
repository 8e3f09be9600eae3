// SPDX-License-Identifier: Apache-2.0
#include "loxo/errors/static_response.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "loxo/earth/gravity.hpp"
#include "loxo/earth/transverse.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

using V3 = std::array<double, 3>;

V3 cross3(const V3& a, const V3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Index into the basis.
enum { kOne, kT, kCosW, kSinW, kCos1, kSin1, kCos2, kSin2 };

// Principal axes of K and the two Schuler-Foucault modes of dr'' = 2k J dr' - gK dr, J = (0 1; -1
// 0).
struct Modes {
  double c = 1, s = 0;    // axis 1 = c E + s N, axis 2 = -s E + c N
  double a = 0, b = 0;    // g K on them, a >= b
  double k = 0;           // Foucault rate w sin(latitude)
  double o1 = 0, o2 = 0;  // o1 >= o2
  // Mode i: x1 = alpha cos(o t + phase), x2 = beta sin(o t + phase).
  double alpha1 = 1, beta1 = 0, alpha2 = 0, beta2 = 1;
};

Modes modes_of(const StaticSite& site) {
  Modes m;
  const double half_turn = 0.5 * std::atan2(2.0 * site.ken, site.kee - site.knn);
  m.c = std::cos(half_turn);
  m.s = std::sin(half_turn);
  const double mean = 0.5 * (site.kee + site.knn);
  const double half = 0.5 * std::hypot(site.kee - site.knn, 2.0 * site.ken);
  m.a = site.g * (mean + half);
  m.b = site.g * (mean - half);
  m.k = site.neglect_foucault ? 0.0 : site.w * site.u[2];
  const double k2 = m.k * m.k;
  // a - O^2 = (u -+ d)/2 without cancellation: the smaller of the two from their product -4 k^2 a.
  const double u = m.a - m.b - 4.0 * k2;
  const double d = std::sqrt(u * u + 16.0 * k2 * m.a);
  double lower, upper;  // a - o1^2 <= 0 (the faster mode) and a - o2^2 >= 0
  if (u >= 0.0) {
    upper = 0.5 * (u + d);
    lower = upper > 0.0 ? -4.0 * k2 * m.a / upper : 0.0;
  } else {
    lower = 0.5 * (u - d);
    upper = -4.0 * k2 * m.a / lower;
  }
  m.o1 = std::sqrt(m.a - lower);
  m.o2 = std::sqrt(m.a - upper);
  if (m.k == 0.0) return m;  // straight modes along the principal axes
  // beta/alpha = (a - O^2)/(2 k O); written so that neither divides by a vanishing number.
  m.beta1 = lower / (2.0 * m.k * m.o1);
  m.alpha2 = 2.0 * m.k * m.o2 / upper;
  return m;
}

void solve2(double a11, double a12, double a21, double a22, double f1, double f2, double& x1,
            double& x2) {
  const double det = a11 * a22 - a12 * a21;
  x1 = (f1 * a22 - f2 * a12) / det;
  x2 = (a11 * f2 - a21 * f1) / det;
}

StaticSite site_of(const Ellipsoid& ell, double s, double a1, double a2) {
  StaticSite site;
  site.w = ell.w_ie;
  site.g = normal_gravity(ell, s, 0.0);
  site.u[0] = a1;
  site.u[1] = a2;
  site.u[2] = s;
  const auto k = curvature(ell, a1, a2, s, 0.0);
  site.kee = k.xx;
  site.ken = k.xy;
  site.knn = k.yy;
  return site;
}

void refuse_pole(double lat, const std::string& frame) {
  constexpr double kLimit = 89.9999 * deg;
  if (std::fabs(lat) <= kLimit) return;
  throw Error(ErrorKind::kInput, "the " + frame + " frame has no axes at its pole: " + frame +
                                     " latitude within +-89.9999 deg expected, found " +
                                     std::to_string(lat / deg) +
                                     " deg; another reference meridian moves the pole");
}

std::array<double, 8> basis(const StaticResponse& r, double t) {
  return {1.0,
          t,
          std::cos(r.w * t),
          std::sin(r.w * t),
          std::cos(r.o1 * t),
          std::sin(r.o1 * t),
          std::cos(r.o2 * t),
          std::sin(r.o2 * t)};
}

}  // namespace

StaticSite transverse_site(const Ellipsoid& ell, double tlat, double tlon) {
  refuse_pole(tlat, "transverse");
  const double sp = std::sin(tlat), cp = std::cos(tlat), sl = std::sin(tlon), cl = std::cos(tlon);
  auto site = site_of(ell, cp * cl, -sl, -sp * cl);  // polar.md 2.2
  site.tan_e = sp / cp;
  site.cos_lat = cp;
  return site;
}

StaticSite geographic_site(const Ellipsoid& ell, double lat) {
  refuse_pole(lat, "geographic");
  auto site = site_of(ell, std::sin(lat), 0.0, std::cos(lat));
  site.tan_e = std::tan(lat);
  site.cos_lat = std::cos(lat);
  return site;
}

StaticSite grid_site(const Ellipsoid& ell, double tlat, double tlon) {
  refuse_pole(tlat, "transverse");
  const double sp = std::sin(tlat), cp = std::cos(tlat), sl = std::sin(tlon), cl = std::cos(tlon);
  auto site = site_of(ell, cp * cl, -sp * cl, sl);  // G_E = N_t, G_N = -E_t (polar.md 1.3)
  site.tan_n = -sp / cp;
  return site;
}

StaticSite wander_site(const Ellipsoid& ell, double lat, double azimuth) {
  const double c = std::cos(lat);
  return site_of(ell, std::sin(lat), -c * std::sin(azimuth), c * std::cos(azimuth));
}

// polar.md 5.2 on the sphere; the same steps with K in place of 1/R on the ellipsoid.
StaticResponse static_response(const StaticSite& site, const StaticInputs& in) {
  StaticResponse out;
  const Modes m = modes_of(site);
  out.w = site.w;
  out.o1 = m.o1;
  out.o2 = m.o2;

  // Position error in metres from the frame's angles: K dr = (cos_lat dlon, dlat).
  double east0, north0;
  const double turn_e = site.cos_lat * in.dlon0, turn_n = in.dlat0;
  solve2(site.kee, site.ken, site.ken, site.knn, turn_e, turn_n, east0, north0);
  // psi0 = Phi0 - Th dr0 (polar.md 4.3)
  const V3 psi0 = {in.phie0 + turn_n, in.phin0 - turn_e,
                   in.phiu0 - (site.tan_e * turn_e + site.tan_n * turn_n)};

  // psi(t) = A0 + B0 t + C0 cos wt + D0 sin wt: exact on any Earth.
  const V3 u = {site.u[0], site.u[1], site.u[2]};
  const V3 eps = {in.eps_e, in.eps_n, in.eps_u};
  const double u_psi = u[0] * psi0[0] + u[1] * psi0[1] + u[2] * psi0[2];
  const double u_eps = u[0] * eps[0] + u[1] * eps[1] + u[2] * eps[2];
  const V3 s_eps = cross3(u, eps), s_psi = cross3(u, psi0);
  double psi[3][8]{};
  for (std::size_t i = 0; i < 3; ++i) {
    psi[i][kOne] = u[i] * u_psi + s_eps[i] / site.w;
    psi[i][kT] = -u[i] * u_eps;
    psi[i][kCosW] = psi0[i] - u[i] * u_psi - s_eps[i] / site.w;
    psi[i][kSinW] = -s_psi[i] - (eps[i] - u[i] * u_eps) / site.w;
  }

  // dr'' = 2k J dr' - gK dr + F with F = g (-psi_N, psi_E) + nabla, in principal axes.
  double f[2][4];
  for (int j = 0; j < 4; ++j) {
    const double fe = -site.g * psi[1][j] + (j == kOne ? in.nabla_e : 0.0);
    const double fn = site.g * psi[0][j] + (j == kOne ? in.nabla_n : 0.0);
    f[0][j] = m.c * fe + m.s * fn;
    f[1][j] = -m.s * fe + m.c * fn;
  }
  double x[2][8]{};
  x[0][kT] = f[0][kT] / m.a;
  x[1][kT] = f[1][kT] / m.b;
  x[0][kOne] = (f[0][kOne] + 2.0 * m.k * x[1][kT]) / m.a;
  x[1][kOne] = (f[1][kOne] - 2.0 * m.k * x[0][kT]) / m.b;
  const double w2 = site.w * site.w, kw = 2.0 * m.k * site.w;
  solve2(m.a - w2, -kw, -kw, m.b - w2, f[0][kCosW], f[1][kSinW], x[0][kCosW], x[1][kSinW]);
  solve2(m.a - w2, kw, kw, m.b - w2, f[0][kSinW], f[1][kCosW], x[0][kSinW], x[1][kCosW]);

  // The two modes take up what the particular part leaves of the initial values.
  const double h1 = m.c * east0 + m.s * north0 - x[0][kOne] - x[0][kCosW];
  const double h2 = -m.s * east0 + m.c * north0 - x[1][kOne] - x[1][kCosW];
  const double v1 = m.c * in.dve0 + m.s * in.dvn0 - x[0][kT] - site.w * x[0][kSinW];
  const double v2 = -m.s * in.dve0 + m.c * in.dvn0 - x[1][kT] - site.w * x[1][kSinW];
  double c1, c2, s1, s2;  // amplitude times cos and sin of each mode's phase
  solve2(m.alpha1, m.alpha2, m.beta1 * m.o1, m.beta2 * m.o2, h1, v2, c1, c2);
  solve2(m.beta1, m.beta2, -m.alpha1 * m.o1, -m.alpha2 * m.o2, h2, v1, s1, s2);
  x[0][kCos1] = m.alpha1 * c1;
  x[0][kSin1] = -m.alpha1 * s1;
  x[1][kCos1] = m.beta1 * s1;
  x[1][kSin1] = m.beta1 * c1;
  x[0][kCos2] = m.alpha2 * c2;
  x[0][kSin2] = -m.alpha2 * s2;
  x[1][kCos2] = m.beta2 * s2;
  x[1][kSin2] = m.beta2 * c2;

  auto& q = out.coefficient;
  double east[8], north[8];
  for (std::size_t j = 0; j < 8; ++j) {
    east[j] = m.c * x[0][j] - m.s * x[1][j];
    north[j] = m.s * x[0][j] + m.c * x[1][j];
    out.metres[0][j] = north[j];
    out.metres[1][j] = east[j];
    const double re = site.kee * east[j] + site.ken * north[j];
    const double rn = site.ken * east[j] + site.knn * north[j];
    q[2][j] = psi[0][j] - rn;
    q[3][j] = psi[1][j] + re;
    q[4][j] = psi[2][j] + site.tan_e * re + site.tan_n * rn;
    q[5][j] = rn;
    q[6][j] = re / site.cos_lat;
  }
  const auto differentiate = [&](const double* p, std::array<double, 8>& v) {
    v[kOne] = p[kT];
    v[kCosW] = site.w * p[kSinW];
    v[kSinW] = -site.w * p[kCosW];
    v[kCos1] = m.o1 * p[kSin1];
    v[kSin1] = -m.o1 * p[kCos1];
    v[kCos2] = m.o2 * p[kSin2];
    v[kSin2] = -m.o2 * p[kCos2];
  };
  differentiate(east, q[0]);
  differentiate(north, q[1]);
  return out;
}

StaticState StaticResponse::at(double t) const {
  const auto b = basis(*this, t);
  StaticState x{};
  for (std::size_t i = 0; i < 7; ++i)
    for (std::size_t j = 0; j < 8; ++j) x[i] += coefficient[i][j] * b[j];
  return x;
}

std::array<double, 2> StaticResponse::position(double t) const {
  const auto b = basis(*this, t);
  std::array<double, 2> p{};
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t j = 0; j < 8; ++j) p[i] += metres[i][j] * b[j];
  return p;
}

StaticRoots static_roots(const StaticSite& site) {
  const Modes m = modes_of(site);
  return {site.w, m.o2, m.o1};
}

void static_series(std::span<const StaticResponse> responses, double t0, double dt, std::size_t n,
                   std::span<std::array<std::vector<double>, 7>> out) {
  if (responses.empty()) return;
  for (auto& source : out)
    for (auto& component : source) component.resize(n);
  // Blocks of 64 steps: the exact phasors of the block's start times those of the offsets, computed
  // once.
  constexpr std::size_t kBlock = 64;
  const StaticResponse& first = responses[0];
  const double rate[3] = {first.w, first.o1, first.o2};
  alignas(64) double offset_cos[3][kBlock], offset_sin[3][kBlock], b[8][kBlock], value[kBlock];
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t i = 0; i < kBlock; ++i) {
      offset_cos[r][i] = std::cos(rate[r] * dt * static_cast<double>(i));
      offset_sin[r][i] = std::sin(rate[r] * dt * static_cast<double>(i));
    }
  for (std::size_t start = 0; start < n; start += kBlock) {
    const double t = t0 + dt * static_cast<double>(start);
    for (std::size_t i = 0; i < kBlock; ++i) b[1][i] = t + dt * static_cast<double>(i);
    for (std::size_t r = 0; r < 3; ++r) {
      const double c = std::cos(rate[r] * t), s = std::sin(rate[r] * t);
      for (std::size_t i = 0; i < kBlock; ++i) {
        b[2 + 2 * r][i] = c * offset_cos[r][i] - s * offset_sin[r][i];
        b[3 + 2 * r][i] = s * offset_cos[r][i] + c * offset_sin[r][i];
      }
    }
    const std::size_t count = std::min(kBlock, n - start);
    for (std::size_t k = 0; k < responses.size(); ++k)
      for (std::size_t component = 0; component < 7; ++component) {
        const auto q = responses[k].coefficient[component];
        double* const __restrict to =
            count == kBlock ? out[k][component].data() + start : value;  // no copy but for the last
        for (std::size_t i = 0; i < kBlock; ++i)
          to[i] = ((q[0] + q[1] * b[1][i]) + (q[2] * b[2][i] + q[3] * b[3][i])) +
                  ((q[4] * b[4][i] + q[5] * b[5][i]) + (q[6] * b[6][i] + q[7] * b[7][i]));
        if (to == value)
          std::copy_n(value, count, out[k][component].begin() + static_cast<std::ptrdiff_t>(start));
      }
  }
}

std::array<double, 49> static_noise_covariance(const StaticSite& site, double qa, double qg,
                                               double t) {
  // An accelerometer (gyro) impulse acts as that initial velocity (minus that tilt).
  std::array<StaticResponse, 5> impulse;
  for (std::size_t i = 0; i < 5; ++i) {
    StaticInputs in;
    double* slot[5] = {&in.dve0, &in.dvn0, &in.phie0, &in.phin0, &in.phiu0};
    *slot[i] = i < 2 ? 1.0 : -1.0;
    impulse[i] = static_response(site, in);
  }
  // Eight points a panel of 250 s, a twentieth of a Schuler period: exact to rounding for these
  // sinusoids.
  static constexpr double kNode[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                      0.9602898564975363};
  static constexpr double kWeight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                        0.1012285362903763};
  std::array<double, 49> p{};
  const auto panels = static_cast<std::size_t>(std::ceil(std::max(t, 0.0) / 250.0));
  for (std::size_t k = 0; k < panels; ++k) {
    const double lo = t * static_cast<double>(k) / static_cast<double>(panels);
    const double hi = t * static_cast<double>(k + 1) / static_cast<double>(panels);
    for (int node = 0; node < 8; ++node) {
      const double at = (node < 4 ? -1.0 : 1.0) * kNode[node % 4];
      const double tau = 0.5 * (lo + hi) + 0.5 * (hi - lo) * at;
      const double weight = 0.5 * (hi - lo) * kWeight[node % 4];
      for (std::size_t i = 0; i < 5; ++i) {
        const auto h = impulse[i].at(tau);
        const double q = weight * (i < 2 ? qa : qg);
        for (std::size_t r = 0; r < 7; ++r)
          for (std::size_t c = 0; c < 7; ++c) p[7 * r + c] += q * h[r] * h[c];
      }
    }
  }
  return p;
}

}  // namespace loxo
