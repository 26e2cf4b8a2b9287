"""The flesh between lids and eyeballs, where the skin of a face ends at the lids."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.eyeball import Eyeball
from ..anatomy.eyelid_opening import lid_rim
from ..anatomy.face import Face
from ..geometry.normals import vertex_normals
from ..geometry.rings import ring_triangles
from ..mesh import to_polydata
from .skin_paint import flesh

Array = npt.NDArray[np.float64]

WITHIN = 0.96
"""Where the flesh ends, in radii of the ball: in it."""

FILLED = 1.05
"""Where no part of the rim is farther from the centre, in radii, the ball fills the hole."""

ROWS = np.linspace(0.0, 1.0, 5)
"""Of vertices, from the rim (0) to where the flesh ends."""


class LidMargin:
    """A strip from the rim of the hole that a skin has before an eye, to the ball: without it one looks past the ball
    into the dark where the lids do not touch it, in the corners above all.

    Parameters
    ----------
    eye : Eyeball
    face : Face

    Attributes
    ----------
    loop : ndarray of int
        Vertices of the rim in order; none where the skin goes on behind the lids, or the ball fills the hole.
    """

    def __init__(self, eye: Eyeball, face: Face) -> None:
        self.eye = eye
        loop = lid_rim(eye, face.points, face.triangles)
        reach = 0.0 if loop is None else float(np.linalg.norm(face.points[loop] - eye.centre, axis=1).max())
        self.loop = np.empty(0, np.int32) if loop is None or reach <= FILLED * eye.radius else loop
        n = len(self.loop)
        self._triangles = ring_triangles(n, len(ROWS))[:, [0, 2, 1]]
        self._paint = np.rint(flesh(np.repeat(ROWS, n))).astype(np.uint8)

    def at(self, points: Array) -> pv.PolyData:
        """The strip, with `paint` (rgb), at lids whose vertices are where they are now (n, 3)."""
        offset = points[self.loop] - self.eye.centre
        distance = np.linalg.norm(offset, axis=1, keepdims=True)
        end = np.minimum(WITHIN * self.eye.radius, distance - 0.02 * self.eye.radius)
        away = distance + ROWS[:, None, None] * (end - distance)
        strip = (self.eye.centre + away * (offset / distance)).reshape(-1, 3)
        mesh = to_polydata(strip, self._triangles)
        mesh.point_data["Normals"] = vertex_normals(strip, self._triangles)
        mesh.point_data["paint"] = self._paint
        return mesh
