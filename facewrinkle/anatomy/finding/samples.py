"""Point clouds thinned, and meshes coarsened by vertex clustering."""

from __future__ import annotations

import numpy as np

from ...array_types import Array, IntArray


def thinned(points: Array, spacing: float) -> Array:
    """Return the first of the points in every cube of a grid with this spacing."""
    cell = np.floor(points / spacing).astype(np.int64)
    cell -= cell.min(axis=0)
    number = np.ravel_multi_index(tuple(cell.T), tuple(cell.max(axis=0) + 1))
    return points[np.sort(np.unique(number, return_index=True)[1])]


def clustered(
    points: Array, triangles: IntArray, centre: Array, radius: float, spacing: float
) -> tuple[Array, IntArray]:
    """Return a coarser mesh of the triangles that reach into a ball, by vertex clustering.

    All corners in one cube of a grid become their mean; triangles with two corners in one cube are dropped.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(9.0), np.arange(2.0))
    >>> points = np.stack([x.ravel(), y.ravel(), np.zeros(18)], axis=1)
    >>> low = np.arange(8)
    >>> triangles = np.concatenate([np.stack([low, low + 1, low + 9], 1), np.stack([low + 1, low + 10, low + 9], 1)])
    >>> [len(array) for array in clustered(points, triangles, np.zeros(3), 3.5, 2.0)]
    [3, 0]
    >>> [len(array) for array in clustered(points, triangles, np.zeros(3), 3.5, 0.5)]
    [10, 8]
    """
    within = ((points - centre) ** 2).sum(axis=1) < radius**2
    triangles = triangles[within[triangles].any(axis=1)]
    used = np.zeros(len(points), bool)
    used[triangles] = True
    corners = points[used]
    cell = np.floor((corners - corners.min(axis=0, initial=np.inf)) / spacing).astype(np.int64)
    wide = cell.max(axis=0, initial=0) + 1
    _, cluster = np.unique((cell[:, 0] * wide[1] + cell[:, 1]) * wide[2] + cell[:, 2], return_inverse=True)
    size = np.bincount(cluster)
    number = np.zeros(len(points), np.int64)
    number[used] = cluster
    merged = number[triangles]
    proper = (merged != np.roll(merged, 1, axis=1)).all(axis=1)
    return np.stack([np.bincount(cluster, c) / size for c in corners.T], axis=1), merged[proper]
