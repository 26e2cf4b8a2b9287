"""Contacts of the skin with itself: lip on lip, the flesh between skin and lining of a lip, and lid on lid.

A point of a lip and the triangle of the other lip straight below (or above) it at rest stay a pair: the point is kept
above the plane of its triangle, wherever both go. So the energy of this contact is a smooth function of the place of
the skin; which side is the right one never depends on the past, and lips that were flung through each other part
again. Samples beyond the border of the other lip take its nearest triangle. Where lips are rounded, the plane lies
outside them, so that lips that slide over each other do not enter. In the same way the lining of a lip cannot come out
through its skin, nor its skin through its lining.

Lids turn about the centre of the eye. So what a vertex of one lid meets is the edge of the other lid that is the
highest (or lowest) at its place along the lids at rest; the vertex is kept on its side of the plane through this edge
and the centre of the eye. These planes part the lids whatever their thickness; and their sides never change.
"""

from __future__ import annotations

import numpy as np

from ..anatomy import EyelidOpening, Face
from ..anatomy.eyelids import CORNER
from ..anatomy.teeth import OVERJET
from ..array_types import Array, BoolArray, IntArray
from ..geometry import BoxTree, triangle_normals
from ..geometry import closest as closest_triangle
from .constraints import from_lips
from .solids import EYE_STIFFNESS, STIFFNESS, Samples, of_vertices, samples_of

# --- lips -----------------------------------------------------------------------------------------


LIP_DISTANCE = 0.1
"""Lips that are farther apart at rest than this touch at this distance, mm."""


def facing_lips(face: Face, area: Array, share_of_jaw: Array) -> Samples:
    """Return the samples of each lip that face the other one.

    Parameters
    ----------
    face : Face
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.
    share_of_jaw : ndarray, shape (n,)
        Share of the mandible's turn that each vertex takes: the lower lip goes with it, the upper one does not.

    Examples
    --------
    No sample meets a triangle that it is part of:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> weights, share = face.joint_weights["jaw"], np.zeros(len(face.points))
    >>> share[weights.vertices] = weights.angles / weights.angles.max()
    >>> lips = facing_lips(face, np.ones(len(face.points)), share)
    >>> len(lips.allowed) > 100, bool((lips.corners[:, :, None] == lips.partners[:, None]).any())
    (True, False)
    """
    up = face.frame.axes[1]
    near, looks_up = around_mouth(face), face.normals @ up
    # At the corners of the mouth both lips take about half of the mandible's turn. There what looks up is of the lower.
    lower = share_of_jaw > 0.5 - 0.25 * looks_up
    away, found = 0.3, []  # skin that looks away by more cannot meet the other lip
    for own, other, side in ((~lower, lower, 1.0), (lower, ~lower, -1.0)):
        faces = near & own & (side * looks_up < away)
        surface = (near & other & (side * looks_up > -away))[face.triangles].all(axis=1)
        # Lips are as round as a ball of 5 mm.
        samples = samples_of(face, faces, STIFFNESS * area, radius=5.0, allowed=LIP_DISTANCE, middles=True)
        found.append(_faced(face, samples, face.triangles[surface].astype(np.int64), side))
    return Samples.joined(found)


def tied_lips(face: Face) -> IntArray:
    """Return pairs (k, 2) of vertices at which one lip touches the other.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> ends = face.points[tied_lips(face)]
    >>> len(ends) > 20, float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max()) < 2.0
    (True, True)
    """
    each = np.ones(len(face.points))
    lips = facing_lips(face, each, 0.5 * each)  # what looks up is the lower one
    one = (lips.corners == lips.corners[:, :1]).all(axis=1)
    own, other = lips.corners[one, 0], lips.partners[one]
    away = np.linalg.norm(face.points[other] - face.points[own][:, None], axis=2) * face.unit
    nearest = other[np.arange(len(own)), away.argmin(axis=1)]
    touch = away.min(axis=1) < 2.0  # mm
    return np.unique(np.sort(np.stack([own, nearest], axis=1)[touch], axis=1), axis=0)


