"""Samples of the skin, and the solids that they meet: eyeballs and the dental arches.

Every solid is a ball or half of an upright elliptic cylinder, so its distance is a convex function of the place, known
in closed form. What a point of the skin meets depends on nothing but where it is: the lower teeth go along with the
mandible.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..anatomy import Face, JointWeights
from ..anatomy.eyelid_opening import LID_ROOM
from ..anatomy.teeth import BEHIND_TEETH, CROWN_BULGE, ELLIPSE, place_of
from ..array_types import Array, BoolArray, IntArray
from ._skin_kernels import add_turns
from .constraints import from_lips

SLACK = 0.02
"""Depth to which skin that touches a solid at rest may enter it before it is pushed, mm: so rest is an equilibrium."""

STIFFNESS, TEETH_STIFFNESS, EYE_STIFFNESS = 40.0, 100.0, 1000.0
"""Stiffness of contacts, and of those with teeth and eyeballs, per area, relative to the membrane stiffness of the
skin, 1/mm^2. The strongest muscle presses lips a hundredth of a millimeter deep; many together press them at the teeth,
and the plates of lids press harder.
"""


class Samples(NamedTuple):
    """Samples of the skin, each with the triangle or the solid that it meets; mm.

    Attributes
    ----------
    corners : ndarray of int, shape (k, 3)
        Vertices of each sample.
    shares : ndarray, shape (k, 3)
        Its barycentric coordinates.
    partners : ndarray of int, shape (k, 3)
        Corners of the triangle that it meets, counter-clockwise seen from its own side. Numbers beyond the vertices are
        points that stay. For the solid number s, three times -1 - s.
    allowed : ndarray, shape (k,)
        Distance from what it meets below which a sample is pushed off it.
    stiffness : ndarray, shape (k,)

    Examples
    --------
    Samples of the built-in head that eyes and teeth keep away, each with weights that add up to 1:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> _, samples = met_solids(face, np.ones(len(face.points)))
    >>> isinstance(samples, Samples), bool(np.allclose(samples.shares.sum(axis=1), 1.0))
    (True, True)
    """

    corners: IntArray
    shares: Array
    partners: IntArray
    allowed: Array
    stiffness: Array

    @classmethod
    def joined(cls, parts: Iterable[Samples]) -> Samples:
        """Return all samples of several.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> _, samples = met_solids(face, np.ones(len(face.points)))
        >>> len(Samples.joined([samples, samples]).allowed) == 2 * len(samples.allowed)
        True
        """
        return cls(*(np.concatenate(column) for column in zip(*parts, strict=True)))


class Solids(NamedTuple):
    """Balls and half cylinders, at rest; mm.

    Attributes
    ----------
    origins : ndarray, shape (s, 3)
        Centres of balls, or points on the axes of cylinders.
    axes : ndarray, shape (s, 3, 3)
        Directions in which cylinders have their half axes, and in which they end; unused for balls.
    halves : ndarray, shape (s, 2)
        Half axes; of balls, -1 and the radius.
    angles : ndarray, shape (s,)
        Turn of each solid with the mandible at full contraction, radians.

    Examples
    --------
    Two eyeballs, and the dental arches:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> solids, _ = met_solids(face, np.ones(len(face.points)))
    >>> (solids.halves[:, 0] < 0.0).tolist()
    [True, True, False, False]
    """

    origins: Array
    axes: Array
    halves: Array
    angles: Array

    def turned(self, joint: JointWeights | None, rate: float) -> Solids:
        """Return the solids as a mandible places them at its contraction rate."""
        if joint is None or rate == 0.0:
            return self
        origins, axes, angles = self.origins.copy(), self.axes.copy(), rate * self.angles
        add_turns(origins, np.arange(len(origins)), joint.centre, joint.axis, angles, 1.0, origins)
        flat = axes.reshape(-1, 3)
        add_turns(flat, np.arange(len(flat)), np.zeros(3), joint.axis, np.repeat(angles, 3), 1.0, flat)
        return Solids(origins, axes, self.halves, self.angles)


def met_solids(face: Face, area: Array, angle: float = 0.0) -> tuple[Solids, Samples]:
    """Return the eyeballs and the dental arches, and the samples that meet them.

    Eyeballs push off skin as far as there is room at rest between the margins of the lids and the ball, but not the
    lining of sockets behind their middle that is no farther off, which nobody sees; the middles of edges are samples,
    too, as chords cut the balls most. The dental arches are half cylinders that end at the edges of the incisors: the
    upper one is part of the skull, the lower one goes with the mandible. A mouth that does not open has none.

    Parameters
    ----------
    face : Face
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.
    angle : float
        Turn of the mandible at full contraction, radians.

    Examples
    --------
    Skin is pushed before it reaches the eyeballs:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> _, samples = met_solids(face, np.ones(len(face.points)))
    >>> round(float(samples.allowed.max()), 2)
    0.31
    """
    points = face.points_mm
    solids: list[tuple[Array, Array, Array, float]] = []
    found: list[Samples] = []
    for eye in face.eyes:
        centre, radius = eye.centre * face.unit, eye.radius * face.unit
        offset, room = points - centre, (1.0 / LID_ROOM - 1.0) * radius
        away = np.linalg.norm(offset, axis=1)
        lining = (offset @ eye.gaze < 0.0) & (away < radius + room)
        near = (away < 1.6 * radius) & ~lining  # skin farther away cannot meet it
        found.append(samples_of(face, near, EYE_STIFFNESS * area, radius, -1 - len(solids), room))
        solids.append((centre, np.zeros((3, 3)), np.array([-1.0, radius]), 0.0))
    for jaw, own in (("upper", 0.0), ("lower", angle)) if face.mouth_opens else ():
        origin, axes, half, near, edges = _arch(face, jaw)
        bulge = CROWN_BULGE * face.frame.scale * face.unit
        radius = half[0] ** 2 / half[1]
        found.append(samples_of(face, near, TEETH_STIFFNESS * area, radius, -1 - len(solids), bulge, edges))
        solids.append((origin, axes, half, own))
    return Solids(*(np.array(column) for column in zip(*solids, strict=True))), Samples.joined(found)


def _arch(face: Face, jaw: str) -> tuple[Array, Array, Array, BoolArray, IntArray]:
    """Return the origin (3,), axes (3, 3) and half axes (2,) of a dental arch, True (n,) for vertices in front of it,
    and the edges (m, 2) there, also those that end in the lining of the mouth.
    """
    scale = face.frame.scale * face.unit
    half = scale * np.array(ELLIPSE[jaw])
    local, side = from_lips(face) * face.unit, 1.0 if jaw == "upper" else -1.0
    down, back = place_of(jaw, face.behind_lips)
    middle = np.array([0.0, -down * scale, -half[1] - back * scale])

    def before(places: Array) -> BoolArray:
        flat = (places - middle)[:, [0, 2]]
        outside = half[1] * (np.hypot(*(flat / half).T) - 1.0) > -BEHIND_TEETH * scale
        close = (np.linalg.norm(places, axis=1) < 50.0 * scale) & (np.abs(places[:, 1]) < 25.0 * scale)
        return np.asarray(close & outside & (flat[:, 1] > 0.3 * half[1]))

    edges = face.edges
    lips = (face.points_mm - local @ face.frame.axes)[0]
    axes = face.frame.axes[[0, 2, 1]] * [[1.0], [1.0], [-side]]
    return lips + middle @ face.frame.axes, axes, half, before(local), edges[before(local[edges].mean(axis=1))]


def samples_of(
    face: Face,
    near: BoolArray,
    stiffness: Array,
    radius: float,
    partner: int = 0,
    allowed: float = 0.0,
    edges: IntArray | None = None,
    middles: bool = False,
) -> Samples:
    """Return samples: the `near` vertices, and the middles of edges that are so long that they would cut a surface of a
    given radius by more than 0.05 mm.

    Parameters
    ----------
    face : Face
    near : ndarray of bool, shape (n,)
    stiffness : ndarray, shape (n,)
        Of the skin around each vertex.
    radius : float
    partner : int
        Three times that is what all meet; see :class:`Samples`.
    allowed : float
        See :class:`Samples`.
    edges : ndarray of int, shape (m, 2), optional
        Default: those between two near vertices.
    middles : bool
        Add the middles of triangles that would still cut the surface with those of their edges on it.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> near = np.ones(len(face.points), bool)
    >>> samples = samples_of(face, near, np.ones(len(face.points)), radius=1e9)
    >>> len(samples.corners) == len(face.points)
    True
    """
    vertices = np.flatnonzero(near)
    if edges is None:
        edges = face.edges
        edges = edges[near[edges].all(axis=1)]
    edges = edges.astype(np.int64)
    ends = face.points[edges] * face.unit
    cut = radius * 0.05
    # An edge whose length has the square e cuts a sphere by e / 8 r; the middle of a triangle with the middles of its
    # edges on the sphere, by the sum of its three e / 72 r.
    edges = edges[((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1) > 8.0 * cut]
    triangles = face.triangles[near[face.triangles].all(axis=1) & middles].astype(np.int64)
    ends = face.points[triangles] * face.unit
    squares = ((ends - np.roll(ends, 1, axis=1)) ** 2).sum(axis=(1, 2))
    triangles = triangles[squares > 72.0 * cut]
    corners = np.concatenate([np.repeat(vertices[:, None], 3, axis=1), edges[:, [0, 1, 1]], triangles])
    which = np.repeat([0, 1, 2], [len(vertices), len(edges), len(triangles)])
    shares = np.array([[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [1 / 3, 1 / 3, 1 / 3]])[which]
    own, met = (shares * stiffness[corners]).sum(axis=1), np.full_like(corners, partner)
    return Samples(corners, shares, met, np.full(len(corners), allowed), own)


def of_vertices(vertices: IntArray, partners: IntArray, allowed: float | Array, stiffness: Array) -> Samples:
    """Return samples at vertices (k,), which meet the triangles `partners` (k, 3), given the stiffness (n,) of all.

    Examples
    --------
    >>> of_vertices(np.array([7]), np.array([[1, 2, 3]]), 0.5, np.ones(9)).corners
    array([[7, 7, 7]])
    """
    corners, shares = np.repeat(vertices[:, None], 3, axis=1), np.tile([1.0, 0.0, 0.0], (len(vertices), 1))
    return Samples(corners, shares, partners, np.broadcast_to(allowed, len(vertices)), stiffness[vertices])
