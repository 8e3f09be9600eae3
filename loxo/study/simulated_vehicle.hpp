// SPDX-License-Identifier: Apache-2.0
// A road vehicle with an inertial unit and a wheel, run after run on one truth (sim/trajectory):
// constants drawn from their stated sigmas, noise by counter, everything that is a rotation done as
// a rotation. Nothing here knows a filter's linear model; what a filter is told is the sigmas.
#pragma once
#include <cstdint>
#include <vector>

#include "loxo/estimate/nominal.hpp"
#include "loxo/ins/samples.hpp"
#include "loxo/sim/trajectory.hpp"

namespace loxo {

struct NavigatorConfig;

// Truth at the IMU's rate, of the point of the vehicle that follows its way (where the odometer
// measures) and in the vehicle's own axes (right, forward, up; no mounting).
struct RouteTruth {
  Ellipsoid ellipsoid;
  double dt = 0.01;                       // s
  std::vector<ImuIncrement<double>> imu;  // [i] ends at i dt; [0] is empty
  std::vector<EcefState<double>> state;   // at i dt
  std::vector<double> distance, speed;    // m along the way, m/s
  std::vector<Vec<Body>> turn;            // integral of the rate against the Earth, rad
  std::vector<Vec<Body>> w_ib;            // rad/s
  double duration() const { return dt * static_cast<double>(state.size() - 1); }
  // Index of time t.
  std::size_t at(double t) const;
};
// The trajectory must have no mounting angles of its own.
RouteTruth route_truth(const Trajectory& trajectory, double rate);

// 1 sigma, SI. Constants are drawn once a run.
struct VehicleErrors {
  double gyro_bias = 0, gyro_noise = 0, accel_bias = 0, accel_noise = 0;
  double gyro_bias_walk = 0, accel_bias_walk = 0;  // rad/s/sqrt(s), m/s^2/sqrt(s)
  // Odometer: mean of k and of the mounting, and their scatter about it.
  double scale = 1, scale_std = 0, eps_h = 0, eps_h_std = 0, eps_p_std = 0;
  double scale_walk = 0;                        // 1/sqrt(s)
  double scale_slow = 0, scale_slow_tau = 600;  // Gauss-Markov part of k
  double scale_noise = 0;                       // white, of the way of each `noise_interval`
  double noise_interval = 0.1;                  // s
  double distance_noise = 0;                    // m/sqrt(s), white, while it moves
  double lever_std = 0, tau_std = 0;            // m, s
  double quantisation = 0;                      // m
  double tick_interval = 0.1;                   // s
  // Slip of the vehicle against its way, white from second to second, a smooth swing that begins
  // and ends a second at zero: metres to the side and up in a second (side_turn: times lateral
  // acceleration in m/s^2), or a mean angle.
  double side = 0, up = 0, side_turn = 0, slip_angle = 0;
  // Fixes.
  double fix_every = 0, fix_std = 3;  // s (0: none), m per axis
  // Start: at rest, by the gyros (static_heading) or with a heading given; random parts beside what
  // the biases cause.
  bool static_heading = false;
  double level_std = 0, heading_std = 0, position_std = 0, velocity_std = 0;
};
// A tactical unit (1 deg/h, 300 ug, a third of each moving within an hour), a wheel of a millimetre
// whose scale, mounting, lever and delay are unknown (3 %, 2 deg, 0.3 m, 0.1 s); a level of the
// accelerometers', a heading given to half a degree; no fixes.
VehicleErrors tactical_vehicle();
// What such a vehicle's own description would tell the joint filter; dt: of the IMU, s. The
// simulated one stands exactly still and its wheel does not leave its way: the sigmas that a real
// one needs for that (zero velocity, the constraint's constant part) would only make the filter's
// covariance too wide, and are not used.
NavigatorConfig filter_config(const VehicleErrors& errors, double dt);

// One run; the same (seed, run) is the same run.
class SimulatedVehicle {
 public:
  SimulatedVehicle(const RouteTruth& route, const VehicleErrors& errors, std::uint64_t seed,
                   std::uint64_t run);
  // To the next IMU sample; false at the end of the route.
  bool next();
  double t() const;
  const ImuIncrement<double>& imu() const { return imu_; }
  // What else is said at this time; null where nothing is.
  const OdometerTick* tick() const { return has_tick_ ? &tick_ : nullptr; }
  const Fix* fix() const { return has_fix_ ? &fix_ : nullptr; }
  // True state of the IMU's body now, and true constants (`d` and `t` are not used).
  NominalState truth() const;
  double distance() const;
  // The start as an alignment at rest would have it, with its covariance on ECEF axes (constants of
  // the odometer included).
  NominalState start() const { return start_; }
  const Covariance<kStates>& start_covariance() const { return P_; }

 private:
  void align();

  const RouteTruth* route_;
  VehicleErrors e_;
  std::uint64_t seed_, run_;
  std::size_t i_ = 0;
  long per_second_, per_tick_, per_noise_, per_fix_;
  NominalState constants_;  // true bg, ba, scale, mounting, lever, tau
  Rot<Body, Body> R_;       // IMU axes to vehicle axes
  struct Swing {
    Vec<Body> angle, rate;  // against the way, vehicle axes
  };
  Swing swing(std::size_t i) const;
  Vec<Body> rate_at(std::size_t i) const;                   // of the body, rad/s, vehicle axes
  Vec<Body> slip_;                                          // mean angle of this second
  Quat<Body, Body> turned_ = Quat<Body, Body>::identity();  // way to body at i_
  Vec<Body> w_;                                             // rate_at(i_)
  Vec<Body> arm_;  // from the IMU to the point that follows the way, vehicle axes
  double slow_ = 0, white_ = 0, indicated_ = 0, told_ = 0, last_way_ = 0;
  NominalState start_;
  Covariance<kStates> P_;
  ImuIncrement<double> imu_;
  OdometerTick tick_;
  Fix fix_;
  bool has_tick_ = false, has_fix_ = false;
};

// Normalised squared errors of a filter's state against the truth [EST-1]: attitude, velocity,
// position, all nine, and with the biases fifteen.
struct Nees {
  double attitude = 0, velocity = 0, position = 0, nine = 0, fifteen = 0;
};
Nees nees_of(const NominalState& computed, const Covariance<kStates>& P, const NominalState& truth);

// The three routes of vehicle.md 7.3 (straight, mixed, closed): from rest by 1 m/s^2 (mean) to 20
// m/s, turns at 6 deg/s (mean), smooth; `rest` seconds at rest before. Throws Error(kUsage) for
// another name.
Trajectory acceptance_route(const char* name, double length, double rest = 0);

}  // namespace loxo
