"""The skin of the lids that can meet the other lid of the same eye, and what of it they meet.

Lids turn about the centre of the eye. So what a vertex of one lid meets is the edge of the other lid that is the
highest (or lowest) at its place along the lids at rest; the vertex is kept on its side of the plane through this edge
and the centre of the eye. These planes part the lids whatever their thickness; and their sides never change.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..anatomy.eyelid_opening import EyelidOpening
from ..anatomy.eyelids import CORNER
from ..anatomy.face import Face
from ..geometry.topology import unique_edges
from .lip_surfaces import FacingSkin, facing_none, joined
from .solids import EYE_STIFFNESS, SLACK

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

LID_SHELL = 1.3
"""Skin farther from the centre of an eye than this many radii does not reach the other lid."""

FROM_MARGIN = np.deg2rad(20.0)
"""Nor does skin farther than this from the margin of its lid, as seen from the centre of the eye."""

HALF = 0.05
"""The edge that a vertex meets reaches at least as far to both sides, in widths of the eye: short ones would turn with
every fold of a fine mesh.
"""

ALONG_LIDS = 0.5
"""Edges that run along the lids: by more than this share of their length."""


def facing_lids(face: Face, area: Array) -> FacingSkin:
    """Return the vertices of each lid that can meet the other one, with an edge of it and the centre of the eye.

    The centres of the eyes are numbered as vertices that follow those of the face, in the order of `face.eyes`.

    Examples
    --------
    The lids of the built-in head are open at rest:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> lids = facing_lids(face, np.ones(len(face.points)))
    >>> centres = [eye.centre for eye in face.eyes]
    >>> gaps = lids.gaps(np.vstack([face.points, centres]))
    >>> len(gaps) > 50, bool((gaps > lids.allowed).all()), bool(gaps.max() > 10.0)
    (True, True, True)
    """
    edges = unique_edges(face.triangles)[0].astype(np.int64)
    found = [facing_none()]
    for k, eye in enumerate(face.eyes):
        opening = face.eyelid_openings.get(eye.side)
        if opening is not None:
            found += [_facing(face, opening, edges, area, upper, len(face.points) + k) for upper in (True, False)]
    return joined(found)


def _facing(face: Face, opening: EyelidOpening, edges: IntArray, area: Array, upper: bool, centre: int) -> FacingSkin:
    """The vertices of one lid, and the edges of the other; `centre` is the number of the centre of the eye."""
    points, eye = face.points, opening.eye
    along, elevation, distance = opening.polar(points)
    lines = opening.lines(along)
    near = (distance < LID_SHELL * eye.radius) & ((points - eye.centre) @ eye.gaze > 0.0)
    near &= np.abs(along - 0.5) < 0.5 + CORNER
    is_upper = elevation > 0.5 * (lines[0] + lines[1])
    near &= np.abs(elevation - np.where(is_upper, *lines)) < FROM_MARGIN
    vertices = np.flatnonzero(near & (is_upper == upper))
    ends = edges[(near & (is_upper != upper))[edges].all(axis=1)]
    ends = np.where((along[ends[:, 0]] < along[ends[:, 1]])[:, None], ends, ends[:, ::-1])
    run = points[ends[:, 1]] - points[ends[:, 0]]
    ends = ends[run @ opening.axes[0] > ALONG_LIDS * np.linalg.norm(run, axis=1)]
    outwards = elevation if upper else -elevation
    here, left, right = (_highest(along[vertices] + aside, along[ends], outwards[ends]) for aside in (0.0, -HALF, HALF))
    met = np.flatnonzero(here >= 0)
    left, right = (np.where(there < 0, here, there)[met] for there in (left, right))
    vertices, ends = vertices[met], np.column_stack([ends[left, 0], ends[right, 1]])
    triangles = np.column_stack([ends, np.full(len(ends), centre)])
    corners, shares = np.repeat(vertices[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (len(vertices), 1))
    places = np.vstack([points * face.unit, *(each.centre[None] * face.unit for each in face.eyes)])
    middle = np.cross(places[ends[:, 1]] - places[ends[:, 0]], places[centre] - places[ends[:, 0]])
    turned = (middle @ opening.axes[1] > 0.0) != upper
    triangles[turned] = triangles[turned][:, [1, 0, 2]]
    triangles = np.ascontiguousarray(triangles)
    skin = FacingSkin(corners, shares, triangles, np.zeros(len(corners)), EYE_STIFFNESS * area[vertices])
    return skin.touching_from(np.minimum(skin.gaps(places) - SLACK, 0.0))


def _highest(places: Array, along: Array, heights: Array) -> IntArray:
    """Return the numbers of the edges that are the highest at places (k,) along the lids; -1 where none reaches.

    Edges have the places `along` (e, 2) and `heights` (e, 2) of their ends.
    """
    if not len(along):
        return np.full(len(places), -1)
    share = (places[:, None] - along[:, 0]) / (along[:, 1] - along[:, 0])
    height = heights[:, 0] + share * (heights[:, 1] - heights[:, 0])
    there = np.where((share >= 0.0) & (share <= 1.0), height, -np.inf)
    return np.where(np.isfinite(there.max(axis=1)), there.argmax(axis=1), -1)
