"""Meshes as they are drawn: only what a picture needs of them, and only if it is not what was drawn before."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from vtkmodules.util.numpy_support import vtk_to_numpy

Array = npt.NDArray[np.float64]


class FrontFirst:
    """Orders triangles so that those in front come first: what they hide is not shaded then.

    The order is made once for a mesh, by its shape at rest; if the face turns, it is only less of a help.

    Examples
    --------
    >>> ball = pv.Sphere()
    >>> ordered = FrontFirst().applied(ball, np.array([0.0, 0.0, 9.0]))
    >>> ordered.n_cells == ball.n_cells, bool(ordered.cell_centers().points[:100, 2].min() > 0.0)
    (True, True)
    """

    def __init__(self) -> None:
        self._triangles = np.empty((0, 3), np.int64)
        self._ordered = pv.PolyData()

    def applied(self, mesh: pv.PolyData, viewpoint: Array) -> pv.PolyData:
        """Return the mesh with its triangles in order, seen from a viewpoint; its arrays are the same, not copies."""
        triangles = np.asarray(mesh.regular_faces)
        if not np.array_equal(triangles, self._triangles):
            points = np.asarray(mesh.point_data.get("rest", mesh.points), dtype=np.float64)
            a, b, c = (points[triangles[:, k]] for k in range(3))
            hidden = (np.cross(b - a, c - a) * (viewpoint - a)).sum(axis=1) <= 0.0
            order = np.argsort(hidden, kind="stable")
            self._triangles = triangles.copy()
            self._ordered = pv.PolyData.from_regular_faces(np.empty((0, 3)), triangles[order])
        drawn = pv.PolyData()
        drawn.SetPoints(mesh.GetPoints())
        drawn.SetPolys(self._ordered.GetPolys())  # the very same: they are not sent again
        drawn.GetPointData().ShallowCopy(mesh.GetPointData())
        return drawn


def same(first: pv.PolyData, second: pv.PolyData) -> bool:
    """Return True if two meshes look the same: points, triangles and point data.

    Examples
    --------
    >>> same(pv.Sphere(), pv.Sphere()), same(pv.Sphere(), pv.Sphere(radius=0.6))
    (True, False)
    """
    if first.GetNumberOfPoints() != second.GetNumberOfPoints() or first.GetNumberOfCells() != second.GetNumberOfCells():
        return False
    if not np.array_equal(_values(first.GetPoints().GetData()), _values(second.GetPoints().GetData())):
        return False
    one, other = first.GetPointData(), second.GetPointData()
    if one.GetNumberOfArrays() != other.GetNumberOfArrays():
        return False
    arrays = [(one.GetArray(k), other.GetArray(one.GetArrayName(k))) for k in range(one.GetNumberOfArrays())]
    return all(b is not None and np.array_equal(_values(a), _values(b)) for a, b in arrays)


def _values(array: Any) -> npt.NDArray[Any]:
    return np.asarray(vtk_to_numpy(array))
