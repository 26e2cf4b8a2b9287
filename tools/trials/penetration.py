"""Depths to which the moved skin has entered eyes, the other lip or lid, and teeth, in mm beyond those at rest.

They are found by the positions and the shape of the face alone, whatever moved the skin. The cheap tests come first:
boxes rule out nearly all triangles, and the rest is computed exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import lips_middle
from facewrinkle.anatomy.teeth import CROWN_RINGS, CROWN_SIDES, CROWN_WIDTHS, ELLIPSE, OVERJET, Arch
from facewrinkle.geometry.topology import incident_triangles, morton_order, unique_edges, vertex_rings
from tools import _self_intersection_kernels as crossings

from . import _oracle_kernels as kernels
from .orientation import Normals

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.integer]
BoolArray = npt.NDArray[np.bool_]
Tree = tuple[IntArray, int, Array, Array]
"""Triangles in order, how many are in a leaf, and the low and high ends of the boxes, numbered as in a heap."""

PER_BOX = 4
"""Triangles in each of the smallest boxes of a tree."""

SLIDING = 4.0
"""Lips and lids that run through each other at rest may be as deep up to this far from there, mm: skin slides."""

CLEAR_OF_TEETH = 1.08
"""No crown reaches farther than this, relative to the arch's outer border."""


class Ball:
    """The depth of the skin in an eyeball: of vertices, and of triangles in between.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        At rest, mm.
    triangles : ndarray of int, shape (m, 3)
    centre : ndarray, shape (3,)
    radius : float
    """

    def __init__(self, points: Array, triangles: IntArray, centre: Array, radius: float) -> None:
        self._triangles, self._centre, self._radius = triangles, np.ascontiguousarray(centre), float(radius)
        self._rest = np.minimum(self._distances(points), self._radius)

    def _distances(self, points: Array) -> Array:
        out = np.empty(len(self._triangles))
        kernels.squared_distances(self._centre, points, self._triangles, self._radius, out)
        return np.sqrt(out)

    def depths(self, points: Array) -> Array:
        """Return the depth (m,) of the triangles beyond that at rest."""
        return np.maximum(self._rest - self._distances(points), 0.0)


@dataclass(frozen=True, eq=False)
class Sheet:
    """Triangles of one lip or lid.

    Attributes
    ----------
    kept : ndarray of int
        Their numbers in the whole mesh, of m triangles.
    triangles, edges : ndarray of int, shapes (k, 3) and (e, 2)
    border : ndarray of bool, shape (m, 3)
        True for the sides, opposite each corner, at which the sheet ends.
    order, leaves
        The tree of boxes around the triangles.
    start, ring : ndarray of int
        Neighbors of each vertex within the sheet.
    """

    kept: IntArray
    triangles: IntArray
    edges: IntArray
    border: BoolArray
    order: IntArray
    leaves: int
    start: IntArray
    ring: IntArray

    @classmethod
    def of(cls, points: Array, triangles: IntArray, kept: IntArray) -> Sheet:
        """Return the sheet of some triangles of a mesh at rest."""
        own = np.ascontiguousarray(triangles[kept], dtype=np.int64)
        edges, sides = unique_edges(own)
        single = np.diff(incident_triangles(sides)[0]) == 1
        ends = {frozenset(edge) for edge in edges[single].tolist()}
        border = np.zeros((len(triangles), 3), bool)
        for t, corners in zip(kept, own.tolist(), strict=True):
            for s in range(3):
                border[t, s] = frozenset((corners[s - 2], corners[s - 1])) in ends
        middles = points[own].mean(axis=1)
        span = float(np.ptp(middles, axis=0).max()) or 1.0
        order = morton_order(((middles - middles.min(axis=0)) / span * 1023.0).astype(np.int64), 10)
        leaves = 1 << max(0, int(np.ceil(np.log2(max(len(own), 1) / PER_BOX))))
        start, ring = vertex_rings(own, len(points))
        return cls(kept, own, edges, border, order, leaves, start.astype(np.int64), ring.astype(np.int64))

    def tree(self, points: Array) -> Tree:
        """Return the tree of boxes around the triangles at positions (n, 3)."""
        low, high = np.empty((2, 2 * self.leaves - 1, 3))
        crossings.boxes(points, self.triangles, self.order, PER_BOX, low, high)
        return self.order, PER_BOX, low, high

    def pierced_by(self, points: Array, edges: IntArray, tree: Tree) -> IntArray:
        """Return pairs (k, 2) of an edge and a triangle of this sheet that it pierces."""
        _, _, low, high = tree
        near = np.empty(len(edges), np.int64)
        near = near[: kernels.edges_in_box(points, edges, low[0], high[0], near)]
        found = np.empty((len(edges) + len(self.triangles), 2), np.int64)
        count = crossings.pierced(points, edges[near], self.triangles, *tree, found)
        found = found[:count]
        return np.column_stack([near[found[:, 0]], found[:, 1]])


