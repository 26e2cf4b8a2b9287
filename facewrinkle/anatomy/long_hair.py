"""Long hair of the built-in head: a sheet that falls from a parting in locks, with loose strands over it.

Lengths are in mm. Hair is opaque, and a hair of the sheet is a row of its points: any program shows it as pictures do.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..array_types import Array, IntArray
from ..geometry import ring_quads, unit
from ..mesh import COLORS, to_polydata
from .head import Head
from .parts import Part

SEED = 5
"""All people have the same locks, in their own colors."""

COLUMNS, STRANDS = 400, 300
"""Hairs that the sheet is made of, in order around the head, and loose ones."""

KNOTS, STRAND_KNOTS = 18, 10
"""Points along each of them."""

ROOTS_DENSER = 1.4
"""Exponent that gathers the points of the sheet near the parting, where it bends."""

STRAND, ASTRAY = 0.25, 3.0
"""Half the width of loose strands, and the deviation of their tips to the side."""

SWAY = 3.0
"""How far hairs swing to the side on their way down."""

LOCK, POINTED, BULGE = 6.0, 11.0, 5.0
"""Hairs of a lock, and how far its middle hangs below its sides and stands out between them."""

SIDES_DARKER, ROOTS_DARKER = 0.4, 0.45
"""How much darker the sides of locks are, and the roots of hairs."""

STEP, STEPS = 8.0, 38
"""Length and number of the pieces in which hair grows."""

PARTING = np.array([[8.0, -4.0], [5.0, -105.0]])
"""Both ends of the parting: to the left of the middle, and forward from the hairline."""

WHORL = (0.27, 0.73)
"""Shares of the way around the head at which its hairs begin to come from the rear end of the parting, and cease to."""

BACKWARDS = 0.35
"""How much further back than straight to the side the foremost hair is combed."""

COMBED, WEIGHT = 65.0, 0.8
"""Length over which hair keeps to the way it was combed, and weight in units of that."""

LIFT, LOOSE, GROWTH = 8.0, 6.0, 0.02
"""Height of the sheet over the head, of the loosest strands over the sheet, and what is added along their length."""

ROUNDING, LEAST = 2.5, 6.0
"""Edges of the hull under the hair are rounded over the first length, which lets up to some 4 mm of them stand out of
it; no hair is lower than the second.
"""

CHEEK = 45.0
"""Hair slides over the face as far forward of the zygion as this, and over all that is above the brows."""

TURNING, TURNED_IN = 0.55, 14.0
"""Share of its length from which hair turns in, and how far its tips do."""

UNEVEN, HEM, SHORTEST = 4.0, 6.0, 0.55
"""Deviation of the height of the hem, its height over the chin at length 1, and the share of the way from the brows to
there at which the hem of the shortest is: between that and cropped hair are cuts that a sheet cannot show.
"""


class RoundedHull:
    """A convex hull of points, of 160 planes, with rounded edges: what hair slides down on.

    Parameters
    ----------
    points : ndarray, shape (n, 3)

    Examples
    --------
    Above a ball:

    >>> import pyvista as pv
    >>> ball = RoundedHull(np.asarray(pv.Sphere(radius=80.0).points))
    >>> height, normals = ball(np.array([[0.0, 120.0, 0.0]]))
    >>> bool(abs(height[0] - 40.0) < 5.0), normals.round(1) + 0.0
    (True, array([[0., 1., 0.]]))
    """

    def __init__(self, points: Array) -> None:
        count = 160
        share = 1.0 - (2.0 * np.arange(count) + 1.0) / count
        turn, radius = np.pi * (1.0 + 5.0**0.5) * np.arange(count), np.sqrt(1.0 - share**2)
        self.directions = np.stack([radius * np.cos(turn), share, radius * np.sin(turn)], axis=1)
        self.supports = (points @ self.directions.T).max(axis=0)

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Return heights (...) of points (..., 3) above the hull, and its normals (..., 3) there."""
        beyond = (points @ self.directions.T - self.supports) / ROUNDING
        most = beyond.max(axis=-1, keepdims=True)
        near = np.exp(beyond - most)
        return ROUNDING * (most[..., 0] + np.log(near.sum(axis=-1))), unit(near @ self.directions)

    def top(self, places: Array) -> Array:
        """Return the points (k, 3) of the hull above places [x, z] (k, 2)."""
        upper = self.directions[:, 1] > 0.1
        x, y, z = self.directions[upper].T
        height = ((self.supports[upper] - places @ np.stack([x, z])) / y).min(axis=1)
        return np.stack([places[:, 0], height, places[:, 1]], axis=1)


