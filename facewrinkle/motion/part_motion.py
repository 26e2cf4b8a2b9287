"""Parts that a recording moves beside the skin: lashes that blink, eyes that turn, teeth that part."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..anatomy.face import Face
from ..array_types import Array, IntArray
from ..geometry.rigid_alignment import RigidAlignment
from .recorded import OFF_REST, Recorded, same_places

LEAST_MOTION = 0.003
"""Parts that move on the head by less than this, in distances between the pupils, go along with the face."""

SAMPLED_TIMES = 48
"""Times of a recording at which parts are compared with the head, to see if they move on it."""


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
        self._face, self._pieces = face, {}
        if not face.parts:
            return
        self._size = face.frame.pupil_distance if face.landmarks else float(np.ptp(face.points, axis=0).max()) / 3.0
        times = np.linspace(recorded.track.times[0], recorded.track.times[-1], SAMPLED_TIMES)
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
                turn = RigidAlignment(ball.rest).pose(ball.at(time), 0.1 * eye.radius, rounds=1)[:3, :3]
                gaze = np.linalg.solve(pose[:3, :3], turn @ eye.gaze)
                out[eye.side] = gaze / np.linalg.norm(gaze)
        return out

    def _moves(self, piece: _Piece, times: Array, pose: Callable[[float], Array]) -> bool:
        """Return True if a piece moves on the head."""
        still, recorded = LEAST_MOTION * self._size, piece.recorded
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
