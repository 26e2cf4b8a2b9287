"""The footprint of a tear: the surface under it, subdivided, and the part of it that water covers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array, vstack
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..array_types import Array, BoolArray, IntArray
from ..geometry.normals import vertex_normals
from ..geometry.topology import unique_edges
from .path import StreamPath

LEAST_LEVEL = 1e-6
"""The least absolute level of a vertex; the outline of the tear is where the level is 0."""

CUT = 0.03, 0.97
"""Shares of a side between which the outline cuts it: triangles beside it are never too thin."""

COVERING = 0.71
"""No point of a triangle is farther from the middle of one of its sides than half the side's length, nor from an end
of a side than this share of its length."""


@dataclass(frozen=True, eq=False)
class Footprint:
    """The surface under a tear, subdivided: all that changes only with the triangles of the surface.

    Attributes
    ----------
    mesh_rest, mesh_triangles : ndarray
        Points at rest and triangles of the mesh of which it was made.
    cells : ndarray of int32
        The triangles of the mesh under the tear.
    weights : sparse array, shape (n, n0)
        Barycentric coordinates of its vertices in the mesh.
    rest : ndarray, shape (n, 3)
        Its vertices at rest.
    triangles, hosts : ndarray of int32, shapes (m, 3) and (m,)
        Its triangles, and those of `cells` in which they lie.
    edges, sides : ndarray of int32, shapes (e, 2) and (m, 3)
        As of :func:`facewrinkle.geometry.topology.unique_edges`.
    s, w, wobble, noise : ndarray, shape (c, n)
        Position along each path and distance from it, and the wobble and noise there.

    Examples
    --------
    A sheet of two triangles; a tear that has run 8 of 16 mm covers its vertices from y = 0 to y = 8:

    >>> from facewrinkle.tears.shape import Shape, thickness
    >>> rest = np.array([[-10.0, -10, 0], [10, -10, 0], [-10, 10, 0], [10, 10, 0]])
    >>> triangles, line = np.array([[0, 1, 2], [2, 1, 3]], np.int32), np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> path = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> footprint = footprint_under([path], rest, triangles, reach=2.0, detail=0.5)
    >>> level, height = thickness(footprint.s[0], footprint.w[0], 8.0, Shape(1.0, 0.8, 0.5, 0.05))
    >>> covered = footprint.rest[level > 0.0]
    >>> round(float(covered[:, 1].min())), round(float(covered[:, 1].max()))
    (0, 8)
    """

    mesh_rest: Array
    mesh_triangles: IntArray
    cells: IntArray
    weights: csr_array
    rest: Array
    triangles: IntArray
    hosts: IntArray
    edges: IntArray
    sides: IntArray
    s: Array
    w: Array
    wobble: Array
    noise: Array

    def part(self, level: Array) -> Part | None:
        """Return the part where the linear function `level` (n,) is above 0, as one piece without holes."""
        level = self._one_piece(level)
        wet, n = level > 0.0, len(level)
        if not wet.any():
            return None
        v, w = self.edges.T
        inner, crossed = np.flatnonzero(wet), np.flatnonzero(wet[v] != wet[w])
        number, between = np.full(n, -1, np.int32), np.full(len(v), -1, np.int32)
        number[inner] = np.arange(len(inner))
        between[crossed] = len(inner) + np.arange(len(crossed))
        v, w = v[crossed], w[crossed]
        share = np.concatenate([np.zeros(len(inner)), np.clip(level[v] / (level[v] - level[w]), *CUT)])
        first, second = np.concatenate([inner, v]), np.concatenate([inner, w])
        of_triangle = np.repeat(np.arange(len(self.triangles)), 3)
        of_vertex, of_edge = np.empty(n, np.int64), np.empty(len(self.edges), np.int64)
        of_vertex[self.triangles.ravel()], of_edge[self.sides.ravel()] = of_triangle, of_triangle
        inside = np.concatenate([of_vertex[inner], of_edge[crossed]])
        triangles = clipped(number[self.triangles], between[self.sides])
        return Part(self, triangles, first, second, share, self.cells[self.hosts[inside]])

    def _one_piece(self, level: Array) -> Array:
        """Return the level with all vertices below 0 but the largest piece, whose holes are above 0."""
        level = np.where(np.abs(level) < LEAST_LEVEL, LEAST_LEVEL, level)
        wet, piece = level > 0.0, self._pieces(level > 0.0)
        if not wet.any():
            return level
        islands = wet & (piece != np.bincount(piece[wet]).argmax())
        if islands.any():
            level[islands] = -LEAST_LEVEL
            wet, piece = level > 0.0, self._pieces(level > 0.0)
        border = self.edges[np.bincount(self.sides.ravel(), minlength=len(self.edges)) == 1]
        reached = np.zeros(len(level), bool)
        reached[piece[border]] = True
        level[~wet & ~reached[piece]] = LEAST_LEVEL
        return level

    def _pieces(self, wet: BoolArray) -> IntArray:
        """Return the number (n,) of the piece, wet or dry, that each vertex belongs to."""
        v, w = self.edges[wet[self.edges[:, 0]] == wet[self.edges[:, 1]]].T
        return connected_components(coo_array((np.ones(len(v)), (v, w)), shape=(len(wet),) * 2))[1]


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a footprint; each of its vertices lies between two of the footprint.

    Attributes
    ----------
    footprint : Footprint
    triangles : ndarray of int32, shape (m, 3)
    first, second : ndarray of int, shape (n,)
        Vertices of the footprint between which each vertex lies.
    share : ndarray, shape (n,)
        Its share of the way from the first: 0 but for vertices of the outline.
    under : ndarray of int, shape (n,)
        A triangle of the mesh in which the vertex lies.

    Examples
    --------
    The outline of a disk of radius 1, cut out of a sheet that has risen by 5 mm:

    >>> rest = np.array([[-10.0, -10, 0], [10, -10, 0], [-10, 10, 0], [10, 10, 0]])
    >>> triangles, line = np.array([[0, 1, 2], [2, 1, 3]], np.int32), np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> path = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> footprint = footprint_under([path], rest, triangles, reach=2.0, detail=0.5)
    >>> part = footprint.part(1.0 - np.linalg.norm(footprint.rest, axis=1))
    >>> points, normals, at_rest = part.at(rest + [0, 0, 5], np.tile([0.0, 0, 1], (4, 1)))
    >>> round(float(np.linalg.norm(at_rest[part.share > 0.0], axis=1).min()), 1), float(points[:, 2].max())
    (1.0, 5.0)
    """

    footprint: Footprint
    triangles: IntArray
    first: IntArray
    second: IntArray
    share: Array
    under: IntArray

    def between(self, values: Array) -> Array:
        """Return values of its vertices, given those (n0,) or (n0, 3) of the vertices of the footprint."""
        share = self.share.reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray(values[self.first] + share * (values[self.second] - values[self.first]))

    def at(self, points: Array, normals: Array) -> tuple[Array, Array, Array]:
        """Return its vertices (n, 3) in a frame of the mesh, their unit normals, and the vertices at rest."""
        footprint = self.footprint
        upright = self.between(footprint.weights @ normals)
        upright /= np.maximum(np.linalg.norm(upright, axis=1, keepdims=True), 1e-300)
        return self.between(footprint.weights @ points), upright, self.between(footprint.rest)


