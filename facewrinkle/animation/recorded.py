"""Recorded motion: tracks of values over time, and what they move: morph targets, vertex positions, or bones."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, Self, get_args

import numpy as np
import numpy.typing as npt
import pyvista as pv
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from ..anatomy import Atlas, Face
from ..array_types import Array, IntArray
from ..checks import finite
from ..errors import ParameterError, check_name, check_range, type_of, warn
from ..mesh import Surface, merged
from .action_units import units_of

Interpolation = Literal["linear", "step", "cubic"]


@dataclass(frozen=True, eq=False)
class Track:
    """Values at some times, interpolated between them.

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
            object.__setattr__(self, name, finite(name, getattr(self, name)))
        check_name("interpolation", self.interpolation, get_args(Interpolation))
        if self.times.ndim != 1 or not len(self.times) or not (np.diff(self.times) > 0.0).all():
            raise ParameterError(f"times must be a list of increasing seconds, received {np.ravel(self.times)[:8]}.")
        if self.values.ndim < 1 or len(self.values) != len(self.times):
            raise ParameterError(
                f"there must be as many values as times, received {len(self.times)} times and values of the shape "
                f"{self.values.shape}."
            )
        if self.interpolation == "cubic" and (self.slopes is None or self.slopes.shape != (2, *self.values.shape)):
            raise ParameterError("cubic interpolation needs the slopes before and after each time, as (2, f, ...).")

    def at(self, time: float) -> Array:
        """Return the value at a time; the first value before the first time, and the last one after the last."""
        i, share = self.place(time)
        if share == 0.0 or self.interpolation == "step":
            return self.values[i]
        if self.interpolation == "cubic":
            from scipy.interpolate import CubicHermiteSpline  # takes a fifth of a second to import

            ends, slopes = slice(i, i + 2), np.asarray(self.slopes)
            spline = CubicHermiteSpline(self.times[ends], self.values[ends], [slopes[1, i], slopes[0, i + 1]])
            return np.asarray(spline(time))
        # SciPy takes three times as long for the positions of a whole face.
        return np.asarray(self.values[i] + share * (self.values[i + 1] - self.values[i]))

    def place(self, time: float) -> tuple[int, float]:
        """Return the interval that a time lies in, and the share of the interval that has passed, in [0, 1]."""
        times = self.times
        if time <= times[0]:
            return 0, 0.0
        if time >= times[-1]:
            return len(times) - 1, 0.0
        i = int(np.searchsorted(times, time, side="right")) - 1
        return i, (time - float(times[i])) / float(times[i + 1] - times[i])


@dataclass(frozen=True, eq=False)
class Bones:
    """Bones that carry the points of a mesh: ``p(t) = S(t) S(rest)^-1 p(rest)``, with ``S = sum_b w_b B_b`` per point.

    Attributes
    ----------
    weights : sparse array, shape (n, b)
        Share of each bone in the motion of each point; those of a point add up to 1.
    matrices : callable
        Gives the matrices (b, 4, 4) of the bones at a time.
    rest : ndarray, shape (b, 4, 4)
        Matrices of the bones at rest.

    Examples
    --------
    >>> half = csr_array(np.array([[1.0, 0.0], [0.5, 0.5]]))  # two bones, of which one rises
    >>> still, risen = np.eye(4), np.eye(4)
    >>> risen[1, 3] = 2.0
    >>> bones = Bones(half, lambda time: np.array([still, risen]), np.array([still, still]))
    >>> bones.positions_at(1.0, np.zeros((2, 3))).tolist()
    [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    """

    weights: csr_array
    matrices: Callable[[float], Array]
    rest: Array

    def positions_at(self, time: float, rest: Array, numbers: IntArray | slice = slice(None)) -> Array:
        """Return positions (n, 3) of the points `numbers` at a time; `rest` (n, 3) is where they are without bones."""
        turn = self._blended(self.matrices(time))[numbers] @ self._back[numbers]
        return np.asarray(np.einsum("nij,nj->ni", turn[:, :3, :3], rest) + turn[:, :3, 3])

    def _blended(self, matrices: Array) -> Array:
        return np.asarray((self.weights @ matrices.reshape(-1, 16)).reshape(-1, 4, 4))

    @cached_property
    def _back(self) -> Array:
        """Matrices from rest to the coordinates of the bones; directions that the rest pose flattens stay flat."""
        return np.asarray(np.linalg.pinv(self._blended(self.rest)))


