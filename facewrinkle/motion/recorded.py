"""Recorded motion: morph targets with weights over time, or vertex positions over time, that others made."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..anatomy.atlas import Atlas
from ..anatomy.face import Face
from ..anatomy.muscles import EyeMuscle
from ..anatomy.parts import STILL
from ..errors import LARGEST, FaceWrinkleWarning, ParameterError, check_range, unknown_name
from ..geometry.rigid import Rigid
from .action_units import looks_of, units_of
from .base import Undriven

Array = npt.NDArray[np.float64]
Interpolation = Literal["linear", "step", "cubic"]
INTERPOLATIONS = ("linear", "step", "cubic")

OFF_REST = 1e-4
"""Recording and face have to agree at rest to this share of their size."""


@dataclass(frozen=True, eq=False)
class Track:
    """Values at some times, and between them.

    Attributes
    ----------
    times : ndarray, shape (f,)
        Increasing, s.
    values : ndarray, shape (f, ...)
    interpolation : {"linear", "step", "cubic"}
        "step" holds each value until the next; "cubic" is the Hermite spline of `slopes`.
    slopes : ndarray, shape (2, f, ...), optional
        Derivatives before and after each time.

    Examples
    --------
    >>> Track(np.array([0.0, 2.0]), np.array([[1.0], [5.0]])).at(0.5)
    array([2.])
    """

    times: Array
    values: Array
    interpolation: Interpolation = "linear"
    slopes: Array | None = None

    def __post_init__(self) -> None:
        for name in ("times", "values") + (("slopes",) if self.slopes is not None else ()):
            object.__setattr__(self, name, _finite(name, getattr(self, name)))
        if self.interpolation not in INTERPOLATIONS:
            raise unknown_name("interpolation", self.interpolation, INTERPOLATIONS)
        if self.times.ndim != 1 or not len(self.times) or not (np.diff(self.times) > 0.0).all():
            raise ParameterError(f"times must be a list of increasing seconds, received {self.times[:8]}.")
        if self.values.ndim < 1 or len(self.values) != len(self.times):
            raise ParameterError(
                f"there must be as many values as times, received {len(self.times)} times and values of the shape "
                f"{self.values.shape}."
            )
        if self.interpolation == "cubic" and (self.slopes is None or self.slopes.shape != (2, *self.values.shape)):
            raise ParameterError("cubic interpolation needs the slopes before and after each time, as (2, f, ...).")

    def at(self, time: float) -> Array:
        """The value at a time; before the first and after the last time it is theirs."""
        i, share, length = self.place(time)
        a = self.values[i]
        if share == 0.0 or self.interpolation == "step":
            return a
        b = self.values[i + 1]
        if self.interpolation == "linear" or self.slopes is None:
            return np.asarray(a + share * (b - a))
        s, s2, s3 = share, share**2, share**3
        out, into = length * self.slopes[1, i], length * self.slopes[0, i + 1]
        return np.asarray(a + (3 * s2 - 2 * s3) * (b - a) + (s3 - 2 * s2 + s) * out + (s3 - s2) * into)

    def place(self, time: float) -> tuple[int, float, float]:
        """The interval that a time lies in, how far in it as a share of its length, and that length."""
        times = self.times
        if time >= times[-1]:
            return len(times) - 1, 0.0, 1.0
        i = max(int(np.searchsorted(times, time, side="right")) - 1, 0)
        length = float(times[i + 1] - times[i])
        return i, max((time - float(times[i])) / length, 0.0), length


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
    >>> frame = fw.Simulation(face, motion=recorded, time_step=0.25).step()
    >>> bool(np.allclose(frame.points[: len(face.points)] - face.points, face.tissue.normals))
    True
    """

    track: Track
    names: tuple[str, ...] = ()
    deltas: Array | None = None
    rest: Array | None = None
    pose: Callable[[float], Array] | None = None
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
        moved = _finite("deltas", deltas)
        if moved.ndim != 3 or moved.shape[2] != 3 or not moved.size:
            raise ParameterError(
                f"deltas must have the shape (shapes, points, 3), received {moved.shape}. One shape is deltas[None]."
            )
        track = (
            weights if isinstance(weights, Track) else Track(_times(weights, times, fps), _finite("weights", weights))
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
        where = _finite("positions", positions)
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
            warnings.warn(  # the same at all times: Python shows it once
                f"the recording has shapes without muscles, which are left out: {', '.join(lacking)}.",
                FaceWrinkleWarning,
                stacklevel=2,
            )
        return {unit: weight for unit, weight in units.items() if unit in atlas.action_units}

    def positions(self, time: float, rest: Array, which: npt.NDArray[np.int64] | slice = slice(None)) -> Array:
        """Positions (n, 3) of the vertices `which` whose rest is `rest` (n, 3)."""
        recorded = self.recorded_time(time)
        values = self.track.at(recorded)
        if self.deltas is None:
            moved = values[which]
        else:
            moved = rest.copy()
            for k in np.flatnonzero(values):
                moved += values[k] * self.deltas[k][which]
        if self.pose is not None:
            matrix = self.pose(recorded)
            if not np.array_equal(matrix, np.eye(4)):
                moved = moved @ matrix[:3, :3].T + matrix[:3, 3]
        return moved

    # --- on a face -----------------------------------------------------------------------------

    def on(self, face: Face, time_step: float = 0.02) -> Playback:
        """The motion that plays this on a face.

        Raises
        ------
        ParameterError
            If it was recorded on another mesh.
        """
        return Playback(self, face, time_step)

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
            elif _near(self.rest[numbers], points):
                return numbers
        if self.rest is not None:
            nearest = cKDTree(self.rest).query(points)[1]
            if _near(self.rest[nearest], points):
                return np.asarray(nearest)
        raise ParameterError(
            f"the recording has {n} points and was not made on this face, which has {len(points)}: at rest they must "
            "be at the same places. Fit the face to the mesh of the recording (the one that read_animation returns)."
        )


class Playback(Undriven):
    """The motion that plays a recording on a face.

    Parameters
    ----------
    recorded : Recorded
    face : Face
    time_step : float
        Seconds per step.
    """

    def __init__(self, recorded: Recorded, face: Face, time_step: float = 0.02) -> None:
        self.recorded = recorded
        self.time_step = check_range("time_step", time_step, 1e-9, 1e9)
        self._which = recorded.points_of(face)
        baked = recorded.deltas is None and face.landmarks
        self._head, self._near = Rigid(face.points) if baked else None, STILL * face.frame.pupil_distance
        self._rest, self._unit = face.points, face.unit
        muscles = {(m.side, m.turn): name for name, m in face.muscles.items() if isinstance(m, EyeMuscle)}
        looks = looks_of(recorded.names).items()
        self._looks = {shape: muscles[look] for shape, look in looks if look in muscles}
        self._face = face
        self.points = self._rest * self._unit
        self.reset()

    def reset(self) -> None:
        """See :class:`facewrinkle.Motion`."""
        self._steps = 0

    def step(self) -> Array:
        """See :class:`facewrinkle.Motion`; the first step leads to the time of one time step."""
        self._steps += 1
        return self.recorded.positions(self._steps * self.time_step, self._rest, self._which) * self._unit

    @property
    def gazes(self) -> Mapping[str, Array]:
        """The unit directions (3,) in which the eyes of the head at rest look, by side, where shapes turn them."""
        if not self._looks:
            return {}
        weights = self.recorded.weights(self._steps * self.time_step)
        rates = {muscle: min(max(weights[shape], 0.0), 1.0) for shape, muscle in self._looks.items()}
        return self._face.gazes(rates)

    @property
    def pose(self) -> Array | None:
        """How the head as a whole has moved since rest: a matrix (4, 4) in the unit of the mesh, or None.

        As it was recorded, and as most positions tell where these were recorded.
        """
        recorded, time = self.recorded, self._steps * self.time_step
        pose = None if recorded.pose is None else recorded.pose(recorded.recorded_time(time))
        if self._head is None:
            return pose
        own = replace(recorded, pose=None).positions(time, self._rest, self._which)
        baked = self._head.pose(own, self._near)
        return baked if pose is None else pose @ baked


def _number(unit: str) -> tuple[int, str]:
    return int(unit.removeprefix("AU")), unit


def _near(ours: Array, theirs: Array) -> bool:
    return bool(np.abs(ours - theirs).max() <= OFF_REST * np.ptp(theirs, axis=0).max())


def _finite(name: str, values: object) -> Array:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"{name} must be numbers in rows of one length, received {type(values).__name__}."
        ) from None
    if not (np.abs(array) < LARGEST).all():
        broken = np.argwhere(~(np.abs(array) < LARGEST))[0].tolist()
        raise ParameterError(f"{name} must be finite; entry {broken} is {array[tuple(broken)]}. Record it again.")
    return array


def _times(values: Any, times: npt.ArrayLike | None, fps: float | None) -> Array:
    """Times of as many frames as there are values, from either."""
    if (times is None) == (fps is None):
        raise ParameterError("give either times (seconds of each frame) or fps (frames in a second).")
    if times is not None:
        return _finite("times", times)
    return np.arange(len(values)) / check_range("fps", fps or 0.0, 1e-6, 1e6)


def _rest(rest: npt.ArrayLike | None, n: int) -> Array | None:
    if rest is None:
        return None
    points = _finite("rest", rest)
    if points.shape != (n, 3):
        raise ParameterError(f"rest must hold the {n} points of the recording, received the shape {points.shape}.")
    return points
