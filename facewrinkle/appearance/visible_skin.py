"""Skin as pictures show it: small holes, such as scanners leave, are closed, and the lining of mouth and eye sockets is
not seen from behind.
"""

from __future__ import annotations

import numpy as np
import pyvista as pv

from ..anatomy import Face
from ..anatomy.eyelids import SHELL
from ..array_types import Array, BoolArray, IntArray
from ..geometry import area_vectors, boundary_loops
from ..mesh.arrays import CORNERS, rest_of

SMALL_HOLE = 0.3
"""Holes smaller than this are closed, in distances between the pupils: eyes and mouths are larger."""


class VisibleSkin:
    """The part of a face's skin that is drawn.

    Parameters
    ----------
    face : Face
        Without landmarks its holes stay open: nothing tells which are faults.
    bag : bool
        True if the skin goes on behind the lips: that part may come out through the chin.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> before = face.frame.world(np.array([0.0, 0.0, 10.0]))
    >>> VisibleSkin(face, bag=False).of(face.mesh, before) is face.mesh
    True
    """

    def __init__(self, face: Face, bag: bool) -> None:
        limit = SMALL_HOLE * face.frame.pupil_distance
        loops = face.boundary_loops if face.landmarks else []
        small = [loop for loop in loops if np.linalg.norm(np.ptp(face.points[loop], axis=0)) < limit]
        self._rims = np.zeros(len(face.points), bool)
        for loop in small:
            self._rims[loop] = not face.lining.vertices[loop].all()
        self._lining = face.lining if bag else None
        # Eyes with open lids behind which the skin goes on, between lids and ball.
        self._sockets = [eye for eye in face.eyes if eye.side in face.eyelid_openings and eye.side not in face.lid_rims]

    @property
    def by_view(self) -> bool:
        """True if what is drawn depends on the viewpoint: where the skin goes on behind lips or lids."""
        return self._lining is not None or bool(self._sockets)

    def of(self, skin: pv.PolyData, viewpoint: Array) -> pv.PolyData:
        """Return the skin of a frame as drawn from a viewpoint; the frame itself if that is no different."""
        triangles = np.asarray(skin.regular_faces)
        across, kept = self.across(skin, triangles), ~self._hidden(skin, triangles, viewpoint)
        if not len(across) and kept.all():
            return skin
        drawn = skin.copy(deep=False)
        drawn.clear_cell_data()
        drawn.faces = np.insert(np.vstack([triangles[kept], across]), 0, 3, axis=1).ravel()
        if CORNERS in skin.cell_data:
            corners = np.asarray(skin.active_texture_coordinates)[across].reshape(-1, 6)
            drawn.cell_data[CORNERS] = np.vstack([skin.cell_data[CORNERS][kept], corners])
        return drawn

    def across(self, skin: pv.PolyData, triangles: IntArray) -> IntArray:
        """Return triangles across small holes, between the vertices of their rims as they are now."""
        if not self._rims.any():
            return np.empty((0, 3), triangles.dtype)
        n = len(self._rims)  # base vertices come first in every frame
        loops = [loop[::-1] for loop in boundary_loops(triangles) if self._rims[loop[loop < n]].any()]
        polygons = np.concatenate([np.append(len(loop), loop) for loop in loops])
        return np.asarray(pv.PolyData(np.asarray(skin.points), faces=polygons).triangulate().regular_faces)

    def lined(self, skin: pv.PolyData, triangles: IntArray) -> BoolArray:
        """Return True for triangles of linings, whose backs lie in the flesh and are not to be seen."""
        rest, lined = rest_of(skin), np.zeros(len(triangles), bool)
        if self._lining is not None:
            inner = self._lining.vertices
            lined |= np.append(inner, self._lining.holds(rest[len(inner) :]))[triangles].any(axis=1)
        for socket in self._sockets:
            offset = rest - socket.centre
            near = np.flatnonzero((np.linalg.norm(offset, axis=1) < SHELL * socket.radius)[triangles].all(axis=1))
            lined[near] |= _faces(offset, triangles[near], np.zeros(3))  # the ball
        return lined

    def _hidden(self, skin: pv.PolyData, triangles: IntArray, viewpoint: Array) -> BoolArray:
        """True for triangles of linings whose backs would be seen."""
        lined = self.lined(skin, triangles)
        hidden = np.zeros(len(triangles), bool)
        hidden[lined] = ~_faces(np.asarray(skin.points), triangles[lined], viewpoint)
        return hidden


def _faces(points: Array, triangles: IntArray, place: Array) -> BoolArray:
    """True for triangles that turn their front to a place."""
    return np.asarray((area_vectors(points, triangles) * (place - points[triangles[:, 0]])).sum(axis=1) >= 0.0)
