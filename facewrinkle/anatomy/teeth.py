"""Teeth: the two dental arches of an adult, placed behind the lips by landmarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..array_types import Array, IntArray
from ..geometry import ring_triangles, unit
from .landmarks import FaceFrame, lips_middle

CROWN_WIDTHS = {"upper": (8.5, 6.5, 7.5, 7.0, 7.0, 10.0, 9.0), "lower": (5.0, 5.5, 7.0, 7.0, 7.0, 11.0, 10.5)}
"""Widths of the crowns from the middle backwards, mm (Nelson, "Wheeler's Dental Anatomy")."""

CROWN_HEIGHTS = {"upper": (10.5, 9.0, 10.0, 8.5, 8.5, 7.5, 7.0), "lower": (9.0, 9.5, 11.0, 8.5, 8.0, 7.5, 7.0)}
"""Heights of the crowns, mm (same source)."""

CROWN_THICKNESS = (6.0, 6.0, 7.0, 8.0, 8.5, 10.5, 10.5)
"""Thickness of the crowns from lip to tongue at the gum, mm."""

SHORT = {"upper": (0.0, 0.7, 0.0, 0.3, 0.3, 0.0, 0.0), "lower": (0.0,) * 7}
"""How far the crowns end before the edge of the first incisor, mm."""

ELLIPSE = {"upper": (29.0, 46.0), "lower": (27.0, 43.5)}
"""Half width and depth of the arch's outer border, mm."""

BEHIND_LIPS = 9.5
"""From the front of the lips back to the upper incisors, mm, unless the lining of the lips reaches farther."""

BELOW_LIPS = 2.6
"""From the line where the lips meet down to the edges of the upper incisors, mm."""

OVERJET, OVERBITE = 2.0, 3.2
"""From the edges of the upper incisors back, and up, to those of the lower ones, mm."""

OCCLUSAL_PLANE = 0.164
"""Rise of the edges of the teeth per length backwards: their plane is inclined by 9.3 degrees on average (W. B. Downs,
"Variations in facial relationships", Am J Orthod 34, 1948). So the lower lip of a smile follows the upper teeth.
"""

CROWN_BULGE = 0.25
"""Distance from the arch's outer border at which skin meets the crowns, mm: they bulge by .2 mm."""

END_RADIUS = 5.0
"""Radius with which the outer border rounds off beyond the edges of the incisors, mm."""

BEHIND_TEETH = 3.0
"""Skin that lies farther behind the outer border of the teeth at rest, mm, is lining of the mouth."""

GUM = np.array([195.0, 112.0, 105.0])
"""Color of the gum, in the light of the teeth beside it."""

CROWN_SIDES, CROWN_RINGS = 14, 7
"""Points around a crown, and rings of them from its edge into the gum."""


@dataclass(frozen=True, eq=False)
class Arch:
    """The teeth and gum of one jaw at rest, in the unit of the mesh.

    Attributes
    ----------
    jaw : {"upper", "lower"}
        The upper arch is part of the skull, the lower one goes with the mandible.
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
        Counter-clockwise seen from outside.
    paint : ndarray of uint8, shape (n, 3)
        Color.
    edge : ndarray, shape (3,)
        Middle of the edges of the incisors.

    Examples
    --------
    The width of the upper arch, mm:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> upper, lower = teeth_of(face.landmarks, face.frame)
    >>> round(float(np.ptp(upper.points[:, 0])))
    61
    """

    jaw: str
    points: Array
    triangles: IntArray
    paint: npt.NDArray[np.uint8]
    edge: Array


def place_of(jaw: str, behind_lips: float = BEHIND_LIPS) -> tuple[float, float]:
    """Return how far below and behind the middle of the lips the edges of the incisors of a jaw are, mm on a face of
    average size, by the distance of the upper ones behind the lips.

    Examples
    --------
    >>> place_of("upper"), np.round(place_of("lower"), 1).tolist()
    ((2.6, 9.5), [-0.6, 11.5])
    """
    return (BELOW_LIPS, behind_lips) if jaw == "upper" else (BELOW_LIPS - OVERBITE, behind_lips + OVERJET)


