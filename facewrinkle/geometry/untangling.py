"""Triangles that are turned over against the surface around them are turned back."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import _untangling_kernels as kernels

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.integer]

LEAST = 0.1
"""Triangles get at least this share of their area at rest, along their normals at rest, turned with the surface."""

SWEEPS = 100
"""The most rounds in which vertices are moved: what one triangle gets, the next one may lack."""


class Untangling:
    """Moves of the vertices of a triangle mesh that turn over no triangle.

    A triangle is turned over if its area along a direction is negative: its normal at rest, turned as the surface
    around it has turned. That is the rotation which fits two rings of vertices around its corners best (Horn,
    "Closed-form solution of absolute orientation using unit quaternions", 1987).

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        At rest.
    triangles : ndarray of int, shape (m, 3)
    offsets, ring : ndarray of int
        Neighbours of each vertex; see :func:`facewrinkle.geometry.topology.vertex_rings`.

    Examples
    --------
    One vertex of a flat grid is moved beyond its neighbours:

    >>> import pyvista as pv
    >>> from facewrinkle.geometry.topology import vertex_rings
    >>> grid = pv.Plane(i_resolution=6, j_resolution=6, i_size=6.0, j_size=6.0).triangulate()
    >>> points, triangles = grid.points.astype(float), grid.regular_faces
    >>> untangling = Untangling(points, triangles, *vertex_rings(triangles))
    >>> moved = points.copy()
    >>> moved[24, :2] += 1.3
    >>> mended = untangling.untangled(moved)
    >>> areas = [np.cross(*(p[triangles[:, k]] - p[triangles[:, 0]] for k in (1, 2)))[:, 2] for p in (moved, mended)]
    >>> bool(areas[0].min() < -0.2), bool(areas[1].min() > 0.09)
    (True, True)
    """

    def __init__(self, points: Array, triangles: IntArray, offsets: IntArray, ring: IntArray) -> None:
        self._points = np.ascontiguousarray(points, dtype=np.float64)
        self._triangles, self._rings = np.ascontiguousarray(triangles, np.int32), (offsets, ring)
        self._cross = np.empty((len(triangles), 3))
        kernels.crosses(self._points, self._triangles, self._cross)

    def untangled(self, points: Array) -> Array:
        """Return moved points (n, 3) with all triangles upright; the given ones themselves if they are."""
        triangles, marked = self._triangles, np.zeros(len(points), np.bool_)
        if not kernels.turned(points, triangles, self._cross, LEAST, marked):
            return points
        near = kernels.touching(triangles, marked)
        chosen = kernels.doubtful(points, triangles, self._cross, LEAST, marked, near)
        low = self._shares(points, chosen, *self._facing(points, chosen)) < LEAST
        if not low.any():
            return points
        out, free = points.copy(), np.zeros(len(points), np.bool_)
        free[triangles[chosen[low]]] = True
        around = kernels.touching(triangles, free)
        kernels.turn_back(out, triangles, around, *self._facing(points, around), free, LEAST, SWEEPS)
        return out

    def _facing(self, points: Array, chosen: IntArray) -> tuple[Array, Array]:
        """Normals (k, 3) of chosen triangles at rest, turned with the surface around them, and twice the areas (k,)."""
        m = np.empty((len(chosen), 3, 3))
        kernels.correlations(points, self._points, self._triangles, chosen, *self._rings, m)
        n = np.empty((len(chosen), 4, 4))
        n[:, 0, 0] = np.trace(m, axis1=1, axis2=2)
        n[:, 1:, 1:] = m + m.transpose(0, 2, 1) - n[:, :1, :1] * np.eye(3)
        n[:, 0, 1:] = n[:, 1:, 0] = np.stack(
            [m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1
        )
        quaternion = np.linalg.eigh(n)[1][:, :, 3]
        scalar, vector = quaternion[:, :1], quaternion[:, 1:]
        cross = self._cross[chosen]
        double = np.maximum(np.linalg.norm(cross, axis=1), 1e-300)
        aside = 2.0 * np.cross(vector, cross)
        facing = cross + scalar * aside + np.cross(vector, aside)
        return facing / double[:, None], double

    def _shares(self, points: Array, chosen: IntArray, facing: Array, double: Array) -> Array:
        out = np.empty(len(chosen))
        kernels.shares(points, self._triangles, chosen, facing, double, out)
        return out
