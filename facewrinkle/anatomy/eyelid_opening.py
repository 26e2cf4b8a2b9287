"""The opening between the lids of an eye; the margins of the lids: their front edges, where lashes grow; and the place
and size of the ball on which the lids lie.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from ..array_types import Array, BoolArray, IntArray
from ..geometry.interpolation import smoothstep
from ..geometry.normals import unit
from ..geometry.topology import connected, unique_edges
from .eyeball import RADIUS, Eyeball
from .landmarks import FaceFrame
from .parts import Part, given_eye

LidSections = list[tuple[float, Array, tuple[float, float]]]
"""Meridians with a gap between the lids: their place, the skin on them, and the gap's lowest and highest height."""

# Lengths are in distances between the canthi (27 mm on the built-in head); heights are above the line between them.
# Measurements in brackets are of the three faces with open eyes at hand.

MERIDIANS = np.linspace(0.04, 0.96, 24)
"""Places between the inner (0) and the outer canthus (1) at which the margins are measured."""

# --- Lids are open at a meridian --------------------------------------------------------------------------

HEIGHTS = np.linspace(-0.45, 0.45, 81)
"""The heights at which a meridian is searched for skin: margins lie at most so far above and below the canthi (-0.17 to
0.25).
"""

# --- The mesh ends at the margins, or goes on behind them: then the lids have a thickness -------------------


RIM_MISS, RIM_MIDDLE = 0.035, (0.3, 0.7)
"""The rim is the margin that is seen if, between these places, the two are nowhere farther apart than this."""

# --- The margin of a lid with a thickness is its front edge -------------------------------------------------

LID_THICKNESS = 0.06
"""Skin farther beyond the gap than this is the front of a lid, and no longer its edge."""


# --- The opening as it is seen ------------------------------------------------------------------------------

LINING_DEPTH = 0.7
"""Depth that the lining of a socket is taken to have, from the margins (0) to the ball (1): it is in their shadow."""

EYE_WIDTH, EYE_DEPTH = 1.4, 1.5
"""Points belong to an eye within this width about its middle, and within this many radii of its centre."""

# --- The ball behind the lids ----------------------------------------------------------------------------------

LID_ROOM, LID_QUANTILE = 0.975, 0.1
"""The ball's radius is the first share of its centre's distance from the margins of the lids, whose edges must not cut
it. The distance is this quantile over the margins' vertices, so that single ones do not count.
"""


