"""A face: a rest mesh with the anatomy under it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
import numpy.typing as npt
import pyvista as pv

from ..errors import MeshError
from ..mesh import to_polydata
from .atlas import Atlas, load_atlas
from .eyes import Eyeball, lids_of, place_eyeballs
from .guides import Guide
from .head import Hairs
from .jaw import jaw_guide
from .landmarks import FaceFrame, frame_of
from .muscles import JawMuscle, LidMuscle, Muscle
from .skull import Tissue, tissue_of

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Face:
    """A rest mesh with landmarks, skull, eyes and muscles; everything in the mesh's own unit and coordinates.

    Make one with :func:`facewrinkle.default_face` or :func:`facewrinkle.fit_face`.

    Attributes
    ----------
    mesh : pyvista.PolyData
        The skin at rest, n vertices, m triangles, with the point data of the input.
    landmarks : dict of str to ndarray, shape (3,)
    muscles : dict of str to Muscle
    eyes : list of Eyeball
    tissue : Tissue
        Depth, stiffness and direction of the soft tissue under each vertex.
    unit : float
        Millimetres per unit of the mesh.
    atlas : Atlas
        Where the muscles, action units and expressions come from.
    estimated : tuple of str
        Landmarks that were not given but mirrored or carried over.
    texture : ndarray of uint8, shape (h, w, 3), optional
        Colour over the mesh's texture coordinates, first row at the top.
    brows : Hairs, optional
        Eyebrows, tied to the triangles of the mesh.
    confidences : dict of str to float
        How far landmarks that were found by the shape of the mesh can be trusted, 0 to 1.
    """

    mesh: pv.PolyData
    landmarks: dict[str, Array]
    muscles: dict[str, Muscle]
    eyes: list[Eyeball]
    tissue: Tissue
    unit: float
    atlas: Atlas
    estimated: tuple[str, ...] = ()
    texture: npt.NDArray[np.uint8] | None = None
    brows: Hairs | None = None
    confidences: dict[str, float] = field(default_factory=dict)

    @classmethod
    def from_landmarks(
        cls,
        mesh: pv.PolyData,
        landmarks: Mapping[str, Array],
        unit: float,
        atlas: Atlas | None = None,
        estimated: tuple[str, ...] = (),
    ) -> Self:
        """Build the anatomy under a clean triangle mesh from its complete landmarks."""
        atlas = atlas or load_atlas()
        points, triangles = (
            np.asarray(mesh.points, dtype=np.float64),
            np.asarray(mesh.regular_faces, dtype=np.int32),
        )
        if len(triangles) == 0:
            raise MeshError("a face needs triangles; the mesh has none.")
        frame = frame_of(landmarks)
        where, depth, stiffness = atlas.tissue_samples(landmarks, frame)
        tissue = tissue_of(points, triangles, (where, depth / unit, stiffness), frame.pupil_distance)
        eyes = place_eyeballs(landmarks, frame, points, triangles)
        return cls(mesh, dict(landmarks), atlas.place(landmarks, frame), eyes, tissue, unit, atlas, estimated)

    @property
    def points(self) -> Array:
        """Rest positions (n, 3)."""
        return np.asarray(self.mesh.points, dtype=np.float64)

    @cached_property
    def triangles(self) -> npt.NDArray[np.int32]:
        """Vertices of the triangles (m, 3)."""
        return np.ascontiguousarray(self.mesh.regular_faces, dtype=np.int32)

    @cached_property
    def frame(self) -> FaceFrame:
        """Axes and size of the face."""
        return frame_of(self.landmarks)

    @cached_property
    def guides(self) -> dict[str, Guide]:
        """What the muscles that move lids and jaw carry, by muscle; eyes without an opening have no lids."""
        found: dict[str, Guide] = {}
        for eye in self.eyes:
            lids = lids_of(eye, self.points, self.triangles, self.landmarks)
            if lids is None:
                continue
            found[f"orbicularis_oculi_{eye.side}"] = lids
            upper = np.maximum(lids.angles, 0.0)
            for name, muscle in self.muscles.items():
                if isinstance(muscle, LidMuscle) and muscle.side == eye.side:
                    found[name] = dataclasses.replace(lids, angles=-muscle.share * upper)
        for name, muscle in self.muscles.items():
            if isinstance(muscle, JawMuscle):
                found[name] = jaw_guide(muscle, self.points, self.triangles, self.landmarks, self.frame)
        return {name: guide for name, guide in found.items() if name in self.muscles}

    @property
    def skull(self) -> pv.PolyData:
        """The bone under the skin, one vertex under each vertex of the skin."""
        return to_polydata(self.tissue.foot, self.triangles)

    def with_muscles(self, changes: Mapping[str, Muscle]) -> Self:
        """The face with some muscles replaced or added.

        Examples
        --------
        >>> import facewrinkle as fw
        >>> face = fw.default_face()
        >>> deeper = face.muscles["corrugator_l"].replaced(depth=3.0)
        >>> face.with_muscles({"corrugator_l": deeper}).muscles["corrugator_l"].fold_pattern.wrinkles.depth
        3.0
        """
        return dataclasses.replace(self, muscles={**self.muscles, **changes})
