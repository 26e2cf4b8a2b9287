"""The shading of furrows in the skin."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..array_types import Array
from . import _furrow_kernels as kernels

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
        rest = np.ascontiguousarray(skin.point_data.get("rest", skin.points), np.float64)  # without its furrows
        triangles = np.ascontiguousarray(skin.regular_faces, np.int32)
        coherence = np.empty(len(dark))
        kernels.coherence(rest, height, triangles, dark > 0.0, FURROW_RINGS, coherence)
        dark *= coherence
    factors = np.empty((len(dark), 3), np.uint8)
    factors[:, 0], factors[:, 1:] = np.rint(255.0 - 191.25 * dark), np.rint(255.0 - 255.0 * dark)[:, None]
    return factors
