"""Laplacians and means of neighbors on triangle meshes, as sparse matrices."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from ..array_types import Array


def symmetric_factors(matrix: csc_array) -> SuperLU:
    """Return the factors of a sparse matrix that is symmetric and positive definite.

    Examples
    --------
    >>> symmetric_factors(csc_array(np.diag([2.0, 4.0]))).solve(np.ones(2)).tolist()
    [0.5, 0.25]
    """
    # relax=1: relaxed supernodes take minutes where vertices are numbered as subdivision does, and fill in no less.
    return splu(matrix, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, relax=1, options={"SymmetricMode": True})


def graph_laplacian(edges: npt.NDArray[np.integer], weight: Array, n: int) -> csr_array:
    """Laplacian (n, n) of the graph with these edges (e, 2) and weights (e,): rows sum to 0, positive semi-definite.

    Examples
    --------
    >>> graph_laplacian(np.array([[0, 1]], np.int32), np.array([2.0]), 2).toarray()
    array([[ 2., -2.],
           [-2.,  2.]])
    """
    i, j = edges[:, 0], edges[:, 1]
    ends = np.concatenate([i, j]), np.concatenate([j, i])
    graph = csr_array((np.concatenate([weight, weight]), ends), shape=(n, n))
    return csr_array(diags_array(np.asarray(graph.sum(axis=1))) - graph)


def neighbor_mean(edges: npt.NDArray[np.integer], n: int) -> csr_array:
    """Matrix (n, n) that gives each vertex the mean of those it shares an edge (e, 2) with; loose vertices get 0.

    Examples
    --------
    >>> neighbor_mean(np.array([[0, 1], [1, 2]]), 4) @ np.array([1.0, 2.0, 5.0, 7.0])
    array([2., 3., 2., 0.])
    """
    both = np.concatenate([edges, edges[:, ::-1]]).T
    links = csr_array((np.ones(both.shape[1]), both), shape=(n, n))
    return csr_array(links.multiply(1.0 / np.maximum(links.sum(axis=1), 1.0)[:, None]))


def cotangent_laplacian(points: Array, triangles: npt.NDArray[np.int32]) -> csr_array:
    """Laplacian (n, n) with half-cotangent weights, bounded so that needle-shaped triangles do not dominate.

    Examples
    --------
    Away from the border it vanishes on linear functions, whatever the shape of the triangles:

    >>> p = np.array([[0.0, 0, 0], [3, 0, 0], [0, 2, 0], [-1, 0, 0], [0, -1, 0]])
    >>> laplacian = cotangent_laplacian(p, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]], np.int32))
    >>> (laplacian @ p)[0].round(12)
    array([0., 0., 0.])
    """
    pairs, weights = [], []
    for k in range(3):
        o, i, j = triangles[:, k], triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3]
        a, b = points[i] - points[o], points[j] - points[o]
        cotangent = (a * b).sum(axis=1) / np.maximum(np.linalg.norm(np.cross(a, b), axis=1), 1e-12)
        pairs.append(np.stack([i, j], axis=1))
        weights.append(np.clip(0.5 * cotangent, -1.0, 4.0))
    return graph_laplacian(np.concatenate(pairs), np.concatenate(weights), len(points))
