"""Eyelids: their turns over the eyeball as the eye closes, and as it looks up and down."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.transform import Rotation

from ..array_types import Array, BoolArray, IntArray
from ..geometry.interpolation import smoothstep
from ..geometry.topology import unique_edges
from .eyeball import Eyeball
from .eyelid_opening import EyelidOpening
from .muscles import JointWeights

# --- Skin that belongs to a lid -----------------------------------------------------------------------------

SHELL = 1.5
"""Skin farther from the centre of the eye than this many radii is not part of a lid."""

CORNER = 0.08
"""Beyond the canthi, the motion fades to nothing over this length, in distances between the canthi."""

# --- Closing ------------------------------------------------------------------------------------------------

OVERLAP, MOST_OVERLAP = np.deg2rad(2.0), 0.2
"""Turn of the upper lid beyond the line where both meet, so that coarse margins leave no chink, and its limit relative
to the height of the opening. Lids with a thickness have no overlap: they would come through each other.
"""

# --- Following the eye --------------------------------------------------------------------------------------

LARGEST_TURN = np.deg2rad(40.0)
"""Largest turn of an eye from straight ahead; people turn their heads well before."""


def lid_share(eye: Eyeball, points: Array) -> Array:
    """Return the share of a lid in skin (n,) around an eye: 1 near the ball, falling to 0 where no lid reaches."""
    away = np.linalg.norm(points - eye.centre, axis=1) / eye.radius
    return 1.0 - smoothstep((away - 1.0) / (SHELL - 1.0))


@dataclass(frozen=True, eq=False)
class LidWeights:
    """Turns of the skin with the lids of an eye.

    Attributes
    ----------
    close : JointWeights
    tighten : JointWeights
        As the palpebral part of the orbicularis oculi tightens the lower lid.
    up, down : JointWeights
        As the eye turns up and down by one radian.

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
    tighten: JointWeights
    up: JointWeights
    down: JointWeights


def lid_weights(opening: EyelidOpening, points: Array, triangles: IntArray) -> LidWeights | None:
    """Return the turns with the lids around an opening; None if no skin is near enough to the eye to be a lid.

    Closing turns the upper margin about the eyeball's centre down to a line just above the lower margin, and raises
    the lower margin to it; skin beyond the margins follows less and less.

    Examples
    --------
    Turns that close the eye, of the upper lid down over the ball and of the lower one up, degrees:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> close = lid_weights(face.eyelid_openings["l"], face.points, face.triangles).close
    >>> round(float(np.degrees(close.angles.max()))), round(float(np.degrees(close.angles.min())))
    (43, -6)
    """
    eye, offset = opening.eye, points - opening.eye.centre
    near = (offset @ eye.gaze > 0.0) & (np.linalg.norm(offset, axis=1) < SHELL * eye.radius)
    used, corners = np.unique(triangles[near[triangles].any(axis=1)], return_inverse=True)
    if not len(used):
        return None
    points, offset, near, triangles = points[used], offset[used], near[used], corners.reshape(-1, 3)
    along, elevation, distance = opening.polar(points)
    top, bottom = opening.lines(along)
    height, is_upper = top - bottom, elevation > 0.5 * (top + bottom)
    between = smoothstep(np.minimum(along, 1.0 - along) / CORNER + 1.0)
    fade = _fade(opening, along, distance, np.where(is_upper, elevation - top, bottom - elevation), is_upper)
    fade *= smoothstep(distance / max(eye.core, 1e-12))  # the lining in a ball stays there, and binds no lid
    triangles = triangles[(distance >= eye.core)[triangles].all(axis=1)]
    meeting = bottom + 0.12 * height  # the line where the lids meet
    overlap = np.minimum(0.0 if opening.thick else OVERLAP, MOST_OVERLAP * height)
    angles = np.where(is_upper, top - meeting + overlap, bottom - meeting) * fade * between
    # The stiff plate of a lid ends 1.3 radii from the centre: from there its hold on the skin fades.
    hold = fade**2 * (1.0 - smoothstep((distance / eye.radius - 1.3) / (SHELL - 1.3))) * between
    across = along * opening.width / eye.radius
    angles = _without_folds(np.where(near, angles, 0.0), elevation, across, triangles, shear=3.0)
    # A positive turn about up x gaze turns the gaze down.
    axis = opening.axes[0] * np.sign(np.cross(eye.up, eye.gaze) @ opening.axes[0])
    corner = (along < 0.2)[triangles].all(axis=1)  # there the lids are one narrow skin
    angles = _none_turned_over(angles, offset, triangles[corner], axis)
    vertices = np.flatnonzero(near & ((np.abs(angles) > 1e-4) | (hold > 0.5)))
    if not len(vertices):
        return None
    close = JointWeights(used[vertices], angles[vertices], hold[vertices], eye.centre, axis)
    full = 0.6 * height[vertices].max()  # margins follow less where the opening is lower, not at all at its corners
    follow = np.where(near, fade * between, 0.0) * np.clip(height / full, 0.0, 1.0)
    following = []
    # Turns of the upper and the lower lid relative to that of the eye (captured: 15 and 8 degrees up, 34 and 11 down).
    for share, sign in (((0.45, 0.2), -1.0), ((0.9, 0.3), 1.0)):
        most = np.where(is_upper, *share) * follow * LARGEST_TURN
        bounded = sign * _without_folds(most, sign * elevation, across, triangles, shear=1.5) / LARGEST_TURN
        following.append(replace(close, angles=bounded[vertices]))
    # A lower lid that is tightened goes in one piece, up by about a quarter of the opening (0.21 in a captured squint),
    # and towards the inner canthus, where the muscle rises, by about half as much (0.4 to 0.5 there).
    below = 1.0 - smoothstep(np.maximum(bottom - elevation, 0.0) / np.deg2rad(45.0))
    tightened = np.where(is_upper, 0.0, -0.24 * height * below * between)[vertices]
    tilted = axis + 0.45 * np.cross(eye.gaze, opening.axes[0])
    tighten = replace(close, angles=tightened, axis=tilted / np.linalg.norm(tilted))
    return LidWeights(close, tighten, *following)


