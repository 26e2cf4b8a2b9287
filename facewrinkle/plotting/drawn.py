"""Meshes as they are drawn: only what a picture needs of them, and only if it is not what was drawn before."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray


class Joined:
    """Meshes of one look as one: each that is drawn by itself costs a millisecond more, however small it is.

    What did not change since the last time is not sent again: points, triangles, normals and paint each for itself.

    Examples
    --------
    >>> both, ball = Joined(), pv.Sphere().compute_normals(split_vertices=False)
    >>> ball["paint"] = np.zeros((ball.n_points, 3), np.uint8)
    >>> both.show([ball, ball.translate((2.0, 0.0, 0.0))])
    >>> both.mesh.n_cells == 2 * ball.n_cells, both.mesh.active_scalars_name
    (True, 'paint')
    """

    ARRAYS = ("Normals", "paint")

    def __init__(self) -> None:
        self.mesh = pv.PolyData()
        self.mesh.SetPolys(vtkCellArray())
        self._values: dict[str, npt.NDArray[Any]] = {}
        self._cells: list[vtkCellArray] = []

    def show(self, parts: Sequence[pv.PolyData]) -> None:
        """Replace the content by meshes that have the same arrays, and cells with the same number of corners."""
        mesh = self.mesh
        if self._changed("points", [_values(part.GetPoints().GetData()) for part in parts]):
            mesh.SetPoints(_points(self._values["points"]))
        cells = [part.GetPolys() for part in parts]
        if list(map(id, cells)) != list(map(id, self._cells)):
            self._cells = cells
            starts = np.cumsum([0, *(part.GetNumberOfPoints() for part in parts[:-1])])
            corners = [_values(one.GetConnectivityArray()) + start for one, start in zip(cells, starts, strict=True)]
            if self._changed("corners", corners):
                polys = vtkCellArray()
                polys.SetData(cells[0].IsHomogeneous(), numpy_to_vtk(self._values["corners"]))
                mesh.SetPolys(polys)
        data = mesh.GetPointData()
        for name in self.ARRAYS:
            arrays = [part.GetPointData().GetArray(name) for part in parts]
            if all(array is not None for array in arrays) and self._changed(name, [_values(a) for a in arrays]):
                array = numpy_to_vtk(self._values[name])
                array.SetName(name)
                data.AddArray(array)
        data.SetActiveNormals("Normals" if data.HasArray("Normals") else None)
        data.SetActiveScalars("paint")

    def _changed(self, name: str, pieces: list[npt.NDArray[Any]]) -> bool:
        values = np.concatenate(pieces)  # a copy: a part may change in place
        if name in self._values and np.array_equal(values, self._values[name]):
            return False
        self._values[name] = values
        return True


def _points(values: npt.NDArray[Any]) -> vtkPoints:
    points = vtkPoints()
    points.SetData(numpy_to_vtk(values))
    return points


def _values(array: Any) -> npt.NDArray[Any]:
    return np.asarray(vtk_to_numpy(array))
