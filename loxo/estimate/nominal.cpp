// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/nominal.hpp"

namespace loxo {

void feed_back(NominalState& s, const double x[kStates]) {
  const Vec<Ecef> psi{x[0], x[1], x[2]};
  s.q = normalized(exp_rotation<Ecef, Ecef>(psi) * s.q);  // C <- exp([psi]) C~
  s.v = s.v - Vec<Ecef>{x[3], x[4], x[5]};
  s.r = s.r - Vec<Ecef>{x[6], x[7], x[8]};
  s.bg = s.bg + Vec<Body>{x[9], x[10], x[11]};
  s.ba = s.ba + Vec<Body>{x[12], x[13], x[14]};
  s.sg = s.sg + Vec<Body>{x[15], x[16], x[17]};
  s.sa = s.sa + Vec<Body>{x[18], x[19], x[20]};
  s.scale += x[kScale];
  s.eps_h += x[kEpsH];
  s.eps_p += x[kEpsP];
  s.lever = s.lever + Vec<Body>{x[kLever], x[kLever + 1], x[kLever + 2]};
  s.tau += x[kTau];
  s.offset += x[kOffset];
  for (int i = 0; i < 3; ++i) s.d[i] -= x[kAcc + i];
}

void feed_back_extra(NominalState& s, const double x[kExtra]) {
  s.antenna = s.antenna + Vec<Body>{x[0], x[1], x[2]};
  s.height_bias += x[kHeightBias - kStates];
  s.heading_bias += x[kHeadingBias - kStates];
  for (int i = 0; i < 6; ++i) s.misalignment[i] += x[kMisalignment - kStates + i];
}

namespace {
Block3<> reset_block(const double x[kStates]) {
  return identity3<double>() + 0.5 * skew(Vec<Ecef>{x[0], x[1], x[2]});
}
template <int W>
void turn_rows(double (*rows)[W], const Block3<>& g) {
  for (int j = 0; j < W; ++j) {
    const double a = rows[0][j], b = rows[1][j], c = rows[2][j];
    for (int i = 0; i < 3; ++i) rows[i][j] = g.m[i][0] * a + g.m[i][1] * b + g.m[i][2] * c;
  }
}
}  // namespace

void reset_attitude(Covariance<kStates>& P, const double x[kStates]) {
  const Block3<> g = reset_block(x);
  turn_rows(P.p, g);
  for (int i = 0; i < kStates; ++i) {
    const double a = P.p[i][0], b = P.p[i][1], c = P.p[i][2];
    for (int j = 0; j < 3; ++j) P.p[i][j] = g.m[j][0] * a + g.m[j][1] * b + g.m[j][2] * c;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 3; j < kStates; ++j) P.p[i][j] = P.p[j][i];
    for (int j = 0; j < i; ++j) P.p[i][j] = P.p[j][i];
  }
}

void reset_attitude(ExtraCovariance& X, const double x[kStates]) { turn_rows(X.c, reset_block(x)); }

void TransitionProduct::clear() {
  for (auto& row : f)
    for (double& e : row) e = 0;
  for (auto& row : extra)
    for (double& e : row) e = 0;
  for (int i = 0; i < kStates; ++i) f[i][i] = 1;
  identity = true;
}
void TransitionProduct::advance(const ErrorTransition<double>& t,
                                const AccumulatorTransition<double>& acc) {
  advance_product(f, t, &acc);
  identity = false;
}
// F_xe <- Phi F_xe + G: the extra states' own transition is the identity.
void TransitionProduct::advance_extra(const ErrorTransition<double>& t,
                                      const AccumulatorTransition<double>& acc,
                                      const MisalignmentTransition& m) {
  loxo::advance_extra(extra, t, &acc);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 6; ++k) {
      extra[kPsi + i][kMisalignment - kStates + k] += m.psi[i][k];
      extra[kDv + i][kMisalignment - kStates + k] += m.dv[i][k];
    }
}
void TransitionProduct::reset_attitude(const double x[kStates]) {
  turn_rows(f, reset_block(x));
  turn_rows(extra, reset_block(x));
  identity = false;
}
void TransitionProduct::reset_accumulator(int axis) {
  for (double& e : f[kAcc + axis]) e = 0;
  for (double& e : extra[kAcc + axis]) e = 0;
  identity = false;
}

}  // namespace loxo
