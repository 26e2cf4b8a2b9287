"""Triangles split so that their edges no longer show: new points lie on the smooth surface that normals tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_types import Array, BoolArray, IntArray

ROUNDS = 3
"""An edge is halved so many times at most."""

LARGEST = 0.12
"""Most by which a point leaves the flat triangle, in lengths of the edge: where normals mean a rim, it stays one."""


@dataclass(frozen=True, eq=False)
class SmoothSplit:
    """Triangles of a mesh and the new vertices among them, which follow its own.

    Attributes
    ----------
    triangles : ndarray of int, shape (m, 3)
    parent : ndarray of int, shape (m,)
        The triangle of the mesh that each is a part of.
    shares : ndarray, shape (m, 3, 3)
        Barycentric coordinates of the corners in it.
    rounds : list of ndarray of int, shape (k, 2)
        The two vertices that each new vertex lies between, in the order of the new ones.

    Examples
    --------
    The edge between two triangles of a ridge is halved, and its middle lies on the ridge:

    >>> points = np.array([[0.0, 0, 0], [2, 0, 0], [1, 3, -1], [1, -3, -1]])
    >>> normals = np.array([[-0.6, 0, 0.8], [0.6, 0, 0.8], [0, 0, 1], [0, 0, 1]])
    >>> split = smooth_split(points, normals, np.array([[0, 1, 2], [1, 0, 3]]), longest=9.0, bend=0.5, sagitta=0.0)
    >>> split.rounds[0].tolist(), len(split.triangles)
    ([[0, 1]], 8)
    >>> split.places(points, normals)[0][4].tolist()
    [1.0, 0.0, 0.24]
    """

    triangles: IntArray
    parent: IntArray
    shares: Array
    rounds: list[IntArray]

    def values(self, values: np.ndarray) -> np.ndarray:
        """Values (n, ...) of the vertices of the mesh at all vertices; whole numbers but bytes are not averaged."""
        whole, kind = values.dtype.kind in "iub" and values.dtype != np.uint8, values.dtype
        out = values if whole else values.astype(np.float64)
        for ends in self.rounds:
            a, b = out[ends[:, 0]], out[ends[:, 1]]
            out = np.concatenate([out, np.maximum(a, b) if whole else 0.5 * (a + b)])
        return np.rint(out).astype(kind) if kind == np.uint8 else out.astype(kind)

    def places(self, points: Array, normals: Array) -> tuple[Array, Array]:
        """Points and unit normals (n + k, 3) of all vertices by those (n, 3) of the mesh, as it is now."""
        for ends in self.rounds:
            points, normals = _with_middles(points, normals, ends)
        return points, normals


def smooth_split(
    points: Array, normals: Array, triangles: IntArray, *, longest: float, bend: float, sagitta: float
) -> SmoothSplit:
    """Split edges that are long, or whose ends have normals that differ.

    Edges that do not lie between two triangles stay whole: what joins a rim goes on doing so.

    Parameters
    ----------
    points, normals : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    longest : float
        Longer edges are split.
    bend, sagitta : float
        So are those between normals that differ by more than this, radians, unless the arc between them rises by less
        than the second.
    """
    n, rounds, whole = len(points), [], []
    corners, parent = np.asarray(triangles, np.int64), np.arange(len(triangles))
    shares = np.tile(np.eye(3), (len(triangles), 1, 1))
    for _ in range(ROUNDS):
        ends = corners[:, [[0, 1], [1, 2], [2, 0]]]
        length = np.linalg.norm(points[ends[..., 1]] - points[ends[..., 0]], axis=2)
        turn = np.linalg.norm(normals[ends[..., 1]] - normals[ends[..., 0]], axis=2)
        wanted = (length > longest) | ((turn > bend) & (length * turn > 8.0 * sagitta))
        new, middles = _numbered(wanted, np.sort(ends, axis=2), n)
        rounds.append(new)
        points, normals = _with_middles(points, normals, new)
        n, split = len(points), (middles >= 0).any(axis=1)
        whole.append((corners[~split], parent[~split], shares[~split]))  # their edges will not be split later, either
        corners, parent, shares = _children(middles[split], corners[split], parent[split], shares[split])
    parts = [np.concatenate(part) for part in zip(*whole, (corners, parent, shares), strict=True)]
    return SmoothSplit(parts[0], parts[1], parts[2], rounds)


def lifted(points: Array, corners: Array, normals: Array, shares: Array) -> Array:
    """Return points (n, 3) of flat triangles, moved onto the smooth surface through their corners.

    Half-way to the mean of where the planes at the corners lie: Phong tessellation (Boubekeur and Alexa, 2008) with the
    share that is right on a sphere.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        At or above the flat triangles.
    corners, normals : ndarray, shape (n, 3, 3)
        Corners of the triangles, and unit normals there.
    shares : ndarray, shape (n, 3)
        Barycentric coordinates of the points.

    Examples
    --------
    The middle of a triangle of a large ball is lifted by what it lies below the ball:

    >>> corners = np.array([[[1.0, 0, 20], [-0.5, 0.8660254, 20], [-0.5, -0.8660254, 20]]])
    >>> radius = float(np.linalg.norm(corners[0, 0]))
    >>> up = lifted(np.array([[0.0, 0, 20]]), corners, corners / radius, np.full((1, 3), 1 / 3))
    >>> round(float(up[0, 2]) - 20, 3), round(radius - 20, 3)
    (0.025, 0.025)
    """
    flat = np.einsum("nk,nkd->nd", shares, corners)
    above = np.einsum("nkd,nkd->nk", corners - flat[:, None], normals)
    size = np.linalg.norm(corners - flat[:, None], axis=2).max(axis=1)
    return points + _limited(0.5 * np.einsum("nk,nkd->nd", shares * above, normals), size)


def _with_middles(points: Array, normals: Array, ends: IntArray) -> tuple[Array, Array]:
    """Points and normals with those in the middle of curves between pairs of vertices (k, 2)."""
    (a, b), (first, last) = points[ends].transpose(1, 0, 2), normals[ends].transpose(1, 0, 2)
    along = b - a
    rise = (along * last).sum(axis=1, keepdims=True) * last - (along * first).sum(axis=1, keepdims=True) * first
    middle = 0.5 * (a + b) + _limited(rise / 8.0, np.linalg.norm(along, axis=1))
    upright = first + last
    upright /= np.maximum(np.linalg.norm(upright, axis=1, keepdims=True), 1e-12)
    return np.concatenate([points, middle]), np.concatenate([normals, upright])


def _limited(moved: Array, sizes: Array) -> Array:
    """Displacements (n, 3), none longer than the share `LARGEST` of sizes (n,)."""
    far = np.maximum(np.linalg.norm(moved, axis=1), 1e-300)
    return np.asarray(moved * np.minimum(1.0, LARGEST * sizes / far)[:, None])


def _numbered(wanted: BoolArray, ends: IntArray, n: int) -> tuple[IntArray, IntArray]:
    """Ends (k, 2) of the wanted sides (m, 3) that lie between two triangles, and numbers (m, 3) of middles, or -1."""
    keys = ends[wanted][:, 0] * n + ends[wanted][:, 1]
    found, which, count = np.unique(keys, return_inverse=True, return_counts=True)
    inner = count == 2
    middles = np.full(wanted.shape, -1)
    middles[wanted] = np.where(inner, n + np.cumsum(inner) - 1, -1)[which]
    return np.column_stack(np.divmod(found[inner], n)), middles


def _children(
    middles: IntArray, corners: IntArray, parent: IntArray, shares: Array
) -> tuple[IntArray, IntArray, Array]:
    """Parts of triangles (m, 3) with middles (m, 3) on some sides, their parents, and shares in these."""
    children_of = (
        # by the sides that are halved (1: from corner 0 to 1, 2: from 1 to 2, 4: from 2 to 0); 3 to 5 are their middles
        ((0, 1, 2),),
        ((0, 3, 2), (3, 1, 2)),
        ((0, 1, 4), (0, 4, 2)),
        ((3, 1, 4), (0, 3, 4), (0, 4, 2)),
        ((0, 1, 5), (5, 1, 2)),
        ((0, 3, 5), (3, 1, 2), (3, 2, 5)),
        ((5, 4, 2), (0, 1, 4), (0, 4, 5)),
        ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    )
    kind = (middles >= 0) @ np.array([1, 2, 4])
    of_sides = np.concatenate([corners, middles], axis=1)
    places = np.concatenate([shares, 0.5 * (shares + np.roll(shares, -1, axis=1))], axis=1)
    parts = [
        (of_sides[own][:, child], parent[own], places[own][:, child])
        for number, children in enumerate(children_of)
        for own in [np.flatnonzero(kind == number)]
        for child in map(list, children)
    ]
    triangles, parents, within = (np.concatenate(part) for part in zip(*parts, strict=True))
    return triangles, parents, within
