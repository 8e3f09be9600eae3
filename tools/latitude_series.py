#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints loxo/earth/latitude_series.inc: the series that join geodetic (phi), rectifying (mu) and conformal (chi)
latitude, to order 8 in the third flattening n, derived here with exact fractions. y = x + sum_j c_j sin(2 j x).

A trigonometric polynomial with coefficients in Q[n]/n^9 is a dict {(power of z, power of n): value}, z = exp(i x);
sines are kept as real odd Laurent series divided by i, so everything stays rational: z^k stands for exp(i k x) and
i^2 = -1 is carried by a separate parity."""
from fractions import Fraction as Q
from math import factorial

ORDER = 8


class T:
    """re + i*im, both rational in z and n."""

    def __init__(self, re=None, im=None):
        self.re = {k: v for k, v in (re or {}).items() if v}
        self.im = {k: v for k, v in (im or {}).items() if v}

    def __add__(self, o):
        return T(add(self.re, o.re), add(self.im, o.im))

    def __mul__(self, o):
        if not isinstance(o, T):
            return T({k: v * o for k, v in self.re.items()}, {k: v * o for k, v in self.im.items()})
        return T(add(mul(self.re, o.re), mul(self.im, o.im), -1), add(mul(self.re, o.im), mul(self.im, o.re)))

    def d(self):  # d/dx: z^k -> i k z^k
        return T({k: -v * k[0] for k, v in self.im.items()}, {k: v * k[0] for k, v in self.re.items()})


def add(a, b, s=1):
    r = dict(a)
    for k, v in b.items():
        r[k] = r.get(k, 0) + s * v
    return r


def mul(a, b):
    r = {}
    for (k1, n1), v1 in a.items():
        for (k2, n2), v2 in b.items():
            if n1 + n2 <= ORDER:
                r[(k1 + k2, n1 + n2)] = r.get((k1 + k2, n1 + n2), 0) + v1 * v2
    return r


ONE = T({(0, 0): Q(1)})


def series(coefficients):
    """coefficients[j] = {power of n: value} -> sum_j c_j sin(2 j x)"""
    im = {}
    for j, c in coefficients.items():
        for n, v in c.items():
            im[(2 * j, n)] = -v / 2
            im[(-2 * j, n)] = v / 2
    return T(None, im)


def coefficients(t):
    r = {j: {} for j in range(1, ORDER + 1)}
    for (k, n), v in t.im.items():
        if k < 0:
            r[-k // 2][n] = 2 * v
    return r


def shift(g, f):
    """g(x + f(x)) - by Taylor's series; f = O(n)"""
    total, power, derivative = T(), ONE, g
    for k in range(ORDER + 1):
        total = total + power * derivative * Q(1, factorial(k))
        power = power * f
        derivative = derivative.d()
    return total


def inverse(f):
    """y = x + f(x)  ->  x = y + g(y), Lagrange"""
    g, power = T(), ONE
    for k in range(1, ORDER + 1):
        power = power * f
        t = power
        for _ in range(k - 1):
            t = t.d()
        g = g + t * Q((-1) ** k, factorial(k))
    return g


def compose(f, g):
    """z = y + f(y), y = x + g(x)  ->  z - x"""
    return g + shift(f, g)


def binomial(a, k):
    r = Q(1)
    for i in range(k):
        r = r * (a - i) / (i + 1)
    return r


def mu_of_phi():
    # d mu / d phi ~ (1 + 2 n cos 2 phi + n^2)^(-3/2) = [(1 + n z^2)(1 + n z^-2)]^(-3/2), divided by its mean.
    u = T({(2 * k, k): binomial(Q(-3, 2), k) for k in range(ORDER + 1)})
    w = T({(-2 * k, k): binomial(Q(-3, 2), k) for k in range(ORDER + 1)})
    d = (u * w).re
    mean = [d.get((0, n), Q(0)) for n in range(ORDER + 1)]
    inv = [Q(0)] * (ORDER + 1)
    inv[0] = 1 / mean[0]
    for n in range(1, ORDER + 1):
        inv[n] = -sum(mean[i] * inv[n - i] for i in range(1, n + 1)) / mean[0]
    d = mul(d, {(0, n): v for n, v in enumerate(inv)})
    return series({j: {n: 2 * v / (2 * j) for (k, n), v in d.items() if k == 2 * j} for j in range(1, ORDER + 1)})


def chi_of_phi():
    # chi = gd(gd^-1(phi) - T), T = e atanh(e sin phi); Taylor in T with D = cos(phi) d/dphi. e^2 = 4n/(1+n)^2.
    sine = T(None, {(1, 0): Q(-1, 2), (-1, 0): Q(1, 2)})
    cosine = T({(1, 0): Q(1, 2), (-1, 0): Q(1, 2)})
    t, odd = T(), sine
    for k in range(ORDER):
        e2k = {(0, k + 1 + i): 4 ** (k + 1) * binomial(Q(-2 * (k + 1)), i) for i in range(ORDER - k)}
        t = t + T(e2k) * odd * Q(1, 2 * k + 1)
        odd = odd * sine * sine
    total, power, derivative = T(), ONE, cosine  # D phi = cos(phi)
    for k in range(1, ORDER + 1):
        power = power * t * Q(-1)
        total = total + power * derivative * Q(1, factorial(k))
        derivative = cosine * derivative.d()
    return total


def table(name, t, sign=1):
    c = coefficients(t)
    print(f"constexpr double {name}[8][8] = {{")
    for j in range(1, ORDER + 1):
        row = []
        for n in range(j, ORDER + 1):
            v = sign * c[j].get(n, Q(0))
            row.append(f"{v.numerator}.0" if v.denominator == 1 else f"{v.numerator}.0 / {v.denominator}")
        print(f"    {{{', '.join(row)}}},  // sin {2 * j}x: n^{j} ... n^8")
    print("};")


if __name__ == "__main__":
    mu_phi, chi_phi = mu_of_phi(), chi_of_phi()
    phi_mu, phi_chi = inverse(mu_phi), inverse(chi_phi)
    mu_chi, chi_mu = compose(mu_phi, phi_chi), compose(chi_phi, phi_mu)
    print("// SPDX-License-Identifier: Apache-2.0")
    print("// Written by tools/latitude_series.py: row j, column k is the factor of n^(j + k) in the coefficient of sin(2 j x).")
    table("kMuOfPhi", mu_phi)
    table("kPhiOfMu", phi_mu)
    table("kChiOfPhi", chi_phi)
    table("kPhiOfChi", phi_chi)
    table("kMuOfChi", mu_chi)
    table("kChiOfMu", chi_mu)
