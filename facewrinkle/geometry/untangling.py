"""Triangles that are turned over against the surface around them are turned back."""

from __future__ import annotations

import numpy as np

from ..array_types import Array, IntArray
from . import _untangling_kernels as kernels
from .rigid_alignment import closest_rotations

LEAST = 0.1
"""Triangles get at least this share of their area at rest, along their normals at rest, turned with the surface."""

SWEEPS = 100
"""The most sweeps of a round in which vertices are moved: what one triangle gets, the next one may lack."""

ROUNDS = 20
"""The most rounds in which vertices near triangles that are still turned over go along with their neighbours."""


class Untangling:
    """Turns back triangles of a moved mesh that are turned over.

    A triangle is turned over if its area along a direction is negative: its normal at rest, turned as the surface
    around it has turned. That is the rotation which fits two rings of vertices around its corners best (Kabsch 1976),
    with weights of one over their squared distances at rest. Where the surface is crumpled so much that this says
    nothing, some may remain.

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
    >>> len(untangling.turned_over(moved)), len(untangling.turned_over(mended))
    (3, 0)
    """

    def __init__(self, points: Array, triangles: IntArray, offsets: IntArray, ring: IntArray) -> None:
        self._points = np.ascontiguousarray(points, dtype=np.float64)
        self._triangles, self._rings = np.ascontiguousarray(triangles, np.int32), (offsets, ring)
        self._cross = np.empty((len(triangles), 3))
        kernels.crosses(self._points, self._triangles, self._cross)

    def untangled(self, points: Array) -> Array:
        """Return moved points (n, 3) with no triangle turned over; the given ones themselves if none is.

        Corners of triangles that are turned over, or nearly so, make room for them. Where they cannot, there and around
        points go half the way to where the mean motion of their neighbours takes them, and make room again.
        """
        low = self._low(points, LEAST, some=True)
        if not len(low):
            return points
        out = self._swept(points, low)
        for _ in range(ROUNDS):
            left = self._low(out, 0.5 * LEAST)
            if not len(left):
                break
            points = self._smoothed(points, left)
            out = self._swept(points, self._low(points, LEAST))
        return out

    def turned_over(self, points: Array) -> IntArray:
        """Return the triangles (k,) that are turned over at points (n, 3)."""
        return self._low(points, 0.0)

    def _low(self, points: Array, least: float, some: bool = False) -> IntArray:
        """Return the triangles (k,) with less than a share of their area at rest, along where they should face.

        `some` takes a triangle that faces as the triangles around it do for one that is upright: no rotations are
        needed, and in a heap of triangles that are turned over a few are overlooked.
        """
        triangles, marked = self._triangles, np.zeros(len(points), np.bool_)
        if not kernels.turned(points, triangles, self._cross, least, marked):
            return np.empty(0, np.int64)
        chosen = kernels.touching(triangles, marked)
        if some:
            chosen = kernels.doubtful(points, triangles, self._cross, least, marked, chosen)
        facing, double = self._facing(points, chosen)
        shares = np.empty(len(chosen))
        kernels.shares(points, triangles, chosen, facing, double, shares)
        return np.asarray(chosen[(shares < least) & facing.any(axis=1)])

    def _swept(self, points: Array, low: IntArray) -> Array:
        """Return points (n, 3) at which the corners of low triangles have made room for them."""
        out, free = points.copy(), np.zeros(len(points), np.bool_)
        free[self._triangles[low]] = True
        around = kernels.touching(self._triangles, free)
        kernels.turn_back(out, self._triangles, around, *self._facing(points, around), free, LEAST, SWEEPS)
        return out

    def _smoothed(self, points: Array, low: IntArray) -> Array:
        """Return points (n, 3), of which those around low triangles have gone half the way to the mean motion."""
        marked, out, moved = np.zeros(len(points), np.bool_), points.copy(), points - self._points
        marked[self._triangles[low]] = True
        offsets, ring = self._rings
        for vertex in np.unique(self._triangles[kernels.touching(self._triangles, marked)]):
            mean = moved[ring[offsets[vertex] : offsets[vertex + 1]]].mean(axis=0)
            out[vertex] += 0.5 * (mean - moved[vertex])
        return out

    def _facing(self, points: Array, chosen: IntArray) -> tuple[Array, Array]:
        """Normals (k, 3) of chosen triangles at rest, turned with the surface around them, and twice the areas (k,)."""
        m = np.empty((len(chosen), 3, 3))
        kernels.correlations(points, self._points, self._triangles, chosen, *self._rings, m)
        cross = self._cross[chosen]
        double = np.maximum(np.linalg.norm(cross, axis=1), 1e-300)
        facing = np.einsum("ti,tij->tj", cross, closest_rotations(m))
        return facing / double[:, None], double
