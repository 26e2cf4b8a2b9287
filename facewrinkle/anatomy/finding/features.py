"""Features that are measured on the shape.

The corners of a closed mouth are the ends of the furrow between the lips wherever it is drawn to, and the lower lip
bulges. The profile of the chin bends where it turns under. Lengths are in distances between the pupils.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from ...array_types import Array, BoolArray, IntArray
from ...geometry.depth_buffer import depth_buffer
from ..landmarks import MOUTH_LANDMARKS
from .depth import Grid, depth_map, openings_closed
from .template import Pose, template

MOUTH_GRID = Grid(0.015, (-1.0, -2.0), (1.0, -0.45))

# --- The furrow between the lips: concavity is the second derivative of depth
# times the size of the furrow or bulge, so it has no unit.
FURROW_SIZE = 0.03
"""Size of a furrow: the standard deviation of the Gaussian that smooths the depth."""
START = (0.12, 0.15)
"""Half the breadth and the height of the place where the furrow begins."""
CLEAR_STRENGTH = 3.5
"""Strength of the furrow over the roughness of the skin around it, at least."""
ROUGHNESS_HEIGHT = 0.35
"""Distance above and below within which the roughness is measured."""
# --- The path along the furrow to its end: the one with the largest sum of strength, less these costs.
FAINT, STRONGEST = 0.4, 1.2
"""Strength at which the furrow ends, and the largest that counts, relative to that in its middle."""
LEAN_COST = 0.1
"""Cost of a step upwards or downwards."""
DISTANCE_COST = 50.0
"""Cost of an end far from its expected place, per square of the distance."""
# --- The lower lip: a place below the furrow between the lips, by its concavity.
LIP_SIZE = 0.04
"""Size of the bulges and furrows down the middle of a mouth, and half the breadth of the strip on which they are seen.
"""
LIP_BORDER = 0.37
"""The border of the lower lip lies this share of the way from the top of its bulge to the fold above the chin (0.17 to
0.54 on thirty-two labelled faces, a share of 0.12 of the distance between the pupils on average).
"""
LIP_HEIGHT = 0.3
"""Distance from the meeting of the lips to the bulge, and from the bulge to the fold, at most."""

# --- The chin: its profile is seen from before and below, where the bend is foremost ---
FROM_BELOW = np.radians(45.0)
PROFILE = Grid(0.01, (-0.04, -2.7), (0.04, 0.0))
JUMP = 0.15
"""Larger steps of the depth from one row to the next are rims, behind which something else is seen."""

BEND_SIZE = 0.1
"""Size of the bends that count: the standard deviation of the Gaussian that smooths the profile."""

BENT = 1.8
"""Curvature of the bend, at least (2.4 to 5.0 on thirty-one labelled faces)."""

NEAR_MENTON = 0.3
"""The bend is looked for up to here from the expected lowest place of the chin, along the profile."""

BEYOND = 0.2
"""The skin goes on for this beyond the bend, at least: at the rim of a mask nothing tells that the chin turns under."""

UNDER = np.radians(50.0)
"""Angle by which the profile leans back at the lowest place of the chin, at least (42 to 71 degrees there)."""

TO_MENTON, TO_POGONION = 0.05, 0.19
"""From the bend along the profile to the lowest place of the chin (0 to 0.12 there), and up to the most prominent place
of its front (0.16 to 0.23).
"""


def furrow(points: Array, triangles: IntArray, pose: Pose, expected: Array) -> tuple[Array, float] | None:
    """Return the corners of a closed mouth, and the height at which the lips meet in the middle.

    The corners are the ends of the furrow between the lips, seen from the front; None where there is no clear one.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    pose : Pose
    expected : ndarray, shape (4, 2)
        Expected places of the left and right corner, and of the middles of upper and lower lip, in the face's
        coordinates.

    Returns
    -------
    corners : ndarray, shape (2, 2)
        The left and the right one.
    height : float
    """
    found = _ends(pose.local(points), triangles, expected)
    return None if found is None else (found[0] - _beyond_corners(), found[1])


@cache
def _beyond_corners() -> Array:
    """Offset (2, 2) of the ends of the template's furrow from the corners of its mouth."""
    face = template()
    expected = np.array([face.landmarks[name][:2] for name in MOUTH_LANDMARKS])
    found = _ends(face.points, face.triangles, expected)
    assert found is not None
    return np.asarray(found[0] - expected[:2])


