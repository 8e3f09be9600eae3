// SPDX-License-Identifier: Apache-2.0
#include "loxo/sim/path.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "loxo/earth/geodetic.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/functions.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// Weights of the six control points around x in [0, 1), and their derivatives.
struct Weights {
  double w[6], d[6], dd[6];
};
Weights weights(double x) {
  const double a = 1 - x, a3 = a * a * a, x2 = x * x, x3 = x2 * x, x4 = x3 * x, x5 = x4 * x;
  constexpr double k = 1.0 / 120.0;
  return {{k * a3 * a * a, k * (26 - 50 * x + 20 * x2 + 20 * x3 - 20 * x4 + 5 * x5),
           k * (66 - 60 * x2 + 30 * x4 - 10 * x5),
           k * (26 + 50 * x + 20 * x2 - 20 * x3 - 20 * x4 + 10 * x5),
           k * (1 + 5 * x + 10 * x2 + 10 * x3 + 5 * x4 - 5 * x5), k * x5},
          {-5 * k * a3 * a, k * (-50 + 40 * x + 60 * x2 - 80 * x3 + 25 * x4),
           k * (-120 * x + 120 * x3 - 50 * x4), k * (50 + 40 * x - 60 * x2 - 80 * x3 + 50 * x4),
           k * (5 + 20 * x + 30 * x2 + 20 * x3 - 25 * x4), k * 5 * x4},
          {20 * k * a3, k * (40 + 120 * x - 240 * x2 + 100 * x3), k * (-120 + 360 * x2 - 200 * x3),
           k * (40 - 120 * x - 240 * x2 + 200 * x3), k * (20 + 60 * x + 60 * x2 - 100 * x3),
           k * 20 * x3}};
}

// Value and derivatives of a spline of numbers; controls[0] stands two before parameter 0.
struct Scalar {
  double value, first, second;
};
Scalar spline(const std::vector<double>& controls, double q) {
  const double most = static_cast<double>(controls.size()) - 6.0;
  const double at = std::clamp(loxo::floor(q), 0.0, most);
  const auto i = static_cast<std::size_t>(at);
  const Weights w = weights(q - at);
  // Against the point in the middle: differences of neighbours lose nothing.
  const double c = controls[i + 2];
  Scalar s{c, 0, 0};
  for (std::size_t k = 0; k < 6; ++k) {
    const double d = controls[i + k] - c;
    s.value += w.w[k] * d;
    s.first += w.d[k] * d;
    s.second += w.dd[k] * d;
  }
  return s;
}

Vec<Ecef> unit(const Vec<Ecef>& v) { return (1.0 / norm(v)) * v; }

// Two controls before and three after, straight on.
template <class T>
void extend(std::vector<T>& c) {
  const std::size_t n = c.size();
  const T before = c[0] - c[1], after = c[n - 1] - c[n - 2];
  c.insert(c.begin(), c[0] + before);
  c.insert(c.begin(), c[0] + before);
  for (int i = 0; i < 3; ++i) c.push_back(c.back() + after);
}

}  // namespace

Path::Place Path::geometry(double q) const {
  const double most = static_cast<double>(normal_.size()) - 6.0;
  const double at = std::clamp(loxo::floor(q), 0.0, most);
  const auto i = static_cast<std::size_t>(at);
  const Weights w = weights(q - at);
  const Vec<Ecef> c = normal_[i + 2];
  Vec<Ecef> p{}, p1{}, p2{};
  for (std::size_t k = 0; k < 6; ++k) {
    const Vec<Ecef> d = normal_[i + k] - c;
    p += w.w[k] * d;
    p1 += w.d[k] * d;
    p2 += w.dd[k] * d;
  }
  p += c;
  // n = p/|p| and its derivatives.
  Place out;
  const double m = norm(p);
  out.n = (1.0 / m) * p;
  const double m1 = dot(out.n, p1);
  out.n1 = (1.0 / m) * (p1 - m1 * out.n);
  const double m2 = dot(out.n1, p1) + dot(out.n, p2);
  out.n2 = (1.0 / m) * (p2 - m2 * out.n - (2.0 * m1) * out.n1);
  const Scalar h = spline(height_, q);
  out.h = h.value;
  out.h1 = h.first;
  out.h2 = h.second;
  return out;
}

