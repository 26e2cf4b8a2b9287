"""Meshes of all that is seen besides the skin in a frame: parts that came with the face, eyes and mouth.

Painted brows and lashes are not among them: their width depends on the picture.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..anatomy.face import Face
from .seen import Appearance

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
    seen, state = Appearance.of(face).at(frame), face.state_of(frame)
    own = {name: part.copy(deep=False) for name, part in seen.own.items()}
    parts = {f"eye_{side}": eye for side, eye in seen.eyes.items() if f"eye_{side}" not in own}
    parts |= {f"rim_{side}": rim for side, rim in seen.lid_margins.items()}
    if seen.parted:
        parts |= ({"mouth": seen.pocket} if seen.pocket is not None else {}) | seen.inside_mouth
    parts = {name: part.copy() for name, part in parts.items()}
    for part in parts.values():
        part.points = state.from_rest(np.asarray(part.points, dtype=np.float64))
        if "Normals" in part.point_data:
            part.point_data["Normals"] = np.asarray(part.point_data["Normals"]) @ state.head[:3, :3].T
    return parts | own
