"""The point of a mesh that is closest to a given point."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..array_types import Array, IntArray
from .compilation import compiled
from .normals import vertex_normals


@dataclass(frozen=True, eq=False)
class ClosestPoint:
    """The point of a mesh that is closest to a given point.

    Attributes
    ----------
    triangle : int
    barycentric : ndarray, shape (3,)
    point, normal : ndarray, shape (3,)
        Its position, and the unit normal interpolated there; zero on triangles without area.
    distance : float

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
    >>> near = closest_point(corners, np.array([[0, 1, 2]], np.int32), [1.0, 2.0, 3.0])
    >>> near.distance, near.barycentric, near.normal
    (3.0, array([0.25, 0.25, 0.5 ]), array([0., 0., 1.]))
    """

    triangle: int
    barycentric: Array
    point: Array
    normal: Array
    distance: float


def closest_point(points: Array, triangles: IntArray, query: npt.ArrayLike) -> ClosestPoint:
    """Return the point of a mesh that is closest to `query` (3,).

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
    >>> closest_point(corners, np.array([[0, 1, 2]], np.int32), [1.0, 2.0, 3.0]).point
    array([1., 2., 0.])
    """
    triangle, weights, distance = closest(points, triangles, np.asarray(query, dtype=np.float64))
    own = triangles[triangle]
    corners, around = points[own], triangles[np.isin(triangles, own).any(axis=1)]
    normal = weights @ vertex_normals(points, around)[own]
    length = max(float(np.linalg.norm(normal)), 1e-300)
    return ClosestPoint(int(triangle), weights, weights @ corners, normal / length, float(distance))


@compiled
def closest(points, triangles, query):
    """Triangle, barycentric coordinates and distance of the point of a mesh that is closest to `query`."""
    best, found = np.inf, 0
    weights, w = np.empty(3), np.empty(3)
    for f in range(triangles.shape[0]):
        a, b, c = points[triangles[f, 0]], points[triangles[f, 1]], points[triangles[f, 2]]
        distance = closest_in_triangle(query, a, b, c, w)
        if distance < best:
            best, found = distance, f
            for k in range(3):  # as a whole, numba would compile the text of an error for it: three seconds
                weights[k] = w[k]
    return found, weights, np.sqrt(best)


@compiled
def closest_in_triangle(p, a, b, c, weights):
    """Squared distance of p from the triangle abc; the barycentric coordinates of the closest point go to `weights`.

    The triangle may be degenerate.
    """
    d00 = d01 = d11 = d20 = d21 = 0.0
    for k in range(3):  # numbers, not small arrays, which would be allocated
        ab, ac, ap = b[k] - a[k], c[k] - a[k], p[k] - a[k]
        d00 += ab * ab
        d01 += ab * ac
        d11 += ac * ac
        d20 += ap * ab
        d21 += ap * ac
    determinant = d00 * d11 - d01 * d01
    if determinant > 0.0:
        v, w = (d11 * d20 - d01 * d21) / determinant, (d00 * d21 - d01 * d20) / determinant
        if v >= 0.0 and w >= 0.0 and v + w <= 1.0:
            weights[0], weights[1], weights[2] = 1.0 - v - w, v, w
            distance = 0.0
            for k in range(3):
                distance += (p[k] - a[k] - v * (b[k] - a[k]) - w * (c[k] - a[k])) ** 2
            return distance
    best, corners = np.inf, (a, b, c)
    for e in range(3):
        start, end = corners[e], corners[(e + 1) % 3]
        along = square = distance = 0.0
        for k in range(3):
            along += (p[k] - start[k]) * (end[k] - start[k])
            square += (end[k] - start[k]) ** 2
        t = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        for k in range(3):
            distance += (p[k] - start[k] - t * (end[k] - start[k])) ** 2
        if distance < best:
            best = distance
            weights[e], weights[(e + 1) % 3], weights[(e + 2) % 3] = 1.0 - t, t, 0.0
    return best
