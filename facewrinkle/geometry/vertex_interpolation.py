"""Values at some vertices of a mesh, interpolated smoothly at all of them."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from ..array_types import Array, IntArray
from .compilation import compiled
from .laplacian import neighbour_mean
from .normals import tangent_axes, vertex_normals
from .topology import unique_edges, vertex_rings

SINGULAR = 0.05
"""Distance from a node, relative to its radius, within which its weight grows no further."""

DETOUR, DETOUR_FADE = 0.2, 0.2
"""Nodes count in full if the way to them along the edges is longer than the straight line by less than the first share
of their radius, and not at all from the sum of both on.
"""

AT_ONCE = 8192
"""Vertices whose polynomials are fitted at once."""

RADIUS = 2.1
"""Distance at which the weight of a node ends, in lengths of the edges between nodes around it."""


class VertexInterpolation:
    """Interpolates values at some vertices of a mesh, the nodes, at all of its vertices.

    At each vertex, moving least squares fit a polynomial of degree 2 in the tangent plane to the values at the nodes
    around it. So the result is as smooth as the mesh, without a trace of the triangles between the nodes, and
    reproduces displacements that are linear or quadratic over the surface. Nodes that are near only through the air,
    as on the other lip, do not count.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    nodes : ndarray of int, shape (k,)
        Numbers of the vertices that are nodes; every piece of the mesh must have one.
    node_triangles : ndarray of int, shape (l, 3)
        Triangles between the nodes, as numbers of nodes.

    Attributes
    ----------
    rings : tuple of ndarray of int
        Neighbours of each vertex; see :func:`facewrinkle.geometry.topology.vertex_rings`.

    Examples
    --------
    >>> import pyvista as pv
    >>> from facewrinkle.geometry.decimation import decimated
    >>> ball = pv.Icosphere(radius=50.0, nsub=4)
    >>> points, triangles = ball.points.astype(float), ball.regular_faces.astype(np.int32)
    >>> nodes, between = decimated(points, triangles, np.full(len(points), 12.0))
    >>> smooth = VertexInterpolation(points, triangles, nodes, between)
    >>> wave = np.sin(points / 20.0)
    >>> bool(np.abs(smooth.at(wave[nodes]) - wave).max() < 0.02)
    True
    """

    def __init__(
        self, points: Array, triangles: IntArray, nodes: npt.NDArray[np.integer], node_triangles: IntArray
    ) -> None:
        positions, numbers = np.ascontiguousarray(points, dtype=np.float64), np.asarray(nodes, np.int64)
        n, where = len(positions), positions[numbers]
        edges, _ = unique_edges(node_triangles)
        length = np.linalg.norm(where[edges[:, 0]] - where[edges[:, 1]], axis=1)
        valence = np.maximum(np.bincount(edges.ravel(), minlength=len(where)), 1)
        spacing = np.bincount(edges.ravel(), np.repeat(length, 2), minlength=len(where)) / valence
        radius = RADIUS * 0.5 * (spacing + neighbour_mean(edges, len(where)) @ spacing)
        offsets, ring = self.rings = vertex_rings(triangles, n)
        way = np.linalg.norm(positions[np.repeat(np.arange(n), np.diff(offsets))] - positions[ring], axis=1)
        vertex, node, share = _shares(positions, numbers, radius, offsets, ring, way)
        without = np.bincount(vertex, minlength=n) == 0
        if without.any():  # far from all nodes: these go with the nearest
            graph = csr_array((np.maximum(way, 1e-300), ring, offsets), shape=(n, n))
            nearest = dijkstra(graph, indices=numbers, min_only=True, return_predecessors=True)[2]
            lost = np.flatnonzero(without & (nearest >= 0))
            number = np.empty(n, np.int64)
            number[numbers] = np.arange(len(numbers))
            vertex, node = np.concatenate([vertex, lost]), np.concatenate([node, number[nearest[lost]]])
            share = np.concatenate([share, np.ones(len(lost))])
        self._rows = csr_array((share, (vertex, node)), shape=(n, len(where)))
        self._rows.sort_indices()
        _fit(self._rows, positions, where, vertex_normals(where, node_triangles), radius)

    def at(self, values: Array) -> Array:
        """Return the values (n, 3) at all vertices from those (k, 3) at the nodes; 0 at vertices of no triangle."""
        return np.asarray(self._rows @ values)

    def averages(self, weights: Array) -> csr_array:
        """Return the matrix (k, n) that averages values at all vertices around each node.

        A vertex counts as much as it goes with the node, times its own weight (n,), such as its area: what varies
        between nodes counts as a whole, and not as it happens to be at them.

        Examples
        --------
        >>> import pyvista as pv
        >>> from facewrinkle.geometry.decimation import decimated
        >>> mesh = pv.Plane(i_resolution=20, j_resolution=20).triangulate()
        >>> points, triangles = mesh.points.astype(float), mesh.regular_faces.astype(np.int32)
        >>> nodes, between = decimated(points, triangles, np.full(len(points), 0.2))
        >>> around = VertexInterpolation(points, triangles, nodes, between).averages(np.ones(len(points)))
        >>> spotted = (np.arange(len(points)) % 2).astype(float)  # of every other vertex
        >>> bool((np.abs(around @ spotted - 0.5) < 0.2).all()), sorted(set(spotted[nodes].tolist()))
        (True, [0.0, 1.0])
        """
        columns = self._rows.maximum(0.0).T.tocsr()
        columns.data *= np.asarray(weights, dtype=np.float64)[columns.indices]
        total = columns.sum(axis=1)
        columns.data *= np.repeat(1.0 / np.where(total > 0.0, total, 1.0), np.diff(columns.indptr))
        return csr_array(columns)


def _fit(rows: csr_array, points: Array, nodes: Array, normals: Array, radius: Array) -> None:
    """Replace the shares of nodes at each vertex, in the rows of a sparse matrix, by their weights.

    These are weights in the polynomial, of degree 2 in the tangent plane, that fits the values of the nodes best by
    their shares: its value at the vertex is the sum of weighted values.
    """
    total = np.maximum(rows.sum(axis=1), 1e-300)
    scale, normal = rows @ radius / total, rows @ normals
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    # Small penalties keep the polynomials determinate where nodes are few or on a line.
    some, ridge = np.diff(rows.indptr) > 0, np.diag([0.0, 1e-12, 1e-12, 1e-6, 1e-6, 1e-6])
    for first in range(0, len(points), AT_ONCE):
        chosen = first + np.flatnonzero(some[first : first + AT_ONCE])
        if not len(chosen):
            continue
        part = rows[chosen]
        row = np.repeat(np.arange(len(chosen)), np.diff(part.indptr))
        offset = (nodes[part.indices] - points[chosen][row]) / scale[chosen][row, None]
        x, y = ((offset * axis[row]).sum(axis=1) for axis in tangent_axes(normal[chosen]))
        basis = np.stack([np.ones_like(x), x, y, x * x, np.sqrt(2.0) * x * y, y * y], axis=1)
        share = part.data / total[chosen][row]
        products = (share[:, None, None] * basis[:, :, None] * basis[:, None]).reshape(len(row), -1)
        matrix = np.add.reduceat(products, part.indptr[:-1]).reshape(-1, 6, 6) + ridge
        solution = np.linalg.solve(matrix, np.eye(6)[:, :1])[..., 0]
        fitted = share * (basis * solution[row]).sum(axis=1)
        fitted /= np.bincount(row, fitted)[row]
        rows.data[rows.indptr[chosen[0]] : rows.indptr[chosen[-1] + 1]] = fitted


@compiled
def _spread(node, points, radius, offsets, ring, length, way, queue, waiting, touched):
    """Write to `way` the lengths of ways along edges from a node to the vertices around, listed in `touched`; return
    their number. `way` is infinite, and no vertex `waiting`, before.
    """
    limit = (1.0 + DETOUR + DETOUR_FADE) * radius
    way[node], queue[0], touched[0] = 0.0, node, node
    first, queued, count, size = 0, 1, 1, len(queue)
    while queued > 0:
        v = queue[first]
        first, queued, waiting[v] = (first + 1) % size, queued - 1, False
        for e in range(offsets[v], offsets[v + 1]):
            w, far = ring[e], way[v] + length[e]
            if far >= limit or far >= way[w]:
                continue
            if way[w] == np.inf:
                touched[count] = w
                count += 1
            way[w] = far
            if not waiting[w]:
                waiting[w] = True
                queue[(first + queued) % size] = w
                queued += 1
    return count


@compiled
def _shares(points, nodes, radius, offsets, ring, length):
    """Vertices, numbers of nodes and weights for all pairs of a vertex and a node that are near, by node."""
    n = len(points)
    way, waiting = np.full(n, np.inf), np.zeros(n, np.bool_)
    queue, touched = np.empty(n, np.int64), np.empty(n, np.int64)
    vertices, numbers, values = [], [], []
    for i in range(len(nodes)):
        node, reach = nodes[i], radius[i]
        count = _spread(node, points, reach, offsets, ring, length, way, queue, waiting, touched)
        for k in range(count):
            v = touched[k]
            square = 0.0
            for axis in range(3):
                square += (points[v, axis] - points[node, axis]) ** 2
            straight = np.sqrt(square)
            if straight < reach:
                d, detour = straight / reach, (way[v] - straight) / reach
                t = min(max((detour - DETOUR) / DETOUR_FADE, 0.0), 1.0)
                fade = 1.0 - t * t * (3.0 - 2.0 * t)
                share = fade * (1.0 - d) ** 4 * (4.0 * d + 1.0) / (d * d + SINGULAR * SINGULAR)  # smooth, 0 at d = 1
                if share > 1e-9:
                    vertices.append(v)
                    numbers.append(i)
                    values.append(share)
            way[v] = np.inf
    return np.array(vertices), np.array(numbers), np.array(values)
