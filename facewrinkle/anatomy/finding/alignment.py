"""A pose made exact: first the depth of the face is laid on the template's, then its relief."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from .depth import Grid, Pose, closed, depth_map, relief
from .template import template

Array = npt.NDArray[np.float64]

COARSE, FINE = Grid(0.07), Grid(0.035)
SCALES = (0.06, 0.11, 0.22)
"""Sizes of bulges and hollows that are compared, in distances between the pupils."""

STRONG = 0.5
"""Relief beyond this is compressed: the rims of masks, hair and cloth must not outweigh a face."""

STIFF = 0.003
"""Resistance to stretch."""

OFF = 0.35
"""A surface that lies farther from the template counts as none."""


@dataclass(frozen=True, eq=False)
class Map:
    """What is seen over a grid: depth with closed holes, relief (c, rows, columns), how much places count, and how
    far there is a surface (0 to 1).
    """

    depth: Array
    relief: Array
    weight: Array
    known: Array


@cache
def template_map(grid: Grid, person: int = 0) -> Map:
    """The built-in head as one of several people."""
    depth, weight = template(person).depth(grid)
    return Map(depth, _compressed(relief(depth, grid, SCALES)), weight, (weight > 0.0).astype(np.float64))


def seen(points: Array, triangles: npt.NDArray[np.int64], pose: Pose, grid: Grid, person: int = 0) -> Map:
    """The surface in this pose; places that are not seen weigh nothing."""
    base = template_map(grid, person)
    raw = depth_map(pose.local(points), triangles, grid)
    offset = _offset(raw, base)
    raw[np.abs(raw - base.depth - offset) > OFF] = np.nan
    depth, known = closed(raw, grid, template(person).agape, base.depth)
    sure = gaussian_filter(known.astype(float), SCALES[0] / grid.step) ** 2
    return Map(depth, _compressed(relief(depth, grid, SCALES)), base.weight * sure, sure)


def _offset(raw: Array, base: Map) -> float:
    inside = (base.weight > 0.0) & (np.abs(raw - base.depth) < 1.0)
    return float(np.median((raw - base.depth)[inside])) if inside.any() else 0.0


def _compressed(values: Array) -> Array:
    return np.asarray(values / np.sqrt(1.0 + (values / STRONG) ** 2))


def likeness(found: Map, base: Map) -> float:
    """How much a surface looks like the template, at most 1: correlation of relief, less where little is seen of a
    quarter of the face or where depth differs.
    """
    if found.weight.sum() < 0.2 * base.weight.sum():
        return -1.0
    correlations = [_correlation(a, b, found.weight) for a, b in zip(found.relief, base.relief, strict=True)]
    return float(np.mean(correlations)) * covered(found, base) ** 0.5 - 4.0 * distance(found, base)


def covered(found: Map, base: Map) -> float:
    """Share of the template that is seen, in that quarter of the face that shows least."""
    rows, columns = (length // 2 for length in base.weight.shape)
    quarters = [np.s_[i, j] for i in (np.s_[:rows], np.s_[rows:]) for j in (np.s_[:columns], np.s_[-columns:])]
    return float(min(found.weight[quarter].sum() / base.weight[quarter].sum() for quarter in quarters))


def distance(found: Map, base: Map) -> float:
    """Median difference of depth, in distances between the pupils."""
    difference = (found.depth - base.depth)[found.weight > 0.2]
    return float(np.median(np.abs(difference - np.median(difference)))) if difference.size else 1.0


def _correlation(a: Array, b: Array, weight: Array) -> float:
    norm = np.sqrt((weight * a * a).sum() * (weight * b * b).sum())
    return float((weight * a * b).sum() / max(norm, 1e-12))


def laid_on(points: Array, triangles: npt.NDArray[np.int64], pose: Pose, look: int = 0, steps: int = 14) -> Pose:
    """The pose in which the depth is closest to the template's: Gauss-Newton over turn, shift, size and stretch.

    A surface of height h(x, y) that moves by a small (a, b, c) has the new height h + c - a dh/dx - b dh/dy at the
    same place. Places that differ much count less and less.
    """
    grid, base = COARSE, template_map(COARSE, look)
    x, y = np.meshgrid(grid.x, grid.y)
    for step in range(steps):
        raw = depth_map(pose.local(points), triangles, grid)
        raw -= _offset(raw, base) if step == 0 else 0.0
        tolerance = 0.25 * 0.85**step + 0.05
        difference = raw - base.depth
        near = (base.weight > 0.0) & (np.abs(difference) < 3.0 * tolerance)
        slope_y, slope_x = np.asarray(np.gradient(raw, grid.step))
        near &= np.isfinite(slope_x) & np.isfinite(slope_y)
        if near.sum() < 60:
            return pose
        d, z, u, v = difference[near], raw[near], slope_x[near], slope_y[near]
        px, py = x[near], y[near]
        weight = base.weight[near] / (1.0 + (d / tolerance) ** 2) ** 2 / (1.0 + u * u + v * v)
        turn = [py + v * z, -px - u * z, u * py - v * px]
        columns = np.stack([*turn, -u, -v, np.ones_like(z), z - u * px - v * py, -v * py, z], axis=1)
        scaled = columns * weight[:, None]
        stiff = weight.sum() * np.array([*[1e-3] * 7, *[STIFF if step >= 4 else 1.0] * 2])
        held = np.array([*[0.0] * 7, *np.log(pose.stretch[1:])])
        change = -np.linalg.solve(scaled.T @ columns + np.diag(stiff), scaled.T @ d - stiff * held)
        change *= min(1.0, 0.3 / max(float(np.abs(change).max()), 1e-12))
        pose = _moved(pose, change)
    return pose


def _moved(pose: Pose, change: Array) -> Pose:
    """The pose whose local coordinates are stretched exp(s) R(w) local + t, for change = (w, t, s, stretch)."""
    turn, grow = Rotation.from_rotvec(change[:3]).as_matrix(), float(np.exp(change[6]))
    origin = pose.world(-(change[3:6] @ turn / grow)[None])[0]
    return Pose(turn @ pose.axes, origin, pose.size / grow, pose.stretch * np.exp([0.0, *-change[7:9]]))
