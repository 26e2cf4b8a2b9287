"""The motion that plays a recording on a face: skin, pose of the head, gazes, and parts beside the skin, such as
lashes that blink and teeth that part.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.spatial import cKDTree

from ..anatomy import EyeMuscle, Face
from ..anatomy.attachments import STILL
from ..array_types import Array, IntArray
from ..errors import check_range
from ..geometry import rigid_motion
from ..motion.base import Undriven
from .action_units import looks_of
from .recorded import OFF_REST, Recorded, same_places


@dataclass(frozen=True, eq=False)
class _Piece:
    """Points of a part, by their `rows`, that are the points `numbers` of a recording."""

    rows: IntArray
    recorded: Recorded
    numbers: IntArray
    rest: Array

    def at(self, time: float) -> Array:
        return self.recorded.positions_at(time, self.rest, self.numbers)

    @property
    def thin(self) -> _Piece:
        """Some of its points, enough to show its motion."""
        few = slice(None, None, max(len(self.rows) // 64, 1))
        return replace(self, rows=self.rows[few], numbers=self.numbers[few], rest=self.rest[few])


class PartMotion:
    """The motion of the parts that a recording moves on the head; other parts go along with the face.

    Parameters
    ----------
    recorded : Recorded
    face : Face
        Made from the mesh of the recording.
    pose : callable
        The matrix (4, 4) that has moved the head since rest, at a time of the recording.
    """

    def __init__(self, recorded: Recorded, face: Face, pose: Callable[[float], Array]) -> None:
        self._face = face
        self._pieces: dict[str, list[_Piece]] = {}
        sources, posed = {0: recorded} | dict(recorded.companions), cache(pose)
        for name, part in face.parts.items():
            rest = np.asarray(part.mesh.points, dtype=np.float64)
            for start, source in sources.items():
                piece = _piece(source, start, part.source_points, rest)
                if piece is not None and self._moves(piece, recorded.some_times, posed):
                    self._pieces.setdefault(name, []).append(piece)

    def __contains__(self, name: str) -> bool:
        return name in self._pieces

    def at(self, time: float) -> dict[str, Array]:
        """Return points (k, 3) by part at a time of the recording, in the unit of the mesh; NaN if not moved."""
        out = {}
        for name, pieces in self._pieces.items():
            out[name] = np.full((self._face.parts[name].mesh.n_points, 3), np.nan)
            for piece in pieces:
                out[name][piece.rows] = piece.at(time)
        return out

    def gazes(self, time: float, pose: Array) -> Mapping[str, Array]:
        """Return the unit directions (3,) in which eyes that the recording turns look, on the head at rest, by side."""
        out = {}
        for eye in self._face.eyes:
            if (pieces := self._pieces.get(f"eye_{eye.side}")) is not None:
                ball = max(pieces, key=lambda piece: len(piece.rows)).thin
                turn = rigid_motion(ball.rest, ball.at(time), 0.1 * eye.radius, rounds=1)[:3, :3]
                gaze = np.linalg.solve(pose[:3, :3], turn @ eye.gaze)
                out[eye.side] = gaze / np.linalg.norm(gaze)
        return out

    def _moves(self, piece: _Piece, times: Array, pose: Callable[[float], Array]) -> bool:
        """Return True if a piece moves on the head; one that hardly does goes along with the face."""
        still, recorded = 0.003 * self._face.frame.pupil_distance, piece.recorded
        if recorded.deltas is not None:
            reach = np.abs(recorded.track.values).max(axis=0)
            if any(np.abs(recorded.deltas[k][piece.numbers]).max() * reach[k] > still for k in np.flatnonzero(reach)):
                return True
            if recorded.pose is None and recorded.bones is None and np.array_equal(pose(times[-1]), np.eye(4)):
                return False
        thin = piece.thin
        for time in times:
            head = pose(time)
            if np.abs(thin.at(time) - thin.rest @ head[:3, :3].T - head[:3, 3]).max() > still:
                return True
        return False


def _piece(source: Recorded, start: int, source_points: IntArray | None, rest: Array) -> _Piece | None:
    """Return the points of a part (k, 3) that are in a recording: by number, or by position if most match."""
    if source.rest is None:
        return None
    if source_points is None:
        away, nearest = cKDTree(source.rest).query(rest)
        rows = np.flatnonzero(away <= OFF_REST * np.ptp(source.rest, axis=0).max())
        return _Piece(rows, source, nearest[rows], rest[rows]) if 2 * len(rows) > len(rest) else None
    rows = np.flatnonzero((source_points >= start) & (source_points < start + source.n_points))
    numbers = source_points[rows] - start
    if not len(rows) or not same_places(rest[rows], source.rest[numbers]):
        return None
    return _Piece(rows, source, numbers, rest[rows])


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
        self._some = slice(None, None, max(len(face.points) // 4096, 1))  # enough of them for a pose
        self._head = self._rest[self._some] if baked else None
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
        baked = rigid_motion(self._head, replace(recorded, pose=None).positions_at(time, rest, numbers), self._still)
        return baked if pose is None else pose @ baked
