"""The shading of furrows in the skin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.sparse import csr_array

from ..array_types import Array, BoolArray, IntArray

FURROW_SHADE, FURROW_DEPTH = 0.42, 0.6
"""Share of the light that deep furrows lose, and the depth at which they lose two thirds of that, mm."""

FURROW_RINGS = 3
"""Rings of triangles around a vertex that tell furrows from pits: the width of a furrow, as refinement samples it."""


def furrow_shade(height: Array) -> Array:
    """Return the share (n,) of the light that furrows lose, by the heights (n,) of their vertices, mm."""
    return np.asarray(-FURROW_SHADE * np.expm1(np.minimum(height, 0.0) / FURROW_DEPTH))


def cavity_shading(skin: pv.PolyData) -> npt.NDArray[np.uint8]:
    """Return factors (n, 3) of a frame's colours, as bytes: furrows get less light, and lose less of the red.

    Dimples, whose walls stand around them instead of facing each other, are shaded by their slopes alone.
    """
    height = np.ascontiguousarray(skin.point_data["W"], np.float64)
    dark = furrow_shade(height)
    if dark.any():
        rest = np.asarray(skin.point_data.get("rest", skin.points), np.float64)  # without its furrows
        dark *= _coherence(rest, height, skin.regular_faces, dark > 0.0)
    factors = np.empty((len(dark), 3), np.uint8)
    factors[:, 0], factors[:, 1:] = np.rint(255.0 - 191.25 * dark), np.rint(255.0 - 255.0 * dark)[:, None]
    return factors


def _coherence(points: Array, height: Array, triangles: IntArray, deep: BoolArray) -> Array:
    """Coherence (n,) of the directions in which a height rises, at the vertices `deep` (n,) and around them; else 1.

    That of the structure tensor, ((p - q) / (p + q))^2 with its two eigenvalues p and q, in means over some rings of
    triangles: 1 on a furrow, 0 in a round pit.
    """
    around = deep.copy()
    for _ in range(FURROW_RINGS):
        near = triangles[around[triangles].any(axis=1)]
        around[near] = True
    i, j, k = near.T
    b, c = points[j] - points[i], points[k] - points[i]
    normal = np.cross(b, c)
    double = np.maximum(np.linalg.norm(normal, axis=1), 1e-150)
    rise = np.cross(normal, (height[j] - height[i])[:, None] * c - (height[k] - height[i])[:, None] * b)
    rise /= double[:, None] ** 2
    tensor = (rise[:, :, None] * rise[:, None]).reshape(-1, 9)
    to_corners = csr_array((np.repeat(double, 3), near.ravel(), np.arange(0, near.size + 1, 3)), (len(near), len(deep)))
    sums, area = to_corners.T @ tensor, to_corners.T @ np.ones(len(near))
    for _ in range(FURROW_RINGS - 1):
        means = sums / np.maximum(3.0 * area, 1e-300)[:, None]
        sums = to_corners.T @ means[near].sum(axis=1)
    trace = sums[:, [0, 4, 8]].sum(axis=1)
    coherence = 2.0 * (sums**2).sum(axis=1) / np.maximum(trace**2, 1e-300) - 1.0
    return np.where(area > 0.0, np.clip(coherence, 0.0, 1.0), 1.0)
