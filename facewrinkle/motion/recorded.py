"""Recorded motion: morph targets with weights over time, or vertex positions over time, that others made."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy.atlas import Atlas
from ..anatomy.face import Face
from ..errors import ParameterError, check_range, warn
from .action_units import units_of
from .skinning import Bones
from .track import Track, finite

Array = npt.NDArray[np.float64]

OFF_REST = 1e-4
"""Recording and face have to agree at rest to this share of their size."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A recording that moves a face in place of its muscles; see :meth:`of_shapes` and :meth:`of_positions`.

    It is in the unit and the coordinates of the mesh that it was recorded on. Muscle wrinkles on it follow the
    measured compression of the skin.

    Attributes
    ----------
    track : Track
        Weights (f, k) of the shapes, or positions (f, n, 3).
    names : tuple of str
        Of the shapes; empty for positions.
    deltas : ndarray, shape (k, n, 3), optional
        Displacements of the shapes.
    rest : ndarray, shape (n, 3), optional
        The mesh at rest.
    pose : callable, optional
        Matrix (4, 4) at a time that moves the whole mesh, as (x, y, z, 1).
    bones : Bones, optional
        What carries the points, after the shapes and in place of a pose.
    companions : mapping of int to Recorded
        Recordings of the meshes beside (eyes, teeth, lashes), of the same time, each by the number that its first point
        has in the mesh of :func:`facewrinkle.read_animation`.
    speed : float
        Seconds of the recording in one second.
    loop : bool
        Begin anew at the end; the last shape is held otherwise.

    Examples
    --------
    >>> import facewrinkle as fw
    >>> face = fw.default_face()
    >>> lifted = 2.0 * face.tissue.normals
    >>> recorded = Recorded.of_shapes([lifted], [[0.0], [1.0]], times=[0.0, 0.5], names=["puff"])
    >>> recorded.duration, recorded.weights(0.25)
    (0.5, {'puff': 0.5})
    >>> frame = fw.Simulation(face, layers=[], motion=recorded, time_step=0.25).step()
    >>> bool(np.allclose(frame.points[: len(face.points)] - face.points, face.tissue.normals))
    True
    """

    track: Track
    names: tuple[str, ...] = ()
    deltas: Array | None = None
    rest: Array | None = None
    pose: Callable[[float], Array] | None = None
    bones: Bones | None = None
    companions: Mapping[int, Recorded] = field(default_factory=dict)
    speed: float = 1.0
    loop: bool = False

    @classmethod
    def of_shapes(
        cls,
        deltas: npt.ArrayLike,
        weights: npt.ArrayLike | Track,
        *,
        times: npt.ArrayLike | None = None,
        fps: float | None = None,
        names: Sequence[str] | None = None,
        rest: npt.ArrayLike | None = None,
        pose: Callable[[float], Array] | None = None,
    ) -> Self:
        """Morph targets (blend shapes).

        Parameters
        ----------
        deltas : array_like, shape (k, n, 3)
            Displacements at weight 1, in the unit of the mesh.
        weights : array_like, shape (f, k), or Track
        times : array_like, shape (f,), optional
            Seconds.
        fps : float, optional
            In place of times: rows of weights in a second.
        names : sequence of str, optional
            Default: shape_0, shape_1, ...
        rest : array_like, shape (n, 3), optional
            The mesh at rest, to recognise points by where the face has fewer or others.
        pose : callable, optional
            See :class:`Recorded`.
        """
        moved = finite("deltas", deltas)
        if moved.ndim != 3 or moved.shape[2] != 3 or not moved.size:
            raise ParameterError(
                f"deltas must have the shape (shapes, points, 3), received {moved.shape}. One shape is deltas[None]."
            )
        track = (
            weights if isinstance(weights, Track) else Track(_times(weights, times, fps), finite("weights", weights))
        )
        labels = tuple(f"shape_{i}" for i in range(len(moved))) if names is None else tuple(map(str, names))
        if track.values.shape[1:] != (len(moved),):
            raise ParameterError(
                f"weights must have a column for each of the {len(moved)} shapes, received the shape "
                f"{track.values.shape}."
            )
        if len(labels) != len(moved) or len(set(labels)) < len(labels):
            raise ParameterError(
                f"{len(moved)} shapes need as many different names, received {', '.join(labels[:80])}."
            )
        return cls(track, labels, moved, _rest(rest, moved.shape[1]), pose)

    @classmethod
    def of_positions(
        cls,
        positions: npt.ArrayLike,
        *,
        times: npt.ArrayLike | None = None,
        fps: float | None = None,
        rest: npt.ArrayLike | None = None,
    ) -> Self:
        """Positions of all vertices over time (a vertex cache), interpolated linearly.

        Parameters
        ----------
        positions : array_like, shape (f, n, 3)
            In the unit and coordinates of the mesh.
        times, fps, rest
            See :meth:`of_shapes`.
        """
        where = finite("positions", positions)
        if where.ndim != 3 or where.shape[2] != 3 or not where.size:
            raise ParameterError(f"positions must have the shape (frames, points, 3), received {where.shape}.")
        return cls(Track(_times(where, times, fps), where), rest=_rest(rest, where.shape[1]))

    # --- what is recorded ----------------------------------------------------------------------

    @property
    def n_points(self) -> int:
        """Vertices that are moved."""
        return int((self.track.values if self.deltas is None else self.deltas).shape[1])

    @property
    def duration(self) -> float:
        """Seconds from the first to the last time of the recording, at its speed."""
        return float(self.track.times[-1] - self.track.times[0]) / self.speed

    def played(self, speed: float | None = None, loop: bool | None = None) -> Self:
        """The same recording, played faster, slower or endlessly."""
        changes: dict[str, Any] = {}
        if speed is not None:
            changes["speed"] = check_range("speed", speed, 1e-6, 1e6)
        return replace(self, **changes, loop=self.loop if loop is None else bool(loop))

    def recorded_time(self, time: float) -> float:
        """The time in the recording that is played at a time."""
        first, length = float(self.track.times[0]), float(self.track.times[-1] - self.track.times[0])
        passed = time * self.speed
        if self.loop and length > 0.0 and passed > length:
            passed %= length
        return first + min(passed, length)

    def weights(self, time: float) -> dict[str, float]:
        """Weights of the shapes by name.

        Raises
        ------
        ParameterError
            If positions were recorded.
        """
        if self.deltas is None:
            raise ParameterError("this recording holds positions, which have no weights.")
        return dict(zip(self.names, self.track.at(self.recorded_time(time)).tolist(), strict=True))

    def action_units(
        self, time: float, side: Literal["l", "r"] | None = None, atlas: Atlas | None = None
    ) -> dict[str, float]:
        """Action units of the shapes that bear ARKit's names, with their weights; the stronger side counts.

        Parameters
        ----------
        time : float
        side : {"l", "r"}, optional
            Only this side of the face.
        atlas : Atlas, optional
            Only units that it has muscles for: ``sim.express(recorded.action_units(t, atlas=sim.face.atlas))``.

        Warns
        -----
        FaceWrinkleWarning
            If units act that the atlas has no muscles for.

        Examples
        --------
        >>> face_shapes = np.zeros((2, 4, 3))
        >>> recorded = Recorded.of_shapes(face_shapes, [[0.7, 0.2]], fps=1, names=["mouthSmile_L", "jawOpen"])
        >>> recorded.action_units(0.0), recorded.action_units(0.0, side="r")
        ({'AU12': 0.7, 'AU26': 0.2}, {'AU26': 0.2})
        """
        units = units_of(self.weights(time), side)
        if atlas is None:
            return units
        if set(units) - set(atlas.action_units):
            lacking = sorted(set(units_of(dict.fromkeys(self.names, 1.0))) - set(atlas.action_units), key=_number)
            # The same at all times: Python shows it once.
            warn(f"the recording has shapes without muscles, which are left out: {', '.join(lacking)}.")
        return {unit: weight for unit, weight in units.items() if unit in atlas.action_units}

    def positions(self, time: float, rest: Array, which: npt.NDArray[np.int64] | slice = slice(None)) -> Array:
        """Positions (n, 3) of the vertices `which` whose rest is `rest` (n, 3)."""
        return self.positions_then(self.recorded_time(time), rest, which)

    def positions_then(self, time: float, rest: Array, which: npt.NDArray[np.int64] | slice = slice(None)) -> Array:
        """The same for a time of the recording itself."""
        values = self.track.at(time)
        if self.deltas is None:
            moved = values[which]
        else:
            moved = rest.copy()
            for k in np.flatnonzero(values):
                moved += values[k] * self.deltas[k][which]
        if self.bones is not None:
            return self.bones.carried(moved, time, which)
        if self.pose is not None:
            matrix = self.pose(time)
            if not np.array_equal(matrix, np.eye(4)):
                moved = moved @ matrix[:3, :3].T + matrix[:3, 3]
        return moved

    # --- on a face -----------------------------------------------------------------------------

    def points_of(self, face: Face) -> npt.NDArray[np.int64]:
        """The recorded point (n,) that each vertex of a face is.

        They are told by their numbers in the mesh that the face was made from, and, where the numbers do not fit, by
        their positions at rest.
        """
        n, points = self.n_points, face.points
        numbers = np.arange(len(points)) if face.source_points is None else face.source_points
        if numbers.max() < n:
            if self.rest is None:
                if face.source_points is not None or n == len(points):
                    return numbers
            elif near(self.rest[numbers], points):
                return numbers
        if self.rest is not None:
            nearest = cKDTree(self.rest).query(points)[1]
            if near(self.rest[nearest], points):
                return np.asarray(nearest)
        raise ParameterError(
            f"the recording has {n} points and was not made on this face, which has {len(points)}: at rest they must "
            "be at the same places. Fit the face to the mesh of the recording (the one that read_animation returns)."
        )


def near(ours: Array, theirs: Array) -> bool:
    """Whether points (n, 3) are those of a recording at rest."""
    return bool(np.abs(ours - theirs).max() <= OFF_REST * np.ptp(theirs, axis=0).max())


def _number(unit: str) -> tuple[int, str]:
    return int(unit.removeprefix("AU")), unit


def _times(values: Any, times: npt.ArrayLike | None, fps: float | None) -> Array:
    """Times of as many frames as there are values, from either."""
    if (times is None) == (fps is None):
        raise ParameterError("give either times (seconds of each frame) or fps (frames in a second).")
    if times is not None:
        return finite("times", times)
    return np.arange(len(values)) / check_range("fps", fps or 0.0, 1e-6, 1e6)


def _rest(rest: npt.ArrayLike | None, n: int) -> Array | None:
    if rest is None:
        return None
    points = finite("rest", rest)
    if points.shape != (n, 3):
        raise ParameterError(f"rest must hold the {n} points of the recording, received the shape {points.shape}.")
    return points
