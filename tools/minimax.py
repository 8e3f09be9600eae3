#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints the polynomial coefficients of loxo/num/function_kernels.hpp and their errors.

Each polynomial interpolates at Chebyshev nodes in 60-digit arithmetic (near-minimax), is rounded to
double, and its largest error relative to the final function is printed as a power of two.
"""
from mpmath import mp, mpf, cos, sin, exp, log, atan, pi, sqrt, factorial, matrix, lu_solve, chop, floor

mp.dps = 60


def fit(g, a, b, n):
    """Coefficients c of sum c_k z^k, degree n - 1, interpolating g on [a, b]."""
    nodes = [(a + b) / 2 + (b - a) / 2 * cos((2 * k + 1) * pi / (2 * n)) for k in range(n)]
    m = matrix(n, n)
    y = matrix(n, 1)
    for i, z in enumerate(nodes):
        y[i] = g(z)
        for k in range(n):
            m[i, k] = z**k
    return [mpf(float(c)) for c in lu_solve(m, y)]


def worst(c, g, weight, a, b):
    e = mpf(0)
    for i in range(1, 2001):
        z = a + (b - a) * i / 2000
        if z == 0:
            continue
        p = sum(ck * z**k for k, ck in enumerate(c))
        e = max(e, abs((p - g(z)) * weight(z)))
    return mp.nstr(log(e, 2), 4)


def show(name, c, err):
    print(f"{name}: {len(c)} coefficients, error 2^{err}")
    for ck in c:
        print("   ", float(ck).hex(), mp.nstr(ck, 18))


tiny = mpf(10) ** -20
q = (pi / 4 + mpf(2) ** -20) ** 2
gs = lambda z: (sin(sqrt(z)) / sqrt(z) - 1) / z
for n in (6, 7):
    c = fit(gs, mpf(0), q, n)
    show("sin", c, worst(c, gs, lambda z: z * sqrt(z) / sin(sqrt(z)), mpf(0), q))
gc = lambda z: (cos(sqrt(z)) - 1 + z / 2) / z**2
for n in (6, 7):
    c = fit(gc, mpf(0), q, n)
    show("cos", c, worst(c, gc, lambda z: z * z / cos(sqrt(z)), mpf(0), q))
h = log(mpf(2)) / 2 + mpf(2) ** -12
ge = lambda r: (exp(r) - 1 - r - r * r / 2) / r**3 if abs(r) > mpf(10)**-12 else mpf(1) / 6 + r / 24
for n in (9, 10):
    c = fit(ge, -h, h, n)
    show("exp", c, worst(c, ge, lambda r: abs(r) ** 3 / abs(exp(r) - 1), -h, h))
s2 = ((sqrt(mpf(2)) - 1) / (sqrt(mpf(2)) + 1)) ** 2 * (1 + mpf(2) ** -12)
gl = lambda z: (log((1 + sqrt(z)) / (1 - sqrt(z))) / sqrt(z) - 2) / z
for n in (7, 8):
    c = fit(gl, mpf(0), s2, n)
    show("log", c, worst(c, gl, lambda z: z / 2, mpf(0), s2))
t2 = (sqrt(mpf(2)) - 1) ** 2 * (1 + mpf(2) ** -12)
ga = lambda z: (atan(sqrt(z)) / sqrt(z) - 1) / z
for n in (10, 11, 12):
    c = fit(ga, mpf(0), t2, n)
    show("atan", c, worst(c, ga, lambda z: z * sqrt(z) / atan(sqrt(z)), mpf(0), t2))


def chunks(name, x, bits, count):
    """x as `count` doubles of `bits` significant binary places each on one grid, the last one full."""
    out, lsb = [], mpf(2) ** (int(floor(log(x, 2))) + 1 - bits)
    for _ in range(count - 1):
        part = floor(x / lsb) * lsb
        out.append(part)
        x -= part
        lsb *= mpf(2) ** -bits
    out.append(mpf(float(x)))
    print(name, [float(p).hex() for p in out])


chunks("pi/2 in 27-bit chunks", pi / 2, 27, 4)
chunks("ln 2, 42 bits and the rest", log(mpf(2)), 42, 2)
chunks("ln 2, 32, 32 bits and the rest", log(mpf(2)), 32, 3)
for name, x in (("pi", pi), ("pi/2", pi / 2), ("pi/4", pi / 4), ("3pi/4", 3 * pi / 4)):
    hi = mpf(float(x))
    print(name, float(hi).hex(), float(x - hi).hex())
