"""Features that are measured on the shape.

The corners of a mouth are the ends of the furrow or opening between the lips wherever they are drawn to, those of an
eye the ends of the opening between its lids, and the lower lip bulges. The profile of the chin bends where it turns
under. Lengths are in distances between the pupils.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import gaussian_filter, gaussian_filter1d, label

from ...array_types import Array, BoolArray, IntArray
from ...geometry import barycentric
from ...geometry.depth_buffer import depth_buffer
from ...mesh import COLORS, closest_places, corner_texture, has_colors
from ..landmarks import MOUTH_LANDMARKS, FaceFrame
from .template import Grid, Pose, depth_map, openings_closed, template

MOUTH_GRID = Grid(0.015, (-1.0, -2.45), (1.0, -0.45))
EYE_GRID = Grid(0.01, (-1.1, -0.45), (1.1, 0.45))

# --- the mouth: concavity is the second derivative of depth, times the size of the furrow or bulge: it has no unit ----


def furrow(points: Array, triangles: IntArray, pose: Pose, expected: Array) -> tuple[Array, float] | None:
    """Return the corners of a mouth, and the height at which the lips meet in the middle, or the lower one begins.

    The corners are the ends of the furrow or opening between the lips, seen from the front; None where there is no
    clear one.

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


def below_furrow(points: Array, triangles: IntArray, pose: Pose, x: float, meeting: float) -> Array | None:
    """Return the border (3,) of the lower lip in the face's coordinates, by the profile below the furrow of a mouth.

    It lies between the top of the lip's bulge, the first below the meeting of the lips, and the first fold below that,
    the one above the chin: 0.37 of the way (0.17 to 0.54 on thirty-two labeled faces), but at most 0.09 above the fold:
    a smile draws the lip away from the chin, not its border from the fold. None where either is missing.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    pose : Pose
    x : float
        The place of the profile.
    meeting : float
        The height at which the lips meet, or the lower one begins.
    """
    depth, known = openings_closed(depth_map(pose.local(points), triangles, MOUTH_GRID), MOUTH_GRID)
    size = 0.04  # of the bulges and furrows, and half the breadth of the strip on which they are seen
    strip = np.abs(MOUTH_GRID.x - x) < size
    middle, seen = depth[:, strip].mean(axis=1), known[1:-1, strip].any(axis=1)
    concavity = gaussian_filter1d(middle, size / MOUTH_GRID.step, order=2)  # of furrows it is positive
    up, inner = MOUTH_GRID.y[1:-1], concavity[1:-1]
    bulges = (inner < concavity[:-2]) & (inner <= concavity[2:]) & (inner < 0.0)
    bulge = up[bulges & seen & (up < meeting)].max(initial=-np.inf)
    folds = (inner > concavity[:-2]) & (inner >= concavity[2:]) & (inner > 0.0)
    fold = up[folds & (up < bulge)].max(initial=-np.inf)
    if meeting - bulge > 0.3 or bulge - fold > 0.4:
        return None
    border = fold + min(0.63 * (bulge - fold), 0.09)
    return np.array([x, border, np.interp(border, MOUTH_GRID.y, middle)])


def _ends(local: Array, triangles: IntArray, expected: Array) -> tuple[Array, float] | None:
    """The ends (2, 2) of the longest and deepest furrow near the middle of the lips, and its height there."""
    seen = depth_map(local, triangles, MOUTH_GRID)
    depth, known = openings_closed(seen, MOUTH_GRID)
    hollow = seen < openings_closed(seen, MOUTH_GRID, mouth_open=True)[0] - 0.1
    # An opening counts as much as the furrow between lips that hardly part.
    strength, middle = np.where(known & ~hollow, furrows(depth, MOUTH_GRID), 1.0), expected.mean(axis=0)
    columns, below = np.abs(MOUTH_GRID.x - middle[0]) < 0.12, np.abs(MOUTH_GRID.y - middle[1])  # where it begins
    profile = np.where(below < 0.15, strength[:, columns].mean(axis=1), -np.inf)
    clear = 3.5 * float(np.median(np.abs(strength[below < 0.35])))  # beyond the roughness of the skin around it
    start, best, ends = int(np.argmin(np.abs(MOUTH_GRID.x - middle[0]))), -np.inf, None
    for row in range(1, len(profile) - 1):
        if profile[row] > max(profile[row - 1], clear) and profile[row] >= profile[row + 1]:
            rows = np.abs(np.arange(len(profile)) - row) <= 2
            full = float(np.median(strength[rows][:, columns].max(axis=0)))
            if full <= 0.0:  # fewer than half of the columns have a furrow
                continue
            # The furrow ends at 0.4 of the strength in its middle, of which no more than 1.2 counts.
            gain = np.clip(strength / full, -0.2, 1.2) - 0.4
            value, places = _path(gain, rows, start, expected[:2], MOUTH_GRID)
            if value > best:
                best, ends = value, (places, float(MOUTH_GRID.y[row]))
    return ends


