"""What comes with a face beside its skin: eyes, teeth, lashes, brows, hair, glasses. They are carried along."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.spatial import cKDTree

from ..geometry.topology import unique_edges
from ..mesh import merged_texture
from ..mesh.arrays import COLORS, PART, SOURCE, with_data
from .eyeball import RADIUS, Eyeball
from .landmarks import FaceFrame

Array = npt.NDArray[np.float64]
Follows = Literal["skull", "mandible", "eye", "skin"]

NEAR_EYE, AROUND_EYE = 1.6, 0.1
"""What lies within so many radii of the middle of an eye, and this farther, in distances between the pupils, belongs
to it.
"""

BALLS = (0.7, 2.6)
"""Radii of balls that may be eyes, relative to an adult's: up to where those of a child or a cartoon touch."""

UNEVEN, OPEN = 0.25, 1.2
"""How far a ball may bulge, as with its cornea, and how broad the piece of it is that there is at least, in radii."""

ARCH, ROWS, TONGUE = 0.4, 0.04, 0.2
"""How broad a row of teeth is, how far apart two are, and how broad a tongue is, in distances between the pupils."""

ON_SKIN = 0.12
"""Parts that nowhere are farther from the skin than this, in distances between the pupils, follow the skin."""


SPECK = 0.02
"""Parts smaller than this, in distances between the pupils, are dropped, unless they belong to an eye or a mouth."""


CARD = 0.04
"""Sheets wider than this share of all lashes are cards with a picture of many hairs; a hair is a tenth as wide."""


@dataclass(frozen=True, eq=False)
class Part:
    """Something that comes with a face beside its skin.

    Attributes
    ----------
    mesh : pyvista.PolyData
        At rest, in the coordinates of the face, with the point data of the input.
    follows : {"skull", "mandible", "eye", "skin"}
        What carries it.
    side : {"l", "r", ""}
        Of an eye.
    texture : ndarray of uint8, shape (h, w, 3 or 4), optional
        Colour, and how opaque it is, over the mesh's texture coordinates.
    source_points : ndarray of int, shape (k,), optional
        The number that each point has in the mesh that the face was made from.
    """

    mesh: pv.PolyData
    follows: Follows
    side: str = ""
    texture: npt.NDArray[np.uint8] | None = None
    source_points: npt.NDArray[np.int64] | None = None

    @cached_property
    def lacks_picture(self) -> bool:
        """Whether it is cards, flat and wide, that should show a picture of hairs, and has neither that nor colours."""
        if self.texture is not None or COLORS in self.mesh.point_data:
            return False
        points, triangles = np.asarray(self.mesh.points), np.asarray(self.mesh.regular_faces)
        label = np.asarray(self.mesh.cell_data[PART])
        a, b, c = (points[triangles[:, corner]] for corner in range(3))
        across = 0.5 * np.cross(b - a, c - a)
        area = np.bincount(label, np.linalg.norm(across, axis=1))
        flat = np.linalg.norm([np.bincount(label, values) for values in across.T], axis=0) > 0.5 * area  # no tube
        edges, sides = unique_edges(triangles)
        length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        length[np.bincount(sides.ravel()) > 1] = 0.0
        border = np.bincount(label, length[sides].sum(axis=1))
        cards = flat & (2.0 * area > CARD * np.ptp(points, axis=0).max() * border)
        return bool(area[cards].sum() > 0.5 * area.sum())


def follower(name: str, mesh: pv.PolyData, texture: npt.NDArray[np.uint8] | None = None) -> Part:
    """The part of a name: ``eye_l`` turns with the eye, lower teeth and tongue with the jaw, lashes with the skin."""
    source, side = mesh.point_data.pop(SOURCE, None), ""  # of a new object
    follows: Follows = "skin" if name.split("_")[0] in ("lashes", "fuzz") else "skull"
    if name.startswith("eye_"):
        follows, side = "eye", name[-1]
    elif name in ("lower_teeth", "tongue"):
        follows = "mandible"
    return Part(mesh, follows, side, texture, None if source is None else np.asarray(source))


