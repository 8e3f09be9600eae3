// SPDX-License-Identifier: Apache-2.0
#include "loxo/errors/static_response.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "refusal.hpp"
#include "shared_folder.hpp"

namespace loxo {
namespace {

using Matrix = std::array<std::array<long double, 8>, 8>;

Matrix multiply(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 8; ++k)
      for (int j = 0; j < 8; ++j) c[i][j] += a[i][k] * b[k][j];
  return c;
}

// exp(F t) in extended precision by scaling and squaring of a Taylor series: shares nothing with
// the closed form.
Matrix exponential(Matrix f, long double t) {
  int squarings = 0;
  long double scale = t;
  while (scale > 0.25L) {
    scale /= 2;
    ++squarings;
  }
  for (auto& row : f)
    for (auto& x : row) x *= scale;
  Matrix sum{}, term{};
  for (int i = 0; i < 8; ++i) sum[i][i] = term[i][i] = 1;
  for (int n = 1; n < 30; ++n) {
    term = multiply(term, f);
    for (auto& row : term)
      for (auto& x : row) x /= n;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) sum[i][j] += term[i][j];
  }
  for (int i = 0; i < squarings; ++i) sum = multiply(sum, sum);
  return sum;
}

// The linear error equations at rest, polar.md 4.2, in units of hours-free SI; the eighth state is
// the constant 1.
Matrix equations(const StaticSite& s, const StaticInputs& in, double cos_lat) {
  Matrix f{};
  const long double w2k = s.neglect_foucault ? 0.0L : 2.0L * s.w * s.u[2];
  const long double kee = s.kee, ken = s.ken, knn = s.knn, w = s.w;
  enum { VE, VN, PE, PN, PU, LAT, LON, ONE };
  f[VE][VN] = w2k;
  f[VN][VE] = -w2k;
  f[VE][PN] = -s.g;
  f[VN][PE] = s.g;
  f[VE][ONE] = in.nabla_e;
  f[VN][ONE] = in.nabla_n;
  f[LAT][VE] = ken;
  f[LAT][VN] = knn;
  f[LON][VE] = kee / cos_lat;
  f[LON][VN] = ken / cos_lat;
  // Phi' = dw_et + dw_ie - w_ie x Phi - eps, with dth = (-dlat, cos dlon, tan_e cos dlon + tan_n
  // dlat), dw_ie = w u x dth (the computed frame is turned by dth).
  const long double th[3][2] = {
      {-1, 0}, {0, cos_lat}, {s.tan_n, s.tan_e * cos_lat}};  // by LAT, LON
  const int phi[3] = {PE, PN, PU};
  for (int i = 0; i < 3; ++i) {
    f[phi[i]][VE] = th[i][0] * f[LAT][VE] + th[i][1] * f[LON][VE];
    f[phi[i]][VN] = th[i][0] * f[LAT][VN] + th[i][1] * f[LON][VN];
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    // -(w u x Phi)_i = -(u_j Phi_k - u_k Phi_j) w; dw_ie = +(u x dth) w
    f[phi[i]][phi[k]] -= w * s.u[j];
    f[phi[i]][phi[j]] += w * s.u[k];
    for (int c = 0; c < 2; ++c) f[phi[i]][LAT + c] += w * (s.u[j] * th[k][c] - s.u[k] * th[j][c]);
  }
  f[PE][ONE] = -in.eps_e;
  f[PN][ONE] = -in.eps_n;
  f[PU][ONE] = -in.eps_u;
  return f;
}

double* input(StaticInputs& in, int i) {
  double* all[12] = {&in.dve0,  &in.dvn0,    &in.phie0,   &in.phin0, &in.phiu0, &in.dlat0,
                     &in.dlon0, &in.nabla_e, &in.nabla_n, &in.eps_e, &in.eps_n, &in.eps_u};
  return all[i];
}
constexpr double kSize[12] = {0.01,   0.01,   1.5e-4, 1.5e-4, 1.5e-4, 1.6e-6,
                              1.6e-6, 9.8e-5, 9.8e-5, 4.8e-9, 4.8e-9, 4.8e-9};