@dataclass(frozen=True, eq=False)
class EyelidOpening:
    """The opening between the lids of an eye.

    Attributes
    ----------
    eye : Eyeball
    inner : ndarray, shape (3,)
        The inner canthus.
    axes : ndarray, shape (3, 3)
        Unit directions outwards, up and forward, as rows.
    width : float
        From the inner to the outer canthus, in the unit of the mesh.
    canthi : ndarray, shape (2,)
        Elevations of the canthi, the inner one first.
    thick : bool
        True if the lids have a thickness: the skin goes on behind the margins.
    upper, lower : ndarray of int
        Vertices of the margins, from the inner canthus outwards.
    rims : tuple of ndarray, shape (3, k)
        :meth:`polar` coordinates of these vertices at rest.
    brow : ndarray, shape (3, 3)
        :meth:`polar` coordinates of the landmarks of the brow.

    Examples
    --------
    How wide the left eye of the built-in head is open, from canthus to canthus, and how high in the middle; mm:

    >>> import facewrinkle as fw
    >>> opening = fw.default_face().eyelid_openings["l"]
    >>> top, bottom = opening.lines(np.array([0.5]))
    >>> round(opening.width), round(float((top - bottom)[0] * opening.eye.radius))
    (28, 10)
    """

    eye: Eyeball
    inner: Array
    axes: Array
    width: float
    canthi: Array
    thick: bool
    upper: IntArray
    lower: IntArray
    rims: tuple[Array, Array]
    brow: Array

    def polar(self, points: Array) -> Array:
        """Polar coordinates (3, n) of points (n, 3): place from the inner (0) to the outer canthus (1), elevation as
        seen from the centre of the eye, radians, and distance from that centre.
        """
        return _polar(points, self.eye.centre, self.inner, self.axes, self.width)

    def lines(self, along: Array) -> tuple[Array, Array]:
        """Elevations of the upper and of the lower margin at places between the canthi, where both end."""
        return self._line(0, along), self._line(1, along)

    def _line(self, lid: int, along: Array) -> Array:
        at, elevation, _ = self.rims[lid]
        # Margins end within these places, inner and outer, and meet the canthi 0.1 beyond.
        ends = np.clip([at[0], at[-1]], [0.01, 0.9], [0.1, 0.99])
        place = np.concatenate([[ends[0] - 0.1], at, [ends[1] + 0.1]])
        return np.interp(along, place, np.concatenate([self.canthi[:1], elevation, self.canthi[1:]]))

    def rim(self, along: Array, upper: BoolArray) -> Array:
        """Distance of the upper margin, or else the lower, from the centre of the eye at places between the canthi."""
        return np.where(upper, *(np.interp(along, at, distance) for at, _, distance in self.rims))

    def lining(self, points: Array, edges: IntArray, normals: Array) -> BoolArray:
        """True (n,) for vertices that face the ball and are connected through such vertices with those nearest to the
        margins: the lining of the socket, and not the side of the nose.
        """
        facing = ((points - self.eye.centre) * normals).sum(axis=1) < 0.0
        piece = connected(edges[facing[edges].all(axis=1)], len(points))
        margins = points[np.concatenate([self.upper, self.lower])]
        nearest = cKDTree(points[facing]).query(margins)[1]
        return np.asarray(facing & np.isin(piece, piece[facing][nearest]))

    def behind(self, points: Array, lining: BoolArray) -> Array:
        """Depth (n,) of points between the lids or on the lining of the socket: 0 at the margins, 1 on the ball."""
        along, elevation, distance = self.polar(points)
        top, bottom = self.lines(along)
        rim = self.rim(along, elevation > 0.5 * (top + bottom))
        # Skin behind the margins may be seen up to 6 degrees above and below them.
        seen = smoothstep(1.0 - np.maximum(elevation - top, bottom - elevation) / np.deg2rad(6.0))
        deep = np.clip((rim - distance) / np.maximum(rim - self.eye.radius, 0.02 * self.eye.radius), 0.0, 1.0)
        near = (np.abs(along - 0.5) < 0.5 * EYE_WIDTH) & (distance < EYE_DEPTH * self.eye.radius)
        return np.asarray(np.where(near, np.where(lining, LINING_DEPTH, deep * seen), 0.0))

    def back_edges(self, points: Array, triangles: IntArray) -> Array:
        """Places (k, 3) where thick lids touch the ball: at most half their thickness behind their front edges."""
        local = (points - self.inner) @ self.axes.T / self.width
        lids = _lid_sections(local[_near(local, triangles)], _ball(self.eye, self.inner, self.axes, self.width))
        places = [_front_edge(lids, away) for away in (1.0, -1.0)]
        for front in places:
            for place, (_, section, _) in zip(front, lids, strict=True):
                start, end = section[:, 0], section[:, 1]
                skin = (start + np.linspace(0.0, 1.0, 9)[:, None, None] * (end - start)).reshape(-1, 2)
                behind = place[2] - skin[:, 1]
                edge = (np.abs(skin[:, 0] - place[1]) < 0.5 * LID_THICKNESS) & (behind < 0.5 * LID_THICKNESS)
                place[2] -= behind[edge].max(initial=0.0)
        return np.asarray(self.inner + self.width * np.concatenate(places) @ self.axes)


def eyelid_opening(
    eye: Eyeball, points: Array, triangles: IntArray, loops: Sequence[IntArray], landmarks: Mapping[str, Array]
) -> EyelidOpening | None:
    """Return the opening before an eye, by the boundary loops of the mesh; None if the lids are closed.

    Examples
    --------
    Angle between the lids of the built-in face in the middle, as seen from the centre of the ball, degrees:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> mesh = face.points, face.triangles, face.boundary_loops
    >>> top, bottom = eyelid_opening(face.eyes[0], *mesh, face.landmarks).lines(np.array([0.5]))
    >>> np.degrees(top - bottom).round()
    array([47.])
    """
    inner, outer = landmarks[f"eye_{eye.side}_inner"], landmarks[f"eye_{eye.side}_outer"]
    width = float(np.linalg.norm(outer - inner))
    lateral = (outer - inner) / width
    forward = unit(eye.gaze - (eye.gaze @ lateral) * lateral)
    up = np.cross(forward, lateral)
    axes = np.stack([lateral, up * np.sign(up @ eye.up), forward])
    local, polar = (points - inner) @ axes.T / width, _polar(points, eye.centre, inner, axes, width)
    triangles = _near(local, triangles)
    lids = _lid_sections(local[triangles], _ball(eye, inner, axes, width))
    in_middle = any(RIM_MIDDLE[0] <= at <= RIM_MIDDLE[1] for at, *_ in lids)
    if len(lids) < len(MERIDIANS) // 2 or not in_middle:  # they are closed
        return None
    hole = _hole(lid_rim(eye, points, loops), *polar[:2])
    thick = hole is None or not _is_seen(hole, local, lids)
    upper, lower = _margins(lids, local, triangles) if hole is None or thick else hole
    canthi = _polar(np.stack([inner, outer]), eye.centre, inner, axes, width)[1]
    over = _polar(
        np.array([landmarks[f"brow_{eye.side}_{part}"] for part in ("inner", "mid", "outer")]),
        eye.centre, inner, axes, width,
    )  # fmt: skip
    rims = polar[:, upper], polar[:, lower]
    return EyelidOpening(eye, inner, axes, width, canthi, thick, upper, lower, rims, over[:, np.argsort(over[0])])


