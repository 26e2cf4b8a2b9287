"""Solids that the skin meets: eyeballs and the dental arches.

Every solid is a ball or half of an upright elliptic cylinder, so its distance is a convex function of the place, known
in closed form. What a point of the skin meets depends on nothing but where it is: the lower teeth go along with the
mandible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from ..anatomy.eyelid_opening import LID_ROOM
from ..anatomy.face import Face
from ..anatomy.muscles import JointWeights
from ..anatomy.teeth import BEHIND_TEETH, BELOW_LIPS, CROWN_BULGE, ELLIPSE, OVERBITE, OVERJET
from ..array_types import Array, IntArray
from ..geometry.topology import unique_edges
from . import _contact_kernels as kernels
from ._skin_kernels import add_turns
from .constraints import from_lips

SLACK = 0.02
"""Depth to which skin that touches a solid at rest may enter it before it is pushed, mm: so rest is an equilibrium."""

STIFFNESS, TEETH_STIFFNESS, EYE_STIFFNESS = 40.0, 100.0, 1000.0
"""Stiffness of contacts, and of those with teeth and eyeballs, per area, relative to the membrane stiffness of the
skin, 1/mm^2. The strongest muscle presses lips a hundredth of a millimetre deep; many together press them at the teeth,
and the plates of lids press harder.
"""

CUT = 0.05
"""Depth to which an edge between two vertices on a surface may cut it, mm."""

AROUND_EYE = 1.6
"""Skin nearer to the centre of an eye than this many radii can meet the eyeball."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of the skin, each with what it meets; mm.

    Attributes
    ----------
    corners : ndarray of int, shape (k, 3)
        Vertices of each sample.
    shares : ndarray, shape (k, 3)
        Its barycentric coordinates.
    allowed : ndarray, shape (k,)
        Distance from what it meets below which a sample is pushed off it.
    stiffness : ndarray, shape (k,)

    Examples
    --------
    Samples of the built-in head that the eyeballs keep away, each with weights that add up to 1:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> samples = eyeballs(face, np.ones(len(face.points)))
    >>> isinstance(samples, Samples), bool(np.allclose(samples.shares.sum(axis=1), 1.0))
    (True, True)
    """

    corners: IntArray
    shares: Array
    allowed: Array
    stiffness: Array

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return all samples of several.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face, each = fw.default_face(), np.ones(len(fw.default_face().points))
        >>> eyes = eyeballs(face, each)
        >>> len(Solids.joined([eyes, eyes]).allowed) == 2 * len(eyes.allowed)
        True
        """
        return cls(*(np.concatenate(column) for column in zip(*(vars(each).values() for each in parts), strict=True)))

    def gap(self, s: int, x: Array) -> float:
        """Return the distance of sample s from what it meets, for positions (n, 3)."""
        raise NotImplementedError

    def gaps(self, x: Array) -> Array:
        """Return the distances (k,) of all samples from what they meet, for positions (n, 3)."""
        return np.array([self.gap(s, x) for s in range(len(self.corners))])

    def pushed_within(self, x: Array, distance: float | Array) -> Self:
        """Return the same samples, which are pushed off from a distance on, or as far as their places (n, 3) at rest
        allow.
        """
        return replace(self, allowed=np.minimum(self.gaps(x) - SLACK, distance))


@dataclass(frozen=True, eq=False)
class Solids(Samples):
    """Samples of the skin, each with the solid that it meets, at rest; mm.

    Attributes
    ----------
    origins : ndarray, shape (k, 3)
        Centres of balls, or points on the axes of cylinders.
    axes : ndarray, shape (k, 3, 3)
        Directions in which cylinders have their half axes, and in which they end; unused for balls.
    halves : ndarray, shape (k, 2)
        Half axes; of balls, -1 and the radius.
    angles : ndarray, shape (k,)
        Turn of each solid with the mandible at full contraction, radians.

    Examples
    --------
    Skin around the eyes is pushed before it reaches the eyeballs:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> eyes = eyeballs(face, np.ones(len(face.points)))
    >>> round(float(eyes.allowed.max()), 2), bool((eyes.gaps(face.points) > eyes.allowed).all())
    (0.31, True)
    """

    origins: Array
    axes: Array
    halves: Array
    angles: Array

    def gap(self, s: int, x: Array) -> float:
        """See :meth:`Samples.gap`."""
        place = self.shares[s] @ x[self.corners[s]]
        return float(kernels.solid_gap(place, self.origins[s], self.axes[s], self.halves[s], np.empty(3)))

    def turned(self, joint: JointWeights | None, rate: float) -> tuple[Array, Array]:
        """Return `origins` and `axes` as a mandible places them at its contraction rate."""
        if joint is None or rate == 0.0:
            return self.origins, self.axes
        origins, axes, angles = self.origins.copy(), self.axes.copy(), rate * self.angles
        add_turns(origins, np.arange(len(origins)), joint.centre, joint.axis, angles, 1.0, origins)
        flat = axes.reshape(-1, 3)
        add_turns(flat, np.arange(len(flat)), np.zeros(3), joint.axis, np.repeat(angles, 3), 1.0, flat)
        return origins, axes


