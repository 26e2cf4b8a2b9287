"""The footprint of a tear: the surface under it, subdivided, and the part of it that water covers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..array_types import Array, BoolArray, IntArray
from ..geometry.topology import unique_edges
from . import _kernels as kernels
from .stream_path import StreamPath
from .subdivision import LocalSubdivision

LEAST_LEVEL = 1e-6
"""The least absolute level of a vertex; the outline of the tear is where the level is 0."""


@dataclass(frozen=True, eq=False)
class Footprint:
    """The surface under a tear, subdivided: all that changes only with the triangles of the surface.

    Attributes
    ----------
    mesh_rest, mesh_triangles : ndarray
        Points at rest and triangles of the mesh of which it was made.
    cells : ndarray of int32
        The triangles of the mesh under the tear.
    corners, weights : ndarray, shape (n, 3)
        Barycentric coordinates of the vertices: three vertices of the mesh, and their weights.
    rest : ndarray, shape (n, 3)
        Its vertices at rest.
    triangles, hosts : ndarray of int32, shapes (m, 3) and (m,)
        Its triangles, and those of `cells` in which they lie.
    edges, sides : ndarray of int32, shapes (e, 2) and (m, 3)
        As of :func:`facewrinkle.geometry.topology.unique_edges`.
    border_edges, border : ndarray of bool, shapes (e,) and (n,)
        True for edges of one triangle only, and for their vertices.
    neighbours : tuple of ndarray
        Neighbours of the vertices: offsets (n + 1,) and vertices.
    s, w, wobble, noise : ndarray, shape (c, n)
        Position along each path and distance from it, and the wobble and noise there.

    Examples
    --------
    A sheet of two triangles; a tear that has run 8 of 16 mm covers its vertices from y = 0 to y = 8:

    >>> from facewrinkle.tears.shape import Shape, thickness
    >>> from facewrinkle.tears.subdivision import LocalSubdivision
    >>> rest = np.array([[-10.0, -10, 0], [10, -10, 0], [-10, 10, 0], [10, 10, 0]])
    >>> triangles, line = np.array([[0, 1, 2], [2, 1, 3]], np.int32), np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> path = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> footprint = footprint_under(LocalSubdivision([line], reach=2.0, detail=0.5), [path], rest, triangles)
    >>> level, height = thickness(footprint.s[0], footprint.w[0], 8.0, Shape(1.0, 0.8, 0.5, 0.05))
    >>> covered = footprint.rest[level > 0.0]
    >>> round(float(covered[:, 1].min())), round(float(covered[:, 1].max()))
    (0, 8)
    """

    mesh_rest: Array
    mesh_triangles: IntArray
    cells: IntArray
    corners: IntArray
    weights: Array
    rest: Array
    triangles: IntArray
    hosts: IntArray
    edges: IntArray
    sides: IntArray
    border_edges: BoolArray
    border: BoolArray
    neighbours: tuple[IntArray, IntArray]
    s: Array
    w: Array
    wobble: Array
    noise: Array

    def part(self, level: Array) -> Part | None:
        """Return the part where the linear function `level` (n,) is above 0, as one piece without holes."""
        level = level.copy()
        if kernels.make_disk(level, self.triangles, self.edges, self.neighbours, self.border, LEAST_LEVEL) == 0:
            return None
        room = len(level) + len(self.edges)
        triangles, rim = np.empty((2 * len(self.triangles), 3), np.int32), np.empty((len(self.edges), 2), np.int32)
        first, second, inside, share = *(np.empty(room, np.int32) for _ in range(3)), np.empty(room)
        m, b, n = kernels.clip(
            self.triangles, self.sides, self.edges, self.border_edges, level, triangles, rim,
            (first, second, share, inside),
        )  # fmt: skip
        return Part(self, triangles[:m], rim[:b], first[:n], second[:n], share[:n], inside[:n])


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a footprint; each of its vertices lies between two of the footprint.

    Attributes
    ----------
    footprint : Footprint
    triangles : ndarray of int32, shape (m, 3)
    rim : ndarray of int32, shape (b, 2)
        Its outline, as sides of its triangles.
    first, second : ndarray of int32, shape (n,)
        Vertices of the footprint between which each vertex lies.
    share : ndarray, shape (n,)
        Its share of the way from the first: 0 but for vertices of the outline.
    inside : ndarray of int32, shape (n,)
        A triangle of the footprint in which the vertex lies.

    Examples
    --------
    The outline of a disk of radius 1, cut out of a sheet that has risen by 5 mm:

    >>> from facewrinkle.tears.subdivision import LocalSubdivision
    >>> rest = np.array([[-10.0, -10, 0], [10, -10, 0], [-10, 10, 0], [10, 10, 0]])
    >>> triangles, line = np.array([[0, 1, 2], [2, 1, 3]], np.int32), np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> path = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> footprint = footprint_under(LocalSubdivision([line], reach=2.0, detail=0.5), [path], rest, triangles)
    >>> part = footprint.part(1.0 - np.linalg.norm(footprint.rest, axis=1))
    >>> points, normals, at_rest = part.at(rest + [0, 0, 5], np.tile([0.0, 0, 1], (4, 1)))
    >>> round(float(np.linalg.norm(at_rest[part.rim[:, 0]], axis=1).min()), 1), float(points[:, 2].max())
    (1.0, 5.0)
    """

    footprint: Footprint
    triangles: IntArray
    rim: IntArray
    first: IntArray
    second: IntArray
    share: Array
    inside: IntArray

    def at(self, points: Array, normals: Array) -> tuple[Array, Array, Array]:
        """Return its vertices (n, 3) in a frame of the mesh, their unit normals, and the vertices at rest."""
        footprint, between = self.footprint, (self.first, self.second, self.share)
        found = np.empty((3, len(self.first), 3))
        kernels.interpolate(points, normals, footprint.corners, footprint.weights, footprint.rest, between, *found)
        return found[0], found[1], found[2]

    @property
    def under(self) -> IntArray:
        """The triangles (n,) of the mesh in which its vertices lie."""
        return self.footprint.cells[self.footprint.hosts[self.inside]]


