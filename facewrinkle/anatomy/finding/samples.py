"""Points spread evenly over a surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def spread(points: Array, triangles: npt.NDArray[np.int64], count: int) -> Array:
    """`count` points spread over the triangles evenly by area, the same ones every time.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> spread(square, np.array([[0, 1, 2], [0, 2, 3]]), 1000).mean(axis=0).round(2)
    array([0.5, 0.5, 0. ])
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1))
    order = np.arange(count)
    which = np.searchsorted(area, (order + 0.5) / count * area[-1])
    # The additive sequence of the plastic number: evenly spread in the square, also in every stretch of it.
    u, v = (0.5 + order * 0.7548776662466927) % 1.0, (0.5 + order * 0.5698402909980532) % 1.0
    fold = u + v > 1.0
    u, v = np.where(fold, 1.0 - u, u)[:, None], np.where(fold, 1.0 - v, v)[:, None]
    return np.asarray(a[which] + u * (b - a)[which] + v * (c - a)[which])


def thinned(points: Array, spacing: float) -> Array:
    """One point in every cube of this width."""
    cell = np.floor(points / spacing).astype(np.int64)
    cell -= cell.min(axis=0)
    number = np.ravel_multi_index(tuple(cell.T), tuple(cell.max(axis=0) + 1))
    return points[np.sort(np.unique(number, return_index=True)[1])]
