"""What reaches the parts of a face of the light in a scene: shadows of the key light, and openness to all sides."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.spatial import cKDTree

from ..anatomy import Face, hair_cover, per_face
from ..anatomy.cropped_hair import beard
from ..appearance.seen import Seen
from ..appearance.skin_paint import lips
from ..appearance.smooth_skin import on_base, open_to
from ..array_types import Array
from ..geometry import Lamp, interpolated, smoothstep
from ..mesh.arrays import in_bytes

STEP, SOFT, RAYS = 1.0, 10.0, 24
"""Width of the rays of the key light and half the border of its shadows, mm on a face of average size; their number."""

WET = 3.2
"""Gloss of lips relative to that of skin."""

IN_SHADE = 0.4
"""Share of its light that a part beside the skin keeps in the shadow of the skin."""

LEAST = -0.4
"""Cosine with the direction of the key light up to which a place counts as turned away from it."""


class KeyLight:
    """The key light of a scene on a face in one frame.

    Parameters
    ----------
    face : Face
    seen : Seen
    towards : ndarray, shape (3,)
        Direction of the lamp.
    follow : bool
        True if the camera goes along with the head: lamps do, too.
    """

    def __init__(self, face: Face, seen: Seen, towards: Array, follow: bool) -> None:
        self._seen, self._face, self._scale = seen, face, face.frame.scale
        towards = towards if follow else towards @ seen.pose[:3, :3]
        self._lamp = Lamp(seen.smooth.occluder, towards, STEP * self._scale)

    def on_skin(self, hairy: bool) -> npt.NDArray[np.float32]:
        """Return what the shader needs of each vertex of the smooth skin (n, 4).

        These are its openness, the share of the key light that it gets, its gloss relative to that of bare skin, and
        how far it is from the end of the bust, where the picture fades: from 0 to 1. Hair and beards shade skin that is
        `hairy`.
        """
        smooth, face = self._seen.smooth, self._face
        lit = 1.0 - self._hidden(*smooth.on_head)
        bare, far, near = (smooth.from_base(column) for column in per_face(face, "bust", None, lambda: _bust(face)))
        shade = near if hairy else np.ones(len(near))
        return np.column_stack([shade * smooth.openness, shade * lit, bare, smoothstep(far)]).astype(np.float32)

    def on_part(self, part: pv.PolyData, posed: bool = False) -> pv.PolyData:
        """Return a part on the head at rest, or where the frame has it, with its `paint` in the shadow of the skin."""
        shaded, pose = part.copy(deep=False), self._seen.pose if posed else np.eye(4)
        points = (np.asarray(part.points, np.float64) - pose[:3, 3]) @ pose[:3, :3]
        hidden = self._hidden(points, np.asarray(part.point_data["Normals"], np.float64) @ pose[:3, :3])
        left = np.sqrt(1.0 - (1.0 - IN_SHADE) * hidden)[:, None]
        shaded.point_data["paint"] = np.rint(left * np.asarray(part.point_data["paint"])).astype(np.uint8)
        return shaded

    def _hidden(self, points: Array, normals: Array) -> Array:
        return self._lamp.hidden(points, normals, soft=SOFT * self._scale, rays=RAYS, least=LEAST)


def light_at_rest(face: Face, skin: pv.PolyData) -> npt.NDArray[np.uint8]:
    """What the shader of a page needs of each vertex (n, 4) of a frame, or of a mesh at rest whose first vertices are
    the face's, as if the face were at rest, in the shade of hair alone; see :meth:`KeyLight.on_skin`. Here gloss is
    relative to that of lips.
    """
    base = per_face(face, "light at rest", None, lambda: _light_at_rest(face))
    return in_bytes(np.concatenate([base, interpolated(base, *on_base(face, skin))]))


def _light_at_rest(face: Face) -> Array:
    bare, far, near = _bust(face)
    return np.column_stack([near * open_to(face, face.points), near, bare / WET, smoothstep(far)])


def _bust(face: Face) -> tuple[Array, Array, Array]:
    """Gloss (n0,), of bare skin 1, distances (n0,) from the end of the neck, 1 where all is seen, and shares (n0,) of
    light that hair and beards leave.
    """
    bare, far, near = np.ones((3, len(face.points)))
    if not face.landmarks:
        return bare, far, near
    scale, cover = face.frame.scale, hair_cover(face.points, face.landmarks, face.frame)
    bare -= 0.8 * smoothstep(cover / 8.0)  # skin is dull under cropped hair, whatever the colors of both
    lip = lips(face.points, face.landmarks, face.frame)
    under = np.zeros(len(near))
    if "cropped_hair" in face.bound_hair:
        under = 0.4 * smoothstep(1.0 + cover / 12.0)  # up to 12 mm beside it, on a face of average size
    if "hair" in face.parts:
        away = cKDTree(face.parts["hair"].mesh.points).query(face.points)[0] / scale
        under = np.maximum(under, 0.5 * smoothstep((16.0 - away) / 12.0))  # short hairs before tied ones shade no more
    if "beard" in face.bound_hair:
        # Stubble takes a quarter of the light, a full beard, of hairs that half stand 0.6 mm off the skin, nearly two
        # thirds, and less where it thins out.
        full = smoothstep(np.median(face.bound_hair["beard"].heights) / (0.6 * scale))
        dense = beard(face.frame.local_mm(face.points), face.landmarks, face.frame) ** 2 * (1.0 - lip)
        under = np.maximum(under, (0.25 + 0.4 * full) * dense)
    near -= under
    bare += (WET - 1.0) * lip
    # The bust ends below the chin by more than 25 mm, and fades over twice that; on a face of average size.
    neck = face.frame.local_mm(face.landmarks["menton"])[1] - 25.0
    rims = np.concatenate([np.empty(0, np.int64), *face.boundary_loops])
    ends = face.points[rims[face.frame.local_mm(face.points[rims])[:, 1] < neck]]
    if len(ends):
        far = cKDTree(ends).query(face.points)[0] / (50.0 * scale)
    return bare, far, near
