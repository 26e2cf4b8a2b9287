"""The lips: the points that can meet the other lip, the flesh between skin and lining, and the pressure of muscles.

A point of a lip and the triangle of the other lip straight below (or above) it at rest stay a pair: the point is kept
above the plane of its triangle, wherever both go. So the energy of this contact is a smooth function of the place of
the skin; which side is the right one never depends on the past, and lips that were flung through each other part
again. Samples beyond the border of the other lip take its nearest triangle. Where lips are rounded, the plane lies
outside them, so that lips that slide over each other do not enter. In the same way the lining of a lip cannot come out
through its skin, nor its skin through its lining.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..anatomy.teeth import OVERJET
from ..array_types import Array, BoolArray, IntArray
from ..geometry.normals import vertex_normals
from ..geometry.topology import pairs_of
from .constraints import from_lips
from .solids import STIFFNESS, Samples, of_vertices, samples_of

LIP_DISTANCE = 0.1
"""Lips that are farther apart at rest than this touch at this distance, mm."""

LIP_ROUNDING = 5.0
"""Radius to which lips are rounded, mm."""

AT_CORNERS = 0.25
"""At the corners of the mouth both lips take about half of the mandible's turn. There what looks up is of the lower
one, even if it takes this share less.
"""

FACES_AWAY = 0.3
"""Skin belongs to the surface of a lip that can meet the other unless it looks away from it by more than this share."""

STEEPEST = 0.1
"""Cosine of the slope of triangles that are steeper than what lips meet with."""

FACING = -0.3
"""Cosine between the normals of a sample and a triangle below which they face each other."""

BEYOND = 4.0
"""Samples no farther than this from straight above (or below) the other lip face its nearest triangle, mm."""


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
    points, up = face.points * face.unit, face.frame.axes[1]
    near, looks_up = around_mouth(face), vertex_normals(points, face.triangles) @ up
    lower = share_of_jaw > 0.5 - AT_CORNERS * looks_up
    found = []
    for own, other, side in ((~lower, lower, 1.0), (lower, ~lower, -1.0)):
        faces = near & own & (side * looks_up < FACES_AWAY)
        surface = (near & other & (side * looks_up > -FACES_AWAY))[face.triangles].all(axis=1)
        samples = samples_of(face, faces, STIFFNESS * area, LIP_ROUNDING)
        which, partners = _faced(face, *samples[:2], face.triangles[surface].astype(np.int64), side)
        corners, shares, _, _, stiffness = (column[which] for column in samples)
        found.append(Samples(corners, shares, partners, np.full(len(which), LIP_DISTANCE), stiffness))
    return Samples.joined(found)


def _faced(face: Face, corners: IntArray, shares: Array, triangles: IntArray, side: float) -> tuple[IntArray, IntArray]:
    """Return the samples (p,) that face one of some triangles, and the nearest one's corners (p, 3)."""
    points = face.points * face.unit
    normals, local = vertex_normals(points, face.triangles), points @ face.frame.axes.T
    a, b, c = (points[triangles[:, k]] for k in range(3))
    facing = np.cross(b - a, c - a)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-12)
    flat = side * (facing @ face.frame.axes[1]) > STEEPEST
    triangles, facing = triangles[flat], facing[flat]
    samples, of_samples = (np.einsum("kc,kci->ki", shares, each[corners]) for each in (local, normals))
    i, k, _, gaps = columns(samples, local, triangles, side)
    faced = np.flatnonzero((of_samples[i] * facing[k]).sum(axis=1) < FACING)
    faced = faced[nearest(i[faced], gaps[faced], k[faced])]
    i, k = i[faced], k[faced]
    if len(triangles):
        beyond = np.setdiff1d(np.arange(len(samples)), i)
        away, closest = aside(samples[beyond], local, triangles)
        near = (away < BEYOND) & ((of_samples[beyond] * facing[closest]).sum(axis=1) < FACING)
        i, k = np.concatenate([i, beyond[near]]), np.concatenate([k, closest[near]])
    return i, np.ascontiguousarray(triangles[k])


