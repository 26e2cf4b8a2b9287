"""The surface under a tear, subdivided, and what of it is covered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import map_coordinates

from ..geometry.normals import vertex_normals
from ..geometry.topology import unique_edges
from . import _kernels as kernels
from . import path as paths

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

TINY = 1e-6


@dataclass(frozen=True, eq=False)
class Course:
    """One run of a stream.

    Attributes
    ----------
    points : ndarray, shape (k, 3)
        At rest.
    begin, flow : float
        Where it leaves the source's path, and its share of the water.
    noise, spacing : ndarray and float
        Bumps over a grid of (s, w), see :func:`facewrinkle.tears.shape.rough_film`.
    wobble : ndarray
        Change of the trail's width along the grid, as a share.
    """

    points: Array
    begin: float
    flow: float
    noise: Array
    spacing: float
    wobble: Array

    @cached_property
    def lengths(self) -> Array:
        """Length up to each point."""
        return paths.lengths(self.points)

    def fields(self, s: Array, w: Array) -> tuple[Array, Array]:
        """Wobble and noise at positions along the course (n,) and distances to its side (n,)."""
        place = s / self.spacing
        wobble = np.interp(place, np.arange(len(self.wobble)), self.wobble)
        across = w / self.spacing + self.noise.shape[1] // 2
        return wobble, map_coordinates(self.noise, [place, across], order=1, mode="nearest")


@dataclass(frozen=True, eq=False)
class Base:
    """The surface under a tear, subdivided: everything that changes only when the mesh below it does.

    Attributes
    ----------
    of, below : tuple
        The rest points and triangles of the mesh it was made of, and of the part of it below the tear.
    used, cells : ndarray of int32
        The vertices and triangles of that part, in the mesh.
    corners, weights : ndarray, shape (n, 3)
        Barycentric coordinates of the base's vertices, in that part.
    triangles, hosts : ndarray of int32, shapes (m, 3) and (m,)
        The base's triangles, and those of that part in which they lie.
    edges, sides : ndarray of int32, shapes (e, 2) and (m, 3)
        As of :func:`facewrinkle.geometry.topology.unique_edges`.
    single, border : ndarray of bool, shapes (e,) and (n,)
        The edges of one triangle only, and their vertices.
    rings : tuple of ndarray
        Neighbours of the vertices: offsets (n + 1,) and vertices.
    s, w, wobble, noise : ndarray, shape (c, n)
        Position along each course and distance from it, and the wobble and noise there.
    """

    of: tuple[Array, IntArray]
    below: tuple[Array, IntArray]
    used: IntArray
    cells: IntArray
    corners: IntArray
    weights: Array
    triangles: IntArray
    hosts: IntArray
    edges: IntArray
    sides: IntArray
    single: npt.NDArray[np.bool_]
    border: npt.NDArray[np.bool_]
    rings: tuple[IntArray, IntArray]
    s: Array
    w: Array
    wobble: Array
    noise: Array

    def part(self, level: Array) -> Part | None:
        """What is covered: where the linear function `level` (n,) is above 0, as one piece without holes."""
        level = np.where(np.abs(level) < TINY, TINY, level)
        if kernels.make_disk(level, *self.rings, self.border, TINY) == 0:
            return None
        room = len(level) + len(self.edges)
        faces, rim = np.empty((2 * len(self.triangles), 3), np.int32), np.empty((len(self.edges), 2), np.int32)
        first, second, inside, share = *(np.empty(room, np.int32) for _ in range(3)), np.empty(room)
        m, r, n = kernels.clip(
            self.triangles, self.sides, self.edges, self.single, level, faces, rim, first, second, share, inside
        )
        return Part(self, faces[:m], rim[:r], first[:n], second[:n], share[:n], inside[:n])


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a base: its triangles (m, 3), and for each vertex the two of the base that it lies between.

    Attributes
    ----------
    base : Base
    triangles : ndarray of int32, shape (m, 3)
    rim : ndarray of int32, shape (b, 2)
        Its outline, as sides of its triangles.
    first, second : ndarray of int32, shape (n,)
    share : ndarray, shape (n,)
        0 at the first; vertices of the outline lie in between.
    inside : ndarray of int32, shape (n,)
        A triangle of the base in which the vertex lies.
    """

    base: Base
    triangles: IntArray
    rim: IntArray
    first: IntArray
    second: IntArray
    share: Array
    inside: IntArray

    def on(self, values: Array) -> Array:
        """Values (n0, 3) of the mesh's vertices, at those of the part."""
        out = np.empty((len(self.first), 3))
        base = self.base
        kernels.carry(values, base.used, base.corners, base.weights, self.first, self.second, self.share, out)
        return out

    @property
    def under(self) -> IntArray:
        """The triangles (n,) of the mesh that its vertices lie in."""
        return self.base.cells[self.base.hosts[self.inside]]