def clipped(corners: IntArray, cuts: IntArray) -> IntArray:
    """Return the parts (m, 3) of triangles on one side of a line that cuts them.

    Parameters
    ----------
    corners, cuts : ndarray of int, shape (m0, 3)
        Numbers of the corners on that side, else -1; and numbers of the points at which sides are cut, else -1. Side k
        leads from corner k to the next.

    Examples
    --------
    A whole triangle, one of which a corner is left, and one that has lost a corner:

    >>> corners = np.array([[0, 1, 2], [-1, 3, -1], [4, -1, 5]])
    >>> clipped(corners, np.array([[-1, -1, -1], [6, 7, -1], [8, 9, -1]])).tolist()
    [[0, 1, 2], [3, 7, 6], [5, 4, 8], [5, 8, 9]]
    """
    left = corners >= 0
    count, k = left.sum(axis=1), np.arange(3)
    whole = corners[count == 3]
    one, two = np.flatnonzero(count == 1), np.flatnonzero(count == 2)
    turned = (left[one].argmax(axis=1)[:, None] + k) % 3  # the corner that is left comes first
    tips = np.column_stack([corners[one[:, None], turned][:, 0], cuts[one[:, None], turned][:, [0, 2]]])
    turned = (left[two].argmin(axis=1)[:, None] + 1 + k) % 3  # the corner that is lost comes last
    a, b = corners[two[:, None], turned][:, :2].T
    _, p, q = cuts[two[:, None], turned].T
    quads = np.stack([np.stack([a, b, p], axis=1), np.stack([a, p, q], axis=1)], axis=1).reshape(-1, 3)
    return np.concatenate([whole, tips, quads]).astype(np.int32)


