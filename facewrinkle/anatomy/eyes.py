"""Eyeballs, and the lids that glide over them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..geometry.topology import boundary_loops
from .landmarks import MEAN_PUPIL_DISTANCE, FaceFrame

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

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
        ball = pv.Sphere(
            radius=self.radius,
            center=self.centre,
            direction=self.gaze,
            theta_resolution=resolution,
            phi_resolution=resolution,
        )
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


def place_eyeballs(
    landmarks: Mapping[str, Array], frame: FaceFrame, points: Array, triangles: IntArray
) -> list[Eyeball]:
    """Both eyeballs: at the landmarks of their centres, as large as an adult's unless the lids leave less room."""
    eyes = []
    for side in "lr":
        eye = Eyeball(
            side, landmarks[f"eye_{side}_centre"], RADIUS * frame.pupil_distance, frame.axes[2], frame.axes[1]
        )
        opening = _opening(eye, points, triangles, landmarks)
        if opening is not None:
            margin = np.unique(np.concatenate(opening[3:]))
            room = ROOM * np.quantile(np.linalg.norm(points[margin] - eye.centre, axis=1), 0.1)
            eye = replace(eye, radius=float(np.clip(room, 0.75 * eye.radius, 1.05 * eye.radius)))
        eyes.append(eye)
    return eyes


ROOM = 0.975
"""Share of the room between the lids that the ball takes: the chords between the vertices of the lids must not cut it."""

MARGIN_FADE = np.deg2rad(20.0)
"""Angle above the margin within which the motion of the upper lid fades to nothing (14 to 22 degrees in captured blinks)."""

SHELL = 1.5
"""Skin farther from the centre than this many radii is no lid."""

MERIDIANS = np.linspace(0.04, 0.96, 24)
"""Where the margins are measured, from the inner (0) to the outer canthus (1)."""


def lids_of(eye: Eyeball, points: Array, triangles: IntArray, landmarks: Mapping[str, Array]) -> Lids | None:
    """The lids of an eye, found from the skin around it; None if the opening is closed or cannot be seen.

    Closing turns the upper margin about the eyeball's centre down to a line just above the lower margin, and raises the lower
    margin to it; skin beyond the margins follows less and less.
    """
    opening = _opening(eye, points, triangles, landmarks)
    if opening is None:
        return None
    lateral, along, elevation, upper, lower = opening
    offset = points - eye.centre
    distance = np.linalg.norm(offset, axis=1)
    top = np.interp(along, along[upper], elevation[upper])
    bottom = np.interp(along, along[lower], elevation[lower])
    meeting = bottom + 0.12 * (top - bottom)
    inside = _smoothstep(np.minimum(along, 1.0 - along) / 0.08 + 1.0)
    is_upper = elevation > 0.5 * (top + bottom)
    beyond = np.where(is_upper, elevation - top, bottom - elevation)
    fade = 1.0 - _smoothstep(beyond / np.where(is_upper, MARGIN_FADE, 0.6 * MARGIN_FADE))
    overlap = np.minimum(OVERLAP, 0.2 * (top - bottom))
    angles = np.where(is_upper, top - meeting + overlap, bottom - meeting) * fade * inside
    near = (offset @ eye.gaze > 0.0) & (distance < SHELL * eye.radius)
    vertices = np.flatnonzero(near & (np.abs(angles) > 1e-4))
    if not len(vertices):
        return None
    hold = fade**2 * (1.0 - _smoothstep((distance / eye.radius - 1.3) / (SHELL - 1.3)))
    # Turning about up x gaze by a positive angle lowers what looks along the gaze.
    axis = lateral * np.sign(np.cross(eye.up, eye.gaze) @ lateral)
    return Lids(vertices, angles[vertices], hold[vertices], eye.centre, axis)


OVERLAP = np.deg2rad(2.0)
"""How much farther than to the line where the lids meet the upper one turns, so that coarse margins leave no chink."""


def _opening(
    eye: Eyeball, points: Array, triangles: IntArray, landmarks: Mapping[str, Array]
) -> tuple[Array, ...] | None:
    """The opening between the lids: lateral direction, every point's position between the canthi (0 to 1) and its elevation
    about the lateral axis, and the vertices of the upper and lower margin from inside outwards. None where it is closed.
    """
    inner, outer = landmarks[f"eye_{eye.side}_inner"], landmarks[f"eye_{eye.side}_outer"]
    width = float(np.linalg.norm(outer - inner))
    lateral = (outer - inner) / width
    forward = eye.gaze - (eye.gaze @ lateral) * lateral
    forward /= np.linalg.norm(forward)
    up = np.cross(forward, lateral)
    up *= np.sign(up @ eye.up)
    offset = points - eye.centre
    along = ((offset - (inner - eye.centre)) @ lateral) / width
    elevation = np.arctan2(offset @ up, offset @ forward)
    margins = _hole(eye, points, triangles, along, elevation) or _gap(eye, points, along, elevation)
    return None if margins is None else (lateral, along, elevation, *margins)


def _hole(
    eye: Eyeball, points: Array, triangles: IntArray, along: Array, elevation: Array
) -> tuple[Array, Array] | None:
    """Both margins where the opening is a hole in the mesh: its boundary loop, cut at the canthi."""
    for loop in boundary_loops(triangles):
        offset = points[loop] - eye.centre
        if np.linalg.norm(offset, axis=1).max() > 1.8 * eye.radius or len(loop) < 6:
            continue
        start, end = int(np.argmin(along[loop])), int(np.argmax(along[loop]))
        loop = np.roll(loop, -start)
        turn = (end - start) % len(loop)
        chains = [loop[: turn + 1], np.append(loop[turn:], loop[0])]
        chains = [chain[np.argsort(along[chain], kind="stable")] for chain in chains]
        lower, upper = sorted(chains, key=lambda chain: float(elevation[chain].mean()))
        return upper, lower
    return None


def _gap(eye: Eyeball, points: Array, along: Array, elevation: Array) -> tuple[Array, Array] | None:
    """Both margins where the skin goes on into the socket: the widest gap in elevation on each meridian."""
    offset = points - eye.centre
    distance = np.linalg.norm(offset, axis=1)
    near = np.flatnonzero((offset @ eye.gaze > 0.0) & (np.abs(distance / eye.radius - 1.15) < 0.3))
    upper, lower = [], []
    for meridian in MERIDIANS:
        column = near[np.abs(along[near] - meridian) < 0.07]
        column = column[np.argsort(elevation[column])]
        gaps = np.diff(elevation[column])
        if len(gaps) == 0 or gaps.max() < np.deg2rad(3.0):
            return None
        widest = int(np.argmax(gaps))
        lower.append(column[widest])
        upper.append(column[widest + 1])
    chains = (np.unique(upper), np.unique(lower))
    first, second = (chain[np.argsort(along[chain], kind="stable")] for chain in chains)
    return first, second


def _smoothstep(t: Array) -> Array:
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))