class Sheets:
    """The depth to which two lips, or two lids, have come through each other.

    Where edges of the one pierce triangles of the other, vertices and points of edges behind the other's skin are
    looked for, from there on. Skin that is nearest to the end of the other's skin is not behind it.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        At rest, mm.
    triangles : ndarray of int, shape (m, 3)
    upper, lower : ndarray of int
        Numbers of the triangles of either.
    """

    def __init__(self, points: Array, triangles: IntArray, upper: IntArray, lower: IntArray) -> None:
        self._triangles = triangles
        self.upper, self.lower = (Sheet.of(points, triangles, kept) for kept in (upper, lower))
        depths = self._depths(points, Normals(points, triangles))
        self._rest = [
            tuple(_largest_around(points, sheet, *found))
            for sheet, found in zip((self.upper, self.lower), depths, strict=True)
        ]

    def depth(self, points: Array, normals: Normals) -> tuple[float, int]:
        """Return the largest depth beyond that at rest, and the vertex, or an end of the edge, that is so deep."""
        worst, which = 0.0, -1
        found = self._depths(points, normals)
        for sheet, rest, now in zip((self.upper, self.lower), self._rest, found, strict=True):
            for kind in range(2):
                beyond = np.where(now[kind] > 0.0, now[kind] - rest[kind], 0.0)
                k = int(np.argmax(beyond)) if len(beyond) else 0
                if len(beyond) and beyond[k] > worst:
                    worst, which = float(beyond[k]), int(sheet.edges[k, 0]) if kind else k
        return worst, which

    def _depths(self, points: Array, normals: Normals) -> tuple[tuple[Array, Array], ...]:
        """Return the depths of the vertices (n,) and of the edges of both sheets in the other."""
        out = tuple((np.zeros(len(points)), np.zeros(len(s.edges))) for s in (self.upper, self.lower))
        trees = self.lower.tree(points), self.upper.tree(points)
        pairs = (
            self.lower.pierced_by(points, self.upper.edges, trees[0]),
            self.upper.pierced_by(points, self.lower.edges, trees[1]),
        )
        if not len(pairs[0]) and not len(pairs[1]):
            return out
        for k, (own, other) in enumerate(((self.upper, self.lower), (self.lower, self.upper))):
            pierced = np.unique(pairs[k][:, 0])
            seeds = np.unique(np.append(own.edges[pierced].ravel(), own.triangles[pairs[1 - k][:, 1]].ravel()))
            skin = (points, self._triangles, other.kept, normals.cross, other.border, trees[k])
            ring = own.ring.copy()
            for a, b in own.edges[pierced]:  # no walk goes through the other's skin
                for v, w in ((a, b), (b, a)):
                    around = slice(own.start[v], own.start[v + 1])
                    ring[around][own.ring[around] == w] = -1
            kernels.penetrating(*skin, own.start, ring, seeds.astype(np.int64), out[k][0])
            deep = np.zeros(len(pierced))
            kernels.penetrating_edges(*skin, own.edges[pierced], deep)
            out[k][1][pierced] = deep
        return out


def _largest_around(points: Array, sheet: Sheet, vertices: Array, edges: Array) -> tuple[Array, Array]:
    """Return the depths of vertices and edges at rest, each the largest within `SLIDING`: there others come to lie."""
    places = np.concatenate([points, points[sheet.edges].mean(axis=1)])
    deep = np.concatenate([vertices, edges])
    some = np.flatnonzero(deep)
    out = np.zeros(len(deep))
    if len(some):
        near = cKDTree(places[some]).query_ball_point(places, SLIDING)
        out = np.array([deep[some[found]].max(initial=0.0) for found in near])
    return out[: len(points)], out[len(points) :]


class Crowns:
    """The depth of the skin before the teeth in the crowns of an arch.

    Parameters
    ----------
    face : Face
    arch : Arch
    samples : Samples
        Of the skin before the teeth.
    """

    def __init__(self, face: fw.Face, arch: Arch, samples: Samples) -> None:
        self.jaw, rest = arch.jaw, face.points_mm
        points = np.asarray(arch.points * face.unit)
        size = CROWN_SIDES * CROWN_RINGS + 1
        count = 2 * len(CROWN_WIDTHS[arch.jaw])
        gum = len(points) - count * size  # its points come first
        solids = [_closed(points, np.asarray(arch.triangles, np.int64), gum + size * k, size) for k in range(count)]
        self._points, self._triangles = np.ascontiguousarray(points), np.concatenate(solids)
        self._firsts = np.cumsum([0] + [len(solid) for solid in solids])
        axes = face.frame.axes
        crowns = points[gum : gum + count * size].reshape(count, size, 3)
        self._middles = np.ascontiguousarray(crowns.mean(axis=1))
        self._cylinder = border_of(face, arch)
        outward = self._middles - self._cylinder[0]
        outward -= np.outer(outward @ axes[1], axes[1])
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        up = np.broadcast_to(axes[1], outward.shape)
        self._axes = np.ascontiguousarray(np.stack([np.cross(up, outward), up, outward], axis=1))
        local = np.einsum("bkj,bpj->bpk", self._axes, crowns - self._middles[:, None])
        self._low, self._high = local.min(axis=1), local.max(axis=1)
        self._box = crowns.min(axis=(0, 1)), crowns.max(axis=(0, 1))
        self.samples = samples
        self.at_rest = np.zeros(len(samples.shares))
        self.at_rest = self.depths(rest)

    def depths(self, points: Array) -> Array:
        """Return the depth (s,) of the samples beyond that at rest, for a skin in the frame of the bone, mm."""
        own = self.samples
        places, chosen = np.empty((len(own.shares), 3)), np.empty(len(own.shares), np.int64)
        middle, axes, half = self._cylinder
        count = kernels.sampled(
            points, own.triangles, own.firsts, own.shares, *self._box, middle, axes, CLEAR_OF_TEETH * half, places,
            chosen,
        )  # fmt: skip
        deep, out = np.zeros(count), np.zeros(len(own.shares))
        solids = (self._points, self._triangles, self._firsts, self._middles, self._axes, self._low, self._high)
        kernels.in_solids(places[:count], *solids, deep)
        out[chosen[:count]] = np.maximum(deep - self.at_rest[chosen[:count]], 0.0)
        return out


