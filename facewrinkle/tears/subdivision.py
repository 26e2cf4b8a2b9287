"""The surface under a tear, made fine: sides that are too long are halved, and what was found is kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..geometry.normals import vertex_normals
from . import _subdivision_kernels as kernels
from . import path as paths

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


class LocalSubdivision:
    """Subdivides meshes of one surface within reach of polylines on it, linearly, until no side is too long.

    Whether a side is halved depends on nothing but its ends, so that neighbours agree. The mesh of the next frame is
    mostly that of the last, so vertices are kept, with the place on the polylines that was searched for them.

    Parameters
    ----------
    lines : sequence of ndarray, shape (k, 3)
        At rest.
    reach, detail : float
        Triangles with a corner within `reach` are kept; their sides are at most `detail` long.

    Attributes
    ----------
    corners, weights : ndarray, shape (n, 3)
        Barycentric coordinates in the mesh, of all vertices that are kept.
    place : ndarray, shape (c, 2, n)
        Position along each line, and distance to its side, positive on the right looking up.
    """

    def __init__(self, lines: Sequence[Array], reach: float, detail: float) -> None:
        self.reach, self.detail = reach, detail
        self._lines, self._starts = np.concatenate(lines), np.cumsum([0, *(len(line) for line in lines)])
        self._lengths = np.concatenate([paths.lengths(line) for line in lines])
        self._way = np.concatenate([paths.resampled(line, 0.5 * reach) for line in lines])
        self._rest, self._number = np.empty((0, 3)), np.empty(0, np.int32)
        self._clear(256 + int(32.0 * reach * self._lengths.max() * len(lines) / detail**2))

    def _clear(self, room: int) -> None:
        """Forget everything; make room for vertices."""
        self.points, self.normals, self.weights = (np.empty((room, 3)) for _ in range(3))
        self.corners = np.empty((room, 3), np.int32)
        self.place, self._apart = np.empty((len(self._starts) - 1, 2, room)), np.empty(room)
        rows = 1 << (4 * room).bit_length()
        self._halves, self._done = np.full((rows, 3), -1, np.int32), np.full((rows, 5), -1, np.int32)
        self._fine, self._number = np.empty((4 * room, 3), np.int32), self._number[:0]
        self._used = np.zeros(4, np.int64)

    def cells(self, rest: Array, triangles: IntArray) -> IntArray:
        """The triangles of a mesh that may have points within reach."""
        return np.asarray(kernels.near_course(rest, triangles, self._way, 0.5 * self.reach, self.reach))

    def halved(self, rest: Array, triangles: IntArray) -> tuple[IntArray, IntArray, IntArray]:
        """Subdivide triangles (m0, 3) of a mesh.

        Returns
        -------
        vertices : ndarray of int32, shape (n,)
            Those in use, of all that are kept.
        fine, hosts : ndarray of int32, shapes (m, 3) and (m,)
            Triangles of these, and those of the mesh in which they lie.
        """
        normals, used = vertex_normals(rest, triangles), np.unique(triangles)
        while True:
            number = np.full(len(rest), -1, np.int32)
            same = min(kernels.first_change(rest, self._rest), len(self._number))  # the others are numbered anew
            number[:same] = self._number[:same]
            new, first = used[number[used] < 0], int(self._used[0])
            if first + len(new) <= len(self.points):
                at = slice(first, first + len(new))
                number[new] = np.arange(first, at.stop)
                self.points[at], self.normals[at], self.corners[at] = rest[new], normals[new], new[:, None]
                self.weights[at] = 1.0, 0.0, 0.0
                self._rest, self._number, self._used[0] = rest.copy(), number, at.stop
                runs = np.empty((len(triangles), 2), np.int64)
                if kernels.subdivide(
                    triangles, number[triangles], self.points, self.normals, self.corners, self.weights, self.place,
                    self._apart, self._halves, self._done, self._fine, self._used, first, self._lines, self._lengths,
                    self._starts, self.detail, self.reach, runs,
                ):  # fmt: skip
                    vertices, fine, hosts = kernels.joined(self._fine, runs, int(self._used[0]))
                    return vertices, fine, hosts
            self._clear(len(self.points) if first else 2 * len(self.points))  # what is not used any more fills it
