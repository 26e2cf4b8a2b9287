"""The inside of the mouth, as it shows between parted lips: a dark pocket, teeth, gums and tongue."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from ..anatomy.landmarks import lips_middle
from ..anatomy.teeth import teeth_of
from ..geometry.normals import vertex_normals
from ..geometry.smoothstep import smoothstep
from ..geometry.topology import boundary_loops
from ..mesh import to_polydata
from .own_parts import PART_COLOURS

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


IN_MOUTH = 14.0
"""Skin that lies deeper behind the lips is that of a mouth, mm on a face of average size."""


FARTHEST, FADING = np.array([0.07, 0.025, 0.025]), np.array([0.26, 0.22, 0.215])
"""Share of the light that is left far back in a mouth, and how far in it goes, in distances between the pupils: flesh
around it throws back red.
"""


class Mouth:
    """What shows between parted lips: the dark inside, teeth, gums and tongue.

    Parameters
    ----------
    face : Face
        Its mouth is an opening of the mesh (`loop`), or a bag of skin behind the lips (`bag`); where it is neither,
        there is nothing.
    """

    INSIDE = ("upper_teeth", "lower_teeth", "tongue")

    def __init__(self, face: Face) -> None:
        self.loop, self.bag = np.empty(0, np.int64), False
        if not face.landmarks:
            return
        centre = lips_middle(face.landmarks)
        self._size, self._axes = face.frame.pupil_distance, face.frame.axes
        width = 0.5 * float((face.landmarks["mouth_l"] - face.landmarks["mouth_r"]) @ self._axes[0])
        for loop in boundary_loops(face.triangles):
            near, across = np.linalg.norm(face.points[loop] - centre, axis=1), np.ptp(face.points[loop] @ self._axes[0])
            if (
                near.max() < 0.8 * self._size
                and np.linalg.norm(face.points[loop].mean(axis=0) - centre) < 0.3 * self._size
                and across > width  # others are holes beside it
            ):
                self.loop, width = np.asarray(loop, dtype=np.int64), across
        ends = self._middles(face) if len(self.loop) else _lips_of_bag(face)
        if ends is None:
            return
        self._ends, self.bag = ends, not len(self.loop)
        self._rest = self._gap(face.points)
        self._width = float(np.ptp(face.points[self.loop] @ self._axes[0])) if not self.bag else 0.0
        self.teeth = teeth_of(face.landmarks, face.frame)
        self._normals = [vertex_normals(arch.points, arch.triangles) for arch in self.teeth]
        self._bones = [
            self._shaded(arch.points, arch.paint * self._facing(normals), centre)
            for arch, normals in zip(self.teeth, self._normals, strict=True)
        ]
        ball = pv.Sphere(radius=1.0, theta_resolution=24, phi_resolution=16)
        self._tongue = centre + (ball.points * [0.30, 0.15, 0.42] - [0.0, 0.15, 0.62]) * self._size @ self._axes
        self._tongue_triangles = np.asarray(ball.regular_faces, np.int32)
        tint = np.tile(np.array(PART_COLOURS["tongue"], np.float64), (len(self._tongue), 1))
        self._tongue_paint = self._shaded(self._tongue, tint, centre)
        self._mandible = face.mandible

    def _middles(self, face: Face) -> tuple[int, int]:
        """The two vertices of the opening in the middle of the lips: nearest to the midline on either side of it."""
        aside = np.abs((face.points[self.loop] - face.frame.origin) @ self._axes[0])
        n, first = len(self.loop), int(np.argmin(aside))
        across = [(first + step) % n for step in range(n // 4, n - n // 4)]
        return int(self.loop[first]), int(self.loop[min(across, key=lambda at: float(aside[at]))])

    def _gap(self, points: Array) -> float:
        return float(abs((points[self._ends[0]] - points[self._ends[1]]) @ self._axes[1]))

    def _shaded(self, points: Array, paint: npt.NDArray[Any], centre: Array) -> npt.NDArray[np.uint8]:
        """Paint, darker and redder the farther back it is."""
        back = np.maximum((centre - points) @ self._axes[2] / self._size - 0.2, 0.0)[:, None]
        return np.rint(paint * (FARTHEST + 0.84 * np.exp(-back / FADING))).astype(np.uint8)

    def _facing(self, normals: Array) -> Array:
        """Share (n, 1) of the light that comes in between the lips: little on the sides towards the tongue."""
        return 0.25 + 0.75 * smoothstep((normals @ self._axes[2] + 0.1) / 0.5)[:, None]

    def parted(self, points: Array) -> bool:
        """Whether the lips are farther apart than at rest."""
        return (self.bag or len(self.loop) > 0) and self._gap(points) - self._rest > 0.012 * self._size

    def pocket(self, points: Array) -> pv.PolyData:
        """The dark inside, with `paint` (rgb), behind the lips as they are now: the face's vertices (n, 3)."""
        rim = points[self.loop]
        n, middle, size = len(rim), rim.mean(axis=0), self._size
        local = (rim - middle) @ self._axes.T
        turn = np.arctan2(local[:, 1] / max(float(np.abs(local[:, 1]).max()), 0.02 * size), local[:, 0] / (0.4 * size))
        oval = np.stack([np.cos(turn), 0.65 * np.sin(turn), np.zeros(n)], axis=1)
        rings = [rim]
        narrow = min(float(np.ptp(local[:, 0])) / self._width, 1.0)  # pursed lips take the cheeks beside them along
        for half, depth in ((0.38 * narrow, 0.12), (0.47 * narrow, 0.3), (0.45, 0.85)):
            rings.append(middle + (half * oval - [0.0, 0.0, depth]) * size @ self._axes)
        here = np.arange(n)
        after = (here + 1) % n
        faces = []
        for k in (0, n, 2 * n):
            faces += [np.stack(c, axis=1) + k for c in ((here, here + n, after), (after, here + n, after + n))]
        faces.append(np.stack([here + 3 * n, np.full(n, 4 * n), after + 3 * n], axis=1))
        rings.append(rings[-1].mean(axis=0)[None])
        pocket = to_polydata(np.vstack(rings), np.vstack(faces))
        tints = [(84, 38, 36), (50, 20, 19), (26, 9, 9), (12, 4, 5), (12, 4, 5)]
        pocket.point_data["paint"] = np.repeat(np.array(tints, np.uint8), [n, n, n, n, 1], axis=0)
        return pocket

    def inside(self, points: Array) -> dict[str, pv.PolyData]:
        """Teeth and tongue by name, with `paint` (rgb): the lower ones go with the mandible."""
        turn, hinge = self._turn(points)
        parts = {}
        for arch, paint, normals in zip(self.teeth, self._bones, self._normals, strict=True):
            moves = arch.jaw == "lower"
            mesh = to_polydata((arch.points - hinge) @ turn.T + hinge if moves else arch.points, arch.triangles)
            mesh.point_data["Normals"] = normals @ turn.T if moves else normals
            mesh.point_data["paint"] = paint
            parts[f"{arch.jaw}_teeth"] = mesh
        tongue = to_polydata((self._tongue - hinge) @ turn.T + hinge, self._tongue_triangles)
        tongue.point_data["Normals"] = vertex_normals(tongue.points, self._tongue_triangles)
        tongue.point_data["paint"] = self._tongue_paint
        return parts | {"tongue": tongue}

    def _turn(self, points: Array) -> tuple[Array, Array]:
        """Rotation of the mandible about a point of its hinge, as the skin over it shows."""
        if self._mandible is None:
            return np.eye(3), np.zeros(3)
        return self._mandible.rotation(points), self._mandible.hinge


def _lips_of_bag(face: Face) -> tuple[int, int] | None:
    """The vertices in the middle of the lips where these meet, if the skin goes on from there into a mouth."""
    size = face.frame.pupil_distance
    lips = lips_middle(face.landmarks)
    local = (face.points - lips) @ face.frame.axes.T / size
    depth = face.cavities.depth(face.points)
    if not (depth[(np.abs(local[:, :2]) < [0.3, 0.25]).all(axis=1)] > IN_MOUTH).any():
        return None
    up = vertex_normals(face.points, face.triangles) @ face.frame.axes[1]
    near = (np.abs(local[:, 0]) < 0.1) & (np.abs(local[:, 1]) < 0.25) & (local[:, 2] > -0.2)
    ends = []
    for sign in (-1.0, 1.0):  # the upper lip faces down where it meets the lower one
        at = np.flatnonzero(near & (sign * up > 0.5) & (depth < IN_MOUTH))
        if not len(at):
            return None
        ends.append(int(at[np.argmin(np.abs(local[at, 0]) + 2.0 * np.abs(local[at, 1]))]))
    return ends[0], ends[1]