def base_under(
    courses: Sequence[Course], reach: float, detail: float, rest: Array, triangles: IntArray, kept: Base | None = None
) -> Base:
    """The base surface in a mesh: the triangles under the courses, subdivided linearly until they are small enough.

    Sides longer than `detail` are halved; whether one is depends on nothing but its ends, so that neighbours agree.

    Parameters
    ----------
    courses : sequence of Course
    reach : float
        Half the width of the widest part of the tear.
    detail : float
        Edges are at most this long.
    rest : ndarray, shape (n0, 3)
    triangles : ndarray of int32, shape (m0, 3)
    kept : Base, optional
        The last one; what did not change since is taken from it.
    """
    if kept is not None and np.array_equal(kept.of[1], triangles) and np.array_equal(kept.of[0], rest):
        return kept
    way = np.concatenate([paths.resampled(course.points, 0.5 * reach) for course in courses])
    chosen = np.empty(len(triangles), bool)
    kernels.near_course(rest, triangles, way, 0.5 * reach, reach, chosen)
    cells = np.flatnonzero(chosen).astype(np.int32)
    used, local = _numbered(triangles[cells], len(rest))
    of, below = (rest.copy(), triangles.copy()), (rest[used], local)
    if kept is not None and np.array_equal(kept.below[1], below[1]) and np.array_equal(kept.below[0], below[0]):
        return replace(kept, of=of, used=used, cells=cells)  # the mesh has changed elsewhere
    return Base(of, below, used, cells, *_subdivided(courses, reach, detail, *below))


def _subdivided(courses: Sequence[Course], reach: float, detail: float, points: Array, triangles: IntArray) -> Any:
    """What a Base keeps of the subdivision of a mesh."""
    lines, lengths = (np.concatenate([getattr(c, name) for c in courses]) for name in ("points", "lengths"))
    starts = np.cumsum([0, *(len(course.points) for course in courses)])
    mesh = points, vertex_normals(points, triangles)
    n, room = len(points), len(points) + 64 + int(8.0 * reach * lengths.max() * len(courses) / detail**2)
    count = -1
    while count < 0:
        room *= 2
        points, normals, weights = (np.empty((room, 3)) for _ in range(3))
        corners, place, apart = np.empty((room, 3), np.int32), np.empty((len(courses), 2, room)), np.empty(room)
        fine, hosts = np.empty((2 * room, 3), np.int32), np.empty(2 * room, np.int32)
        points[:n], normals[:n] = mesh
        weights[:n], corners[:n] = (1.0, 0.0, 0.0), np.arange(n)[:, None]
        count, m = kernels.subdivide(
            triangles, n, points, normals, corners, weights, lines, lengths, starts, place, apart, detail, reach, fine,
            hosts,
        )  # fmt: skip
    vertices, fine = _numbered(fine[:m], count)
    edges, sides = unique_edges(fine)
    offsets, neighbours = np.zeros(len(vertices) + 1, np.int32), np.empty(edges.size, np.int32)
    kernels.rings(edges, offsets, neighbours)
    single, border = np.bincount(sides.ravel(), minlength=len(edges)) == 1, np.zeros(len(vertices), bool)
    border[edges[single]] = True
    s, w = place[:, 0, vertices], place[:, 1, vertices]
    fields = [course.fields(*at) for course, *at in zip(courses, s, w, strict=True)]
    wobble, noise = (np.array(field) for field in zip(*fields, strict=True))
    return (
        corners[vertices], weights[vertices], fine, hosts[:m].copy(), edges, sides, single, border,
        (offsets, neighbours), s, w, wobble, noise,
    )  # fmt: skip


def _numbered(triangles: IntArray, n: int) -> tuple[IntArray, IntArray]:
    """Which of n vertices triangles use, and the triangles in numbers of these."""
    number = np.zeros(n, np.int32)
    number[triangles] = 1
    used = np.flatnonzero(number).astype(np.int32)
    number[used] = np.arange(len(used), dtype=np.int32)
    return used, number[triangles]
