"""Parts that come with a face besides its skin, and go along with it: eyes, teeth, tongue, lashes, hair, glasses."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.spatial import cKDTree

from ..array_types import Array, IntArray
from ..geometry.normals import vertex_normals
from ..geometry.topology import components
from ..mesh import COLORS, Surface, has_colors, merged_texture
from .eyeball import RADIUS, Eyeball
from .landmarks import FaceFrame, mouth_middle

Follows = Literal["skull", "mandible", "eye", "skin"]

ALONG = "strand_along"
"""Array of a part's mesh: unit vectors along the hairs at its points, which turn with the part."""

# The file says what a piece is, or its place and size do. Lengths are in distances between the pupils. Numbers in
# brackets are those of the built-in head, whose eyes have a radius of 0.19.


@dataclass(frozen=True, eq=False)
class Part:
    """Something that comes with a face besides its skin.

    Attributes
    ----------
    mesh : pyvista.PolyData
        At rest, in the coordinates of the face, with the point data of the input.
    follows : {"skull", "mandible", "eye", "skin"}
        What it moves with.
    side : {"l", "r", ""}
        Side of an eye; "" for all else.
    texture : ndarray of uint8, shape (h, w, 3 or 4), optional
        Color, and opacity, over the mesh's texture coordinates.
    source_points : ndarray of int, shape (k,), optional
        Index of each point in the mesh that the face was made from.
    sheet : ndarray of int, shape (m,), optional
        Which connected piece each triangle belongs to, as seams may have split the pieces of a file. Default: as the
        triangles are connected.

    Examples
    --------
    A hat, which goes with the head:

    >>> Part(pv.Sphere(radius=90.0, center=(0, 120, 0)), follows="skull").mesh.n_points
    842
    """

    mesh: pv.PolyData
    follows: Follows
    side: str = ""
    texture: npt.NDArray[np.uint8] | None = None
    source_points: IntArray | None = None
    sheet: IntArray | None = None

    @cached_property
    def pieces(self) -> IntArray:
        """The number (m,) of the connected piece that each triangle belongs to, from 0.

        Examples
        --------
        >>> both = pv.Sphere() + pv.Icosahedron(center=(2, 0, 0))
        >>> np.bincount(Part(both, follows="skull").pieces).tolist()
        [1680, 20]
        """
        return components(np.asarray(self.mesh.regular_faces, np.int32)) if self.sheet is None else self.sheet

    @cached_property
    def lacks_picture(self) -> bool:
        """True for cards, mostly no hairs, that have neither the picture of hairs that they should show nor colors."""
        if self.texture is not None or has_colors(self.mesh.point_data):
            return False
        points, triangles = np.asarray(self.mesh.points), np.asarray(self.mesh.regular_faces)
        pieces = [points[np.unique(triangles[piece])] for piece in _pieces(self.pieces)]
        cards = sum(len(piece) for piece in pieces if not _is_strand(piece))
        return 2 * cards > sum(map(len, pieces))


def follower(name: str, mesh: pv.PolyData, texture: npt.NDArray[np.uint8] | None = None, **of_file: Any) -> Part:
    """Return the part of a name: ``eye_l`` turns with the eye, lower teeth and tongue with the jaw, lashes with the
    skin; `of_file` are its `source_points` and `sheet`.
    """
    side = ""
    follows: Follows = "skin" if name.split("_")[0] in ("lashes", "fuzz") else "skull"
    if name.startswith("eye_"):
        follows, side = "eye", name[-1]
    elif name in ("lower_teeth", "tongue"):
        follows = "mandible"
    return Part(mesh, follows, side, texture, **of_file)


# --- naming them ------------------------------------------------------------------------------------------


