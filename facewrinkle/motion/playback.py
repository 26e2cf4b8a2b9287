"""The motion that plays a recording on a face: skin, pose of the head, gazes, and parts beside the skin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..anatomy.attachments import STILL
from ..anatomy.face import Face
from ..anatomy.muscles import EyeMuscle
from ..array_types import Array
from ..errors import check_range
from ..geometry.rigid_alignment import RigidAlignment
from .action_units import looks_of
from .base import Undriven
from .part_motion import PartMotion
from .recorded import Recorded

POINTS_FOR_POSE = 4096
"""The pose of a head is found from this many of its points, or up to twice as many."""


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
    One shape that rises over half a second; the first step leads to half its height, 1 mm.

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
        self._numbers = recorded.points_of(face)
        everything = np.array_equal(self._numbers, np.arange(recorded.n_points))
        self._taken = slice(None) if everything else self._numbers  # a slice copies nothing
        self._face, self._rest = face, face.points
        self.points = self._rest * face.unit
        # A pose that is not recorded shows in the positions: most of the head moves as one.
        baked = (recorded.deltas is None or recorded.bones is not None) and face.landmarks
        self._some = slice(None, None, max(len(face.points) // POINTS_FOR_POSE, 1))
        self._head = RigidAlignment(self._rest[self._some]) if baked else None
        self._still = STILL * face.frame.pupil_distance if baked else 0.0
        muscles = {(m.side, m.turn): name for name, m in face.muscles.items() if isinstance(m, EyeMuscle)}
        looks = looks_of(recorded.names).items()
        self._eye_muscles = {shape: muscles[look] for shape, look in looks if look in muscles}

        def pose(time: float) -> Array:
            return np.eye(4) if (matrix := self._pose_at(time)) is None else matrix

        self._part_motion = PartMotion(recorded, face, pose)
        self.reset()

    def reset(self) -> None:
        """See :class:`facewrinkle.Motion`."""
        self._steps = 0.0
        self._move_parts(self.recorded.recorded_time(0.0))

    def seek(self, time: float) -> None:
        """Let the next step lead to a time, s."""
        self._steps = time / self.time_step - 1.0

    def step(self) -> Array:
        """See :class:`facewrinkle.Motion`; the first step leads to the time `time_step`."""
        self._steps += 1
        time = self.recorded.recorded_time(self._steps * self.time_step)
        moved = self.recorded.positions_at(time, self._rest, self._taken) * self._face.unit
        self._move_parts(time)
        return moved

    def _move_parts(self, time: float) -> None:
        """Set the pose, the parts that the recording moves, and the gazes of a time of the recording."""
        self.pose = self._pose_at(time)
        self.parts = self._part_motion.at(time)
        self.gazes = self._gazes_at(time)

    def _gazes_at(self, time: float) -> dict[str, Array]:
        """Return the gazes that the shapes, or the eyes of the recording itself, show."""
        gazes: dict[str, Array] = {}
        if self._eye_muscles:
            weights = dict(zip(self.recorded.names, self.recorded.track.at(time).tolist(), strict=True))
            gazes |= self._face.gazes({m: min(max(weights[s], 0.0), 1.0) for s, m in self._eye_muscles.items()})
        if any(f"eye_{eye.side}" in self._part_motion for eye in self._face.eyes):
            gazes |= self._part_motion.gazes(time, np.eye(4) if self.pose is None else self.pose)
        return gazes

    def _pose_at(self, time: float) -> Array | None:
        """Return the recorded pose, times that which most points show where positions or bones were recorded."""
        recorded = self.recorded
        pose = None if recorded.pose is None else recorded.pose(time)
        if self._head is None:
            return pose
        rest, numbers = self._rest[self._some], self._numbers[self._some]
        baked = self._head.pose(replace(recorded, pose=None).positions_at(time, rest, numbers), self._still)
        return baked if pose is None else pose @ baked
