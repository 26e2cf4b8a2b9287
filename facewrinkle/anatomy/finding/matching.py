"""A surface in a pose, matched with the template: the warp between them, and the confidence that it is a face."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from ...array_types import Array, IntArray
from .alignment import FINE, SCALES, SurfaceMap, coverage, depth_difference, surface_map, template_map
from .depth import curvature
from .template import Pose, template
from .warp import Warp, contrast_normalised, fitted_warp, resampled

STAGES = (([2, 3], 5), ([1, 2, 3], 5), ([0, 1, 2, 3], 8))
"""Stages of the warp: the channels that lead it (curvature by size, then depth), and the number of steps.

More steps would bring other things closer to a face; faces come no closer.
"""

UNCERTAIN_SHIFT = 0.04
"""Shifts smaller than this, in distances between the pupils, are reduced: the curvature of faces differs also where
their landmarks lie alike.
"""

DEPTH_SCALE, SURFACE_DROP = 0.8, 0.5
"""Depth that counts as much as curvature, and the drop of depth where there is no surface, which keeps the template
from being warped off the surface.
"""

AROUND = 0.2
"""Size of the surroundings that are compared, in distances between the pupils."""

# Is it a face? The confidence is a product of shares, each 0 at the first and 1 at the second number of a pair.
# Measured by `python -m analysis.finding likeness` on faces and other things, each warped to be most like the template.
CORRELATION = (0.5, 1.0)
"""Mean correlation of curvature: spheres and other things have 0.57 to 0.92, faces 0.82 and more."""
NOSE_CORRELATION, NOSE_RADIUS = (0.80, 0.94), 0.25
"""The same about the tip of the nose: other things have 0.93 and less, faces more."""
SHOWN = (0.0, 0.35)
"""Share that is seen of the quarter of the face that shows least: half a face is refused, a torn or a narrow one is
not.
"""
DEPTH_PENALTY = 3.0
"""Loss of the first share per median difference of depth of one distance between the pupils."""
USUAL_STRETCH, UNUSUAL_STRETCH = 0.2, 0.3
"""Logarithm of stretch up to which a face is as likely as the template; beyond, it is less likely, by a Gaussian of the
second's width.
"""


@dataclass(frozen=True, eq=False)
class Match:
    """A surface in a pose and its likeness to a variant of the template.

    Attributes
    ----------
    pose : Pose
    surface : SurfaceMap
        Map of the surface seen in this pose.
    warp : Warp
    correlation : ndarray, shape (rows, columns)
        Correlation of curvature around every place of the template, less where little is seen.
    confidence : float
        0 to 1.
    mouth_open : bool
        True if the variant's mouth is open.
    """

    pose: Pose
    surface: SurfaceMap
    warp: Warp
    correlation: Array
    confidence: float
    mouth_open: bool


def matched(points: Array, triangles: IntArray, pose: Pose, variant: int = 0) -> Match:
    """Match a surface in a pose with a variant of the template: a warp by coarse curvature first, then by finer one."""
    surface, base = surface_map(points, triangles, pose, FINE, variant), template_map(FINE, variant)
    face, model = _channels(surface, base), _channels(base, base)
    shown = np.clip(surface.weight / np.maximum(base.weight, 1e-3), 0.0, 1.0)
    warp = None
    for channels, steps in STAGES:
        warp = fitted_warp(face[channels], shown, model[channels], base.weight, FINE, warp, steps)
    assert warp is not None
    warp = Warp(FINE, certain(warp.shift))
    field = warp.field()
    weight = base.weight * resampled(shown, FINE, field)
    alike = _correlation(np.array([resampled(channel, FINE, field) for channel in face[:-1]]), model[:-1], weight)
    sigma = AROUND / FINE.step
    share = gaussian_filter(weight, sigma) / np.maximum(gaussian_filter(base.weight, sigma), 1e-3)
    return Match(
        pose,
        surface,
        warp,
        alike * np.clip(share, 0.0, 1.0),
        _confidence(alike, weight, surface, base, pose, variant),
        template(variant).mouth_open,
    )


def certain(shift: Array) -> Array:
    """Return shifts (..., 2), the small ones reduced: see :data:`UNCERTAIN_SHIFT`."""
    square = (shift**2).sum(axis=-1, keepdims=True)
    return np.asarray(shift * square / (square + UNCERTAIN_SHIFT**2))


def _confidence(alike: Array, weight: Array, surface: SurfaceMap, base: SurfaceMap, pose: Pose, variant: int) -> float:
    """Confidence that a surface is a face, from its correlation with the template around every place."""
    likeness = _share(_mean(alike, weight), CORRELATION) - DEPTH_PENALTY * depth_difference(surface, base)
    likeness *= min(1.0, _share(coverage(surface, base), SHOWN)) * _nose(alike, weight, variant) * _proportion(pose)
    return float(np.clip(likeness, 0.0, 1.0))


def _share(value: float, limits: tuple[float, float]) -> float:
    return (value - limits[0]) / (limits[1] - limits[0])


def _mean(values: Array, weight: Array) -> float:
    return float((values * weight).sum() / max(weight.sum(), 1e-9))


def _nose(alike: Array, weight: Array, variant: int) -> float:
    """Likeness (0 to 1) of the supposed nose and its surroundings to a nose."""
    tip = template(variant).landmarks["nose_tip"]
    x, y = np.meshgrid(FINE.x - tip[0], FINE.y - tip[1])
    near = weight * np.exp(-(x * x + y * y) / NOSE_RADIUS**2)
    return float(np.clip(_share(_mean(alike, near), NOSE_CORRELATION), 0.0, 1.0))


def _proportion(pose: Pose) -> float:
    """1, falling to 0 as the face gets much longer, shorter, deeper or flatter than the template."""
    beyond = np.maximum(np.abs(np.log(pose.stretch)) - USUAL_STRETCH, 0.0)
    return float(np.exp(-((beyond / UNUSUAL_STRETCH) ** 2).sum()))


def _channels(surface: SurfaceMap, base: SurfaceMap) -> Array:
    """Curvature by size, with normalised contrast, and depth (c + 1, rows, columns)."""
    seen = (surface.weight > 0.05).astype(np.float64)
    curved = contrast_normalised(curvature(surface.depth, FINE, SCALES), seen, FINE)
    inside = surface.weight > 0.2
    offset = np.median((surface.depth - base.depth)[inside]) if inside.any() else 0.0
    depth = np.maximum(surface.depth - SURFACE_DROP * (1.0 - surface.known) - offset, -1.0)
    return np.concatenate([curved, depth[None] / DEPTH_SCALE])


def _correlation(face: Array, model: Array, weight: Array) -> Array:
    """Correlation of channels (c, rows, columns) around every place (rows, columns)."""

    def mean(values: Array) -> Array:
        return np.asarray(gaussian_filter(weight * values, AROUND / FINE.step))

    product = np.sum([mean(a * b) for a, b in zip(face, model, strict=True)], axis=0)
    norm = np.sum([np.sqrt(mean(a * a) * mean(b * b)) for a, b in zip(face, model, strict=True)], axis=0)
    return np.asarray(product / np.maximum(norm, 1e-9))
