"""The place and size of eyeballs, by landmarks and by the lids that lie on them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .eyeball import RADIUS, Eyeball
from .eyelid_opening import eyelid_opening
from .landmarks import FaceFrame

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


def place_eyeballs(
    landmarks: Mapping[str, Array],
    frame: FaceFrame,
    points: Array,
    triangles: IntArray,
    estimated: Collection[str] = (),
) -> list[Eyeball]:
    """Both eyeballs: at the landmarks of their centres, as large as an adult's unless the lids leave less room.

    The shape of a face does not show the depth of an eye, but the lids lie on the ball: where a centre is `estimated`,
    or no ball around it could touch the lids, it is moved to where an adult's does. An eye that is not open lies
    behind the skin.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> eyes = place_eyeballs(face.landmarks, face.frame, face.points, face.triangles)
    >>> [(eye.side, round(eye.radius)) for eye in eyes]
    [('l', 12), ('r', 12)]
    """
    eyes = []
    for side in "lr":
        name, radius = f"eye_{side}_centre", RADIUS * frame.pupil_distance
        eye = Eyeball(side, landmarks[name], radius, frame.axes[2], frame.axes[1])
        opening = eyelid_opening(eye, points, triangles, landmarks)
        if opening is None:
            eyes.append(_behind(eye, points))
            continue
        margin = points[np.unique(np.concatenate([opening.upper, opening.lower]))]
        if opening.thick:
            margin = opening.back_edges(points, triangles)
        if name in estimated or not SMALLEST * radius < _room(eye.centre, margin) < LARGEST * radius:
            eye = replace(eye, centre=_among(margin, eye))
        room = _room(eye.centre, margin)
        eyes.append(replace(eye, radius=float(np.clip(room, SMALLEST * radius, LARGEST * radius))))
    return eyes


def _room(centre: Array, margin: Array) -> float:
    """The radius for which there is room between the margins of the lids."""
    return float(ROOM * np.quantile(np.linalg.norm(margin - centre, axis=1), 0.1))


def _among(margin: Array, eye: Eyeball) -> Array:
    """Where the centre of the ball is that the margins lie on: not much larger or smaller, and not far above, below or
    beside where it was.
    """
    start = np.append(eye.centre, eye.radius / ROOM)
    stay = np.zeros((4, 4))
    stay[:3, :3] = np.stack([0.5 * eye.up, 0.2 * np.cross(eye.up, eye.gaze), 0.1 * eye.gaze])
    stay[3, 3] = 0.25
    n, found = len(margin), start
    for _ in range(12):
        offset = found[:3] - margin
        distance = np.linalg.norm(offset, axis=1)
        rows = np.vstack([np.column_stack([offset / distance[:, None], np.full(n, -1.0)]) / np.sqrt(n), stay])
        miss = np.concatenate([(distance - found[3]) / np.sqrt(n), stay @ (found - start)])
        found = found - np.linalg.lstsq(rows, miss, rcond=None)[0]
    return np.asarray(found[:3])


def _behind(eye: Eyeball, points: Array) -> Eyeball:
    """The eyeball so far back that it lies behind the skin before it."""
    offset = points - eye.centre
    ahead = offset @ eye.gaze
    aside = np.linalg.norm(offset - np.outer(ahead, eye.gaze), axis=1)
    before = (aside < 0.8 * eye.radius) & (ahead > -eye.radius)
    if not before.any():
        return eye
    reach = np.sqrt((eye.radius / ROOM) ** 2 - aside[before] ** 2)
    return replace(eye, centre=eye.centre - max(float((reach - ahead[before]).max()), 0.0) * eye.gaze)


SMALLEST, LARGEST = 0.75, 1.08
"""Radii of eyeballs, relative to an adult's."""


ROOM = 0.975
"""Share of the room between the lids that the ball takes: the chords between the vertices of the lids must not cut
it.
"""