def below_furrow(points: Array, triangles: IntArray, pose: Pose, x: float, meeting: float) -> float | None:
    """Return the height of the lower lip, by the profile below the furrow of a mouth.

    Its border lies between the top of its bulge, the first below the meeting of the lips, and the first fold below
    that. None where either is missing.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    pose : Pose
    x : float
        The place of the profile.
    meeting : float
        The height at which the lips meet.
    """
    depth, _ = openings_closed(depth_map(pose.local(points), triangles, MOUTH_GRID), MOUTH_GRID)
    middle = depth[:, np.abs(MOUTH_GRID.x - x) < LIP_SIZE].mean(axis=1)
    concavity = gaussian_filter1d(middle, LIP_SIZE / MOUTH_GRID.step, order=2)  # of furrows it is positive
    up, inner = MOUTH_GRID.y[1:-1], concavity[1:-1]
    bulges = up[(inner < concavity[:-2]) & (inner <= concavity[2:]) & (inner < 0.0) & (up < meeting)]
    if not len(bulges) or meeting - bulges[-1] > LIP_HEIGHT:
        return None
    folds = up[(inner > concavity[:-2]) & (inner >= concavity[2:]) & (inner > 0.0) & (up < bulges[-1])]
    if not len(folds) or bulges[-1] - folds[-1] >= LIP_HEIGHT:
        return None
    return float(bulges[-1] - LIP_BORDER * (bulges[-1] - folds[-1]))


def _ends(local: Array, triangles: IntArray, expected: Array) -> tuple[Array, float] | None:
    """The ends (2, 2) of the longest and deepest furrow near the middle of the lips, and its height there."""
    depth, known = openings_closed(depth_map(local, triangles, MOUTH_GRID), MOUTH_GRID)
    strength, middle = np.where(known, furrows(depth, MOUTH_GRID), 0.0), expected.mean(axis=0)
    columns = np.abs(MOUTH_GRID.x - middle[0]) < START[0]
    below = np.abs(MOUTH_GRID.y - middle[1])
    profile = np.where(below < START[1], strength[:, columns].mean(axis=1), -np.inf)
    roughness = float(np.median(np.abs(strength[below < ROUGHNESS_HEIGHT])))
    start, best, ends = int(np.argmin(np.abs(MOUTH_GRID.x - middle[0]))), -np.inf, None
    for row in range(1, len(profile) - 1):
        if profile[row] > max(profile[row - 1], profile[row + 1], CLEAR_STRENGTH * roughness):
            rows = np.abs(np.arange(len(profile)) - row) <= 2
            full = float(np.median(strength[rows][:, columns].max(axis=0)))
            gain = np.clip(strength / full, -0.2, STRONGEST) - FAINT
            sides = [_end(gain, rows, start, side, place) for side, place in zip((1, -1), expected[:2], strict=True)]
            if sum(value for value, _ in sides) > best:
                best = sum(value for value, _ in sides)
                ends = np.array([end for _, end in sides]), float(MOUTH_GRID.y[row])
    return ends


def furrows(depth: Array, grid: Grid) -> Array:
    """Strength of furrows (rows, columns): the largest concavity in any direction, an eigenvalue of the Hessian."""
    sigma = FURROW_SIZE / grid.step

    def second(order: tuple[int, int]) -> Array:
        return np.asarray(gaussian_filter(depth, sigma, order=order)) * FURROW_SIZE / grid.step**2

    down, across, both = second((2, 0)), second((0, 2)), second((1, 1))
    return np.asarray(0.5 * (down + across) + np.hypot(0.5 * (down - across), both))


