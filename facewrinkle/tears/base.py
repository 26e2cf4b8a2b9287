"""The surface under a tear, subdivided, and what of it is covered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.ndimage import map_coordinates

from ..geometry.normals import vertex_normals
from ..geometry.refinement import RedGreenForest
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

    def fields(self, points: Array, normals: Array) -> tuple[Array, Array, Array, Array]:
        """Position along the course, distance from it, wobble and noise, at points (n, 3) with normals (n, 3)."""
        s, w = np.empty(len(points)), np.empty(len(points))
        kernels.along_course(points, self.points, self.lengths, normals, s, w)
        place = s / self.spacing
        wobble = np.interp(place, np.arange(len(self.wobble)), self.wobble)
        across = w / self.spacing + self.noise.shape[1] // 2
        return s, w, wobble, map_coordinates(self.noise, [place, across], order=1, mode="nearest")


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
    centres, radii : ndarray, shapes (k, 3) and (k,)
        Of the mesh's triangles, at rest.
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
    centres: Array
    radii: Array
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
    courses: Sequence[Course], half: float, detail: float, rest: Array, triangles: IntArray, kept: Base | None = None
) -> Base:
    """The base surface in a mesh: the triangles under the courses, subdivided linearly until they are small enough.

    Parameters
    ----------
    courses : sequence of Course
    half : float
        Half the width of the tear.
    detail : float
        Edges are at most this long.
    rest : ndarray, shape (n0, 3)
    triangles : ndarray of int32, shape (m0, 3)
    kept : Base, optional
        The last one; what did not change since is taken from it.
    """
    if kept is not None and np.array_equal(kept.of[1], triangles) and np.array_equal(kept.of[0], rest):
        return kept
    spacing, reach = 0.5 * half, half + 0.5 * detail
    way = np.concatenate([paths.resampled(course.points, spacing) for course in courses])

    def near(points: Array, triangles: IntArray) -> tuple[npt.NDArray[np.bool_], Array]:
        chosen, longest = np.empty(len(triangles), bool), np.empty(len(triangles))
        kernels.near_course(points, triangles, way, spacing, reach, chosen, longest)
        return chosen, longest

    chosen, _ = near(rest, triangles)
    used, local = _numbered(triangles[chosen], len(rest))
    below, of = (rest[used], as_triangles(local)), (rest.copy(), triangles.copy())
    centres, radii = np.empty((len(triangles), 3)), np.empty(len(triangles))
    kernels.spheres(rest, triangles, centres, radii)
    if kept is not None and np.array_equal(kept.below[1], below[1]) and np.array_equal(kept.below[0], below[0]):
        return replace(kept, of=of, used=used, centres=centres, radii=radii)  # the mesh has changed elsewhere
    forest = RedGreenForest(below[1], 8)
    inside, longest = near(below[0], forest.triangles)
    while (marked := inside & (longest > detail)).any() and forest.split(marked):
        inside, longest = near(carried(below[0], forest.corners, forest.barycentric), forest.triangles)
    vertices, fine = _numbered(forest.triangles[inside], forest.n_points)
    corners, weights = forest.corners[vertices], forest.barycentric[vertices]
    edges, sides = unique_edges(fine)
    offsets, neighbours = np.zeros(len(vertices) + 1, np.int32), np.empty(edges.size, np.int32)
    kernels.rings(edges, offsets, neighbours)
    border = np.zeros(len(vertices), bool)
    border[edges[np.bincount(sides.ravel(), minlength=len(edges)) == 1]] = True
    points, normals = carried(below[0], corners, weights), vertex_normals(*below)[corners].sum(axis=1)
    s, w, wobble, noise = (np.array(field) for field in zip(*(c.fields(points, normals) for c in courses), strict=True))
    return Base(
        of, below, used, corners, weights, fine, edges, sides, (offsets, neighbours), border, centres, radii,
        s, w, wobble, noise,
    )  # fmt: skip


def _numbered(triangles: IntArray, n: int) -> tuple[IntArray, IntArray]:
    """Which of n vertices triangles use, and the triangles in numbers of these."""
    number = np.zeros(n, np.int32)
    number[triangles] = 1
    used = np.flatnonzero(number).astype(np.int32)
    number[used] = np.arange(len(used), dtype=np.int32)
    return used, number[triangles]
