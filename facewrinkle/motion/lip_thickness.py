"""The flesh of the lips: their lining cannot come out through their skin, nor their skin through their lining."""

from __future__ import annotations

from itertools import chain

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..geometry.normals import vertex_normals
from .lip_surfaces import FacingSkin, around_mouth, nearest
from .solids import SLACK, STIFFNESS

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

THICKEST = 15.0
"""Skin and lining that are farther apart at rest than this do not feel each other, on a face of average size, mm."""

THINNEST = 0.3
"""Lips resist as they are pressed to this share of their thickness at rest."""

STRAIGHT, BESIDE = 0.5, 0.3
"""Cosine of the angle between the normal of a triangle and the way to it, above which it is the other side of the
flesh; and cosine between the normal of the vertex and this way below which the way leads through the flesh.
"""

AT_ONCE = 512
"""Vertices for which the other side is looked for at once."""


def behind_lips(face: Face, area: Array) -> FacingSkin:
    """Return the vertices of the lips, each with the nearest triangle on the other side of the flesh.

    A vertex of the lining is kept behind the plane of a triangle of the skin, and a vertex of the skin behind that of a
    triangle of the lining.

    Parameters
    ----------
    face : Face
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.

    Examples
    --------
    From the red of the built-in head's lips through their flesh it is up to 15 mm:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> flesh = behind_lips(face, np.ones(len(face.points)))
    >>> thickness = flesh.gaps(face.points)
    >>> bool((thickness > flesh.allowed).all()), bool(4.0 < thickness.max() < THICKEST)
    (True, True)
    """
    points, near = face.points * face.unit, around_mouth(face)
    vertices, triangles = np.flatnonzero(near), face.triangles.astype(np.int64)
    normals = vertex_normals(points, face.triangles)[vertices]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    facing = np.cross(b - a, c - a)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-12)
    which = _opposite(points[vertices], normals, (a + b + c) / 3.0, facing, THICKEST * face.frame.scale * face.unit)
    met = np.flatnonzero(which >= 0)
    triangles = np.ascontiguousarray(triangles[which[met]][:, ::-1])
    corners = np.repeat(vertices[met, None], 3, axis=1)
    shares = np.tile([1.0, 0.0, 0.0], (len(met), 1))
    flesh = FacingSkin(corners, shares, triangles, np.zeros(len(met)), STIFFNESS * area[vertices[met]])
    thickness = flesh.gaps(points)
    return flesh.touching_from(np.minimum(THINNEST * thickness, thickness - SLACK))


def _opposite(places: Array, normals: Array, middles: Array, facing: Array, reach: float) -> IntArray:
    """Return the number (k,) of the nearest triangle straight through the flesh from each place, -1 for none."""
    out = np.full(len(places), -1)
    tree = cKDTree(middles)
    for first in range(0, len(places), AT_ONCE):
        found = tree.query_ball_point(places[first : first + AT_ONCE], reach)
        i = np.repeat(np.arange(first, first + len(found)), [len(f) for f in found])
        k = np.fromiter(chain.from_iterable(found), np.int64, len(i))
        offset = middles[k] - places[i]
        away = np.linalg.norm(offset, axis=1)
        through = (facing[k] * offset).sum(axis=1) > STRAIGHT * away
        through &= (normals[i] * offset).sum(axis=1) < BESIDE * away
        i, k, away = i[through], k[through], away[through]
        order = nearest(i, away, k)
        out[i[order]] = k[order]
    return out
