// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/covariance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/errors/error_dynamics.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

struct Named {
  BudgetSource source;
  const char *name, *words;
};
constexpr Named kNames[kBudgetSources] = {
    {BudgetSource::kGyroBias, "gyro_bias", "gyro bias"},
    {BudgetSource::kGyroScale, "gyro_scale", "gyro scale"},
    {BudgetSource::kGyroNoise, "gyro_noise", "gyro noise (angle random walk)"},
    {BudgetSource::kGyroWalk, "gyro_walk", "gyro rate random walk"},
    {BudgetSource::kAccelBias, "accel_bias", "accelerometer bias"},
    {BudgetSource::kAccelScale, "accel_scale", "accelerometer scale"},
    {BudgetSource::kAccelNoise, "accel_noise", "accelerometer noise (velocity random walk)"},
    {BudgetSource::kAccelWalk, "accel_walk", "acceleration random walk"},
    {BudgetSource::kLevel, "alignment_level", "levelling of the alignment"},
    {BudgetSource::kHeading, "alignment_heading", "heading of the alignment"},
    {BudgetSource::kStartPosition, "start_position", "start position (benchmark)"},
    {BudgetSource::kStartVelocity, "start_velocity", "start velocity"},
    {BudgetSource::kDeflection, "gravity_deflection", "deflection of the vertical"},
    {BudgetSource::kOdometerScale, "odometer_scale", "odometer scale"},
    {BudgetSource::kMountingHeading, "mounting_heading", "mounting angle, heading"},
    {BudgetSource::kMountingPitch, "mounting_pitch", "mounting angle, pitch"},
    {BudgetSource::kScaleNoise, "scale_noise", "noise of the odometer's scale"},
    {BudgetSource::kSideSlip, "side_slip", "side slip"},
    {BudgetSource::kQuantisation, "quantisation", "quantisation of the odometer"},
    {BudgetSource::kAttitudeBias, "heading_bias", "heading sensor, bias"},
    {BudgetSource::kAttitudeDrift, "heading_drift", "heading sensor, drift"},
    {BudgetSource::kAttitudeNoise, "heading_noise", "heading sensor, noise"},
    {BudgetSource::kMapFormula, "map_formula", "formula of the reckoning"},
};

// The moving errors: psi 0-2, dv 3-5, dr 6-8 of the inertial solution on ECEF axes [EST-1], dd 9-11
// of the reckoned position, 12 the heading sensor's; 13-15 a source's own states.
constexpr int kPsi = 0, kDv = 3, kDr = 6, kDd = 9, kHead = 12, kOwn = 13, kAll = 16;
constexpr int kColumns = 32;  // constants: one column each, zeros beyond those in use

struct alignas(64) Matrix {
  double m[kAll][kAll]{};
};
struct alignas(64) Columns {
  double m[kAll][kColumns]{};
};
template <class F>
void put(Matrix& a, int row, int column, const Block3<>& b, F&& map) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a.m[row + i][column + j] = map(b.m[i][j]);
}
void put(Matrix& a, int row, int column, const Block3<>& b) {
  put(a, row, column, b, [](double x) { return x; });
}
// r = a b for square matrices: rows are two vectors of eight, or four of four.
void multiply(const Matrix& a, const Matrix& b, Matrix& r) {
  for (int i = 0; i < kAll; ++i) {
    double sum[kAll]{};
    for (int k = 0; k < kAll; ++k) {
      const double x = a.m[i][k];
      if (x == 0) continue;  // most of a transition is
      for (int j = 0; j < kAll; ++j) sum[j] += x * b.m[k][j];
    }
    for (int j = 0; j < kAll; ++j) r.m[i][j] = sum[j];
  }
}
// P <- A P A^T.
void sandwich(const Matrix& a, Matrix& p) {
  Matrix ap, t;
  multiply(a, p, ap);
  for (int i = 0; i < kAll; ++i)
    for (int j = 0; j < kAll; ++j) t.m[j][i] = ap.m[i][j];
  multiply(a, t, p);  // A (A P)^T = A P A^T, P symmetric
}

}  // namespace

