"""Place and size of eyeballs, by landmarks and by the lids that lie on them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from ..array_types import Array, IntArray
from ..geometry.topology import boundary_loops
from .eyeball import RADIUS, Eyeball
from .eyelid_opening import eyelid_opening
from .landmarks import FaceFrame

SMALLEST_EYE, LARGEST_EYE = 0.75, 1.08
"""Radii of eyeballs, relative to an adult's."""

LID_ROOM, LID_QUANTILE = 0.975, 0.1
"""The ball's radius is the first share of its centre's distance from the margins of the lids, whose edges must not cut
it. The distance is this quantile over the margins' vertices, so that single ones do not count.
"""

HOLD = np.array([0.5, 0.2, 0.1, 0.25])
"""Weights that hold a ball, as it is fitted to the margins, at its place (up, aside, ahead) and at its size. The least
is that of its depth, which the landmarks show least.
"""

CLOSED_REACH = 0.8
"""Skin within this many radii of the axis of a closed eye is in front of it."""


def place_eyeballs(
    landmarks: Mapping[str, Array],
    frame: FaceFrame,
    points: Array,
    triangles: IntArray,
    estimated: Collection[str] = (),
) -> list[Eyeball]:
    """Return both eyeballs, at the landmarks of their centres, as large as an adult's unless the lids leave less room.

    The shape of a face does not show the depth of an eye, but the lids lie on the ball: where a centre is `estimated`,
    or no ball of a usual size about it could touch the lids, it is moved to where an adult's does. An eye whose lids
    are closed is moved back behind the skin.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> eyes = place_eyeballs(face.landmarks, face.frame, face.points, face.triangles)
    >>> [(eye.side, round(eye.radius)) for eye in eyes]
    [('l', 12), ('r', 12)]
    """
    eyes, loops = [], boundary_loops(triangles)
    for side in "lr":
        name, radius = f"eye_{side}_centre", RADIUS * frame.pupil_distance
        eye = Eyeball(side, landmarks[name], radius, frame.axes[2], frame.axes[1])
        opening = eyelid_opening(eye, points, triangles, loops, landmarks)
        if opening is None:
            eyes.append(_behind(eye, points))
            continue
        margin = points[np.unique(np.concatenate([opening.upper, opening.lower]))]
        if opening.thick:
            margin = opening.back_edges(points, triangles)
        if name in estimated or not SMALLEST_EYE * radius < _room(eye.centre, margin) < LARGEST_EYE * radius:
            eye = replace(eye, centre=_fitted_centre(margin, eye))
        room = _room(eye.centre, margin)
        eyes.append(replace(eye, radius=float(np.clip(room, SMALLEST_EYE * radius, LARGEST_EYE * radius))))
    return eyes


def _room(centre: Array, margin: Array) -> float:
    """Radius of the ball about a centre for which the margins of the lids leave room."""
    return float(LID_ROOM * np.quantile(np.linalg.norm(margin - centre, axis=1), LID_QUANTILE))


def _fitted_centre(margin: Array, eye: Eyeball) -> Array:
    """Centre of the ball that fits the margins best, while the weights `HOLD` hold it (Gauss-Newton)."""
    start = np.append(eye.centre, eye.radius / LID_ROOM)
    hold = np.zeros((4, 4))
    hold[:3, :3] = HOLD[:3, None] * np.stack([eye.up, np.cross(eye.up, eye.gaze), eye.gaze])
    hold[3, 3] = HOLD[3]
    n, found = len(margin), start
    for _ in range(12):
        offset = found[:3] - margin
        distance = np.linalg.norm(offset, axis=1)
        rows = np.vstack([np.column_stack([offset / distance[:, None], np.full(n, -1.0)]) / np.sqrt(n), hold])
        miss = np.concatenate([(distance - found[3]) / np.sqrt(n), hold @ (found - start)])
        found = found - np.linalg.lstsq(rows, miss, rcond=None)[0]
    return np.asarray(found[:3])


def _behind(eye: Eyeball, points: Array) -> Eyeball:
    """The eyeball moved back until it lies behind the skin before it."""
    offset = points - eye.centre
    ahead = offset @ eye.gaze
    aside = np.linalg.norm(offset - np.outer(ahead, eye.gaze), axis=1)
    before = (aside < CLOSED_REACH * eye.radius) & (ahead > -eye.radius)
    if not before.any():
        return eye
    reach = np.sqrt((eye.radius / LID_ROOM) ** 2 - aside[before] ** 2)
    return replace(eye, centre=eye.centre - max(float((reach - ahead[before]).max()), 0.0) * eye.gaze)