def furrows(depth: Array, grid: Grid) -> Array:
    """Strength of furrows (rows, columns): the largest concavity in any direction, an eigenvalue of the Hessian."""
    size = 0.03  # of a furrow: the standard deviation of the Gaussian that smooths the depth

    def second(order: tuple[int, int]) -> Array:
        return np.asarray(gaussian_filter(depth, size / grid.step, order=order)) * size / grid.step**2

    down, across, both = second((2, 0)), second((0, 2)), second((1, 1))
    return np.asarray(0.5 * (down + across) + np.hypot(0.5 * (down - across), both))


def _path(gain: Array, rows: BoolArray, start: int, expected: Array, grid: Grid) -> tuple[float, Array]:
    """Sum and ends (2, 2) of the path with the largest sum, from a column and these rows to the left and the right."""
    sides = [_end(gain, rows, start, side, place, grid) for side, place in zip((1, -1), expected, strict=True)]
    return sum(value for value, _ in sides), np.array([end for _, end in sides])


def _end(gain: Array, rows: BoolArray, start: int, side: int, expected: Array, grid: Grid) -> tuple[float, Array]:
    """Sum and end (2,) of the path with the largest sum: outwards from the middle, by at most one row per column,
    which costs a tenth. An end costs the square of its distance from the expected place, 0.75 times over the spacing
    of the grid.
    """
    total, best, end = np.where(rows, gain[:, start], -np.inf), -np.inf, expected
    for column in range(start + side, gain.shape[1] if side > 0 else -1, side):
        above, below = np.append(total[1:], -np.inf), np.append(-np.inf, total[:-1])
        total = np.maximum(total, np.maximum(above, below) - 0.1) + gain[:, column]
        sums = total - 0.75 / grid.step * ((grid.x[column] - expected[0]) ** 2 + (grid.y - expected[1]) ** 2)
        row = int(np.argmax(sums))
        if sums[row] > best:
            best, end = float(sums[row]), np.array([grid.x[column], grid.y[row]])
    return best, end


# --- eyes: the opening between their lids -----------------------------------------------------------------------------


def openings(points: Array, triangles: IntArray, pose: Pose, expected: Array) -> Array:
    """Return the left and the right corner of each eye (k, 2, 2): the ends of the opening between its lids, or of the
    furrow where they are narrowed, seen from the front. NaN where it is shut or there is another furrow.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    pose : Pose
    expected : ndarray, shape (k, 2, 2)
        Expected places of the left and right corner of each eye, in the face's coordinates.
    """
    depth, known = openings_closed(depth_map(pose.local(points), triangles, EYE_GRID), EYE_GRID)
    furrowed = furrows(depth, EYE_GRID)
    return np.array([_corners(furrowed, known, of_eye) for of_eye in expected])


def _corners(furrowed: Array, known: BoolArray, expected: Array) -> Array:
    """The corners (2, 2) of the eye at the expected ones, from the strength of furrows and what is known of depths."""
    middle, width = expected.mean(axis=0), expected[0, 0] - expected[1, 0]
    across, rows = np.abs(EYE_GRID.x - middle[0]), np.abs(EYE_GRID.y - middle[1]) < 0.12
    # Beside the eye, what is not known is the hollow beside the nose, or beyond the rim of a mask.
    strength = np.where(known | (across > 0.5 * width), furrowed, 1.0)
    full = float(np.median(strength[rows][:, across < 0.08].max(axis=0)))
    gain = np.clip(strength / max(full, 1.0), -0.2, 1.2) - 0.55
    _, ends = _path(gain, rows, int(np.argmin(across)), expected, EYE_GRID)
    # The furrow has a strength of 0.6 and less where the lids are shut, and of 0.7 and more where they are narrowed.
    ends[(full < 0.65) | (np.linalg.norm(ends - expected, axis=1) > 0.1)] = np.nan
    return ends


