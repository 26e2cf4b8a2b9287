"""Long hair of the built-in head: a sheet that falls from a parting, with locks and loose hairs over it.

Lengths are in mm. Hair is opaque, and a hair of the sheet is a row of its points: any program shows it as pictures do.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..array_types import Array, IntArray
from ..geometry import ring_quads, unit
from ..mesh import COLORS, to_polydata
from .head import Head
from .parts import Part

SEED = 5
"""All people have the same locks; how these fall and curl is their own."""

COLUMNS, LOCKS, STRANDS = 220, 240, 300
"""Hairs that the sheet is made of, in order around the head, locks over it, and loose hairs over these."""

KNOTS, LOCK_HAIRS = 14, 5
"""Points along each of them, and hairs side by side in a lock."""

ROOTS_DENSER = 1.4
"""Exponent that gathers the points of the sheet near the parting, where it bends."""

PARTING = np.array([[4.0, -2.0], [5.0, -105.0]])
"""Both ends of the parting: to the left of the middle, and forward from the hairline."""

OVAL, ROUNDER, PARTED_ASIDE = 0.84, 0.045, (-20.0, 30.0)
"""Width of an oval face relative to its height from chin to hairline, and how much wider a round one is. The rounder a
face, the farther aside its hair is parted, up to these distances.
"""

CROOKED = 1.6
"""Deviation of the parting from a straight line."""

WHORL = (0.27, 0.73)
"""Shares of the way around the head at which its hairs begin to come from the rear end of the parting, and cease to."""

FORWARD = 1.5
"""Exponent that gathers hair near the front end of the parting, from where it spreads around the face."""

BACKWARDS, RAISED = 0.35, 0.16
"""How much further back than straight to the side the foremost hair is combed, and how much upwards hair that falls to
the other side of the middle.
"""

FRINGE, FRINGE_HAIRS = 0.12, 6.0
"""How much further forward than the others the foremost hairs are combed, each as far as it happens, and their number
on either side.
"""

STEP, STEPS = 8.0, 42
"""Length and number of the pieces in which hair grows."""

COMBED, WEIGHT = 65.0, 0.8
"""Length over which hair keeps to the way it was combed, and weight in units of that."""

FAR = 20.0
"""Distance from the middle of roots whose hair, if it falls to the other side, is combed twice as far back, and
keeps to that for half as long again.
"""

LIFT, FULLER, GROWTH = 4.5, 4.0, 0.02
"""Height of the sheet over the head, what dense hair has beyond, and what is added along its length."""

WAVE, SHIFT, WAVY = 66.0, 2.5, 6.5
"""Length of the waves of hair, the deviation of their phase around the head, and how far dense hair swings."""

ROUNDING, LEAST = 1.5, 4.5
"""Edges of the hull under the hair are rounded over the first length, which lets up to some 4 mm of them stand out of
it; no hair is lower than the second.
"""

CHEEK = 45.0
"""Hair slides over the face as far forward of the zygion as this, and over all that is above the brows."""

TURNING, TURNED_IN = 0.55, 15.0
"""Share of its length from which hair turns in, and how far its tips do."""

UNEVEN, HEM, SHORTEST = 4.0, -36.0, 0.4
"""Deviation of the height of the hem, its height over the chin at length 1, and the share of the way from the brows to
there at which the hem of the shortest is: between that and cropped hair are cuts that a sheet cannot show.
"""

LAYERS, UNDER = 0.3, 8.0
"""Share of the length that the shortest locks lack, and how much shorter than the longest ones the sheet is."""

WIDEST, ROUND, TUCKED, ROUGH, POINTED = (1.0, 4.5), 0.12, 0.2, 0.08, 0.7
"""Half the width of locks; relative to it the height of their middle, the depth of their sides and the deviation of
single hairs from that; and the share of the width that tips lack.
"""

CLEAR, FRAYED = 1.2, 0.015
"""Height of locks over the sheet, and deviation of the lengths of their hairs, as a share."""

STRAND, OFF, LOOSE, ASTRAY = 0.15, 2.0, 6.0, 4.0
"""Half the width of loose hairs, how far the farthest locks and hairs stand off, and the deviation of their tips aside.
"""

SIDES_DARKER, ROOTS_DARKER, UNDER_DARKER = 0.3, 0.4, 0.45
"""How much darker the sides of locks are, the roots of hairs, and the sheet."""


class RoundedHull:
    """A convex hull of points, of 240 planes, with rounded edges: what hair slides down on.

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
        count = 240
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

    The rounder the face, the farther aside the parting; the denser the hair, the fuller and the more wavy.

    Parameters
    ----------
    head : Head
    length : float
        From the mouth (0) to below the chin (1).

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
    lines, ends = _fallen(random, head, hull, length)
    sheet = _between(lines, (ends - UNDER / STEP)[:, None] * np.linspace(0.0, 1.0, KNOTS) ** ROOTS_DENSER)
    across = np.linspace(-1.0, 1.0, LOCK_HAIRS)
    over = ((np.arange(LOCKS) + random.uniform(0.0, 1.0, LOCKS)) / LOCKS * COLUMNS).astype(int)
    locks = _locks(random, hull, lines[over], ends[over], random.uniform(*WIDEST, LOCKS), LOCK_HAIRS, OFF)
    loose = random.integers(0, COLUMNS, STRANDS)
    strands = _locks(random, hull, lines[loose], ends[loose], np.full(STRANDS, STRAND), 2, LOOSE)
    shades = np.exp(0.08 * random.normal(size=(LOCKS, 1, 1))) * (1.0 - SIDES_DARKER * across**2)[:, None]
    parts = [  # points and tints of hairs that are side by side
        (sheet[None], (1.0 - UNDER_DARKER) * _tints(random, 1, COLUMNS)),
        (locks, shades * _tints(random, LOCKS, LOCK_HAIRS)),
        (strands, np.repeat(_tints(random, STRANDS, 1), 2, axis=1)),
    ]
    places = np.concatenate([points.swapaxes(1, 2).reshape(-1, 3) for points, _ in parts])
    height, normals = hull(places)
    places += np.maximum(LEAST - height, 0.0)[:, None] * normals
    mesh = to_polydata(places, _triangles([points.shape[:2] for points, _ in parts]))
    tints = np.concatenate([tints.swapaxes(1, 2).ravel() for _, tints in parts])
    colors = np.asarray(head.paint[0].hair) * tints[:, None]
    mesh.point_data[COLORS] = np.rint(np.clip(colors, 0.0, 255.0)).astype(np.uint8)
    return Part(mesh, follows="skull")


