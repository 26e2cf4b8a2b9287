"""The pressure with which a muscle closes the lips on each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..array_types import Array, IntArray
from ..geometry.normals import vertex_normals
from .constraints import from_lips
from .lip_surfaces import columns, nearest


def closing_forces(face: Face, area: Array) -> Array:
    """Return the forces (n, 3) of a pressure of 1 that presses each lip on what it faces of the other at rest.

    Parameters
    ----------
    face : Face
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.

    Examples
    --------
    Both lips are pressed equally, and nothing else is:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> forces = closing_forces(face, np.ones(len(face.points)))
    >>> bool(np.abs(forces.sum(axis=0)).max() < 1e-9), bool((forces @ face.frame.axes[1] != 0.0).sum() < 200)
    (True, True)
    """
    vertices, corners, shares, signs = _facing(face)
    forces = np.zeros_like(face.points)
    push = (area[vertices] * signs)[:, None] * face.frame.axes[1]
    np.subtract.at(forces, vertices, push)
    np.add.at(forces, corners, shares[:, :, None] * push[:, None])
    return forces


def _facing(face: Face) -> tuple[IntArray, IntArray, Array, Array]:
    """Return vertices of one lip, and the points of the other straight below (sign 1) or above (sign -1) each of them:
    corners (k, 3) and barycentric coordinates (k, 3).
    """
    points = face.points * face.unit
    left, up, _ = face.frame.axes
    size = face.frame.pupil_distance * face.unit
    marks = {name: point * face.unit for name, point in face.landmarks.items()}
    reach = 0.55 * abs((marks["mouth_l"] - marks["mouth_r"]) @ left)
    thick = 0.75 * abs((marks["upper_lip_mid"] - marks["lower_lip_mid"]) @ up)
    local = from_lips(face) * face.unit
    near = np.all(np.abs(local) < np.array([reach, thick + 0.1 * size, 0.4 * size]), axis=1)
    facing = vertex_normals(points, face.triangles) @ up
    inside = np.flatnonzero(near[face.triangles].all(axis=1))
    triangles = face.triangles[inside]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    slope = np.cross(b - a, c - a) @ up
    found = []
    for sign in (1.0, -1.0):  # the upper lip looks down on triangles that look up, and the other way round
        own = np.flatnonzero(near & (sign * facing < -0.2))
        other = triangles[sign * slope > 1e-12]
        found.append(_seen(local, own, other, sign, 0.25 * size))
    vertices, corners, shares, _, signs = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return vertices, corners, shares, signs


def _seen(
    local: Array, own: IntArray, triangles: npt.NDArray[np.int32], sign: float, far: float
) -> tuple[npt.NDArray[Any], ...]:
    """Return, for each vertex of `own` that sees one, the nearest of the triangles straight below (sign 1) or above it.

    The result is vertices, corners, barycentric coordinates, distances and signs; `local` is [left, up, forward].
    """
    i, k, shares, gaps = columns(local[own], local, triangles, sign)
    over = np.flatnonzero((gaps >= 0.0) & (gaps < far) & ~(triangles[k] == own[i][:, None]).any(axis=1))
    over = over[nearest(i[over], gaps[over], k[over])]
    corners = triangles[k[over]].astype(np.int64)
    return own[i[over]], corners, shares[over], gaps[over], np.full(len(over), sign)
