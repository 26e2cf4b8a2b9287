"""Depth maps of a surface seen from the front, and its curvature in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from ...array_types import Array, BoolArray, IntArray
from ...geometry.depth_buffer import depth_buffer

NEAREST, FARTHEST = 1.1, -1.5
"""Range of depth of a face, in distances between the pupils; the tip of the nose is at 0.6."""

# Openings in the map are closed according to their width. Lengths are in distances between the pupils.
SLIT_WIDTH, SLIT_DEPTH = 0.11, 0.06
"""Openings narrower than the first, such as that between the lips, become furrows of the second's depth."""
OPENING_WIDTH, OPENING_DEPTH = 0.27, 0.12
"""Openings up to the first's width that are deeper than the second, such as open eyes, count as unknown."""
OPEN_MOUTH_WIDTH, OPEN_MOUTH_DEPTH = 0.9, 0.25
"""An open mouth, where one is expected, up to the first's width becomes a hollow of the second's depth."""
BELOW_NOSTRILS = -0.8
"""An open mouth lies below this height."""

PEAK_RADIUS = 0.12
"""Size of the surroundings to which a peak's paraboloid is fitted; farther from the start it is another bulge's."""


@dataclass(frozen=True)
class Grid:
    """A grid over the face, in distances between the pupils from the middle between the eyes."""

    step: float
    low: tuple[float, float] = (-1.32, -2.52)
    high: tuple[float, float] = (1.32, 1.11)

    @property
    def x(self) -> Array:
        return np.arange(self.low[0], self.high[0] + 1e-9, self.step)

    @property
    def y(self) -> Array:
        return np.arange(self.low[1], self.high[1] + 1e-9, self.step)

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.y), len(self.x)

    def index(self, xy: Array) -> Array:
        """Fractional row and column (2, n) of points (n, 2)."""
        return np.stack([(xy[:, 1] - self.low[1]) / self.step, (xy[:, 0] - self.low[0]) / self.step])


def depth_map(local: Array, triangles: IntArray, grid: Grid) -> Array:
    """Depth of the foremost surface over the grid, NaN where there is none."""
    depth = depth_buffer(local, triangles, grid.low, grid.step, grid.shape, (FARTHEST, NEAREST))
    depth[np.isinf(depth)] = np.nan
    return depth


def openings_closed(
    depth: Array, grid: Grid, mouth_open: bool = False, model: Array | None = None
) -> tuple[Array, BoolArray]:
    """Return the map with its openings closed, and True where the surface is known.

    An open mouth is kept as a hollow if `mouth_open`. Where the surface is not known, the map goes on smoothly, along
    the depth of a `model` if there is one: a rim must not look like curvature of the face.
    """
    deep = np.where(np.isnan(depth), FARTHEST, depth)
    below = grid.y < BELOW_NOSTRILS
    if mouth_open:
        deep[below] = np.maximum(deep, _grey_closing(deep, OPEN_MOUTH_WIDTH, grid) - OPEN_MOUTH_DEPTH)[below]
    level = np.maximum(deep, _grey_closing(deep, SLIT_WIDTH, grid) - SLIT_DEPTH)
    known = (_grey_closing(level, OPENING_WIDTH, grid) - level < OPENING_DEPTH) & (level > FARTHEST)
    if mouth_open:
        known[below] = level[below] > FARTHEST
    base = np.zeros_like(level) if model is None else model
    return base + _continued(np.where(known, level - base, 0.0), known), known


def _grey_closing(depth: Array, size: float, grid: Grid) -> Array:
    width = 2 * max(int(size / grid.step / 2), 1) + 1
    return np.asarray(ndimage.grey_closing(depth, size=(width, width), mode="constant", cval=FARTHEST))


def _continued(values: Array, known: BoolArray) -> Array:
    """The values, with the unknown ones filled in from the smallest neighbourhood that has enough known ones."""
    weight, out = known.astype(float), np.where(known, values, np.nan)
    if not known.any():
        return np.zeros_like(values)
    for sigma in (1.0, 2.0, 4.0, 8.0, 16.0, 32.0):
        share = ndimage.gaussian_filter(weight, sigma)
        mean = ndimage.gaussian_filter(values * weight, sigma) / np.maximum(share, 1e-12)
        out = np.where(np.isnan(out) & (share > 0.2), mean, out)
        if not np.isnan(out).any():
            return out
    return np.where(np.isnan(out), values[known].mean(), out)


def curvature(depth: Array, grid: Grid, scales: tuple[float, ...]) -> Array:
    """Curvature (c, rows, columns) at the given scales: the Laplacian of Gaussian, dimensionless.

    Bulges are positive, hollows negative.
    """
    return np.array([-((s / grid.step) ** 2) * ndimage.gaussian_laplace(depth, s / grid.step) / s for s in scales])


def peak(depth: Array, grid: Grid, start: Array) -> Array:
    """Return the peak (2,) of the bulge at a place: that of a paraboloid through its surroundings.

    Return the place itself where there is no bulge, or none with a peak nearby.
    """
    x, y = np.meshgrid(grid.x, grid.y)
    place = np.asarray(start, dtype=np.float64)
    for _ in range(3):
        u, v = x - place[0], y - place[1]
        weight = np.exp(-1.5 * (u * u + v * v) / PEAK_RADIUS**2)
        near = weight > 0.05
        u, v, root = u[near], v[near], np.sqrt(weight[near])
        terms = np.stack([np.ones_like(u), u, v, 0.5 * u * u, u * v, 0.5 * v * v], axis=1)
        _, a, b, p, q, r = np.linalg.lstsq(terms * root[:, None], depth[near] * root, rcond=None)[0]
        if not (p < 0.0 and p * r > q * q):
            return start
        step = -np.linalg.solve([[p, q], [q, r]], [a, b])
        place = place + step * min(1.0, 0.08 / max(float(np.linalg.norm(step)), 1e-12))
    return place if np.linalg.norm(place - start) < PEAK_RADIUS else start
