"""Color of the built-in head's skin, and the hairs of its brows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

from facewrinkle.anatomy.head import HAIR_LIGHT
from facewrinkle.anatomy.identity import hair_cover
from facewrinkle.anatomy.landmarks import frame_of
from facewrinkle.appearance.skin_paint import complexion
from facewrinkle.geometry.depth_buffer import sampled_depth_buffer
from facewrinkle.geometry.interpolation import smoothstep
from facewrinkle.geometry.normals import vertex_normals

from .chart import Chart, cross

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

TEXELS = 1024
"""Rows and columns of the texture."""

DIRECTIONS = 96
"""Directions from which the visibility of the skin is tested."""

PIXEL = 1.6
"""Width of a pixel of the views from these directions, mm."""

EAR_RINGS = tuple(f"ear_ring{k}" for k in range(2, 8))
"""Rings of the cage on the ear, from the back of the helix inwards."""

EAR_ROUNDS, EAR_RIDGES, EAR_LIGHT = 30, 0.7, 0.8
"""Rounds of averaging that level the folds of the ear; contrast of ridges and hollows, and of slopes up and down."""

EAR_SOFTENED = 8
"""Rounds of averaging that round the ear's painted ridges and hollows."""

HAIRLESS = 25.0
"""Ears count as this much farther outside the hairline, mm."""

FADE = 15.0
"""Hair is dense so far inside its border, mm."""

WHORL, MIDDLE = np.array([8.0, 115.0, -62.0]), np.array([0.0, 50.0, 0.0])
"""Where hair grows away from, and the middle of the head, mm."""

FRONT = 50.0
"""Brows and folds of the lids are painted before this plane, mm."""

SHADE = np.array([0.42, 0.30, 0.26])
"""Share of the color that is left where no light comes in: light that bounces between skin is red."""


