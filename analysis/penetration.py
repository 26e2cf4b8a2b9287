"""Depths to which the moved skin has entered eyes, the other lip or lid, and teeth, in mm beyond those at rest.

They are found by the positions and the shape of the face alone, whatever moved the skin. The cheap tests come first:
boxes rule out nearly all triangles, and the rest is computed exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import facewrinkle as fw
from facewrinkle.anatomy.landmarks import lips_middle
from facewrinkle.anatomy.teeth import CROWN_RINGS, CROWN_SIDES, CROWN_WIDTHS, ELLIPSE, Arch
from facewrinkle.geometry import _self_intersection_kernels as crossings
from facewrinkle.geometry.morton import morton_order
from facewrinkle.geometry.topology import edge_triangles, unique_edges, vertex_rings

from . import _oracle_kernels as kernels
from .orientation import Normals

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.integer]
BoolArray = npt.NDArray[np.bool_]

PER_BOX = 4
"""Triangles in each of the smallest boxes of a tree."""


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
    """Triangles of one lip or lid: its edges, and the sides (m, 3) of triangles of the whole mesh that are its border."""

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
        own = np.ascontiguousarray(triangles[kept], dtype=np.int64)
        edges, sides = unique_edges(own)
        single = np.diff(edge_triangles(sides)[0]) == 1
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

    def pierced_by(self, points: Array, edges: IntArray) -> IntArray:
        """Return pairs (k, 2) of an edge and a triangle of this sheet that it pierces."""
        low, high = np.empty((2, 2 * self.leaves - 1, 3))
        crossings.boxes(points, self.triangles, self.order, PER_BOX, low, high)
        found = np.empty((len(edges) + len(self.triangles), 2), np.int64)
        count = crossings.pierced(points, edges, self.triangles, self.order, PER_BOX, low, high, found)
        return found[:count]


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
        self._rest = tuple((np.zeros(len(points)), np.zeros(len(s.edges))) for s in (self.upper, self.lower))
        self._rest = self._depths(points, Normals(points, triangles))

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
        pairs = self.lower.pierced_by(points, self.upper.edges), self.upper.pierced_by(points, self.lower.edges)
        if not len(pairs[0]) and not len(pairs[1]):
            return out
        for k, (own, other) in enumerate(((self.upper, self.lower), (self.lower, self.upper))):
            pierced = np.unique(pairs[k][:, 0])
            seeds = np.unique(np.append(own.edges[pierced].ravel(), own.triangles[pairs[1 - k][:, 1]].ravel()))
            skin = (points, self._triangles, other.kept, normals.cross, normals.around, other.border)
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


class Crowns:
    """The depth of the skin before the teeth in the crowns of an arch.

    Parameters
    ----------
    face : Face
    arch : Arch
    samples : tuple of ndarray, shape (s, 3)
        Corners of the triangles that samples of the skin lie in, and barycentric coordinates.
    """

    def __init__(self, face: fw.Face, arch: Arch, samples: tuple[IntArray, Array]) -> None:
        self.jaw, rest = arch.jaw, face.points * face.unit
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
        middle = lips_middle(face.landmarks) * face.unit
        outward = self._middles - middle
        outward += 0.5 * ELLIPSE[arch.jaw][1] * face.frame.scale * face.unit * axes[2]
        outward -= np.outer(outward @ axes[1], axes[1])
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        up = np.broadcast_to(axes[1], outward.shape)
        self._axes = np.ascontiguousarray(np.stack([np.cross(up, outward), up, outward], axis=1))
        local = np.einsum("bkj,bpj->bpk", self._axes, crowns - self._middles[:, None])
        self._low, self._high = local.min(axis=1), local.max(axis=1)
        self._box = crowns.min(axis=(0, 1)), crowns.max(axis=(0, 1))
        self._corners, self._shares = samples
        self._rest = np.zeros(len(self._corners))
        self._rest = self.depths(rest)

    def depths(self, points: Array) -> Array:
        """Return the depth (s,) of the samples beyond that at rest, for a skin in the frame of the bone, mm."""
        places, chosen = np.empty((len(self._corners), 3)), np.empty(len(self._corners), np.int64)
        count = kernels.sampled(points, self._corners, self._shares, *self._box, places, chosen)
        deep, out = np.zeros(count), np.zeros(len(self._corners))
        solids = (self._points, self._triangles, self._firsts, self._middles, self._axes, self._low, self._high)
        kernels.in_solids(places[:count], *solids, deep)
        out[chosen[:count]] = np.maximum(deep - self._rest[chosen[:count]], 0.0)
        return out


def _closed(points: Array, triangles: IntArray, first: int, size: int) -> IntArray:
    """Triangles of one crown, closed at the end in the gum by a fan from the first point of the last ring."""
    own = triangles[((triangles >= first) & (triangles < first + size)).all(axis=1)]
    sides = np.concatenate([own[:, [0, 1]], own[:, [1, 2]], own[:, [2, 0]]])
    there = set(map(tuple, sides.tolist()))
    open_sides = [(a, b) for a, b in sides.tolist() if (b, a) not in there]
    apex = min(a for a, _ in open_sides)
    cap = [(b, a, apex) for a, b in open_sides if apex not in (a, b)]
    return np.concatenate([own, np.array(cap, dtype=own.dtype)])


def samples(points: Array, triangles: IntArray, kept: IntArray, spacing: float) -> tuple[IntArray, Array]:
    """Return corners and barycentric coordinates (s, 3) of points of triangles, at most `spacing` apart, and vertices.

    Examples
    --------
    >>> corners, shares = samples(np.eye(3), np.array([[0, 1, 2]]), np.array([0]), spacing=1.0)
    >>> len(shares), shares[0].round(3), shares[-1]
    (7, array([0.667, 0.167, 0.167]), array([1., 0., 0.]))
    """
    chosen = triangles[kept]
    sides = points[chosen] - points[np.roll(chosen, 1, axis=1)]
    parts = np.ceil(np.sqrt((sides**2).sum(axis=2)).max(axis=1) / spacing).astype(int)
    corners, shares = [], []
    for n in np.unique(parts):
        i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
        up = np.stack([i, j], axis=1)[i + j < n] + 1.0 / 3.0
        down = np.stack([i, j], axis=1)[i + j < n - 1] + 2.0 / 3.0
        inner = np.concatenate([up, down])[:, :] / n
        inner = np.column_stack([1.0 - inner.sum(axis=1), inner])
        these = chosen[parts == n]
        corners.append(np.repeat(these, len(inner), axis=0))
        shares.append(np.tile(inner, (len(these), 1)))
    vertices = np.unique(chosen)
    corners.append(np.repeat(vertices[:, None], 3, axis=1))
    shares.append(np.tile([1.0, 0.0, 0.0], (len(vertices), 1)))
    return np.concatenate(corners), np.concatenate(shares)