def long_hair(head: Head, length: float) -> Part:
    """Return hair that hangs down from a parting, the same for the same head and length.

    Parameters
    ----------
    head : Head
    length : float
        From the mouth (0) to the chin (1).

    Examples
    --------
    Does it reach below the chin?

    >>> from facewrinkle.anatomy.head import load_head
    >>> head = load_head()
    >>> [bool(long_hair(head, length).mesh.bounds[2] < head.landmarks["menton"][1]) for length in (0.2, 1.0)]
    [False, True]
    """
    random, marks, points = np.random.default_rng(SEED), head.landmarks, head.points
    behind = (points[:, 1] > marks["menton"][1]) & (points[:, 2] < marks["zygion_l"][2] + CHEEK)
    hull = RoundedHull(points[behind | (points[:, 1] > marks["glabella"][1])])
    even, uneven = _even(random, (COLUMNS,), 14.0), _even(random, (COLUMNS,), 2.0)
    lock = np.abs(np.sin(np.cumsum(np.pi / LOCK * np.exp(0.7 * _even(random, (COLUMNS,), 3.0)))))
    share = np.linspace(0.0, 1.0, COLUMNS)  # of the way around
    along = np.interp(share, [0.0, *WHORL, 1.0], [0.0, 1.0, 1.0, 0.0])
    front, back = PARTING + np.array([0.0, marks["trichion"][2]])
    roots = hull.top(front + along[:, None] * (back - front))
    aside = np.interp(share, WHORL, [0.5 * np.pi, -0.5 * np.pi]) + 0.05 * even
    comb = np.stack([np.sin(aside), np.zeros(COLUMNS), -np.cos(aside)], axis=1)
    comb[:, 2] -= BACKWARDS * np.clip(roots[:, 2] / front[1], 0.0, 1.0)
    brows, chin = marks["glabella"][1], marks["menton"][1] + HEM
    down = SHORTEST + (1.0 - SHORTEST) * length
    hem = brows + down * (chin - brows) + UNEVEN * (even + uneven) - POINTED * (lock**2 - 0.5)
    lines, ends = _grown(hull, roots, comb, LIFT * (1.0 + 0.15 * even), hem)
    grown = np.minimum(np.arange(STEPS + 1) / ends[:, None], 1.0)
    turn = np.maximum(grown - TURNING, 0.0) / (1.0 - TURNING)
    up = hull(lines)[1]
    aside = unit(np.cross(np.gradient(lines, axis=1), up))
    sway = SWAY * grown**1.5 * (np.sin(5.0 * grown + 2.0 * even[:, None]) + _even(random, (COLUMNS,), 6.0)[:, None])
    lines += sway[..., None] * aside - (TURNED_IN * turn**2 + BULGE * (1.0 - lock[:, None]) * grown)[..., None] * up
    sheet = _between(lines, ends[:, None] * np.linspace(0.0, 1.0, KNOTS) ** ROOTS_DENSER).swapaxes(0, 1)
    over = (COLUMNS * random.beta(0.6, 0.6, STRANDS)).astype(int)
    strands = _strands(random, hull, lines[over], ends[over])
    places = np.concatenate([sheet.reshape(-1, 3), strands.reshape(-1, 3)])
    height, normals = hull(places)
    places += np.maximum(LEAST - height, 0.0)[:, None] * normals
    quads = np.vstack([_quads(1, COLUMNS, KNOTS), _quads(STRANDS, 3, STRAND_KNOTS) + COLUMNS * KNOTS])
    mesh = to_polydata(places, np.vstack([quads[:, [0, 2, 1]], quads[:, [0, 3, 2]]]))
    rooted = 1.0 - ROOTS_DARKER * np.maximum(1.0 - 5.0 * np.linspace(0.0, 1.0, KNOTS), 0.0)
    tint = _tints(random, COLUMNS, KNOTS) * rooted * (1.0 - SIDES_DARKER * (1.0 - lock[:, None]))
    tints = np.append(tint.T, np.repeat(_tints(random, STRANDS, STRAND_KNOTS), 3))
    colors = np.asarray(head.paint[0].hair) * tints[:, None]
    mesh.point_data[COLORS] = np.rint(np.clip(colors, 0.0, 255.0)).astype(np.uint8)
    return Part(mesh, follows="skull")


