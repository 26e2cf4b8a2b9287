"""The point of a mesh that is closest to a given point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..array_types import Array, IntArray
from . import _closest_point_kernels as kernels
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
    triangle, weights, distance = kernels.closest(points, triangles, np.asarray(query, dtype=np.float64))
    own = triangles[triangle]
    corners, around = points[own], triangles[np.isin(triangles, own).any(axis=1)]
    normal = weights @ vertex_normals(points, around)[own]
    length = max(float(np.linalg.norm(normal)), 1e-300)
    return ClosestPoint(int(triangle), weights, weights @ corners, normal / length, float(distance))
