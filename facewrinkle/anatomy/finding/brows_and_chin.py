"""The heights of brows and chin: the ridge above the orbits, and the bend where the profile of the chin turns under.

Lengths are in distances between the pupils.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ...array_types import Array, IntArray
from ...geometry.depth_buffer import depth_buffer
from .depth import Grid, depth_map, openings_closed
from .template import Pose

# --- The brows ---

BROW_GRID = Grid(0.02, (-1.2, -0.6), (1.2, 1.1))

ABOVE_RIDGE = {"inner": 0.01, "mid": 0.05}
"""Height of a brow above the ridge, in distances between the pupils: on thirty-two labelled faces it lies 0.05 below to
0.09 above, and 0.03 below to 0.13 above. Their outer ends lie beside the ridge, and go along.
"""

RIDGE_SIZE = 0.1
"""Size of the bends that count, and half the breadth of the strip on which they are seen."""

STRONG_RIDGE = -0.12
"""Concavity of a ridge, at most."""

SEARCHED = (-0.4, 0.2)
"""Heights above the expected brow between which the ridge is looked for."""

# --- The chin: its profile is seen from before and below, where the bend is foremost ---
FROM_BELOW = np.radians(45.0)
PROFILE = Grid(0.01, (-0.04, -2.7), (0.04, 0.0))
JUMP = 0.15
"""Larger steps of the depth from one row to the next are rims, behind which something else is seen."""

BEND_SIZE = 0.1
"""Size of the bends that count: the standard deviation of the Gaussian that smooths the profile."""

BENT = 1.8
"""Curvature of the bend, at least (2.4 to 5.0 on thirty-one labelled faces)."""

ABOVE_MENTON, BELOW_MENTON = 0.25, 0.3
"""The bend is looked for up to here from the expected lowest place of the chin, along the profile."""

BEYOND = 0.2
"""The skin goes on for this beyond the bend, at least: at the rim of a mask nothing tells that the chin turns under."""

TURNING = np.radians(30.0)
"""Angle by which the profile leans back at the bend, at least."""

UNDER = np.radians(50.0)
"""Angle by which the profile leans back at the lowest place of the chin, at least (42 to 71 degrees there)."""

TO_MENTON, TO_POGONION = 0.05, 0.19
"""From the bend along the profile to the lowest place of the chin (0 to 0.12 there), and up to the most prominent place
of its front (0.16 to 0.23).
"""


def rise_of_brows(points: Array, triangles: IntArray, pose: Pose, expected: dict[str, Array]) -> float:
    """Return how far the brows lie above their expected places, by the ridge above the orbits; 0 where none is seen.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    pose : Pose
    expected : dict of str to ndarray, shape (2,)
        Expected places of the landmarks of the brows, in the face's coordinates.
    """
    depth, known = openings_closed(depth_map(pose.local(points), triangles, BROW_GRID), BROW_GRID)
    rises = []
    for name, (x, y) in expected.items():
        above = ABOVE_RIDGE.get(name.rsplit("_", 1)[1])
        strip = np.abs(BROW_GRID.x - x) < 0.5 * RIDGE_SIZE
        if above is None or not strip.any():
            continue
        profile = depth[:, strip].mean(axis=1)
        bend = gaussian_filter1d(profile, RIDGE_SIZE / BROW_GRID.step, order=2) * RIDGE_SIZE / BROW_GRID.step**2
        bend[~known[:, strip].all(axis=1)] = 0.0
        inner = bend[1:-1]
        near = (BROW_GRID.y > y + SEARCHED[0] - above) & (BROW_GRID.y < y + SEARCHED[1] - above)
        tops = near[1:-1] & (inner < bend[:-2]) & (inner <= bend[2:]) & (inner < STRONG_RIDGE)
        if tops.any():
            row = 1 + int(np.argmin(np.where(tops, inner, np.inf)))
            rises.append(float(BROW_GRID.y[row]) + above - y)
    return float(np.median(rises)) if len(rises) > 2 else 0.0


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
    start = int(np.argmin(np.abs(PROFILE.y - y - ABOVE_MENTON)))
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
    lean = np.arctan(slope) + FROM_BELOW
    bend = -np.gradient(slope, PROFILE.step) / (1.0 + slope**2) ** 1.5
    along = np.append(0.0, np.cumsum(np.hypot(PROFILE.step, np.diff(profile))))
    near = np.flatnonzero((up < y + ABOVE_MENTON) & (up > y - BELOW_MENTON))
    at = int(near[np.argmax(bend[near])]) if len(near) else 0
    if bend[at] < BENT or along[at] < BEYOND or lean[at] < TURNING:
        under = np.flatnonzero((lean > UNDER) & (up < y + ABOVE_MENTON))
        return place(min(float(np.interp(y, up, np.arange(len(up)))), float(under.max(initial=0)))), None
    lowest = np.interp(along[at] - TO_MENTON, along, np.arange(len(up)))
    return place(float(lowest)), float(place(at)[1] + TO_POGONION)