def usual_corners(landmarks: Mapping[str, Array], frame: FaceFrame) -> dict[str, Array]:
    """Return places by name of landmark where the lids of an adult's eyes meet, by the landmarks of the eyes' centres.

    Examples
    --------
    Millimeters beside the corners of the built-in face:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> usual = usual_corners(face.landmarks, face.frame)
    >>> max(float(np.linalg.norm(place - face.landmarks[name])) for name, place in usual.items()) < 2.0
    True
    """
    radius = RADIUS * frame.pupil_distance
    return {
        f"eye_{side}_{end}": landmarks[f"eye_{side}_centre"] + radius * np.array([sign * out, up, ahead]) @ frame.axes
        for side, sign in (("l", 1.0), ("r", -1.0))
        for end, out, up, ahead in (("inner", -1.1, -0.3, 0.65), ("outer", 1.1, -0.2, 0.2))  # in these radii
    }


def lid_rim(eye: Eyeball, points: Array, loops: Sequence[IntArray]) -> IntArray | None:
    """Vertices around the hole before an eye, of the boundary loops of a mesh; None if it goes on behind the lids.

    Of several holes within 1.8 radii of the eye's centre, it is the longest.
    """
    near = [loop for loop in loops if np.linalg.norm(points[loop] - eye.centre, axis=1).max() < 1.8 * eye.radius]
    return np.asarray(max(near, key=len), np.int32) if near else None


def _polar(points: Array, centre: Array, inner: Array, axes: Array, width: float) -> Array:
    offset = (points - centre) @ axes.T
    along = (points - inner) @ axes[0] / width
    return np.stack([along, np.arctan2(offset[:, 1], offset[:, 2]), np.linalg.norm(offset, axis=1)])


def _hole(loop: IntArray | None, along: Array, elevation: Array) -> tuple[IntArray, IntArray] | None:
    """The rim of a hole, if there is one, cut at its inner and outer ends into an upper and a lower half."""
    if loop is None:
        return None
    loop = np.roll(loop, -int(np.argmin(along[loop])))
    turn = int(np.argmax(along[loop]))
    halves = [loop[: turn + 1], np.append(loop[turn:], loop[0])]
    lower, upper = sorted(halves, key=lambda half: float(elevation[half].mean()))
    return upper[np.argsort(along[upper], kind="stable")], lower[np.argsort(along[lower], kind="stable")]


# --- the margins: coordinates are [outwards, up, forward] from the inner canthus, the outer one is at [1, 0, 0] ------


def _is_seen(rim: tuple[IntArray, IntArray], local: Array, lids: LidSections) -> bool:
    """True if the rim of a hole is the margin that is seen, and not an edge behind it."""
    seen = [(at, *gap) for at, _, gap in lids if RIM_MIDDLE[0] <= at <= RIM_MIDDLE[1]]
    at, low, high = np.array(seen).T
    upper, lower = (np.interp(at, *local[half, :2].T) for half in rim)
    return bool(max(np.abs(upper - high).max(), np.abs(lower - low).max()) < RIM_MISS)


