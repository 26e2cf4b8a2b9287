"""What lies on the surface of the built-in head: the colour of its skin, and hairs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from facewrinkle.anatomy.cage_mesh import Chart, cross

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

TEXELS = 512


@dataclass
class Skin:
    """What is painted: the left half of the head.

    Parameters
    ----------
    points : (n, 3) float array
        A fine mesh of the surface.
    triangles : (m, 3) int array
    plane : (n, 2) float array
        Its chart; the middle of the head is the line x = 0.
    between : callable
        From two rings of the cage and the last number of their points: whether a point lies between them (n,), and
        how far from the first to the second (n,).
    data : dict
        The cage's data: `paint` and `brow`.
    """

    points: Floats
    triangles: Ints
    plane: Floats
    between: Callable[[str, str, int], tuple[Bools, Floats]]
    data: dict[str, Any]

    @cached_property
    def chart(self) -> Chart:
        """Looks up the colour at places of the chart."""
        return Chart(self.plane, self.triangles, tinted(self.points, self.between, self.data))

    def colours(self, plane: Floats) -> NDArray[np.uint8]:
        """Colours (q, 3) at places (q, 2) of the chart, those of the right half too."""
        return _bytes(self.chart(np.stack([np.abs(plane[:, 0]), plane[:, 1]], axis=1)))

    def texture(self, middle: Floats, span: float) -> NDArray[np.uint8]:
        """The colour as a square image, first row at v = 1; mirrored from the left half."""
        centres = (np.arange(TEXELS) + 0.5) / TEXELS - 0.5
        u, v = np.meshgrid(centres[TEXELS // 2 :], centres[::-1])
        left = self.chart(np.stack([u.ravel(), v.ravel()], axis=1) * span + middle, most=32)
        image = _bytes(left).reshape(TEXELS, -1, 3)
        return np.concatenate([image[:, ::-1], image], axis=1)


def _bytes(colours: Floats) -> NDArray[np.uint8]:
    return np.rint(np.clip(colours, 0, 255)).astype(np.uint8)


def tinted(points: Floats, between: Callable[[str, str, int], tuple[Bools, Floats]], data: dict[str, Any]) -> Floats:
    """Skin colour (n, 3) of the fine points, 0 to 255: typed spots, brow and rings over one another."""
    paint = data["paint"]
    colour = np.tile(np.array(paint["skin"], dtype=float), (len(points), 1))
    for centre, reach, tint, strength in paint["spots"]:
        away = np.linalg.norm(points - centre, axis=1)
        share = strength * np.exp(-0.5 * (away / reach) ** 2)[:, None]
        colour += share * (np.array(tint) - colour)
    tint, strength = paint["brow"]
    colour += (strength * _brow_shade(np.array(data["brow"]["line"]), points))[:, None] * (np.array(tint) - colour)
    for first, second, tint, outer, inner, reach, last in paint["rings"]:
        over, share = between(first, second, last)
        ramp = np.minimum(share / reach, 1.0)
        share = np.where(over, outer + (inner - outer) * ramp * ramp * (3.0 - 2.0 * ramp), 0.0)[:, None]
        colour += share * (np.array(tint) - colour)
    return colour


def _brow_shade(line: Floats, points: Floats) -> Floats:
    """1 on the brow's centre line in the frontal view, fading to 0 within its width (n,)."""
    stations = np.linspace(0.0, len(line) - 1.0, 8 * len(line))
    x, y, width = (np.interp(stations, np.arange(len(line)), line[:, c]) for c in range(3))
    away, nearest = cKDTree(np.stack([x, y], axis=1)).query(points[:, :2])
    front = points[:, 2] > 50.0
    return np.where(front, np.exp(-((away / (1.3 * width[nearest])) ** 2)), 0.0)


def brow_hairs(brow: dict[str, Any], points: Floats, triangles: Ints) -> tuple[Ints, Floats]:
    """Left eyebrow: triangles (k, p) and weights (k, p, 3) of the points of its hairs.

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


def _combed(line: Floats, brow: dict[str, Any]) -> Floats:
    """Hairs (k, p, 2) in the frontal view: upright at the inner end, then along the brow."""
    count, knots = brow["count"], len(brow["heights"])
    random = np.random.default_rng(1).random((4, count))
    stations = np.linspace(0.0, 1.0, len(line))
    along = (np.arange(count) + random[0]) / count
    across = 2.0 * random[1] - 1.0
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
    return np.concatenate([root[:, None], root[:, None] + path], axis=1)
