"""What makes drawn wrinkles look grown: no two have the same length, depth, distance and bend."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ...geometry.smoothstep import smoothstep

Array = npt.NDArray[np.float64]

ROWS = 64
"""So many wrinkles differ from each other; then they come again."""
SHIFTS = (0.5, 0.5, 0.6, 0.3)
"""The most, in radians, that the place, slant, bend and waviness of a wrinkle shift its phase. Together less than 2.09:
neighbours, between which the shift changes by up to twice that, at up to 1.5 times the mean rate, cannot meet.
"""
SHALLOWER, SHORTER, FADE = 0.65, 0.8, 0.6
"""The most that a wrinkle lacks in depth, and at each end (as a share of half the region); how far an end fades."""


def natural(phase: Array, along: Array, amount: float, seed: int) -> tuple[Array, Array]:
    """What natural variation adds to the phase of waves, and the share of their height that it leaves.

    A wrinkle is a furrow, where the sine of the phase is -1, and the half wave at both sides of it. Each has random
    numbers of its own, drawn by seed and number, so that they are the same on every mesh and in every frame.

    Parameters
    ----------
    phase : ndarray, shape (k,)
        Of the waves, radians.
    along : ndarray, shape (k,)
        Place along the wrinkles, -1 to 1 from border to border.
    amount : float
        In [0, 1].
    seed : int

    Returns
    -------
    shift, share : ndarray, shape (k,)
        `shift` in radians.

    Examples
    --------
    >>> shift, share = natural(np.array([-0.5 * np.pi, 1.5 * np.pi]), np.zeros(2), 0.5, seed=1)
    >>> bool(shift[0] != shift[1]), bool((share > 0.5).all() and (share <= 1.0).all())
    (True, True)
    >>> [part.tolist() for part in natural(np.zeros(1), np.zeros(1), 0.0, seed=1)]
    [[0.0], [1.0]]
    """
    drawn = np.random.default_rng(seed).random((ROWS, 8))
    number = phase / (2.0 * np.pi) + 0.25
    first = np.floor(number)
    blend = smoothstep(number - first)
    shift, share = np.zeros_like(along), np.zeros_like(along)
    for k, part in ((first, 1.0 - blend), (first + 1.0, blend)):
        own = drawn[k.astype(np.int64) % ROWS].T
        signed = 2.0 * own[:4] - 1.0
        bends = np.stack([np.ones_like(along), along, along**2, np.sin(4.0 * along + 2.0 * np.pi * own[4])])
        shift += part * np.einsum("i,ik,ik->k", SHIFTS, signed, bends)
        share += part * _depth(along, own[5:], amount)
    return amount * shift, share


def _depth(along: Array, own: Array, amount: float) -> Array:
    """How deep a wrinkle is along its way, as a share: it is shallower than others, and begins and ends in its region.

    The square of its random number: most are nearly as deep as they can be.
    """
    deep = 1.0 - amount * SHALLOWER * own[0] ** 2
    begins, ends = amount * SHORTER * own[1], amount * SHORTER * own[2]
    rises = 1.0 - amount * (1.0 - smoothstep((along + 1.0 - begins) / FADE))
    falls = 1.0 - amount * (1.0 - smoothstep((1.0 - ends - along) / FADE))
    return np.asarray(deep * rises * falls)
