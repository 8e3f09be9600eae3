// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/coasting.hpp"

#include "loxo/earth/attitude.hpp"

namespace loxo {
namespace {

constexpr int kNine = 9;

struct NineByNine {
  double m[kNine][kNine]{};
};
NineByNine identity9() {
  NineByNine j;
  for (int i = 0; i < kNine; ++i) j.m[i][i] = 1;
  return j;
}
void put(NineByNine& j, int row, int column, const Block3<>& b) {
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) j.m[row + i][column + k] = b.m[i][k];
}
template <int W>
void times(double (*rows)[W], const NineByNine& j) {
  for (int c = 0; c < W; ++c) {
    double x[kNine];
    for (int i = 0; i < kNine; ++i) x[i] = rows[i][c];
    for (int i = 0; i < kNine; ++i) {
      double sum = 0;
      for (int k = 0; k < kNine; ++k) sum += j.m[i][k] * x[k];
      rows[i][c] = sum;
    }
  }
}
// x' = J x on the nine navigation errors.
void apply(Covariance<kStates>& P, TransitionProduct* product, ExtraCovariance* X,
           const NineByNine& j) {
  times(P.p, j);
  for (int r = 0; r < kStates; ++r) {
    double x[kNine];
    for (int i = 0; i < kNine; ++i) x[i] = P.p[r][i];
    for (int i = 0; i < kNine; ++i) {
      double sum = 0;
      for (int k = 0; k < kNine; ++k) sum += j.m[i][k] * x[k];
      P.p[r][i] = sum;
    }
  }
  for (int i = 0; i < kNine; ++i)
    for (int k = i + 1; k < kStates; ++k) P.p[i][k] = P.p[k][i];
  if (X) times(X->c, j);
  if (!product) return;
  times(product->f, j);
  times(product->extra, j);
  product->identity = false;
}
// Noise n of the heading, that turns the velocity with it: psi += u n, dv += (v x u) n.
void add_turn(Covariance<kStates>& P, const Vec<Ecef>& v, const Vec<Ecef>& u, double variance) {
  const Vec<Ecef> w = cross(v, u);
  const double g[6] = {u.x, u.y, u.z, w.x, w.y, w.z};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) P.p[i][j] += variance * (g[i] * g[j]);
}

}  // namespace

void coast(NominalState& s, Covariance<kStates>& P, TransitionProduct* product, const CoastNoise& q,
           double dt, ExtraCovariance* X) {
  NineByNine j = identity9();
  for (int i = 0; i < 3; ++i) j.m[kDr + i][kDv + i] = dt;
  apply(P, product, X, j);
  s.r = s.r + s.v * dt;
  s.t += dt;
  const Vec<Ecef> right = cross(q.ahead, q.up);
  add_turn(P, s.v, q.up, q.heading * dt);
  add_turn(P, s.v, q.ahead, q.level * dt);
  add_turn(P, s.v, right, q.level * dt);
  const Vec<Ecef>* axis[3] = {&q.ahead, &right, &q.up};
  const double density[3] = {q.forward, q.sideways, q.sideways};
  for (int k = 0; k < 3; ++k) {
    const double a[3] = {axis[k]->x, axis[k]->y, axis[k]->z};
    for (int i = 0; i < 3; ++i)
      for (int l = 0; l < 3; ++l) P.p[kDv + i][kDv + l] += density[k] * dt * (a[i] * a[l]);
  }
}

double heading_sigma(const Covariance<kStates>& P, const Vec<Ecef>& up) {
  const double u[3] = {up.x, up.y, up.z};
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum += u[i] * P.p[kPsi + i][kPsi + j] * u[j];
  return sqrt(max(sum, 0.0));
}

// With b = dv - [v] psi, what is wrong of the velocity beside the heading:
//   psi' = D (I - u u^T) psi + u n,  b' = D b,  so dv' = D dv + (u x Dv) (u^T psi) - (u x Dv) n.
void turn_heading(NominalState& s, Covariance<kStates>& P, TransitionProduct* product,
                  const Vec<Ecef>& up, double angle, double sigma, ExtraCovariance* X) {
  const Quat<Ecef, Ecef> d = exp_rotation<Ecef, Ecef>(up * angle);
  const Block3<> D = block_of(to_matrix(d));
  s.q = normalized(d * s.q);
  s.v = to_matrix(d) * s.v;
  const Vec<Ecef> w = cross(up, s.v);
  const double u[3] = {up.x, up.y, up.z}, wv[3] = {w.x, w.y, w.z};
  Block3<> psi = D, dv{};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      psi.m[i][k] -= u[i] * u[k];  // D u = u
      dv.m[i][k] = wv[i] * u[k];
    }
  NineByNine j = identity9();
  put(j, kPsi, kPsi, psi);
  put(j, kDv, kPsi, dv);
  put(j, kDv, kDv, D);
  apply(P, product, X, j);
  add_turn(P, s.v, up, sigma * sigma);
}

void forget_position(Covariance<kStates>& P, TransitionProduct* product, const Vec<Ecef>& up,
                     double sigma, ExtraCovariance* X) {
  NineByNine j = identity9();
  const double u[3] = {up.x, up.y, up.z};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) j.m[kDr + i][kDr + k] = u[i] * u[k];
  apply(P, product, X, j);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      P.p[kDr + i][kDr + k] += sigma * sigma * ((i == k ? 1.0 : 0.0) - u[i] * u[k]);
}

}  // namespace loxo
