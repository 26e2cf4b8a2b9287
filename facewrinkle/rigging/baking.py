"""From poses to arrays: one mesh that is fine enough for all of them, and where its vertices are in each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyvista as pv

from ..anatomy.face import Face
from ..appearance.companion_meshes import companion_meshes
from ..array_types import Array
from ..export.animation import rest_models
from ..export.model import Model, part_model
from ..layers.base import Layer
from ..simulation import Refinement, Simulation
from .poses import Held, Pose

Progress = Callable[[Iterable[Any], str, int], Iterator[Any]]
"""Yields items, such as poses, while it shows what is done, and how many there are."""

SAMPLES, BEND = 2.75, 0.1
"""Vertices from bulge to furrow, and the threshold of Eq. 19: a bit coarser than for pictures, as rigs are sent around.
"""

ROUNDS = 4
"""Each round of all poses may ask for triangles that the rounds before did not; the mesh is done long before this."""


def silent(items: Iterable[Any], what: str, total: int) -> Iterator[Any]:
    """Yield the items without a word."""
    return iter(items)


@dataclass(frozen=True, eq=False)
class Placed:
    """Points and normals (n, 3) of a mesh in one pose, in the unit of the face."""

    points: Array
    normals: Array


class Baker:
    """Places the skin and all parts of a face in poses, always with the same triangles.

    Parameters
    ----------
    face : Face
    layers : sequence of Layer, optional
        Default: the folds of a :class:`facewrinkle.Simulation`.
    level : int
        How often a triangle may be split.

    Attributes
    ----------
    models : dict of str to Model
        The meshes at rest, "face" first; filled by :meth:`refine`.
    """

    def __init__(self, face: Face, layers: list[Layer] | None, level: int) -> None:
        self.face, self._motion = face, Held(face)
        self.simulation = Simulation(face, Refinement(BEND, level, SAMPLES, coarsen=False), layers, motion=self._motion)
        self.models: dict[str, Model] = {}

    def refine(self, poses: list[Pose], neutral: Pose, progress: Progress = silent) -> None:
        """Split all triangles that any of the poses needs, and make the models of the face at rest."""
        for _ in range(ROUNDS):
            before = self.simulation.forest.n_points
            for pose in progress(poses, "Refining", len(poses)):
                self._grown(pose)
            if self.simulation.forest.n_points == before:
                break
        frame = self.frame(neutral)
        self.models = rest_models(self.face, frame)

    def follow(self, other: Baker) -> None:
        """Take over the triangles and models of another baker of the same face."""
        self.simulation.take_triangles(other.simulation)
        self.models = other.models

    def _grown(self, pose: Pose) -> None:
        count = -1
        while self.simulation.forest.n_points != count:
            count = self.simulation.forest.n_points
            self.frame(pose)

    def frame(self, pose: Pose) -> pv.PolyData:
        """Return the skin in a pose, with its fields."""
        self._motion.hold(pose)
        return self.simulation.step()

    def placed(self, pose: Pose, parts: bool = True) -> dict[str, Placed]:
        """Return all meshes in a pose."""
        frame = self.frame(pose)
        origin = self.models["face"].origin
        found = {"face": Placed(np.asarray(frame.points)[origin], np.asarray(frame.point_data["Normals"])[origin])}
        for name, mesh in companion_meshes(self.face, frame, always=True).items() if parts else ():
            model = part_model(mesh)
            found[name] = Placed(model.points, model.normals)
        return found
