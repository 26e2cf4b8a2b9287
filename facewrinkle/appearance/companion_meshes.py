"""Meshes of all that is seen besides the skin in a frame: parts that came with the face, eyes and mouth.

Painted brows and lashes are not among them: their width depends on the picture.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from .eye import PaintedEye
from .lid_margins import LidMargin
from .mouth import Mouth
from .own_parts import own_parts

Array = npt.NDArray[np.float64]


def companion_meshes(face: Face, frame: pv.PolyData) -> dict[str, pv.PolyData]:
    """Return what is seen besides the skin in a frame: meshes by name, with `paint` (rgb) or texture coordinates.

    They are the parts that came with the face, painted eyes where it has none, the flesh between lids and eyeballs,
    and, between parted lips, the dark pocket of the mouth, teeth and tongue.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> sorted(companion_meshes(face, face.mesh))
    ['eye_l', 'eye_r']
    """
    own = own_parts(face, frame)
    state = face.state_of(frame)
    points = state.to_rest(state.points)
    parts = {}
    for eye in face.eyes:
        ball, rim = PaintedEye(eye, face), LidMargin(eye, face)
        if f"eye_{eye.side}" not in own:
            parts[f"eye_{eye.side}"] = ball.at(points, state.gazes.get(eye.side))
        if ball.open and len(rim.loop):
            parts[f"rim_{eye.side}"] = rim.at(points)
    mouth = Mouth(face)
    if mouth.parted(points):
        inside = {name: part for name, part in mouth.inside(points, state.jaw_angle).items() if name not in own}
        parts |= inside if mouth.bag else {"mouth": mouth.pocket(points)} | inside
    for part in parts.values():
        part.points = state.from_rest(np.asarray(part.points, dtype=np.float64))
        if "Normals" in part.point_data:
            part.point_data["Normals"] = np.asarray(part.point_data["Normals"]) @ state.head[:3, :3].T
    return parts | own
