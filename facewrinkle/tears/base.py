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
from ..geometry.topology import as_triangles, unique_edges
from ..geometry.transfer import carried
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
    used : ndarray of int
        The vertices of that part, in the mesh.
    corners, barycentric : ndarray, shape (n, 3)
        Of the base's vertices, in that part.
    triangles : ndarray of int32, shape (m, 3)
    s, w, wobble, noise : ndarray, shape (c, n)
        Position along each course and distance from it, and the wobble and noise there.
    """

    of: tuple[Array, IntArray]
    below: tuple[Array, IntArray]
    used: IntArray
    corners: IntArray
    barycentric: Array
    triangles: IntArray
    edges: IntArray
    sides: IntArray
    rings: tuple[IntArray, IntArray]
    border: npt.NDArray[np.bool_]
    s: Array
    w: Array
    wobble: Array
    noise: Array

    def on(self, values: Array) -> Array:
        """Values (n0, d) of the mesh's vertices, carried to those of the base."""
        return carried(values[self.used], self.corners, self.barycentric)

    def part(self, level: Array) -> Part | None:
        """What is covered: where the linear function `level` (n,) is above 0, as one piece without holes."""
        level = np.where(np.abs(level) < TINY, TINY, level)
        if kernels.make_disk(level, *self.rings, self.border, TINY) == 0:
            return None
        most = len(level) + len(self.edges)
        faces = np.empty((2 * len(self.triangles), 3), np.int32)
        first, second, share = np.empty(most, np.int32), np.empty(most, np.int32), np.empty(most)
        m, n = kernels.clip(self.triangles, self.sides, self.edges, level, faces, first, second, share)
        return Part(faces[:m], first[:n], second[:n], share[:n])


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a base: its triangles (m, 3), and for each vertex the two of the base that it lies between.

    Attributes
    ----------
    triangles : ndarray of int32, shape (m, 3)
    first, second : ndarray of int32, shape (n,)
    share : ndarray, shape (n,)
        0 at the first; vertices of the outline lie in between.
    """

    triangles: IntArray
    first: IntArray
    second: IntArray
    share: Array

    def on(self, values: Array) -> Array:
        """Values of the base's vertices, at those of the part."""
        out = np.empty((len(self.first), values.shape[1]))
        kernels.between(values, self.first, self.second, self.share, out)
        return out


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
    used, local = _numbered(triangles[chosen], len(rest))
    below, of = (rest[used], as_triangles(local)), (rest.copy(), triangles.copy())
    if kept is not None and np.array_equal(kept.below[1], below[1]) and np.array_equal(kept.below[0], below[0]):
        return replace(kept, of=of, used=used)  # the mesh has changed elsewhere
    return Base(of, below, used, *_subdivided(courses, reach, detail, *below))


def _subdivided(courses: Sequence[Course], reach: float, detail: float, points: Array, triangles: IntArray) -> Any:
    """What a Base keeps of the subdivision of a mesh."""
    lines, lengths = (np.concatenate([getattr(c, name) for c in courses]) for name in ("points", "lengths"))
    starts = np.cumsum([0, *(len(c.points) for c in courses)])
    n, room = len(points), len(points) + 64 + int(12.0 * reach * lengths.max() * len(courses) / detail**2)
    arrays = points, vertex_normals(points, triangles), np.repeat(np.arange(n, dtype=np.int32)[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (n, 1))
    count = -1
    while count < 0:
        grown = [np.empty((room, 3), array.dtype) for array in arrays]
        for new, old in zip(grown, arrays, strict=True):
            new[:n] = old
        place, apart, out = np.empty((len(courses), 2, room)), np.empty(room), np.empty((2 * room, 3), np.int32)
        count, m = kernels.subdivide(triangles, n, *grown, lines, lengths, starts, place, apart, detail, reach, out)
        room *= 2
    vertices, fine = _numbered(out[:m], count)
    corners, weights = grown[2][vertices], grown[3][vertices]
    edges, sides = unique_edges(fine)
    offsets, neighbours = np.zeros(len(vertices) + 1, np.int32), np.empty(edges.size, np.int32)
    kernels.rings(edges, offsets, neighbours)
    border = np.zeros(len(vertices), bool)
    border[edges[np.bincount(sides.ravel(), minlength=len(edges)) == 1]] = True
    s, w = np.ascontiguousarray(place[:, :, vertices].swapaxes(0, 1))
    wobble, noise = (np.array(field) for field in zip(*(c.fields(*x) for c, *x in zip(courses, s, w, strict=True)), strict=True))
    return corners, weights, fine, edges, sides, (offsets, neighbours), border, s, w, wobble, noise


def _numbered(triangles: IntArray, n: int) -> tuple[IntArray, IntArray]:
    """Which of n vertices triangles use, and the triangles in numbers of these."""
    number = np.zeros(n, np.int32)
    number[triangles] = 1
    used = np.flatnonzero(number).astype(np.int32)
    number[used] = np.arange(len(used), dtype=np.int32)
    return used, number[triangles]