def footprint_under(
    subdivision: LocalSubdivision,
    paths: Sequence[StreamPath],
    rest: Array,
    triangles: IntArray,
    last: Footprint | None = None,
) -> Footprint:
    """Return the footprint in a mesh: the triangles under the paths, subdivided until they are small enough.

    Parameters
    ----------
    subdivision : LocalSubdivision
        Of the same paths.
    paths : sequence of StreamPath
    rest : ndarray, shape (n0, 3)
    triangles : ndarray of int32, shape (m0, 3)
    last : Footprint, optional
        The footprint of the last frame; if nothing has changed under the paths, it is used again.

    Examples
    --------
    Under a tear that runs down a sheet of two triangles; no side is longer than 0.5:

    >>> from facewrinkle.tears.subdivision import LocalSubdivision
    >>> rest = np.array([[-10.0, -10, 0], [10, -10, 0], [-10, 10, 0], [10, 10, 0]])
    >>> triangles, line = np.array([[0, 1, 2], [2, 1, 3]], np.int32), np.array([[0.0, 8, 0], [0, -8, 0]])
    >>> path = StreamPath(line, 0.0, 1.0, np.zeros((65, 9)), 0.25, np.zeros(65))
    >>> footprint = footprint_under(LocalSubdivision([line], reach=2.0, detail=0.5), [path], rest, triangles)
    >>> a, b = footprint.rest[footprint.edges.T]
    >>> bool(np.linalg.norm(b - a, axis=1).max() <= 0.5), footprint.cells.tolist()
    (True, [0, 1])
    """
    if last is not None and np.array_equal(last.mesh_triangles, triangles) and np.array_equal(last.mesh_rest, rest):
        return last
    mesh, cells = (rest.copy(), triangles.copy()), subdivision.near(rest, triangles)
    if last is not None and np.array_equal(last.mesh_triangles[last.cells], triangles[cells]):
        used = np.unique(triangles[cells])
        if np.array_equal(last.mesh_rest[used], rest[used]):
            return replace(last, mesh_rest=mesh[0], mesh_triangles=mesh[1], cells=cells)
    used, parts, hosts = subdivision.subdivided(rest, triangles[cells])
    edges, sides = unique_edges(parts)
    neighbours, border_edges, border = kernels.adjacency(edges, sides, len(used))
    kept = subdivision.vertices
    points, corners, weights = (values.take(used, axis=0) for values in (kept.points, kept.corners, kept.weights))
    coordinates = kept.coordinates.take(used, axis=2)
    wobble, noise = np.array([path.fields(*sw) for path, sw in zip(paths, coordinates, strict=True)]).swapaxes(0, 1)
    return Footprint(
        *mesh, cells, corners, weights, points, parts, hosts, edges, sides, border_edges, border, neighbours,
        coordinates[:, 0], coordinates[:, 1], wobble, noise,
    )  # fmt: skip