def border_of(face: fw.Face, arch: Arch) -> tuple[Array, Array, Array]:
    """Return middle (3,), axes (2, 3) and half axes (2,) of the upright elliptic cylinder around an arch, mm."""
    half = np.array(ELLIPSE[arch.jaw]) * face.frame.scale * face.unit
    middle, axes = lips_middle(face.landmarks) * face.unit, np.ascontiguousarray(face.frame.axes[[0, 2]])
    back = face.behind_lips + (OVERJET if arch.jaw == "lower" else 0.0)
    return middle - (back * face.frame.scale * face.unit + half[1]) * axes[1], axes, half


def _closed(points: Array, triangles: IntArray, first: int, size: int) -> IntArray:
    """Triangles of one crown, closed at the end in the gum by a fan from the first point of the last ring."""
    own = triangles[((triangles >= first) & (triangles < first + size)).all(axis=1)]
    sides = np.concatenate([own[:, [0, 1]], own[:, [1, 2]], own[:, [2, 0]]])
    there = set(map(tuple, sides.tolist()))
    open_sides = [(a, b) for a, b in sides.tolist() if (b, a) not in there]
    apex = min(a for a, _ in open_sides)
    cap = [(b, a, apex) for a, b in open_sides if apex not in (a, b)]
    return np.concatenate([own, np.array(cap, dtype=own.dtype)])


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of triangles.

    Attributes
    ----------
    triangles : ndarray of int, shape (m, 3)
        Their corners.
    firsts : ndarray of int, shape (m + 1,)
        The samples of triangle t are those from ``firsts[t]`` to before ``firsts[t + 1]``.
    shares : ndarray, shape (s, 3)
        Barycentric coordinates.

    Examples
    --------
    A triangle with sides of 1.4 mm has 4 samples, and three at its corners:

    >>> found = Samples.of(np.eye(3), np.array([[0, 1, 2]]), spacing=1.0)
    >>> found.triangles.tolist(), found.firsts.tolist()
    ([[0, 1, 2], [0, 0, 0], [1, 1, 1], [2, 2, 2]], [0, 4, 5, 6, 7])
    """

    triangles: IntArray
    firsts: IntArray
    shares: Array

    @classmethod
    def of(cls, points: Array, triangles: IntArray, spacing: float) -> Samples:
        """Return samples no farther apart than `spacing`, and all vertices."""
        sides = points[triangles] - points[np.roll(triangles, 1, axis=1)]
        parts = np.ceil(np.sqrt((sides**2).sum(axis=2)).max(axis=1) / spacing).astype(int)
        vertices = np.repeat(np.unique(triangles)[:, None], 3, axis=1)
        shares = [_lattice(n) for n in parts] + [np.array([[1.0, 0.0, 0.0]])] * len(vertices)
        firsts = np.cumsum([0] + [len(s) for s in shares])
        return cls(np.concatenate([triangles, vertices]).astype(np.int64), firsts, np.concatenate(shares))

    def places(self, points: Array) -> Array:
        """Return the samples' positions (s, 3)."""
        corners = np.repeat(self.triangles, np.diff(self.firsts), axis=0)
        return np.asarray(np.einsum("sk,skj->sj", self.shares, points[corners]))

    def chosen(self, kept: BoolArray) -> Samples:
        """Return those samples where `kept` (s,) is True."""
        firsts = np.concatenate([[0], np.cumsum(kept)])[self.firsts]
        some = np.diff(firsts) > 0
        return Samples(self.triangles[some], np.append(firsts[:-1][some], firsts[-1]), self.shares[kept])


@cache
def _lattice(n: int) -> Array:
    """Barycentric coordinates (n n, 3) of the middles of the triangles into which n parts of each side cut one."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    corner = np.column_stack([i, j])
    inner = np.concatenate([corner[i + j < n] + 1.0 / 3.0, corner[i + j < n - 1] + 2.0 / 3.0]) / n
    return np.column_stack([1.0 - inner.sum(axis=1), inner])
