"""The skin of the lids that can meet the other lid of the same eye, and what of it they meet.

Lids turn about the centre of the eye. So what a vertex of one lid meets is the edge of the other lid that is the
highest (or lowest) at its place along the lids at rest; the vertex is kept on its side of the plane through this edge
and the centre of the eye. These planes part the lids whatever their thickness; and their sides never change.
"""

from __future__ import annotations

import numpy as np

from ..anatomy.eyelid_opening import EyelidOpening
from ..anatomy.eyelids import CORNER
from ..anatomy.face import Face
from ..array_types import Array, BoolArray, IntArray
from ..geometry.topology import unique_edges
from .solids import EYE_STIFFNESS, Samples, of_vertices

LID_SHELL = 1.3
"""Skin farther from the centre of an eye than this many radii does not reach the other lid."""

FROM_MARGIN = np.deg2rad(20.0)
"""Nor does skin farther than this from the margin of its lid, as seen from the centre of the eye."""

HALVES = 0.05, 0.02
"""The edges that a vertex meets reach at least as far to both sides, in widths of the eye: short ones turn with every
fold of a mesh, and long ones cut off what bulges in the corners of shut eyes, so both are met.
"""

LAYER = 0.03
"""Edges are as far from an eye as a vertex is if they are so up to this share of its radius: lids with a thickness tilt
as they shut, and what reached the farthest at rest falls behind.
"""

LID_DISTANCE = 0.1
"""Lids that are farther apart at rest touch at this distance, mm: a chink too narrow to see."""

ALL_ALONG = np.linspace(-0.1, 1.1, 481)
"""Places along the lids at which the edges are looked for that reach the farthest towards the other lid."""

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
    edges = unique_edges(face.triangles)[0].astype(np.int64)
    found = [of_vertices(np.empty(0, np.int64), np.empty((0, 3), np.int64), 0.0, area)]
    for k, eye in enumerate(face.eyes):
        opening = face.eyelid_openings.get(eye.side)
        if opening is not None:
            found += [_facing(face, opening, edges, area, upper, len(face.points) + k) for upper in (True, False)]
    return Samples.joined(found)


def lid_ridges(face: Face) -> IntArray:
    """Return the edges (k, 2) along which lids meet: those that reach farthest towards the other lid.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> len(lid_ridges(fw.default_face())) > 30
    True
    """
    edges = unique_edges(face.triangles)[0].astype(np.int64)
    found = [np.empty((0, 2), np.int64)]
    for opening in face.eyelid_openings.values():
        lids = _Lids(face, opening, edges)
        for upper in (True, False):
            ends = lids.edges(upper)
            highest = _highest(ALL_ALONG, lids.along[ends], lids.inwards(upper)[ends])
            found.append(ends[np.unique(highest[highest >= 0])])
    return np.concatenate(found)


class _Lids:
    """The skin of the lids of an eye that can meet: places `along` them (n,) and `elevation` (n,) of all vertices."""

    def __init__(self, face: Face, opening: EyelidOpening, edges: IntArray) -> None:
        points, eye = face.points, opening.eye
        self.along, self.elevation, self.distance = opening.polar(points)
        self._points, self._edges, self._outwards = points, edges, opening.axes[0]
        lines = opening.lines(self.along)
        near = (self.distance < LID_SHELL * eye.radius) & ((points - eye.centre) @ eye.gaze > 0.0)
        near &= np.abs(self.along - 0.5) < 0.5 + CORNER
        self._upper = self.elevation > 0.5 * (lines[0] + lines[1])
        self._near = near & (np.abs(self.elevation - np.where(self._upper, *lines)) < FROM_MARGIN)

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


def _facing(face: Face, opening: EyelidOpening, edges: IntArray, area: Array, upper: bool, centre: int) -> Samples:
    """The vertices of one lid, and the edges of the other; `centre` is the number of the centre of the eye.

    Each vertex meets the edge that reaches the farthest towards it, and that of those as far from the eye as it is.
    """
    lids = _Lids(face, opening, edges)
    vertices, ends = np.flatnonzero(lids.of(upper)), lids.edges(not upper)
    far = np.abs(lids.distance[vertices, None] - lids.distance[ends].mean(axis=1)) > LAYER * opening.eye.radius
    kinds = [(half, np.zeros_like(far)) for half in HALVES] + [(min(HALVES), far)]
    pairs = [lids.met(vertices, ends, not upper, *kind) for kind in kinds]
    met = np.unique(np.concatenate(pairs), axis=0)
    vertices, ends = met[:, 0], met[:, 1:]
    triangles = np.column_stack([ends, np.full(len(ends), centre)])
    places = np.vstack([face.points * face.unit, *(each.centre[None] * face.unit for each in face.eyes)])
    middle = np.cross(places[ends[:, 1]] - places[ends[:, 0]], places[centre] - places[ends[:, 0]])
    turned = (middle @ opening.axes[1] > 0.0) != upper
    triangles[turned] = triangles[turned][:, [1, 0, 2]]
    return of_vertices(vertices, triangles, LID_DISTANCE, EYE_STIFFNESS * area)


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
