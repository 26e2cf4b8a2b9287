"""A triangle mesh with an exact number of triangles on a surface that is charted to the plane.

The surface is a fine triangle mesh with a one-to-one planar chart. The coarse mesh lives in the chart, so that its
triangles can never fold over or jump to another sheet of the surface, while lengths and angles are measured in space:
edges too long for their target length are split, edges are flipped to Delaunay, and vertices glide.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from matplotlib.path import Path
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facewrinkle.geometry import vertex_normals

from .chart import Chart, cross

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

FREE, ON_LINE, FIXED = 0, 1, 2
SLIM = np.radians(28)
"""Angles below this must not shrink further, radians."""

SHORT = 0.72
"""Edges shorter than this share of their target length collapse."""


@dataclass
class ChartMesh:
    """A coarse mesh in a chart, which its methods improve in place.

    Attributes
    ----------
    chart : Chart
        Its values are x, y, z and the target length of edges.
    plane : ndarray, shape (n, 2)
    triangles : ndarray of int, shape (m, 3)
        Counter-clockwise in the chart.
    kind : ndarray of int, shape (n,)
        FREE, ON_LINE (glides along `line`) or FIXED. Edges between two FIXED vertices are kept.
    line : ndarray, shape (n, 2)
        Unit direction in which an ON_LINE vertex may glide.
    kept : set of pairs of int
        Further edges that are neither split nor flipped; the lower vertex comes first.
    merged : dict of int to int
        Vertices that are collapsed onto others before all else.
    points : ndarray, shape (n, 3)
        The vertices in space.
    size : ndarray, shape (n,)
        Target length of edges at the vertices.
    renumbered : ndarray of int
        Current index of each initial vertex; arbitrary if that is gone.
    """

    chart: Chart
    plane: Array
    triangles: IntArray
    kind: IntArray
    line: Array
    kept: set[tuple[int, int]]
    merged: dict[int, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.renumbered = np.arange(len(self.plane))
        self._evaluate()

    def _evaluate(self) -> None:
        """Look up the vertices in space, and their target lengths."""
        values = self.chart(self.plane)
        self.points, self.size = values[:, :3], values[:, 3]

    def refine(self, count: int) -> None:
        """Collapse short edges, then split, flip and smooth until there are `count` triangles."""
        self.flip()
        for _ in range(4):
            self.coarsen()
            self.flip()
            self.smooth(3)
            self.flip()
        while len(self.triangles) < count:
            self.split(count)
            self.flip()
            self.smooth(6)
            self.flip()
        for _ in range(15):
            self.smooth(6)
            self.flip()
        self.polish()

    def _sides(self) -> tuple[IntArray, IntArray]:
        """Edges (e, 2), and the triangles on both sides (e, 2), -1 at a boundary."""
        t = self.triangles
        sides = np.stack([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]], axis=1).reshape(-1, 2)
        edges, index = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
        order = np.argsort(index, kind="stable")
        first = np.searchsorted(index[order], np.arange(len(edges)))
        last = np.append(first[1:], len(index)) - 1
        pair = np.stack([order[first], np.where(last > first, order[last], -3)], axis=1) // 3
        return edges, pair

    def _kept(self, edges: IntArray) -> BoolArray:
        """True for edges (e,) that are neither split nor flipped."""
        fixed = (self.kind[edges] == FIXED).all(axis=1)
        listed = np.fromiter((tuple(e) in self.kept for e in edges.tolist()), dtype=bool, count=len(edges))
        return fixed | listed

    def split(self, count: int) -> None:
        """Split the edges longest for their target length, no two in one triangle, up to `count` triangles."""
        edges, pair = self._sides()
        length = np.linalg.norm(self.points[edges[:, 0]] - self.points[edges[:, 1]], axis=1)
        ratio = length / self.size[edges].mean(axis=1)
        ratio[self._kept(edges) | (self._angle_after(edges, pair) < SLIM / 3)] = 0.0
        room = count - len(self.triangles)
        budget = max(1, room // 6)
        if room == 1:
            ratio[pair[:, 1] >= 0] = 0.0
        touched = np.zeros(len(self.triangles), dtype=bool)
        for e in np.argsort(-ratio, kind="stable"):
            sides = [t for t in pair[e] if t >= 0]
            if len(sides) > room or touched[sides].any():
                continue
            touched[sides] = True
            self._split(int(edges[e, 0]), int(edges[e, 1]), sides)
            room -= len(sides)
            budget -= len(sides)
            if budget <= 0 or room == 0 or ratio[e] == 0.0:
                break
        self._evaluate()

    def _angle_after(self, edges: IntArray, pair: IntArray) -> Array:
        """Smallest angle (e,) that splitting an edge would leave, 0 where it would fold the surface.

        The middle of an edge in the chart may lie off its middle in space.
        """
        middle = self.chart(self.plane[edges].mean(axis=1))[:, :3]
        least = np.full(len(edges), np.pi)
        for side in range(2):
            there = pair[:, side] >= 0
            cells = self.triangles[np.where(there, pair[:, side], pair[:, 0])]
            before = _normals(self.points[cells])
            for end in edges.T:
                new = np.where((cells == end[:, None])[:, :, None], middle[:, None], self.points[cells])
                turned = np.einsum("mi,mi->m", before, _normals(new)) < 0.5
                least = np.where(there, np.minimum(least, np.where(turned, 0.0, _smallest(new))), least)
        return least

    def _split(self, a: int, b: int, sides: list[int]) -> None:
        """Split the edge from a to b, in the middle of the chart, and the triangles on its sides."""
        new = len(self.plane)
        along = self.plane[b] - self.plane[a]
        self.plane = np.vstack([self.plane, self.plane[a] + 0.5 * along])
        self.kind = np.append(self.kind, ON_LINE if len(sides) == 1 else FREE)
        self.line = np.vstack([self.line, along / np.linalg.norm(along)])
        for t in sides:
            old = self.triangles[t].copy()
            self.triangles[t] = np.where(old == b, new, old)
            self.triangles = np.vstack([self.triangles, np.where(old == a, new, old)])

    def coarsen(self, short: float = SHORT, most: float = np.inf) -> None:
        """Collapse the edges that are short for their target length, the shortest first, until none or enough are gone.

        Where not all may go, those at a boundary and in the more bent half stay, and no angle below SLIM is made, as no
        smoothing follows.
        """
        few = bool(np.isfinite(most))
        slim = SLIM if few else SLIM / 2
        refused: set[tuple[int, int]] = set()
        while True:
            edges, pair = self._sides()
            length = np.linalg.norm(self.points[edges[:, 0]] - self.points[edges[:, 1]], axis=1)
            ratio = length / self.size[edges].mean(axis=1)
            if few:
                normals = vertex_normals(self.points, self.triangles)
                bent = np.linalg.norm(normals[edges[:, 0]] - normals[edges[:, 1]], axis=1)
                ratio[(bent > np.median(bent)) | (pair[:, 1] < 0)] = np.inf
            ratio[self._kept(edges)] = np.inf
            ratio[[self.merged.get(a) == b or self.merged.get(b) == a for a, b in edges.tolist()]] = 0.0
            around = _fans(self.triangles, len(self.plane))
            touched = np.zeros(len(self.plane), dtype=bool)
            gone, done = np.zeros(len(self.triangles), dtype=bool), 0
            for e in np.argsort(ratio, kind="stable"):
                if ratio[e] > short or done >= most:
                    break
                for v, u in (edges[e].tolist(), edges[e].tolist()[::-1]):
                    ring = np.unique(self.triangles[around[v]])
                    if (v, u) in refused or touched[ring].any():
                        continue
                    if not self._may_collapse(v, u, around[v], around[u], bool(pair[e, 1] < 0), slim):
                        refused.add((v, u))
                        continue
                    lost = around[v][(self.triangles[around[v]] == u).any(axis=1)]
                    self.triangles[around[v]] = np.where(self.triangles[around[v]] == v, u, self.triangles[around[v]])
                    gone[lost] = True
                    touched[ring] = True
                    done += 1
                    break
            self.triangles = self.triangles[~gone]
            most -= done
            if not done or most == 0:
                self._drop_unused()
                return

    def insert_row(self, *rows: Array) -> None:
        """Put a vertex halfway between each two of two rows (k, 2) of fixed ones; as many go where edges are shortest.

        All others stay where they are.
        """
        self.coarsen(np.inf, len(rows[0]))
        first, second = (cKDTree(self.plane).query(row)[1] for row in rows)
        for a, b in zip(first, second, strict=True):
            self._split(a, b, np.flatnonzero(np.isin(self.triangles, [a, b]).sum(axis=1) == 2).tolist())
        self._evaluate()
        edges, _ = self._sides()
        for edge in edges[np.isin(edges, first).any(axis=1) & np.isin(edges, second).any(axis=1)]:  # across the row
            sides = np.flatnonzero(np.isin(self.triangles, edge).sum(axis=1) == 2)
            self._flip(edge, sides, self.triangles[sides].sum(axis=1) - edge.sum())
        self.flip()

    def refill(self, rings: list[tuple[Array, Array]]) -> None:
        """Replace the vertices inside a ring by as many others, on rings inside it; edges along the rings are kept.

        All others stay where they are. A ring is places (k, 2), clockwise, and their shares (k,) of the way around, in
        [0, 1); the outermost ring lies on vertices and edges.
        """
        outer = rings[0][0]
        rim = cKDTree(self.plane).query(outer)[1]
        inside = Path(outer).contains_points(self.plane[self.triangles].mean(axis=1))
        old = np.setdiff1d(self.triangles[inside], rim)
        ends = np.cumsum([len(places) for places, _ in rings[1:]])
        if ends[-1] != len(old):
            raise ValueError(f"the rings must hold {len(old)} vertices, not {ends[-1]}")
        self.plane[old] = np.concatenate([places for places, _ in rings[1:]])
        self.kind[old] = FREE
        vertices = [rim, *np.split(old, ends[:-1])]
        named = [(ring, share) for ring, (_, share) in zip(vertices, rings, strict=True)]
        last = vertices[-1]
        fan = np.column_stack([np.full(len(last) - 2, last[0]), last[2:], last[1:-1]])
        self.triangles[inside] = np.vstack([*(_between(*pair) for pair in pairwise(named)), fan])
        sides = np.concatenate([np.column_stack([ring, np.roll(ring, -1)]) for ring in vertices])
        self.kept |= set(map(tuple, np.sort(sides, axis=1).tolist()))
        self._evaluate()
        self.flip()

    def _may_collapse(self, v: int, u: int, fan: IntArray, other: IntArray, border: bool, slim: float) -> bool:
        """Return True if vertex v may collapse onto its neighbor u: without a fold, along its line if it has one."""
        if self.kind[v] == FIXED or any(v in edge for edge in self.kept):
            return False
        if self.kind[v] == ON_LINE:
            off = self.plane[u] - self.plane[v]
            if not border or abs(cross(off, self.line[v])) > 1e-9 * float(np.linalg.norm(off)):
                return False
        shared = np.intersect1d(np.unique(self.triangles[fan]), np.unique(self.triangles[other]))
        if len(shared) != (3 if border else 4):
            return False
        stay = fan[(self.triangles[fan] != u).all(axis=1)]
        new = np.where(self.triangles[stay] == v, u, self.triangles[stay])
        p, q = self.plane[new], self.points[new]
        if len(stay) == 0 or (cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) <= 1e-9).any():
            return False
        before = self.points[self.triangles[stay]]
        turned = np.einsum("mi,mi->m", _normals(q), _normals(before))
        return bool((_smallest(q) > slim).all() and (turned > 0.5).all())

    def _drop_unused(self) -> None:
        """Renumber the vertices that triangles still use."""
        used = np.unique(self.triangles)
        number = np.full(len(self.plane), -1)
        number[used] = np.arange(len(used))
        self.triangles = number[self.triangles]
        self.plane, self.kind, self.line = self.plane[used], self.kind[used], self.line[used]
        self.kept = {(int(number[a]), int(number[b])) for a, b in self.kept}
        self.merged = {int(number[a]): int(number[b]) for a, b in self.merged.items() if number[a] >= 0}
        self.renumbered = number[self.renumbered]
        self._evaluate()

    def flip(self) -> None:
        """Flip edges until each is Delaunay in space, wherever the chart allows."""
        for _ in range(40):
            edges, pair = self._sides()
            inner = (pair[:, 1] >= 0) & ~self._kept(edges)
            edges, pair = edges[inner], pair[inner]
            tips = np.stack([self.triangles[pair[:, s]].sum(axis=1) - edges.sum(axis=1) for s in range(2)], axis=1)
            a, b, c, d = (self.points[v] for v in (*edges.T, *tips.T))
            excess = angle(a - c, b - c) + angle(a - d, b - d) - np.pi
            existing = set(map(tuple, np.sort(self._sides()[0], axis=1).tolist()))
            touched = np.zeros(len(self.triangles), dtype=bool)
            done = 0
            for e in np.argsort(-excess, kind="stable"):
                if excess[e] < 1e-3:
                    break
                if touched[pair[e]].any() or tuple(sorted(tips[e].tolist())) in existing:
                    continue
                done += self._flip(edges[e], pair[e], tips[e])
                touched[pair[e]] = True
            if not done:
                return

    def _flip(self, edge: IntArray, pair: IntArray, tips: IntArray) -> bool:
        """Flip the edge between two triangles unless one would turn over; return True if it was flipped."""
        a, b = edge
        row = self.triangles[pair[0]].tolist()
        if row[(row.index(a) + 1) % 3] != b:
            a, b = b, a
        # The first triangle is (a, b, tip 0), the second (b, a, tip 1).
        new = np.array([[tips[0], a, tips[1]], [tips[1], b, tips[0]]])
        p = self.plane[new]
        if (cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) <= 1e-9).any():
            return False
        before, after = (_normals(self.points[rows]) for rows in (self.triangles[pair], new))
        if after[0] @ after[1] < min(0.0, before[0] @ before[1]):
            return False
        self.triangles[pair] = new
        return True

    def smooth(self, rounds: int) -> None:
        """Move free vertices to the mean of their triangles' centroids in space, weighted by area over target area."""
        n = len(self.plane)
        moving = self.kind != FIXED
        corners = self.triangles.ravel()
        for _ in range(rounds):
            p = self.points[self.triangles]
            area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
            weight = np.repeat(area / self.size[self.triangles].mean(axis=1) ** 2, 3)
            off = np.repeat(p.mean(axis=1), 3, axis=0) - self.points[corners]
            flat = np.repeat(self.plane[self.triangles].mean(axis=1), 3, axis=0) - self.plane[corners]
            goal = np.zeros((n, 3))
            np.add.at(goal, corners, weight[:, None] * off)
            goal /= np.bincount(corners, weight, n)[:, None]
            # The step in the chart is the one whose image in space, by a local linear fit, is nearest the goal.
            square, mixed = np.zeros((n, 2, 2)), np.zeros((n, 2, 3))
            np.add.at(square, corners, flat[:, :, None] * flat[:, None, :])
            np.add.at(mixed, corners, flat[:, :, None] * off[:, None, :])
            slope = np.linalg.pinv(square, hermitian=True) @ mixed
            inverse = np.linalg.pinv(slope @ slope.transpose(0, 2, 1), hermitian=True)
            step = np.where(moving[:, None], np.einsum("ncd,ndi,ni->nc", inverse, slope, goal), 0.0)
            glide = self.kind == ON_LINE
            step[glide] = np.einsum("nc,nc->n", step[glide], self.line[glide])[:, None] * self.line[glide]
            self._move(0.7 * step)

    def _move(self, step: Array) -> None:
        """Take the steps, except where a triangle would turn over, or an angle below SLIM would shrink."""
        before, normals = self.smallest_angles(), _normals(self.points[self.triangles])
        state = self.plane, self.points, self.size
        moves = (step != 0.0).any(axis=1)
        values = self.chart(self.plane[moves] + step[moves])
        goal = tuple(array.copy() for array in state)
        for array, new in zip(goal, (self.plane[moves] + step[moves], values[:, :3], values[:, 3]), strict=True):
            array[moves] = new
        while True:
            self.plane, self.points, self.size = (
                np.where(moves if old.ndim == 1 else moves[:, None], new, old)
                for old, new in zip(state, goal, strict=True)
            )
            p = self.plane[self.triangles]
            now = self.smallest_angles()
            bad = (cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) <= 1e-9) | ((now < SLIM) & (now < before - 1e-9))
            bad |= np.einsum("mi,mi->m", normals, _normals(self.points[self.triangles])) < 0.5
            bad &= moves[self.triangles].any(axis=1)
            if not bad.any():
                return
            moves[self.triangles[bad]] = False

    def smallest_angles(self) -> Array:
        """Return the smallest angle (m,) of every triangle in space, radians."""
        return _smallest(self.points[self.triangles])

    def polish(self) -> None:
        """Move the vertices of the worst triangles wherever that widens their smallest angle."""
        turns = np.arange(8) * np.pi / 4
        fan = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        movable = np.flatnonzero((self.kind[self.triangles] != FIXED).any(axis=1))
        for _ in range(30):
            worst = movable[np.argsort(self.smallest_angles()[movable], kind="stable")[:25]]
            vertices = np.unique(self.triangles[worst])
            if not sum(self._widen(int(v), fan) for v in vertices if self.kind[v] != FIXED):
                return

    def _widen(self, v: int, fan: Array) -> bool:
        """Move a vertex by the step of a fan that widens the smallest angle around it most; return True if one does."""
        ring = self.triangles[(self.triangles == v).any(axis=1)]
        edge = np.linalg.norm(self.plane[ring] - self.plane[v], axis=2).max()
        steps = np.concatenate([fan * (edge * s) for s in (0.15, 0.05, 0.015)])
        if self.kind[v] == ON_LINE:
            steps = (steps @ self.line[v])[:, None] * self.line[v]
        places = np.vstack([self.plane[v], self.plane[v] + steps])
        points = self.chart(places)[:, :3]
        space = np.repeat(self.points[ring][None], len(places), axis=0)
        flat = np.repeat(self.plane[ring][None], len(places), axis=0)
        at = ring == v
        space[:, at] = points[:, None]
        flat[:, at] = places[:, None]
        a, b, c = np.moveaxis(space, 2, 0)
        least = np.minimum(np.minimum(angle(b - a, c - a), angle(c - b, a - b)), angle(a - c, b - c)).min(axis=1)
        a, b, c = np.moveaxis(flat, 2, 0)
        least[(cross(b - a, c - a) <= 1e-9).any(axis=1)] = -1.0
        best = int(least.argmax())
        if least[best] <= least[0] + 1e-6:
            return False
        self.plane[v], self.points[v] = places[best], points[best]
        return True