# --- what is what -----------------------------------------------------------------------------------------


def named_parts(
    others: pv.PolyData, skin: pv.PolyData, landmarks: Mapping[str, Array], frame: FaceFrame
) -> tuple[dict[str, Part], int]:
    """Eyes, teeth, tongue, lashes, glasses, hair, told apart by size and place, and how many specks were dropped.

    Parameters
    ----------
    others : pyvista.PolyData
        All that is not skin; its cell data "part" number what is connected.
    skin : pyvista.PolyData
    landmarks : dict of str to ndarray, shape (3,)
    frame : FaceFrame
    """
    triangles, label = np.asarray(others.regular_faces), np.asarray(others.cell_data[PART])
    local = (np.asarray(others.points) - frame.origin) @ frame.axes.T / frame.pupil_distance
    marks = {n: (p - frame.origin) @ frame.axes.T / frame.pupil_distance for n, p in landmarks.items()}
    away = cKDTree(np.asarray(skin.points)).query(others.points)[0] / frame.pupil_distance
    order = np.argsort(label, kind="stable")
    ends = np.flatnonzero(np.diff(label[order], prepend=-1, append=label.max() + 1))
    pieces = [(piece, np.unique(triangles[piece])) for piece in (order[begin:end] for begin, end in pairwise(ends))]
    eyes = {side: _socket([local[used] for _, used in pieces], marks[f"eye_{side}_centre"]) for side in "lr"}
    kinds = [_kind(local[used], away[used], marks, eyes) for _, used in pieces]
    inside = [local[used] for (_, used), kind in zip(pieces, kinds, strict=True) if kind == "teeth"]
    line = _bite(inside, _lips(marks)[1])
    rows: dict[str, list[npt.NDArray[np.int64]]] = {}
    for (piece, used), kind in zip(pieces, kinds, strict=True):
        name = _jaw_with(local[used], line) + "_teeth" if kind == "teeth" else kind
        rows.setdefault(name, []).append(piece)
    specks = len(rows.pop("speck", []))
    found = {}
    for name in sorted(rows):
        chosen = np.sort(np.concatenate(rows[name]))
        kept, renumbered = np.unique(triangles[chosen], return_inverse=True)
        mesh = with_data(others, renumbered.reshape(-1, 3), kept)
        for array in others.cell_data:
            mesh.cell_data[array] = np.asarray(others.cell_data[array])[chosen]
        if COLORS in mesh.point_data and np.asarray(mesh.point_data[COLORS]).min() == 255:
            del mesh.point_data[COLORS]  # where others have colours
        found[name] = follower(name, mesh, merged_texture(mesh))
    return found, specks


def _socket(pieces: list[Array], centre: Array) -> tuple[Array, float]:
    """Centre and radius of an eye: of the largest ball that there is about where it is expected, or as expected."""
    balls = [ball for ball in (_eyeball(points, centre, RADIUS) for points in pieces) if ball is not None]
    return max(balls, key=lambda ball: ball[1], default=(centre, RADIUS))


