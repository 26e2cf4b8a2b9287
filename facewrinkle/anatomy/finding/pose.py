"""Poses of a face: its place, direction, size and proportions on a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...array_types import Array
from ...geometry.rigid_alignment import closest_rotations
from ..landmarks import NAMES
from .template import UNMEASURED, template

# Given landmarks tell no pose if either holds. Lengths are in distances between the pupils.
COLLINEAR = 0.2
"""They scatter less than this to the sides of a line: the turn about the line stays unknown."""
MISFIT = 0.45
"""One lies farther than this from its place on the template fitted to them: they are swapped, or not of a face."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Place, direction and size of a face: local = (point - origin) @ axes.T / (size * stretch).

    Local coordinates are in distances between the pupils.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
        Rows are the subject's left, up and forward.
    origin : ndarray, shape (3,)
        The middle between the eyes.
    size : float
        Distance between the pupils.
    stretch : ndarray, shape (3,)
        Size of the face along the axes over that of the template, apart from `size`.

    Examples
    --------
    A face 60 mm from pupil to pupil, and a place half of this below and in front of its eyes:

    >>> pose = Pose(np.eye(3), origin=np.array([0.0, 100, 0]), size=60.0, stretch=np.ones(3))
    >>> pose.world(np.array([[0.0, -0.5, 0.5]]))
    array([[ 0., 70., 30.]])
    >>> pose.local(np.array([[0.0, 70, 30]]))
    array([[ 0. , -0.5,  0.5]])
    """

    axes: Array
    origin: Array
    size: float
    stretch: Array

    def local(self, points: Array) -> Array:
        """Return points (n, 3), or one (3,), in the template's coordinates."""
        axes = self.axes / (self.size * self.stretch)[:, None]
        return np.asarray((points - self.origin) @ axes.T)

    def world(self, local: Array) -> Array:
        """Return points (n, 3), given in the template's coordinates, in those of the mesh."""
        return local * (self.size * self.stretch) @ self.axes + self.origin


def pose_from_landmarks(landmarks: Mapping[str, Array]) -> Pose | None:
    """Return the pose in which the template's landmarks are closest to given ones.

    None if fewer than three are given that can be measured, if they lie on a line, or if they do not fit a face.

    Examples
    --------
    >>> marks = template().landmarks
    >>> pose = pose_from_landmarks({name: 7.0 * marks[name] + 1.0 for name in ("nasion", "mouth_l", "mouth_r")})
    >>> round(pose.size, 6), np.allclose(pose.origin, 1.0)
    (7.0, True)
    """
    names = [name for name in NAMES if name in landmarks and name not in UNMEASURED]
    if len(names) < 3:
        return None
    model, face = (np.array([source[name] for name in names]) for source in (template().landmarks, landmarks))
    from_, to = model - model.mean(axis=0), face - face.mean(axis=0)
    if np.linalg.svd(from_, compute_uv=False)[1] < COLLINEAR:
        return None
    axes = closest_rotations(from_.T @ to)
    size = float((from_ @ axes * to).sum() / (from_**2).sum())
    if size <= 0.0 or np.linalg.norm(to / size - from_ @ axes, axis=1).max() > MISFIT:
        return None
    return Pose(axes, face.mean(axis=0) - size * model.mean(axis=0) @ axes, size, np.ones(3))
