// SPDX-License-Identifier: Apache-2.0
// Position fixes in the joint filter, and the heading that a long gap of the inertial unit has
// lost.
#include <algorithm>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/estimate/coasting.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// chi2 quantiles of 1, 2, 3 degrees: 0.95 and 1 - 1e-6 ([EST-9], vectors).
constexpr double kChi95[4] = {0, 3.841458820694124, 5.991464547107979, 7.814727903251179};
constexpr double kChiGate[4] = {0, 23.92812697687947, 27.631021115871036, 30.66484962115624};

}  // namespace

// Through a gap that may hide a turn: straight on, what may have happened as noise, the wheel as a
// speed. (1.5, with its totals over the gap; a heading is at worst uniform.)
void Navigator::coast_to(double t) {
  const double gap = t - s_.t, turn = min(config_.gap_rate * gap, kPi / sqrt(3.0)),
               level = min(config_.gap_rate * gap, config_.gap_level),
               force = config_.gap_force * config_.gap_force * gap;
  const int n = std::max(1, static_cast<int>(std::min(1e6, std::ceil(gap / 0.1))));
  const double h = gap / n;
  TransitionProduct* const product = tape_ ? product_.get() : nullptr;
  coasting_ = true;
  w_eb_ = {};
  a_ = {};
  for (int axis = 0; axis < 3; ++axis) reset_accumulator(axis, 0.0);
  for (int i = 0; i < n; ++i) {
    CoastNoise q;
    q.up = to_normal(config_.ellipsoid, s_.r).n;
    q.ahead = to_matrix(s_.q) * mounting_.axis[1];
    q.ahead = q.ahead - q.up * dot(q.ahead, q.up);
    q.ahead = q.ahead * (1.0 / max(norm(q.ahead), 1e-9));
    // A road vehicle whose wheel stands does not turn.
    const bool told = config_.use_nhc && coast_tick_t_ > s_.t - 1.5;
    const double moves = told ? min(1.0, dot(s_.v, s_.v)) : 1.0;
    q.heading = moves * turn * turn / gap;
    q.level = level * level / gap;
    q.forward = force;
    q.sideways = config_.use_nhc ? config_.speed_std * config_.speed_std / gap : force;
    coast(s_, P_, product, q, h, rest());
    for (int k = 0; k < 3; ++k) {
      const double wg = config_.bias_moving * config_.gyro_bias,
                   wa = config_.bias_moving * config_.accel_bias;
      P_.p[kBg + k][kBg + k] += 2.0 * wg * wg * h / config_.gyro_bias_tau;
      P_.p[kBa + k][kBa + k] += 2.0 * wa * wa * h / config_.accel_bias_tau;
    }
    if (config_.use_odometer) {
      P_.p[kScale][kScale] += config_.scale_walk * config_.scale_walk * h;
      P_.p[kTau][kTau] += config_.tau_walk * config_.tau_walk * h;
    }
    run_pending();
  }
  s_.t = t;
  coasting_ = false;
  last_dt_ = nhc_age_ = 0;
  have_tick_ = false;  // the way of the next reading began in the gap
  anchored_ = false;
  const Vec<Ecef> up = to_normal(config_.ellipsoid, s_.r).n;
  const double sigma = heading_sigma(P_, up);
  if (sigma > config_.heading_lost) {
    lost_variance_ = sigma * sigma;
    lost_from_ = s_.r;
    turn_heading(s_, P_, product, up, 0.0, 0.0, rest());
    // Fixes in the gap said where, not whither.
    standing_health_ |= kHealthUncovered;
    recovering_ = true;
  }
}

Covariance<kStates> Navigator::stated_covariance() const {
  Covariance<kStates> P = P_;
  if (!lost()) return P;
  const Vec<Ecef> up = to_normal(config_.ellipsoid, s_.r).n, v = cross(s_.v, up),
                  r = cross(s_.r - lost_from_, up);
  const double g[9] = {up.x, up.y, up.z, v.x, v.y, v.z, r.x, r.y, r.z};
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) P.p[i][j] += lost_variance_ * (g[i] * g[j]);
  return P;
}

