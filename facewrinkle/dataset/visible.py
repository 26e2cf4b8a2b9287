"""The triangle that each pixel of a picture shows, and the place on it: exact labels are worked out from that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt
import pyvista as pv
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from ..geometry.interpolation import interpolated
from ..mesh.arrays import of_own_arrays, points_and_triangles
from ..plotting.window import rendered
from . import _pixel_kernels as kernels

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


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
    """

    intrinsic: Array
    extrinsic: Array
    size: tuple[int, int]

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
        position = np.array(camera.position)
        away = np.array(camera.focal_point) - position
        away /= np.linalg.norm(away)
        right = np.cross(away, camera.up)
        right /= np.linalg.norm(right)
        turn = np.stack([right, np.cross(away, right), away])
        extrinsic = np.eye(4)
        extrinsic[:3, :3], extrinsic[:3, 3] = turn, -turn @ position
        width, height = size
        focal = 0.5 * height / np.tan(np.radians(camera.view_angle / 2.0))
        return cls(np.array([[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]]), extrinsic, size)

    def project(self, points: Array) -> tuple[Array, Array]:
        """Return where points (n, 3) are seen, as columns and rows (n, 2), and their distances (n,) along z."""
        local = points @ self.extrinsic[:3, :3].T + self.extrinsic[:3, 3]
        image = local @ self.intrinsic.T
        return image[:, :2] / image[:, 2:], local[:, 2]

    def rays(self, rows: IntArray, columns: IntArray) -> Array:
        """Return the directions (n, 3) in the camera's coordinates, with z = 1, through the middles of pixels."""
        pixels = np.column_stack([columns + 0.5, rows + 0.5, np.ones(len(rows))])
        return np.asarray(pixels @ np.linalg.inv(self.intrinsic).T)


@dataclass(frozen=True, eq=False)
class Hits:
    """Places that the pixels of a picture show.

    Attributes
    ----------
    part : ndarray of int, shape (h, w)
        Number of the mesh that a pixel shows, -1 for none.
    rows, columns : ndarray of int, shape (p,)
        The pixels that show the mesh that labels are about.
    corners : ndarray of int, shape (p, 3)
        The vertices of the triangle in each of them.
    barycentric : ndarray, shape (p, 3)
        The place on the triangle that the line of sight through the middle of the pixel meets.
    depth : ndarray, shape (p,)
        Distance of that place along the camera's z axis, in the unit of the mesh.
    """

    part: IntArray
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
    """Draws triangles in colours that number them, without light and anti-aliasing.

    Parameters
    ----------
    size : tuple of int
        Width and height, pixels.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="none")
        self._plotter.disable_anti_aliasing()
        self._plotter.renderer.set_background("black")

    def close(self) -> None:
        """Free the window."""
        self._plotter.close()

    def drawn(self, meshes: Mapping[str, pv.PolyData], camera: pv.Camera) -> IntArray:
        """Return the number of the triangle that each pixel shows, counted through all meshes; -1 for none.

        Examples
        --------
        >>> buffer, camera = TriangleBuffer((8, 8)), pv.Camera()
        >>> camera.position, camera.focal_point, camera.view_angle = (0.0, 0.0, 4.0), (0.0, 0.0, 0.0), 20.0
        >>> near = pv.Triangle([[-1.0, -1, 1], [1, -1, 1], [0, 1, 1]])
        >>> far = pv.Plane(i_resolution=1, j_resolution=1, i_size=9, j_size=9).triangulate()
        >>> np.unique(buffer.drawn({"near": near, "far": far}, camera)).tolist()
        [0, 1, 2]
        >>> buffer.close()
        """
        arrays = [points_and_triangles(mesh) for mesh in meshes.values()]
        starts = np.cumsum([0, *(len(points) for points, _ in arrays)])
        points = np.concatenate([np.asarray(points, dtype=np.float64) for points, _ in arrays])
        triangles = np.concatenate([t + start for (_, t), start in zip(arrays, starts, strict=False)])
        number = np.arange(1, len(triangles) + 1)
        colours = np.stack([number >> 16, number >> 8, number], axis=1).astype(np.uint8)
        mesh = of_own_arrays(points, np.ascontiguousarray(triangles, dtype=np.int64), {})
        mesh.cell_data["number"] = colours
        actor = self._actor(mesh)
        self._plotter.renderer.AddActor(actor)
        self._plotter.camera = camera
        pixels = rendered(self._plotter).astype(np.int64)
        self._plotter.renderer.RemoveActor(actor)
        return np.asarray((pixels[..., 0] << 16 | pixels[..., 1] << 8 | pixels[..., 2]) - 1)

    def _actor(self, mesh: pv.PolyData) -> Any:
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(mesh)
        mapper.SetScalarModeToUseCellFieldData()
        mapper.SelectColorArray("number")
        mapper.SetColorModeToDirectScalars()
        actor = vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().SetInterpolationToFlat()
        actor.GetProperty().LightingOff()
        return actor


def parts_of(numbers: IntArray, meshes: Mapping[str, pv.PolyData]) -> IntArray:
    """Return the number of the mesh of each triangle, by the numbers of triangles; -1 for none.

    Examples
    --------
    >>> two = pv.Plane(i_resolution=1, j_resolution=1).triangulate()
    >>> parts_of(np.array([-1, 0, 1, 2]), {"near": pv.Triangle(), "far": two})
    array([-1,  0,  1,  1])
    """
    counts = [mesh.n_cells for mesh in meshes.values()]
    lookup = np.concatenate([np.repeat(np.arange(len(counts)), counts), [-1]])  # the last stands for -1
    return np.asarray(lookup[numbers])


def hits_of(numbers: IntArray, meshes: Mapping[str, pv.PolyData], about: str, camera: Camera) -> Hits:
    """Return what pixels show, from the numbers of their triangles: exact on the mesh that labels are `about`."""
    counts = np.cumsum([0, *(mesh.n_cells for mesh in meshes.values())])
    part = parts_of(numbers, meshes)
    which = list(meshes).index(about)
    rows, columns = np.nonzero(part == which)
    points, triangles = points_and_triangles(meshes[about])
    corners = np.asarray(triangles, dtype=np.int32)[numbers[rows, columns] - counts[which]]
    local = np.asarray(points, dtype=np.float64) @ camera.extrinsic[:3, :3].T + camera.extrinsic[:3, 3]
    weights, depth = np.empty((len(rows), 3)), np.empty(len(rows))
    kernels.meet(local, corners, camera.rays(rows, columns), weights, depth)
    return Hits(part, rows, columns, corners, weights, depth)