def footprint_under(
    paths: Sequence[StreamPath],
    rest: Array,
    triangles: IntArray,
    reach: float,
    detail: float,
    last: Footprint | None = None,
) -> Footprint:
    """Return the footprint in a mesh: the triangles under the paths, subdivided until they are small enough.

    Parameters
    ----------
    paths : sequence of StreamPath
    rest : ndarray, shape (n0, 3)
    triangles : ndarray of int32, shape (m0, 3)
    reach, detail : float
        Triangles with a corner within `reach` of a path are kept; their sides are at most `detail` long.
    last : Footprint, optional
        The footprint of the last frame; if nothing has changed under the paths, it is used again.

    Examples
    --------
    Under a tear that runs down a sheet of two triangles; no side is longer than 0.5:

    >>> rest = np.array([[-10.0, -10, 0], [10, -10, 0], [-10, 10, 0], [10, 10, 0]])
    >>> triangles, line = np.array([[0, 1, 2], [2, 1, 3]], np.int32), np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> path = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> footprint = footprint_under([path], rest, triangles, reach=2.0, detail=0.5)
    >>> a, b = footprint.rest[footprint.edges.T]
    >>> bool(np.linalg.norm(b - a, axis=1).max() <= 0.5), footprint.cells.tolist()
    (True, [0, 1])
    """
    if last is not None and np.array_equal(last.mesh_triangles, triangles) and np.array_equal(last.mesh_rest, rest):
        return last
    cells = near_lines(rest, triangles, [path.points for path in paths], reach)
    corners, inverse = np.unique(triangles[cells], return_inverse=True)
    if (
        last is not None
        and np.array_equal(last.mesh_triangles[last.cells], triangles[cells])
        and np.array_equal(last.mesh_rest[corners], rest[corners])
    ):
        entries = last.weights.data, last.weights.indices, last.weights.indptr
        weights = csr_array(entries, shape=(len(last.rest), len(rest)))
        return replace(last, mesh_rest=rest.copy(), mesh_triangles=triangles.copy(), cells=cells, weights=weights)
    own = inverse.reshape(-1, 3)
    halves, parts, hosts, s, w = subdivided(rest[corners], own.astype(np.int32), paths, reach, detail)
    weights = halves @ csr_array(
        (np.ones(len(corners)), (np.arange(len(corners)), corners)), shape=(len(corners), len(rest))
    )
    edges, sides = unique_edges(parts)
    wobble, noise = np.array([path.fields(*sw) for path, *sw in zip(paths, s, w, strict=True)]).swapaxes(0, 1)
    return Footprint(
        rest.copy(), triangles.copy(), cells, csr_array(weights), weights @ rest, parts, hosts, edges, sides, s, w,
        wobble, noise,
    )  # fmt: skip