@dataclass
class HeadPainter:
    """The color of the head, from a fine mesh of its left half.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    plane : ndarray, shape (n, 2)
        Chart of the mesh; the middle of the head is the line x = 0.
    between : callable
        Called with two rings of the cage and the last number of their points, returns True for points (n,) between
        them, and their shares (n,) of the way from the first to the second.
    data : dict
        The cage's data: `paint`, `brow` and `eye`.
    landmarks : dict of str to ndarray, shape (3,)
    """

    points: Array
    triangles: IntArray
    plane: Array
    between: Callable[[str, str, int], tuple[BoolArray, Array]]
    data: dict[str, Any]
    landmarks: dict[str, Array]

    @cached_property
    def chart(self) -> Chart:
        """The chart with the values position, openness, strength of the rings' colors, ears, and share of lip."""
        rings = [
            np.column_stack([self._cover(*ring[:2], *ring[3:]) for ring in self.data["paint"]["rings"]]),
            self._on_ears.astype(np.float64),
            self._cover("mouth_ring1", "mouth_ring2", 0.0, 1.0, 0.2, 99)
            + self._cover("mouth_ring2", "mouth_ring3", 1.0, 1.0, 1.0, 99),
        ]
        return Chart(self.plane, self.triangles, np.column_stack([self.points, self._openness(), *rings]))

    def _cover(self, first: str, second: str, outer: float, inner: float, reach: float, last: int) -> Array:
        """Strength (n,) of a ring's color: goes from `outer` to `inner` over the first share `reach` of the way.

        The first ring itself belongs to what lies before it: two colors would add up to a line there.
        """
        inside, share = self.between(first, second, last)
        return np.where(inside & (share > 0.0), outer + (inner - outer) * smoothstep(share / reach), 0.0)

    def _openness(self) -> Array:
        """Share (n,) of the light that reaches folds of the ears: no triangle shows them.

        All else that keeps light out moves, and is looked for when a picture is drawn; painted, it would count twice.
        """
        normals = vertex_normals(self.points, self.triangles)
        cloud = np.vstack([self.points, self.points[self.triangles].mean(axis=1)])
        sky = averaged(openness(self.points, normals, cloud), self.triangles, 3) * self._ear_folds(normals)
        ear = averaged(self._on_ears.astype(np.float64), self.triangles, 3)
        return 1.0 + ear * (sky - 1.0)

    @cached_property
    def _on_ears(self) -> BoolArray:
        """True for points (n,) on the ears, from the back of the helix to the floor of the concha."""
        return np.any([self.between(*pair, 21)[0] for pair in pairwise(EAR_RINGS)], axis=0)

    def _ear_folds(self, normals: Array) -> Array:
        """Factor (n,) of the light on folds of the ears that no triangle shows: from above, and on the ridges.

        They are those of the cage, and ridges and hollows whose heights, mm, and lines in the side view are typed.
        """
        seen, side_view = self._on_ears & (normals[:, 0] > 0.1), self.points[:, [2, 1]]
        relief = sum(height * _along(np.array(line), side_view) for height, line in self.data["paint"]["ear"])
        relief = averaged(np.where(seen, relief, 0.0), self.triangles, EAR_SOFTENED)
        folded = self.points + relief[:, None] * normals
        normals = vertex_normals(folded, self.triangles)
        smooth = averaged(np.column_stack([folded, normals]), self.triangles, EAR_ROUNDS)
        ridge = np.einsum("ni,ni->n", folded - smooth[:, :3], normals)
        light = EAR_RIDGES * np.tanh(ridge / 0.5) + EAR_LIGHT * (normals[:, 1] - smooth[:, 4])
        return 1.0 + averaged(np.where(self._on_ears, light, 0.0), self.triangles, 3)

    def colors(self, plane: Array) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return colors (q, 3) of the bald skin at places (q, 2) of the chart of both halves, and hair (2, q) on it.

        Both are without fine detail; the hair is its share of the color, and its light.
        """
        skin, sky, cover, _ = self._without_detail(self.chart(np.stack([np.abs(plane[:, 0]), plane[:, 1]], axis=1)))
        return _bytes(shaded(skin, sky)), hair(cover, sky, np.ones(len(sky)))

    def texture(self, middle: Array, span: float) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return the same as square images (s, s, 3) and (2, s, s), first row at v = 1."""
        centres = (np.arange(TEXELS) + 0.5) / TEXELS - 0.5
        u, v = np.meshgrid(centres[TEXELS // 2 :], centres[::-1])
        values = self.chart(np.stack([u.ravel(), v.ravel()], axis=1) * span + middle, most=32)
        skin, sky, cover, lip = self._without_detail(values)
        halves = []
        for side in (-1.0, 1.0):
            places = values[:, :3] * [side, 1.0, 1.0]
            ragged = cover + 0.08 * noise(places, 9.0, 21) + 0.08 * combed(places, 0.5, 4.0, 22)
            halves.append((_bytes(shaded(skin * mottled(places, lip), sky)), hair(ragged, sky, strands(places))))
        (right, right_hair), (left, left_hair) = halves
        shape = TEXELS, TEXELS // 2
        color = np.concatenate([right.reshape(*shape, 3)[:, ::-1], left.reshape(*shape, 3)], axis=1)
        grown = np.concatenate([right_hair.reshape(2, *shape)[..., ::-1], left_hair.reshape(2, *shape)], axis=2)
        return color, grown

    def _without_detail(self, values: Array) -> tuple[Array, Array, Array, Array]:
        """Color (q, 3) of the skin, openness, how far inside the hair, 1 where it is dense, and share of lip (q, 1)."""
        frame, paint = frame_of(self.landmarks), self.data["paint"]
        places, sky, rings, ear, lip = np.split(values, [3, 4, values.shape[1] - 2, values.shape[1] - 1], axis=1)
        sky, ear = np.clip(sky[:, 0], 0.0, 1.0), ear[:, 0]
        skin = complexion(places, self.landmarks, frame)
        for k, ring in enumerate(paint["rings"]):
            skin += rings[:, k, None] * (np.array(ring[2]) - skin)
        for tint, strength, line in paint["lines"]:
            near = np.where(places[:, 2] > FRONT, _along(np.array(line), places[:, :2]), 0.0)
            skin += (strength * near)[:, None] * (tint - skin)
        cover = hair_cover(places, self.landmarks, frame) - HAIRLESS * ear
        return skin, sky, cover / FADE, lip


def shaded(skin: Array, sky: Array) -> Array:
    """Return the color (n, 3) of skin that only a share (n,) of the light reaches."""
    return skin * (SHADE + (1.0 - SHADE) * sky[:, None])


def hair(cover: Array, sky: Array, strands: Array) -> NDArray[np.uint8]:
    """Return the share of hair (255 is all hair), denser from the border (0) inwards, and its light (2, n).

    The light is in units of :data:`facewrinkle.anatomy.head.HAIR_LIGHT`.
    """
    dense = smoothstep(1.15 * cover - 0.1)
    light = np.where(dense > 0.0, strands * (0.5 + 0.5 * sky), 0.75)
    return _bytes(np.stack([255.0 * dense, HAIR_LIGHT * light]))


def mottled(places: Array, lip: Array) -> Array:
    """Return factors (n, 3) for blood and melanin in clouds, freckles, pores, and the lines of the lips."""
    blood, brown = cloudy(places, 11.0, 1), cloudy(places, 6.0, 11)
    freckle = smoothstep((noise(places, 1.3, 5) - 1.5) / 1.0) * smoothstep(noise(places, 25.0, 6))
    pores = smoothstep((noise(places, 0.6, 7) + 0.2) / 2.2) - 0.25
    shares = np.stack([0.006 * blood, 0.022 * blood, 0.018 * blood], axis=1)
    shares += np.stack([0.009 * brown, 0.014 * brown, 0.019 * brown], axis=1)
    shares += freckle[:, None] * [0.05, 0.09, 0.11]
    skin = 1.0 - shares - 0.04 * pores[:, None] * [0.8, 1.0, 1.05]
    wavy = places * [1.0, 0.3, 0.3] + 0.5 * noise(places, 2.5, 11)[:, None] * [1.0, 0.0, 0.0]
    lines = smoothstep(1.0 - np.abs(noise(wavy, 0.9, 9)) / 0.7)
    red = 1.0 - lines[:, None] * [0.015, 0.045, 0.04] - 0.02 * blood[:, None]
    return skin + lip * (red - skin)


def cloudy(places: Array, size: float, seed: int) -> Array:
    """Return noise (n,) of unit variance at several scales, as skin has it: the finer the grains, the fainter."""
    shares = 0.75 ** np.arange(4)
    total = sum(share * noise(places, 0.5**k * size, seed + k) for k, share in enumerate(shares))
    return np.asarray(total / np.linalg.norm(shares))


def strands(places: Array) -> Array:
    """Return factors (n,) for the light and dark of cropped hair: of hairs, tufts, and waves."""
    light = 0.08 * combed(places, 0.5, 6.0, 31) + 0.03 * combed(places, 1.6, 9.0, 32)
    return 1.0 + light + 0.05 * noise(places, 12.0, 33)


def combed(places: Array, size: float, length: float, seed: int) -> Array:
    """Return noise (n,) of unit variance with grains that are drawn out to a length along the growth of hair.

    Hair grows away from the whorl at the back of the crown, along the head.
    """
    way = places - WHORL
    upright = places - MIDDLE
    upright /= np.linalg.norm(upright, axis=1, keepdims=True)
    way -= (way * upright).sum(axis=1, keepdims=True) * upright
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1.0)
    turned = np.cross(upright, way)
    angle = 0.35 * noise(places, 14.0, seed + 100)[:, None]
    way = np.cos(angle) * way + np.sin(angle) * turned
    steps = np.arange(-0.5 * length, 0.5 * length, 0.8 * size)
    total = np.sum([noise(places + step * way, size, seed) for step in steps], axis=0)
    return np.asarray(total / total.std())


def noise(places: Array, size: float, seed: int) -> Array:
    """Return smooth noise (n,) in space with grains of a size, of about unit variance; the same for the same seed."""
    lattice = np.random.default_rng(seed).normal(0.0, 2.6, (48, 48, 48))
    return map_coordinates(lattice, (places / size).T, order=2, mode="grid-wrap", prefilter=False)


def openness(points: Array, normals: Array, cloud: Array) -> Array:
    """Return the share (n,) of the sky above each point that a dense cloud leaves open (ambient occlusion).

    Directions are weighted by slope; in the view from each, points that lie behind the cloud do not see the sky.
    """
    seen, whole = np.zeros(len(points)), np.zeros(len(points))
    for towards in _sphere(DIRECTIONS):
        slope = normals @ towards
        right = np.cross(towards, np.eye(3)[np.abs(towards).argmin()])
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(towards, right), towards])
        shadow, here = cloud @ axes.T, points @ axes.T
        low = shadow[:, :2].min(axis=0) - 2.0 * PIXEL
        size = ((np.ptp(shadow[:, :2], axis=0)) / PIXEL).astype(int) + 5
        front = sampled_depth_buffer(((shadow[:, :2] - low) / PIXEL).astype(int), shadow[:, 2], size)
        depth = front[tuple(((here[:, :2] - low) / PIXEL).astype(int).T)]
        up = np.maximum(slope, 0.0)
        margin = 1.2 + 1.5 * PIXEL * np.sqrt(1.0 - np.minimum(slope**2, 0.99)) / np.maximum(up, 0.15)
        seen += up * smoothstep((margin - (depth - here[:, 2])) / 1.5 + 1.0)
        whole += up
    return seen / whole


