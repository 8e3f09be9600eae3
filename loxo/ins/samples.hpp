// SPDX-License-Identifier: Apache-2.0
// What sensors say, in SI, body axes right-forward-up: the values that walk from log/ and sim/ into
// the kernels.
#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>

#include "loxo/earth/frames.hpp"
#include "loxo/num/geometry.hpp"

namespace loxo {

inline constexpr double kNone =
    std::numeric_limits<double>::quiet_NaN();  // "not given" in a sample
inline bool given(double x) { return x == x; }
inline double or_else(double x, double other) { return given(x) ? x : other; }

// Integrals over (t - dt, t]: angle [rad] and velocity [m/s] increments.
template <Real S = double>
struct ImuIncrement {
  double t = 0, dt = 0;
  Vec<Body, S> dtheta, dv;
};

// How the recorded heading came about (vehicle.md 1.5): kept by something that knows where it is
// (H1), or by the dead reckoning itself with its own wrong position (H2).
enum class HeadingModel { kIndependent, kMechanised };
// Heading from true north, or from grid north: G = psi - lon in the north, psi + lon in the south.
enum class HeadingReference { kTrue, kGrid };

// One step of dead reckoning that ends at t: distance [m] as recorded (negative when reversing),
// heading for the whole step, i.e. at mid-step [rad, clockwise from true or grid north], pitch
// [rad, bow up +], height [m].
struct TrackStep {
  double t = 0, ds = 0, heading = 0, pitch = 0, h = 0;
  std::uint32_t row =
      0;  // data rows of the file when this step ended, bad ones counted; 0: not from a file
};

// An odometer reading in metres or m/s (already scaled by the value in use).
struct OdometerTick {
  double t = 0;
  double value = 0;  // distance since the last tick [m], or forward speed [m/s] where is_speed
  bool is_speed = false;
};

// A surveyed point passed after `row` rows of the track (0: before the first) or at time t (kNone:
// by row).
struct Benchmark {
  double t = kNone;
  std::ptrdiff_t row = -1;
  double lat = 0, lon = 0, h = 0;  // rad, rad, m
  double std = 0, std_h = 0;       // m, 1 sigma per axis; 0 = known exactly
};

// A position fix; kNone where a part is not given.
struct Fix {
  double t = 0, lat = 0, lon = 0, h = kNone;
  double std_e = 0, std_n = 0, std_u = 0;
  double ve = kNone, vn = kNone, vu = kNone;
  double std_v = kNone;
};

struct HeadingSample {
  double t = 0, heading = 0, std = 0;  // rad
};
struct HeightSample {
  double t = 0, h = 0, rate = kNone;  // m, m/s
};
struct AttitudeSample {
  double t = 0, heading = 0, pitch = 0, roll = 0;  // rad
};
// A velocity log (Doppler, laser): body axes RFU, or level ENU where `level`.
struct VelocitySample {
  double t = 0;
  double v[3] = {kNone, kNone, kNone};  // m/s
  bool level = false;
};

}  // namespace loxo
