"""Depth maps of a surface seen from the front, and the relief in them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from . import _kernels as kernels

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a face is: local = (point - origin) @ axes.T / (size * stretch), in distances between the pupils.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
        Rows are the subject's left, up and forward.
    origin : ndarray, shape (3,)
        The middle between the eyes.
    size : float
        Distance between the pupils.
    stretch : ndarray, shape (3,)
        How much larger than the template's the face is along the axes, apart from its size.

    Examples
    --------
    A face 60 mm from pupil to pupil, and a place half of this below and in front of its eyes:

    >>> pose = Pose(np.eye(3), origin=np.array([0.0, 100, 0]), size=60.0, stretch=np.ones(3))
    >>> pose.world(np.array([[0.0, -0.5, 0.5]]))
    array([[ 0., 70., 30.]])
    >>> pose.local(np.array([[0.0, 70, 30]]))
    array([[ 0. , -0.5,  0.5]])
    """

    axes: Array
    origin: Array
    size: float
    stretch: Array

    def local(self, points: Array) -> Array:
        """Points (n, 3) in the template's coordinates."""
        return (points - self.origin) @ self.axes.T / (self.size * self.stretch)

    def world(self, local: Array) -> Array:
        """Points in the coordinates of the mesh."""
        return local * (self.size * self.stretch) @ self.axes + self.origin


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


NEAREST, FARTHEST = 1.1, -1.5
"""Range of depth of a face; the tip of the nose is at 0.6."""


def depth_map(local: Array, triangles: npt.NDArray[np.int64], grid: Grid) -> Array:
    """Depth of the foremost surface over the grid, NaN where there is none."""
    depth = np.empty(grid.shape)
    kernels.rasterise(local, triangles, *grid.low, grid.step, FARTHEST, NEAREST, depth)
    depth[np.isinf(depth)] = np.nan
    return depth


SLIT, FURROW = 0.11, 0.06
"""Openings narrower than the first, such as that between the lips, become furrows of the second's depth."""

OPENING, PIT = 0.27, 0.12
"""Wider ones up to this width that are deeper than the second, such as open eyes, are filled."""


MOUTH, CAVITY, NOSTRILS = 0.9, 0.25, -0.8
"""An open mouth of up to the first's size becomes a hollow of the second's depth; it is below the third."""


def closed(
    depth: Array, grid: Grid, agape: bool = False, model: Array | None = None
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """The map with its openings closed, and where it is known; an open mouth is kept as a hollow where that is said.

    What is not known goes on smoothly from what is, or as the depth of a model does: a rim must not look like relief.
    """
    deep = np.where(np.isnan(depth), FARTHEST, depth)
    below = grid.y < NOSTRILS
    if agape:
        deep[below] = np.maximum(deep, _closing(deep, MOUTH, grid) - CAVITY)[below]
    level = shallow(deep, grid)
    known = (_closing(level, OPENING, grid) - level < PIT) & (level > FARTHEST)
    if agape:
        known[below] = level[below] > FARTHEST
    like = np.zeros_like(level) if model is None else model
    return like + _filled(np.where(known, level - like, 0.0), known), known


def shallow(depth: Array, grid: Grid) -> Array:
    """The map with its slits, such as that between lips, as furrows."""
    deep = np.where(np.isnan(depth), FARTHEST, depth)
    return np.asarray(np.maximum(deep, _closing(deep, SLIT, grid) - FURROW))


def _closing(depth: Array, size: float, grid: Grid) -> Array:
    width = 2 * max(int(size / grid.step / 2), 1) + 1
    return np.asarray(ndimage.grey_closing(depth, size=(width, width), mode="constant", cval=FARTHEST))


def _filled(values: Array, known: npt.NDArray[np.bool_]) -> Array:
    """Unknown values from known ones around them, from the smallest neighbourhood that has enough."""
    weight, out = known.astype(float), np.where(known, values, np.nan)
    if not known.any():
        return np.zeros_like(values)
    for sigma in (1.0, 2.0, 4.0, 8.0, 16.0, 32.0):
        share = ndimage.gaussian_filter(weight, sigma)
        mean = ndimage.gaussian_filter(values * weight, sigma) / np.maximum(share, 1e-12)
        out = np.where(np.isnan(out) & (share > 0.2), mean, out)
    return np.where(np.isnan(out), values[known].mean(), out)


def relief(depth: Array, grid: Grid, scales: tuple[float, ...]) -> Array:
    """Bulges and hollows of the given sizes (c, rows, columns): the Laplacian of Gaussian, without dimension."""
    return np.array([-((s / grid.step) ** 2) * ndimage.gaussian_laplace(depth, s / grid.step) / s for s in scales])


def foremost(depth: Array, grid: Grid, start: Array, reach: float = 0.12, within: float = 0.15) -> Array:
    """The top (2,) of the bulge at a place: that of the paraboloid through what is around, taken again from there.

    The place itself where there is no bulge, or none with a top within this distance.
    """
    x, y = np.meshgrid(grid.x, grid.y)
    place = np.asarray(start, dtype=np.float64)
    for _ in range(3):
        u, v = x - place[0], y - place[1]
        weight = np.exp(-1.5 * (u * u + v * v) / reach**2)
        near = weight > 0.05
        u, v, root = u[near], v[near], np.sqrt(weight[near])
        terms = np.stack([np.ones_like(u), u, v, 0.5 * u * u, u * v, 0.5 * v * v], axis=1)
        _, a, b, p, q, r = np.linalg.lstsq(terms * root[:, None], depth[near] * root, rcond=None)[0]
        if not (p < 0.0 and p * r > q * q):
            return start
        step = -np.linalg.solve([[p, q], [q, r]], [a, b])
        place = place + step * min(1.0, 0.08 / max(float(np.linalg.norm(step)), 1e-12))
    return place if np.linalg.norm(place - start) < within else start