def columns(
    samples: Array, local: Array, triangles: npt.NDArray[np.integer], side: float
) -> tuple[IntArray, IntArray, Array, Array]:
    """Return all pairs of samples and triangles that are straight above (side 1) or below each other.

    Parameters
    ----------
    samples : ndarray, shape (k, 3)
        Places as [left, up, forward], mm.
    local : ndarray, shape (n, 3)
        Vertices of the triangles, likewise.
    triangles : ndarray of int, shape (m, 3)
    side : float
        1 or -1.

    Returns
    -------
    samples, triangles : ndarray of int, shape (p,)
    shares : ndarray, shape (p, 3)
        Barycentric coordinates of the point of the triangle.
    gaps : ndarray, shape (p,)
        Its distance from the sample, negative on the other side.

    Examples
    --------
    >>> triangle = np.array([[0.0, 0, 0], [3, 0, 0], [0, 0, 3]])
    >>> sample, _, shares, gaps = columns(np.array([[1.0, 2, 1], [5, 2, 1]]), triangle, np.array([[0, 1, 2]]), 1.0)
    >>> sample.tolist(), shares.round(3).tolist(), gaps.tolist()
    ([0], [[0.333, 0.333, 0.333]], [2.0])
    """
    flat, places = local[:, [0, 2]], samples[:, [0, 2]]
    i, k = _candidates(places, flat, triangles)
    a, b, c = (flat[triangles[k, corner]] - places[i] for corner in range(3))
    parts = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
    total = parts.sum(axis=1)
    shares = parts / np.where(total == 0.0, 1.0, total)[:, None]
    gaps = side * (samples[i, 1] - (shares * local[triangles[k], 1]).sum(axis=1))
    over = np.flatnonzero((shares.min(axis=1, initial=np.inf) >= 0.0) & (total != 0.0))
    return i[over], k[over], shares[over], gaps[over]


def aside(samples: Array, local: Array, triangles: npt.NDArray[np.integer]) -> tuple[Array, IntArray]:
    """Return the horizontal distances (k,) of samples from the nearest of some triangles, and its number (k,).

    Parameters
    ----------
    samples : ndarray, shape (k, 3)
        Places as [left, up, forward], mm.
    local : ndarray, shape (n, 3)
        Vertices of the triangles, likewise.
    triangles : ndarray of int, shape (m, 3)
        At least one. Samples lie above or below none of them.

    Examples
    --------
    >>> triangle = np.array([[0.0, 0, 0], [3, 0, 0], [0, 0, 3]])
    >>> distance, which = aside(np.array([[-2.0, 7, 1]]), triangle, np.array([[0, 1, 2]]))
    >>> distance.tolist(), which.tolist()
    ([2.0], [0])
    """
    flat, places = local[:, [0, 2]], samples[:, None, [0, 2]]
    square = np.full((len(samples), len(triangles)), np.inf)
    for corner in range(3):
        start, end = flat[triangles[:, corner]], flat[triangles[:, corner - 2]]
        line = end - start
        long = np.maximum((line**2).sum(axis=1), 1e-300)
        share = np.clip(((places - start) * line).sum(axis=2) / long, 0.0, 1.0)
        square = np.minimum(square, ((places - start - share[:, :, None] * line) ** 2).sum(axis=2))
    closest = square.argmin(axis=1)
    return np.sqrt(square[np.arange(len(samples)), closest]), closest


def nearest(samples: IntArray, gaps: Array, triangles: IntArray) -> IntArray:
    """Return the index of the pair with the least gap for each sample; of equal ones, that with the first triangle.

    Examples
    --------
    >>> nearest(np.array([4, 4, 7]), np.array([2.0, 1.0, 3.0]), np.array([0, 1, 0])).tolist()
    [1, 2]
    """
    order = np.lexsort((triangles, gaps, samples))
    return np.asarray(order[np.unique(samples[order], return_index=True)[1]])


def around_mouth(face: Face) -> BoolArray:
    """Return True (n,) for vertices of the lips and of their lining in front of the teeth of either jaw."""
    left, up, _ = face.frame.axes
    marks = face.landmarks
    reach = 0.55 * abs((marks["mouth_l"] - marks["mouth_r"]) @ left)
    thick = 0.75 * abs((marks["upper_lip_mid"] - marks["lower_lip_mid"]) @ up)
    side, height, depth = from_lips(face).T
    near = (np.abs(side) < reach) & (np.abs(height) < thick + 0.1 * face.frame.pupil_distance)
    return np.asarray(near & (depth > -(face.behind_lips + OVERJET) * face.frame.scale - (side / reach) ** 2 * reach))


def _candidates(places: Array, flat: Array, triangles: npt.NDArray[np.integer]) -> tuple[IntArray, IntArray]:
    """Return pairs (p,) of places (k, 2) and triangles that are no farther apart than the triangle reaches from its
    centre.

    Triangles are searched by size, so that a few large ones do not make all reach far.
    """
    corners = flat[triangles]
    centres = corners.mean(axis=1)
    reach = (1.0 + 1e-9) * np.sqrt(((corners - centres[:, None]) ** 2).sum(axis=2).max(axis=1, initial=0.0))
    pairs = [(np.empty(0, np.int64), np.empty(0, np.int64))]
    octave = np.frexp(reach)[1]
    for size in np.unique(octave):
        similar = np.flatnonzero(octave == size)
        found = cKDTree(centres[similar]).query_ball_point(places, reach[similar].max()) if len(places) else []
        owner, hit = pairs_of(found)
        pairs.append((owner, similar[hit]))
    those, hits = (np.concatenate(column) for column in zip(*pairs, strict=True))
    return those, hits


