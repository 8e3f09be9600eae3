// SPDX-License-Identifier: Apache-2.0
// From a kernel `template <Real S> void operator()(const S* p, std::uint64_t seed, std::uint64_t
// trial, S* m) const` to a kind of trial. For the .cpp files of kinds only.
#pragma once
#include <cstddef>
#include <utility>
#include <vector>

#include "loxo/num/lanes.hpp"
#include "loxo/study/trial.hpp"

namespace loxo {

template <class Kernel>
class KernelTrial : public TrialKind {
 public:
  KernelTrial(Kernel kernel, const std::vector<ParameterInfo>& parameters,
              const std::vector<MetricInfo>& metrics, const std::string& settings, int grain)
      : kernel_(std::move(kernel)), grain_(grain) {
    parameters_ = parameters;
    metrics_ = metrics;
    settings_ = settings;
  }
  void alone(const double* p, std::uint64_t seed, std::uint64_t trial, double* m) const override {
    kernel_.template run<double>(p, seed, trial, m);
  }
  void eight(const double* p, std::uint64_t seed, std::uint64_t first, double* m) const override {
    const std::size_t np = parameters_.size(), nm = metrics_.size();
    std::vector<Lanes> in(np), out(nm);
    double v[Lanes::kLanes];
    for (std::size_t j = 0; j < np; ++j) {
      for (std::size_t k = 0; k < 8; ++k) v[k] = p[k * np + j];
      in[j] = Lanes::load(v);
    }
    kernel_.template run<Lanes>(in.data(), seed, first, out.data());
    for (std::size_t j = 0; j < nm; ++j) {
      out[j].store(v);
      for (std::size_t k = 0; k < 8; ++k) m[k * nm + j] = v[k];
    }
  }
  int grain() const override { return grain_; }

 private:
  Kernel kernel_;
  int grain_;
};

}  // namespace loxo