# --- the chin: its profile is seen from before and below, where the bend is foremost ----------------------------------


def chin(points: Array, triangles: IntArray, pose: Pose, expected: Array) -> tuple[Array, Array | None]:
    """Return the lowest and the most prominent place (3,) of the chin in the face's coordinates.

    Where the mesh ends soon after the chin turns under, or before, the second is None, and the first the expected
    place, or one below it, where the profile begins to turn under or ends.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
    triangles : ndarray of int, shape (m, 3)
    pose : Pose
    expected : ndarray, shape (3,)
        Expected lowest place, in the face's coordinates.
    """
    from_below = np.radians(45.0)
    cos, sin = np.cos(from_below), np.sin(from_below)
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, cos, sin], [0.0, -sin, cos]])
    grid = Grid(0.01, (-0.04, -2.7), (0.04, 0.0))
    x, y, _ = tilt @ expected
    low = (x + grid.low[0], grid.low[1])
    depth = depth_buffer(pose.local(points) @ tilt.T, triangles, low, grid.step, grid.shape)
    # Depths beside each other that differ by more are of two surfaces: the nearer has a rim or a hole there, and what
    # is seen behind it is no chin.
    same = 0.15
    with np.errstate(invalid="ignore"):
        seen = np.abs(depth - np.median(depth, axis=1, keepdims=True)) < same
    known = seen.mean(axis=1) >= 0.5  # rims are ragged
    middle = np.where(seen, depth, 0.0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    known[1:] &= np.abs(np.diff(middle)) < same
    near_menton = 0.3  # up to which the bend is looked for from the expected place, along the profile
    start = int(np.argmin(np.abs(grid.y - y - near_menton)))
    runs, _ = label(known)
    whole = known & (runs == runs[start])
    if whole.sum() < 3:
        return expected, None
    up, profile = grid.y[whole], middle[whole]

    rows = np.arange(len(up))

    def place(row: float) -> Array:
        return np.asarray(tilt.T @ [x, np.interp(row, rows, up), np.interp(row, rows, profile)])

    slope = gaussian_filter1d(np.gradient(profile, grid.step), 0.1 / grid.step, mode="nearest")  # of large bends
    bend = -np.gradient(slope, grid.step) / (1.0 + slope**2) ** 1.5
    along = np.append(0.0, np.cumsum(np.hypot(grid.step, np.diff(profile))))
    near = np.flatnonzero(np.abs(up - y) < near_menton)
    at = int(near[np.argmax(bend[near])]) if len(near) else 0
    # The bend has a curvature of 2.4 to 5.0 on thirty-one labeled faces. The skin goes on beyond it: at the rim of a
    # mask nothing tells that the chin turns under.
    if bend[at] < 1.8 or along[at] < 0.2:
        if up[0] > y:
            return expected, None
        # The profile leans back by at least 50 degrees at the lowest place of the chin (42 to 71 on labeled faces).
        under = np.flatnonzero((np.arctan(slope) + from_below > np.radians(50.0)) & (up < y + near_menton))
        return place(min(float(np.interp(y, up, rows)), float(under.max(initial=0)))), None
    # From the bend along the profile to the lowest place of the chin (0 to 0.12 there), and up to the most prominent
    # place of its front (0.16 to 0.23).
    height = cos * up - sin * profile
    front = np.interp(height[at] + 0.19, height[at:], rows[at:])
    return place(float(np.interp(along[at] - 0.05, along, rows))), place(float(front))


# --- eyebrows: dark bands of the photo on a scan, across the ridges above the eyes ------------------------------------

# Lengths are in distances between the pupils.
PHOTO_STEP = 0.02
"""Spacing of the grid on which the photo is seen from the front."""


DARKER = 0.06
"""Share by which brows are darker than the skin around them, at least, on average over their length."""


def rise_of_dark_bands(
    mesh: pv.PolyData, image: npt.NDArray[np.uint8] | None, landmarks: Mapping[str, Array], frame: FaceFrame
) -> float:
    """Return how far the brows of a photo lie above those of the landmarks, in distances between the pupils.

    0 where there is neither a photo nor colors, or no dark band as long as the brows.

    Parameters
    ----------
    mesh : PolyData
        With texture coordinates, or colors of its points.
    image : ndarray of uint8, shape (h, w, 3), optional
    landmarks : mapping of str to ndarray, shape (3,)
    frame : FaceFrame
    """
    marks = {name: frame.local(place) for name, place in landmarks.items()}
    shifts = np.arange(-0.24, 0.2 + 1e-9, PHOTO_STEP)  # heights above the expected brows at which they are looked for
    # Standard deviations of the Gaussians that smooth the photo: over the height of a brow, and over the skin around.
    band, around = 0.03, 0.11
    rows = []
    for side in "lr":
        brow = np.array([marks[f"brow_{side}_{part}"][:2] for part in ("inner", "mid", "outer")])
        brow = brow[np.argsort(brow[:, 0])]
        x = np.arange(brow[0, 0], brow[-1, 0], PHOTO_STEP)
        low = np.array([x[0], brow[:, 1].min() + shifts[0] - 2.0 * around])
        high = np.array([x[-1], brow[:, 1].max() + shifts[-1] + 2.0 * around])
        bright, known = _brightness(mesh, image, frame, low, high)
        if known.mean() < 0.5 or not bright.any():
            return 0.0
        dark = 1.0 - _smoothed(bright, known, band) / np.maximum(_smoothed(bright, known, around), 1.0)
        expected = np.interp(x, *brow.T)
        floor = marks[f"eye_{side}_centre"][1] + 0.18  # below, dark bands are lids
        found = []
        for shift in shifts:
            y = expected + shift
            row, column = np.rint((y - low[1]) / PHOTO_STEP).astype(int), np.rint((x - low[0]) / PHOTO_STEP).astype(int)
            seen = (y > floor) & known[row, column]
            found.append(dark[row, column][seen].mean() if seen.sum() > 0.7 * len(x) else -np.inf)
        rows.append(found)
    strength = np.mean(rows, axis=0)
    best = int(np.argmax(strength))
    inner = 0 < best < len(shifts) - 1 and np.isfinite(strength[best - 1])
    return float(shifts[best]) if inner and strength[best] > DARKER else 0.0


def _smoothed(values: Array, known: npt.NDArray[np.bool_], size: float) -> Array:
    weight = gaussian_filter(known.astype(float), size / PHOTO_STEP, mode="nearest")
    return np.asarray(gaussian_filter(values * known, size / PHOTO_STEP, mode="nearest") / np.maximum(weight, 1e-9))


def _brightness(
    mesh: pv.PolyData, image: npt.NDArray[np.uint8] | None, frame: FaceFrame, low: Array, high: Array
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Brightness (rows, columns) of the foremost skin over a grid, 0 without a photo, and True where it is seen."""
    shape = np.rint((high - low) / PHOTO_STEP).astype(int)[::-1] + 1
    points, triangles = frame.local(np.asarray(mesh.points, np.float64)), np.asarray(mesh.regular_faces)
    corners, texture, colors = (
        points[triangles],
        corner_texture(mesh),
        mesh.point_data.get(COLORS) if has_colors(mesh.point_data) else None,
    )
    ahead = np.flatnonzero(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0.0)
    depth = depth_buffer(points, triangles[ahead], (low[0], low[1]), PHOTO_STEP, (shape[0], shape[1]))
    bright, known = np.zeros(shape), np.isfinite(depth)
    row, column = np.nonzero(known)
    places = np.column_stack([low + PHOTO_STEP * np.stack([column, row], 1), depth[known]])
    seen, _ = closest_places(mesh, frame.world(places))
    weights = barycentric(places, corners[seen])
    if image is not None and texture is not None:
        u, v = np.einsum("nc,nci->in", weights, texture[seen])
        height, width = image.shape[:2]
        row = np.clip(((1.0 - v) % 1.0 * height).astype(int), 0, height - 1)
        bright[known] = image[row, np.clip((u % 1.0 * width).astype(int), 0, width - 1), :3].mean(axis=1)
    elif colors is not None:
        full = 1.0 if colors.dtype.kind == "u" else 255.0
        bright[known] = full * np.einsum("nc,nci->ni", weights, colors[triangles[seen], :3]).mean(axis=1)
    return bright, known
