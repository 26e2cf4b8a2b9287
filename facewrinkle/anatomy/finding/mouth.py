"""The corners of a closed mouth: the ends of the furrow between the lips, wherever the mouth is drawn to; and whether
what is taken for its lower lip bulges.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from .depth import Grid, Pose, closed, depth_map
from .template import template

Array = npt.NDArray[np.float64]

MOUTH = ("mouth_l", "mouth_r", "upper_lip_mid", "lower_lip_mid")

GRID = Grid(0.015, (-1.0, -2.0), (1.0, -0.45))

WIDTH = 0.03
"""Of the furrow, in distances between the pupils."""

STEEPEST = np.radians(45.0)
"""How far the furrow may lean."""

CLEAR, OPEN = 3.5, 3.0
"""A furrow is at least so many times as deep as the skin round about is rough; one this deep is an open mouth."""

MIDDLE = (0.12, 0.15)
"""Half the breadth and the height of the place where the furrow begins."""

WHOLE = 0.8
"""Share of that place that is closed, at least."""

ROUND_ABOUT = 0.35
"""How far above and below the roughness is measured."""

FAINT, DEEPEST = 0.4, 1.2
"""Strength at which the furrow ends, and the largest that counts, over that in its middle."""

LEAN = 0.1
"""Cost of a step upwards or downwards."""

ELSEWHERE = 50.0
"""Cost of an end far from where it is expected, per square of the distance."""

LIP, BREADTH = 0.04, 0.04
"""Size of the bulges and furrows that are told apart down the middle of a mouth, and half its breadth."""

FURROWED, BULGED = 0.15, -0.25
"""Curvature, times its width, of what is no lip but the furrow below it, and of a lip."""

FLAT = -0.08
"""Curvature of the strongest bulge where a lip is rolled in."""

REACH = 0.85
"""How far from the middle corners are looked for."""


def corners(points: Array, triangles: npt.NDArray[np.int64], pose: Pose, expected: Array) -> Array | None:
    """Where the furrow between the lips ends, from the front; none where there is no clear one.

    Parameters
    ----------
    expected : ndarray, shape (4, 2)
        Where left and right corner, and the middles of upper and lower lip are expected, in the face's coordinates.

    Returns
    -------
    ndarray, shape (2, 2), or None
        The left and the right corner.
    """
    ends = _ends(pose.local(points), triangles, expected)
    return None if ends is None else ends - _beyond()


@cache
def _beyond() -> Array:
    """How far the furrow of the template ends from the corners of its mouth."""
    face = template()
    expected = np.array([face.landmarks[name][:2] for name in MOUTH])
    ends = _ends(face.points, face.triangles, expected)
    assert ends is not None
    return np.asarray(ends - expected[:2])


def lower_lip(
    points: Array, triangles: npt.NDArray[np.int64], pose: Pose, upper: Array, lower: Array
) -> tuple[float, bool]:
    """How far up the lower lip is from where it is expected, if that is in the furrow below, and whether it is seen.

    `upper` and `lower` are where the middles of the lips (2,) are expected, in the face's coordinates.
    """
    curvature = _profile(pose.local(points), triangles, float(lower[0]))
    up, between = GRID.y, (GRID.y > lower[1]) & (GRID.y < upper[1])
    if not between.any():
        return 0.0, False
    meeting = float(up[between][np.argmax(curvature[between])])
    if np.interp(lower[1], up, curvature) < FURROWED:
        around = (up > lower[1] - GRID.step) & (up < meeting)
        return 0.0, bool(around.any() and curvature[around].min() < FLAT)
    inner = curvature[1:-1]
    tops = np.flatnonzero((inner < curvature[:-2]) & (inner <= curvature[2:]) & (inner < BULGED)) + 1
    above = up[tops][(up[tops] > lower[1]) & (up[tops] < upper[1])]
    if not len(above):
        return 0.0, False
    return float(above[0] - min(_below_the_top(), 0.5 * (above[0] - lower[1])) - lower[1]), True


def _profile(local: Array, triangles: npt.NDArray[np.int64], x: float) -> Array:
    """Curvature down the middle of a mouth, times its width: furrows are positive."""
    depth, _ = closed(depth_map(local, triangles, GRID), GRID)
    middle = depth[:, np.abs(GRID.x - x) < BREADTH].mean(axis=1)
    return np.asarray(gaussian_filter1d(middle, LIP / GRID.step, order=2)) * LIP / GRID.step**2


@cache
def _below_the_top() -> float:
    """How far below the top of its bulge the template's lower lip is."""
    face = template()
    x, y, _ = face.landmarks["lower_lip_mid"]
    near = np.abs(GRID.y - y) < 0.1
    return float(GRID.y[near][np.argmin(_profile(face.points, face.triangles, float(x))[near])] - y)


