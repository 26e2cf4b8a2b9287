"""Triangles over a grid: depth buffers, the foremost surface seen along -z."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import Array, IntArray
from .compilation import compiled


def depth_buffer(
    points: Array,
    triangles: IntArray,
    low: tuple[float, float],
    step: float,
    shape: tuple[int, int],
    span: tuple[float, float] = (-np.inf, np.inf),
) -> Array:
    """Return the largest z of triangles at the nodes of a grid, exact at the nodes.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
        Either winding is seen.
    low : tuple of float
        x and y of the first node.
    step : float
        Distance between nodes.
    shape : tuple of int
        Number of rows, along y, and of columns, along x.
    span : tuple of float
        Only surface between these two z is seen.

    Returns
    -------
    ndarray, shape (rows, columns)
        -inf where there is no triangle.

    Examples
    --------
    A slanted triangle, and nodes beside it:

    >>> corners = np.array([[0.0, 0, 0], [2, 0, 2], [0, 2, 0]])
    >>> depth_buffer(corners, np.array([[0, 1, 2]]), (0.0, 0.0), 1.0, (2, 4))
    array([[  0.,   1.,   2., -inf],
           [  0.,   1., -inf, -inf]])
    """
    depth, numbers = np.full(shape, -np.inf), np.empty(shape, np.int32)
    x, y = ((points[:, k] - low[k]) / step for k in range(2))
    z, corners = np.ascontiguousarray(points[:, 2]), np.ascontiguousarray(triangles, np.int32)
    rasterize(x, y, z, corners, *span, 0, numbers, depth)
    return depth


def sampled_depth_buffer(pixels: IntArray, heights: Array, shape: npt.ArrayLike) -> Array:
    """Return the largest height in every pixel of samples: points, or triangles that are sampled densely.

    A pixel shows the foremost sample anywhere in it, not the surface at its middle: slits and steps are closed or
    widened by up to a pixel.

    Parameters
    ----------
    pixels : ndarray of int, shape (n, 2)
        The pixel of each sample.
    heights : ndarray, shape (n,)
    shape : two ints

    Returns
    -------
    ndarray
        -inf where there is no sample.

    Examples
    --------
    >>> sampled_depth_buffer(np.array([[0, 0], [0, 0], [0, 2]]), np.array([1.0, 3.0, 2.0]), (1, 3))
    array([[  3., -inf,   2.]])
    """
    depth = np.full(np.asarray(shape), -np.inf)
    np.maximum.at(depth, (pixels[:, 0], pixels[:, 1]), heights)
    return depth


@compiled
def rasterize(x, y, z, triangles, low, high, first, numbers, depth):
    """Write the z of triangles and their numbers, from `first`, into the nodes where they are in front of all before.

    The node in row i and column j is at (j, i) in the coordinates x and y (n,) of the points; z is linear in them. Only
    z in [low, high] counts, and no triangle that has a corner at -inf.
    """
    rows, columns = depth.shape
    for f in range(triangles.shape[0]):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        if z[a] == -np.inf or z[b] == -np.inf or z[c] == -np.inf:
            continue
        left, right = max(min(x[a], x[b], x[c]), 0.0), min(max(x[a], x[b], x[c]), columns - 1.0)
        bottom, top = max(min(y[a], y[b], y[c]), 0.0), min(max(y[a], y[b], y[c]), rows - 1.0)
        if not (np.ceil(left) <= right and np.ceil(bottom) <= top):
            continue
        bx, by, cx, cy = x[b] - x[a], y[b] - y[a], x[c] - x[a], y[c] - y[a]
        double = bx * cy - cx * by
        if double == 0.0:
            continue
        for i in range(int(np.ceil(bottom)), int(top) + 1):
            for j in range(int(np.ceil(left)), int(right) + 1):
                v = ((j - x[a]) * cy - cx * (i - y[a])) / double
                w = (bx * (i - y[a]) - (j - x[a]) * by) / double
                if v >= -1e-9 and w >= -1e-9 and v + w <= 1.0 + 1e-9:
                    height = z[a] + v * (z[b] - z[a]) + w * (z[c] - z[a])
                    if low <= height <= high and height > depth[i, j]:
                        numbers[i, j], depth[i, j] = first + f, height
