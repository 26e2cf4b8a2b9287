"""The triangles of a mesh that muscles fold."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from ...array_types import Array, BoolArray
from .base import Muscle


def zones(muscles: Iterable[Muscle], points: Array, triangles: npt.NDArray[np.int32]) -> BoolArray:
    """True (k, m) for the triangles that the wrinkling region of each muscle may touch.

    These are the ones with a corner, an edge's midpoint or the centroid in it, and the ring around them.

    Examples
    --------
    >>> from facewrinkle.anatomy.muscles import LinearMuscle
    >>> points = np.array([[0.0, 20, 0], [1, 20, 0], [0, 21, 0], [90, 0, 0], [91, 0, 0], [90, 1, 0]])
    >>> muscle = LinearMuscle((0, 0, 0), (0, 30, 0), max_angle=0.5, radius=40.0)
    >>> zones([muscle], points, np.array([[0, 1, 2], [3, 4, 5]], np.int32)).tolist()
    [[True, False]]
    """
    corners = points[triangles]
    centres = corners.mean(axis=1)
    sizes = np.sqrt(((corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1, initial=0.0))
    between = [centres, *(0.5 * (corners[:, side] + corners[:, side - 1]) for side in range(3))]
    x, y, z = np.ascontiguousarray(centres.T)
    out = []
    for muscle in muscles:
        middle, reach = muscle.reach
        away = (x - middle[0]) ** 2 + (y - middle[1]) ** 2 + (z - middle[2]) ** 2
        near = np.flatnonzero(away <= (1.0 + 1e-9) * (reach + sizes) ** 2)
        inside = np.zeros(len(points), bool)
        inside[triangles[near]] = True
        candidates = np.flatnonzero(inside)
        inside[candidates] = muscle.wrinkling_region(points[candidates])
        touched = _any_corner(inside, triangles[near])
        for places in between:
            others = np.flatnonzero(~touched)
            touched[others] = muscle.wrinkling_region(places[near[others]])
        ring = np.zeros(len(points), bool)
        ring[triangles[near[touched]]] = True
        out.append(_any_corner(ring, triangles))
    return np.array(out, bool).reshape(-1, len(triangles))


def _any_corner(marked: BoolArray, triangles: npt.NDArray[np.int32]) -> BoolArray:
    return np.asarray(marked[triangles[:, 0]] | marked[triangles[:, 1]] | marked[triangles[:, 2]])
