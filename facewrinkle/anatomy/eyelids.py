"""Eyeballs, and the lids that glide over them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.transform import Rotation

from ..geometry.smoothstep import smoothstep
from ..geometry.topology import unique_edges
from .eyelid_opening import EyelidOpening
from .joint_weights import JointWeights

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]


MARGIN_FADE = np.deg2rad(20.0)
"""Angle above the margin within which the motion of the upper lid fades to nothing (14 to 22 degrees in captured
blinks).
"""

SHELL = 1.5
"""Skin farther from the centre than this many radii is no lid."""


@dataclass(frozen=True, eq=False)
class LidWeights:
    """What the lids of an eye do, as guides.

    Attributes
    ----------
    close : JointWeights
    up, down : JointWeights
        What they do while the eye turns up and down by one radian.

    Examples
    --------
    The share of an eye's turn that its upper lid follows, farther down than up:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> lids = lid_weights(face.eyelid_openings["l"], face.points, face.triangles)
    >>> float(lids.up.angles.min().round(2)), float(lids.down.angles.max().round(2))
    (-0.45, 0.9)
    """

    close: JointWeights
    up: JointWeights
    down: JointWeights


def lid_weights(opening: EyelidOpening, points: Array, triangles: IntArray) -> LidWeights | None:
    """The lids around an opening; None where no skin is near enough to the eye to be one.

    Closing turns the upper margin about the eyeball's centre down to a line just above the lower margin, and raises
    the lower margin to it; skin beyond the margins follows less and less.

    Examples
    --------
    How far the upper lid turns down over the ball, and the lower one up, to close the eye; degrees:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> close = lid_weights(face.eyelid_openings["l"], face.points, face.triangles).close
    >>> round(float(np.degrees(close.angles.max()))), round(float(np.degrees(close.angles.min())))
    (51, -7)
    """
    eye, offset = opening.eye, points - opening.eye.centre
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
    close = JointWeights(vertices, angles[vertices], hold[vertices], eye.centre, axis)
    # The corners of the eye stay; in between both margins follow it.
    height = top - bottom
    follow = np.where(near, fade * inside, 0.0) * np.clip(height / (0.6 * height[vertices].max()), 0.0, 1.0)
    guides = []
    for share, sign in ((FOLLOWS_UP, -1.0), (FOLLOWS_DOWN, 1.0)):
        most = np.where(is_upper, *share) * follow * LARGEST_TURN
        bounded = sign * _without_folds(most, sign * elevation, across, triangles, FOLLOWING_SHEAR) / LARGEST_TURN
        guides.append(replace(close, angles=bounded[vertices]))
    return LidWeights(close, *guides)


FOLLOWS_UP, FOLLOWS_DOWN = (0.45, 0.2), (0.9, 0.3)
"""Turn of the upper and the lower lid relative to that of the eye (captured: 15 and 8 degrees up, 34 and 11 down)."""

LARGEST_TURN = np.deg2rad(40.0)
"""As far as an eye turns from straight ahead; people turn their heads well before."""


OVERLAP = np.deg2rad(2.0)
"""How much farther than to the line where the lids meet the upper one turns where the skin ends at its margin, so that
coarse margins leave no chink. LidWeights that have a thickness would come through each other.
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
