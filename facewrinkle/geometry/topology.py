"""Connectivity of triangle meshes: edges, rings, boundary loops, components, orientation.

A mesh here is its triangles (m, 3), all integers; no function looks at coordinates. A *half-edge*
`3 t + s` is side `s` of triangle `t`, directed from its corner `s` to its corner `s + 1`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..array_types import Array, BoolArray, IntArray
from ..errors import MeshError


def as_triangles(triangles: ArrayLike, n_points: int | None = None) -> IntArray:
    """Return the triangles as a contiguous int32 array (m, 3), after checking them.

    Raises
    ------
    MeshError
        If the shape is not (m, 3) with m > 0; if vertices are not integers, are negative or not below `n_points`; or if
        a triangle names a vertex twice.

    Examples
    --------
    >>> as_triangles([[0, 1, 2], [2, 1, 3]]).dtype
    dtype('int32')
    >>> as_triangles([[0, 1, 7]], n_points=4)
    Traceback (most recent call last):
    facewrinkle.errors.MeshError: triangles must name vertices 0 to 3, received 0 to 7.
    """
    array = np.asarray(triangles)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) == 0:
        raise MeshError(f"triangles must be an array (m, 3) with m > 0, received shape {array.shape}.")
    if array.dtype.kind not in "iu":
        raise MeshError(f"triangles must hold integers, received {array.dtype}. Convert them with astype(int).")
    limit = np.iinfo(np.int32).max if n_points is None else n_points
    if array.min() < 0 or array.max() >= limit:
        raise MeshError(f"triangles must name vertices 0 to {limit - 1}, received {array.min()} to {array.max()}.")
    a, b, c = array.T
    twice = (a == b) | (b == c) | (c == a)
    if twice.any():
        worst = int(np.argmax(twice))
        raise MeshError(
            f"a triangle must have three different vertices, received {array[worst].tolist()} "
            f"(triangle {worst}; {int(twice.sum())} in all). Remove the degenerate triangles."
        )
    return np.ascontiguousarray(array, dtype=np.int32)


def unique_edges(triangles: ArrayLike) -> tuple[IntArray, IntArray]:
    """The undirected edges of a mesh.

    Returns
    -------
    edges : ndarray of int32, shape (e, 2)
        Vertices of each edge, in the order and direction in which the triangles first name it.
    sides : ndarray of int32, shape (m, 3)
        The edge of each side of each triangle; side `s` runs from corner `s` to corner `s + 1`.

    Examples
    --------
    >>> edges, sides = unique_edges([[0, 1, 2], [2, 1, 3]])
    >>> edges.tolist()
    [[0, 1], [1, 2], [2, 0], [1, 3], [3, 2]]
    >>> sides.tolist()
    [[0, 1, 2], [1, 3, 4]]
    """
    array = as_triangles(triangles)
    after = array[:, [1, 2, 0]]
    key = (np.minimum(array, after) * (np.int64(array.max()) + 1) + np.maximum(array, after)).ravel()
    order = np.argsort(key, kind="stable")  # equal keys in the order of the triangles, so the first names the edge
    starts = np.append(True, np.diff(key[order]) != 0)
    names = np.zeros(len(key), bool)
    names[order[starts]] = True
    number = np.cumsum(names, dtype=np.int32) - np.int32(1)
    sides = np.empty_like(number)
    sides[order] = number[order[starts]][np.cumsum(starts) - 1]
    return np.stack([array.ravel()[names], after.ravel()[names]], axis=1), sides.reshape(-1, 3)


def side_lengths(corners: NDArray[np.floating]) -> NDArray[np.floating]:
    """Lengths (m, 3) of the sides of triangles, given by their corners (m, 3, 3).

    Examples
    --------
    >>> side_lengths(np.array([[[0.0, 0, 0], [3, 0, 0], [3, 4, 0]]])).tolist()
    [[5.0, 3.0, 4.0]]
    """
    sides = corners - np.roll(corners, 1, axis=1)
    return np.asarray(np.sqrt(np.einsum("mck,mck->mc", sides, sides)))


def incident_triangles(elements: NDArray[np.integer]) -> tuple[NDArray[np.int64], IntArray]:
    """Triangles at each edge or vertex, as CSR: offsets (n + 1,), triangles (3 m,).

    The `elements` (m, 3) of each triangle are its sides, as `unique_edges` numbers them, or its vertices.

    Examples
    --------
    >>> edges, sides = unique_edges([[0, 1, 2], [2, 1, 3]])
    >>> offsets, triangles = incident_triangles(sides)
    >>> {tuple(edge): triangles[offsets[i]:offsets[i + 1]].tolist() for i, edge in enumerate(edges.tolist())}
    {(0, 1): [0], (1, 2): [0, 1], (2, 0): [0], (1, 3): [1], (3, 2): [1]}
    """
    offsets = np.concatenate([[0], np.cumsum(np.bincount(elements.ravel()))])
    return offsets, (np.argsort(elements, axis=None, kind="stable") // 3).astype(np.int32)


def vertex_rings(triangles: ArrayLike, n_points: int | None = None) -> tuple[IntArray, IntArray]:
    """Neighbors of each vertex, ascending, as CSR (offsets (n + 1,), neighbors (2 e,)).

    Examples
    --------
    >>> offsets, neighbors = vertex_rings([[0, 1, 2], [2, 1, 3]])
    >>> neighbors[offsets[3]:offsets[4]].tolist()
    [1, 2]
    """
    array = as_triangles(triangles, n_points)
    n = int(array.max()) + 1 if n_points is None else n_points
    both = array[:, [[0, 1], [1, 0], [1, 2], [2, 1], [2, 0], [0, 2]]].reshape(-1, 2)
    graph = coo_array((np.ones(len(both), np.int8), both.T), shape=(n, n)).tocsr()  # each pair once
    graph.sort_indices()
    return graph.indptr, graph.indices


def non_manifold_edges(triangles: ArrayLike) -> IntArray:
    """Edges (k, 2) that more than two triangles share.

    Examples
    --------
    Three pages of a book, and its spine:

    >>> non_manifold_edges([[0, 1, 2], [0, 1, 3], [0, 1, 4]]).tolist()
    [[0, 1]]
    """
    edges, sides = unique_edges(triangles)
    return edges[np.bincount(sides.ravel()) > 2]


def euler_characteristic(triangles: ArrayLike) -> int:
    """Vertices in use - edges + triangles: 2 for a sphere, 1 for a disk, 0 for a torus or an annulus.

    Examples
    --------
    >>> euler_characteristic([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    2
    """
    array = as_triangles(triangles)
    edges, _ = unique_edges(array)
    return len(np.unique(array)) - len(edges) + len(array)


def connected(links: ArrayLike, n: int) -> IntArray:
    """Component (n,) of each of n things, counted from 0; those that pairs (k, 2) name are connected.

    Examples
    --------
    >>> connected([[0, 2], [2, 3]], 5).tolist()
    [0, 1, 0, 0, 2]
    """
    pairs = np.reshape(links, (-1, 2)).T
    graph = coo_array((np.ones(pairs.shape[1], bool), pairs), shape=(n, n))
    return np.asarray(connected_components(graph, directed=False)[1])


def components(triangles: ArrayLike) -> IntArray:
    """Component (m,) of each triangle, counted from 0; triangles that share a vertex are connected.

    Examples
    --------
    >>> components([[0, 1, 2], [3, 4, 5], [2, 1, 6]]).tolist()
    [0, 1, 0]
    """
    array = as_triangles(triangles)
    label = connected(np.concatenate([array[:, :2], array[:, 1:]]), int(array.max()) + 1)
    return np.unique(label[array[:, 0]], return_inverse=True)[1].astype(np.int32)


def sheets(triangles: ArrayLike) -> IntArray:
    """Sheet (m,) of each triangle, counted from 0; triangles that share an edge are connected.

    Examples
    --------
    >>> sheets([[0, 1, 2], [2, 1, 3], [3, 4, 5]]).tolist()
    [0, 0, 1]
    """
    array = as_triangles(triangles)
    _, sides = unique_edges(array)
    offsets, around = incident_triangles(sides)
    after = np.ones(len(around), bool)
    after[offsets[:-1]] = False  # the first triangle of each edge follows none
    return connected(np.stack([around[np.flatnonzero(after) - 1], around[after]], axis=1), len(array))


def _shared(triangles: IntArray, sides: IntArray) -> tuple[NDArray[np.int64], NDArray[np.int64], BoolArray]:
    """Both half-edges of each edge with exactly two triangles, and True where they run in opposite directions."""
    order = np.argsort(sides, axis=None, kind="stable")
    valence = np.bincount(sides.ravel())
    start = (np.cumsum(valence) - valence)[valence == 2]
    h, g = order[start], order[start + 1]
    return h, g, triangles.ravel()[h] != triangles.ravel()[g]


def is_oriented(triangles: ArrayLike) -> bool:
    """Return True if the two triangles of each inner edge run along it in opposite directions.

    Examples
    --------
    >>> is_oriented([[0, 1, 2], [2, 1, 3]]), is_oriented([[0, 1, 2], [1, 2, 3]])
    (True, False)
    """
    array = as_triangles(triangles)
    return bool(_shared(array, unique_edges(array)[1])[2].all())


def oriented(triangles: ArrayLike) -> IntArray:
    """Return the triangles with one orientation per component; the smaller part of each component is flipped.

    Orientation does not spread across non-manifold edges.

    Raises
    ------
    MeshError
        If the surface has only one side (a Möbius strip).

    Examples
    --------
    >>> oriented([[0, 1, 2], [1, 2, 3], [2, 4, 3]]).tolist()
    [[0, 2, 1], [1, 2, 3], [2, 4, 3]]
    """
    array = as_triangles(triangles)
    m = len(array)
    h, g, opposite = _shared(array, unique_edges(array)[1])
    # Double cover: each triangle stands once as it is (t) and once flipped (m + t); consistent neighbors connect.
    t, u = h // 3, g // 3
    links = np.concatenate([[t, u + np.where(opposite, 0, m)], [t + m, u + np.where(opposite, m, 0)]], axis=1)
    label = connected(links.T, 2 * m)
    kept, turned = label[:m], label[m:]
    if (kept == turned).any():
        raise MeshError("the surface has only one side, so its triangles cannot be oriented. Cut it open first.")
    votes = np.bincount(kept, minlength=label.max() + 1)
    turn = (votes[turned] > votes[kept]) | ((votes[turned] == votes[kept]) & (turned < kept))
    return np.where(turn[:, None], array[:, [0, 2, 1]], array)


def boundary_loops(triangles: ArrayLike) -> list[IntArray]:
    """Closed loops of boundary vertices, each in the direction of its triangles, from its smallest vertex on.

    Loops that touch at a vertex stay apart: the walk goes round the fan of triangles at that vertex.

    Raises
    ------
    MeshError
        If an edge has more than two triangles, or the orientation is not consistent (`oriented` mends it).

    Examples
    --------
    >>> [loop.tolist() for loop in boundary_loops([[0, 1, 2], [2, 1, 3]])]
    [[0, 1, 3, 2]]
    """
    array = as_triangles(triangles)
    edges, sides = unique_edges(array)
    excess = edges[np.bincount(sides.ravel()) > 2]
    if len(excess):
        raise MeshError(f"boundary loops need at most two triangles per edge; edge {excess[0].tolist()} has more.")
    h, g, opposite = _shared(array, sides)
    if not opposite.all():
        raise MeshError("boundary loops need a consistent orientation; mend it with oriented(triangles).")
    twin = np.full(array.size, -1)
    twin[h], twin[g] = g, h
    border = np.flatnonzero(twin < 0)
    after = _following(border)
    while (inner := twin[after] >= 0).any():
        after[inner] = _following(twin[after[inner]])
    following = dict(zip(border.tolist(), after.tolist(), strict=True))
    start_of = array.ravel()
    loops = []
    while following:
        first, at = following.popitem()
        loop = [first]
        while at != first:
            loop.append(at)
            at = following.pop(at)
        vertices = start_of[loop]
        loops.append(np.roll(vertices, -int(np.argmin(vertices))))
    return sorted(loops, key=lambda loop: (int(loop[0]), int(loop[1])))


def _following(half_edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """The half-edges that come next in their triangles."""
    return half_edges - half_edges % 3 + (half_edges + 1) % 3


# --- an order of points, where neighbors are mostly neighbors in space ----------------------------


def morton_order(cells: NDArray[np.integer], bits: int) -> IntArray:
    """Return the order (n,) of the cells of a grid along the curve of Morton (1966).

    Parameters
    ----------
    cells : ndarray of int, shape (n, d)
        Position of each cell along the d axes of the grid, from 0 to ``2**bits - 1``. The last axis counts most.
    bits : int
        Bits per axis; at most 63 for all axes together.

    Examples
    --------
    >>> morton_order(np.array([[1, 1], [0, 1], [1, 0], [0, 0]]), 1).tolist()
    [3, 2, 1, 0]
    """
    cells = np.asarray(cells, np.int64)
    code, axes = np.zeros(len(cells), np.int64), cells.shape[1]
    for bit in range(bits):
        for axis in range(axes):
            code |= ((cells[:, axis] >> bit) & 1) << (axes * bit + axis)
    return np.argsort(code, kind="stable")


# --- vertices with several values --------------------------------------------------------------------


@dataclass(frozen=True)
class SplitMesh:
    """A mesh whose vertices have one value each.

    Attributes
    ----------
    triangles : ndarray of int, shape (m, 3)
        Numbers of the split vertices.
    origin : ndarray of int, shape (p,)
        The vertex of the mesh that each comes from; the first n are those of the mesh, in order.
    values : ndarray, shape (p, d)
    """

    triangles: IntArray
    origin: IntArray
    values: Array


def split_vertices(triangles: IntArray, values: Array, n_points: int) -> SplitMesh:
    """Split the vertices whose corners have different values into one vertex for each value.

    Parameters
    ----------
    triangles : ndarray of int, shape (m, 3)
    values : ndarray, shape (m, 3, d)
        At the corners.
    n_points : int
        Number of vertices, n. Those without a triangle get the value 0.

    Examples
    --------
    >>> values = np.array([[[0.0], [1.0], [2.0]], [[2.0], [5.0], [6.0]]])
    >>> parts = split_vertices(np.array([[0, 1, 2], [2, 1, 3]]), values, 4)
    >>> parts.triangles.tolist(), parts.origin.tolist(), parts.values.ravel().tolist()
    ([[0, 1, 2], [2, 4, 3]], [0, 1, 2, 3, 1], [0.0, 1.0, 2.0, 6.0, 5.0])
    """
    vertices, flat = np.array(triangles, np.int64).ravel(), values.reshape(-1, values.shape[-1])
    own, (used, first) = np.zeros((n_points, flat.shape[1])), np.unique(vertices, return_index=True)
    own[used] = flat[first]
    differs = (flat != own[vertices]).any(axis=1)
    differs[first] = False  # not even if it is NaN
    further = np.flatnonzero(differs)
    rows, which = np.unique(np.column_stack([vertices[further], flat[further]]), axis=0, return_inverse=True)
    vertices[further] = n_points + which.ravel()
    origin = np.concatenate([np.arange(n_points), rows[:, 0].astype(np.int64)])
    return SplitMesh(vertices.reshape(-1, 3), origin, np.concatenate([own, rows[:, 1:]]))


# --- rings of points ---------------------------------------------------------------------------------


def ring_quads(n: int, rings: int, *, closed: bool = True, start: int = 0) -> IntArray:
    """Quadrilaterals between consecutive rings of points, which are numbered ring by ring.

    Parameters
    ----------
    n : int
        Points of each ring.
    rings : int
        At least two.
    closed : bool
        Join the last point of each ring to its first one.
    start : int
        Number of the first point of the first ring.

    Returns
    -------
    ndarray of int, shape (k, 4)
        Two points a and b of a ring that follow each other, and those next to them on the next ring, as [a, b, c, d].

    Examples
    --------
    >>> ring_quads(3, 2).tolist()
    [[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]]
    >>> ring_quads(3, 2, closed=False).tolist()
    [[0, 1, 4, 3], [1, 2, 5, 4]]
    """
    here = np.arange(n if closed else n - 1)
    after = np.where(here == n - 1, 0, here + 1)
    ring = start + n * np.arange(rings - 1)[:, None]
    quads = np.stack([ring + here, ring + after, ring + n + after, ring + n + here], axis=-1)
    return quads.reshape(-1, 4).astype(np.int32)


def ring_triangles(
    n: int,
    rings: int,
    *,
    closed: bool = True,
    start: int = 0,
    first: int | None = None,
    last: int | None = None,
    diagonal: Literal["bd", "ac"] = "bd",
) -> IntArray:
    """Triangles between consecutive rings of points and, if they are given, to points that close the ends.

    Seen from outside they are counter-clockwise, if the rings are counter-clockwise seen from beyond the last one.

    Parameters
    ----------
    n, rings, closed, start
        As for :func:`ring_quads`.
    first, last : int, optional
        Points that close the surface before the first and after the last ring. Default: it is open there.
    diagonal : {"bd", "ac"}
        Corners between which the quadrilaterals [a, b, c, d] are split.

    Returns
    -------
    ndarray of int, shape (m, 3)
        One half of each quadrilateral, then the other halves, then the ends.

    Examples
    --------
    >>> ring_triangles(3, 2).tolist()
    [[0, 1, 3], [1, 2, 4], [2, 0, 5], [1, 4, 3], [2, 5, 4], [0, 3, 5]]
    >>> ring_triangles(3, 2, last=6)[6:].tolist()
    [[3, 4, 6], [4, 5, 6], [5, 3, 6]]
    """
    quads = ring_quads(n, rings, closed=closed, start=start)
    a, b, c, d = quads.T
    parts = [(a, b, d), (b, c, d)] if diagonal == "bd" else [(a, b, c), (a, c, d)]
    size = n if closed else n - 1
    if first is not None:
        parts.append((b[:size], a[:size], np.full(size, first)))
    if last is not None:
        parts.append((d[-size:], c[-size:], np.full(size, last)))
    return np.concatenate([np.stack(corners, axis=1) for corners in parts]).astype(np.int32)
