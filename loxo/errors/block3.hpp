// SPDX-License-Identifier: Apache-2.0
// 3x3 blocks of error matrices: small, fixed, fit for double and for lanes. A block has no frame of
// its own; the function that makes one says on which axes it stands.
#pragma once
#include "loxo/num/geometry.hpp"

namespace loxo {

template <Real S = double>
struct Block3 {
  S m[3][3]{};
};

template <Real S>
inline Block3<S> identity3() {
  Block3<S> r;
  r.m[0][0] = r.m[1][1] = r.m[2][2] = S(1.0);
  return r;
}
// [v]: skew(v) u = v x u.
template <class F, Real S>
inline Block3<S> skew(const Vec<F, S>& v) {
  Block3<S> r;
  r.m[0][1] = -v.z;
  r.m[0][2] = v.y;
  r.m[1][0] = v.z;
  r.m[1][2] = -v.x;
  r.m[2][0] = -v.y;
  r.m[2][1] = v.x;
  return r;
}
template <class A, class B, Real S>
inline Block3<S> block_of(const Rot<A, B, S>& c) {
  Block3<S> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.m[i][j] = c.m[i][j];
  return r;
}
template <class F, Real S>
inline Block3<S> outer(const Vec<F, S>& a, const Vec<F, S>& b) {
  const S u[3] = {a.x, a.y, a.z}, w[3] = {b.x, b.y, b.z};
  Block3<S> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.m[i][j] = u[i] * w[j];
  return r;
}
template <Real S>
inline Block3<S> operator+(const Block3<S>& a, const Block3<S>& b) {
  Block3<S> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.m[i][j] = a.m[i][j] + b.m[i][j];
  return r;
}
template <Real S>
inline Block3<S> operator-(const Block3<S>& a, const Block3<S>& b) {
  Block3<S> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.m[i][j] = a.m[i][j] - b.m[i][j];
  return r;
}
template <Real S>
inline Block3<S> operator*(const Block3<S>& a, const Block3<S>& b) {
  Block3<S> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      r.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
  return r;
}
template <Real S>
inline Block3<S> operator*(S k, const Block3<S>& a) {
  Block3<S> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.m[i][j] = k * a.m[i][j];
  return r;
}
// a with its columns scaled by the components of v: a diag(v).
template <class F, Real S>
inline Block3<S> scale_columns(const Block3<S>& a, const Vec<F, S>& v) {
  Block3<S> r;
  for (int i = 0; i < 3; ++i) {
    r.m[i][0] = a.m[i][0] * v.x;
    r.m[i][1] = a.m[i][1] * v.y;
    r.m[i][2] = a.m[i][2] * v.z;
  }
  return r;
}
template <Real S>
inline Block3<S> transpose(const Block3<S>& a) {
  Block3<S> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.m[i][j] = a.m[j][i];
  return r;
}
// The components of a v, under the same frame's name.
template <class F, Real S>
inline Vec<F, S> operator*(const Block3<S>& a, const Vec<F, S>& v) {
  return {a.m[0][0] * v.x + a.m[0][1] * v.y + a.m[0][2] * v.z,
          a.m[1][0] * v.x + a.m[1][1] * v.y + a.m[1][2] * v.z,
          a.m[2][0] * v.x + a.m[2][1] * v.y + a.m[2][2] * v.z};
}

}  // namespace loxo