// polar.md 5.2: 1e-12 of each component's 24 h envelope, against the matrix exponential, every
// input, every site.
TEST(StaticResponse, AgreesWithTheMatrixExponentialOnSphereAndEllipsoidInEveryFrame) {
  std::vector<StaticSite> sites;
  for (const Ellipsoid* ell : {&paper_sphere(), &wgs84()}) {
    sites.push_back(transverse_site(*ell, 0.0707 * deg, 0.0707 * deg));
    sites.push_back(transverse_site(*ell, 0.0, 0.0));
    sites.push_back(transverse_site(*ell, 48.59 * deg, 40.893 * deg));
    sites.push_back(transverse_site(*ell, -20.0 * deg, 120.0 * deg));
    sites.push_back(transverse_site(*ell, 0.0, 90.0 * deg));  // on the equator: no Foucault
    sites.push_back(geographic_site(*ell, 89.0 * deg));
    sites.push_back(geographic_site(*ell, 0.0));
    sites.push_back(geographic_site(*ell, -45.0 * deg));
    sites.push_back(geographic_site(*ell, 1e-7));
    sites.push_back(grid_site(*ell, 3.0 * deg, -5.0 * deg));
    sites.push_back(wander_site(*ell, 90.0 * deg, 0.3));
    sites.push_back(wander_site(*ell, 33.0 * deg, -2.0));
  }
  const auto plain = sites.size();
  for (std::size_t i = 0; i < plain; i += 3) {
    sites.push_back(sites[i]);
    sites.back().neglect_foucault = true;
  }
  for (std::size_t number = 0; number < sites.size(); ++number) {
    const auto& site = sites[number];
    for (int source = 0; source < 12; ++source) {
      StaticInputs in;
      *input(in, source) = kSize[source];
      const auto response = static_response(site, in);
      double envelope[7]{};
      for (double t = 0; t <= 86400; t += 300)
        for (int i = 0; i < 7; ++i)
          envelope[i] = std::max(envelope[i], std::fabs(response.at(t)[i]));
      const auto f = equations(site, in, site.cos_lat);
      for (double t : {1.0, 600.0, 5064.0, 21600.0, 86400.0}) {
        const auto e = exponential(f, t);
        long double x0[8] = {in.dve0, in.dvn0, in.phie0, in.phin0, in.phiu0, in.dlat0, in.dlon0, 1};
        const auto x = response.at(t);
        for (int i = 0; i < 7; ++i) {
          long double expected = 0;
          for (int j = 0; j < 8; ++j) expected += e[i][j] * x0[j];
          // A component that exists only by rounding (150 rad of phase, 3e-14) of its neighbours
          // has no envelope of its own.
          const int group = i < 2 ? 0 : i < 5 ? 2 : 5, last = i < 2 ? 2 : i < 5 ? 5 : 7;
          const double neighbours = *std::max_element(envelope + group, envelope + last);
          EXPECT_NEAR(x[i], static_cast<double>(expected),
                      1e-12 * envelope[i] + 3e-14 * neighbours + 1e-15 * kSize[group])
              << "site " << number << " source " << source << " t " << t << " component " << i;
        }
      }
    }
  }
}

// polar.md 5.1 and the values to meet.
TEST(StaticResponse, RootsMeetTheTable) {
  const auto rows = testing::expected_rows("polar-expected.csv");
  if (rows.empty()) GTEST_SKIP() << "polar-expected.csv is not here";
  const struct {
    const char* name;
    double lat, lon;
  } places[] = {{"pole", 90, 0},
                {"89.9N45E", 89.9, 45},
                {"85N0E", 85, 0},
                {"30N60E", 30, 60},
                {"0N0E", 0, 0}};
  for (const auto& place : places) {
    auto site = wander_site(paper_sphere(), place.lat * deg, 0.2);
    const auto roots = static_roots(site);
    const std::string id = std::string("ROOT-") + place.name;
    EXPECT_NEAR(roots.low, rows.at(id + "-lo").value(), 1e-12) << id;
    EXPECT_NEAR(roots.high, rows.at(id + "-hi").value(), 1e-12) << id;
    EXPECT_EQ(roots.earth, rows.at("ROOT-earth").value());
    // CHARPOLY: (s^2 + ws^2)^2 + 4 s^2 k^2 vanishes at s = jO.
    const double ws2 = site.g * site.kee, k = site.w * site.u[2];
    for (double o : {roots.low, roots.high})
      EXPECT_NEAR(((ws2 - o * o) * (ws2 - o * o) - 4 * o * o * k * k) / (ws2 * ws2), 0.0, 1e-14);
  }
}

