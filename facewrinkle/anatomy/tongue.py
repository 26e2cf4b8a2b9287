"""The tongue: a soft body that lies in the lower dental arch and comes out over the lower lip.

On its way out it moves forward and stretches, and keeps its volume ("The dimensions of the tongue in relation to its
motility", Am J Orthod Dentofacial Orthop, 1991). Places are [left, up, forward] from the middle of the edges of the
lower incisors, mm on a face of average size; they go with the mandible.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from ..array_types import Array, IntArray
from ..geometry import ring_triangles

IN_MOUTH = (
    (-23.0, -60.0, 14.0, 9.0),
    (-12.0, -54.0, 16.0, 10.0),
    (-6.5, -44.0, 16.0, 9.0),
    (-5.5, -33.0, 15.0, 7.5),
    (-6.0, -22.0, 12.0, 5.5),
    (-7.0, -11.0, 9.0, 3.5),
)
"""Middle of the tongue, [up, forward], and its half width and half height, from the root to the tip."""

RAISED = (
    (-22.0, -56.0, 14.0, 8.6),
    (-10.0, -48.0, 15.5, 9.5),
    (-2.5, -36.0, 15.0, 8.0),
    (1.0, -25.0, 14.0, 6.0),
    (3.5, -14.0, 12.5, 4.5),
    (4.5, -2.0, 11.0, 3.3),
)
"""The same where the tip is over the incisors."""

OUT = (
    (-20.0, -50.0, 14.0, 8.0),
    (-8.0, -40.0, 14.0, 8.0),
    (1.0, -27.0, 13.5, 6.0),
    (5.2, -9.0, 14.0, 4.6),
    (5.1, -6.0, 16.5, 4.2),
    (-3.8, 9.5, 17.0, 4.2),
)
"""The same of a tongue that is put out; places of the last two are from the crest of the lower lip."""

RINGS, ABOVE, BELOW = 44, 28, 12
"""Rings of points from the root to the tip, and points of each on the back of the tongue and on its lower side."""

ALONG = 1.0 - (1.0 - np.linspace(0.0, 1.0, RINGS)[:, None]) ** 1.5
TURN = np.pi * np.concatenate([np.arange(ABOVE) / ABOVE, 1.0 + np.arange(BELOW) / BELOW])
UPPER = np.maximum(np.sin(TURN), 0.0)
# The tip, from 0.7 of the length on, is rounded.
CAP, BLUNT = (np.sqrt(1.0 - np.clip((ALONG - 0.7) / (1.0 - 0.7), 0.0, 1.0) ** power) for power in (3, 5))
GRAIN = CAP * np.random.default_rng(0).normal(size=(RINGS, ABOVE + BELOW)) * UPPER


def lip_crest(lip: Array) -> Array:
    """Return how far [up, forward] the points (k, 3) of a lower lip reach that hold up a tongue on its way out; 3 mm
    below the edges of the incisors, something else does.

    Examples
    --------
    The sides of the tongue are higher than its middle:

    >>> lip_crest(np.array([[0.0, 1.0, 9.0], [12.0, 1.5, 5.0]]))
    array([1., 9.])
    """
    half, high = OUT[-2][2:]
    left, up, forward = lip.T
    rounded = high * (1.0 - np.sqrt(np.maximum(1.0 - (left / half) ** 2, 0.0)))
    return np.array([(up - rounded).max(initial=-3.0), forward.max(initial=0.0)])


def tongue_points(out: float, crest: Array) -> Array:
    """Return the points (n, 3) of a tongue.

    Parameters
    ----------
    out : float
        Share by which it is put out, in [0, 1].
    crest : ndarray, shape (2,)
        Of :func:`lip_crest`.

    Examples
    --------
    The tip moves from behind the incisors to the front of the lip and beyond:

    >>> [tongue_points(out, np.array([1.0, 13.0]))[-1].round(1).tolist() for out in (0.0, 1.0)]
    [[0.0, -7.0, -11.0], [0.0, -2.8, 22.5]]
    """
    over_lip = np.array(OUT)
    over_lip[-2:, :2] += crest
    raised = 0.4  # share by which a tongue is put out whose tip is over the incisors
    coming, going = out / raised, (out - raised) / (1.0 - raised)
    shares = np.array([(1.0 - out) * (1.0 - coming), coming * (1.0 - going), out * going])  # the parabola through all
    stage = np.tensordot(shares, [IN_MOUTH, RAISED, over_lip], axes=1)
    spline = CubicSpline(np.linspace(0.0, 1.0, len(OUT)), stage)
    up, forward, half, high = np.moveaxis(spline(ALONG), -1, 0)
    rise, way = np.moveaxis(spline(ALONG, 1), -1, 0)[:2]
    across = half * CAP * np.cos(TURN)
    furrow = 1.4 * CAP**2 * np.exp(-((across / 3.0) ** 2)) * UPPER  # along the middle
    above = BLUNT * (high * np.sin(TURN) - furrow + 0.18 * GRAIN) / np.hypot(rise, way)  # with papillae
    return _points(np.stack([across, up + above * way, forward - above * rise], axis=-1))


def tongue_paint() -> Array:
    """Return the colors (n, 3) of the points of a tongue.

    Examples
    --------
    >>> bool((tongue_paint()[:, 0] > tongue_paint()[:, 1]).all())
    True
    """
    furrow = 0.25 * CAP**2 * np.exp(-((7.0 * np.cos(TURN)) ** 2)) * UPPER  # the share of the light that it lacks
    back, side = np.array([206.0, 134.0, 130.0]), np.array([188.0, 96.0, 94.0])  # the back is coated
    tint = side + np.sqrt(UPPER)[:, None] * (back - side)
    return _points(tint * (1.0 + 0.045 * GRAIN - furrow)[..., None])


def _points(rings: Array) -> Array:
    """Values of all rings but the last, and of the middles of the first and the last, which close the ends."""
    return np.vstack([rings[:-1].reshape(-1, 3), rings[[0, -1]].mean(axis=1)])


def tongue_triangles() -> IntArray:
    """Return the triangles (m, 3) of a tongue, counter-clockwise seen from outside.

    Examples
    --------
    >>> int(tongue_triangles().max()) + 1 == len(tongue_paint())
    True
    """
    last = len(TURN) * (RINGS - 1)
    return ring_triangles(len(TURN), RINGS - 1, first=last, last=last + 1)