std::string_view budget_source_name(BudgetSource s) {
  return kNames[static_cast<std::size_t>(s)].name;
}
std::string_view budget_source_words(BudgetSource s) {
  return kNames[static_cast<std::size_t>(s)].words;
}
SourceVariance total(const BudgetRow& row) {
  SourceVariance t;
  for (const auto& s : row) {
    t.ee += s.ee, t.nn += s.nn, t.en += s.en;
    t.vee += s.vee, t.vnn += s.vnn, t.psi_up += s.psi_up, t.heading += s.heading;
    t.dee += s.dee, t.dnn += s.dnn, t.den += s.den;
  }
  return t;
}

struct CovarianceBudget::Impl {
  struct Noise {
    BudgetSource source;
    Matrix P;
  };
  struct Constant {
    BudgetSource source;
    int first, count;
  };
  std::vector<Noise> noises;
  std::vector<Constant> constants;
  Columns Z;
  EcefState<double> at;
  Vec<Ecef> n, east, north, heading_unit, first_unit, way_unit;
  double tan_over_n = 0, t = 0;
  bool moved = false;

  // Level axes; at a pole those of longitude 0, which serve variances as well as any.
  void axes(const Ellipsoid& ell) {
    const auto p = to_geodetic(ell, at.r);
    const auto c = geographic_axes(p.lat, p.lon);
    east = {c.m[0][0], c.m[0][1], c.m[0][2]};
    north = {c.m[1][0], c.m[1][1], c.m[1][2]};
    n = {c.m[2][0], c.m[2][1], c.m[2][2]};
    tan_over_n = std::tan(p.lat) / (prime_vertical_radius(ell, std::sin(p.lat)) + p.h);
  }
  Noise* noise(BudgetSource s) {
    for (auto& x : noises)
      if (x.source == s) return &x;
    return nullptr;
  }
};

CovarianceBudget::~CovarianceBudget() = default;

CovarianceBudget::CovarianceBudget(const BudgetConfig& config)
    : config_(config), impl_(std::make_unique<Impl>()) {
  const auto& e = config.errors;
  const std::pair<BudgetSource, double> given[] = {
      {BudgetSource::kGyroBias, e.gyro_bias},
      {BudgetSource::kGyroScale, e.gyro_scale},
      {BudgetSource::kGyroNoise, e.gyro_noise},
      {BudgetSource::kGyroWalk, e.gyro_walk},
      {BudgetSource::kAccelBias, e.accel_bias},
      {BudgetSource::kAccelScale, e.accel_scale},
      {BudgetSource::kAccelNoise, e.accel_noise},
      {BudgetSource::kAccelWalk, e.accel_walk},
      {BudgetSource::kLevel, e.level},
      {BudgetSource::kHeading, e.heading},
      {BudgetSource::kStartPosition, e.position},
      {BudgetSource::kStartVelocity, e.velocity},
      {BudgetSource::kDeflection, e.deflection},
      {BudgetSource::kOdometerScale, e.scale},
      {BudgetSource::kMountingHeading, e.mounting_heading},
      {BudgetSource::kMountingPitch, e.mounting_pitch},
      {BudgetSource::kScaleNoise, e.scale_noise},
      {BudgetSource::kSideSlip, e.side_slip},
      {BudgetSource::kQuantisation, e.quantisation},
      {BudgetSource::kAttitudeBias, e.attitude_bias},
      {BudgetSource::kAttitudeDrift, e.attitude_drift},
      {BudgetSource::kAttitudeNoise, e.attitude_noise}};
  int column = 0;
  for (const auto& [source, sigma] : given) {
    if (!(sigma >= 0 && std::isfinite(sigma)))
      throw Error(ErrorKind::kInput,
                  fmt::format("a standard deviation is never negative: at least 0 expected, found "
                              "{:g}",
                              sigma),
                  std::string(budget_source_name(source)));
    if (sigma == 0) continue;
    sources_.push_back(source);
    int columns = 0;
    switch (source) {
      case BudgetSource::kGyroBias:
        columns = e.gyro_bias_tau > 0 ? 0 : 3;
        break;
      case BudgetSource::kAccelBias:
        columns = e.accel_bias_tau > 0 ? 0 : 3;
        break;
      case BudgetSource::kGyroScale:
      case BudgetSource::kAccelScale:
        columns = 3;
        break;
      case BudgetSource::kLevel:
      case BudgetSource::kStartPosition:
      case BudgetSource::kStartVelocity:
        columns = 2;
        break;
      case BudgetSource::kHeading:
      case BudgetSource::kOdometerScale:
      case BudgetSource::kMountingHeading:
      case BudgetSource::kMountingPitch:
      case BudgetSource::kAttitudeBias:
      case BudgetSource::kAttitudeDrift:
        columns = 1;
        break;
      default:
        break;
    }
    if (columns == 0) {
      impl_->noises.push_back({source, {}});
    } else {
      impl_->constants.push_back({source, column, columns});
      column += columns;
    }
  }
  if (!(e.odometer_interval > 0 && e.deflection_length > 0))
    throw Error(ErrorKind::kInput, "a positive odometer interval and correlation length expected",
                "budget");
}

