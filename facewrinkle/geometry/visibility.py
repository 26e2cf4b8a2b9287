"""How much of the light from afar reaches the points of a surface: shadows of one lamp, and openness to all sides."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np

from ..array_types import Array, IntArray
from .compilation import compiled
from .depth_buffer import depth_buffer
from .normals import tangent_axes

GOLDEN = np.pi * (3.0 - np.sqrt(5.0))

DIRECTIONS = 28
"""Directions in which openness is looked for."""


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
        number, step = np.arange(rays), self._step
        away = soft * np.sqrt((number + 0.5) / rays)[:, None] / step
        around = away * np.stack([np.cos(GOLDEN * number), np.sin(GOLDEN * number)], axis=1)
        asked = normals @ self._axes[2] > least
        place = (points[asked] + 1.3 * step * normals[asked]) @ self._axes.T
        place[:, :2] = (place[:, :2] - self._low) / step
        place[:, 2] += 1.3 * step
        out, found = np.ones(len(points)), np.empty(len(place))
        _hidden(place, around, self._depth, 2.0 * step, found)
        out[asked] = found
        return out


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
def _hidden(places, rays, depth, fade, out):
    """Share of rays (k, 2), offsets in nodes, on which places (n, 3), [column, row, z], lie below a depth buffer.

    It grows over `fade` of z.
    """
    rows, columns = depth.shape
    for i in range(len(places)):
        total = 0.0
        for k in range(len(rays)):
            column, row = int(places[i, 0] + rays[k, 0] + 0.5), int(places[i, 1] + rays[k, 1] + 0.5)
            if 0 <= column < columns and 0 <= row < rows:
                t = min(max((depth[row, column] - places[i, 2]) / fade, 0.0), 1.0)
                total += t * t * (3.0 - 2.0 * t)
        out[i] = total / len(rays)
