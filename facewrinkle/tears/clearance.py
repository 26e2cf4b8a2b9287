"""The room between a tear and other skin: the other lid of an eye that closes, or the other side of a fold."""

from __future__ import annotations

from scipy.spatial import cKDTree

from ..array_types import Array, IntArray
from ..geometry.interpolation import balls_around, overlapping
from ..geometry.topology import pairs_of
from . import _kernels as kernels

REACH = 2.5
"""Distance from the skin, in heights of the tear, within which other skin is looked up."""

SAME = 6e-8
"""Distance along a ray, in widths of the tear, below which it only meets the triangle that it starts on."""


def kept_off(
    bottom: Array, rest: Array, normals: Array, height: Array, skin: tuple[Array, Array, IntArray], width: float
) -> Array:
    """Return heights so low that every vertex stays less than half way to skin ahead of it, and to other skin near it.

    Parameters
    ----------
    bottom, rest, normals : ndarray, shape (n, 3)
        Vertices on the skin, the same at rest, and unit normals.
    height : ndarray, shape (n,)
    skin : tuple of ndarray
        Its points, its points at rest, and its triangles. Other skin is far from a vertex at rest.
    width : float
        Width of the tear.

    Examples
    --------
    A vertex 2 mm high, with skin of the other side of a fold 1 mm above it that is far at rest:

    >>> import numpy as np
    >>> flat = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    >>> points, at_rest = np.vstack([flat, flat + [0, 0, 1]]), np.vstack([flat, flat + [0, 50, 0]])
    >>> skin = points, at_rest, np.array([[0, 1, 2], [4, 3, 5]])
    >>> origin, up = np.zeros((1, 3)), np.array([[0.0, 0, 1]])
    >>> kept_off(origin, origin, up, np.array([2.0]), skin, width=3.0)
    array([0.45])
    """
    points, at_rest, triangles = skin
    lowered, reach = height.copy(), REACH * height.max(initial=0.0)
    beside = triangles[overlapping(points, triangles, bottom.min(axis=0) - reach, bottom.max(axis=0) + reach)]
    corners = points[beside]
    balls = balls_around(corners)
    near = cKDTree(bottom).query_ball_point(balls[:, :3], balls[:, 3] + reach, return_sorted=False)
    triangle, vertex = pairs_of(near)
    kernels.limit_heights(
        bottom, rest, normals, vertex, triangle, corners, balls, balls_around(at_rest[beside]), SAME * width, lowered
    )
    return lowered
