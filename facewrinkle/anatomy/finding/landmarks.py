"""Landmarks found on a mesh of a face."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from ...array_types import Array, IntArray
from ...errors import LARGEST, LandmarkError, MeshError
from ...mesh import MeshLike, read_surface
from ...progress import Progress, bar
from ..landmarks import NAMES
from .placement import placed_landmarks
from .search import NO_FACE, check_surface, searched
from .template import UNMEASURED, Pose, pose_from_landmarks

HIDDEN = 0.2
"""Confidence below which a landmark counts as hidden, before it is multiplied by that of the face."""


@dataclass(frozen=True, eq=False)
class Found:
    """A face that was found on a mesh.

    Attributes
    ----------
    landmarks : dict of str to ndarray, shape (3,)
        In the coordinates and the unit of the mesh.
    confidences : dict of str to float
        Confidence in each, 0 to 1.
    estimated : tuple of str
        The landmarks that cannot be measured on the shape, or are hidden.
    confidence : float
        Likeness to a face, at most 1; other things stay below 0.6.
    pose : Pose
        Rotation (`axes`), scale (`size`) and translation (`origin`).

    Examples
    --------
    A possible outcome of a search; the nose was measured, the hairline was not:

    >>> pose = Pose(np.eye(3), origin=np.zeros(3), size=6.3, stretch=np.ones(3))
    >>> places = {"nose_tip": np.array([0.0, -3.2, 4.5]), "trichion": np.array([0.0, 8, 1])}
    >>> found = Found(places, {"nose_tip": 0.97, "trichion": 0.4}, ("trichion",), 0.97, pose)
    >>> [name for name in found.landmarks if name not in found.estimated], found.confidence > 0.6
    (['nose_tip'], True)
    """

    landmarks: dict[str, Array]
    confidences: dict[str, float]
    estimated: tuple[str, ...]
    confidence: float
    pose: Pose


def find_landmarks(
    mesh: MeshLike,
    progress: Progress | None = None,
    given: Mapping[str, npt.ArrayLike] | None = None,
) -> Found:
    """Find a face on a mesh by its shape: any unit, any direction, either winding, with or without other parts.

    Parameters
    ----------
    mesh : PolyData, or anything that `read_surface` takes
        Not changed. It may have holes, loose parts and faults.
    progress : callable, optional
        Shows progress: called with the steps of the search, what is done, and the number of steps; returns the steps,
        to be done one by one. Default: a bar on stderr where that is a terminal.
    given : dict, optional
        Landmarks that are known. Three or more that do not lie on a line say where the face is, and nothing else is
        searched; fewer do not guide the search.

    Returns
    -------
    Found
        Whatever looks most like a face; its `confidence` tells faces from other things.

    Raises
    ------
    MeshError
        If there is no surface, or points are not finite.
    LandmarkError
        If nothing on the mesh looks like a face at all, or if it has fewer than 200 triangles and not three landmarks
        are given.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> head = fw.default_face()
    >>> found = find_landmarks(head.mesh.rotate_x(70).scale(0.001))
    >>> found.confidence > 0.9
    True
    """
    points, triangles = _regular_surface(mesh)
    middle, diagonal = 0.5 * (points.min(axis=0) + points.max(axis=0)), float(np.linalg.norm(np.ptp(points, axis=0)))
    points = (points - middle) / diagonal
    marks = {name: (np.asarray(point, dtype=np.float64) - middle) / diagonal for name, point in (given or {}).items()}
    pose = pose_from_landmarks(marks)
    if pose is None:
        check_surface(points, triangles)
    with threadpool_limits(1, "blas"):  # its threads wait for each other longer than they work here
        matches, face = searched(points, triangles, pose, progress or bar)
    match = matches[0]
    try:
        landmarks, confidences, estimated = placed_landmarks(points, face, matches)
    except LandmarkError:  # the template's landmarks fell into disorder
        raise LandmarkError(NO_FACE) from None
    hidden = [name for name in NAMES if name not in UNMEASURED and confidences[name] < HIDDEN]
    pose = match.pose
    return Found(
        {name: point * diagonal + middle for name, point in landmarks.items()},
        {name: value * match.confidence for name, value in confidences.items()},
        (*estimated, *hidden),
        match.confidence,
        Pose(pose.axes, pose.origin * diagonal + middle, pose.size * diagonal, pose.stretch),
    )


def _regular_surface(mesh: MeshLike) -> tuple[Array, IntArray]:
    """The triangles of a mesh that have an area, and the points that they use."""
    source = read_surface(mesh)
    points, triangles = np.array(source.points, dtype=np.float64), np.array(source.regular_faces, dtype=np.int64)
    corners = points[triangles]
    if not (np.abs(corners) < LARGEST).all():
        raise MeshError("points of the mesh are NaN, infinite or huge. Delete them in a modeller, or export it again.")
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    triangles = triangles[area > 1e-12 * (sides**2).sum(axis=2).max(axis=1, initial=0.0)]
    if not len(triangles):
        raise MeshError("the mesh has no triangles with an area. Export it again.")
    used, renumbered = np.unique(triangles, return_inverse=True)
    return points[used], renumbered.reshape(-1, 3)
