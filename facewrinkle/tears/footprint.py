"""The surface under a tear, subdivided, and what of it is covered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..geometry.topology import unique_edges
from . import _kernels as kernels
from . import path as paths
from .subdivision import LocalSubdivision

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

TINY = 1e-6


@dataclass(frozen=True, eq=False)
class StreamPath:
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

    Examples
    --------
    Down a line 16 mm long, with a tenth more width everywhere and no bumps; s and w are known every 0.25 mm:

    >>> line = np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> course = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.full(65, 0.1))
    >>> wobble, noise = course.fields(np.array([4.0]), np.array([0.5]))
    >>> course.lengths, wobble, noise
    (array([ 0., 16.]), array([0.1]), array([0.]))
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

    def fields(self, s: Array, w: Array) -> Array:
        """Wobble and noise (2, n) at positions along the course (n,) and distances to its side (n,)."""
        out = np.empty((2, len(s)))
        kernels.look_up(s / self.spacing, w / self.spacing, self.wobble, self.noise, *out)
        return out


@dataclass(frozen=True, eq=False)
class Footprint:
    """The surface under a tear, subdivided: everything that changes only when the mesh below it does.

    Attributes
    ----------
    rest, mesh : ndarray
        The rest points and triangles of the mesh it was made of.
    cells : ndarray of int32
        The triangles of the mesh below the tear.
    corners, weights : ndarray, shape (n, 3)
        Barycentric coordinates of the base's vertices, in the mesh.
    home : ndarray, shape (n, 3)
        Where they are at rest.
    triangles, hosts : ndarray of int32, shapes (m, 3) and (m,)
        The base's triangles, and those of `cells` in which they lie.
    edges, sides : ndarray of int32, shapes (e, 2) and (m, 3)
        As of :func:`facewrinkle.geometry.topology.unique_edges`.
    single, border : ndarray of bool, shapes (e,) and (n,)
        The edges of one triangle only, and their vertices.
    rings : tuple of ndarray
        Neighbours of the vertices: offsets (n + 1,) and vertices.
    s, w, wobble, noise : ndarray, shape (c, n)
        Position along each course and distance from it, and the wobble and noise there.

    Examples
    --------
    A sheet of two triangles, and what a tear covers of it that has run 8 of 16 mm:

    >>> from facewrinkle.tears.shape import Shape, thickness
    >>> from facewrinkle.tears.subdivision import LocalSubdivision
    >>> rest = np.array([[-10.0, -10, 0], [10, -10, 0], [-10, 10, 0], [10, 10, 0]])
    >>> triangles, line = np.array([[0, 1, 2], [2, 1, 3]], np.int32), np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> course = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> base = footprint_under(LocalSubdivision([line], reach=2.0, detail=0.5), [course], rest, triangles)
    >>> level, height = thickness(base.s[0], base.w[0], 8.0, Shape(1.0, 0.8, 0.5, 0.05))
    >>> covered = base.home[level > 0.0]
    >>> round(float(covered[:, 1].min())), round(float(covered[:, 1].max()))
    (0, 8)
    """

    rest: Array
    mesh: IntArray
    cells: IntArray
    corners: IntArray
    weights: Array
    home: Array
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
        level = level.copy()
        if kernels.make_disk(level, self.triangles, self.edges, *self.rings, self.border, TINY) == 0:
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
    base : Footprint
    triangles : ndarray of int32, shape (m, 3)
    rim : ndarray of int32, shape (b, 2)
        Its outline, as sides of its triangles.
    first, second : ndarray of int32, shape (n,)
    share : ndarray, shape (n,)
        0 at the first; vertices of the outline lie in between.
    inside : ndarray of int32, shape (n,)
        A triangle of the base in which the vertex lies.

    Examples
    --------
    The outline of a disk of radius 1, cut out of a sheet that has risen by 5 mm:

    >>> from facewrinkle.tears.subdivision import LocalSubdivision
    >>> rest = np.array([[-10.0, -10, 0], [10, -10, 0], [-10, 10, 0], [10, 10, 0]])
    >>> triangles, line = np.array([[0, 1, 2], [2, 1, 3]], np.int32), np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> course = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> base = footprint_under(LocalSubdivision([line], reach=2.0, detail=0.5), [course], rest, triangles)
    >>> part = base.part(1.0 - np.linalg.norm(base.home, axis=1))
    >>> bottom, up, home = part.at(rest + [0, 0, 5], np.tile([0.0, 0, 1], (4, 1)))
    >>> round(float(np.linalg.norm(home[part.rim[:, 0]], axis=1).min()), 1), float(bottom[:, 2].max())
    (1.0, 5.0)
    """

    base: Footprint
    triangles: IntArray
    rim: IntArray
    first: IntArray
    second: IntArray
    share: Array
    inside: IntArray

    def at(self, points: Array, normals: Array) -> tuple[Array, Array, Array]:
        """Where its vertices (n, 3) are in a frame of the mesh, their unit normals, and where they are at rest."""
        base, places = self.base, (self.first, self.second, self.share)
        bottom, up, home = np.empty((3, len(self.first), 3))
        kernels.carry(points, normals, base.corners, base.weights, base.home, *places, bottom, up, home)
        return bottom, up, home

    @property
    def under(self) -> IntArray:
        """The triangles (n,) of the mesh that its vertices lie in."""
        return self.base.cells[self.base.hosts[self.inside]]


