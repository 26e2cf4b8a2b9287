"""Values at some vertices of a mesh, interpolated smoothly at all of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from ..array_types import Array, IntArray
from . import _vertex_interpolation_kernels as kernels
from .laplacian import neighbour_mean
from .normals import vertex_normals
from .topology import unique_edges, vertex_rings

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
        rings = self.rings = vertex_rings(triangles, n)
        vertex, node, share = kernels.shares(positions, numbers, radius, *rings)
        without = np.bincount(vertex, minlength=n) == 0
        if without.any():  # far from all nodes: these go with the nearest
            nearest = kernels.nearest_nodes(positions, *rings, numbers)
            lost = np.flatnonzero(without & (nearest >= 0))
            vertex, node = np.concatenate([vertex, lost]), np.concatenate([node, nearest[lost]])
            share = np.concatenate([share, np.ones(len(lost))])
        rows = csr_array((share, (vertex, node)), shape=(n, len(where)))
        rows.sort_indices()
        self._rows = rows.indptr, rows.indices.astype(np.uint32), rows.data
        kernels.fit_rows(positions, where, vertex_normals(where, node_triangles), radius, *self._rows)
        self._n, self._nodes = n, len(where)

    def at(self, values: Array) -> Array:
        """Return the values (n, 3) at all vertices from those (k, 3) at the nodes; 0 at vertices of no triangle."""
        out = np.empty((self._n, 3))
        kernels.interpolate(*self._rows, np.ascontiguousarray(values, dtype=np.float64), out)
        return out

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
        starts, nodes, shares = self._rows
        rows = csr_array((np.maximum(shares, 0.0), nodes.astype(np.int64), starts), shape=(self._n, self._nodes))
        columns = rows.T.tocsr()
        columns.data *= np.asarray(weights, dtype=np.float64)[columns.indices]
        total = columns @ np.ones(self._n)
        columns.data *= np.repeat(1.0 / np.where(total > 0.0, total, 1.0), np.diff(columns.indptr))
        return csr_array(columns)
