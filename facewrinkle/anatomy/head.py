"""The built-in head: a Catmull-Clark surface of a hand-typed cage, meshed with 4,517 triangles.

``tools/build_head`` makes the stored head anew from ``data/head_cage.json``. The half with x >= 0 is meshed and
mirrored; one triangle straddles the middle of the neck rim, which makes the count odd and keeps the mesh symmetric.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from functools import cache, cached_property
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..array_types import Array, IntArray
from .eyeball import Eyeball

DATA = Path(__file__).parent / "data"
MIRROR = np.array([-1.0, 1.0, 1.0])


HAIR_COLOR = (50.0, 38.0, 31.0)
"""Red, green and blue of cropped hair."""

HAIR_LIGHT = 127.0
"""Stored light of hair that has this color."""


def both_sides(points: Array) -> Array:
    """Cage points of the left half, and after them the mirror images of those off the middle."""
    return np.vstack([points, points[points[:, 0] != 0.0] * MIRROR])


def seated(points: Array, share: Array, centre: Array, radius: float) -> Array:
    """Points (n, 3) with the lids' inner margin, where `share` (n,) is 1, on the eyeball, and all others outside it."""
    away = points - centre
    distance = np.linalg.norm(away, axis=1)
    seat = radius + 0.25  # mm: more than the edges of the margin cut into the ball
    wanted = np.maximum(distance + share**2 * (seat - distance), seat)
    return np.asarray(centre + away * (wanted / distance)[:, None])


def parted(points: Array, lips: NDArray[np.int32]) -> Array:
    """Points (n, 3) with the upper lip's lining clear of the lower one's; see :class:`Mold` for `lips` (m, 4).

    Only the upper lip gives way: it follows the lower one's curve, 0.2 mm above its vertices, so that nobody looks
    straight in between them. Its vertices lie a little ahead of those opposite, over which the line to the next vertex
    inwards has to pass.
    """
    out = points.copy()
    for vertex, inwards, *opposite in lips:
        below = out[opposite].mean(axis=0)
        length = out[vertex, 2] - out[inwards, 2]
        share = np.clip((out[vertex, 2] - below[2]) / length, 0.0, 0.5) if length > 0.0 else 0.0
        least = (below[1] + 0.2 - share * out[inwards, 1]) / (1.0 - share)
        out[vertex, 1] = max(out[vertex, 1], least)
    return out


def pair_of_eyes(centre: Array, radius: float) -> tuple[Eyeball, Eyeball]:
    """The left eyeball, which looks ahead, and its mirror image."""
    ahead, up = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    return Eyeball("l", centre, radius, ahead, up), Eyeball("r", centre * MIRROR, radius, ahead, up)


@dataclass(frozen=True)
class Mold:
    """The map from the cage's points to the head's vertices, which is linear but for the lids and lips.

    Parameters
    ----------
    weights : sparse array, shape (k, c)
        From the c cage points of :func:`both_sides` to the k vertices of the left half, which come first.
    lids : ndarray, shape (k,)
        1 on the lids' inner margin, falling to 0 on their front; see :func:`seated`.
    lips : ndarray of int, shape (m, 4)
        Vertices of the upper lip's lining from inside outwards, each with the next one inwards (the innermost with
        themselves), and the two of the lower lip's whose middle lies opposite; see :func:`parted`.
    twins : ndarray of int, shape (n - k,)
        Vertices of the left half whose mirror images are the other vertices.
    """

    weights: Any
    lids: Array
    lips: NDArray[np.int32]
    twins: NDArray[np.int32]

    def __call__(self, cage: Array, centre: Array, radius: float) -> Array:
        """The head's points (n, 3) for the left half's cage points (c0, 3) and left eyeball."""
        left = parted(seated(self.weights @ both_sides(cage), self.lids, centre, radius), self.lips)
        middle = np.setdiff1d(np.arange(len(left)), self.twins)
        left[middle, 0] = 0.0
        return np.vstack([left, left[self.twins] * MIRROR])


