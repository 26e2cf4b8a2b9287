"""Triangles over a grid: depth buffers, the foremost surface seen along -z, and the light from afar that reaches it."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..array_types import Array, IntArray
from .compilation import compiled
from .normals import tangent_axes


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


# --- light from afar: shadows of one lamp, and openness to all sides -----------------------------------------------


GOLDEN = np.pi * (3.0 - np.sqrt(5.0))

DIRECTIONS = 28
"""Directions in which openness is looked for."""

RAISED, FADE = 1.3, 2.0
"""How far places are raised, along their normals and towards a lamp, before it is asked what hides them; depth of
what hides a ray only in part. Both in widths of a ray."""

GRAZING = 0.25
"""Cosine with the direction of a lamp below which a surface counts as no steeper: it does not hide the lamp itself."""


class Lamp:
    """A lamp afar, and a mesh that hides it.

    Parameters
    ----------
    mesh : tuple of ndarray
        Points (k, 3) and triangles (m, 3) of what casts shadows.
    towards : ndarray, shape (3,)
        Direction of the lamp.
    step : float
        Details smaller than this cast no shadow.

    Examples
    --------
    A small roof over the first of two places:

    >>> roof = 2.0 * np.array([[-1.0, -1, 2], [1, -1, 2], [1, 1, 2], [-1, 1, 2]]), np.array([[0, 1, 2], [0, 2, 3]])
    >>> ground, up = np.array([[0.0, 0, 0], [9, 0, 0]]), np.tile([0.0, 0, 1], (2, 1))
    >>> Lamp(roof, np.array([0.0, 0, 1]), step=0.2).hidden(ground, up, soft=0.5, rays=8).tolist()
    [1.0, 0.0]
    """

    def __init__(self, mesh: tuple[Array, IntArray], towards: Array, step: float) -> None:
        ahead = towards / np.linalg.norm(towards)
        self._axes = np.stack([*(axis[0] for axis in tangent_axes(ahead[None])), ahead])
        self._step, local = step, mesh[0] @ self._axes.T
        self._low = local[:, :2].min(axis=0) - step
        columns, rows = (np.ceil(np.ptp(local[:, :2], axis=0) / step) + 3).astype(int).tolist()
        self._depth = depth_buffer(local, mesh[1], (self._low[0], self._low[1]), step, (rows, columns))

    def hidden(self, points: Array, normals: Array, *, soft: float, rays: int, least: float = -1.0) -> Array:
        """Return the share (n,) of the lamp that the mesh hides from points on it, or near it.

        Parameters
        ----------
        points, normals : ndarray, shape (n, 3)
        soft : float
            Half the width of the border of shadows.
        rays : int
            Number of rays that tell the share.
        least : float
            Points count as hidden whose normals have no larger cosine with the direction.
        """
        step = self._step
        local = normals @ self._axes.T
        asked = local[:, 2] > least
        place = (points[asked] + RAISED * step * normals[asked]) @ self._axes.T
        place[:, :2] = (place[:, :2] - self._low) / step
        place[:, 2] += RAISED * step
        rise = -step * local[asked, :2] / np.maximum(local[asked, 2:], GRAZING)
        out, found = np.ones(len(points)), np.empty(len(place))
        _hidden(place, rise, soft / step * on_disk(rays), self._depth, FADE * step, found)
        out[asked] = found
        return out


def on_disk(number: int) -> Array:
    """Return points (number, 2) that lie evenly on a disk of radius 1.

    Examples
    --------
    >>> np.linalg.norm(on_disk(2), axis=1)
    array([0.5      , 0.8660254])
    """
    k = np.arange(number)
    around = np.stack([np.cos(GOLDEN * k), np.sin(GOLDEN * k)], axis=1)
    return np.asarray(np.sqrt((k + 0.5) / number)[:, None] * around)


def openness(points: Array, normals: Array, mesh: tuple[Array, IntArray], *, step: float) -> Array:
    """Return the share (n,) of the light from all sides of a mesh that reaches points on it.

    Examples
    --------
    Between two walls, and before one of them:

    >>> wall = np.array([[0.0, -9, -9], [0, 9, -9], [0, 9, 9], [0, -9, 9]])
    >>> walls = np.concatenate([wall, wall + [3, 0, 0]]), np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    >>> places = np.array([[0.0, 0, 0], [3, 0, 0]])
    >>> openness(places, np.tile([1.0, 0, 0], (2, 1)), walls, step=0.5).round(1).tolist()
    [0.0, 1.0]
    """
    number = np.arange(DIRECTIONS)
    height = 1.0 - (2.0 * number + 1.0) / DIRECTIONS
    around = np.sqrt(1.0 - height**2)
    seen, whole = np.zeros(len(points)), np.full(len(points), 1e-9)
    for towards in np.stack([around * np.cos(GOLDEN * number), height, around * np.sin(GOLDEN * number)], axis=1):
        facing = np.maximum(normals @ towards, 0.0)
        seen += facing * (1.0 - Lamp(mesh, towards, step).hidden(points, normals, soft=step, rays=3, least=0.0))
        whole += facing
    return np.asarray(seen / whole)


@compiled
def _hidden(places, rise, rays, depth, fade, out):
    """Share of rays (k, 2), offsets in nodes, on which places (n, 3), [column, row, z], lie below a depth buffer.

    It grows over `fade` of z. Rays start on the level to which the surface itself has risen (n, 2), in z by the node.
    """
    rows, columns = depth.shape
    for i in range(len(places)):
        total = 0.0
        for k in range(len(rays)):
            column, row = int(places[i, 0] + rays[k, 0] + 0.5), int(places[i, 1] + rays[k, 1] + 0.5)
            if 0 <= column < columns and 0 <= row < rows:
                level = places[i, 2] + max(rise[i, 0] * rays[k, 0] + rise[i, 1] * rays[k, 1], 0.0)
                t = min(max((depth[row, column] - level) / fade, 0.0), 1.0)
                total += t * t * (3.0 - 2.0 * t)
        out[i] = total / len(rays)
