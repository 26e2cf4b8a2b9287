"""Skin as pictures show it: without small holes, such as scanners leave, and without the back of a mouth's and eye
sockets' lining.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.eyeball import Eyeball
from ..anatomy.eyelid_opening import lid_rim
from ..anatomy.eyelids import SHELL
from ..anatomy.face import Face
from ..geometry.topology import boundary_loops
from ..mesh.arrays import CORNERS

SMALL = 0.3
"""Holes across less are closed, in distances between the pupils: eyes and mouths are larger."""

Triangles = npt.NDArray[np.int_]


class VisibleSkin:
    """What is drawn of the skin of a face.

    Parameters
    ----------
    face : Face
        Without landmarks nothing tells what is a hole in it.
    bag : bool
        Its skin goes on behind the lips: there, it may come out through the chin.
    """

    def __init__(self, face: Face, bag: bool) -> None:
        self._rims = np.zeros(len(face.points), bool)
        limit = SMALL * face.frame.pupil_distance
        loops = boundary_loops(face.triangles) if face.landmarks else []
        small = [loop for loop in loops if np.linalg.norm(np.ptp(face.points[loop], axis=0)) < limit]
        self._lining = face.lining if bag else None
        self._sockets = _sockets(face)
        if small:
            inner = face.lining.vertices
            for loop in small:
                self._rims[loop] = not inner[loop].all()

    def of(self, skin: pv.PolyData, eye: npt.NDArray[np.float64]) -> pv.PolyData:
        """The skin of a frame as it is seen from a place: the frame itself where nothing is different."""
        triangles = np.asarray(skin.regular_faces)
        across, kept = self._across(skin, triangles), ~self._hidden(skin, triangles, eye)
        if not len(across) and kept.all():
            return skin
        drawn = skin.copy(deep=False)
        drawn.clear_cell_data()
        drawn.faces = np.insert(np.vstack([triangles[kept], across]), 0, 3, axis=1).ravel()
        if CORNERS in skin.cell_data:
            corners = np.asarray(skin.active_texture_coordinates)[across].reshape(-1, 6)
            drawn.cell_data[CORNERS] = np.vstack([skin.cell_data[CORNERS][kept], corners])
        return drawn

    def _across(self, skin: pv.PolyData, triangles: Triangles) -> Triangles:
        """Triangles across small holes, between the vertices of their rims as they are now."""
        if not self._rims.any():
            return np.empty((0, 3), triangles.dtype)
        n = len(self._rims)  # base vertices come first in every frame
        loops = [loop[::-1] for loop in boundary_loops(triangles) if self._rims[loop[loop < n]].any()]
        polygons = np.concatenate([np.append(len(loop), loop) for loop in loops])
        return np.asarray(pv.PolyData(np.asarray(skin.points), faces=polygons).triangulate().regular_faces)

    def _hidden(self, skin: pv.PolyData, triangles: Triangles, eye: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
        """Which triangles of linings are seen from within the flesh."""
        rest, lined = np.asarray(skin.point_data.get("rest", skin.points)), np.zeros(len(triangles), bool)
        if self._lining is not None:
            inner = self._lining.vertices
            lined |= np.append(inner, self._lining.holds(rest[len(inner) :]))[triangles].any(axis=1)
        for socket in self._sockets:  # what faces the ball
            offset = rest - socket.centre
            near = np.flatnonzero((np.linalg.norm(offset, axis=1) < SHELL * socket.radius)[triangles].all(axis=1))
            lined[near] |= _faces(offset, triangles[near], np.zeros(3))
        hidden = np.zeros(len(triangles), bool)
        hidden[lined] = ~_faces(np.asarray(skin.points), triangles[lined], eye)
        return hidden


def _faces(
    points: npt.NDArray[np.float64], triangles: Triangles, place: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    """Which triangles show their front to a place."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return np.asarray((np.cross(b - a, c - a) * (place - a)).sum(axis=1) >= 0.0)


def _sockets(face: Face) -> list[Eyeball]:
    """The eyes between whose open lids and the ball the skin of a face goes on: its lining lies behind the lids."""
    return [
        eye
        for eye in face.eyes
        if eye.side in face.eyelid_openings and lid_rim(eye, face.points, face.triangles) is None
    ]
