"""The flesh of the lips: their lining cannot come out through their skin, nor their skin through their lining."""

from __future__ import annotations

from itertools import chain

import numpy as np
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..array_types import Array, IntArray
from ..geometry.normals import vertex_normals
from .lip_surfaces import FacingSkin, around_mouth, joined, nearest
from .solids import SLACK, STIFFNESS

THICKEST = 15.0
"""Skin and lining that are farther apart at rest than this do not feel each other, on a face of average size, mm."""

THINNEST, THINNEST_STRAIGHT = 0.3, 0.1
"""Lips resist as they are pressed to the first share of their thickness at rest to the nearest skin, and to the second
one to the skin that is the most straight across, which is farther.
"""

SOFT = 0.1
"""Stiffness against the second one, relative to that against the nearest: as stiff as it, lips that roll in would move
by fits and starts.
"""

STRAIGHT, BESIDE = 0.5, 0.3
"""Cosine of the angle between the normal of a triangle and the way to it, above which it is the other side of the
flesh; and cosine between the normal of the vertex and this way below which the way leads through the flesh.
"""

AT_ONCE = 512
"""Vertices for which the other side is looked for at once."""


def behind_lips(face: Face, area: Array) -> FacingSkin:
    """Return the vertices of the lips, each with two triangles on the other side of the flesh.

    A vertex of the lining is kept behind the plane of a triangle of the skin, and a vertex of the skin behind that of a
    triangle of the lining. One is the nearest, at the red of the lips often close by, around their edge; the other is
    the one that lies and faces the most straight across: lips that roll in would turn their flesh inside out there.

    Parameters
    ----------
    face : Face
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.

    Examples
    --------
    Through the flesh of the built-in head's lips it is up to 15 mm:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> flesh = behind_lips(face, np.ones(len(face.points)))
    >>> thickness = flesh.gaps(face.points)
    >>> bool((thickness > flesh.allowed).all()), bool(4.0 < thickness.max() < THICKEST * face.frame.scale)
    (True, True)
    """
    points, near = face.points * face.unit, around_mouth(face)
    vertices, triangles = np.flatnonzero(near), face.triangles.astype(np.int64)
    normals = vertex_normals(points, face.triangles)[vertices]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    facing = np.cross(b - a, c - a)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-12)
    closest, straight = _opposite(
        points[vertices], normals, (a + b + c) / 3.0, facing, THICKEST * face.frame.scale * face.unit
    )
    stiff = STIFFNESS * area
    pairs = (
        (closest, closest >= 0, THINNEST, stiff),
        (straight, straight != closest, THINNEST_STRAIGHT, SOFT * stiff),
    )
    return joined(
        [_kept_behind(points, vertices[which], triangles[k[which]], own, least) for k, which, least, own in pairs]
    )


def _kept_behind(points: Array, vertices: IntArray, triangles: IntArray, stiffness: Array, least: float) -> FacingSkin:
    """Return vertices (k,) that are kept behind triangles (k, 3), at a least share of their distance at rest."""
    corners, shares = np.repeat(vertices[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (len(vertices), 1))
    behind = np.ascontiguousarray(triangles[:, ::-1])
    flesh = FacingSkin(corners, shares, behind, np.zeros(len(vertices)), stiffness[vertices])
    thickness = flesh.gaps(points)
    return flesh.touching_from(np.minimum(least * thickness, thickness - SLACK))


def _opposite(places: Array, normals: Array, middles: Array, facing: Array, reach: float) -> tuple[IntArray, IntArray]:
    """Return the numbers (k,) of the nearest triangle through the flesh from each place, and of the one that is the
    most straight across; -1 for none.
    """
    out = np.full((2, len(places)), -1)
    tree = cKDTree(middles)
    for first in range(0, len(places), AT_ONCE):
        found = tree.query_ball_point(places[first : first + AT_ONCE], reach)
        i = np.repeat(np.arange(first, first + len(found)), [len(f) for f in found])
        k = np.fromiter(chain.from_iterable(found), np.int64, len(i))
        offset = middles[k] - places[i]
        away = np.linalg.norm(offset, axis=1)
        across, beside = (facing[k] * offset).sum(axis=1), (normals[i] * offset).sum(axis=1)
        through = np.flatnonzero((across > STRAIGHT * away) & (beside < BESIDE * away))
        i, k, away = i[through], k[through], away[through]
        for kind, least in enumerate((away, (beside - across)[through] / away)):
            order = nearest(i, least, k)
            out[kind, i[order]] = k[order]
    return out[0], out[1]
