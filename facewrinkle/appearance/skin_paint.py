"""Colors of skin by its place on a face: red, yellow and gray zones, eye sockets, lips, and shaved hair;
and the shading of furrows.

Landmarks place everything, so it fits any mesh. Colors are numbers from 0 to 255; lengths are mm on a face whose
pupils are 63 mm apart.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from ..anatomy import Cavities, Face, FaceFrame, hair_cover, of_side
from ..anatomy.cavities import INSIDE_DEPTH
from ..anatomy.cropped_hair import beard
from ..anatomy.head import HAIR_COLOR
from ..array_types import Array, BoolArray, IntArray
from ..geometry import smoothstep
from ..mesh.arrays import rest_of

SKIN_COLOR = (211.0, 169.0, 142.0)

TINTS: tuple[tuple[str, tuple[float, float, float], float, tuple[float, float, float], float], ...] = (
    # landmark, offset [outwards, up, forward], reach, color, strength
    ("forehead_mid", (0, 0, 0), 30, (222, 180, 148), 0.55),
    ("brow_mid", (8, 14, 0), 20, (220, 176, 146), 0.4),
    ("glabella", (0, -4, 0), 9, (210, 152, 128), 0.35),
    ("malar", (0, -9, 2), 15, (205, 130, 110), 0.42),
    ("malar", (-14, -2, 4), 11, (207, 138, 118), 0.25),
    ("malar", (14, 6, -14), 16, (208, 142, 120), 0.2),
    ("nose_tip", (0, 1, 0), 10, (203, 120, 102), 0.58),
    ("ala", (3, 5, -1), 7, (196, 110, 92), 0.5),
    ("subnasale", (0, -4, 0), 8, (206, 142, 122), 0.35),
    ("mouth", (5, -5, -1), 13, (207, 148, 124), 0.45),
    ("pogonion", (0, 0, 0), 12, (206, 142, 120), 0.4),
    ("eye_centre", (0, 5, 12), 11, (206, 152, 132), 0.3),
    ("eye_centre", (2, -11, 10), 9, (192, 140, 126), 0.3),
    ("eye_inner", (-2, 9, 1), 9, (204, 146, 124), 0.45),
    ("eye_inner", (2, 0, -1), 3, (200, 130, 118), 0.5),
    ("eye_outer", (1, 0, -1), 4, (198, 142, 124), 0.3),
    ("zygion", (9, -12, -16), 17, (206, 128, 110), 0.4),
    ("gonion", (0, -40, 0), 34, (204, 158, 128), 0.45),
)

SHAVED = 0.10
"""Share of the hair's color on a shaved head: more looks like a cap, and ends in a line as coarse as the mesh."""

LIP_COLOR = (176.0, 106.0, 95.0)

LID, FLESH, DEEP_FLESH = (
    np.array(color, dtype=np.float64) for color in ((208, 150, 132), (190, 112, 100), (120, 58, 52))
)
"""Colors of the flesh between lids and eyeballs, at the margins, behind them, and at the ball."""


class SkinPainter:
    """Paints a face that has no colors of its own: skin, lips, shaved hair, and the dark of mouth and nostrils.

    Parameters
    ----------
    face : Face
        With landmarks. Hair is painted only if the mesh is a whole head: on a mask it would look like dirt.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> SkinPainter(face)(face.points).dtype
    dtype('uint8')
    """

    def __init__(self, face: Face) -> None:
        self._face = face
        self._cavities = face.cavities
        # Depth in nostrils is measured as seen from 40 degrees below: from the front, wings and sill hide it.
        self._nostrils = Cavities(face.points, face.triangles, face.landmarks, face.frame.tilted(40.0))
        self._lining = face.lining
        self._openings = [opening for opening in face.eyelid_openings.values() if opening.thick]
        self._tree = cKDTree(face.points)
        self._sockets = [opening.lining(face.points, face.edges, face.normals) for opening in self._openings]
        where = face.frame.local_mm(face.points)
        ear, top = (face.frame.local_mm(face.landmarks[name]) for name in ("zygion_l", "trichion"))
        # A mesh is a whole head if it reaches far above the hairline and behind the ears.
        self._hair = bool((where[:, 1].max() > top[1] + 25.0) & (where[:, 2].min() < ear[2] - 50.0))

    def __call__(self, points: Array) -> npt.NDArray[np.uint8]:
        """Return the colors (n, 3) of points of the face at rest."""
        landmarks, frame = self._face.landmarks, self._face.frame
        color = complexion(points, landmarks, frame)
        depth, lined = self._cavities.depth(points), self._lining.holds(points)
        depth[~lined & self._cavities.beside(points)] = 0.0
        creased = smoothstep((depth - 0.3) / 1.2) * self._by_corners(points)
        red = np.maximum(lips(points, landmarks, frame), creased)
        color += 0.7 * red[:, None] * (np.array(LIP_COLOR) - color)
        if self._hair:
            hair = SHAVED * smoothstep(hair_cover(points, landmarks, frame) / 14.0)[:, None]
            color += hair * (np.array(HAIR_COLOR) - color)
        hidden = 11.0  # the depth whose color lining has that cannot be seen from the front
        depth[lined & (depth < INSIDE_DEPTH)] = hidden
        far = smoothstep(2.0 * depth / hidden - 1.0)  # so far behind what is seen, there are no rims of nostrils
        rims = (1.0 - far) * self._cavities.at_nostrils(points)
        # Colors in mouth and nostrils, depths at which they begin, and further depths over which they grow to full.
        colors = (((134.0, 66.0, 60.0), 1.5, 5.0), ((34.0, 13.0, 12.0), 6.0, 14.0))
        # Nostrils darken 2.2 times as fast as the mouth, from 1.3 mm on: above, rims are rounded.
        for where, inside in ((1.0 - rims, depth), (rims, 2.2 * (self._nostrils.depth(points) - 1.3))):
            for tint, begin, over in colors:
                color += (where * smoothstep((inside - begin) / over))[:, None] * (np.array(tint) - color)
        away, nearest = self._tree.query(points)
        for opening, socket in zip(self._openings, self._sockets, strict=True):
            behind = opening.behind(points, socket[nearest] & (away == 0.0))
            strength = smoothstep(behind / 0.3) * (0.75 + 0.25 * behind)  # whole at the ball
            color += strength[:, None] * (flesh(behind) - color)
        return np.asarray(np.rint(color), dtype=np.uint8)

    def _by_corners(self, points: Array) -> Array:
        """Nearness (0 to 1) of points to the corners of the mouth, where the lips end in a crease."""
        where = self._face.frame.local_mm(points)
        corners = [self._face.frame.local_mm(self._face.landmarks[f"mouth_{side}"]) for side in "lr"]
        away = np.min([np.linalg.norm(where - corner, axis=1) for corner in corners], axis=0)
        return np.asarray(smoothstep((9.0 - away) / 4.0))


