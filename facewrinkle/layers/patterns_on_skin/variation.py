"""Natural variation: no two wrinkles have the same length, depth, distance and bend."""

from __future__ import annotations

import numpy as np

from ...array_types import Array
from ...geometry.smoothstep import smoothstep

DISTINCT = 64
"""Number of different wrinkles, after which they repeat."""

SHIFTS = (0.5, 0.5, 0.6, 0.3)
"""The most, in radians, that the place, slant, bend and waviness of a wrinkle shift its phase. Their sum must be below
2.09, or neighbours could meet: between them the shift changes by up to twice the sum, at up to 1.5 times the mean rate.
"""

SHALLOWER, SHORTER, FADE = 0.65, 0.8, 0.6
"""The most that a wrinkle lacks in depth and at each end, and the length over which an end fades; the last two are
shares of half the region.
"""


def natural_variation(phase: Array, along: Array, amount: float, seed: int) -> tuple[Array, Array]:
    """Return the phase that natural variation adds to waves, and the share of their height that it leaves.

    A wrinkle is a furrow, where the sine of the phase is -1, and half a wave on both sides of it. Each has its own
    random numbers, drawn by seed and number, so that they are the same on every mesh and in every frame.

    Parameters
    ----------
    phase : ndarray, shape (k,)
        Phase of the waves, radians.
    along : ndarray, shape (k,)
        Place along the wrinkles, -1 to 1 from border to border.
    amount : float
        In [0, 1].
    seed : int

    Returns
    -------
    shift : ndarray, shape (k,)
        Radians.
    share : ndarray, shape (k,)

    Examples
    --------
    >>> shift, share = natural_variation(np.array([-0.5 * np.pi, 1.5 * np.pi]), np.zeros(2), 0.5, seed=1)
    >>> bool(shift[0] != shift[1]), bool((share > 0.5).all() and (share <= 1.0).all())
    (True, True)
    >>> [part.tolist() for part in natural_variation(np.zeros(1), np.zeros(1), 0.0, seed=1)]
    [[0.0], [1.0]]
    """
    drawn = np.random.default_rng(seed).random((DISTINCT, 8))
    number = phase / (2.0 * np.pi) + 0.25
    first = np.floor(number)
    blend = smoothstep(number - first)
    shift, share = np.zeros_like(along), np.zeros_like(along)
    for k, part in ((first, 1.0 - blend), (first + 1.0, blend)):
        own = drawn[k.astype(np.int64) % DISTINCT].T
        signed = 2.0 * own[:4] - 1.0
        bends = np.stack([np.ones_like(along), along, along**2, np.sin(4.0 * along + 2.0 * np.pi * own[4])])
        shift += part * np.einsum("i,ik,ik->k", SHIFTS, signed, bends)
        share += part * _depth_along(along, own[5:], amount)
    return amount * shift, share


def _depth_along(along: Array, own: Array, amount: float) -> Array:
    """Depth along a wrinkle as a share: it may be shallower than others, and begin and end within the region.

    The depth takes the square of a random number: most wrinkles are nearly as deep as they can be.
    """
    deep = 1.0 - amount * SHALLOWER * own[0] ** 2
    begins, ends = amount * SHORTER * own[1], amount * SHORTER * own[2]
    rises = 1.0 - amount * (1.0 - smoothstep((along + 1.0 - begins) / FADE))
    falls = 1.0 - amount * (1.0 - smoothstep((1.0 - ends - along) / FADE))
    return np.asarray(deep * rises * falls)
