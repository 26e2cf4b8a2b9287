"""The heights of the eyebrows by the photo on a scan: dark bands across the ridges above the eyes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.ndimage import gaussian_filter

from ..array_types import Array
from ..mesh import corner_texture
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

FINEST = 12
"""Samples along the sides of a triangle, at most."""


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
    """Brightness (rows, columns) of the foremost skin over a grid, and True where there is any."""
    shape = np.rint((high - low) / STEP).astype(int)[::-1] + 1
    bright, foremost = np.zeros(shape), np.full(shape, -np.inf)
    triangles, texture = np.asarray(mesh.regular_faces), corner_texture(mesh)
    colours = mesh.point_data.get(COLORS)
    if (image is None or texture is None) and (colours is None or np.ndim(colours) != 2):
        return bright, np.zeros(shape, bool)
    corners = frame.local(np.asarray(mesh.points, np.float64))[triangles]
    near = ((corners.max(axis=1)[:, :2] > low) & (corners.min(axis=1)[:, :2] < high)).all(axis=1)
    near &= np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0.0
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.clip(np.ceil(2.0 * sides / STEP), 1, FINEST).astype(int)
    nodes, samples = [], []
    for k in np.unique(parts[near]):
        chosen = np.flatnonzero(near & (parts == k))
        i, j = np.divmod(np.arange((k + 1) ** 2), k + 1)
        i, j = i[i + j <= k], j[i + j <= k]
        weights = np.stack([i, j, k - i - j], axis=1) / k
        place = (weights @ corners[chosen]).reshape(-1, 3)
        if image is not None and texture is not None:
            u, v = (weights @ texture[chosen]).reshape(-1, 2).T
            height, width = image.shape[:2]
            row = np.clip(((1.0 - v) % 1.0 * height).astype(int), 0, height - 1)
            shown = image[row, np.clip((u % 1.0 * width).astype(int), 0, width - 1), :3].mean(axis=1)
        elif colours is not None:
            full = 1.0 if colours.dtype.kind == "u" else 255.0
            shown = full * (weights @ colours[triangles[chosen], :3].astype(np.float64)).reshape(-1, 3).mean(axis=1)
        nodes.append(np.rint((place[:, :2] - low) / STEP).astype(int)[:, ::-1])
        samples.append(np.column_stack([place[:, 2], shown]))
    if not nodes:
        return bright, np.isfinite(foremost)
    node, (z, shown) = np.concatenate(nodes), np.concatenate(samples).T
    inside = ((node >= 0) & (node < shape)).all(axis=1)
    flat, z, shown = node[inside] @ [shape[1], 1], z[inside], shown[inside]
    np.maximum.at(foremost.ravel(), flat, z)
    front = z >= foremost.ravel()[flat] - STEP
    count = np.bincount(flat[front], minlength=bright.size)
    bright.ravel()[:] = np.bincount(flat[front], shown[front], minlength=bright.size) / np.maximum(count, 1)
    return bright, np.isfinite(foremost)
