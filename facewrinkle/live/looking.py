"""Looking at a frame, or at any other surface, as it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyvista as pv

from ..errors import MeshError
from ..geometry.normals import vertex_normals
from ..layers.base import Layer
from .document import Document
from .library import Library
from .stage import Stage
from .visible_parts import VisibleParts


def to_look_at(surface: pv.PolyData) -> pv.PolyData:
    """Return the triangles of a surface, with normals and all of its fields: a copy.

    Raises
    ------
    MeshError
        If it has no triangles.
    """
    frame = surface.copy() if surface.is_all_triangles else surface.triangulate()
    if not frame.n_cells or not frame.is_all_triangles:
        raise MeshError("the surface has no triangles to look at.")
    if "Normals" not in frame.point_data:
        points = np.asarray(frame.points, np.float64)
        frame.point_data["Normals"] = vertex_normals(points, np.asarray(frame.regular_faces))
    return frame


class Look(Stage):
    """A stage on which one frame stands still.

    Parameters
    ----------
    frame : PolyData
        Triangles with normals, see :func:`to_look_at`.
    library, document :
        See :class:`~facewrinkle.live.stage.Stage`.
    """

    time_step = 0.02
    looks = True

    @property
    def layers(self) -> Sequence[Layer]:
        """None: it is not known what made the folds."""
        return ()

    def __init__(self, frame: pv.PolyData, library: Library, document: Document) -> None:
        super().__init__(library, document)
        self._frame = frame

    def _apply(self, data: Mapping[str, Any], version: int) -> None:
        if not self._applied:
            self._parts = VisibleParts(self.face)
            self.photos = 1, self._parts.photos()
        self._seen, self._applied = version, dict(data)

    def _next(self, data: Mapping[str, Any], live: Mapping[str, float]) -> tuple[pv.PolyData, bool]:
        return self._frame, True
