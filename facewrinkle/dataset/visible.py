"""The triangle that each pixel of a picture shows, and the place on it: exact labels are worked out from that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..array_types import Array, IntArray
from ..geometry import interpolated, rasterize


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera in the convention of OpenCV: x to the right, y down, z away from the camera.

    Attributes
    ----------
    intrinsic : ndarray, shape (3, 3)
        From the camera's coordinates to pixels; the middle of the first pixel, at the upper left, is (.5, .5).
    extrinsic : ndarray, shape (4, 4)
        From the coordinates of the mesh to those of the camera, without a change of unit.
    size : tuple of int
        Width and height, pixels.
    near : float
        What is nearer than this along the z axis is not seen, in the unit of the mesh.
    """

    intrinsic: Array
    extrinsic: Array
    size: tuple[int, int]
    near: float = 0.0

    @classmethod
    def of(cls, camera: pv.Camera, size: tuple[int, int]) -> Self:
        """Return the camera of a plotter.

        Examples
        --------
        >>> plotter = pv.Plotter(off_screen=True, window_size=(40, 20))
        >>> plotter.camera_position = [(0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
        >>> seen, distance = Camera.of(plotter.camera, (40, 20)).project(np.array([[0.0, 0.0, 1.0]]))
        >>> seen.tolist(), distance.tolist()
        ([[20.0, 10.0]], [4.0])
        >>> plotter.close()
        """
        view = pv.array_from_vtkmatrix(camera.GetModelViewTransformMatrix())  # y is up there, and z towards the camera
        extrinsic = np.diag([1.0, -1.0, -1.0, 1.0]) @ view
        width, height = size
        focal = 0.5 * height / np.tan(np.radians(camera.view_angle / 2.0))
        intrinsic = np.array([[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]])
        return cls(intrinsic, extrinsic, size, float(camera.clipping_range[0]))

    @property
    def place(self) -> Array:
        """Where the camera is (3,)."""
        return np.asarray(-self.extrinsic[:3, 3] @ self.extrinsic[:3, :3])

    def local(self, points: Array) -> Array:
        """Return points (n, 3) in the camera's coordinates."""
        return np.asarray(points @ self.extrinsic[:3, :3].T + self.extrinsic[:3, 3])

    def project(self, points: Array) -> tuple[Array, Array]:
        """Return where points (n, 3) are seen, as columns and rows (n, 2), and their distances (n,) along z."""
        local = self.local(points)
        image = local @ self.intrinsic.T
        return image[:, :2] / image[:, 2:], local[:, 2]

    def rays(self, rows: IntArray, columns: IntArray) -> Array:
        """Return the directions (n, 3) in the camera's coordinates, with z = 1, through the middles of pixels."""
        pixels = np.column_stack([columns + 0.5, rows + 0.5, np.ones(len(rows))])
        return np.asarray(pixels @ np.linalg.inv(self.intrinsic).T)


@dataclass(frozen=True, eq=False)
class Hits:
    """Places on a mesh that the pixels of a picture show.

    Attributes
    ----------
    rows, columns : ndarray of int, shape (p,)
        The pixels that show the mesh.
    corners : ndarray of int, shape (p, 3)
        The vertices of the triangle in each of them.
    barycentric : ndarray, shape (p, 3)
        The place on the triangle that the line of sight through the middle of the pixel meets.
    depth : ndarray, shape (p,)
        Distance of that place along the camera's z axis, in the unit of the mesh.
    """

    rows: IntArray
    columns: IntArray
    corners: npt.NDArray[np.int32]
    barycentric: Array
    depth: Array

    def interpolated(self, values: Array) -> Array:
        """Return values of vertices, (n,) or (n, k), at the pixels."""
        columns = np.ascontiguousarray(values, dtype=np.float64).reshape(len(values), -1)
        found = interpolated(columns, self.corners, self.barycentric)
        return found[:, 0] if values.ndim == 1 else found


