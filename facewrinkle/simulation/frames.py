"""The frames of a simulation: meshes with the fields of one time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyvista as pv

from ..anatomy import EyeMuscle, Face, JawMuscle, TongueMuscle
from ..array_types import Array
from ..geometry import RedGreenForest
from ..layers.base import SurfacePoints
from ..mesh import (
    GAZE,
    JAW,
    MANDIBLE,
    MUSCLES,
    OF_PART,
    POSE,
    TONGUE,
    UNIT,
    interpolated_point_data,
    refilled,
    refine_seams,
    to_polydata,
)
from ..mesh.arrays import use_texture
from ..motion.base import Motion


class FrameMaker:
    """Assembles the frames of a face that a motion moves.

    Each frame is a copy of a template, which holds all that stays the same while the mesh keeps its triangles.

    Parameters
    ----------
    face : Face
    motion : Motion

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> maker = FrameMaker(face, fw.Still(face))
    >>> sorted(maker.field_data)
    ['muscles', 'unit']
    """

    def __init__(self, face: Face, motion: Motion) -> None:
        self._face, self._motion = face, motion
        self._point_data = {name: np.asarray(values) for name, values in face.mesh.point_data.items()}
        self._common = pv.PolyData()  # its field data are those of every frame
        self._common.field_data[MUSCLES] = list(face.muscles)
        self._common.field_data[UNIT] = [face.unit]
        self._template: pv.PolyData | None = None
        self._kinds: dict[str, tuple[np.dtype[Any], tuple[int, ...]]] = {}
        kinds = EyeMuscle | JawMuscle | TongueMuscle
        self._turning = [k for k, m in enumerate(motion.names) if isinstance(face.muscles.get(m), kinds)]
        self._shown_rates: dict[str, float] = {}

    @property
    def field_data(self) -> pv.DataSetAttributes:
        """The field data that all frames have."""
        return self._common.field_data

    def remesh(self) -> None:
        """Begin a new template: the next frame has other triangles."""
        self._template = None

    def frame(
        self, points: Array, data: Mapping[str, np.ndarray], vertices: SurfacePoints, forest: RedGreenForest
    ) -> pv.PolyData:
        """Return the frame with points (n, 3), in mm, and point data."""
        kinds = {name: (values.dtype, values.shape) for name, values in data.items()}
        if self._template is None or kinds != self._kinds:  # layers of one's own may change their arrays at any time
            self._template, self._kinds = self._new_template(data, vertices, forest), kinds
        if len(self._motion.names):
            self._update_joints()
        places = points / self._face.unit
        if self._face.unit != 1.0:  # what does not move stays to the last bit where it was given
            places = np.where(points == vertices.points * self._face.unit, vertices.points, places)
        frame = refilled(self._template, places, data)
        motion = self._motion
        if (pose := motion.pose) is not None:
            frame.field_data[POSE] = pose
        if motion.mandible is not None:
            frame.field_data[MANDIBLE] = motion.mandible
        for side, gaze in motion.gazes.items():
            frame.field_data[GAZE + side] = gaze[None]
        for name, part in motion.parts.items():
            frame.field_data[OF_PART + name] = part
        return frame

    def _update_joints(self) -> None:
        """Write the turns of eyes, mandible and tongue by muscles to the common field data, those that have changed."""
        names, muscles = self._motion.names, self._face.muscles
        rates = {names[k]: float(self._motion.rates[k]) for k in self._turning}
        changed = {name for name, rate in rates.items() if rate != self._shown_rates.get(name)}
        kinds = {type(muscles[name]) for name in changed}
        if JawMuscle in kinds:
            self._common.field_data[JAW] = [self._face.jaw_angle(rates)]
        for name in changed:
            if isinstance(muscles[name], TongueMuscle):
                self._common.field_data[TONGUE] = [rates[name]]
        if EyeMuscle in kinds or not self._shown_rates:
            for side, gaze in self._face.gazes(rates).items():
                self._common.field_data[GAZE + side] = gaze[None]
        self._shown_rates = rates

    def _new_template(
        self, data: Mapping[str, np.ndarray], vertices: SurfacePoints, forest: RedGreenForest
    ) -> pv.PolyData:
        """Return a frame of the present triangles: from one frame to the next only `data` and points change."""
        source = self._face.mesh.point_data
        given = interpolated_point_data(self._point_data, vertices.corners, vertices.barycentric)
        n = len(vertices.points)
        blank = {name: np.zeros(n) for name in ("lambda", "gamma", "epsilon")} | {"muscle": np.full(n, -1, np.int32)}
        all_data = {**given, **blank, **data, "rest": vertices.points, "level": forest.vertex_level}
        all_data["host"] = vertices.host
        frame = to_polydata(vertices.points, forest.triangles, all_data, copy=False)  # frames are copies of it
        frame.SetFieldData(self._common.GetFieldData())
        use_texture(frame, source.active_texture_coordinates_name)
        frame.point_data.active_normals_name = "Normals"
        frame.point_data.active_scalars_name = "W"  # what `frame.plot()` colors
        refine_seams(self._face.mesh, frame, forest)
        return frame
