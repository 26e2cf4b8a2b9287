"""The surfaces of the lips that can meet each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..anatomy.face import Face
from ..anatomy.teeth import BEHIND_LIPS
from ..geometry.normals import vertex_normals
from . import _contact_kernels as kernels
from .constraints import from_lips
from .solids import SLACK, samples_of

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
Near = tuple[IntArray, IntArray, Array]
"""Triangles near each sample, as offsets and indices, and its gap; inf where there is none."""

LIP_DISTANCE = 0.1
"""Lips that are farther apart at rest than this touch at this distance, mm."""

LIP_ROUNDING = 5.0
"""Radius to which lips are rounded, mm."""

FACES_AWAY = 0.3
"""Skin belongs to the surface of a lip that can meet the other unless it looks away from it by more than this share."""


FACING = -0.5
"""Sum of the cosines between a sample's normal and those of a triangle's corners below which they face each other."""


@dataclass(frozen=True, eq=False)
class LipSurfaces:
    """Samples of one lip and the surface of the other; mm.

    Attributes
    ----------
    corners : ndarray of int, shape (k, 3)
        Vertices of each sample.
    shares : ndarray, shape (k, 3)
        Its barycentric coordinates.
    triangles : ndarray of int, shape (m, 3)
        Surface of the other lip, counter-clockwise seen from outside.
    open_edges : ndarray of int, shape (m,)
        A bit for each side of a triangle at which the surface ends: 1, 2, 4.
    facing : ndarray of bool, shape (k, m)
        True where a sample and a triangle face each other at rest: only through such can a sample enter.
    allowed : ndarray, shape (k,)
        Distance below which samples are pushed off the surface.
    stiffness : ndarray, shape (k,)
    vertices : ndarray of int
        All vertices of samples and surface.
    """

    corners: IntArray
    shares: Array
    triangles: IntArray
    open_edges: IntArray
    facing: BoolArray
    allowed: Array
    stiffness: Array

    @cached_property
    def vertices(self) -> IntArray:
        return np.unique(np.concatenate([self.corners.ravel(), self.triangles.ravel()]))

    def near(self, x: Array, reach: float) -> Near:
        """Return the triangles within `reach` of each sample, for positions (n, 3), and the gaps (k,) there."""
        least = x[self.triangles, 0].min(axis=1, initial=np.inf)
        order = np.argsort(least, kind="stable")
        return kernels.near_triangles(
            x, self.corners, self.shares, self.triangles, self.open_edges, self.facing, order, least[order], reach
        )

    def gaps(self, x: Array, near: Near) -> Array:
        """Return the signed distances (k,) of samples from the surface; inf where they are far from it."""
        return np.asarray(
            kernels.lip_gaps(x, self.corners, self.shares, self.triangles, self.open_edges, self.facing, near[:2])
        )


def lip_surfaces(face: Face, area: Array, share_of_jaw: Array) -> list[LipSurfaces]:
    """Return the samples of the upper lip with the surface of the lower one, and the other way round.

    Parameters
    ----------
    face : Face
    area : ndarray, shape (n,)
        Area of the skin around each vertex, mm^2.
    share_of_jaw : ndarray, shape (n,)
        Share of the mandible's turn that each vertex takes: the lower lip goes with it, the upper one does not.

    Examples
    --------
    At rest the lips of the built-in head touch nowhere:

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> weights, share = face.joint_weights["jaw"], np.zeros(len(face.points))
    >>> share[weights.vertices] = weights.angles / weights.angles.max()
    >>> for lip in lip_surfaces(face, np.ones(len(face.points)), share):
    ...     print(bool((lip.gaps(face.points, lip.near(face.points, 3.0)) > lip.allowed).all()))
    True
    True
    """
    points, up = face.points * face.unit, face.frame.axes[1]
    near, lower = _around_mouth(face), share_of_jaw > 0.5
    looks_up = vertex_normals(points, face.triangles) @ up
    found = []
    for own, other, sign in ((~lower, lower, 1.0), (lower, ~lower, -1.0)):
        samples = near & own & (sign * looks_up < FACES_AWAY)
        triangles = face.triangles[(near & other & (sign * looks_up > -FACES_AWAY))[face.triangles].all(axis=1)]
        if samples.any() and len(triangles):
            found.append(_surfaces(face, samples, triangles.astype(np.int64), area, points))
    return found


def _around_mouth(face: Face) -> BoolArray:
    """True (n,) for vertices of the lips and of their lining in front of the teeth."""
    left, up, _ = face.frame.axes
    marks = face.landmarks
    reach = 0.55 * abs((marks["mouth_l"] - marks["mouth_r"]) @ left)
    thick = 0.75 * abs((marks["upper_lip_mid"] - marks["lower_lip_mid"]) @ up)
    side, height, depth = from_lips(face).T
    near = (np.abs(side) < reach) & (np.abs(height) < thick + 0.1 * face.frame.pupil_distance)
    return np.asarray(near & (depth > -BEHIND_LIPS * face.frame.scale - (side / reach) ** 2 * reach))


def _surfaces(face: Face, samples: BoolArray, triangles: IntArray, area: Array, points: Array) -> LipSurfaces:
    """The samples of one lip and the surface of the other."""
    corners, shares, stiffness = samples_of(face, samples, area, LIP_ROUNDING)
    normals = vertex_normals(points, face.triangles)
    of_samples = np.einsum("kc,kci->ki", shares, normals[corners])
    facing = of_samples @ normals[triangles].sum(axis=1).T < FACING
    out = LipSurfaces(corners, shares, triangles, _open_edges(triangles), facing, np.zeros(len(corners)), stiffness)
    gaps = out.gaps(points, out.near(points, 2.0 * LIP_DISTANCE))
    return replace(out, allowed=np.minimum(gaps - SLACK, LIP_DISTANCE))


def _open_edges(triangles: IntArray) -> IntArray:
    """Bits (m,) for the sides of triangles that no other triangle shares."""
    sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, inverse, counts = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    return np.asarray((counts[inverse.ravel()].reshape(-1, 3) == 1) @ np.array([1, 2, 4]))