// The heading from a velocity, or from the way between two fixes against the way reckoned between
// them: a turn of any size. False: the fix is not to be used (too near to the last).
bool Navigator::find_heading(const Fix& f) {
  const MeasurementPoint p = point(s_.t - f.t);
  const Vec<Body> l = s_.antenna;
  const NormalHeight<double> n = to_normal(config_.ellipsoid, p.r);
  const Vec<Ecef> up = n.n;
  const auto level = [&](const Vec<Ecef>& x) { return x - up * dot(x, up); };
  const Geodetic<double> here = to_geodetic(config_.ellipsoid, p.r);
  const Point<Ecef> z =
      to_ecef(config_.ellipsoid, Geodetic<double>{f.lat, f.lon, or_else(f.h, here.h)});
  const double s2 = f.std_e * f.std_e + f.std_n * f.std_n,
               sigma = sqrt(max(s2, 2 * config_.fix_std_min * config_.fix_std_min));
  Vec<Ecef> told, own;
  double std = 0;
  bool found = false;
  if (given(f.ve) && given(f.vn) && hypot(f.ve, f.vn) > 5.0) {
    told = transpose(geographic_axes(here.lat, here.lon)) * Vec<Geographic>{f.ve, f.vn, 0};
    own = level(p.v + p.C * cross(p.w_eb, l));
    std = (f.std_v > 0 ? f.std_v : config_.fix_velocity_std) / norm(told);
    found = norm(own) > 1.0;
  } else if (anchored_) {
    told = level(z - anchor_fix_);
    own = level(p.r + p.C * l - anchor_);
    const double way = norm(told), reckoned = norm(own);
    std = sigma / max(way, 1e-9);
    found = std < 0.1 && fabs(way - reckoned) < 4.0 * sigma + 0.1 * reckoned;
    if (!found && max(way, reckoned) < 10.0 * sigma) return false;
  }
  TransitionProduct* const product = tape_ ? product_.get() : nullptr;
  if (found) {
    turn_heading(s_, P_, product, up, atan2(dot(cross(own, told), up), dot(own, told)),
                 max(std, 1e-3), rest());
    lost_variance_ = 0;
    anchored_ = false;
  } else {
    anchored_ = true;
  }
  forget_position(P_, product, up, 1e4, rest());
  return true;
}