class TriangleBuffer:
    """The triangle that each pixel of a picture shows, where the line of sight through its middle meets it.

    Nothing of this is left to a graphics driver: labels are the same on all machines.

    Parameters
    ----------
    camera : Camera

    Attributes
    ----------
    numbers : ndarray of int32, shape (h, w)
        The triangle, counted through all meshes; -1 for none.

    Examples
    --------
    >>> eye = np.eye(4)
    >>> eye[2] = [0.0, 0.0, -1.0, 4.0]  # looks along -z, from (0, 0, 4)
    >>> buffer = TriangleBuffer(Camera(np.array([[16.0, 0, 4], [0, 16, 4], [0, 0, 1]]), eye, (8, 8)))
    >>> near = pv.Triangle([[-1.0, -1, 1], [1, -1, 1], [0, 1, 1]])
    >>> far = pv.Plane(i_resolution=1, j_resolution=1, i_size=9, j_size=9).triangulate()
    >>> buffer.draw({"near": near, "far": far})
    >>> np.unique(buffer.numbers).tolist(), np.unique(buffer.part).tolist()
    ([0, 1, 2], [0, 1])
    >>> hits = buffer.hits("near")
    >>> bool(len(hits.rows) == (buffer.part == 0).sum()), set(hits.depth.round(9).tolist())
    (True, {3.0})
    """

    def __init__(self, camera: Camera) -> None:
        width, height = camera.size
        self.camera = camera
        self.numbers = np.full((height, width), -1, np.int32)
        self._inverse = np.zeros((height, width))
        self._meshes: dict[str, tuple[Array, npt.NDArray[np.int32], int]] = {}
        self._count = 0

    def draw(self, meshes: Mapping[str, pv.PolyData]) -> None:
        """Draw meshes, each with another name than all before; they hide what lies behind them."""
        for name, mesh in meshes.items():
            local = self.camera.local(np.asarray(mesh.points, dtype=np.float64))
            corners = np.ascontiguousarray(mesh.regular_faces, dtype=np.int32)
            seen = local[:, 2] > self.camera.near
            nearness = np.divide(1.0, local[:, 2], out=np.full(len(local), -np.inf), where=seen)
            scale, k = np.where(seen, nearness, 0.0), self.camera.intrinsic
            x, y = (k[axis, axis] * local[:, axis] * scale + k[axis, 2] - 0.5 for axis in range(2))  # whole in middles
            # 1 / z is linear in the picture. Triangles that reach beyond the near plane are left out.
            rasterize(x, y, nearness, corners, 0.0, np.inf, self._count, self.numbers, self._inverse)
            self._meshes[name] = local, corners, self._count
            self._count += len(corners)

    @property
    def part(self) -> IntArray:
        """The number (h, w) of the mesh that each pixel shows, in the order in which they were drawn; -1 for none."""
        counts = [len(corners) for _, corners, _ in self._meshes.values()]
        lookup = np.concatenate([np.repeat(np.arange(len(counts)), counts), [-1]])  # the last stands for -1
        return np.asarray(lookup[self.numbers])

    def hits(self, name: str) -> Hits:
        """Return the places on a mesh where it is seen.

        A ray meets the plane of a triangle where its volumes with two corners each tell the weights. A pixel at an edge
        may be given to the triangle beside the one that its ray meets: the place is moved to the edge.
        """
        local, corners, first = self._meshes[name]
        rows, columns = np.nonzero((self.numbers >= first) & (self.numbers < first + len(corners)))
        own, placed = self.numbers[rows, columns] - first, local[corners]
        opposite = np.cross(placed[:, [1, 2, 0]], placed[:, [2, 0, 1]])  # whose products with a ray are the volumes
        weights = np.einsum("pkd,pd->pk", opposite[own], self.camera.rays(rows, columns))
        total = weights.sum(axis=1, keepdims=True)
        weights = np.where(np.abs(total) < 1e-300, 1.0, np.maximum(weights * np.sign(total), 0.0))
        weights /= weights.sum(axis=1, keepdims=True)
        return Hits(rows, columns, corners[own], weights, (weights * placed[own, :, 2]).sum(axis=1))
