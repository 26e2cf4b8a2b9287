"""The shading of furrows in the skin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.sparse import csr_array

Array = npt.NDArray[np.float64]

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
    height = np.asarray(skin.point_data["W"], dtype=np.float64)
    dark = furrow_shade(height)
    if dark.any():
        rest = np.asarray(skin.point_data.get("rest", skin.points), dtype=np.float64)  # the skin without its furrows
        triangles = np.asarray(skin.regular_faces)
        around, reached = dark > 0.0, np.zeros(len(triangles), bool)
        for _ in range(FURROW_RINGS):
            reached = around[triangles].any(axis=1)
            around[triangles[reached]] = True
        used = np.flatnonzero(around)
        number = np.empty(len(dark), np.int64)
        number[used] = np.arange(len(used))
        dark[used] *= _coherence(rest[used], number[triangles[reached]], height[used])
    return np.rint(255.0 * (1.0 - dark[:, None] * [0.75, 1.0, 1.0])).astype(np.uint8)


def _coherence(points: Array, triangles: npt.NDArray[np.integer], height: Array) -> Array:
    """Coherence (n,) of the directions in which a height rises around each vertex: 1 on a furrow, 0 in a round pit.

    This is the coherence of the structure tensor: ((p - q) / (p + q))^2 with its two eigenvalues p and q.
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    double_area = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    rise = sum(height[triangles[:, k], None] * side for k, side in enumerate((c - b, a - c, b - a)))
    gradient = np.cross(normal / double_area, rise) / double_area
    tensor = gradient[:, [0, 1, 2, 0, 0, 1]] * gradient[:, [0, 1, 2, 1, 2, 2]]
    spread = csr_array(
        (np.repeat(double_area, 3), triangles.ravel(), np.arange(0, 3 * len(triangles) + 1, 3)),
        shape=(len(triangles), len(points)),
    ).T
    area = np.maximum(spread.sum(axis=1), 1e-300)[:, None]
    around = spread @ tensor / area
    for _ in range(FURROW_RINGS - 1):
        a, b, c = (around[triangles[:, k]] for k in range(3))
        around = spread @ ((a + b + c) / 3.0) / area
    trace = around[:, :3].sum(axis=1)
    squares = (around[:, :3] ** 2).sum(axis=1) + 2.0 * (around[:, 3:] ** 2).sum(axis=1)
    coherence = 2.0 * squares / np.maximum(trace**2, 1e-300) - 1.0
    return np.asarray(np.clip(coherence, 0.0, 1.0))
