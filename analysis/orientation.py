"""Triangles that turn over as the skin moves."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from facewrinkle.geometry.rigid_alignment import closest_rotations
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
    around : ndarray, shape (n, 3)
        Their sums around each vertex.
    """

    def __init__(self, points: Array, triangles: IntArray) -> None:
        self.cross, self.around = np.empty((len(triangles), 3)), np.empty_like(points)
        kernels.crossed(points, triangles, self.cross)
        kernels.gathered(self.cross, triangles, self.around)


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
        normals = Normals(points, triangles)
        self._cross, self._lean = normals.cross, self._leans(normals)

    def _leans(self, normals: Normals) -> Array:
        out = np.empty(len(self._triangles))
        kernels.leans(normals.cross, normals.around, self._triangles, out)
        return out

    def shares(self, points: Array, normals: Normals, chosen: IntArray) -> Array:
        """Return the signed area of chosen triangles, relative to rest, along their rotated rest normals.

        The rotation of a normal is the one that fits two rings around its triangle best (Kabsch).
        """
        spread = np.zeros((len(chosen), 3, 3))
        kernels.spreads(points, self._rest, self._start, self._ring, self._weight, self._triangles[chosen], spread)
        turn, rest = closest_rotations(spread), self._cross[chosen]
        rotated = np.einsum("tij,tj->ti", turn, rest)
        return np.asarray((normals.cross[chosen] * rotated).sum(axis=1) / (rest**2).sum(axis=1))

    def turned_over(self, points: Array, normals: Normals) -> IntArray:
        """Return the triangles that are turned over, or have no area left."""
        doubtful = np.flatnonzero(self._leans(normals) + self._lean > kernels.SURELY_UPRIGHT)
        return doubtful[self.shares(points, normals, doubtful) <= 0.0]