def subdivided(
    points: Array, triangles: IntArray, paths: Sequence[StreamPath], reach: float, detail: float
) -> tuple[csr_array, IntArray, IntArray, Array, Array]:
    """Halve sides within reach of paths until none is longer than `detail`; only its ends decide if a side is halved.

    Returns
    -------
    weights : sparse array, shape (n, n0)
        Of the `points` (n0, 3) at the vertices.
    parts, hosts : ndarray of int32, shapes (m, 3) and (m,)
        Triangles of these, and those of `triangles` in which they lie.
    s, w : ndarray, shape (c, n)
        Coordinates of the vertices along each path.
    """
    trees = [cKDTree(path.points) for path in paths]

    def located(places: Array, normals: Array) -> Array:
        """s, w and distance (3, c, n) along each path."""
        found = [path.coordinates(places, normals, tree) for path, tree in zip(paths, trees, strict=True)]
        return np.array(found).swapaxes(0, 1)

    places, normals = points, vertex_normals(points, triangles)
    coordinates, weights = located(places, normals), csr_array(eye_array(len(points)))
    parts, hosts, far = triangles, np.arange(len(triangles), dtype=np.int32), reach + COVERING * detail
    done: list[tuple[IntArray, IntArray]] = []
    while len(parts):
        edges, sides = unique_edges(parts)
        v, w = edges.T
        length, away = np.linalg.norm(places[v] - places[w], axis=1), coordinates[2].min(axis=0)
        long = np.flatnonzero((length > detail) & (np.maximum(away[v], away[w]) <= far + length))
        v, w = v[long], w[long]
        middle, upright = 0.5 * (places[v] + places[w]), 0.5 * (normals[v] + normals[w])
        found = located(middle, upright)
        near = found[2].min(axis=0) < far + 0.5 * length[long]
        number = np.full(len(edges), -1, np.int32)
        number[long[near]] = len(places) + np.arange(near.sum())
        halved = number[sides]
        stay = (halved < 0).all(axis=1)
        within = stay & (away[parts].min(axis=1) < reach)
        done.append((parts[within], hosts[within]))
        weights = vstack([weights, 0.5 * (weights[v[near]] + weights[w[near]])], format="csr")
        places, normals = np.concatenate([places, middle[near]]), np.concatenate([normals, upright[near]])
        coordinates = np.concatenate([coordinates, found[:, :, near]], axis=2)
        parts, of = _divided(parts[~stay], halved[~stay], places)
        hosts = hosts[~stay][of]
    used, new = np.unique(np.concatenate([kept for kept, _ in done]), return_inverse=True)
    s, w, _ = coordinates[:, :, used]
    return weights[used], new.reshape(-1, 3).astype(np.int32), np.concatenate([host for _, host in done]), s, w


def _divided(triangles: IntArray, middles: IntArray, points: Array) -> tuple[IntArray, IntArray]:
    """Return the parts of triangles whose sides have some middles, else -1, and the triangle that each is a part of."""
    for _ in range(2):  # until the sides that are halved come first: one, two or all of them
        p, q, r = middles.T
        turn = (((p < 0) & (q >= 0)) | ((q < 0) & (r >= 0)))[:, None]
        triangles, middles = (np.where(turn, np.roll(each, -1, axis=1), each) for each in (triangles, middles))
    (a, b, c), (p, q, r) = triangles.T, middles.T
    shorter = np.linalg.norm(points[p] - points[c], axis=1) < np.linalg.norm(points[a] - points[q], axis=1)
    one, two, three = (q < 0), (q >= 0) & (r < 0), r >= 0
    kinds = [
        (one, (a, p, c)), (one, (p, b, c)),
        (two, (p, b, q)),
        (two & shorter, (a, p, c)), (two & shorter, (p, q, c)),
        (two & ~shorter, (a, p, q)), (two & ~shorter, (a, q, c)),
        (three, (a, p, r)), (three, (p, b, q)), (three, (r, q, c)), (three, (p, q, r)),
    ]  # fmt: skip
    parts = np.concatenate([np.stack(corners, axis=1)[which] for which, corners in kinds])
    return parts, np.concatenate([np.flatnonzero(which) for which, _ in kinds])


def near_lines(points: Array, triangles: IntArray, lines: Sequence[Array], reach: float) -> IntArray:
    """Return the triangles that may have points within reach of some polylines."""
    samples = np.concatenate(lines)
    gap = max(float(np.linalg.norm(np.diff(line, axis=0), axis=1).max()) for line in lines)
    far = reach + gap
    some = overlapping(points, triangles, samples.min(axis=0) - far, samples.max(axis=0) + far)
    corners = points[triangles[some]]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    away = cKDTree(samples).query(corners.mean(axis=1))[0]
    return some[away < far + 0.6 * longest]  # from the centroid no corner is farther than 0.58 sides


def overlapping(points: Array, triangles: IntArray, low: Array, high: Array) -> IntArray:
    """Return the triangles whose bounding boxes overlap the box from `low` to `high`."""
    beyond = np.packbits(np.hstack([points < low, points > high]), axis=1)[:, 0]  # one bit for each side of the box
    a, b, c = triangles.T
    return np.flatnonzero((beyond[a] & beyond[b] & beyond[c]) == 0)
