"""Where a face could be: protruding points taken for noses, at every size, seen from all sides."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from . import _kernels as kernels
from .depth import Pose
from .samples import spread, thinned
from .template import template

Array = npt.NDArray[np.float64]

SIZES = np.geomspace(1 / 45.0, 1 / 2.9, 15)
"""Distance between the pupils over the diagonal of the bounding box: from a whole body on a floor to a narrow mask."""

NOSES = 40
"""Protruding points that are tried at every size."""

RADIUS = 1.2
"""Of the round maps about noses, in distances between the pupils."""

RINGS, SECTORS = 9, 36
TILTS = ((0.0, 1), (0.38, 6), (0.76, 9))
"""Angles by which the direction of looking may differ from that of protrusion, and how many directions at each."""

CAP, MISSING = 0.15, 0.12
"""Largest difference that counts, and what a place without surface counts, over the radius."""


@dataclass(frozen=True)
class _Round:
    """The template as a round map about its nose."""

    heights: Array
    weights: Array


@cache
def _round_template() -> _Round:
    face = template()
    points = spread(face.points, face.triangles, 40_000)
    heights = np.empty((RINGS, SECTORS))
    kernels.round_map(points, face.landmarks["nose_tip"], np.eye(3), RADIUS, heights)
    heights = 0.5 * (heights + heights[:, (SECTORS // 2 - 1 - np.arange(SECTORS)) % SECTORS])
    ring = (np.arange(RINGS)[:, None] + 0.5) / RINGS
    return _Round(heights, np.where(np.isfinite(heights) & (heights > -0.9), ring, 0.0))


def candidates(points: Array) -> Iterator[list[tuple[float, Pose]]]:
    """Poses at which a face could be, with their mismatch, at one size after the other.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Spread evenly over the surface.
    """
    middle = points.mean(axis=0)
    along = np.linalg.svd(points - middle, full_matrices=False)[2]  # a box that turns with them
    for size in SIZES * float(np.linalg.norm(np.ptp(points @ along.T, axis=0))):
        found = _at_size(points - middle, size)
        yield [(cost, Pose(pose.axes, pose.origin + middle, pose.size, pose.stretch)) for cost, pose in found]


def distinct(found: list[tuple[float, Pose]], count: int) -> list[tuple[float, Pose]]:
    """The first poses of a list that are not close to an earlier one."""
    kept: list[tuple[float, Pose]] = []
    for value, pose in found:
        if not any(_alike(pose, other) for _, other in kept):
            kept.append((value, pose))
            if len(kept) == count:
                break
    return kept


def _alike(a: Pose, b: Pose) -> bool:
    size = max(a.size, b.size)
    return bool(
        min(a.size, b.size) > 0.75 * size
        and np.linalg.norm(a.origin - b.origin) < 0.35 * size
        and np.trace(a.axes @ b.axes.T) > 1.0 + 2.0 * np.cos(0.4)
    )


def _at_size(points: Array, size: float) -> list[tuple[float, Pose]]:
    """The best pose of every nose and direction at one size."""
    points = thinned(points, 0.06 * size)
    if len(points) < 60:
        return []
    noses = _noses(points, size)
    axes = np.array([_directions(nose, points[kernels.within(points, nose, 0.8 * size)]) for nose in noses])
    face, base = _round_template(), template()
    cost, roll = kernels.compare(
        points, noses, axes, 1.6 * RADIUS * size, RADIUS * size, face.heights, face.weights, CAP, MISSING
    )
    tip = base.landmarks["nose_tip"]
    found = []
    for k, nose in enumerate(noses):
        for a in np.argsort(cost[k], kind="stable")[:4]:
            angle = 2.0 * np.pi * roll[k, a] / SECTORS
            across, over, ahead = axes[k, a]
            left = np.cos(angle) * across + np.sin(angle) * over
            turned = np.array([left, np.cross(ahead, left), ahead])
            found.append((float(cost[k, a]), Pose(turned, nose - size * tip @ turned, size, np.ones(3))))
    return found


def _noses(points: Array, size: float) -> Array:
    """The points (n, 3) that protrude most, none within the width of a nose of another."""
    coarse = thinned(points, 0.12 * size)
    tree = cKDTree(coarse)
    away = kernels.protrusion(coarse, tree.query_pairs(0.55 * size, output_type="ndarray"))
    free = np.ones(len(coarse), bool)
    chosen: list[Array] = []
    for p in np.argsort(-np.linalg.norm(away, axis=1), kind="stable"):
        if free[p]:
            free[tree.query_ball_point(coarse[p], 0.25 * size)] = False
            close = points[kernels.within(points, coarse[p], 0.12 * size)]
            chosen.append(close[np.argmax(close @ away[p])])
            if len(chosen) == NOSES:
                break
    return np.array(chosen)


def _directions(nose: Array, around: Array) -> Array:
    """Frames (a, 3, 3) whose last rows are the directions in which a nose may look: away from what is around."""
    ahead = nose - around.mean(axis=0)
    length = np.linalg.norm(ahead)
    return _tilted() @ _frame(ahead / length if length > 0.0 else np.array([0.0, 0.0, 1.0]))


@cache
def _tilted() -> Array:
    """Frames whose last rows are z and directions around it."""
    directions = [
        (np.cos(turn) * np.sin(tilt), np.sin(turn) * np.sin(tilt), np.cos(tilt))
        for tilt, count in TILTS
        for turn in 2.0 * np.pi * np.arange(count) / count
    ]
    return np.array([_frame(np.array(direction)) for direction in directions])


def _frame(ahead: Array) -> Array:
    """A right-handed frame with this last row."""
    across = np.cross(ahead, np.eye(3)[int(np.argmin(np.abs(ahead)))])
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(ahead, across), ahead])