void CovarianceBudget::start(const EcefState<double>& state) {
  Impl& s = *impl_;
  const auto& e = config_.errors;
  s.at = state;
  s.axes(config_.ellipsoid);
  const double cos_lat = std::hypot(s.n.x, s.n.y);
  if ((config_.self_aligned || config_.true_heading) && cos_lat < 0.1 * deg)
    throw Error(ErrorKind::kInput,
                "at a pole a heading is neither found from gyros nor counted from north: give the "
                "attitude, and count without true headings",
                "budget");
  const auto C = to_matrix(state.q_eb);
  const auto p = to_normal(config_.ellipsoid, state.r);
  const double g = normal_gravity(config_.ellipsoid, s.n.z, p.h), w = config_.ellipsoid.w_ie;
  // What a unit error of each sensor axis does to the attitude found with it [EST-14].
  const auto by_force = [&](const Vec<Ecef>& a) {
    const Vec<Ecef> level = (1.0 / g) * cross(s.n, a);
    const double up = (s.n.z / cos_lat) * dot(s.north, level);
    return level + up * s.n;
  };
  const auto by_rate = [&](const Vec<Ecef>& r) { return (-dot(s.east, r) / (w * cos_lat)) * s.n; };
  const auto set = [&](int column, int row, const Vec<Ecef>& v) {
    s.Z.m[row][column] = v.x, s.Z.m[row + 1][column] = v.y, s.Z.m[row + 2][column] = v.z;
  };
  const auto axis = [&](int i) { return Vec<Ecef>{C.m[0][i], C.m[1][i], C.m[2][i]}; };
  s.Z = {};
  for (const auto& c : s.constants) {
    const auto k = c.first;
    switch (c.source) {
      case BudgetSource::kGyroBias:
        for (int i = 0; config_.self_aligned && i < 3; ++i)
          set(k + i, kPsi, e.gyro_bias * by_rate(axis(i)));
        break;
      case BudgetSource::kAccelBias:
        for (int i = 0; config_.self_aligned && i < 3; ++i)
          set(k + i, kPsi, e.accel_bias * by_force(axis(i)));
        break;
      case BudgetSource::kLevel:
        set(k, kPsi, e.level * s.east);
        set(k + 1, kPsi, e.level * s.north);
        break;
      case BudgetSource::kHeading:
        set(k, kPsi, e.heading * s.n);
        break;
      case BudgetSource::kStartPosition:
        for (int row : {kDr, kDd}) {
          set(k, row, e.position * s.east);
          set(k + 1, row, e.position * s.north);
        }
        break;
      case BudgetSource::kStartVelocity:
        set(k, kDv, e.velocity * s.east);
        set(k + 1, kDv, e.velocity * s.north);
        break;
      case BudgetSource::kAttitudeBias:
        s.Z.m[kHead][k] = e.attitude_bias;
        break;
      default:
        break;
    }
  }
  // Sources with states of their own start with them, and with the alignment made of them.
  const auto correlated = [&](Matrix& P, double sigma, auto&& attitude) {
    P = {};
    Block3<> a;
    for (int i = 0; i < 3; ++i) {
      const Vec<Ecef> v = attitude(i);
      a.m[0][i] = v.x, a.m[1][i] = v.y, a.m[2][i] = v.z;
      P.m[kOwn + i][kOwn + i] = sigma * sigma;
    }
    put(P, kPsi, kOwn, sigma * sigma * a);
    put(P, kOwn, kPsi, sigma * sigma * transpose(a));
    put(P, kPsi, kPsi, sigma * sigma * (a * transpose(a)));
  };
  const bool self = config_.self_aligned;
  for (auto& x : s.noises) {
    x.P = {};
    const Vec<Ecef> none{};
    if (x.source == BudgetSource::kGyroBias)
      correlated(x.P, e.gyro_bias, [&](int i) { return self ? by_rate(axis(i)) : none; });
    if (x.source == BudgetSource::kAccelBias)
      correlated(x.P, e.accel_bias, [&](int i) { return self ? by_force(axis(i)) : none; });
    if (x.source == BudgetSource::kDeflection)  // own states: horizontal pull over g, ECEF axes
      correlated(x.P, e.deflection, [&](int i) {
        Vec<Ecef> a{i == 0 ? g : 0.0, i == 1 ? g : 0.0, i == 2 ? g : 0.0};
        return self ? by_force(a - dot(a, s.n) * s.n) : none;
      });
  }
  s.t = 0;
  s.moved = false;
}

