"""Takes: weights of shapes over time, as phones and trackers record them, without a mesh of their own."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ..array_types import Array
from ..checks import finite
from ..errors import LARGEST, ParameterError, check_range, warn
from ..files import check_file, reading, text_of
from ..motion.action_units import named_shapes
from ..motion.track import Track
from .take_files import HEAD, SECONDS, SILENT, Table, is_number, of_json, of_table, plain_name, shapes_of_column

JSON = ".json"
SUFFIXES = (".csv", ".tsv", ".txt", JSON)

FPS, PHONE_FPS = 30.0, 60.0
"""Frames per second of a file that does not tell: of trackers, and of phones that write time codes."""

RATES = (24, 25, 30, 50, 60, 100, 120)
"""Frames per second that a time code may count."""

_CODE = re.compile(r"(\d+):(\d+):(\d+)[:;.](\d+(?:\.\d+)?)")


@dataclass(frozen=True, eq=False)
class Take:
    """Weights of shapes over time; made by :func:`facewrinkle.read_take` or from arrays.

    Attributes
    ----------
    names : tuple of str
        Shapes: ARKit's, visemes, further ones of :data:`facewrinkle.rigging.shapes.SETS`, or action units.
    times : ndarray, shape (f,)
        Increasing, from 0, s.
    weights : ndarray, shape (f, k)
        In [0, 1].
    head : ndarray, shape (f, 3), optional
        Turn of the head, radians: yaw to the subject's left, pitch upwards, roll to the subject's right shoulder.

    Examples
    --------
    >>> take = Take(("jawOpen",), np.array([0.0, 0.5]), np.array([[0.0], [1.0]]))
    >>> take
    Take(1 shapes, 0.5 s)
    >>> take.at(0.25)
    {'jawOpen': 0.5}
    """

    names: tuple[str, ...]
    times: Array
    weights: Array
    head: Array | None = None

    def __post_init__(self) -> None:
        track = Track(self.times, self.weights)
        if self.head is not None:
            head = finite("head", self.head)
            if head.shape != (len(track.times), 3):
                raise ParameterError(
                    f"a take needs three angles of the head at each of its {len(track.times)} times, received the "
                    f"shape {head.shape}."
                )
            object.__setattr__(self, "head", head)
        if track.values.shape[1:] != (len(self.names),) or not self.names:
            raise ParameterError(
                f"a take needs a column of weights for each of its {len(self.names)} shapes, received the shape "
                f"{track.values.shape}."
            )
        outside = np.asarray((track.values < 0.0) | (track.values > 1.0))
        if outside.any():
            which = [name for name, out in zip(self.names, np.atleast_1d(outside.any(axis=0)), strict=True) if out]
            warn(f"weights outside [0, 1] are clamped, in {int(outside.any(axis=1).sum())} frames: {_listed(which)}.")
        object.__setattr__(self, "times", track.times)
        object.__setattr__(self, "weights", np.clip(track.values, 0.0, 1.0))

    def __repr__(self) -> str:
        return f"Take({len(self.names)} shapes, {self.duration:g} s)"

    @property
    def duration(self) -> float:
        """Seconds from the first to the last frame."""
        return float(self.times[-1] - self.times[0])

    def at(self, time: float) -> dict[str, float]:
        """Return the weights at a time, by shape; they are interpolated linearly."""
        return dict(zip(self.names, Track(self.times, self.weights).at(time).tolist(), strict=True))

    def turn(self, time: float) -> Array:
        """Return the turn of the head at a time as a matrix (3, 3), in axes [left, up, forward]."""
        if self.head is None:
            return np.eye(3)
        yaw, pitch, roll = Track(self.times, self.head).at(time)
        return np.asarray(Rotation.from_euler("YXZ", [yaw, -pitch, roll]).as_matrix())

    def gained(self, gains: Mapping[str, float]) -> Take:
        """Return a take with weights of some shapes multiplied, for trackers that make too little of them.

        Names may be in any spelling; one without a side means both.

        Examples
        --------
        >>> take = Take(("mouthSmileLeft", "jawOpen"), np.zeros(1), np.array([[0.4, 0.2]]))
        >>> take.gained({"mouthSmile": 2.0}).at(0.0)
        {'mouthSmileLeft': 0.8, 'jawOpen': 0.2}
        """
        factors = np.ones(len(self.names))
        for asked, gain in gains.items():
            for name in named_shapes(asked, self.names):
                factors[self.names.index(name)] = check_range(f"the gain of {asked}", gain, 0.0, 100.0)
        return replace(self, weights=np.minimum(self.weights * factors, 1.0))


def read_take(path: str | Path, fps: float | None = None) -> Take:
    """Read what a phone or a tracker recorded: weights of shapes over time.

    - Tables (.csv, .tsv, .txt): the first row names the columns, each further row is a frame. Live Link Face writes
      such; so do many others. Names of shapes are ARKit's in any spelling, those of visemes, or action units, also
      those of OpenFace (``AU12_r``, from 0 to 5). A column `Timecode` or `time` tells when; HeadYaw, HeadPitch and
      HeadRoll turn the head, in radians.
    - JSON (.json): a list of frames, or an object that holds one. A frame has weights by name, or a list of categories
      as MediaPipe's face landmarker gives them (`categoryName` and `score`); it may have a `timestamp`, and a
      `facialTransformationMatrixes` that turns the head. An object with a list of numbers for each name will do too.

    Parameters
    ----------
    path : path
    fps : float, optional
        Frames per second of files that tell no times, and of time codes. Default: for time codes what they count up to
        (60 if they do not reach a full second); otherwise 30.

    Returns
    -------
    Take

    Raises
    ------
    MeshError
        If the file cannot be read.
    ParameterError
        If it has no shapes, a row has the wrong number of columns, a weight is no number, or times do not increase.

    Warns
    -----
    FaceWrinkleWarning
        For columns that are no shapes, frames without values, and weights outside [0, 1].

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "take.csv"
    ...     _ = path.write_text("time, JawOpen, mouth_frown\\n0.0, 0.1, 0\\n0.1, 0.6, 0.5\\n")
    ...     take = read_take(path)
    >>> take, take.names
    (Take(3 shapes, 0.1 s), ('jawOpen', 'mouthFrownLeft', 'mouthFrownRight'))
    """
    path = Path(os.path.expanduser(path))
    check_file(path)
    if fps is not None:
        check_range("fps", fps, 1e-3, 1e4)
    if path.suffix.lower() not in SUFFIXES:
        raise ParameterError(f"takes are read from {', '.join(SUFFIXES)} files, received {path.name}.")
    with reading(path):
        table = (of_json if path.suffix.lower() == JSON else of_table)(path, text_of(path))
        return _take(table, path.name, fps)


def _take(table: Table, file: str, fps: float | None) -> Take:
    columns: dict[str, Array] = {}
    unknown = []
    for name, values in zip(table.names, table.values.T, strict=True):
        shapes, most = shapes_of_column(name)
        for shape in shapes:
            columns[shape] = np.fmax(columns.get(shape, values / most), values / most)
        if not shapes and plain_name(name) not in (*SILENT, *SECONDS, *HEAD, "timecode"):
            unknown.append(name)
    if not columns:
        raise ParameterError(
            f"{file} has no column for a shape: ARKit's names are needed, such as jawOpen, or action units; received "
            f"{_listed(table.names)}."
        )
    if unknown:
        warn(f"{file}: {len(unknown)} columns are no shapes, and are left out: {_listed(unknown)}.")
    weights = np.stack(list(columns.values()), axis=1)
    head = table.head
    plain = [plain_name(name) for name in table.names]
    if head is None and set(HEAD) <= set(plain):
        head = table.values[:, [plain.index(name) for name in HEAD]]
    times = _times(table.times, len(weights), file, fps)
    seen = np.asarray(~np.isnan(weights).any(axis=1))
    if not seen.any():
        raise ParameterError(f"{file} has no frame with a weight for each of its shapes. Record it again.")
    if not seen.all():
        warn(f"{file}: {int((~seen).sum())} of {len(seen)} frames lack values, and those around are used.")
    fresh = seen & np.concatenate([[True], np.diff(np.maximum.accumulate(times)) > 0.0])
    times, weights = times[fresh], weights[fresh]
    if head is not None:
        head = head[fresh]
        known = ~np.isnan(head).any(axis=1)
        head = (
            np.stack([np.interp(times, times[known], np.unwrap(angle[known])) for angle in head.T], axis=1)
            if known.any()
            else None
        )
    return Take(tuple(columns), times - times[0], weights, head)


def _times(given: Sequence[str] | None, n: int, file: str, fps: float | None) -> Array:
    """Return the seconds (n,) of rows."""
    if given is None:
        return np.arange(n) / (fps or FPS)
    codes = [_CODE.fullmatch(text) for text in given]
    if all(codes):
        parts = np.array([[_bounded(x, file) for x in code.groups()] for code in codes if code])
        rate = fps or (PHONE_FPS if parts[0, 2] == parts[-1, 2] else _counted(parts[:, 3]))
        seconds = parts[:, :3] @ [3600.0, 60.0, 1.0] + parts[:, 3] / rate
        seconds += 86400.0 * np.cumsum(np.diff(seconds, prepend=seconds[0]) < -43200.0)  # past midnight
    else:
        seconds = np.array([_bounded(text.replace(",", "."), file) for text in given])
        while len(seconds) > 1 and np.median(np.diff(seconds)) > 1.0:  # thousandths, or millionths
            seconds = seconds / 1000.0
    back = np.flatnonzero(~(np.diff(seconds) >= 0.0))
    if len(back):
        raise ParameterError(f"{file}: times must increase, and row {int(back[0]) + 3} comes before the one above it.")
    return np.asarray(seconds - seconds[0])


def _bounded(text: str, file: str) -> float:
    """Return a number of a time; an error for what is none, or too large to count with."""
    if not is_number(text) or not abs(float(text)) < LARGEST:
        raise ParameterError(
            f"{file}: times must be seconds, or time codes such as 10:31:02:15.5, received {text[:40]!r}."
        )
    return float(text)


def _counted(frames: Array) -> float:
    """Return the frames per second that time codes count."""
    most = int(frames.max())
    return float(next((rate for rate in RATES if rate > most), most + 1))


def _listed(names: Iterable[str], most: int = 8) -> str:
    every = list(names)
    return ", ".join(every[:most]) + (f" and {len(every) - most} more" if len(every) > most else "")
