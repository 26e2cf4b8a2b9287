"""Contacts of the skin with eyeballs, the other lip and the teeth.

Each contact is an energy that is zero until two surfaces meet, and grows with the depth to which one has entered the
other. The skin's steps minimise it together with all other energies. So lids press on the eyes, and lips on each other
and on the teeth, in a balance of forces that does not depend on the time step and creates no energy.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy.eye_placement import LID_ROOM
from ..anatomy.face import Face
from ..anatomy.landmarks import lips_middle
from ..anatomy.teeth import BEHIND_LIPS, ELLIPSE
from ..geometry.normals import vertex_normals
from . import _skin_kernels as kernels
from .constraints import from_lips

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

CONTACT_STIFFNESS = 2.5
"""Stiffness of the contact of a vertex, relative to the resistance of the skin when that vertex alone is moved."""

TEETH_STIFFNESS = 8.0
"""Stiffness of the contact with the teeth per area, relative to the membrane stiffness of the skin, 1/mm^2."""

LIP_DISTANCE = 0.1
"""Lips that are farther apart at rest than this touch at this distance, mm."""

LIP_LINE, AROUND_LIPS = 4.0, 6.0
"""Depth of the line where the lips meet behind their red, and reach of the lips' tethers around this line, mm."""

SLACK = 0.05
"""Depth to which skin that touches at rest may enter before it is pushed, mm: so rest is an equilibrium."""


@dataclass(frozen=True, eq=False)
class Ball:
    """An eyeball, mm.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
        Vertices around the eyeball.
    centre : ndarray, shape (3,)
    radii : ndarray, shape (k,)
        Distance from the centre below which a vertex is pushed out.
    least : ndarray, shape (k,)
        Distance from the centre below which no vertex may be at the end of a step.
    weight : ndarray, shape (k,)
        Stiffness of the contact.

    Examples
    --------
    Skin around the left eye is pushed before it reaches the eyeball; mm:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> each = np.ones(len(face.points))
    >>> left, right = Contacts(face, each, each).balls
    >>> round(float(left.radii.max()), 2), round(face.eyes[0].radius, 2)
    (12.25, 11.94)
    """

    vertices: IntArray
    centre: Array
    radii: Array
    least: Array
    weight: Array


@dataclass(frozen=True, eq=False)
class LipPairs:
    """Vertices of one lip, and the points of the other lip that lie straight above or below.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
    corners : ndarray of int, shape (k, 3)
        The triangle that a vertex faces.
    shares : ndarray, shape (k, 3)
        Barycentric coordinates of the point in it.
    away : ndarray, shape (k, 3)
        Unit direction in which the vertex parts from the point.
    gap, allowed : ndarray, shape (k,)
        Distance of vertex and point at rest, and that below which they are pushed apart, mm.
    weight : ndarray, shape (k,)
        Stiffness of the contact.

    Examples
    --------
    The distances between the lips of the built-in face, and the least of them, mm:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> each = np.ones(len(face.points))
    >>> pairs = Contacts(face, each, each).lips
    >>> facing = np.einsum("kc,kci->ki", pairs.shares, face.points[pairs.corners])
    >>> apart = ((face.points[pairs.vertices] - facing) * pairs.away).sum(axis=1)
    >>> bool(np.allclose(apart, pairs.gap)), round(float(pairs.gap.min()), 1)
    (True, 0.1)
    """

    vertices: IntArray
    corners: npt.NDArray[np.int32]
    shares: Array
    away: Array
    gap: Array
    allowed: Array
    weight: Array


@dataclass(frozen=True, eq=False)
class DentalWall:
    """The outer border of the dental arches, an upright elliptic cylinder; mm.

    Attributes
    ----------
    vertices : ndarray of int, shape (k,)
        Vertices in front of it.
    axes : ndarray, shape (2, 3)
        The subject's left, and forward.
    local : ndarray, shape (k, 2)
        Rest positions along the axes from the cylinder's middle.
    half : ndarray, shape (2,)
        Half axes of the ellipse.
    allowed : ndarray, shape (k,)
        Radius, relative to the ellipse, below which a vertex is pushed out.
    weight : ndarray, shape (k,)
        Stiffness of the contact.

    Examples
    --------
    Half the width and the depth of the arches; the lips of a face at rest lie in front of them:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> each = np.ones(len(face.points))
    >>> wall = Contacts(face, each, each).teeth
    >>> wall.half.round(), bool((np.hypot(*(wall.local / wall.half).T) >= wall.allowed).all())
    (array([29., 47.]), True)
    """

    vertices: IntArray
    axes: Array
    local: Array
    half: Array
    allowed: Array
    weight: Array