def _fade(opening: EyelidOpening, along: Array, distance: Array, beyond: Array, is_upper: BoolArray) -> Array:
    """Share (n,) of the margin's motion that skin takes, by its angle `beyond` the margin.

    Above, it fades well before the brow, which is near above the large eyes of drawn figures, and stays. The inside of
    a lid goes with the margin; only skin far back in the socket stays.
    """
    # Over a tenth of a radius, skin beyond the margin passes from the outside of a lid to its inside.
    outside = smoothstep((distance - opening.rim(along, is_upper)) / (0.1 * opening.eye.radius) + 0.5)
    to_brow = np.interp(along, *opening.brow[:2]) - opening.lines(along)[0]
    most = np.deg2rad(20.0)  # 14 to 22 degrees in captured blinks
    upper = np.clip(0.6 * to_brow, 0.25 * most, most)
    reach = np.where(is_upper, upper, 0.6 * most)
    return np.asarray(1.0 - smoothstep(beyond / (outside * reach + (1.0 - outside) * 2.5 * most)))


def _without_folds(angles: Array, elevation: Array, across: Array, triangles: IntArray, shear: float) -> Array:
    """The largest angles, not above these, that keep the skin from folding over where the two lids join.

    Skin that turns down (by a positive angle) must stay above its neighbors below, and keep a tenth of its height over
    them; `shear` times their distance `across` is allowed besides. Thus every angle bounds the others along paths of
    edges, and the least bound is a shortest path.
    """
    edges, _ = unique_edges(triangles)
    i, j = np.concatenate([edges, edges[:, ::-1]]).T
    rise, aside = elevation[j] - elevation[i], np.abs(across[j] - across[i])
    up = rise > -0.2 * aside  # or about level with it
    length = 0.9 * np.maximum(rise, 0.0) + shear * aside
    n, base = len(angles), float(-angles.min()) + 1.0
    # The paths begin at one more node; its distance from each vertex is that vertex's angle, made positive.
    source = np.full(n, n)
    graph = csr_array(
        (
            np.concatenate([length[up] + 1e-12, angles + base]),
            (np.concatenate([i[up], source]), np.concatenate([j[up], np.arange(n)])),
        ),
        shape=(n + 1, n + 1),
    )
    return np.asarray(dijkstra(graph, indices=n)[:n] - base)


def _none_turned_over(angles: Array, offset: Array, triangles: IntArray, axis: Array) -> Array:
    """Turns of vertices about an axis through the origin, smaller where triangles would turn over.

    Each keeps a tenth of its area at least, projected on the plane that it would have if it turned in one piece.
    """
    triangles = triangles[(angles[triangles] != 0.0).any(axis=1)]
    if not len(triangles):
        return angles
    angles = angles.copy()

    def areas(turns: Array) -> Array:
        pairs = zip(turns.T, triangles.T, strict=True)
        a, b, c = (Rotation.from_rotvec(turn[:, None] * axis).apply(offset[k]) for turn, k in pairs)
        return np.cross(b - a, c - a)

    for _ in range(40):
        turns = angles[triangles]
        together = areas(np.repeat(turns.mean(axis=1, keepdims=True), 3, axis=1))
        share = (areas(turns) * together).sum(axis=1) / np.maximum((together**2).sum(axis=1), 1e-300)
        over = np.unique(triangles[share < 0.1])
        if not len(over):
            break
        angles[over] *= 0.9
        triangles = triangles[np.isin(triangles, over).any(axis=1)]  # all others are as they were
    return angles