def complexion(points: Array, landmarks: Mapping[str, Array], frame: FaceFrame) -> Array:
    """Return the color (n, 3) of the skin at points of a face, without lips and hair.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> marks = face.landmarks
    >>> cheek, brow = complexion(np.array([marks["malar_l"], marks["forehead_mid"]]), marks, face.frame)
    >>> bool(cheek[0] / cheek[1] > brow[0] / brow[1])
    True
    """
    where = frame.local_mm(points)
    color = np.tile(SKIN_COLOR, (len(points), 1))
    for stem, offset, reach, tint, strength in TINTS:
        cover = np.zeros(len(points))
        for side, sign in (("l", 1.0), ("r", -1.0)):
            centre = frame.local_mm(landmarks[of_side(stem, side)]) + np.array(offset) * [sign, 1.0, 1.0]
            cover = np.maximum(cover, np.exp(-0.5 * ((where - centre) ** 2).sum(axis=1) / reach**2))
        color += strength * cover[:, None] * (np.array(tint) - color)
    color += 0.13 * beard(where, landmarks, frame)[:, None] * ([142.0, 118.0, 110.0] - color)
    return color


def flesh(behind: Array) -> Array:
    """Return the color (n, 3) of flesh at depths (n,) between the margin of a lid (0) and the ball (1)."""
    t = behind[:, None]
    return np.asarray(np.where(t < 0.4, LID + (FLESH - LID) * t / 0.4, FLESH + (DEEP_FLESH - FLESH) * (t - 0.4) / 0.6))


def lips(points: Array, landmarks: Mapping[str, Array], frame: FaceFrame) -> Array:
    """Return the strength (0 to 1) of the red of the lips at points of a face, by the landmarks of the mouth."""
    where = frame.local_mm(points)
    upper, lower = (frame.local_mm(landmarks[name]) for name in ("upper_lip_mid", "lower_lip_mid"))
    corner = 0.5 * (frame.local_mm(landmarks["mouth_l"]) + frame.local_mm(landmarks["mouth_r"]) * [-1.0, 1.0, 1.0])
    share = np.abs(where[:, 0]) / corner[0]
    bow = 1.0 - np.clip(share, 0.0, 1.0) ** 2.2
    middle = corner[1] + (0.55 * upper[1] + 0.45 * lower[1] - corner[1]) * bow
    above = (upper[1] - middle) * bow
    below = (middle - lower[1]) * bow
    height = where[:, 1] - middle
    off = np.where(height > 0.0, height - above, -height - below)
    front = smoothstep((where[:, 2] - corner[2] + 8.0) / 6.0)
    return np.asarray(front * smoothstep(0.5 - off / 3.0) * smoothstep((1.06 - share) / 0.1))


FIELD, OLD_FIELD = 0.62, (1.0, 0.66, 0.8)
"""Size of the fields between furrows, mm on a face of average size: of the young; of the old to the side, upwards and
forward, as they grow along the lines in which skin is relaxed.
"""

DEPTH, OLD_DEPTH = 0.06, 0.075
"""Depth of the furrows of the young and the old, mm."""