void CovarianceBudget::step(const EcefState<double>& next, double dt) {
  Impl& s = *impl_;
  const auto& e = config_.errors;
  const EcefState<double> before = s.at;
  const Vec<Ecef> w_ie{0, 0, config_.ellipsoid.w_ie};
  // The motion at mid-step.
  const Vec<Ecef> v = 0.5 * (before.v + next.v);
  const Vec<Ecef> way = dt * v;  // a filter's position may jump at a fix; the vehicle did not
  s.at.r = before.r + 0.5 * (next.r - before.r);
  s.axes(config_.ellipsoid);
  const auto place = to_normal(config_.ellipsoid, s.at.r);
  const double gamma = normal_gravity(config_.ellipsoid, s.n.z, place.h);
  const Vec<Ecef> f = (1.0 / dt) * (next.v - before.v) + 2.0 * cross(w_ie, v) + gamma * s.n;
  const auto &q0 = before.q_eb, &q1 = next.q_eb;
  const double sign =
      q0.w * q1.w + q0.x * q1.x + q0.y * q1.y + q0.z * q1.z < 0 ? -1.0 : 1.0;  // q and -q are one
  const Quat<Ecef, Body> mid = normalized(Quat<Ecef, Body>{q0.w + sign * q1.w, q0.x + sign * q1.x,
                                                           q0.y + sign * q1.y, q0.z + sign * q1.z});
  const auto turn = conjugate(q0) * q1;  // the turn against the Earth, small
  const double twice = turn.w < 0 ? -2.0 : 2.0;
  ErrorPoint<Ecef> point;
  point.C_mb = to_matrix(mid);
  point.v = v;
  point.w_ie = w_ie;
  const auto back = transpose(point.C_mb);
  point.w = back * w_ie + (twice / dt) * Vec<Body>{turn.x, turn.y, turn.z};
  point.f = back * f;
  point.gradient = gravity_gradient(config_.ellipsoid, s.n, place.h);
  const auto T = error_transition(point, dt);  // [EST-4]

  Matrix F;
  // [EST-4] with what it leaves out at second order: over hours of 0.1 s it would let Schuler's
  // oscillation grow by ws^2 dt t/4, and tilts act half a step late.
  const Block3<> I = identity3<double>(), turned = (-dt) * skew(w_ie);
  const Block3<> psi_psi = I + turned + 0.5 * (turned * turned);
  put(F, kPsi, kPsi, psi_psi);
  put(F, kDv, kPsi, 0.5 * (T.dv_psi * (I + psi_psi)));
  put(F, kDv, kDv, I + 2.0 * turned + 2.0 * (turned * turned) + (0.5 * dt * dt) * point.gradient);
  put(F, kDv, kDr, T.dv_dr);
  put(F, kDr, kPsi, T.dr_psi);
  put(F, kDr, kDv, dt * identity3<double>());
  put(F, kDr, kDr, T.dr_dr);
  put(F, kDd, kDd, identity3<double>());
  F.m[kHead][kHead] = 1;

  // The reckoned way: C~ = (I - [psi]) C turns it by -psi; of that the horizontal plane sees only
  // the part about up. Counted from true north, the error of the azimuth is that of the axes too:
  // tan L/N of the way east of where the heading, or the reckoning, believes to be [EST-2].
  const Vec<Ecef> flat = way - dot(way, s.n) * s.n;
  const Vec<Ecef> aside = cross(flat, s.n);  // d(way)/d(azimuth error, clockwise)
  const double tan_n = config_.true_heading ? s.tan_over_n : 0.0;
  const Vec<Ecef> by_psi = config_.attitude_sensor ? Vec<Ecef>{} : s.n;
  const auto row = [&](const Vec<Ecef>& a, const Vec<Ecef>& b, int column, double k) {
    const double x[3] = {a.x, a.y, a.z}, y[3] = {b.x, b.y, b.z};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) F.m[kDd + i][column + j] += k * x[i] * y[j];
  };
  row(aside, by_psi, kPsi, 1.0);
  if (!config_.attitude_sensor) row(aside, s.east, kDr, tan_n);
  row(aside, s.east, kDd, -tan_n);
  if (config_.attitude_sensor)
    for (int i = 0; i < 3; ++i) F.m[kDd + i][kHead] = i == 0 ? aside.x : i == 1 ? aside.y : aside.z;

  // A sensor's error over the step: columns of the three axes. The reckoning sees half of what the
  // attitude gains.
  struct Input {
    double m[kHead + 1][3]{};
  };
  const auto input = [&](const Block3<>* psi, const Block3<>* dv, const Block3<>* dr) {
    Input g;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        if (psi) g.m[kPsi + i][j] = psi->m[i][j];
        if (dv) g.m[kDv + i][j] = dv->m[i][j];
        if (dr) g.m[kDr + i][j] = dr->m[i][j];
      }
    if (psi && !config_.attitude_sensor)
      for (int j = 0; j < 3; ++j) {
        const double up =
            0.5 * (s.n.x * psi->m[0][j] + s.n.y * psi->m[1][j] + s.n.z * psi->m[2][j]);
        g.m[kDd][j] = aside.x * up, g.m[kDd + 1][j] = aside.y * up, g.m[kDd + 2][j] = aside.z * up;
      }
    return g;
  };
  const Block3<> plane = identity3<double>() - outer(s.n, s.n);
  const Block3<> pull = (dt * gamma) * plane, pull_dr = (0.5 * dt) * pull;
  const Input by_gyro = input(&T.psi_bg, &T.dv_bg, nullptr);
  const Input by_accel = input(nullptr, &T.dv_ba, &T.dr_ba);
  const Input by_gyro_scale = input(&T.psi_sg, &T.dv_sg, nullptr);
  const Input by_accel_scale = input(nullptr, &T.dv_sa, &T.dr_sa);
  const Input by_deflection = input(nullptr, &pull, &pull_dr);

  // Known height: the vertical errors of both positions and of the velocity are taken out.
  const auto flatten = [&](auto& m, int columns) {
    const double u[3] = {s.n.x, s.n.y, s.n.z};
    for (int first : {kDv, kDr, kDd}) {
      if (first != kDd && !config_.height_known) continue;
      for (int j = 0; j < columns; ++j) {
        const double up = u[0] * m[first][j] + u[1] * m[first + 1][j] + u[2] * m[first + 2][j];
        for (int i = 0; i < 3; ++i) m[first + i][j] -= u[i] * up;
      }
    }
  };
  flatten(F.m, kAll);

  // Constants: Z <- F Z + G.
  Columns Z;
  for (int i = 0; i <= kHead; ++i) {
    double sum[kColumns]{};
    for (int k = 0; k <= kHead; ++k) {
      const double x = F.m[i][k];
      if (x == 0) continue;
      for (int j = 0; j < kColumns; ++j) sum[j] += x * s.Z.m[k][j];
    }
    for (int j = 0; j < kColumns; ++j) Z.m[i][j] = sum[j];
  }
  Columns G;
  const auto set = [&](const Input& g, int first, double sigma) {
    for (int i = 0; i <= kHead; ++i)
      for (int j = 0; j < 3; ++j) G.m[i][first + j] += sigma * g.m[i][j];
  };
  const auto set_way = [&](const Vec<Ecef>& d, int column, double k) {
    G.m[kDd][column] += k * d.x, G.m[kDd + 1][column] += k * d.y, G.m[kDd + 2][column] += k * d.z;
  };
  const double length = norm(flat);
  for (const auto& c : s.constants) switch (c.source) {
      case BudgetSource::kGyroBias:
        set(by_gyro, c.first, e.gyro_bias);
        break;
      case BudgetSource::kGyroScale:
        set(by_gyro_scale, c.first, e.gyro_scale);
        break;
      case BudgetSource::kAccelBias:
        set(by_accel, c.first, e.accel_bias);
        break;
      case BudgetSource::kAccelScale:
        set(by_accel_scale, c.first, e.accel_scale);
        break;
      case BudgetSource::kOdometerScale:
        set_way(flat, c.first, e.scale);
        break;
      case BudgetSource::kMountingHeading:
        set_way(aside, c.first, e.mounting_heading);
        break;
      case BudgetSource::kMountingPitch: {
        // The way turned about the vehicle's right axis: up in the vehicle, which lies level only
        // where the road does.
        const auto& m = point.C_mb.m;
        const double forward = way.x * m[0][1] + way.y * m[1][1] + way.z * m[2][1];
        set_way(Vec<Ecef>{m[0][2], m[1][2], m[2][2]}, c.first, forward * e.mounting_pitch);
        break;
      }
      case BudgetSource::kAttitudeDrift:
        G.m[kHead][c.first] += e.attitude_drift * dt;
        set_way(aside, c.first, 0.5 * e.attitude_drift * dt);
        break;
      default:
        break;
    }
  flatten(G.m, kColumns);
  for (int i = 0; i <= kHead; ++i)
    for (int j = 0; j < kColumns; ++j) s.Z.m[i][j] = Z.m[i][j] + G.m[i][j];

  // Random sources: P <- A P A^T + Q, A with the columns of the source's own states.
  for (auto& x : s.noises) {
    Matrix A = F;
    const auto own = [&](const Input* g, double decay) {
      for (int j = 0; j < 3; ++j) {
        if (g)
          for (int i = 0; i <= kHead; ++i) A.m[i][kOwn + j] = g->m[i][j];
        A.m[kOwn + j][kOwn + j] = decay;
      }
      flatten(A.m, kAll);
    };
    Matrix Q;
    const auto own_noise = [&](double q) {
      for (int j = 0; j < 3; ++j) Q.m[kOwn + j][kOwn + j] = q;
    };
    const auto along = [&](const Vec<Ecef>& d, double k) {
      const double y[3] = {d.x, d.y, d.z};
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) Q.m[kDd + i][kDd + j] += k * y[i] * y[j];
    };
    const auto markov = [&](const Input& g, double sigma, double tau) {
      const double decay = std::exp(-dt / tau);
      own(&g, decay);
      own_noise(sigma * sigma * (1 - decay * decay));
    };
    switch (x.source) {
      case BudgetSource::kGyroNoise: {
        const auto q = error_noise(e.gyro_noise, 0.0, dt, dt * f);
        for (int i = 0; i < 3; ++i) Q.m[kPsi + i][kPsi + i] = q.psi;
        put(Q, kDv, kPsi, q.dv_psi);
        put(Q, kPsi, kDv, transpose(q.dv_psi));
        if (!config_.attitude_sensor) {
          // The reckoning of the step sees the mean of the attitude's walk: half with it, a third
          // in itself.
          along(aside, q.psi / 3.0);
          const double a[3] = {aside.x, aside.y, aside.z}, u[3] = {s.n.x, s.n.y, s.n.z};
          for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
              Q.m[kDd + i][kPsi + j] = Q.m[kPsi + j][kDd + i] = 0.5 * q.psi * a[i] * u[j];
        }
        break;
      }
      case BudgetSource::kAccelNoise: {
        const auto q = error_noise(0.0, e.accel_noise, dt, dt * f);
        put(Q, kDv, kDv, q.dv * plane);
        put(Q, kDr, kDr, q.dr * plane);
        put(Q, kDr, kDv, q.dr_dv * plane);
        put(Q, kDv, kDr, q.dr_dv * plane);
        if (!config_.height_known)
          for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
              const double o = i == j ? 1.0 : 0.0;
              Q.m[kDv + i][kDv + j] = q.dv * o, Q.m[kDr + i][kDr + j] = q.dr * o;
              Q.m[kDr + i][kDv + j] = Q.m[kDv + i][kDr + j] = q.dr_dv * o;
            }
        break;
      }
      case BudgetSource::kGyroBias:
        markov(by_gyro, e.gyro_bias, e.gyro_bias_tau);
        break;
      case BudgetSource::kAccelBias:
        markov(by_accel, e.accel_bias, e.accel_bias_tau);
        break;
      case BudgetSource::kGyroWalk:
        own(&by_gyro, 1.0);
        own_noise(e.gyro_walk * e.gyro_walk * dt);
        break;
      case BudgetSource::kAccelWalk:
        own(&by_accel, 1.0);
        own_noise(e.accel_walk * e.accel_walk * dt);
        break;
      case BudgetSource::kDeflection:
        if (length > 0) {
          markov(by_deflection, e.deflection, dt * e.deflection_length / length);
        } else {
          own(&by_deflection, 1.0);
        }
        break;
      // White in each interval T of the odometer: N intervals of way ds/N add up to ds^2/N.
      case BudgetSource::kScaleNoise:
        along(flat, e.scale_noise * e.scale_noise * (e.odometer_interval / dt));
        break;
      case BudgetSource::kSideSlip:
        along(aside, e.side_slip * e.side_slip * (e.odometer_interval / dt));
        break;
      case BudgetSource::kQuantisation: {
        // (V-43): q^2/12 of every change of the direction in which a remainder is kept.
        if (length > 1e-6) {
          const Vec<Ecef> unit = (1.0 / length) * flat;
          if (s.moved) {
            const Vec<Ecef> d = unit - s.way_unit;
            along(d,
                  e.quantisation * e.quantisation / 12.0 * std::min(1.0, e.odometer_interval / dt));
          } else {
            s.first_unit = unit;
            s.moved = true;
          }
          s.way_unit = unit;
        }
        break;
      }
      case BudgetSource::kAttitudeNoise: {
        const double q = e.attitude_noise * e.attitude_noise * dt;
        Q.m[kHead][kHead] = q;
        along(aside, q / 3.0);
        const double a[3] = {aside.x, aside.y, aside.z};
        for (int i = 0; i < 3; ++i) Q.m[kDd + i][kHead] = Q.m[kHead][kDd + i] = 0.5 * q * a[i];
        break;
      }
      default:
        break;
    }
    sandwich(A, x.P);
    for (int i = 0; i < kAll; ++i)
      for (int j = 0; j < kAll; ++j) x.P.m[i][j] += Q.m[i][j];
  }
  s.at = next;
  s.t += dt;
}

