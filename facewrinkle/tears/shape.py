"""The shape of a tear that is shed, as formulas: its thickness, its noise, and the closed solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..array_types import Array, IntArray
from ..geometry import unique_edges
from ..geometry.least_squares import moving_least_squares

DRAINED = 0.85
"""Share of its width that the trail keeps long after the head has passed."""

POOLING = 2.4
"""Thickening of the film per widening of the trail, both as shares: water stays where it is wide."""

TAPER = 2.6
"""Length over which the head narrows into the trail, in halves of its width."""

BUMP = 6.0
"""Height of the highest bumps of the trail, in thicknesses of its film."""

REACH, SOFT = 4.0, 0.3
"""Length over which an extruded head is smoothed, and epsilon of the weights, in halves of its width."""


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
    A tear 3 mm wide and 1 mm high, with its trail:

    >>> Shape(half=1.5, height=1.0, trail=1.0, film=0.05).trail
    1.0
    """

    half: float
    height: float
    trail: float
    film: float


def outline(s: Array, front: float, shape: Shape, wobble: Array | float = 0.0) -> Array:
    """Return half the width of the tear: round in front, narrowing from the head into the trail, round at the start.

    Parameters
    ----------
    s : ndarray, shape (n,)
        Position along the path.
    front : float
        Length of the path that is covered.
    shape : Shape
    wobble : ndarray, shape (n,)
        Change of the trail's width, as a share.

    Examples
    --------
    >>> outline(np.array([0.0, 3.0, 9.0, 10.0]), 10.0, Shape(1.0, 0.8, 0.5, 0.05)).round(3).tolist()
    [0.0, 0.472, 1.0, 0.0]
    """
    width, ends = _straight(s, front, shape, wobble)
    return np.asarray(width * np.sqrt(np.maximum(1.0 - ends, 0.0)))


def _straight(s: Array, front: float, shape: Shape, wobble: Array | float) -> tuple[Array, Array]:
    """Return half the width (n,) without the round ends, and what these take of the level (n,)."""
    behind = (front - s) / shape.half
    left = DRAINED + (1.0 - DRAINED) * np.exp(-np.maximum(behind, 0.0) / 15.0)
    trail = shape.trail * (1.0 + wobble) * left
    cap, start = np.maximum(1.0 - behind, 0.0), np.maximum(1.0 - s / shape.trail, 0.0)
    return trail + (shape.half - trail) * _head(behind), cap**2 + start**2


def _head(behind: Array) -> Array:
    """Return the share (n,) of the head, 1 in front and 0 in the trail, at distances behind the front in halves."""
    return np.asarray(0.5 + 0.5 * np.cos(np.pi * np.clip((behind - 1.0) / TAPER, 0.0, 1.0)))


def thickness(s: Array, w: Array, front: float, shape: Shape, wobble: Array | float = 0.0) -> Array:
    """Return the thickness of the tear: across, its profile is a parabola, and along, it goes with the width.

    Parameters
    ----------
    s, w : ndarray, shape (n,)
        Position along the path and distance from it.
    front : float
        Length of the path that is covered.
    shape : Shape
    wobble : ndarray, shape (n,)
        Change of the trail's width, as a share.

    Returns
    -------
    ndarray, shape (n,)
        0 outside the outline.

    Examples
    --------
    >>> thickness(np.array([9.0, 3.0, 11.0]), np.zeros(3), 10.0, Shape(1.0, 0.8, 0.5, 0.05)).round(3).tolist()
    [0.8, 0.05, 0.0]
    """
    film, head = _film(s, front, shape, wobble)
    return np.asarray((film + (shape.height - film) * head) * _level(s, w, front, shape, wobble))


def raised(s: Array, w: Array, front: float, shape: Shape, wobble: Array | float, noise: Array) -> Array:
    """Return what noise adds to the thickness: bumps on the trail, the paper's step four.

    Parameters
    ----------
    s, w, front, shape, wobble
        As of :func:`thickness`.
    noise : ndarray, shape (n,)
        At least 0; see :func:`rough_film`.

    Examples
    --------
    A bump of noise 0.5 in the trail, and in the head, where none is seen:

    >>> shape, s = Shape(1.0, 0.8, 0.5, 0.05), np.array([3.0, 9.0])
    >>> raised(s, np.zeros(2), 10.0, shape, 0.0, np.full(2, 0.5)).round(3).tolist()
    [0.15, 0.0]
    """
    film, head = _film(s, front, shape, wobble)
    return np.asarray(BUMP * noise * film * (1.0 - head) * _level(s, w, front, shape, wobble))


