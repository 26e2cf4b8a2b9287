"""Catmull-Clark surfaces of a control cage, as sparse matrices.

The cage is a mesh of quads with boundaries. One subdivision step is a sparse matrix from old to new vertices
(Catmull and Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes", Computer-Aided
Design 10, 1978). Boundary edges follow the cubic B-spline of the boundary vertices: holes keep smooth rims.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class SubdividedCage:
    """A cage subdivided k times.

    Attributes
    ----------
    quads : ndarray of int, shape (m 4^k, 4)
        The quads of the fine mesh; rows q 4^k to (q + 1) 4^k - 1 are those of cage quad q.
    limit : sparse array, shape (n, n0)
        Points on the limit surface as combinations of the cage's points.
    grids : ndarray of int, shape (m, 2^k + 1, 2^k + 1)
        Fine vertices over each cage quad: ``grids[q, i, j]`` is the one at (u, v) = (i, j) / 2^k. u runs from the
        quad's first to its second corner, v from its first to its fourth.

    Examples
    --------
    A square, subdivided once; the vertex in its middle:

    >>> import numpy as np
    >>> once = subdivided(np.array([[0, 1, 2, 3]]), 1)
    >>> points = once.limit @ np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    >>> points[once.grids[0, 1, 1]]
    array([0.5, 0.5])
    """

    quads: IntArray
    limit: sparse.csr_array
    grids: IntArray


def subdivided(quads: IntArray, levels: int) -> SubdividedCage:
    """Return the Catmull-Clark subdivision of quads (m, 4), with its limit points.

    Examples
    --------
    >>> import numpy as np
    >>> flat = subdivided(np.array([[0, 1, 2, 3]]), 2)
    >>> flat.quads.shape, flat.grids.shape
    ((16, 4), (1, 5, 5))
    """
    count = int(quads.max()) + 1
    matrix = sparse.identity(count, format="csr")
    size = 1
    fine = quads
    corners = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]]), (len(quads), 1, 1))
    for _ in range(levels):
        step, fine = _step(fine)
        matrix = step @ matrix
        corners = _split_corners(2 * corners)
        size *= 2
    grids = np.empty((len(quads), size + 1, size + 1), dtype=np.int64)
    parent = np.repeat(np.arange(len(quads)), 4**levels)
    grids[parent[:, None], corners[..., 0], corners[..., 1]] = fine
    return SubdividedCage(fine, sparse.csr_array(_limit(fine) @ matrix), grids)


def _split_corners(corners: IntArray) -> IntArray:
    """Parameter corners of the four children of each quad, in the order of `_step`."""
    centre = corners.sum(axis=1, keepdims=True) // 4
    after = (corners + np.roll(corners, -1, axis=1)) // 2
    before = np.roll(after, 1, axis=1)
    a, b, c, d = np.moveaxis(corners, 1, 0), np.moveaxis(after, 1, 0), centre[:, 0], np.moveaxis(before, 1, 0)
    # Every child keeps its parent's orientation of u and v: the corner nearest (0, 0) of the parent comes first.
    children = [
        (a[0], b[0], c, d[0]),
        (b[0], a[1], b[1], c),
        (c, b[1], a[2], b[2]),
        (d[0], c, b[2], a[3]),
    ]
    return np.stack([np.stack(child, axis=1) for child in children], axis=1).reshape(-1, 4, 2)


def _edges(quads: IntArray) -> tuple[IntArray, IntArray, BoolArray]:
    """Unique edges (e, 2), the edge of every side of the quads (m, 4), and True for edges (e,) on the boundary."""
    sides = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2), axis=2)
    edges, index, counts = np.unique(sides.reshape(-1, 2), axis=0, return_inverse=True, return_counts=True)
    return edges, index.reshape(-1, 4), counts == 1


def _step(quads: IntArray) -> tuple[sparse.csr_array, IntArray]:
    """One subdivision: the matrix from old to new vertices, and the new quads."""
    n, m = int(quads.max()) + 1, len(quads)
    edges, side, rim = _edges(quads)
    faces = _incidence(quads, np.full(quads.shape, 0.25), n)
    ends = _incidence(edges, np.full(edges.shape, 0.5), n)
    around = sparse.csr_array((np.full(4 * m, 0.5), (side.ravel(), np.repeat(np.arange(m), 4))), shape=(len(edges), m))
    inner = sparse.diags_array(np.where(rim, 0.0, 0.5))
    edge_points = ends - inner @ ends + inner @ (around @ faces)
    vertex_points = _vertex_rule(quads, edges, rim, faces, ends, n)
    new = sparse.vstack([vertex_points, edge_points, faces]).tocsr()
    after, centre = side + n, np.arange(m) + n + len(edges)
    q, s = quads.T, after.T
    children = np.stack(
        [
            np.stack([q[0], s[0], centre, s[3]], axis=1),
            np.stack([s[0], q[1], s[1], centre], axis=1),
            np.stack([centre, s[1], q[2], s[2]], axis=1),
            np.stack([s[3], centre, s[2], q[3]], axis=1),
        ],
        axis=1,
    )
    return new, children.reshape(-1, 4)


def _vertex_rule(
    quads: IntArray, edges: IntArray, rim: BoolArray, faces: sparse.csr_array, ends: sparse.csr_array, n: int
) -> sparse.csr_array:
    """Old vertices move to (F + 2 R + (k - 3) P) / k inside, (P- + 6 P + P+) / 8 on a boundary."""
    valence = np.bincount(quads.ravel(), minlength=n).astype(float)
    to_faces = _incidence(quads, np.ones(quads.shape), n).T
    to_edges = _incidence(edges, np.ones(edges.shape), n).T
    k = sparse.diags_array(1.0 / valence)
    inside = k @ (k @ to_faces @ faces + 2.0 * (k @ to_edges @ ends))
    inside = inside + sparse.diags_array((valence - 3.0) / valence)
    on_rim = _on_rim(edges, rim, n)
    links = _rim_links(edges, rim, n)
    border = 0.125 * links + 0.75 * sparse.identity(n)
    return sparse.diags_array(1.0 - on_rim) @ inside + sparse.diags_array(on_rim) @ border


def _limit(quads: IntArray) -> sparse.csr_array:
    """Limit positions.

    Inside (k^2 P + 4 sum of edge neighbors + sum of diagonals) / (k (k + 5)); (1, 4, 1) / 6 on a boundary.
    """
    n = int(quads.max()) + 1
    edges, _, rim = _edges(quads)
    k = np.bincount(quads.ravel(), minlength=n).astype(float)
    ones = np.ones(len(edges))
    links = sparse.csr_array((ones, edges.T), shape=(n, n))
    links = links + links.T
    pairs = np.concatenate([quads[:, [0, 2]], quads[:, [1, 3]]])
    across = sparse.csr_array((np.ones(len(pairs)), pairs.T), shape=(n, n))
    inside = sparse.diags_array(1.0 / (k * (k + 5.0))) @ (sparse.diags_array(k * k) + 4.0 * links + across + across.T)
    on_rim = _on_rim(edges, rim, n)
    border = (_rim_links(edges, rim, n) + 4.0 * sparse.identity(n)) / 6.0
    return sparse.csr_array(sparse.diags_array(1.0 - on_rim) @ inside + sparse.diags_array(on_rim) @ border)


def _on_rim(edges: IntArray, rim: BoolArray, n: int) -> Array:
    """1 for vertices (n,) on the boundary, else 0."""
    flags = np.zeros(n)
    flags[edges[rim].ravel()] = 1.0
    return flags


def _rim_links(edges: IntArray, rim: BoolArray, n: int) -> sparse.csr_array:
    """The matrix (n, n) with 1 for vertices that an edge of the boundary joins."""
    links = sparse.csr_array((np.ones(int(rim.sum())), edges[rim].T), shape=(n, n))
    return links + links.T


def _incidence(cells: IntArray, weights: Array, n: int) -> sparse.csr_array:
    """The matrix (m, n) of the weights of the corners of cells (m, k)."""
    rows = np.repeat(np.arange(len(cells)), cells.shape[1])
    return sparse.csr_array((weights.ravel(), (rows, cells.ravel())), shape=(len(cells), n))
