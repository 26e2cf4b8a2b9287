"""Eyeballs: spheres in their sockets, and the turns of their gaze."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ..array_types import Array
from ..checks import vector
from ..errors import ParameterError, check_range
from .landmarks import MEAN_PUPIL_DISTANCE

RADIUS = 12.0 / MEAN_PUPIL_DISTANCE
"""Radius of an adult's eyeball, in distances between the pupils."""


@dataclass(frozen=True, eq=False)
class Eyeball:
    """A sphere in its socket, in the unit of the mesh.

    Attributes
    ----------
    side : {"l", "r"}
    centre : ndarray, shape (3,)
    radius : float
    gaze : ndarray, shape (3,)
        Unit direction in which the eye looks.
    up : ndarray, shape (3,)
        Unit direction at right angles to the gaze.
    given : bool
        True if the ball came with the face, as one of its parts.

    Examples
    --------
    The turns of a left eye, outwards and up in degrees, to look along a direction, and the sideways shift of its iris
    for another gaze:

    >>> eye = Eyeball("l", np.array([31.0, 0, 0]), 12.0, gaze=np.array([0.0, 0, 1]), up=np.array([0.0, 1, 0]))
    >>> np.degrees(eye.turn_to(np.array([1.0, 0, 1]))).round()
    array([45.,  0.])
    >>> eye.looking(np.array([0.6, 0, 0.8])).gaze
    array([0.6, 0. , 0.8])
    """

    side: str
    centre: Array
    radius: float
    gaze: Array
    up: Array
    given: bool = False

    @property
    def core(self) -> float:
        """Radius within which skin is no lid but the shallow lining behind a ball that came with the face; else 0.

        Margins of lids cut into such balls by up to a tenth of the radius.
        """
        return 0.9 * self.radius if self.given else 0.0

    def turned(self, outwards: float, up: float) -> Array:
        """The unit direction of the gaze after turns in radians, outwards (to the eye's own side) and up.

        Examples
        --------
        >>> eye = Eyeball("l", np.zeros(3), 12.0, gaze=np.array([0.0, 0.0, 1.0]), up=np.array([0.0, 1.0, 0.0]))
        >>> eye.turned(0.0, np.pi / 6).round(2).tolist()
        [0.0, 0.5, 0.87]
        """
        ahead = np.cos(outwards) * self.gaze + np.sin(outwards) * self._outwards
        return np.asarray(np.cos(up) * ahead + np.sin(up) * self.up)

    def turn_to(self, direction: Array) -> tuple[float, float]:
        """Turns outwards and up, in radians, after which the eye looks along a direction."""
        ahead, aside, above = (float(direction @ axis) for axis in (self.gaze, self._outwards, self.up))
        return float(np.arctan2(aside, ahead)), float(np.arctan2(above, np.hypot(ahead, aside)))

    @property
    def _outwards(self) -> Array:
        left = np.cross(self.up, self.gaze)
        return left if self.side == "l" else -left

    def looking(self, gaze: Array) -> Eyeball:
        """The eyeball turned so that it looks along a unit direction."""
        up = self.up - (self.up @ gaze) * gaze
        return replace(self, gaze=np.asarray(gaze), up=up / np.linalg.norm(up))

    def slit(self, inner: Array, outer: Array, along: npt.ArrayLike) -> Array:
        """Places (k, 3) on the line where shut lids meet, at shares of the way from corner to corner.

        In the middle it sags by 0.14 of this way.

        Examples
        --------
        >>> eye = Eyeball("l", np.zeros(3), 12.0, gaze=np.array([0.0, 0.0, 1.0]), up=np.array([0.0, 1.0, 0.0]))
        >>> eye.slit(np.array([-10.0, 0, 12]), np.array([10.0, 0, 12]), 0.5)
        array([[ 0. , -2.8, 12. ]])
        """
        share = np.reshape(along, (-1, 1))
        sag = 0.14 * np.linalg.norm(outer - inner) * np.sin(np.pi * share)
        return np.asarray(inner + share * (outer - inner) - sag * self.up)


def gaze_of(eye: Eyeball, yaw: float = 0.0, pitch: float = 0.0, at: npt.ArrayLike | None = None) -> tuple[float, float]:
    """The turns outwards and up, in radians, of an eye that looks by angles in degrees, or at a point.

    Parameters
    ----------
    eye : Eyeball
    yaw, pitch : float
        Degrees to the subject's left, and upwards.
    at : (3,) array_like, optional
        The point to look at, in the unit of the mesh, in place of the angles.

    Raises
    ------
    ParameterError
        For angles that are not numbers, for angles together with a point, or for a point in the eye.

    Examples
    --------
    Turns in degrees, outwards and up, of both eyes that look to the left; and outwards, to meet 300 mm ahead:

    >>> import facewrinkle as fw
    >>> left, right = fw.default_face().eyes
    >>> [np.degrees(gaze_of(eye, yaw=20.0)).round().tolist() for eye in (left, right)]
    [[20.0, 0.0], [-20.0, 0.0]]
    >>> there = 0.5 * (left.centre + right.centre) + 300.0 * left.gaze
    >>> [round(float(np.degrees(gaze_of(eye, at=there)[0]))) for eye in (left, right)]
    [-6, -6]
    """
    if at is None:
        left, up = (check_range(name, value, -90.0, 90.0) for name, value in (("yaw", yaw), ("pitch", pitch)))
        return np.deg2rad(left if eye.side == "l" else -left), np.deg2rad(up)
    if yaw != 0.0 or pitch != 0.0:
        raise ParameterError(
            f"look needs either angles or a point at=(x, y, z), received yaw={yaw!r}, pitch={pitch!r}, at={at!r}."
        )
    target = vector("at", at)
    if np.linalg.norm(target - eye.centre) <= 1.2 * eye.radius:
        raise ParameterError(f"the eyes cannot look at {at!r}: the point lies in an eye.")
    return eye.turn_to(target - eye.centre)


def eye_distance(points: Array, eyes: Iterable[Eyeball]) -> Array:
    """Return the distance (n,) of points (n, 3) from the nearest middle of an eyeball, in its radii.

    Examples
    --------
    >>> eye = Eyeball("l", np.zeros(3), 12.0, gaze=np.array([0.0, 0, 1]), up=np.array([0.0, 1, 0]))
    >>> eye_distance(np.array([[0.0, 0.0, 18.0]]), [eye])
    array([1.5])
    """
    return np.asarray(np.min([np.linalg.norm(points - eye.centre, axis=1) / eye.radius for eye in eyes], axis=0))
