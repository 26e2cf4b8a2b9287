"""A surface in a pose, matched with the template: where the template's places lie, and whether it is a face."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter

from .alignment import FINE, SCALES, Map, covered, distance, seen, template_map
from .depth import Pose, relief
from .template import template
from .warp import Warp, evened, sampled, warped

Array = npt.NDArray[np.float64]

DOUBT = 0.04
"""Shifts smaller than this, in distances between the pupils, are believed less and less: relief differs from face to
face also where places do not.
"""

STAGES = (([2, 3], 5), ([1, 2, 3], 5), ([0, 1, 2, 3], 8))
"""Channels that lead the warp, one stage after the other: relief by size, and depth; and steps. What is no face would
come closer to one in more steps, faces do not.
"""

SHALLOW, EDGE = 0.8, 0.5
"""Depth that counts as much as relief does, and how much deeper the map is where there is no surface: what is seen of
the template must not be warped off it.
"""

AROUND = 0.2
"""Size of the surroundings that are compared, in distances between the pupils."""

UNLIKE, ALIKE = 0.5, 1.0
"""Correlation of relief after the warp that means nothing, and that of the template with itself: spheres and other
things have 0.57 to 0.92, faces 0.82 and more.
"""

NOSE = 0.25
"""How far round the tip of the nose is looked at, in distances between the pupils."""

NO_NOSE, SURE_NOSE = 0.80, 0.94
"""Correlation of relief there: other things, warped to be most like one, have 0.93 and less; faces more."""

USUAL, UNUSUAL = 0.2, 0.3
"""Logarithm of stretch up to which a face is as likely as the template, and how fast it gets less likely beyond."""

ENOUGH = 0.5
"""Share that has to be seen of every quarter of the face."""


@dataclass(frozen=True, eq=False)
class Match:
    """A surface in a pose and what it has to do with the template.

    Attributes
    ----------
    pose : Pose
    view : Map
        What is seen in this pose.
    warp : Warp
    trust : ndarray, shape (rows, columns)
        Correlation of relief around every place of the template.
    confidence : float
        0 to 1.
    agape : bool
        Whether the template's mouth is open.
    """

    pose: Pose
    view: Map
    warp: Warp
    trust: Array
    confidence: float
    agape: bool


def matched(points: Array, triangles: npt.NDArray[np.int64], pose: Pose, person: int = 0) -> Match:
    """The warp to the surface in this pose, coarse relief first, and how alike the two are then."""
    view, base = seen(points, triangles, pose, FINE, person), template_map(FINE, person)
    face, model = _channels(view, base), _channels(base, base)
    shown = np.clip(view.weight / np.maximum(base.weight, 1e-3), 0.0, 1.0)
    warp = None
    for channels, steps in STAGES:
        warp = warped(face[channels], shown, model[channels], base.weight, FINE, warp, steps)
    assert warp is not None
    square = (warp.shift**2).sum(axis=2, keepdims=True)
    warp = Warp(FINE, warp.shift * square / (square + DOUBT**2))
    field = warp.field()
    weight = base.weight * sampled(shown, FINE, field)
    alike = _correlation(np.array([sampled(channel, FINE, field) for channel in face[:-1]]), model[:-1], weight)
    mean = float((alike * weight).sum() / max(weight.sum(), 1e-9))
    likeness = (mean - UNLIKE) / (ALIKE - UNLIKE) - 3.0 * distance(view, base)
    likeness *= min(1.0, covered(view, base) / ENOUGH) * _nose(alike, weight, person) * _proportion(pose)
    confidence = float(np.clip(likeness, 0.0, 1.0))
    sigma = AROUND / FINE.step
    share = gaussian_filter(weight, sigma) / np.maximum(gaussian_filter(base.weight, sigma), 1e-3)
    return Match(pose, view, warp, alike * np.clip(share, 0.0, 1.0), confidence, template(person).agape)


def _nose(alike: Array, weight: Array, person: int) -> float:
    """0 to 1: how much what is taken for the nose, with what is round about, is one."""
    tip = template(person).landmarks["nose_tip"]
    x, y = np.meshgrid(FINE.x - tip[0], FINE.y - tip[1])
    near = weight * np.exp(-(x * x + y * y) / NOSE**2)
    mean = float((alike * near).sum() / max(near.sum(), 1e-9))
    return float(np.clip((mean - NO_NOSE) / (SURE_NOSE - NO_NOSE), 0.0, 1.0))


def _proportion(pose: Pose) -> float:
    """0 to 1: 1 unless the face is much longer or deeper than the template."""
    beyond = np.maximum(np.abs(np.log(pose.stretch)) - USUAL, 0.0)
    return float(np.exp(-((beyond / UNUSUAL) ** 2).sum()))


def _channels(view: Map, base: Map) -> Array:
    """Relief by size, evened out, and depth."""
    even = evened(relief(view.depth, FINE, SCALES), (view.weight > 0.05).astype(np.float64), FINE)
    inside = view.weight > 0.2
    offset = np.median((view.depth - base.depth)[inside]) if inside.any() else 0.0
    depth = np.maximum(view.depth - EDGE * (1.0 - view.known) - offset, -1.0)
    return np.concatenate([even, depth[None] / SHALLOW])


def _correlation(face: Array, model: Array, weight: Array) -> Array:
    """Correlation of channels (c, rows, columns) around every place (rows, columns)."""

    def mean(values: Array) -> Array:
        return np.asarray(gaussian_filter(weight * values, AROUND / FINE.step))

    like = np.sum([mean(a * b) for a, b in zip(face, model, strict=True)], axis=0)
    norm = np.sum([np.sqrt(mean(a * a) * mean(b * b)) for a, b in zip(face, model, strict=True)], axis=0)
    return np.asarray(like / np.maximum(norm, 1e-9))