def behind_lips(points: Array, landmarks: Mapping[str, Array], frame: FaceFrame) -> float:
    """Return the distance from the front of the lips back to the upper incisors, mm on a face of average size.

    The arches stand behind the lining of the lips, at the heights of the crowns and up to 4 mm beyond, where skin
    before the gum slides over the crowns. Skin that lies much farther back lines the mouth.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Places on the skin at rest.
    landmarks : mapping of str to ndarray, shape (3,)
        Middles of the lips and corners of the mouth.
    frame : FaceFrame

    Examples
    --------
    Lining that ends 12 mm behind the lips:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> behind_lips(face.points, face.landmarks, face.frame)
    9.5
    >>> lining = lips_middle(face.landmarks) - 12.0 * face.frame.scale * face.frame.axes[2]
    >>> round(behind_lips(lining[None], face.landmarks, face.frame), 2)
    12.3
    """
    local = frame.local_mm(points) - frame.local_mm(lips_middle(landmarks))
    most = BEHIND_LIPS
    for jaw, (half, depth) in ELLIPSE.items():
        side, (down, back) = 1.0 if jaw == "upper" else -1.0, place_of(jaw)
        left, up, forward = local.T + np.array([[0.0], [down], [depth + back]])
        before = (forward > 0.0) & (np.abs(left) < half) & (side * up < max(CROWN_HEIGHTS[jaw]) + 4.0)
        left, up, forward = left[before], up[before], forward[before]
        before = depth * (np.hypot(left / half, forward / depth) - 1.0) > -BEHIND_TEETH
        room = CROWN_BULGE + 0.05 - 0.5 * np.maximum(-side * up, 0.0) ** 2 / END_RADIUS
        reach = np.maximum(1.0 + room / depth, 0.0)
        wanted = depth * np.sqrt(np.maximum(reach**2 - (left / half) ** 2, 0.0))
        most = max(most, BEHIND_LIPS + float((wanted - forward)[before].max(initial=0.0)))
    return most


def teeth_of(landmarks: Mapping[str, Array], frame: FaceFrame, behind_lips: float = BEHIND_LIPS) -> tuple[Arch, Arch]:
    """Return the upper and the lower arch behind the lips.

    Parameters
    ----------
    landmarks : mapping of str to ndarray, shape (3,)
        Middles of the lips and corners of the mouth.
    frame : FaceFrame
    behind_lips : float
        From the front of the lips back to the upper incisors, mm on a face of average size.

    Returns
    -------
    upper, lower : Arch

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> upper, lower = teeth_of(face.landmarks, face.frame)
    >>> upper.jaw, lower.jaw
    ('upper', 'lower')
    """
    lips = lips_middle(landmarks)
    arches = []
    for jaw in ("upper", "lower"):
        points, triangles, paint = _arch(jaw)
        shift = np.array([0.0, *place_of(jaw, behind_lips)])
        placed = lips + frame.scale * (points - shift) @ frame.axes
        edge = lips - frame.scale * shift @ frame.axes
        arches.append(Arch(jaw, placed, triangles.astype(np.int32), np.rint(paint).astype(np.uint8), edge))
    return arches[0], arches[1]


def _arch(jaw: str) -> tuple[Array, IntArray, Array]:
    """Points [left, up, forward] in mm, triangles and colors; the incisors' edges meet the outer border at 0."""
    sign = 1.0 if jaw == "upper" else -1.0
    parts = [_gum(jaw)]
    crowns = ring_triangles(CROWN_SIDES, CROWN_RINGS, first=CROWN_SIDES * CROWN_RINGS)
    edges = (0.28, 0.28, 0.4, 0.75, 0.8, 0.85, 0.85)  # thickness there, relative to that at the gum
    numbers = (0, 0, 1, 2, 2, 4, 4)  # of cusps; incisors have an edge
    yellow = (0.0, 0.1, 0.35, 0.25, 0.25, 0.25, 0.25)  # canines most of all
    tables = CROWN_WIDTHS[jaw], CROWN_HEIGHTS[jaw], SHORT[jaw], CROWN_THICKNESS, edges, numbers, yellow
    place = 0.0
    for width, height, short, thickness, edge, cusps, tint in zip(*tables, strict=True):
        centre, outward = _on_border(jaw, np.array(place + 0.5 * width))
        place += width
        crown = _crown(width, height, thickness, edge, cusps)
        along = np.array([outward[2], 0.0, -outward[0]])
        on_border = centre + crown[:, :1] * along
        rise = crown[:, 1:2] + short - sign * OCCLUSAL_PLANE * on_border[:, 2:]
        left = on_border + rise * [0.0, 1.0, 0.0] + crown[:, 2:] * outward
        share = np.clip(crown[:, 1] / height, 0.0, 1.0)
        beside = (2.0 * crown[:, :1] / width) ** 4
        # Crowns take 40 % of the light from each other's sides.
        paint = _enamel(share, tint) * (1.0 - 0.4 * beside)
        parts += [(left, crowns, paint), (left * [-1, 1, 1], crowns[:, ::-1], paint)]
    offsets = np.cumsum([0] + [len(points) for points, _, _ in parts])
    points = np.concatenate([points for points, _, _ in parts]) * [1.0, sign, 1.0]
    triangles = np.concatenate([t + offset for (_, t, _), offset in zip(parts, offsets, strict=False)])
    return points, triangles[:, :: int(sign)], np.concatenate([paint for _, _, paint in parts])


def _on_border(jaw: str, place: Array) -> tuple[Array, Array]:
    """Points (..., 3) at arc lengths from the middle on the left outer border, and the outward directions."""
    half, depth = ELLIPSE[jaw]
    turn = np.linspace(0.0, 0.5 * np.pi, 400)
    x, z = half * np.sin(turn), depth * (np.cos(turn) - 1.0)
    at = np.interp(place, np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(z)))), turn)
    zero = np.zeros_like(at)
    outward = unit(np.stack([depth * np.sin(at), zero, half * np.cos(at)], axis=-1))
    return np.stack([half * np.sin(at), zero, depth * (np.cos(at) - 1.0)], axis=-1), outward