def averaged(values: Array, triangles: IntArray, rounds: int) -> Array:
    """Return values (n,) or (n, k) of vertices, averaged with their neighbors' a number of times."""
    i, j = triangles[:, [0, 1, 2]].ravel(), triangles[:, [1, 2, 0]].ravel()
    both = np.concatenate([i, j]), np.concatenate([j, i])
    links = sparse.csr_array((np.ones(len(both[0])), both), shape=(len(values), len(values)))
    count = links.sum(axis=1)
    for _ in range(rounds):
        values = 0.5 * values + 0.5 * ((links @ values).T / count).T
    return values


def _sphere(count: int) -> Array:
    """Unit vectors (count, 3) spread evenly (a spiral with golden angle)."""
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (1.0 + 5.0**0.5) * np.arange(count)
    away = np.sqrt(1.0 - height**2)
    return np.stack([away * np.cos(turn), height, away * np.sin(turn)], axis=1)


def _bytes(colors: Array) -> NDArray[np.uint8]:
    return np.rint(np.clip(colors, 0, 255)).astype(np.uint8)


def _along(line: Array, places: Array) -> Array:
    """1 at places (n, 2) on a line of places and widths (k, 3) in a view, falling to 0 within its width (n,)."""
    stations = np.linspace(0.0, len(line) - 1.0, 8 * len(line))
    x, y, width = (np.interp(stations, np.arange(len(line)), line[:, c]) for c in range(3))
    away, nearest = cKDTree(np.stack([x, y], axis=1)).query(places)
    return np.asarray(np.exp(-((away / (1.3 * width[nearest])) ** 2)))