Path::Place Path::at(double t) const {
  const Scalar q = spline(progress_, t / tick_);
  Place p = geometry(q.value);
  p.q1 = q.first / tick_;
  p.q2 = q.second / (tick_ * tick_);
  return p;
}

double Path::metres_per_q(const Ellipsoid& ell, const Place& p) const {
  const double s = p.n.z;
  const double radius = ell.a / loxo::sqrt(1 - ell.e2 * s * s) + p.h;
  const double level = radius * norm(p.n1);  // to e2: enough for a plan of speed
  return loxo::sqrt(level * level + p.h1 * p.h1);
}

Path::Path(const Ellipsoid& ell, const std::vector<PathPoint>& points, double spacing,
           double tightest, const PathSpeed& v, const std::string& where) {
  const auto refuse = [&](const std::string& what) { throw Error(ErrorKind::kInput, what, where); };
  if (!(spacing > 0)) refuse("expected a distance of control points above 0");
  // The points' way along chords; places visited twice in a row are one place.
  std::vector<Vec<Ecef>> n;
  std::vector<double> h, s, t;
  std::vector<Point<Ecef>> r;
  bool timed = true;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& p = points[i];
    timed = timed && given(p.t);
    if (i > 0 && timed && !(p.t > points[i - 1].t))
      refuse(
          fmt::format("the time of point {} does not come after that of the point before", i + 1));
    n.push_back(normal_of(p.lat, p.lon));
    h.push_back(p.h);
    r.push_back(from_normal(ell, NormalHeight<double>{n.back(), p.h}));
    s.push_back(s.empty() ? 0.0 : s.back() + norm(r[i] - r[i - 1]));
    t.push_back(p.t);
  }
  if (points.size() < 2 || !(s.back() > spacing))
    refuse(fmt::format("expected a way longer than {} m (the distance of the control points)",
                       spacing));
  length_ = s.back();

  // Control points at equal distances on the chords.
  const auto count = static_cast<std::size_t>(max(2.0, loxo::round(length_ / spacing)));
  const double d = length_ / static_cast<double>(count);
  std::size_t j = 0;
  for (std::size_t i = 0; i <= count; ++i) {
    const double at = min(length_, d * static_cast<double>(i));
    while (j + 2 < s.size() && s[j + 1] < at) ++j;
    const double x = s[j + 1] > s[j] ? min(1.0, (at - s[j]) / (s[j + 1] - s[j])) : 0.0;
    normal_.push_back(unit(n[j] + x * (n[j + 1] - n[j])));
    height_.push_back(h[j] + x * (h[j + 1] - h[j]));
  }
  extend(normal_);
  extend(height_);

  // Curvature at and between the control points, for the plan of speed and to find cusps.
  const std::size_t plan = 4 * count;
  std::vector<double> way(plan + 1), fastest(plan + 1);
  for (std::size_t i = 0; i <= plan; ++i) {
    const Place p = geometry(0.25 * static_cast<double>(i));
    const double g = metres_per_q(ell, p), n1 = norm(p.n1);
    const double bend = dot(cross(p.n, p.n1), p.n2);  // of the curve of normals, times n1^3
    const double radius_of_earth = (n1 > 0 ? g / n1 : ell.a);
    const double curvature = n1 > 0 ? loxo::fabs(bend) / (n1 * n1 * n1 * radius_of_earth) : 1e300;
    // A place where the way turns back is driven through by no vehicle.
    if (!(curvature * tightest < 1) || n1 * ell.a < 1e-3 * d)
      refuse(
          fmt::format("{:.0f} m after its start the way turns more tightly than a radius of {} m "
                      "(does it turn back on itself?); expected a wider smoothing, or the way "
                      "cut there",
                      0.25 * d * static_cast<double>(i), tightest));
    way[i] = i == 0 ? 0.0 : way[i - 1] + 0.25 * g;
    fastest[i] = min(v.speed, loxo::sqrt(v.lateral / max(curvature, 1e-12)));
  }

  if (timed) {
    // Progress at equal times, from the points' own: as given, smoothed over some seconds.
    duration_ = t.back() - t.front();
    tick_ = max(0.5, duration_ / static_cast<double>(points.size() - 1));
    const auto ticks = static_cast<std::size_t>(max(2.0, loxo::round(duration_ / tick_)));
    tick_ = duration_ / static_cast<double>(ticks);
    j = 0;
    for (std::size_t i = 0; i <= ticks; ++i) {
      const double at = t.front() + tick_ * static_cast<double>(i);
      while (j + 2 < t.size() && t[j + 1] < at) ++j;
      const double x = min(1.0, (at - t[j]) / (t[j + 1] - t[j]));
      progress_.push_back((s[j] + x * (s[j + 1] - s[j])) / d);
    }
    extend(progress_);
    // No vehicle is beyond the ends.
    const double last = static_cast<double>(count);
    for (double& q : progress_) q = std::clamp(q, 0.0, last);
    return;
  }
  if (!(v.speed > 0 && v.acceleration > 0 && v.lateral > 0))
    refuse("expected speed, acceleration and lateral acceleration above 0");
  // The fastest drive within the limits: forward for gaining speed, backward for losing it.
  if (v.from_rest) fastest.front() = 0;
  if (v.to_rest) fastest.back() = 0;
  const auto reach = [&](double from, double step) {
    return loxo::sqrt(from * from + 2 * v.acceleration * step);
  };
  for (std::size_t i = 1; i <= plan; ++i)
    fastest[i] = min(fastest[i], reach(fastest[i - 1], way[i] - way[i - 1]));
  for (std::size_t i = plan; i-- > 0;)
    fastest[i] = min(fastest[i], reach(fastest[i + 1], way[i + 1] - way[i]));
  std::vector<double> time(plan + 1, 0.0);
  for (std::size_t i = 1; i <= plan; ++i)
    time[i] = time[i - 1] + 2 * (way[i] - way[i - 1]) / (fastest[i] + fastest[i - 1]);
  // It stands for three ticks before and after, so that it is at rest to the last bit.
  tick_ = 1;
  const double stand_before = v.from_rest ? 3 * tick_ : 0, stand_after = v.to_rest ? 3 * tick_ : 0;
  const double total = stand_before + time.back() + stand_after;
  const auto ticks = static_cast<std::size_t>(max(2.0, -loxo::floor(-total)));
  duration_ = static_cast<double>(ticks);
  j = 0;
  for (std::size_t i = 0; i <= ticks; ++i) {
    const double at = static_cast<double>(i) - stand_before;
    if (at <= 0) {
      progress_.push_back(0.0);
      continue;
    }
    while (j + 1 < plan && time[j + 1] < at) ++j;
    const double span = time[j + 1] - time[j], x = min(1.0, (at - time[j]) / span);
    // Acceleration is constant over a piece of the plan.
    const double gained = fastest[j + 1] - fastest[j], step = way[j + 1] - way[j];
    const double part = x * span * (fastest[j] + 0.5 * x * gained) / step;
    progress_.push_back(0.25 * (static_cast<double>(j) + min(1.0, part)));
  }
  extend(progress_);
  if (v.from_rest)
    for (std::size_t i = 0; i < 2; ++i) progress_[i] = 0;
  const double last = static_cast<double>(count);
  for (double& q : progress_)
    q = std::clamp(q, v.from_rest ? 0.0 : -2.0, v.to_rest ? last : last + 3);
}

}  // namespace loxo
