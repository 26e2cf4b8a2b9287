"""Inner loops of patterns: their heights at one time, from values computed once per vertex.

Sine and exponential are series in loops without branches and without inner loops of variable length, so that the
compiler works on several vertices at once; they are exact to a few units in the last place of 1.
"""

from __future__ import annotations

from math import factorial

import numpy as np

from ...geometry.compilation import njit

_SINE = tuple((-1.0) ** k / factorial(2 * k + 1) for k in range(14))
_EXPONENTIAL = tuple(1.0 / factorial(k) for k in range(12))  # up to 1/4 all further terms are below 2e-16
TURN = 2.0 * np.pi


@njit(cache=True, inline="always")
def _sine(x):
    r = x - TURN * np.rint(x / TURN)
    y = r * r
    s = 0.0
    for k in range(13, -1, -1):
        s = s * y + _SINE[k]
    return r * s


@njit(cache=True, inline="always")
def _exponential(z):
    """exp(z) for abs(z) <= 1/4."""
    e = 0.0
    for k in range(11, -1, -1):
        e = e * z + _EXPONENTIAL[k]
    return e


@njit(cache=True)
def waves(weight, phase, t, a, b, c, out):
    """``weight (a + b exp(c s))`` with s the sine of the phase ``p0 + p1 t + p2 t^2`` (3, n); b s where c is 0."""
    for i in range(weight.shape[0]):
        out[i] = _sine(phase[0, i] + t * (phase[1, i] + t * phase[2, i]))
    shaped(weight, out, a, b, c, out)


@njit(cache=True)
def shaped(weight, sine, a, b, c, out):
    """``weight (a + b exp(c s))`` of sines s; b s where c is 0."""
    if c == 0.0:
        for i in range(weight.shape[0]):
            out[i] = weight[i] * b * sine[i]
        return
    halvings = max(0, int(np.ceil(np.log2(4.0 * abs(c)))))
    z = c / 2.0**halvings
    for i in range(weight.shape[0]):
        out[i] = _exponential(z * sine[i])
    for _ in range(halvings):
        for i in range(weight.shape[0]):
            out[i] *= out[i]
    for i in range(weight.shape[0]):
        out[i] = weight[i] * (a + b * out[i])


@njit(cache=True)
def standing(where, weight, sine, a, b, c, scratch, out):
    """Add ``weight (a + b exp(c s))`` of sines s that do not change with t."""
    shaped(weight, sine, a, b, c, scratch)
    add(where, scratch, 1.0, out)


@njit(cache=True)
def add(where, heights, factor, out):
    """Add ``factor heights`` to the vertices `where`."""
    for i in range(where.shape[0]):
        out[where[i]] += factor * heights[i]


@njit(cache=True)
def dent(where, weight, square, t, scale, out):
    """Add ``weight scale log((r^2 + t) / (1 + t))``."""
    for i in range(where.shape[0]):
        out[where[i]] += weight[i] * scale * np.log1p((square[i] - 1.0) / (1.0 + t))


@njit(cache=True)
def pouch(where, weight, turns, cos_a, sin_a, cos_b, sin_b, gamma, scale, out):
    """Add ``weight scale ((cos(x + a) + cos(y + b)) / 2)^gamma``; `turns` holds cos x, sin x, cos y, sin y."""
    for i in range(where.shape[0]):
        x = turns[i, 0] * cos_a - turns[i, 1] * sin_a
        y = turns[i, 2] * cos_b - turns[i, 3] * sin_b
        s, power = 0.5 * (x + y), 1.0
        for _ in range(gamma):
            power *= s
        out[where[i]] += weight[i] * scale * power
