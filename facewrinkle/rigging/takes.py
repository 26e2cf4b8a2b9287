"""Takes: weights of shapes over time, as phones and trackers record them, without a mesh of their own."""

from __future__ import annotations

import csv
import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..animation.action_units import named_shapes, plain_name, sided
from ..animation.recorded import Track
from ..array_types import Array
from ..checks import finite
from ..errors import LARGEST, ParameterError, check_range, warn
from ..files import check_file, reading, text_of
from .shapes import ARKIT, SETS

SECONDS = {"time", "times", "t", "s", "sec", "seconds", "timestamp", "timestampms", "timems", "ms", "timesec"}
"""Plain names of columns with times; the unit follows from the steps, which last less than a second."""

HEAD = ("headyaw", "headpitch", "headroll")
"""Plain names of columns with the turn of the head, in radians."""

SILENT = {"blendshapecount", "neutral", "frame", "faceid", "confidence", "success"} | {
    f"{side}eye{turn}" for side in ("left", "right") for turn in ("yaw", "pitch", "roll")
}
"""Plain names of columns that are not needed: eyes turn by eyeLookInLeft and so on."""

SHAPES, MATRICES = "faceBlendshapes", "facialTransformationMatrixes"
"""Keys of a result of MediaPipe's face landmarker."""


class Table(NamedTuple):
    """The content of a file: values (f, c) of columns, NaN where there is none, and time codes or times of the rows."""

    names: list[str]
    values: Array
    times: Sequence[str] | None


def of_table(path: Path, text: str) -> Table:
    """Return the table of a text file, whose first row names the columns."""
    lines = [line for line in text.splitlines() if line.strip()]
    if not lines:
        raise ParameterError(f"{path.name} is empty. A table needs a row with the names of its columns.")
    separator = max(",;\t", key=lines[0].count)
    table = csv.DictReader(lines, delimiter=separator, skipinitialspace=True, restval="")
    names, rows = [name for name in table.fieldnames or () if name], list(table)
    if not rows:
        raise ParameterError(f"{path.name} has no frames: there is nothing below the names of its columns.")
    for number, row in enumerate(rows, start=2):
        if any(row.get(None, ())):  # a separator at the end of a row does no harm
            raise ParameterError(f"{path.name}: row {number} has more columns than the first one. Export it again.")
    when = next((name for name in names if plain_name(name) in {"timecode", *SECONDS}), None)
    values = [[np.nan if name == when else _number(row[name], path.name, name) for name in names] for row in rows]
    return Table(names, np.array(values), None if when is None else [row[when] for row in rows])


def _number(cell: str, file: str, column: str) -> float:
    """Return the number in a cell; NaN for an empty one, and for words in columns that are not needed."""
    try:
        return float(cell.replace(",", ".")) if cell else np.nan
    except ValueError:
        if shapes_of_column(column)[0] or plain_name(column) in HEAD:
            raise ParameterError(f"{file}: the column {column} must hold numbers, received {cell[:40]!r}.") from None
        return np.nan


def of_json(path: Path, text: str) -> Table:
    """Return the frames of a JSON file as a table."""
    try:
        content = json.loads(text)
    except ValueError as problem:
        raise ParameterError(f"{path.name} is not valid JSON: {problem}.") from None
    frames = _frames(content)
    if not frames:
        raise ParameterError(
            f"{path.name} has no frames. Needed is a list of them, each with weights by name, or results of "
            "MediaPipe's face landmarker."
        )
    found = [_weights(frame) for frame in frames]
    names = list(dict.fromkeys(name for weights in found for name in weights))
    values = np.array([[weights.get(name, np.nan) for name in names] for weights in found])
    seen = ~np.isnan(values).all(axis=1)
    values[seen] = np.nan_to_num(values[seen])  # a frame that names some shapes has none of the others
    keys = {key for key in frames[0] if plain_name(key) in SECONDS}
    times = [str(frame[min(keys)]) for frame in frames] if keys and all(min(keys) in f for f in frames) else None
    turns = np.array([_turn(frame) for frame in frames])
    if not np.isnan(turns).all():
        names, values = [*HEAD, *names], np.hstack([turns, values])
    return Table(names, values, times)


def _frames(content: Any) -> list[Mapping[str, Any]]:
    """Return the frames of the content of a JSON file: a list of them, or an object that holds one."""
    if isinstance(content, Mapping) and SHAPES not in content:
        content = next((value for value in content.values() if isinstance(value, list)), [content])
    frames = content if isinstance(content, list) else [content]
    return [frame for frame in frames if isinstance(frame, Mapping)]


def _weights(frame: Mapping[str, Any]) -> dict[str, float]:
    """Return the weights of a frame of MediaPipe, of its first face, or of one that has them by name."""
    if SHAPES in frame:
        return {str(c["categoryName"]): float(c["score"]) for face in frame[SHAPES][:1] for c in face["categories"]}
    return {
        str(name): float(value)
        for name, value in frame.items()
        if isinstance(value, int | float) and plain_name(str(name)) not in SECONDS
    }