def eyeballs(face: Face, area: Array) -> Solids:
    """Return the contacts with the eyeballs: of vertices, and of the middles of edges, whose chords cut the balls most.

    Skin is pushed off as far as there is room at rest between the margins of the lids and the ball.
    """
    points = face.points * face.unit
    found = []
    for eye in face.eyes:
        centre, radius = eye.centre * face.unit, eye.radius * face.unit
        near = np.linalg.norm(points - centre, axis=1) < AROUND_EYE * radius
        room = (1.0 / LID_ROOM - 1.0) * radius
        corners, shares, stiffness = samples_of(face, near, area, radius)
        stiffness *= EYE_STIFFNESS / STIFFNESS
        found.append(_balls(face, corners, shares, stiffness, centre, np.array(radius), room))
    return Solids.joined(found) if found else _none()


def dental_arches(face: Face, area: Array, angle: float) -> Solids:
    """Return the contacts with the dental arches, half cylinders that end at the edges of the incisors: the upper one
    is part of the skull, the lower one goes with the mandible, which turns by `angle` at full contraction.
    """
    return Solids.joined([_arch(face, area, "upper", 0.0), _arch(face, area, "lower", angle)])


def _arch(face: Face, area: Array, jaw: str, angle: float) -> Solids:
    scale = face.frame.scale * face.unit
    half = scale * np.array(ELLIPSE[jaw])
    local, side = from_lips(face) * face.unit, 1.0 if jaw == "upper" else -1.0
    down, back = BELOW_LIPS, face.behind_lips
    if jaw == "lower":
        down, back = down - OVERBITE, back + OVERJET
    middle = np.array([0.0, -down * scale, -half[1] - back * scale])

    def before(places: Array) -> npt.NDArray[np.bool_]:
        flat = (places - middle)[:, [0, 2]]
        outside = half[1] * (np.hypot(*(flat / half).T) - 1.0) > -BEHIND_TEETH * scale
        close = (np.linalg.norm(places, axis=1) < 50.0 * scale) & (np.abs(places[:, 1]) < 25.0 * scale)
        return np.asarray(close & outside & (flat[:, 1] > 0.3 * half[1]))

    edges, _ = unique_edges(face.triangles)
    edges = edges[before(local[edges].mean(axis=1))]  # also of those that end in the lining of the mouth
    corners, shares, stiffness = samples_of(face, before(local), area, half[0] ** 2 / half[1], edges)
    stiffness *= TEETH_STIFFNESS / STIFFNESS
    k = len(corners)
    lips = (face.points * face.unit - local @ face.frame.axes)[0]
    axes = np.broadcast_to(face.frame.axes[[0, 2, 1]] * [[1.0], [1.0], [-side]], (k, 3, 3)).copy()
    origins = np.tile(lips + middle @ face.frame.axes, (k, 1))
    arches = Solids(corners, shares, np.zeros(k), stiffness, origins, axes, np.tile(half, (k, 1)), np.full(k, angle))
    return arches.pushed_within(face.points * face.unit, CROWN_BULGE * scale)


def samples_of(
    face: Face, near: npt.NDArray[np.bool_], area: Array, radius: float, edges: npt.NDArray[np.integer] | None = None
) -> tuple[IntArray, Array, Array]:
    """Return corners (k, 3), shares (k, 3) and stiffness (k,) of samples: the `near` vertices, and the middles of edges
    (m, 2) that are so long that they would cut a surface of a given radius, mm, by more than `CUT`. Default: of those
    between two near vertices.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> near = np.ones(len(face.points), bool)
    >>> corners, shares, _ = samples_of(face, near, np.ones(len(face.points)), radius=1e9)
    >>> len(corners) == len(face.points)
    True
    """
    vertices = np.flatnonzero(near)
    if edges is None:
        edges, _ = unique_edges(face.triangles)
        edges = edges[near[edges].all(axis=1)]
    edges = edges.astype(np.int64)
    ends = face.points[edges] * face.unit
    edges = edges[((ends[:, 1] - ends[:, 0]) ** 2).sum(axis=1) > 8.0 * radius * CUT]
    corners = np.concatenate([np.repeat(vertices[:, None], 3, axis=1), edges[:, [0, 1, 1]]])
    shares = np.concatenate([np.tile([1.0, 0, 0], (len(vertices), 1)), np.tile([0.5, 0.5, 0], (len(edges), 1))])
    return corners, shares, STIFFNESS * (shares * area[corners]).sum(axis=1)


def _balls(
    face: Face, corners: IntArray, shares: Array, stiffness: Array, centres: Array, radii: Array, room: float
) -> Solids:
    k = len(corners)
    halves = np.stack([np.full(k, -1.0), np.broadcast_to(radii, k)], axis=1)
    centres = np.broadcast_to(centres, (k, 3)).copy()
    balls = Solids(corners, shares, np.zeros(k), stiffness, centres, np.zeros((k, 3, 3)), halves, np.zeros(k))
    return balls.pushed_within(face.points * face.unit, room)


def _none() -> Solids:
    none = np.zeros(0)
    return Solids(
        np.zeros((0, 3), np.int64), np.zeros((0, 3)), none, none,
        np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 2)), none,
    )  # fmt: skip