def brow_hairs(brow: dict[str, Any], points: Array, triangles: IntArray) -> tuple[IntArray, Array]:
    """Return the triangles (k, p) and weights (k, p, 3) of the points of the hairs of the left eyebrow.

    Seen from the front the brow is a height field: the frontal projection of the skin near it is a chart.
    """
    line = np.array(brow["line"])
    places = _combed(line, brow)
    low, high = line[:, :2].min(axis=0) - 15.0, line[:, :2].max(axis=0) + 15.0
    p = points[triangles][..., :2]
    near = ((p > low) & (p < high)).all(axis=(1, 2)) & (cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) > 0.0)
    rows = np.flatnonzero(near)
    cells, weights = Chart(points[:, :2], triangles[rows], points).locate(places.reshape(-1, 2))
    return rows[cells].reshape(places.shape[:2]), weights.reshape(*places.shape[:2], 3)


def _combed(line: Array, brow: dict[str, Any]) -> Array:
    """Hairs (k, p, 2) in the frontal view, from the upper edge down: upright at the inner end, then along the brow."""
    count, knots = brow["count"], len(brow["heights"])
    random = np.random.default_rng(1).random((4, count))
    stations = np.linspace(0.0, 1.0, len(line))
    along = ((np.arange(count) + random[0]) / count) ** 0.87  # thinner towards the nose
    across = 0.8 * np.arcsin(2.0 * random[1] - 1.0)  # denser in the middle
    x, y, width, lean, slope_x, slope_y = (
        np.interp(along, stations, values) for values in (*line.T, *np.gradient(line[:, :2], axis=0).T)
    )
    tangent = np.arctan2(slope_y, slope_x)
    root = np.stack([x - width * across * np.sin(tangent), y + width * across * np.cos(tangent)], axis=1)
    start = tangent + np.radians(lean) * (1.0 - 0.5 * across) + 0.25 * (random[2] - 0.5)
    bend = -np.radians(brow["bend"]) * (0.4 + 0.6 * across)
    heading = start[:, None] + bend[:, None] * (np.arange(1, knots) - 0.5) / (knots - 1)
    step = brow["length"] * (0.7 + 0.6 * random[3])[:, None] / (knots - 1)
    path = np.stack([np.cos(heading) * step, np.sin(heading) * step], axis=2).cumsum(axis=1)
    return np.concatenate([root[:, None], root[:, None] + path], axis=1)[np.argsort(-across)]