class Contacts:
    """All contacts of a face; lengths in mm.

    Parameters
    ----------
    face : Face
    resistance : ndarray, shape (n,)
        Force per mm with which the skin resists when one vertex alone is moved.
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.

    Attributes
    ----------
    balls : list of Ball
    lips : LipPairs
    teeth : DentalWall

    Examples
    --------
    At rest nothing has entered anything; skin that is pushed back by 2 mm meets eyes and teeth:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> still = np.zeros_like(face.points)
    >>> contacts = Contacts(face, resistance=np.ones(len(still)), area=np.ones(len(still)))
    >>> contacts.energy(still, still, np.zeros_like(still))
    0.0
    >>> gradient = np.zeros_like(still)
    >>> contacts.energy(still - [0, 0, 2], still, gradient) > 0.0, bool(gradient[:, 2].sum() < 0.0)
    (True, True)
    """

    def __init__(self, face: Face, resistance: Array, area: Array) -> None:
        weight = CONTACT_STIFFNESS * resistance
        self._points, self._area = face.points * face.unit, area
        self.balls = [_ball(self._points, weight, eye.centre * face.unit, eye.radius * face.unit) for eye in face.eyes]
        self.lips = _lip_pairs(face, self._points, weight)
        self.teeth = _dental_wall(face, TEETH_STIFFNESS * area)

    def energy(self, u: Array, shift: Array, gradient: Array) -> float:
        """Return the energy at displacements `u` where joints have moved the anchors by `shift`; add its gradient."""
        energy = 0.0
        for b in self.balls:
            energy += kernels.eyeball(u, self._points, b.vertices, b.centre, b.radii, b.weight, gradient)
        p, t = self.lips, self.teeth
        energy += kernels.lip_pairs(u, p.vertices, p.corners, p.shares, p.away, p.gap, p.allowed, p.weight, gradient)
        energy += kernels.dental_wall(u, shift, t.vertices, t.local, t.axes, t.half, t.allowed, t.weight, gradient)
        return float(energy)

    def closing(self) -> Array:
        """Return the forces (n, 3) of a pressure of 1 that presses the lips on each other."""
        p, forces = self.lips, np.zeros_like(self._points)
        push = self._area[p.vertices, None] * p.away
        np.subtract.at(forces, p.vertices, push)
        np.add.at(forces, p.corners, p.shares[:, :, None] * push[:, None])
        return forces

    def keep_off_eyes(self, u: Array) -> None:
        """Push vertices out that a step which did not converge has left deep in an eyeball."""
        for ball in self.balls:
            kernels.keep_off_eye(u, self._points, ball.vertices, ball.centre, ball.least)


def lip_tethers(face: Face) -> tuple[Array, Array]:
    """Return the share (n,) in which each vertex is part of the lips, and the unit directions (n, 3) of the tethers.

    Tethers point along the normals of the tissue; near the lips, where these point every way as lips fold over, they
    turn to point straight off the dental arch.
    """
    scale, axes = face.frame.scale, face.frame.axes
    middle = lips_middle(face.landmarks) - LIP_LINE * scale * axes[2]
    square = np.full(len(face.points), np.inf)
    for corner in (face.landmarks["mouth_l"], face.landmarks["mouth_r"]):
        line, offset = corner - middle, face.points - middle
        along = np.clip(offset @ line / (line @ line), 0.0, 1.0)
        square = np.minimum(square, ((offset - along[:, None] * line) ** 2).sum(axis=1))
    near = np.exp(-square / (AROUND_LIPS * scale) ** 2)
    half = scale * np.array(ELLIPSE["upper"])
    local = from_lips(face) + np.array([0.0, 0.0, half[1] + BEHIND_LIPS * scale])
    off = np.stack([local[:, 0] / half[0] ** 2, np.zeros(len(local)), local[:, 2] / half[1] ** 2], axis=1)
    off /= np.maximum(np.linalg.norm(off, axis=1, keepdims=True), 1e-12)
    out = face.tissue.normals + near[:, None] * (off @ axes - face.tissue.normals)
    return near, np.asarray(out / np.linalg.norm(out, axis=1, keepdims=True))


def _ball(points: Array, weight: Array, centre: Array, radius: float) -> Ball:
    """Return the contact with an eyeball, with room for the chords between the vertices where there is room at rest."""
    distance = np.sqrt(((points - centre) ** 2).sum(axis=1))
    near = np.flatnonzero(distance < 2.0 * radius)
    radii = np.minimum(distance[near] - SLACK, radius / LID_ROOM)
    return Ball(near, centre, radii, np.minimum(radii - SLACK, radius), weight[near])