def _crown(width: float, height: float, thickness: float, edge: float, cusps: int) -> Array:
    """Points (along the arch, up from the edge, out) of a crown, ring by ring from its edge into the gum."""
    level = np.linspace(0.0, 1.0, CROWN_RINGS)[:, None] ** 1.5
    turn = 2.0 * np.pi * np.arange(CROWN_SIDES) / CROWN_SIDES
    boxy = np.where(np.cos(turn) > 0.0, 0.8, 1.0)  # towards the lips; towards the tongue crowns are round
    across, out = (np.sign(f) * np.abs(f) ** boxy for f in (np.sin(turn), np.cos(turn)))
    round_off = 1.0 - 0.2 * np.exp(-level / 0.02)  # the edge is rounded
    half = 0.5 * width * (0.99 - 0.15 * level**1.5 - 0.12 * (1.0 - level) ** 8) * round_off
    deep = 0.5 * thickness * (edge + (1.0 - edge) * level**0.8) * round_off
    bulge = 0.7 * np.sin(np.pi * np.minimum(1.3 * level, 1.0)) - 0.5
    rise = 1.15 * height * level + (0.4 + 0.3 * across) * np.exp(-level / 0.15) * across**2  # more so on the far side
    first = 0.25 * np.pi if cusps == 4 else 0.0  # of four, two are on each side
    steep = 2.0 if cusps == 1 else 1.0
    above_grooves = 1.1  # height of cusps, mm, half that of canines
    rise += steep * above_grooves * np.exp(-level / (0.1 * steep)) * np.sin(0.5 * cusps * (turn - first)) ** 2
    # The outer face stays upright; the inner one leans to the edge.
    rings = np.stack([half * across, rise, deep * (out - 1.0) + bulge], axis=-1)
    pit = [0.0, above_grooves if cusps > 1 else 0.0, 0.0]
    return np.vstack([rings.reshape(-1, 3), rings[0].mean(axis=0) + pit])


def _enamel(height: Array, yellow: float) -> Array:
    """Colors (n, 3) at shares (n,) of a crown's height: it is clear at the edge, and yellow dentine shows at the gum.

    A `yellow` share of that shows everywhere.
    """
    edge, white, cream, neck = [218, 217, 214], [241, 234, 221], [240, 229, 210], np.array([222.0, 203.0, 176.0])
    colors = np.transpose([edge, white, cream, neck])
    enamel = np.stack([np.interp(height, (0.0, 0.14, 0.5, 1.0), color) for color in colors], axis=1)
    return np.asarray(enamel + yellow * (neck - white))


def _gum(jaw: str) -> tuple[Array, IntArray, Array]:
    """The gum over the roots of both sides: a ridge along the arch, scalloped around the crowns."""
    ends = np.cumsum(CROWN_WIDTHS[jaw])
    share = np.array([0.0, 0.06, 0.16, 0.33, 0.5, 0.67, 0.84, 0.94])
    place = np.append(ends[:, None] + (share - 1.0) * np.array(CROWN_WIDTHS[jaw])[:, None], ends[-1])
    inside = np.append(np.tile(share, len(ends)), 1.0)
    height = np.interp(place, ends - 0.5 * np.array(CROWN_WIDTHS[jaw]), np.add(CROWN_HEIGHTS[jaw], SHORT[jaw]))
    thick = np.interp(place, ends - 0.5 * np.array(CROWN_WIDTHS[jaw]), CROWN_THICKNESS)
    border, outward = _on_border(jaw, place)
    height -= (1.0 if jaw == "upper" else -1.0) * OCCLUSAL_PLANE * border[:, 2]
    papilla = 1.6 * np.abs(2.0 * inside - 1.0) ** 3
    # Profile [out, up]: under the tongue's side, over the crowns' necks, and up the outer side.
    profile = [(-1.0, 12.0), (-1.05, 2.0), (-0.95, 0.3), (-0.15, 0.3), (-0.06, -0.3), (0.04, 0.6), (0.09, 3.0)]
    profile.append((0.12, 12.0) if jaw == "upper" else (-0.35, 12.0))  # drawn back, for the fold of the chin
    rows = [
        border + (out * thick)[:, None] * outward + (height + up - papilla * (up < 1.0))[:, None] * [0.0, 1.0, 0.0]
        for out, up in profile
    ]
    left = np.stack(rows, axis=1)
    whole = np.concatenate([left[:0:-1] * [-1.0, 1.0, 1.0], left])
    m, n = whole.shape[:2]
    triangles = ring_triangles(n, m, closed=False)[:, [0, 2, 1]]
    return whole.reshape(-1, 3), triangles, np.tile(GUM, (m * n, 1))
