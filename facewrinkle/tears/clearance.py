"""The room between a tear and other skin: the other lid of an eye that closes, or the other side of a fold."""

from __future__ import annotations

from itertools import chain

import numpy as np
from scipy.spatial import cKDTree

from ..array_types import Array, IntArray
from . import _kernels as kernels
from .footprint import overlapping

REACH = 2.5
"""Distance from the skin, in heights of the tear, within which other skin is looked up."""

SAME = 6e-8
"""Distance along a ray, in widths of the tear, below which it only meets the triangle that it starts on."""


def kept_off(
    bottom: Array,
    rest: Array,
    normals: Array,
    height: Array,
    under: IntArray,
    skin: tuple[Array, Array, IntArray],
    width: float,
) -> Array:
    """Return heights so low that every vertex stays less than half way to skin ahead of it, and to other skin near it.

    Parameters
    ----------
    bottom, rest, normals : ndarray, shape (n, 3)
        Vertices on the skin, the same at rest, and unit normals.
    height : ndarray, shape (n,)
    under : ndarray of int, shape (n,)
        The triangle of the skin that each vertex stands on.
    skin : tuple of ndarray
        Its points, its points at rest, and its triangles. Other skin is far from a vertex at rest.
    width : float
        Width of the tear.

    Examples
    --------
    A vertex 2 mm high, with skin of the other side of a fold 1 mm above it that is far at rest:

    >>> flat = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    >>> points, at_rest = np.vstack([flat, flat + [0, 0, 1]]), np.vstack([flat, flat + [0, 50, 0]])
    >>> skin = points, at_rest, np.array([[0, 1, 2], [4, 3, 5]])
    >>> origin, up = np.zeros((1, 3)), np.array([[0.0, 0, 1]])
    >>> kept_off(origin, origin, up, np.array([2.0]), np.array([0]), skin, width=3.0)
    array([0.45])
    """
    points, at_rest, triangles = skin
    hosts, group = np.unique(under, return_inverse=True)
    tallest = np.zeros(len(hosts))
    np.maximum.at(tallest, group, height)
    around, reach = _balls(points[triangles[hosts]]), REACH * tallest
    out = (around[:, 3] + reach)[:, None]
    some = overlapping(points, triangles, (around[:, :3] - out).min(axis=0), (around[:, :3] + out).max(axis=0))
    corners, balls = points[triangles[some]], _balls(points[triangles[some]])
    found = cKDTree(balls[:, :3]).query_ball_point(around[:, :3], out[:, 0] + balls[:, 3].max())
    owner = np.repeat(np.arange(len(hosts)), [len(each) for each in found])
    near = np.fromiter(chain.from_iterable(found), np.int64, len(owner))
    close = np.linalg.norm(balls[near, :3] - around[owner, :3], axis=1) < out[owner, 0] + balls[near, 3]
    owner, near = owner[close], near[close]
    offsets = np.searchsorted(owner, np.arange(len(hosts) + 1))
    lowered = height.copy()
    kernels.limit_heights(
        bottom, rest, normals, group, offsets, near, corners, balls, _balls(at_rest[triangles[some]]), SAME * width,
        lowered,
    )  # fmt: skip
    return lowered


def _balls(corners: Array) -> Array:
    """Centres and radii (k, 4) of balls around triangles (k, 3, 3)."""
    centres = corners.mean(axis=1)
    return np.column_stack([centres, np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)])