// [CHARPOLY]: det(sI - F) = s (s^2 + w^2)((s^2 + ws^2)^2 + 4 s^2 k^2) as an identity in s, off the
// roots too; F is written down by equations() above, not by the closed form. [ROOT-zero]: its
// factor s.
TEST(StaticResponse, CharacteristicPolynomialIsAnIdentity) {
  const auto rows = testing::expected_rows("polar-expected.csv");
  if (!rows.empty()) {
    EXPECT_EQ(rows.at("CHARPOLY").tolerance, "exact");
    EXPECT_EQ(rows.at("ROOT-zero").value(), 0.0);
  }
  using Complex = std::complex<long double>;
  for (double p : {-1.2, 0.0, 0.4, 1.0})
    for (double l : {-2.0, 0.0, 0.55, 1.5}) {
      const auto site = transverse_site(paper_sphere(), p, l);
      const auto f = equations(site, {}, site.cos_lat);
      const long double w = site.w, ws2 = site.g * site.kee, k = w * site.u[2];
      for (const Complex s : {Complex(0.0L, 0.0L), Complex(1e-3L, 2e-3L), Complex(-3e-4L, 1e-4L),
                              Complex(5e-5L, 0.0L), Complex(0.0L, 1.2e-3L)}) {
        // Gaussian elimination with pivots, rows scaled by nothing: 7 x 7.
        Complex m[7][7], det = 1.0L;
        for (int i = 0; i < 7; ++i)
          for (int j = 0; j < 7; ++j) m[i][j] = (i == j ? s : Complex(0.0L)) - f[i][j];
        for (int c = 0; c < 7; ++c) {
          int best = c;
          for (int r = c + 1; r < 7; ++r)
            if (std::abs(m[r][c]) > std::abs(m[best][c])) best = r;
          if (best != c) {
            std::swap(m[c], m[best]);
            det = -det;
          }
          det *= m[c][c];
          if (m[c][c] == Complex(0.0L)) break;
          for (int r = c + 1; r < 7; ++r) {
            const Complex q = m[r][c] / m[c][c];
            for (int j = c; j < 7; ++j) m[r][j] -= q * m[c][j];
          }
        }
        const Complex a = s * s + ws2;
        const Complex expected = s * (s * s + w * w) * (a * a + 4.0L * s * s * k * k);
        // Rounding of the elimination against the largest product of its kind.
        const long double size = std::pow(std::abs(s) + std::sqrt(ws2), 6) * (std::abs(s) + w);
        EXPECT_LT(std::abs(det - expected), 1e-13L * size) << p << " " << l;
      }
    }
}

// RESP-P<place>-<source>-<hours>h-F<foucault>-<component>,
// INIT-P<place>-<state>0-<hours>h-<component>
TEST(StaticResponse, EveryRowOfTheTableOfResponses) {
  const auto rows = testing::expected_rows("polar-expected.csv");
  if (rows.empty()) GTEST_SKIP() << "polar-expected.csv is not here";
  const double p3 = std::asin(std::cos(30 * deg) * std::sin(60 * deg));
  const double l3 = std::atan2(std::cos(30 * deg) * std::cos(60 * deg), std::sin(30 * deg));
  const double p2 = std::asin(std::cos(89.9 * deg) * std::sin(45 * deg));
  const double l2 = std::atan2(std::cos(89.9 * deg) * std::cos(45 * deg), std::sin(89.9 * deg));
  const StaticSite places[2] = {transverse_site(paper_sphere(), p2, l2),
                                transverse_site(paper_sphere(), p3, l3)};
  const std::map<std::string, int> sources = {{"nE", 7},    {"nN", 8},    {"eE", 9},   {"eN", 10},
                                              {"eU", 11},   {"dvE0", 0},  {"dvN0", 1}, {"phiE0", 2},
                                              {"phiN0", 3}, {"phiU0", 4}, {"dp0", 5},  {"dl0", 6}};
  int seen = 0;
  for (const auto& [id, row] : rows) {
    const bool initial = id.rfind("INIT-P", 0) == 0;
    if (!initial && id.rfind("RESP-P", 0) != 0) continue;
    std::vector<std::string> part(1);
    for (char c : id.substr(6)) {
      if (c == '-')
        part.emplace_back();
      else
        part.back() += c;
    }
    ASSERT_EQ(part.size(), initial ? 4u : 5u) << id;
    auto site = places[part[0] == "1" ? 0 : 1];
    site.neglect_foucault = !initial && part[3] == "F0";
    auto source = part[1];
    if (source == "dtlat0") source = "dp0";
    if (source == "dtlon0") source = "dl0";
    ASSERT_TRUE(sources.count(source)) << id;
    const int index = sources.at(source);
    StaticInputs in;
    const double size = index < 2   ? 0.01
                        : index < 5 ? 30 * arcsec
                        : index < 7 ? 10.0 / 6371000 / (index == 6 ? site.cos_lat : 1.0)
                        : index < 9 ? 9.8e-5
                                    : 0.001 * deg_per_h;
    *input(in, index) = size;
    const double t = 3600 * std::stod(part[2]);
    const int component = std::stoi(part.back());
    const auto response = static_response(site, in);
    double envelope = 0;
    for (double s = 0; s <= 86400; s += 300)
      envelope = std::max(envelope, std::fabs(response.at(s)[component]));
    EXPECT_NEAR(response.at(t)[component], row.value(),
                1e-9 * std::fabs(row.value()) + 1e-11 * envelope)
        << id;
    ++seen;
  }
  EXPECT_EQ(seen, 280 + 196);
}

