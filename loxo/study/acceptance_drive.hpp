// SPDX-License-Identifier: Apache-2.0
// The acceptance simulation of vehicle.md 7.3: an hour on one of three routes, truth by the
// non-linear mechanization, sensors of the class stated there, the segmented method and the joint
// filter on what they say. A run is a pure function of (route, seed, run).
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "loxo/earth/ellipsoid.hpp"

namespace loxo {

// 1 sigma, SI: the navigation-grade class of 7.3.
struct AcceptanceSensors {
  double scale = 0.02, mounting = 0.017453292519943295;    // preset dK; mu [rad]
  double gyro_bias = 4.84813681109536e-8;                  // 0.01 deg/h, each axis, constant
  double gyro_noise = 2.908882086657216e-7;                // 0.001 deg/sqrt(h)
  double accel_bias = 2.941995e-4;                         // 30 ug
  double accel_noise = 4.903325e-5;                        // 5 ug/sqrt(Hz)
  double level = 4.84813681109536e-6;                      // 1 arcsec, random part of the alignment
  double heading = 8.726646259971648e-5;                   // 0.3 arcmin
  double quantisation = 0.05;                              // m a pulse
  double scale_noise = 1e-3, slip = 8.726646259971648e-4;  // white, per second: 1, rad
  double drawn_mounting_sign = 1;  // -1: the unit stands the other way than `mounting` says (tests)
  double slow_scale = 3e-4, slow_time = 600;  // Gauss-Markov: 1, s
};

// Position errors in per cent of the distance run, one a minute from 120 s on.
struct AcceptanceErrors {
  std::vector<double> ins, reckoned, weighted, naive, intersection, joint;
};
struct AcceptanceRun {
  double found_scale_60 = 0;                   // share of the preset found after 60 s …
  double found_scale = 0, found_mounting = 0;  // … and after 120 s
  double mounting_error = 0;                   // rad, after 120 s
  double azimuth = 0;                          // rad, phi_U of the alignment
  std::vector<double> scale;                   // dK found, every 5 s from 5 to 180 s
  AcceptanceErrors errors;
  double switch_t = 0;
  bool forced = false;
};

class AcceptanceRoute {
 public:
  // "straight", "mixed", "closed"; duration [s]. Throws Error(kUsage) for another name.
  AcceptanceRoute(const Ellipsoid& ell, const std::string& name, double duration,
                  const AcceptanceSensors& sensors = {});
  ~AcceptanceRoute();
  AcceptanceRun run(std::uint64_t seed, std::uint64_t run) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace loxo
