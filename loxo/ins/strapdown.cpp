// SPDX-License-Identifier: Apache-2.0
#include "loxo/ins/strapdown.hpp"

namespace loxo {

template State<GeographicMechanization, double> step(const EarthModel&,
                                                     const State<GeographicMechanization, double>&,
                                                     const StepIncrement<double>&);
template State<TransverseMechanization, double> step(const EarthModel&,
                                                     const State<TransverseMechanization, double>&,
                                                     const StepIncrement<double>&);
template State<VirtualSphereMechanization, double> step(
    const EarthModel&, const State<VirtualSphereMechanization, double>&,
    const StepIncrement<double>&);
template State<GridMechanization, double> step(const EarthModel&,
                                               const State<GridMechanization, double>&,
                                               const StepIncrement<double>&);
template State<WanderMechanization, double> step(const EarthModel&,
                                                 const State<WanderMechanization, double>&,
                                                 const StepIncrement<double>&);
template State<EcefMechanization, double> step(const EarthModel&,
                                               const State<EcefMechanization, double>&,
                                               const StepIncrement<double>&);

VerticalGains make_vertical_gains(double tau) {
  const double schuler2 = 2.0 * 9.8 / 6.38e6;  // 2 g/R [1/s^2]
  return {3.0 / tau, 3.0 / (tau * tau) + schuler2, 1.0 / (tau * tau * tau)};
}

double vertical_time(double std, double interval, double accel_noise) {
  const double tau2 = std * sqrt(11.0 * interval) / accel_noise;
  return min(max(sqrt(tau2), 2.0), 120.0);
}

}  // namespace loxo
