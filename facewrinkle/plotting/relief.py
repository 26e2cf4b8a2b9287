"""Micro-relief of the skin in pictures: what the skin's shader is told of pores and fine furrows.

Lights are worked out at the corners of triangles; a pixel adds what the slope of the relief there changes. Slopes are
differences from pixel to pixel, of heights that belong to places on the skin at rest: they grow where the skin is
compressed, and flatten where it is stretched.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt
import pyvista as pv
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

from ..anatomy.face import Face, per_face
from ..appearance.skin_paint import DEPTH, FIELD, OLD_DEPTH, OLD_FIELD, relief_strength
from ..array_types import Array, IntArray
from ..geometry.normals import vertex_normals
from ..geometry.smoothstep import smoothstep
from ..mesh.arrays import AGE
from .shaders import RELIEF
from .views import VIEW_ANGLE

FADING = (0.08, 0.22)
"""Widths of a pixel, mm on a face of average size, up to which the relief is whole, and from which it is not seen."""

STRONGEST = 2.0
"""Largest strength that can be sent."""


class Relief:
    """The relief of a face, for pictures with pixels of one width.

    Parameters
    ----------
    face : Face
    pixel : float
        Width of a pixel, in the unit of the mesh.
    rows : int
        Pixels from the lower to the upper border of the picture.
    """

    def __init__(self, face: Face, pixel: float, rows: int) -> None:
        self._face, self._angle = face, np.radians(VIEW_ANGLE) / rows
        self._fade = 1.0 - float(smoothstep((pixel / face.frame.scale - FADING[0]) / (FADING[1] - FADING[0])))

    @staticmethod
    def seen(face: Face, pixel: float) -> bool:
        """Return True if a pixel of this width shows anything of a face's relief."""
        return bool(face.landmarks) and pixel < FADING[1] * face.frame.scale

    @property
    def shading(self) -> tuple[float, float]:
        """Depth and angle of a pixel for :meth:`facewrinkle.plotting.shaders.Material.apply`."""
        return STRONGEST * self._fade * self._face.frame.scale * OLD_DEPTH, self._angle

    def on(self, skin: pv.PolyData) -> npt.NDArray[np.float32]:
        """Return what the shader needs of each vertex of a frame (n, 4).

        These are its place at rest, in fields of the relief, the plane of the axes that it faces there (0: xy, 1: zy,
        2: xz), and as the fraction of the same number the strength, which is less on younger skin. The frame tells the
        age, or else the face.
        """
        age = float(skin.field_data[AGE][0]) if AGE in skin.field_data else max(self._face.age, 0.0)
        points = np.array(skin.point_data.get("rest", skin.points), np.float64)
        make = partial(_on_skin, points, np.asarray(skin.regular_faces), age, self._face)
        return per_face(self._face, "relief", (age, points.tobytes()), make)


def _on_skin(points: Array, triangles: IntArray, age: float, face: Face) -> npt.NDArray[np.float32]:
    """Return places, planes and strengths (n, 4) of vertices at rest; see :meth:`Relief.on`."""
    facing = np.abs(vertex_normals(points, triangles) @ face.frame.axes.T)
    plane = np.array([1, 2, 0])[facing.argmax(axis=1)]
    own = np.clip(relief_strength(points, face) / STRONGEST, 0.0, 0.999)
    strength = own * ((1.0 - age) * DEPTH + age * OLD_DEPTH) / OLD_DEPTH
    field = (1.0 - age) * np.full(3, FIELD) + age * np.array(OLD_FIELD)
    return np.column_stack([face.frame.local_mm(points) / field, plane + strength]).astype(np.float32)


def send_relief(actor: vtkActor) -> None:
    """Give an actor a mapper that sends the array `RELIEF` of its mesh to the shader; PyVista's cannot."""
    mapper = vtkPolyDataMapper()
    mapper.MapDataArrayToVertexAttribute(f"{RELIEF}MC", RELIEF, 0, -1)
    vtkActor.SetMapper(actor, mapper)