@dataclass(frozen=True)
class BoundHairs:
    """Hairs of brows, or cropped hair, that go with the skin.

    Parameters
    ----------
    triangles : ndarray of int, shape (k, p)
        The skin triangle of each of the p points of k hairs: those of one brow from its upper edge down, then those of
        the other.
    weights : ndarray, shape (k, p, 3)
        Barycentric coordinates of the points in these triangles, or beside them.
    heights : ndarray, shape (p,) or (k, p)
        Heights of a hair's points above the skin, in the unit of the mesh.
    color : ndarray, shape (3,)
        Mean of the hairs' red, green and blue, from 0 to 255. Default: that of the built-in head's brows.

    Examples
    --------
    Skin that is raised by 5 mm takes the hairs along:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> brows = face.bound_hair["brows"]
    >>> rest = brows.polylines(face.points, face.triangles, face.tissue.normals)
    >>> raised = brows.polylines(face.points + [0, 5, 0], face.triangles, face.tissue.normals)
    >>> len(rest), float((raised - rest)[..., 1].mean().round(3))
    (640, 5.0)
    """

    triangles: IntArray
    weights: Array
    heights: Array
    color: Array = field(default_factory=lambda: np.array([78.0, 56.0, 47.0]))

    def polylines(self, points: Array, triangles: NDArray[np.int32], normals: Array) -> Array:
        """Points (k, p, 3) of the hairs on the skin as it is now, given its points and vertex normals (n, 3)."""
        return self.on_skin(points, triangles, normals)[0]

    def on_skin(self, points: Array, triangles: NDArray[np.int32], normals: Array) -> tuple[Array, Array]:
        """:meth:`polylines`, and the normals (k, p, 3) of the skin below them."""
        corners = triangles[self.triangles]
        below = np.einsum("kpc,kpci->kpi", self.weights, points[corners])
        up = np.einsum("kpc,kpci->kpi", self.weights, normals[corners])
        return below + self.heights[..., None] * up, up

    def thinned(self, share: float) -> BoundHairs:
        """Return brows without a share of their hairs, the lowest ones all along.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> brows = fw.default_face().bound_hair["brows"]
        >>> len(brows.thinned(0.25).triangles) / len(brows.triangles)
        0.75
        """
        of_one = len(self.triangles) // 2
        highest = np.arange(round((1.0 - share) * of_one))
        kept = np.concatenate([highest, of_one + highest])
        return dataclasses.replace(self, triangles=self.triangles[kept], weights=self.weights[kept])


@dataclass(frozen=True)
class Paint:
    """Colors of the skin of a head, and the cropped hair over them.

    Parameters
    ----------
    skin : ndarray of uint8, shape (..., 3)
    share, light : ndarray of uint8, shape (...)
        Share of hair in the color, 255 where it covers the skin; its light, in units of :data:`HAIR_LIGHT`.
    tint, hair : array_like, shape (3,)
        Factors of the color of the skin; the color of the hair.
    density : float
        -1 for a shaved head, below 0 for hair that is thinner all over, and 1 for hair that is denser at its borders.
    border : float
        Share of hair from which on it grows, below 1: the larger, the farther the hairline has receded.
    bare : float
        Share of the skin that is seen between the hairs where they are dense.
    """

    skin: NDArray[np.uint8]
    share: NDArray[np.uint8]
    light: NDArray[np.uint8]
    tint: npt.ArrayLike = (1.0, 1.0, 1.0)
    hair: npt.ArrayLike = HAIR_COLOR
    density: float = 0.0
    border: float = 0.0
    bare: float = 0.0

    def cover(self) -> Array:
        """Return how much of the skin (...) the hair covers, 0 to 1."""
        share = np.maximum(self.share / 255.0 - self.border, 0.0) / (1.0 - self.border)
        if self.density < 0.0:
            return np.asarray((1.0 + self.density) ** 0.12 * share)  # it covers the scalp until it is nearly shaved
        return np.asarray(1.0 - (1.0 - share) ** (1.0 + self.density))

    def colors(self) -> NDArray[np.uint8]:
        """Return the colors (..., 3), read-only."""
        out = np.rint(np.minimum(np.asarray(self.tint) * self.skin, 255.0))
        cover = (1.0 - self.bare) * self.cover() ** 2  # skin is seen through thin hair
        where = cover > 0.0
        out[where] += cover[where, None] * (np.asarray(self.hair) * self.light[where, None] / HAIR_LIGHT - out[where])
        shown = np.asarray(np.rint(np.clip(out, 0.0, 255.0)), dtype=np.uint8)
        shown.setflags(write=False)
        return shown


