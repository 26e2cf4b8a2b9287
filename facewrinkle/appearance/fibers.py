"""Muscles as fibers, from their origins on the bone to their insertions in the skin, colored by contraction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree

from ..anatomy import Face, LinearMuscle, Muscle, SheetMuscle, SphincterMuscle, per_face
from ..array_types import Array, IntArray
from ..geometry import unit
from .hair import HairCards, HairLines

COUNT, KNOTS = 7, 14
"""Fibers of a muscle, and points of each."""

RELAXED, CONTRACTED = np.array([226.0, 196.0, 176.0]), np.array([150.0, 8.0, 20.0])
"""Colors of fibers, 0 to 255."""

OPACITY = 0.75
"""Of fibers: they are seen through the skin, as if it were translucent."""

BENEATH = 0.45
"""Fibers are seen through skin in front of them by this, in distances between the pupils: not through the head."""


class Fibers:
    """The fibers of the muscles that pull the skin of a face.

    They lie between bone and skin. Their origins go with the bone, their insertions with the skin, and what is between
    with both. Rings go with the skin alone.

    Parameters
    ----------
    face : Face

    Attributes
    ----------
    names : list of str
        Of the muscles that have fibers.
    muscle : ndarray of int, shape (count,)
        The muscle of each fiber, by its number among the names.
    half : ndarray, shape (count, knots)
        Half the width at the points, in the unit of the mesh.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> fibers = Fibers.of(face)
    >>> fibers.names[0], fibers.at(face.mesh).shape == (*fibers.half.shape, 3)
    ('frontalis_inner_l', True)
    """

    def __init__(self, face: Face) -> None:
        self._face = face
        found = {name: lines for name, muscle in face.muscles.items() if len(lines := _lines(muscle, face))}
        self.names = list(found)
        self.muscle = np.repeat(np.arange(len(found)), [len(lines) for lines in found.values()])
        lines = np.concatenate([*found.values(), np.empty((0, KNOTS, 3))])
        along, belly = np.linspace(0.0, 1.0, KNOTS), np.sin(np.linspace(0.15, np.pi - 0.15, KNOTS))
        ring = np.array([isinstance(face.muscles[name], SphincterMuscle) for name in found], bool)[self.muscle]
        self._share = np.where(ring[:, None], 1.0, along)[..., None]
        self.half = 0.009 * face.frame.pupil_distance * np.where(ring[:, None], 0.6, belly)
        away, nearest = cKDTree(face.points).query(lines, k=6)  # vertices that a point goes along with
        weights = 1.0 / (away + 1e-3 * face.frame.pupil_distance) ** 2
        weights /= weights.sum(axis=-1, keepdims=True)
        self._rest = _in_flesh(lines, nearest, weights[..., None], face)
        self._vertices = np.where(ring[:, None, None], nearest, nearest[:, -1:])
        self._weights = np.where(ring[:, None, None], weights, weights[:, -1:])[..., None]
        self._on_jaw = (face.mandible_share > 0.5)[nearest[:, 0, 0]][:, None, None]

    @classmethod
    def of(cls, face: Face) -> Self:
        """Return the fibers of a face, made at the first call."""
        return per_face(face, "fibers", None, lambda: cls(face))

    def at(self, frame: pv.PolyData) -> Array:
        """Return the points (count, knots, 3) of the fibers in a frame of a simulation, or in the mesh of the face."""
        state = self._face.state_of(frame)
        points = state.to_rest(state.points)
        rest, skin = self._rest, self._on_skin(self._face.points)
        if (jaw := self._face.mandible) is not None:
            turn = jaw.rotation(points, state.jaw_angle).T - np.eye(3)
            rest = rest + np.where(self._on_jaw, (rest - jaw.hinge) @ turn, 0.0)
            skin = skin + np.where(self._on_jaw, (skin - jaw.hinge) @ turn, 0.0)
        return np.asarray(state.from_rest(rest + self._share * (self._on_skin(points) - skin)))

    def _on_skin(self, points: Array) -> Array:
        """Return places (count, knots, 3) on skin with vertices (n, 3) that fibers go along with."""
        return np.asarray((self._weights * points[self._vertices]).sum(axis=-2))

    def ribbons(self, frame: pv.PolyData, rates: Mapping[str, float], camera: Array, pixel: float) -> pv.PolyData:
        """Return the fibers as ribbons, with `paint` (rgba), so near to a camera that they are seen through the skin.

        Parameters
        ----------
        frame : PolyData
        rates : dict of str to float
            Contractions by muscle, 0 to 1.
        camera : ndarray, shape (3,)
            Position of the camera.
        pixel : float
            Width of a pixel, in the unit of the mesh.
        """
        rate = np.array([rates.get(name, 0.0) for name in self.names])[self.muscle, None]
        tint = (1.0 - rate) * RELAXED + rate * CONTRACTED
        lines, size = self.at(frame), self._face.frame.pupil_distance
        towards = camera - lines
        share = BENEATH * size / np.linalg.norm(towards, axis=-1, keepdims=True)
        side = unit(np.cross(np.gradient(lines, axis=1), towards))
        half = (1.0 - share[..., 0]) * self.half
        return HairCards(half, tint, pixel).along(HairLines(lines + share * towards, side, unit(towards)))


def _in_flesh(lines: Array, nearest: IntArray, weights: Array, face: Face) -> Array:
    """Return points (..., 3) moved into the soft tissue under the vertices that are nearest, and lines made smooth."""
    on_skin, normals, depth = (
        (weights * values[nearest]).sum(axis=-2)
        for values in (face.points, face.tissue.normals, face.tissue.depth[:, None])
    )
    normals = unit(normals)
    moved = np.array(lines)
    for step in range(7):
        if step:  # vertices under which they lie change abruptly
            moved[:, 1:-1] = 0.25 * (moved[:, :-2] + 2.0 * moved[:, 1:-1] + moved[:, 2:])
        height = ((moved - on_skin) * normals).sum(axis=-1, keepdims=True)
        moved += (np.clip(height, -depth, -0.2 * depth) - height) * normals
    return moved


def _lines(muscle: Muscle, face: Face) -> Array:
    """Return the fibers (k, knots, 3) of a muscle as straight lines, or as arcs; none if it does not pull the skin."""
    along, across = np.linspace(0.0, 1.0, KNOTS)[:, None], np.linspace(0.0, 1.0, COUNT)[:, None]
    if isinstance(muscle, SphincterMuscle):
        # Four rings, each of three fibers.
        angle = np.linspace(0.0, 2.0 * np.pi, 3 * (KNOTS - 1) + 1)
        arcs = angle[(KNOTS - 1) * np.arange(3)[:, None] + np.arange(KNOTS)]
        radius = np.linspace(muscle.inner, 1.0, 4)[:, None, None, None]
        axes = muscle.semi_major * muscle.lateral, muscle.semi_minor * muscle.vertical
        ring = np.cos(arcs)[..., None] * axes[0] + np.sin(arcs)[..., None] * axes[1]
        return np.asarray(muscle.centre + radius * ring).reshape(-1, KNOTS, 3)
    if isinstance(muscle, SheetMuscle):
        begin, end = (ends[0] + across * (ends[1] - ends[0]) for ends in (muscle.attachment, muscle.insertion))
    elif isinstance(muscle, LinearMuscle):
        way = muscle.insertion - muscle.attachment
        vertex = face.mesh.find_closest_point(muscle.insertion)
        aside = muscle.length * unit(np.cross(face.tissue.normals[vertex], way))
        angle = 0.5 * muscle.max_angle * (2.0 * across - 1.0)  # half of that at which the pull ends
        begin, end = muscle.attachment, muscle.attachment + np.cos(angle) * way + np.sin(angle) * aside
    else:
        return np.empty((0, KNOTS, 3))
    return np.asarray(np.expand_dims(begin, -2) + along * np.expand_dims(end - begin, -2))