def _end(gain: Array, rows: BoolArray, start: int, side: int, expected: Array) -> tuple[float, Array]:
    """Sum and end (2,) of the path with the largest sum: outwards from the middle, by at most one row per column."""
    grid = MOUTH_GRID
    total, best, end = np.where(rows, gain[:, start], -np.inf), -np.inf, expected
    for column in range(start + side, gain.shape[1] if side > 0 else -1, side):
        above, below = np.append(total[1:], -np.inf), np.append(-np.inf, total[:-1])
        total = np.maximum(total, np.maximum(above, below) - LEAN_COST) + gain[:, column]
        square = (grid.x[column] - expected[0]) ** 2 + (grid.y - expected[1]) ** 2
        row = int(np.argmax(total - DISTANCE_COST * square))
        if total[row] - DISTANCE_COST * square[row] > best:
            best, end = float(total[row] - DISTANCE_COST * square[row]), np.array([grid.x[column], grid.y[row]])
    return best, end


def chin(points: Array, triangles: IntArray, pose: Pose, expected: Array) -> tuple[Array, float | None]:
    """Return the lowest place of the chin (3,) in the face's coordinates, and the height of its most prominent place.

    Where the mesh ends soon after the chin turns under, or before, the height is None, and the place the expected one,
    or one below it, where the profile begins to turn under or ends.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    pose : Pose
    expected : ndarray, shape (3,)
        Expected lowest place, in the face's coordinates.
    """
    cos, sin = np.cos(FROM_BELOW), np.sin(FROM_BELOW)
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, cos, sin], [0.0, -sin, cos]])
    x, y, _ = tilt @ expected
    low = (x + PROFILE.low[0], PROFILE.low[1])
    depth = depth_buffer(pose.local(points) @ tilt.T, triangles, low, PROFILE.step, PROFILE.shape)
    known = np.asarray(np.isfinite(depth).all(axis=1))
    with np.errstate(invalid="ignore"):  # from one row that is not known to the next
        known[1:] &= np.abs(np.diff(depth.mean(axis=1))) < JUMP  # what is seen behind a rim is no chin
    start = int(np.argmin(np.abs(PROFILE.y - y - NEAR_MENTON)))
    gaps = np.flatnonzero(~known)
    first = int(gaps[gaps < start].max(initial=-1)) + 1
    last = int(gaps[gaps > start].min(initial=len(known)))
    if not known[start] or last - first < 3:
        return expected, None
    up, profile = PROFILE.y[first:last], depth[first:last].mean(axis=1)

    def place(row: float) -> Array:
        rows = np.arange(len(up))
        return np.asarray(tilt.T @ [x, np.interp(row, rows, up), np.interp(row, rows, profile)])

    slope = gaussian_filter1d(np.gradient(profile, PROFILE.step), BEND_SIZE / PROFILE.step, mode="nearest")
    bend = -np.gradient(slope, PROFILE.step) / (1.0 + slope**2) ** 1.5
    along = np.append(0.0, np.cumsum(np.hypot(PROFILE.step, np.diff(profile))))
    near = np.flatnonzero(np.abs(up - y) < NEAR_MENTON)
    at = int(near[np.argmax(bend[near])]) if len(near) else 0
    if bend[at] < BENT or along[at] < BEYOND:
        under = np.flatnonzero((np.arctan(slope) + FROM_BELOW > UNDER) & (up < y + NEAR_MENTON))
        return place(min(float(np.interp(y, up, np.arange(len(up)))), float(under.max(initial=0)))), None
    lowest = np.interp(along[at] - TO_MENTON, along, np.arange(len(up)))
    return place(float(lowest)), float(place(at)[1] + TO_POGONION)
