"""The exact pose: the depth of a surface is aligned with the template's."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from ...array_types import Array, IntArray
from .depth import Grid, curvature, depth_map, openings_closed
from .template import Pose, template

COARSE, FINE = Grid(0.07), Grid(0.035)
SCALES = (0.06, 0.11, 0.22)
"""Sizes of bulges and hollows that are compared, in distances between the pupils."""

STRONG = 0.5
"""Curvature beyond this is compressed: the rims of masks, hair and cloth must not outweigh a face."""

BACKGROUND = 0.35
"""A surface that lies farther than this from the template is not the face, in distances between the pupils."""

# The Gauss-Newton steps of an alignment.
STEPS = 14
FEWEST_NODES = 60
"""Nodes of the grid near the template that an alignment needs at least."""
RIGID_STEPS = 4
"""Steps in which proportions hardly change: size and place come first."""
STRETCH_STIFFNESS = 0.003
"""Resistance to stretch in the later steps."""
LARGEST_CHANGE = 0.3
"""Turn, shift and growth of one step, at most."""

# How likely a pose is to be that of a face.
LEAST_SHOWN = 0.2
"""A pose has the score -1 where less than this share of the template is seen."""
DEPTH_PENALTY = 4.0
"""Loss of likelihood per median difference of depth of one distance between the pupils."""


@dataclass(frozen=True, eq=False)
class SurfaceMap:
    """A surface seen from the front, over a grid.

    Attributes
    ----------
    depth : ndarray, shape (rows, columns)
        With closed openings.
    curvature : ndarray, shape (c, rows, columns)
        At each of :data:`SCALES`, compressed where it is strong.
    weight : ndarray, shape (rows, columns)
        0 outside of the face and where no surface is seen.
    known : ndarray, shape (rows, columns)
        1 where a surface is seen, falling to 0 where there is none.
    """

    depth: Array
    curvature: Array
    weight: Array
    known: Array


@cache
def template_map(grid: Grid, variant: int = 0) -> SurfaceMap:
    """Return the map of one of the template's variants."""
    depth, weight = template(variant).depth(grid)
    return SurfaceMap(depth, _compressed(curvature(depth, grid, SCALES)), weight, (weight > 0.0).astype(np.float64))


def surface_map(points: Array, triangles: IntArray, pose: Pose, grid: Grid, variant: int = 0) -> SurfaceMap:
    """Return the map of a surface in a pose; places that are not seen weigh nothing."""
    base = template_map(grid, variant)
    depth = depth_map(pose.local(points), triangles, grid)
    depth[np.abs(depth - base.depth - _median_offset(depth, base)) > BACKGROUND] = np.nan
    closed, known = openings_closed(depth, grid, template(variant).mouth_open, base.depth)
    certain = gaussian_filter(known.astype(float), SCALES[0] / grid.step) ** 2
    return SurfaceMap(closed, _compressed(curvature(closed, grid, SCALES)), base.weight * certain, certain)


def _median_offset(depth: Array, base: SurfaceMap) -> float:
    inside = (base.weight > 0.0) & (np.abs(depth - base.depth) < 1.0)
    return float(np.median((depth - base.depth)[inside])) if inside.any() else 0.0


def _compressed(values: Array) -> Array:
    return np.asarray(values / np.sqrt(1.0 + (values / STRONG) ** 2))


def pose_score(found: SurfaceMap, base: SurfaceMap) -> float:
    """Likeness of a surface to the template, at most 1: the mean correlation of curvature.

    Less where little is seen of a quarter of the face, and where depth differs.
    """
    if found.weight.sum() < LEAST_SHOWN * base.weight.sum():
        return -1.0
    correlations = [_correlation(a, b, found.weight) for a, b in zip(found.curvature, base.curvature, strict=True)]
    return float(np.mean(correlations)) * coverage(found, base) ** 0.5 - DEPTH_PENALTY * depth_difference(found, base)