def angle(a: Array, b: Array) -> Array:
    """Return angles between vectors along the last axis, radians."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.einsum("...i,...i->...", a, b))


def _smallest(corners: Array) -> Array:
    """Smallest angle (m,) of triangles (m, 3, k), radians."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.minimum(np.minimum(angle(b - a, c - a), angle(c - b, a - b)), angle(a - c, b - c))


def _normals(corners: Array) -> Array:
    """Unit normals (m, 3) of triangles (m, 3, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))


def _between(outer: tuple[IntArray, Array], inner: tuple[IntArray, Array]) -> IntArray:
    """Triangles (n + m, 3) between two clockwise rings: vertices, and their shares of the way around."""
    (a, to_a), (b, to_b) = ((ring, np.append(share[1:], share[0] + 1.0)) for ring, share in (outer, inner))
    tip_b = b[np.searchsorted(to_b, to_a, side="left") % len(b)]
    tip_a = a[np.searchsorted(to_a, to_b, side="right") % len(a)]
    return np.vstack([np.column_stack([np.roll(a, -1), a, tip_b]), np.column_stack([b, np.roll(b, -1), tip_a])])


def _fans(triangles: IntArray, n: int) -> list[IntArray]:
    """The triangles around each of n vertices."""
    order = np.argsort(triangles.ravel(), kind="stable")
    starts = np.searchsorted(triangles.ravel()[order], np.arange(1, n))
    return np.split(order // 3, starts)
