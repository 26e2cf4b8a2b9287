"""Inner loops of patterns: their heights at a moment from what was computed once per vertex."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def waves(where, weight, phase, amplitude, t, a, b, c, out):
    """Add ``weight amplitude (a + b exp(c s))``, s the sine of the phase ``p0 + p1 t + p2 t^2``; b s where c is 0."""
    for i in range(where.shape[0]):
        s = np.sin(phase[i, 0] + t * (phase[i, 1] + t * phase[i, 2]))
        out[where[i]] += weight[i] * amplitude[i] * (b * s if c == 0.0 else a + b * np.exp(c * s))


@njit(cache=True)
def standing(where, weight, sine, amplitude, a, b, c, out):
    """The same where the sine does not change."""
    for i in range(where.shape[0]):
        out[where[i]] += weight[i] * amplitude[i] * (b * sine[i] if c == 0.0 else a + b * np.exp(c * sine[i]))


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
