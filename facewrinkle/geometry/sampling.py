"""Points spread evenly over triangles, not at random: the same ones every time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import Array

PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])
"""1 / p and 1 / p^2 of the plastic number p: their multiples fill the square evenly (Roberts 2018)."""


def triangle_samples(count: int) -> tuple[Array, Array]:
    """Coordinates u and v (count,) of points a + u (b - a) + v (c - a) of a triangle.

    They are the additive sequence of the plastic number, every stretch of which is evenly spread.

    Examples
    --------
    >>> u, v = triangle_samples(1000)
    >>> round(float(u.mean()), 2), round(float(v.mean()), 2), bool((u + v <= 1.0).all())
    (0.33, 0.33, True)
    """
    u, v = ((0.5 + np.arange(count)[:, None] * PLASTIC) % 1.0).T
    over = u + v > 1.0
    return np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)


def surface_samples(points: Array, triangles: npt.NDArray[np.integer], count: int) -> Array:
    """Return `count` points (count, 3) spread over the triangles evenly by area.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> surface_samples(square, np.array([[0, 1, 2], [0, 2, 3]]), 1000).mean(axis=0).round(2)
    array([0.5, 0.5, 0. ])
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.cumsum(np.linalg.norm(np.cross(b - a, c - a), axis=1))
    which = np.searchsorted(area, (np.arange(count) + 0.5) / count * area[-1])
    u, v = (share[:, None] for share in triangle_samples(count))
    return np.asarray(a[which] + u * (b - a)[which] + v * (c - a)[which])
