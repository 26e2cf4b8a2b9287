"""Eyeballs, and the lids that glide over them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.transform import Rotation

from ..errors import ParameterError, check_range
from ..geometry.blending import smoothstep
from ..geometry.topology import unique_edges
from .guides import Guide
from .landmarks import MEAN_PUPIL_DISTANCE, FaceFrame
from .opening import lid_rim, opening_of

if TYPE_CHECKING:
    from .face import Face

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]

RADIUS = 12.0 / MEAN_PUPIL_DISTANCE
"""Radius of an eyeball, in distances between the pupils."""

SAG = 0.14
"""How far below the line between its corners a shut eye's lids and lashes meet, in distances between the corners."""


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

    Examples
    --------
    How far a left eye turns outwards and up, in degrees, and how far its iris moves aside in another turn:

    >>> eye = Eyeball("l", np.array([31.0, 0, 0]), 12.0, gaze=np.array([0.0, 0, 1]), up=np.array([0.0, 1, 0]))
    >>> np.degrees(eye.turn_to(np.array([1.0, 0, 1]))).round()
    array([45.,  0.])
    >>> iris = eye.looking(np.array([0.6, 0, 0.8])).surface().points[0]
    >>> round(float(iris[0]) - 31.0, 1)
    7.2
    """

    side: str
    centre: Array
    radius: float
    gaze: Array
    up: Array

    def turned(self, outwards: float, up: float) -> Array:
        """The unit direction of the gaze after turns in radians, outwards (to the eye's own side) and up.

        Examples
        --------
        >>> eye = Eyeball("l", np.zeros(3), 12.0, gaze=np.array([0.0, 0.0, 1.0]), up=np.array([0.0, 1.0, 0.0]))
        >>> eye.turned(0.0, np.pi / 6).round(2).tolist()
        [0.0, 0.5, 0.87]
        """
        ahead = np.cos(outwards) * self.gaze + np.sin(outwards) * self._outwards
        return np.asarray(np.cos(up) * ahead + np.sin(up) * self.up)

    def turn_to(self, direction: Array) -> tuple[float, float]:
        """The turns outwards and up, in radians, after which the eye looks along a direction."""
        ahead, aside, above = (float(direction @ axis) for axis in (self.gaze, self._outwards, self.up))
        return float(np.arctan2(aside, ahead)), float(np.arctan2(above, np.hypot(ahead, aside)))

    @property
    def _outwards(self) -> Array:
        left = np.cross(self.up, self.gaze)
        return left if self.side == "l" else -left

    def looking(self, gaze: Array) -> Eyeball:
        """The eyeball turned so that it looks along a unit direction."""
        up = self.up - (self.up @ gaze) * gaze
        return replace(self, gaze=np.asarray(gaze), up=up / np.linalg.norm(up))

    def slit(self, inner: Array, outer: Array, along: npt.ArrayLike) -> Array:
        """Where lids meet that are shut in the mesh (k, 3), at shares of the way from corner to corner: it sags.

        Examples
        --------
        >>> eye = Eyeball("l", np.zeros(3), 12.0, gaze=np.array([0.0, 0.0, 1.0]), up=np.array([0.0, 1.0, 0.0]))
        >>> eye.slit(np.array([-10.0, 0, 12]), np.array([10.0, 0, 12]), 0.5)
        array([[ 0. , -2.8, 12. ]])
        """
        share = np.reshape(along, (-1, 1))
        sag = SAG * np.linalg.norm(outer - inner) * np.sin(np.pi * share)
        return np.asarray(inner + share * (outer - inner) - sag * self.up)

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


def gaze_of(eye: Eyeball, yaw: float = 0.0, pitch: float = 0.0, at: npt.ArrayLike | None = None) -> tuple[float, float]:
    """The turns outwards and up, in radians, of an eye that looks by angles in degrees, or at a point.

    Parameters
    ----------
    eye : Eyeball
    yaw, pitch : float
        Degrees to the subject's left, and upwards.
    at : (3,) array_like, optional
        In place of them, in the unit of the mesh.

    Raises
    ------
    ParameterError
        For angles that are no numbers, both angles and a point, or a point in the eye.

    Examples
    --------
    Outwards and up, in degrees, for both eyes to look to the left; and outwards, for them to meet at 300 mm.

    >>> import facewrinkle as fw
    >>> left, right = fw.default_face().eyes
    >>> [np.degrees(gaze_of(eye, yaw=20.0)).round().tolist() for eye in (left, right)]
    [[20.0, 0.0], [-20.0, 0.0]]
    >>> there = 0.5 * (left.centre + right.centre) + 300.0 * left.gaze
    >>> [round(float(np.degrees(gaze_of(eye, at=there)[0]))) for eye in (left, right)]
    [-6, -6]
    """
    if at is None:
        left, up = (check_range(name, value, -90.0, 90.0) for name, value in (("yaw", yaw), ("pitch", pitch)))
        return np.deg2rad(left if eye.side == "l" else -left), np.deg2rad(up)
    try:
        target = np.array(at, dtype=np.float64)
    except (TypeError, ValueError):
        target = np.empty(0)
    if target.shape != (3,) or not np.isfinite(target).all() or yaw != 0.0 or pitch != 0.0:
        raise ParameterError(
            f"look needs either angles or a point at=(x, y, z), received yaw={yaw!r}, pitch={pitch!r}, at={at!r}."
        )
    if np.linalg.norm(target - eye.centre) <= 1.2 * eye.radius:
        raise ParameterError(f"the eyes cannot look at {at!r}: the point lies in an eye.")
    return eye.turn_to(target - eye.centre)


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
        opening = opening_of(eye, points, triangles, landmarks)
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

MARGIN_FADE = np.deg2rad(20.0)
"""Angle above the margin within which the motion of the upper lid fades to nothing (14 to 22 degrees in captured
blinks).
"""

SHELL = 1.5
"""Skin farther from the centre than this many radii is no lid."""


@dataclass(frozen=True, eq=False)
class Lids:
    """What the lids of an eye do, as guides.

    Attributes
    ----------
    close : Guide
    up, down : Guide
        What they do while the eye turns up and down by one radian.

    Examples
    --------
    The share of an eye's turn that its upper lid follows, farther down than up:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> lids = lids_of(face.eyes[0], face.points, face.triangles, face.landmarks)
    >>> float(lids.up.angles.min().round(2)), float(lids.down.angles.max().round(2))
    (-0.45, 0.9)
    """

    close: Guide
    up: Guide
    down: Guide


def lids_of(eye: Eyeball, points: Array, triangles: IntArray, landmarks: Mapping[str, Array]) -> Lids | None:
    """The lids of an eye, found from the skin around it; None if the opening is closed or cannot be seen.

    Closing turns the upper margin about the eyeball's centre down to a line just above the lower margin, and raises
    the lower margin to it; skin beyond the margins follows less and less.

    Examples
    --------
    How far the upper lid turns down over the ball, and the lower one up, to close the eye; degrees:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> close = lids_of(face.eyes[0], face.points, face.triangles, face.landmarks).close
    >>> round(float(np.degrees(close.angles.max()))), round(float(np.degrees(close.angles.min())))
    (51, -7)
    """
    opening = opening_of(eye, points, triangles, landmarks)
    if opening is None:
        return None
    offset = points - eye.centre
    along, elevation, distance = opening.polar(points)
    top, bottom = opening.lines(along)
    meeting = bottom + 0.12 * (top - bottom)
    is_upper = elevation > 0.5 * (top + bottom)
    # The inside of a lid, nearer to the ball than its margin, goes with the margin; what lies far inside the socket
    # stays.
    outside = smoothstep((distance - opening.rim(along, is_upper)) / (0.1 * eye.radius) + 0.5)
    beyond = np.where(is_upper, elevation - top, bottom - elevation)
    reach = np.where(is_upper, MARGIN_FADE, 0.6 * MARGIN_FADE)
    fade = 1.0 - smoothstep(beyond / (outside * reach + (1.0 - outside) * 2.5 * MARGIN_FADE))
    inside = smoothstep(np.minimum(along, 1.0 - along) / 0.08 + 1.0)
    overlap = np.minimum(0.0 if opening.thick else OVERLAP, 0.2 * (top - bottom))
    angles = np.where(is_upper, top - meeting + overlap, bottom - meeting) * fade * inside
    near = (offset @ eye.gaze > 0.0) & (distance < SHELL * eye.radius)
    hold = fade**2 * (1.0 - smoothstep((distance / eye.radius - 1.3) / (SHELL - 1.3))) * inside
    across = along * opening.width / eye.radius
    angles = _without_folds(np.where(near, angles, 0.0), elevation, across, triangles, CLOSING_SHEAR)
    # Turning about up x gaze by a positive angle lowers what looks along the gaze.
    axis = opening.axes[0] * np.sign(np.cross(eye.up, eye.gaze) @ opening.axes[0])
    corner = (along < JOINED)[triangles].all(axis=1)
    angles = _none_turned_over(angles, offset, triangles[corner], axis)
    vertices = np.flatnonzero(near & ((np.abs(angles) > 1e-4) | (hold > 0.5)))
    if not len(vertices):
        return None
    close = Guide(vertices, angles[vertices], hold[vertices], eye.centre, axis)
    # The corners of the eye stay; in between both margins follow it.
    height = top - bottom
    follow = np.where(near, fade * inside, 0.0) * np.clip(height / (0.6 * height[vertices].max()), 0.0, 1.0)
    guides = []
    for share, sign in ((FOLLOWS_UP, -1.0), (FOLLOWS_DOWN, 1.0)):
        most = np.where(is_upper, *share) * follow * LARGEST_TURN
        bounded = sign * _without_folds(most, sign * elevation, across, triangles, FOLLOWING_SHEAR) / LARGEST_TURN
        guides.append(replace(close, angles=bounded[vertices]))
    return Lids(close, *guides)


FOLLOWS_UP, FOLLOWS_DOWN = (0.45, 0.2), (0.9, 0.3)
"""Turn of the upper and the lower lid relative to that of the eye (captured: 15 and 8 degrees up, 34 and 11 down)."""

LARGEST_TURN = np.deg2rad(40.0)
"""As far as an eye turns from straight ahead; people turn their heads well before."""


def lid_margins(
    eye: Eyeball, points: Array, triangles: IntArray, landmarks: Mapping[str, Array]
) -> tuple[IntArray, IntArray] | None:
    """Vertices of the upper and of the lower margin from inside outwards; None if the opening is closed."""
    opening = opening_of(eye, points, triangles, landmarks)
    return None if opening is None else (opening.upper, opening.lower)


def sockets(face: Face) -> list[Eyeball]:
    """The eyes between whose open lids and the ball the skin of a face goes on: its lining lies behind the lids."""
    return [
        eye
        for eye in face.eyes
        if lid_rim(eye, face.points, face.triangles) is None
        and lid_margins(eye, face.points, face.triangles, face.landmarks) is not None
    ]


OVERLAP = np.deg2rad(2.0)
"""How much farther than to the line where the lids meet the upper one turns where the skin ends at its margin, so that
coarse margins leave no chink. Lids that have a thickness would come through each other.
"""


def _without_folds(angles: Array, elevation: Array, across: Array, triangles: IntArray, shear: float) -> Array:
    """The largest angles, not above these, that keep the skin from folding over where the two lids join.

    What turns down (by a positive angle) must stay above what is connected to it from below, and keep a share of its
    height over it; along it, `shear` times their distance is allowed. So every angle is bounded by the others through
    paths along the edges, and the least bound is a shortest path.
    """
    edges, _ = unique_edges(triangles)
    i, j = np.concatenate([edges, edges[:, ::-1]]).T
    rise, aside = elevation[j] - elevation[i], np.abs(across[j] - across[i])
    up = rise > -0.2 * aside
    length = KEPT * np.maximum(rise, 0.0) + shear * aside
    n, base = len(angles), float(-angles.min()) + 1.0
    # From one node more, as far from every vertex as its angle; the angles are made positive for it.
    source = np.full(n, n)
    graph = csr_array(
        (
            np.concatenate([length[up] + 1e-12, angles + base]),
            (np.concatenate([i[up], source]), np.concatenate([j[up], np.arange(n)])),
        ),
        shape=(n + 1, n + 1),
    )
    return np.asarray(dijkstra(graph, indices=n)[:n] - base)


KEPT, CLOSING_SHEAR, FOLLOWING_SHEAR = 0.9, 3.0, 1.5
"""By how much of its height over its neighbours skin may come down on them, and how far along them."""


def _none_turned_over(angles: Array, offset: Array, triangles: IntArray, axis: Array) -> Array:
    """Turns of vertices about an axis through the origin, smaller where triangles would come to lie on their faces."""
    triangles = triangles[(angles[triangles] != 0.0).any(axis=1)]
    if not len(triangles):
        return angles
    angles = angles.copy()

    def across(turns: Array) -> Array:
        pairs = zip(turns.T, triangles.T, strict=True)
        a, b, c = (Rotation.from_rotvec(turn[:, None] * axis).apply(offset[k]) for turn, k in pairs)
        return np.cross(b - a, c - a)

    for _ in range(40):
        turns = angles[triangles]
        together = across(np.repeat(turns.mean(axis=1, keepdims=True), 3, axis=1))
        share = (across(turns) * together).sum(axis=1) / np.maximum((together**2).sum(axis=1), 1e-300)
        over = np.unique(triangles[share < UPRIGHT])
        if not len(over):
            break
        angles[over] *= 0.9
    return angles


JOINED, UPRIGHT = 0.2, 0.1
"""How far from the inner corner of an eye its lids are one narrow skin, in distances between the corners, and what is
left there at least of the area of a triangle, as it was seen before they closed.
"""
