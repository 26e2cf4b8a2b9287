"""Charts: one-to-one maps of fine triangle meshes to the plane.

Mean value coordinates: Floater, CAGD 20, 2003.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from facewrinkle.geometry.compilation import compiled

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


def mean_value_chart(
    points: Array, triangles: IntArray, fixed: list[IntArray], values: list[Array], pull: Array | None = None
) -> Array:
    """Return planar coordinates (n, 2) in which every free vertex is an average of its neighbors.

    The weights are mean values, times the mean `pull` (n,) > 0 of both ends of an edge: vertices that pull more get
    less room. `fixed[c]` are the vertices whose coordinate c is given, by `values[c]`. With all of a convex outline
    given, the chart is one-to-one.
    """
    n = len(points)
    pull = np.ones(n) if pull is None else pull
    rows, columns, weights = [], [], []
    for k in range(3):
        i, j, l = triangles[:, k], triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3]
        a, b = points[j] - points[i], points[l] - points[i]
        length_a, length_b = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
        sine = np.linalg.norm(np.cross(a, b), axis=1)
        half_tangent = sine / (length_a * length_b + np.einsum("ij,ij->i", a, b))
        rows += [i, i]
        columns += [j, l]
        weights += [half_tangent / length_a * (pull[i] + pull[j]), half_tangent / length_b * (pull[i] + pull[l])]
    matrix = sparse.csr_array((np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))), shape=(n, n))
    laplacian = (sparse.diags_array(matrix.sum(axis=1)) - matrix).tocsr()
    chart = np.empty((n, 2))
    for c in range(2):
        free = np.ones(n, dtype=bool)
        free[fixed[c]] = False
        chart[fixed[c], c] = values[c]
        right = -laplacian[free][:, ~free] @ chart[~free, c]
        chart[free, c] = spsolve(laplacian[free][:, free].tocsc(), right)
    return chart


class Chart:
    """Values of a fine charted mesh, interpolated at points of the chart.

    Parameters
    ----------
    plane : ndarray, shape (n, 2)
        The chart.
    triangles : ndarray of int, shape (m, 3)
    values : ndarray, shape (n, k)
    """

    def __init__(self, plane: Array, triangles: IntArray, values: Array) -> None:
        self.plane, self.triangles, self.values = plane, triangles, values
        self._corners = plane[triangles]
        self._tree = cKDTree(self._corners.mean(axis=1))

    def __call__(self, at: Array, most: int = 256) -> Array:
        """Return the values (q, k) at chart points (q, 2); see `locate`. Outside, a near triangle counts."""
        cells, weights = self.locate(at, most=most)
        return np.einsum("qc,qck->qk", weights, self.values[self.triangles[cells]])

    def locate(self, at: Array, near: int = 4, most: int = 256) -> tuple[IntArray, Array]:
        """Return the triangle (q,) and barycentric weights (q, 3) of chart points (q, 2).

        The triangles with the `near` nearest centroids are tried, then more, up to `most`.
        """
        near = min(near, len(self.triangles))
        candidates = self._tree.query(at, k=near)[1].reshape(len(at), near)
        cells, weights = _best(at, self._corners, candidates)
        missed = weights.min(axis=1) < -1e-9
        if near < min(most, len(self.triangles)) and missed.any():
            cells[missed], weights[missed] = self.locate(at[missed], 8 * near, most)
        weights = np.maximum(weights, 0.0)
        return cells, weights / weights.sum(axis=1, keepdims=True)


@compiled
def _best(at, corners, candidates):  # type: ignore[no-untyped-def]
    """Of the candidates (q, k) at points (q, 2), those with the largest least barycentric weight, and the weights."""
    cells, weights = np.empty(len(at), np.int64), np.empty((len(at), 3))
    for q in range(len(at)):
        most, (x, y) = -np.inf, at[q]
        for cell in candidates[q]:
            (ax, ay), (bx, by), (cx, cy) = corners[cell]
            area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
            v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
            w = ((ax - x) * (by - y) - (ay - y) * (bx - x)) / area
            least = min(u, v, w)
            if least > most:
                most, cells[q], weights[q] = least, cell, (u, v, w)
    return cells, weights


def cross(a: Array, b: Array) -> Array:
    """Return planar cross products along the last axis."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