def _margins(lids: LidSections, local: Array, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Vertices of the upper and of the lower margin, from the inner canthus outwards, on the triangles around it."""
    used, corners = np.unique(triangles, return_inverse=True)
    edges, _ = unique_edges(corners.reshape(-1, 3))
    upper, lower = (used[_along(_front_edge(lids, away), local[used], edges)] for away in (1.0, -1.0))
    return upper, lower


def _near(local: Array, triangles: IntArray) -> IntArray:
    """The triangles around an eye, near the middle between the canthi."""
    inside = np.asarray((np.abs(local - [0.5, 0.0, 0.0]) < [0.8, 2.0 * HEIGHTS[-1], 2.0]).all(axis=1))
    return triangles[inside[triangles[:, 0]] & inside[triangles[:, 1]] & inside[triangles[:, 2]]]


def _ball(eye: Eyeball, inner: Array, axes: Array, width: float) -> Array:
    """How far forward (meridians, heights) skin must lie to be seen before a ball that came with the face; -inf beside
    it, and before others.
    """
    aside, up, ahead = axes @ (eye.centre - inner) / width
    left = (eye.radius / width) ** 2 - (MERIDIANS[:, None] - aside) ** 2 - (HEIGHTS - up) ** 2
    front = ahead - (eye.radius - eye.core) / width + np.sqrt(np.maximum(left, 0.0))
    return np.where((left > 0.0) & eye.given, front, -np.inf)


def _lid_sections(corners: Array, ball: Array) -> LidSections:
    """The lids on all meridians where triangles (m, 3, 3) that are seen before a `ball` leave them open."""
    sections = [(float(meridian), _section(corners, meridian)) for meridian in MERIDIANS]
    gaps = [_gap(section, front) for (_, section), front in zip(sections, ball, strict=True)]
    return [(*lid, gap) for lid, gap in zip(sections, gaps, strict=True) if gap is not None]


def _section(corners: Array, meridian: float) -> Array:
    """Pieces (k, 2, 2) of the skin [up, forward], where triangles (m, 3, 3) cross a meridian."""
    beyond = corners[..., 0] > meridian
    triangle, side = np.nonzero(beyond != np.roll(beyond, -1, axis=1))  # two edges of a triangle or none
    a, b = corners[triangle, side], corners[triangle, (side + 1) % 3]
    share = ((meridian - a[:, 0]) / (b[:, 0] - a[:, 0]))[:, None]
    return np.asarray((a + share * (b - a))[:, 1:].reshape(-1, 2, 2))


def _gap(section: Array, ball: Array) -> tuple[float, float] | None:
    """Lowest and highest height of the widest gap in a section; None where the lids are closed.

    From the front, a gap shows no skin, or skin more than 0.08 behind the line between the canthi, such as a socket, or
    a `ball` before the skin.
    """
    start, end = section[:, 0], section[:, 1]
    rise = end[:, :1] - start[:, :1]
    t = (HEIGHTS - start[:, :1]) / np.where(rise == 0.0, 1.0, rise)
    depth = np.where((t >= 0.0) & (t <= 1.0), start[:, 1:] + t * (end[:, 1:] - start[:, 1:]), -np.inf)
    front = depth.max(axis=0, initial=-np.inf)
    front[front < ball] = -np.inf
    deep = front < -0.08
    steps = np.flatnonzero(np.diff(np.concatenate([[False], deep, [False]]).astype(np.int8)))
    first, last = steps[::2], steps[1::2]
    inside = (first > 0) & (last < len(HEIGHTS))
    if not inside.any():
        return None
    widest = np.argmax(np.where(inside, last - first, 0))
    gap = front[first[widest] : last[widest]]
    # Skin in a gap reaches far back, behind the middle of the ball (-0.84 to -0.62; that is at -0.2). Otherwise the eye
    # is one piece with the skin, as those of statues are, and nothing opens or closes. Two heights are no gap.
    if len(gap) <= 2 or gap.min() > -0.3:
        return None
    return float(HEIGHTS[first[widest] - 1]), float(HEIGHTS[last[widest]])


def _front_edge(lids: LidSections, away: float) -> Array:
    """Places (k, 3) where a lid turns from its front to its thickness; `away` from the opening is 1 (up) or -1.

    On a rounded edge many places qualify, by the slope between that of the lid's front and that of its thickness; those
    on the smoothest line are taken.
    """
    slopes, edges = np.linspace(0.4, 1.5, 12), []
    for at, section, gap in lids:
        places = section.reshape(-1, 2)
        beyond = away * (places[:, 0] - gap[int(away > 0.0)])
        lid = (beyond > -1.5 * (HEIGHTS[1] - HEIGHTS[0])) & (beyond < LID_THICKNESS)
        # Beyond the gap there may also be the lining of the socket, but it lies far behind.
        best = np.argmax(np.where(lid, places[:, 1] - slopes[:, None] * beyond, -np.inf), axis=1)
        edges.append(np.column_stack([np.full(len(best), at), places[best]]))
    return min(np.stack(edges, axis=1), key=lambda line: float((np.diff(line, 2, axis=0) ** 2).sum()))


def _along(places: Array, local: Array, edges: IntArray) -> IntArray:
    """Vertices of the path along edges of the mesh nearest to places in order, from the inner canthus outwards."""
    beyond = np.vstack([2.0 * places[0] - places[1], places, 2.0 * places[-1] - places[-2]])
    steps = np.linspace(0.0, len(beyond) - 1.0, 20 * len(beyond))
    curve = np.stack([np.interp(steps, np.arange(len(beyond)), column) for column in beyond.T], axis=1)
    away = cKDTree(curve).query(local)[0]
    length = np.linalg.norm(local[edges[:, 0]] - local[edges[:, 1]], axis=1)
    cost = length * (1.0 + (away[edges] ** 2).mean(axis=1) / 0.01**2) + 1e-12  # so far off, edges count twice
    graph = csr_array((cost, tuple(edges.T)), shape=(len(local), len(local)))
    first, last = (int(np.argmin(np.abs(local[:, 0] - end) + 2.0 * away)) for end in beyond[[0, -1], 0])
    before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)[1]
    path = [last]
    while path[-1] != first and before[path[-1]] >= 0:
        path.append(before[path[-1]])
    chain = np.array(path[::-1], dtype=np.int64)
    place = local[chain, 0]
    # At its ends the path may turn back from one edge of a thick lid to the other.
    return np.asarray(chain[place <= np.minimum.accumulate(place[::-1])[::-1]])


# --- the ball behind them -----------------------------------------------------------------------------------------


def place_eyeballs(
    landmarks: Mapping[str, Array],
    frame: FaceFrame,
    points: Array,
    triangles: IntArray,
    loops: Sequence[IntArray],
    estimated: Collection[str] = (),
    parts: Mapping[str, Part] | None = None,
) -> list[Eyeball]:
    """Return both eyeballs: those among the parts of the face, or else at the landmarks of their centres, as large as
    an adult's unless the lids leave less room.

    The shape of a face does not show the depth of an eye, but the lids lie on the ball: where a centre is `estimated`,
    or no ball of a usual size about it could touch the lids, it is moved to where an adult's does. An eye whose lids
    are closed is moved back behind the skin.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> eyes = place_eyeballs(face.landmarks, face.frame, face.points, face.triangles, face.boundary_loops)
    >>> [(eye.side, round(eye.radius)) for eye in eyes]
    [('l', 12), ('r', 12)]
    """
    eyes = []
    for side in "lr":
        name, radius = f"eye_{side}_centre", RADIUS * frame.pupil_distance
        eye = Eyeball(side, landmarks[name], radius, frame.axes[2], frame.axes[1])
        eye = given_eye(eye, (parts or {}).get(f"eye_{side}"))
        if eye.given:
            eyes.append(eye)
            continue
        opening = eyelid_opening(eye, points, triangles, loops, landmarks)
        if opening is None:
            eyes.append(_behind(eye, points))
            continue
        front = points[np.unique(np.concatenate([opening.upper, opening.lower]))]
        margin = opening.back_edges(points, triangles) if opening.thick else front
        smallest, largest = 0.75 * radius, 1.08 * radius  # that eyeballs are, by an adult's
        if name in estimated or not smallest < _room(eye.centre, margin) < largest:
            eye = replace(eye, centre=_fitted_centre(margin, eye))
        room = _room(eye.centre, margin)
        eyes.append(replace(eye, radius=float(np.clip(room, smallest, largest))))
    return eyes


def _room(centre: Array, margin: Array) -> float:
    """Radius of the ball about a centre for which the margins of the lids leave room."""
    return float(LID_ROOM * np.quantile(np.linalg.norm(margin - centre, axis=1), LID_QUANTILE))


def _fitted_centre(margin: Array, eye: Eyeball) -> Array:
    """Centre of the ball that fits the margins best, while weights hold it (Gauss-Newton)."""
    start = np.append(eye.centre, eye.radius / LID_ROOM)
    hold = np.zeros((4, 4))
    # They hold it at its place (up, aside, ahead) and at its size. The landmarks show its depth least.
    weights = np.array([0.5, 0.2, 0.1, 0.25])
    hold[:3, :3] = weights[:3, None] * np.stack([eye.up, np.cross(eye.up, eye.gaze), eye.gaze])
    hold[3, 3] = weights[3]
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
    before = (aside < 0.8 * eye.radius) & (ahead > -eye.radius)
    if not before.any():
        return eye
    reach = np.sqrt((eye.radius / LID_ROOM) ** 2 - aside[before] ** 2)
    return replace(eye, centre=eye.centre - max(float((reach - ahead[before]).max()), 0.0) * eye.gaze)