BudgetRow CovarianceBudget::row(std::array<double, 2> map) const {
  Impl& s = *impl_;
  s.axes(config_.ellipsoid);
  BudgetRow r{};
  const auto component = [](const auto& m, int first, const Vec<Ecef>& u, int j) {
    return u.x * m[first][j] + u.y * m[first + 1][j] + u.z * m[first + 2][j];
  };
  // The azimuth of the attitude against the axes where it believes to be [EST-2].
  const double tan_n = config_.true_heading ? s.tan_over_n : 0.0;
  for (const auto& c : s.constants) {
    SourceVariance& v = r[static_cast<std::size_t>(c.source)];
    for (int j = c.first; j < c.first + c.count; ++j) {
      const double e = component(s.Z.m, kDr, s.east, j), n = component(s.Z.m, kDr, s.north, j);
      v.ee += e * e, v.nn += n * n, v.en += e * n;
      const double ve = component(s.Z.m, kDv, s.east, j), vn = component(s.Z.m, kDv, s.north, j);
      v.vee += ve * ve, v.vnn += vn * vn;
      const double up = component(s.Z.m, kPsi, s.n, j), h = up + tan_n * e;
      v.psi_up += up * up, v.heading += h * h;
      const double de = component(s.Z.m, kDd, s.east, j), dn = component(s.Z.m, kDd, s.north, j);
      v.dee += de * de, v.dnn += dn * dn, v.den += de * dn;
    }
  }
  const auto form = [](const Matrix& P, int a, const Vec<Ecef>& x, int b, const Vec<Ecef>& y) {
    const double u[3] = {x.x, x.y, x.z}, w[3] = {y.x, y.y, y.z};
    double sum = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) sum += u[i] * P.m[a + i][b + j] * w[j];
    return sum;
  };
  for (const auto& x : s.noises) {
    SourceVariance& v = r[static_cast<std::size_t>(x.source)];
    v.ee = form(x.P, kDr, s.east, kDr, s.east);
    v.nn = form(x.P, kDr, s.north, kDr, s.north);
    v.en = form(x.P, kDr, s.east, kDr, s.north);
    v.vee = form(x.P, kDv, s.east, kDv, s.east);
    v.vnn = form(x.P, kDv, s.north, kDv, s.north);
    v.psi_up = form(x.P, kPsi, s.n, kPsi, s.n);
    v.heading = v.psi_up + tan_n * tan_n * v.ee + 2 * tan_n * form(x.P, kPsi, s.n, kDr, s.east);
    v.dee = form(x.P, kDd, s.east, kDd, s.east);
    v.dnn = form(x.P, kDd, s.north, kDd, s.north);
    v.den = form(x.P, kDd, s.east, kDd, s.north);
    if (x.source == BudgetSource::kQuantisation && s.moved) {
      // The first and the last remainder (V-43).
      const double q = config_.errors.quantisation * config_.errors.quantisation / 12.0;
      for (const Vec<Ecef>& u : {s.first_unit, s.way_unit}) {
        const double e = dot(u, s.east), n = dot(u, s.north);
        v.dee += q * e * e, v.dnn += q * n * n, v.den += q * e * n;
      }
    }
  }
  SourceVariance& m = r[static_cast<std::size_t>(BudgetSource::kMapFormula)];
  m.dee = map[0] * map[0], m.dnn = map[1] * map[1], m.den = map[0] * map[1];
  return r;
}

}  // namespace loxo