def _faced(face: Face, samples: Samples, triangles: IntArray, side: float) -> Samples:
    """Return the samples that face one of some triangles (m, 3), each with the one that it reaches along the height."""
    points, up = face.points_mm, face.frame.axes[1]
    facing = triangle_normals(points, triangles)
    flat = side * (facing @ up) > 0.1  # lips do not meet with steeper ones
    triangles, facing = triangles[flat], facing[flat]
    both = points, face.normals
    places, normals = (np.einsum("kc,kci->ki", samples.shares, each[samples.corners]) for each in both)
    flat = squeezed(points, up)
    found, _, beside = BoxTree(flat, triangles).closest(squeezed(places, up))
    faced = np.flatnonzero(beside < 4.0)  # mm from straight above or below
    # The angle of normals does not tell what faces each other, as closed lips turn outwards along their front edge.
    faced = faced[(facing[found[faced]] @ up) * (normals[faced] @ up) < -0.3]
    corners, shares, _, allowed, stiffness = (column[faced] for column in samples)
    return Samples(corners, shares, triangles[found[faced]], allowed, stiffness)


def squeezed(points: Array, direction: Array) -> Array:
    """Return points (n, 3) of a space that is squeezed along a unit direction: what is the nearest there, is so beside
    the line along it, as ways along the line count as a thousandth of their length.

    Examples
    --------
    >>> squeezed(np.array([[1.0, 2.0, 5.0]]), np.array([0.0, 0.0, 1.0])).round(6).tolist()
    [[1.0, 2.0, 0.005]]
    """
    return np.asarray(points - 0.999 * np.outer(points @ direction, direction))


CLOSE_BY = 0.01
"""How far beside the direction in which a partner is looked for it may be to count as straight along, mm."""


def around_mouth(face: Face) -> BoolArray:
    """Return True (n,) for vertices of the lips and of their lining in front of the teeth of either jaw."""
    left, up, _ = face.frame.axes
    marks = face.landmarks
    reach = 0.55 * abs((marks["mouth_l"] - marks["mouth_r"]) @ left)
    thick = 0.75 * abs((marks["upper_lip_mid"] - marks["lower_lip_mid"]) @ up)
    side, height, depth = from_lips(face).T
    near = (np.abs(side) < reach) & (np.abs(height) < thick + 0.1 * face.frame.pupil_distance)
    return np.asarray(near & (depth > -(face.behind_lips + OVERJET) * face.frame.scale - (side / reach) ** 2 * reach))


THINNEST = 0.3
"""Lips resist as they are pressed to this share of their thickness at rest to the nearest skin, and to a third of it to
the skin that is the most straight across, which is farther.
"""


def behind_lips(face: Face, area: Array) -> Samples:
    """Return the vertices of the lips, each with two triangles on the other side of the flesh.

    A vertex of the lining is kept behind the plane of a triangle of the skin, and a vertex of the skin behind that of a
    triangle of the lining. One is the nearest, at the red of the lips often close by, around their edge; the other is
    the one that lies and faces the most straight across: lips that roll in would turn their flesh inside out there.

    Parameters
    ----------
    face : Face
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.

    Examples
    --------
    The lips of the built-in head may be pressed to a thickness of this at most, mm:

    >>> import facewrinkle as fw
    >>> flesh = behind_lips(fw.default_face(), np.ones(len(fw.default_face().points)))
    >>> round(float(flesh.allowed.max()), 1)
    3.9
    """
    points, near = face.points_mm, around_mouth(face)
    normals, triangles = face.normals, face.triangles[near[face.triangles].any(axis=1)]
    # Coordinate by coordinate, which is faster.
    facing, middles = (of.T.copy() for of in (triangle_normals(points, triangles), points[triangles].mean(axis=1)))
    vertices, reach = np.flatnonzero(near), 15.0 * face.frame.scale * face.unit  # of the thickest lips, mm
    closest, straight = np.full((2, len(vertices)), -1)
    for v, vertex in enumerate(vertices):
        way = middles - points[vertex][:, None]
        away = np.linalg.norm(way, axis=0)
        across, beside = (facing * way).sum(axis=0), normals[vertex] @ way
        # A triangle is the other side of the flesh if the way to it goes along its normal, and not along the vertex's.
        through = np.flatnonzero((away < reach) & (across > 0.5 * away) & (beside < 0.3 * away))
        if len(through):
            closest[v] = through[away[through].argmin()]
            straight[v] = through[((beside - across) / away)[through].argmin()]
    found = []
    for k, which, least, soft in (
        (closest, closest >= 0, THINNEST, 1.0),
        (straight, straight != closest, 0.1, 0.1),  # as stiff, lips that roll in would move by fits and starts
    ):
        k, own = k[which], vertices[which]
        thickness = (facing[:, k] * (middles[:, k] - points[own].T)).sum(axis=0)
        found.append(of_vertices(own, triangles[k][:, ::-1], least * thickness, soft * STIFFNESS * area))
    return Samples.joined(found)


