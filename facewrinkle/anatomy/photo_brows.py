"""The heights of the eyebrows by the photo on a scan: dark bands across the ridges above the eyes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import gaussian_filter

from ..array_types import Array
from ..geometry.depth_buffer import depth_buffer
from ..geometry.interpolation import barycentric
from ..mesh import closest_places, corner_texture
from ..mesh.arrays import COLORS
from .landmarks import FaceFrame

# Lengths are in distances between the pupils.
STEP = 0.02
"""Spacing of the grid on which the photo is seen from the front."""

SHIFTS = np.arange(-0.24, 0.2 + 1e-9, STEP)
"""Heights above the expected brows at which they are looked for."""

BAND, AROUND = 0.03, 0.11
"""Standard deviations of the Gaussians that smooth the photo: over the height of a brow, and over the skin around."""

ABOVE_EYE = 0.18
"""Height above the middles of the eyes from which dark bands are brows, not lids."""

DARKER = 0.06
"""Share by which brows are darker than the skin around them, at least, on average over their length."""


def rise_of_dark_bands(
    mesh: pv.PolyData, image: npt.NDArray[np.uint8] | None, landmarks: Mapping[str, Array], frame: FaceFrame
) -> float:
    """Return how far the brows of a photo lie above those of the landmarks, in distances between the pupils.

    0 where there is neither a photo nor colours, or no dark band as long as the brows.

    Parameters
    ----------
    mesh : PolyData
        With texture coordinates, or colours of its points.
    image : ndarray of uint8, shape (h, w, 3), optional
    landmarks : mapping of str to ndarray, shape (3,)
    frame : FaceFrame
    """
    marks = {name: frame.local(place) for name, place in landmarks.items()}
    rows = []
    for side in "lr":
        brow = np.array([marks[f"brow_{side}_{part}"][:2] for part in ("inner", "mid", "outer")])
        brow = brow[np.argsort(brow[:, 0])]
        x = np.arange(brow[0, 0], brow[-1, 0], STEP)
        low = np.array([x[0], brow[:, 1].min() + SHIFTS[0] - 2.0 * AROUND])
        high = np.array([x[-1], brow[:, 1].max() + SHIFTS[-1] + 2.0 * AROUND])
        bright, known = _brightness(mesh, image, frame, low, high)
        if known.mean() < 0.5 or not bright.any():
            return 0.0
        dark = 1.0 - _smoothed(bright, known, BAND) / np.maximum(_smoothed(bright, known, AROUND), 1.0)
        expected = np.interp(x, *brow.T)
        floor = marks[f"eye_{side}_centre"][1] + ABOVE_EYE
        found = []
        for shift in SHIFTS:
            y = expected + shift
            row, column = np.rint((y - low[1]) / STEP).astype(int), np.rint((x - low[0]) / STEP).astype(int)
            seen = (y > floor) & known[row, column]
            found.append(dark[row, column][seen].mean() if seen.sum() > 0.7 * len(x) else -np.inf)
        rows.append(found)
    strength = np.mean(rows, axis=0)
    best = int(np.argmax(strength))
    inner = 0 < best < len(SHIFTS) - 1 and np.isfinite(strength[best - 1])
    return float(SHIFTS[best]) if inner and strength[best] > DARKER else 0.0


def _smoothed(values: Array, known: npt.NDArray[np.bool_], size: float) -> Array:
    weight = gaussian_filter(known.astype(float), size / STEP, mode="nearest")
    return np.asarray(gaussian_filter(values * known, size / STEP, mode="nearest") / np.maximum(weight, 1e-9))


def _brightness(
    mesh: pv.PolyData, image: npt.NDArray[np.uint8] | None, frame: FaceFrame, low: Array, high: Array
) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Brightness (rows, columns) of the foremost skin over a grid, 0 without a photo, and True where it is seen."""
    shape = np.rint((high - low) / STEP).astype(int)[::-1] + 1
    points, triangles = frame.local(np.asarray(mesh.points, np.float64)), np.asarray(mesh.regular_faces)
    corners, texture, colours = points[triangles], corner_texture(mesh), mesh.point_data.get(COLORS)
    ahead = np.flatnonzero(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0.0)
    depth = depth_buffer(points, triangles[ahead], (low[0], low[1]), STEP, (shape[0], shape[1]))
    bright, known = np.zeros(shape), np.isfinite(depth)
    row, column = np.nonzero(known)
    places = np.column_stack([low + STEP * np.stack([column, row], 1), depth[known]])
    seen, _ = closest_places(mesh, frame.world(places))
    weights = barycentric(places, corners[seen])
    if image is not None and texture is not None:
        u, v = np.einsum("nc,nci->in", weights, texture[seen])
        height, width = image.shape[:2]
        row = np.clip(((1.0 - v) % 1.0 * height).astype(int), 0, height - 1)
        bright[known] = image[row, np.clip((u % 1.0 * width).astype(int), 0, width - 1), :3].mean(axis=1)
    elif colours is not None and np.ndim(colours) == 2:
        full = 1.0 if colours.dtype.kind == "u" else 255.0
        bright[known] = full * np.einsum("nc,nci->ni", weights, colours[triangles[seen], :3]).mean(axis=1)
    return bright, known
