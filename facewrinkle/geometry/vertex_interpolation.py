"""Values at some vertices of a mesh, interpolated smoothly at all of them."""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from ..array_types import Array, IntArray
from .compilation import compiled
from .decimation import distance
from .laplacian import neighbor_mean
from .least_squares import cholesky_solve
from .normals import tangent_axes, unit, vertex_normals
from .topology import unique_edges, vertex_rings


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
        Numbers of the vertices that are nodes, ascending; every piece of the mesh must have one.
    node_triangles : ndarray of int, shape (l, 3)
        Triangles between the nodes, as numbers of nodes.

    Attributes
    ----------
    rings : tuple of ndarray of int
        Neighbors of each vertex; see :func:`facewrinkle.geometry.topology.vertex_rings`.

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
        # The weight of a node ends at 2.1 times the length of the edges between nodes around it.
        radius = 1.05 * (spacing + neighbor_mean(edges, len(where)) @ spacing)
        offsets, ring = self.rings = vertex_rings(triangles, n)
        way = np.linalg.norm(positions[np.repeat(np.arange(n), np.diff(offsets))] - positions[ring], axis=1)
        vertex, node, share = _shares(positions, numbers, radius, offsets, ring, way)
        without = np.bincount(vertex, minlength=n) == 0
        if without.any():  # far from all nodes: these go with the nearest
            graph = csr_array((np.maximum(way, 1e-300), ring, offsets), shape=(n, n))
            nearest = dijkstra(graph, indices=numbers, min_only=True, return_predecessors=True)[2]
            lost = np.flatnonzero(without & (nearest >= 0))
            vertex = np.concatenate([vertex, lost])
            node = np.concatenate([node, np.searchsorted(numbers, nearest[lost])])
            share = np.concatenate([share, np.ones(len(lost))])
        self._rows = rows = csr_array((share, (vertex, node)), shape=(n, len(where)))
        rows.sort_indices()
        rows.data /= np.repeat(rows.sum(axis=1), np.diff(rows.indptr))
        axes = np.stack(tangent_axes(unit(rows @ vertex_normals(where, node_triangles))))
        # Small penalties keep the polynomials determinate where nodes are few or on a line.
        _fit(
            rows.indptr, rows.indices, rows.data, positions, where, axes / np.maximum(rows @ radius, 1e-300)[:, None],
            np.diag([0.0, 1e-12, 1e-12, 1e-6, 1e-6, 1e-6]),
        )  # fmt: skip
        rows.data /= np.repeat(rows.sum(axis=1), np.diff(rows.indptr))

    def at(self, values: Array) -> Array:
        """Return the values (n, 3) at all vertices from those (k, 3) at the nodes; 0 at vertices of no triangle."""
        return np.asarray(self._rows @ values)


@compiled
def _fit(offsets, numbers, shares, points, nodes, axes, penalties):
    """Replace the shares of nodes at each vertex, in the rows of a sparse matrix, by weights that are as large relative
    to each other as those of the nodes in the polynomial that fits their values best by their shares.

    The polynomials are of degree 2 along two `axes` (2, n, 3); what counts is their value at the vertex.
    """
    terms, unity = np.empty((len(nodes), 6)), np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    for v in range(len(points)):
        matrix, first = penalties.copy(), unity.copy()
        for e in range(offsets[v], offsets[v + 1]):
            x = y = 0.0
            for k in range(3):
                way = nodes[numbers[e], k] - points[v, k]
                x += axes[0, v, k] * way
                y += axes[1, v, k] * way
            t = terms[e - offsets[v]]
            t[0], t[1], t[2], t[3], t[4], t[5] = 1.0, x, y, x * x, np.sqrt(2.0) * x * y, y * y
            for i in range(6):
                for j in range(i + 1):
                    matrix[i, j] += shares[e] * t[i] * t[j]
        cholesky_solve(matrix, first)
        for e in range(offsets[v], offsets[v + 1]):
            value = 0.0
            for i in range(6):
                value += terms[e - offsets[v], i] * first[i]
            shares[e] *= value


@compiled
def _shares(points, nodes, radius, offsets, ring, length):
    """Vertices (p,), numbers of nodes (p,) and weights (p,) for all pairs of a vertex and a node that are near.

    From each node, ways are followed along the edges of the mesh, of which each vertex has a `ring`, and the lengths,
    up to the first vertex beyond the radius. Nodes count in full if the way is longer than the straight line by less
    than the `detour`, a share of their radius, and not at all from twice that on.
    """
    detour = 0.2
    way, vertices, numbers, shares = np.full(len(points), np.inf), [0], [0], [0.0]
    for k in range(len(nodes)):
        way[nodes[k]], met, at = 0.0, [nodes[k]], 0
        while at < len(met):
            start = met[at]
            at += 1
            if distance(points, start, nodes[k]) > radius[k]:
                continue
            for e in range(offsets[start], offsets[start + 1]):
                end, further = ring[e], way[start] + length[e]
                if further < min(way[end], (1.0 + 2.0 * detour) * radius[k]):
                    way[end] = further
                    met.append(np.int64(end))
        for v in met:
            d = distance(points, v, nodes[k]) / radius[k]
            t = min(max((way[v] / radius[k] - d - detour) / detour, 0.0), 1.0)
            way[v] = np.inf  # it may have been met more than once
            share = (1.0 - t * t * (3.0 - 2.0 * t)) * max(1.0 - d, 0.0) ** 4 * (4.0 * d + 1.0)
            share /= d * d + 0.05 * 0.05  # smooth, 0 at d = 1, and no larger within a twentieth of the radius
            if share > 1e-9:
                vertices.append(v)
                numbers.append(k)
                shares.append(share)
    return np.array(vertices)[1:], np.array(numbers)[1:], np.array(shares)[1:]