def closing_forces(face: Face, area: Array) -> Array:
    """Return the forces (n, 3) of a pressure of 1 that presses each lip on what it faces straight below or above it.

    Parameters
    ----------
    face : Face
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.

    Examples
    --------
    Both lips are pressed equally, and nothing else is:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> forces = closing_forces(face, np.ones(len(face.points)))
    >>> bool(np.abs(forces.sum(axis=0)).max() < 1e-9), bool((forces @ face.frame.axes[1] != 0.0).sum() < 200)
    (True, True)
    """
    points, up, near = face.points_mm, face.frame.axes[1], around_mouth(face)
    looks_up, height, forces = face.normals @ up, points @ up, np.zeros_like(points)
    triangles = face.triangles[near[face.triangles].all(axis=1)]
    slopes, flat = triangle_normals(points, triangles) @ up, squeezed(points, up)
    for side in (1.0, -1.0):  # the upper lip looks down on triangles that look up, and the other way round
        facing = triangles[side * slopes > 1e-12]
        middles = side * height[facing].mean(axis=1)
        for vertex in np.flatnonzero(near & (side * looks_up < -0.2)):  # what looks more aside is not pressed
            others = facing[(middles < side * height[vertex]) & (facing != vertex).all(axis=1)]
            k, shares, beside = closest_triangle(flat, others, flat[vertex])
            if beside < CLOSE_BY:
                push = area[vertex] * side * up
                forces[vertex] -= push
                forces[others[k]] += shares[:, None] * push
    return forces


# --- lids -----------------------------------------------------------------------------------------


ALONG_LIDS = 0.5
"""Edges that run along the lids: by more than this share of their length."""


def facing_lids(face: Face, area: Array) -> Samples:
    """Return the vertices of each lid that can meet the other one, with an edge of it and the centre of the eye.

    The centres of the eyes are numbered as vertices that follow those of the face, in the order of `face.eyes`.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> lids = facing_lids(face, np.ones(len(face.points)))
    >>> len(lids.allowed) > 50, np.unique(lids.partners[lids.partners >= len(face.points)]) - len(face.points)
    (True, array([0, 1]))
    """
    edges = face.edges.astype(np.int64)
    found = [of_vertices(np.empty(0, np.int64), np.empty((0, 3), np.int64), 0.0, area)]
    for k, eye in enumerate(face.eyes):
        opening = face.eyelid_openings.get(eye.side)
        if opening is not None:
            found += [_facing_lid(face, opening, edges, area, upper, len(face.points) + k) for upper in (True, False)]
    return Samples.joined(found)


def lid_ridges(face: Face) -> IntArray:
    """Return the edges (k, 2) along which lids meet: those that reach farthest towards the other lid.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> len(lid_ridges(fw.default_face())) > 30
    True
    """
    edges = face.edges.astype(np.int64)
    found = [np.empty((0, 2), np.int64)]
    for opening in face.eyelid_openings.values():
        lids = _Lids(face, opening, edges)
        for upper in (True, False):
            ends = lids.edges(upper)
            everywhere = np.linspace(-0.1, 1.1, 481)  # along the lids
            highest = _highest(everywhere, lids.along[ends], lids.inwards(upper)[ends])
            found.append(ends[np.unique(highest[highest >= 0])])
    return np.concatenate(found)


