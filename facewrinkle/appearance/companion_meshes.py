"""Meshes of all that is seen besides the skin in a frame: parts that came with the face, eyes, mouth and hair."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from .eye import coarser
from .seen import Appearance


def companion_meshes(face: Face, frame: pv.PolyData, always: bool = False) -> dict[str, pv.PolyData]:
    """Return what is seen besides the skin in a frame: meshes by name, with `paint` (rgb) or texture coordinates.

    They are the parts that came with the face, painted eyes where it has none, the flesh between lids and eyeballs,
    and, between parted lips, the dark pocket of the mouth, teeth and tongue. Painted brows and lashes, whose width in a
    picture depends on its pixels, are among them only if `always` is true, and so are the insides of a closed mouth:
    then every frame has the same meshes with the same triangles.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> sorted(companion_meshes(face, face.mesh))
    ['eye_l', 'eye_r']
    >>> len(companion_meshes(face, face.mesh, always=True))
    9
    """
    seen, state = Appearance.of(face).at(frame), face.state_of(frame)
    own = {name: part.copy(deep=False) for name, part in seen.own.items()}
    eyes = {side: coarser(eye, 2) if always else eye for side, eye in seen.eyes.items()}
    parts = {f"eye_{side}": eye for side, eye in eyes.items() if f"eye_{side}" not in own}
    parts |= {f"rim_{side}": rim for side, rim in seen.lid_margins.items()}
    if seen.parted or always:
        parts |= ({"mouth": seen.pocket} if seen.pocket is not None else {}) | seen.mouth_parts
    if always:
        parts |= seen.hairs
    parts = {name: part.copy() for name, part in parts.items()}
    for part in parts.values():
        part.points = state.from_rest(np.asarray(part.points, dtype=np.float64))
        if "Normals" in part.point_data:
            part.point_data["Normals"] = np.asarray(part.point_data["Normals"]) @ state.head[:3, :3].T
    return parts | own