void Navigator::use_fix(const Fix& f, bool user) {
  const double age = s_.t - f.t;
  const bool was_lost = lost();
  if (was_lost && !find_heading(f)) return;
  const MeasurementPoint p = point(age);
  const Geodetic<double> here = to_geodetic(config_.ellipsoid, p.r);
  const Rot<Geographic, Ecef> C_ge = geographic_axes(here.lat, here.lon);
  const Block3<> level = block_of(C_ge);
  const Vec<Body> l = s_.antenna;
  const bool with_h = given(f.h);
  const Point<Ecef> z =
      to_ecef(config_.ellipsoid, Geodetic<double>{f.lat, f.lon, with_h ? f.h : here.h});
  const int n = with_h ? 3 : 2;
  const double floor2 = config_.fix_std_min * config_.fix_std_min;
  double r[3] = {max(f.std_e * f.std_e, floor2), max(f.std_n * f.std_n, floor2),
                 max(f.std_u * f.std_u, floor2)};
  for (double& e : r)
    if (!(e > 0)) e = 1e-6;
  // The whole vector first: n^2 = y^T S^-1 y. [EST-9]
  ScalarMeasurement m[3];
  FullProjection a[3];
  double S[3][3], y[3];
  for (int i = 0; i < n; ++i) {
    m[i] = position_along(p, l, row_of(level, i), z);
    if (extra_) m[i].row.add3(kAntenna, transpose(p.C) * row_of(level, i));
    projection(m[i].row, a[i]);
    y[i] = -m[i].h;
  }
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      S[i][j] = i == j ? r[i] : 0.0;
      for (int k = 0; k < m[i].row.n; ++k) S[i][j] += m[i].row.value[k] * a[j][m[i].row.index[k]];
    }
  auto norm2 = [&](const double e[3]) {  // by Cholesky
    double L[3][3]{}, u[3], sum = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) {
        double s = S[i][j];
        for (int k = 0; k < j; ++k) s -= L[i][k] * L[j][k];
        L[i][j] = i == j ? sqrt(max(s, 1e-300)) : s / L[j][j];
      }
      u[i] = e[i];
      for (int k = 0; k < i; ++k) u[i] -= L[i][k] * u[k];
      u[i] /= L[i][i];
      sum += u[i] * u[i];
    }
    return sum;
  };
  const double n2 = norm2(y);
  contradict(n2 / n);
  double factor = 0;
  if (!(n2 <= kChi95[n])) factor = sqrt(n2 / kChi95[n]) - 1.0;
  if (!(n2 <= kChiGate[n])) {
    // A shift of the stamp along the velocity that explains it, found on horizontal components.
    const Vec<Geographic> v = C_ge * p.v;
    const double v2 = v.x * v.x + v.y * v.y;
    bool wrong_stamp = false;
    double shift = 0;
    if (v2 > 4.0) {
      shift = (y[0] * v.x + y[1] * v.y) / v2;
      const double e[3] = {y[0] - v.x * shift, y[1] - v.y * shift, n == 3 ? y[2] : 0.0};
      wrong_stamp = fabs(shift) <= 5.0 && fabs(shift) > 0.2 && norm2(e) < kChi95[n];
    }
    health_ |= kHealthRejected;
    if (!wrong_stamp) detector_.contradict(s_.t);
    if (user && !wrong_stamp) {
      ++events_.far_benchmarks;
      events_.far_metres = max(events_.far_metres, norm(z - p.r));
      if (!(events_.first_far <= s_.t)) events_.first_far = s_.t;
    } else if (wrong_stamp) {
      ++events_.wrong_stamps;
      events_.stamp_shift += shift;
      if (!(events_.first_wrong_stamp <= s_.t)) events_.first_wrong_stamp = s_.t;
    } else {
      ++events_.outlier_fixes;
    }
    if (!user && fix_rejected_since_ > s_.t) fix_rejected_since_ = s_.t;
    const bool locked_out = s_.t - fix_rejected_since_ > 3.0 * config_.lock_time;
    if ((config_.fix_gate && !user && !locked_out) || wrong_stamp) {
      Weighed w{Verdict::kRejected, r[0], n2 / n};
      counts_[static_cast<int>(Sensor::kFix)].add(sqrt(n2 / n), 1.0, w);
      if (sink_) sink_->innovation({s_.t, Sensor::kFix, sqrt(n2 / n), 1.0, w.verdict});
      return;
    }
    if (locked_out) standing_health_ |= kHealthUncovered;
  } else {
    fix_rejected_since_ = 1e300;
    // After a long gap the first fix only says where; the next one whether that was right.
    if (n2 <= kChi95[n] && !was_lost) {
      if (!recovering_) standing_health_ &= ~static_cast<std::uint32_t>(kHealthUncovered);
      recovering_ = false;
    }
  }
  const Gate all{1e9, 0};
  for (int i = 0; i < n; ++i) scalar(Sensor::kFix, m[i], 0.0, r[i], all, nullptr, S[i][i] * factor);
  close();
  if (lost()) {
    const MeasurementPoint at = point(age);
    lost_from_ = s_.r;
    anchor_fix_ = z;
    anchor_ = at.r + at.C * l;
    return;
  }
  if (given(f.ve) && given(f.vn)) {
    const MeasurementPoint p2 = point(age);
    const double sd = f.std_v > 0 ? f.std_v : config_.fix_velocity_std, rv = sd * sd;
    const double zv[3] = {f.ve, f.vn, f.vu};
    for (int i = 0; i < 3; ++i) {
      if (!(zv[i] == zv[i])) continue;
      ScalarMeasurement mv = velocity_along(p2, s_.antenna, row_of(level, i));
      if (extra_) mv.row.add3(kAntenna, cross(transpose(p2.C) * row_of(level, i), p2.w_eb));
      scalar(Sensor::kFixVelocity, mv, zv[i], rv, config_.gate);
    }
    close();
  }
}

}  // namespace loxo