// The rows F2 and F3 that are linear theory: maxima over 24 h, ends, ramps, constants, the price of
// no Foucault.
TEST(StaticResponse, LiuScenariosAtRest) {
  const auto rows = testing::expected_rows("polar-expected.csv");
  if (rows.empty()) GTEST_SKIP() << "polar-expected.csv is not here";
  const struct {
    const char* id;
    double lat, lon;
  } cases[] = {{"F2", 89.9, 45}, {"F3", 30, 60}};
  for (const auto& c : cases) {
    const double p = std::asin(std::cos(c.lat * deg) * std::sin(c.lon * deg));
    const double l =
        std::atan2(std::cos(c.lat * deg) * std::cos(c.lon * deg), std::sin(c.lat * deg));
    auto site = transverse_site(paper_sphere(), p, l);
    StaticInputs in;
    in.dve0 = in.dvn0 = 0.01;
    in.phie0 = in.phin0 = in.phiu0 = 30 * arcsec;
    in.dlat0 = 10 / 6371000.0;
    in.dlon0 = 10 / 6371000.0 / std::cos(p);
    in.nabla_e = in.nabla_n = 9.8e-5;
    in.eps_e = in.eps_n = in.eps_u = 0.001 * deg_per_h;
    const auto exact = static_response(site, in);
    site.neglect_foucault = true;
    const auto paper = static_response(site, in);
    double top[7]{}, position = 0, difference = 0;
    for (double t = 0; t <= 86400; t += 1) {
      auto x = exact.at(t);
      const auto m = exact.position(t);
      x[5] = m[0];
      x[6] = m[1];
      for (int i = 0; i < 7; ++i) top[i] = std::max(top[i], std::fabs(x[i]));
      position = std::max(position, std::hypot(m[0], m[1]));
      difference = std::max(difference, std::fabs(m[0] - paper.position(t)[0]));
    }
    const std::string id = c.id;
    const double unit[7] = {1, 1, arcsec, arcsec, arcsec, 1, 1};
    for (int i = 0; i < 7; ++i) {
      const double max = rows.at(id + "-MAX-" + std::to_string(i)).value();
      EXPECT_NEAR(top[i] / unit[i], max, 1e-3 * max) << id << i;
      const double end = rows.at(id + "-END-" + std::to_string(i)).value();
      const double found = i < 5 ? exact.at(86400)[i] / unit[i] : exact.position(86400)[i - 5];
      EXPECT_NEAR(found, end, std::max(3e-3 * std::fabs(end), 1e-4 * max)) << id << i;
    }
    EXPECT_NEAR(position, rows.at(id + "-POSMAX").value(), 1e-3 * position);
    EXPECT_NEAR(std::hypot(exact.position(86400)[0], exact.position(86400)[1]),
                rows.at(id + "-POSEND").value(), 5e-3 * rows.at(id + "-POSEND").value());
    EXPECT_NEAR(difference, rows.at(id + "-NOFOUC").value(), 0.02 * difference);
    // Ramps and constants come from the sensor errors alone.
    in = {};
    in.eps_e = in.eps_n = in.eps_u = 0.001 * deg_per_h;
    site.neglect_foucault = false;
    const auto drift = static_response(site, in);
    const auto near = [&](double found, const std::string& row) {
      EXPECT_NEAR(found, rows.at(id + row).value(), 1e-6 * std::fabs(found)) << id << row;
    };
    near(drift.metres[0][1] * 86400, "-RAMP-N");
    near(drift.metres[1][1] * 86400, "-RAMP-E");
    near(drift.coefficient[4][1] * 86400 / arcsec, "-RAMP-U");
    near(drift.coefficient[0][0], "-VCONST-E");
    near(drift.coefficient[1][0], "-VCONST-N");
  }
}

