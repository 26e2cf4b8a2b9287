"""What a recording moves beside the skin: lashes that blink, eyes that turn, teeth that part, as their file says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..geometry.rigid_alignment import RigidAlignment
from .recorded import OFF_REST, Recorded, near

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

OWN = 0.003
"""Parts that move on the head by less than this, in distances between the pupils, are still there: they are carried."""

MOMENTS = 48
"""Of a recording, at which it is seen whether a part moves; shapes tell it without."""


@dataclass(frozen=True, eq=False)
class _Piece:
    """Points of a part that one recording moves."""

    rows: Ints
    recorded: Recorded
    which: Ints
    rest: Array

    def at(self, time: float) -> Array:
        return self.recorded.positions_then(time, self.rest, self.which)

    @property
    def thin(self) -> _Piece:
        """Some of its points, that tell how it moves."""
        few = slice(None, None, max(len(self.rows) // 64, 1))
        return replace(self, rows=self.rows[few], which=self.which[few], rest=self.rest[few])


class PartMotion:
    """Where the parts of a face are that its recording moves by themselves; others are left to be carried.

    Parameters
    ----------
    recorded : Recorded
    face : Face
        In the mesh of the recording.
    pose : callable
        How the head has moved at a time of the recording: a matrix (4, 4).
    """

    def __init__(self, recorded: Recorded, face: Face, pose: Callable[[float], Array]) -> None:
        self._face, self._pieces = face, {}
        if not face.parts:
            return
        self._size = face.frame.pupil_distance if face.landmarks else float(np.ptp(face.points, axis=0).max()) / 3.0
        times = np.linspace(recorded.track.times[0], recorded.track.times[-1], MOMENTS)
        poses: dict[float, Array] = {}

        def posed(time: float) -> Array:
            if time not in poses:
                poses[time] = pose(time)
            return poses[time]

        sources = {0: recorded} | dict(recorded.companions)
        found: dict[str, list[_Piece]] = {}
        for name, part in face.parts.items():
            rest = np.asarray(part.mesh.points, dtype=np.float64)
            for start, source in sources.items():
                piece = _piece(source, start, part.source_points, rest)
                if piece is not None and self._moves(piece, times, posed):
                    found.setdefault(name, []).append(piece)
        self._pieces = found

    def __contains__(self, name: str) -> bool:
        return name in self._pieces

    def at(self, time: float) -> dict[str, Array]:
        """Points (k, 3) by part at a time of the recording, in the unit of the mesh; NaN for those that it leaves."""
        out = {}
        for name, pieces in self._pieces.items():
            out[name] = np.full((self._face.parts[name].mesh.n_points, 3), np.nan)
            for piece in pieces:
                out[name][piece.rows] = piece.at(time)
        return out

    def gazes(self, time: float, pose: Array) -> Mapping[str, Array]:
        """The unit directions (3,) in which eyes that it turns look, on the head at rest, by side."""
        out = {}
        for eye in self._face.eyes:
            if (pieces := self._pieces.get(f"eye_{eye.side}")) is not None:
                ball = max(pieces, key=lambda piece: len(piece.rows)).thin
                turn = RigidAlignment(ball.rest).pose(ball.at(time), 0.1 * eye.radius, rounds=1)[:3, :3]
                gaze = np.linalg.solve(pose[:3, :3], turn @ eye.gaze)
                out[eye.side] = gaze / np.linalg.norm(gaze)
        return out

    def _moves(self, piece: _Piece, times: Array, pose: Callable[[float], Array]) -> bool:
        """Whether it moves on the head."""
        still, recorded = OWN * self._size, piece.recorded
        if recorded.deltas is not None:
            reach = np.abs(recorded.track.values).max(axis=0)
            if any(np.abs(recorded.deltas[k][piece.which]).max() * reach[k] > still for k in np.flatnonzero(reach)):
                return True
            if recorded.pose is None and recorded.bones is None and np.array_equal(pose(times[-1]), np.eye(4)):
                return False
        thin = piece.thin
        for time in times:
            head = pose(time)
            if np.abs(thin.at(time) - thin.rest @ head[:3, :3].T - head[:3, 3]).max() > still:
                return True
        return False


def _piece(source: Recorded, start: int, numbers: Ints | None, rest: Array) -> _Piece | None:
    """The points of a part (k, 3) that are in a recording: by number, or most of them by their places at rest."""
    if source.rest is None:
        return None
    if numbers is None:
        away, which = cKDTree(source.rest).query(rest)
        rows = np.flatnonzero(away <= OFF_REST * np.ptp(source.rest, axis=0).max())
        return _Piece(rows, source, which[rows], rest[rows]) if 2 * len(rows) > len(rest) else None
    rows = np.flatnonzero((numbers >= start) & (numbers < start + source.n_points))
    which = numbers[rows] - start
    return _Piece(rows, source, which, rest[rows]) if len(rows) and near(rest[rows], source.rest[which]) else None