OFF_REST = 1e-4
"""Recording and face must agree at rest to this share of their size."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A recording that moves a face in place of its muscles; made by :meth:`of_shapes` and :meth:`of_positions`.

    It is in the unit and coordinates of the mesh that it was recorded on. Muscle wrinkles then follow the measured
    compression of the skin.

    Attributes
    ----------
    track : Track
        Weights (f, k) of the shapes, or positions (f, n, 3).
    names : tuple of str
        Names of the shapes; empty for positions.
    deltas : ndarray, shape (k, n, 3), optional
        Displacements of the shapes.
    rest : ndarray, shape (n, 3), optional
        The mesh at rest.
    pose : callable, optional
        Gives the matrix (4, 4) that moves the whole mesh at a time; it multiplies columns (x, y, z, 1).
    bones : Bones, optional
        Bones that carry the points after the shapes have displaced them; in place of a pose.
    companions : mapping of int to Recorded
        Recordings of other meshes (eyes, teeth, lashes) over the same time, each by the number that its first point has
        in the mesh of :func:`facewrinkle.read_animation`.
    speed : float
        Seconds of the recording in one second.
    loop : bool
        Begin again after the end; otherwise the last shape is held.

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

    def __post_init__(self) -> None:
        if not isinstance(self.track, Track):
            raise ParameterError(
                f"a recording is made of a Track, received {type_of(self.track)}. Recorded.of_positions takes the "
                "positions of all points over time, Recorded.of_shapes shapes and their weights."
            )

    def __repr__(self) -> str:
        return f"Recorded({len(self.names)} shapes, {self.duration:g} s)"

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
        """Make a recording of morph targets (blend shapes).

        Parameters
        ----------
        deltas : array_like, shape (k, n, 3)
            Displacements at weight 1, in the unit of the mesh.
        weights : array_like, shape (f, k), or Track
        times : array_like, shape (f,), optional
            Seconds.
        fps : float, optional
            In place of times: rows of weights per second.
        names : sequence of str, optional
            Default: shape_0, shape_1, ...
        rest : array_like, shape (n, 3), optional
            The mesh at rest, by which points are recognized where the face has fewer points, or other ones.
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
        """Make a recording of the positions of all vertices over time (a vertex cache), interpolated linearly.

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
        """Number of vertices that are moved."""
        return int((self.track.values if self.deltas is None else self.deltas).shape[1])

    @property
    def duration(self) -> float:
        """Seconds from the first to the last time, at the speed of the recording."""
        return float(self.track.times[-1] - self.track.times[0]) / self.speed

    @property
    def some_times(self) -> Array:
        """Times (48,) of the recording at which its motion is looked at as a whole."""
        return np.linspace(self.track.times[0], self.track.times[-1], 48)

    def played(self, speed: float | None = None, loop: bool | None = None) -> Self:
        """Return the same recording, to be played faster, slower or in a loop."""
        return replace(
            self,
            speed=self.speed if speed is None else check_range("speed", speed, 1e-6, 1e6),
            loop=self.loop if loop is None else bool(loop),
        )

    def recorded_time(self, time: float) -> float:
        """Return the time of the recording that is played at a time."""
        first, length = float(self.track.times[0]), float(self.track.times[-1] - self.track.times[0])
        passed = time * self.speed
        if self.loop and length > 0.0 and passed > length:
            passed %= length
        return first + min(passed, length)

    def weights(self, time: float) -> dict[str, float]:
        """Return the weights of the shapes at a time, by name.

        Raises
        ------
        ParameterError
            If positions were recorded.
        """
        if self.deltas is None:
            raise ParameterError("this recording holds positions, which have no weights.")
        return dict(zip(self.names, self.track.at(self.recorded_time(time)).tolist(), strict=True))

    def action_units(self, time: float, atlas: Atlas | None = None) -> dict[str, float]:
        """Return the weights of the action units of shapes that bear ARKit's names; the stronger side counts.

        Parameters
        ----------
        time : float
        atlas : Atlas, optional
            Only units for which it has muscles: ``sim.express(recorded.action_units(t, atlas=sim.face.atlas))``.

        Warns
        -----
        FaceWrinkleWarning
            If units have a weight for which the atlas has no muscles.

        Examples
        --------
        >>> face_shapes = np.zeros((2, 4, 3))
        >>> recorded = Recorded.of_shapes(face_shapes, [[0.7, 0.2]], fps=1, names=["mouthSmile_L", "jawOpen"])
        >>> recorded.action_units(0.0)
        {'AU12': 0.7, 'AU27': 0.2}
        """
        units = units_of(self.weights(time))
        if atlas is None:
            return units
        if set(units) - set(atlas.action_units):
            lacking = set(units_of(dict.fromkeys(self.names, 1.0))) - set(atlas.action_units)
            listed = ", ".join(sorted(lacking, key=lambda unit: int(unit.removeprefix("AU"))))
            # The message is the same at all times, so that Python shows it once.
            warn(f"the recording has shapes without muscles, which are left out: {listed}.")
        return {unit: weight for unit, weight in units.items() if unit in atlas.action_units}

    def positions_at(self, time: float, rest: Array, numbers: IntArray | slice = slice(None)) -> Array:
        """Return positions (n, 3) of the points `numbers`, which are at `rest` (n, 3), at a time of the recording.

        That is the time itself, whatever speed the recording is played at; see :meth:`recorded_time`.
        """
        values = self.track.at(time)
        if self.deltas is None:
            moved = values[numbers]
        else:
            moved = rest.copy()
            for k in np.flatnonzero(values):
                moved += values[k] * self.deltas[k][numbers]
        if self.bones is not None:
            return self.bones.positions_at(time, moved, numbers)
        if self.pose is not None:
            matrix = self.pose(time)
            moved = moved @ matrix[:3, :3].T + matrix[:3, 3]
        return moved

    # --- on a face -----------------------------------------------------------------------------

    def points_of(self, face: Face) -> IntArray:
        """Return the number (n,) of the recorded point that each vertex of a face is.

        Points are recognized by their numbers in the mesh that the face was made from and, where these do not fit, by
        their positions at rest.

        Raises
        ------
        ParameterError
            If the recording was not made on this face.
        """
        n, points = self.n_points, face.points
        numbers = np.arange(len(points)) if face.source_points is None else face.source_points
        if numbers.max() < n:
            if self.rest is None:
                if face.source_points is not None or n == len(points):
                    return numbers
            elif same_places(self.rest[numbers], points):
                return numbers
        if self.rest is not None:
            nearest = cKDTree(self.rest).query(points)[1]
            if same_places(self.rest[nearest], points):
                return np.asarray(nearest)
        raise ParameterError(
            f"the recording has {n} points and was not made on this face, which has {len(points)}: at rest they must "
            "be at the same places. Fit the face to the mesh of the recording (the one that read_animation returns)."
        )


def with_companions(
    surface: Surface, recorded: Recorded, others: Iterable[tuple[Surface, Recorded | None]]
) -> tuple[pv.PolyData, Recorded]:
    """Return a mesh with others after it, and its recording with theirs; those without one keep still."""
    surfaces, companions, start = [surface], {}, len(surface.points)
    for other, own in others:
        surfaces.append(other)
        if own is not None:
            companions[start] = own
        start += len(other.points)
    return merged(surfaces).to_polydata(), replace(recorded, companions=companions)


def same_places(ours: Array, theirs: Array) -> bool:
    """Return True if points (n, 3) are at the same places, within the share `OFF_REST` of their extent.

    Examples
    --------
    >>> corners = np.eye(3)
    >>> same_places(corners, corners + 1e-6), same_places(corners, corners + 0.1)
    (True, False)
    """
    return bool(np.abs(ours - theirs).max() <= OFF_REST * np.ptp(theirs, axis=0).max())


def _times(values: Any, times: npt.ArrayLike | None, fps: float | None) -> Array:
    """Return the times of the frames in `values`: as given, or from the frames per second."""
    if (times is None) == (fps is None):
        raise ParameterError("give either times (the second of each frame) or fps (frames per second).")
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