def _cross(p: Array, q: Array) -> Array:
    return np.asarray(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])


THICKEST = 15.0
"""Skin and lining that are farther apart at rest than this do not feel each other, on a face of average size, mm."""

THINNEST, THINNEST_STRAIGHT = 0.3, 0.1
"""Lips resist as they are pressed to the first share of their thickness at rest to the nearest skin, and to the second
one to the skin that is the most straight across, which is farther.
"""

SOFT = 0.1
"""Stiffness against the second one, relative to that against the nearest: as stiff as it, lips that roll in would move
by fits and starts.
"""

STRAIGHT, BESIDE = 0.5, 0.3
"""Cosine of the angle between the normal of a triangle and the way to it, above which it is the other side of the
flesh; and cosine between the normal of the vertex and this way below which the way leads through the flesh.
"""

AT_ONCE = 512
"""Vertices for which the other side is looked for at once."""


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
    3.7
    """
    points, near = face.points * face.unit, around_mouth(face)
    vertices, triangles = np.flatnonzero(near), face.triangles.astype(np.int64)
    normals = vertex_normals(points, face.triangles)[vertices]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    facing = np.cross(b - a, c - a)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-12)
    found, reach = [], THICKEST * face.frame.scale * face.unit
    closest, straight = _opposite(points[vertices], normals, (a + b + c) / 3.0, facing, reach)
    for k, which, least, soft in (
        (closest, closest >= 0, THINNEST, 1.0),
        (straight, straight != closest, THINNEST_STRAIGHT, SOFT),
    ):
        k, own = k[which], vertices[which]
        thickness = (facing[k] * (a[k] - points[own])).sum(axis=1)
        found.append(of_vertices(own, triangles[k][:, ::-1], least * thickness, soft * STIFFNESS * area))
    return Samples.joined(found)


def _opposite(places: Array, normals: Array, middles: Array, facing: Array, reach: float) -> tuple[IntArray, IntArray]:
    """Return the numbers (k,) of the nearest triangle through the flesh from each place, and of the one that is the
    most straight across; -1 for none.
    """
    out = np.full((2, len(places)), -1)
    tree = cKDTree(middles)
    for first in range(0, len(places), AT_ONCE):
        found = tree.query_ball_point(places[first : first + AT_ONCE], reach)
        i, k = pairs_of(found)
        i += first
        offset = middles[k] - places[i]
        away = np.linalg.norm(offset, axis=1)
        across, beside = (facing[k] * offset).sum(axis=1), (normals[i] * offset).sum(axis=1)
        through = np.flatnonzero((across > STRAIGHT * away) & (beside < BESIDE * away))
        i, k, away = i[through], k[through], away[through]
        for kind, least in enumerate((away, (beside - across)[through] / away)):
            order = nearest(i, least, k)
            out[kind, i[order]] = k[order]
    return out[0], out[1]


def closing_forces(face: Face, area: Array) -> Array:
    """Return the forces (n, 3) of a pressure of 1 that presses each lip on what it faces of the other at rest.

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
    vertices, corners, shares, signs = _facing(face)
    forces = np.zeros_like(face.points)
    push = (area[vertices] * signs)[:, None] * face.frame.axes[1]
    np.subtract.at(forces, vertices, push)
    np.add.at(forces, corners, shares[:, :, None] * push[:, None])
    return forces


def _facing(face: Face) -> tuple[IntArray, IntArray, Array, Array]:
    """Return vertices of one lip, and the points of the other straight below (sign 1) or above (sign -1) each of them:
    corners (k, 3) and barycentric coordinates (k, 3).
    """
    points = face.points * face.unit
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
    vertices, corners, shares, _, signs = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return vertices, corners, shares, signs


def _seen(
    local: Array, own: IntArray, triangles: npt.NDArray[np.int32], sign: float, far: float
) -> tuple[npt.NDArray[Any], ...]:
    """Return, for each vertex of `own` that sees one, the nearest of the triangles straight below (sign 1) or above it.

    The result is vertices, corners, barycentric coordinates, distances and signs; `local` is [left, up, forward].
    """
    i, k, shares, gaps = columns(local[own], local, triangles, sign)
    over = np.flatnonzero((gaps >= 0.0) & (gaps < far) & ~(triangles[k] == own[i][:, None]).any(axis=1))
    over = over[nearest(i[over], gaps[over], k[over])]
    corners = triangles[k[over]].astype(np.int64)
    return own[i[over]], corners, shares[over], gaps[over], np.full(len(over), sign)
