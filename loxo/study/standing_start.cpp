// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/standing_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "loxo/num/units.hpp"

namespace loxo {
StandingStart standing_start(const Drive& drive, double t0, double duration, double stop,
                             Diagnostics& d, bool jolts_end) {
  struct Second {
    double begin, end, length, vw, vf;
    long n;
    Vec<Body> w, f;  // means
  };
  ImuReader reader(drive, d);
  ImuIncrement<double> s;
  std::vector<Second> all;
  Second q{};
  Vec<Body> sw, sf, f0;
  double ww = 0, ff = 0;
  std::vector<double> sorted_w, sorted_f;
  auto middle = [](const std::vector<double>& v) { return v[v.size() / 2]; };
  auto disturbed = [&](const Second& x) {
    return x.vw > 36 * middle(sorted_w) + 1e-12 || x.vf > 36 * middle(sorted_f) + 1e-10;
  };
  int in_a_row = 0;
  while (reader.next(s)) {
    if (s.t <= t0 || !(s.dt > 0)) continue;
    if (s.t > t0 + duration || s.t > stop) break;
    const Vec<Body> w = s.dtheta * (1 / s.dt), f = s.dv * (1 / s.dt);
    if (q.n == 0) {
      q = Second{};
      q.begin = s.t - s.dt;
      f0 = f;
      sw = sf = {};
      ww = ff = 0;
    }
    ++q.n;
    q.length += s.dt;
    sw += w;
    sf += f - f0;
    ww += dot(w, w);
    ff += dot(f - f0, f - f0);
    if (q.length < 1.0 - 1e-6) continue;
    const double k = 1.0 / static_cast<double>(q.n);
    const Vec<Body> df = sf * k;
    q.w = sw * k;
    q.f = f0 + df;
    q.vw = std::max(0.0, ww * k - dot(q.w, q.w));
    q.vf = std::max(0.0, ff * k - dot(df, df));
    q.end = s.t;
    const bool moves = all.size() >= 5 && ((jolts_end && disturbed(q)) || norm(q.w) > 0.02);
    in_a_row = moves ? in_a_row + 1 : 0;
    sorted_w.insert(std::upper_bound(sorted_w.begin(), sorted_w.end(), q.vw), q.vw);
    sorted_f.insert(std::upper_bound(sorted_f.begin(), sorted_f.end(), q.vf), q.vf);
    all.push_back(q);
    q.n = 0;
    if (in_a_row >= 3) {
      all.resize(all.size() - 3);
      break;
    }
  }
  StandingStart out;
  if (all.empty()) return out;
  out.begin = all.front().begin;
  out.end = all.back().end;
  double quiet_n = 0, sum_w = 0, sum_f = 0, time = 0, v[3]{};
  long quiet = 0;
  for (const Second& x : all) {
    out.samples += x.n;
    out.mean_w += x.w * static_cast<double>(x.n);
    out.mean_f += x.f * static_cast<double>(x.n);
  }
  out.mean_w = out.mean_w * (1.0 / static_cast<double>(out.samples));
  out.mean_f = out.mean_f * (1.0 / static_cast<double>(out.samples));
  Vec<Body> angle;
  std::vector<Vec<Body>> angles;
  for (const Second& x : all) {
    angle += x.w * x.length;
    time += x.length;
    angles.push_back(angle);
    if (disturbed(x)) continue;
    const auto n = static_cast<double>(x.n);
    quiet_n += n;
    sum_w += x.vw * n;
    sum_f += x.vf * n;
    const Vec<Body> e = x.w - out.mean_w;
    v[0] += e.x * e.x, v[1] += e.y * e.y, v[2] += e.z * e.z;
    ++quiet;
  }
  if (quiet > 0) {
    out.sigma_w = std::sqrt(sum_w / (3.0 * quiet_n));
    out.sigma_f = std::sqrt(sum_f / (3.0 * quiet_n));
    for (int i = 0; i < 3; ++i) out.sway[i] = std::sqrt(v[i] / static_cast<double>(quiet));
  }
  double a2 = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double u = static_cast<double>(i + 1) / static_cast<double>(angles.size());
    const Vec<Body> e = angles[i] - angle * u;
    a2 += (e.x * e.x + e.y * e.y) / 2;
  }
  out.sway_angle = std::sqrt(a2 / static_cast<double>(angles.size()));
  return out;
}

}  // namespace loxo
