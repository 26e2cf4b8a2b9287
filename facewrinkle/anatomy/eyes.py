"""Eyeballs, and the lids that glide over them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyvista as pv

from .landmarks import MEAN_PUPIL_DISTANCE, FaceFrame

Array = npt.NDArray[np.float64]

RADIUS = 12.0 / MEAN_PUPIL_DISTANCE
"""Radius of an eyeball, in distances between the pupils."""


@dataclass(frozen=True, eq=False)
class Eyeball:
    """A sphere in its socket, in the unit of the mesh.

    Attributes
    ----------
    side : {"l", "r"}
    centre : ndarray, shape (3,)
    radius : float
    gaze : ndarray, shape (3,)
        Unit direction in which the eye looks.
    up : ndarray, shape (3,)
    """

    side: str
    centre: Array
    radius: float
    gaze: Array
    up: Array

    def surface(self, resolution: int = 48) -> pv.PolyData:
        """The eyeball as a mesh whose pole is the middle of the iris; `angle` is the angle from it in radians."""
        ball = pv.Sphere(self.radius, self.centre, self.gaze, theta_resolution=resolution, phi_resolution=resolution)
        cosine = (ball.points - self.centre) @ self.gaze / self.radius
        ball.point_data["angle"] = np.arccos(np.clip(cosine, -1.0, 1.0))
        return ball


@dataclass(frozen=True, eq=False)
class Lids:
    """How far each vertex turns about the eyeball's centre when the lids close.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
    angles : ndarray, shape (k,)
        Turn about `axis` at full closure, radians; downwards positive.
    hold : ndarray, shape (k,)
        In [0, 1]: 1 on the stiff plates of the lids (tarsi), which follow exactly; falls to 0 in the skin around.
    centre, axis : ndarray, shape (3,)
    """

    vertices: npt.NDArray[np.int64]
    angles: Array
    hold: Array
    centre: Array
    axis: Array


def place_eyeballs(landmarks: Mapping[str, Array], frame: FaceFrame, points: Array) -> list[Eyeball]:
    """Both eyeballs: at the landmarks of their centres, as large as the lids allow (at most an adult's eye)."""
    eyes = []
    for side in "lr":
        centre = landmarks[f"eye_{side}_centre"]
        largest = RADIUS * frame.pupil_distance
        offset = points - centre
        distance = np.linalg.norm(offset, axis=1)
        # Lid margins rest on the ball: the skin straight in front of it must not lie inside.
        front = (offset @ frame.axes[2] > 0.5 * distance) & (distance < 1.6 * largest)
        nearest = np.quantile(distance[front], 0.01) if front.any() else largest
        radius = float(np.clip(nearest, 0.75 * largest, 1.1 * largest))
        eyes.append(Eyeball(side, centre, radius, frame.axes[2], frame.axes[1]))
    return eyes


MARGIN_FADE = np.deg2rad(20.0)
"""Angle above the margin within which the motion of the upper lid fades to nothing (14 to 22 degrees in captured blinks)."""

SHELL = 1.45
"""Skin farther from the centre than this many radii is no lid."""

BINS = 25


def lids_of(eye: Eyeball, points: Array, landmarks: Mapping[str, Array]) -> Lids | None:
    """The lids of an eye, found from the skin around it; None if the opening is closed or cannot be seen.

    The margins are measured per meridian between the canthi: the lowest skin of the upper lid and the highest of the lower
    lid, as elevations about the horizontal axis through the eyeball's centre. Closing turns the upper margin down to a line
    just above the lower margin, and raises the lower margin to it.
    """
    inner, outer = landmarks[f"eye_{eye.side}_inner"], landmarks[f"eye_{eye.side}_outer"]
    axis = outer - inner
    axis = axis - (axis @ eye.gaze) * eye.gaze
    width = np.linalg.norm(axis)
    axis /= width
    up = np.cross(eye.gaze, axis)
    up *= np.sign(up @ eye.up)
    offset = points - eye.centre
    x, y, z = offset @ axis, offset @ up, offset @ eye.gaze
    start = (inner - eye.centre) @ axis
    along = (x - start) / width
    distance = np.linalg.norm(offset, axis=1)
    elevation = np.arctan2(y, z)
    line = np.arctan2((inner - eye.centre) @ up, (inner - eye.centre) @ eye.gaze)
    line = line + along * (np.arctan2((outer - eye.centre) @ up, (outer - eye.centre) @ eye.gaze) - line)
    near = (distance < SHELL * eye.radius) & (z > 0.0) & (distance > 0.9 * eye.radius)
    upper, lower = _margins(along, elevation, line, near)
    if upper is None or lower is None:
        return None
    top, bottom = np.interp(along, CENTRES, upper), np.interp(along, CENTRES, lower)
    meeting = bottom + 0.15 * (top - bottom)
    inside = np.clip(np.minimum(along, 1.0 - along) / 0.04 + 1.0, 0.0, 1.0)
    is_upper = elevation > 0.5 * (top + bottom)
    beyond = np.where(is_upper, elevation - top, bottom - elevation)
    fade = 1.0 - _smoothstep(beyond / np.where(is_upper, MARGIN_FADE, 0.6 * MARGIN_FADE))
    angles = np.where(is_upper, top - meeting, bottom - meeting) * fade * inside
    vertices = np.flatnonzero(near & (np.abs(angles) > 1e-4))
    if not len(vertices):
        return None
    hold = fade[vertices] * (1.0 - _smoothstep((distance[vertices] / eye.radius - 1.2) / (SHELL - 1.2)))
    return Lids(vertices, angles[vertices], hold, eye.centre, np.cross(up, eye.gaze))


CENTRES = (np.arange(BINS) + 0.5) / BINS


def _margins(along: Array, elevation: Array, line: Array, near: npt.NDArray[np.bool_]) -> tuple[Array | None, Array | None]:
    """Elevations of the upper and of the lower margin at the meridians `CENTRES`."""
    found: list[Array | None] = []
    for sign in (1.0, -1.0):
        side = near & (sign * (elevation - line) > 0.0) & (along > 0.0) & (along < 1.0)
        place = np.clip((along[side] * BINS).astype(int), 0, BINS - 1)
        lowest = np.full(BINS, np.inf)
        np.minimum.at(lowest, place, sign * elevation[side])
        known = np.isfinite(lowest)
        if known.sum() < 4:
            return None, None
        smooth = np.interp(CENTRES, CENTRES[known], lowest[known])
        smooth = np.convolve(np.pad(smooth, 1, mode="edge"), [0.25, 0.5, 0.25], mode="valid")
        found.append(sign * smooth)
    return found[0], found[1]


def _smoothstep(t: Array) -> Array:
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