def _kind(points: Array, away: Array, marks: Mapping[str, Array], eyes: Mapping[str, tuple[Array, float]]) -> str:
    """What a part is, from its points (n, 3) [left, up, forward] and their distances from the skin.

    All lengths are in distances between the pupils.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    middle, extent = 0.5 * (low + high), high - low
    for side, (centre, radius) in eyes.items():
        if np.linalg.norm(points - centre, axis=1).max() > NEAR_EYE * radius + AROUND_EYE:
            continue
        # Balls, corneas and irises are round and lie before or about the middle of the eye; lashes stand off its rim.
        flat = np.linalg.norm(middle[:2] - centre[:2])
        lengths = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        hair = lengths[1] < 0.2 * lengths[0]
        round_ = not hair and (extent[1] > 0.6 * extent[0] or extent[:2].max() < 0.8 * RADIUS)
        return f"eye_{side}" if flat < 0.5 * radius and round_ else f"lashes_{side}"
    lips = _lips(marks)
    within = np.abs(middle - lips)
    behind = middle[2] < lips[2] + 0.05 and high[2] < lips[2] + 0.25
    if behind and within[0] < 0.55 and within[1] < 0.5 and middle[2] > lips[2] - 1.2 and extent.max() < 1.4:
        tongue = extent[0] > TONGUE and extent[2] > 1.2 * extent[0] and within[0] < 0.1  # deep, and in the middle
        return "tongue" if tongue else "teeth"
    if extent.max() < SPECK:
        return "speck"
    if away.max() < ON_SKIN:
        return "fuzz"
    bridge = marks["nasion"]
    if high[2] > bridge[2] and high[1] < bridge[1] + 0.7 and low[1] > bridge[1] - 0.9 and extent[0] > 0.4:
        return "glasses"
    hangs = low[2] < marks["nose_tip"][2] - 1.2 and high[1] > lips[1]  # what ends below is a neck or a pedestal
    fringe = high[1] > bridge[1] + 1.0  # from above the forehead, however far down
    return "hair" if middle[1] > bridge[1] or hangs or fringe else "other"


def _lips(marks: Mapping[str, Array]) -> Array:
    return np.asarray(np.mean([marks[n] for n in ("upper_lip_mid", "lower_lip_mid", "mouth_l", "mouth_r")], axis=0))


def _bite(pieces: list[Array], lips: float) -> float:
    """The height at which two rows of teeth meet: between the highest and the lowest, or the lips' if there is one."""
    heights = [0.5 * (points[:, 1].min() + points[:, 1].max()) for points in pieces if np.ptp(points[:, 0]) > ARCH]
    return 0.5 * (min(heights) + max(heights)) if heights and max(heights) - min(heights) > ROWS else lips


def _jaw_with(points: Array, line: float) -> str:
    return "lower" if points[:, 1].min() + points[:, 1].max() <= 2.0 * line else "upper"


def ball_of(points: Array) -> tuple[Array, float]:
    """Centre and radius of the sphere that fits points (n, 3) best.

    Examples
    --------
    >>> centre, radius = ball_of(np.array([[2.0, 0, 0], [0, 2, 0], [-2, 0, 0], [0, 0, 2], [0, -2, 0]]))
    >>> np.allclose(centre, 0.0), round(radius, 9)
    (True, 2.0)
    """
    middle = points.mean(axis=0)
    offset = points - middle
    right = (offset**2).sum(axis=1)
    solution = np.linalg.lstsq(np.column_stack([2.0 * offset, np.ones(len(offset))]), right, rcond=None)[0]
    radius = float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 0.0)))
    return middle + solution[:3], radius


def _eyeball(points: Array, centre: Array, adult: float) -> tuple[Array, float] | None:
    """Centre and radius of the ball, or its front, that points (n, 3) are; none if it is no eye about this place.

    `adult` is the radius of an eye as it is expected.
    """
    if len(points) < 9:
        return None
    middle, radius = ball_of(points)
    across = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    extent = np.sort(np.ptp(points @ across.T, axis=0))
    even = np.abs(np.linalg.norm(points - middle, axis=1) - radius).max() < UNEVEN * radius
    right = BALLS[0] < radius / adult < BALLS[1] and np.linalg.norm(middle - centre) < radius
    return (middle, radius) if even and right and extent[1] > OPEN * radius else None


def eyes_of(eyes: list[Eyeball], parts: Mapping[str, Part], frame: FaceFrame) -> list[Eyeball]:
    """The eyeballs, moved to the eyes that came with the face where these are balls."""
    out = []
    for eye in eyes:
        part = parts.get(f"eye_{eye.side}")
        if part is not None:
            label = np.asarray(part.mesh.cell_data[PART])
            largest = np.asarray(part.mesh.regular_faces)[label == np.argmax(np.bincount(label))]
            points = np.asarray(part.mesh.points)[np.unique(largest)]
            ball = _eyeball(points, eye.centre, RADIUS * frame.pupil_distance)
            if ball is not None:
                eye = replace(eye, centre=ball[0], radius=ball[1])
        out.append(eye)
    return out


# --- how it moves -----------------------------------------------------------------------------------------
