"""Adaptive red-green refinement of triangle meshes, by connectivity alone.

A triangle is split *red* into four similar ones; where that leaves one hanging vertex on a neighbor, the
neighbor is bisected *green*, and where it leaves two, the neighbor is split red as well (Zhang, Sim and
Tan, Section 4). Bisecting bisected triangles again and again would ruin their angles, so the state is the
forest of red splits, and the green halves are derived from it each time. Neighboring leaves of the forest
differ by at most one level, every vertex keeps its place in the base mesh M0 as barycentric weights, and
undoing every split restores M0 exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array

from ..array_types import Array, BoolArray, IntArray
from ..errors import MeshError, check_range
from . import _forest_kernels as kernels
from .topology import as_triangles, unique_edges


@dataclass(frozen=True)
class Change:
    """The fate of the vertices: `attribute = concatenate([attribute[change.kept], created])`.

    Attributes
    ----------
    kept : slice or ndarray of int64, shape (k,)
        The old vertices that remain, in their new order; `slice(None)` if all do, and keep their numbers.
    n_created : int
        Number of vertices appended after them.

    Examples
    --------
    One value per vertex, kept in step with the mesh:

    >>> forest, height = RedGreenForest([[0, 1, 2], [2, 1, 3]]), np.array([1.0, 2.0, 3.0, 4.0])
    >>> change = forest.split([0])
    >>> np.concatenate([height[change.kept], np.zeros(change.n_created)])
    array([1., 2., 3., 4., 0., 0., 0.])
    >>> bool(forest.split([]))
    False
    """

    kept: slice | NDArray[np.int64]
    n_created: int

    def __bool__(self) -> bool:
        """True if the mesh changed at all."""
        return self.n_created > 0 or not isinstance(self.kept, slice)


class RedGreenForest:
    """The red splits of a triangle mesh, and the conforming mesh that follows from them.

    Triangles come depth first, in the order of the base mesh; new vertices are appended to the old ones. The
    arrays are snapshots: later changes of the forest leave them as they are.

    Parameters
    ----------
    triangles : array_like of int, shape (m0, 3)
        The base mesh M0. Boundaries, several components and non-manifold edges are allowed.
    max_level : int, optional
        Triangles at this level are not split again; at most 52, which is the default.
    n_points : int, optional
        Number of vertices of M0, n0, if some have no triangle; by default the largest index + 1.

    Raises
    ------
    MeshError
        If `triangles` is not (m0, 3) with m0 > 0, or has negative or repeated vertices.
    ParameterError
        If `max_level` is not in 0 to 52.

    Examples
    --------
    >>> forest = RedGreenForest([[0, 1, 2], [2, 1, 3]])
    >>> forest.split([0])
    Change(kept=slice(None, None, None), n_created=3)
    >>> forest.triangles.tolist()
    [[0, 4, 6], [1, 5, 4], [2, 6, 5], [4, 5, 6], [2, 5, 3], [5, 1, 3]]
    >>> forest.weights.toarray()[4:].tolist()
    [[0.5, 0.5, 0.0, 0.0], [0.0, 0.5, 0.5, 0.0], [0.5, 0.0, 0.5, 0.0]]
    >>> forest.coarsen([0, 1, 2, 3]).kept
    array([0, 1, 2, 3])
    """

    def __init__(self, triangles: ArrayLike, max_level: int | None = None, n_points: int | None = None) -> None:
        base = as_triangles(triangles, n_points).copy()
        n0 = int(base.max()) + 1 if n_points is None else n_points
        ends, sides = unique_edges(base)
        deepest = 52  # weights of level L are multiples of 2^-L: after more halvings they would no longer be exact
        self.max_level = deepest if max_level is None else int(check_range("max_level", max_level, 0, deepest))
        self._base = base
        self._nodes = _table(len(base), kernels.NODE_WIDTH)
        self._edges = _table(len(ends), kernels.EDGE_WIDTH)
        self._points = _table(n0, kernels.POINT_WIDTH)
        kernels.plant(self._nodes, self._edges, self._points[:n0], ends, sides, base)
        self._state = np.full(kernels.STATE_WIDTH, kernels.NONE)
        self._state[: kernels.N_ROOTS + 1] = len(base), len(ends), n0, len(base)
        self._state[kernels.FIRST :] = 0
        self._corners = np.repeat(np.arange(n0, dtype=np.int32)[:, None], 3, axis=1)
        self._barycentric = np.tile([1.0, 0.0, 0.0], (n0, 1))
        self._triangles = frozen(base)
        self._leaf = np.arange(len(base), dtype=np.int32)

    def split(self, marked: ArrayLike) -> Change:
        """Split the marked triangles in four, and all others that must follow for the mesh to stay conforming.

        Parameters
        ----------
        marked : array_like of bool, shape (m,), or indices of triangles
            A marked green half stands for the red triangle it is half of; triangles at `max_level` are skipped.

        Raises
        ------
        MeshError
            If `marked` is neither a bool per triangle nor indices in range.
        """
        created = self._grown(self._leaf[self._mask(marked)])
        if created:
            self._read_leaves()
        return Change(slice(None), created)

    def _grown(self, leaves: IntArray) -> int:
        """Split leaves (numbers of nodes), and all that must follow; return the number of new vertices."""
        before = self.n_points
        while not kernels.grow(self._nodes, self._edges, self._points, self._state, leaves, self.max_level):
            leaves = leaves[:0]
            self._make_room()
        created = self.n_points - before
        if created:
            self._corners = np.concatenate([self._corners, np.empty((created, 3), np.int32)])
            self._barycentric = np.concatenate([self._barycentric, np.empty((created, 3))])
            kernels.weigh(self._points, self._base, self._corners, self._barycentric, before)
        return created

    def adapt(self, wanted: BoolArray, coarsen: bool = True) -> Change:
        """Split the leaves that are wanted in four; where there are none, undo, by one level, red splits that are not.

        A split is wanted if that of the node is, and those of all nodes that it lies in. Called until nothing changes
        with marks that depend on each node alone, it ends at the same triangles from whatever triangles it began.

        Parameters
        ----------
        wanted : ndarray of bool, shape (k,)
            For each of the `nodes`, if it is to be split.
        coarsen : bool
            Undo splits at all.

        Examples
        --------
        >>> forest = RedGreenForest([[0, 1, 2], [2, 1, 3]], max_level=2)
        >>> forest.adapt(np.array([True, False]))
        Change(kept=slice(None, None, None), n_created=3)
        >>> forest.adapt(np.zeros(len(forest.nodes), bool)).kept
        array([0, 1, 2, 3])
        """
        n_roots, keep = len(self._base), wanted.copy()
        rows = np.arange(n_roots, len(keep))
        parent = self._nodes[rows - (rows - n_roots) % 4, kernels.FAMILY]
        for _ in range(int(self.level.max())):
            keep[n_roots:] &= keep[parent]
        created = self._grown(self._leaf[keep[self._leaf]])
        if created:
            self._read_leaves()
        if created or not coarsen:
            return Change(slice(None), created)
        inner = self._leaf >= n_roots
        fine = inner.copy()
        fine[inner] = ~keep[parent[self._leaf[inner] - n_roots]]
        return self.coarsen(fine)

    def coarsen(self, marked: ArrayLike) -> Change:
        """Undo every red split whose four leaves are marked, by one level, as far as the mesh stays legal.

        Parameters
        ----------
        marked : array_like of bool, shape (m,), or indices of triangles
            Of a bisected leaf, both green halves must be marked.

        Raises
        ------
        MeshError
            If `marked` is neither a bool per triangle nor indices in range.
        """
        mask, gone = self._mask(marked), np.zeros(self.n_points, bool)
        if not mask.any():
            return Change(slice(None), 0)
        status, quarter = np.zeros(len(self._nodes), np.uint8), (len(self._leaf) + 3) // 4
        found, waiting = np.empty(quarter, np.int32), np.empty(quarter, np.int32)
        kernels.prune(self._nodes, self._edges, self._state, self._leaf, mask, status, found, waiting, gone)
        if not gone.any():
            return Change(slice(None), 0)
        return self._renumbered(np.flatnonzero(~gone))  # midpoints stay younger than their ends

    def sort(self) -> Change:
        """Number the vertices level by level, and by their places: the same triangles have the same numbers then, in
        whatever order they were split.

        Examples
        --------
        >>> one, other = (RedGreenForest([[0, 1, 2], [2, 1, 3]]) for _ in range(2))
        >>> for first, second, forest in (([0], [5], one), ([1], [0], other)):
        ...     changes = forest.split(first), forest.split(second)
        >>> bool((one.triangles == other.triangles).all())
        False
        >>> changes = one.sort(), other.sort()
        >>> bool((one.triangles == other.triangles).all())
        True
        """
        n0 = self._n_given
        place = self._barycentric[n0:].T
        order = np.lexsort((place[1], place[0], self.host[n0:], self.vertex_level[n0:]))
        return self._renumbered(np.concatenate([np.arange(n0), n0 + order]))

    def _renumbered(self, kept: NDArray[np.int64]) -> Change:
        """Keep some of the vertices, in this order; midpoints must come after their ends."""
        numbers = np.full(self.n_points + 1, kernels.NONE, np.int32)  # the last is that of no vertex
        numbers[kept] = np.arange(len(kept), dtype=np.int32)
        n_nodes, n_edges, _ = self._used
        self._points[: len(kept)] = self._points[kept]
        for vertices in (
            self._nodes[:n_nodes, kernels.VERTEX : kernels.VERTEX + 3],
            self._edges[:n_edges, kernels.END : kernels.MIDPOINT + 1],
            self._points[: len(kept), kernels.OF : kernels.OF + 2],
        ):
            vertices[:] = numbers[vertices]
        self._state[kernels.N_POINTS] = len(kept)
        self._corners, self._barycentric = self._corners[kept], self._barycentric[kept]
        self._read_leaves()
        return Change(kept, 0)

    def copy(self) -> Self:
        """Return an independent forest in the same state."""
        twin = object.__new__(type(self))
        vars(twin).update(vars(self))
        for name in ("_nodes", "_edges", "_points", "_state"):
            setattr(twin, name, getattr(self, name).copy())
        return twin

    @property
    def n_points(self) -> int:
        """Number of vertices, n."""
        return int(self._state[kernels.N_POINTS])

    @property
    def _n_given(self) -> int:
        """Number of vertices of M0, n0."""
        return int(np.searchsorted(self._points[: self.n_points, kernels.OF] >= 0, True))

    @property
    def triangles(self) -> IntArray:
        """Triangles (m, 3) of the conforming mesh, oriented as in M0; read-only."""
        return self._triangles

    @property
    def nodes(self) -> IntArray:
        """Vertices (k, 3) of all triangles that the forest knows, be they split or not; rows of zeros are free."""
        return self._nodes[: int(self._state[kernels.N_NODES]), kernels.VERTEX : kernels.VERTEX + 3]

    @property
    def leaf(self) -> IntArray:
        """The node (m,) that each triangle is, or is a half of."""
        return self._leaf

    @property
    def level(self) -> IntArray:
        """Level (m,) of the red leaf of each triangle: 0 in M0, one more with each red split."""
        return self._nodes[self._leaf, kernels.FLAGS] >> kernels.LEVEL

    @property
    def root(self) -> IntArray:
        """The M0 triangle (m,) that each triangle lies in."""
        leaf, n_roots = self._leaf, len(self._base)
        second = leaf - (leaf - n_roots) % 4 + 1  # of its four siblings
        return np.where(leaf < n_roots, leaf, self._nodes[np.maximum(second, 0), kernels.FAMILY])

    @property
    def vertex_level(self) -> IntArray:
        """Level (n,) of every vertex: 0 in M0, else one more than that of the edge it halves."""
        return self._points[: self.n_points, kernels.POINT_LEVEL].copy()

    @property
    def parents(self) -> IntArray:
        """The two vertices (n, 2) between which each vertex lies midway; -1 in M0."""
        return self._points[: self.n_points, kernels.OF : kernels.OF + 2].copy()

    @property
    def host(self) -> IntArray:
        """The M0 triangle (n,) that each vertex lies in, the lowest of several; -1 for M0 vertices without one."""
        return self._points[: self.n_points, kernels.POINT_HOST].copy()

    @property
    def corners(self) -> IntArray:
        """M0 vertices (n, 3) of `barycentric`: the corners of the host, or (i, i, i) for vertex i of M0."""
        return frozen(self._corners)

    @property
    def barycentric(self) -> Array:
        """Weights (n, 3) of `corners`, exact; (1, 0, 0) for the vertices of M0."""
        return frozen(self._barycentric)

    @property
    def weights(self) -> csr_array:
        """Sparse matrix (n, n0) that interpolates values of M0 at all vertices; its rows sum to 1 exactly."""
        rows, columns = np.repeat(np.arange(self.n_points), 3), self._corners.ravel()
        matrix = csr_array((self._barycentric.ravel(), (rows, columns)), shape=(self.n_points, self._n_given))
        matrix.eliminate_zeros()
        return matrix

    def _mask(self, marked: ArrayLike) -> BoolArray:
        """Return the marks as one bool per triangle."""
        array, m = np.asarray(marked), len(self._leaf)
        if array.dtype == bool and array.shape == (m,):
            return array
        if array.shape == (0,) and array.dtype != bool:  # an empty list
            array = array.astype(int)
        if array.dtype.kind not in "iu" or array.ndim != 1 or (array.size and not 0 <= array.min() <= array.max() < m):
            raise MeshError(
                f"marks must be {m} bools, one per triangle, or a list of triangles from 0 to {m - 1}, "
                f"received {array.dtype} of shape {array.shape}."
            )
        mask = np.zeros(m, bool)
        mask[array] = True
        return mask

    @property
    def _used(self) -> tuple[int, int, int]:
        """Rows in use: nodes, edges, points."""
        n_nodes, n_edges, n_points = self._state[: kernels.N_ROOTS].tolist()
        return n_nodes, n_edges, n_points

    def _make_room(self) -> None:
        """Enlarge the tables for the splits in the worklist, as far as they can be foreseen, and some more."""
        n_nodes, n_edges, n_points = self._used
        splits = int(self._state[kernels.COUNT])
        self._nodes = _enlarged(self._nodes, n_nodes, 4 * splits)
        self._edges = _enlarged(self._edges, n_edges, 6 * splits)  # three inner ones, and half of three pairs of halves
        self._points = _enlarged(self._points, n_points, 3 * splits // 2)

    def _read_leaves(self) -> None:
        """Derive the conforming mesh from the forest."""
        n_roots, n_nodes = len(self._base), int(self._state[kernels.N_NODES])
        # Every leaf may be bisected; rows that are never written take no memory, and are given back.
        room = 2 * (n_roots + 3 * (n_nodes - n_roots) // 4)
        triangles, leaf = np.empty((room, 3), np.int32), np.empty(room, np.int32)
        m = kernels.read_leaves(self._nodes, self._edges, n_roots, triangles, leaf)
        triangles.resize((m, 3), refcheck=False)
        leaf.resize(m, refcheck=False)
        self._triangles, self._leaf = frozen(triangles), leaf


def _table(used: int, width: int) -> IntArray:
    """Return a table with room for `used` rows and half as many more."""
    return np.empty((used + used // 2 + 4 * kernels.ROOM, width), np.int32)


def _enlarged(table: IntArray, used: int, more: int) -> IntArray:
    """Return the table, or one with room for `more` rows and an eighth beyond if it is about to overflow."""
    if used + more + kernels.ROOM <= len(table):
        return table
    out = np.empty((used + more + (used + more) // 8 + 4 * kernels.ROOM, table.shape[1]), np.int32)
    out[:used] = table[:used]
    return out


def frozen(array: np.ndarray) -> np.ndarray:
    """Return a read-only view."""
    view = array.view()
    view.flags.writeable = False
    return view
