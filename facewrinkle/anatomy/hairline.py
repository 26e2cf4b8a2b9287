"""The hairline of the scalp."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy.landmarks import FaceFrame
from ..geometry.smoothstep import smoothstep

Array = npt.NDArray[np.float64]


HAIRLINE = np.array(
    # azimuth from the front about the middle of the head in degrees, height over the eyes in mm
    [
        *((0, 62), (10, 62.5), (20, 64), (29, 63), (36, 57), (42, 46), (48, 32), (55, 24), (61, 18), (64, 8)),
        *((66, -8), (69, -19), (76, -20), (80, -14), (82, 4), (86, 15), (95, 20), (106, 15), (113, 2), (118, -22)),
        *((124, -40), (134, -52), (150, -62), (168, -67), (180, -68)),
    ],
    dtype=np.float64,
)
"""Of the scalp: over the forehead, down the temple and before the ear, around the ear to the nape."""


BEHIND = 12.0
"""From the zygion back to the axis about which the azimuth turns, mm."""


AROUND = 80.0
"""Radius at which an azimuth is a length, mm."""


def hair_cover(points: Array, landmarks: Mapping[str, Array], frame: FaceFrame) -> Array:
    """Signed distance (n,) of points from the hairline along the head, mm; positive where hair grows.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> marks = face.landmarks
    >>> crown = marks["trichion"] + [0, 60, -60]
    >>> hair_cover(np.array([crown, marks["nose_tip"]]), marks, face.frame) > 0
    array([ True, False])
    """
    where = frame.local_mm(points)
    ear, top = frame.local_mm(landmarks["zygion_l"]), frame.local_mm(landmarks["trichion"])
    azimuth = np.degrees(np.arctan2(np.abs(where[:, 0]), where[:, 2] - ear[2] + BEHIND))
    line = HAIRLINE.copy()
    share = smoothstep((line[:, 0] - 30.0) / 30.0)
    line[:, 1] += (1.0 - share) * (top[1] - line[0, 1]) + share * (ear[1] + 16.0)
    flat = np.radians(azimuth) * AROUND
    line[:, 0] = np.radians(line[:, 0]) * AROUND
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    dense = np.linspace(0.0, along[-1], 600)
    curve = np.stack([np.interp(dense, along, line[:, c]) for c in range(2)], axis=1)
    away = cKDTree(curve).query(np.stack([flat, where[:, 1]], axis=1))[0]
    below = where[:, 1] < np.interp(flat, *line.T)
    return np.asarray(np.where(below, -away, away))
