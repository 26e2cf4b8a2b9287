"""Triangles that are about to turn over: they meet their own plane as skin meets a solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..anatomy.face import Face
from ..array_types import Array, IntArray

LEAST_AREA = 0.2
"""Triangles are kept from falling below this share of their area, seen along the normal that joints have turned."""

FIRMER = 100.0
"""Stiffness of this contact, relative to the resistance of the skin when one vertex alone is moved."""

LAST_AREA, FIRMEST = 0.1, 1000.0
"""Share of their area below which as much stiffness comes on top: muscles that jump press many times as hard as they
hold. Poses that are held hardly get there, and settle as fast as without.
"""


@dataclass(frozen=True, eq=False)
class FlatTriangles:
    """Triangles at rest; mm.

    Attributes
    ----------
    triangles : ndarray of int, shape (m, 3)
    facing : ndarray, shape (m, 3)
        Unit normals.
    double_area, heights, stiffness : ndarray, shape (m,)
        Twice the area, the least height, and the stiffness against the loss of height.
    """

    triangles: IntArray
    facing: Array
    double_area: Array
    heights: Array
    stiffness: Array


def flat_triangles(face: Face, resistance: Array) -> FlatTriangles:
    """Return the triangles of a face, given the force (n,) per mm with which the skin resists when one vertex is moved.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> flats = flat_triangles(face, np.ones(len(face.points)))
    >>> bool((flats.heights > 0.0).all())
    True
    """
    points, triangles = face.points * face.unit, face.triangles.astype(np.int64)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    double = np.linalg.norm(cross, axis=1)
    longest = np.sqrt(np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0))
    stiffness = FIRMER * resistance[triangles].mean(axis=1)
    return FlatTriangles(triangles, cross / double[:, None], double, double / longest, stiffness)
