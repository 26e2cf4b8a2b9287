"""Triangles that turn over as the skin moves."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from facewrinkle.geometry.topology import vertex_rings

from . import _oracle_kernels as kernels

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.integer]


class Normals:
    """Normals of the triangles of a moved skin, which several checks share.

    Attributes
    ----------
    cross : ndarray, shape (m, 3)
        Twice their area long.
    """

    def __init__(self, points: Array, triangles: IntArray) -> None:
        self.cross = np.empty((len(triangles), 3))
        kernels.crossed(points, triangles, self.cross)


class Orientation:
    """Orientation of triangles relative to the rotation of the skin around each: negative for those turned over.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        At rest.
    triangles : ndarray of int, shape (m, 3)
    """

    def __init__(self, points: Array, triangles: IntArray) -> None:
        n = len(points)
        start, ring = vertex_rings(triangles, n)
        first = csr_array((np.ones(len(ring)), ring, start), shape=(n, n))
        two = csr_array(first @ first + first)
        two.setdiag(0.0)
        two.eliminate_zeros()
        self._start, self._ring = two.indptr, two.indices
        offsets = points[self._ring] - np.repeat(points, np.diff(self._start), axis=0)
        self._weight = 1.0 / np.maximum((offsets**2).sum(axis=1), 1e-12)
        self._rest, self._triangles = points, triangles
        self._cross = Normals(points, triangles).cross

    def shares(self, points: Array, normals: Normals, chosen: IntArray) -> Array:
        """Return the signed area of chosen triangles, relative to rest, along their rotated rest normals.

        The rotation of a normal is the one that fits two rings around its triangle best.
        """
        out = np.empty(len(chosen))
        rings = self._start, self._ring, self._weight
        kernels.area_shares(points, self._rest, *rings, self._triangles, chosen, normals.cross, self._cross, out)
        return out

    def turned_over(self, points: Array, normals: Normals) -> IntArray:
        """Return the triangles that are turned over, or have no area left."""
        change, chosen = np.empty(len(points)), np.empty(len(self._triangles), np.int64)
        kernels.changes(points, self._rest, self._start, self._ring, self._weight, change)
        chosen = chosen[: kernels.doubtful(normals.cross, self._cross, change, self._triangles, chosen)]
        return chosen[self.shares(points, normals, chosen) <= 0.0]
