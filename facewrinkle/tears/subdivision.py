"""The surface under a tear, subdivided until its sides are short; vertices are kept for the next frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..array_types import Array, IntArray
from ..geometry.normals import vertex_normals
from . import _subdivision_kernels as kernels
from . import path as paths


class LocalSubdivision:
    """Subdivides meshes of one surface within reach of polylines on it, linearly, until no side is too long.

    Only its ends decide if a side is halved, so that neighbours agree. The mesh of the next frame is mostly that of the
    last, so vertices are kept, with their coordinates along the polylines, which are slow to find.

    Parameters
    ----------
    lines : sequence of ndarray, shape (k, 3)
        At rest.
    reach, detail : float
        Triangles with a corner within `reach` are kept; their sides are at most `detail` long.

    Attributes
    ----------
    vertices : tuple of ndarray
        All vertices that are kept: `points` (n, 3) at rest, the `corners` (n, 3) and `weights` (n, 3) of their
        barycentric coordinates in the mesh, and `coordinates` (c, 2, n): position along each line, and distance to its
        side, positive on the right looking up.
    """

    def __init__(self, lines: Sequence[Array], reach: float, detail: float) -> None:
        self.reach, self.detail = reach, detail
        lengths = np.concatenate([paths.lengths(line) for line in lines])
        starts = np.cumsum([0, *(len(line) for line in lines)])
        self._lines = kernels.Polylines(np.concatenate(lines), lengths, starts)
        self._sparse = np.concatenate([paths.resampled(line, 0.5 * reach) for line in lines])
        self._mesh_rest, self._number = np.empty((0, 3)), np.empty(0, np.int32)
        self._clear(256 + int(32.0 * reach * lengths.max() * len(lines) / detail**2))

    def _clear(self, room: int) -> None:
        """Forget everything; make room for vertices."""
        points, normals, weights = (np.empty((room, 3)) for _ in range(3))
        coordinates = np.empty((len(self._lines.starts) - 1, 2, room))
        corners = np.empty((room, 3), np.int32)
        self.vertices = kernels.Vertices(points, normals, corners, weights, coordinates, np.empty(room))
        rows = 1 << (4 * room).bit_length()
        middles, done = np.full((rows, 3), -1, np.int32), np.full((rows, 5), -1, np.int32)
        self._tables = kernels.Tables(middles, done, np.empty((4 * room, 3), np.int32), np.zeros(4, np.int64))
        self._number = self._number[:0]

    def near(self, rest: Array, triangles: IntArray) -> IntArray:
        """Return the triangles of a mesh that may have points within reach."""
        return np.asarray(kernels.near_path(rest, triangles, self._sparse, 0.5 * self.reach, self.reach))

    def subdivided(self, rest: Array, triangles: IntArray) -> tuple[IntArray, IntArray, IntArray]:
        """Subdivide triangles (m0, 3) of a mesh.

        Returns
        -------
        used : ndarray of int32, shape (n,)
            Those of the vertices kept that are in use.
        parts, hosts : ndarray of int32, shapes (m, 3) and (m,)
            Triangles of these, and those of the mesh in which they lie.
        """
        normals, of_mesh = vertex_normals(rest, triangles), np.unique(triangles)
        while True:
            first = int(self._tables.used[0])
            if self._add(rest, normals, of_mesh):
                runs = np.empty((len(triangles), 2), np.int64)
                if kernels.subdivide(
                    triangles, self._number[triangles], self.vertices, self._tables, first, self._lines, self.detail,
                    self.reach, runs,
                ):  # fmt: skip
                    used, parts, hosts = kernels.collect(self._tables.parts, runs, int(self._tables.used[0]))
                    return used, parts, hosts
            room = len(self.vertices.points)
            self._clear(room if first else 2 * room)  # full of what is not used any more, or too small

    def _add(self, rest: Array, normals: Array, of_mesh: IntArray) -> bool:
        """Number the vertices of a mesh that are in use; return True if there was room for the new ones."""
        number = np.full(len(rest), -1, np.int32)
        same = min(kernels.first_change(rest, self._mesh_rest), len(self._number))  # the others are numbered anew
        number[:same] = self._number[:same]
        new, first = of_mesh[number[of_mesh] < 0], int(self._tables.used[0])
        if first + len(new) > len(self.vertices.points):
            return False
        at = slice(first, first + len(new))
        number[new] = np.arange(first, at.stop)
        points, kept_normals, corners, weights, *_ = self.vertices
        points[at], kept_normals[at], corners[at], weights[at] = rest[new], normals[new], new[:, None], (1.0, 0.0, 0.0)
        self._mesh_rest, self._number, self._tables.used[0] = rest.copy(), number, at.stop
        return True