def relief_strength(points: Array, face: Face) -> Array:
    """Return the strength (n,) of the relief at points (n, 3) of a face at rest; 0 on lips, scalp and linings.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> nose, forehead, *lips = (
    ...     face.landmarks[name] for name in ("nose_tip", "forehead_mid", "upper_lip_mid", "lower_lip_mid")
    ... )
    >>> at = np.array([nose, forehead, np.mean(lips, axis=0)])
    >>> relief_strength(at, face).round(1).tolist()
    [1.8, 0.6, 0.0]
    """
    frame, marks = face.frame, face.landmarks
    where, strength = frame.local_mm(points), np.ones(len(points))
    elsewhere = (  # pores are wider, or skin is thinner or tighter: landmark, reach in mm, strength there
        ("nose_tip", 13.0, 1.8),
        ("ala", 10.0, 1.7),
        ("malar", 15.0, 1.5),
        ("pogonion", 10.0, 1.4),
        ("forehead_mid", 26.0, 0.6),
        ("eye_centre", 15.0, 0.3),
        ("eye_outer", 8.0, 0.8),
    )
    for stem, reach, factor in elsewhere:
        for name in sorted({of_side(stem, side) for side in "lr"}):
            away = ((where - frame.local_mm(marks[name])) ** 2).sum(axis=1)
            strength += (factor - 1.0) * np.exp(-0.5 * away / reach**2)
    bare = 1.0 - smoothstep((hair_cover(points, marks, frame) + 3.0) / 6.0)
    skin = 1.0 - smoothstep(face.cavities.depth(points) / 2.0)
    return np.asarray(strength * bare * skin * (1.0 - lips(points, marks, frame)))


# --- the shading of furrows -------------------------------------------------------------------------------------------


def furrow_shade(height: Array) -> Array:
    """Return about the share (n,) of the light that furrows lose, by the heights (n,) of their vertices, mm.

    Deep ones are held to lose 0.22 of it, and two thirds of that at a depth of 0.6 mm.
    """
    return np.asarray(-0.22 * np.expm1(np.minimum(height, 0.0) / 0.6))


def cavity_shading(skin: pv.PolyData, unit: float = 1.0) -> npt.NDArray[np.uint8]:
    """Return factors (n, 3) of a frame's colors, as bytes: furrows get less light, and lose less of the red.

    Between walls of the slope s the sky is 1 / sqrt(1 + s^2) of what it is in the open: a slit is dark, a valley of
    the same depth is not. Dimples, whose walls stand around them instead of facing each other, are lit by the lamps
    alone. The `unit` of the mesh is in mm.
    """
    height = np.ascontiguousarray(skin.point_data["W"], np.float64)
    dark = np.clip(-height / 0.15, 0.0, 1.0)  # 1 at the floor of a furrow, mm
    if dark.any():
        rest = rest_of(skin)  # without its furrows
        coherence, square = _slopes(rest, height / unit, skin.regular_faces, dark > 0.0)
        # Floors lose twice the light that the mean slopes tell, and 0.6 of it at the most.
        dark *= np.minimum(2.0 * coherence**2 * (1.0 - 1.0 / np.sqrt(1.0 + square)), 0.6)
    factors = np.empty((len(dark), 3), np.uint8)
    factors[:, 0], factors[:, 1:] = np.rint(255.0 - 191.25 * dark), np.rint(255.0 - 255.0 * dark)[:, None]
    return factors


def _slopes(points: Array, height: Array, triangles: IntArray, deep: BoolArray) -> tuple[Array, Array]:
    """Coherence (n,) of the directions in which a height rises, and its mean square slope, around vertices `deep` (n,).

    Coherence is that of the structure tensor, ((p - q) / (p + q))^2 with its two eigenvalues p and q: 1 on a furrow, 0
    in a round pit. Both are means over some rings of triangles: the width of a furrow, as refinement samples it.
    """
    around, rings = deep.copy(), 3
    for _ in range(rings):
        near = triangles[around[triangles].any(axis=1)]
        around[near] = True
    i, j, k = near.T
    b, c = points[j] - points[i], points[k] - points[i]
    normal = np.cross(b, c)
    double = np.maximum(np.linalg.norm(normal, axis=1), 1e-150)
    rise = np.cross(normal, (height[j] - height[i])[:, None] * c - (height[k] - height[i])[:, None] * b)
    rise /= double[:, None] ** 2
    tensor = (rise[:, :, None] * rise[:, None]).reshape(-1, 9)
    to_corners = csr_array((np.repeat(double, 3), near.ravel(), np.arange(0, near.size + 1, 3)), (len(near), len(deep)))
    sums, area = to_corners.T @ tensor, to_corners.T @ np.ones(len(near))
    for _ in range(rings - 1):
        means = sums / np.maximum(3.0 * area, 1e-300)[:, None]
        sums = to_corners.T @ means[near].sum(axis=1)
    trace = sums[:, [0, 4, 8]].sum(axis=1)
    coherence = 2.0 * (sums**2).sum(axis=1) / np.maximum(trace**2, 1e-300) - 1.0
    return np.clip(coherence, 0.0, 1.0), trace / np.maximum(area, 1e-300)
