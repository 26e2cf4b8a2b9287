"""Triangles of a moved surface that have turned over, and what turns them back."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from .laplacian import neighbour_mean
from .rigid_alignment import closest_rotations
from .topology import unique_edges

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.integer]

DOUBTFUL = 0.9
"""Triangles whose normals have turned by an angle with a larger cosine than this are not turned over."""

ROUNDS = 20
"""Rounds in which corners of triangles that are turned over go half the way to the mean of their neighbours."""


class Unfolding:
    """Finds triangles of a moved surface that are turned over, and turns them back.

    A triangle is turned over if its normal points away from where the rotation takes it that fits two rings of vertices
    around it best (Kabsch 1976), with weights of one over their squared distances.

    Parameters
    ----------
    rest : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)

    Examples
    --------
    A corner of a flat grid that was drawn across its triangle:

    >>> import pyvista as pv
    >>> grid = pv.Plane(i_resolution=4, j_resolution=4).triangulate()
    >>> rest, triangles = np.asarray(grid.points, np.float64), np.asarray(grid.regular_faces)
    >>> moved = rest.copy()
    >>> moved[12] += [0.3, 0.3, 0.0]
    >>> unfolding = Unfolding(rest, triangles)
    >>> len(unfolding.turned_over(moved)) > 0, len(unfolding.turned_over(unfolding.mended(moved)))
    (True, 0)
    """

    def __init__(self, rest: Array, triangles: IntArray) -> None:
        self._rest, self._triangles, n = rest, triangles, len(rest)
        edges, _ = unique_edges(triangles)
        both = np.concatenate([edges, edges[:, ::-1]]).T
        ring = csr_array((np.ones(both.shape[1]), both), shape=(n, n))
        two = csr_array(ring @ ring + ring)
        two.setdiag(0.0)
        two.eliminate_zeros()
        self._start, self._around = two.indptr, two.indices
        self._mean = neighbour_mean(edges, n)
        self._cross = self._crossed(rest)

    def _crossed(self, points: Array) -> Array:
        a, b, c = (points[self._triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    def turned_over(self, points: Array) -> IntArray:
        """Return the triangles (k,) of the surface at `points` (n, 3) that are turned over."""
        cross = self._crossed(points)
        along = (cross * self._cross).sum(axis=1)
        size = np.linalg.norm(cross, axis=1) * np.linalg.norm(self._cross, axis=1)
        doubtful = np.flatnonzero(along < DOUBTFUL * size)
        if not len(doubtful):
            return doubtful
        used, corners = np.unique(self._triangles[doubtful], return_inverse=True)
        counts = self._start[used + 1] - self._start[used]
        owner = np.repeat(np.arange(len(used)), counts)
        first = np.repeat(self._start[used] - np.cumsum(counts) + counts, counts)
        around = self._around[first + np.arange(len(owner))]
        before, now = (x[around] - x[used[owner]] for x in (self._rest, points))
        before /= np.maximum((before**2).sum(axis=1, keepdims=True), 1e-12)
        pairs = np.einsum("pi,pj->pij", before, now).reshape(-1, 9)
        spread = np.stack([np.bincount(owner, pairs[:, k], len(used)) for k in range(9)], axis=1)
        turns = closest_rotations(spread[corners.reshape(-1, 3)].sum(axis=1).reshape(-1, 3, 3))
        expected = np.einsum("ti,tij->tj", self._cross[doubtful], turns)
        return doubtful[(cross[doubtful] * expected).sum(axis=1) <= 0.0]

    def mended(self, points: Array) -> Array:
        """Return positions (n, 3) at which triangles that are turned over are so no more, if a few rounds can do it."""
        moved = points - self._rest
        for _ in range(ROUNDS):
            turned = self.turned_over(self._rest + moved)
            if not len(turned):
                break
            corners = np.unique(self._triangles[turned])
            moved[corners] = 0.5 * (moved[corners] + self._mean[corners] @ moved)
        return np.asarray(self._rest + moved)