def named_parts(
    others: Surface,
    skin: Surface,
    landmarks: Mapping[str, Array],
    frame: FaceFrame,
) -> tuple[dict[str, Part], int]:
    """Return eyes, teeth, tongue, lashes, glasses and hair by name, and the number of specks that were dropped.

    Parameters
    ----------
    others : Surface
        All that is not skin, by its sheets. What the file calls each counts more than place and size.
    skin : Surface
    landmarks : dict of str to ndarray, shape (3,)
    frame : FaceFrame

    Examples
    --------
    >>> import facewrinkle as fw
    >>> from facewrinkle.mesh import Piece
    >>> face = fw.default_face()
    >>> ball = pv.Sphere(radius=12.0, center=face.eyes[0].centre)
    >>> ball = replace(Surface.of(ball), sheet=np.zeros(ball.n_cells, int))
    >>> monocle = replace(ball, pieces=(Piece(name="Head/Monocle_glasses"),))
    >>> [list(named_parts(b, Surface.of(face.mesh), face.landmarks, face.frame)[0]) for b in (ball, monocle)]
    [['eye_l'], ['glasses']]
    """
    local = frame.local(others.points)
    marks = {name: frame.local(place) for name, place in landmarks.items()}
    away = _height(others.points, skin) / frame.pupil_distance
    pieces = [(piece, np.unique(others.triangles[piece])) for piece in _pieces(others.sheet)]
    eyes = {side: _socket([local[used] for _, used in pieces], marks[f"eye_{side}_centre"]) for side in "lr"}
    said = [kind_said(others.pieces[others.piece[piece[0]]].name) for piece, _ in pieces]
    kinds = [
        _sided(kind, local[used], eyes) if kind else _kind(local[used], away[used], marks, eyes)
        for (_, used), kind in zip(pieces, said, strict=True)
    ]
    teeth = [local[used] for (_, used), kind in zip(pieces, kinds, strict=True) if kind == "teeth"]
    # Rows of teeth, and their gums, are wide; those of both jaws differ in height (0.39), and meet in between.
    # Lips may lie lower or higher than the teeth behind them, and tell only where there is one row.
    rows = [0.5 * (points[:, 1].min() + points[:, 1].max()) for points in teeth if np.ptp(points[:, 0]) > 0.4]
    two = rows and max(rows) - min(rows) > 0.04
    bite = 0.5 * (min(rows) + max(rows)) if two else mouth_middle(marks)[1]
    chosen: dict[str, list[IntArray]] = {}
    for (piece, used), kind in zip(pieces, kinds, strict=True):
        jaw = "lower" if local[used, 1].min() + local[used, 1].max() <= 2.0 * bite else "upper"
        chosen.setdefault(f"{jaw}_teeth" if kind == "teeth" else kind, []).append(piece)
    specks = len(chosen.pop("speck", []))
    return {name: part_of(name, others.only(np.sort(np.concatenate(chosen[name])))) for name in sorted(chosen)}, specks


def kind_said(name: str) -> str:
    """Return which kind of piece a name in a file says, "" for none; of names with "/" between them, the first that
    says a single one decides.

    Examples
    --------
    >>> kind_said("mesh_3/LeftEyelashes"), kind_said("Eye_L/brown hair"), kind_said("Head with eyes and teeth")
    ('lashes', 'eye', '')
    """
    called = {  # in small letters
        "lashes": r"(?<![fp])lash",  # no flash, no splash
        "fuzz": r"brow(?!n)",
        "glasses": r"glasses|spectacles|goggles",
        "tongue": r"tongue",
        "teeth": r"teeth|tooth|gums?(?![a-z])",
        "hair": r"(?<!c)hair",
        "eye": r"eye(?![ _-]*(lid|lash|brow|line|glasses|socket|shell|edge|occlusion))|cornea|sclera|pupil",
    }
    said = ([kind for kind, words in called.items() if re.search(words, one)] for one in name.lower().split("/"))
    return next((kinds[0] for kinds in said if len(kinds) == 1), "")


def _sided(kind: str, points: Array, eyes: Mapping[str, tuple[Array, float]]) -> str:
    """A kind with the side of the nearer eye, if it is eyes or lashes."""
    if kind not in ("eye", "lashes"):
        return kind
    side = min(eyes, key=lambda side: float(np.linalg.norm(points.mean(axis=0) - eyes[side][0])))
    return f"{kind}_{side}"


def _pieces(label: IntArray) -> list[IntArray]:
    """The numbers of the triangles with each label."""
    counts = np.unique(label, return_counts=True)[1]
    return np.split(np.argsort(label, kind="stable"), np.cumsum(counts)[:-1])


def _height(points: Array, skin: Surface) -> Array:
    """Distance (n,) of points from the nearest vertices of the skin, negative inside the head."""
    distance, nearest = cKDTree(skin.points).query(points)
    normals = vertex_normals(skin.points, skin.triangles)
    outside = ((points - skin.points[nearest]) * normals[nearest]).sum(axis=1) >= 0.0
    return np.asarray(np.where(outside, distance, -distance))


def part_of(name: str, surface: Surface) -> Part:
    """Return the part of a name that a surface is."""
    data = dict(surface.point_data)
    if has_colors(data):
        colors = data[COLORS]
        if colors.min() == 255:
            del data[COLORS]  # other parts have colors, this one has none
        elif colors.shape[1] == 4 and colors[:, 3].min() > 0.95 * (255 if colors.dtype == np.uint8 else 1.0):
            # Opaque: scanners and exporters leave an alpha of 254 here and there.
            data[COLORS] = colors[:, :3]
    laid, texture = merged_texture(replace(surface, point_data=data))
    return follower(name, laid.mesh, texture, source_points=laid.source_points, sheet=laid.sheet)


def _socket(pieces: list[Array], centre: Array) -> tuple[Array, float]:
    """Centre and radius of an eye: those of the largest ball about its landmark, or an adult's there."""
    balls = [ball for ball in (_eyeball(points, centre, RADIUS) for points in pieces) if ball is not None]
    return max(balls, key=lambda ball: ball[1], default=(centre, RADIUS))