def _ends(local: Array, triangles: npt.NDArray[np.int64], expected: Array) -> Array | None:
    """The ends of the longest and deepest furrow near the middle of the lips, by its own depth."""
    depth, known = closed(depth_map(local, triangles, GRID), GRID)
    strength, middle = np.where(known, furrows(depth, GRID), 0.0), expected.mean(axis=0)
    columns = np.abs(GRID.x - middle[0]) < MIDDLE[0]
    profile = np.where(np.abs(GRID.y - middle[1]) < MIDDLE[1], strength[:, columns].mean(axis=1), -np.inf)
    if known[np.isfinite(profile)][:, columns].mean() < WHOLE:
        return None
    rough = float(np.median(np.abs(strength[np.abs(GRID.y - middle[1]) < ROUND_ABOUT])))
    start, best, ends = int(np.argmin(np.abs(GRID.x - middle[0]))), -np.inf, None
    for row in range(1, len(profile) - 1):
        if profile[row] > max(profile[row - 1], profile[row + 1], CLEAR * rough) and profile[row] < OPEN:
            rows = np.abs(np.arange(len(profile)) - row) <= 2
            deep = float(np.median(strength[rows][:, columns].max(axis=0)))
            gain = np.clip(strength / deep, -0.2, DEEPEST) - FAINT
            sides = [_end(gain, rows, start, side, at) for side, at in zip((1, -1), expected[:2], strict=True)]
            if sum(value for value, _ in sides) > best:
                best, ends = sum(value for value, _ in sides), np.array([end for _, end in sides])
    return ends


def furrows(depth: Array, grid: Grid) -> Array:
    """Curvature across the deepest line through every place that leans no more than 45 degrees, times its width."""
    sigma = WIDTH / grid.step

    def second(order: tuple[int, int]) -> Array:
        return np.asarray(gaussian_filter(depth, sigma, order=order)) * WIDTH / grid.step**2

    down, across, both = second((2, 0)), second((0, 2)), second((1, 1))
    mean, half = 0.5 * (down + across), 0.5 * (down - across)
    turn = np.clip(np.arctan2(both, half), -2.0 * STEEPEST, 2.0 * STEEPEST)  # twice the angle from the vertical
    return np.asarray(mean + half * np.cos(turn) + both * np.sin(turn))


def _end(gain: Array, rows: npt.NDArray[np.bool_], start: int, side: int, expected: Array) -> tuple[float, Array]:
    """Sum and end of the path with the largest sum: outwards from the middle, by at most one row per column."""
    total, best, end = np.where(rows, gain[:, start], -np.inf), -np.inf, expected
    for column in range(start + side, start + side * int(REACH / GRID.step), side):
        if not 0 <= column < gain.shape[1]:
            break
        above, below = np.append(total[1:], -np.inf), np.append(-np.inf, total[:-1])
        total = np.maximum(total, np.maximum(above, below) - LEAN) + gain[:, column]
        off = (GRID.x[column] - expected[0]) ** 2 + (GRID.y - expected[1]) ** 2
        row = int(np.argmax(total - ELSEWHERE * off))
        if total[row] - ELSEWHERE * off[row] > best:
            best, end = float(total[row] - ELSEWHERE * off[row]), np.array([GRID.x[column], GRID.y[row]])
    return best, end