// polar.md 5.3: the papers' printed form, corrected, term by term, for the three gyro sources of
// dvE and PhiU.
TEST(StaticResponse, NeglectingFoucaultGivesTheCorrectedPrintedForm) {
  auto site = transverse_site(paper_sphere(), 0.4, 0.55);
  site.neglect_foucault = true;
  const double R = 6371000, w = site.w, ws = std::sqrt(9.8 / R), D = ws * ws - w * w;
  const double sp = std::sin(0.4), cp = std::cos(0.4), tp = sp / cp, sl = std::sin(0.55),
               cl = std::cos(0.55);
  for (double t : {0.0, 10.0, 3000.0, 50000.0}) {
    const double S = std::sin(ws * t), C = std::cos(ws * t), s = std::sin(w * t),
                 c = std::cos(w * t);
    const double dve[3] = {
        R * (sp * sl * cl + sp * sl * cl * (w * w * C - ws * ws * c) / D +
             cp * cl * (w * ws * S - ws * ws * s) / D),
        R * (sp * sp * cl * cl +
             (ws * ws * (1 - sp * sp * cl * cl) * c + (w * w * sp * sp * cl * cl - ws * ws) * C) /
                 D),
        R * (-sp * cp * cl * cl + sp * cp * cl * cl * (ws * ws * c - w * w * C) / D +
             sl * (w * ws * S - ws * ws * s) / D)};
    const double phiu_e = t * sl * cl / cp - cp * sl * cl * s / w + w * sp * cl * (c - C) / D +
                          sp * tp * sl * cl * (w * w * S / ws - ws * ws * s / w) / D;
    for (int source = 0; source < 3; ++source) {
      StaticInputs in;
      *input(in, 9 + source) = 1e-8;
      const auto x = static_response(site, in).at(t);
      EXPECT_NEAR(x[0], 1e-8 * dve[source], 1e-8 * R * 1e-12);
      if (source == 0) {
        EXPECT_NEAR(x[4], 1e-8 * phiu_e, 1e-8 / w * 1e-11);
      }
    }
  }
}

TEST(StaticResponse, SeriesIsTheSameFunction) {
  const auto site = transverse_site(wgs84(), 0.1, 1.0);
  StaticInputs a, b;
  a.eps_n = 1e-8;
  b.dve0 = 0.01;
  const StaticResponse responses[2] = {static_response(site, a), static_response(site, b)};
  std::array<std::vector<double>, 7> out[2];
  static_series(responses, 100.0, 1.5, 1001, out);
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < 7; ++i) {
      // Rounding of the terms that are summed.
      double terms = 0;
      for (int j = 0; j < 8; ++j)
        terms += std::fabs(responses[k].coefficient[i][j]) * (j == 1 ? 1600.0 : 1.0);
      for (std::size_t n : {0u, 1u, 63u, 64u, 1000u})
        EXPECT_NEAR(out[k][i][n], responses[k].at(100.0 + 1.5 * static_cast<double>(n))[i],
                    1e-15 * terms);
    }
}

// The covariance from white noise against summed squares of short steps of noise put in one by one.
TEST(StaticResponse, NoiseCovarianceIsTheSumOfItsImpulses) {
  const auto site = transverse_site(wgs84(), 0.2, 0.3);
  const double qa = 1e-8, qg = 1e-16, t = 7000, step = 10;
  const auto p = static_noise_covariance(site, qa, qg, t);
  std::array<double, 49> sum{};
  for (int source = 0; source < 5; ++source) {
    StaticInputs in;
    double* slot[5] = {&in.dve0, &in.dvn0, &in.phie0, &in.phin0, &in.phiu0};
    *slot[source] = 1;
    const auto response = static_response(site, in);
    for (double tau = step / 2; tau < t; tau += step) {
      const auto x = response.at(tau);
      for (int i = 0; i < 7; ++i)
        for (int j = 0; j < 7; ++j) sum[7 * i + j] += (source < 2 ? qa : qg) * step * x[i] * x[j];
    }
  }
  // The midpoint rule's error is (ws step)^2/24 = 6e-6 of the sum.
  for (int i = 0; i < 7; ++i) EXPECT_NEAR(p[8 * i] / sum[8 * i], 1.0, 2e-5) << i;
  for (int i = 0; i < 7; ++i)
    for (int j = 0; j < 7; ++j)
      EXPECT_NEAR(p[7 * i + j], sum[7 * i + j], 2e-5 * std::sqrt(sum[8 * i] * sum[8 * j]));
}

TEST(StaticResponse, RefusesTheTransversePoleWithTheReason) {
  EXPECT_NE(testing::refusal([] { transverse_site(wgs84(), 90 * deg, 0); }).find("transverse"),
            std::string::npos);
  EXPECT_THROW(geographic_site(wgs84(), -90 * deg), Error);
}

}  // namespace
}  // namespace loxo
