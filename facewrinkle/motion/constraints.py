"""Where the skin is held otherwise than the tissue under it tells: on the tip of the nose, and on the gums."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..anatomy.landmarks import MEAN_PUPIL_DISTANCE, lips_middle
from ..geometry.smoothstep import smoothstep

Array = npt.NDArray[np.float64]

CARTILAGE, GLIDING = 7.0, 20.0
"""How far around the line from the tip of the nose to its base, and how far around its tip, mm."""

GLIDE = 0.92
"""Share of its tethers that the tip of the nose lacks."""

LINING = (2.0, 8.0)
"""How far above and below the line between the lips their lining leaves them for the gums, mm."""

VESTIBULE = 30.0
"""How far behind the lips there are gums in front of teeth, mm."""


def tip_of_nose(face: Face) -> tuple[Array, Array]:
    """How far (n,) the skin sits on the cartilage between the tip of the nose and its base, and what share (n,) of its
    tethers it lacks there: cartilage gives way where the bone ends.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> firm, free = tip_of_nose(face)
    >>> tip = np.linalg.norm(face.points - face.landmarks["nose_tip"], axis=1).argmin()
    >>> bool(firm[tip] > 0.9), bool(free[tip] > 0.9)
    (True, True)
    """
    tip, base = face.landmarks["nose_tip"], face.landmarks["subnasale"]
    line, offset = base - tip, face.points - tip
    along = np.clip(offset @ line / (line @ line), 0.0, 1.0)
    away = np.array([((offset - share * line) ** 2).sum(axis=1) for share in (along[:, None], 0.0)])
    reach = np.array([CARTILAGE, GLIDING]) * face.frame.pupil_distance / MEAN_PUPIL_DISTANCE
    firm, near = np.exp(-away / reach[:, None] ** 2)
    return firm, GLIDE * near


def on_gums(face: Face) -> Array:
    """How far (n,) the skin is lining of the lips that has turned to the gums: it holds to them, no muscle pulls it.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> bool(on_gums(face)[face.tissue.normals @ face.frame.axes[2] > 0.0].any())
    False
    """
    left, up, forward = face.frame.axes
    scale = face.frame.pupil_distance / MEAN_PUPIL_DISTANCE
    lips = lips_middle(face.landmarks)
    wide = abs((face.landmarks["mouth_l"] - face.landmarks["mouth_r"]) @ left)
    local = face.points - lips
    inside = (np.abs(local @ left) < 0.6 * wide) & (face.tissue.normals @ forward < 0.0)
    inside &= ((face.points - face.landmarks["subnasale"]) @ up < 0.0) & (local @ forward > -VESTIBULE * scale)
    first, last = LINING
    return np.asarray(inside * smoothstep((np.abs(local @ up) / scale - first) / (last - first)))