class _Lids:
    """The skin of the lids of an eye that can meet: places `along` them (n,) and `elevation` (n,) of all vertices."""

    def __init__(self, face: Face, opening: EyelidOpening, edges: IntArray) -> None:
        points, eye = face.points, opening.eye
        self.along, self.elevation, self.distance = opening.polar(points)
        self._points, self._outwards = points, opening.axes[0]
        lines = opening.lines(self.along)
        # Skin farther from the eye, or than 20 degrees from the margin of its lid, does not reach the other one.
        near = (self.distance < 1.3 * eye.radius) & ((points - eye.centre) @ eye.gaze > 0.0)
        near &= (np.abs(self.along - 0.5) < 0.5 + CORNER) & (self.distance >= eye.core)
        self._upper = self.elevation > 0.5 * (lines[0] + lines[1])
        self._near = near & (np.abs(self.elevation - np.where(self._upper, *lines)) < np.deg2rad(20.0))
        self._edges = edges[self._near[edges].all(axis=1)]

    def of(self, upper: bool) -> BoolArray:
        """Return True (n,) for the vertices of one lid."""
        return np.asarray(self._near & (self._upper == upper))

    def inwards(self, upper: bool) -> Array:
        """Return how far (n,) skin of one lid reaches towards the other, radians."""
        return -self.elevation if upper else self.elevation

    def edges(self, upper: bool) -> IntArray:
        """Return the edges (e, 2) of one lid that run along it, from the inner canthus outwards."""
        ends = self._edges[self.of(upper)[self._edges].all(axis=1)]
        ends = np.where((self.along[ends[:, 0]] < self.along[ends[:, 1]])[:, None], ends, ends[:, ::-1])
        run = self._points[ends[:, 1]] - self._points[ends[:, 0]]
        return np.asarray(ends[run @ self._outwards > ALONG_LIDS * np.linalg.norm(run, axis=1)])

    def met(self, vertices: IntArray, ends: IntArray, upper: bool, half: float, left_out: BoolArray) -> IntArray:
        """Return what vertices (k,) meet of the edges (e, 2) of the other lid, the upper one or not.

        Each row (p, 3) is a vertex and the ends of a chord along the lid, which reaches by `half` to both sides. Edges
        that are `left_out` (k, e) are not met.
        """
        along, heights = self.along, self.inwards(upper)
        here, left, right = (
            _highest(along[vertices] + aside, along[ends], heights[ends], left_out) for aside in (0.0, -half, half)
        )
        found = np.flatnonzero(here >= 0)
        left, right = (np.where(there < 0, here, there)[found] for there in (left, right))
        return np.column_stack([vertices[found], ends[left, 0], ends[right, 1]])


def _facing_lid(face: Face, opening: EyelidOpening, edges: IntArray, area: Array, upper: bool, centre: int) -> Samples:
    """The vertices of one lid, and the edges of the other; `centre` is the number of the centre of the eye.

    Each vertex meets the edge that reaches the farthest towards it, and that of those as far from the eye as it is.
    """
    lids = _Lids(face, opening, edges)
    vertices, ends = np.flatnonzero(lids.of(upper)), lids.edges(not upper)
    # Edges are as far from an eye as a vertex is up to this share of its radius: lids with a thickness tilt as they
    # shut, and what reached the farthest at rest falls behind.
    far = np.abs(lids.distance[vertices, None] - lids.distance[ends].mean(axis=1)) > 0.03 * opening.eye.radius
    # The edges reach at least as far to both sides, in widths of the eye: short ones turn with every fold of a mesh,
    # and long ones cut off what bulges in the corners of shut eyes, so both are met.
    wide, narrow = 0.05, 0.02
    kinds = [(wide, np.zeros_like(far)), (narrow, np.zeros_like(far)), (narrow, far)]
    pairs = [lids.met(vertices, ends, not upper, *kind) for kind in kinds]
    met = np.unique(np.concatenate(pairs), axis=0)
    start, end = (face.points[met[:, k]] - opening.eye.centre for k in (1, 2))
    longest = np.linalg.norm(start, axis=1) * np.linalg.norm(end - start, axis=1)
    facing = np.cross(start, end) @ opening.axes[1] / longest
    parting = np.abs(facing) > ALONG_LIDS  # planes of others turn with the least motion of their ends
    (vertices, *ends), turned = met[parting].T, (facing[parting] > 0.0) != upper
    triangles = np.column_stack([*ends, np.full(len(turned), centre)])
    triangles[turned] = triangles[turned][:, [1, 0, 2]]
    return of_vertices(vertices, triangles, 0.1, EYE_STIFFNESS * area)  # a chink too narrow to see, mm


def _highest(places: Array, along: Array, heights: Array, left_out: BoolArray | None = None) -> IntArray:
    """Return the numbers (k,) of the edges that are the highest at places (k,) along the lids; -1 where none reaches.

    Edges have the places `along` (e, 2) and `heights` (e, 2) of their ends. Those `left_out` (k, e) do not count.
    """
    if not len(along):
        return np.full(len(places), -1)
    share = (places[:, None] - along[:, 0]) / (along[:, 1] - along[:, 0])
    height = heights[:, 0] + share * (heights[:, 1] - heights[:, 0])
    there = np.where((share >= 0.0) & (share <= 1.0), height, -np.inf)
    if left_out is not None:
        there[left_out] = -np.inf
    return np.where(np.isfinite(there.max(axis=1)), there.argmax(axis=1), -1)