@dataclass(frozen=True)
class Head:
    """The built-in head at rest: +y up, +z forward, the subject's left at +x, millimeters.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int32, shape (4517, 3)
        Counter-clockwise seen from outside.
    uv : ndarray, shape (n, 2)
        Texture coordinates in [0, 1], without overlaps.
    landmarks : dict of str to ndarray, shape (3,)
        On the surface; ``eye_l_centre`` and ``eye_r_centre`` are the eyeballs' centres.
    eyes : tuple of two Eyeball
        The left one and the right one.
    brows : BoundHairs
    mold : Mold
    paint : tuple of two Paint
        What `color` and `texture` are made of.

    Attributes
    ----------
    color : ndarray of uint8, shape (n, 3)
        Color of the skin and its hair.
    texture : ndarray of uint8, shape (s, s, 3)
        The same color as an image over `uv`, first row at v = 1: the border of the lips is sharper in it.

    Examples
    --------
    The distance between the centres of the eyes, mm, and the pixels of the skin's texture:

    >>> head = load_head()
    >>> left, right = head.eyes
    >>> round(float(left.centre[0] - right.centre[0]), 1), head.texture.shape
    (63.8, (1024, 1024, 3))
    """

    points: Array
    triangles: NDArray[np.int32]
    uv: Array
    landmarks: dict[str, Array]
    eyes: tuple[Eyeball, Eyeball]
    brows: BoundHairs
    mold: Mold
    paint: tuple[Paint, Paint]

    @cached_property
    def color(self) -> NDArray[np.uint8]:
        return self.paint[0].colors()

    @cached_property
    def texture(self) -> NDArray[np.uint8]:
        return self.paint[1].colors()


@cache
def load_head() -> Head:
    """Load the built-in head.

    Examples
    --------
    >>> head = load_head()
    >>> head.triangles.shape
    (4517, 3)
    """
    with np.load(DATA / "head.npz") as stored:
        data = {name: stored[name] for name in stored.files}
    return unpacked(data)


def cage_data() -> dict[str, Any]:
    """The cage as it was typed: names, points, quads, landmarks, eyeball, brows, colors."""
    return dict(json.loads((DATA / "head_cage.json").read_text(encoding="utf-8")))


def unpacked(data: dict[str, NDArray[Any]]) -> Head:
    """Return the head from its arrays as they are stored."""
    share, light = np.split(_decoded(data["hair"]), 2)
    paint = Paint(data["color"], *data["color_hair"]), Paint(_decoded(data["texture"]), share, light)
    for array in data.values():
        array.setflags(write=False)
    landmarks = dict(zip(data["landmark_names"].tolist(), data["landmarks"], strict=True))
    hairs = BoundHairs(data["brow_triangles"], data["brow_weights"], data["brow_heights"])
    shape = len(data["lid_share"]), int(data["mold_size"])
    columns = data["mold_cage_points"].astype(np.int32)
    weights = csr_array((data["mold_weights"], columns, data["mold_rows"]), shape=shape)
    return Head(
        points=data["points"],
        triangles=data["triangles"],
        uv=data["uv"],
        landmarks=landmarks,
        eyes=pair_of_eyes(landmarks["eye_l_centre"], float(data["eye_radius"])),
        brows=hairs,
        mold=Mold(weights, data["lid_share"], data["lips"], data["twins"]),
        paint=paint,
    )


def _decoded(file: NDArray[np.uint8]) -> NDArray[np.uint8]:
    from PIL import Image

    with Image.open(BytesIO(file.tobytes())) as image:
        return np.array(image)