def _dental_wall(face: Face, weight: Array) -> DentalWall:
    scale = face.frame.scale * face.unit
    half = scale * np.array(ELLIPSE["upper"])
    local = from_lips(face) * face.unit
    close = (np.linalg.norm(local, axis=1) < 50.0 * scale) & (np.abs(local[:, 1]) < 25.0 * scale)
    local = local[:, [0, 2]] + [0.0, half[1] + BEHIND_LIPS * scale]
    vertices = np.flatnonzero(close & (local[:, 1] > 0.3 * half[1]))
    # Vertices that are behind the wall at rest are not pushed out of it.
    radius = np.hypot(*(local[vertices] / half).T) - SLACK / half[1]
    axes = np.ascontiguousarray(face.frame.axes[[0, 2]])
    return DentalWall(vertices, axes, local[vertices].copy(), half, np.minimum(radius, 1.0), weight[vertices])


def _lip_pairs(face: Face, points: Array, weight: Array) -> LipPairs:
    """Return vertices and triangles that face each other across the line between the lips, straight up and down."""
    left, up, _ = face.frame.axes
    size = face.frame.pupil_distance * face.unit
    marks = {name: point * face.unit for name, point in face.landmarks.items()}
    reach = 0.55 * abs((marks["mouth_l"] - marks["mouth_r"]) @ left)
    thick = 0.75 * abs((marks["upper_lip_mid"] - marks["lower_lip_mid"]) @ up)
    local = from_lips(face) * face.unit
    near = np.all(np.abs(local) < np.array([reach, thick + 0.1 * size, 0.4 * size]), axis=1)
    facing = vertex_normals(points, face.triangles) @ up
    inside = np.flatnonzero(near[face.triangles].all(axis=1))
    triangles = face.triangles[inside]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    slope = np.cross(b - a, c - a) @ up
    found = []
    for sign in (1.0, -1.0):  # the upper lip looks down on triangles that look up, and the other way round
        own = np.flatnonzero(near & (sign * facing < -0.2))
        other = triangles[sign * slope > 1e-12]
        found.append(_seen(local, own, other, sign, 0.25 * size))
    vertices, corners, shares, gap, signs = (np.concatenate(parts) for parts in zip(*found, strict=True))
    allowed = np.minimum(gap - SLACK, LIP_DISTANCE)
    return LipPairs(vertices, corners.astype(np.int32), shares, signs[:, None] * up, gap, allowed, weight[vertices])


def _seen(
    local: Array, own: IntArray, triangles: npt.NDArray[np.int32], sign: float, far: float
) -> tuple[npt.NDArray[Any], ...]:
    """Return, for each vertex of `own` that sees one, the nearest of the triangles straight below (sign 1) or above it.

    The result is vertices, corners, barycentric coordinates, distances and signs; `local` is [left, up, forward].
    """
    flat = local[:, [0, 2]]
    i, k = _candidates(flat, own, triangles)
    a, b, c = (flat[triangles[k, side]] - flat[i] for side in range(3))
    parts = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
    total = parts.sum(axis=1)
    shares = parts / np.where(total == 0.0, 1.0, total)[:, None]
    gaps = sign * (local[i, 1] - (shares * local[triangles[k], 1]).sum(axis=1))
    over = (shares.min(axis=1) >= 0.0) & (total != 0.0) & (gaps >= 0.0) & (gaps < far)
    over = np.flatnonzero(over & ~(triangles[k] == i[:, None]).any(axis=1))
    over = over[np.lexsort((k[over], gaps[over], i[over]))]
    over = over[np.unique(i[over], return_index=True)[1]]
    corners = triangles[k[over]].astype(np.int64)
    return i[over], corners, shares[over], gaps[over], np.full(len(over), sign)


def _candidates(flat: Array, own: IntArray, triangles: npt.NDArray[np.int32]) -> tuple[IntArray, IntArray]:
    """Return pairs (p,) of vertices and triangles that are no farther apart than the triangle reaches from its centre.

    Triangles are searched by size, so that a few large ones do not make all reach far.
    """
    corners = flat[triangles]
    centres = corners.mean(axis=1)
    reach = (1.0 + 1e-9) * np.sqrt(((corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1, initial=0.0))
    pairs = [(np.empty(0, np.int64), np.empty(0, np.int64))]
    octave = np.frexp(reach)[1]
    for size in np.unique(octave):
        similar = np.flatnonzero(octave == size)
        found = cKDTree(centres[similar]).query_ball_point(flat[own], reach[similar].max()) if len(own) else []
        pairs.append(
            (np.repeat(own, [len(f) for f in found]), similar[np.fromiter(chain.from_iterable(found), np.int64)])
        )
    vertices, hits = (np.concatenate(column) for column in zip(*pairs, strict=True))
    return vertices, hits


def _cross(p: Array, q: Array) -> Array:
    return np.asarray(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
