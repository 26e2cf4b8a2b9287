"""Flesh between lids and eyeballs, where the skin of a face ends at the margins of the lids."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from ..anatomy.eyeball import Eyeball
from ..anatomy.face import Face
from ..array_types import Array, IntArray
from ..geometry.normals import vertex_normals
from ..geometry.rings import ring_triangles
from ..mesh import to_polydata
from .skin_paint import flesh

END = 0.96
"""Distance from the centre of the ball, in its radii, at which the flesh ends inside the ball."""

FILLED = 1.05
"""A ball fills the hole before it if no vertex of the rim is farther from the ball's centre than this, in radii."""

DEPTHS = np.linspace(0.0, 1.0, 5)
"""Depths of the rings of vertices, from the rim (0) to the end (1)."""


class LidMargin:
    """A strip of flesh that leads from the rim of the hole before an eye into the ball.

    Without it, one would look into the dark wherever the lids do not touch the ball, above all in the corners.

    Parameters
    ----------
    eye : Eyeball
    face : Face

    Attributes
    ----------
    loop : ndarray of int
        Vertices of the rim in order; empty where the skin goes on behind the lids, or the ball fills the hole.

    Examples
    --------
    The balls of the built-in face fill their holes; smaller ones would not:

    >>> import facewrinkle as fw
    >>> from dataclasses import replace
    >>> face = fw.default_face()
    >>> eye = face.eyes[0]
    >>> small = LidMargin(replace(eye, radius=0.9 * eye.radius), face)
    >>> len(LidMargin(eye, face).loop), small.at(face.points).n_open_edges == 2 * len(small.loop)
    (0, True)
    """

    def __init__(self, eye: Eyeball, face: Face) -> None:
        self.eye = eye
        loop: IntArray = face.lid_rims.get(eye.side, np.empty(0, np.int32))
        farthest = np.linalg.norm(face.points[loop] - eye.centre, axis=1).max(initial=0.0)
        self.loop = loop if farthest > FILLED * eye.radius else loop[:0]
        n = len(self.loop)
        self._triangles = ring_triangles(n, len(DEPTHS))[:, [0, 2, 1]]
        self._paint = np.rint(flesh(np.repeat(DEPTHS, n))).astype(np.uint8)

    def at(self, points: Array) -> pv.PolyData:
        """Return the strip, with `paint` (rgb), between the lids of a face with vertices at `points` (n, 3)."""
        offset = points[self.loop] - self.eye.centre
        distance = np.linalg.norm(offset, axis=1, keepdims=True)
        end = np.minimum(END * self.eye.radius, distance - 0.02 * self.eye.radius)
        away = distance + DEPTHS[:, None, None] * (end - distance)
        strip = (self.eye.centre + away * (offset / distance)).reshape(-1, 3)
        mesh = to_polydata(strip, self._triangles)
        mesh.point_data["Normals"] = vertex_normals(strip, self._triangles)
        mesh.point_data["paint"] = self._paint
        return mesh
