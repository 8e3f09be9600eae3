// SPDX-License-Identifier: Apache-2.0
// A drive or voyage as functions of time in ECEF: no level frame, so the way may lead over a pole.
// Its way comes from a list of manoeuvres (legs) or from points (a path). The IMU's increments are
// the integrals of its own rate and specific force, so that error-free navigation returns the
// truth.
#pragma once
#include <memory>
#include <vector>

#include "loxo/earth/geodetic.hpp"
#include "loxo/ins/mechanization.hpp"
#include "loxo/ins/samples.hpp"
#include "loxo/sim/path.hpp"

namespace loxo {

// Speed and course go smoothly (acceleration and turn rate are zero at both ends) from where the
// leg before left them.
struct Leg {
  double duration = 0;    // s
  double speed = 0;       // m/s at the end
  double turn = 0;        // rad clockwise over the leg, against the path below
  bool straight = false;  // true: a great circle of normals but for the turn; false: a constant
                          // true course but for it
};
enum class WaveAxis { kRoll, kPitch, kYaw, kHeave };
// One sine of a ship's motion: amplitude sin(2 pi t / period + phase), rad or m.
struct Wave {
  WaveAxis axis = WaveAxis::kRoll;
  double amplitude = 0, period = 10, phase = 0;
};

struct Trajectory {
  Ellipsoid ellipsoid;
  Geodetic<double> start;        // rad, m
  double course = 0, speed = 0;  // rad from true north, m/s at t = 0
  std::vector<Leg> legs;
  std::shared_ptr<const Path>
      path;  // where set, the way; start, course, speed and legs are not used
  std::vector<Wave> waves;
  double mounting_heading = 0,
         mounting_pitch = 0;  // rad: the IMU stands so much clockwise, nose up, in the vehicle
  double duration() const;
};

// What is true at t. The body is the IMU's.
struct Truth {
  double t = 0, distance = 0, h = 0, vu = 0;  // s, m along the track, m, m/s
  EcefState<double> state;
  Vec<Body> w_ib, f;      // rad/s, m/s^2
  Vec<Ecef> forward, up;  // of the track: level along it; the ellipsoid's normal
};

// Walks along the trajectory. The only approximation is the Runge-Kutta step: local error (rate
// dt)^5 / 120, below rounding at 10 ms and vehicle rates. A true course is not defined at a pole:
// doors refuse it there.
class TrajectoryWalk {
 public:
  explicit TrajectoryWalk(const Trajectory& trajectory);
  // To time t >= the last; returns the increments over the way there, by three-point Gauss: error
  // (w dt)^6 / 2e6.
  ImuIncrement<double> to(double t);
  Truth truth() const;
  bool true_course() const;  // of the leg under way
  // Way of a wheel that stands at `lever` [m] in the IMU's body axes, from the start on: rolls
  // along the vehicle's forward axis. And its speed now.
  double wheel_way(const Vec<Body>& lever) const;
  double wheel_speed(const Vec<Body>& lever) const;
  Vec<Body> earth_rate() const { return earth_rate(truth()); }  // w_eb now, rad/s

 private:
  struct State {
    Vec<Ecef> n, f;  // normal, direction of the track
    double s;        // m
  };
  struct Command {
    double u, du, turn;  // m/s, m/s^2, rad/s
    bool straight;
  };
  struct Angles {
    double value[4], rate[4], second[4];  // by WaveAxis
  };
  // What the track does at t, however it is given.
  struct Motion {
    Vec<Ecef> n, f, dn, df, v, dv;    // v: level velocity; d…: derivatives by time
    double h, vu, au, pitch, dpitch;  // pitch: of the road
    double speed;                     // along the road, signed
  };
  Command command(double t) const;
  Angles angles(double t) const;
  Motion motion(double t, const State& x) const;
  Motion motion_on_path(double t) const;
  State rate(double t, const State& x) const;
  State advanced(double t, const State& x, double dt) const;
  Truth truth_at(double t, const State& x) const;
  Vec<Body> earth_rate(const Truth& truth) const;  // w_eb

  Trajectory trajectory_;
  std::vector<double> leg_start_, speed_start_;
  Rot<Body, Body> mounting_;  // IMU to vehicle
  double t_ = 0;
  State x_{};
  Vec<Body> turned_{};  // integral of w_eb
};

}  // namespace loxo
