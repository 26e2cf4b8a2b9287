"""The heights of the eyebrows, which lie on the ridge above the orbits."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ...array_types import Array, IntArray
from .depth import Grid, depth_map, openings_closed
from .pose import Pose

BROW_GRID = Grid(0.02, (-1.2, -0.6), (1.2, 1.1))

ABOVE_RIDGE = {"inner": 0.01, "mid": 0.05}
"""Height of a brow above the ridge, in distances between the pupils: on thirty-two labelled faces it lies 0.05 below to
0.09 above, and 0.03 below to 0.13 above. Their outer ends lie beside the ridge, and go along.
"""

RIDGE_SIZE = 0.1
"""Size of the bends that count, and half the breadth of the strip on which they are seen."""

STRONG_RIDGE = -0.12
"""Concavity of a ridge, at most."""

SEARCHED = (-0.4, 0.2)
"""Heights above the expected brow between which the ridge is looked for."""


def rise_of_brows(points: Array, triangles: IntArray, pose: Pose, expected: dict[str, Array]) -> float:
    """Return how far the brows lie above their expected places, by the ridge above the orbits; 0 where none is seen.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    pose : Pose
    expected : dict of str to ndarray, shape (2,)
        Expected places of the landmarks of the brows, in the face's coordinates.
    """
    depth, known = openings_closed(depth_map(pose.local(points), triangles, BROW_GRID), BROW_GRID)
    rises = []
    for name, (x, y) in expected.items():
        above = ABOVE_RIDGE.get(name.rsplit("_", 1)[1])
        strip = np.abs(BROW_GRID.x - x) < 0.5 * RIDGE_SIZE
        if above is None or not strip.any():
            continue
        profile = depth[:, strip].mean(axis=1)
        bend = gaussian_filter1d(profile, RIDGE_SIZE / BROW_GRID.step, order=2) * RIDGE_SIZE / BROW_GRID.step**2
        bend[~known[:, strip].all(axis=1)] = 0.0
        inner = bend[1:-1]
        near = (BROW_GRID.y > y + SEARCHED[0] - above) & (BROW_GRID.y < y + SEARCHED[1] - above)
        tops = near[1:-1] & (inner < bend[:-2]) & (inner <= bend[2:]) & (inner < STRONG_RIDGE)
        if tops.any():
            row = 1 + int(np.argmin(np.where(tops, inner, np.inf)))
            rises.append(float(BROW_GRID.y[row]) + above - y)
    return float(np.median(rises)) if len(rises) > 2 else 0.0