def coverage(found: SurfaceMap, base: SurfaceMap) -> float:
    """Share of the template that is seen in the quarter of the face that shows least."""
    rows, columns = (length // 2 for length in base.weight.shape)
    quarters = [np.s_[i, j] for i in (np.s_[:rows], np.s_[rows:]) for j in (np.s_[:columns], np.s_[-columns:])]
    return float(min(found.weight[quarter].sum() / base.weight[quarter].sum() for quarter in quarters))


def depth_difference(found: SurfaceMap, base: SurfaceMap) -> float:
    """Median difference of depth about a common offset, in distances between the pupils."""
    difference = (found.depth - base.depth)[found.weight > 0.2]
    return float(np.median(np.abs(difference - np.median(difference)))) if difference.size else 1.0


def _correlation(a: Array, b: Array, weight: Array) -> float:
    norm = np.sqrt((weight * a * a).sum() * (weight * b * b).sum())
    return float((weight * a * b).sum() / max(norm, 1e-12))


def aligned(points: Array, triangles: IntArray, pose: Pose, variant: int = 0) -> Pose:
    """Return the pose in which the depth is closest to the template's: Gauss-Newton over turn, shift, size and stretch.

    The more a place differs, the less it counts.
    """
    grid, base = COARSE, template_map(COARSE, variant)
    for step in range(STEPS):
        depth = depth_map(pose.local(points), triangles, grid)
        depth -= _median_offset(depth, base) if step == 0 else 0.0
        stiffness = STRETCH_STIFFNESS if step >= RIGID_STEPS else 1.0
        change = _gauss_newton_step(depth, base, pose, 0.25 * 0.85**step + 0.05, stiffness)
        if change is None:
            return pose
        pose = _moved(pose, change)
    return pose


def _gauss_newton_step(depth: Array, base: SurfaceMap, pose: Pose, tolerance: float, stiffness: float) -> Array | None:
    """The change (w, t, s, stretch) that brings a depth map closer to the template's; None if too little is near it.

    A surface of height h(x, y) that moves by a small (a, b, c) has the new height h + c - a dh/dx - b dh/dy at the
    same place. Turns and shifts, growth, and stretch upward and forward have these derivatives; the more a place
    differs, and the steeper it is, the less it weighs.
    """
    slope_y, slope_x = np.array(np.gradient(depth, COARSE.step))
    difference = depth - base.depth
    near = (base.weight > 0.0) & (np.abs(difference) < 3.0 * tolerance) & np.isfinite(slope_x) & np.isfinite(slope_y)
    if near.sum() < FEWEST_NODES:
        return None
    x, y = (axis[near] for axis in np.meshgrid(COARSE.x, COARSE.y))
    d, z, u, v = difference[near], depth[near], slope_x[near], slope_y[near]
    derivatives = np.array(
        [y + v * z, -x - u * z, u * y - v * x, -u, -v, np.ones_like(z), z - u * x - v * y, -v * y, z]
    )
    weights = base.weight[near] / (1.0 + (d / tolerance) ** 2) ** 2 / (1.0 + u * u + v * v)
    weight, weighted = weights.sum(), derivatives * weights
    square, right = weighted @ derivatives.T, weighted @ d
    stiff = weight * np.array([*[1e-3] * 7, *[stiffness] * 2])
    stretch = np.array([*[0.0] * 7, *np.log(pose.stretch[1:])])
    change = -np.linalg.solve(square + np.diag(stiff), right - stiff * stretch)
    return np.asarray(change * min(1.0, LARGEST_CHANGE / max(float(np.abs(change).max()), 1e-12)))


def _moved(pose: Pose, change: Array) -> Pose:
    """The pose whose local coordinates are stretched exp(s) R(w) local + t, for change = (w, t, s, stretch)."""
    turn, growth = Rotation.from_rotvec(change[:3]).as_matrix(), float(np.exp(change[6]))
    origin = pose.world(-(change[3:6] @ turn / growth)[None])[0]
    return Pose(turn @ pose.axes, origin, pose.size / growth, pose.stretch * np.exp([0.0, *-change[7:9]]))