def _film(s: Array, front: float, shape: Shape, wobble: Array | float) -> tuple[Array | float, Array]:
    """Return the thickness of the film on the path, and the share (n,) of the head in the thickness."""
    return shape.film * (1.0 + POOLING * wobble), _head((front - s) / shape.half) ** 1.5


def _level(s: Array, w: Array, front: float, shape: Shape, wobble: Array | float) -> Array:
    """Return the level (n,) of the tear: 1 on the path, a parabola across, 0 on the outline and outside."""
    width, ends = _straight(s, front, shape, wobble)
    level = 1.0 - (w / width) ** 2 - ends
    return np.where(level > 1e-9, level, 0.0)


def extruded(s: Array, height: Array, front: float, shape: Shape) -> Array:
    """Return heights of a film after its end has been extruded: the paper's step three (Fig. 9 d).

    Parameters
    ----------
    s, height : ndarray, shape (n,)
        Position along the path, and thickness of the film.
    front : float
    shape : Shape

    Examples
    --------
    >>> film = np.array([0.05, 0.05, 0.0])
    >>> extruded(np.array([3.0, 9.0, 11.0]), film, 10.0, Shape(1.0, 0.8, 0.5, 0.05)).tolist()
    [0.05, 0.8, 0.0]
    """
    return np.where((height > 0.0) & (s > front - 2.0 * shape.half), shape.height, height)


def smoothed_head(s: Array, w: Array, height: Array, front: float, shape: Shape) -> Array:
    """Return heights of an extruded head after smoothing by moving least squares of degree 0 (Fig. 9 e).

    Behind the head nothing changes, and the outline stays on the skin.

    Parameters
    ----------
    s, w, height : ndarray, shape (n,)
        Position along the path, distance from it, and height.
    front : float
    shape : Shape

    Examples
    --------
    In the trail, and across the head, which is lower towards its edges:

    >>> s, w = np.array([2.0, 9, 9, 9, 9, 9]), np.array([0.0, -1, -0.5, 0, 0.5, 1])
    >>> block = np.array([0.05, 0, 0.8, 0.8, 0.8, 0])
    >>> smoothed_head(s, w, block, 10.0, Shape(1.0, 0.8, 0.5, 0.05)).round(2).tolist()
    [0.05, 0.0, 0.72, 0.8, 0.72, 0.0]
    """
    behind = (front - s) / shape.half
    near = (behind > -1.0) & (behind < REACH)
    out, places = height.copy(), np.stack([s[near], w[near]], axis=1)
    if near.any():
        smooth = moving_least_squares(places, places, height[near], 0, SOFT * shape.half)
        smooth *= height[near].max() / max(smooth.max(), 1e-300)  # the head stays as high
        share = np.clip(REACH - behind[near], 0.0, 1.0) * (height[near] > 0.0)
        out[near] += share * (smooth - height[near])
    return out


def rough_film(
    length: float, half: float, roughness: float, degree: int, random: np.random.Generator
) -> tuple[Array, float]:
    """Return noise over a grid of (s, w) for the top of a tear: bumps of height 0 to 1 in some places, 0 elsewhere.

    Parameters
    ----------
    length, half : float
        The grid spans [0, length] and [-half, half].
    roughness : float
        0 to 1: rough skin holds more water back. Half as large a share of the places is raised, so that even the
        roughest trail is no even belt.
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
    raised = random.random(s.size) < 0.5 * roughness
    values = np.where(raised, random.uniform(0.3, 1.0, s.size), 0.0)
    noise = np.empty((len(grid_s), len(grid_w)))
    for first in range(0, len(grid_s), 32):  # so many rows together: far away points hardly count
        part = grid_s[first : first + 32]
        near = (places[:, 0] > part[0] - 6.0 * apart) & (places[:, 0] < part[-1] + 6.0 * apart)
        x = np.stack(np.meshgrid(part, grid_w, indexing="ij"), axis=-1).reshape(-1, 2)
        fitted = moving_least_squares(x, places[near], values[near], degree, 0.2 * apart)
        noise[first : first + len(part)] = fitted.reshape(len(part), -1)
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
