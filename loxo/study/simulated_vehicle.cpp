// SPDX-License-Identifier: Apache-2.0
#include "loxo/study/simulated_vehicle.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/earth/gravity.hpp"
#include "loxo/estimate/measurements.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/ins/alignment.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/random.hpp"
#include "loxo/num/rotation_forms.hpp"
#include "loxo/num/units.hpp"
#include "loxo/study/drive_truth.hpp"

namespace loxo {
namespace {

enum : std::uint64_t { kConstant, kStart, kImu, kWheel, kSlip, kFixes, kWalk };
// Below it a slip in metres would be an angle that no vehicle has.
constexpr double kSlowest = 1.0;  // m/s

long count(double interval, double dt) { return std::max(1L, std::lround(interval / dt)); }

}  // namespace

VehicleErrors tactical_vehicle() {
  VehicleErrors e;
  e.gyro_bias = 1 * deg_per_h, e.gyro_noise = 0.05 * deg_per_sqrt_h;
  e.accel_bias = 300 * ug, e.accel_noise = 0.02 * mps_per_sqrt_h;
  e.gyro_bias_walk = 0.3 * e.gyro_bias * std::sqrt(2.0 / 3600);
  e.accel_bias_walk = 0.3 * e.accel_bias * std::sqrt(2.0 / 3600);
  e.scale_std = 0.03, e.eps_h_std = e.eps_p_std = 2 * deg, e.scale_walk = 3e-5;
  e.scale_noise = 1e-3, e.distance_noise = 0.01, e.quantisation = 0.001;
  e.lever_std = 0.3, e.tau_std = 0.1;
  e.side = 0.02, e.up = 0.03, e.side_turn = 0.02;
  e.level_std = 0.003 * deg, e.heading_std = 0.5 * deg;
  e.position_std = 1, e.velocity_std = 0.02;
  return e;
}

NavigatorConfig filter_config(const VehicleErrors& e, double dt) {
  NavigatorConfig c;
  c.ellipsoid = wgs84();
  c.imu_interval = dt;
  c.gyro_noise = e.gyro_noise, c.gyro_bias = e.gyro_bias;
  c.accel_noise = e.accel_noise, c.accel_bias = e.accel_bias;
  c.scale_std = e.scale_std, c.scale_walk = e.scale_walk;
  c.quantisation = e.quantisation, c.scale_noise = e.scale_noise;
  c.nhc_side = e.side, c.nhc_up = e.up, c.nhc_turn = e.side_turn, c.nhc_std = 1e-4;
  c.distance_std = e.distance_noise, c.stamp_jitter = 0;
  c.use_zupt = false;
  c.tau_std = e.tau_std;
  expect_noise(c.standstill, e.gyro_noise, e.accel_noise, dt);
  return c;
}

std::size_t RouteTruth::at(double t) const {
  return static_cast<std::size_t>(
      std::clamp(std::lround(t / dt), 0L, static_cast<long>(state.size()) - 1));
}

RouteTruth route_truth(const Trajectory& trajectory, double rate) {
  RouteTruth out;
  out.ellipsoid = trajectory.ellipsoid;
  out.dt = 1.0 / rate;
  const long n = std::lround(trajectory.duration() * rate);
  const auto size = static_cast<std::size_t>(n + 1);
  out.imu.reserve(size), out.state.reserve(size), out.turn.reserve(size);
  out.distance.reserve(size), out.speed.reserve(size);
  TrajectoryWalk walk(trajectory);
  const Vec<Ecef> w_ie{0, 0, trajectory.ellipsoid.w_ie};
  Vec<Body> turn, earth_before;
  for (long i = 0; i <= n; ++i) {
    ImuIncrement<double> u;
    if (i > 0) u = walk.to(static_cast<double>(i) / rate);
    const Truth truth = walk.truth();
    const Vec<Body> earth = transpose(to_matrix(truth.state.q_eb)) * w_ie;
    if (i > 0) turn = turn + u.dtheta - (0.5 * u.dt) * (earth + earth_before);
    earth_before = earth;
    out.imu.push_back(u);
    out.state.push_back(truth.state);
    out.distance.push_back(truth.distance);
    out.speed.push_back(norm(truth.state.v));
    out.turn.push_back(turn);
    out.w_ib.push_back(truth.w_ib);
  }
  return out;
}

SimulatedVehicle::SimulatedVehicle(const RouteTruth& route, const VehicleErrors& errors,
                                   std::uint64_t seed, std::uint64_t run)
    : route_(&route),
      e_(errors),
      seed_(seed),
      run_(run),
      per_second_(count(1.0, route.dt)),
      per_tick_(count(errors.tick_interval, route.dt)),
      per_noise_(count(errors.noise_interval, route.dt)),
      per_fix_(errors.fix_every > 0 ? count(errors.fix_every, route.dt) : 0) {
  const auto g = Stream<double>{seed, run, kConstant}.normals<16>(0);
  auto three = [&](std::size_t i, double s) {
    return Vec<Body>{s * g[i], s * g[i + 1], s * g[i + 2]};
  };
  NominalState& c = constants_;
  c.bg = three(0, e_.gyro_bias);
  c.ba = three(3, e_.accel_bias);
  c.scale = e_.scale + e_.scale_std * g[6];
  c.eps_h = e_.eps_h + e_.eps_h_std * g[7];
  c.eps_p = e_.eps_p_std * g[8];
  c.lever = three(9, e_.lever_std);
  c.tau = e_.tau_std * g[12];
  slow_ = e_.scale_slow * g[13];
  const MountingAxes m = mounting_axes(c.eps_h, c.eps_p);
  for (int i = 0; i < 3; ++i) {
    R_.m[i][0] = m.axis[i].x;
    R_.m[i][1] = m.axis[i].y;
    R_.m[i][2] = m.axis[i].z;
  }
  arm_ = R_ * c.lever;
  w_ = rate_at(0);
  align();
}

double SimulatedVehicle::t() const { return route_->dt * static_cast<double>(i_); }
double SimulatedVehicle::distance() const { return route_->distance[i_]; }

SimulatedVehicle::Swing SimulatedVehicle::swing(std::size_t i) const {
  // Mean 1 over the second, value and slope zero at its ends; the end of a second belongs to it.
  const double x = 2 * kPi * static_cast<double>(static_cast<long>(i) % per_second_) /
                   static_cast<double>(per_second_);
  return {(1 - std::cos(x)) * slip_,
          (2 * kPi * std::sin(x) / (route_->dt * static_cast<double>(per_second_))) * slip_};
}
Vec<Body> SimulatedVehicle::rate_at(std::size_t i) const {
  const Swing s = swing(i);
  // exp(-s) w of the way, and the swing's own rate by the right Jacobian to second order.
  return to_matrix(exp_rotation<Body, Body>(-s.angle)) * route_->w_ib[i] + s.rate -
         0.5 * cross(s.angle, s.rate) + (1.0 / 6.0) * cross(s.angle, cross(s.angle, s.rate));
}

NominalState SimulatedVehicle::truth() const {
  NominalState s = constants_;
  const EcefState<double>& x = route_->state[i_];
  s.t = t();
  const Quat<Ecef, Body> q = x.q_eb * conjugate(turned_);
  const Rot<Ecef, Body> C = to_matrix(q);
  const Vec<Body> w_eb = w_ - transpose(C) * Vec<Ecef>{0, 0, route_->ellipsoid.w_ie};
  s.r = x.r - C * arm_;
  s.v = x.v - C * cross(w_eb, arm_);
  s.q = normalized(q * to_quaternion(R_));
  return s;
}

// [EST-14] in its non-linear form: axes from the mean force and the mean rate at rest.
void SimulatedVehicle::align() {
  const Ellipsoid& ell = route_->ellipsoid;
  const NominalState truth = this->truth();
  const auto g = Stream<double>{seed_, run_, kStart}.normals<9>(0);
  const Geodetic<double> place = to_geodetic(ell, truth.r);
  const Rot<Geographic, Ecef> C_ne = geographic_axes(place.lat, place.lon);
  const Rot<Geographic, Body> C_nb = C_ne * to_matrix(truth.q);
  const double gamma = normal_gravity(ell, std::sin(place.lat), place.h);
  const Vec<Body> f = transpose(C_nb) * Vec<Geographic>{0, 0, gamma} + constants_.ba;
  const Vec<Body> w = transpose(to_matrix(truth.q)) * Vec<Ecef>{0, 0, ell.w_ie} + constants_.bg;
  // With a heading given, east is taken from the true axes and levelled anew.
  const Vec<Body> true_north{C_nb.m[1][0], C_nb.m[1][1], C_nb.m[1][2]};
  const Rot<Geographic, Body> A = coarse_static(e_.static_heading ? w : true_north, f);
  const Vec<Geographic> random{e_.level_std * g[0], e_.level_std * g[1], e_.heading_std * g[2]};
  start_ = NominalState{};
  start_.q = normalized(to_quaternion(transpose(C_ne)) *
                        exp_rotation<Geographic, Geographic>(-random) * to_quaternion(A));
  start_.r = truth.r + e_.position_std * Vec<Ecef>{g[3], g[4], g[5]};
  start_.v = truth.v + e_.velocity_std * Vec<Ecef>{g[6], g[7], g[8]};
  start_.scale = e_.scale;
  start_.eps_h = e_.eps_h;
  StartSigmas sigmas;
  sigmas.gyro_bias = e_.gyro_bias, sigmas.accel_bias = e_.accel_bias;
  sigmas.level = e_.level_std, sigmas.heading = e_.heading_std;
  sigmas.static_heading = e_.static_heading;
  sigmas.velocity = e_.velocity_std, sigmas.position = e_.position_std;
  sigmas.scale = e_.scale_std, sigmas.eps_h = e_.eps_h_std, sigmas.eps_p = e_.eps_p_std;
  sigmas.lever = e_.lever_std, sigmas.tau = e_.tau_std;
  P_ = loxo::start_covariance(ell, start_, sigmas);
}

bool SimulatedVehicle::next() {
  if (i_ + 1 >= route_->state.size()) return false;
  ++i_;
  const auto k = static_cast<std::uint64_t>(i_);
  const long i = static_cast<long>(i_);
  const double dt = route_->dt;
  const ImuIncrement<double>& u = route_->imu[i_];
  if ((i - 1) % per_second_ == 0) {  // a new second
    const auto g = Stream<double>{seed_, run_, kSlip}.normals<2>(k);
    const std::size_t middle =
        std::min(i_ + static_cast<std::size_t>(per_second_ / 2), route_->speed.size() - 1);
    const double speed = route_->speed[middle];
    const double rate = (route_->turn[middle].z - route_->turn[middle - 1].z) / dt;
    const double a = speed * rate;
    const double side = std::hypot(e_.side, e_.side_turn * a);
    Vec<Body> next{};
    if (speed > 0.01) {
      next.z = std::hypot(side / std::max(speed, kSlowest), e_.slip_angle) * g[0];
      next.x = e_.up / std::max(speed, kSlowest) * g[1];
    }
    slip_ = next;
    const auto w = Stream<double>{seed_, run_, kWalk}.normals<8>(k);
    constants_.bg = constants_.bg + e_.gyro_bias_walk * Vec<Body>{w[0], w[1], w[2]};
    constants_.ba = constants_.ba + e_.accel_bias_walk * Vec<Body>{w[3], w[4], w[5]};
    constants_.scale += e_.scale_walk * w[6];
    if (e_.scale_slow > 0) {
      const double decay = std::exp(-1.0 / e_.scale_slow_tau);
      slow_ = decay * slow_ + e_.scale_slow * std::sqrt(1 - decay * decay) * w[7];
    }
  }
  double noise[6];
  Stream<double>{seed_, run_, kImu}.fill(k, noise, 6);
  const double a = e_.gyro_noise * std::sqrt(dt), b = e_.accel_noise * std::sqrt(dt);
  imu_.t = t();
  imu_.dt = dt;
  // The body's turn over the step, and the force at its middle; at the IMU, less what the arm's own
  // turning takes.
  const Quat<Body, Body> before = turned_;
  const Vec<Body> w_before = w_, angle = swing(i_).angle;
  turned_ = exp_rotation<Body, Body>(-angle);
  w_ = rate_at(i_);
  const Vec<Body> turn =
      rotation_vector(before * exp_rotation<Body, Body>(u.dtheta) * conjugate(turned_));
  const Vec<Body> half = 0.5 * (angle + rotation_vector(conjugate(before)));
  const Vec<Body> w = turn * (1 / dt);
  const Vec<Body> dv = to_matrix(exp_rotation<Body, Body>(-half)) * u.dv -
                       cross(w_ - w_before, arm_) - dt * cross(w, cross(w, arm_));
  imu_.dtheta =
      transpose(R_) * turn + constants_.bg * dt + a * Vec<Body>{noise[0], noise[1], noise[2]};
  imu_.dv = transpose(R_) * dv + constants_.ba * dt + b * Vec<Body>{noise[3], noise[4], noise[5]};

  if ((i - 1) % per_noise_ == 0 && e_.scale_noise > 0)
    white_ = e_.scale_noise * Stream<double>{seed_, run_, kWheel}.normal(2 * k);
  has_tick_ = i % per_tick_ == 0;
  if (has_tick_) {
    // Way of the wheel at t - tau.
    const double at = std::clamp(imu_.t - constants_.tau, 0.0, route_->duration()) / dt;
    const std::size_t j = std::min(static_cast<std::size_t>(at), route_->state.size() - 2);
    const double part = at - static_cast<double>(j);
    const double now = (1 - part) * route_->distance[j] + part * route_->distance[j + 1];
    indicated_ += (constants_.scale + slow_ * constants_.scale) * (1 + white_) * (now - last_way_);
    if (e_.distance_noise > 0 && now > last_way_)
      indicated_ += e_.distance_noise * std::sqrt(e_.tick_interval) *
                    Stream<double>{seed_, run_, kWheel}.normal(2 * k + 1);
    last_way_ = now;
    const double q = e_.quantisation, counted = q > 0 ? std::floor(indicated_ / q) * q : indicated_;
    tick_ = {imu_.t, counted - told_, false};
    told_ = counted;
  }
  has_fix_ = per_fix_ > 0 && i % per_fix_ == 0;
  if (has_fix_) {
    const auto g = Stream<double>{seed_, run_, kFixes}.normals<3>(k);
    const Geodetic<double> p =
        to_geodetic(route_->ellipsoid, truth().r + e_.fix_std * Vec<Ecef>{g[0], g[1], g[2]});
    fix_ = Fix{};
    fix_.t = imu_.t, fix_.lat = p.lat, fix_.lon = p.lon, fix_.h = p.h;
    fix_.std_e = fix_.std_n = fix_.std_u = e_.fix_std;
  }
  return true;
}

Nees nees_of(const NominalState& s, const Covariance<kStates>& P, const NominalState& truth) {
  using Vector = Eigen::Matrix<double, 15, 1>;
  const Quat<Ecef, Ecef> d = s.q * conjugate(truth.q);  // C~ C^T = exp(-[psi])
  const Vec<Ecef> psi = -rotation_vector(d);
  const Vec<Ecef> dv = s.v - truth.v, dr = s.r - truth.r;
  const Vec<Body> g = truth.bg - s.bg, a = truth.ba - s.ba;
  Vector e;
  e << psi.x, psi.y, psi.z, dv.x, dv.y, dv.z, dr.x, dr.y, dr.z, g.x, g.y, g.z, a.x, a.y, a.z;
  Eigen::Matrix<double, 15, 15> M;
  for (int i = 0; i < 15; ++i)
    for (int j = 0; j < 15; ++j) M(i, j) = P.p[i][j];
  const Vector scale = M.diagonal().cwiseSqrt().cwiseInverse();
  M = (scale.asDiagonal() * M * scale.asDiagonal()).eval();
  e = (scale.array() * e.array()).matrix();
  Nees out;
  auto three = [&](int at) {
    const Eigen::Vector3d x = e.segment<3>(at);
    return x.dot(M.block<3, 3>(at, at).ldlt().solve(x));
  };
  out.attitude = three(0), out.velocity = three(3), out.position = three(6);
  const Eigen::Matrix<double, 9, 1> nine = e.head<9>();
  out.nine = nine.dot(M.topLeftCorner<9, 9>().ldlt().solve(nine));
  out.fifteen = e.dot(M.ldlt().solve(e));
  return out;
}

Trajectory acceptance_route(const char* name, double length, double rest) {
  const std::string route = name;
  if (route != "straight" && route != "mixed" && route != "closed")
    throw Error(ErrorKind::kUsage, "expected straight, mixed or closed, found '" + route + "'",
                "route");
  // The campaigns' own.
  Trajectory t = drive_scenario(TomlTable::parse("route = \"" + route +
                                                     "\"\nlat = \"40 deg\"\nlon = \"20 deg\"\n"
                                                     "heading = \"30 deg\"\nspeed = \"20 m/s\"\n"
                                                     "duration = \"" +
                                                     std::to_string(length) + " s\"\n",
                                                 "acceptance route"))
                     .trajectory;
  if (rest > 0) t.legs.insert(t.legs.begin(), {rest, 0, 0, true});
  return t;
}

}  // namespace loxo
