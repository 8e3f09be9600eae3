// SPDX-License-Identifier: Apache-2.0
// Fixed-interval smoother in the modified Bryson-Frazier form [EST-17]: the estimate of Rauch, Tung
// and Striebel without an inverse of P (which is singular after every reset of an accumulator). The
// filter's steps are written forward to a file that has no name, and read backward; memory is
// constant.
#pragma once
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <vector>

#include "loxo/estimate/nominal.hpp"
#include "loxo/estimate/spool.hpp"

namespace loxo {

class SmootherTape : public FilterTape {
 public:
  // `extra`: the filter has the states of extra_states.hpp. Throws Error(kWork) where no temporary
  // file can be made or the disk is full.
  explicit SmootherTape(bool extra = false);
  ~SmootherTape() override;
  void transition(const TransitionProduct& f) override;
  void measurement(const SparseRow<double>& h, double s, double y, const double* gain) override;
  void epoch(const NominalState& nominal, const Covariance<kStates>& P, const ExtraCovariance* X,
             std::uint32_t health) override;

  // Newest epoch first: the smoothed state, its covariance (navigation block and the diagonal;
  // other elements are the filter's) and the filter's health word.
  using Emit = std::function<void(const NominalState& state, const Covariance<kStates>& P,
                                  std::uint32_t health)>;
  void smooth(const Emit& emit);
  // Smoothed variances of the extra states, inside `emit`; zero where there are none.
  const double* extra_variances() const { return extra_variance_; }
  std::uint64_t bytes() const { return bytes_; }

 private:
  void put(int kind, const double* data, int count);
  template <int N>
  void smooth_states(const Emit& emit);
  SpoolFile file_;
  std::vector<double> buffer_;  // one record, then its trailer
  std::uint64_t bytes_ = 0;
  bool extra_ = false;
  double extra_variance_[kExtra]{};
};

}  // namespace loxo
