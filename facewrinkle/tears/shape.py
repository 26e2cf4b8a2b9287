"""The shape of a tear that is shed, as formulas: its thickness, its noise, and the closed solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..array_types import Array, IntArray
from ..geometry.least_squares import moving_least_squares
from ..geometry.topology import unique_edges

DRAINED = 0.85
"""Share of its width that the trail keeps long after the head has passed."""

POOLING = 2.0
"""Thickening of the film per widening of the trail, both as shares: water stays where it is wide."""

TAPER = 2.6
"""Length over which the head narrows into the trail, in halves of its width."""

ROWS = 32
"""Rows of the grid of noise that are fitted together."""


@dataclass(frozen=True)
class Shape:
    """Sizes of a tear that is shed, in the unit of the surface.

    Attributes
    ----------
    half : float
        Half the width of the head.
    height : float
        Height of the head.
    trail, film : float
        Half the width, and the thickness, of the trail.

    Examples
    --------
    A tear 3 mm wide and 1 mm high, with its trail, and one of half the size:

    >>> Shape(half=1.5, height=1.0, trail=1.0, film=0.05).scaled(0.5)
    Shape(half=0.75, height=0.5, trail=0.5, film=0.025)
    """

    half: float
    height: float
    trail: float
    film: float

    def scaled(self, factor: float) -> Shape:
        """Return the shape with all sizes times `factor`."""
        return Shape(self.half * factor, self.height * factor, self.trail * factor, self.film * factor)


def thickness(
    s: Array,
    w: Array,
    front: float,
    shape: Shape,
    wobble: Array | float = 0.0,
    rough: Array | float = 0.0,
    depth: float = 0.0,
) -> tuple[Array, Array]:
    """Return the level of the tear, which is 0 on its outline, and its thickness.

    The head is round in front and tapers into the trail; across, its profile is a parabola.

    Parameters
    ----------
    s, w : ndarray, shape (n,)
        Position along the path and distance from it.
    front : float
        Length of the path that is covered.
    shape : Shape
    wobble, rough : ndarray, shape (n,)
        Change of the trail's width, and what is added to its thickness, as shares.
    depth : float
        Outside the outline, the height goes on below 0 as the level does, down to this level below 0.

    Returns
    -------
    level : ndarray, shape (n,)
        Above 0 inside the outline, 1 on the path.
    height : ndarray, shape (n,)
        0 outside the outline, unless it goes on below it.

    Examples
    --------
    >>> level, height = thickness(np.array([9.0, 3.0, 11.0]), np.zeros(3), 10.0, Shape(1.0, 0.8, 0.5, 0.05))
    >>> height.round(3).tolist()
    [0.8, 0.05, 0.0]
    """
    behind = (front - s) / shape.half
    head = 0.5 + 0.5 * np.cos(np.pi * np.clip((behind - 1.0) / TAPER, 0.0, 1.0))
    left = DRAINED + (1.0 - DRAINED) * np.exp(-np.maximum(behind, 0.0) / 15.0)
    half = shape.trail * (1.0 + wobble) * left
    half += (shape.half - half) * head
    cap, start = np.maximum(1.0 - behind, 0.0), np.maximum(1.0 - s / shape.trail, 0.0)
    level = 1.0 - (w / half) ** 2 - cap**2 - start**2
    film = shape.film * (1.0 + rough) * (1.0 + POOLING * wobble)
    return level, (film + (shape.height - film) * head**1.5) * np.maximum(level, 0.0 - depth)


def rough_film(
    length: float, half: float, roughness: float, degree: int, random: np.random.Generator
) -> tuple[Array, float]:
    """Return noise over a grid of (s, w) for the top of a tear: bumps of height 0 to 1 in some places, 0 elsewhere.

    Parameters
    ----------
    length, half : float
        The grid spans [0, length] and [-half, half].
    roughness : float
        Share of the places that are raised, 0 to 1: rough skin holds more water back.
    degree : int
        Degree of the moving least squares. Above 0 they dip below 0 and are cut off: the tear must not enter the skin.

    Returns
    -------
    noise : ndarray, shape (i, j)
        At least 0.
    spacing : float
        Spacing of the grid.

    Examples
    --------
    A trail 40 mm long and 2 mm wide, on rough skin and on smooth skin, which holds nothing back:

    >>> rough, spacing = rough_film(40.0, 1.0, 0.3, 0, np.random.default_rng(7))
    >>> smooth, _ = rough_film(40.0, 1.0, 0.0, 0, np.random.default_rng(7))
    >>> rough.shape, spacing, bool(rough.max() > 0.3), float(smooth.max())
    ((161, 9), 0.25, True, 0.0)
    """
    spacing = half / 4.0
    grid_s, grid_w = np.arange(0.0, length + spacing, spacing), spacing * np.arange(-4, 5)
    apart = 2.5 * spacing
    s, w = np.meshgrid(np.arange(0.0, length + apart, apart), apart * np.arange(-2, 3), indexing="ij")
    places = np.stack([s.ravel(), w.ravel()], axis=1) + random.uniform(-0.35, 0.35, (s.size, 2)) * apart
    raised = random.random(s.size) < roughness
    values = np.where(raised, random.uniform(0.3, 1.0, s.size), 0.0)
    noise = np.empty((len(grid_s), len(grid_w)))
    for first in range(0, len(grid_s), ROWS):  # far away points hardly count
        part = grid_s[first : first + ROWS]
        near = (places[:, 0] > part[0] - 6.0 * apart) & (places[:, 0] < part[-1] + 6.0 * apart)
        x = np.stack(np.meshgrid(part, grid_w, indexing="ij"), axis=-1).reshape(-1, 2)
        fitted = moving_least_squares(x, places[near], values[near], degree, 0.4 * apart)
        noise[first : first + ROWS] = fitted.reshape(len(part), -1)
    return np.maximum(noise, 0.0), spacing


def waves(random: np.random.Generator, n: int, scale: float) -> Array:
    """Return smooth random numbers (n,) between -1 and 1 that change over about `scale` of them.

    Examples
    --------
    >>> float(np.abs(waves(np.random.default_rng(0), 50, 5.0)).max())
    1.0
    """
    smooth = np.asarray(gaussian_filter1d(random.normal(size=n), scale, mode="nearest"))
    return smooth / max(float(np.abs(smooth).max()), 1e-9)


def solid(bottom: Array, top: Array, triangles: IntArray) -> tuple[Array, IntArray]:
    """Return the closed surface between a bottom and a top with the same triangles, joined by walls along the outline.

    Parameters
    ----------
    bottom, top : ndarray, shape (n, 3)
    triangles : ndarray of int32, shape (m, 3)
        Of a disk.

    Returns
    -------
    points : ndarray, shape (2 n, 3)
        Those of the top, then those of the bottom.
    triangles : ndarray of int32, shape (2 m + 2 b, 3)
        For b sides of the outline. Oriented outwards if those given face from the bottom towards the top.

    Examples
    --------
    >>> flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> points, triangles = solid(flat, flat + [0.0, 0.0, 1.0], np.array([[0, 1, 2]], np.int32))
    >>> points.shape, triangles.shape
    ((6, 3), (8, 3))
    """
    _, sides = unique_edges(triangles)
    t, k = np.nonzero(np.bincount(sides.ravel())[sides] == 1)
    a, b, n = triangles[t, k], triangles[t, (k + 1) % 3], len(bottom)
    walls = [np.stack([a + n, b + n, b], axis=1), np.stack([a + n, b, a], axis=1)]
    return np.concatenate([top, bottom]), np.concatenate([triangles, triangles[:, ::-1] + n, *walls]).astype(np.int32)
