// SPDX-License-Identifier: Apache-2.0
#include "loxo/calibrate/replay_sums.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "loxo/earth/rhumb.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

constexpr std::size_t kBlock = 512;  // rows: eight values of w(m) for each cost 1 ns a row
constexpr int kNodes = 8;
// Beside the distance d to the pole a block reaches at most this far: the interpolation's error is
// (reach / 2d)^8 ...
constexpr double kReach = 0.02;
// ... and a step is at most this long: the next term of its mean rate is (dn/d)^4 / 80.
constexpr double kStep = 1e-3;

// Chebyshev nodes on [-1, 1] and the matrix from values there to monomials.
struct Interpolation {
  std::array<double, kNodes> node{};
  std::array<std::array<double, kNodes>, kNodes> monomial{};
  Interpolation() {
    std::array<std::array<double, kNodes>, kNodes> chebyshev{};  // T_j in monomials
    chebyshev[0][0] = 1;
    chebyshev[1][1] = 1;
    for (int j = 2; j < kNodes; ++j)
      for (int i = 0; i < kNodes; ++i)
        chebyshev[j][i] = (i > 0 ? 2 * chebyshev[j - 1][i - 1] : 0.0) - chebyshev[j - 2][i];
    for (int k = 0; k < kNodes; ++k) {
      const double angle = kPi * (k + 0.5) / kNodes;
      node[k] = std::cos(angle);
      for (int j = 0; j < kNodes; ++j)
        for (int i = 0; i < kNodes; ++i)
          monomial[i][k] += (j == 0 ? 1.0 : 2.0) / kNodes * std::cos(j * angle) * chebyshev[j][i];
    }
  }
};
const Interpolation& interpolation() {
  static const Interpolation table;
  return table;
}

struct Compensated {
  double hi = 0, low = 0;
  void add(double x) {
    const double y = x + low, t = hi + y, b = t - hi;
    low = (hi - (t - b)) + (y - b);
    hi = t;
  }
};

double sum(const Lanes& x) {
  double v[8], total = 0;
  x.store(v);
  for (const double each : v) total += each;
  return total;
}

}  // namespace

ReplaySums::ReplaySums(const std::vector<double>& north, const std::vector<double>& east,
                       const std::vector<std::size_t>& rows) {
  Compensated n, e;
  std::size_t i = 0;
  for (std::size_t stop = 0; stop < rows.size(); ++stop) {
    if (stop > 0 && rows[stop] == rows[stop - 1]) {
      ++repeats_.back();
      continue;
    }
    do {
      Block b;
      b.begin = n_.size();
      b.north = n.hi + n.low;
      b.east = e.hi + e.low;
      double pn = 0, pe = 0;
      for (std::size_t j = 0; j < kBlock && i < rows[stop]; ++i, ++j) {
        n_.push_back(north[i]);
        e_.push_back(east[i]);
        mid_n_.push_back(pn + 0.5 * north[i]);
        mid_e_.push_back(pe + 0.5 * east[i]);
        pn += north[i];
        pe += east[i];
        b.reach = std::max(b.reach, std::fabs(pn) + std::fabs(pe));
        b.step = std::max(b.step, std::fabs(north[i]) + std::fabs(east[i]));
        n.add(north[i]);
        e.add(east[i]);
      }
      while (n_.size() % 8 != 0) {
        n_.push_back(0);
        e_.push_back(0);
        mid_n_.push_back(0);
        mid_e_.push_back(0);
      }
      b.end = n_.size();
      b.stop = i == rows[stop];
      blocks_.push_back(b);
    } while (i < rows[stop]);
    stop_north_.push_back(n.hi + n.low);
    stop_east_.push_back(e.hi + e.low);
    repeats_.push_back(1);
  }
}

bool ReplaySums::run(const Ellipsoid& ell, double m0, double c, double s, bool sensitive,
                     std::vector<ReplaySum>& out, double& largest) const {
  const auto& table = interpolation();
  const double size = std::hypot(c, s);
  out.clear();
  Compensated lon;
  ReplaySum at;
  largest = std::fabs(m0);
  std::size_t stop = 0;
  for (const Block& b : blocks_) {
    const double north = c * b.north + s * b.east, east = c * b.east - s * b.north;
    const double m = m0 + north;
    const double reach = std::max(1.0, size * b.reach);
    const double pole = ell.quarter_meridian - std::fabs(m);
    if (!(reach < kReach * pole) || !(size * b.step < kStep * pole)) return false;
    largest = std::max(largest, std::fabs(m) + reach);

    // w(m) over the block: u = (arc from its begin) / reach in [-1, 1].
    const Lanes arc = Lanes(m) + Lanes(reach) * Lanes::load(table.node.data());
    double w[kNodes];
    isometric_rate(ell, latitude_of_arc(ell, arc)).store(w);
    std::array<double, kNodes> p{};
    for (int i = 0; i < kNodes; ++i)
      for (int k = 0; k < kNodes; ++k) p[i] += table.monomial[i][k] * w[k];
    const double scale = 1.0 / reach;
    Lanes coefficient[kNodes], first[kNodes - 1], second[4];
    for (int i = 0; i < kNodes; ++i) coefficient[i] = Lanes(p[i]);
    for (int i = 1; i < kNodes; ++i) first[i - 1] = Lanes(i * p[i] * scale);
    for (int i = 2; i < 6; ++i) second[i - 2] = Lanes(i * (i - 1) * p[i] * scale * scale / 24.0);

    const Lanes cc(c), ss(s), to_u(scale);
    Lanes sum_lon(0.0), sum_dn_d(0.0), sum_m(0.0), sum_e(0.0), sum_w(0.0);
    for (std::size_t i = b.begin; i < b.end; i += 8) {
      const Lanes n = Lanes::load(&n_[i]), e = Lanes::load(&e_[i]);
      const Lanes pn = Lanes::load(&mid_n_[i]), pe = Lanes::load(&mid_e_[i]);
      const Lanes dn = cc * n + ss * e, de = cc * e - ss * n;
      const Lanes mid = cc * pn + ss * pe, u = mid * to_u;
      Lanes rate = coefficient[kNodes - 1];
      for (int k = kNodes - 2; k >= 0; --k) rate = rate * u + coefficient[k];
      Lanes bend = second[3];
      for (int k = 2; k >= 0; --k) bend = bend * u + second[k];
      // The mean over the step: midpoint and its second derivative (V-8).
      const Lanes mean = rate + bend * dn * dn;
      sum_lon += de * mean;
      if (!sensitive) continue;
      Lanes slope = first[kNodes - 2];
      for (int k = kNodes - 3; k >= 0; --k) slope = slope * u + first[k];
      const Lanes weight = de * slope;
      sum_dn_d += dn * mean;
      sum_m += weight * mid;
      sum_e += weight * (cc * pe - ss * pn);
      sum_w += weight;
    }
    lon.add(sum(sum_lon));
    if (sensitive) {
      const double weight = sum(sum_w);
      at.dn_d += sum(sum_dn_d);
      at.slope_m += sum(sum_m) + north * weight;
      at.slope_e += sum(sum_e) + east * weight;
      at.slope += weight;
    }
    if (!b.stop) continue;
    at.north = c * stop_north_[stop] + s * stop_east_[stop];
    at.east = c * stop_east_[stop] - s * stop_north_[stop];
    at.lon = lon.hi + lon.low;
    for (int k = 0; k < repeats_[stop]; ++k) out.push_back(at);
    ++stop;
  }
  return true;
}

}  // namespace loxo