def _kind(points: Array, away: Array, marks: Mapping[str, Array], eyes: Mapping[str, tuple[Array, float]]) -> str:
    """Name of a piece from its points [left, up, forward] (n, 3) and their distances (n,) from the skin, negative
    inside the head; "teeth" for those of either jaw.
    """
    for side, (centre, radius) in eyes.items():  # about which all of it lies, with some room for lashes
        if np.linalg.norm(points - centre, axis=1).max() <= 1.6 * radius + 0.1:
            return f"eye_{side}" if _is_of_eyeball(points, centre, radius) else f"lashes_{side}"
    low, high = points.min(axis=0), points.max(axis=0)
    middle, mouth, bridge = 0.5 * (low + high), mouth_middle(marks), marks["nasion"]
    width, _, length = high - low
    # To the mouth belongs what has its middle about it (0.37, 0.23, -0.67 to -0.12; gums are 0.96 wide), and what lies
    # mostly inside the head, at this height and in the middle: gums and tongues may reach far back, a pedestal fills
    # the neck. But nothing that stands out, as glasses and a fringe do (-0.05).
    off = middle - mouth
    about = (off > [-0.55, -0.5, -1.2]).all() and (off < [0.55, 0.5, 0.05]).all() and (high - low).max() < 1.4
    within = np.mean(away < 0.0) > 0.6 and marks["menton"][1] < middle[1] < bridge[1] and abs(middle[0]) < 0.1
    if (about or within) and high[2] < mouth[2] + 0.25:
        # A tongue is wide (0.6; a molar is 0.17 wide), long for its width (1.4; gums are 0.7), and in the middle.
        return "tongue" if width > 0.2 and length > 1.2 * width and abs(off[0]) < 0.1 else "teeth"
    if (high - low).max() < 0.02:
        return "speck"  # which is dropped
    if np.abs(away).max() < 0.12:
        return "fuzz"  # such as brows or stubble, nowhere farther from the skin
    level = bridge[1] - 0.9 < low[1] and high[1] < bridge[1] + 0.7
    if level and high[2] > bridge[2] and width > 0.4:
        return "glasses"
    # Hair has its middle above the nasion; or hangs behind the face, and above the mouth, which a neck or a pedestal
    # does not; or is a fringe, which begins at the hairline (0.94), however far it hangs down.
    hangs = low[2] < marks["nose_tip"][2] - 1.2 and high[1] > mouth[1]
    return "hair" if middle[1] > bridge[1] or hangs or high[1] > bridge[1] + 1.0 else "other"


def _is_of_eyeball(points: Array, centre: Array, radius: float) -> bool:
    """True for balls, corneas and irises; False for lashes, which stand off the rim of the eye.

    As seen from the front, the former lie about the middle of the eye, and are about as high as wide, or small as a
    pupil is.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    aside, extent = np.linalg.norm((0.5 * (low + high) - centre)[:2]), high - low
    if aside >= 0.5 * radius or _is_strand(points):
        return False
    return bool(extent[1] > 0.6 * extent[0] or extent[:2].max() < 0.8 * RADIUS)


def _is_strand(points: Array) -> bool:
    """True for hairs, whose largest extent is more than five times the second.

    Lashes that are no hairs are cards, which show a picture of some.
    """
    lengths = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(lengths[1] < 0.2 * lengths[0])


# --- balls ------------------------------------------------------------------------------------------------


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
    """Centre and radius of the ball, or its front, that points (n, 3) lie on; None if it is no eye about this place.

    `adult` is the radius of an adult's eye.
    """
    if len(points) < 9:  # too few to tell a sphere by
        return None
    middle, radius = ball_of(points)
    across = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    extent = np.sort(np.ptp(points @ across.T, axis=0))
    # Points of a cornea lie up to a quarter of the radius off the sphere.
    is_round = np.abs(np.linalg.norm(points - middle, axis=1) - radius).max() < 0.25 * radius
    is_here = np.linalg.norm(middle - centre) < radius
    # The largest are of children and cartoons, whose two balls touch. Of some eyes only the front is modeled; an iris
    # is narrower.
    fits = 0.7 < radius / adult < 2.6 and extent[1] > 1.2 * radius
    return (middle, radius) if is_round and is_here and fits else None


def given_eye(eye: Eyeball, part: Part | None) -> Eyeball:
    """Return the eyeball that came with the face as a part, if that is a ball about an eye of an adult; else that eye.

    Examples
    --------
    >>> eye = Eyeball("l", np.zeros(3), 12.0, gaze=np.array([0.0, 0.0, 1.0]), up=np.array([0.0, 1.0, 0.0]))
    >>> given = given_eye(eye, follower("eye_l", pv.Sphere(radius=13.0, center=(1, 0, 0)).triangulate()))
    >>> bool(np.allclose(given.centre, [1, 0, 0], atol=1e-3)), round(given.radius, 3), given.given
    (True, 13.0, True)
    """
    if part is None:
        return eye
    largest = np.asarray(part.mesh.regular_faces)[part.pieces == np.argmax(np.bincount(part.pieces))]
    ball = _eyeball(np.asarray(part.mesh.points)[np.unique(largest)], eye.centre, eye.radius)
    return eye if ball is None else replace(eye, centre=ball[0], radius=ball[1], given=True)
