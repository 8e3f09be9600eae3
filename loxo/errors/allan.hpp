// SPDX-License-Identifier: Apache-2.0
// Allan deviation of a log of any length by streaming, and the noise coefficients behind it with
// honest errors. IEEE Std 952 gives the names; the covariance of the estimates is derived in
// decision 0008.
#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace loxo {

enum class AllanKind { kAllan, kModified, kHadamard };

// One averaging time. Deviations in the unit of the samples (rates: rad/s, m/s^2).
struct AllanPoint {
  double tau = 0;           // s
  std::size_t m = 0;        // samples averaged
  std::size_t windows = 0;  // second (third) differences summed
  std::size_t stride = 1;   // samples between windows: 1, or at most m/64
  double deviation = 0;
  double deviation_std =
      0;  // 1 sigma of the deviation; from the fitted noise where there is a fit, else white noise
};

// Samples in, deviations out, at constant memory: a cascade of phase buffers, each level at half
// the rate of the one before; windows of m samples are stepped by one sample up to m = 128, by at
// most m/64 above.
class AllanStream {
 public:
  // dt: sample interval [s]. Averaging times: m = 1, 2, 3, 4, 6, 8, 12, 16 … up to half (a third)
  // of the samples.
  AllanStream(double dt, AllanKind kind = AllanKind::kAllan);
  void add(std::span<const double> rates);
  std::size_t samples() const { return count_; }
  double mean() const { return count_ == 0 ? 0 : sum_ / static_cast<double>(count_); }
  // The points with at least `least` independent windows (m * (least + 1) <= samples).
  std::vector<AllanPoint> points(std::size_t least = 2) const;

 private:
  // Phase samples at a stride of 2^(level) and the sums over windows of m of them.
  struct Level {
    std::vector<double> phase;  // oldest first
    std::vector<std::size_t> m,
        next;  // averaging lengths in steps of the level; first window not yet summed
    std::vector<double> sum;  // of squared differences
    std::vector<std::size_t> windows;
    bool skip = false;  // every second sample goes on to the next level
  };
  void push(std::size_t number, std::span<const double> phase);
  void sum_windows(Level& level) const;

  double dt_;
  AllanKind kind_;
  std::size_t count_ = 0;
  double sum_ = 0, offset_ = 0, phase_ = 0;
  std::vector<Level> levels_;
};

// sigma^2(tau) = 3 Q^2/tau^2 + N^2/tau + (2 ln 2/pi) B^2 + K^2 tau/3 + R^2 tau^2/2. For rates in
// rad/s: quantisation Q [rad], random walk N [rad/sqrt(s)], bias instability B [rad/s], rate random
// walk K [rad/s/sqrt(s)], ramp R [rad/s^2].
struct AllanFit {
  enum { kQuantisation, kRandomWalk, kBiasInstability, kRateRandomWalk, kRamp };
  std::array<double, 5> value{};
  std::array<double, 5> std{};  // 1 sigma; for a coefficient found zero: its 1 sigma upper limit
  std::array<bool, 5> found{};  // different from zero by the fit
  double chi2 = 0;
  std::size_t dof = 0;
  // Relative 1 sigma by which the curve departs from the five noises beyond chance; 0 where they
  // explain it. It is in the bands.
  double model_error = 0;
};
// The deviation that the fitted coefficients give at tau [s].
double allan_deviation(const AllanFit& fit, double tau);
// Generalised least squares with the covariance that the fitted noise itself implies between all
// averaging times, coefficients non-negative. `allowed` switches coefficients off. Sets
// deviation_std of the points. For kAllan.
AllanFit fit_allan(std::vector<AllanPoint>& points, double dt, std::size_t samples,
                   const std::array<bool, 5>& allowed = {true, true, true, true, true});

}  // namespace loxo
