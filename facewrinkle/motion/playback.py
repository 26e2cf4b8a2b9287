"""What plays a recording on a face: its skin, the pose of its head, where its eyes look, and what moves beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ..anatomy.attachments import STILL
from ..anatomy.face import Face
from ..anatomy.muscles import EyeMuscle
from ..errors import check_range
from ..geometry.rigid_alignment import RigidAlignment
from .action_units import looks_of
from .base import Undriven
from .part_motion import PartMotion
from .recorded import Recorded

Array = npt.NDArray[np.float64]

ENOUGH = 4096
"""Points, or up to twice as many, tell how a head has moved as a whole."""


class Playback(Undriven):
    """The motion that plays a recording on a face.

    Parameters
    ----------
    recorded : Recorded
    face : Face
    time_step : float
        Seconds per step.

    Examples
    --------
    One shape over half a second; the first step leads to the middle of it, a displacement by 1 mm.

    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> recorded = Recorded.of_shapes([2.0 * face.tissue.normals], [[0.0], [1.0]], times=[0.0, 0.5])
    >>> motion = Playback(recorded, face, time_step=0.25)
    >>> float(np.linalg.norm(motion.step() - face.points, axis=1).max().round(3))
    1.0
    """

    def __init__(self, recorded: Recorded, face: Face, time_step: float = 0.02) -> None:
        self.recorded = recorded
        self.time_step = check_range("time_step", time_step, 1e-9, 1e9)
        self._which = recorded.points_of(face)
        baked = (recorded.deltas is None or recorded.bones is not None) and face.landmarks
        self._few = slice(None, None, max(len(face.points) // ENOUGH, 1))
        self._head = RigidAlignment(face.points[self._few]) if baked else None
        self._near = STILL * face.frame.pupil_distance if baked else 0.0
        self._rest, self._unit = face.points, face.unit
        muscles = {(m.side, m.turn): name for name, m in face.muscles.items() if isinstance(m, EyeMuscle)}
        looks = looks_of(recorded.names).items()
        self._looks = {shape: muscles[look] for shape, look in looks if look in muscles}
        self._face = face
        self._part_motion = PartMotion(
            recorded, face, lambda time: np.eye(4) if (p := self._posed(time)) is None else p
        )
        self.points = self._rest * self._unit
        self.reset()

    def reset(self) -> None:
        """See :class:`facewrinkle.Motion`."""
        self._steps = 0
        self._shown: tuple[float, Array | None] = (np.nan, None)

    def step(self) -> Array:
        """See :class:`facewrinkle.Motion`; the first step leads to the time of one time step."""
        self._steps += 1
        return self.recorded.positions_then(self._time, self._rest, self._which) * self._unit

    @property
    def _time(self) -> float:
        """Of the recording."""
        return self.recorded.recorded_time(self._steps * self.time_step)

    @property
    def parts(self) -> Mapping[str, Array]:
        """Points (k, 3) of the parts beside the skin that the recording moves, in the unit of the mesh; NaN for those
        that are carried.
        """
        return self._part_motion.at(self._time)

    @property
    def gazes(self) -> Mapping[str, Array]:
        """The unit directions (3,) in which the eyes of the head at rest look, by side, where shapes or the file's own
        eyes tell.
        """
        looks: dict[str, Array] = {}
        if self._looks:
            weights = dict(zip(self.recorded.names, self.recorded.track.at(self._time).tolist(), strict=True))
            rates = {muscle: min(max(weights[shape], 0.0), 1.0) for shape, muscle in self._looks.items()}
            looks |= self._face.gazes(rates)
        if any(f"eye_{eye.side}" in self._part_motion for eye in self._face.eyes):
            looks |= self._part_motion.gazes(self._time, np.eye(4) if self.pose is None else self.pose)
        return looks

    @property
    def pose(self) -> Array | None:
        """How the head as a whole has moved since rest: a matrix (4, 4) in the unit of the mesh, or None.

        As it was recorded, and as most positions tell where these were recorded or bones carry them.
        """
        if self._shown[0] != self._time:
            self._shown = self._time, self._posed(self._time)
        return self._shown[1]

    def _posed(self, time: float) -> Array | None:
        recorded = self.recorded
        pose = None if recorded.pose is None else recorded.pose(time)
        if self._head is None:
            return pose
        rest, which = self._rest[self._few], self._which[self._few]
        baked = self._head.pose(replace(recorded, pose=None).positions_then(time, rest, which), self._near)
        return baked if pose is None else pose @ baked
