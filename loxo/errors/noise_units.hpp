// SPDX-License-Identifier: Apache-2.0
// Noise between the data sheet, the continuous model and the samples of a recorder, both ways. One
// set of formulas for gyros (SI: rad/s) and accelerometers (SI: m/s^2).
#pragma once
#include <cmath>

namespace loxo {

// White noise. Random walk N [SI sqrt(s)]: the integral grows as N sqrt(t). Data sheets also state
// a root density; where it is one-sided (over 0 to the band's end) it is sqrt(2) N.
inline double density_of_random_walk(double n) { return n * 1.4142135623730951; }
inline double random_walk_of_density(double density) { return density / 1.4142135623730951; }
// Standard deviation [SI] of a sample that is the mean over 1/rate, and back.
inline double sample_of_random_walk(double n, double rate) { return n * std::sqrt(rate); }
inline double random_walk_of_sample(double sigma, double rate) { return sigma / std::sqrt(rate); }
// Rate random walk K [SI/sqrt(s)]: the step of the bias from one sample to the next, and back.
inline double step_of_rate_walk(double k, double rate) { return k / std::sqrt(rate); }
inline double rate_walk_of_step(double step, double rate) { return step * std::sqrt(rate); }
// Bias instability: data sheets state the floor of the Allan deviation, sqrt(2 ln 2/pi) of the
// flicker coefficient B (IEEE Std 952).
inline double floor_of_instability(double b) { return b * 0.6642824702679601; }
inline double instability_of_floor(double floor) { return floor / 0.6642824702679601; }
// A Gauss-Markov bias whose Allan deviation tops at that floor: its standard deviation (the top, at
// 1.892 tau, is 0.61736 of it), and the root density of the noise that drives it.
inline double markov_of_floor(double floor) { return floor / 0.61736; }
inline double drive_of_markov(double sigma, double tau) { return sigma * std::sqrt(2.0 / tau); }

}  // namespace loxo