def footprint_under(
    below: LocalSubdivision,
    courses: Sequence[StreamPath],
    rest: Array,
    triangles: IntArray,
    kept: Footprint | None = None,
) -> Footprint:
    """The base surface in a mesh: the triangles under the courses, subdivided linearly until they are small enough.

    Parameters
    ----------
    below : LocalSubdivision
        Of the same courses.
    courses : sequence of StreamPath
    rest : ndarray, shape (n0, 3)
    triangles : ndarray of int32, shape (m0, 3)
    kept : Footprint, optional
        The last one; if nothing has changed under the courses, it is the next, too.

    Examples
    --------
    Under a tear that runs down a sheet of two triangles; no side is longer than 0.5:

    >>> from facewrinkle.tears.subdivision import LocalSubdivision
    >>> rest = np.array([[-10.0, -10, 0], [10, -10, 0], [-10, 10, 0], [10, 10, 0]])
    >>> triangles, line = np.array([[0, 1, 2], [2, 1, 3]], np.int32), np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> course = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> base = footprint_under(LocalSubdivision([line], reach=2.0, detail=0.5), [course], rest, triangles)
    >>> a, b = base.home[base.edges.T]
    >>> bool(np.linalg.norm(b - a, axis=1).max() <= 0.5), base.cells.tolist()
    (True, [0, 1])
    """
    if kept is not None and np.array_equal(kept.mesh, triangles) and np.array_equal(kept.rest, rest):
        return kept
    mesh, cells = (rest.copy(), triangles.copy()), below.cells(rest, triangles)
    if kept is not None and np.array_equal(kept.mesh[kept.cells], triangles[cells]):
        used = np.unique(triangles[cells])
        if np.array_equal(kept.rest[used], rest[used]):
            return replace(kept, rest=mesh[0], mesh=mesh[1], cells=cells)
    vertices, fine, hosts = below.halved(rest, triangles[cells])
    edges, sides = unique_edges(fine)
    rings, single, border = kernels.connected(edges, sides, len(vertices))
    place = below.place.take(vertices, axis=2)
    wobble, noise = np.array([course.fields(*at) for course, at in zip(courses, place, strict=True)]).swapaxes(0, 1)
    return Footprint(
        *mesh, cells, below.corners.take(vertices, axis=0), below.weights.take(vertices, axis=0),
        below.points.take(vertices, axis=0), fine, hosts, edges, sides, single, border, rings, place[:, 0], place[:, 1],
        wobble, noise,
    )  # fmt: skip
