"""Parts that came with a face and are drawn with their own shape and colours."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..anatomy.parts import Part
from ..mesh import split_at_seams

PART_COLOURS = {
    "teeth": (214, 205, 186), "tongue": (176, 92, 88), "glasses": (40, 40, 44), "other": (150, 140, 134),
    "hair": (62, 46, 38),
}  # fmt: skip
"""Colours of parts that have none, by a word in their names; all others have that of hair."""


def has_colours(mesh: pv.PolyData) -> bool:
    """Return True if the points of a mesh have colours, of uint8 or from 0 to 1."""
    colours = mesh.point_data.get("Colors")
    if colours is None or colours.ndim != 2 or colours.shape[1] not in (3, 4):
        return False
    return colours.dtype == np.uint8 or (colours.dtype.kind == "f" and 0.0 <= colours.min() <= colours.max() <= 1.0)


def is_drawn(name: str, part: Part) -> bool:
    """Return True if a part is drawn as it is.

    An eye that has no colours, or only one, would look blind: a painted one takes its place. In the same way,
    painted lashes take the place of hair cards whose picture is missing.
    """
    if name.startswith("lashes"):
        return not part.lacks_picture
    if part.texture is not None or not name.startswith("eye"):
        return True
    return has_colours(part.mesh) and bool(np.ptp(part.mesh.point_data["Colors"], axis=0).any())


def own_parts(face: Face, frame: pv.PolyData) -> dict[str, pv.PolyData]:
    """Return the parts by name that are drawn as they are, where they are in a frame.

    Parts without a texture have `paint` (rgb).
    """
    if not face.parts:
        return {}
    parts = {name: part for name, part in face.parts_at(frame).items() if is_drawn(name, face.parts[name])}
    for name, part in parts.items():
        if face.parts[name].texture is not None:
            parts[name] = split_at_seams(part)
        elif has_colours(part):
            part.point_data["paint"] = np.asarray(part.point_data["Colors"])
        else:
            colour = next((c for stem, c in PART_COLOURS.items() if stem in name), PART_COLOURS["hair"])
            part.point_data["paint"] = np.tile(np.array(colour, np.uint8), (part.n_points, 1))
    return parts
