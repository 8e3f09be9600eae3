// SPDX-License-Identifier: Apache-2.0
// Replay: the recorded track integrated again with candidate constants, with its derivatives, and
// the scale and angle that bring its end onto the surveyed end. vehicle.md section 4.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "loxo/calibrate/calibration.hpp"
#include "loxo/calibrate/replay_sums.hpp"
#include "loxo/ins/samples.hpp"

namespace loxo {

// A track as recorded, between the start and the last benchmark. Views: the caller keeps steps and
// ellipsoid.
struct RecordedTrack {
  const Ellipsoid* ellipsoid = nullptr;
  std::span<const TrackStep> steps;
  double t0 = 0;  // s: when the first step begins
  HeadingModel model = HeadingModel::kIndependent;
  HeadingReference reference = HeadingReference::kTrue;
  bool earth_rate = false;
  // A scale and heading offset already taken out of `steps`; a mechanised heading was kept with
  // them still in.
  double taken_scale = 1, taken_offset = 0;
  double lever_right = 0, lever_forward = 0;  // m, known: from the odometer to the surveyed point
};

// Sensor errors declared for the track, 1 sigma, SI; 0: none declared. (V-43)
struct TrackErrorModel {
  double heading_bias = 0;   // rad
  double heading_drift = 0;  // rad/s
  double heading_noise = 0;  // rad/sqrt(s)
  double side_slip = 0;      // rad, white, each step
  double scale_noise = 0;    // white, each step, relative
  double quantisation = 0;   // m of indicated distance
};

// Where the track is after some row. Sensitivities in metres north, east, up for each state.
struct Arrival {
  double lat = 0, lon = 0;     // rad, lon continuous
  double up = 0;               // m climbed, by pitch
  double north = 0, east = 0;  // m: plain sums of the corrected increments
  double heading = 0;          // rad, corrected, at the row
  double heading_t = 0;        // s: the row's own time, for the drift
  std::array<std::array<double, 3>, kStates> by{};
};

// Integrals that the covariance needs (V-43), metres and seconds from the start, at one row.
struct Moments {
  double t = 0, rows = 0;            // s and rows since the start
  double north = 0, east = 0;        // P
  double sn = 0, se = 0;             // INT P dt
  double qnn = 0, qne = 0, qee = 0;  // INT P P^T dt
  double bn = 0, be = 0;             // INT t v dt
  double along[3][3]{};              // SUM ds^2 t t^T, t the unit vector ahead (n, e, up)
  double cnn = 0, cne = 0, cee = 0;  // SUM ds^2 n n^T, n level and across
  double change[3][3]{};             // SUM of (change of t)(change of t)^T
  double first[3]{}, last[3]{};      // first and last t
  double next[3]{};                  // change of t to the first moving step after the row
  // What a turn of all headings and a drift of 1 rad/s since the start do to the position: flat,
  // (-e, n) of P and B, until exact_turns() puts the ellipsoid's own in their place.
  double turn[2]{}, drift[2]{};
  double route = 0;  // m driven
  double area = 0;   // m^2 INT n de - n e / 2: positive, the route lies left of its chord
};

class Replay {
 public:
  // `rows`: after how many steps to report, ascending. Throws Error(kInput) for a row beyond the
  // track.
  Replay(const RecordedTrack& track, const Benchmark& start, std::vector<std::size_t> rows);

  // One pass. `estimated`: the states whose sensitivities are wanted; none: positions only. H1:
  // analytic sums (V-39), (V-40), about 2 ns a row on long level tracks, 50 ns else; H2 and grid:
  // central differences.
  std::vector<Arrival> run(const StateVector& x, std::span<const State> estimated = {}) const;
  // (V-43) sums at each row, with the track corrected by x.
  std::vector<Moments> moments(const StateVector& x) const;
  // Metres from benchmark to arrival, in the heading reference of the track: exact zero where they
  // coincide.
  std::array<double, 3> residual(const Arrival& arrival, const Benchmark& benchmark) const;
  // Largest |lat| met in the last run() [rad]; NaN where the track left its domain.
  double largest_latitude() const { return largest_latitude_; }
  const RecordedTrack& track() const { return track_; }
  const Benchmark& start() const { return start_; }

 private:
  template <bool kSensitive, bool kFull>
  std::vector<Arrival> run_true(const StateVector& x) const;
  std::vector<Arrival> run_mechanised(const StateVector& x) const;
  std::vector<Arrival> run_grid(const StateVector& x) const;
  std::vector<Arrival> positions(const StateVector& x) const;
  double heading_at(std::size_t row) const;
  void finish(std::vector<Arrival>& arrivals, const StateVector& x, bool sensitive) const;

  RecordedTrack track_;
  Benchmark start_;
  std::vector<std::size_t> rows_;
  std::vector<double> north_, east_;  // level increments as recorded [m]
  bool has_pitch_ = false;
  std::shared_ptr<const ReplaySums> sums_;  // of a long level track
  mutable double largest_latitude_ = 0;
};

// An alignment error cannot be told from eps, however long the way (5.3): its effect must be that
// of eps exactly. Takes it from the sensitivities of the arrivals; that of the drift too where they
// hold it.
void exact_turns(const RecordedTrack& track, std::span<const Arrival> arrivals, bool with_drift,
                 std::vector<Moments>& moments);

// Covariance of all residuals (V-43): n x n row-major, n = dim * moments.size(), dim 2 (north,
// east) or 3 (and up).
std::vector<double> residual_covariance(std::span<const Moments> moments,
                                        std::span<const Benchmark> benchmarks,
                                        const Benchmark& start, const TrackErrorModel& errors,
                                        double k, int dim, bool with_start, bool with_drift);

// Scale and angle from the start and one surveyed end (the last), exact for any route. Not valid,
// with the reason: zero chord, weak geometry (smallest singular value below 5 sigma), the pole
// crossed with true headings, no convergence in 30 iterations. Accuracy in double: 1e-11 + 2e-7 m /
// smallest singular value.
Calibration calibrate_replay(const RecordedTrack& track, const Benchmark& start,
                             const Benchmark& end, const TrackErrorModel& errors = {});
// Start values from the chord that suits the track: rhumb (H1), geodesic (H2), stereographic
// (grid). Also tells where the track as recorded ends.
struct ChordStart {
  bool valid = false;
  std::string why;
  double ln_k = 0, eps = 0;
  double chord = 0;                 // m
  double end_lat = 0, end_lon = 0;  // reckoned end, lon continuous
};
ChordStart chord_start(const Replay& replay, const Arrival& as_recorded, const Benchmark& end);
ChordStart chord_start(const Replay& replay, const Benchmark& end, std::size_t which);

}  // namespace loxo
