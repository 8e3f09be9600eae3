// SPDX-License-Identifier: Apache-2.0
// The carriers whose frame is part of the type. Plain aggregates over a scalar; letters that touch
// must match: C_nb * f_b compiles, C_nb * f_n does not. Frame tags stand in earth/frames.hpp.
#pragma once
#include <type_traits>

#include "loxo/num/functions.hpp"
#include "loxo/num/real.hpp"

namespace loxo {

// A free vector (velocity, force, rate) with components in frame F.
template <class F, Real S = double>
struct Vec {
  S x{}, y{}, z{};
};

// A position in a Cartesian frame F, metres from its origin.
template <class F, Real S = double>
struct Point {
  S x{}, y{}, z{};
};

template <class F, Real S>
inline Vec<F, S> operator+(const Vec<F, S>& a, const Vec<F, S>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class F, Real S>
inline Vec<F, S> operator-(const Vec<F, S>& a, const Vec<F, S>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class F, Real S>
inline Vec<F, S> operator-(const Vec<F, S>& a) {
  return {-a.x, -a.y, -a.z};
}
template <class F, Real S>
inline Vec<F, S> operator*(const Vec<F, S>& a, std::type_identity_t<S> k) {
  return {a.x * k, a.y * k, a.z * k};
}
template <class F, Real S>
inline Vec<F, S> operator*(std::type_identity_t<S> k, const Vec<F, S>& a) {
  return {k * a.x, k * a.y, k * a.z};
}
template <class F, Real S>
inline Vec<F, S>& operator+=(Vec<F, S>& a, const Vec<F, S>& b) {
  return a = a + b;
}
template <class F, Real S>
inline Vec<F, S>& operator-=(Vec<F, S>& a, const Vec<F, S>& b) {
  return a = a - b;
}
template <class F, Real S>
inline S dot(const Vec<F, S>& a, const Vec<F, S>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class F, Real S>
inline Vec<F, S> cross(const Vec<F, S>& a, const Vec<F, S>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class F, Real S>
inline S norm(const Vec<F, S>& a) {
  return sqrt(dot(a, a));
}
template <class F, Real S>
inline Vec<F, S> operator-(const Point<F, S>& a, const Point<F, S>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class F, Real S>
inline Point<F, S> operator+(const Point<F, S>& p, const Vec<F, S>& d) {
  return {p.x + d.x, p.y + d.y, p.z + d.z};
}
template <class F, Real S>
inline Point<F, S> operator-(const Point<F, S>& p, const Vec<F, S>& d) {
  return {p.x - d.x, p.y - d.y, p.z - d.z};
}

// Attitude: turns components in B into components in A (C_ab). m[row][column], orthonormal, det +1.
template <class A, class B, Real S = double>
struct Rot {
  S m[3][3]{};

  static Rot identity() {
    Rot r;
    r.m[0][0] = r.m[1][1] = r.m[2][2] = S(1.0);
    return r;
  }
};

template <class A, class B, Real S>
inline Vec<A, S> operator*(const Rot<A, B, S>& c, const Vec<B, S>& v) {
  return {c.m[0][0] * v.x + c.m[0][1] * v.y + c.m[0][2] * v.z,
          c.m[1][0] * v.x + c.m[1][1] * v.y + c.m[1][2] * v.z,
          c.m[2][0] * v.x + c.m[2][1] * v.y + c.m[2][2] * v.z};
}
template <class A, class B, class C, Real S>
inline Rot<A, C, S> operator*(const Rot<A, B, S>& p, const Rot<B, C, S>& q) {
  Rot<A, C, S> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      r.m[i][j] = p.m[i][0] * q.m[0][j] + p.m[i][1] * q.m[1][j] + p.m[i][2] * q.m[2][j];
  return r;
}
template <class A, class B, Real S>
inline Rot<B, A, S> transpose(const Rot<A, B, S>& c) {
  Rot<B, A, S> r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r.m[i][j] = c.m[j][i];
  return r;
}

// The same attitude as a unit quaternion (scalar first): v_A = q v_B q*.
template <class A, class B, Real S = double>
struct Quat {
  S w{}, x{}, y{}, z{};
  static Quat identity() { return {S(1.0), S(0.0), S(0.0), S(0.0)}; }
};

template <class A, class B, class C, Real S>
inline Quat<A, C, S> operator*(const Quat<A, B, S>& p, const Quat<B, C, S>& q) {
  return {
      p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
      p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}
template <class A, class B, Real S>
inline Quat<B, A, S> conjugate(const Quat<A, B, S>& q) {
  return {q.w, -q.x, -q.y, -q.z};
}
template <class A, class B, Real S>
inline Quat<A, B, S> normalized(const Quat<A, B, S>& q) {
  const S k = S(1.0) / sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w * k, q.x * k, q.y * k, q.z * k};
}
template <class A, class B, Real S>
inline Rot<A, B, S> to_matrix(const Quat<A, B, S>& q) {
  const S two(2.0), one(1.0);
  const S xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
  const S xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
  const S wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
  Rot<A, B, S> r;
  r.m[0][0] = one - two * (yy + zz);
  r.m[0][1] = two * (xy - wz);
  r.m[0][2] = two * (xz + wy);
  r.m[1][0] = two * (xy + wz);
  r.m[1][1] = one - two * (xx + zz);
  r.m[1][2] = two * (yz - wx);
  r.m[2][0] = two * (xz - wy);
  r.m[2][1] = two * (yz + wx);
  r.m[2][2] = one - two * (xx + yy);
  return r;
}
// Largest-component form: exact sign choice by select, no branch; the result has w >= 0.
template <class A, class B, Real S>
Quat<A, B, S> to_quaternion(const Rot<A, B, S>& c) {
  const S one(1.0), quarter(0.25);
  const S t0 = one + c.m[0][0] + c.m[1][1] + c.m[2][2];
  const S t1 = one + c.m[0][0] - c.m[1][1] - c.m[2][2];
  const S t2 = one - c.m[0][0] + c.m[1][1] - c.m[2][2];
  const S t3 = one - c.m[0][0] - c.m[1][1] + c.m[2][2];
  const S a = c.m[2][1] - c.m[1][2], b = c.m[0][2] - c.m[2][0], d = c.m[1][0] - c.m[0][1];
  const S e = c.m[1][0] + c.m[0][1], f = c.m[0][2] + c.m[2][0], g = c.m[2][1] + c.m[1][2];
  S best = t0, w = t0, x = a, y = b, z = d;
  auto take = [&](S t, S w1, S x1, S y1, S z1) {
    const auto better = t > best;
    best = select(better, t, best);
    w = select(better, w1, w);
    x = select(better, x1, x);
    y = select(better, y1, y);
    z = select(better, z1, z);
  };
  take(t1, a, t1, e, f);
  take(t2, b, e, t2, g);
  take(t3, d, f, g, t3);
  const S k = sqrt(quarter / best);
  const S s = select(w < S(0.0), -k, k);
  return normalized(Quat<A, B, S>{w * s, x * s, y * s, z * s});
}
// exp of a rotation vector phi (components in B, equal to those in A): the turn by |phi| about phi.
// Error order: exact to rounding for any |phi|; regular at zero.
template <class A, class B, Real S>
Quat<A, B, S> exp_rotation(const Vec<B, S>& phi) {
  const S half(0.5);
  const S n2 = dot(phi, phi);
  const S h = half * sqrt(n2);
  const S h2 = h * h;
  // sin(h)/(2h) by its series below 0.05 rad: no division by a small number.
  const S series =
      half * (S(1.0) - h2 * (S(1.0 / 6.0) - h2 * (S(1.0 / 120.0) - h2 * (S(1.0 / 5040.0) -
                                                                         h2 * S(1.0 / 362880.0)))));
  const auto small = h < S(0.05);
  const S hs = select(small, S(1.0), h);
  const S k = select(small, series, half * sin(hs) / hs);
  return {cos(h), k * phi.x, k * phi.y, k * phi.z};
}

// The same components under another frame's name: only where two frames coincide by definition.
template <class To, class From, Real S>
inline Vec<To, S> relabel(const Vec<From, S>& v) {
  return {v.x, v.y, v.z};
}

}  // namespace loxo