def _turn(frame: Mapping[str, Any]) -> Array:
    """Return yaw, pitch and roll of the first matrix of a frame of MediaPipe, 16 numbers by columns; NaN for none."""
    first = next(iter(frame.get(MATRICES) or ()), None)
    matrix = np.full((4, 4), np.nan) if first is None else np.array(first["data"], float).reshape(4, 4).T
    if not np.isfinite(matrix).all() or np.linalg.det(matrix[:3, :3]) < 1e-9:
        return np.full(3, np.nan)
    yaw, down, roll = Rotation.from_matrix(matrix[:3, :3]).as_euler("YXZ")
    return np.array([yaw, -down, roll])


_SHAPES = {plain_name(name): name for shapes in SETS.values() for name in shapes}


def shapes_of_column(column: str) -> tuple[list[str], float]:
    """Return the shapes that a column names, and the value that is a weight of 1.

    Examples
    --------
    >>> shapes_of_column("EyeBlink_L"), shapes_of_column("mouthFrown")
    ((['eyeBlinkLeft'], 1.0), (['mouthFrownLeft', 'mouthFrownRight'], 1.0))
    >>> shapes_of_column("AU06_r"), shapes_of_column("hair")
    ((['AU6'], 5.0), ([], 1.0))
    """
    plain = plain_name(column)
    if plain in _SHAPES:
        return [_SHAPES[plain]], 1.0
    if unit := re.fullmatch(r"au0*(\d+)(r?)", plain):
        return [f"AU{unit[1]}"], 5.0 if unit[2] else 1.0  # intensities of OpenFace, such as AU12_r, go up to 5
    stem, side = sided(column)
    words = {"l": ["Left"], "r": ["Right"], None: ["", "Left", "Right"]}[side]
    return [f"{stem}{word}" for word in words if f"{stem}{word}" in ARKIT], 1.0


SUFFIXES = (".csv", ".tsv", ".txt", ".json")

FPS, PHONE_FPS = 30.0, 60.0
"""Frames per second of a file that does not tell: of trackers, and of phones that write time codes."""

RATES = (24, 25, 30, 50, 60, 100, 120)
"""Frames per second that a time code may count."""


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
    - JSON (.json): a list of frames, or an object that holds one. A frame has weights by name, and maybe a `timestamp`;
      or it is a result of MediaPipe's face landmarker in a browser (`faceBlendshapes`, and
      `facialTransformationMatrixes` that turn the head).

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
        table = (of_json if path.suffix.lower() == ".json" else of_table)(path, text_of(path))
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
            f"{file} has no column of a shape: ARKit's names are needed, such as jawOpen, or action units; received "
            f"{_listed(table.names)}."
        )
    if unknown:
        warn(f"{file}: {len(unknown)} columns are not shapes and are ignored: {_listed(unknown)}.")
    weights = np.stack(list(columns.values()), axis=1)
    times = _times(table.times, len(weights), file, fps)
    seen = np.asarray(~np.isnan(weights).any(axis=1))
    if not seen.any():
        raise ParameterError(f"{file} has no frame with a weight for each of its shapes. Record it again.")
    if not seen.all():
        warn(f"{file}: {int((~seen).sum())} of {len(seen)} frames lack values; their neighbors are used.")
    fresh = seen & np.concatenate([[True], np.diff(np.maximum.accumulate(times)) > 0.0])
    times, head = times[fresh], None
    plain = [plain_name(name) for name in table.names]
    if set(HEAD) <= set(plain):
        turns = table.values[np.ix_(fresh, [plain.index(name) for name in HEAD])]
        known = ~np.isnan(turns).any(axis=1)
        if known.any():
            head = np.stack([np.interp(times, times[known], np.unwrap(angle[known])) for angle in turns.T], axis=1)
    return Take(tuple(columns), times - times[0], weights[fresh], head)


def _times(given: Sequence[str] | None, n: int, file: str, fps: float | None) -> Array:
    """Return the seconds (n,) of rows."""
    if given is None:
        return np.arange(n) / (fps or FPS)
    codes = [re.fullmatch(r"(\d+):(\d+):(\d+)[:;.](\d+(?:\.\d+)?)", text) for text in given]
    if all(codes):
        parts = np.array([[_bounded(x, file) for x in code.groups()] for code in codes if code])
        most = int(parts[:, 3].max())
        within_second = (parts[:, :3] == parts[0, :3]).all()  # frames are not counted up to their rate
        counted = PHONE_FPS if within_second else next((each for each in RATES if each > most), most + 1)
        rate = fps or counted
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
    try:
        number = float(text)
    except ValueError:
        number = np.nan
    if not abs(number) < LARGEST:
        raise ParameterError(
            f"{file}: times must be seconds, or time codes such as 10:31:02:15.5, received {text[:40]!r}."
        )
    return number


def _listed(names: Iterable[str], most: int = 8) -> str:
    every = list(names)
    return ", ".join(every[:most]) + (f" and {len(every) - most} more" if len(every) > most else "")
