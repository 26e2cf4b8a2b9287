"""The hairline around the scalp. Lengths are mm on a face of average size."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial import cKDTree

from ..array_types import Array
from ..geometry.smoothstep import smoothstep
from .landmarks import FaceFrame

HAIRLINE = np.array(
    # azimuth from the front about the axis of the head in degrees, height above the eyes
    [
        *((0, 62), (10, 62.5), (20, 64), (29, 63), (36, 57), (42, 46), (48, 32), (55, 24), (61, 18), (64, 8)),
        *((66, -8), (69, -19), (76, -20), (80, -14), (82, 4), (86, 15), (95, 20), (106, 15), (113, 2), (118, -22)),
        *((124, -40), (134, -52), (150, -62), (168, -67), (180, -68)),
    ],
    dtype=np.float64,
)
"""The line over the forehead, down the temple before the ear, and around the ear to the nape."""

AXIS_BEHIND_ZYGION = 12.0
"""From the zygion back to the upright axis of the head."""

HEAD_RADIUS = 80.0
"""Radius about this axis at which azimuths are measured as lengths."""

FOREHEAD, TEMPLE = 30.0, 60.0
"""The line follows the trichion up to the first of these azimuths, the zygion from the second one on."""

EAR_HEIGHT = 16.0
"""The zygion lies this far below the eyes on the built-in head; a line over a higher zygion is higher by as much."""


def hair_cover(points: Array, landmarks: Mapping[str, Array], frame: FaceFrame) -> Array:
    """Signed distance (n,) of points (n, 3) from the hairline along the head; positive where hair grows.

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
    azimuth = np.degrees(np.arctan2(np.abs(where[:, 0]), where[:, 2] - ear[2] + AXIS_BEHIND_ZYGION))
    line = HAIRLINE.copy()
    share = smoothstep((line[:, 0] - FOREHEAD) / (TEMPLE - FOREHEAD))
    line[:, 1] += (1.0 - share) * (top[1] - line[0, 1]) + share * (ear[1] + EAR_HEIGHT)
    flat = np.radians(azimuth) * HEAD_RADIUS
    line[:, 0] = np.radians(line[:, 0]) * HEAD_RADIUS
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    dense = np.linspace(0.0, along[-1], 600)
    curve = np.stack([np.interp(dense, along, line[:, c]) for c in range(2)], axis=1)
    away = cKDTree(curve).query(np.stack([flat, where[:, 1]], axis=1))[0]
    below = where[:, 1] < np.interp(flat, *line.T)
    return np.asarray(np.where(below, -away, away))