def _fallen(random: np.random.Generator, head: Head, hull: RoundedHull, length: float) -> tuple[Array, Array]:
    """Return the lines (k, STEPS + 1, 3) of the hairs of the sheet, combed and waved, and how many of the steps (k,) it
    takes to reach the hem.
    """
    marks = head.landmarks
    dense = 0.5 + 0.5 * head.paint[0].density
    even, uneven = _even(random, (COLUMNS,), 12.0), _even(random, (COLUMNS,), 2.0)
    share = np.linspace(0.0, 1.0, COLUMNS)  # of the way around
    along = np.interp(share, [0.0, *WHORL, 1.0], [0.0, 1.0, 1.0, 0.0]) ** FORWARD
    roots = hull.top(_parting(random, marks, along))
    aside = np.interp(share, WHORL, [0.5 * np.pi, -0.5 * np.pi]) + 0.05 * even
    comb = np.stack([np.sin(aside), np.zeros(COLUMNS), -np.cos(aside)], axis=1)
    far = np.maximum(-roots[:, 0] * np.sin(aside), 0.0) / FAR
    comb[:, 1] += RAISED * far * (1.0 - along)
    comb[:, 2] -= BACKWARDS * (1.0 + far) * (1.0 - along)
    foremost = np.exp(-np.minimum(share, 1.0 - share) * COLUMNS / FRINGE_HAIRS)
    comb[:, 2] += FRINGE * np.abs(uneven) * foremost / (1.0 + far)
    brows, chin = marks["glabella"][1], marks["menton"][1] + HEM
    down = SHORTEST + (1.0 - SHORTEST) * length
    hem = brows + down * (chin - brows) + UNEVEN * (even + 1.5 * uneven)
    lift = (LIFT + FULLER * dense) * (1.0 + 0.15 * even)
    lines, ends = _grown(hull, roots, comb, COMBED * (1.0 + 0.5 * far), lift, hem)
    grown = np.minimum(np.arange(STEPS + 1) / ends[:, None], 1.0)
    turn = np.maximum(grown - TURNING, 0.0) / (1.0 - TURNING)
    up = hull(lines)[1]
    aside = unit(np.cross(np.gradient(lines, axis=1), up))
    phase = 2.0 * np.pi * STEP / WAVE * np.arange(STEPS + 1) + SHIFT * _even(random, (COLUMNS,), 25.0)[:, None]
    swing = WAVY * dense**1.5 * np.minimum(1.5 * grown, 1.0)
    lines += (swing * np.sin(phase))[..., None] * aside
    lines += (0.6 * swing * np.cos(phase) - TURNED_IN * turn**2)[..., None] * up
    return lines, ends


def _parting(random: np.random.Generator, marks: Mapping[str, Array], along: Array) -> Array:
    """Return the places [x, z] (k, 2) at shares (k,) of the parting, which is where it suits the shape of the face."""
    ratio = (marks["zygion_l"] - marks["zygion_r"])[0] / (marks["trichion"] - marks["menton"])[1]
    front, back = PARTING + np.array([0.0, marks["trichion"][2]])
    front[0] = np.clip(front[0] + (ratio - OVAL) / ROUNDER * PARTED_ASIDE[1], *PARTED_ASIDE)
    places = front + along[:, None] * (back - front)
    places[:, 0] += CROOKED * np.interp(along, np.linspace(0.0, 1.0, 24), _even(random, (24,), 0.8))
    return places


