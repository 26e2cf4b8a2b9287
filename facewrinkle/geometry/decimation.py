"""Decimation of triangle meshes to wanted lengths of edges; what remains is a subset of the vertices."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..array_types import Array, IntArray
from . import _decimation_kernels as kernels
from .normals import vertex_normals
from .topology import as_triangles, unique_edges

SPACING = 0.67
"""Vertices are removed while they are closer to a neighbour than this share of the wanted length: the edges that stay
are then about as long as wanted, on average.
"""

LEAST_OF_LINE = 8
"""Every line and every boundary loop keeps at least this many vertices, or all that it has."""


def decimated(
    points: Array,
    triangles: IntArray,
    size: Array,
    lines: npt.NDArray[np.integer] | None = None,
    fewest: int = 4,
) -> tuple[npt.NDArray[np.int64], IntArray]:
    """Merge vertices into neighbours (half-edge collapses) until the edges of a mesh are about as long as wanted.

    The topology stays: components, boundary loops, and the Euler characteristic. Boundaries and other `lines` stay
    lines of vertices of their own. No triangle turns over, and none becomes much worse shaped than it was.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    size : ndarray, shape (n,)
        Wanted length of the edges at each vertex.
    lines : ndarray of int, shape (k, 2), optional
        Edges of the mesh that are lines to be kept, besides its boundaries. Vertices where more or fewer than two of
        these edges meet are not removed.
    fewest : int
        Number of vertices at which to stop, whatever the lengths of the edges.

    Returns
    -------
    vertices : ndarray of int, shape (k,)
        The vertices that remain, ascending.
    triangles : ndarray of int32, shape (l, 3)
        The triangles between them, by their new numbers.

    Examples
    --------
    >>> import pyvista as pv
    >>> ball = pv.Icosphere(radius=50.0, nsub=4)
    >>> vertices, triangles = decimated(ball.points.astype(float), ball.regular_faces, np.full(ball.n_points, 12.0))
    >>> ball.n_points, 200 < len(vertices) < 400, len(triangles) == 2 * len(vertices) - 4
    (2562, True, True)
    """
    faces = as_triangles(triangles, len(points)).copy()
    positions = np.ascontiguousarray(points, dtype=np.float64)
    n = len(positions)
    kind, neighbours, loop, left = _lines(faces, n, lines)
    alive = kernels.decimate(
        positions, vertex_normals(positions, faces), np.ascontiguousarray(size, dtype=np.float64), faces, kind,
        neighbours, loop, left, LEAST_OF_LINE, SPACING, int(fewest),
    )  # fmt: skip
    vertices, renumbered = np.unique(faces[alive], return_inverse=True)
    return vertices.astype(np.int64), renumbered.reshape(-1, 3).astype(np.int32)


def _lines(
    triangles: IntArray, n: int, lines: npt.NDArray[np.integer] | None
) -> tuple[npt.NDArray[np.int8], npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Kinds (n,) of vertices, neighbours (n, 2) of those on lines, their line (n,), and the vertices of each line."""
    edges, sides = unique_edges(triangles)
    shared = np.bincount(sides.ravel(), minlength=len(edges))
    chosen = edges[shared == 1]
    if lines is not None and len(lines):
        chosen = np.unique(np.sort(np.concatenate([chosen, lines]), axis=1), axis=0)
    degree = np.bincount(chosen.ravel(), minlength=n)
    kind = np.full(n, kernels.FIXED, np.int8)
    kind[degree == 0] = kernels.FREE
    kind[degree == 2] = kernels.ON_LINE
    kind[edges[shared > 2]] = kernels.FIXED
    both = np.concatenate([chosen, chosen[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    neighbours = np.full((n, 2), -1, np.int64)
    pair = both[degree[both[:, 0]] == 2].reshape(-1, 2, 2)
    neighbours[pair[:, 0, 0]] = pair[:, :, 1]
    graph = coo_array((np.ones(len(chosen), np.int8), tuple(chosen.T)), shape=(n, n))
    count, loop = connected_components(graph, directed=False)
    left = np.bincount(loop, minlength=count)
    return kind, neighbours, loop.astype(np.int64), left.astype(np.int64)
