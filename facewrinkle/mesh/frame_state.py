"""The state of a face in a frame of a simulation: its base vertices, the pose of its head, gazes, and moving parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pyvista as pv

from ..array_types import Array
from ..errors import MeshError
from .arrays import GAZE, JAW, MANDIBLE, OF_PART, POSE, TONGUE, is_frame


@dataclass(frozen=True, eq=False)
class FrameState:
    """The state of a face in one frame, in the unit and coordinates of its mesh.

    Attributes
    ----------
    points : ndarray, shape (n0, 3)
        The base vertices; they come first in every frame, before those of split triangles.
    pose : ndarray, shape (4, 4), optional
        Motion of the head as a whole since rest; None if the frame does not hold it.
    gazes : mapping of str to ndarray, shape (3,)
        Unit directions in which the eyes look, by side ("l", "r"), on the head at rest; empty if the frame has none.
    parts : mapping of str to ndarray, shape (k, 3)
        Points of the parts that move by themselves, by name; NaN for points that follow the skin.
    jaw_angle : float, optional
        Turn of the mandible, radians; None if it has to be measured on the skin.
    mandible : ndarray, shape (4, 4), optional
        Motion of the mandible after that turn, such as forward or aside, on the head at rest.
    tongue : float
        Share by which the tongue is put out, in [0, 1].

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> sim = fw.Simulation(face)
    >>> sim.look(yaw=30)
    >>> state = face.state_of(sim.step())
    >>> state.points.shape == face.points.shape, state.gazes["l"].round(2)
    (True, array([0.5 , 0.05, 0.86]))
    """

    points: Array
    pose: Array | None
    gazes: Mapping[str, Array]
    parts: Mapping[str, Array]
    jaw_angle: float | None = None
    mandible: Array | None = None
    tongue: float = 0.0

    @classmethod
    def of(cls, frame: pv.PolyData, n_points: int) -> FrameState:
        """Read the state of a face with `n_points` base vertices from a frame.

        Raises
        ------
        MeshError
            If the frame has fewer points.
        """
        if frame.n_points < n_points:
            raise MeshError(
                f"a frame of this face has {n_points} points or more, received {frame.n_points}. "
                "Is it one of another face?"
            )
        fields = frame.GetFieldData()  # PyVista's own is slow to read, and pictures do so for each frame
        keys = [fields.GetArrayName(k) for k in range(fields.GetNumberOfArrays() if is_frame(frame) else 0)]
        data = frame.field_data
        return cls(
            np.asarray(frame.points, dtype=np.float64)[:n_points],
            np.asarray(data[POSE], dtype=np.float64) if POSE in keys else None,
            {key[len(GAZE) :]: np.array(data[key], np.float64).ravel() for key in keys if key.startswith(GAZE)},
            {key[len(OF_PART) :]: np.asarray(data[key]) for key in keys if key.startswith(OF_PART)},
            float(data[JAW][0]) if JAW in keys else None,
            np.asarray(data[MANDIBLE], dtype=np.float64) if MANDIBLE in keys else None,
            float(data[TONGUE][0]) if TONGUE in keys else 0.0,
        )

    @property
    def head(self) -> Array:
        """The pose as a matrix (4, 4); the identity if the frame does not hold it."""
        return np.eye(4) if self.pose is None else self.pose

    def to_rest(self, points: Array) -> Array:
        """Return points (k, 3) of the frame, moved with the head back to rest."""
        back = np.linalg.inv(self.head)
        return np.asarray(points @ back[:3, :3].T + back[:3, 3])

    def from_rest(self, points: Array) -> Array:
        """Return points (k, 3) of the head at rest, moved with the head to where they are in the frame."""
        return np.asarray(points @ self.head[:3, :3].T + self.head[:3, 3])