def _grown(hull: RoundedHull, roots: Array, comb: Array, reach: Array, lift: Array, hem: Array) -> tuple[Array, Array]:
    """Return the lines (k, STEPS + 1, 3) of hair, and how many of the steps (k,) it takes to reach the hem."""
    lines, way = [roots], np.zeros_like(roots)
    for step in range(STEPS):
        length, (_, normals) = step * STEP, hull(lines[-1])
        combed = comb - (comb * normals).sum(axis=1, keepdims=True) * normals
        wanted = combed * np.exp(-length / reach)[:, None] - [0.0, WEIGHT, 0.0] if step else combed + 0.4 * normals
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


def _locks(
    random: np.random.Generator, hull: RoundedHull, lines: Array, ends: Array, wide: Array, hairs: int, loose: float
) -> Array:
    """Return the points (k, hairs, KNOTS, 3) of locks along lines (k, s, 3), each a roof of so many hairs.

    Their tips are thin, of different lengths, and stray; the upper ones stand off more. Some begin on the way.
    """
    t, shape = np.linspace(0.0, 1.0, KNOTS), (len(lines), 1)
    begin = 0.45 * random.uniform(0.0, 1.0, shape) ** 2
    end = 1.04 - LAYERS * random.uniform(0.0, 1.0, shape) ** 2
    points = _between(lines, ends[:, None] * (begin + (end - begin) * t**ROOTS_DENSER))
    up = hull(points)[1]
    aside = unit(np.cross(np.gradient(points, axis=1), up))
    off = CLEAR + loose * random.uniform(0.0, 1.0, shape) ** 2 * np.sqrt(t)
    stray = random.normal(0.0, ASTRAY, shape) * t**2 + 0.6 * np.sin(9.0 * t + random.uniform(0.0, 6.0, shape)) * t
    points += off[..., None] * up + stray[..., None] * aside
    half = wide[:, None] * (0.35 + 0.65 * np.minimum(4.0 * t, 1.0)) * (1.0 - POINTED * t**3)
    half, u = half[:, None, :, None], np.linspace(1.0, -1.0, hairs)[:, None, None]
    height = ROUND * (1.0 - u**2) - TUCKED * u**4 + ROUGH * random.normal(size=(len(lines), hairs, 1, 1))
    roof = (points[:, None] + half * (u * aside[:, None] + height * up[:, None])).reshape(-1, KNOTS, 3)
    frayed = (KNOTS - 1.0) * (1.0 - np.abs(random.normal(0.0, FRAYED, (len(roof), 1))))
    return _between(roof, frayed * t).reshape(len(lines), hairs, KNOTS, 3)


def _tints(random: np.random.Generator, locks: int, hairs: int) -> Array:
    """Return factors (locks, hairs, KNOTS) of the color: hairs differ, are dark at the roots and fair at the tips."""
    t = np.linspace(0.0, 1.0, KNOTS)
    streaks = random.uniform(-0.36, 0.36, (locks, hairs, 1)) + 0.12 * _even(random, (locks, hairs, KNOTS), 1.5)
    return np.asarray(np.exp(streaks) * (1.0 - ROOTS_DARKER * np.maximum(1.0 - 5.0 * t, 0.0)) * (1.0 + 0.2 * t**2))


def _even(random: np.random.Generator, shape: tuple[int, ...], reach: float) -> Array:
    """Return noise of deviation 1 that changes slowly along the last axis."""
    noise = gaussian_filter1d(random.normal(size=shape), reach, mode="nearest")
    return np.asarray(noise / noise.std())


def _between(lines: Array, places: Array) -> Array:
    """Return points (k, p, 3) of lines (k, s, 3) at fractional numbers (k, p) of their points."""
    before = np.minimum(places.astype(int), lines.shape[1] - 2)
    hairs, share = np.arange(len(lines))[:, None], (places - before)[..., None]
    return np.asarray((1.0 - share) * lines[hairs, before] + share * lines[hairs, before + 1])


def _triangles(grids: list[tuple[int, int]]) -> IntArray:
    """Return the corners of the triangles of grids, so many of so many columns, each of KNOTS rows."""
    quads, first = [], 0
    for count, columns in grids:
        starts = first + columns * KNOTS * np.arange(count)[:, None, None]
        quads.append((starts + ring_quads(columns, KNOTS, closed=False)).reshape(-1, 4))
        first += count * columns * KNOTS
    corners = np.concatenate(quads)
    return np.vstack([corners[:, [0, 2, 1]], corners[:, [0, 3, 2]]])