def _grown(hull: RoundedHull, roots: Array, comb: Array, lift: Array, hem: Array) -> tuple[Array, Array]:
    """Return the lines (k, STEPS + 1, 3) of hair, and how many of the steps (k,) it takes to reach the hem."""
    lines, way = [roots], np.zeros_like(roots)
    for step in range(STEPS):
        length, (_, normals) = step * STEP, hull(lines[-1])
        combed = comb - (comb * normals).sum(axis=1, keepdims=True) * normals
        wanted = combed * np.exp(-length / COMBED) - [0.0, WEIGHT, 0.0] if step else combed + 0.4 * normals
        way = unit(1.5 * way + unit(wanted))
        points = lines[-1] + STEP * way
        height, normals = hull(points)
        least = lift * (1.0 - np.exp(-(length + STEP) / 30.0)) + GROWTH * (length + STEP)
        lines.append(points + np.maximum(least - height, 0.0)[:, None] * normals)
    grown = np.stack(lines, axis=1)
    low = grown[:, 1:, 1] < hem[:, None]
    low[:, -1] = True
    last, hairs = low.argmax(axis=1), np.arange(len(roots))
    above, below = grown[hairs, last, 1], grown[hairs, last + 1, 1]
    return grown, last + np.clip((above - hem) / (above - below), 0.0, 1.0)


def _strands(random: np.random.Generator, hull: RoundedHull, lines: Array, ends: Array) -> Array:
    """Return the points (k, STRAND_KNOTS, 3, 3) of ribbons, which begin somewhere on the way.

    They are roofs: from the side, too, one sees how wide they are.
    """
    share, shape = np.linspace(0.0, 1.0, STRAND_KNOTS), (len(lines), 1)
    begin = random.uniform(0.0, 0.5, shape)
    end = begin + (1.07 - begin) * np.sqrt(random.uniform(0.1, 1.0, shape))
    points = _between(lines, ends[:, None] * (begin + (end - begin) * share))
    up = hull(points)[1]
    aside = unit(np.cross(np.gradient(points, axis=1), up))
    loose = LOOSE * random.uniform(0.0, 1.0, shape) ** 2 * np.sqrt(share)
    points += (0.4 + loose)[..., None] * up + (random.normal(0.0, ASTRAY, shape) * share**2)[..., None] * aside
    half = (STRAND * random.uniform(0.8, 1.2, shape) * (1.0 - 0.4 * share**2))[..., None]
    return np.stack([points + half * aside, points + half * up, points - half * aside], axis=2)


def _tints(random: np.random.Generator, hairs: int, knots: int) -> Array:
    """Return factors (hairs, knots) of the color: hairs differ, and are fair at the tips."""
    streaks = 0.24 * random.normal(size=(hairs, 1)) + 0.15 * _even(random, (hairs, knots), 1.5)
    return np.asarray(np.exp(streaks) * (1.0 + 0.2 * np.linspace(0.0, 1.0, knots) ** 2))


def _even(random: np.random.Generator, shape: tuple[int, ...], reach: float) -> Array:
    """Return noise of deviation 1 that changes slowly along the last axis."""
    noise = gaussian_filter1d(random.normal(size=shape), reach, mode="nearest")
    return np.asarray(noise / noise.std())


def _between(lines: Array, places: Array) -> Array:
    """Return points (k, p, 3) of lines (k, s, 3) at fractional numbers (k, p) of their points."""
    before = np.minimum(places.astype(int), lines.shape[1] - 2)
    hairs, share = np.arange(len(lines))[:, None], (places - before)[..., None]
    return np.asarray((1.0 - share) * lines[hairs, before] + share * lines[hairs, before + 1])


def _quads(count: int, columns: int, rows: int) -> IntArray:
    """Return the corners of the quads of grids with so many columns and rows."""
    first = columns * rows * np.arange(count)[:, None, None]
    return np.asarray((first + ring_quads(columns, rows, closed=False)).reshape(-1, 4))
